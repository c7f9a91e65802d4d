"""The bag beside a recording: one bag a file of the recording, each replayable by itself."""

from pathlib import Path

from rpf3d_ros.recording.bag_writer import BagWriter

WHOLE, PATCH = ("terrain/points", "terrain/mesh"), "terrain/update"
"""The last whole terrain and the patches since begin every bag."""

PATCHES_KEPT = 200
"""At most; a site that patches more often than it surveys loses the oldest in the bags after the first."""


class IncidentBag:
    """Writes nothing where no bag is wanted. A bag that cannot be written is left; the next file begins another."""

    def __init__(self, prefix: str) -> None:
        """prefix : path that the bags' names begin with; "" where none is wanted."""
        self._prefix = Path(prefix) if prefix else None
        self._writer: BagWriter | None = None
        self._ground: list[tuple[str, str, bytes]] = []
        self._is_new = True
        self.folder: Path | None = None
        self.fault = ""

    def begin_with(self, recording: Path) -> None:
        """End the bag and begin the one of a recording.

        Raises OSError where that of the first recording cannot be written; of later ones `fault` then says why.
        """
        if self._prefix is None:
            return
        first = self.folder is None
        self.folder = self._beside(recording)
        try:
            self.close()
            self._writer, self._is_new, self.fault = BagWriter(self.folder), True, ""
        except OSError as error:
            self.fault = f"{self.folder} cannot be written: {error}"
            if first:
                raise

    def forget(self, recording: Path) -> None:
        """Delete the bag of a recording that is deleted; where that is not possible, `fault` says why."""
        if self._prefix is None:
            return
        try:
            for file in self._beside(recording).glob("*"):  # a bag's folder holds files alone
                file.unlink()
            self._beside(recording).rmdir()
        except FileNotFoundError:
            pass
        except OSError as error:
            self.fault = f"an old bag could not be deleted: {error}"

    def write(self, topic: str, name: str, stamp_ns: int, data: bytes) -> None:
        """Add a message as it came; where that is not possible, `fault` says why and the bag is left."""
        if self._prefix is None:
            return
        try:
            if self._writer is not None:
                self._begin(stamp_ns)
                self._writer.write(topic, name, stamp_ns, data)
        except OSError as error:
            self._writer, self.fault = None, f"{self.folder} could not be written and is left: {error}"
        self._remember(topic, name, data)

    def close(self) -> None:
        """Write the index of the bag that is open."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _beside(self, recording: Path) -> Path:
        assert self._prefix is not None
        return self._prefix.with_name(f"{self._prefix.name}_{recording.stem}")

    def _begin(self, stamp_ns: int) -> None:
        """The ground comes first, at the time of the first message: whoever replays does not wait for it."""
        if self._is_new and self._writer is not None:
            self._is_new = False
            for topic, name, data in self._ground:
                self._writer.write(topic, name, stamp_ns, data)

    def _remember(self, topic: str, name: str, data: bytes) -> None:
        if topic in WHOLE:
            self._ground = [(topic, name, data)]
        elif topic == PATCH:
            self._ground = [*self._ground[:1], *self._ground[1:][1 - PATCHES_KEPT :], (topic, name, data)]
