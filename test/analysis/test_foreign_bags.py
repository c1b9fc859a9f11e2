# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that this package did not write: split, compressed, incomplete, unordered, hostile."""

from __future__ import annotations

import random
import shutil
import struct
from collections.abc import Callable, Iterable
from pathlib import Path

import lz4.frame
import mcap.writer
import numpy as np
import pytest
import yaml
import zstandard
from checkout import ROOT
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from synthetic_bag import STORE, write_bag
from synthetic_walk import SyntheticWalk
from test_analysis_loading import assert_same, contents

from dmp_cpg_ros.analysis.bag import opened, payload_digests, recorded
from dmp_cpg_ros.analysis.decoding import alike
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.rescue import Unpacker
from dmp_cpg_ros.commands.analyze import main
from dmp_cpg_ros.commands.ros_arguments import BAD_INPUT
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

Message = tuple[Connection, int, bytes]
STORAGES = [StoragePlugin.MCAP, StoragePlugin.SQLITE3]
BOMB = bytes(2**28)


@pytest.fixture(scope='module')
def walked() -> Recording:
    return SyntheticWalk(rate_hz=50.0, stop_s=2.0, release_s=4.0, end_s=6.0).recording()


@pytest.fixture(scope='module')
def plain(walked: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(walked, tmp_path_factory.mktemp('plain') / 'bag')


def messages_of(bag: Path) -> list[Message]:
    with AnyReader([bag]) as reader:
        return [(of, time, bytes(raw)) for of, time, raw in reader.messages()]


def rewritten(messages: Iterable[Message], folder: Path,
              storage: StoragePlugin = StoragePlugin.MCAP,
              mode: CompressionMode = CompressionMode.NONE) -> Path:
    writer = Writer(folder, version=9, storage_plugin=storage)
    if mode != CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        known: dict[str, Connection] = {}
        for connection, time, raw in messages:
            if connection.topic not in known:
                known[connection.topic] = writer.add_connection(
                    connection.topic, connection.msgtype, typestore=STORE)
            writer.write(known[connection.topic], time, raw)
    return folder


def split(bag: Path, folder: Path, storage: StoragePlugin, mode: CompressionMode) -> Path:
    """Two halves, listed by one metadata.yaml, as rosbag2 writes them."""
    messages, folder_of = messages_of(bag), {}
    half = len(messages) // 2
    folder.mkdir()
    for number, part in enumerate((messages[:half], messages[half:])):
        made = rewritten(part, folder.parent / f'part_{number}', storage, mode)
        described = yaml.safe_load((made / 'metadata.yaml').read_text(encoding='utf-8'))
        (name,) = described['rosbag2_bagfile_information']['relative_file_paths']
        suffixes = ''.join(Path(name).suffixes)
        shutil.move(made / name, folder / f'{folder.name}_{number}{suffixes}')
        folder_of[f'{folder.name}_{number}{suffixes}'] = described
    described['rosbag2_bagfile_information']['relative_file_paths'] = list(folder_of)
    (folder / 'metadata.yaml').write_text(yaml.safe_dump(described), encoding='utf-8')
    return folder


MODES = [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE]


@pytest.mark.parametrize('storage', STORAGES)
@pytest.mark.parametrize('mode', MODES)
def test_compressed_and_split_bags_are_read(walked: Recording, plain: Path, tmp_path: Path,
                                            storage: StoragePlugin, mode: CompressionMode) -> None:
    whole = rewritten(messages_of(plain), tmp_path / 'whole', storage, mode)
    before = contents(tmp_path)
    assert_same(load_recording(whole), walked)
    assert contents(tmp_path) == before
    assert payload_digests(whole) == payload_digests(plain)
    parts = split(plain, tmp_path / 'day', storage, mode)
    before = contents(tmp_path)
    assert_same(load_recording(parts), walked)
    (parts / 'metadata.yaml').unlink()
    assert_same(load_recording(parts), walked)
    assert set(contents(tmp_path)) == set(before) - {'day/metadata.yaml'}


def test_chunks_are_unpacked(walked: Recording, plain: Path, tmp_path: Path) -> None:
    bag = rewritten(messages_of(plain), tmp_path / 'bag', mode=CompressionMode.STORAGE)
    assert_same(load_recording(bag), walked)
    for packing in mcap.writer.CompressionType:
        assert_same(load_recording(
            with_mcap(messages_of(plain), tmp_path / f'{packing}.mcap', packing)), walked)
    assert_same(load_recording(with_mcap(
        messages_of(plain), tmp_path / 'no.mcap', use_chunking=False)), walked)


def with_mcap(messages: Iterable[Message], file: Path,
              packing: mcap.writer.CompressionType = mcap.writer.CompressionType.NONE,
              **options: bool) -> Path:
    """File of the mcap library's own writer."""
    with file.open('wb') as stream:
        writer = mcap.writer.Writer(stream, chunk_size=2**16, compression=packing, **options)
        writer.start(profile='ros2')
        channels: dict[str, int] = {}
        for of, time, raw in messages:
            if of.topic not in channels:
                schema = writer.register_schema(of.msgtype, 'ros2msg', of.msgdef.data.encode())
                channels[of.topic] = writer.register_channel(of.topic, 'cdr', schema)
            writer.add_message(channels[of.topic], time, raw, time)
        writer.finish()
    return file


def test_records_in_another_order_are_read_by_time(
        walked: Recording, plain: Path, tmp_path: Path) -> None:
    messages = messages_of(plain)
    random.Random(1).shuffle(messages)
    for storage in STORAGES:
        bag = rewritten(messages, tmp_path / storage.name, storage)
        assert_same(load_recording(bag), walked)
        with opened(bag) as reader:
            times = [time for _, time, _ in recorded(reader, reader.connections)]
        assert times == sorted(times) and len(times) == len(messages)


def test_messages_that_are_alike_are_decoded_as_each_of_them(plain: Path) -> None:
    messages = messages_of(plain)
    for kind in {of.msgtype for of, _, _ in messages} - {'diagnostic_msgs/msg/DiagnosticArray'}:
        raws = [raw for of, _, raw in messages if of.msgtype == kind][:300]
        seen = []
        for group in alike(raws, kind):
            for at, row in enumerate(group.rows):
                message = STORE.deserialize_cdr(raws[row], kind)
                for name in ('position', 'velocity', 'effort', 'twist.twist.angular.z',
                             'pose.pose.orientation.w', 'pose.covariance', 'header.stamp.nanosec',
                             'clock.sec', 'linear.x', 'twist.linear.y'):
                    if group.has(name):
                        value = message
                        for word in name.split('.'):
                            value = getattr(value, word)
                        np.testing.assert_array_equal(group.numbers(name)[at], value)
                seen.append(row)
        assert sorted(seen) == list(range(len(raws)))


def test_big_endian_messages_are_read(plain: Path, tmp_path: Path, walked: Recording) -> None:
    def turned(of: Connection, raw: bytes) -> bytes:
        message = STORE.deserialize_cdr(raw, of.msgtype)
        return bytes(STORE.serialize_cdr(message, of.msgtype, little_endian=False))

    messages = [(of, time, turned(of, raw)) for of, time, raw in messages_of(plain)]
    assert_same(load_recording(rewritten(messages, tmp_path / 'bag')), walked)


@pytest.mark.parametrize('kept', [
    {'/joint_states'}, {'/ground_truth'}, {'/ground_truth', '/reference'},
    {'/canonical_state', '/foot_contacts'},
    {'/joint_states', '/ground_truth', '/cmd_vel', '/reference', '/foot_contacts'}])
def test_topics_that_are_missing_are_named_and_the_rest_is_reported(
        plain: Path, tmp_path: Path, kept: set[str], capsys: pytest.CaptureFixture[str]) -> None:
    messages = [of for of in messages_of(plain) if of[0].topic.removeprefix('/') in
                {name.removeprefix('/') for name in kept}]
    assert messages
    bag = rewritten(messages, tmp_path / 'outing')
    assert main([str(bag), '--no-pictures']) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if 'Nothing was recorded' in
               line]
    named = set(line.partition(': ')[2].split(', '))
    assert not named & {name.removeprefix('/') for name in kept}
    assert 'inhibition_state' in named and 'joint_targets' in named
    assert 'Nothing was recorded on' in (tmp_path / 'outing_analysis' / 'report.html').read_text(
        encoding='utf-8')


