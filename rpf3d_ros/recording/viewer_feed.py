"""Handing what is recorded to a viewer, which may be absent, slow, hung or dead: the file never waits for it.

A thread of its own owns the viewer's stream and takes from a bounded queue. What does not fit is dropped and counted.
After a fault the stream is made anew, beginning with what holds (`Head`), so a viewer that comes back sees the ground.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, Full, Queue
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.log import import_rerun
from rpf3d_ros.recording.files import FAULTS, Head, draw
from rpf3d_ros.recording.message_log import Entry
from rpf3d_ros.recording.stream import APPLICATION, Recording
from rpf3d_ros.recording.views import blueprint

WAITING = 64
"""Messages that wait for the viewer at most."""

PATIENCE = 2.0
"""Seconds in which a viewer must have taken a message; a hung one is left after that."""

RETRY = 3.0
"""Seconds between attempts to reach a viewer."""

MEMORY = "512MiB"
"""What the server keeps for viewers that come late; the oldest is dropped."""

SERVE, NONE = "serve", "none"
PREFIXES = ("rerun://", "rerun+http://", "rerun+https://")


@dataclass(frozen=True)
class Viewer:
    """kind : none, serve (viewers come to us), or the url of a viewer that we go to; bind, port : where to serve."""

    kind: str = NONE
    bind: str = "127.0.0.1"
    port: int = 9876

    def check(self) -> None:
        """Raises InputError for a kind that is none of the three."""
        if self.kind not in (NONE, SERVE) and not self.kind.startswith(PREFIXES):
            raise InputError(
                f"viewer is '{self.kind}'; it must be none, serve, or a url such as rerun+http://127.0.0.1:9876/proxy"
            )

    def stream(self) -> Any:
        """A rerun.RecordingStream whose sink is the viewer; may take seconds, or raise OSError or RuntimeError."""
        rerun = import_rerun()
        stream = rerun.RecordingStream(APPLICATION)
        if self.kind == SERVE:
            sink = rerun.GrpcServerSink(bind_ip=self.bind, port=self.port, server_memory_limit=MEMORY)
        else:
            sink = rerun.GrpcSink(self.kind)
        stream.set_sinks(sink, default_blueprint=blueprint())
        return stream


class ViewerFeed:
    """The thread that feeds a viewer. `offer` and `state` never wait."""

    def __init__(self, viewer: Viewer, head: Head, stream: Callable[[], Any] | None = None) -> None:
        """head : what a stream begins with; stream : opens the viewer's stream, `Viewer.stream` by default."""
        self._viewer, self._head, self._open = viewer, head, stream or viewer.stream
        self._queue: Queue[list[Entry]] = Queue(WAITING)
        self._closing = threading.Event()
        self.dropped, self.fault = 0, ""
        self._thread = threading.Thread(target=self._run, name="viewer", daemon=True)
        self._thread.start()

    def offer(self, entries: list[Entry]) -> None:
        """Hand entries on where there is room for them."""
        try:
            self._queue.put_nowait(entries)
        except Full:
            self.dropped += 1

    def close(self, seconds: float) -> bool:
        """End the thread; False where a hung viewer has kept it, which then ends with the process."""
        self._closing.set()
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                self._feed()
            except FAULTS as error:
                self.fault = " ".join(str(error).split())
                self._closing.wait(RETRY)

    def _feed(self) -> None:
        """Open the stream and feed it until something fails or the end; the stream is left in any case."""
        recording = Recording(self._open())
        try:
            self._empty()
            draw(recording, self._head.entries())
            recording.flush(PATIENCE)
            self.fault = ""
            while not self._closing.is_set():
                self._pass_on(recording)
        finally:
            recording.leave()

    def _pass_on(self, recording: Recording) -> None:
        try:
            entries = self._queue.get(timeout=0.2)
        except Empty:
            return
        draw(recording, entries)
        recording.flush(PATIENCE)

    def _empty(self) -> None:
        """What waited while there was no viewer is old; what of it still holds is in the head."""
        while True:
            try:
                self._queue.get_nowait()
            except Empty:
                return
            self.dropped += 1
