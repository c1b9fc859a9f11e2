# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``learn``: from demonstrations to the weights of a discrete or rhythmic primitive."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np

from dmp_cpg_ros.commands.demonstration_files import read_demonstration
from dmp_cpg_ros.commands.ros_arguments import (
    RosArguments,
    number,
    run_command,
    within,
)
from dmp_cpg_ros.commands.walked_motion import read_motion
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.learning import discrete, period, rhythmic
from dmp_cpg_ros.core.learning.learning import METHODS, FitOptions, ranges
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.primitives.spring_damper import FORMS
from dmp_cpg_ros.core.transformation.learned_motion import LearnedMotion, learn_motion
from dmp_cpg_ros.primitive_files import save_primitive
from dmp_cpg_ros.strict_yaml import naming

Primitive = DiscretePrimitive | RhythmicPrimitive

_EXAMPLES = """\
files:
  CSV    first column time [s]; the others NAME, and NAME_velocity, NAME_acceleration if recorded
  .npy   array (m, 1 + n), first column time [s]
  .npz   arrays times (m,), positions (m, n); velocities, accelerations, names if there are any
  bag    rosbag2 folder (MCAP or SQLite) or a run's folder; joint names from JointState messages

examples:
  learn reach.csv --out reach.yaml
  learn first.csv second.csv --bases auto --out reach.yaml
  learn runs/latest --motion my_walk.yaml
  learn runs/latest --kind rhythmic --joints fl_hip,fl_knee --start 5 --end 9 --out trot.yaml
"""


PERIODS, RIDGES, OVERLAPS = (1e-3, 1e4), (0.0, 1e3), (1e-3, 0.999)
"""Least and largest numbers that may be asked for: periods [s]; shares."""

DAMPINGS, STIFFNESSES = (1e-3, 1e6), (1e-6, 1e12)
"""The same of the spring [1/s], [1/s^2]; those of critical springs belong together."""

_NOT_OF_A_WALK = ('out', 'kind', 'period', 'joints', 'start', 'end', 'positions_only', 'method',
                  'ridge', 'overlap', 'form')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    return run_command(_parser(), arguments, _main)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='learn', epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
        description='Learn a discrete or rhythmic movement primitive from demonstrations.')
    add = parser.add_argument
    add('demonstrations', metavar='DEMO', nargs='+', type=Path, help='CSV or NumPy file, or bag')
    add('--out', metavar='FILE', type=Path, help='YAML file to write')
    add('--motion', metavar='FILE', type=Path,
        help='YAML file to write with what all feet do in a recorded walk, for walk --motion')
    add('--robot', metavar='FILE', type=Path,
        help='robot that walked, for --motion (default: the one of the run)')
    add('--kind', choices=('discrete', 'rhythmic'), default='discrete', help='default: discrete')
    add('--bases', type=_bases, default=25,
        help="number of bases, or 'auto' to choose it by the held-out error (default: 25)")
    add('--period', metavar='S', type=within(*PERIODS),
        help='period of a rhythm [s], {:g} to {:g} (default: found from data)'.format(*PERIODS))
    add('--joints', metavar='A,B', type=_words, default=(), help='joints to take (default: all)')
    add('--topic', help='topic of a bag (default: joint_states; joint_targets for --motion)')
    add('--start', metavar='S', type=number, help='take samples from here on, after the first [s]')
    add('--end', metavar='S', type=number, help='take samples up to here, after the first [s]')
    add('--positions-only', action='store_true', help='leave recorded derivatives aside')
    add('--method', choices=METHODS, default=METHODS[0], help='what is fitted: '
        'response, the movement that the weights cause (default); joint, the force that it needs, '
        'all bases at once; local, the same force, each basis by itself')
    add('--ridge', type=within(*RIDGES), default=FitOptions.ridge, metavar='R',
        help='regularisation of the weights, relative to the mean square of their regressors, '
        '{:g} to {:g} (default: %(default)g)'.format(*RIDGES))
    add('--overlap', type=within(*OVERLAPS), metavar='SHARE',
        help='value of a basis at the centre of its neighbour, {:g} to {:g} (default: suits kind '
        'and method)'.format(*OVERLAPS))
    add('--stiffness', metavar='K', type=within(*STIFFNESSES),
        help='[1/s^2], {:g} to {:g} (default: suits the duration)'.format(*STIFFNESSES))
    add('--damping', metavar='B', type=within(*DAMPINGS),
        help='[1/s], {:g} to {:g} (default: critical)'.format(*DAMPINGS))
    add('--form', choices=FORMS, default=FORMS[0], help='reading of tau (default: scaled)')
    return parser


