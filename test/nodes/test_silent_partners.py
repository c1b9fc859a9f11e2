# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes whose partners fall silent notice it on the robot's clock, and promise nothing."""

from __future__ import annotations

import time
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import ros_processes
from rclpy.parameter import Parameter
from ros_processes import Ros
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool

from dmp_cpg_ros.core.balance.body_command import BodyCommand
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.nodes import posture_control
from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.framework import gait_memory, parameter_follower
from dmp_cpg_ros.nodes.framework.judging import Later
from dmp_cpg_ros.nodes.framework.known_stop import BRIEF_NS, PATIENT_NS
from dmp_cpg_ros.nodes.framework.told_stop import HEARTBEAT_NS
from dmp_cpg_ros.nodes.framework.waiting_requests import PATIENCE_NS
from dmp_cpg_ros.nodes.inhibition import InhibitionNode
from dmp_cpg_ros.nodes.leg_transformation import AWAY_NS, FEEDBACK_NS, LegTransformation
from dmp_cpg_ros.nodes.messages.canonical_state import GaitMemoryWriter
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsReader, read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import BLIND_NS, SILENT_NS
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.nodes.mujoco_robot import MujocoRobotNode
from dmp_cpg_ros.nodes.posture_control import PostureControl
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.robot.target_watch import TargetWatch
from dmp_cpg_ros.suite import load_gaits, load_suite
from dmp_cpg_ros.suite_table import RETURN_S, ROBOT

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.model_reader import load_description

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain
SUITE = load_suite(None, {'cmd_vel_timeout': 0.0})
TICK = SUITE.tick_ns


def walked(ticks: int) -> tuple[WalkingLoop, RobotState, Any]:
    """A loop that may walk on, and its last state and tick."""
    loop, state, tick = walked_once(ticks)
    return deepcopy(loop), state, tick


@cache
def walked_once(ticks: int) -> tuple[WalkingLoop, RobotState, Any]:
    robot = PerfectTrackingRobot(load_description(SUITE.robot_file), TICK, 'standing')
    loop = WalkingLoop(robot.description, SUITE.gait, SUITE.parameters)
    state = robot.reset()
    loop.command(0.5)
    for _ in range(ticks):
        before, tick = state, loop.tick(state)
        state = robot.step(tick.targets)
    return loop, before, tick


def tick_at(node: InhibitionNode, state: RobotState, tick: Any, after_ns: int = 0) -> int:
    """Give a node one tick, some time [ns] after a state; return its stamp [ns]."""
    stamp = state.time_ns + after_ns
    node.health.stamp_ns = stamp
    node.on_tick(stamp, {
        'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r,
        'posture_feedback': ('standing', None, None)})
    return stamp


def watching(ros: Ros, *acting: tuple[str, int, Inhibition], wait_ns: int = PATIENT_NS,
             lock_step: bool = False, parameters: Sequence[Parameter] = ()
             ) -> tuple[InhibitionNode, int]:
    """A node that is started while the robot walks, with what others tell of the stop."""
    _, state, tick = walked(300)
    node = InhibitionNode('inhibition', context=ros.context, parameter_overrides=[
        Parameter('lock_step', value=lock_step), *parameters])
    node.start()
    node.certified.others.unheard.clear()  # nobody is there to tell parameters
    for who, stamp_ns, what in acting:
        node._others.hear(who, stamp_ns, what)
    tick_at(node, state, tick)
    return node, tick_at(node, state, tick, wait_ns)


RUNS = Inhibition(False, np.zeros(4), 0.3)
ACTS = Announced(RUNS)
KNOWN = ('acting_gains', 1_000_000_000, RUNS)
AT_FIRST = ('acting_gains', 0, Inhibition(True, np.zeros(4), 0.3, at_rest=True))
STOPPED = Inhibition(True, np.zeros(4), 0.3, automatic=False)


def test_while_nothing_is_known_of_the_gait_no_time_to_rest_is_promised(ros: Ros) -> None:
    node, now = watching(ros, KNOWN)
    assert not node._state.requested
    told, answer = node._take_request(SetBool.Request(data=True))
    assert told and 'at rest in' in answer
    node._take_request(SetBool.Request(data=False))
    node._watch(now + 200_000_000)
    assert not node.health.has_problem('blind')
    node._watch(now + 300_000_000)
    assert node.health.has_problem('blind') and node._state.state == 'waiting'
    for stop in (True, False):
        told, answer = node._take_request(SetBool.Request(data=stop))
        assert not told and 'from reference_filter' in answer and 'at rest in' not in answer
    node._watch(now + 10_000_000_000)
    assert node.health.has_problem('bound')
    node.destroy_node()


