# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of the paper: what it computes, what is packed into it, and how it is in a browser."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Page as BrowserPage
from browser import browser, find_browser

from dmp_cpg_ros.commands.certify import running_setting
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.paper.interactive import Page
from dmp_cpg_ros.studies import paper_page
from dmp_cpg_ros.suite import load_suite

PATIENCE_S, NPM_PATIENCE_S = 300.0, 60.0

GIVEN = json.loads(paper_page.given())
PAGE = Page(**GIVEN)
VALUES = {'gait': 'amble', 'coupling_graph': 'all_to_all', 'leg': 'fl', 'inhibition_gain': 400.0,
          'region_radius': 0.3, 'cadence_scale': 1.0, 'coupling_gain': 100.0}


def answer(what: str, **changes: object) -> Any:
    return json.loads(PAGE.answer(what, json.dumps({**VALUES, **changes})))


def blocks(html: str) -> dict[str, bytes]:
    """Parts that are packed into a page, by name."""
    found = re.findall(r'<script type="text/plain" id="(.+?)">(.*?)</script>', html)
    return {name: gzip.decompress(base64.b64decode(text)) for name, text in found}


@pytest.mark.parametrize('changes', [
    {}, {'gait': 'trot'}, {'inhibition_gain': 150.0}, {'coupling_graph': 'ring', 'leg': 'rr'},
    {'region_radius': 0.1, 'cadence_scale': 0.7}, {'leg': 'auto'}])
def test_its_certificate_is_that_of_the_suite(changes: dict[str, Any]) -> None:
    set_ = {('inhibited_legs' if name == 'leg' else name): [value] if name == 'leg' else value
            for name, value in changes.items()}
    expected = certify(running_setting(load_suite(overrides=set_)))
    found = answer('certificate', **changes)
    assert {name: found[name] for name in expected.as_mapping()} == json.loads(
        json.dumps(expected.as_mapping()))
    assert found['broken'] == [row.explained() for row in expected.failing]


@pytest.mark.parametrize('gait', ['amble', 'trot', 'pronk'])
def test_a_stop_and_a_start_take_the_time_that_is_predicted_and_keep_the_bound(gait: str) -> None:
    episode, certificate = answer('episode', gait=gait), answer('certificate', gait=gait)
    stop, start = episode['stop'], episode['start']
    assert certificate['holds']
    assert stop['measured'] == pytest.approx(stop['predicted'], abs=1e-9)
    assert start['measured'] == pytest.approx(start['predicted'], abs=1e-9)
    assert stop['measured'] <= certificate['time_to_rest_s']
    words = list(dict.fromkeys(frame['state'] for frame in episode['frames']))
    assert [word for word in words if word != 'free'] == [
        'walking', 'waiting', 'captured', 'at_rest', 'releasing']
    resting = [frame['x'] for frame in episode['frames'] if frame['state'] == 'at_rest']
    assert np.ptp(resting, axis=0).max() < 0.02
    assert np.linalg.norm(np.subtract(resting[-1][0], [1.0, 0.0])) < episode['region']


def test_a_gait_that_a_small_gain_cannot_hold_walks_on_as_is_predicted() -> None:
    stop = answer('episode', inhibition_gain=20.0)['stop']
    assert stop['predicted'] is None and stop['measured'] is None
    assert 'capture' in answer('certificate', inhibition_gain=20.0)['failing']


def test_what_is_packed_runs_on_numpy_alone(tmp_path: Path) -> None:
    with zipfile.ZipFile(io.BytesIO(paper_page.core())) as archive:
        archive.extractall(tmp_path)
    program = (
        'import json, sys\n'
        f'sys.path.insert(0, {str(tmp_path)!r})\n'
        'given, values = map(json.loads, sys.stdin)\n'
        'before = set(sys.modules)\n'
        'from dmp_cpg_ros.paper import interactive\n'
        f'assert interactive.__file__.startswith({str(tmp_path)!r})\n'
        'page = interactive.Page(**given)\n'
        'for what in ("certificate", "episode"): print(page.answer(what, json.dumps(values)))\n'
        'tops = {name.split(".")[0] for name in set(sys.modules) - before}\n'
        'assert tops - set(sys.stdlib_module_names) <= {"dmp_cpg_ros", "numpy"}, tops\n')
    done = subprocess.run([sys.executable, '-c', program], text=True, capture_output=True,
                          input=f'{json.dumps(GIVEN)}\n{json.dumps(VALUES)}\n')
    assert done.returncode == 0, done.stderr
    certificate, episode = map(json.loads, done.stdout.splitlines())
    assert certificate == answer('certificate') and episode == answer('episode')


def test_a_page_holds_its_parts_and_names_no_other_place() -> None:
    parts = {name: name.encode() * 3 for name in (*paper_page.TAKEN, paper_page.WHEEL)}
    html = paper_page.page(parts)
    found = blocks(html)
    assert {name: found[name] for name in parts} == parts
    assert json.loads(found['given.json']) == GIVEN
    shell = re.sub(r'<script type="text/plain".*?</script>', '', html)
    assert not re.findall(r'(?:src|href)="(?!data:,)', shell) and '\nexport ' not in shell
    assert set(re.findall(r'https?://[^\s\'"]+', shell)) == {'https://page.invalid/'}


