# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures, pictures, the report and the command that makes them."""

from __future__ import annotations

import dataclasses
import errno
import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from browser import Page, browser, find_browser
from synthetic_bag import write_bag
from synthetic_walk import SyntheticWalk, robot

from dmp_cpg_ros.analysis import report
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import planned_stance
from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.figures import robot as robot_figures
from dmp_cpg_ros.analysis.metrics.definitions import DEFINITIONS
from dmp_cpg_ros.analysis.metrics.summary import compute_metrics
from dmp_cpg_ros.analysis.motion import roll_pitch_yaw
from dmp_cpg_ros.analysis.recording import (
    ArrivalSeries,
    Recording,
    StatusEvent,
    VelocitySeries,
)
from dmp_cpg_ros.analysis.report import CATALOGUE, FOLDED, SCRIPT, label, write_figures
from dmp_cpg_ros.analysis.run import RunResults, moments, write_results
from dmp_cpg_ros.analysis.story import MOST_POINTS, story
from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.analysis.tables import flattened
from dmp_cpg_ros.commands.analyze import analyze_run, main
from dmp_cpg_ros.commands.ros_arguments import BAD_INPUT
from dmp_cpg_ros.core.gait.known_gaits import GaitShares

WALK = SyntheticWalk(rate_hz=50.0, turn_rate=0.3)

CERTIFICATE = [
    {'name': 'synchronisation', 'left': 400.0, 'right': 8.0, 'margin': 392.0, 'holds': True},
    {'name': '<capture>', 'left': 0.1, 'right': 0.3, 'margin': 0.2, 'holds': True},
]


@pytest.fixture(scope='module')
def walked() -> Recording:
    return WALK.recording()


@pytest.fixture(scope='module')
def context() -> RunContext:
    return RunContext(robot(), WALK.gait)


def no_pictures(*poses: Any) -> list[Any]:
    return []


def grey_pictures(positions: Any, quaternions: Any, joints: Any) -> list[Any]:
    assert positions.shape[1:] == (3,)
    assert joints.shape[1:] == (12,)
    np.testing.assert_allclose(np.exp(1j * roll_pitch_yaw(quaternions)[:, 2]), 1.0, atol=1e-9)
    return [np.full((9, 16, 3), 128, dtype=np.uint8)] * len(positions)


@pytest.fixture(scope='module')
def results(
    walked: Recording, context: RunContext, tmp_path_factory: pytest.TempPathFactory
) -> RunResults:
    manifest = {'scenario': 'start & stop', 'lock_step': True, 'parameters': {'a': {'b': 1}}}
    return write_results(
        tmp_path_factory.mktemp('run'), walked, context, manifest, CERTIFICATE, grey_pictures
    )


def test_every_figure_is_drawn_and_nothing_global_changes(
    walked: Recording, context: RunContext, tmp_path: Path
) -> None:
    before = dict(matplotlib.rcParams)
    written = write_figures(walked, context, tmp_path)
    assert list(written) == [draw.__name__ for draw in CATALOGUE]
    assert all(path.read_bytes().startswith(b'\x89PNG') for path in written.values())
    assert dict(matplotlib.rcParams) == before


def test_an_empty_recording_has_no_figures(tmp_path: Path) -> None:
    assert write_figures(Recording(), RunContext(), tmp_path) == {}


@pytest.mark.parametrize(
    'topic', ['joints', 'canonical', 'reference', 'odometry', 'feet', 'inhibition', 'statuses']
)
def test_a_missing_topic_costs_no_more_than_its_figures(
    walked: Recording, context: RunContext, tmp_path: Path, topic: str
) -> None:

    less = dataclasses.replace(walked, **{topic: getattr(Recording(), topic)})
    for draw in CATALOGUE:
        draw(less, context)
        draw(less, RunContext())


def test_the_planned_stance_is_that_of_the_walk(walked: Recording, context: RunContext) -> None:
    planned, _ = planned_stance(walked, context)
    running = (WALK.time >= WALK.walk_s) & (WALK.time < WALK.stop_s)
    np.testing.assert_array_equal(planned[running], WALK.stance()[running])


def test_moments_lie_where_their_captions_say(walked: Recording, context: RunContext) -> None:
    found = {moment.name: moment.time for moment in moments(walked, context)}
    assert set(found) == {'at_rest', 'turning'}  # this walk never goes straight
    assert WALK.stop_s + WALK.time_to_rest_s <= found['at_rest'] <= WALK.release_s
    row = np.searchsorted(walked.feet.time, found['turning'])
    assert walked.feet.force[row].min() == 0.0


