# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Metrics find what was prescribed, and say nothing where nothing was recorded."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import pytest
from synthetic_walk import BELIEVED, MASS, SyntheticWalk, robot

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.metrics.summary import compute_metrics
from dmp_cpg_ros.analysis.motion import feet_in_base, foot_slip, rotations, shank_rate_in_base
from dmp_cpg_ros.analysis.recording import (
    FootForceSeries,
    JointSeries,
    OdometrySeries,
    Recording,
    StatusEvent,
    WorkSeries,
)
from dmp_cpg_ros.analysis.strict_json import to_json


def metrics_of(walk: SyntheticWalk, **changes: Any) -> dict[str, Any]:
    recording = dataclasses.replace(walk.recording(), **changes)
    return compute_metrics(recording, RunContext(robot(), walk.gait))


@pytest.fixture(scope='module')
def plain_metrics() -> dict[str, Any]:
    return metrics_of(SyntheticWalk())


def test_an_empty_recording_has_no_numbers() -> None:
    metrics = compute_metrics(Recording(), RunContext(robot()))
    flat = {**metrics['robot'], **metrics['gait'], **metrics['timing'], **metrics['estimation']}
    assert all(value is None for value in flat.values())
    assert metrics['stop'] | {'all': 0} == {
        'predicted_s': None,
        'bound_s': None,
        'measured_s': None,
        'count': 0,
        'completed': 0,
        'overruled': 0,
        'cut_off': 0,
        'all': 0,
    }
    assert json.loads(to_json(metrics)) == metrics


@pytest.mark.parametrize('topic', [field.name for field in dataclasses.fields(Recording)])
def test_every_topic_may_be_missing(topic: str) -> None:
    walk = SyntheticWalk(rate_hz=50.0)
    empty = getattr(Recording(), topic)
    metrics = metrics_of(walk, **{topic: empty})
    json.loads(to_json(metrics), parse_constant=pytest.fail)


def test_the_contract_names_every_number(plain_metrics: dict[str, Any]) -> None:
    for group, names in {
        'robot': 'fell distance_m yaw_drift_deg_per_10m cost_of_transport foot_slip_m',
        'tracking': 'v_rmse gamma_rmse',
        'gait': 'phase_error_rad_max duty_factor',
        'stop': 'predicted_s bound_s measured_s',
        'start': 'predicted_s bound_s measured_s',
        'timing': 'rate_hz real_time_factor latency_ms_p50 latency_ms_p99 deadline_misses',
    }.items():
        for name in names.split():
            assert plain_metrics[group][name] is not None, f'{group}.{name}'


def test_distance_is_that_of_the_path() -> None:
    walk = SyntheticWalk(turn_rate=0.3)
    _, _, speed = walk.body()
    distance = metrics_of(walk)['robot']['distance_m']
    assert distance == pytest.approx(speed.sum() / walk.rate_hz, rel=0.01)


def test_sway_is_no_distance() -> None:
    walk = SyntheticWalk()
    recording = walk.recording()
    odometry = recording.odometry
    sway = 0.03 * np.sin(2.0 * np.pi * walk.cadence_hz * odometry.time) * walk.walking()
    position = odometry.position_in_world + np.outer(sway, [0.0, 1.0, 0.0])
    swaying = dataclasses.replace(odometry, position_in_world=position)
    assert metrics_of(walk, odometry=swaying)['robot']['distance_m'] == pytest.approx(
        metrics_of(walk)['robot']['distance_m'], rel=0.02
    )


@pytest.mark.parametrize('drift_deg_per_m', [-0.8, 0.0, 0.3])
def test_yaw_drift_is_found(drift_deg_per_m: float) -> None:
    metrics = metrics_of(SyntheticWalk(yaw_drift_deg_per_m=drift_deg_per_m))
    assert metrics['robot']['yaw_drift_deg_per_10m'] == pytest.approx(
        10.0 * abs(drift_deg_per_m), rel=0.01, abs=1e-6
    )


