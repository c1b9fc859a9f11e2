# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A person at the live view: opens its page in a browser, drives, pushes and stops the robot.

Import ``page`` into a test module to use it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from browser import Page, browser, find_browser
from ros_processes import BY_ITSELF, Ros, wait_until

from dmp_cpg_ros.nodes.messages.interfaces import interface

PATIENCE_S = 90.0
"""How long a step may take on a loaded machine [s]."""

SIZE = (900, 640)
"""Of the window [pixels]."""

COARSE = 0.25
"""Scale of a page at whose picture nobody looks."""

TIMES = r'(measured|predicted|bound) ([0-9.]+) s'
"""What the panel of a stop says of its times [s]."""


@pytest.fixture(scope='module')
def page() -> Iterator[Page]:
    """A page of a browser, for the tests of a module."""
    executable = find_browser()
    if executable is None:
        pytest.skip('there is no Chromium here (Debian: apt-get install chromium)')
    with browser(executable) as page:
        yield page


def heard(ros: Ros, name: str) -> list[Any]:
    """Messages of a topic, from when its readers know each other."""
    topic = interface(name)
    messages = ros.collect(topic.type, name, topic.reader_qos)
    count = ros.node.count_publishers
    ros.spin_until(lambda: bool(count(ros.node.resolve_topic_name(name))))
    return messages


def state(word: str) -> str:
    """Whether the page shows a state of the stop, for the page to evaluate."""
    return f"document.querySelector('#state').textContent === '{word}'"


def start(page: Page, ask: Callable[[], None]) -> None:
    """Ask for the gait until the answer is yes: who looks after itself for a moment refuses."""
    answers: list[str] = []

    def agreed() -> bool:
        page.evaluate("document.querySelector('#answers').replaceChildren()")
        ask()
        answers.append(page.until("document.querySelector('#answers').textContent"))
        refused = 'refused' in answers[-1]
        assert not refused or BY_ITSELF in answers[-1], answers
        return not refused

    wait_until(agreed, PATIENCE_S, what=lambda: str(answers))


def drive(page: Page, ros: Ros) -> dict[str, float]:
    """Start, drive by key and by stick, push, and stop a robot that rests, all by hand.

    Returns what the page then shows: predicted and measured time of the stop, and its bound [s].
    """
    page.until(state('at rest'))
    page.until("document.querySelector('#robot').textContent === 'mini quadruped'")
    pushes, commands = heard(ros, 'push'), heard(ros, 'cmd_vel')
    start(page, lambda: page.click('#resume'))
    page.key('keyDown', 'ArrowUp')
    ros.spin_until(lambda: bool(commands) and commands[-1].linear.x == 0.5)
    page.until(state('walking'))
    page.key('keyUp', 'ArrowUp')
    ros.spin_until(lambda: commands[-1].linear.x == 0.0)
    page.click('#hold')
    x, y = page.centre('#stick')
    for kind, up in (('Pressed', 0.0), ('Moved', 50.0), ('Released', 50.0)):
        page.mouse(kind, x, y - up)
    ros.spin_until(lambda: commands[-1].linear.x > 0.4)
    page.until(state('walking'))
    x, y = page.evaluate("[document.querySelector('#scene').clientWidth / 2, "
                         "document.querySelector('#scene').clientHeight * 0.45]")
    page.mouse('Pressed', x, y)
    page.mouse('Moved', x + 60.0, y)
    ros.spin_until(lambda: len(pushes) > 2)
    page.mouse('Released', x + 60.0, y)
    forces = [push.wrench.force for push in pushes]
    assert all(force.z == 0.0 for force in forces)
    assert max(np.hypot(force.x, force.y) for force in forces) > 5.0
    page.click('#inhibit')
    # A slow machine has begun to stop by itself before, since the stick is released.
    page.until("['at rest in', 'already'].some("
               "words => document.querySelector('#answers').textContent.includes(words))")
    page.until(state('at rest'))
    page.until("document.querySelector('#certificate').classList.contains('holds')")
    shown = page.until("document.querySelector('#times').getAttribute('aria-label')")
    assert not page.problems
    times = {name: float(seconds) for name, seconds in re.findall(TIMES, shown)}
    assert 0.0 < times['predicted'] <= times['bound'] >= times['measured'], shown
    return times
