# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sound files of every kind that the package reads, ways to spoil them, and who reads them."""

from __future__ import annotations

import argparse
import io
import random
import re
import runpy
import shutil
import struct
import sys
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros import layouts
from dmp_cpg_ros.analysis.bag import payload_digests
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.report import render
from dmp_cpg_ros.analysis.run import RunResults, write_results
from dmp_cpg_ros.analysis.story import story
from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.analysis.topics import TOPICS
from dmp_cpg_ros.commands import inspect_robot, learn, walk
from dmp_cpg_ros.commands.analyze import analyze_run
from dmp_cpg_ros.commands.certify import running_setting
from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.commands.run_folder import run_context
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.proofs import check_proof
from dmp_cpg_ros.core.proofs.proof import proof_of
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.core.transformation.learned_motion import MOTION_NAMES
from dmp_cpg_ros.primitive_files import load_motion, load_primitive, save_primitive
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.robot_file import own_robot_file
from dmp_cpg_ros.strict_yaml import naming
from dmp_cpg_ros.suite import load_gaits, load_suite
from dmp_cpg_ros.suite_table import POSTURE

KINDS = ('scenario', 'suite', 'gaits', 'robot', 'mjcf', 'primitive', 'motion', 'numpy', 'csv',
         'mcap', 'sqlite', 'metadata', 'run', 'proof')

NO_PROOF = 1
"""Exit status of ``check_proof.py`` for a file that proves nothing."""

NUMBERS = ('0', '-1', '1e308', '-1e308', '1e-320', '1e999', '.nan', '.inf', 'nan', '9' * 400,
           '2147483648', '-9223372036854775808', '18446744073709551616', '0x7f', '1e', 'true',
           '1/3', '1e99999999', '""', '[]', '{}', 'null', '1_000', '01', '1:30')

WORDS = (
    '&a [*a, *a]', '*a', '<<: *b', '!!python/object/apply:os.system ["touch pwned"]',
    '!!python/object/new:os.getcwd []', '!!binary aGFsbG8=', '!!set {a, b}', '{' * 40, '[' * 9000,
    '{a: ' * 3000, '- ' * 3000, '? [a, b]\n: c', '%YAML 9.9\n---\n', '---\n...\n---\n', '\x00',
    '\ufeff', '\u202e', '"\\ud800"', "'", '"', '\t', '\r', '../../../../etc/passwd', '/dev/zero',
    '/dev/stdin', 'package://os/x', 'package://../x', '~', '=', '<script>alert(1)</script>',
    'x' * 100_000, '<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;&b;&b;">]>', '&c;',
    '<include file="/dev/zero"/>', '<include file="robot.xml"/>',
    '<replicate count="100000000" offset="0 0 1"><body/></replicate>',
    '<texture name="t" type="2d" builtin="flat" width="100000" height="100000"/>',
    '<hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/>',
    '<size memory="100G" nuserdata="2000000000"/>', '<body>' * 3000, '<!--', ']]>', '\n\n',
    '<plugin plugin="mujoco.x"/>', '<mesh file="/dev/zero"/>')
"""What is put in place of a number, or anywhere."""

SIZES = (0, 1, -1, 2**7, 2**15 - 1, 2**16, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1)


