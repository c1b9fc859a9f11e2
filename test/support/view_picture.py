# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the live view of a robot that is being stopped: ``python view_picture.py FILE.png``.

Walks in real time; needs a Chromium.
"""

from __future__ import annotations

import contextlib
import io
import re
import signal
import subprocess
import sys
import tempfile
import threading
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from browser import BrowserError, Page, browser, find_browser
from PIL import Image

WIDTH, HEIGHT = 1400, 880

PATIENCE_S = 200.0

STATE = "document.querySelector('#state').textContent"


def drive(address: str, over: threading.Event) -> None:
    """Command a velocity until it is over, from outside of a browser that is busy drawing."""
    url = urlsplit(address)
    headers = {'Authorization': f'Bearer {parse_qs(url.query)["token"][0]}'}
    while not over.wait(0.1):
        with contextlib.suppress(OSError):
            connection = HTTPConnection('127.0.0.1', url.port or 0, timeout=30)
            connection.request('POST', '/command', '{"velocity": [0.5, 0, 0.1]}', headers)
            connection.getresponse().read()


def draw(page: Page, address: str) -> bytes:
    """Walk for some seconds, stop, and draw the stop; PNG."""
    page.open(address, WIDTH // 2, HEIGHT // 2)
    page.until(f"{STATE} === 'at rest'", PATIENCE_S)
    over = threading.Event()
    threading.Thread(target=drive, args=(address, over)).start()
    try:
        page.until(f"{STATE} === 'walking'", PATIENCE_S)
        begin = page.evaluate("parseFloat(document.querySelector('#clock').textContent)")
        page.until(f"parseFloat(document.querySelector('#clock').textContent) > {begin + 4.0}",
                   PATIENCE_S)
        page.resize(WIDTH, HEIGHT)
        page.evaluate("document.querySelector('#inhibit').click()")
        page.until(f"['waiting', 'captured', 'at rest'].includes({STATE})", PATIENCE_S)
        return page.picture()
    finally:
        over.set()


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
