# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``mujoco_robot``: the robot.

In real time it keeps the wall clock's pace; in lock-step it waits for every target.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.balance.body_command import BALANCED
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.estimation.parameters import StateSourceParameters
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.core.scenario.fault import Fault, FaultInjector
from dmp_cpg_ros.core.voting.parameters import VotingSwitch
from dmp_cpg_ros.nodes.framework.driven_robot import DrivenRobot
from dmp_cpg_ros.nodes.framework.health import Intervals, ReadinessOfOthers
from dmp_cpg_ros.nodes.framework.parameters import NodeParameters, Sets
from dmp_cpg_ros.nodes.messages.commands import read_push_force
from dmp_cpg_ros.nodes.messages.interfaces import BODY_TOPICS, Interface
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.nodes.messages.robot_state import RobotStateWriter
from dmp_cpg_ros.nodes.messages.values import set_stamp, stamp_ns
from dmp_cpg_ros.process import end_with_parent
from dmp_cpg_ros.robot.drive_watch import DriveWatch
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.robot.port import Robot, RobotError
from dmp_cpg_ros.robot.robot_file import load_robot_file
from dmp_cpg_ros.robot.slow_motion import SlowMotion
from dmp_cpg_ros.robot.urdf import urdf
from dmp_cpg_ros.strict_yaml import parse_yaml
from dmp_cpg_ros.suite_table import KINDS, LEG, POSTURE, ROBOT

READY_PERIOD_S, REMIND_S = 0.05, 1.0
"""How often a lock-step robot without a gate asks whether its partners are there, and after which
time it tells a tick again that does not end [s].
"""

MAKE_UP_NS = 100_000_000
"""Wall time that a robot in real time may lag behind and make up again; what is more is lost
[ns].
"""

CLOCK_EVERY = 4
"""In real time ``/clock`` ticks with every so many states: the suite itself goes by stamps."""

VIEW_WAITS_S = 86400.0
"""How long a live view that the robot serves waits for the other nodes [s]."""

TURN_TICKS = 25
"""In lock-step, where all nodes share a process: how often in ticks its executor has its turn."""

VOTING_TOPICS = ('imu', 'foot_contacts')
"""What the inhibition reads when sensors can vote."""

SENSED_TOPICS = (*VOTING_TOPICS, 'joint_states')
"""What the robot feels."""

STATE_TOPICS = ('/clock', 'imu', 'ground_truth', 'foot_contacts', 'joint_states')
"""What the robot publishes at every tick, the tick itself last: between nodes of one process, what
it leads to runs before its publication ends.
"""


