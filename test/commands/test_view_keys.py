# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The keyboard of the live view, in Node.js: no browser is needed for what a handler decides."""

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

BUTTON, SLIDER, BOX, BODY = (
    {'tagName': tag, 'type': kind} for tag, kind in (
        ('BUTTON', 'submit'), ('INPUT', 'range'), ('INPUT', 'checkbox'), ('BODY', None)))


def played(*events: tuple[str, dict[str, Any]]) -> list[list[Any]]:
    """After each event: keys that are held, whether the browser's own answer is prevented, what
    the page was told.
    """
    assert NODE is not None
    module = 'data:text/javascript,' + quote((PAGE / 'keys.js').read_text(encoding='utf-8'))
    answer = subprocess.run(
        [NODE, '--input-type=module', '-e', PLAYED % (module, json.dumps(events))],
        capture_output=True, text=True, timeout=60, check=False)
    assert answer.returncode == 0, answer.stderr
    return list(json.loads(answer.stdout))


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