def mutated_text(data: bytes, rng: random.Random) -> bytes:
    """Text with up to four changes."""
    text = data.decode(errors='surrogateescape')
    for _ in range(rng.randint(1, 4)):
        if not text:
            break
        at, end = sorted(rng.randrange(len(text) + 1) for _ in range(2))
        near = min(end, at + rng.choice((1, 8, 60)))
        words = list(re.finditer(r'\w+', text)) or list(re.finditer('$', text))
        numbers = list(re.finditer(r'[-+]?\d[\d.e+-]*', text)) or words
        lines = text.splitlines(keepends=True)
        match rng.randrange(10):
            case 0 | 1 | 2:
                spot = rng.choice(numbers)
                text = text[:spot.start()] + rng.choice(NUMBERS) + text[spot.end():]
            case 3:
                spot, other = rng.choice(words), rng.choice(words)
                text = text[:spot.start()] + other.group() + text[spot.end():]
            case 4:
                spot = rng.choice(words)
                text = text[:spot.start()] + rng.choice(WORDS) + text[spot.end():]
            case 5:
                text = text[:at] + rng.choice(WORDS) + text[at:]
            case 6:
                text = text[:at] + text[near:]
            case 7:
                text = text[:near] + text[at:near] * rng.choice((1, 2, 500)) + text[near:]
            case 8:
                a, b = (rng.randrange(len(lines)) for _ in range(2))
                lines[a], lines[b] = lines[b], rng.choice((lines[a], ' ' + lines[b], ''))
                text = ''.join(lines)
            case 9:
                return mutated_bytes(text.encode(errors='surrogateescape'), rng)
    return text.encode(errors='surrogateescape')


