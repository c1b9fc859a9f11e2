# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo: joint drive at the physics rate, noisy sensors, clock, pushes."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.maths.vec3 import rotation
from dmp_cpg_ros.core.modes.falls import FALLEN_HEIGHT_SHARE, FALLEN_TILT
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, RobotState
from dmp_cpg_ros.core.robot_model.world import height_over_ground
from dmp_cpg_ros.core.scenario.push import HOLD_NS, PushForce, PushQueue
from dmp_cpg_ros.robot import model_parts
from dmp_cpg_ros.robot.footing import Footing
from dmp_cpg_ros.robot.joint_drive import JointDrive
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.port import RobotError, steps_per_tick
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file
from dmp_cpg_ros.robot.start_pose import UPRIGHT, StartPose, home_joint_position, start_pose_of

STREAM = 1
"""Tells the sensors' random numbers from others of the same seed."""


class SensorNoise:
    """Noise of one robot's sensors; the same seed gives the same noise.

    Parameters
    ----------
    parameters : SensorParameters
        How good the sensors are.
    seed : int
        Seed of noise and biases.
    tick_ns : int
        Time between two readings [ns]: a density n gives deviations n / √tick.
    """

    def __init__(self, parameters: SensorParameters, seed: int, tick_ns: int) -> None:
        """Scale the deviations: gyroscope, accelerometer, joint angles, joint velocities."""
        p, root = parameters, (tick_ns * 1e-9) ** -0.5
        self._seed = seed
        self._deviation = p.sensor_noise * np.repeat(
            (p.gyro_noise_density * root, p.accelerometer_noise_density * root, p.encoder_noise,
             p.joint_velocity_noise), (3, 3, 12, 12))
        self._bias_deviation = p.sensor_noise * np.repeat((p.gyro_bias, p.accelerometer_bias), 3)
        self.reset()

    def reset(self) -> None:
        """Draw the biases, and begin the noise anew."""
        self._random = np.random.default_rng((self._seed, STREAM))
        self._bias = self._bias_deviation * self._random.standard_normal(6)

    def measured(self, state: RobotState) -> RobotState:
        """State as the sensors tell it; what is no sensor's stays the truth.

        Without any noise the numbers are the truth's, bit for bit.
        """
        noise = self._deviation * self._random.standard_normal(30)
        noise[:6] += self._bias
        return replace_unchecked(
            state, joint_position=state.joint_position + noise[6:18],
            joint_velocity=state.joint_velocity + noise[18:],
            acceleration_in_base=state.acceleration_in_base + noise[3:6],
            gyro_in_base=state.measured_rate_in_base + noise[:3])


LYING_HEIGHT_SHARE = 0.7  # on rough ground a belly that brushes an edge above this has not fallen
LYING_TILT = np.deg2rad(40.0)
INITIAL_PENETRATION = 1e-5  # [m] without any there would be no contact at the first stamp


