# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite as its users run it: real nodes in real processes over DDS, the service, the bag."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
from pathlib import Path

import numpy as np
import pytest

from dmp_cpg_ros.core.gait.known_gaits import shares_of

pytest.importorskip('rclpy')

import ros_processes
from plain_run import plain_run
from ros_processes import RUN_S, SHARED_HZ, Processes, reserved_domain

from dmp_cpg_ros.analysis.bag import opened, payload_digests
from dmp_cpg_ros.analysis.loading import load_recording

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

SCENARIO = """\
name: short
duration: 5.0
events:
  - {at: 0.2, inhibit: false}
  - {at: 0.2, command: {v_x: 0.5, gamma: 0.1}}
  - {at: 1.0, gait: trot}
  - {at: 1.5, push: {impulse: [1, 4, 0], duration: 0.15}}
  - {at: 1.8, command: {v_x: 1.6, gamma: 0.1}}   # more than a walk can do
  - {at: 1.9, gait: walk}
  - {at: 2.0, inhibit: true}
  - {at: 3.9, gait: pace}
  - {at: 4.4, inhibit: false}
"""

IN_REAL_TIME = """\
name: in_real_time
duration: 6.0
events:
  - {at: 0.2, inhibit: false}
  - {at: 0.2, command: {v_x: 0.5, gamma: 0.1}}
  - {at: 1.5, inhibit: true}    # heard late on a busy machine, and then the body may step first
  - {at: 5.5, inhibit: false}
"""

ON_BLOCKS = """\
name: blocks
duration: 3.9
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.5}}
  - {at: 2.5, inhibit: true}
"""

PUSHED = """\
name: pushed
duration: 6.5
events:
  - {at: 0.4, push: {impulse: [0, -10.7, 0]}}
  - {at: 2.2, push: {impulse: [0, 8, 0], duration: 0.2}}
  - {at: 3.0, inhibit: false}
  - {at: 3.0, command: {v_x: 0.8}}
  - {at: 4.5, push: {impulse: [0, 8, 0]}}
  - {at: 4.75, inhibit: true}
"""

LEADING = """\
name: leading
duration: 2.0
parameters: {target_lead: 0.02}
events:
  - {at: 0.3, inhibit: false}
  - {at: 0.3, command: {v_x: 0.8}}
"""

COMMANDED = """\
name: commanded
duration: 1.5
events:
  - {at: 0.2, inhibit: false}
  - {at: 0.2, command: {v_x: 0.5, gamma: 0.1}}
"""

WITH_CONTACTS = {'contact_feedback': True}
"""All that listens to the feet."""

TICK_NS = 4_000_000

@pytest.fixture(scope='module')
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('scenario') / 'short.yaml'
    path.write_text(SCENARIO, encoding='utf-8')
    return path


def test_lock_step_runs_agree_bit_for_bit_however_they_are_run(
    scenario: Path, tmp_path: Path
) -> None:
    # All three at once on one processor: each is the load under which the others run.
    started, kinds = [], {'processes': (), 'composed': ('--composed',),
                          'blocks': ('--processes', 'blocks')}
    with contextlib.ExitStack() as domains:
        for name, options in kinds.items():
            own = Processes(domains.enter_context(reserved_domain()))
            domains.callback(own.end)
            started.append(own.walk(scenario, tmp_path / name, '--lock-step',
                                      '--rate', str(SHARED_HZ), *options))
            os.sched_setaffinity(started[-1].pid, {min(os.sched_getaffinity(0))})
        for process in started:
            assert process.wait(3.0 * RUN_S) == 0, str(process)
    first, composed, blocks = (tmp_path / name for name in kinds)
    digests = payload_digests(first / 'bag')
    assert {
        'joint_states',
        'canonical_state',
        *(f'joint_targets/{leg}' for leg in ('fl', 'fr', 'rl', 'rr')),
    } <= set(digests)
    assert payload_digests(composed / 'bag') == digests
    assert payload_digests(blocks / 'bag') == digests
    manifest = json.loads((first / 'manifest.json').read_text(encoding='utf-8'))
    assert manifest['digests'] == digests
    for run in (first, composed, blocks):
        counts = load_recording(run / 'bag').counts
        assert counts['/inhibition_gains'] == counts['/canonical_state'], run.name

    recording, (states, ticks) = load_recording(first / 'bag'), plain_run(
        scenario, control_rate=SHARED_HZ)
    assert len(recording.joints.time) == len(ticks) == round(5.0 * SHARED_HZ)
    np.testing.assert_array_equal(
        recording.joints.position, [state.joint_position for state in states[:-1]]
    )
    np.testing.assert_array_equal(
        recording.joints.velocity, [state.joint_velocity for state in states[:-1]]
    )
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])
    assert list(recording.canonical.gaits) == [shares_of(tick.gait) for tick in ticks]
    changes = {(gait.before, gait.after) for gait in recording.canonical.gaits}
    assert {('amble', ''), ('trot', ''), ('pace', ''), ('trot', 'walk')} <= changes
    np.testing.assert_array_equal(recording.canonical.x_dot, [tick.x_dot for tick in ticks])
    np.testing.assert_array_equal(
        recording.targets.effort, [tick.targets.effort for tick in ticks]
    )

    np.testing.assert_array_equal(
        recording.work.work, [state.joint_work for state in states[:-1:10]]
    )
    assert not any('mujoco_robot/' in topic for topic in recording.counts)  # the gate's

    metrics = json.loads((first / 'metrics.json').read_text(encoding='utf-8'))
    assert metrics['robot']['fell'] is False
    assert metrics['robot']['cost_of_transport_from'] == 'joint_work'
    assert metrics['stop']['measured_s'] == pytest.approx(metrics['stop']['predicted_s'], abs=1e-6)


