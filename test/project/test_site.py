# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The documentation as a site: tables are filled in, links lead somewhere, nothing is fetched."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from checkout import ROOT

pytest.importorskip('rclpy')  # the reference is made from the tables of nodes

PAGES = sorted((ROOT / 'doc').rglob('*.md'))


@pytest.fixture(scope='module')
def hooks() -> Any:
    spec = importlib.util.spec_from_file_location('hooks', ROOT / 'doc' / 'hooks.py')
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def filled(hooks: Any, path: Path, repository: str | None) -> str:
    """Text of a page as the site gets it."""
    page = SimpleNamespace(file=SimpleNamespace(src_uri=str(path.relative_to(ROOT / 'doc'))))
    text = path.read_text(encoding='utf-8')
    return str(hooks.on_page_markdown(text, page, {'repo_url': repository}))


@pytest.mark.parametrize('path', PAGES, ids=lambda path: path.stem)
def test_links_stay_in_the_site_or_lead_to_the_repository(hooks: Any, path: Path) -> None:
    for repository in (None, 'https://example.org/it'):
        text = filled(hooks, path, repository)
        assert '<!-- table' not in text
        prose = re.sub(r'```.*?```', '', text, flags=re.DOTALL)
        for link in re.findall(r'\]\(([^)\s]+)\)', prose):
            if link.startswith(f'{repository}/blob/main/'):
                target = ROOT / link.partition('/blob/main/')[2].partition('#')[0]
            elif '://' in link:
                continue
            else:
                target = (path.parent / link.partition('#')[0]).resolve()
                assert (ROOT / 'doc') in (target, *target.parents), link
            assert target.exists(), link


def test_every_page_is_in_the_navigation() -> None:
    navigation = (ROOT / 'mkdocs.yml').read_text(encoding='utf-8').partition('nav:')[2]
    named = set(re.findall(r'[\w/]+\.md', navigation))
    assert named == {str(path.relative_to(ROOT / 'doc')) for path in PAGES}


def test_the_site_is_made_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip('mkdocs')
    pytest.importorskip('material')
    done = subprocess.run([sys.executable, '-m', 'mkdocs', 'build', '--strict', '--site-dir',
                           str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 'inhibition_gain' in (tmp_path / 'reference.html').read_text()
    for page in tmp_path.rglob('*.html'):
        fetched = re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="?(https?://[^">\s]+)',
                             page.read_text(encoding='utf-8'))
        assert not fetched, page
