# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of the live view in Node.js: what keys do, what panels write; it needs no browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import Any
from urllib.parse import quote

import pytest

from dmp_cpg_ros.commands.view_server import PAGE

NODE = shutil.which('node')

pytestmark = pytest.mark.skipif(NODE is None, reason='there is no Node.js here')

PLAYED = """
const { hear_keys } = await import('%s');
const heard = {}, held = new Set(), told = [], window = {
  addEventListener: (kind, take) => { (heard[kind] ||= []).push(take); },
  document: { activeElement: { blur: () => told.push('blur') } } };
hear_keys(window, held, () => told.push('stop'));
const steps = %s.map(([kind, event]) => {
  let prevented = false;
  told.length = 0;
  const own = { preventDefault: () => { prevented = true; } };
  for (const take of heard[kind] || []) take({ ...own, ...event });
  return [[...held].join(' '), prevented, told.join(' ')];
});
console.log(JSON.stringify(steps));
"""

WRITTEN = """
globalThis.window = {};
const { Oscillators, Speeds } = await import('%s');
const texts = [], ink = new Proxy({ fillText: (text) => texts.push(text) }, {
  get: (own, name) => own[name] || (() => {}), set: () => true });
const canvas = { clientWidth: 300, clientHeight: 226, getContext: () => ink };
const x = [[1, 0], [0, 1], [-1, 0], [0, -1]], legs = ['fl', 'fr', 'rl', 'rr'];
new Oscillators(canvas).draw({ x, places: x, region: 0.3 }, { legs, inhibited: ['fl'] });
const speeds = new Speeds(canvas);
for (const time of [1, 2]) speeds.take({ time, speed: [0.8, 0, 0], reference: [0.5, 0, 0] });
speeds.draw({ speed: [0.8, 0, 0], reference: [0.5, 0, 0] });
console.log(JSON.stringify(texts));
"""

DRAWN = """
globalThis.window = {};
const { Oscillators, drawTimes } = await import('%s');
const frames = %s.map((frame) => {
  const done = { texts: [], discs: [], bars: [], said: '' };
  const own = { fillText: (text) => done.texts.push(text),
    arc: (x, y, radius) => done.discs.push([x, y, radius]),
    fillRect: (x, y, width) => done.bars.push([ink.fillStyle, width]) };
  const ink = new Proxy(own, { get: (of, name) => (name in of ? of[name] : () => {}),
    set: (of, name, value) => { of[name] = value; return true; } });
  const canvas = { clientWidth: 300, clientHeight: 226, getContext: () => ink,
    setAttribute: (name, value) => { done.said = value; } };
  if (frame.x) new Oscillators(canvas).draw(frame, { legs: ['fl', 'fr', 'rl', 'rr'],
    inhibited: ['fl'] });
  else drawTimes(canvas, frame);
  return done;
});
console.log(JSON.stringify(frames));
"""

LATE = '#e5484d'
"""Colour of a time that is longer than its bound."""

BUTTON, SLIDER, BOX, BODY = (
    {'tagName': tag, 'type': kind} for tag, kind in (
        ('BUTTON', 'submit'), ('INPUT', 'range'), ('INPUT', 'checkbox'), ('BODY', None)))


def played(*events: tuple[str, dict[str, Any]]) -> list[list[Any]]:
    """After each event: keys that are held, whether the browser's own answer is prevented, what
    the page was told.
    """
    return list(run(PLAYED % (source('keys.js'), json.dumps(events))))


def source(name: str) -> str:
    """Address of a file of the page that Node.js imports as a module."""
    return 'data:text/javascript,' + quote((PAGE / name).read_text(encoding='utf-8'))


def run(script: str) -> Any:
    """What a script prints."""
    assert NODE is not None
    answer = subprocess.run([NODE, '--input-type=module', '-e', script], capture_output=True,
                            text=True, timeout=60, check=False)
    assert answer.returncode == 0, answer.stderr
    return json.loads(answer.stdout)


