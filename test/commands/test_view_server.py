# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The web server of the live view, without ROS: who is let in, and what is taken."""

from __future__ import annotations

import http.client
import json
import re
import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from checkout import ROOT
from ros_processes import wait_until

from dmp_cpg_ros.commands import view_server
from dmp_cpg_ros.commands.view_server import FILES, PAGE, Frames, ViewServer
from dmp_cpg_ros.core.errors import DataError

TOKEN = 'a-token'


class Served:
    """A server with a suite that takes everything but ``bad``, and a browser."""

    def __init__(self) -> None:
        self.frames, self.taken = Frames(), list[Any]()
        self.scene = b''
        self.server = ViewServer(TOKEN, self.frames, lambda: self.scene, self.take)
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()

    def take(self, command: Any) -> dict[str, Any]:
        if command == 'bad':
            raise DataError('bad is no command')
        self.taken.append(command)
        return {'taken': True, 'text': 'done'}

    def ask(self, path: str, body: str | None = None, token: str | None = TOKEN,
            **headers: str) -> http.client.HTTPResponse:
        """Answer to a request; ``Host`` and others as keywords."""
        connection = http.client.HTTPConnection('127.0.0.1', self.server.server_port, timeout=30)
        given = {} if token is None else {'Authorization': f'Bearer {token}'}
        connection.request('GET' if body is None else 'POST', path, body, {**given, **headers})
        return connection.getresponse()

    def command(self, body: str) -> tuple[int, str]:
        answer = self.ask('/command', body)
        return answer.status, answer.read().decode()


@pytest.fixture
def served() -> Iterator[Served]:
    site = Served()
    yield site
    site.server.shutdown()
    site.server.server_close()


def test_it_listens_on_the_loopback_interface_only(served: Served) -> None:
    assert served.server.server_address[0] == '127.0.0.1'
    assert served.server.address == f'http://127.0.0.1:{served.server.server_port}/?token={TOKEN}'


def test_a_second_view_takes_another_port_and_a_chosen_one_that_is_taken_is_an_error(
        served: Served) -> None:
    second = Served()
    assert second.server.server_port != served.server.server_port
    second.server.shutdown()
    second.server.server_close()
    with pytest.raises(OSError, match='in use'):
        ViewServer(TOKEN, Frames(), bytes, dict, served.server.server_port)


def test_the_page_is_for_who_knows_the_token(served: Served) -> None:
    right = served.ask(f'/?token={TOKEN}', token=None)
    assert right.status == 200
    assert '<canvas id="scene">' in right.read().decode()
    for path in ('/', '/?token=', '/?token=a-tokem', '/?tokem=a-token'):
        wrong = served.ask(path)  # the header does not open the page
        assert wrong.status == 403
        assert TOKEN not in wrong.read().decode()


@pytest.mark.parametrize('path', ['/scene', '/frames', '/command'])
@pytest.mark.parametrize('token', [None, '', 'a-tokem', f'{TOKEN}x'])
def test_scene_frames_and_commands_are_for_who_knows_the_token(
        served: Served, path: str, token: str | None) -> None:
    answer = served.ask(path, '{}' if path == '/command' else None, token)
    assert answer.status == 403
    assert not served.taken


@pytest.mark.parametrize(('host', 'status'), [
    ('127.0.0.1:1', 204), ('localhost:9000', 204), ('evil.example:8642', 403),
    ('127.0.0.1.evil.example:80', 403), ('', 403), ('localhost', 403)])
def test_names_of_others_that_lead_here_are_refused(
        served: Served, host: str, status: int) -> None:
    assert served.ask('/scene', Host=host).status == status


@pytest.mark.parametrize('origin', [
    'http://evil.example', 'null', 'https://localhost:9000', 'http://localhost:9001'])
def test_pages_of_others_are_refused(served: Served, origin: str) -> None:
    for path, body in (('/scene', None), ('/command', '{}'), (f'/?token={TOKEN}', None)):
        answer = served.ask(path, body, Host='localhost:9000', Origin=origin)
        assert answer.status == 403
    assert not served.taken
    own = served.ask('/command', '{}', Host='localhost:9000', Origin='http://localhost:9000')
    assert own.status == 200


def test_no_answer_lets_other_pages_in(served: Served) -> None:
    for path in ('/', f'/?token={TOKEN}', '/live.js', '/scene', '/nothing'):
        headers = {name.lower(): value for name, value in served.ask(path).getheaders()}
        assert not any(name.startswith('access-control') for name in headers)
        assert 'set-cookie' not in headers
        assert "default-src 'self'" in headers['content-security-policy']
        assert "frame-ancestors 'none'" in headers['content-security-policy']