def test_a_commanded_turn_is_no_drift() -> None:
    assert metrics_of(SyntheticWalk(turn_rate=0.5))['robot']['yaw_drift_deg_per_10m'] is None


@pytest.mark.parametrize('slip_speed', [0.0, 0.02])
def test_slip_is_found(slip_speed: float) -> None:
    walk = SyntheticWalk(slip_speed=slip_speed)
    stance, walking = walk.stance(), walk.walking()
    held = (stance[1:] & stance[:-1]) & walking[1:, None]
    expected = held.sum() * slip_speed / walk.rate_hz
    assert metrics_of(walk)['robot']['foot_slip_m'] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize('slip_speed', [0.0, 0.02])
def test_noise_of_the_joints_is_no_slip(slip_speed: float) -> None:
    walk = SyntheticWalk(slip_speed=slip_speed, rate_hz=250.0, end_s=9.0)
    exact = walk.recording().joints
    noise = np.random.default_rng(1).normal(0.0, 1e-3, exact.position.shape)
    noisy = dataclasses.replace(exact, position=exact.position + noise)
    slip, noisy_slip = (metrics_of(walk, joints=joints)['robot']['foot_slip_m']
                        for joints in (exact, noisy))
    way_of_noise = 0.41 * np.sqrt(2.0) * 1e-3 * len(walk.time) * 4
    assert noisy_slip - slip < 0.05 * way_of_noise


def test_slip_does_not_depend_on_the_heading() -> None:
    straight = metrics_of(SyntheticWalk(slip_speed=0.02))['robot']
    turned = metrics_of(SyntheticWalk(slip_speed=0.02, turn_rate=0.4))['robot']
    assert turned['foot_slip_m'] == pytest.approx(straight['foot_slip_m'], rel=1e-3)


def test_a_rolling_foot_does_not_slip() -> None:
    """The base moves just so that the shank, turning about y, rolls on its round foot."""
    radius, n = 0.03, 400
    leg = robot(radius).legs[0]
    time = np.linspace(0.0, 1.0, n)
    hip, knee = 0.4 * np.sin(2.0 * time), -0.9 + 0.2 * np.cos(3.0 * time)
    q = np.column_stack([np.zeros(n), hip, knee])
    q_dot = np.column_stack([np.zeros(n), 0.8 * np.cos(2.0 * time), -0.6 * np.sin(3.0 * time)])
    foot = feet_in_base(leg, q)
    rolled = radius * (hip + knee)  # [m] along x
    position = np.column_stack([rolled - foot[:, 0], np.zeros(n), radius - foot[:, 2]])
    recording = Recording(
        joints=JointSeries(time, np.tile(q, 4), np.tile(q_dot, 4), np.zeros((n, 12))),
        odometry=OdometrySeries(
            time,
            position,
            np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)),
            np.zeros((n, 3)),
            np.zeros((n, 3)),
        ),
        feet=FootForceSeries(time, np.tile([50.0, 0.0, 0.0, 0.0], (n, 1))),
    )
    slip = foot_slip(recording, robot(radius), 2.0)
    assert slip is not None
    assert slip[0] < 1e-4
    sliding = foot_slip(recording, robot(0.0), 2.0)
    assert sliding is not None
    assert sliding[0] == pytest.approx(np.abs(np.diff(rolled)).sum(), rel=1e-3)


