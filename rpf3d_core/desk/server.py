"""Serve the desk to browsers on this machine: bound to the loopback address, with a token, and a content policy.

A request must name this server as its host and carry the token, in the address or in the cookie that the first
answer sets. So neither other users of the machine nor pages of other sites reach the desk. The content policy lets the
page send no request to another machine.
"""

import errno
import os
import secrets
import socket
import webbrowser
from collections.abc import Callable
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.formats.extras import library_of

LOOPBACK = "127.0.0.1"
TOKEN = "token"
"""Name of the token in the address."""
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


class Request(NamedTuple):
    """What a request says about who sends it; None for what it leaves out.

    host, origin : its headers; token : in the address; cookie : the value of this server's cookie
    """

    host: str | None
    origin: str | None
    token: str | None
    cookie: str | None


class Gate(NamedTuple):
    """Decides which requests are answered; port : of the server; token : random."""

    port: int
    token: str

    @property
    def host(self) -> str:
        """Address and port, as browsers name them."""
        return f"{LOOPBACK}:{self.port}"

    @property
    def address(self) -> str:
        """The address to open in a browser."""
        return f"http://{self.host}/?{TOKEN}={self.token}"

    @property
    def cookie(self) -> str:
        """The name of the cookie; cookies of one machine are shared by all its ports."""
        return f"rpf3d_desk_{self.port}"

    def admits(self, request: Request) -> bool:
        """Return True if a request comes from a page of this server, or from its user."""
        if request.host != self.host or request.origin not in (None, f"http://{self.host}"):
            return False
        return any(
            secrets.compare_digest(given.encode(), self.token.encode())
            for given in (request.token, request.cookie)
            if given is not None
        )


def new_gate(port: int) -> Gate:
    """Return the gate of a new server; port : 0 for any free port.

    Raises
    ------
    InputError
        The port is in use, or may not be used.
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
    """Run a server of trame until Ctrl-C; ready : called when browsers can connect."""
    # trame reads options from the command line and from these variables; only those named here hold.
    os.environ["TRAME_ARGS"] = f"--host {LOOPBACK} --port {gate.port} --timeout 0 --server"
    os.environ["WSLINK_READY_MSG"] = ""
    os.environ["WSLINK_WS_COMPRESS"] = "0"  # compression takes longer than sending, on one machine
    os.environ.pop("WSLINK_HTTP_HEADERS", None)
    server.controller.on_server_bind.add(lambda web, **_: web.app.middlewares.append(guard(gate)))
    server.controller.on_server_ready.add(lambda **_: ready())
    server.start(
        port=gate.port, host=LOOPBACK, open_browser=False, show_connection_info=False, timeout=0,
        disable_logging=True, exec_mode="main", backend="aiohttp",
    )  # fmt: skip


def guard(gate: Gate) -> Any:
    """Return the middleware of aiohttp that refuses requests and adds headers to answers."""
    web = library_of("desk", "aiohttp.web", "the desk needs")

    @web.middleware  # type: ignore[untyped-decorator]
    async def guarded(request: Any, handler: Any) -> Any:
        asked = Request(
            host=request.headers.get("Host"), origin=request.headers.get("Origin"),
            token=request.query.get(TOKEN), cookie=request.cookies.get(gate.cookie),
        )  # fmt: skip
        if not gate.admits(asked):
            return web.Response(status=403, text=REFUSED, headers=HEADERS)
        try:
            answer = await handler(request)
        except web.HTTPException as other:  # also a redirection
            answer = other
        if not answer.prepared:
            answer.headers.update(HEADERS)
            if asked.token is not None:
                answer.set_cookie(gate.cookie, gate.token, httponly=True, samesite="Strict")
        if isinstance(answer, web.HTTPException):
            raise answer
        return answer

    return guarded


def open_browser(address: str) -> bool:
    """Open the address in the user's browser; return False if there is none."""
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False
