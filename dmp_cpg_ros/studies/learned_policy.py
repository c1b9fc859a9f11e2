# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A learned policy as a controller of the MuJoCo robot: what it observes in, joint targets out.

The network is an ONNX file of the user's. What its numbers are, a network does not say; a YAML
file of a few lines does (``config/policies``). The action is what usual policies of legged robots
have: targets q = q₀ + s a of joints that are held by stiffness and damping until the next one.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.configuration import POLICIES, find_config
from dmp_cpg_ros.core.errors import DmpCpgError, MissingFileError, ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.vec3 import rotation
from dmp_cpg_ros.core.parameters import Parameters, check_names, parameter
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file
from dmp_cpg_ros.strict_yaml import load_yaml, naming
from dmp_cpg_ros.studies.loop_recording import LoopRun


class Seen(NamedTuple):
    """What a policy may observe.

    Attributes
    ----------
    state : RobotState
        Of the robot, as it is.
    joints : ndarray (12,)
        Places of the policy's joints among those of the state.
    action : ndarray (12,)
        Its last one.
    command : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    """

    state: RobotState
    joints: Array
    action: Array
    command: tuple[float, float, float]


def _velocity(file: PolicyFile, seen: Seen) -> Array:
    state = seen.state
    return state.base_velocity_in_base + np.cross(state.base_rate_in_base, file.sensor_in_base)


TERMS: dict[str, Callable[[PolicyFile, Seen], Any]] = {
    'linear_velocity': _velocity,
    'angular_velocity': lambda file, seen: seen.state.base_rate_in_base,
    'gravity': lambda file, seen: [-z for z in rotation(seen.state.base_quaternion.tolist())[2]],
    'joint_position': lambda file, seen: seen.state.joint_position[seen.joints] - file.pose,
    'joint_velocity': lambda file, seen: seen.state.joint_velocity[seen.joints],
    'last_action': lambda file, seen: seen.action,
    'command': lambda file, seen: seen.command,
}
"""Parts of an observation: of the base [m/s], [rad/s], the direction of gravity in it, angles from
q₀ [rad] and their rates [rad/s], what the network said last, and what is asked of it.
"""


@dataclass(frozen=True)
class PolicyFile(Parameters):
    """What the numbers of a network are."""

    network: str = parameter('', 'ONNX file with an input (1, n) and an output (1, 12)')
    period: float = parameter(
        0.02, 'time for which an output holds', 0.001, 1.0, unit='s')
    joints: tuple[str, ...] = parameter(('',), "joints of the model in the network's order")
    pose: tuple[float, ...] = parameter((0.0,), 'q₀ in that order', -10.0, 10.0, unit='rad')
    action_scale: float = parameter(1.0, 's', 1e-6, 10.0, unit='rad')
    stiffness: float = parameter(1.0, 'that holds the joints', 1e-3, 1e4, unit='N m/rad')
    damping: float = parameter(
        0.0, "that holds them beside that of the model's joints", 0.0, 1e3, unit='N m s/rad')
    observation: tuple[str, ...] = parameter(
        ('',), "parts of the observation in the network's order", choices=tuple(TERMS))
    sensor_in_base: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0), 'where the velocity is observed', -10.0, 10.0, unit='m')
    cycle: float = parameter(
        0.5, 'length of a cycle of its gait, over which phases are spread', 0.05, 5.0, unit='s')

    def __post_init__(self) -> None:
        """Check how many entries lists have."""
        super().__post_init__()
        for name, count in (('joints', 12), ('pose', 12), ('sensor_in_base', 3)):
            if len(getattr(self, name)) != count:
                raise ParameterError(f"parameter '{name}' must list {count} entries, not "
                                     f'{len(getattr(self, name))}')

    @property
    def period_ns(self) -> int:
        """The period [ns]."""
        return round(1e9 * self.period)


_REQUIRED = ('network', 'period', 'joints', 'pose', 'action_scale', 'stiffness', 'observation')


def load_policy(path: str | Path, network: str | Path | None = None) -> PolicyFile:
    """Read the description of a policy.

    Parameters
    ----------
    path : str or Path
        YAML file as in ``config/policies``.
    network : str or Path, optional
        ONNX file instead of the one that it names, which is relative to itself.

    Raises
    ------
    MissingFileError
        If the file or the network does not exist.
    DataError, ParameterError
        If it is no such description.
    """
    path = find_config(path, POLICIES)
    with naming(path):
        content = load_yaml(path)
        check_names(content, PolicyFile.__dataclass_fields__, _REQUIRED, f"policy '{path}'")
        file = PolicyFile.from_mapping(content)
    onnx = Path(network) if network else path.parent / os.path.expanduser(file.network)
    if not onnx.is_file():
        raise MissingFileError(f"policy '{path}': there is no network '{onnx}'")
    return replace(file, network=str(onnx.resolve()))


