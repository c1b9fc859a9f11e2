# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The data model: one run as plain arrays, whatever it was recorded with.

Times are seconds on the robot's clock, taken from message stamps. A topic that was not recorded is
an array with no rows, so that every query works on every recording.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

Rows = TypeVar('Rows', bound='Series')

OF_JOINTS = ('joint_states', 'joint_targets')
"""Topics whose joints may have names of their own."""


def no_rows(*axes: Sequence[str], unit: str = '') -> Any:
    """Field of a dataclass that is an array without rows by default, with the names along its
    other axes and its unit, as they stand in names of columns.
    """
    return field(default_factory=lambda: np.empty((0, *map(len, axes))),
                 metadata={'axes': axes, 'unit': unit})


@dataclass(frozen=True)
class Series:
    """Arrays with a row for each time.

    Attributes
    ----------
    time : ndarray (n,)
        [s]
    """

    time: Array = no_rows(unit='s')


def taken(series: Rows, rows: Any) -> Rows:
    """Some rows of a series: those of an index, a mask or a slice."""
    return replace(series, **{of.name: getattr(series, of.name)[rows] for of in fields(series)})


@dataclass(frozen=True)
class JointSeries(Series):
    """Joint states or joint targets.

    Attributes
    ----------
    position, velocity, effort : ndarray (n, 12)
        [rad], [rad/s], [N m] in the order of ``JOINT_NAMES``; NaN where a message held no value.
    """

    position: Array = no_rows(JOINT_NAMES, unit='rad')
    velocity: Array = no_rows(JOINT_NAMES, unit='rad_s')
    effort: Array = no_rows(JOINT_NAMES, unit='n_m')


@dataclass(frozen=True)
class WorkSeries(Series):
    """What the joints' torques did, taken at every physics step.

    Attributes
    ----------
    work : ndarray (n, 12)
        Positive mechanical work since time 0 [J].
    peak_effort : ndarray (n, 12)
        Largest size of the torque since the row before [N m].
    loss : ndarray (n, 12)
        What the joints' damping and dry friction have taken since time 0 [J]; NaN where that was
        not told.
    """

    work: Array = no_rows(JOINT_NAMES, unit='j')
    peak_effort: Array = no_rows(JOINT_NAMES, unit='n_m')
    loss: Array = no_rows(JOINT_NAMES, unit='j')


@dataclass(frozen=True)
class CanonicalSeries(Series):
    """Canonical states.

    Attributes
    ----------
    x, x_dot : ndarray (n, 4, 2)
        States and their time derivatives [1/s].
    gaits : tuple of GaitShares
        Gait in which the phases are to be read, one per state; empty where it was not recorded.
    """

    x: Array = no_rows(LEGS, '12')
    x_dot: Array = no_rows(LEGS, '12', unit='per_s')
    gaits: tuple[GaitShares, ...] = ()

    @cached_property
    def turns(self) -> Array:
        """Growing phase of oscillator fl, ndarray (n,) in cycles."""
        return np.unwrap(phase(self.x[:, 0])) / (2.0 * np.pi)


@dataclass(frozen=True)
class VelocitySeries(Series):
    """Commands or the reference.

    Attributes
    ----------
    value : ndarray (n, 3)
        v_x, v_y [m/s], γ [rad/s].
    """

    value: Array = no_rows(('v_x_m_s', 'v_y_m_s', 'gamma_rad_s'))


@dataclass(frozen=True)
class OdometrySeries(Series):
    """Motion of ``base_link`` in ``odom``.

    Attributes
    ----------
    position_in_world : ndarray (n, 3)
        [m]
    quaternion : ndarray (n, 4)
        Orientation of the base in the world, x, y, z, w.
    velocity_in_base, rate_in_base : ndarray (n, 3)
        [m/s], [rad/s]
    """

    position_in_world: Array = no_rows('xyz', unit='m')
    quaternion: Array = no_rows('xyzw')
    velocity_in_base: Array = no_rows('xyz', unit='m_s')
    rate_in_base: Array = no_rows('xyz', unit='rad_s')


