# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite on two hosts, and the link between them."""

from __future__ import annotations

import json
import socket
import threading
from math import inf, nan
from pathlib import Path

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
from rclpy.qos import ReliabilityPolicy
from ros_processes import SHARED_HZ, Processes

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.nodes.messages.interfaces import EVERY_TICK, TOPICS
from dmp_cpg_ros.robot.target_loss import WINDOW_NS, TargetLoss
from dmp_cpg_ros.studies import two_hosts
from dmp_cpg_ros.studies.lossy_link import Conditions, LossyLink
from dmp_cpg_ros.studies.network_hosts import Host, NoHostsError, TwoHosts
from dmp_cpg_ros.studies.two_hosts import lead_for

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

TICK_NS = 4_000_000


def may_make_hosts() -> bool:
    """Whether this process can make hosts."""
    try:
        Host('10.87.0.1').close()
    except NoHostsError:
        return False
    return True


NEEDS_HOSTS = pytest.mark.skipif(
    not may_make_hosts(), reason='no network namespaces with TUN devices may be made here')


def packet(number: int, destination: str = '10.87.0.2') -> bytes:
    """Bytes of an IPv4 packet as far as the link reads them, and a number."""
    return b'\x45' + bytes(15) + socket.inet_aton(destination) + number.to_bytes(4, 'big')


def test_a_link_loses_and_delays_as_it_is_told() -> None:
    link, count = LossyLink(seed=1), 20_000
    link.conditions = Conditions(delay_ms=5.0, jitter_ms=2.0, loss=10.0)
    for number in range(count):
        link.take(packet(number), 0.0, to=3)
    assert link.packets == count
    assert link.lost == pytest.approx(0.1 * count, rel=0.1)
    assert link.patience_s(0.0) == pytest.approx(3e-3, rel=0.01)
    assert not link.due(2.99e-3)
    early = link.due(5e-3)
    assert len(early) == pytest.approx((count - link.lost) / 2, rel=0.05)
    numbers = [int.from_bytes(data[-4:], 'big') for _, data in early]
    assert numbers != sorted(numbers)  # each has a delay of its own
    assert len(early) + len(link.due(7e-3)) == count - link.lost
    assert link.patience_s(7e-3) is None


def test_a_link_without_multicast_hands_over_the_rest_in_order() -> None:
    link = LossyLink(seed=0)
    link.conditions = Conditions.parse(Conditions(multicast=False).line)
    for number in range(10):
        link.take(packet(number, '239.255.0.1' if number % 2 else '10.87.0.2'), 0.0, to=3)
    assert link.due(0.0) == [(3, packet(number)) for number in range(0, 10, 2)]


def test_a_lead_covers_the_way_there_and_back() -> None:
    assert lead_for(Conditions(delay_ms=5.0, jitter_ms=2.0)) == 28.0
    assert lead_for(Conditions(delay_ms=50.0)) == 60.0


@pytest.mark.parametrize('numbers', [
    {'delay_ms': -1.0}, {'delay_ms': nan}, {'delay_ms': inf}, {'delay_ms': 2.0, 'jitter_ms': 3.0},
    {'delay_ms': 2.0, 'jitter_ms': -1.0}, {'loss': -1.0}, {'loss': 101.0}, {'loss': nan}])
def test_no_link_does_the_impossible(numbers: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match='a link (takes|loses)'):
        Conditions(**numbers)


@pytest.mark.parametrize('option', [
    ['--delay-ms', '-5'], ['--loss', 'nan'], ['--seconds', 'nan'], ['--speed', '-1'],
    ['--then', '5', '9', '0']])
def test_two_hosts_refuses_impossible_numbers(
        option: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        raise SystemExit(two_hosts.main(option))
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert 'not' in said or 'must be' in said
    assert 'Traceback' not in said


@pytest.mark.parametrize('every', [1, 2, 5])
def test_what_is_lost_is_counted_by_stamps(every: int) -> None:
    loss, ticks = TargetLoss(TICK_NS, gap_ns=200_000_000), 2 * WINDOW_NS // TICK_NS
    for tick in range(0, ticks, every):
        assert tick * TICK_NS >= WINDOW_NS or loss.share == 0.0
        loss.accept(tick * TICK_NS)
    assert loss.share == pytest.approx(1.0 - 1.0 / every)
    loss.accept((ticks + 100) * TICK_NS)  # silence is no loss
    assert loss.share == 0.0


def test_what_comes_at_every_tick_is_read_as_it_comes_over_a_link_and_nothing_else() -> None:
    for topic in TOPICS:
        lossy = topic.lossy_qos.reliability == ReliabilityPolicy.BEST_EFFORT
        assert lossy == (topic.name in EVERY_TICK), topic.name
        assert topic.reader_qos.reliability == ReliabilityPolicy.RELIABLE
    assert {topic.name for topic in TOPICS} >= set(EVERY_TICK)


def bound_on(host: Host) -> socket.socket:
    """UDP socket on a host; it stays there."""
    made: list[socket.socket] = []

    def make() -> None:
        host.enter()
        made.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        made[0].bind((host.address, 0))

    thread = threading.Thread(target=make)
    thread.start()
    thread.join()
    return made[0]


@NEEDS_HOSTS
def test_packets_cross_from_host_to_host_and_not_when_all_are_lost() -> None:
    with TwoHosts(Conditions(delay_ms=1.0), seed=0) as two:
        one, other = map(bound_on, two.hosts)
        with one, other:
            other.settimeout(30.0)
            one.sendto(b'here', other.getsockname())
            data, sender = other.recvfrom(10)
            assert (data, sender) == (b'here', one.getsockname())
            two.change(Conditions(loss=100.0))
            one.sendto(b'lost', other.getsockname())
            told = json.loads(two.end_link())
    assert told['packets'] >= told['lost'] + 1


@NEEDS_HOSTS
def test_a_robot_walks_by_controllers_on_another_host_and_stands_when_the_link_is_cut(
        processes: Processes, tmp_path: Path) -> None:
    """Without multicast, by naming each other; time waits for a busy machine here."""
    results = tmp_path / 'results.json'
    study = processes.python(
        '-m', 'dmp_cpg_ros.studies.two_hosts', '--seconds', '1.5', '--then', '0', '0', '100',
        '--loss', '0', '--delivery', 'reliable', '--peers', '--json', str(results),
        '--ros-args', '-p', 'longest_lag:=0.024', '-p', f'control_rate:={SHARED_HZ}')
    assert study.wait(240.0) == 0, study
    told = json.loads(results.read_text(encoding='utf-8'))
    walked, cut = told['phases']
    assert (walked['drive'], walked['stop']) == ('following', 'walking')
    assert walked['speed'] > 0.1  # a machine that lets it wait lets it walk slowly
    assert cut['drive'] == 'stand' and cut['posture'] == 'standing'
    assert not walked['fell'] and not cut['fell']
    # which of the two reasons it gives depends on what was late before
    assert any('mujoco_robot: ' in text and 'looks after itself: it takes up a stand' in text
               for _, text in told['said']), told['said']