class MujocoRobotNode(DrivenRobot):
    """Publishes the robot's state at every control tick and moves its joints to their targets."""

    KIND = ROBOT
    CHANGEABLE = ('fail',)

    def configure(self) -> None:
        """Stand the robot up and create its topics."""
        self._options = self.parameters_of(core.RobotParameters)
        self._tick_ns = self.parameters_of(core.TickParameters).tick_ns
        self._robot = self._make_robot()
        self._body_mode = 'standing' if self._options.start_pose == 'standing' else 'lying'
        names = self._robot.description.joint_names
        self._writer = RobotStateWriter(names)
        self._state = self._robot.reset()
        self._fell, self._holding, self._open_until = False, True, -1
        self._faults: FaultInjector | None = None
        self._arrived: dict[str, int] = {}
        lag, lead, patience = (round(1e9 * seconds) for seconds in (
            self._options.longest_lag, self._options.target_lead, self._options.target_timeout))
        self._slow_motion = SlowMotion(self._tick_ns, lag, lead, patience)
        self._told = deque[dict[str, Any]](maxlen=2)
        work = () if self._state.joint_work is None else ('joint_work',)
        self._state_publishers = {name: self.publisher(name) for name in (*work, *STATE_TOPICS)}
        self.publisher('robot_description').publish(String(data=urdf(self._file)))
        self.prepare_drive(self._robot.description, self._options)
        self.listen('joint_targets', self._on_targets)
        self.listen('body_mode', self._on_body_mode)
        self.listen('push', self._on_push, command=True)
        if self._options.gated:
            self._held = self.publisher(f'{self.KIND}/holding_at')
            self.listen(f'{self.KIND}/advance_until', self._on_advance)
        self._viewer: Any = None
        self._view = self._serve_view() if self._options.live_view else None
        if self._options.viewer and self._options.physics == 'mujoco':
            from dmp_cpg_ros.robot.camera import open_viewer

            self._viewer = open_viewer(self._robot)  # type: ignore[arg-type]

    def activate(self) -> None:
        """Begin with the first tick: at the gate, when all nodes are connected, or at once."""
        self._timer: Any = None
        self._others: ReadinessOfOthers | None = None
        self.tell_drive('')
        if self._options.gated:
            self._hold()
        elif self.lock_step:
            self._waiting = Intervals()
            expected = self.parameters_of(NodeParameters).expected_nodes
            self._others = ReadinessOfOthers(
                self, [name for kind in expected if kind != self.KIND
                       for name in KINDS[kind].instances])
            self._timer = self.create_steady_timer(READY_PERIOD_S, self._start_when_connected)
        else:
            self._start_real_time()

    def deactivate(self) -> None:
        """Stop the clock; the robot stays where it is."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None
        if self._others is not None:
            self._others.end()
            self._others = None

    def cleanup(self) -> None:
        """Close the window, and the view."""
        if self._viewer is not None:
            self._viewer.close()
        if self._view is not None:
            self._view.terminate()
            self._view.wait()

    def _serve_view(self) -> subprocess.Popen[bytes]:
        """Start ``live_view``, which waits for the other nodes and ends with this process."""
        return subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros', 'live_view', '--wait', f'{VIEW_WAITS_S}',
             '--namespace', self.get_namespace()],
            preexec_fn=partial(end_with_parent, signal.SIGTERM))

    def readers(self, topic: Interface) -> tuple[str, ...]:
        """Count those among the readers of a topic that read it with these parameters."""
        name, options = topic.name, self._options
        reads = {
            LEG: name == 'joint_states' and options.reading == 'torque',
            POSTURE: name in BODY_TOPICS[self.parameters_of(StateSourceParameters).state_source],
            core.INHIBITION: name in VOTING_TOPICS and self.parameters_of(VotingSwitch).voting,
            core.CANONICAL: name == 'foot_contacts' and options.contact_feedback,
        }
        return (*super().readers(topic), *self.outside(kind for kind in reads if reads[kind]))

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Timing, and whether the robot has fallen or stands by itself."""
        return {**self._timing.values(), 'fell': self._fell, 'time_s': self._state.time_ns * 1e-9,
                **self.watchdog_values()}

    def check_parameters(self, sets: Sets) -> None:
        """Refuse what is no failure, and every one unless they are allowed."""
        options: Any = sets[core.RobotParameters]
        if options.fail:
            if not options.failures_allowed:
                raise ParameterError(
                    'no failures are injected here: start it with failures_allowed:=true')
            self._fault(options)

    def on_parameters(self) -> None:
        """Inject the failure that was set."""
        self._options = self.parameters_of(core.RobotParameters)
        if self._options.fail:
            self._faults = self._faults or FaultInjector(self._options.seed)
            self._faults.add(self._fault(self._options), self._state.time_ns)

    def _fault(self, options: core.RobotParameters) -> Fault:
        """Failure that a parameter names; those that a lock-step would wait for are refused."""
        fault = Fault.from_mapping(parse_yaml(options.fail, 'fail'))
        if fault.component == 'clock' and self.lock_step:
            raise ParameterError('fail: clock needs real time; in lock-step all would wait for '
                                 'the stamp of the tick')
        return fault

    # The tick ------------------------------------------------------------------------------------

    def _publish_state(self) -> None:
        stamp, writer = self._state.time_ns, self._writer
        self._holding = False
        self.begin_tick(stamp)
        try:
            writer.fill(self._state)
        except DataError as error:
            self._start_over(stamp, f'the robot at {stamp * 1e-9:.3f} s: {error}')
            writer.fill(self._state)
        if self._faults is not None:
            writer.fill_failing(self._faults.sensed(self._state))
            self._tell_failures(self._faults.acting)
        self._timing.published(stamp)
        self._publish_all()
        if self.lock_step:
            self._told.append({name: getattr(writer, name) for name in SENSED_TOPICS})
        self.end_tick()

    def _publish_all(self) -> None:
        clock_ticks = self.lock_step or self._state.time_ns // self._tick_ns % CLOCK_EVERY == 0
        for name, publisher in self._state_publishers.items():
            message = getattr(self._writer, name.strip('/'))
            if message is not None and (clock_ticks or name != '/clock'):
                publisher.publish(message)

    def _tell_again(self) -> None:
        """Tell the last tick again, for a node that was restarted and may not have heard it; and
        what is sensed of the one before: the inhibition may have died before that tick ended, with
        who tells it of the body; what it says acts one tick later, so that the robot had gone on.
        """
        if len(self._told) > 1:
            for name, message in self._told[0].items():
                self._state_publishers[name].publish(message)
        self._publish_all()

    def _tell_failures(self, faults: Sequence[Fault]) -> None:
        """Tell what fails on purpose, and when nothing does any more."""
        if faults:
            self.warn('failing', f'injected: {", ".join(map(str, faults))}')
        else:
            self.clear('failing')

    def _step(self) -> None:
        """Move the robot by one tick under the targets that are there."""
        now = self._state.time_ns
        targets = self._guard.targets(self._state)
        if self._faults is not None:
            targets = self._faults.driven(targets)
        self.watch_silence(now)
        self.watch_joints()
        self._robot.without_power = self._guard.drives.lame
        try:
            self._state = self._robot.step(targets)
        except RobotError as error:
            self._start_over(now + self._tick_ns, str(error))
        should_stand = self._body_mode in BALANCED
        if should_stand and not self._fell and getattr(self._robot, 'fallen', False):
            self._fell = True
            self.warn('fell', f'the robot fell at {self._state.time_ns * 1e-9:.3f} s', error=True)
        if self._viewer is not None and self._viewer.is_running():
            self._viewer.sync()

    def _start_over(self, time_ns: int, why: str) -> None:
        """Put the robot back when its simulation has diverged; time goes on."""
        self.warn('diverged', f'{why}; the robot is back in its start pose', error=True)
        self._state = self._robot.reset(time_ns)
        self.forget_targets()

    def _on_body_mode(self, message: Any) -> None:
        """Know when lying is no fall; a fall is over when the robot stands again."""
        mode = read_body_mode(message)
        if mode == 'standing' and self._body_mode != 'standing':
            self._fell = False
            self.clear('fell')
        self._body_mode = mode

    def _on_targets(self, message: Any) -> None:
        leg, stamp, targets = self.read_targets(message)
        self._arrived[leg] = stamp  # what is waited for, believed or not
        self._slow_motion.hear(leg, stamp, time.monotonic_ns())
        sent = [(leg, stamp, targets)]
        for arriving in sent if self._faults is None else self._faults.sent(sent):
            self._guard.accept(*arriving)
        self._timing.arrived(stamp)
        if self.lock_step and not self._holding and not self.awaited()[1]:
            self._step()
            self._hold()

    def awaited(self) -> tuple[int, list[str]]:
        """Stamp of this tick [ns], and the legs whose targets have not come."""
        now = self._state.time_ns
        return now, [] if self._holding else [
            f'joint_targets of {leg}' for leg in LEGS if self._arrived.get(leg) != now]

    def _on_push(self, message: Any) -> None:
        force, take = read_push_force(message), getattr(self._robot, 'take_push', None)
        if take is None:
            raise DataError(f'physics: {self._options.physics} knows no forces; '
                            'physics: mujoco does')
        take(force)

    # Lock-step -----------------------------------------------------------------------------------

    def _start_when_connected(self) -> None:
        if self._timer is None or self._others is None:          # was due when it was destroyed
            return
        # A tick that one of the others loses would be waited for for ever.
        missing = self.missing() + self._others.missing()
        if not missing:
            self.deactivate()
            self._reminded_ns = -1
            self._timer = self.create_steady_timer(REMIND_S, self._remind)
            self._publish_state()
        elif self._waiting.due():
            self.get_logger().info(f'waiting for {"; ".join(missing)}')

    def _remind(self) -> None:
        """Tell a tick again that has not ended since the last time: a node may have been restarted
        in it. Who holds a gate does that.
        """
        now = self._state.time_ns
        if now == self._reminded_ns:
            self._tell_again()
        self._reminded_ns = now

    def _hold(self) -> None:
        """Go on, or wait at the gate until the state may be published."""
        if not self._options.gated or self._open_until >= self._state.time_ns:
            self._go_on()
            return
        self._holding = True
        message = Clock()
        set_stamp(message.clock, self._state.time_ns)
        self._held.publish(message)

    def _on_advance(self, message: Clock) -> None:
        until = stamp_ns(message.clock)
        if self.lock_step and until == self._open_until:
            self._tell_again()
            return
        self._open_until = max(self._open_until, until)
        if not self._holding or self._open_until < self._state.time_ns:
            return
        self._go_on()

    def _go_on(self) -> None:
        """Begin the next tick; where all nodes share a process the executor has its turn now and
        then, as their ticks are worked off within one callback.
        """
        now = self._state.time_ns
        if not self.lock_step:
            self._start_real_time()
        elif self.local is None or self.executor is None or now // self._tick_ns % TURN_TICKS:
            self._publish_state()
        else:
            def begin() -> None:
                if self.active and self._state.time_ns == now:
                    self._publish_state()

            self.executor.create_task(self.guarded('gate', begin))

    # Real time -----------------------------------------------------------------------------------

    def _start_real_time(self) -> None:
        self._publish_state()
        self._begun = time.monotonic_ns() - self._state.time_ns
        self._timer = self.create_steady_timer(self._tick_ns * 1e-9, self._on_timer)

    def _on_timer(self) -> None:
        """Run the tick that is due, and one more when the process was kept from running before."""
        if self._timer is None:                                  # was due when it was destroyed
            return
        for _ in range(2):
            behind = time.monotonic_ns() - self._begun - self._state.time_ns
            if behind < self._tick_ns // 2:
                return
            if behind > MAKE_UP_NS:
                self._begun += behind - MAKE_UP_NS
            if self._wait_for_targets():
                return
            self._timing.deadline(self._state.time_ns)
            self._step()
            self._publish_state()

    def _wait_for_targets(self) -> bool:
        """Whether to let wall time pass, so that a machine too slow for real time does not make
        the robot fall.
        """
        waits = self._slow_motion.waits(self._state.time_ns, time.monotonic_ns())
        self._timing.waits += waits
        return waits

    # Inside --------------------------------------------------------------------------------------

    def prepare_watch(self, drives: DriveWatch) -> None:
        """Joints that are exactly where they are told to be have no drives; others lose their
        power as by the enable lines of real drives, whatever these are told.
        """
        drives.watches = drives.cuts = self._options.physics == 'mujoco'

    @property
    def _file(self) -> Path:
        return find_config(self.parameters_of(core.RobotFileParameters).robot, ROBOTS)

    def _make_robot(self) -> Robot:
        p, file = self._options, self._file
        world = core.chosen_world(self.parameters_of(WorldParameters), p)
        if p.physics == 'perfect_tracking':
            return PerfectTrackingRobot(load_description(file), self._tick_ns, p.start_pose)
        from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

        robot_file = load_robot_file(file)
        if p.reading == 'torque':
            robot_file = robot_file.without_gains()
        return MujocoRobot(robot_file, self._tick_ns, p.seed, p.initial_spread, world=world,
                           sensors=self.parameters_of(SensorParameters), start_pose=p.start_pose,
                           mismatch=self.parameters_of(MismatchParameters))
