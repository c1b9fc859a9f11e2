# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Between the suite's messages and the core's arrays.

Values pass bit for bit. What enters is taken by name and checked;
:class:`~dmp_cpg_ros.core.errors.DataError` is raised for what must not enter. The robot's state is
in :mod:`~dmp_cpg_ros.nodes.messages.robot_state`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import Any, TypeAlias

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros import layouts
from dmp_cpg_ros.core.balance.body_command import MODES, BodyCommand
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits, shares_of
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.inhibition.step_timing import QUICKEST
from dmp_cpg_ros.core.parameters import range_of
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS, JointTargets
from dmp_cpg_ros.core.scenario.push import FRAMES, PushForce
from dmp_cpg_ros.core.suite_parameters import INHIBITION
from dmp_cpg_ros.core.voting.parameters import VotingParameters
from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.joint_states import JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.messages.robot_state import BASE_FRAME
from dmp_cpg_ros.nodes.messages.values import Array, checked_numbers, header_ns, status_message

AnyJointState: TypeAlias = JointState | cdr.SerializedJointState

DRIVE_MODES = ('following', 'stand', 'lie', 'damp')
"""What ``drive_mode`` can say."""

_OSCILLATORS = slice(0, len(layouts.OSCILLATOR_ROWS))
_GAITS = slice(_OSCILLATORS.stop, None)
_JOINTS = slice(0, len(JOINT_NAMES))
_FEET = slice(_JOINTS.stop, _JOINTS.stop + len(layouts.SHIFT_ROWS))
_BASE = slice(_FEET.stop, _FEET.stop + len(layouts.CORRECTION_ROWS))
_MARGINS = slice(_BASE.stop, _BASE.stop + len(layouts.MARGIN_ROWS))
_PROGRESS = slice(_MARGINS.stop, _MARGINS.stop + len(layouts.PROGRESS_ROWS))
_FELT = slice(_PROGRESS.stop, _PROGRESS.stop + len(layouts.FELT_ROWS))
_COMMAND = slice(_FELT.stop, None)


def read_twist(message: Twist) -> tuple[float, float, float]:
    """(v_x, v_y, γ) of a velocity command [m/s, m/s, rad/s]; raises DataError."""
    linear, angular = message.linear, message.angular
    v_x, v_y, gamma = linear.x, linear.y, angular.z
    checked_numbers((v_x, v_y, gamma, linear.z, angular.x, angular.y), 'velocity')
    return v_x, v_y, gamma


def read_push_force(message: WrenchStamped) -> PushForce:
    """Force of a push with its time and frame; raises DataError."""
    force, torque = message.wrench.force, message.wrench.torque
    x, y, z = checked_numbers((force.x, force.y, force.z), 'force of the push')
    if (torque.x, torque.y, torque.z) != (0.0, 0.0, 0.0):
        raise DataError('push: only a force can act, the torque must be zero')
    return PushForce(header_ns(message), (x, y, z), message.header.frame_id or FRAMES[0])


class ReferenceWriter:
    """Writes ``reference``."""

    def __init__(self) -> None:
        """Lay the message out."""
        self._message = cdr.RefilledMessage(BASE_FRAME)
        self._message.refilled(reference=6)
        self._numbers = np.zeros(6)

    def fill(self, time_ns: int, r: Array) -> cdr.SerializedTwist:
        """Refill with r = (v_x, v_y, γ), ndarray (3,); raises DataError when it is not finite."""
        self._numbers[:2], self._numbers[5] = r[:2], r[2]
        return cdr.SerializedTwist(self._message.filled(time_ns, self._numbers))


def read_reference(message: TwistStamped | cdr.SerializedTwist) -> Array:
    """Reference r = (v_x, v_y, γ), ndarray (3,) [m/s, m/s, rad/s]; raises DataError."""
    if isinstance(message, cdr.SerializedTwist):
        numbers = checked_numbers(message.numbers, 'velocity')
        return np.array((numbers[0], numbers[1], numbers[5]))
    return np.array(read_twist(message.twist))


