# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measures the cost of the core: time steps, networks of growing size, the parts of one tick,
certificates, messages.

Every row is the best of several repetitions and is also given as a ratio within the same run, for
absolute times drift with the machine.
"""

from __future__ import annotations

import sys
import time
import timeit
from array import array
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count
from typing import NamedTuple

import numpy as np
import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState

from dmp_cpg_ros.commands.certify import running_setting
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.coupling import Edges, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.estimation.estimator import BodyEstimator
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.prediction import look_ahead
from dmp_cpg_ros.core.loop import Array, WalkingLoop
from dmp_cpg_ros.core.robot_model.sensor_readings import readings_of
from dmp_cpg_ros.core.transformation.leg import LegFeedback
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.posture_feedback import (
    PostureFeedbackReader,
    PostureFeedbackWriter,
)
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter, read_reference
from dmp_cpg_ros.paper import network as networks
from dmp_cpg_ros.paper.oscillators import HopfOscillators
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.draws import both_ways
from dmp_cpg_ros.studies.loop_recording import LoopRun
from dmp_cpg_ros.studies.output import parser_of, write_results
from dmp_cpg_ros.studies.tightness import network
from dmp_cpg_ros.suite import Suite, load_suite

TICK, OMEGA, GAIN = 0.004, 9.0, 100.0
"""Tick [s], angular frequency [rad/s] and sum of the gains at each node [1/s] of the networks."""


class Row(NamedTuple):
    """What was measured, its time [s], and the same over that of the row that the table's title
    names.
    """

    what: str
    seconds: float
    ratio: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; returns the exit status."""
    parser = parser_of('bench', __doc__, 'the tables', jobs=False)
    parser.add_argument('--sizes', type=int, nargs='+', metavar='N',
                        default=[10, 100, 1000, 3000, 10_000],
                        help='numbers of oscillators (default: 10 100 1000 3000 10000)')
    options = parser.parse_args(arguments)
    measurements: dict[str, Callable[[], list[Row]]] = {
        'One time step of four coupled oscillators (ratio: to the first row)': steps_of_four,
        'A time step per oscillator (ratio: to 1,000 oscillators)':
            lambda: steps_of_many(options.sizes),
        'The parts of one tick of the plain loop (ratio: to the whole tick)': parts_of_a_tick,
        'Certificates (ratio: to a whole tick of the plain loop)': certificates,
        'Messages of every tick (ratio: to the first row)': messages,
    }
    tables = dict[str, list[Row]]()
    for title, measure in measurements.items():
        rows = tables[title] = measure()
        width = max(len(row.what) for row in rows)
        print(f'\n{title}')
        for row in rows:
            print(f'  {row.what.ljust(width)} {_text(row.seconds)} {row.ratio:8.2f}', flush=True)
    write_results(options.json, {title: [row._asdict() for row in rows]
                                 for title, rows in tables.items()})
    return 0


def steps_of_four() -> list[Row]:
    """Time steps of the gait's network, and of what else could be done."""
    of = network('all_to_all', GAIN)
    coupling = networks.EdgeCoupling(of.graph)
    general = networks.OscillatorNetwork(HopfOscillators(4, OMEGA), coupling, of.target)
    x, free, held = state_at(of.graph.phases + 0.5), np.zeros(4), 400.0 * np.eye(4)[0]
    return _with_ratios([
        ('exponential step (core/canonical/system.py)', lambda: of.step(x, OMEGA, free, TICK)),
        ('the same, inhibited', lambda: of.step(x, OMEGA, held, TICK)),
        ('its vector field alone', lambda: of.field(x, OMEGA, free)),
        ('classical Runge-Kutta, unstable here', lambda: _classical(of, x, held)),
        ('stabilised step of any network (core/networks)', lambda: general.step(x, TICK, held)),
    ])