def mutated_bytes(data: bytes, rng: random.Random) -> bytes:
    """Bytes with up to sixteen changes, and every third time cut off."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        if not changed:
            break
        at = rng.randrange(rng.choice((len(changed), min(len(changed), 256))))
        at = rng.choice((at, at, len(changed) - 1 - at))
        match rng.randrange(5):
            case 0 | 1:
                changed[at] = rng.choice((changed[at] ^ 1 << rng.randrange(8), rng.randrange(256)))
            case 2:
                size = rng.choice((1, 2, 4, 8))
                value = (rng.choice(SIZES) % 2**(8 * size)).to_bytes(size, 'little')
                changed[at:at + size] = value[:len(changed) - at]
            case 3:
                del changed[at:at + rng.choice((1, 4, 100))]
            case 4:
                changed[at:at] = changed[at:at + rng.choice((1, 4, 100))]
    if rng.random() < 0.3:
        del changed[rng.randrange(len(changed) + 1):]
    return bytes(changed)


def make(folder: Path) -> Path:
    """Write a sound file of every kind; a folder for each."""
    for kind in KINDS:
        (folder / kind).mkdir(parents=True)
    for kind, names in (('scenario', ('scenarios/start_stop', 'scenarios/rough_ground',
                                      'scenarios/votes', 'scenarios/change_gaits')),
                        ('suite', ('suite',)), ('gaits', ('gaits',)),
                        ('robot', ('robots/mini_quadruped',))):
        for name in names:
            shutil.copy(find_config(name), folder / kind)
    shutil.copy(own_robot_file().model, folder / 'mjcf')
    t = np.linspace(0.0, 2.0, 60)
    reach = Demonstration(t, np.stack([t**2 * (3.0 - t), np.sin(t)], axis=1))
    cycle = Demonstration(t, 0.2 * np.sin(np.pi * t[:, None] + np.arange(len(MOTION_NAMES))),
                          names=MOTION_NAMES)
    save_primitive(learn_discrete([reach], 5), folder / 'primitive' / 'reach.yaml')
    save_primitive(learn_rhythmic([cycle], 5, period=2.0), folder / 'motion' / 'cycle.yaml')
    shutil.copy(folder / 'motion' / 'cycle.yaml', folder / 'primitive')
    table = np.column_stack([t, reach.positions])
    np.save(folder / 'numpy' / 'reach.npy', table)
    np.savez(folder / 'numpy' / 'stored.npz', times=t, positions=reach.positions)
    np.savez_compressed(folder / 'numpy' / 'packed.npz', times=t, positions=reach.positions,
                        names=np.array(('a', 'b')))
    np.savetxt(folder / 'csv' / 'reach.csv', table, delimiter=',', header='t,a,b', comments='')
    write_bag(folder / 'mcap' / 'bag', StoragePlugin.MCAP)
    write_bag(folder / 'sqlite' / 'bag', StoragePlugin.SQLITE3)
    running = running_setting(load_suite())
    certificate = [row.as_mapping() for row in certify(running).inequalities]
    shutil.copytree(folder / 'mcap' / 'bag', folder / 'metadata' / 'bag')
    shutil.copytree(folder / 'mcap' / 'bag', folder / 'run' / 'run' / 'bag')
    write_json(folder / 'run' / 'run' / 'manifest.json', {
        'created': 'now', 'lock_step': True, 'scenario': 'x', 'seeds': {'robot': 0},
        'parameters': {POSTURE: {'robot': 'robots/mini_quadruped.yaml', 'radius': 1.0,
                                           'gait': 'amble', 'gaits_file': 'gaits.yaml',
                                           'inhibited_legs': ['fl'], 'terrain': 'flat'}}})
    write_json(folder / 'run' / 'run' / 'metrics.json', {'certificate': certificate})
    write_json(folder / 'proof' / 'proof.json', proof_of(running))
    return folder


def mutated(samples: Path, kind: str, place: Path, rng: random.Random) -> Path:
    """Write a spoiled copy of a sample into a folder; returns what is to be read."""
    sample = rng.choice(sorted((samples / kind).iterdir()))
    path = place / sample.name
    if sample.is_dir():
        shutil.copytree(sample, path)
        spoiled = rng.choice([file for file in sorted(path.rglob('*')) if file.is_file() and (
            file.suffix in SPOILED[kind])])
    else:
        place.mkdir(parents=True)
        shutil.copy(sample, path)
        spoiled = path
    binary = spoiled.suffix in ('.mcap', '.db3', '.npy', '.npz')
    data = spoiled.read_bytes()
    if kind == 'numpy' and rng.random() < 0.2:
        data = hostile_arrays(spoiled.suffix, rng)
    else:
        data = (mutated_bytes if binary else mutated_text)(data, rng)
    spoiled.write_bytes(data)
    return path


SPOILED = {'mcap': ('.mcap',), 'sqlite': ('.db3',), 'metadata': ('.yaml',), 'run': ('.json',)}
"""Files of a folder that are spoiled."""


def hostile_arrays(suffix: str, rng: random.Random) -> bytes:
    """A NumPy file that says it is larger than it is, holds objects, or unpacks into very much."""
    shape = rng.choice(('(1000000000000, 3)', '(-1, 3)', '(3,)', '()', '(2, 2, 2)', '(0, 3)',
                        '(99999999999999999999, 3)', '(20000000, 3)'))
    kind = rng.choice(("'<f8'", "'|O'", "'<c16'", "'<U1000000'", "[('a', '<f8')]", "'|V8'",
                       "'<M8[s]'"))
    head = f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    pickle = b"cos\nsystem\n(S'touch pwned'\ntR."
    array = b'\x93NUMPY\x01\x00' + struct.pack('<H', len(head)) + head + pickle
    if suffix == '.npy':
        return array
    data = io.BytesIO()
    with zipfile.ZipFile(data, 'w', zipfile.ZIP_DEFLATED) as archive:
        archive.writestr('times.npy', array)
        archive.writestr('positions.npy', array + bytes(rng.choice((8, 2**26))))
    return data.getvalue()


def read(kind: str, path: Path, out: Path) -> int:
    """Read a file as its command does; returns the exit status."""
    match kind:
        case 'mjcf':
            return inspect_robot.main([str(path)])
        case 'numpy' | 'csv':
            return learn.main([str(path), '--bases', '5', '--out', f'{out}.yaml'])
        case 'proof':
            sys.argv = ['check_proof.py', str(path)]
            try:
                runpy.run_path(str(check_proof.__file__), run_name='__main__')
            except SystemExit as ended:
                return int(ended.code or 0)
            return 0
    return run_command(argparse.ArgumentParser(prog=kind), [], lambda *_: READERS[kind](path, out))


def _scenario(path: Path, _: Path) -> int:
    scenario = walk.load_scenario(path)
    scenario.timeline(4_000_000)
    with naming(path):
        load_suite(None, scenario.parameters)
    return 0


def _suite(path: Path, _: Path) -> int:
    certify(running_setting(load_suite(path)))
    return 0


def _bag(path: Path, out: Path) -> int:
    payload_digests(path)
    context, _ = run_context({'gait': 'amble'})
    recording = load_recording(path)
    results = write_results(out, recording, context, {}, report=False)
    _report(results, story(recording, results.metrics))
    return 0


def _run(path: Path, out: Path) -> int:
    _report(analyze_run(path, out=out, pictures=False, report=False))
    return 0


def _report(results: RunResults, told: str = '') -> None:
    """The report without its figures, which take a second."""
    render('', '', results.metrics, results.manifest, {}, {}, told)


def _by(load: Callable[[Path], Any]) -> Callable[[Path, Path], int]:
    return lambda path, _: (load(path), 0)[1]


READERS: dict[str, Callable[[Path, Path], int]] = {
    'scenario': _scenario, 'suite': _suite, 'gaits': _by(load_gaits),
    'robot': _by(load_description), 'primitive': _by(load_primitive),
    'motion': _by(lambda path: load_motion(str(path))),
    'mcap': _bag, 'sqlite': _bag, 'metadata': _bag, 'run': _run}

# A short recording ------------------------------------------------------------------------------

STORE = get_typestore(Stores.ROS2_JAZZY)
NAMES = {'joint_states': JOINT_NAMES, 'joint_targets': JOINT_NAMES, 'foot_contacts': LEGS,
         'joint_work': layouts.work_rows(JOINT_NAMES), 'canonical_state': (
             *layouts.OSCILLATOR_ROWS, f'{layouts.GAIT_PREFIX}amble', layouts.CADENCE_ROW),
         'posture_feedback': layouts.MODE_ROWS}


def write_bag(folder: Path, storage: StoragePlugin) -> None:
    """Write a third of a second of made-up messages on every topic that the analysis reads."""
    rng = np.random.default_rng(0)
    with Writer(folder, version=9, storage_plugin=storage) as writer:
        for kind, topics in TOPICS.items():
            for topic in topics:
                if (kind, topic) == ('geometry_msgs/msg/Twist', 'cmd_vel'):
                    continue
                connection = writer.add_connection(f'/{topic}', kind, typestore=STORE)
                for time_ns in range(0, 320_000_000, 8_000_000):
                    names = list(NAMES.get(topic, ('x',)))
                    rows = rng.normal(size=(3, len(names)))
                    rows[:, 8:] = (np.array([[1.0], [0.0], [0.0]]) if topic == 'canonical_state'
                                   else rows[:, 8:])
                    values = {'name': names, 'sec': 0, 'nanosec': time_ns, 'status': [], **dict(
                        zip(('position', 'velocity', 'effort'), rows, strict=True))}
                    if topic in ('inhibition_state', 'body_mode', 'diagnostics'):
                        values['status'] = [message('diagnostic_msgs/msg/DiagnosticStatus', {
                            'name': topic, 'message': 'walking', 'values': [message(
                                'diagnostic_msgs/msg/KeyValue', {'key': 'a', 'value': '1.5'})]})]
                    writer.write(connection, time_ns,
                                 STORE.serialize_cdr(message(kind, values), kind))


def message(kind: str, values: Mapping[str, Any]) -> Any:
    """Message whose fields have values by their names, zeros where there are none."""
    made: dict[str, Any] = {}
    for name, (node, what) in STORE.fielddefs[kind][1]:
        if node.name == 'NAME':
            made[name] = message(what, values)
        elif node.name == 'BASE':
            made[name] = values.get(name, '' if what[0] == 'string' else 0)
        else:
            made[name] = values.get(name, np.zeros(what[1] if node.name == 'ARRAY' else 0))
    return STORE.types[kind](**made)