def test_nodes_let_targets_act_a_lead_after_their_stamp(
    processes: Processes, tmp_path: Path
) -> None:
    scenario = tmp_path / 'leading.yaml'
    scenario.write_text(LEADING, encoding='utf-8')
    run = processes.walked(scenario, tmp_path / 'run', '--lock-step', '--composed',
                           '--rate', str(SHARED_HZ))
    recording = load_recording(run / 'bag')
    (states, ticks), (at_once, _) = plain_run(scenario, control_rate=SHARED_HZ), plain_run(
        scenario, control_rate=SHARED_HZ, target_lead=0.0)
    joints = np.array([state.joint_position for state in states[:-1]])
    np.testing.assert_array_equal(recording.joints.position, joints)
    np.testing.assert_array_equal(recording.targets.position,
                                  [tick.targets.position for tick in ticks])
    assert not np.array_equal(joints, [state.joint_position for state in at_once[:-1]])


@pytest.mark.parametrize('in_file', [False, True])
def test_a_suite_whose_commands_are_stamped_walks_as_another(
    processes: Processes, tmp_path: Path, in_file: bool
) -> None:
    scenario, parameters = tmp_path / 'commanded.yaml', tmp_path / 'stamped.yaml'
    scenario.write_text(COMMANDED, encoding='utf-8')
    parameters.write_text('/**: {ros__parameters: {stamped_cmd_vel: true}}', encoding='utf-8')
    given = (('--parameters', str(parameters)) if in_file else ('--set', 'stamped_cmd_vel:=true'))
    run = processes.walked(scenario, tmp_path / 'run', '--lock-step', '--composed',
                           '--rate', str(SHARED_HZ), *given)
    recording, (_, ticks) = load_recording(run / 'bag'), plain_run(
        scenario, control_rate=SHARED_HZ)
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])
    np.testing.assert_array_equal(recording.reference.value, [tick.r for tick in ticks])
    np.testing.assert_array_equal(np.unique(recording.commands.value, axis=0), [[0.5, 0.0, 0.1]])


def test_nodes_answer_pushes_as_the_plain_loop_does(
    processes: Processes, tmp_path: Path
) -> None:
    scenario = tmp_path / 'pushed.yaml'
    scenario.write_text(PUSHED, encoding='utf-8')
    run = processes.walked(scenario, tmp_path / 'run', '--lock-step', '--composed',
                           '--rate', str(SHARED_HZ))
    recording, (states, ticks) = load_recording(run / 'bag'), plain_run(
        scenario, control_rate=SHARED_HZ)
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])
    np.testing.assert_array_equal(recording.reference.value, [tick.r for tick in ticks])
    np.testing.assert_array_equal(
        recording.joints.position, [state.joint_position for state in states[:-1]])
    assert recording.counts['/inhibition_gains'] == recording.counts['/canonical_state']
    least = min(tick.supervisor.share for tick in ticks)
    assert least < 1.0 and all(
        tick.supervisor.share == 1.0 for tick in ticks if tick.supervisor.in_force)
    words = [(event.message, event.values['pushed']) for event in recording.inhibition]
    assert {('releasing', 'true'), ('stepping', 'true'), ('waiting', 'false')} <= set(words)
    assert all(event.values['requested'] == 'true' for event in recording.inhibition
               if event.time < 3.0)
    for event in recording.inhibition:
        measured, bound = event.number('measured_s'), event.number('bound_s')
        if event.message == 'stepping' or (event.message == 'at_rest' and measured):
            assert measured == pytest.approx(event.number('predicted_s'), abs=1e-6)
            assert measured <= bound