def steps_of_many(sizes: Sequence[int]) -> list[Row]:
    """Time steps of growing networks, divided by the number of oscillators."""
    kinds: dict[str, Callable[[int], networks.Coupling]] = {
        'ring': lambda n: _over(n, topology('ring', n)),
        'random, 6 neighbours': lambda n: _over(n, _random_edges(n)),
        'all to all': lambda n: networks.MeanFieldCoupling(n, GAIN / n),
    }
    rows = []
    for kind, coupling in kinds.items():
        seconds = {size: _step_time(coupling(size)) for size in {*sizes, 1000}}
        rows += [Row(f'{kind}, {size:,}', seconds[size], seconds[size] / seconds[1000])
                 for size in sizes]
    return rows


def parts_of_a_tick() -> list[Row]:
    """Parts of the plain loop on the walking robot, and the prediction of a stop."""
    suite, run = _walking()
    loop, robot = run.loop, run.robot
    state, x, r, dt, zero = run.state, loop.x, loop.r, run.tick_s, np.zeros(3)
    x_dot = loop.network.rate(x, r, loop.inhibition)
    stopping = loop.supervisor.request(loop.stop, True)
    leg, command, gait = loop.legs[0].primitive, (0.5, 0.0, 0.0), loop.canon.gait
    estimator = BodyEstimator(robot.description, suite.parameters.estimation)
    known, readings = loop.estimator_state, readings_of(state)
    balance, of_leg = loop.posture.balance, loop.leg_states[0].leg
    asked = LegFeedback(state.joint_position[:3].tolist(), (0.0,) * 3, (0.0,) * 2, (0.0,) * 3)

    return _with_ratios([
        # of a robot that walks: one whose state repeats itself has sensors that froze
        ('whole tick, MuJoCo included', lambda: run.tick(dt)),
        ('reference', lambda: loop.reference.step(r, zero, dt)),
        ('oscillators', lambda: loop.network.step(x, r, loop.inhibition, dt)),
        ('state of the stop', lambda: loop.supervisor.step(
            loop.stop, loop.stop.time_ns, loop.network, x, x_dot, r, command)),
        ('estimate of the body', lambda: estimator.step(known, readings)),
        ('balance', lambda: loop.body.posture.step(balance, state, gait, x, x_dot, r, dt)),
        ('one leg', lambda: leg.step(of_leg, gait, x[0], x_dot[0], r, asked, dt)),
        ('prediction of a stop', lambda: look_ahead(
            loop.supervisor, loop.reference, loop.canonical, stopping, Announced(loop.inhibition),
            loop.canon, r, command, dt).time_s),
    ])


