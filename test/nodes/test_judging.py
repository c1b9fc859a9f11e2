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

import ros_processes
from rclpy.executors import SingleThreadedExecutor
from ros_processes import DEADLINE_S, Ros

from dmp_cpg_ros.nodes.framework import judging
from dmp_cpg_ros.nodes.framework.judging import NAME, Compute, Judge, JudgeError
from dmp_cpg_ros.nodes.posture_control import PostureControl

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain


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


def test_who_cannot_use_an_answer_keeps_no_other_from_its_own(
        judge: Judge, capfd: pytest.CaptureFixture[str]) -> None:
    judge.ask(os.getpid, partial(int.__add__, 'no number'))
    assert answer(judge, os.getpid) == judge.pid
    assert 'TypeError' in capfd.readouterr().err


def test_an_answer_to_a_node_whose_executor_was_shut_down_is_dropped(
        ros: Ros, judge: Judge, monkeypatch: pytest.MonkeyPatch,
        capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(judging, 'judge', lambda: judge)
    node = PostureControl(context=ros.context)
    executor = SingleThreadedExecutor(context=ros.context)
    executor.add_node(node)
    executor.shutdown()
    used: list[object] = []
    judging.beside_ticks(node, os.getpid, used.append)
    assert answer(judge, os.getpid) == judge.pid
    assert not used and not capfd.readouterr().err
    node.destroy_node()


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