def test_a_command_is_taken_and_answered(served: Served) -> None:
    assert served.command('{"inhibit": true}') == (200, '{"taken": true, "text": "done"}')
    assert served.taken == [{'inhibit': True}]


@pytest.mark.parametrize(('body', 'why'), [
    ('"bad"', 'bad is no command'), ('{"velocity": [NaN, 0, 0]}', 'NaN'),
    ('{"velocity": [Infinity, 0, 0]}', 'Infinity'), ('{', 'Expecting'), ('', 'Expecting'),
    ('\x00', 'Expecting'), ('[' * 999, ''), (' ' * 1001, 'at most 1000 bytes'),
    ('{"velocity": [1e999, 0, 0]}', ''), (f'{{"velocity": [1{400 * "0"}, 0, 0]}}', '')])
def test_what_is_no_command_is_refused_with_the_reason(
        served: Served, body: str, why: str) -> None:
    status, text = served.command(body)
    if body.startswith('{"velocity": [1'):  # JSON reads it as infinity: for who takes it
        assert served.taken == [{'velocity': [float('inf'), 0, 0]}]
        return
    assert (status, why in text) == (400, True), text
    assert not served.taken
    assert served.command('{"inhibit": true}')[0] == 200


@pytest.mark.parametrize('length', ['-1', 'ten', '1e2', '99999999999'])
def test_a_wrong_length_is_refused_at_once(served: Served, length: str) -> None:
    with socket.create_connection(('127.0.0.1', served.server.server_port), 30) as end:
        end.sendall(f'POST /command HTTP/1.1\r\nHost: localhost:1\r\nAuthorization: Bearer '
                    f'{TOKEN}\r\nContent-Length: {length}\r\n\r\n'.encode())
        assert end.recv(4096).startswith(b'HTTP/1.1 400 ')


@pytest.mark.parametrize('path', ['/../view_server.py', '/%2e%2e/setup.py', '//etc/passwd',
                                  '/page/live.js', '/live.js/', '/favicon.ico'])
def test_only_the_files_of_the_page_are_served(served: Served, path: str) -> None:
    assert served.ask(path).status == 404


def next_line(stream: http.client.HTTPResponse) -> bytes:
    """Next line with something in it; empty ones keep the connection alive."""
    while line := stream.readline():
        if line.strip():
            return line
    raise AssertionError('the stream ended')


def test_frames_are_lines_the_newest_for_everybody(served: Served) -> None:
    first, second = served.ask('/frames'), served.ask('/frames')
    assert (first.status, second.status) == (200, 200)
    for number in range(3):
        served.frames.put(json.dumps({'number': number}).encode())
        for stream in (first, second):
            assert json.loads(next_line(stream)) == {'number': number}
    assert served.frames.viewers == 2


def test_there_is_room_for_some_viewers_and_who_leaves_makes_room(
        served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(view_server, 'MOST_STREAMS', 1)
    first = served.ask('/frames')
    assert served.ask('/frames').status == 503
    first.close()

    def found_out() -> bool:  # when a line is written
        served.frames.put(b'{}')
        return not served.frames.viewers

    wait_until(found_out, what=lambda: 'a viewer that has gone')
    assert served.ask('/frames').status == 200


def test_connections_beyond_the_most_are_closed_and_who_leaves_makes_room(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(view_server, 'MOST_CONNECTIONS', 2)
    site = Served()
    address = ('127.0.0.1', site.server.server_port)
    waiting = [socket.create_connection(address, 30) for _ in range(2)]
    with socket.create_connection(address, 30) as third:
        assert third.recv(1) == b''
    for end in waiting:
        end.close()

    def answered() -> bool:
        try:
            return site.ask('/scene').status == 204
        except (http.client.HTTPException, OSError):
            return False

    wait_until(answered, what=lambda: 'room for a connection')
    site.server.shutdown()
    site.server.server_close()


def test_the_page_fetches_nothing_from_elsewhere_and_all_of_it_is_served() -> None:
    names = {path.name for path in PAGE.iterdir()}
    of_paper = {'paper.html', 'paper.js'}  # a page of their own, which nobody serves
    assert names == {'index.html', *of_paper, *(name[1:] for name in FILES)}
    for path in (PAGE / name for name in names - of_paper):
        text = path.read_text(encoding='utf-8')
        assert not re.search(r'(https?|wss?):|//[a-z]+\.[a-z]', text), path
        assert 'The dmp_cpg_ros authors' in text.splitlines()[0 if path.suffix != '.html' else 1]
        for name in re.findall(r"(?:src|href)=\"(/[^\"]+)\"|from '(/[^']+)'", text):
            assert ''.join(name) in FILES
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    assert "'page'" in setup
