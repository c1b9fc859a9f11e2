# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The process that computes beside the ticks, where it was forked."""

from __future__ import annotations

import os
import queue
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')

from ros_processes import DEADLINE_S

from dmp_cpg_ros.nodes.framework.judging import NAME, Compute, Judge, JudgeError


@pytest.fixture
def judge() -> Iterator[Judge]:
    forked = Judge()
    forked.fork()
    yield forked
    if forked.pid is not None:
        os.kill(forked.pid, signal.SIGKILL)
        os.waitpid(forked.pid, 0)


def answer(judge: Judge, compute: Compute) -> Any:
    answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
    judge.ask(compute, answers.put)
    return answers.get(timeout=DEADLINE_S)


def test_it_answers_by_its_own_name_whatever_is_raised_and_leaves_ctrl_c_to_others(
        judge: Judge) -> None:
    pid = judge.pid
    assert pid is not None and answer(judge, os.getpid) == pid != os.getpid()
    assert isinstance(answer(judge, partial(int, 'no number')), ValueError)
    os.kill(pid, signal.SIGINT)
    assert answer(judge, os.getpid) == pid
    assert Path(f'/proc/{pid}/comm').read_text(encoding='utf-8') == f'{NAME}\n'
    words = Path(f'/proc/{pid}/cmdline').read_text(encoding='utf-8').split('\0')
    assert words[0] == NAME and not any(words[1:])


def test_it_is_there_before_it_is_asked_once_and_another_one_after_its_death(
        judge: Judge) -> None:
    pid = judge.pid
    judge.fork()
    assert judge.pid == pid is not None
    os.kill(pid, signal.SIGKILL)
    assert isinstance(answer(judge, os.getpid), JudgeError)
    assert answer(judge, os.getpid) == judge.pid != pid


def test_it_ends_when_nobody_can_ask_any_more(judge: Judge) -> None:
    assert answer(judge, os.getpid) == judge.pid
    process = judge._process
    assert process is not None and process.stdin is not None
    ended = os.pidfd_open(process.pid)
    process.stdin.close()
    try:
        end = os.waitid(os.P_PIDFD, ended, os.WEXITED | os.WNOWAIT)
        assert end is not None and end.si_status == 0
    finally:
        os.close(ended)
