# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Robots that nobody has built: each is drawn, written as MJCF, found by ``inspect_robot``, and
walks with the package's parameters as they are.

Legs of 0.15 to 0.8 m, 0.6 to 2.2 times as heavy as the package's own robot of that size, long or
short, wide or narrow bodies, hind knees that bend backwards or forwards, axes in either direction,
light or heavy legs, a centre of mass out of the middle, and weak or strong motors with more or
less friction. Each ambles and trots, comes to rest by inhibition and starts again, and walks a
course of random commands, gaits and stops (:mod:`~dmp_cpg_ros.studies.random_commands`). Equal
seeds give equal robots and walks. Nothing is tuned to a robot.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.commands.inspect_robot import robot_yaml
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.robot.model_inspection import inspect_model
from dmp_cpg_ros.studies import output, random_commands
from dmp_cpg_ros.studies.draws import log_uniform
from dmp_cpg_ros.studies.walking_trials import Walk, held, relative_error
from dmp_cpg_ros.studies.workers import Workers

GAITS, ALSO = ('amble', 'trot'), ('changes', 'auto_gait', 'disturbed')
SPEED = 0.3
"""Of the steady walks, dimensionless."""

LONGEST_STOP = 5.0
"""Time that a robot is given to come to rest [s]."""

OWN = (8.9, 0.4)
"""Mass [kg] and length of the legs [m] of the package's own robot, whose density is 1."""

_ABDUCTION, _THIGH, _SHANK = 0.4, 0.42, 0.18
"""Shares of a leg's mass."""


class Shape(NamedTuple):
    """A quadruped; lengths without a unit are in lengths of a stretched leg.

    Attributes
    ----------
    leg : float
        Thigh and shank, stretched [m].
    mass : float
        All of it [kg].
    thigh : float
        Share of the thigh in the leg.
    half_length, half_width, abduction : float
        From the middle to the abduction joints, ahead and aside, and from there to the hip's.
    foot : float
        Radius of a foot.
    legs : float
        Share of the four legs in the mass.
    forwards : bool
        Whether hind knees bend forwards.
    turned : bool
        Whether hips and knees turn about −y.
    torque, knee : float
        Of abduction and hip, in m g times the leg; the knee's in that of the hip.
    armature, friction, damping : float
        In m times the leg squared, shares of the torque, and of the torque in a rad/s.
    ahead : float
        Of the trunk's centre of mass, in lengths of the trunk.
    """

    leg: float
    mass: float
    thigh: float
    half_length: float
    half_width: float
    abduction: float
    foot: float
    legs: float
    forwards: bool
    turned: bool
    torque: float
    knee: float
    armature: float
    friction: float
    damping: float
    ahead: float

    @classmethod
    def drawn(cls, seed: int) -> Shape:
        """Draw one."""
        rng = np.random.default_rng(seed)
        leg = log_uniform(rng, 0.15, 0.8)
        mass = OWN[0] * (leg / OWN[1]) ** 3 * log_uniform(rng, 0.6, 2.2)
        between = [float(rng.uniform(*span)) for span in (
            (0.43, 0.57), (0.35, 0.65), (0.08, 0.2), (0.1, 0.25), (0.04, 0.07), (0.15, 0.4),
            (0.45, 1.0), (1.0, 1.6), (0.0, 0.02), (-0.05, 0.05))]
        thigh, half_length, half_width, abduction, foot, legs, torque, knee, dry, ahead = between
        return cls(leg, mass, thigh, half_length, half_width, abduction, foot, legs,
                   bool(rng.random() < 0.4), bool(rng.random() < 0.3), torque, knee,
                   log_uniform(rng, 6e-4, 4.4e-3), dry, log_uniform(rng, 3e-4, 6e-3), ahead)

    def mjcf(self, seed: int = 0) -> str:
        """The robot as MJCF, its legs in an order that is drawn."""
        long, trunk = self.leg, (1.0 - self.legs) * self.mass
        x, y = self.half_length * long, self.half_width * long
        size = (2.0 * x, 2.0 * y + 0.1 * long, 0.3 * long)
        legs = [self._leg(end + side, x * ahead, y * left, ahead < 0.0)
                for end, ahead in (('F', 1.0), ('R', -1.0))
                for side, left in (('L', 1.0), ('R', -1.0))]
        order = np.random.default_rng((seed, 1)).permutation(4)
        hip = self.torque * self.mass * GRAVITY * long
        motors = [f'<motor joint="{leg}_j{k}" ctrlrange="{-most:.6g} {most:.6g}"/>'
                  for leg in ('FL', 'FR', 'RL', 'RR')
                  for k, most in enumerate((hip, hip, self.knee * hip))]
        return '\n'.join((
            '<mujoco model="drawn"><compiler angle="radian" autolimits="true"/>',
            '<option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"/>',
            f'<worldbody><body name="trunk" pos="0 0 {long:.6g}"><freejoint/>',
            _inertial((self.ahead * size[0], 0.0, 0.0), trunk, size),
            f'<geom type="box" size="{_numbers(0.5 * np.array(size))}" {_SOLID}/>',
            '<site name="imu"/>', *(legs[k] for k in order), '</body></worldbody>',
            '<actuator>', *motors, '</actuator></mujoco>'))

    def _leg(self, name: str, x: float, y: float, hind: bool) -> str:
        """One leg, hanging straight down at zero."""
        long, mass = self.leg, 0.25 * self.legs * self.mass
        thigh, shank = self.thigh * long, (1.0 - self.thigh) * long
        forwards = self.forwards and hind
        hip, knee = ((-2.8, 1.2), (0.2, 2.7)) if forwards else ((-1.2, 2.8), (-2.7, -0.2))
        if self.turned:
            hip, knee = ((-high, -low) for low, high in (hip, knee))
        torque = self.torque * self.mass * GRAVITY * long
        drive = (f'damping="{self.damping * torque:.6g}" '
                 f'frictionloss="{self.friction * torque:.6g}" '
                 f'armature="{self.armature * self.mass * long ** 2:.6g}"')
        about, radius = '0 -1 0' if self.turned else '0 1 0', self.foot * long
        aside = math.copysign(self.abduction * long, y)

        def link(k: int, at: Sequence[float], axis: str, limits: Sequence[float]) -> str:
            return (f'<body name="{name}_{k}" pos="{_numbers(at)}"><joint name="{name}_j{k}" '
                    f'axis="{axis}" range="{_numbers(limits)}" {drive}/>')

        return '\n'.join((
            link(0, (x, y, 0.0), '1 0 0', (-1.0, 1.0)),
            _inertial((0.0, 0.3 * aside, 0.0), _ABDUCTION * mass, (0.2 * long,) * 3),
            link(1, (0.0, aside, 0.0), about, hip),
            _inertial((0.0, 0.0, -0.25 * thigh), _THIGH * mass, (0.1 * long, 0.1 * long, thigh)),
            f'<geom type="capsule" fromto="0 0 0 0 0 {-thigh:.6g}" size="{0.6 * radius:.6g}" '
            f'{_SOLID}/>',
            link(2, (0.0, 0.0, -thigh), about, knee),
            _inertial((0.0, 0.0, -0.4 * shank), _SHANK * mass,
                      (0.06 * long, 0.06 * long, shank)),
            f'<geom name="{name}_foot" type="sphere" size="{radius:.6g}" pos="0 0 {-shank:.6g}" '
            f'friction="0.8 0.02 0.001" condim="4" {_SOLID}/>', '</body></body></body>'))