def key(kind: str, name: str, target: dict[str, Any] = BODY, **more: bool
        ) -> tuple[str, dict[str, Any]]:
    return kind, {'key': name, 'target': target, **more}


@pytest.mark.parametrize('target', [BUTTON, SLIDER, BOX, BODY])
def test_the_space_bar_stops_once_whatever_has_the_focus_and_presses_nothing(
        target: dict[str, Any]) -> None:
    assert played(key('keydown', ' ', target), key('keydown', ' ', target, repeat=True),
                  key('keyup', ' ', target)) == [
        ['', True, 'stop'], ['', True, ''], ['', True, '']]


def test_keys_drive_while_they_are_held_and_a_slider_has_its_arrows() -> None:
    assert played(
        key('keydown', 'ArrowUp'), key('keydown', 'd', BUTTON), key('keyup', 'ArrowUp'),
        key('keydown', 'w', ctrlKey=True), key('keydown', 'ArrowUp', SLIDER),
        key('keydown', 'Q'), key('keyup', 'D'), ('blur', {})) == [
        ['ArrowUp', True, ''], ['ArrowUp d', True, ''], ['d', False, ''], ['d', False, ''],
        ['d', False, ''], ['d q', True, ''], ['q', False, ''], ['', False, '']]


def test_what_was_clicked_or_dragged_keeps_no_focus() -> None:
    assert played(('pointerup', {})) == [['', False, 'blur']]


def test_panels_name_their_axes_and_their_scale() -> None:
    texts = run(WRITTEN % source('panels.js'))
    assert texts.count('x₁') == texts.count('x₂') == 4
    assert {'0.8 m/s', '0', '8 s'} <= set(texts)


def drawn(*frames: dict[str, Any]) -> list[dict[str, Any]]:
    """Texts, discs and bars of each frame."""
    return list(run(DRAWN % (source('panels.js'), json.dumps(frames))))


def test_the_last_stop_is_told_with_its_prediction_its_bound_and_what_it_took() -> None:
    stop = {'state': 'at_rest', 'predicted_s': '1.252', 'bound_s': '2.337', 'measured_s': '1.26',
            'request_stamp': '3.0'}
    frame = {'time': 4.5, 'requested': True, 'stop': stop}
    none, ended, lasts, late, start = (
        found for found in drawn(
            {'time': 1.0, 'stop': {}}, frame,
            {**frame, 'stop': {**stop, 'state': 'captured', 'measured_s': 'nan'}},
            {**frame, 'stop': {**stop, 'measured_s': '2.4'}}, {**frame, 'requested': False}))
    assert none['texts'] == ['no stop requested yet']
    told = {'predicted', '1.252 s', 'measured', '1.260 s', 'bound 2.337 s', 'to rest'}
    assert set(ended['texts']) == told
    assert ended['said'] == 'predicted 1.252 s, measured 1.260 s, bound 2.337 s to rest'
    assert {'elapsed', '1.500 s'} <= set(lasts['texts']) and 'measured' not in lasts['texts']
    assert LATE in [colour for colour, _ in late['bars']]
    assert LATE not in [colour for colour, _ in ended['bars']]
    assert set(start['texts']) == told - {'to rest'} | {'to walking'}
    (_, _), (_, predicted), (_, _), (_, measured) = ended['bars']
    assert measured / predicted == pytest.approx(1.26 / 1.252)


def test_an_oscillator_is_drawn_on_its_circle_and_the_region_about_its_place() -> None:
    x, places = [[0.6, 0.8], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [[1.0, 0.0]] * 4
    (found,) = drawn({'x': x, 'places': places, 'region': 0.3, 'gains': [400.0, 0.0, 0.0, 0.0]})
    (x0, y0, circle), region, state = found['discs'][:3]
    assert region == pytest.approx([x0 + circle, y0, 0.3 * circle])
    assert state[:2] == pytest.approx([x0 + 0.6 * circle, y0 - 0.8 * circle])
    assert len(found['discs']) == 9  # a region of the inhibited one alone