class References(HTMLParser):
    """Collects everything that a browser would follow or load."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.found += [
            value or ''
            for name, value in attrs
            if name in ('src', 'href', 'srcset', 'data', 'action')
        ]


def test_the_report_fetches_nothing(results: RunResults) -> None:
    assert results.report is not None
    text = results.report.read_text(encoding='utf-8')
    parser = References()
    parser.feed(text)
    assert parser.found
    assert all(value.startswith(('data:image/png;base64,', '#')) for value in parser.found)
    assert not {'link', 'iframe', 'object', 'embed'} & set(parser.tags)
    assert parser.tags.count('script') == 1
    assert not re.search(r'fetch|XMLHttp|WebSocket|import|eval|innerHTML', SCRIPT)
    assert not re.search(r'url\(|@import|https?:', text)
    links = {value[1:] for value in parser.found if value.startswith('#')}
    assert links <= set(re.findall(r'id="(\w+)"', text))


def shapes(html: str, kind: str) -> list[dict[str, float]]:
    return [{key: float(value) for key, value in re.findall(r'(\w+)="(-?[\d.]+)"', found)}
            for found in re.findall(rf'<\w+ class="{kind}"([^>]*)/>', html)]


def test_the_story_tells_what_was_promised_and_kept(
        walked: Recording, context: RunContext) -> None:
    metrics = compute_metrics(walked, context)
    html, (stop,) = story(walked, metrics), metrics['stop']['all']
    (kept,), (bound, predicted) = shapes(html, 'kept'), shapes(html, 'promised')
    assert kept['x'] == bound['x'] == pytest.approx(stop['request_s'], abs=1e-3)
    assert kept['width'] == pytest.approx(stop['measured_s'], abs=1e-3)
    assert bound['width'] == pytest.approx(stop['bound_s'], abs=1e-3)
    assert predicted['x1'] == pytest.approx(stop['request_s'] + stop['predicted_s'], abs=1e-3)
    assert all(f'polyline class="{name}"' in html
               for name in ('commanded', 'reference', 'walked'))
    stop['measured_s'] = stop['bound_s'] + 0.1
    assert shapes(story(walked, metrics), 'kept broken')
    assert story(Recording(), compute_metrics(Recording())) == ''


def test_a_long_story_has_few_points_and_keeps_its_extremes(context: RunContext) -> None:
    time = np.arange(0.0, 400.0, 0.004)
    value = np.zeros((len(time), 3))
    value[77_777, 0], value[50_001, 0] = 0.9, -0.7
    recording = dataclasses.replace(Recording(), reference=VelocitySeries(time, value))
    html = story(recording, compute_metrics(recording, context))
    (points,) = re.findall(r'points="([^"]*)"', html)
    speeds = [float(point.partition(',')[2]) for point in points.split()]
    assert len(speeds) <= MOST_POINTS
    assert (max(speeds), min(speeds)) == (0.9, -0.7)


@pytest.mark.parametrize('wrong', [np.nan, np.inf, -1e308])
def test_the_story_leaves_out_what_is_no_speed(
        walked: Recording, context: RunContext, wrong: float) -> None:
    value = walked.commands.value.copy()
    value[5, 0] = wrong
    recording = dataclasses.replace(
        walked, commands=dataclasses.replace(walked.commands, value=value))
    html = story(recording, compute_metrics(recording, context))
    assert 'polyline class="commanded"' in html and 'nan' not in html
    (zero,) = shapes(html, 'zero')
    assert re.findall(r'viewBox="[-\d. ]*"', html) == re.findall(
        r'viewBox="[-\d. ]*"', story(walked, compute_metrics(walked, context))) and zero


def test_what_is_no_pose_is_left_out_of_the_path(
        walked: Recording, context: RunContext, tmp_path: Path) -> None:
    position = walked.odometry.position_in_world.copy()
    position[7, 1], position[9, 0] = np.nan, np.inf
    recording = dataclasses.replace(
        walked, odometry=dataclasses.replace(walked.odometry, position_in_world=position))
    assert robot_figures.path(recording, context) is not None
    assert len(write_figures(recording, context, tmp_path)) == len(CATALOGUE)


def test_targets_that_came_before_their_states_have_a_histogram() -> None:
    state = np.arange(9.0)
    arrivals = ArrivalSeries(0.004 * state, state, state - 0.5)
    assert robot_figures.timing(Recording(arrivals=arrivals), RunContext()) is not None


def test_a_figure_that_cannot_be_drawn_costs_no_other(
        walked: Recording, context: RunContext, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        caplog: pytest.LogCaptureFixture) -> None:
    def broken(recording: Recording, context: RunContext) -> None:
        raise ValueError('no limits')

    monkeypatch.setattr(report, 'CATALOGUE', (broken, robot_figures.attitude))
    assert list(write_figures(walked, context, tmp_path)) == ['attitude']
    assert "no figure 'broken': no limits" in caplog.text


def box(page: Page, element: str) -> list[float]:
    """Left, top, width and height of an element in the window [pixels]."""
    of = page.evaluate('(({ x, y, width, height }) => [x, y, width, height])'
                       f'({element}.getBoundingClientRect())')
    return list(of)


def zooms_where_it_is_dragged(page: Page, image: str) -> None:
    """A rectangle of a quarter of a figure's size fills its frame, and a double click shows all;
    a click enlarges to twice the size about the place.
    """
    frame = f'{image}.parentElement'
    page.evaluate(f'{frame}.scrollIntoView({{ block: "center" }})')
    left, top, width, height = whole = box(page, image)
    assert box(page, frame) == pytest.approx(whole, abs=1.0)
    x, y = left + 0.5 * width, top + 0.25 * height               # of the rectangle's upper left
    page.mouse('Pressed', x, y)
    page.mouse('Moved', x + 0.1 * width, y + 0.1 * height)
    marked = box(page, f"{frame}.querySelector('.mark')")
    assert marked == pytest.approx([x, y, 0.1 * width, 0.1 * height], abs=2.0)
    page.mouse('Released', x + 0.25 * width, y + 0.25 * height)
    large = box(page, image)
    assert large[2:] == pytest.approx([4.0 * width, 4.0 * height], rel=0.05)
    assert large[:2] == pytest.approx(
        [left - 4.0 * (x - left), top - 4.0 * (y - top)], abs=0.1 * width)
    assert box(page, frame) == pytest.approx(whole, abs=1.0)
    page.evaluate(f'{frame}.ondblclick()')
    assert box(page, image) == pytest.approx(whole, abs=1.0)
    for kind in ('Pressed', 'Released'):
        page.mouse(kind, left + 0.75 * width, top + 0.5 * height)
    assert box(page, image) == pytest.approx(
        [left - width, top - 0.5 * height, 2.0 * width, 2.0 * height], abs=4.0)
    page.evaluate(f'{frame}.ondblclick()')


@pytest.mark.skipif(find_browser() is None, reason='no Chromium here')
def test_the_report_zooms_and_unfolds(results: RunResults) -> None:
    view = "document.querySelector('.story svg').getAttribute('viewBox').split(' ').map(Number)"
    with browser(find_browser() or '') as page:
        page.open(f'file://{results.report}')
        whole = page.evaluate(view)
        x, y = page.centre('.story .plot')
        for kind, at in (('Pressed', x), ('Moved', x + 50), ('Released', x + 100)):
            page.mouse(kind, at, y)
        start, _, width, _ = page.evaluate(view)
        assert start == pytest.approx(whole[0] + 0.5 * whole[2], rel=0.02)
        assert 0.05 * whole[2] < width < 0.2 * whole[2]
        assert page.evaluate("document.querySelectorAll('.times span').length") > 2
        page.evaluate("document.querySelector('.story .plot').ondblclick()")
        assert page.evaluate(view) == whole
        count = page.evaluate('document.images.length')
        assert count > len(CATALOGUE) // 2
        for number in range(count):
            zooms_where_it_is_dragged(page, f'document.images[{number}]')
        for name in FOLDED:
            folded = f"document.getElementById('{name.lower().replace(' ', '_')}')"
            if page.evaluate(f'{folded} !== null'):
                assert page.evaluate(f'{folded}.open') is False
        page.evaluate("location.hash = '#metrics'")
        page.until("document.getElementById('metrics').open")
        assert not page.problems


def test_the_report_shows_figures_pictures_certificate_and_escapes(results: RunResults) -> None:
    assert results.report is not None
    text = results.report.read_text(encoding='utf-8')
    assert text.count('data:image/png') == len(CATALOGUE) + len(results.pictures)
    for word in ('start &amp; stop', '&lt;capture&gt;', 'lock-step', 'synchronisation'):
        assert word in text
    assert '<capture>' not in text


def test_the_folder_holds_strict_json(results: RunResults) -> None:
    for name in ('metrics.json', 'manifest.json'):
        text = (results.folder / name).read_text(encoding='utf-8')
        json.loads(text, parse_constant=pytest.fail)
    assert json.loads((results.folder / 'metrics.json').read_text())['certificate'] == CERTIFICATE


def test_every_number_is_defined(results: RunResults) -> None:
    numbers = {key: value for key, value in results.metrics.items() if key != 'certificate'}
    assert set(flattened(numbers)) == set(DEFINITIONS)


def test_texts_of_a_recording_are_no_markup(context: RunContext, tmp_path: Path) -> None:
    hostile = '<script>alert("&")</script>'
    walk = WALK.recording()
    values = {'requested': 'true', 'cause': hostile, 'request_stamp': hostile}
    changed = dataclasses.replace(
        walk,
        inhibition=tuple(dataclasses.replace(event, values={**event.values, **values})
                         for event in walk.inhibition),
        statuses={hostile: (StatusEvent(1.0, 2, hostile, {hostile: hostile}),)},
        modes=(StatusEvent(0.0, 0, hostile, {'reason': hostile}),),
        canonical=dataclasses.replace(
            walk.canonical, gaits=(GaitShares(hostile),) * len(walk.canonical.time)))
    manifest = {'scenario': hostile, hostile: [hostile, {hostile: hostile}],
                'parameters': {hostile: hostile}}
    certificate = [{'name': hostile, hostile: hostile, 'holds': True}]
    written = write_results(tmp_path, changed, context, manifest, certificate, no_pictures)
    assert written.report is not None and written.pictures == {}
    page = written.report.read_text(encoding='utf-8')
    assert page.count('<script') == 1 and f'<script>{SCRIPT}</script>' in page
    assert '&lt;script&gt;' in page


def test_labels_have_units() -> None:
    assert label('body_speed_at_rest_m_s') == 'body speed at rest [m/s]'
    assert label('request_s') == 'request [s]'
    assert label('cycles') == 'cycles'


def test_facts_do_not_hold_when_the_run_was_bad(walked: Recording, context: RunContext) -> None:
    metrics = compute_metrics(walked, context, [{'name': 'a', 'holds': False}])
    good = {fact.statement for fact in facts(metrics) if fact.holds is False}
    assert good == {'The certificate of the parameters at the start holds'}
    metrics['robot']['fell'] = True
    metrics['tracking']['v_error_max'] = 0.2
    metrics['stop']['all'][0] |= {
        'measured_s': 2.0,
        'bound_s': 1.0,
        'body_speed_at_rest_m_s': 0.02,
        'feet_down_at_rest': False,
    }
    metrics['timing']['real_time_factor'] = 0.5
    assert sum(fact.holds is False for fact in facts(metrics, lock_step=False)) == 7
    assert sum(fact.holds is False for fact in facts(metrics, lock_step=True)) == 6


@pytest.mark.parametrize(('told', 'lost'), [
    ('true true true', None), ('false false true', None), ('true false true', '9.00 s'),
    ('false true false', '9.80 s'), ('- true false', '9.80 s')])
def test_a_certificate_that_a_change_has_cost_is_told_with_its_time(
        walked: Recording, context: RunContext, told: str, lost: str | None) -> None:
    """A recording may begin without a certificate, as with ``allow_uncertified``."""
    words = dict(zip((0.0, WALK.stop_s, WALK.stop_s + WALK.time_to_rest_s), told.split(),
                     strict=True))
    events = tuple(
        dataclasses.replace(event, values={
            **event.values, **({} if words[event.time] == '-' else {
                'certified': words[event.time]})})
        for event in walked.inhibition if event.time in words)
    changed = dataclasses.replace(walked, inhibition=events)
    found = {fact.statement: fact for fact in facts(compute_metrics(
        changed, context, CERTIFICATE))}
    assert found['The certificate of the parameters at the start holds'].holds
    fact = found.get('The certificate held whatever was changed')
    assert (fact is None) == (lost is None)
    assert fact is None or (fact.holds, fact.finding) == (False, f'it failed from {lost} on')


def test_the_command_needs_a_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / 'nowhere')]) == BAD_INPUT
    assert 'does not exist' in capsys.readouterr().err
    assert main([str(tmp_path)]) == BAD_INPUT
    assert 'no rosbag2 recording' in capsys.readouterr().err
    with pytest.raises(SystemExit) as stopped:
        main(['--help'])
    assert stopped.value.code == 0


def test_the_command_names_a_bad_robot_file(
    walked: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_bag(walked, tmp_path / 'bag')
    assert main([str(tmp_path), '--robot', str(tmp_path / 'no.yaml')]) == BAD_INPUT
    assert 'no.yaml' in capsys.readouterr().err


def test_the_command_fills_the_runs_folder_and_keeps_its_manifest(
    walked: Recording, tmp_path: Path
) -> None:
    write_bag(walked, tmp_path / 'bag')
    parameters = {'canonical_oscillators': {'gait': 'trot'}, 'robot': {'robot': 'mini_quadruped'}}
    first = analyze_run(
        tmp_path,
        parameters={**parameters, 'x': {'robot': 'robots/mini_quadruped.yaml'}},
        certificate=CERTIFICATE,
        lock_step=True,
        report=False,
        scenario='a',
    )
    assert len(first.manifest['digests']) == 6
    assert not (tmp_path / 'report.html').exists()
    assert main([str(tmp_path), '--no-pictures']) == 0
    for name in ('metrics.json', 'manifest.json', 'report.html', 'figures/footfall.png'):
        assert (tmp_path / name).is_file()
    assert json.loads((tmp_path / 'manifest.json').read_text()) == first.manifest
    metrics = json.loads((tmp_path / 'metrics.json').read_text())
    assert metrics['certificate'] == CERTIFICATE
    assert metrics['gait']['name'] == 'trot'


def test_a_manifest_stays_as_it_is_and_one_that_cannot_be_read_is_refused(
        walked: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(walked, tmp_path / 'bag')
    manifest = tmp_path / 'manifest.json'
    manifest.write_text('{"scenario":   "a"}')
    analyze_run(tmp_path, report=False)
    assert manifest.read_text() == '{"scenario":   "a"}'
    for text in ('{"scenario": "a', '[]'):
        manifest.write_text(text)
        assert main([str(tmp_path), '--no-pictures']) == BAD_INPUT
        assert f"'{manifest}'" in capsys.readouterr().err
        assert manifest.read_text() == text


def test_a_disk_that_is_full_costs_no_earlier_result(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, write = tmp_path / 'metrics.json', Path.write_text
    write_json(path, {'a': 1})

    def half(to: Path, text: str, encoding: str) -> None:
        write(to, text[:3], encoding)
        raise OSError(errno.ENOSPC, 'full')

    monkeypatch.setattr(Path, 'write_text', half)
    with pytest.raises(OSError, match='full'):
        write_json(path, {'a': 2})
    assert json.loads(path.read_text()) == {'a': 1}
    assert list(tmp_path.iterdir()) == [path]


WINDOWS = """
import ctypes, os, sys
for name in ('fcntl', 'resource', 'termios', 'pwd', 'grp'):
    sys.modules[name] = None
