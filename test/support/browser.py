# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, driven through its debugging pipe: nothing but the browser is needed."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from typing import Any

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
"""Executables that are looked for; the environment variable ``BROWSER`` names another."""

FLAGS = ('--headless=new', '--no-sandbox', '--remote-debugging-pipe', '--no-first-run',
         '--enable-unsafe-swiftshader', '--disable-background-networking', '--disable-sync',
         '--disable-component-update', '--no-proxy-server')

WITHOUT_WEBGL = """
const context = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
  return kind === 'webgl2' ? null : context.call(this, kind, ...options);
};
"""
"""What runs before a page that has none."""

DEADLINE_S = 60.0
"""How long a page may take [s]; a loaded machine is no failure."""


def find_browser() -> str | None:
    """Path of a Chromium, or None."""
    return next(filter(None, map(shutil.which, (os.environ.get('BROWSER', ''), *NAMES))), None)


class BrowserError(Exception):
    """The browser, or the page in it, did something wrong."""


class Page:
    """One page.

    Parameters
    ----------
    to_browser, from_browser : int
        File descriptors of the debugging pipe.

    Attributes
    ----------
    problems : list of str
        Exceptions and errors that the page has written to its console.
    """

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self._to, self._from, self._number, self._rest = to_browser, from_browser, 0, b''
        self._session = ''
        self.problems: list[str] = []
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        self._session = self.call(
            'Target.attachToTarget', targetId=target, flatten=True)['sessionId']
        for domain in ('Page', 'Runtime', 'Log'):
            self.call(f'{domain}.enable')

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the debugging protocol."""
        self._number += 1
        request = {'id': self._number, 'method': method, 'params': parameters}
        if self._session:
            request['sessionId'] = self._session
        os.write(self._to, json.dumps(request).encode() + b'\0')
        while True:
            message = self._read()
            if message.get('id') == self._number:
                if 'error' in message:
                    raise BrowserError(f'{method}: {message["error"]}')
                return dict(message['result'])
            self._note(message.get('method', ''), message.get('params', {}))

    def open(self, address: str, width: int = 1400, height: int = 900, *, scale: float = 1,
             touch: bool = False, webgl: bool = True) -> None:
        """Go to an address, in a window of a size [pixels], of a telephone perhaps; without WebGL,
        which takes a core where there is no graphics card.
        """
        self.resize(width, height, scale=scale, touch=touch)
        without = '' if webgl else self.call(
            'Page.addScriptToEvaluateOnNewDocument', source=WITHOUT_WEBGL)['identifier']
        self.call('Page.navigate', url=address)
        self.until(f"location.href === {address!r} && document.readyState === 'complete'")
        if without:
            self.call('Page.removeScriptToEvaluateOnNewDocument', identifier=without)

    def resize(self, width: int, height: int, *, scale: float = 1, touch: bool = False) -> None:
        """Give the window another size."""
        self.call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                  deviceScaleFactor=scale, mobile=touch)

    def evaluate(self, expression: str) -> Any:
        """Value of an expression of JavaScript; promises are awaited."""
        answer = self.call('Runtime.evaluate', expression=expression, awaitPromise=True,
                           returnByValue=True)
        if 'exceptionDetails' in answer:
            raise BrowserError(f'{expression}: {answer["exceptionDetails"]}')
        return answer['result'].get('value')

    def until(self, expression: str, deadline_s: float = DEADLINE_S) -> Any:
        """Wait until an expression is true; returns its value."""
        end = time.monotonic() + deadline_s
        while not (value := self.evaluate(expression)):
            if time.monotonic() > end:
                raise BrowserError(
                    f'waited {deadline_s} s in vain for {expression}; problems: {self.problems}; '
                    f'the page says: {self.evaluate("document.body.innerText")}')
        return value

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Move, press or release the left button (``Moved``, ``Pressed``, ``Released``)."""
        self.call('Input.dispatchMouseEvent', type=f'mouse{kind}', x=x, y=y, button='left',
                  buttons=0 if kind == 'Released' else 1, clickCount=0 if kind == 'Moved' else 1)

    def key(self, kind: str, key: str) -> None:
        """Press or release a key (``keyDown``, ``keyUp``)."""
        self.call('Input.dispatchKeyEvent', type=kind, key=key)

    def centre(self, selector: str) -> tuple[float, float]:
        """Centre of an element [pixels], scrolled into the window."""
        x, y = self.evaluate(
            f'(() => {{ const e = document.querySelector({selector!r}); '
            'e.scrollIntoView({ block: "nearest" }); const b = e.getBoundingClientRect(); '
            'return [b.x + b.width / 2, b.y + b.height / 2]; })()')
        return x, y

    def click(self, selector: str) -> None:
        """Click on an element, once the page around it no longer moves."""
        end = time.monotonic() + DEADLINE_S
        x, y = self.centre(selector)
        while (x, y) != (found := self._drawn(selector)):
            if time.monotonic() > end:
                raise BrowserError(f'waited {DEADLINE_S} s in vain until {selector} stood still')
            x, y = found
        self.mouse('Pressed', x, y)
        self.mouse('Released', x, y)

    def _drawn(self, selector: str) -> tuple[float, float]:
        """Centre of an element after the page was drawn twice more."""
        self.evaluate('new Promise(done => requestAnimationFrame(() => '
                      'requestAnimationFrame(done)))')
        return self.centre(selector)

    def picture(self) -> bytes:
        """What is seen, as PNG."""
        return base64.b64decode(self.call('Page.captureScreenshot', format='png')['data'])

    def _read(self) -> dict[str, Any]:
        while b'\0' not in self._rest:
            if not select.select([self._from], [], [], DEADLINE_S)[0]:
                raise BrowserError(f'the browser has said nothing for {DEADLINE_S} s')
            read = os.read(self._from, 1 << 16)
            if not read:
                raise BrowserError('the browser has ended')
            self._rest += read
        line, _, self._rest = self._rest.partition(b'\0')
        return dict(json.loads(line))

    def _note(self, method: str, parameters: dict[str, Any]) -> None:
        if method == 'Runtime.exceptionThrown':
            self.problems.append(str(parameters['exceptionDetails']))
        elif method == 'Log.entryAdded' and parameters['entry']['level'] == 'error':
            self.problems.append(f'{parameters["entry"]["text"]} {parameters["entry"].get("url")}')


@contextlib.contextmanager
def browser(executable: str) -> Iterator[Page]:
    """A page in a browser of its own."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        (page_in, to_browser), (from_browser, page_out) = os.pipe(), os.pipe()

        def as_expected() -> None:
            # The browser reads from 3 and writes to 4, whatever numbers the pipes have here.
            read, written = os.dup(page_in), os.dup(page_out)
            os.dup2(read, 3)
            os.dup2(written, 4)

        process = subprocess.Popen(
            [executable, *FLAGS, f'--user-data-dir={profile}'], preexec_fn=as_expected,
            close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True)
        for end in (page_in, page_out):
            os.close(end)
        try:
            yield Page(to_browser, from_browser)
        finally:
            os.close(to_browser)
            process.terminate()
            process.wait(DEADLINE_S)
            os.close(from_browser)
