# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``learn``: every kind of file gives the same primitive, and what cannot be used is named."""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from demonstrations import joint_angles, walking_joints
from synthetic_bag import write_bag as write_recording
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.commands import learn, walked_motion
from dmp_cpg_ros.commands.demonstration_files import read_demonstration
from dmp_cpg_ros.commands.learn import main
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import BAD_INPUT
from dmp_cpg_ros.commands.run_folder import run_context
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.primitive_files import load_primitive

WALK, REACH = walking_joints(0.5, 2.6, dt=0.005), joint_angles(dt=0.004)
EPOCH = 1_700_000_000


def write_csv(path, demonstration, derived=True):
    names = list(demonstration.names)
    columns = [demonstration.times[:, None], demonstration.positions]
    header = ['time', *names]
    if derived:
        columns += [demonstration.velocities, demonstration.accelerations]
        header += [f'{n}_velocity' for n in names] + [f'{n}_acceleration' for n in names]
    np.savetxt(
        path, np.hstack(columns), delimiter=',', header=','.join(header), comments='', fmt='%.17g'
    )
    return path


def write_bag(folder, demonstration, *, stamped=True, velocities=True, one_by_one=False):
    rosbag2 = pytest.importorskip('rosbags.rosbag2')
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    kind = 'sensor_msgs/msg/JointState'
    make, header = store.types[kind], store.types['std_msgs/msg/Header']
    time = store.types['builtin_interfaces/msg/Time']
    with rosbag2.Writer(folder, version=9) as writer:
        connection = writer.add_connection('/robot/joint_states', kind, typestore=store)
        other = writer.add_connection('/clock', 'rosgraph_msgs/msg/Clock', typestore=store)
        clock = store.types['rosgraph_msgs/msg/Clock'](clock=time(sec=0, nanosec=1))
        writer.write(other, 1, store.serialize_cdr(clock, 'rosgraph_msgs/msg/Clock'))
        for t, y, v in zip(
            demonstration.times, demonstration.positions, demonstration.velocities, strict=True
        ):
            stamp = round(t * 1e9)
            sent = (
                time(sec=EPOCH + stamp // 10**9, nanosec=stamp % 10**9)
                if stamped
                else time(sec=0, nanosec=0)
            )
            groups = [[i] for i in range(len(y))] if one_by_one else [list(range(len(y)))[::-1]]
            for group in groups:
                message = make(
                    header=header(stamp=sent, frame_id=''),
                    name=[demonstration.names[i] for i in group],
                    position=y[group],
                    velocity=v[group] if velocities else np.zeros(0),
                    effort=np.zeros(0),
                )
                writer.write(connection, 10**9 + stamp, store.serialize_cdr(message, kind))
    return folder


def test_csv_npy_npz_and_bag_give_the_same_demonstration(tmp_path):
    np.save(tmp_path / 'a.npy', np.hstack([WALK.times[:, None], WALK.positions]))
    np.savez(
        tmp_path / 'a.npz',
        times=WALK.times,
        positions=WALK.positions,
        velocities=WALK.velocities,
        names=np.array(WALK.names),
    )
    paths = [
        write_csv(tmp_path / 'a.csv', WALK),
        tmp_path / 'a.npz',
        write_bag(tmp_path / 'a_bag', WALK),
    ]
    for path in paths:
        read = read_demonstration(path, joints=('knee', 'hip'))
        assert read.names == ('knee', 'hip')
        np.testing.assert_allclose(read.times, WALK.times, atol=1e-9)
        np.testing.assert_array_equal(read.positions, WALK.positions[:, [2, 1]])
        np.testing.assert_array_equal(read.velocities, WALK.velocities[:, [2, 1]])
    plain = read_demonstration(tmp_path / 'a.npy')
    np.testing.assert_array_equal(plain.positions, WALK.positions)
    np.testing.assert_array_equal(read_demonstration(paths[0]).accelerations, WALK.accelerations)


def test_joints_that_come_in_separate_messages_are_put_together(tmp_path):
    read = read_demonstration(write_bag(tmp_path / 'bag', WALK, one_by_one=True, velocities=False))
    assert read.names == WALK.names
    assert read.velocities is None
    np.testing.assert_array_equal(read.positions, WALK.positions)


def test_a_long_recording_takes_hardly_more_memory_than_its_numbers(tmp_path):
    count, joints = 6000, 12
    times = 0.004 * np.arange(count)
    positions = np.sin(times[:, None] + np.arange(joints))
    walk = Demonstration(times, positions, positions, names=tuple(f'j{k}' for k in range(joints)))
    bag = write_bag(tmp_path / 'bag', walk)
    tracemalloc.start()
    read = read_demonstration(bag)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    np.testing.assert_array_equal(read.positions, positions[:, ::-1])
    numbers = 2 * 8 * joints * count
    assert peak < 6 * numbers


def test_messages_without_a_stamp_take_the_time_of_recording(tmp_path):
    read = read_demonstration(write_bag(tmp_path / 'bag', WALK, stamped=False))
    np.testing.assert_allclose(read.times, WALK.times, atol=1e-9)


def test_a_part_of_a_recording_is_cut_out(tmp_path):
    read = read_demonstration(write_csv(tmp_path / 'a.csv', WALK), start=0.2, end=0.7)
    inside = (WALK.times >= 0.2) & (WALK.times <= 0.7)
    np.testing.assert_array_equal(read.positions, WALK.positions[inside])


def test_a_part_without_samples_is_named_with_what_there_is(tmp_path):
    table = write_csv(tmp_path / 'a.csv', WALK)
    for part in ({'start': 0.7, 'end': 0.2}, {'start': 100.0}):
        with pytest.raises(DataError, match=f'it lasts {WALK.duration:g} s'):
            read_demonstration(table, **part)


def test_a_table_without_a_header_is_numbered(tmp_path):
    np.savetxt(
        tmp_path / 'a.csv', np.hstack([REACH.times[:, None], REACH.positions]), delimiter=','
    )
    assert read_demonstration(tmp_path / 'a.csv').names == ('joint_1', 'joint_2', 'joint_3')


def test_a_discrete_primitive_is_learned_and_written(tmp_path, capsys):
    path, out = (
        write_csv(tmp_path / 'reach.csv', REACH, derived=False),
        tmp_path / 'out' / 'reach.yaml',
    )
    assert main([str(path), str(path), '--out', str(out), '--bases', '20']) == 0
    learned = load_primitive(out)
    assert isinstance(learned, DiscretePrimitive)
    assert learned.names == REACH.names
    assert learned.bases.count == 20
    made = learned.rollout(REACH.times).positions
    np.testing.assert_allclose(made, REACH.positions, atol=0.01 * np.ptp(REACH.positions))
    said = capsys.readouterr().out
    assert 'knee' in said
    assert str(out) in said


def test_a_rhythmic_primitive_is_learned_from_a_bag_with_its_period(tmp_path, capsys):
    out = tmp_path / 'walk.yaml'
    arguments = [
        str(write_bag(tmp_path / 'bag', WALK)),
        '--kind',
        'rhythmic',
        '--joints',
        'hip,knee',
        '--positions-only',
        '--out',
        str(out),
    ]
    assert main([*arguments, '--ros-args', '-r', '__node:=learn', '--log-level', 'warn']) == 0
    learned = load_primitive(out)
    assert isinstance(learned, RhythmicPrimitive)
    assert learned.period == pytest.approx(0.5, rel=1e-6)
    assert learned.names == ('hip', 'knee')
    assert 'period 0.5 s' in capsys.readouterr().out


def test_options_reach_the_primitive(tmp_path):
    path, out = write_csv(tmp_path / 'reach.csv', REACH), tmp_path / 'reach.yaml'
    options = [
        '--bases',
        'auto',
        '--stiffness',
        '400',
        '--form',
        'printed',
        '--method',
        'joint',
        '--ridge',
        '1e-8',
    ]
    assert main([str(path), '--out', str(out), *options]) == 0
    spring = load_primitive(out).transformation
    assert spring.form == 'printed'
    np.testing.assert_allclose(spring.stiffness, 400.0)
    np.testing.assert_allclose(spring.damping, 40.0)


@pytest.mark.parametrize(
    ('name', 'content', 'text'),
    [
        ('none.csv', None, 'does not exist'),
        ('a.txt', 'x', 'no known kind'),
        ('a.csv', '', 'empty'),
        ('a.csv', 'hip,knee\n1,2\n', 'first column'),
        ('a.csv', 'time,hip\n0,1\n1,x\n', 'no number'),
        ('a.csv', 'time,hip\n0,1,2\n', 'numbers in every row'),
        ('a.csv', 'time,hip\n0,1\n1,2\n', 'at least 8'),
        ('a.csv', 'time,hip,hip\n' + '0,1,2\n' * 9, "names two columns 'hip'"),
        ('a.csv', 'time,hip,time\n' + '0,1,2\n' * 9, "names two columns 'time'"),
        ('a.csv', 'time,hip, \n' + '0,1,2\n' * 9, 'no name for column 3'),
        ('a.npy', 'no array', 'NumPy'),
        ('a.npz', 'no array', 'NumPy'),
        ('a.csv', 'time,hip\n' + '0,1\n' * 9, 'must increase'),
        ('a.csv', 'time,hip\n' + ''.join(f'{i},nan\n' for i in range(9)), 'finite'),
    ],
)
def test_files_that_cannot_be_used_are_named(name, content, text, tmp_path, capsys):
    if content is not None:
        (tmp_path / name).write_text(content)
    assert main([str(tmp_path / name), '--out', str(tmp_path / 'out.yaml')]) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.startswith('learn: ')
    assert text in said
    assert not (tmp_path / 'out.yaml').exists()


def test_arrays_that_cannot_be_used_are_named(tmp_path, capsys):
    np.save(tmp_path / 'flat.npy', np.zeros(9))
    np.savez(tmp_path / 'bare.npz', positions=np.zeros((9, 1)))
    np.savez(tmp_path / 'twice.npz', times=np.arange(9.0), positions=np.zeros((9, 2)),
             names=np.array(['hip', 'hip']))
    for name, text in (('flat.npy', 'first column'), ('bare.npz', "no array 'times'"),
                       ('twice.npz', "names two columns 'hip'")):
        assert main([str(tmp_path / name), '--out', str(tmp_path / 'out.yaml')]) == BAD_INPUT
        assert text in capsys.readouterr().err


def test_unknown_joints_and_topics_are_answered_with_the_known_ones(tmp_path, capsys):
    bag, out = str(write_bag(tmp_path / 'bag', WALK)), str(tmp_path / 'out.yaml')
    table = str(write_csv(tmp_path / 'a.csv', WALK))
    for arguments in ([bag, '--joints', 'elbow'], [table, '--joints', 'elbow']):
        assert main([*arguments, '--out', out]) == BAD_INPUT
        said = capsys.readouterr().err
        assert 'elbow' in said
        assert 'abduction, hip, knee' in said or 'knee, hip, abduction' in said
    assert main([bag, '--topic', 'joint_targets', '--out', out]) == BAD_INPUT
    assert '/robot/joint_states' in capsys.readouterr().err
    assert main([bag, '--topic', 'clock', '--out', out]) == BAD_INPUT
    (tmp_path / 'empty').mkdir()
    assert main([str(tmp_path / 'empty'), '--out', out]) == BAD_INPUT


def test_what_has_no_rhythm_is_refused(tmp_path, capsys):
    noise = np.random.default_rng(0).normal(size=(200, 1))
    np.save(tmp_path / 'noise.npy', np.hstack([np.arange(200.0)[:, None], noise]))
    out = str(tmp_path / 'out.yaml')
    assert main([str(tmp_path / 'noise.npy'), '--kind', 'rhythmic', '--out', out]) == BAD_INPUT
    assert 'period' in capsys.readouterr().err


def test_a_movement_that_no_number_can_describe_is_refused_in_one_line(tmp_path, capfd):
    times = np.linspace(0.0, 1.0, 50)
    for size, duration in ((1e200, 1.0), (1e11, 1e-150), (1.0, 1e-200), (1e-300, 1e-170)):
        np.save(tmp_path / 'odd.npy',
                np.column_stack([duration * times, size * np.sin(6.0 * times)]))
        out = str(tmp_path / 'out.yaml')
        assert main([str(tmp_path / 'odd.npy'), '--out', out]) == BAD_INPUT
        told = capfd.readouterr().err
        assert 'odd.npy' in told and told.count('\n') == 1


@pytest.mark.parametrize(
    'arguments', [['--bases', 'many'], ['--bases', '0'], ['--kind', 'wild'], ['--method', 'x']]
)
def test_arguments_that_mean_nothing_end_with_status_2(arguments):
    with pytest.raises(SystemExit) as stopped:
        main(['a.csv', '--out', 'b.yaml', *arguments])
    assert stopped.value.code == BAD_INPUT


@pytest.mark.parametrize(('option', 'value', 'valid'), [
    ('--ridge', 'nan', 'finite'), ('--ridge', '-1', 'from 0 to 1000'), ('--ridge', 'x', 'number'),
    ('--overlap', 'nan', 'finite'), ('--overlap', '1', 'from 0.001 to 0.999'),
    ('--overlap', '0', 'from 0.001 to 0.999'), ('--stiffness', 'inf', 'finite'),
    ('--stiffness', '0', 'from 1e-06 to 1e+12'), ('--damping', 'nan', 'finite'),
    ('--damping', '1e-300', 'from 0.001 to 1e+06'), ('--damping', '-40', 'from 0.001 to 1e+06'),
    ('--period', '1e-300', 'from 0.001 to 10000'), ('--period', '-1', 'from 0.001 to 10000'),
    ('--period', 'nan', 'finite'),
    ('--start', 'nan', 'finite'), ('--end', 'inf', 'finite')])
def test_numbers_that_nothing_can_be_learned_with_are_refused(capsys, option, value, valid):
    for target in ('--out', '--motion'):
        with pytest.raises(SystemExit) as stopped:
            main(['a.csv', target, 'b.yaml', option, value])
        assert stopped.value.code == BAD_INPUT
        told = capsys.readouterr().err
        assert f'argument {option}: ' in told and valid in told


@pytest.mark.parametrize('options', [
    ['--damping', str(learn.DAMPINGS[0])], ['--damping', str(learn.DAMPINGS[1])],
    ['--stiffness', str(learn.STIFFNESSES[0])], ['--stiffness', str(learn.STIFFNESSES[1])],
    ['--ridge', str(learn.RIDGES[1])], ['--overlap', str(learn.OVERLAPS[0])],
    ['--overlap', str(learn.OVERLAPS[1])]], ids=' '.join)
def test_numbers_at_the_ends_of_their_ranges_learn_something_or_say_why_not(
        tmp_path, capsys, options):
    path, out = write_csv(tmp_path / 'reach.csv', REACH), tmp_path / 'reach.yaml'
    status = main([str(path), '--out', str(out), *options])
    told = capsys.readouterr().err
    assert (status, told) == (0, '') if out.exists() else (
        status == BAD_INPUT and told.count('\n') == 1)
    assert not out.exists() or np.isfinite(load_primitive(out).transformation.stiffness).all()


def test_an_overlap_and_a_damping_reach_the_primitive(tmp_path):
    path = write_csv(tmp_path / 'reach.csv', REACH)
    narrow, wide = tmp_path / 'narrow.yaml', tmp_path / 'wide.yaml'
    for out, overlap in ((narrow, '0.1'), (wide, '0.9')):
        assert main([str(path), '--out', str(out), '--overlap', overlap, '--damping', '30']) == 0
    widths = [load_primitive(out).bases.widths for out in (narrow, wide)]
    assert (widths[0] != widths[1]).all()
    np.testing.assert_allclose(load_primitive(narrow).transformation.damping, 30.0)
    np.testing.assert_allclose(load_primitive(narrow).transformation.stiffness, 225.0)


def test_a_motion_needs_the_recording_of_a_walk(tmp_path, capsys):
    table, out = tmp_path / 'reach.csv', tmp_path / 'motion.yaml'
    table.write_text('time,a\n0,1\n', encoding='utf-8')
    bag = write_bag(tmp_path / 'bag', WALK)
    for given, text in (
        ([str(table)], 'no rosbag2 recording'),
        ([str(tmp_path / 'nothing')], 'does not exist'),
        ([str(bag)], 'no stamp has all of joint_targets'),
        ([str(bag), '--topic', 'imu'], "joint_states, not 'imu'"),
    ):
        assert main([*given, '--motion', str(out)]) == BAD_INPUT
        assert text in capsys.readouterr().err
    for asked, named in ((['--out', 'a.yaml', '--start', '1'], '--out, --start:'),
                         (['--bases', 'auto'], '--bases auto'), (['--positions-only'], '-only')):
        assert main([str(bag), '--motion', str(out), *asked]) == BAD_INPUT
        told = capsys.readouterr().err
        assert 'does not go with' in told and named in told
    assert main([str(table)]) == BAD_INPUT
    assert '--out FILE or --motion FILE' in capsys.readouterr().err
    assert not out.exists()


def test_a_motion_is_learned_where_messages_of_legs_are_lost(tmp_path, capsys, monkeypatch):
    """As at the end of every recording in real time, which comes within a tick."""
    context, _ = run_context({'gait': 'amble'}, None)
    scale = body_scale(context.robot)
    omega = float(context.gait.omega(scale.foot_speed(0.4, 0.0, 0.0), scale))
    walk = SyntheticWalk(cadence_hz=omega / (2.0 * np.pi), end_s=9.0).recording()
    position = walk.targets.position.copy()
    position[-1, 6:] = np.nan
    position[500, :3] = np.nan
    lost = replace(walk, targets=replace(walk.targets, position=position))
    none = replace(walk, targets=replace(walk.targets, position=np.where(
        np.arange(12) < 3, np.nan, position)))
    counts = [[len(foot.foot) for (foot,) in walked_motion.read_motion(
        write_recording(of, tmp_path / name))[0]] for name, of in (('all', walk), ('lost', lost))]
    assert counts[1] == [count - 2 for count in counts[0]]
    monkeypatch.setattr(Progress, 'SILENT_S', 0.0)
    walked_motion.read_motion(tmp_path / 'all')  # one that is longer takes its time, and says so
    assert capsys.readouterr().err.startswith(f'{tmp_path / "all"}: reading: ')
    monkeypatch.undo()
    bag = write_recording(none, tmp_path / 'none')
    assert main([str(bag), '--motion', str(tmp_path / 'motion.yaml')]) == BAD_INPUT
    assert 'lacks the joints fl_abduction, fl_hip, fl_knee' in capsys.readouterr().err


def test_a_bare_bag_has_nothing_to_do_with_a_manifest_beside_it(tmp_path, monkeypatch):
    asked = []

    def context(parameters, robot_file):
        asked.append(parameters)
        raise DataError('no robot')

    monkeypatch.setattr(walked_motion, 'run_context', context)
    (tmp_path / 'manifest.json').write_text('{"parameters": {"gait": "pace"}}')
    for name in ('outing', 'bag'):
        with pytest.raises(DataError, match='no robot'):
            walked_motion.read_motion(write_bag(tmp_path / name, WALK))
    assert asked == [{}, {'gait': 'pace'}]


def test_help_answers_without_ros():
    probe = (
        'import sys; sys.modules["rclpy"] = None; '
        'from dmp_cpg_ros.commands.learn import main; main(["--help"])'
    )
    done = subprocess.run(
        [sys.executable, '-c', probe], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert '--kind' in done.stdout