_SOLID = 'mass="0" contype="1" conaffinity="0"'


def _numbers(values: Sequence[float] | np.ndarray) -> str:
    return ' '.join(f'{value:.6g}' for value in values)


def _inertial(at: Sequence[float], mass: float, size: Sequence[float]) -> str:
    """A box of even density."""
    squares = np.square(size)
    return (f'<inertial pos="{_numbers(at)}" mass="{mass:.6g}" diaginertia="'
            f'{_numbers(mass * (squares.sum() - squares) / 12.0)}"/>')


@dataclass
class Outcome:
    """What became of one robot.

    Attributes
    ----------
    seed : int
        Of the robot and its walks.
    shape : dict
        The robot.
    error : dict of str to float
        Relative error of the speed, by gait; NaN where it fell.
    stops : list of (str, float, float, float, bool)
        Gait; time to rest as predicted, bounded (infinite without a certificate) and measured
        [s]; whether it walked on.
    course : Outcome of random_commands
        Of the random commands.
    """

    seed: int
    shape: dict[str, float]
    error: dict[str, float] = field(default_factory=dict)
    stops: list[tuple[str, float, float, float, bool]] = field(default_factory=list)
    course: random_commands.Outcome = field(default_factory=lambda: random_commands.Outcome(0))

    @property
    def wrong(self) -> list[str]:
        """Falls, and stops that did not keep their bound or prediction."""
        told = [f'fell in a steady {gait}' for gait, error in self.error.items()
                if math.isnan(error)]
        told += [f'stop in {gait}: predicted {predicted:.3f} s, bound {bound:.3f} s, took '
                 f'{took:.3f} s{"" if on else ", fell"}'
                 for gait, predicted, bound, took, on in self.stops
                 if not (on and took <= bound + 1e-9 and abs(took - predicted) < 1e-9)]
        told += [f'random commands: fell at {self.course.fell}'] if self.course.fell else []
        return told + [f'random commands: a stop in {gait} took {took:.3f} s, predicted '
                       f'{predicted:.3f} s, bound {bound:.3f} s'
                       for gait, predicted, bound, took in self.course.late]


