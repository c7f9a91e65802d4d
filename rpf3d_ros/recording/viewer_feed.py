"""Send the recording to a viewer, which may be absent, slow or dead; the file never waits for the viewer.

A separate thread owns the viewer's stream and takes entries from a bounded queue. If the queue is full, entries are
dropped and counted. After a fault the thread opens a new stream and first sends the current state (`Head`), so a viewer
that reconnects shows the terrain.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, Full, Queue
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.log import import_rerun
from rpf3d_ros.recording.entries import RecordingEntry
from rpf3d_ros.recording.files import FAULTS, Head, draw
from rpf3d_ros.recording.stream import APPLICATION, Recording
from rpf3d_ros.recording.views import blueprint

WAITING = 64
"""Largest number of lists of entries, each from one message, that wait for the viewer."""

PATIENCE = 2.0
"""Time in which a viewer must accept a message (s); a viewer that takes longer is abandoned."""

RETRY = 3.0
"""Time between attempts to reach a viewer (s)."""

MEMORY = "512MiB"
"""Largest memory of the server that keeps data for viewers that connect late; beyond it, the oldest data is dropped."""

SERVE, NONE = "serve", "none"
PREFIXES = ("rerun://", "rerun+http://", "rerun+https://")


@dataclass(frozen=True)
class Viewer:
    """The kind and the address of a viewer.

    kind : "none", "serve" (viewers connect to this process), or the URL of a viewer
    bind, port : for the kind serve: address and port of this process to which viewers connect
    """

    kind: str = NONE
    bind: str = "127.0.0.1"
    port: int = 9876

    def check(self) -> None:
        """Raise InputError if the kind of viewer is unknown."""
        if self.kind not in (NONE, SERVE) and not self.kind.startswith(PREFIXES):
            raise InputError(
                f"viewer is '{self.kind}'; it must be none, serve, or a url such as rerun+http://127.0.0.1:9876/proxy"
            )

    def stream(self) -> Any:
        """Connect to the viewer and return the stream to it.

        This may take seconds, or raise OSError or RuntimeError.
        """
        rerun = import_rerun()
        stream = rerun.RecordingStream(APPLICATION)
        if self.kind == SERVE:
            sink = rerun.GrpcServerSink(bind_ip=self.bind, port=self.port, server_memory_limit=MEMORY)
        else:
            sink = rerun.GrpcSink(self.kind)
        stream.set_sinks(sink, default_blueprint=blueprint())
        return stream


class ViewerFeed:
    """Sends entries to a viewer on its own thread; `offer` never waits.

    dropped : (attribute) number of lists of entries that the viewer did not get
    fault : (attribute) the error of the connection, "" without error
    """

    def __init__(self, viewer: Viewer, head: Head, stream: Callable[[], Any] | None = None) -> None:
        """Start the thread.

        head : entries that are sent first on each stream
        stream : opens the viewer's stream; `Viewer.stream` by default
        """
        self._head, self._open = head, stream or viewer.stream
        self._queue: Queue[list[RecordingEntry]] = Queue(WAITING)
        self._closing = threading.Event()
        self.dropped, self.fault = 0, ""
        self._thread = threading.Thread(target=self._run, name="viewer", daemon=True)
        self._thread.start()

    def offer(self, entries: list[RecordingEntry]) -> None:
        """Queue a list of entries for the viewer; if the queue is full, drop the list and count it in `dropped`."""
        try:
            self._queue.put_nowait(entries)
        except Full:
            self.dropped += 1

    def close(self, seconds: float) -> bool:
        """Ask the thread to stop, and wait at most `seconds`; return True if the thread has ended.

        Return False if the thread still runs, for example because the viewer hangs; it then ends with the process.

        seconds : longest time (s) to wait for the thread
        """
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
        """Connect to the viewer and send entries until a fault or the end; then disconnect."""
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
        """Drop the lists of entries that waited for a viewer, and count the lists in attribute `dropped`.

        A new viewer receives the current state in their place.
        """
        while True:
            try:
                self._queue.get_nowait()
            except Empty:
                return
            self.dropped += 1
