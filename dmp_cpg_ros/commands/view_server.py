# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The web server of ``live_view``: a page, a stream of frames, commands; for one user on this
machine.

It listens on the loopback interface only. Whoever can open a page in the user's browser, or has
another account on the machine, must not drive the robot:

- the page and everything but its unsecret files is given to those who know the token;
- the token is in the address of the page and, for all else, in the header ``Authorization``,
  which a page from elsewhere cannot send (no cookies, no CORS);
- ``Host`` must name this machine, against names of others that lead here (DNS rebinding), and
  ``Origin``, where a browser sends it, must be this page's.
"""

from __future__ import annotations

import hmac
import json
import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from dmp_cpg_ros.core.errors import DataError, DmpCpgError

PAGE = Path(__file__).resolve().parents[1] / 'page'
"""Folder with the files of the page."""

FILES = {'/live.css': 'text/css', '/live.js': 'text/javascript', '/scene.js': 'text/javascript',
         '/panels.js': 'text/javascript', '/keys.js': 'text/javascript'}
"""Files that everybody may read, and their types."""

PORT, PORTS = 8642, 20
"""First port that is tried, and how many are."""

LOOPBACK = '127.0.0.1'
HOSTS = (LOOPBACK, 'localhost')
"""Names of this machine that a browser may use, at any port: ``ssh -L`` changes it."""

LONGEST_COMMAND = 1000
"""Bytes of a command."""

MOST_STREAMS = 8
"""Browsers that may look on."""

MOST_CONNECTIONS = 32
"""Connections at a time, each a thread; those beyond are closed, whoever they are of."""

PATIENCE_S = 15.0
"""How long a browser may leave the server waiting [s]."""

HEADERS = {
    'Cache-Control': 'no-store', 'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff', 'Cross-Origin-Opener-Policy': 'same-origin',
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Content-Security-Policy': "default-src 'self'; img-src 'self' data:; base-uri 'none'; "
                               "form-action 'none'; frame-ancestors 'none'"}

FORBIDDEN = """The address of this page ends with ?token=...: it is printed where the live view
was started. A new start has a new token.
"""


class Frames:
    """The newest frame; who is slow misses some."""

    def __init__(self) -> None:
        """Begin without a frame."""
        self._news, self._count, self._frame = threading.Condition(), 0, b''
        self.viewers = 0

    def put(self, frame: bytes) -> None:
        """Show a frame to all who wait."""
        with self._news:
            self._count, self._frame = self._count + 1, frame
            self._news.notify_all()

    def after(self, count: int) -> tuple[int, bytes]:
        """Number and bytes of the first frame that is newer; empty when none comes for a while."""
        with self._news:
            self._news.wait_for(lambda: self._count > count, timeout=1.0)
            return self._count, self._frame if self._count > count else b''

    def enter(self, step: int) -> bool:
        """Count a viewer in (1) or out (-1); whether there was room."""
        with self._news:
            if self.viewers + step > MOST_STREAMS:
                return False
            self.viewers += step
            return True


class ViewServer(ThreadingHTTPServer):
    """Serves the page.

    Parameters
    ----------
    token : str
        What the address of the page ends with.
    frames : Frames
        What is streamed.
    scene : callable () → bytes
        JSON of what is drawn; empty before it is known.
    take : callable (command) → mapping
        Takes a command, an object of JSON; raises DataError for what must not be taken.
    port : int
        Where to listen; 0: the first of ``PORTS`` from ``PORT`` on that is free, or any.

    Raises
    ------
    OSError
        If the port is taken.
    """

    daemon_threads = True

    def __init__(self, token: str, frames: Frames, scene: Callable[[], bytes],
                 take: Callable[[Any], Any], port: int = 0) -> None:
        """Listen; :meth:`serve_forever` serves."""
        self.token, self.frames, self.scene, self.take = token, frames, scene, take
        self._room = threading.Semaphore(MOST_CONNECTIONS)
        for candidate in (port,) if port else (*range(PORT, PORT + PORTS), 0):
            try:
                super().__init__((LOOPBACK, candidate), _Request)
                return
            except OSError as error:
                if candidate == port:
                    raise OSError(error.errno, error.strerror, f'port {port}') from error

    @property
    def address(self) -> str:
        """Address of the page, with the token."""
        return f'http://{LOOPBACK}:{self.server_port}/?token={self.token}'

    def process_request(self, request: Any, client_address: Any) -> None:
        """Begin a thread for a connection if there is room for it."""
        if self._room.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a connection, and make room."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._room.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of connections that break off; whatever else a request does wrong is
        answered.
        """


