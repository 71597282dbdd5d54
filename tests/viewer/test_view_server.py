"""The server of `rotor view`: who is let in, what is served, pages that share a session, a program that is killed."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys

import pytest
from places import PROJECT
from view_cases import KELVIN, NAME, SERIES, assign_line, write_case

from rotor.viewer.opening import open_session
from rotor.viewer.session import read_session

websockets = pytest.importorskip("websockets.sync.client", reason="needs websockets (extra view)")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A served session."""
    from rotor.viewer.server import ViewServer

    folder = tmp_path_factory.mktemp("served")
    service = open_session(write_case(folder), [str(folder / NAME)], temperature_k=KELVIN)
    server = ViewServer(service)
    thread = server.run_in_thread()
    yield server
    server.stop()
    thread.join(10)
    service.session.release()


def asked(server, path, *, host=None, origin=None, method="GET"):
    """Status and body of a request with headers of our choice."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    if host != "":
        connection.putheader("Host", host or f"127.0.0.1:{server.port}")
    if origin is not None:
        connection.putheader("Origin", origin)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, body, answer.headers


def test_the_page_and_its_files_are_served_with_the_token(served):
    for name, part in (
        ("", b"rotor view"),
        ("page.js", b"export class App"),
        ("page.css", b".rotor-view"),
        ("bokeh.js", b"Bokeh"),
    ):
        status, body, headers = asked(served, f"/{served.token}/{name}")
        assert (status, part in body) == (200, True)
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert headers["X-Content-Type-Options"] == "nosniff"
    assert len(served.token) >= 32
    assert served.socket.getsockname()[0] == "127.0.0.1"
    assert asked(served, f"/{served.token}/", host=f"localhost:{served.port}")[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/page.js",
        "/wrong/",
        "/wrong/page.js",
        "/{token}x/",
        "/{token}/..%2f..%2fetc%2fpasswd",
        "/{token}/../../../../etc/passwd",
        "/{token}/%2e%2e/server.py",
        "/{token}/server.py",
        "/{token}//etc/passwd",
        "/{token}/page.js%00",
        "/{token}/spectrum.view.json",
        "/{token}/static/page.js",
        "/{token}\\page.js",
    ],
)
def test_other_paths_and_tokens_are_refused_alike(served, path):
    status, body, _ = asked(served, path.replace("{token}", served.token))
    assert (status, body) == (404, b"not found")


@pytest.mark.parametrize(
    "host",
    [
        "",
        "evil.example",
        "evil.example:80",
        "127.0.0.1",
        "127.0.0.1:1",
        "127.0.0.1.evil.example:{port}",
        "[::1]:{port}",
    ],
)
def test_other_hosts_are_refused(served, host):
    status, body, _ = asked(served, f"/{served.token}/", host=host.replace("{port}", str(served.port)))
    assert status in (400, 404)
    assert b"rotor" not in body


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:{port}", "http://127.0.0.1:1", ""]
)
def test_other_origins_are_refused(served, origin):
    origin = origin.replace("{port}", str(served.port))
    assert asked(served, f"/{served.token}/", origin=origin)[0] == 404
    with pytest.raises(Exception, match="HTTP 403"):
        talk(served, origin=origin or None)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH"])
def test_only_reading_is_served(served, method):
    assert asked(served, f"/{served.token}/", method=method)[0] in (404, 405)


def talk(server, token=None, origin=""):
    """A websocket as a page opens it."""
    address = f"ws://127.0.0.1:{server.port}/{token or server.token}/socket"
    return websockets.connect(
        address, origin=f"http://127.0.0.1:{server.port}" if origin == "" else origin, max_size=None
    )


def test_a_socket_without_the_token_is_refused(served):
    with pytest.raises(Exception, match="HTTP 403"):
        talk(served, token="guess")


def call(socket, **message):
    """The answer to a message, and the sessions that came before it."""
    socket.send(json.dumps(message))
    sessions = []
    while True:
        content = json.loads(socket.recv(timeout=20))
        if "session" in content:
            sessions.append(content["session"])
        else:
            return content, sessions


def test_oversized_and_broken_messages_end_or_fail_alone(served):
    with talk(served) as socket:
        socket.send("{")
        assert "not JSON" in json.loads(socket.recv(timeout=20))["error"]
        assert "expected a message" in call(socket, id=1)[0]["error"]
        assert call(socket, id=2, do="hello")[0]["ok"]["unit"] == "K"
    with talk(served) as socket:
        socket.send("[" + "1," * (1 << 19) + "1]")  # a little above 1 MiB
        with pytest.raises(Exception, match="1009"):
            socket.recv(timeout=20)
    with talk(served) as socket:
        assert "ok" in call(socket, id=1, do="hello")[0]


def test_two_pages_on_one_session_stay_equal(served):
    with talk(served) as one, talk(served) as two:
        states = [call(socket, id=1, do="hello")[0]["ok"]["session"] for socket in (one, two)]
        assert states[0] == states[1]
        answer, seen = call(one, id=2, do="species", species=1, scale=2.5)
        assert (answer["ok"]["label"], len(seen)) == ("change scale of case", 1)
        other = json.loads(two.recv(timeout=20))["session"]
        assert other == seen[-1]
        assert other["records"]["species/1"]["scale"] == 2.5
        answer, seen = call(two, id=3, do="undo")
        assert json.loads(one.recv(timeout=20))["session"] == seen[-1]
        assert seen[-1]["records"]["species/1"]["scale"] == 1.0
        assert seen[-1]["redo"] == "change scale of case"


def test_most_pages_are_bounded(served, monkeypatch):
    monkeypatch.setattr("rotor.viewer.server.MOST_PAGES", 1)
    with talk(served) as one:
        call(one, id=1, do="hello")
        with pytest.raises(Exception, match="HTTP 403"):
            talk(served)


def test_a_killed_server_is_resumed_with_what_it_answered(tmp_path):
    write_case(tmp_path)
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    words = [sys.executable, "-m", "rotor", "view", "spectrum.csv", NAME, "--temperature", "3", "--no-browser"]
    process = subprocess.Popen(words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        address = process.stdout.readline().strip()
        port, token = int(address.split(":")[2].split("/")[0]), address.rstrip("/").split("/")[-1]
        with websockets.connect(
            f"ws://127.0.0.1:{port}/{token}/socket", origin=f"http://127.0.0.1:{port}", max_size=None
        ) as socket:
            for i, (upper, lower) in enumerate(SERIES):
                target = [{"species": 1, "upper": upper, "lower": lower}]
                assert "ok" in call(socket, id=i, do="assign", frequency_mhz=9000.0 + i, error_mhz=0.01, to=target)[0]
            process.send_signal(signal.SIGKILL)
            process.wait(10)
    finally:
        process.kill()
        process.wait(10)
        process.stdout.close()
    lines = read_session(tmp_path / "spectrum.view.json").state.lines
    assert [line.frequency_mhz for line in lines.values()] == [9000.0 + i for i in range(len(SERIES))]
    again = open_session(tmp_path / "spectrum.view.json")
    assert assign_line(again, *SERIES[0])["ok"]["label"]
    again.session.release()
