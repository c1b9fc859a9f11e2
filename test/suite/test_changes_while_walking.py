# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters changed at run time, through the nodes' own services in real processes."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from plain_run import plain_run
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python
from ros_processes import RUN_S, SHARED_HZ, Processes, Ros

from dmp_cpg_ros.analysis.loading import load_recording

processes, ros, ros_domain = (
    ros_processes.processes, ros_processes.ros, ros_processes.ros_domain)

OVERRIDES = {'physics': 'perfect_tracking', 'coupling_gain': 30.0, 'control_rate': SHARED_HZ}
"""Couplings that are strong enough all-to-all, and would not be on a path."""

REFUSED = """\
  - {at: 1.1, set: {cadence_scale: 3.0}}
  - {at: 1.2, set: {inhibition_gain: 100}}
  - {at: 1.3, set: {coupling_graph: path}}
  - {at: 1.3, set: {coupling_gain: 20.0, coupling_graph: path}}
"""

SCENARIO = """\
name: changes
duration: 4.0
events:
  - {{at: 0.1, inhibit: false}}
  - {{at: 0.1, command: {{v_x: 0.4}}}}
{refused}\
  - {{at: 1.6, set: {{cadence_scale: 1.1, rho: 10, coupling_graph: ring}}}}
  - {{at: 1.8, set: {{max_speed: 0.3, alpha_r: 4.0, braking: 2.0}}}}
  - {{at: 2.0, set: {{inhibition_gain: 600, inhibited_legs: [{leg}]}}}}
  - {{at: 2.4, inhibit: true}}
"""


@pytest.mark.parametrize(('leg', 'shared'), [
    ('rr', '--composed'), ('auto', '--processes=blocks')])
def test_the_robot_walks_on_when_a_change_is_refused_and_when_it_is_accepted(
    processes: Processes, tmp_path: Path, leg: str, shared: str
) -> None:
    plain = tmp_path / 'plain.yaml'
    plain.write_text(SCENARIO.format(refused='', leg=leg), encoding='utf-8')
    settings = [item for name, value in OVERRIDES.items()
                for item in ('--set', f'{name}:={value}')]
    process = processes.walk(SCENARIO.format(refused=REFUSED, leg=leg), tmp_path / 'run',
                             '--lock-step', shared, *settings)
    assert process.wait(RUN_S) == 0, str(process)
    said = process.output
    assert 'walk: 4 of 10 events were refused' in said, said
    refusals = re.findall(r'refused: (.*)', said)
    assert len(refusals) == 4, said
    assert said.count('accepted') == 3, said
    for refusal, words in zip(refusals, [
        (r'capture: N omega r/r0 made exact = \S+ 1/s is not < k_inh = 400 1/s',
         r'nearest value that works: cadence_scale = [12]\.\d+'),
        (r'capture: .* is not < k_inh = 100 1/s',
         r'nearest value that works: inhibition_gain = \d+'),
        (r'contraction: .* is not < connectivity of L_K \+ k_inh E = \S+ 1/s',
         r'what works: coupling_graph = all_to_all or ring'),
        ('contraction: ', 'coupling_graph'),
    ], strict=True):
        for pattern in words:
            assert re.search(pattern, refusal), refusal

    recording, (_, ticks) = load_recording(tmp_path / 'run' / 'bag'), plain_run(
        plain, **OVERRIDES)
    assert ticks[-1].supervisor.state == 'at_rest'
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])
    np.testing.assert_array_equal(recording.canonical.x_dot, [tick.x_dot for tick in ticks])
    for name in ('position', 'velocity', 'effort'):
        np.testing.assert_array_equal(
            getattr(recording.targets, name), [getattr(tick.targets, name) for tick in ticks])


LOST = """\
name: lost
duration: 1.2
parameters: {allow_uncertified: true}
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.4}}
  - {at: 0.8, set: {inhibition_gain: 40.0}}
"""


def test_a_change_that_costs_the_certificate_is_told_at_once_and_at_the_end(
    processes: Processes, tmp_path: Path
) -> None:
    process = processes.walk(LOST, tmp_path / 'run', '--lock-step', '--composed',
                             '--rate', str(SHARED_HZ))
    assert process.wait(RUN_S) == 0, str(process)
    told = [(event.values['certified'], event.time)
            for event in load_recording(tmp_path / 'run' / 'bag').inhibition]
    assert told[-1] == ('false', pytest.approx(0.8, abs=1.5 / SHARED_HZ))
    assert [certified for certified, _ in told[:-1]] == ['true'] * (len(told) - 1)
    assert '[ok] The certificate of the parameters at the start holds' in process.output
    assert ('[NO] The certificate held whatever was changed: it failed from '
            f'{told[-1][1]:.2f} s on') in process.output


