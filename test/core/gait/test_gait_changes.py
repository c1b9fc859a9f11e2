# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of gait in the plain loop: stops within them, at rest, in a row, by speed, refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import GAITS, TICK, TICK_NS, quadruped, standing_state
from hypothesis import given
from hypothesis import strategies as st
from limbless import LimblessLoop, NoBalance

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.changes import certify_changes
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters, chosen_gait
from dmp_cpg_ros.core.gait.known_gaits import GaitShares, shares_of
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitTransition
from dmp_cpg_ros.core.loop import Tick, WalkingLoop
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import body_scale

ROBOT = quadruped()
SCALE = body_scale(ROBOT)


class Walker:
    """A loop whose robot stands still: oscillators, stop and targets do not notice. Without limbs
    it has no targets.
    """

    def __init__(self, gait: str = 'amble', at_rest: bool = False, limbs: bool = True,
                 **changes: object) -> None:
        parameters = SuiteParameters(
            ReferenceParameters(cmd_vel_timeout=0.0),
            inhibition=InhibitionParameters(start_inhibited=at_rest, auto_inhibit=False),
            **changes)  # type: ignore[arg-type]
        loop = WalkingLoop if limbs else LimblessLoop
        self.loop = loop(ROBOT, GAITS[gait], parameters, GAITS)
        if not limbs:
            self.loop.body.posture = NoBalance(ROBOT, PostureParameters())
        self.loop.command(0.5)
        self.ticks: list[Tick] = []

    def walk(self, seconds: float) -> list[Tick]:
        begun = len(self.ticks)
        for _ in range(round(seconds / TICK)):
            state = standing_state(ROBOT, len(self.ticks) * TICK_NS)
            self.ticks.append(self.loop.tick(state))
        return self.ticks[begun:]

    def until(self, word: str, most: float = 6.0) -> float:
        """Time until a state of the stop [s]."""
        for k in range(round(most / TICK)):
            self.walk(TICK)
            if self.loop.stop.state == word:
                return (k + 1) * TICK
        raise AssertionError(f'{self.loop.stop.state} and not {word}')

    def gaits(self) -> list[str]:
        names = [tick.gait.name for tick in self.ticks]
        return [name for k, name in enumerate(names) if k == 0 or name != names[k - 1]]


@pytest.mark.parametrize(('before', 'after', 'later'), [
    *(('amble', 'trot', later) for later in (0.0, 0.35, 0.6)), ('trot', 'bound', 0.35),
    ('pronk', 'walk', 0.35)])
def test_a_stop_within_a_transition_is_predicted_bounded_and_comes_to_rest(
        before: str, after: str, later: float) -> None:
    walker = Walker(before)
    walker.walk(1.0)
    assert walker.loop.change_gait(after) == ''
    walker.walk(later)
    predicted = walker.loop.request(True)
    walker.until('captured')
    if isinstance(walker.ticks[-1].gait, BlendedGait):
        paused = {shares_of(tick.gait) for tick in walker.ticks[-10:]}
        assert len(paused) == 1
    walker.until('at_rest')
    loop = walker.loop
    assert loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
    bound = certify_changes(loop.parameters, [GAITS[before], GAITS[after]], SCALE,
                            TICK).time_to_rest
    assert predicted <= bound
    feet = [float(leg.primitive.kinematics.foot_in_base(state.leg.joints.position)[2])
            for leg, state in zip(loop.legs, loop.leg_states, strict=True)]
    ground = loop.legs[0].primitive.foothold_in_base[2]
    assert max(feet) - ground < 0.01 * ROBOT.stance_height
    walker.walk(0.5)
    assert walker.ticks[-1].gait.name == after == loop.network.gait.name
    assert loop.stop.state == 'at_rest'
    loop.request(False)
    walker.until('walking')
    assert np.abs(loop.network.phase_errors(loop.x)).max() < 0.05


@pytest.mark.parametrize('after', sorted(set(GAITS) - {'amble'}))
def test_at_rest_a_gait_changes_at_once_and_moves_no_foot(after: str) -> None:
    walker = Walker(at_rest=True)
    before = walker.walk(1.0)[-1]
    walker.loop.change_gait(after)
    ticks = walker.walk(1.0)
    assert [tick.gait.name for tick in ticks] == [after] * len(ticks)
    assert {tick.supervisor.state for tick in ticks} == {'at_rest'}
    assert np.abs(walker.loop.network.rate(walker.loop.x, walker.loop.r,
                                           walker.loop.inhibition)).max() < 1e-9
    for tick in ticks:
        np.testing.assert_allclose(tick.targets.position, before.targets.position, atol=0.02)
    walker.loop.request(False)
    assert walker.until('walking') < 1.0