def test_the_shank_turns_as_its_links_do() -> None:
    """Angular velocity against the difference quotient of the shank's rotation."""
    rng = np.random.default_rng(1)
    leg = dataclasses.replace(robot().legs[1], axis_sign=np.array([-1.0, 1.0, -1.0]))
    q, q_dot, h = rng.uniform(-1.0, 1.0, 3), rng.uniform(-1.0, 1.0, 3), 1e-6

    def shank(q: np.ndarray) -> np.ndarray:
        a, b = leg.axis_sign[0] * q[0], leg.axis_sign[1] * q[1] + leg.axis_sign[2] * q[2]
        return rotations(
            np.array(
                [
                    [
                        np.sin(a / 2) * np.cos(b / 2),
                        np.cos(a / 2) * np.sin(b / 2),
                        np.sin(a / 2) * np.sin(b / 2),
                        np.cos(a / 2) * np.cos(b / 2),
                    ]
                ]
            )
        )[0]

    spin = (shank(q + h * q_dot) - shank(q - h * q_dot)) / (2.0 * h) @ shank(q).T
    omega = shank_rate_in_base(leg, q[None], q_dot[None])[0]
    np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], omega, atol=1e-8)


@pytest.mark.parametrize('duty_factor', [0.6, 0.72])
def test_duty_factor_is_found(duty_factor: float) -> None:
    gait = metrics_of(SyntheticWalk(duty_factor=duty_factor))['gait']
    assert gait['duty_factor'] == pytest.approx(duty_factor, abs=0.02)
    assert gait['duty_factor_planned'] == pytest.approx(duty_factor)


def test_a_phase_error_is_found() -> None:
    error = np.array([0.0, 0.2, 0.0, 0.0])
    gait = metrics_of(SyntheticWalk(phase_offset_error=error))['gait']
    # relative to the circular mean of the four, which follows by about a quarter
    assert gait['phase_error_rad_max'] == pytest.approx(0.15, abs=0.002)


def test_without_a_gait_the_offsets_come_from_the_recording() -> None:
    walk = SyntheticWalk(phase_offset_error=np.array([0.0, 0.2, 0.0, 0.0]))
    metrics = compute_metrics(walk.recording(), RunContext(robot()))
    assert metrics['gait']['phase_error_rad_max'] < 1e-9


@pytest.mark.parametrize('ratio', [0.9, 1.0, 1.05])
def test_the_steady_speed_error_is_found(ratio: float) -> None:
    tracking = metrics_of(SyntheticWalk(speed_ratio=ratio))['tracking']
    assert tracking['steady']
    for entry in tracking['steady']:
        assert entry['v_error'] == pytest.approx(ratio - 1.0, abs=1e-3)
        assert entry['cycles'] == pytest.approx(
            (entry['end_s'] - entry['start_s']) * SyntheticWalk.cadence_hz, abs=0.05
        )
    assert tracking['v_error_max'] == pytest.approx(abs(ratio - 1.0), abs=1e-3)


def test_an_error_of_sidesteps_counts() -> None:
    walk = SyntheticWalk(speed_ratio=0.8)
    recording, aside = walk.recording(), [1, 0, 2]
    reference, odometry = recording.reference, recording.odometry
    tracking = metrics_of(
        walk, reference=dataclasses.replace(reference, value=reference.value[:, aside]),
        odometry=dataclasses.replace(
            odometry, velocity_in_base=odometry.velocity_in_base[:, aside]))['tracking']
    assert tracking['v_error_max'] == pytest.approx(0.2, abs=1e-3)


def test_perfect_tracking_has_no_error(plain_metrics: dict[str, Any]) -> None:
    assert plain_metrics['tracking']['v_rmse'] < 1e-12
    assert plain_metrics['tracking']['gamma_rmse'] < 1e-12


def test_ripple_counts_in_every_sample_but_not_over_a_cycle() -> None:
    walk = SyntheticWalk()
    odometry = walk.recording().odometry
    ripple = 0.05 * np.sin(2.0 * np.pi * walk.cadence_hz * odometry.time)
    velocity = odometry.velocity_in_base + np.outer(ripple, [1.0, 0.0, 0.0])
    tracking = metrics_of(walk, odometry=dataclasses.replace(odometry, velocity_in_base=velocity))[
        'tracking'
    ]
    assert tracking['v_rmse'] == pytest.approx(0.05 / np.sqrt(2.0), rel=0.02)
    assert tracking['v_rmse_cycle'] < 0.2 * tracking['v_rmse']