@dataclass(frozen=True)
class FootForceSeries(Series):
    """Normal contact forces.

    Attributes
    ----------
    force : ndarray (n, 4)
        [N], in the order of ``LEGS``.
    """

    force: Array = no_rows(LEGS, unit='n')


@dataclass(frozen=True)
class StatusEvent:
    """One status of a node: from ``inhibition_state`` or ``/diagnostics``.

    Attributes
    ----------
    time : float
        Stamp [s].
    level : int
        0 ok, 1 warning, 2 error, 3 stale.
    message : str
        The node's words; for the inhibition its state.
    values : mapping of str to str
        Keys and values as the node wrote them.
    """

    time: float
    level: int
    message: str
    values: Mapping[str, str]

    def number(self, key: str) -> float | None:
        """Value of a key as a finite number, None where there is none."""
        try:
            value = float(self.values[key])
        except (KeyError, ValueError):
            return None
        return value if np.isfinite(value) else None


@dataclass(frozen=True)
class ArrivalSeries(Series):
    """When the recorder got a tick's state and the last of its targets.

    Attributes
    ----------
    state, targets : ndarray (n,)
        Record times [s]: of ``joint_states``, and of the last ``joint_targets`` with the same
        stamp (NaN without). They are on whatever clock the recorder used.
    """

    state: Array = no_rows(unit='s')
    targets: Array = no_rows(unit='s')

    @property
    def on_wall_clock(self) -> bool:
        """Whether the record times tell anything: they do not when the recorder copied stamps."""
        return self.time.size > 1 and bool(np.ptp(self.state - self.time) > 1e-6)