def test_at_rest_a_gait_without_an_equilibrium_is_not_taken_up(monkeypatch: pytest.MonkeyPatch
                                                               ) -> None:
    def singular(*_: object) -> None:
        raise np.linalg.LinAlgError('Singular matrix')

    walker = Walker(at_rest=True)
    walker.walk(0.1)
    walker.loop.change_gait('trot')
    with monkeypatch.context() as patched:
        patched.setattr(CanonicalSystem, 'newton_step', singular)
        assert {tick.gait.name for tick in walker.walk(0.1)} == {'amble'}
    assert walker.walk(0.1)[-1].gait.name == 'trot'


def test_a_gait_asked_for_while_stopping_waits_for_the_rest() -> None:
    walker = Walker(limbs=False)
    walker.walk(1.0)
    walker.loop.request(True)
    walker.walk(0.2)
    walker.loop.change_gait('trot')
    walker.until('at_rest')
    assert walker.gaits() == ['amble']
    walker.walk(0.1)
    assert walker.gaits() == ['amble', 'trot']


def test_a_resumed_stop_goes_on_with_the_transition() -> None:
    walker = Walker(limbs=False)
    walker.walk(1.0)
    walker.loop.change_gait('bound')
    walker.walk(0.3)
    walker.loop.request(True)
    walker.walk(0.3)
    held = walker.ticks[-1].gait
    walker.loop.request(False)
    walker.walk(3.0)
    assert walker.gaits() == ['amble', 'amble>bound', 'bound']
    shares = [tick.gait.share for tick in walker.ticks if isinstance(tick.gait, BlendedGait)]
    assert np.all(np.diff(shares) >= 0.0) and isinstance(held, BlendedGait) and held.share < 1.0


def test_of_the_gaits_asked_for_in_a_transition_the_last_follows_it() -> None:
    walker = Walker(limbs=False)
    walker.walk(0.5)
    for name in ('bound', 'pronk', 'trot'):
        walker.loop.change_gait(name)
        walker.walk(0.1)
    walker.walk(4.0)
    assert walker.gaits() == ['amble', 'amble>bound', 'bound', 'bound>trot', 'trot'] or (
        walker.gaits() == ['amble', 'amble>bound', 'bound>trot', 'trot'])


def test_targets_do_not_jump_in_a_transition() -> None:
    walker = Walker('trot')
    usual = np.abs(np.diff([t.targets.position for t in walker.walk(3.0)[250:]], axis=0)).max()
    walker.loop.change_gait('pace')
    changed = [walker.ticks[-1], *walker.walk(2.0)]
    assert np.abs(np.diff([t.targets.position for t in changed], axis=0)).max() < 1.4 * usual


def test_a_cadence_that_changes_with_the_gait_reaches_its_factor() -> None:
    walker = Walker(limbs=False)
    walker.walk(0.5)
    assert walker.loop.change({'gait': 'trot', 'cadence_scale': 1.2}) == ''
    walker.walk(3.0)
    assert shares_of(walker.ticks[-1].gait) == GaitShares('trot', cadence_scale=1.2)
    r = walker.loop.r
    plain = GaitNetwork(walker.loop.parameters.canonical, GAITS['trot'], SCALE)
    assert walker.loop.network.omega(r) == pytest.approx(plain.omega(r))


def test_unknown_and_uncertified_gaits_are_refused() -> None:
    walker = Walker()
    walker.walk(0.2)
    with pytest.raises(ParameterError, match='valid are amble'):
        walker.loop.change_gait('gallop')
    weak = Walker(at_rest=False)
    weak.loop.parameters = SuiteParameters(
        inhibition=InhibitionParameters(inhibition_gain=60.0))
    assert 'capture: ' in weak.loop.change_gait('pronk')
    weak.walk(1.0)
    assert weak.gaits() == ['amble']


def test_a_certificate_of_changes_is_no_better_than_those_of_the_gaits() -> None:
    p = SuiteParameters()
    both = certify_changes(p, [GAITS['amble'], GAITS['pronk']], SCALE, TICK)
    assert both.holds and both['offset_rate'].holds
    for name in ('amble', 'pronk'):
        alone = certify(Setting.of(GaitNetwork(p.canonical, GAITS[name], SCALE), p, TICK))
        assert both.time_to_rest > alone.time_to_rest
        assert both['capture'].margin <= alone['capture'].margin