class _Request(BaseHTTPRequestHandler):
    """One connection."""

    server: ViewServer
    protocol_version, server_version, sys_version = 'HTTP/1.1', 'live_view', ''
    timeout = PATIENCE_S

    def do_GET(self) -> None:
        """Serve the page, its files, the scene, the stream."""
        url = urlsplit(self.path)
        if not self._is_from_here():
            return
        if url.path in FILES:
            self._answer(HTTPStatus.OK, FILES[url.path], (PAGE / url.path[1:]).read_bytes())
        elif url.path == '/':
            (given, *_) = parse_qs(url.query).get('token', [''])
            if self._is_token(given):
                self._answer(HTTPStatus.OK, 'text/html', (PAGE / 'index.html').read_bytes())
            else:
                self._refuse(HTTPStatus.FORBIDDEN, FORBIDDEN)
        elif url.path not in ('/scene', '/frames'):
            self._refuse(HTTPStatus.NOT_FOUND, 'there is no such page')
        elif self._is_allowed():
            if url.path == '/frames':
                self._stream()
            else:
                scene = self.server.scene()
                self._answer(HTTPStatus.OK if scene else HTTPStatus.NO_CONTENT,
                             'application/json', scene)

    def do_POST(self) -> None:
        """Take a command."""
        if not (self._is_from_here() and self._is_allowed()):
            return
        length = self.headers.get('Content-Length', '')
        if self.path != '/command' or not length.isdecimal() or int(length) > LONGEST_COMMAND:
            self.close_connection = True  # its body is not read
            self._refuse(HTTPStatus.BAD_REQUEST,
                         f'commands go to /command and have at most {LONGEST_COMMAND} bytes')
            return
        try:
            command = json.loads(self.rfile.read(int(length)), parse_int=float,
                                 parse_constant=_not_finite)
            answer = json.dumps(self.server.take(command)).encode()
        except (DmpCpgError, ValueError, RecursionError) as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        else:
            self._answer(HTTPStatus.OK, 'application/json', answer)

    def _stream(self) -> None:
        """Send frames, a line of JSON each, for as long as the browser takes them."""
        frames, count = self.server.frames, 0
        if not frames.enter(1):
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE, f'{MOST_STREAMS} browsers look on')
            return
        try:
            self.close_connection = True
            self.send_response(HTTPStatus.OK)
            self._head('application/x-ndjson')
            while True:
                count, frame = frames.after(count)
                self.wfile.write(frame + b'\n')  # an empty line finds out who has gone
        except OSError:
            pass
        finally:
            frames.enter(-1)

    def _is_from_here(self) -> bool:
        """Whether the request is meant for this server; else it is refused."""
        host, origin = self.headers.get('Host', ''), self.headers.get('Origin')
        if host.rpartition(':')[0] in HOSTS and origin in (None, f'http://{host}'):
            return True
        self.close_connection = True
        self._refuse(HTTPStatus.FORBIDDEN, 'the live view is for pages of its own only')
        return False

    def _is_allowed(self) -> bool:
        """Whether the request bears the token; else it is refused."""
        if self._is_token(self.headers.get('Authorization', '').removeprefix('Bearer ')):
            return True
        self.close_connection = True
        self._refuse(HTTPStatus.FORBIDDEN, FORBIDDEN)
        return False

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.server.token.encode())

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self._answer(status, 'text/plain', why.encode())

    def _answer(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        if status != HTTPStatus.NO_CONTENT:
            self.send_header('Content-Length', str(len(body)))
        self._head(kind)
        self.wfile.write(body)

    def _head(self, kind: str) -> None:
        for name, value in HEADERS.items():
            self.send_header(name, value)
        if self.close_connection:
            self.send_header('Connection', 'close')
        self.send_header('Content-Type', f'{kind}; charset=utf-8')
        self.end_headers()

    def log_message(self, format: str, *values: Any) -> None:
        """Log nothing: addresses hold the token."""


def _not_finite(word: str) -> float:
    raise DataError(f'{word} is no number that can be commanded')