def renamed(bag: Path, folder: Path, names: dict[str, str]) -> Path:
    """The bag with other names of joints."""
    def said(of: Connection, raw: bytes) -> bytes:
        message = STORE.deserialize_cdr(raw, of.msgtype)
        if of.topic.endswith(('joint_states', 'joint_targets')):
            message.name = [names.get(name, name) for name in message.name]
        return bytes(STORE.serialize_cdr(message, of.msgtype))

    return rewritten([(of, time, said(of, raw)) for of, time, raw in messages_of(bag)], folder)


def test_joints_with_the_names_of_a_robot_file_are_read(
        walked: Recording, plain: Path, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    theirs = [f'{leg.upper()}_{joint}' for leg in LEGS for joint in ('HAA', 'HFE', 'KFE')]
    bag = renamed(plain, tmp_path / 'outing', dict(zip(JOINT_NAMES, theirs, strict=True)))
    own = yaml.safe_load((ROOT / 'config' / 'robots' / 'mini_quadruped.yaml').read_text())
    file = tmp_path / 'theirs.yaml'
    file.write_text(yaml.safe_dump({**own, 'joint_names': {
        leg: theirs[3 * i:3 * i + 3] for i, leg in enumerate(LEGS)}}), encoding='utf-8')

    def said(*arguments: str) -> str:
        assert main([str(bag), '--no-pictures', *arguments]) == 0
        return capsys.readouterr().out

    unknown, known = said(), said('--robot', str(file), '--csv', str(tmp_path / 'tables'))
    for topic in ('joint_states', 'joint_targets'):
        assert f"{topic} names joints that are not the robot's: 'FL_HAA, FL_HFE" in unknown
    assert 'give --robot FILE' in unknown and 'give --robot' not in known
    for text in (unknown, known):
        assert not any('joint_states' in line.partition('recorded on')[2]
                       for line in text.splitlines())
    assert_same(load_recording(bag, joint_names=theirs), walked)
    assert_same(load_recording(plain, joint_names=theirs), walked)
    assert (tmp_path / 'tables' / 'joints.csv').is_file()


def test_a_joint_of_another_beside_all_of_the_robot_is_not_reported(
        plain: Path, tmp_path: Path) -> None:
    named = {JOINT_NAMES[0]: 'first'}
    assert load_recording(renamed(plain, tmp_path / 'lacking', named)).foreign_joints == {
        topic: ('first',) for topic in ('joint_states', 'joint_targets')}
    messages = messages_of(plain)
    of, time, raw = next(m for m in messages if m[0].topic.endswith('joint_states'))
    message = STORE.deserialize_cdr(raw, of.msgtype)
    for name in ('name', 'position', 'velocity', 'effort'):
        setattr(message, name, [*getattr(message, name), 'arm' if name == 'name' else 0.0])
    for name in ('position', 'velocity', 'effort'):
        setattr(message, name, np.array(getattr(message, name)))
    more = (of, time, bytes(STORE.serialize_cdr(message, of.msgtype)))
    assert not load_recording(rewritten([*messages, more], tmp_path / 'arm')).foreign_joints


# --- hostile ----------------------------------------------------------------------------------


def a_message(bag: Path) -> Message:
    return next(of for of in messages_of(bag) if of[0].topic.endswith('joint_states'))


def file_bomb(bag: Path, folder: Path) -> Path:
    folder.mkdir()
    (folder / 'bag_0.mcap.zstd').write_bytes(zstandard.compress(BOMB))
    return folder


def message_bomb(bag: Path, folder: Path) -> Path:
    of, time, _ = a_message(bag)
    return rewritten([(of, time, zstandard.compress(BOMB))], folder, StoragePlugin.SQLITE3)


def chunk_bomb(packing: str, summary: bool) -> Callable[[Path, Path], Path]:
    """A chunk of zeros in place of the first one of a file, with or without a summary."""
    def made(bag: Path, folder: Path) -> Path:
        folder.mkdir()
        packed = (zstandard if packing == 'zstd' else lz4.frame).compress(BOMB)
        data = (bag / 'bag.mcap').read_bytes()
        at = 8
        while data[at] != 6:
            at += 9 + struct.unpack_from('<Q', data, at + 1)[0]
        old = 9 + struct.unpack_from('<Q', data, at + 1)[0]
        head = struct.pack('<QQQII', 0, 1, len(BOMB), 0, len(packing)) + packing.encode()
        chunk = head + struct.pack('<Q', len(packed)) + packed
        fill = old - 18 - len(chunk)  # a record of an unknown kind keeps all offsets as they are
        record = struct.pack('<BQ', 6, len(chunk)) + chunk
        if fill >= 0 and summary:
            record += struct.pack('<BQ', 0x80, fill) + bytes(fill)
            (folder / 'bag.mcap').write_bytes(data[:at] + record + data[at + old:])
        else:
            footer = struct.pack('<BQQQI', 2, 20, 0, 0, 0) + data[:8]
            (folder / 'bag.mcap').write_bytes(data[:at] + record + footer)
        return folder
    return made


@pytest.mark.parametrize('bomb', [
    file_bomb, message_bomb, chunk_bomb('zstd', True), chunk_bomb('zstd', False),
    chunk_bomb('lz4', False)])
def test_a_small_file_is_not_unpacked_without_a_limit(
        plain: Path, tmp_path: Path, bomb: Callable[[Path, Path], Path],
        capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    bag, unpacked = bomb(plain, tmp_path / 'bag'), []
    copy = Unpacker.copy

    def noted(self: Unpacker, *arguments: object) -> None:
        unpacked.append(self)
        copy(self, *arguments)

    monkeypatch.setattr(Unpacker, 'copy', noted)
    with pytest.raises(DataError, match='unpacks into more than'):
        load_recording(bag)
    assert unpacked
    assert main([str(bag), '--no-pictures']) == BAD_INPUT
    assert str(bag) in capsys.readouterr().err


def test_nothing_is_unpacked_twice_as_much_in_pieces(tmp_path: Path) -> None:
    """The limit is that of the file, not of each piece."""
    file = tmp_path / 'x.mcap'
    file.write_bytes(b'0123')
    unpack, piece = Unpacker(file), zstandard.compress(bytes(2**22))
    with pytest.raises(DataError, match='unpacks into more than'):
        for _ in range(17):
            unpack(piece, 'zstd')


def test_what_metadata_say_of_the_compression_is_not_believed(
        plain: Path, tmp_path: Path) -> None:
    bag = rewritten(messages_of(plain)[:9], tmp_path / 'bag', StoragePlugin.SQLITE3,
                    CompressionMode.FILE)
    (packed,) = bag.glob('*.zstd')
    packed.write_bytes(zstandard.compress(BOMB))
    packed.rename(bag / packed.stem)
    text = (bag / 'metadata.yaml').read_text(encoding='utf-8')
    (bag / 'metadata.yaml').write_text(text.replace('.zstd', ''), encoding='utf-8')
    with pytest.raises(DataError, match='cannot be read'):
        load_recording(bag)