def test_cost_of_transport_is_work_over_weight_and_distance() -> None:
    walk = SyntheticWalk()
    recording = walk.recording()
    n = len(recording.joints.time)
    power = np.zeros((n, 12))
    power[:, 4], power[:, 7] = 20.0, -50.0  # the braking joint gives nothing back
    joints = dataclasses.replace(recording.joints, velocity=np.ones((n, 12)), effort=power)
    metrics = metrics_of(walk, joints=joints)['robot']
    duration = recording.joints.time[-1]
    assert metrics['cost_of_transport'] == pytest.approx(
        20.0 * duration / (MASS * 9.81 * metrics['distance_m']), rel=1e-6
    )


def test_work_that_the_robot_told_is_believed_rather_than_the_stamps() -> None:
    walk = SyntheticWalk()
    recording = walk.recording()
    n = len(recording.joints.time)
    joints = dataclasses.replace(
        recording.joints, velocity=np.ones((n, 12)), effort=np.full((n, 12), 20.0))
    told = np.zeros((2, 12))
    told[:, 3], told[:, 7] = (100.0, 160.0), (5.0, 45.0)
    work = WorkSeries(recording.joints.time[[0, -1]], told, np.full((2, 12), 25.0), 0.25 * told)
    metrics = metrics_of(walk, joints=joints, work=work)['robot']
    estimate = metrics_of(walk, joints=joints)['robot']
    assert metrics['cost_of_transport'] == pytest.approx(
        100.0 / (MASS * 9.81 * metrics['distance_m']), rel=1e-9)
    assert metrics['cost_without_joint_losses'] == pytest.approx(
        0.75 * metrics['cost_of_transport'], rel=1e-9)
    assert metrics['cost_of_transport_from'] == 'joint_work'
    assert estimate['cost_without_joint_losses'] is None
    assert estimate['cost_of_transport_from'] == 'joint_states'
    assert metrics['peak_torque_share'] == pytest.approx(1.25 * estimate['peak_torque_share'])
    for series, words in ((work, 'every physics step'), (WorkSeries(), 'estimated')):
        fact, = (fact for fact in facts(metrics_of(walk, joints=joints, work=series))
                 if fact.statement == 'Cost of transport')
        assert words in fact.finding


@pytest.mark.parametrize('falls_again', [False, True])
def test_a_recording_that_begins_after_a_fall_says_so(falls_again: bool) -> None:
    walk = SyntheticWalk()
    words = ['damped', 'recovering', 'standing'] + ['damped'] * falls_again
    modes = tuple(StatusEvent(0.1 * k, 0, word, {}) for k, word in enumerate(words))
    fact, = (fact for fact in facts(metrics_of(walk, modes=modes))
             if fact.statement == 'The robot stayed on its feet')
    assert 'down at the beginning' in fact.finding
    assert ('fell again' in fact.finding) == falls_again
    assert fact.holds is (False if falls_again else None)


@pytest.mark.parametrize('what', ['height', 'tilt'])
def test_a_fall_is_seen(what: str) -> None:
    walk = SyntheticWalk()
    odometry = walk.recording().odometry
    if what == 'height':
        position = odometry.position_in_world.copy()
        position[700:, 2] = 0.1
        fallen = dataclasses.replace(odometry, position_in_world=position)
    else:
        quaternion = odometry.quaternion.copy()
        quaternion[700:] = [np.sin(0.6), 0.0, 0.0, np.cos(0.6)]  # rolled by 1.2 rad
        fallen = dataclasses.replace(odometry, quaternion=quaternion)
    assert metrics_of(walk)['robot']['fell'] is False
    assert metrics_of(walk, odometry=fallen)['robot']['fell'] is True


