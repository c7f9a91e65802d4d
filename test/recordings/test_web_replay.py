"""Tests of recordings served with the web viewer: reachable only from this machine, with a secret address."""

import http.client
import re
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from programs.browsers import LONGEST, LOOK, browser, picture
from programs.command_line import COMMAND, environment, rpf3d
from programs.listening import listening_addresses, session

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.viewer_pages import PAGES, viewer_pages
from rpf3d_core.recordings.web_replay import WebReplay
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene

PATIENCE = 120.0
"""Longest time (s) until a process ends; on an idle machine it takes a fraction of a second."""
EMPTY = 50_000
"""Size (bytes) that a picture of the viewer exceeds; that of an empty viewer is much smaller."""
LOADS = 4
"""Number of times that a recording is opened, because a wrong layout may appear in only some of the loads."""
NEARLY_WHITE = 0.92
"""Smallest colour component, from 0 to 1, of the viewer's white panels."""
SCENES = Path(__file__).parents[2] / "config" / "scenes"
BYTES = b"RRF2" + bytes(range(256)) * 9000
"""Content of a recording that the server sends in more than one part."""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[WebReplay]:
    """Yield a running server of a recording of BYTES; each file of the viewer contains its own name."""
    recording = tmp_path / "shift of today.rrd"
    recording.write_bytes(BYTES)
    with WebReplay(recording, {name: name.encode() for name in PAGES}) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def asked(server: WebReplay, path: str, **headers: str) -> tuple[http.client.HTTPResponse, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=PATIENCE)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer, content


def test_the_server_is_bound_to_the_loopback_address(served: WebReplay) -> None:
    assert served.socket.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize("name", ["", *PAGES])
def test_a_page_comes_with_its_type_and_a_policy_against_requests_elsewhere(served: WebReplay, name: str) -> None:
    answer, content = asked(served, f"/{served.token}/{name}")
    assert answer.status == 200 and content == (name or "index.html").encode()
    assert answer.headers["Content-Type"] == PAGES[name or "index.html"]
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy and "http" not in policy


def test_the_recording_comes_whole_and_no_other_site_may_read_it(served: WebReplay) -> None:
    url = parse_qs(urlsplit(served.address).query)["url"][0]
    answer, content = asked(served, urlsplit(url).path, Origin="https://elsewhere.example")
    assert url.endswith(".rrd") and content == BYTES
    assert answer.headers["Content-Type"] == "application/octet-stream"
    assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert answer.headers["Access-Control-Allow-Origin"] is None


@pytest.mark.parametrize("path", ["/", "/index.html", "/run.rrd", "/wrong/", "/wrong/index.html", "//", "/%C3%A9/"])
def test_a_path_without_the_token_is_refused(served: WebReplay, path: str) -> None:
    answer, content = asked(served, path)
    assert (answer.status, content) == (403, b"")


def test_a_name_of_another_site_that_points_here_is_refused(served: WebReplay) -> None:
    answer, content = asked(served, f"/{served.token}/", Host=f"elsewhere.example:{served.server_port}")
    assert (answer.status, content) == (403, b"")


@pytest.mark.parametrize("name", ["nothing.js", "../../etc/passwd", "%2e%2e/run.rrd", "run.rrd"])
def test_what_is_not_served_is_not_found(served: WebReplay, name: str) -> None:
    assert asked(served, f"/{served.token}/{name}")[0].status == 404


def test_a_port_in_use_is_one_sentence(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=rf"port {port} cannot be used \(.+\); give another with --port"):
            WebReplay(tmp_path / "a.rrd", {}, port)


def test_the_viewer_of_the_wheel_is_whole() -> None:
    pages = viewer_pages()
    assert set(pages) == set(PAGES)
    assert b"re_viewer.js" in pages["index.html"] and pages["re_viewer_bg.wasm"].startswith(b"\0asm")