# Automatic choice ------------------------------------------------------------------------------

CHOICE = GaitChoiceParameters(auto_gait=True, auto_gaits=('walk', 'amble', 'trot'),
                              auto_speeds=(0.2, 0.4), auto_hysteresis=0.1)


def chosen(present: str, speed: float, choice: GaitChoiceParameters = CHOICE) -> str:
    return chosen_gait(choice, present, np.array(
        [speed * (GRAVITY * SCALE.leg_length) ** 0.5, 0.0, 0.0]), SCALE)


def test_the_choice_has_hysteresis() -> None:
    up, gait = [], 'walk'
    for speed in np.linspace(0.005, 0.605, 61):
        up.append(gait := chosen(gait, speed))
    down = [gait := chosen(gait, speed) for speed in np.linspace(0.605, 0.005, 61)]
    assert up.index('amble') == 25 and up.index('trot') == 45            # 0.255, 0.455
    assert down.index('amble') == 26 and down.index('walk') == 46        # 0.345, 0.145


def test_a_gait_is_not_kept_beyond_its_highest_speed() -> None:
    choice = replace(CHOICE, auto_speeds=(0.2, 5.0))
    gaits, root = [GAITS[name] for name in choice.auto_gaits], (GRAVITY * SCALE.leg_length) ** 0.5

    def course(gait: str, speeds: np.ndarray) -> list[str]:
        return [gait := chosen_gait(choice, gait, np.array([u * root, 0.0, 0.0]), SCALE, gaits)
                for u in speeds]

    up, down = (course(*of) for of in (
        ('walk', np.linspace(0.0, 2.0, 201)), ('trot', np.linspace(2.0, 0.0, 201))))
    highest = GAITS['amble'].highest_speed
    assert 0.01 * up.index('trot') == pytest.approx(highest, abs=0.0101)
    assert 2.0 - 0.01 * down.index('amble') == pytest.approx(highest - 0.1, abs=0.0101)


@given(st.sampled_from(['walk', 'amble', 'trot', 'pronk']), st.floats(0.0, 1.0))
def test_the_choice_stands_once_it_is_made(present: str, speed: float) -> None:
    gait = chosen(present, speed)
    assert gait in CHOICE.auto_gaits and chosen(gait, speed) == gait
    assert chosen(present, speed, GaitChoiceParameters()) == present


@pytest.mark.parametrize(('values', 'text'), [
    ({'auto_speeds': (0.1, 0.2)}, 'one speed between every two'),
    ({'auto_gaits': ('walk', 'walk')}, 'must not repeat'),
    ({'auto_gaits': ('a', 'b', 'c'), 'auto_speeds': (0.3, 0.32)}, 'increase by more than'),
    ({'auto_speeds': (float('nan'),)}, 'auto_speeds'),
])
def test_impossible_choices_are_refused(values: dict[str, object], text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        GaitChoiceParameters(**values)  # type: ignore[arg-type]


def test_the_gait_follows_the_speed() -> None:
    walker = Walker('walk', limbs=False, gait_choice=GaitChoiceParameters(auto_gait=True))
    for speed in (0.3, 0.8, 0.3):
        walker.loop.command(speed)
        walker.walk(4.0)
    assert walker.gaits() == ['walk', 'walk>trot', 'trot', 'trot>walk', 'walk']


def test_a_gait_that_is_chosen_cannot_be_asked_for() -> None:
    loop = Walker('walk', limbs=False, gait_choice=GaitChoiceParameters(auto_gait=True)).loop
    with pytest.raises(ParameterError, match='set auto_gait to false first'):
        loop.change_gait('trot')
    with pytest.raises(ParameterError, match='set auto_gait to false first'):
        loop.change({'gait': 'trot', 'auto_gait': True})
    assert not loop.change({'gait': 'trot', 'auto_gait': False}) and loop.canon.wanted.name == (
        'trot')


def test_a_blend_takes_the_place_of_a_gait() -> None:
    """Whoever reads phases asks both the same questions."""
    blend = GaitTransition(GAITS['trot'], GAITS['walk']).at(0.5, 0.1)
    for name in ('omega', 'duty', 'own_omegas', 'oscillator_omegas', 'following', 'moving_phases',
                 'rest_rate', 'phases', 'highest', 'pace',
                 'cycle_position', 'scalar_cycle_position', 'scaled', 'name'):
        assert hasattr(blend, name) and hasattr(GAITS['trot'], name)
