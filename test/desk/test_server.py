"""Tests that the server of the desk is reachable only from this machine and with the token."""

import http.client
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest
from programs.command_line import rpf3d
from programs.listening import session
from programs.served_desk import LONGEST, ServedDesk, served_desk
from programs.waiting import wait_for

from rpf3d_core.desk.server import BrowserRequest, Gate, new_gate, opening_page
from rpf3d_core.errors import InputError

GATE = Gate(port=4711, token="right")
HOST, ORIGIN = "127.0.0.1:4711", "http://127.0.0.1:4711"


def test_the_address_has_the_token_and_two_gates_have_different_ones() -> None:
    assert GATE.address == "http://127.0.0.1:4711/right/"
    tokens = {new_gate(0).token for _ in range(5)}
    assert len(tokens) == 5 and min(map(len, tokens)) >= 32


@pytest.mark.parametrize(
    ("request_", "path"),
    [
        (BrowserRequest(HOST, None, "/right/"), "/"),
        (BrowserRequest(HOST, None, "/right/index.html"), "/index.html"),
        (BrowserRequest(HOST, ORIGIN, "/right/ws"), "/ws"),
        (BrowserRequest(HOST, None, "/right"), "/"),
        (BrowserRequest(HOST, None, "/right/assets/../x"), "/assets/../x"),
        (BrowserRequest(HOST, None, "/"), None),
        (BrowserRequest(HOST, None, ""), None),
        (BrowserRequest(HOST, None, "//right/"), None),
        (BrowserRequest(HOST, None, "/index.html"), None),
        (BrowserRequest(HOST, None, "/wrong/right/"), None),
        (BrowserRequest(HOST, None, "/rightx/"), None),
        (BrowserRequest(HOST, None, "/é/"), None),
        (BrowserRequest("evil.example:4711", None, "/right/"), None),
        (BrowserRequest(None, None, "/right/"), None),
        (BrowserRequest("127.0.0.1:4712", None, "/right/"), None),
        (BrowserRequest(HOST, "http://evil.example", "/right/"), None),
        (BrowserRequest(HOST, "null", "/right/"), None),
        (BrowserRequest(HOST, "http://127.0.0.1:4712", "/right/"), None),
    ],
)
def test_only_requests_of_its_own_pages_with_the_token_are_admitted(request_: BrowserRequest, path: str | None) -> None:
    assert GATE.admitted(request_) == path


def test_the_browser_is_started_with_a_private_page_and_not_with_the_token() -> None:
    with opening_page(GATE.address) as address:
        page = Path(url2pathname(urlsplit(address).path))
        assert address.startswith("file:///") and GATE.token not in address
        assert page.parent.stat().st_mode & 0o077 == 0
        assert f"url={GATE.address}" in page.read_text() and "no-referrer" in page.read_text()
    assert not page.parent.exists()


def test_a_port_in_use_is_one_sentence() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=rf"port {port} cannot be used: another program uses it; give another"):
            new_gate(port)


def test_without_the_extra_the_command_says_how_to_install_it(tmp_path: Path) -> None:
    (tmp_path / "trame.py").write_text("raise ImportError('none here')\n")
    done = rpf3d("desk", "--no-open", PYTHONPATH=f"{tmp_path}:{Path(__file__).parents[2]}")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and line.endswith("install it with: pip install 'rpf3d[desk]'")
    assert line.startswith("rpf3d: the desk needs the library trame, which is not installed")


@pytest.fixture(scope="module")
def desk() -> Iterator[ServedDesk]:
    """Yield a served desk without a scene."""
    with served_desk() as running:
        yield running


def asked(desk: ServedDesk, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", desk.port, timeout=LONGEST)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer


def test_it_listens_on_the_loopback_address_whatever_the_environment_says(desk: ServedDesk) -> None:
    assert desk.heard == {"127.0.0.1"}


@pytest.mark.parametrize("path", ["/", "/index.html", "/wrong/", "/vue.global.js", "/ws", "/paraview/", "/no"])
def test_without_the_token_nothing_is_answered(desk: ServedDesk, path: str) -> None:
    answer = asked(desk, path)
    assert answer.status == 403
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert answer.headers["Set-Cookie"] is None


def test_a_websocket_without_the_token_is_refused(desk: ServedDesk) -> None:
    handshake = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                 "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}  # fmt: skip
    assert asked(desk, "/ws", **handshake).status == 403
    inside = urlsplit(desk.address).path
    assert asked(desk, f"{inside}ws", **handshake, Origin="http://evil.example").status == 403


def test_the_pages_come_under_the_policy_and_set_no_cookie(desk: ServedDesk) -> None:
    inside = urlsplit(desk.address).path
    first, page = asked(desk, inside), asked(desk, f"{inside}index.html")
    assert (first.status, first.headers["Location"]) == (302, "index.html")
    assert page.status == 200 and page.headers["Content-Type"].startswith("text/html")
    policy = page.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy and "http" not in policy
    assert page.headers["Access-Control-Allow-Origin"] is None and page.headers["Referrer-Policy"] == "no-referrer"
    assert first.headers["Set-Cookie"] is None and page.headers["Set-Cookie"] is None
    assert asked(desk, f"{inside}no").status == 404
    assert asked(desk, f"{inside}index.html", Host="evil.example").status == 403


def test_a_second_desk_on_the_port_is_refused(desk: ServedDesk) -> None:
    done = rpf3d("desk", "--no-open", "--port", desk.port)
    assert done.returncode == 2 and f"port {desk.port} cannot be used" in done.stderr


def test_a_scene_that_is_refused_ends_the_command_with_its_sentence(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("terrain: {pit: {}}\n")
    done = rpf3d("desk", tmp_path / "s.yaml", "--no-open")
    assert done.returncode == 2 and "`materials` is missing" in done.stderr and done.stdout == ""


def test_the_command_starts_the_browser_without_the_token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    browser, given = tmp_path / "browser.sh", tmp_path / "given"
    browser.write_text(f'#!/bin/sh\necho "$@" > {given}.part && mv {given}.part {given}\n')
    browser.chmod(0o700)
    monkeypatch.setenv("BROWSER", str(browser))
    with served_desk("--open") as running:
        wait_for(given.exists, LONGEST)
        page = Path(url2pathname(urlsplit(given.read_text().strip()).path))
        assert urlsplit(running.address).path.strip("/") not in given.read_text()
        assert f"url={running.address}" in page.read_text()
    assert not page.parent.exists()


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_leaves_no_process(ending: signal.Signals) -> None:
    with served_desk() as running:
        running.process.send_signal(ending)
        assert running.process.wait(timeout=LONGEST) == 130
        assert session(running.process.pid) == []
        error = running.process.stderr.read()  # type: ignore[union-attr]
    assert error == "rpf3d: interrupted; the desk is closed\n"