def certificates() -> list[Row]:
    """Processor time of the certificate of the defaults, and of judging changes that were not
    asked for before.
    """
    suite, run = _walking()
    loop, new = run.loop, count(1)

    other = _walking()[1].loop  # of which the gait is on its way to another
    voting: dict[str, object] = {'voting': True, 'coupling_gain': 200.0}
    more, path, star = (_walking({'voting': True, **of})[1].loop for of in (
        {'auto_gait': True, 'inhibited_legs': ['auto']},
        {**voting, 'coupling_graph': 'path', 'auto_gait': True, 'inhibited_legs': ['auto']},
        {**voting, 'coupling_graph': 'star', 'vote_majority': 2}))

    def change(of: WalkingLoop = loop, accepted: bool = True, **values: Callable[[int], object]
               ) -> Callable[[], object]:
        def ask() -> None:
            number = next(new)
            refused = of.change({name: value(number) for name, value in values.items()})
            if accepted == bool(refused):
                raise RuntimeError(refused or 'accepted')

        return ask

    rows = _with_ratios([
        ('', lambda: run.tick(run.tick_s)),
        (f'certificate of the defaults ({suite.gait.name})', partial(
            certify, running_setting(suite))),
        ('another inhibition gain', change(inhibition_gain=lambda n: 400.0 - 1e-3 * n)),
        ('another coupling gain', change(coupling_gain=lambda n: 100.0 + 1e-3 * n)),
        ('another gait', change(other, gait=lambda n: ('trot', 'amble')[n % 2],
                                coupling_gain=lambda n: 100.0 + 1e-3 * n)),
        ('a refused inhibition gain, with one that works', change(
            accepted=False, inhibition_gain=lambda n: 10.0 + 1e-3 * n)),
        ('a refused coupling gain, with one that works', change(
            accepted=False, coupling_gain=lambda n: 1.0 + 1e-4 * n)),
        ('refused values of three, with some that work', change(
            accepted=False, cadence_scale=lambda n: 4.0 - 1e-4 * n,
            coupling_gain=lambda n: 50.0, rho=lambda n: 3.0)),
        ('another cadence', change(cadence_scale=lambda n: 1.0 + 1e-5 * n)),
        ('the same with votes, three gaits and any leg', change(
            more, cadence_scale=lambda n: 1.0 + 1e-5 * n)),
        ('a refused one, with one that works', change(
            more, accepted=False, cadence_scale=lambda n: 4.0 - 1e-4 * n)),
        ('another coupling gain on a path with votes, three gaits and any leg', change(
            path, coupling_gain=lambda n: 200.0 + 1e-3 * n)),
        ('another cadence there', change(path, cadence_scale=lambda n: 1.0 + 1e-5 * n)),
        ('a refused region there', change(
            path, accepted=False, region_radius=lambda n: 0.1 + 1e-6 * n)),
        ('another coupling gain on a star with votes', change(
            star, coupling_gain=lambda n: 200.0 + 1e-3 * n)),
        ('refused values of two and a clamp, with some that work', change(
            star, accepted=False, region_radius=lambda n: 0.28 + 1e-6 * n,
            max_speed=lambda n: 0.77, vote_limit=lambda n: 1.0)),
        ('refused values of three, of which votes lose one', change(
            star, accepted=False, cadence_scale=lambda n: 4.0 - 1e-5 * n,
            coupling_gain=lambda n: 60.0, rho=lambda n: 3.0)),
    ], time.process_time)  # another process may compute them beside the ticks
    return rows[1:]


def ticks_per_second() -> float:
    """Ticks of the plain loop with its robot in a second of wall time, while it walks."""
    run = _walking()[1]
    return 1.0 / seconds_of(lambda: run.tick(run.tick_s), least=0.2)


def _walking(overrides: Mapping[str, object] | None = None) -> tuple[Suite, LoopRun[WalkingLoop]]:
    """The plain loop, 2 s after it was told to walk, and its parameters."""
    suite = load_suite(overrides={'cmd_vel_timeout': 0.0, **(overrides or {})})
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    loop = WalkingLoop(robot.description, suite.gait, suite.parameters, suite.gaits.gaits)
    loop.command(0.5)
    run = LoopRun(robot, loop)
    run.tick(500 * run.tick_s)
    return suite, run


