"""Write MCAP bags in parallel with a recording: one bag for each file of the recording.

Each bag can be replayed without the others.
"""

from collections import deque
from pathlib import Path

from rpf3d_ros.interface.recorded_topics import DEFAULT_SENSORS, RecordedSensors
from rpf3d_ros.recording.bag_writer import BagWriter

WHOLE, PATCH = ("terrain/points", "terrain/mesh"), "terrain/update"
"""Topics of whole surveys and of patches; every bag begins with the last whole survey and all later patches."""

PATCHES_KEPT = 200
"""Largest number of patches that are kept for the next bag.

At a site with more patches between two whole surveys, later bags lack the oldest patches.
"""

Message = tuple[str, str, bytes]
"""A message: its topic as in `BagWriter.write`, the full name of the topic, and the CDR bytes."""


class IncidentBag:
    """Writes the bags of a recording: one bag for each file of the recording, or no bags if there is no prefix.

    A bag that cannot be written is abandoned; the next file of the recording begins another bag.

    folder : (attribute) folder of the current bag, None before the first bag
    fault : (attribute) why a bag could not be written, completed or deleted; "" without an error
    """

    def __init__(self, prefix: str, sensors: RecordedSensors = DEFAULT_SENSORS) -> None:
        """Write nothing yet.

        prefix : beginning of the paths of all bags, "" if no bag is wanted; sensors : topics of sources
        """
        self._sensors = sensors
        self._prefix = Path(prefix) if prefix else None
        self._writer: BagWriter | None = None
        self._survey: list[Message] = []
        self._patches: deque[Message] = deque(maxlen=PATCHES_KEPT)
        self._is_new = True
        self.folder: Path | None = None
        self.fault = ""

    def begin_with(self, recording: Path) -> None:
        """Close the last bag, and begin the bag for a new file of the recording; recording : path of this file.

        Raises OSError if the first bag cannot be written, InputError if rosbags is missing. If a later bag cannot be
        written, attribute `fault` states the error, and there is no bag for this file. If the last bag cannot be
        completed, `fault` states this error, but the new bag is begun.
        """
        if self._prefix is None:
            return
        last, self.folder, self.fault = self.folder, self._folder_of(recording), ""
        try:
            self.close()
        except OSError as error:
            self.fault = f"the index of {last} could not be written: {error}"
        try:
            self._writer, self._is_new = BagWriter(self.folder, self._sensors), True
        except OSError as error:
            self.fault = "; ".join(filter(None, [self.fault, f"{self.folder} cannot be written: {error}"]))
            if last is None:
                raise

    def forget(self, recording: Path) -> None:
        """Delete the bag of a deleted file of the recording; if this fails, `fault` states the error."""
        if self._prefix is None:
            return
        try:
            for file in self._folder_of(recording).glob("*"):  # a bag's folder has no subfolders
                file.unlink()
            self._folder_of(recording).rmdir()
        except FileNotFoundError:
            pass
        except OSError as error:
            self.fault = f"an old bag could not be deleted: {error}"

    def write(self, topic: str, name: str, stamp_ns: int, data: bytes) -> None:
        """Add a message unchanged; if this fails, `fault` states the error and the bag is abandoned.

        topic, name, stamp_ns, data : as in `BagWriter.write`
        """
        if self._prefix is None:
            return
        try:
            if self._writer is not None:
                self._begin(stamp_ns)
                self._writer.write(topic, name, stamp_ns, data)
        except OSError as error:
            self._writer, self.fault = None, f"{self.folder} cannot be written and ends here: {error}"
        self._remember(topic, name, data)

    def close(self) -> None:
        """Write the index of the open bag, if any. Raises OSError if this fails."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _folder_of(self, recording: Path) -> Path:
        assert self._prefix is not None
        return self._prefix.with_name(f"{self._prefix.name}_{recording.stem}")

    def _begin(self, stamp_ns: int) -> None:
        """Write the terrain into a new bag before its first message, so that a replay begins with the terrain.

        stamp_ns : time (ns) of the first message; the terrain gets the same time
        """
        if self._is_new and self._writer is not None:
            self._is_new = False
            for topic, name, data in (*self._survey, *self._patches):
                self._writer.write(topic, name, stamp_ns, data)

    def _remember(self, topic: str, name: str, data: bytes) -> None:
        if topic in WHOLE:
            self._survey = [(topic, name, data)]
            self._patches.clear()
        elif topic == PATCH:
            self._patches.append((topic, name, data))
