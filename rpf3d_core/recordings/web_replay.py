"""Serve a recording and rerun's web viewer to browsers on this machine only."""

import os
import secrets
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import quote

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.replay import LOOPBACK, SUFFIX
from rpf3d_core.recordings.viewer_pages import PAGES

POLICY = "; ".join([
    "default-src 'none'",
    "script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'",  # the page has inline scripts and runs WebAssembly
    "style-src 'self' 'unsafe-inline'",
    "connect-src 'self'",
    "img-src 'self' data: blob:",
    "font-src 'self' data:",
    "worker-src 'self' blob:",
    "base-uri 'none'",
    "form-action 'none'",
    "frame-ancestors 'none'",
])  # fmt: skip
"""Content policy of the page: the browser sends no request to another machine, for example for fonts."""
HEADERS = {
    "Content-Security-Policy": POLICY,
    # With this header, and without Access-Control-Allow-Origin, pages of other sites cannot read the recording.
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
RECORDING_TYPE = "application/octet-stream"
START = "index.html"
PART = 2**20
"""Size (bytes) of the parts in which a recording is read."""


class WebReplay(ThreadingHTTPServer):
    """A web server for one recording and the pages of rerun's web viewer, bound to the loopback address.

    The path of each address begins with a random token, so that other users of this machine cannot guess the address.
    """

    daemon_threads = True

    def __init__(self, recording: Path, pages: Mapping[str, bytes], port: int = 0) -> None:
        """Bind a port; pages : content of the viewer's files, by the names of PAGES; port : 0 for any free port.

        Raises
        ------
        InputError
            The port is in use, or this program is not permitted to use it.
        """
        self.recording, self.pages, self.token = recording, pages, secrets.token_urlsafe(16)
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OSError as fault:
            raise InputError(f"port {port} cannot be used ({fault.strerror}); give another with --port") from fault

    @property
    def host(self) -> str:
        """Address and port, as in the header `Host` of a browser's request."""
        return f"{LOOPBACK}:{self.server_port}"

    @property
    def address(self) -> str:
        """The address to open in a browser. The page there is the viewer; it loads the recording."""
        base = f"http://{self.host}/{self.token}/"
        return f"{base}?url={quote(base + self.recording_name, safe='')}"

    @property
    def recording_name(self) -> str:
        """The name of the recording in the address; from the suffix, the viewer knows the format of the recording."""
        return quote(f"{self.recording.stem}{SUFFIX}")

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore errors of a request, such as a browser that ends the connection early."""


class _Handler(BaseHTTPRequestHandler):
    """Answers requests of a browser for a page of the viewer or for the recording."""

    server: WebReplay

    def do_GET(self) -> None:
        """Send a page or the recording."""
        self._answer(body=True)

    def do_HEAD(self) -> None:
        """Send the headers of a page or of the recording."""
        self._answer(body=False)

    def _answer(self, body: bool) -> None:
        """Send the page or recording that the path names; refuse paths without the token and requests to other hosts.

        The header `Host` is checked, because the name of another site may point to this address.

        body : False to send the headers only
        """
        _, token, name = [*self.path.partition("?")[0].split("/", 2), "", ""][:3]
        if self.headers.get("Host") != self.server.host or not secrets.compare_digest(
            token.encode(), self.server.token.encode()
        ):
            self._refuse(HTTPStatus.FORBIDDEN)
        elif name == self.server.recording_name:
            self._send_recording(body)
        elif (name or START) in self.server.pages:
            page = self.server.pages[name or START]
            self._begin(PAGES[name or START], len(page))
            if body:
                self.wfile.write(page)
        else:
            self._refuse(HTTPStatus.NOT_FOUND)

    def _send_recording(self, body: bool) -> None:
        try:
            with self.server.recording.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                self._begin(RECORDING_TYPE, size)
                while body and size > 0 and (part := file.read(min(size, PART))):  # not what is appended later
                    self.wfile.write(part)
                    size -= len(part)
        except FileNotFoundError:
            self._refuse(HTTPStatus.NOT_FOUND)

    def _begin(self, content_type: str, length: int) -> None:
        """Send the status and all headers of a response; length : size of the content that follows (bytes)."""
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", content_type)
        self.send_header("Content-Length", str(length))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()

    def _refuse(self, status: HTTPStatus) -> None:
        """Send a status without content."""
        self.send_response(status)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing, because requests are of no interest to the user."""