class PolicyTick(NamedTuple):
    """What a tick of a policy gives."""

    targets: JointTargets


class PolicyLoop:
    """A policy in the place of the walking loop.

    Parameters
    ----------
    file : PolicyFile
        What the numbers of the network are.
    robot : RobotFile
        The robot, whose joints it names.

    Raises
    ------
    ParameterError
        If the policy's joints are not those of the robot.
    DmpCpgError
        If the network cannot be loaded, or takes or gives other numbers.
    """

    def __init__(self, file: PolicyFile, robot: RobotFile) -> None:
        names = [name for leg in robot.joints for name in leg]
        if sorted(names) != sorted(file.joints):
            raise ParameterError(f"the policy's joints {', '.join(file.joints)} are not those of "
                                 f"the robot: {', '.join(names)}")
        self.file = file
        self._joints = np.array([names.index(name) for name in file.joints])
        self._order = np.argsort(self._joints)
        self._action, self._targets, self._due_ns = np.zeros(12), np.zeros(12), -1
        self._command = (0.0, 0.0, 0.0)
        network_of(file.network)

    def command(self, v_x: float, v_y: float = 0.0, gamma: float = 0.0) -> None:
        """Command a velocity [m/s], [rad/s]; acts from its next output on."""
        self._command = (v_x, v_y, gamma)

    def observed(self, state: RobotState) -> Array:
        """Observation of a state, (n,)."""
        seen = Seen(state, self._joints, self._action, self._command)
        return np.concatenate([
            np.asarray(TERMS[name](self.file, seen), dtype=float) for name in
            self.file.observation])

    def tick(self, state: RobotState) -> PolicyTick:
        """Targets of a tick: those of the last output until its time is over."""
        if state.time_ns >= self._due_ns:
            self._due_ns = state.time_ns + self.file.period_ns
            self._action = network_of(self.file.network)(self.observed(state))
            wanted = np.array(self.file.pose) + self.file.action_scale * self._action
            self._targets = wanted[self._order]
        return PolicyTick(JointTargets(self._targets, np.zeros(12), np.zeros(12)))


class PolicyRun(LoopRun[PolicyLoop]):
    """A policy on a robot whose drives hold the joints as it is used to.

    Parameters
    ----------
    file : PolicyFile
        The policy.
    robot : str or Path
        Robot file.
    tick_ns : int
        Control tick [ns], of which the policy's period is a whole multiple.
    """

    def __init__(self, file: PolicyFile, robot: str | Path, tick_ns: int = 4_000_000) -> None:
        if file.period_ns % tick_ns:
            raise ParameterError(f'period: {1e-9 * file.period_ns:g} s is no whole multiple of '
                                 f'the tick of {1e-9 * tick_ns:g} s')
        of_robot = load_robot_file(robot)
        held = replace(of_robot, kp=(file.stiffness,) * 3, kd=(file.damping,) * 3)
        super().__init__(MujocoRobot(held, tick_ns), PolicyLoop(file, of_robot))

    def period(self) -> float:
        """Length of a cycle [s]."""
        return self.loop.file.cycle

    def stop(self) -> None:
        """Ask for a stop: a policy knows no other than to be told to walk at no speed."""
        self.loop.command(0.0)


@lru_cache
def network_of(path: str) -> Callable[[Array], Array]:
    """Load a network: a function of an observation (n,) that gives an action (12,).

    Raises
    ------
    DmpCpgError
        If the library is missing, or the file is no network of one input and one output.
    """
    try:
        import onnxruntime
    except ImportError:
        raise DmpCpgError('a policy needs onnxruntime: pip install onnxruntime') from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4  # what it has to say comes as an exception
    try:
        session = onnxruntime.InferenceSession(
            path, options, providers=['CPUExecutionProvider'])
    except Exception as error:  # noqa: BLE001 - of its own classes, which are not public
        raise DmpCpgError(f"'{path}' is no ONNX network: {_first_line(error)}") from None
    inputs, outputs = session.get_inputs(), session.get_outputs()
    if len(inputs) != 1 or len(outputs) != 1:
        raise DmpCpgError(f"'{path}' has {len(inputs)} inputs and {len(outputs)} outputs; one of "
                          'each is needed')
    return partial(_said, path, session, inputs[0].name)


def _said(path: str, session: Any, name: str, observation: Array) -> Array:
    try:
        (action,) = session.run(None, {name: observation.astype(np.float32)[None]})
    except Exception as error:  # noqa: BLE001 - as above
        raise DmpCpgError(
            f"'{path}' does not take {observation.size} numbers: {_first_line(error)}") from None
    action = np.asarray(action, dtype=float)
    if action.shape != (1, 12) or not np.isfinite(action).all():
        raise DmpCpgError(f"'{path}' must give (1, 12) finite numbers, not {action.shape}")
    return action[0]


def _first_line(error: Exception) -> str:
    return str(error).strip().partition('\n')[0]