HANDED_OVER = """\
name: handed_over
duration: 6.5
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.4}}
  - {at: 1.0, set: {max_speed: 0.4, max_lateral_speed: 0.0, max_turn_rate: 0.0}}
  - {at: 1.5, set: {inhibition_gain: 328.0}}
  - {at: 2.0, gait: amble}
  - {at: 2.0, set: {max_speed: 3.5}}
  - {at: 2.0, set: {inhibition_gain: 250.0}}
  - {at: 2.1, set: {max_speed: 3.5}}
  - {at: 2.1, set: {inhibition_gain: 250.0}}
  - {at: 4.5, set: {max_speed: 3.5}}
  - {at: 4.5, set: {inhibition_gain: 250.0}}
  - {at: 4.8, inhibit: true}
"""


def test_no_node_accepts_what_the_gait_that_is_still_walked_does_not_bear(
    processes: Processes, tmp_path: Path
) -> None:
    settings = {'physics': 'perfect_tracking', 'gait': 'bound', 'control_rate': SHARED_HZ}
    process = processes.walk(
        HANDED_OVER, tmp_path / 'run', '--lock-step', '--processes=each', *(
            item for name, value in settings.items() for item in ('--set', f'{name}:={value}')))
    assert process.wait(RUN_S) == 0, str(process)
    refusals = re.findall(r'refused: (.*)', process.output)
    assert len(refusals) == 4 and process.output.count('accepted') == 5, process.output
    for refusal in refusals:
        assert re.search('changes among .* not certified: capture.*; ask again when', refusal)
    plain = tmp_path / 'plain.yaml'
    plain.write_text(HANDED_OVER, encoding='utf-8')
    recording, (_, ticks) = load_recording(tmp_path / 'run' / 'bag'), plain_run(plain, **settings)
    assert ticks[-1].supervisor.state == 'at_rest'
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])


SEVERAL = """\
name: several
duration: 13.0
parameters: {auto_delay: 0.2, gait_change_rate: 0.5}
events:
  - {at: 0.1, command: {v_x: 0.4}}
  - {at: 0.1, inhibit: false}
  - {at: 1.0, set: {max_speed: 0.2}}
  - {at: 1.0, command: {v_x: 0.5}}
  - {at: 1.5, set: {alpha_r: 1.5}}
  - {at: 1.5, inhibit: true}
  - {at: 4.0, set: {max_speed: 0.5, alpha_r: 4.0}}
  - {at: 4.0, inhibit: false}
  - {at: 5.0, command: {v_x: 0.3}}
  - {at: 5.0, inhibit: true}
  - {at: 5.0, inhibit: false}
  - {at: 5.0, command: silence}
  - {at: 5.74, set: {alpha_r: 2.0}}
  - {at: 8.0, set: {alpha_r: 4.0}}
  - {at: 8.0, command: {v_x: 0.04}}
  - {at: 9.0, inhibit: true}
  - {at: 9.0, command: {v_x: 0.5}}
  - {at: 10.0, command: {v_x: 0.1}}
  - {at: 10.0, inhibit: false}
  - {at: 11.32, inhibit: true}
  - {at: 11.32, gait: pace}
"""