def test_an_archive_that_is_not_the_one_that_is_meant_is_refused(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    for name, version, _ in paper_page.PACKAGES.values():
        (tmp_path / f'{name.strip("@").replace("/", "-")}-{version}.tgz').write_bytes(b'another')
    with pytest.raises(DataError, match=r"'.*pyodide-.*\.tgz' is not the archive"):
        paper_page.parts(paper_page.download(tmp_path))


def test_a_wheel_is_what_a_package_of_conda_installs_without_its_tests() -> None:
    conda = {'lib/python3.12/site-packages/numpy/__init__.py': b'1', 'info/index.json': b'{}',
             'lib/python3.12/site-packages/numpy/_core/tests/test_it.py': b'',
             'lib/python3.12/site-packages/numpy-2.0.1.dist-info/LICENSE.txt': b'BSD'}
    wheel = paper_page.wheel(conda)
    with zipfile.ZipFile(io.BytesIO(wheel)) as archive:
        assert archive.namelist() == ['numpy-2.0.1.dist-info/LICENSE.txt', 'numpy/__init__.py']
    assert wheel == paper_page.wheel(dict(reversed(conda.items())))


def test_without_npm_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    with pytest.raises(DataError, match='npm pack .*pyodide@'):
        paper_page.download(tmp_path)
    assert capsys.readouterr().err.startswith('fetching pyodide@')


# --- in a browser -------------------------------------------------------------------------------

@pytest.fixture(scope='module')
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowserPage]:
    """The page, offline; npm has its own store, so that only the first time takes a download."""
    executable = find_browser()
    if executable is None:
        pytest.skip('there is no Chromium here (Debian: apt-get install chromium)')
    folder = tmp_path_factory.mktemp('page')
    try:
        archives = paper_page.download(folder, NPM_PATIENCE_S)
    except DataError as error:
        pytest.skip(f'there is no npm, or what it says: {error}')
    file = folder / 'index.html'
    file.write_text(paper_page.page(paper_page.parts(archives)), encoding='utf-8')
    with browser(executable) as page:
        page.call('Network.enable')
        page.call('Network.emulateNetworkConditions', offline=True, latency=0,
                  downloadThroughput=-1, uploadThroughput=-1)
        page.open(file.as_uri(), 1500, 900)
        page.until('document.body.dataset.shown', PATIENCE_S)
        yield page


def shown(page: BrowserPage, name: str, value: float | str) -> None:
    """Set an input and wait until its value is what is shown."""
    page.evaluate(f"(() => {{ const input = document.getElementById('{name}'); "
                  f"input.value = '{value}'; input.dispatchEvent(new Event('input')); }})()")
    page.until(f"JSON.parse(document.body.dataset.shown)['{name}'] === {json.dumps(value)} "
               "&& document.querySelector('#busy').textContent === ''", PATIENCE_S)


def leaves(value: Any) -> Iterator[float | str | None]:
    """Numbers and words of a JSON value with the keys, in order; every number as a float."""
    if isinstance(value, dict):
        for key in sorted(value):
            yield key
            yield from leaves(value[key])
    elif isinstance(value, list):
        for item in value:
            yield from leaves(item)
    else:
        yield float(value) if isinstance(value, int) else value


def text(page: BrowserPage, selector: str) -> list[str]:
    return page.evaluate(
        f'[...document.querySelectorAll({json.dumps(selector)})].map((e) => e.textContent)')


def test_in_a_browser_without_a_network_the_line_that_breaks_is_the_one_of_python(
        page: BrowserPage) -> None:
    assert text(page, '#verdict') == ['holds'] and text(page, '#broken li') == []
    needed = answer('certificate')['inequalities']['capture']['left']
    above, below = 10 * int(needed // 10 + 1), 10 * int(needed // 10)
    for gain, holds in ((above, True), (below, False)):
        shown(page, 'inhibition_gain', gain)
        expected = answer('certificate', inhibition_gain=gain)
        assert ('capture' not in expected['failing']) == holds
        assert text(page, '#broken li') == expected['broken']
        broken = page.evaluate("[...document.querySelectorAll('.side.fails')].map("
                               '(side) => side.dataset.name)')
        assert sorted(broken) == sorted(expected['failing'])
        stop = answer('episode', inhibition_gain=gain)['stop']
        assert f'to rest: predicted {stop["predicted"]:.3f} s' in text(page, '#spans')[0]
    shown(page, 'inhibition_gain', 20)
    assert 'to rest: predicted not in 4 s, taken –' in text(page, '#spans')[0]
    assert page.problems == []


@pytest.mark.parametrize('changes', [
    {}, {'gait': 'trot', 'leg': 'auto'}, {'coupling_graph': 'directed_ring', 'leg': 'rr'},
    {'inhibition_gain': 20.0}, {'cadence_scale': 2.5, 'coupling_gain': 7.0}])
def test_in_a_browser_every_number_is_that_of_python(
        page: BrowserPage, changes: dict[str, Any]) -> None:
    for what in ('certificate', 'episode'):
        found = page.evaluate(f"answer('{what}', {json.dumps({**VALUES, **changes})})")
        assert list(leaves(found)) == [
            pytest.approx(leaf, rel=1e-12, abs=1e-12) if isinstance(leaf, float) else leaf
            for leaf in leaves(answer(what, **changes))]


def test_in_a_browser_every_graph_leg_and_gait_is_answered_as_by_python(page: BrowserPage) -> None:
    changes: dict[str, float | str] = {}
    for name, value in (('inhibition_gain', 400), ('coupling_graph', 'star'), ('leg', 'rr'),
                        ('gait', 'trot'), ('region_radius', 0.45), ('cadence_scale', 3),
                        ('coupling_gain', 7)):
        shown(page, name, value)
        changes[name] = value
        assert text(page, '#broken li') == answer('certificate', **changes)['broken'], changes
    assert page.problems == []
    (contents,) = text(page, '#contents')
    assert paper_page.CONTENTS in contents
    assert len(page.picture()) > 10_000
