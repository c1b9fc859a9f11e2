# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the live view of a robot that is being stopped: ``python view_picture.py FILE.png``.

Walks in real time; needs a Chromium.
"""

from __future__ import annotations

import io
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from browser import BrowserError, Page, browser, find_browser
from PIL import Image

WIDTH, HEIGHT = 1400, 880

STATE = "document.querySelector('#state').textContent"


def draw(page: Page, address: str) -> bytes:
    """Walk for some seconds, stop, and draw the stop; PNG."""
    page.open(address, WIDTH, HEIGHT, scale=2)
    page.until(f"{STATE} === 'at rest'")
    page.click('#hold')
    x, y = page.centre('#stick')
    for kind, up in (('Pressed', 0.0), ('Moved', 45.0), ('Released', 45.0)):
        page.mouse(kind, x, y - up)
    page.until(f"{STATE} === 'walking'")
    begin = page.evaluate("parseFloat(document.querySelector('#clock').textContent)")
    page.until(f"parseFloat(document.querySelector('#clock').textContent) > {begin + 7.0}")
    page.click('#inhibit')
    page.until(f"['waiting', 'captured'].includes({STATE})")
    return page.picture()


def main() -> int:
    """Draw; returns the exit status."""
    executable = find_browser()
    if executable is None or len(sys.argv) != 2:
        sys.exit('usage: view_picture.py FILE.png, where there is a Chromium')
    with tempfile.TemporaryDirectory() as folder, browser(executable) as page:
        walk = subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros', 'walk', '--composed', '--view', '--no-report',
             '--out', f'{folder}/run'], stdout=subprocess.PIPE, text=True)
        assert walk.stdout is not None
        try:
            found = next(filter(None, (re.search(r'live view: (\S+)', line)
                                       for line in walk.stdout)))
            picture = Image.open(io.BytesIO(draw(page, found[1])))
            picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS).convert(
                'P', palette=Image.Palette.ADAPTIVE).save(Path(sys.argv[1]), optimize=True)
        except BrowserError as error:
            print(error, file=sys.stderr)
            return 1
        finally:
            walk.send_signal(signal.SIGINT)
            walk.communicate()
    return 0


if __name__ == '__main__':
    sys.exit(main())