def test_several_changes_and_requests_within_a_tick_act_as_they_are_predicted(
    processes: Processes, tmp_path: Path
) -> None:
    settings = {'physics': 'perfect_tracking', 'control_rate': SHARED_HZ}
    process = processes.walk(
        SEVERAL, tmp_path / 'run', '--lock-step', '--composed', *(
            item for name, value in settings.items() for item in ('--set', f'{name}:={value}')))
    assert process.wait(RUN_S) == 0, str(process)
    metrics = json.loads((tmp_path / 'run' / 'metrics.json').read_text(encoding='utf-8'))
    recording = load_recording(tmp_path / 'run' / 'bag')
    for kind, count in (('stop', 4), ('start', 4)):
        entries = [entry for entry in metrics[kind]['all'] if not entry['overruled']]
        assert len(entries) == count, metrics[kind]
        for entry in entries:
            assert entry['measured_s'] == pytest.approx(entry['predicted_s'], abs=1e-9), entry
            assert entry['measured_s'] <= entry['bound_s'], entry
            if kind == 'stop':
                of, since = recording.reference, entry['request_s']
                taken = (of.time > since) & (of.time <= since + entry['measured_s'])
                way = np.hypot(*of.value[taken, :2].T).sum() / SHARED_HZ
                assert way <= entry['distance_bound_m'], entry
    for log in (tmp_path / 'run' / 'logs').iterdir():
        assert 'was to rest by' not in log.read_text(encoding='utf-8')
    plain = tmp_path / 'plain.yaml'
    plain.write_text(SEVERAL, encoding='utf-8')
    _, ticks = plain_run(plain, **settings)
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])


def set_parameters(ros: Ros, node: str, **values: Any) -> Any:
    """``ros2 param set``: the result of the first parameter."""
    request = SetParameters.Request(parameters=[
        Parameter(name, value=value).to_parameter_msg() for name, value in values.items()])
    return ros.call(SetParameters, f'{node}/set_parameters', request).results[0]


def get_parameter(ros: Ros, node: str, name: str) -> Any:
    answer = ros.call(GetParameters, f'{node}/get_parameters',
                      GetParameters.Request(names=[name]))
    return parameter_value_to_python(answer.values[0])


def test_each_node_guards_its_own_parameters_and_follows_the_others(
    processes: Processes, ros: Ros
) -> None:
    canonical = processes.node('canonical_oscillators')
    inhibition = processes.node('inhibition')
    owner, other = 'canonical_oscillators', 'inhibition'
    for values, words in [
        ({'cadence_scale': 3.0}, ('capture', 'is not <', 'k_inh = 400', 'cadence_scale = 1.98')),
        ({'cadence_scale': 9.0}, ('range',)),
        ({'cadence_scale': 'fast'}, ('Wrong parameter type', 'DOUBLE')),
        ({'coupling_graph': 'chain'}, ('all_to_all, ring',)),
        ({'inhibition_gain': 500.0},
         ('belongs to inhibition', 'param set /inhibition inhibition_gain 500.0')),
        ({'control_rate': 100.0}, ('read-only',)),
    ]:
        result = set_parameters(ros, owner, **values)
        assert not result.successful
        for word in words:
            assert word in result.reason, result.reason
    assert get_parameter(ros, owner, 'cadence_scale') == 1.0

    assert set_parameters(ros, other, inhibition_gain=1500.0).successful
    ros.spin_until(lambda: get_parameter(ros, owner, 'inhibition_gain') == 1500.0)
    assert set_parameters(ros, owner, cadence_scale=3.0).successful
    ros.spin_until(lambda: get_parameter(ros, other, 'cadence_scale') == 3.0)
    lowered = set_parameters(ros, other, inhibition_gain=400.0)
    assert not lowered.successful
    assert 'k_inh = 400' in lowered.reason

    diagnostics: list[DiagnosticArray] = ros.collect(DiagnosticArray, '/diagnostics')
    both = [Parameter('allow_uncertified', value=True), Parameter('inhibition_gain', value=400.0)]
    answer = ros.call(
        SetParametersAtomically, f'{other}/set_parameters_atomically',
        SetParametersAtomically.Request(parameters=[entry.to_parameter_msg() for entry in both]))
    assert answer.result.successful, answer.result.reason

    def alarmed(node: str) -> bool:
        return any(status.name == node and status.level == DiagnosticStatus.ERROR
                   and 'WITHOUT a certificate' in status.message and 'capture' in status.message
                   for message in diagnostics for status in message.status)

    ros.spin_until(lambda: alarmed(other) and alarmed(owner))
    for process in (canonical, inhibition):
        process.interrupt()
        assert process.wait() == 0, str(process)
        assert 'Traceback' not in process.output, process


def test_before_it_is_configured_a_node_takes_what_is_in_range(
    processes: Processes, ros: Ros
) -> None:
    processes.node('reference_filter', autostart=False)
    assert set_parameters(ros, 'reference_filter', alpha_r=0.05).successful
    assert not set_parameters(ros, 'reference_filter', alpha_r=-1.0).successful
