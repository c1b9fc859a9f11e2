# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nothing imports upwards: the layers of doc/architecture.md, enforced."""

from __future__ import annotations

import re
import subprocess
import sys
from graphlib import TopologicalSorter

import pytest
from checkout import PACKAGE, ROOT, imports, modules

MESSAGES = {'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs', 'nav_msgs',
            'rcl_interfaces', 'rosgraph_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs', 'tf2_msgs',
            'visualization_msgs'}
ROS = {'rclpy', 'ament_index_python', 'launch', 'launch_ros', *MESSAGES}
RECORDS = {'rosbags', 'mcap', 'lz4', 'zstandard', 'pyarrow'}
FIGURES = {'matplotlib'}
FILMS = {'PIL', 'imageio_ffmpeg'}
MODELS = {'mujoco', 'mujoco_menagerie'}
EVERYTHING = {'numpy', 'scipy', 'yaml', *MODELS, *ROS, *RECORDS, *FIGURES, *FILMS}
FILES = {'files', 'strict_yaml'}
CLUSTER, POLICY = {'distributed'}, {'onnxruntime'}

# layer: (own layers below it, packages of others); the standard library is everyone's.
LAYERS = {
    'core': (set(), {'numpy', 'scipy'}),
    'paper': ({'core'}, {'numpy', 'scipy'}),
    'files': ({'core'}, set()),
    'strict_yaml': ({'core', 'files'}, {'yaml'}),
    'configuration': ({'core', *FILES}, set()),
    'suite_table': ({'core'}, set()),
    'layouts': ({'core'}, set()),
    'process': (set(), set()),
    'suite': ({'core', 'configuration', 'suite_table', 'primitive_files', *FILES}, set()),
    'primitive_files': ({'core', 'configuration', *FILES}, {'numpy', 'yaml'}),
    'robot': ({'core', 'configuration', 'models', *FILES}, {'numpy', *MODELS}),
    'nodes': ({'core', 'configuration', 'layouts', 'process', 'suite_table', 'suite',
               'primitive_files', 'robot', *FILES}, {'numpy', 'yaml', *ROS, *RECORDS}),
    'analysis': ({'core', 'configuration', 'layouts', 'suite_table', 'suite', *FILES},
                 {'numpy', *RECORDS, *FIGURES}),
    'commands': ({'core', 'configuration', 'layouts', 'process', 'suite_table', 'suite',
                  'primitive_files', 'robot', 'nodes', 'analysis', *FILES}, EVERYTHING),
    'studies': ({'core', 'paper', 'configuration', 'layouts', 'process', 'suite_table', 'suite',
                 'primitive_files', 'robot', 'nodes', 'analysis', 'commands', *FILES},
                EVERYTHING | CLUSTER | POLICY),
    '__main__': ({'suite_table'}, set()),
    'models': (set(), set()),
    '': (set(), set()),  # the package itself: its version
}

CORE = ['errors', 'maths', 'clock', 'parameters', 'robot_model', 'canonical', 'gait', 'reference',
        'primitives', 'learning', 'transformation', 'contraction', 'voting', 'inhibition',
        'balance', 'estimation', 'modes', 'suite_parameters', 'certificates', 'proofs', 'scenario',
        'loop']
"""Folders and files of the core, each above all that it may import."""


def layer_of(module: str) -> str:
    """Second word of a module's name: dmp_cpg_ros.core.canonical.phase is of core."""
    return module.split('.')[1] if '.' in module else ''


def test_the_table_is_that_of_the_architecture() -> None:
    text = (ROOT / 'doc' / 'architecture.md').read_text(encoding='utf-8')
    described = set(re.findall(rf'^\| `{PACKAGE}\.(\w+)` \|', text, re.MULTILINE))
    assert described == set(LAYERS) - {'', 'models', '__main__'}


def test_every_module_is_in_a_layer() -> None:
    assert {layer_of(module) for module in modules()} <= set(LAYERS)


@pytest.mark.parametrize('layer', [layer for layer in LAYERS if layer])
def test_a_layer_imports_only_what_is_below_it(layer: str) -> None:
    own, foreign = LAYERS[layer]
    wrong = []
    for module, path in modules().items():
        if layer_of(module) != layer:
            continue
        for name in sorted(imports(module, path)):
            top = name.split('.')[0]
            if top == PACKAGE:
                allowed = layer_of(name) in {layer, '', *own}
            else:
                allowed = top in foreign or top in sys.stdlib_module_names
            if not allowed:
                wrong.append(f'{module} imports {name}')
    assert not wrong, '\n'.join(wrong)


def test_each_folder_of_the_core_imports_only_folders_below_it() -> None:
    wrong = []
    for module, path in modules().items():
        words = module.split('.')
        if layer_of(module) != 'core' or len(words) < 3:
            continue
        for name in sorted(imports(module, path)):
            if layer_of(name) == 'core' and name.count('.') > 1:
                above = CORE.index(name.split('.')[2]) > CORE.index(words[2])
                wrong += [f'{module} imports {name}'] if above else []
    assert not wrong, '\n'.join(wrong)


def test_no_import_runs_in_a_circle() -> None:
    known = modules()
    graph = {module: imports(module, path, at_import_time=True) & set(known) - {module}
             for module, path in known.items()}
    list(TopologicalSorter(graph).static_order())  # raises CycleError, which names the circle


@pytest.mark.parametrize(('layers', 'unwanted'), [
    (['core'], EVERYTHING - {'numpy'}),
    (['paper'], EVERYTHING - {'numpy', 'scipy'}),
    ([*FILES, 'configuration', 'layouts', 'process', 'suite_table', 'suite', 'primitive_files',
      'models', 'analysis'], ROS | {'mujoco'}),
    (['robot'], ROS | RECORDS),
])
def test_importing_a_layer_loads_nothing_that_it_must_do_without(
        layers: list[str], unwanted: set[str]) -> None:
    names = [module for module in modules() if layer_of(module) in layers]
    program = (
        'import importlib, sys\n'
        'before = set(sys.modules)\n'
        f'for name in {names!r}:\n'
        '    importlib.import_module(name)\n'
        "    loaded = {module.split('.')[0] for module in set(sys.modules) - before}\n"
        f'    wrong = loaded & {unwanted!r}\n'
        '    if wrong:\n'
        "        sys.exit(f'{name} loads {wrong}')\n")
    done = subprocess.run([sys.executable, '-c', program], cwd=ROOT, capture_output=True,
                          text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
