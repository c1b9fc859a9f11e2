# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Digests change with every bit that a publisher sent, and with nothing else; the manifest."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import platform
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Writer
from synthetic_bag import STORE, write_bag
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.analysis.bag import payload_digests
from dmp_cpg_ros.analysis.manifest import build_manifest
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.strict_json import to_json

PUBLISHERS = {
    'canonical_state',
    'joint_states',
    *(f'joint_targets/{leg}' for leg in ('fl', 'fr', 'rl', 'rr')),
}


@pytest.fixture(scope='module')
def walked() -> Recording:
    return SyntheticWalk(rate_hz=20.0, stop_s=2.0, release_s=3.0, end_s=4.0).recording()


@pytest.fixture(scope='module')
def digests(walked: Recording, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return payload_digests(write_bag(walked, tmp_path_factory.mktemp('digests') / 'bag'))


def test_every_publisher_has_one(digests: dict[str, str]) -> None:
    assert set(digests) == PUBLISHERS
    assert len(set(digests.values())) == len(PUBLISHERS)


def test_it_is_the_sha_256_of_the_payloads(
    walked: Recording, digests: dict[str, str], tmp_path: Path
) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    with AnyReader([bag]) as reader:
        payloads = [
            raw for connection, _, raw in reader.messages() if connection.topic == '/joint_states'
        ]
    assert digests['joint_states'] == hashlib.sha256(b''.join(payloads)).hexdigest()


def test_record_times_and_other_topics_do_not_matter(
    walked: Recording, digests: dict[str, str], tmp_path: Path
) -> None:
    other = dataclasses.replace(walked, commands=Recording().commands, statuses={})
    assert payload_digests(write_bag(other, tmp_path / 'bag', wall_clock=True)) == digests


@pytest.mark.parametrize(
    ('series', 'column', 'changed'),
    [
        ('joints', 5, 'joint_states'),
        ('targets', 0, 'joint_targets/fl'),
        ('targets', 7, 'joint_targets/rl'),
    ],
)
def test_one_bit_changes_one_digest(
    walked: Recording,
    digests: dict[str, str],
    tmp_path: Path,
    series: str,
    column: int,
    changed: str,
) -> None:
    velocity = getattr(walked, series).velocity.copy()
    velocity.view(np.int64)[33, column] ^= 1
    other = dataclasses.replace(
        walked, **{series: dataclasses.replace(getattr(walked, series), velocity=velocity)}
    )
    found = payload_digests(write_bag(other, tmp_path / 'bag'))
    assert {key for key in PUBLISHERS if found[key] != digests[key]} == {changed}


def test_how_the_legs_messages_interleave_does_not_matter(
    walked: Recording, digests: dict[str, str], tmp_path: Path
) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    with AnyReader([bag]) as reader:
        messages = [
            (connection.msgtype, raw)
            for connection, _, raw in reader.messages()
            if connection.topic == '/joint_targets'
        ]
    legs = [messages[leg::4] for leg in range(4)]
    with Writer(tmp_path / 'sorted', version=9) as writer:
        connection = writer.add_connection('/joint_targets', messages[0][0], typestore=STORE)
        for time_ns, (_, raw) in enumerate(message for leg in reversed(legs) for message in leg):
            writer.write(connection, time_ns, raw)
    assert payload_digests(tmp_path / 'sorted') == {
        key: value for key, value in digests.items() if key.startswith('joint_targets')
    }


def test_the_order_of_messages_matters(
    digests: dict[str, str], walked: Recording, tmp_path: Path
) -> None:
    joints = walked.joints
    order = np.arange(len(joints.time))
    order[[33, 34]] = order[[34, 33]]
    swapped = dataclasses.replace(joints, position=joints.position[order])
    found = payload_digests(
        write_bag(dataclasses.replace(walked, joints=swapped), tmp_path / 'bag')
    )
    assert found['joint_states'] != digests['joint_states']


def test_the_manifest_tells_versions_and_host_but_no_names_or_paths(tmp_path: Path) -> None:
    (tmp_path / 'my_robot.yaml').write_text('')
    manifest = build_manifest(
        {'mujoco_robot': {'robot': str(tmp_path / 'my_robot.yaml'), 'topic': '/joint_states'}},
        {'robot': 3},
        scenario='start_stop',
    )
    text = to_json(manifest)
    assert json.loads(text)['versions']['numpy'] == np.__version__
    assert manifest['parameters']['mujoco_robot'] == {
        'robot': 'my_robot.yaml',
        'topic': '/joint_states',
    }
    assert manifest['seeds'] == {'robot': 3}
    assert manifest['scenario'] == 'start_stop'
    assert manifest['host']['cores'] >= 1
    assert str(tmp_path) not in text
    assert str(Path.home()) not in text
    assert not platform.node() or f'"{platform.node()}"' not in text