@contextmanager
def replayed(recording: Path) -> Iterator[tuple["subprocess.Popen[str]", str, set[str]]]:
    """Serve a recording with the command; yield its process, its URL, and the addresses at which it listened."""
    command = [*COMMAND, "replay", str(recording), "--web"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(), start_new_session=True
    )
    heard: set[str] = set()
    try:
        reader = threading.Thread(target=lambda: lines.append(process.stdout.readline()))  # type: ignore[union-attr]
        lines: list[str] = []
        reader.start()
        while reader.is_alive():
            heard |= listening_addresses(process.pid)
        (address,) = re.findall(r"open (http://\S+)", lines[0])
        yield process, address, heard | listening_addresses(process.pid)
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_the_command_listens_at_no_other_address_and_leaves_no_child(tmp_path: Path, ending: signal.Signals) -> None:
    """This holds also during the start, while the program of rerun runs."""
    (tmp_path / "run.rrd").write_bytes(BYTES)
    with replayed(tmp_path) as (process, address, heard):
        assert heard == {"127.0.0.1"}
        assert urlsplit(address).hostname == "127.0.0.1"
        children = [one for one in session(process.pid) if one != process.pid]
        process.send_signal(ending)
        assert process.wait(timeout=PATIENCE) == 130
        assert children == [] and session(process.pid) == []
        assert "no longer served" in process.stderr.read()  # type: ignore[union-attr]
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", urlsplit(address).port or 0), timeout=5)


def test_a_folder_without_a_recording_is_refused_before_anything_starts(tmp_path: Path) -> None:
    done = rpf3d("replay", tmp_path, "--web")
    assert done.returncode == 2 and done.stdout == "" and "contains no run.rrd" in done.stderr


@pytest.mark.long
def test_a_browser_draws_the_recording_and_sends_no_request_elsewhere(tmp_path: Path) -> None:
    run_scene(read_scene(SCENES / "bench_15m.yaml"), tmp_path / "run", 64, "reference")
    with replayed(tmp_path / "run") as (_, address, _), browser() as running:
        page = running.new_page(viewport={"width": 1000, "height": 700})
        sent, blocked = [], set()
        page.on("request", lambda request: sent.append(request.url))
        page.on("requestfailed", lambda request: blocked.add(request.url) if request.failure == "csp" else None)
        page.goto(address)
        page.wait_for_selector("canvas.visible", timeout=LONGEST)
        begun = time.monotonic()
        while len(page.screenshot()) <= EMPTY and time.monotonic() - begun < LONGEST / 1000:
            page.wait_for_timeout(LOOK)
        page.wait_for_timeout(5000)  # for requests that a drawn page may send
        seen = page.screenshot()
    here = address.partition("?")[0]
    assert [url for url in sent if url not in blocked and not url.startswith((here, "blob:", "data:"))] == []
    assert any(url.endswith("/run.rrd") for url in sent)
    assert len(seen) > EMPTY


@pytest.mark.long
def test_a_browser_shows_the_layout_of_the_recording_each_time_and_no_layout_of_the_viewer(tmp_path: Path) -> None:
    run_scene(read_scene(SCENES / "bench_15m.yaml"), tmp_path / "run", 64, "reference")
    for _ in range(LOADS):
        with replayed(tmp_path / "run") as (_, address, _), browser() as running:
            page = running.new_page(viewport={"width": 1000, "height": 700})
            page.goto(address)
            page.wait_for_selector("canvas.visible", timeout=LONGEST)
            until = time.monotonic() + LONGEST / 1000
            while not shows_terrain_on_the_left(page):  # the viewer's own layout has lists of data there
                assert time.monotonic() < until, "the viewer shows a layout of its own"
                page.wait_for_timeout(LOOK)


def shows_terrain_on_the_left(page: Any) -> bool:
    """Return True if most of a rectangle at the left of the page, at half its height, is not white."""
    strip = picture(page.locator("canvas.visible"))[400:600, 100:240]
    return bool((strip.min(axis=2) > NEARLY_WHITE).mean() < 0.5)
