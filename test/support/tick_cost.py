# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a tick of the plain loop costs in several versions of the package: the same 250 ticks of a
walk, again and again, the least time of each.

``python test/support/tick_cost.py TREE [TREE ...]`` measures checkouts in turn, each in processes
of its own, and prints µs a tick of the loop, of the robot, of both, and of ``mj_step``, which is
part of the robot's, of the quickest process, and how many times real time both are.
"""

from __future__ import annotations

import copy
import gc
import os
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

TICKS, REPETITIONS, PROCESSES, TICK_S = 250, 20, 3, 0.004


def measured() -> tuple[float, float, float]:
    """Least times of loop, robot and its physics, mean over the ticks [s], of the package on the
    path.
    """
    suites = import_module('dmp_cpg_ros.suite')
    try:
        loops = import_module('dmp_cpg_ros.core.loop')
    except ModuleNotFoundError:  # its place until November 2026
        loops = import_module('dmp_cpg_ros.core.walking_loop')
    suite = suites.load_suite(overrides={'cmd_vel_timeout': 0.0})
    gaits = [suites.load_gaits()] if hasattr(suites, 'load_gaits') else []
    robot = import_module('dmp_cpg_ros.robot.mujoco_robot').MujocoRobot(
        suite.robot_file, suite.tick_ns)
    loop = loops.WalkingLoop(robot.description, suite.gait, suite.parameters, *gaits)
    loop.command(0.5)
    begin = robot.reset()
    for _ in range(500):
        begin = robot.step(loop.tick(begin).targets)
    least = [[float('inf')] * 2 for _ in range(TICKS)]
    physics, mujoco, spent = [float('inf')] * TICKS, import_module('mujoco'), [0.0]
    plain = mujoco.mj_step

    def timed(*arguments: object) -> None:
        start = time.perf_counter()
        plain(*arguments)
        spent[0] += time.perf_counter() - start

    gc.collect()
    gc.freeze()
    gc.disable()
    for _ in range(REPETITIONS):
        acting, body, state = copy.deepcopy((loop, robot, begin))
        for best in least:
            start = time.perf_counter()
            targets = acting.tick(state).targets
            between = time.perf_counter()
            state = body.step(targets)
            end = time.perf_counter()
            best[:] = min(best[0], between - start), min(best[1], end - between)
    mujoco.mj_step = timed  # in runs of its own: to look at the clock takes time as well
    for _ in range(REPETITIONS):
        acting, body, state = copy.deepcopy((loop, robot, begin))
        for tick, known in enumerate(physics):
            spent[0] = 0.0
            state = body.step(acting.tick(state).targets)
            physics[tick] = min(known, spent[0])
    of_loop, of_robot = (sum(column) / TICKS for column in zip(*least, strict=True))
    return of_loop, of_robot, sum(physics) / TICKS


def main(trees: list[str]) -> None:
    """Measure checkouts in turn and print; without any, the package on the path."""
    if not trees:
        print(*measured())
        return
    found: dict[str, list[tuple[float, ...]]] = {tree: [] for tree in trees}
    for _ in range(PROCESSES):
        for tree, times in found.items():
            path = {**os.environ, 'PYTHONPATH': str(Path(tree).resolve()), 'OMP_NUM_THREADS': '1'}
            told = subprocess.run([sys.executable, __file__], env=path, check=True, text=True,
                                  stdout=subprocess.PIPE).stdout
            times.append(tuple(map(float, told.split())))
    for tree, times in found.items():
        loop, robot, physics = min(times, key=lambda of: of[0] + of[1])
        both = loop + robot
        print(f'{tree}: loop {1e6 * loop:.0f}, robot {1e6 * robot:.0f}, both {1e6 * both:.0f}, '
              f'mj_step {1e6 * physics:.0f}; {TICK_S / both:.1f} times real time')


if __name__ == '__main__':
    main(sys.argv[1:])
