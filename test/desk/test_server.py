"""The server of the desk: on this machine only, with the token only, and it sends no page elsewhere."""

import http.client
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import rpf3d
from listening import session
from served_desk import ServedDesk, served_desk

from rpf3d_core.desk.server import Gate, Request, new_gate
from rpf3d_core.errors import InputError

GATE = Gate(port=4711, token="right")
HOST, ORIGIN = "127.0.0.1:4711", "http://127.0.0.1:4711"


def test_the_address_has_the_token_and_two_gates_have_different_ones() -> None:
    assert GATE.address == "http://127.0.0.1:4711/?token=right"
    tokens = {new_gate(0).token for _ in range(5)}
    assert len(tokens) == 5 and min(map(len, tokens)) >= 32


@pytest.mark.parametrize(
    ("request_", "admitted"),
    [
        (Request(HOST, None, "right", None), True),
        (Request(HOST, None, None, "right"), True),
        (Request(HOST, ORIGIN, None, "right"), True),
        (Request(HOST, None, "wrong", "right"), True),
        (Request(HOST, None, None, None), False),
        (Request(HOST, None, "wrong", None), False),
        (Request(HOST, None, "", ""), False),
        (Request(HOST, None, "rightx", "é"), False),
        (Request("evil.example:4711", None, "right", "right"), False),
        (Request(None, None, "right", "right"), False),
        (Request("127.0.0.1:4712", None, None, "right"), False),
        (Request(HOST, "http://evil.example", None, "right"), False),
        (Request(HOST, "null", None, "right"), False),
        (Request(HOST, "http://127.0.0.1:4712", None, "right"), False),
    ],
)
def test_only_requests_of_its_own_pages_with_the_token_are_admitted(request_: Request, admitted: bool) -> None:
    assert GATE.admits(request_) is admitted


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
    """A desk without a scene."""
    with served_desk() as running:
        yield running


def asked(desk: ServedDesk, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", desk.port, timeout=20)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer


def test_it_listens_on_the_loopback_address_whatever_the_environment_says(desk: ServedDesk) -> None:
    assert desk.heard == {"127.0.0.1"}


@pytest.mark.parametrize("path", ["/", "/index.html", "/?token=wrong", "/vue.global.js", "/ws", "/paraview/", "/no"])
def test_without_the_token_nothing_is_answered(desk: ServedDesk, path: str) -> None:
    answer = asked(desk, path)
    assert answer.status == 403
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert answer.headers["Set-Cookie"] is None


def test_a_websocket_without_the_token_is_refused(desk: ServedDesk) -> None:
    handshake = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                 "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}  # fmt: skip
    assert asked(desk, "/ws", **handshake).status == 403
    token = desk.address.partition("?")[2]
    assert asked(desk, f"/ws?{token}", **handshake, Origin="http://evil.example").status == 403


def test_the_address_sets_a_cookie_with_which_the_pages_come_under_the_policy(desk: ServedDesk) -> None:
    first = asked(desk, desk.address.removeprefix(desk.base))
    cookie = first.headers["Set-Cookie"]
    assert first.status == 302 and "HttpOnly" in cookie and "SameSite=Strict" in cookie
    page = asked(desk, "/index.html", Cookie=cookie.partition(";")[0])
    assert page.status == 200 and page.headers["Content-Type"].startswith("text/html")
    policy = page.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy and "http" not in policy
    assert page.headers["Access-Control-Allow-Origin"] is None
    assert asked(desk, "/index.html", Cookie=cookie.partition(";")[0], Host="evil.example").status == 403


def test_a_second_desk_on_the_port_is_refused(desk: ServedDesk) -> None:
    done = rpf3d("desk", "--no-open", "--port", desk.port)
    assert done.returncode == 2 and f"port {desk.port} cannot be used" in done.stderr


def test_a_scene_that_is_refused_ends_the_command_with_its_sentence(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("terrain: {pit: {}}\n")
    done = rpf3d("desk", tmp_path / "s.yaml", "--no-open")
    assert done.returncode == 2 and "`materials` is missing" in done.stderr and done.stdout == ""


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_leaves_no_process(ending: signal.Signals) -> None:
    with served_desk() as running:
        running.process.send_signal(ending)
        assert running.process.wait(timeout=30) == 130
        assert session(running.process.pid) == []
        error = running.process.stderr.read()  # type: ignore[union-attr]
    assert error == "rpf3d: interrupted; the desk is closed\n"