def _main(options: argparse.Namespace, _: RosArguments) -> int:
    if options.motion is not None:
        usual = _parser()
        given = [name for name in _NOT_OF_A_WALK
                 if getattr(options, name) != usual.get_default(name)]
        if given or options.bases == 'auto':
            words = [*('--' + name.replace('_', '-') for name in given),
                     *(['--bases auto'] if options.bases == 'auto' else [])]
            raise ParameterError(f'--motion does not go with {", ".join(words)}: it takes all '
                                 'feet, from what is steady walking, with so many bases')
        return _motion(options)
    if options.out is None:
        raise ParameterError('name the file to write, with --out FILE or --motion FILE')
    demonstrations = [
        read_demonstration(path, options.joints, options.topic or 'joint_states', options.start,
                           options.end) for path in options.demonstrations]
    if options.positions_only:
        demonstrations = [Demonstration(read.times, read.positions, names=read.names)
                          for read in demonstrations]
    began = perf_counter()
    with naming(', '.join(map(str, options.demonstrations))):
        try:
            with np.errstate(over='raise', invalid='raise'):
                primitive, errors = _learn(demonstrations, options)
        except (FloatingPointError, np.linalg.LinAlgError):
            raise DataError('its numbers are too large or too small to be learned') from None
    seconds = perf_counter() - began
    save_primitive(primitive, options.out)
    kind, time = (('discrete', f'duration {primitive.duration:.6g} s')
                  if isinstance(primitive, DiscretePrimitive) else
                  ('rhythmic', f'period {primitive.period:.6g} s'))
    print(f'{kind} primitive, {primitive.bases.count} bases, {time}')
    print(f'largest reproduction error in % of the range: {_listed(primitive, errors)}')
    irregular = _irregularity(demonstrations, primitive)
    if irregular is not None:
        print('the cycles themselves differ from their mean by up to: '
              f'{_listed(primitive, irregular)}')
    print(f'learned and checked in {seconds:.3g} s\nwrote {options.out}')
    return 0


def _motion(options: argparse.Namespace) -> int:
    """Learn what all feet do in recorded walks; returns the exit status."""
    read = [read_motion(path, options.topic or 'joint_targets', options.robot)
            for path in options.demonstrations]
    feet = [[part for leg in legs for part in leg]
            for legs in zip(*(feet for feet, _ in read), strict=True)]
    heights = {robot.stance_height for _, robot in read}
    if len(heights) > 1:
        raise DataError('a motion is learned from walks of one robot')
    gains = {name: value for name in ('stiffness', 'damping')
             if (value := getattr(options, name)) is not None}
    primitive, errors = learn_motion(feet, heights.pop(), options.bases, **gains)
    motion = LearnedMotion(primitive)
    save_primitive(primitive, options.motion)
    stride, side, lift = errors.reshape(-1, 3).max(axis=0)
    print(f'motion of {len(feet)} feet, {options.bases} bases, from {len(feet[0])} stretch(es) of '
          f'steady walking; lift {motion.clearance:.3g} of the standing height')
    print(f'left unexplained (root mean square): stride {100.0 * stride:.2g} % of a stride, '
          f'side {100.0 * side:.2g} % and lift {100.0 * lift:.2g} % of the standing height')
    print(f'wrote {options.motion}')
    return 0


def _learn(demonstrations: list[Demonstration], options: argparse.Namespace
           ) -> tuple[Primitive, np.ndarray]:
    fit = FitOptions(options.method, options.ridge, options.overlap)
    bases = None if options.bases == 'auto' else options.bases
    common = {'stiffness': options.stiffness, 'damping': options.damping, 'form': options.form}
    if options.kind == 'discrete':
        reach = discrete.learn_discrete(demonstrations, bases, options=fit, **common)
        return reach, discrete.reproduction_errors(reach, demonstrations)
    cycle = rhythmic.learn_rhythmic(demonstrations, bases, period=options.period, options=fit,
                                    **common)
    return cycle, rhythmic.reproduction_errors(cycle, demonstrations, options.period)


def _irregularity(demonstrations: list[Demonstration], primitive: Primitive) -> np.ndarray | None:
    """Departure of cycles from their mean, of the range; None without one recording of two."""
    first = demonstrations[0]
    if (isinstance(primitive, DiscretePrimitive) or len(demonstrations) > 1
            or first.duration < 2.0 * primitive.period):
        return None
    return period.spread_between_cycles(first, primitive.period) / ranges([first])


def _listed(primitive: Primitive, shares: np.ndarray) -> str:
    names = primitive.names or range(1, primitive.dofs + 1)
    return ', '.join(f'{name} {100.0 * e:.3g} %' for name, e in zip(names, shares, strict=True))


def _bases(text: str) -> int | str:
    if text != 'auto' and (not text.isdecimal() or int(text) < 1):
        raise argparse.ArgumentTypeError(
            f"must be a whole number of at least 1 or 'auto', not {text!r}")
    return text if text == 'auto' else int(text)


def _words(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(',') if name.strip())


if __name__ == '__main__':
    sys.exit(main())
