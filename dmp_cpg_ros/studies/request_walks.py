# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A walk of the real nodes under a sequence of requests, and what was wrong with it.

What is wrong is said by the recording, the answers and the logs; of the suite's own opinions only
what it has promised counts.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import inf
from pathlib import Path

import numpy as np

from dmp_cpg_ros.analysis.bag import payload_digests
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.motion import held, spans, tilt
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.commands.ending_signals import InterruptedRunError
from dmp_cpg_ros.commands.fork_server import ForkServer
from dmp_cpg_ros.commands.run_folder import resolved_parameters, write_parameters
from dmp_cpg_ros.commands.suite_run import run_suite
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.modes.falls import FALLEN_HEIGHT_SHARE, FALLEN_TILT
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.scenario.scenario import EVENT_KINDS, Event, Scenario
from dmp_cpg_ros.core.suite_parameters import REFERENCE
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.studies.draws import Case
from dmp_cpg_ros.studies.request_draws import (
    INTERRUPT,
    RESTS_S,
    WALKS_S,
    ending,
    ends_at_rest,
    may_lie,
)
from dmp_cpg_ros.studies.request_player import Answer, RequestPlayer
from dmp_cpg_ros.suite import load_suite
from dmp_cpg_ros.suite_table import RECORDED_WALK, RECORDER, WALKING, namespace_rules

STILL_S, STILL = 0.6, 0.5
"""Time after which joints of a gait that rests stand still [s], and their speed then at most
[rad/s].
"""

PUSHED_S = 3.0
"""How long a robot may move after a push or a failure [s]."""

LEAST_TURN = 0.3
"""Rate at which a gait that walks turns at least [cycles/s]."""

SETTLED_S = 1.5
"""Time after a change of mode within which the body's height is not looked at [s]."""

WITHIN_CYCLES, BEFORE_S = 2.0, 0.5
"""Cycles within which a gait is in phase again, and time before a death in which it has to have
been [s].
"""

MARGIN = 1e-6
"""By which numbers may be beyond a limit that was computed otherwise."""

REST = re.compile(r'at rest in ([\d.]+) s(?:, at most ([\d.]+) s)?')
WALK = re.compile(r'walking in ([\d.]+) s(?:, at most ([\d.]+) s)?')
MODE = re.compile(r'(standing|lying) in ([\d.]+) s')


@dataclass
class Walked:
    """What became of a sequence.

    Attributes
    ----------
    wrong : list of str
        What was wrong; empty when nothing was.
    answers : list of Answer
        To what was asked, in order.
    checked : dict of str to int
        How often something was looked at.
    digests : dict of str to str
        Of what was published.
    """

    wrong: list[str] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    checked: Counter[str] = field(default_factory=Counter)
    digests: dict[str, str] = field(default_factory=dict)


def scenario_of(case: Case) -> Scenario:
    """The case with its ending as a scenario."""
    events = [
        Event.from_mapping({'at': at, kind: value}, f'event at {at}')
        if kind in EVENT_KINDS and kind != 'set' else Event(at, kind, value, f'{kind} {value}')
        for at, kind, value in (*case['events'], *ending(case))
        if kind != 'votes' or case['voting']]
    return Scenario('requests', events[-1].at, tuple(events), {})