class CanonicalStateWriter:
    """Writes ``canonical_state``.

    Parameters
    ----------
    gaits : sequence of str
        Names of all gaits that are known.
    """

    def __init__(self, gaits: Sequence[str]) -> None:
        """Lay the message out."""
        self._gaits, rows = tuple(gaits), layouts.canonical_rows(gaits)
        self._writer = JointStateWriter(rows, cdr.FIELDS[:2])
        self._position, self._velocity = np.zeros((2, len(rows)))

    def fill(self, time_ns: int, x: Array, x_dot: Array, gait: GaitInForce,
             cadence_rate: float = 0.0) -> cdr.SerializedJointState:
        """Refill.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        x, x_dot : ndarray (4, 2)
            States and rates [1/s].
        gait : Gait or BlendedGait
            In which the phases are to be read.
        cadence_rate : float
            Rate of the factor on the cadence [1/s].

        Raises
        ------
        DataError
            If a number is not finite.
        """
        self._position[_OSCILLATORS] = x.reshape(-1)
        self._velocity[_OSCILLATORS] = x_dot.reshape(-1)
        self._position[_GAITS], self._velocity[_GAITS] = layouts.gait_rows(
            shares_of(gait), cadence_rate, self._gaits)
        return self._writer.fill(time_ns, self._position, self._velocity)


class CanonicalStateReader:
    """Reads ``canonical_state``.

    Parameters
    ----------
    gaits : KnownGaits
        All gaits that are known.
    """

    def __init__(self, gaits: KnownGaits) -> None:
        """Prepare the order."""
        rows = layouts.canonical_rows(gaits.gaits)
        self._gaits, self._names = gaits, rows[_GAITS]
        self._reader = JointStateReader(rows, cdr.FIELDS[:2])
        self._last: tuple[bytes, GaitInForce] | None = None

    def read(self, message: AnyJointState) -> tuple[Array, Array, GaitInForce]:
        """States x and rates ẋ [1/s], ndarrays (4, 2), and the gait in force, the same object
        while it stays; raises DataError.
        """
        position, velocity = self._reader.read(message)
        shares, rates = position[_GAITS], velocity[_GAITS]
        content = shares.tobytes() + rates.tobytes()
        if self._last is None or content != self._last[0]:
            given = layouts.read_gait_rows(self._names, shares.tolist(), rates.tolist())
            self._last = content, self._gaits.in_force(given)
        x, x_dot = (values[_OSCILLATORS].reshape(len(LEGS), 2) for values in (position, velocity))
        return x, x_dot, self._last[1]


class GaitMemoryWriter:
    """Writes ``gait_memory``.

    Parameters
    ----------
    gaits : sequence of str
        Names of all gaits that are known.
    """

    def __init__(self, gaits: Sequence[str]) -> None:
        """Lay the message out."""
        self._gaits = tuple(gaits)
        self._writer = JointStateWriter(
            (*layouts.canonical_rows(gaits), *layouts.REFERENCE_ROWS), cdr.FIELDS[:2])

    def fill(self, time_ns: int, x: Array, x_dot: Array, gait: GaitInForce, r: Array
             ) -> cdr.SerializedJointState:
        """Refill with what :class:`CanonicalStateReader` read, and r, ndarray (3,)."""
        shares, rates = layouts.gait_rows(shares_of(gait), 0.0, self._gaits)
        return self._writer.fill(time_ns, np.concatenate((x.ravel(), shares, r)),
                                 np.concatenate((x_dot.ravel(), rates, np.zeros(3))))


class GaitMemoryReader:
    """Reads ``gait_memory``.

    Parameters
    ----------
    gaits : KnownGaits
        All gaits that are known.
    """

    def __init__(self, gaits: KnownGaits) -> None:
        """Prepare the order."""
        self._canonical = CanonicalStateReader(gaits)
        self._r = JointStateReader(layouts.REFERENCE_ROWS, cdr.FIELDS[:1])

    def read(self, message: AnyJointState) -> tuple[Array, Array, GaitInForce, Array]:
        """States x and rates ẋ, ndarrays (4, 2), the gait in force, and r, ndarray (3,); raises
        DataError.
        """
        (r,) = self._r.read(message)
        return *self._canonical.read(message), r


def joints_of(leg: str, names: Sequence[str]) -> tuple[str, ...]:
    """Names of one leg's joints out of those of all."""
    first = len(JOINTS_OF_LEG) * LEGS.index(leg)
    return tuple(names[first:first + len(JOINTS_OF_LEG)])


class JointTargetsWriter:
    """Writes the ``joint_targets`` of one leg, with its own out of the names of all joints."""

    def __init__(self, leg: str, names: Sequence[str] = JOINT_NAMES) -> None:
        """Lay the message of a leg out."""
        self._writer = JointStateWriter(joints_of(leg, names))

    def fill(self, time_ns: int, targets: JointTargets) -> cdr.SerializedJointState:
        """Refill with the targets of the leg's joints; raises DataError."""
        return self._writer.fill(time_ns, targets.position, targets.velocity, targets.effort)