def messages() -> list[Row]:
    """Reading and writing by the suite, rclpy and rosbags; and what one message more costs."""
    writer, reader = PostureFeedbackWriter(), PostureFeedbackReader()
    feedback = PostureFeedback((1.0,) * 12, ((1.0,) * 3,) * 4, ((1.0,) * 2,) * 4, (1.0,) * 3)
    data, read = writer.fill(0, feedback).serialized, serialized_reader(JointState)
    message, store = deserialize_message(data, JointState), get_typestore(Stores.ROS2_JAZZY)
    kind, twist_kind = (f'{of.__module__.split(".")[0]}/msg/{of.__name__}'
                        for of in (JointState, TwistStamped))
    other, read_twist = store.deserialize_cdr(data, kind), serialized_reader(TwistStamped)
    twist = ReferenceWriter().fill(0, np.ones(3)).serialized
    with rclpy.context.Context() as context:
        node = rclpy.create_node('bench', context=context, enable_rosout=False)
        publisher = node.create_publisher(JointState, 'bench', 10)
        ends = [node.create_subscription(JointState, 'bench', lambda _: None, 10, raw=True)
                for _ in range(4)]
        while publisher.get_subscription_count() < len(ends):
            time.sleep(0.01)

        def fill_by_rclpy() -> None:
            for field in ('position', 'velocity', 'effort'):
                setattr(message, field, array('d', getattr(other, field).tobytes()))
            publisher.publish(message)

        def deliver() -> None:
            publisher.publish(data)
            for end in ends:
                while end.handle.take_message(JointState, True) is None:
                    pass

        rows = _with_ratios([
            ('read posture_feedback', lambda: reader.read(read(data))),
            ('the same by rclpy', lambda: reader.read(deserialize_message(data, JointState))),
            ('the same by rosbags, arrays only', lambda: store.deserialize_cdr(data, kind)),
            ('write posture_feedback', lambda: writer.fill(0, feedback)),
            ('the same by rclpy, filled already', lambda: serialize_message(message)),
            ('the same by rosbags, filled already', lambda: store.serialize_cdr(other, kind)),
            ('write and publish posture_feedback', lambda: publisher.publish(
                writer.fill(0, feedback).serialized)),
            ('fill and publish it by rclpy', fill_by_rclpy),
            ('read reference', lambda: read_reference(read_twist(twist))),
            ('the same by rclpy', lambda: read_reference(
                deserialize_message(twist, TwistStamped))),
            ('the same by rosbags', lambda: store.deserialize_cdr(twist, twist_kind)),
            ('deliver one message to four readers', deliver),
        ])
        node.destroy_node()
    return rows


def seconds_of(what: Callable[[], object], repetitions: int = 7, least: float = 0.01,
               clock: Callable[[], float] = time.perf_counter) -> float:
    """Time of one call: the best of several repetitions of at least some seconds each."""
    timer, calls = timeit.Timer(what, timer=clock), 1
    while (elapsed := timer.timeit(calls)) < least:
        calls = max(calls + 1, int(1.5 * calls * least / max(elapsed, 1e-9)))
    return min(timer.repeat(repetitions, calls)) / calls


def _with_ratios(cases: Sequence[tuple[str, Callable[[], object]]],
                 clock: Callable[[], float] = time.perf_counter) -> list[Row]:
    seconds = [seconds_of(what, clock=clock) for _, what in cases]
    return [Row(name, own, own / seconds[0])
            for (name, _), own in zip(cases, seconds, strict=True)]


def _step_time(coupling: networks.Coupling) -> float:
    rng, size = np.random.default_rng(0), coupling.count
    of = networks.OscillatorNetwork(HopfOscillators(size, rng.uniform(8.0, 10.0, size)), coupling)
    x = state_at(rng.uniform(-np.pi, np.pi, size))
    return seconds_of(lambda: of.step(x, TICK)) / size


def _over(size: int, edges: Edges) -> networks.EdgeCoupling:
    return networks.EdgeCoupling(graph_from_edges(size, edges, GAIN * size / max(len(edges), 1)))


def _random_edges(size: int) -> Edges:
    """Three chords from every node to random others, both ways."""
    rng = np.random.default_rng(1)
    chords = {(i, int(j)) for i in range(size) for j in rng.integers(0, size, 3) if i != j}
    return both_ways(chords)


def _classical(of: CanonicalSystem, x: Array, gains: Array) -> Array:
    slopes = [np.zeros_like(x)]
    for share in (0.0, 0.5, 0.5, 1.0):
        slopes.append(of.field(x + share * TICK * slopes[-1], OMEGA, gains))
    return x + TICK / 6.0 * np.tensordot((0.0, 1.0, 2.0, 2.0, 1.0), slopes, axes=1)


def _text(seconds: float) -> str:
    unit, scale = ('ns', 1e9) if seconds < 1e-6 else ('us', 1e6) if seconds < 1e-3 else ('ms', 1e3)
    return f'{scale * seconds:8.1f} {unit}'


if __name__ == '__main__':
    sys.exit(main())