def walk(case: Case, folder: Path, namespace: str = '', processes: str = 'composed') -> Walked:
    """Let the suite walk a case in lock-step, in a namespace, and judge it; each node has a
    process of its own where some are killed.
    """
    respawn = any(kind == 'kill' for _, kind, _ in case['events'])
    robot = find_config(case['robot'], ROBOTS)
    overrides = {'robot': str(robot), 'gait': case['gait'], 'start_pose': case['start_pose'],
                 'start_mode': case['start_pose'],
                 'stamped_cmd_vel': case['stamped_cmd_vel'], 'voting': case['voting'],
                 'control_rate': case['control_rate'],
                 'seed': case['seed'], 'failures_allowed': True, 'gated': True,
                 'initial_spread': 0.02}
    suite = load_suite(None, overrides)
    resolved = resolved_parameters(suite.file, overrides)
    for values in resolved.values():
        values.update(lock_step=True, expected_nodes=list(RECORDED_WALK))
    resolved[RECORDER] = {'output': str(folder / 'bag'), 'expected_nodes': [
        kind.name for kind in WALKING], 'stamped_cmd_vel': case['stamped_cmd_vel']}
    file, walked = write_parameters(folder, resolved), Walked()
    said: list[str] = []
    try:
        with ForkServer() as server:
            run_suite(scenario_of(case), suite.tick_ns, [
                '--ros-args', '--params-file', str(file),
                *(word for name, to in namespace_rules(namespace)
                  for word in ('-r', f'{name}:={to}'))],
                      folder / 'logs', lambda at, text: said.append(f'{at:8.3f}  {text}'), server,
                      lock_step=True, respawn=respawn,
                      processes='each' if respawn else processes,
                      stamped=resolved[REFERENCE]['stamped_cmd_vel'],
                      make_player=partial(RequestPlayer, walked.answers))
    except InterruptedRunError as error:
        if case['end'][0] != INTERRUPT:
            walked.wrong.append(f'ended: {error}')
    except DmpCpgError as error:
        walked.wrong.append(f'ended: {error}')
    walked.wrong += [f'ended: {text}' for text in said if ' ended with status ' in text]
    (folder / 'said.txt').write_text('\n'.join(said), encoding='utf-8')
    walked.wrong += _in_logs(folder / 'logs')
    try:
        recording = load_recording(folder)
        walked.digests = payload_digests(folder)
    except DmpCpgError as error:
        walked.wrong.append(f'no recording: {error}')
        return walked
    walked.wrong += _unnamed(walked, said)
    judge = Judge(case, walked, recording, load_description(robot), suite.tick_ns * 1e-9)
    walked.wrong += judge.wrong()
    return walked


def _unnamed(walked: Walked, said: Sequence[str]) -> Iterator[str]:
    """Who was killed without a word of it."""
    for node, kills in Counter(
            answer.value for answer in walked.answers if answer.kind == 'kill').items():
        walked.checked['deaths'] += kills
        named = sum(f'{node} was ended by signal 9' in text for text in said)
        if named != kills:
            yield f'unnamed: {node} was killed {kills} times, and named {named} times'


def _in_logs(logs: Path) -> Iterator[str]:
    """What processes have logged that no request may lead to."""
    for log in sorted(logs.glob('*.log')):
        lines = log.read_text(encoding='utf-8', errors='replace').splitlines()
        for number, line in enumerate(lines):
            if line.startswith('Traceback'):
                last = next((text for text in lines[number + 1:] if not text.startswith(' ')), '')
                yield f'traceback: {lines[number - 1][-80:]} ... {last}'


