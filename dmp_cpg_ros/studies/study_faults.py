# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kills nodes of a walking suite with SIGKILL, each in turn at random times, and tabulates it all.

With --respawn one walk takes many kills, each after all nodes have been ready again; without, one.
A walk is in phase again when its oscillators turn, each in its place, and go on to do so; it is as
fast again when the body has half of its speed besides. The cycles until then count from the moment
at which the robot follows its legs again, or at which all nodes are ready, whichever is earlier. A
recorder that is killed leaves a bag that nobody has closed: what is told is how much of the time
before the kill is not in it, and how many ticks are missing within. Exit status 1 when a robot
fell; --logs keeps its recording, and that of a walk that did not go on.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from itertools import cycle, islice
from math import inf, nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.bag import base_name, opened, recorded
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.motion import tilt
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, positive, run_command
from dmp_cpg_ros.core.canonical.phase import scalar_phase
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.modes.falls import FALLEN_TILT
from dmp_cpg_ros.core.suite_parameters import TickParameters
from dmp_cpg_ros.studies.link_watch import posture
from dmp_cpg_ros.studies.output import folder_of_logs, markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.walk_process import WITHIN_S, WalkProcess, ahead
from dmp_cpg_ros.suite import load_gaits
from dmp_cpg_ros.suite_table import RECORDER, ROBOT, WALKING_NODES

WALKS = (('amble', 0.5), ('trot', 1.0))

VICTIMS = tuple(node for node in WALKING_NODES if node != ROBOT)
"""Nodes without which a robot is left."""

READY, FOLLOWS = 'all nodes are ready again', 'the robot follows its legs again'

STANDS = 'the robot looks after itself'

GOES_ON_S = 2.0
"""Time for which a walk has to go on well, unless the next kill forestalls it [s]: who comes back
but is elsewhere in the gait is followed no longer after a second or so.
"""

COLUMNS = ('gait', 'time', 'respawn', 'walks', 'kills', 'fell', 'came to a stand',
           'in phase again', 'cycles, median / worst', 'until as fast again',
           'seconds after the kill, median / worst', 'ended standing / lying / fallen',
           "recorder's bags: s missing, median / worst; gaps")


@dataclass
class Kill:
    """One kill of a node, and when the walk was itself again.

    Attributes
    ----------
    node : str
        Which; several that were killed at once with a ``+`` between them.
    time_s : float
        On the robot's clock [s].
    back_s, in_phase_s, as_fast_s : float
        When its messages were followed again, when the walk was in phase again, and when the body
        had half of its speed besides [s].
    follows_s : float
        When the robot, which had looked after itself, followed its legs again [s].
    period_s : float
        Of the gait [s].
    stood : bool or None
        Whether the robot came to a stand by itself after it; None: unknown.
    unrecorded_s : float
        Of the recorder: time before the kill that is not in its bag [s].
    gaps : int
        Of the recorder: ticks within its bag that are not there.
    """

    node: str
    time_s: float = nan
    back_s: float = inf
    follows_s: float = -inf
    in_phase_s: float = inf
    as_fast_s: float = inf
    period_s: float = nan
    stood: bool | None = None
    unrecorded_s: float = nan
    gaps: int = 0

    def cycles(self, until_s: float) -> float:
        """Cycles from its return until a moment [s]."""
        return max(0.0, until_s - self.back_s) / self.period_s


@dataclass
class Outcome:
    """What became of one walk.

    Attributes
    ----------
    gait : str
        Of it.
    lock_step, respawn : bool
        How it was run.
    status : int
        Exit status of ``walk``.
    end : str
        ``standing``, ``lying``, ``fallen``, or ``unknown`` without a recording.
    fell : bool
        Whether it was ever tilted as if fallen.
    kills : list of Kill
        In order.
    rate_hz : float
        Control rate [Hz].
    """

    gait: str
    lock_step: bool
    respawn: bool
    status: int = -1
    end: str = 'unknown'
    fell: bool = False
    kills: list[Kill] = field(default_factory=list)
    rate_hz: float = TickParameters.control_rate

    @property
    def lost(self) -> bool:
        """Whether it did not go on after its last death, from which nodes could come back."""
        return self.respawn and bool(self.kills) and self.kills[-1].in_phase_s == inf


