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