class Judge:
    """Looks at what was recorded of a walk.

    Parameters
    ----------
    case : dict
        What was asked.
    walked : Walked
        What was answered; told how often something was looked at.
    recording : Recording
        Of all of it.
    description : RobotDescription
        Limits of its joints.
    tick_s : float
        Control tick [s].
    """

    def __init__(self, case: Case, walked: Walked, recording: Recording,
                 description: RobotDescription, tick_s: float) -> None:
        """Find when something happened that changes what was promised."""
        self._case, self._walked, self._recording = case, walked, recording
        self._robot, self._tick_s = description, tick_s
        self._checked = walked.checked
        accepted = [answer.time_ns * 1e-9 for answer in walked.answers if answer.accepted]
        others = [at for at, kind, _ in case['events'] if kind in ('cycle', 'votes', 'at_once')]
        self._moved = [at + (value.get('for_s', 0.1) if kind == 'fail' else 0.0)
                       for at, kind, value in case['events']
                       if kind in ('push', 'fail', 'cycle', 'kill')]  # who is back has forgotten
        self._failing = [(at, at + value['for_s']) for at, kind, value in case['events']
                         if kind == 'fail']
        pushes = [at for at, kind, _ in case['events'] if kind in ('push', 'fail')]
        self._changes = np.array(sorted([*accepted, *others, *pushes]))
        self._states = [(event.time, event.message) for event in recording.inhibition]
        self._modes = [(event.time, event.message) for event in recording.modes]
        self._end = recording.span[1]

    def wrong(self) -> Iterator[str]:
        """What was wrong, in words."""
        yield from self._answers()
        yield from self._numbers()
        if not may_lie(self._case):
            yield from self._fall()
        yield from self._promises()
        yield from self._modes_in_time()
        yield from self._motion()
        yield from self._phases()
        yield from self._usable()

    def _answers(self) -> Iterator[str]:
        for answer in self._walked.answers:
            self._checked['answers'] += 1
            self._checked['accepted'] += answer.accepted
            if not answer.accepted and not answer.text and answer.kind != 'transition':
                yield f'refused without a reason: {answer.kind} {answer.value}'
            if answer.kind == 'followed':
                yield f'not followed: {answer.value}: {answer.text}'
            if 'Error' in answer.text or 'error' in answer.text.split(':')[0]:
                yield f'an exception for an answer: {answer.kind} {answer.value}: {answer.text}'
            if answer.kind == 'inhibit' and 'could not be predicted' in answer.text:
                yield f'not predicted: {answer.text}'

    def _numbers(self) -> Iterator[str]:
        of, legs = self._recording, self._robot.legs
        low, high, speed, torque = (np.concatenate([getattr(leg, name) for leg in legs]) for name
                                    in ('position_lower', 'position_upper', 'velocity_limit',
                                        'torque_limit'))
        for name, values in {
                'target position': of.targets.position, 'target velocity': of.targets.velocity,
                'target effort': of.targets.effort, 'canonical state': of.canonical.x,
                'canonical rate': of.canonical.x_dot, 'reference': of.reference.value,
                'estimate': of.estimate.velocity_in_base}.items():
            self._checked['numbers'] += values.size
            if not np.isfinite(values).all():
                yield f'not finite: {name}'
        for name, beyond in {
                'target position': np.maximum(low - of.targets.position,
                                              of.targets.position - high),
                'target velocity': np.abs(of.targets.velocity) - speed,
                'target effort': np.abs(of.targets.effort) - torque}.items():
            most = np.nanmax(beyond, initial=-inf)
            if most > MARGIN:
                row = int(np.nanargmax(beyond.max(axis=1)))
                yield f'beyond its limit: {name} by {most:.3g} at {of.targets.time[row]:.3f} s'

    def _fall(self) -> Iterator[str]:
        body = self._recording.odometry
        leaning, height = tilt(body.quaternion), body.position_in_world[:, 2]
        tilted = np.flatnonzero(leaning > FALLEN_TILT)
        if len(tilted):
            yield f'fell: tilted beyond {FALLEN_TILT:.2f} rad at {body.time[tilted[0]]:.3f} s'
        for at, mode in self._modes:
            if mode in ('damped', 'recovering'):
                yield f'fell: {mode} at {at:.3f} s'
                break
        for mode, begin, end in _lasting(self._modes, self._end):
            inside = (body.time > begin + SETTLED_S) & (body.time < end)
            self._checked['modes'] += 1
            share = height[inside] / self._robot.stance_height
            if mode == 'standing' and (share < FALLEN_HEIGHT_SHARE).any():
                yield f'stands by its mode, and is low, between {begin:.3f} and {end:.3f} s'
            if mode == 'lying' and (share > 0.75).any():
                yield f'lies by its mode, and is high, between {begin:.3f} and {end:.3f} s'

    def _promises(self) -> Iterator[str]:
        """Stops and starts at the time and within the bound that was said, where nothing that was
        accepted came between.
        """
        answers = self._walked.answers
        for place, answer in enumerate(answers):
            if answer.kind != 'inhibit' or not answer.accepted:
                continue
            stop, at = answer.value, answer.time_ns * 1e-9 - self._tick_s
            words = ('at_rest',) if stop else ('walking', 'free')
            found = (REST if stop else WALK).search(answer.text)
            if found is None:
                continue
            predicted, bound = float(found[1]), float(found[2] or inf)
            if not self._undisturbed(place, predicted):
                continue
            self._checked['stops' if stop else 'starts'] += 1
            done = next((time for time, word in self._states
                         if word in words and time > at + 0.5 * self._tick_s), inf)
            if any(word in ('stepping',) + (('releasing',) if stop else ())
                   for time, word in self._states if at < time < done):
                self._checked['stepped out'] += 1
                continue
            if done - at > bound + 1e-9:
                yield (f'{"stop" if stop else "start"} at {at:.3f} s took {done - at:.3f} s, '
                       f'bound {bound:.3f} s')
            elif abs(done - at - predicted) > 0.5 * self._tick_s + 1e-3:
                yield (f'{"stop" if stop else "start"} at {at:.3f} s took {done - at:.3f} s, '
                       f'predicted {predicted:.3f} s')

    def _modes_in_time(self) -> Iterator[str]:
        """Standing up and lying down in the time that was said, in the same way."""
        for place, answer in enumerate(self._walked.answers):
            found = MODE.search(answer.text) if answer.kind in REQUESTS else None
            if found is None or not answer.accepted:
                continue
            word, predicted, at = found[1], float(found[2]), answer.time_ns * 1e-9 - self._tick_s
            if not self._undisturbed(place, predicted + 0.01):
                continue
            self._checked['risen or lain'] += 1
            done = next((time for time, mode in self._modes if mode == word and time > at), inf)
            if abs(done - at - predicted) > 0.01 + 2.0 * self._tick_s:
                yield (f'{answer.kind} at {at:.3f} s took {done - at:.3f} s, predicted '
                       f'{predicted:.2f} s')

    def _undisturbed(self, place: int, predicted: float) -> bool:
        """Whether nothing came between an answer and what it predicts in a time [s]."""
        answers, at = self._walked.answers, self._walked.answers[place].time_ns * 1e-9
        at -= self._tick_s
        later = min([of.time_ns * 1e-9 for of in answers[place + 1:] if of.accepted]
                    + [change for change in self._changes if change > at + self._tick_s],
                    default=inf)
        fails = any(begin < at + predicted and at < end + PUSHED_S
                    for begin, end in self._failing)
        return not fails and (
            min(later, self._end) > at + max(predicted, self._tick_s) + self._tick_s)

    def _motion(self) -> Iterator[str]:
        """Whether what is said to rest rests, and what is said to walk walks."""
        of = self._recording
        speed = np.abs(of.joints.velocity).max(axis=1)
        standing = held(np.array([at for at, _ in self._modes]),
                        np.array([mode == 'standing' for _, mode in self._modes]),
                        of.joints.time).astype(bool)
        calm = np.ones(len(standing), dtype=bool)
        for at in self._moved:
            calm &= (of.joints.time < at - 0.5) | (of.joints.time > at + PUSHED_S)
        for first, past in spans(of.joints.time, ~standing):
            calm &= (of.joints.time < first) | (of.joints.time > past + SETTLED_S)
        for word, begin, end in _lasting(self._states, self._end):
            inside = (of.joints.time > begin + STILL_S) & (of.joints.time < end) & calm
            if word == 'at_rest' and inside.any():
                self._checked['rests'] += 1
                if (most := speed[inside].max()) > STILL:
                    yield (f'rests from {begin:.3f} s on, and a joint moves at {most:.2f} rad/s '
                           f'at {of.joints.time[inside][speed[inside].argmax()]:.3f} s')
            turned = (of.canonical.time > begin + 0.5) & (of.canonical.time < end)
            if word == 'walking' and turned.sum() > 1.0 / self._tick_s:
                self._checked['walks'] += 1
                turns, time = of.canonical.turns[turned], of.canonical.time[turned]
                if (turns[-1] - turns[0]) / (time[-1] - time[0]) < LEAST_TURN:
                    yield f'walks from {begin:.3f} s on, and its oscillators stand still'

    def _phases(self) -> Iterator[str]:
        """Whether legs that were in phase when a node died are so again soon, and go on, where
        nothing else came between.
        """
        canonical = self._recording.canonical
        own = np.unwrap(phase(canonical.x), axis=0)
        for node, at in ((answer.value, answer.time_ns * 1e-9)
                         for answer in self._walked.answers if answer.kind == 'kill'):
            before = (canonical.time > at - BEFORE_S) & (canonical.time <= at - self._tick_s)
            walked = [word for time, word in self._states if time <= at - BEFORE_S]
            if walked[-1:] != ['walking'] or before.sum() < 2:
                continue
            off = np.angle(np.exp(1j * (own - own[:, :1])))
            usual = off[before][-1]
            away = np.abs(np.angle(np.exp(1j * (off - usual)))).max(axis=1)
            turned = np.ptp(own[before, 0])
            within_s = WITHIN_CYCLES * 2.0 * np.pi * BEFORE_S / max(turned, 1e-9)
            others = [change for change in self._changes if abs(change - at) > self._tick_s]
            if (away[before].max() > LOCKED_PHASE_ERROR or at + within_s > self._end
                    or any(at - BEFORE_S < change < at + within_s for change in others)):
                continue
            self._checked['in phase'] += 1
            after = (canonical.time > at) & (canonical.time < at + within_s)
            again = np.flatnonzero(after & (away <= LOCKED_PHASE_ERROR))
            if not len(again) or np.ptp(own[after, 0]) < 0.5 * turned:
                yield f'not in phase: {node} died at {at:.3f} s, and {within_s:.2f} s later'

    def _usable(self) -> Iterator[str]:
        """Whether the robot could be brought to walk at the end, and to rest where it was to."""
        if self._walked.wrong:
            return
        rests = ends_at_rest(self._case)
        stop_s = self._end - RESTS_S if rests else self._end
        walks = [word for time, word in self._states if time < stop_s]
        if walks[-1:] not in (['walking'], ['free']):
            yield f'does not walk at the end: {walks[-1:]}, {self._modes[-1:]}'
        elif rests and self._states[-1][1] != 'at_rest' and self._rests_by() <= self._end:
            yield f'does not rest at the end: {self._states[-1]}'
        time = self._recording.odometry.time
        inside = (time > stop_s - 0.5 * WALKS_S) & (time < stop_s)
        pace: Array = self._recording.odometry.velocity_in_base[inside, 0]
        wanted = held(self._recording.reference.time, self._recording.reference.value,
                      time[inside])[:, 0].mean() if len(pace) else 0.0
        if len(pace) and pace.mean() < 0.5 * wanted:
            yield f'walks at {pace.mean():.3f} m/s at the end, asked for {wanted:.3f} m/s'


    def _rests_by(self) -> float:
        """When it rests by the last promise of that [s]."""
        return max((answer.time_ns * 1e-9 + float(found[1]) for answer in self._walked.answers
                    if answer.value is True and (found := REST.search(answer.text))), default=0.0)


def _lasting(events: Sequence[tuple[float, str]], end: float
             ) -> Iterator[tuple[str, float, float]]:
    """What words hold from when to when [s]."""
    begun = None
    if not events:
        return
    for (at, word), following in zip(events, [*events[1:], (end, '')], strict=True):
        begun = at if begun is None else begun
        if following[1] != word:
            yield word, begun, following[0]
            begun = None