def test_a_stop_is_reported_as_stated_and_as_the_body_did() -> None:
    walk = SyntheticWalk()
    stop = metrics_of(walk)['stop']
    assert (stop['count'], stop['completed']) == (1, 1)
    entry = stop['all'][0]
    assert entry['request_s'] == walk.stop_s
    assert stop['measured_s'] == entry['measured_s'] == walk.time_to_rest_s
    assert entry['feet_down_at_rest'] is True
    position, _, speed = walk.body()
    still = walk.time[walk.time >= walk.stop_s][
        np.flatnonzero(speed[walk.time >= walk.stop_s] < 0.01)[0]
    ]
    assert entry['body_still_after_s'] == pytest.approx(still - walk.stop_s, abs=0.02)
    request, rest = (
        round(walk.stop_s * walk.rate_hz),
        round((entry['rest_s'] + 0.5) * walk.rate_hz),
    )
    moved = np.linalg.norm(position[rest] - position[request])
    assert entry['displacement_m'] == pytest.approx(moved, abs=1e-3)


def test_a_lifted_foot_at_rest_is_seen() -> None:
    walk = SyntheticWalk()
    feet = walk.recording().feet
    force = feet.force.copy()
    force[round(11.0 * walk.rate_hz), 2] = 0.0
    entry = metrics_of(walk, feet=FootForceSeries(feet.time, force))['stop']['all'][0]
    assert entry['feet_down_at_rest'] is False
    assert entry['least_foot_force_n'] == 0.0


def test_a_stop_that_never_came_to_rest_counts_as_asked_only() -> None:
    walk = SyntheticWalk()
    events = tuple(event for event in walk.events() if event.message != 'at_rest')
    stop = metrics_of(walk, inhibition=events)['stop']
    assert (stop['count'], stop['completed'], stop['measured_s']) == (1, 0, None)


@pytest.mark.parametrize(('bound', 'cut_off', 'holds'), [(2.5, 1, None), (1.5, 0, False)])
def test_a_stop_that_the_recording_ends_within_its_bound_is_counted_apart(
        bound: float, cut_off: int, holds: bool | None) -> None:
    walk = SyntheticWalk()
    free, waiting, *_ = walk.events()
    last = walk.recording().span[1]
    asked = dataclasses.replace(waiting, time=last - 2.0, values={
        **waiting.values, 'request_stamp': repr(last - 2.0), 'bound_s': repr(bound)})
    metrics = metrics_of(walk, inhibition=(free, asked))
    told = {fact.statement: fact for fact in facts(metrics)}['Every stop came to rest']
    assert (metrics['stop']['cut_off'], told.holds) == (cut_off, holds)
    assert ('the recording ended during 1' in told.finding) == bool(cut_off)


def test_a_stop_that_another_request_ended_is_counted_apart() -> None:
    walk = SyntheticWalk()
    free, waiting, captured, at_rest, releasing, walking = walk.events()
    later = [dataclasses.replace(event, time=event.time + 3.0) for event in (
        waiting, captured, at_rest, releasing, walking)]
    metrics = metrics_of(walk, inhibition=(free, waiting, captured, releasing, walking, *later))
    stop, told = metrics['stop'], {fact.statement: fact for fact in facts(metrics)}
    assert (stop['count'], stop['completed'], stop['overruled']) == (2, 1, 1)
    assert [entry['overruled'] for entry in stop['all']] == [True, False]
    rested = told['Every stop came to rest']
    assert rested.holds and rested.finding == '1 of 1; another request or a push ended 1 before'
    metrics = metrics_of(walk, inhibition=(free, waiting, captured, releasing))
    told = {fact.statement: fact for fact in facts(metrics)}
    assert told['Every stop came to rest'].holds is None
    assert told['Every start led to walking'].holds is False  # the recording ended before