def run(gait: str, speed: float, lock_step: bool, respawn: bool, nodes: Sequence[str],
        rng: random.Random, folder: Path, tell: Callable[[str], None] = lambda _: None,
        rate_hz: float = TickParameters.control_rate) -> Outcome:
    """Walk, and kill some nodes one after the other; says how far it is.

    Raises
    ------
    DmpCpgError
        If the suite does not come to walk.
    """
    way = gait + ', lock-step' * lock_step
    tell(f'{way}: starts')
    walk = WalkProcess.of(folder, 3600.0, ahead(speed), *['--lock-step'] * lock_step,
                          *['--respawn'] * respawn, '--rate', f'{rate_hz:g}', gait=gait)
    outcome = Outcome(gait, lock_step, respawn, rate_hz=rate_hz)
    if walk.said('walking') == inf:
        walk.end()
        raise walk.failure()
    for number, node in enumerate(nodes):
        tell(f'{way}: {number} of {len(nodes)} kills')
        time.sleep(rng.uniform(2.0, 8.0))
        begin, together = len(walk.lines), node.split('+')
        pids = [walk.pid_of([each]) for each in together]
        if not all(pids):
            break
        kill = Kill(node)
        outcome.kills.append(kill)
        for pid in pids:
            os.kill(pid, signal.SIGKILL)
        if not respawn:
            break
        kill.time_s = max(walk.said(f'{each} was ended', begin) for each in together)
        ready = walk.said(READY, begin)
        walks = ready < inf and (lock_step or node == RECORDER or walk.walks())
        follows = walk.told(FOLLOWS, begin)
        kill.back_s, kill.follows_s = min([ready, *follows]), max(follows, default=-inf)
        if not walks:
            break
    if respawn:
        time.sleep(rng.uniform(4.0, 6.0))
    elif outcome.kills:  # by which it ends
        with suppress(subprocess.TimeoutExpired):
            walk.process.wait(WITHIN_S)
    stood = walk.told(STANDS) if outcome.kills else []
    for kill, following_s in _each_until_the_next(outcome.kills):
        kill.stood = any(kill.time_s < at_s < following_s for at_s in stood)
    outcome.status = walk.end()
    (folder / 'said.txt').write_text(''.join(walk.lines))
    _judge(outcome, speed, folder / 'run')
    return outcome


def _each_until_the_next(kills: Sequence[Kill]) -> Iterator[tuple[Kill, float]]:
    """Kills, each with the time of the next one [s]."""
    return zip(kills, [*(kill.time_s for kill in kills[1:]), inf], strict=False)


def _judge_bags(kills: Sequence[Kill], folder: Path) -> None:
    """Read what recorders that were killed have left, a bag each."""
    for number, kill in enumerate(kill for kill in kills if kill.node == RECORDER):
        with opened(folder / (f'bag_{number}' if number else 'bag')) as reader:
            ticks = [connection for connection in reader.connections
                     if base_name(connection.topic) == 'joint_states']
            # A tick that the robot has held for a node that came back is there twice.
            times = 1e-9 * np.unique([time_ns for _, time_ns, _ in recorded(reader, ticks)])
        if len(times) > 1:
            kill.unrecorded_s = max(0.0, kill.time_s - float(times[-1]))
            steps = np.diff(times)
            kill.gaps = int(np.rint(steps / np.median(steps) - 1.0).sum())


def _judge(outcome: Outcome, speed: float, folder: Path) -> None:
    """Read from the recording how the walk went."""
    try:
        recording = load_recording(folder)
    except Exception as error:  # noqa: BLE001 - without a recording the outcome is unknown
        print(f'no recording of {outcome}: {error}', file=sys.stderr)
        return
    _judge_bags(outcome.kills if outcome.respawn else (), folder)
    odometry, canonical = recording.odometry, recording.canonical
    leaning, height = tilt(odometry.quaternion), odometry.position_in_world[:, 2]
    outcome.fell = bool(leaning.max() > FALLEN_TILT)
    outcome.end = posture(leaning[-1], height[-1], height[0])
    if len(canonical.time) < 2:  # it never walked
        return
    phases = load_gaits()[outcome.gait].phases
    own = np.array([[scalar_phase(*leg) for leg in x] for x in canonical.x.tolist()]) - phases
    off = np.abs(np.angle(np.exp(1j * (own - own[:, :1])))).max(axis=1)
    pace = np.interp(canonical.time, odometry.time, odometry.velocity_in_base[:, 0])
    turned = np.unwrap(own[:, 0])
    rate = np.gradient(turned, canonical.time)
    turns = rate[(off <= LOCKED_PHASE_ERROR) & (rate > 1.0)]
    period_s = 2.0 * np.pi / float(np.median(turns)) if len(turns) else nan
    for kill, following_s in _each_until_the_next(outcome.kills):
        kill.period_s = period_s
        # While the robot comes to a stand by itself its pace is not that of its legs.
        well = ((off <= LOCKED_PHASE_ERROR) & (rate > np.pi / period_s)
                & (canonical.time >= max(kill.back_s, kill.follows_s)))
        for name, so in (('in_phase_s', well), ('as_fast_s', well & (pace > 0.5 * speed))):
            setattr(kill, name, _from_when_on(canonical.time, so, following_s))


def _from_when_on(times: Array, so: NDArray[np.bool_], until_s: float) -> float:
    """First time since when something has been so for ``GOES_ON_S``, or until an end [s];
    infinite without any.
    """
    before = times <= until_s  # one that the next kill forestalls says nothing
    times, so = times[before], so[before]
    begins = np.flatnonzero(so & ~np.append(False, so[:-1]))
    ends = np.append(np.flatnonzero(~so), len(so))
    for begin in begins.tolist():
        end = int(ends[np.searchsorted(ends, begin)])
        if end == len(so) or times[end] - times[begin] >= GOES_ON_S:
            return float(times[begin])
    return inf