def test_contacts_reach_the_nodes_at_the_tick_at_which_they_are_measured(
    processes: Processes, tmp_path: Path
) -> None:
    scenario = tmp_path / 'blocks.yaml'
    scenario.write_text(ON_BLOCKS, encoding='utf-8')
    world = {'world': 'blocks', 'world_height': 0.03, 'world_seed': 4, 'control_rate': SHARED_HZ}
    values = {**world, **WITH_CONTACTS}
    options = [f'{name}:={str(value).lower()}' for name, value in values.items()]
    run = processes.walked(
        scenario, tmp_path / 'run', '--lock-step', '--processes', 'blocks',
        *(word for option in options for word in ('--set', option)))
    recording, (_, ticks) = load_recording(run / 'bag'), plain_run(scenario, **values)
    assert min(ticks[-1].feedback.level) < 0.0             # a foot hung at rest and went down
    np.testing.assert_array_equal(recording.canonical.x_dot, [tick.x_dot for tick in ticks])
    np.testing.assert_array_equal(
        recording.targets.position, [tick.targets.position for tick in ticks]
    )
    _, without = plain_run(scenario, **world)
    assert any(np.any(a.x_dot != b.x_dot) for a, b in zip(ticks, without, strict=True))


def test_real_time_run_stops_and_starts(processes: Processes, tmp_path: Path) -> None:
    run = processes.walked(IN_REAL_TIME, tmp_path / 'run', '--composed')
    _, end = load_recording(run / 'bag').span
    with opened(run / 'bag') as reader:
        # When the recorder ends, another topic of the robot may be a tick ahead of the joints.
        assert reader.start_time >= 0 and reader.end_time <= end * 1e9 + TICK_NS + 1
        told = [reader.deserialize(raw, of.msgtype) for of, _, raw in reader.messages(
            [of for of in reader.connections if of.topic == '/inhibition_gains'])]
    requested = [message.position[message.name.index('requested')] for message in told]
    turned = [message.header.stamp for message, now, before in zip(
        told[1:], requested[1:], requested, strict=False) if now != before]
    metrics = json.loads((run / 'metrics.json').read_text(encoding='utf-8'))
    assert metrics['robot']['fell'] is False
    # A robot whose controllers starve may have stood by itself before.
    assert metrics['stop']['completed'] >= 1 and metrics['start']['completed'] >= 1
    # A request is told before it is predicted, which takes ticks.
    asked = {round(entry['request_s'], 6)
             for of in ('stop', 'start') for entry in metrics[of]['all']}
    assert len(turned) >= 2 and asked.issuperset(
        round(stamp.sec + 1e-9 * stamp.nanosec, 6) for stamp in turned)
    for name in (
        'rate_hz',
        'real_time_factor',
        'latency_ms_p50',
        'latency_ms_p99',
        'deadline_misses',
    ):
        assert metrics['timing'][name] is not None


def test_a_dead_node_ends_the_run_and_is_named(
    processes: Processes, scenario: Path, tmp_path: Path
) -> None:
    process = processes.walk(scenario, tmp_path / 'run', '--lock-step', '--rate', str(SHARED_HZ))
    process.wait_for_output('walking', RUN_S)
    os.kill(process.pid_of('leg_transformation_fr'), signal.SIGKILL)
    assert process.wait(RUN_S) == 1
    assert re.search(r'leg_transformation_fr was ended by signal 9', process.output), process
    assert len(load_recording(tmp_path / 'run' / 'bag').joints.time) >= 0.2 * SHARED_HZ


@pytest.mark.parametrize(('options', 'made'), [((), 'report'), (('--no-report',), 'metrics')])
def test_ctrl_c_ends_the_run_with_a_readable_bag(
    processes: Processes, scenario: Path, tmp_path: Path, options: tuple[str, ...], made: str
) -> None:
    process = processes.executable('walk', str(scenario), '--out', str(tmp_path / 'run'),
                                   '--lock-step', '--composed', '--rate', str(SHARED_HZ),
                                   *options)
    process.wait_for_output('walking', RUN_S)
    process.interrupt()
    process.wait_for_output(f'making the {made}, which a second Ctrl-C skips', RUN_S)
    process.interrupt()
    # Python itself ends by the signal when it came while it ran generated code.
    assert process.wait(RUN_S) in (130, -signal.SIGINT), process.output
    # or the work was done when the second signal came
    assert f'{made} skipped' in process.output or 'in all\n' in process.output, process
    assert 'Traceback' not in process.output, process
    assert len(load_recording(tmp_path / 'run' / 'bag').joints.time) >= 0.2 * SHARED_HZ


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (('no_such.yaml',), 'no_such.yaml'),
        (('start_stop.yaml', '--set', 'gait:=gallop'), 'valid are amble'),
        (('start_stop.yaml', '--set', 'rho:=.nan'), 'rho'),
        (('start_stop.yaml', '--set', 'cadence:=1'), "no parameter 'cadence'"),
        (('start_stop.yaml', '--rate', '333'), 'whole microseconds'),
        (('start_stop.yaml', '--robot', 'no_robot.yaml'), 'no_robot.yaml'),
    ],
)
def test_bad_input_is_refused_with_what_is_valid(
    processes: Processes, tmp_path: Path, arguments: tuple[str, ...], text: str
) -> None:
    process = processes.executable('walk', *arguments, '--out', str(tmp_path / 'run'))
    assert process.wait() == 2
    assert text in process.output