def test_a_stop_that_a_push_released_is_counted_apart() -> None:
    walk = SyntheticWalk()
    free, waiting, captured, at_rest, *_ = walk.events()
    pushed = dataclasses.replace(
        captured, message='stepping', values={**waiting.values, 'pushed': 'true'})
    again = [dataclasses.replace(event, time=event.time + 1.0) for event in (waiting, at_rest)]
    metrics = metrics_of(walk, inhibition=(free, waiting, pushed, *again))
    told = {fact.statement: fact for fact in facts(metrics)}['Every stop came to rest']
    assert told.holds and told.finding == '1 of 1; another request or a push ended 1 before'


def test_standing_before_the_first_start_is_no_stop() -> None:
    events = (StatusEvent(0.0, 0, 'at_rest', {}), *SyntheticWalk().events()[4:])
    metrics = metrics_of(SyntheticWalk(), inhibition=events)
    assert metrics['stop']['count'] == 0
    assert metrics['start']['count'] == 1


def test_a_start_that_was_interrupted_is_not_completed() -> None:
    events = (
        StatusEvent(0.0, 0, 'at_rest', {}),
        StatusEvent(1.0, 0, 'releasing', {}),
        StatusEvent(1.2, 0, 'waiting', {}),
        StatusEvent(2.0, 0, 'at_rest', {}),
        StatusEvent(3.0, 0, 'releasing', {}),
        StatusEvent(3.5, 0, 'walking', {}),
    )
    start = metrics_of(SyntheticWalk(), inhibition=events)['start']
    assert (start['count'], start['completed']) == (2, 1)
    assert start['measured_s'] == pytest.approx(0.5)


def test_timing_is_what_the_robot_said_last(plain_metrics: dict[str, Any]) -> None:
    statuses = SyntheticWalk().statuses()['mujoco_robot: timing']
    assert plain_metrics['timing']['latency_ms_p50'] == statuses[-1].number('latency_ms_p50')
    assert plain_metrics['timing']['deadline_misses'] == int(
        statuses[-1].values['deadline_misses']
    )


def test_numbers_that_are_not_finite_are_null_in_json() -> None:
    value = {
        'a': float('nan'),
        'b': [np.inf, np.float32(1.5)],
        'c': np.arange(2),
        'd': np.bool_(True),
    }
    assert json.loads(to_json(value)) == {'a': None, 'b': [None, 1.5], 'c': [0, 1], 'd': True}


def test_the_errors_of_the_estimate_are_those_that_were_put_in() -> None:
    walk = SyntheticWalk()
    recording = walk.recording()
    height = float(recording.odometry.position_in_world[0, 2]) + 0.004
    told = tuple(StatusEvent(time, 0, 'active', {'estimated_height_m': repr(height)})
                 for time in (1.0, 2.0, 3.0))
    found = metrics_of(walk, statuses={'posture_control': told})['estimation']
    for name, wrong in zip('xyz', BELIEVED['velocity'], strict=True):
        assert found[f'v_{name}_rmse'] == pytest.approx(abs(wrong))
    assert found['roll_rmse_deg'] == pytest.approx(0.0, abs=1e-6)
    assert found['pitch_rmse_deg'] == pytest.approx(np.rad2deg(BELIEVED['pitch']))
    time = recording.estimate.time
    drift = np.rad2deg(BELIEVED['yaw_rate'] * (time[-1] - time[0]))
    assert found['yaw_error_deg'] == pytest.approx(drift, rel=1e-6)
    way = recording.odometry.position_in_world[::5, :2]
    walked = np.hypot(*np.diff(way, axis=0).T).sum()
    assert found['yaw_error_deg_per_10m'] == pytest.approx(drift * 10.0 / walked, rel=1e-6)
    straight = np.hypot(*(way[-1] - way[0]))
    share = BELIEVED['position_share'] * straight / walked
    assert found['position_error_share'] == pytest.approx(share, rel=1e-6)
    assert found['height_rmse_m'] == pytest.approx(0.004, rel=1e-6)
