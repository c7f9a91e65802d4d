"""Serve the desk to browsers on this machine only: with the loopback address, a token and a content policy.

A request must name this server as its host, and its path must begin with the token. So neither other users of the
machine nor pages of other sites can reach the desk. The token is not in a cookie, because browsers send the cookies of
127.0.0.1 to the servers of all ports. The content policy forbids the page to send requests to another machine.
"""

import errno
import os
import secrets
import socket
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.formats.extras import library_of

LOOPBACK = "127.0.0.1"
OPENING = """\
<!doctype html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}">
<title>rpf3d desk</title>
<a href="{address}">rpf3d desk</a>
"""
"""A page that forwards the browser to the address of the desk."""
HEADERS = {
    "Content-Security-Policy": "; ".join([
        "default-src 'none'",
        "script-src 'self' 'unsafe-inline' 'unsafe-eval'",  # Vue compiles the page in the browser
        "style-src 'self' 'unsafe-inline'",
        "connect-src 'self'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "worker-src 'self' blob:",
        "base-uri 'self'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    ]),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}  # fmt: skip
"""Headers of every answer."""
REFUSED = "This address needs the token that `rpf3d desk` printed: open the whole address.\n"


class BrowserRequest(NamedTuple):
    """The parts of a request that show its sender; host, origin : headers, None if missing; path : decoded."""

    host: str | None
    origin: str | None
    path: str


class Gate(NamedTuple):
    """Decides which requests are answered; port : of the server; token : random text that each path must begin with."""

    port: int
    token: str

    @property
    def host(self) -> str:
        """Address and port, as in the header `Host` of a browser's request."""
        return f"{LOOPBACK}:{self.port}"

    @property
    def address(self) -> str:
        """The address to open in a browser. All files and the websocket of the page have addresses below it."""
        return f"http://{self.host}/{self.token}/"

    def admitted(self, request: BrowserRequest) -> str | None:
        """Return the path of a request without the token; None to refuse the request (wrong host, origin or token)."""
        if request.host != self.host or request.origin not in (None, f"http://{self.host}"):
            return None
        token, _, path = request.path.removeprefix("/").partition("/")
        return f"/{path}" if secrets.compare_digest(token.encode(), self.token.encode()) else None


def new_gate(port: int) -> Gate:
    """Return the `Gate` of a new server, with a free port and a new random token; port : 0 for any free port.

    Raises
    ------
    InputError
        The port is in use, or this program is not permitted to use it.
    """
    with socket.socket() as probe:
        try:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((LOOPBACK, port))
        except OSError as fault:
            why = "another program uses it" if fault.errno == errno.EADDRINUSE else fault.strerror
            raise InputError(
                f"port {port} cannot be used: {why}; give another with --port, or leave --port out"
            ) from fault
        return Gate(port=int(probe.getsockname()[1]), token=secrets.token_urlsafe(24))


def serve(server: Any, gate: Gate, ready: Callable[[], None]) -> None:
    """Run a trame server until Ctrl-C; the server answers only the requests that `gate` admits.

    The environment variables that trame and wslink read are replaced.

    ready : function that is called when browsers can connect
    """
    # trame reads options from the command line and from these variables; here they are set to fixed values.
    os.environ["TRAME_ARGS"] = f"--host {LOOPBACK} --port {gate.port} --timeout 0 --server"
    os.environ["WSLINK_READY_MSG"] = ""
    os.environ["WSLINK_WS_COMPRESS"] = "0"  # on one machine, compression takes longer than sending
    os.environ.pop("WSLINK_HTTP_HEADERS", None)
    server.controller.on_server_bind.add(lambda web, **_: web.app.middlewares.append(guard(gate)))
    server.controller.on_server_ready.add(lambda **_: ready())
    server.start(
        port=gate.port, host=LOOPBACK, open_browser=False, show_connection_info=False, timeout=0,
        disable_logging=True, exec_mode="main", backend="aiohttp",
    )  # fmt: skip


def guard(gate: Gate) -> Any:
    """Return aiohttp middleware that refuses requests that `gate` does not admit (status 403).

    The middleware removes the token from the paths of the other requests, and adds HEADERS to all answers.
    """
    web = library_of("desk", "aiohttp.web", "the desk needs")

    @web.middleware  # type: ignore[untyped-decorator]
    async def guarded(request: Any, handler: Any) -> Any:  # `handler` is not called: it is for the path with the token
        asked = BrowserRequest(
            host=request.headers.get("Host"), origin=request.headers.get("Origin"), path=request.path
        )
        path = gate.admitted(asked)
        if path is None:
            return web.Response(status=403, text=REFUSED, headers=HEADERS)
        try:
            answer = await _answer(request, path)
        except web.HTTPException as other:  # also a redirection
            answer = other
        if not answer.prepared:
            answer.headers.update(HEADERS)
        if isinstance(answer, web.HTTPException):
            raise answer
        return answer

    return guarded


async def _answer(request: Any, path: str) -> Any:
    """Return the answer of an aiohttp server to a request whose path is replaced.

    path : the new path, that is the path of the request without the token
    """
    inner = request.clone(rel_url=request.rel_url.with_path(path).with_query(request.rel_url.query))
    route = await request.app.router.resolve(inner)
    route.add_app(request.app)
    route.freeze()
    inner._match_info = route  # as aiohttp does for each request
    return await route.handler(inner)


@contextmanager
def opening_page(address: str) -> Iterator[str]:
    """Yield the address of a page that forwards a browser to an address; the page is a file in a private folder.

    The folder is deleted at the end of the `with` block.

    All users of the machine can see the arguments of the browser's process, so the token must not be one of them.
    """
    with tempfile.TemporaryDirectory(prefix="rpf3d-desk-open-") as folder:  # only its owner may enter it
        page = Path(folder) / "open.html"
        page.write_text(OPENING.format(address=address), encoding="utf-8")
        yield page.as_uri()


def open_browser(address: str) -> None:
    """Open an address in the user's browser, if there is one.

    A separate thread opens the browser, because a browser in the terminal would block this thread until it ends.
    """
    threading.Thread(target=_open, args=(address,), name="browser", daemon=True).start()


def _open(address: str) -> None:
    with suppress(webbrowser.Error):  # the user can read the address on the screen
        webbrowser.open(address)