class MujocoRobot:
    """A quadruped in MuJoCo behind the port ``Robot``.

    Two runs from ``reset`` with the same targets are identical bit for bit. Contact forces and
    efforts are those of the last physics step before the stamp; the accelerometer's reading is
    its mean over the tick, as a sensor gives that samples faster and filters before it reports.
    Work and the largest torques are taken at every physics step: most of what the drive does
    about a new target is over at the next stamp.

    Parameters
    ----------
    robot_file : RobotFile, Path, str or None
        The robot; None is the package's own.
    tick_ns : int
        Control tick [ns]; a whole multiple of the model's physics step.
    seed : int
        Seed of the initial spread.
    initial_spread : float
        The joints start at the home pose plus a uniform draw from ± this [rad].
    initial_height : float, optional
        Height of the base at the start [m]; by default its feet touch the ground.
    world : World, optional
        What it walks on; by default the flat floor.
    sensors : SensorParameters, optional
        Noise of the sensors, from the same seed; by default they are perfect.
    start_pose : str
        ``standing``, ``lying`` (on the belly) or ``fallen`` (somehow, by the seed).
    mismatch : MismatchParameters, optional
        How it differs from ``description``, which is what controllers know; by default nowhere.

    Attributes
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    base : int
        Its base among the model's bodies.
    without_power : tuple of str
        Legs whose drives give no torque, whatever they are told.

    Raises
    ------
    MissingFileError, ParameterError
        If files, model or numbers cannot be used.
    """

    def __init__(self, robot_file: RobotFile | Path | str | None = None, tick_ns: int = 4_000_000,
                 seed: int = 0, initial_spread: float = 0.0,
                 initial_height: float | None = None, world: World | None = None,
                 sensors: SensorParameters | None = None, start_pose: str = 'standing',
                 mismatch: MismatchParameters | None = None) -> None:
        file = load_robot_file(robot_file)
        self.world = world = world or World()
        self.model = model = load_model(file.model, file.base, world)
        # what the controllers know of the robot does not depend on the world, not in the last bit
        self.description: RobotDescription = read_description(
            model if world == World() else load_model(file.model, file.base), file)
        self.tick_ns, self._step_s = tick_ns, model.opt.timestep
        self._step_ns = round(self._step_s * 1e9)
        self._steps = steps_per_tick(tick_ns, self._step_ns)
        # A silent restart of the simulation on bad numbers would look like a jump of the robot.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self._ids = ids = model_parts.find_ids(model, file)
        self.base = ids.base
        self._qpos = model_parts.as_slice(model.jnt_qposadr[ids.joints])
        self._dof = model_parts.as_slice(model.jnt_dofadr[ids.joints])
        self._gravity = model.opt.gravity.copy()
        self._actuators = model_parts.JointActuators(model, ids.joints)
        self._drive = JointDrive(
            self.description, self._steps, self._step_s, model.dof_damping[self._dof])
        mismatch = mismatch or MismatchParameters()
        self._strength = np.array(mismatch.joint_strength)
        self.without_power: tuple[str, ...] = ()
        if mismatch != MismatchParameters():
            model_parts.differ(model, ids, self._dof, mismatch, self.description.mass)
        self._contacts = model_parts.ContactReader(model, ids)
        surface = world.surface()
        self._footing = None if surface is None else Footing(model, ids, surface)
        self._hips_in_base = np.array([leg.hip_in_base for leg in self.description.legs])
        if not (np.isfinite(initial_spread) and initial_spread >= 0.0):
            raise ParameterError(f'initial_spread = {initial_spread!r} must be at least 0 rad')
        self._sensors = None if sensors is None else SensorNoise(sensors, seed, tick_ns)
        if start_pose == 'standing':
            spread = np.random.default_rng(seed).uniform(-1.0, 1.0, 12) * initial_spread
            height = self.description.stance_height - INITIAL_PENETRATION
            self._start = StartPose(
                np.array((0.0, 0.0, height if initial_height is None else initial_height)),
                UPRIGHT, home_joint_position(self.description) + spread)
        else:
            self._start = start_pose_of(start_pose, self.description, seed)
        self.data = mujoco.MjData(model)
        # Whole arrays for all physics steps of a tick: NumPy takes five times as long for
        # operands of different shapes, and for parts of rows.
        steps = self._steps
        self._damping, self._friction, self._gravity_of_steps, self._nothing = (
            np.tile(of, (steps, 1)) for of in (
                model.dof_damping[self._dof], model.dof_frictionloss[self._dof], self._gravity,
                np.zeros(12)))
        self._torques = np.zeros((steps, 12))
        self._rotations = np.zeros((steps, 3, 3))  # of the base at the begin of each
        self._rates = np.zeros((steps + 1, 12))  # of the joints before each, after the last
        self._velocities = np.zeros((steps + 1, 3))  # of the base, likewise
        self.reset()

    def reset(self, time_ns: int = 0) -> RobotState:
        """Be in the start pose at a time, whole ticks from 0 [ns].

        A standing robot is in its home pose, held by the torques that standing takes; the other
        poses come to rest before that time.
        """
        data, model, start = self.data, self.model, self._start
        self._push_force, self._push_steps, self._pushes = np.zeros(3), -1, PushQueue()
        self._tick, self._work, self._loss = 0, np.zeros(12), np.zeros(12)
        mujoco.mj_resetData(model, data)
        self._drive.reset()
        if self._sensors is not None:
            self._sensors.reset()
        held = start.joint_position
        model_parts.place_robot(
            model, data, self._ids, start.base_position, start.base_quaternion, held)
        if self._footing is not None:
            self._footing.follow(data)
        mujoco.mj_forward(model, data)
        if start.settling_s:
            for _ in range(round(start.settling_s * 1e9 / self.tick_ns)):
                state = self.step(JointTargets(held, np.zeros(12), np.zeros(12)))
                held = state.joint_position if start.limp else held
            self._drive.reset()
            self._work, self._loss = np.zeros(12), np.zeros(12)
        else:
            holding = model_parts.standing_torque(model, data, self._ids, self._dof)
            self._effort = self._strength * self._drive.limited(holding, np.zeros(12))
            self._peak_effort = np.abs(self._effort)
            inputs, where, per_torque = self._actuators.inputs(data)
            inputs[where] = self._effort * per_torque
            mujoco.mj_forward(model, data)
            # As held at rest: the first instant of the contacts is nothing a sensor would show.
            self._specific_force = -self._gravity @ data.xmat[self.base].reshape(3, 3)
        self._tick, data.time = time_ns // self.tick_ns, time_ns * 1e-9
        return self._state()

    def step(self, targets: JointTargets) -> RobotState:
        """Advance by one control tick.

        Raises
        ------
        DataError
            If the targets have another shape than (12,) or are not finite.
        RobotError
            If the simulation leaves the finite numbers.
        """
        self._drive.accept(targets)
        self._begin_push()
        if self._footing is not None:
            self._footing.follow(self.data)
        model, data, torque, strength = self.model, self.data, self._drive.torque, self._strength
        if self.without_power:
            strength = strength * [leg not in self.without_power for leg in np.repeat(LEGS, 3)]
        # views, asked for once: each look at MuJoCo's data costs as much as a call
        qpos, qvel, step, q, dof = data.qpos, data.qvel, mujoco.mj_step, self._qpos, self._dof
        velocity = qvel[self._ids.base_dof:self._ids.base_dof + 3]
        R_world_base = data.xmat[self.base].reshape(3, 3)  # of the step's begin
        inputs, where, per_torque = self._actuators.inputs(data)
        torques, rates, velocities = self._torques, self._rates, self._velocities
        for i in range(self._steps):
            velocities[i] = velocity
            rate, effort = rates[i], torques[i]
            rate[:] = qvel[dof]
            np.multiply(strength, torque(i, qpos[q], rate), effort)
            inputs[where] = effort * per_torque
            if self._push_steps >= 0:
                self._push_on()
            step(model, data)
            self._rotations[i] = R_world_base
        self._effort, rates[-1], velocities[-1] = torques[-1].copy(), qvel[dof], velocity
        self._tick += 1
        if not isfinite(qpos.dot(qpos) + qvel.dot(qvel)):
            raise RobotError('the simulation became unstable in the tick that ends at '
                             f'{self._tick * self.tick_ns * 1e-9:.3f} s; lower the gains kp and '
                             'kd or the physics step')
        self._specific_force = self._mean_specific_force()
        # Over a physics step the torque is constant and the velocity changes evenly: with their
        # mean the work is what the step adds to the kinetic energy.
        mean = 0.5 * (rates[1:] + rates[:-1])
        power = np.add.reduce(np.maximum(torques * mean, self._nothing))
        self._work = self._work + power * self._step_s
        lost = np.add.reduce(self._damping * mean * mean + self._friction * np.abs(mean))
        self._loss = self._loss + lost * self._step_s
        self._peak_effort = np.maximum.reduce(np.abs(torques))
        return self._state()

    def _mean_specific_force(self) -> Array:
        """What an accelerometer in the base felt in the mean over the tick, (3,) [m/s^2]."""
        velocity = self._velocities
        felt = (velocity[1:] - velocity[:-1]) / self._step_s - self._gravity_of_steps
        in_base = felt[:, None, :] @ self._rotations  # (steps, 1, 3)
        mean: Array = np.add.reduce(in_base)[0] / self._steps
        return mean

    def apply_push(self, force_in_world: Array, duration_ns: int) -> None:
        """Push the base's centre of mass with a force [N] from now on, for whole physics steps.

        Raises
        ------
        ParameterError
            If the force is not three finite numbers, or the duration not a positive multiple of
            the physics step.
        """
        force = np.array(force_in_world, dtype=float)
        if force.shape != (3,) or not np.isfinite(force).all():
            raise ParameterError(f'a push must be three finite numbers, not {force}')
        self._push_steps = steps_per_tick(duration_ns, self._step_ns)
        self._push_force = force

    def take_push(self, force: PushForce) -> None:
        """Let a force act from its time on, for ``HOLD_NS`` or until the next one; raises
        DataError as :meth:`~dmp_cpg_ros.core.scenario.push.PushQueue.add`.
        """
        self._pushes.add(force, self._tick * self.tick_ns)

    def _begin_push(self) -> None:
        """Start the force whose time has come at the beginning of this tick."""
        force = self._pushes.due(self._tick * self.tick_ns)
        if force is not None:
            steps = -(-HOLD_NS // self._step_ns)
            self.apply_push(force.in_world(_xyzw(self._base_pose[3:])), steps * self._step_ns)

    def _push_on(self) -> None:
        """Set the force of one physics step of a push; after the last one it is zero."""
        self.data.xfrc_applied[self.base, :3] = self._push_force if self._push_steps else 0.0
        self._push_steps -= 1

    @property
    def _base_pose(self) -> Array:
        """Position and quaternion (w, x, y, z) of the base, a view of (7,)."""
        pose: Array = self.data.qpos[self._ids.base_qpos:self._ids.base_qpos + 7]
        return pose

    @property
    def fallen(self) -> bool:
        """Whether the base is below half its height over the ground, tilted by over 60°, or lies
        on the ground.
        """
        R_world_base = _rotation(self._base_pose[3:])
        height = self.height_over_ground / self.description.stance_height
        upright = float(R_world_base[2, 2])  # cosine between the base's z and the world's
        lies = self._contacts.base_touches(self.data) and (
            self.world.is_flat or height < LYING_HEIGHT_SHARE or upright < np.cos(LYING_TILT))
        return bool(height < FALLEN_HEIGHT_SHARE or upright < np.cos(FALLEN_TILT) or lies)

    @property
    def height_over_ground(self) -> float:
        """Height of the base over the ground below its hips, or below its feet where that is
        lower, as in front of a block that its hips are over [m].
        """
        place, quaternion = self._base_pose[:3], self._base_pose[3:]
        if self.world.is_flat:
            return float(place[2])
        hips = place + self._hips_in_base @ _rotation(quaternion).T
        feet = np.array([model_parts.foot_position(self.data, foot) for foot in self._ids.feet])
        return max(float(height_over_ground(self.world, place, at)) for at in (hips, feet))

    def _state(self) -> RobotState:
        qpos, qvel, at, d = self.data.qpos, self.data.qvel, self._ids.base_qpos, self._ids.base_dof
        w, x, y, z = qpos[at + 3:at + 7].tolist()
        quaternion = (x, y, z, w)
        state = RobotState(
            time_ns=self._tick * self.tick_ns,
            joint_position=qpos[self._qpos].copy(),
            joint_velocity=qvel[self._dof].copy(), joint_effort=self._effort,
            base_position_in_world=qpos[at:at + 3].copy(), base_quaternion=np.array(quaternion),
            base_velocity_in_base=qvel[d:d + 3].dot(np.array(rotation(quaternion))),
            base_rate_in_base=qvel[d + 3:d + 6].copy(), acceleration_in_base=self._specific_force,
            foot_force=self._contacts.foot_force(self.data),
            joint_work=self._work, joint_peak_effort=self._peak_effort, joint_loss=self._loss)
        return state if self._sensors is None else self._sensors.measured(state)


def _xyzw(quaternion: Array) -> Array:
    """Quaternion x, y, z, w of one in MuJoCo's order."""
    w, x, y, z = quaternion.tolist()
    return np.array((x, y, z, w))


def _rotation(quaternion: Array) -> Array:
    """Rotation matrix (3, 3) of a quaternion w, x, y, z."""
    return np.array(rotation(_xyzw(quaternion).tolist()))
