# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inspect_robot``: from an MJCF to the robot file with which it walks, its URDF, a picture."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.files import writable
from dmp_cpg_ros.robot.model_inspection import Inspection, inspect_model
from dmp_cpg_ros.robot.robot_file import find_model


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = argparse.ArgumentParser(prog='inspect_robot', description=(
        'Find the legs of a quadruped in an MJCF and write its robot file, which walk --robot '
        'takes.'))
    add = parser.add_argument
    add('model', metavar='FILE.xml', help='MJCF file, also as package://PACKAGE/PATH of a Python '
        'package or menagerie://ROBOT/PATH of MuJoCo Menagerie')
    add('--output', metavar='FILE.yaml', type=Path,
        help='where to write the robot file (default: print it)')
    add('--urdf', metavar='FILE.urdf', type=Path, help='write the robot as URDF too')
    add('--picture', metavar='FILE.png', type=Path, help='draw the robot with its legs in colours')
    return run_command(parser, arguments, _inspect)


def _inspect(options: argparse.Namespace, _: RosArguments) -> int:
    if Path(options.model).suffix in ('.yaml', '.yml'):
        raise ParameterError(f"'{options.model}' is YAML; inspect_robot reads MJCF (.xml), and "
                             'writes the robot file (.yaml)')
    found = inspect_model(find_model(options.model, Path.cwd()))
    asked = options.model if '://' in options.model else None
    if options.output is None:
        print(robot_yaml(found, name=asked), end='')
    else:
        writable(options.output).write_text(
            robot_yaml(found, options.output.parent, asked), encoding='utf-8')
    if options.urdf is not None:
        from dmp_cpg_ros.robot.urdf import urdf

        writable(options.urdf).write_text(urdf(found.file), encoding='utf-8')
    if options.picture is not None:
        from matplotlib import image

        from dmp_cpg_ros.robot.camera import leg_picture

        image.imsave(writable(options.picture), leg_picture(found.file))
    print(summary(found), file=sys.stderr if options.output is None else sys.stdout)
    return 0


def robot_yaml(found: Inspection, folder: Path | None = None, name: str | None = None) -> str:
    """Robot file of what was found, as text of at most 15 lines.

    Parameters
    ----------
    found : Inspection
        What :func:`~dmp_cpg_ros.robot.model_inspection.inspect_model` returned.
    folder : Path, optional
        Where the file will be; the model is then named relative to it when it lies below it.
    name : str, optional
        Name of the model, where it has one.
    """
    file = found.file
    joints = (f'  {leg}: [{", ".join(names)}]\n'
              for leg, names in zip(LEGS, file.joints, strict=True))
    feet = ', '.join(f'{leg}: {foot}' for leg, foot in zip(LEGS, file.feet, strict=True))
    return (
        f'# Found by inspect_robot in {file.model.name}; everything else is read from the model.\n'
        f'model: {name or model_name(file.model, folder)}\nbase: {file.base}\njoints:\n'
        f'{"".join(joints)}feet: {{{feet}}}\n')


def model_name(model: Path, folder: Path | None) -> str:
    """Name of a model in a robot file: inside a Python package, relative, or its full path."""
    for root in (Path(entry).resolve() for entry in sys.path if entry):
        if root.name in ('site-packages', 'dist-packages') and model.is_relative_to(root):
            return f'package://{model.relative_to(root).as_posix()}'
    if folder is not None and model.is_relative_to(folder.resolve()):
        return os.path.relpath(model, folder.resolve())
    return str(model)


def summary(found: Inspection) -> str:
    """What was found, in a few lines for people."""
    d, legs = found.description, found.description.legs
    knees = {'forwards' if leg.knee_sign > 0 else 'backwards' for leg in legs}
    lengths = [sum((part @ part) ** 0.5 for part in (leg.thigh, leg.shank)) for leg in legs]
    limits, kp, kd = (', '.join(f'{value:.{digits}f}' for value in values) for values, digits in (
        (legs[0].torque_limit, 1), (d.kp, 0), (d.kd, 1)))
    others = f'\njoints of no leg, left alone: {", ".join(found.others)}' if found.others else ''
    return (
        f'{d.name}: four legs, {d.mass:.1f} kg, base {d.stance_height:.3f} m over the ground when '
        f'it stands\nlegs of {sum(lengths) / 4:.3f} m, knees bend {" and ".join(sorted(knees))}, '
        f'feet of {1e3 * legs[0].foot_radius:.0f} mm radius\ntorque limits {limits} N m; drive '
        f'gains {kp} N m/rad, {kd} N m s/rad{others}')


if __name__ == '__main__':
    sys.exit(main())