def robot_file(seed: int, folder: Path) -> Path:
    """Write the file of a robot that is drawn, and its model, into a folder."""
    model, robot = folder / 'drawn.xml', folder / 'drawn.yaml'
    model.write_text(Shape.drawn(seed).mjcf(seed), encoding='utf-8')
    robot.write_text(robot_yaml(inspect_model(model), folder), encoding='utf-8')
    return robot


def trial(seed: int, seconds: float, only: str = '') -> Outcome:
    """Draw a robot, let it walk steadily and stop, and walk a course of random commands [s]; or
    walk such a course only, in which also one of ``ALSO`` happens, disturbances of its size.
    """
    shape = Shape.drawn(seed)
    outcome = Outcome(seed, shape._asdict())
    with TemporaryDirectory() as name:
        robot = robot_file(seed, Path(name))
        for gait in () if only else GAITS:
            run = Walk(gait, str(robot))
            leg = run.loop.canonical.scale.leg_length
            velocity = (SPEED * math.sqrt(GRAVITY * leg), 0.0, 0.0)
            walked = held(run, velocity)
            outcome.error[gait] = relative_error(walked, velocity)
            if not walked.fell:
                outcome.stops.append((gait, *_stop_and_start(run)))
        if seconds:
            outcome.course = random_commands.trial(
                seed, seconds, str(robot), changes=only == 'changes',
                auto_gait=only == 'auto_gait', disturbed=only == 'disturbed',
                size=shape.leg / OWN[1])
    return outcome


def _stop_and_start(run: Walk) -> tuple[float, float, float, bool]:
    """Stop a walk and let it walk on: predicted, bounded and measured time to rest [s], and
    whether it stayed on its feet.
    """
    predicted, bound = run.loop.request(True), run.loop.time_to_rest()
    upright = run.walk(LONGEST_STOP)
    took = run.loop.stop.measured_s if run.loop.stop.state == 'at_rest' else math.inf
    run.loop.request(False)
    return predicted, bound, took, upright and run.walk(2.0) and (
        run.loop.stop.state == 'walking')


def main(arguments: Sequence[str] | None = None) -> int:
    """Let the robots walk and print what became of them; returns 1 if something was wrong."""
    parser = output.parser_of('random_robots', __doc__, 'every outcome')
    parser.add_argument('--runs', type=output.at_least_one, default=20, metavar='N')
    parser.add_argument('--seconds', type=float, default=20.0,
                        help='of random commands, 0 for none (default: 20)')
    parser.add_argument('--seed', type=int, default=0, help='of the first robot (default: 0)')
    parser.add_argument('--only', choices=ALSO, default='', help='only random commands, in which '
                        'also parameters change, gaits are chosen by speed, or the robot is '
                        'disturbed in the measure of its size')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: RosArguments) -> int:
    outcomes = []
    with Workers(options.workers, options.cluster, progress=True) as workers:
        for outcome in workers.map(partial(trial, seconds=options.seconds, only=options.only),
                                   range(options.seed, options.seed + options.runs)):
            outcomes.append(outcome)
            for line in outcome.wrong:
                shape = ', '.join(f'{name} {value:.3g}' for name, value in outcome.shape.items())
                print(f'robot {outcome.seed}: {line} ({shape})', flush=True)
    errors = {gait: [each.error.get(gait, math.nan) for each in outcomes] for gait in GAITS}
    bounds = [bound for each in outcomes for _, _, bound, *_ in each.stops] + [
        bound for each in outcomes for _, _, bound, _ in each.course.stops]
    print('\n' + output.markdown_table(
        ('robots', *(f'{gait}: fell, largest error of the speed' for gait in GAITS), 'stops',
         'certified', 'late', 'random commands: fell'),
        [(str(len(outcomes)), *(
            '' if options.only else f'{np.isnan(of).sum()}, {100.0 * np.nanmax(of):.1f} %'
            for of in errors.values()), str(len(bounds)), str(sum(map(math.isfinite, bounds))),
          str(sum('stop' in line for each in outcomes for line in each.wrong)),
          str(sum(bool(each.course.fell) for each in outcomes)))]))
    output.write_results(options.json, [asdict(outcome) for outcome in outcomes])
    return int(any(outcome.wrong for outcome in outcomes))


if __name__ == '__main__':
    sys.exit(main())