class JointTargetsReader:
    """Reads ``joint_targets`` of whichever leg sent them.

    Attributes
    ----------
    leg_of : dict of str to str
        Leg of each joint by its name.
    """

    def __init__(self, names: Sequence[str] = JOINT_NAMES) -> None:
        """Prepare the order of the joints of every leg."""
        self._names = names
        self._readers = {leg: JointStateReader(joints_of(leg, names)) for leg in LEGS}
        self.leg_of = {name: leg for leg in LEGS for name in joints_of(leg, names)}

    def read(self, message: AnyJointState) -> tuple[str, JointTargets]:
        """Name of the leg and its targets; raises DataError, also for names of no leg."""
        names = message.name
        leg = self.leg_of.get(names[0], '') if names else ''
        if not leg or len(names) != len(JOINTS_OF_LEG):
            raise DataError(f"names {names} must be the {len(JOINTS_OF_LEG)} joints of one leg of "
                            f"{', '.join(LEGS)}, such as {', '.join(self._names[:3])}")
        return leg, JointTargets(*self._readers[leg].read(message))


class PostureFeedbackWriter:
    """Writes ``posture_feedback``: torques and measured angles of the joints, shift, drift and
    measured forces of the feet, a velocity correction, the body's mode and its movement.
    """

    def __init__(self) -> None:
        """Lay the message out."""
        self._writer = JointStateWriter(layouts.POSTURE_ROWS)
        self._position, self._velocity, self._effort = np.zeros((3, len(layouts.POSTURE_ROWS)))

    def fill(self, time_ns: int, feedback: PostureFeedback) -> cdr.SerializedJointState:
        """Refill with a feedback; raises DataError when it is not finite."""
        self._position[_JOINTS] = feedback.measured
        self._position[_FEET] = feedback.shift_in_base.reshape(-1)
        self._velocity[_FEET].reshape(len(LEGS), 3)[:, :2] = feedback.drift_in_base
        self._velocity[_BASE] = feedback.correction
        self._position[_MARGINS] = feedback.margins
        velocity, behind = feedback.progress or Progress()
        self._position[_PROGRESS] = (*velocity, behind)
        self._position[_FELT] = feedback.felt
        self._effort[_JOINTS] = feedback.torque
        self._effort[_FEET].reshape(len(LEGS), 3)[:, 2] = feedback.foot_force
        self._position[_COMMAND], self._velocity[_COMMAND] = layouts.command_rows(feedback.command)
        return self._writer.fill(time_ns, self._position, self._velocity, self._effort)


class PostureFeedbackReader:
    """Reads ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader, self._command = JointStateReader(layouts.POSTURE_ROWS), CommandReader()

    def read(self, message: AnyJointState) -> PostureFeedback:
        """Read the feedback; raises DataError."""
        position, velocity, effort = self._reader.read(message)
        return PostureFeedback(
            effort[_JOINTS], position[_FEET].reshape(len(LEGS), 3),
            velocity[_FEET].reshape(len(LEGS), 3)[:, :2], velocity[_BASE],
            self._command.of(position[_COMMAND], velocity[_COMMAND]), position[_JOINTS],
            effort[_FEET].reshape(len(LEGS), 3)[:, 2], tuple(position[_MARGINS].tolist()),
            _progress(position[_PROGRESS]), tuple(
                felt > 0.0 for felt in position[_FELT].tolist()))


def _progress(row: Array) -> Progress:
    x, y, behind = row.tolist()
    return Progress((x, y), behind)


class CommandReader:
    """Reads what the body does out of ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(layouts.POSTURE_ROWS[_COMMAND], cdr.FIELDS[:2])
        self._last: tuple[bytes, BodyCommand] | None = None

    def read(self, message: AnyJointState) -> BodyCommand:
        """Read the command only; raises DataError."""
        return self.of(*self._reader.read(message))

    def of(self, position: Array, velocity: Array) -> BodyCommand:
        """Command of its rows, the same object while they stay; raises DataError."""
        content = position.tobytes() + velocity.tobytes()
        if self._last is None or content != self._last[0]:
            self._last = content, layouts.read_command_rows(position.tolist(), velocity.tolist())
        return self._last[1]