def test_a_stop_for_a_drive_that_looks_after_itself_is_predicted_whatever_is_commanded(ros: Ros
                                                                                       ) -> None:
    predicted = []
    for stops in (lambda node: node._take_request(SetBool.Request(data=True)),
                  lambda node: node._on_drive(String(data=DRIVE_MODES[1]))):
        node, _ = watching(ros, KNOWN)
        node._gate.accept(0.5, 0.0, 0.0)
        stops(node)
        assert node._state.requested
        predicted.append(node._promises.latest.predicted_s)
        node.destroy_node()
    assert abs(predicted[0] - predicted[1]) < 1.5e-9 * TICK  # which acts at once


@pytest.mark.parametrize('values', [{'alpha_r': 1.5}, {'caution': False}])
def test_a_change_in_a_stop_changes_what_is_promised_of_it(ros: Ros, values: dict[str, Any]
                                                            ) -> None:
    node, now = watching(ros, KNOWN)
    node._r = np.array([0.5, 0.0, 0.0])
    assert node._take_request(SetBool.Request(data=True))[0]
    told, due = node._promises.latest, node._promises.due_ns
    node.health.stamp_ns = node._state.time_ns
    node.parameter_changes.follow(values)
    node.take_parameters()
    assert node._promises.latest is told  # what it takes to predict must not delay a tick
    node._predict_what_is_new(node._state)
    later = node._promises.latest.predicted_s > told.predicted_s and node._promises.due_ns > due
    assert later == ('alpha_r' in values) and (later or node._promises.latest == told)
    node.destroy_node()


class Tasks:
    """An executor that runs its tasks when it is told to."""

    def __init__(self, node: InhibitionNode, monkeypatch: pytest.MonkeyPatch) -> None:
        self.waiting: list[Any] = []
        monkeypatch.setattr(type(node), 'executor', property(lambda _: self))

    def create_task(self, task: Any) -> None:
        self.waiting.append(task)

    def wake(self) -> None:
        """Nothing waits."""

    def run(self) -> int:
        count = 0
        while self.waiting:
            self.waiting.pop(0)()
            count += 1
        return count


