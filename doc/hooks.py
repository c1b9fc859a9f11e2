# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What ``make doc`` does to the pages: tables of the reference, links out of the folder."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from dmp_cpg_ros.commands.reference import SECTIONS

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r'(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)')


def on_config(config: Any) -> Any:
    """Take the address of the repository, and the one of the site, from package.xml."""
    urls = {url.get('type'): url.text
            for url in ElementTree.parse(ROOT / 'package.xml').getroot().iter('url')}
    config['repo_url'], config['site_url'] = urls.get('repository'), urls.get('documentation', '')
    return config


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Fill in the tables, and lead links to other files to the repository, if there is one."""
    folder = (ROOT / 'doc' / page.file.src_uri).parent

    def link(found: re.Match[str]) -> str:
        text, target = found.groups()
        name, _, anchor = target.partition('#')
        path = os.path.relpath(folder / name, ROOT)
        if '://' in target or not name or path.startswith('doc/'):
            return found[0]
        if path == 'README.md':
            home = os.path.relpath(ROOT / 'doc' / 'index.md', folder)
            return f'[{text}]({home})'
        home = config['repo_url']
        return f'[{text}]({home}/blob/main/{path}{"#" * bool(anchor)}{anchor})' if home else text

    filled = re.sub(r'^<!-- table: (\w+) -->$', lambda found: SECTIONS[found[1]](), markdown,
                    flags=re.MULTILINE)
    return LINK.sub(link, filled)