class BodyReader:
    """Reads what the inhibition needs of ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._command = CommandReader()
        self._rows = JointStateReader(
            (*layouts.MARGIN_ROWS, *layouts.PROGRESS_ROWS), cdr.FIELDS[:1])

    def read(self, message: AnyJointState) -> tuple[str, tuple[float, ...], Progress]:
        """Mode of the body, margins of the capture point [m], and progress; raises DataError."""
        (rows,) = self._rows.read(message)
        count = len(layouts.MARGIN_ROWS)
        return (self._command.read(message).mode, tuple(rows[:count].tolist()),
                _progress(rows[count:]))


class InhibitionGainsWriter:
    """Writes ``inhibition_gains``."""

    def __init__(self) -> None:
        """Lay the message out."""
        self._writer = JointStateWriter(layouts.GAIN_ROWS, cdr.FIELDS[:1])

    def fill(self, time_ns: int, inhibition: Inhibition) -> cdr.SerializedJointState:
        """Refill; raises DataError when a number is not finite."""
        return self._writer.fill(time_ns, np.array((
            *inhibition.gains, inhibition.region_radius, inhibition.rest_phase,
            inhibition.requested, inhibition.at_rest, inhibition.automatic, inhibition.opposite,
            inhibition.share, inhibition.quickness)))


_LARGEST_GAIN = (range_of(InhibitionParameters, 'inhibition_gain')[1]
                 * range_of(VotingParameters, 'vote_limit')[1])
_RADII = range_of(InhibitionParameters, 'region_radius')


class InhibitionGainsReader:
    """Reads ``inhibition_gains``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(layouts.GAIN_ROWS, cdr.FIELDS[:1])

    def read(self, message: AnyJointState) -> Inhibition:
        """Inhibition that is announced; raises DataError for numbers that no parameters allow."""
        (values,) = self._reader.read(message)
        gains, (radius, rest, *flags, share, quickness) = (
            values[:len(LEGS)], values[len(LEGS):].tolist())
        if not (0.0 <= gains.min() and gains.max() <= _LARGEST_GAIN):
            raise DataError(f'gains {gains} must be from 0 to {_LARGEST_GAIN:g}')
        low, high = _RADII
        if not low <= radius <= high:
            raise DataError(f'region_radius = {radius} must be from {low:g} to {high:g}')
        if not {0.0, 1.0}.issuperset(flags):
            raise DataError(f'{", ".join(layouts.GAIN_ROWS[-6:-2])} must be 0 or 1, not {flags}')
        if not 0.0 <= rest <= 2.0 * pi:
            raise DataError(f'rest_phase = {rest} must be from 0 to 2 pi')
        if not 0.0 < share <= 1.0:
            raise DataError(f'share = {share} must be above 0 and at most 1')
        if not 1.0 <= quickness <= QUICKEST:
            raise DataError(f'quickness = {quickness} must be from 1 to {QUICKEST:g}')
        requested, at_rest, automatic, opposite = map(bool, flags)
        return Inhibition(requested, gains, radius, at_rest, automatic, opposite, rest, share,
                          quickness)


def read_votes(message: JointState) -> tuple[dict[str, float], str]:
    """Weights by leg from ``effort`` and the voter's name, of rows ``<voter>/<leg>`` or ``<leg>``.

    Raises
    ------
    DataError
        If names and numbers do not match, or are of several voters; what they say is checked by
        :meth:`~dmp_cpg_ros.core.voting.votes.VoteInbox.accept`.
    """
    voters, _, legs = zip(*(name.rpartition('/') for name in message.name), strict=True) if (
        message.name) else ((), (), ())
    if len(message.effort) != len(legs) or len(set(legs)) != len(legs) or len(set(voters)) > 1:
        raise DataError(
            f'votes {list(message.name)} need one weight in effort for each row voter/leg, none '
            f'twice and all of one voter, not {list(message.effort)}')
    return dict(zip(legs, map(float, message.effort), strict=True)), ''.join(voters[:1])


def read_body_mode(message: String) -> str:
    """Mode in ``body_mode``; raises DataError when it is none."""
    if message.data not in MODES:
        raise DataError(f"body mode '{message.data[:40]}' must be one of {', '.join(MODES)}")
    return str(message.data)


def read_drive_mode(message: String) -> str:
    """Mode in ``drive_mode``; raises DataError when it is none."""
    if message.data not in DRIVE_MODES:
        raise DataError(
            f"drive mode '{message.data[:40]}' must be one of {', '.join(DRIVE_MODES)}")
    return str(message.data)


def inhibition_state(time_ns: int, word: str, values: Mapping[str, Any]) -> DiagnosticArray:
    """State word of the stop at a time [ns], with values, for people."""
    return status_message(INHIBITION, time_ns, word, values)


def read_state_word(message: DiagnosticArray) -> str:
    """State word of ``inhibition_state``, for people; raises DataError where there is none."""
    names = [status.name for status in message.status]
    if INHIBITION not in names:
        raise DataError(f"no status named '{INHIBITION}' among {names}")
    return str(message.status[names.index(INHIBITION)].message)