for name in ('getloadavg', 'sched_getaffinity', 'fork', 'getuid', 'geteuid'):
    delattr(os, name)
library = ctypes.CDLL.__init__
def load(self, name, *rest, **more):
    library(self, name + '' if name is None else name, *rest, **more)
ctypes.CDLL.__init__ = load
from dmp_cpg_ros.commands.analyze import main
sys.exit(main(sys.argv[1:]))
"""
"""What is not on Windows, taken away."""


def test_the_command_needs_nothing_that_windows_does_not_have(
        walked: Recording, tmp_path: Path) -> None:
    write_bag(walked, tmp_path / 'bag')
    subprocess.run([sys.executable, '-c', WINDOWS, tmp_path, '--no-pictures'], check=True)
    assert (tmp_path / 'report.html').is_file()


def test_a_bare_bag_gets_its_results_beside_it(walked: Recording, tmp_path: Path) -> None:
    write_bag(walked, tmp_path / 'outing')
    assert analyze_run(tmp_path / 'outing', report=False).folder == tmp_path / 'outing_analysis'
    assert (
        analyze_run(tmp_path / 'outing', report=False, out=tmp_path / 'x').folder == tmp_path / 'x'
    )


def test_a_bare_bag_that_is_called_bag_is_no_run(
    walked: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_bag(walked, tmp_path / 'bag')
    monkeypatch.chdir(tmp_path)
    assert main(['bag', '--no-pictures']) == 0
    for name in ('bag/bag.mcap', 'bag/metadata.yaml'):
        analyze_run(name, report=False)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_analysis']
    inside = [path.name for path in (tmp_path / 'bag').iterdir() if path.is_dir()]
    assert inside == ['bag_analysis']
    monkeypatch.chdir(tmp_path / 'bag')
    assert analyze_run('.', report=False).folder == tmp_path / 'bag_analysis'


def test_the_bag_of_a_run_has_its_results_in_the_run(walked: Recording, tmp_path: Path) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    assert analyze_run(tmp_path, report=False).folder == tmp_path
    for path in (bag, bag / 'bag.mcap'):
        assert analyze_run(path, report=False).folder == tmp_path