def rows(outcomes: Sequence[Outcome]) -> Iterator[list[str]]:
    """Row of the table for each way to walk."""
    def way_of(one: Outcome) -> tuple[str, bool, bool, float]:
        return one.gait, one.lock_step, one.respawn, one.rate_hz

    for way in dict.fromkeys(map(way_of, outcomes)):
        own = [one for one in outcomes if way_of(one) == way]
        kills, ends = [kill for one in own for kill in one.kills], [one.end for one in own]
        again = [kill for kill in kills if kill.in_phase_s < inf]
        fast = [kill for kill in kills if kill.as_fast_s < inf]
        seconds = [kill.as_fast_s - kill.time_s for kill in fast]
        bags = [kill for kill in kills if kill.unrecorded_s == kill.unrecorded_s]
        slower = f', {way[3]:g} Hz' if way[3] != TickParameters.control_rate else ''
        yield [way[0], ('lock-step' if way[1] else 'real') + slower, 'yes' if way[2] else 'no',
               str(len(own)), str(len(kills)), str(sum(one.fell for one in own)),
               _stands(kills) if way[2] else '',
               f'{len(again)} of {len(kills)}' if way[2] else '',
               _spread([kill.cycles(kill.in_phase_s) for kill in again]),
               _spread([kill.cycles(kill.as_fast_s) for kill in fast]), _spread(seconds),
               ' / '.join(str(ends.count(end)) for end in ('standing', 'lying', 'fallen')) + (
                   f', unknown {ends.count("unknown")}' if 'unknown' in ends else ''),
               f'{_spread([bag.unrecorded_s for bag in bags])}; {sum(bag.gaps for bag in bags)}'
               if bags else '']


def _stands(kills: Sequence[Kill]) -> str:
    stood = [kill.stood for kill in kills if kill.stood is not None]
    return f'{sum(stood)} of {len(stood)}' if stood else 'unknown'


def _spread(values: Sequence[float]) -> str:
    return f'{np.median(values):.2f} / {max(values):.2f}' if values else ''


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    return run_command(_parser(), arguments, _main)


def _main(options: argparse.Namespace, ros: RosArguments) -> int:
    rng, outcomes = random.Random(options.seed), list[Outcome]()
    tell, turns = Progress(every_s=10.0), dict[tuple[str, bool, bool], Iterator[str]]()
    for round_ in range(options.rounds):
        for respawn in options.respawn:
            for lock_step in options.lock_step:
                for gait, speed in WALKS:
                    way = gait, lock_step, respawn
                    if respawn or way not in turns:
                        nodes = list(options.nodes)
                        rng.shuffle(nodes)
                        turns[way] = cycle(nodes)
                    together = min(options.together, len(options.nodes))
                    wanted = ['+'.join(islice(turns[way], together))
                              for _ in range(options.kills if respawn else 1)]
                    name = f'{len(outcomes):03}_{gait}'
                    with folder_of_logs(options.logs and options.logs / name) as folder:
                        outcomes.append(run(
                            gait, speed, lock_step, respawn, wanted, rng, folder, tell,
                            options.rate))
                        lost = '_fell' * outcomes[-1].fell or '_lost' * outcomes[-1].lost
                        if lost and options.logs:
                            shutil.copytree(folder / 'run', options.logs / f'{name}{lost}')
                    print(f'round {round_}: {json.dumps(asdict(outcomes[-1]))}', flush=True)
                    write_results(options.json, [asdict(one) for one in outcomes])
    print(markdown_table(COLUMNS, list(rows(outcomes))))
    return int(any(one.fell for one in outcomes))


def _parser() -> argparse.ArgumentParser:
    parser = parser_of('study_faults', __doc__, 'every walk', jobs=False, logs=True)
    add = parser.add_argument
    add('--rounds', type=int, default=5, help='times through all ways to walk (default: 5)')
    add('--kills', type=int, default=16, help='kills in a walk with --respawn (default: 16)')
    add('--together', type=int, default=1, choices=range(1, len(VICTIMS) + 1), metavar='N',
        help='nodes that are killed at once, at most all of them (default: 1)')
    add('--respawn', type=_choices, default=[True, False], metavar='yes|no|both')
    add('--lock-step', type=_choices, default=[True, False], metavar='yes|no|both')
    add('--nodes', nargs='+', choices=(*VICTIMS, RECORDER), default=VICTIMS,
        metavar='NODE', help=f'that are killed: {RECORDER}, or (default: all of them) '
        f'{", ".join(VICTIMS)}')
    add('--rate', type=positive, default=TickParameters.control_rate, metavar='HZ',
        help='control rate, for a machine that is too slow for %(default)g Hz')
    add('--seed', type=int, default=0, help='of nodes and times (default: 0)')
    return parser


def _choices(text: str) -> list[bool]:
    return {'yes': [True], 'no': [False], 'both': [True, False]}[text]


if __name__ == '__main__':
    sys.exit(main())