@dataclass(frozen=True)
class Recording:
    """One run: :meth:`load` reads it, its attributes are arrays in SI units, and :meth:`tables`
    names every column.

    Attributes
    ----------
    joints, targets : JointSeries
        Measured joint states, and the four legs' targets merged by stamp.
    work : WorkSeries
        Work and largest torques, where the robot told them.
    canonical : CanonicalSeries
        Oscillators.
    reference, commands : VelocitySeries
        The filtered reference and the commands as sent.
    odometry, estimate : OdometrySeries
        Body motion, and what the robot believes of it.
    feet : FootForceSeries
        Contact forces.
    inhibition : tuple of StatusEvent
        ``inhibition_state`` where it changed.
    modes : tuple of StatusEvent
        ``body_mode`` where it changed.
    statuses : mapping of str to tuple of StatusEvent
        What every name on ``/diagnostics`` said, in order.
    arrivals : ArrivalSeries
        Record times of the ticks.
    counts : mapping of str to int
        Messages per recorded topic.
    undecodable : mapping of str to int
        Those among them, on topics that the analysis reads, that were left out because they could
        not be decoded.
    foreign_joints : mapping of str to tuple of str
        By topic of ``OF_JOINTS`` that lacks joints of the robot, the names of others in it.
    """

    joints: JointSeries = JointSeries()
    targets: JointSeries = JointSeries()
    work: WorkSeries = WorkSeries()
    canonical: CanonicalSeries = CanonicalSeries()
    reference: VelocitySeries = VelocitySeries()
    commands: VelocitySeries = VelocitySeries()
    odometry: OdometrySeries = OdometrySeries()
    estimate: OdometrySeries = OdometrySeries()
    feet: FootForceSeries = FootForceSeries()
    inhibition: tuple[StatusEvent, ...] = ()
    modes: tuple[StatusEvent, ...] = ()
    statuses: Mapping[str, tuple[StatusEvent, ...]] = field(default_factory=dict)
    arrivals: ArrivalSeries = ArrivalSeries()
    counts: Mapping[str, int] = field(default_factory=dict)
    undecodable: Mapping[str, int] = field(default_factory=dict)
    foreign_joints: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def load(cls, path: Path | str, **options: Any) -> Recording:
        """Read a recording, see :func:`~dmp_cpg_ros.analysis.loading.load_recording`."""
        from dmp_cpg_ros.analysis.loading import load_recording

        return load_recording(path, **options)

    def tables(self) -> dict[str, dict[str, Any]]:
        """Columns of all that was recorded, by table and by name.

        Returns
        -------
        dict of str to dict of str to ndarray (n,) or list of str
            Tables are named as the attributes are. Columns are named by quantity, frame, joint or
            axis, and unit, such as ``position_fl_hip_rad``. ``inhibition`` has a column for each
            key; ``statuses``, whose keys differ from node to node, a row.
        """
        found: dict[str, dict[str, Any]] = {
            of.name: _columns(series) for of in fields(self)
            if isinstance(series := getattr(self, of.name), Series) and len(series.time)}
        if gaits := self.canonical.gaits:
            found['canonical'] |= {
                'gait': [of.before for of in gaits], 'next_gait': [of.after for of in gaits],
                'share_of_next_gait': np.array([of.share for of in gaits]),
                'cadence_scale': np.array([of.cadence_scale for of in gaits])}
        for name, events in (('inhibition', self.inhibition), ('modes', self.modes)):
            if events:
                columns: dict[str, Any] = {
                    'time_s': np.array([of.time for of in events]),
                    'level': np.array([of.level for of in events]),
                    'message': [of.message for of in events]}
                for key in dict.fromkeys(key for of in events for key in of.values):
                    columns.setdefault(key, _told([of.values.get(key) for of in events]))
                found[name] = columns
        told = [(name, of, *pair) for name, history in self.statuses.items() for of in history
                for pair in of.values.items() or [('', '')]]
        if told:
            found['statuses'] = {
                'time_s': np.array([of.time for _, of, *_ in told]),
                'name': [row[0] for row in told],
                'level': np.array([of.level for _, of, *_ in told]),
                'message': [of.message for _, of, *_ in told],
                'key': [row[2] for row in told], 'value': [row[3] for row in told]}
        return found

    @property
    def diagnostics(self) -> dict[str, StatusEvent]:
        """The last status of every name on ``/diagnostics``."""
        return {name: history[-1] for name, history in self.statuses.items() if history}

    @property
    def missing(self) -> list[str]:
        """Topics that the analysis reads and of which nothing was recorded."""
        read: dict[str, Sized] = {
            'joint_states': self.joints.time, 'joint_targets': self.targets.time,
            'joint_work': self.work.time, 'canonical_state': self.canonical.time,
            'cmd_vel': self.commands.time, 'reference': self.reference.time,
            'ground_truth': self.odometry.time, 'odom': self.estimate.time,
            'foot_contacts': self.feet.time, 'inhibition_state': self.inhibition,
            'diagnostics': self.statuses}
        return [topic for topic, of in read.items()
                if not len(of) and topic not in self.foreign_joints]

    @property
    def span(self) -> tuple[float, float]:
        """First and last stamp of the recorded series [s]; (0, 0) when nothing was recorded."""
        axes = [series.time for series in (self.joints, self.canonical, self.odometry,
                                           self.reference, self.feet, self.targets)]
        ends = [float(axis[row]) for axis in axes if axis.size for row in (0, -1)]
        return min(ends, default=0.0), max(ends, default=0.0)


def _told(values: Sequence[str | None]) -> Array | list[str]:
    """Column of what a key was said to be: numbers, NaN where it was not, or texts."""
    try:
        return np.array([np.nan if of is None else float(of) for of in values])
    except ValueError:
        return ['' if of is None else of for of in values]


def _columns(series: Series) -> dict[str, Array]:
    """Columns of a series by their names."""
    found = {}
    for of in fields(series):
        if 'axes' in of.metadata:
            values, quantity = getattr(series, of.name), of.name if of.name != 'value' else ''
            for place in product(*(range(len(axis)) for axis in of.metadata['axes'])):
                names = [axis[k] for axis, k in zip(of.metadata['axes'], place, strict=True)]
                name = '_'.join(filter(None, [quantity, *names, of.metadata['unit']]))
                at = (slice(None), *place)
                found[name] = values[at]
    return found