def test_a_prediction_is_made_between_ticks_and_is_the_one_that_is_made_at_once(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    node, _ = watching(ros, KNOWN)
    expected = node._take_request(SetBool.Request(data=True))
    node.destroy_node()
    node, _ = watching(ros, KNOWN)
    _, state, tick = walked(300)
    tasks, answers = Tasks(node, monkeypatch), []
    node._take_request(SetBool.Request(data=True)).bound_for(answers.append)
    assert node._announced.latest.requested and not answers
    promise = node._promises.latest
    assert np.isnan(promise.predicted_s) and np.isfinite(promise.bound_s)
    tasks.waiting.pop(0)()
    tick_at(node, state, tick, PATIENT_NS + TICK)            # a tick comes meanwhile
    assert tasks.run() > 10
    assert answers == [expected]
    node.destroy_node()


def test_a_request_is_answered_where_it_cannot_be_predicted(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    def raising(*_: Any, **__: Any) -> Any:
        yield
        raise FloatingPointError('overflow')

    node, _ = watching(ros, KNOWN)
    tasks, answers = Tasks(node, monkeypatch), []
    with monkeypatch.context() as patch:
        patch.setattr('dmp_cpg_ros.nodes.framework.promise.looking_ahead', raising)
        node._take_request(SetBool.Request(data=True)).bound_for(answers.append)
        tasks.run()
    ((done, words),) = answers
    assert done and words == 'done; it could not be predicted: overflow'
    assert node._state.requested and np.isfinite(node._promises.latest.bound_s)
    assert node.health.rejected == {'prediction': 1}
    node._take_request(SetBool.Request(data=False)).bound_for(answers.append)
    tasks.run()
    assert answers[-1][0] and 'walking in' in answers[-1][1]  # the next one is predicted again
    node.destroy_node()
    monkeypatch.undo()  # without an executor, at once
    node, _ = watching(ros, KNOWN)
    monkeypatch.setattr('dmp_cpg_ros.nodes.framework.promise.looking_ahead', raising)
    assert node._take_request(SetBool.Request(data=True)) == (done, words)
    node.destroy_node()


def test_requests_that_overtake_a_prediction_are_all_answered(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    node, _ = watching(ros, KNOWN)
    tasks, answers = Tasks(node, monkeypatch), []
    for stop in (True, False, True):
        node._take_request(SetBool.Request(data=stop)).bound_for(answers.append)
    tasks.run()
    assert ['another request' in what for _, what in answers] == [True, True, False]
    assert all(accepted for accepted, _ in answers) and 'at rest in' in answers[2][1]
    node.destroy_node()


def test_a_restarted_node_keeps_a_stop_and_does_not_stop_a_gait(ros: Ros) -> None:
    for acting in (RUNS, STOPPED):
        node, _ = watching(ros, ('acting_gains', 1_000_000_000, acting))
        assert (node._state.requested, node._state.automatic) == (
            acting.requested, acting.automatic)
        node.destroy_node()
    node, _ = watching(ros)  # nobody knows: only the service starts
    assert node._state.requested and not node._state.automatic
    node.destroy_node()


@pytest.mark.parametrize('lock_step', [False, True])
def test_a_restarted_node_tells_nothing_of_the_stop_before_it_knows_it(
        ros: Ros, lock_step: bool) -> None:
    node, told = InhibitionNode(context=ros.context, parameter_overrides=[
        Parameter('lock_step', value=lock_step)]), []
    ros.nodes.append(node)
    node.trigger_configure()
    node.certified.others.unheard.clear()
    node._told._state_publisher.publish = told.append  # type: ignore[method-assign]
    node.trigger_activate()
    _, state, tick = walked(300)
    tick_at(node, state, tick)
    assert not node._joined and not told and not node.diagnostic_values()
    node._others.hear(*KNOWN)
    node._others.hear('kept_gains', *KNOWN[1:])
    stamp = tick_at(node, state, tick, TICK)
    assert read_state_word(told[0]) == node.diagnostic_values()['inhibition'] == 'walking'
    assert header_ns(told[0]) == stamp


def test_what_restarted_oscillators_do_not_know_does_not_end_a_stop(ros: Ros) -> None:
    """The robot may know of it, and its publishers are found seconds after theirs."""
    node, _ = watching(ros, AT_FIRST, wait_ns=PATIENT_NS - TICK)
    assert not node._joined  # neither the robot nor what it keeps is there
    node._others.hear('kept_gains', 1_000_000_000, STOPPED)
    _, state, tick = walked(300)
    tick_at(node, state, tick, PATIENT_NS - TICK)
    assert node._state.requested and not node._state.automatic
    node.destroy_node()
    node, _ = watching(ros, AT_FIRST)
    assert node._state.requested and not node._state.automatic
    node.destroy_node()


def test_in_lock_step_the_tick_waits_until_it_is_known_what_acts(ros: Ros) -> None:
    node, now = watching(ros, AT_FIRST, lock_step=True)  # no time but the clock's passes there
    node._try_again()
    assert not node._joined and node._state.time_ns < now
    node._others.hear('kept_gains', 1_000_000_000, STOPPED)
    node._try_again()
    assert node._joined and node._state.time_ns == now
    assert node._state.requested and not node._state.automatic
    node._try_again()  # once
    assert node._state.time_ns == now
    node.destroy_node()


def test_a_robot_that_cannot_tell_of_a_stop_is_not_waited_for(ros: Ros) -> None:
    robot = ros.node.create_publisher(JointState, 'joint_states', 1)
    ros.spin_until(lambda: ros.node.count_publishers('joint_states') == 1)
    node, _ = watching(ros, AT_FIRST, wait_ns=BRIEF_NS)
    assert node._state.requested and node._state.automatic
    node.destroy_node()
    ros.node.destroy_publisher(robot)


@pytest.mark.parametrize('stop', [True, False])
def test_what_is_asked_of_a_node_that_has_just_come_back_is_not_lost(
        ros: Ros, stop: bool) -> None:
    node, now = watching(ros, KNOWN, wait_ns=TICK)
    assert not node._joined
    accepted, answer = node._take_request(SetBool.Request(data=stop))
    assert accepted, answer
    _, state, tick = walked(300)
    tick_at(node, state, tick, now + TICK - state.time_ns)
    assert node._state.requested is stop
    node.destroy_node()


def test_the_gait_stops_while_the_robot_looks_after_itself(ros: Ros) -> None:
    node, _ = watching(ros, KNOWN)
    node._on_drive(String(data='lie'))
    assert node._state.requested and node._state.automatic
    told, answer = node._take_request(SetBool.Request(data=False))
    assert not told and 'looking after itself (lie), not standing; call stand_up' in answer
    node.destroy_node()


@pytest.mark.parametrize('then, words', [
    ('following', 'walking in'), ('damp', 'is damped, not standing; call recover'),
    ('stand', 'looking after itself (stand), not standing; ask again when it follows its legs'),
    ('inhibit', 'another request came before the robot followed its legs'),
    ('deactivate', 'inhibition was deactivated before the robot followed its legs')])
def test_a_start_waits_for_a_robot_that_stands_by_itself(
        ros: Ros, then: str, words: str) -> None:
    node, now = watching(ros, KNOWN)
    node._on_drive(String(data='stand'))
    answer, sent = node._take_request(SetBool.Request(data=False)), list[tuple[bool, str]]()
    assert isinstance(answer, Later)
    answer.bound_for(sent.append)
    node._watch(now + TICK)
    assert node._state.requested and not sent
    if then == 'inhibit':
        node._take_request(SetBool.Request(data=True))
    elif then == 'deactivate':
        node.trigger_deactivate()
    else:
        node._on_drive(String(data=then))
    if then == 'stand':
        node._watch(now + PATIENCE_NS + 2 * TICK)
    ros.spin_until(lambda: bool(sent))
    ((taken, text),) = sent
    assert taken is (then == 'following') and words in text
    assert node._state.requested is not taken
    node.destroy_node()


def test_reference_and_oscillators_stop_without_the_inhibition(ros: Ros) -> None:
    reference = ReferenceFilter('reference_filter', context=ros.context)
    canonical = CanonicalOscillators('canonical_oscillators', context=ros.context)
    for node in (reference, canonical):
        node.start()
    for age, silent in ((SILENT_NS, False), (SILENT_NS + TICK, True)):
        told = (0, ACTS)
        reference.on_tick(age, {'joint_states': None, 'inhibition_gains': told})
        canonical.on_tick(age, {'reference': np.zeros(3), 'inhibition_gains': told})
        assert reference._inhibition.requested == canonical._inhibition.requested == silent
        assert canonical.health.has_problem('inhibition') == silent
    told = (SILENT_NS + TICK, ACTS)
    canonical.on_tick(SILENT_NS + 2 * TICK, {
        'reference': np.zeros(3), 'inhibition_gains': told})
    assert not canonical._inhibition.requested
    for node in (reference, canonical):
        node.destroy_node()


RETURNS = [Parameter('return_time', value=RETURN_S)]
RETURN_NS = round(1e9 * RETURN_S)


def test_who_may_come_back_is_waited_for_before_the_gait_stops(ros: Ros) -> None:
    reference = ReferenceFilter('reference_filter', context=ros.context,
                                parameter_overrides=RETURNS)
    canonical = CanonicalOscillators('canonical_oscillators', context=ros.context,
                                     parameter_overrides=RETURNS)
    for node in (reference, canonical):
        ros.nodes.append(node)
        node.start()
    for age in (0, SILENT_NS + TICK, SILENT_NS + RETURN_NS, SILENT_NS + RETURN_NS + TICK):
        reference.on_tick(age, {'joint_states': None, 'inhibition_gains': (0, ACTS)})
        canonical.on_tick(age, {'reference': np.zeros(3), 'inhibition_gains': (0, ACTS)})
        silent = age > SILENT_NS + RETURN_NS
        assert reference._inhibition.requested == canonical._inhibition.requested == silent


def test_a_stop_that_is_asked_for_while_nothing_is_known_of_the_gait_acts_at_once(ros: Ros
                                                                                  ) -> None:
    node, now = watching(ros, KNOWN, parameters=RETURNS)
    node._watch(now + BLIND_NS + TICK)
    assert node.health.has_problem('blind') and not node._state.requested
    told: list[Any] = []
    node._told._gains_publisher.publish = told.append  # type: ignore[method-assign]
    accepted, answer = node._take_request(SetBool.Request(data=True))
    assert not accepted and 'no time to rest can be promised' in answer
    assert InhibitionGainsReader().read(told[-1]).requested
    node._state = replace(node._state, requested=False)
    node._watch(now + BLIND_NS + RETURN_NS)
    assert not node._state.requested
    node._watch(now + BLIND_NS + RETURN_NS + TICK)
    assert node._state.requested and node._state.automatic
    node.destroy_node()


@pytest.mark.parametrize('parameters', [[], RETURNS])
def test_the_gait_is_remembered_for_nodes_that_may_come_back(
        ros: Ros, parameters: list[Parameter]) -> None:
    node, _ = watching(ros, KNOWN, parameters=parameters)
    remembered: list[Any] = []
    if parameters:
        node._told._memory_publisher.publish = remembered.append  # type: ignore[method-assign]
    else:
        assert not hasattr(node._told, '_memory_publisher')
    _, state, tick = walked(300)
    for k in range(101):
        tick_at(node, state, tick, PATIENT_NS + k * TICK)
    assert len(remembered) == (4 if parameters else 0)
    node.destroy_node()


@pytest.mark.parametrize(('silent', 'goes_on'), [(150, True), (280, False)])
def test_oscillators_and_reference_that_come_back_in_time_go_on_in_phase(
        ros: Ros, silent: int, goes_on: bool) -> None:
    """As those would have that had not been away."""
    loop, before, tick = walked(750)
    robot = PerfectTrackingRobot(load_description(SUITE.robot_file), TICK, 'standing')
    canonical = CanonicalOscillators('canonical_oscillators', context=ros.context,
                                     parameter_overrides=RETURNS)
    reference = ReferenceFilter('reference_filter', context=ros.context,
                                parameter_overrides=RETURNS)
    message = GaitMemoryWriter(tuple(load_gaits())).fill(
        before.time_ns, tick.x, tick.x_dot, tick.gait, tick.r)
    state = robot.reset(before.time_ns)
    for _ in range(silent + 1):
        stamp, then = state.time_ns, loop.tick(state)
        state = robot.step(then.targets)
    for node, inputs in ((canonical, {'reference': then.r}), (reference, {'joint_states': None})):
        ros.nodes.append(node)
        node.start()
        sent: list[Any] = []
        node._publisher.publish = sent.append
        node.on_tick(stamp - 2 * TICK, {**inputs, 'inhibition_gains': (stamp, ACTS)})
        assert not sent  # the memory may come after the first tick
        node._memory._kept.append(message)
        node.on_tick(stamp - TICK, {**inputs, 'inhibition_gains': None})
        assert not sent  # without gains it would be at rest
        node.elapsed = 0.0
        node.on_tick(stamp, {**inputs, 'inhibition_gains': (stamp, ACTS)})
    off = np.abs(canonical._state.x - then.x).max()
    assert (off < 0.01 and np.allclose(reference._r, then.r, atol=1e-3)) if goes_on else (
        off > 0.1 and not reference._r.any())


@pytest.mark.parametrize(('gains', 'remembered', 'waited_ns'), [
    (ACTS, False, RETURN_NS), (Announced(STOPPED), False, gait_memory.PATIENT_NS),
    (None, False, gait_memory.PATIENT_NS), (None, True, RETURN_NS)])
def test_what_does_not_come_is_waited_for_longer_where_a_gait_goes_on(
        ros: Ros, gains: Announced | None, remembered: bool, waited_ns: int) -> None:
    reference, sent = ReferenceFilter(
        'reference_filter', context=ros.context, parameter_overrides=RETURNS), list[Any]()
    ros.nodes.append(reference)
    reference.start()
    reference._publisher.publish = sent.append  # type: ignore[method-assign]
    if remembered:
        _, before, tick = walked(10)
        reference._memory._kept.append(GaitMemoryWriter(tuple(load_gaits())).fill(
            before.time_ns, tick.x, tick.x_dot, tick.gait, tick.r))
    for stamp in range(TICK, 2 * RETURN_NS, TICK):
        reference.on_tick(stamp, {
            'joint_states': None, 'inhibition_gains': gains and (stamp, gains)})
        if sent:
            break
    assert stamp == TICK + waited_ns


@pytest.mark.parametrize('comes', [True, False])
def test_in_lock_step_the_first_tick_of_who_comes_back_waits_for_the_memory(
        ros: Ros, monkeypatch: pytest.MonkeyPatch, comes: bool) -> None:
    """It may be found later than what the tick goes by; who waits in vain goes on from zero.
    A tick of before it has been ended by all.
    """
    lock_step = [Parameter('lock_step', value=True)]
    reference, sent = ReferenceFilter(
        'reference_filter', context=ros.context, parameter_overrides=lock_step), list[Any]()
    ros.nodes.append(reference)
    reference.start()
    reference._publisher.publish = sent.append  # type: ignore[method-assign]
    loop, before, tick = walked(750)
    stamp = before.time_ns + TICK
    gains = (before.time_ns, ACTS)
    reference.on_tick(stamp, {'joint_states': None, 'inhibition_gains': gains})
    reference._memory._try_again()
    assert not sent
    if comes:
        reference._memory._hear(GaitMemoryWriter(tuple(load_gaits())).fill(
            before.time_ns, tick.x, tick.x_dot, tick.gait, tick.r))
        assert not sent  # nor does it know what the others have accepted
        assert reference._memory.awaited(before.time_ns - TICK, {}) and not sent
        assert reference._memory._held == (stamp, {'joint_states': None, 'inhibition_gains': None})
        reference.certified.others.unheard.clear()
        reference._memory._try_again()
        assert not sent  # nor what acts
        reference.inputs.add('inhibition_gains', before.time_ns, gains)
        reference._memory._try_again()
    else:
        later_s = time.monotonic() + gait_memory.LOCK_STEP_S
        monkeypatch.setattr(time, 'monotonic', lambda: later_s)
        reference._memory._try_again()
    assert len(sent) == 1 and header_ns(sent[0]) == stamp
    assert bool(reference._r.any()) is comes
    reference._memory._try_again()
    assert len(sent) == 1


def test_who_comes_back_asks_what_others_have_accepted_and_tells_what_it_has(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parameter_follower, 'ASK_EVERY_S', 600.0)
    partners = Parameter('expected_nodes', value=['reference_filter', 'canonical_oscillators'])

    def started(kind: Any, **values: float) -> Any:
        node = kind(kind.KIND, context=ros.context, parameter_overrides=[
            partners, *(Parameter(name, value=value) for name, value in values.items())])
        node.start()
        ros.executor.add_node(node)
        return node

    def knows(node: Any, name: str, value: float) -> bool:
        return bool(node.get_parameter(name).value == value)

    canonical = started(CanonicalOscillators, cadence_scale=0.9)
    for alpha_r in (2.0, 2.5):
        reference = started(ReferenceFilter, alpha_r=alpha_r)
        unknown = 'parameters of canonical_oscillators are not known'
        assert unknown in reference.missing()
        ros.spin_until(lambda node=reference: knows(node, 'cadence_scale', 0.9))
        ros.spin_until(lambda value=alpha_r: knows(canonical, 'alpha_r', value))
        assert unknown not in reference.missing()
        ros.executor.remove_node(reference)
        reference.close()
        reference.destroy_node()
    ros.executor.remove_node(canonical)
    canonical.destroy_node()


def test_gains_of_before_a_clock_that_was_set_back_are_those_of_a_silent_inhibition(ros: Ros
        ) -> None:
    reference = ReferenceFilter('reference_filter', context=ros.context)
    canonical = CanonicalOscillators('canonical_oscillators', context=ros.context)
    for node in (reference, canonical):
        node.start()
    for told_ns, silent in ((1_000_000_000_000, True), (TICK, False)):
        told = (told_ns, ACTS)
        reference.on_tick(2 * TICK, {'joint_states': None, 'inhibition_gains': told})
        canonical.on_tick(2 * TICK, {'reference': np.zeros(3), 'inhibition_gains': told})
        assert reference._inhibition.requested == canonical._inhibition.requested == silent
    for node in (reference, canonical):
        node.destroy_node()


def test_gains_and_promise_go_on_when_the_clock_is_set_back(ros: Ros) -> None:
    node, now = watching(ros, KNOWN)
    node._take_request(SetBool.Request(data=True))
    due_s = 1e-9 * (node._promises.due_ns - now)
    told: list[Any] = []
    node._told._gains_publisher.publish = told.append  # type: ignore[method-assign]
    _, state, tick = walked(300)
    for k in range(1, 60):
        tick_at(node, state, tick, k * TICK)
    passed = 59 * TICK // HEARTBEAT_NS
    assert len(told) > passed >= 2
    assert 1e-9 * (node._promises.due_ns - state.time_ns - TICK) == pytest.approx(due_s)
    node.destroy_node()


def test_what_acts_is_told_again_when_the_clock_is_set_back(ros: Ros) -> None:
    node = CanonicalOscillators('canonical_oscillators', context=ros.context)
    node.start()
    told: list[int] = []
    node._known._publisher.publish = (  # type: ignore[method-assign]
        lambda message: told.append(header_ns(message)))
    later = 1_000_000_000_000
    for stamp_ns, what in ((later, RUNS), (later - TICK, STOPPED), (2 * TICK, RUNS),
                           (3 * TICK, RUNS), (0, STOPPED), (4 * TICK, STOPPED)):
        node._known.learn(stamp_ns, what)
    assert told == [later, 2 * TICK, 4 * TICK]
    node.destroy_node()


@pytest.mark.parametrize('back_ns', [0, 1_000_000_000])
def test_a_restarted_node_does_not_wait_longer_for_a_clock_that_is_set_back(
        ros: Ros, back_ns: int) -> None:
    node, _ = watching(ros, wait_ns=TICK)
    now = node.health.stamp_ns - back_ns
    assert not node._others.have_told(now)
    assert node._others.have_told(now + PATIENT_NS)
    node.destroy_node()


def test_a_memory_that_cannot_be_read_costs_no_tick(ros: Ros) -> None:
    reference = ReferenceFilter('reference_filter', context=ros.context)
    canonical = CanonicalOscillators('canonical_oscillators', context=ros.context)
    for node, inputs in ((reference, {'joint_states': None}), (canonical, {
            'reference': np.zeros(3)})):
        node.start()
        node._memory._kept.append(JointState(name=['nobody']))
        node.on_tick(TICK, {**inputs, 'inhibition_gains': (TICK, ACTS)})
        assert node.health.rejected['gait_memory'] == 1
        assert 'gait_memory' not in [topic.name for topic, _ in node._inputs]
        node.destroy_node()


def test_a_leg_without_feedback_of_the_posture_says_nothing(ros: Ros) -> None:
    _, state, tick = walked(10)
    leg, sent = LegTransformation('leg_transformation_fl', context=ros.context), []
    leg.start()
    leg._publisher.publish = sent.append  # type: ignore[method-assign]
    for age, silent in ((15 * TICK, False), (16 * TICK, True), (TICK, False)):
        sent.clear()
        leg.on_tick(state.time_ns, {
            'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r,
            'posture_feedback': (state.time_ns - age, tick.feedback)})
        assert bool(sent) != silent and leg.health.has_problem('feedback') == silent
    leg.destroy_node()


def test_a_leg_that_was_without_feedback_on_the_way_up_goes_on_from_where_its_joints_are(
        ros: Ros) -> None:
    """The robot has lowered itself meanwhile, and follows only what rests where it is."""
    _, state, tick = walked(10)
    leg, sent = LegTransformation('leg_transformation_fl', context=ros.context), []
    ros.nodes.append(leg)
    leg.start()
    leg._writer.fill = lambda _, targets: sent.append(targets.position)
    leg._publisher.publish = str
    high, low = tick.feedback.measured, [angle + 0.4 for angle in tick.feedback.measured]
    leg.elapsed = 0.0
    for measured, age in ((high, 0), (high, 16 * TICK), (low, 0)):
        feedback = replace(tick.feedback, measured=measured, command=BodyCommand(
            'rising', 'rise', 0.5))
        leg.on_tick(state.time_ns, {
            'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r,
            'posture_feedback': (state.time_ns - age, feedback)})
        leg.elapsed = TICK * 1e-9
    np.testing.assert_array_equal(sent, (high[:3], low[:3]))


@pytest.mark.parametrize('silent', [1, 5, 20, 45])
def test_a_leg_that_was_silent_for_a_moment_goes_on_without_a_jump(ros: Ros, silent: int) -> None:
    """Late feedback makes it silent now and then; who begins anew each time is not believed."""
    description = load_description(SUITE.robot_file)
    loop, state, _ = walked(500)
    robot = PerfectTrackingRobot(description, TICK, 'standing')
    state, sent = robot.reset(state.time_ns), list[tuple[int, Any]]()
    leg = LegTransformation('leg_transformation_fl', context=ros.context,
                            parameter_overrides=RETURNS)
    ros.nodes.append(leg)
    leg.start()
    leg._writer.fill = lambda stamp, targets: sent.append((stamp, JointTargets(
        *map(np.array, (targets.position, targets.velocity, targets.effort)))))
    leg._publisher.publish = str
    watch = TargetWatch(description.legs[0], AWAY_NS)
    for k in range(200):
        tick, stamp = loop.tick(state), state.time_ns
        late_ns = FEEDBACK_NS + TICK if 60 <= k < 60 + silent or 130 <= k < 130 + silent else 0
        leg.elapsed = TICK * 1e-9
        leg.on_tick(stamp, {
            'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r,
            'posture_feedback': (stamp - late_ns, tick.feedback)})
        state = robot.step(tick.targets)
    assert len(sent) == 200 - 2 * silent
    assert all(watch.believes(*entry) for entry in sent)


def test_a_posture_control_that_comes_back_begins_with_the_readings_of_one_tick(ros: Ros) -> None:
    _, state, tick = walked(300)
    posture, sent = PostureControl(context=ros.context, parameter_overrides=RETURNS), list[Any]()
    ros.nodes.append(posture)
    posture.start()
    posture._publisher.publish = sent.append
    joints = state.joint_position, state.joint_velocity, state.joint_effort
    level = np.zeros(3), np.array((0.0, 0.0, 9.81))
    for k, (imu_ns, published) in enumerate([(-TICK, 0), (-TICK, 0), (0, 1), (-TICK, 2)]):
        stamp = state.time_ns + k * TICK
        posture.on_tick(stamp, {
            'joint_states': (stamp, joints), 'imu': (stamp + imu_ns, level), 'foot_contacts': None,
            'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r})
        assert len(sent) == published
    later = stamp + posture_control.FORGOTTEN_NS + TICK
    for k in range(posture_control.MOST_WAITED + 1):  # an IMU that is dead is waited for a while
        posture.on_tick(later + k * TICK, {
            'joint_states': (later + k * TICK, joints), 'imu': None, 'foot_contacts': None,
            'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r})
        assert len(sent) == (2 if k < posture_control.MOST_WAITED else 3)


def test_a_posture_control_that_comes_back_tells_no_mode_before_it_knows_it(ros: Ros) -> None:
    """Else a robot that lies would count as fallen."""
    posture, modes = PostureControl(context=ros.context, parameter_overrides=[
        Parameter('state_source', value='ground_truth')]), []
    ros.nodes.append(posture)
    posture.trigger_configure()
    posture._mode_publisher.publish = lambda message: modes.append(message.data)
    posture.trigger_activate()
    robot = PerfectTrackingRobot(load_description(SUITE.robot_file), TICK, 'lying')
    state, tick = robot.reset(1000 * TICK), walked(1)[2]
    posture.on_tick(state.time_ns, {
        'joint_states': (state.time_ns, (
            state.joint_position, state.joint_velocity, state.joint_effort)),
        'ground_truth': (state.base_position_in_world, state.base_quaternion,
                         state.base_velocity_in_base, state.base_rate_in_base),
        'canonical_state': (tick.x, tick.x_dot, tick.gait), 'reference': tick.r})
    assert modes == ['lying']


def test_a_body_that_stays_slower_than_its_reference_is_told_until_it_follows(ros: Ros) -> None:
    posture = PostureControl(context=ros.context, parameter_overrides=[
        Parameter('state_source', value='ground_truth')])
    ros.nodes.append(posture)
    posture.start()
    state, tick = walked(300)[1:]
    reference, stamp = np.array((1.0, 0.0, 0.0)), state.time_ns
    joints = state.joint_position, state.joint_velocity, state.joint_effort
    posture.elapsed, told = TICK * 1e-9, []
    for share in (0.6, 1.0):
        for _ in range(2000):
            stamp += TICK
            posture.on_tick(stamp, {
                'joint_states': (stamp, joints), 'reference': reference,
                'canonical_state': (tick.x, tick.x_dot, tick.gait),
                'ground_truth': (state.base_position_in_world, state.base_quaternion,
                                 share * reference, state.base_rate_in_base)})
        told.append(posture.health.has_problem('slow'))
    assert told == [True, False]


def test_a_robot_in_lock_step_tells_a_tick_again_that_does_not_end(ros: Ros) -> None:
    robot, told = MujocoRobotNode(context=ros.context, parameter_overrides=[
        Parameter('physics', value='perfect_tracking'), Parameter('lock_step', value=True),
        Parameter('expected_nodes', value=[ROBOT])]), []
    robot.start()
    robot._state_publishers['joint_states'].publish = lambda message: told.append(
        header_ns(message))
    robot._start_when_connected()
    assert told == [0]
    robot._remind()
    assert told == [0]
    robot._remind()
    assert told == [0, 0]
    robot._step()
    robot._hold()
    robot._remind()
    assert told == [0, 0, TICK]
    robot.destroy_node()
