"""Verify recordings, read their content, and repair incomplete recordings, with rerun's own tools."""

import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.log import import_rerun

LONGEST = 600.0
"""Time (s) after which a tool of rerun counts as failed; a recording of 1 GB takes about 10 s."""

IN_FLIGHT = "/trajectories/rocks"
"""Last part of the names of the entities with the predicted positions of rocks.

Times of these entities lie in the future, so they do not count for the last moment of a recording.
"""

TIMELINES = ("ros_time", "sim_time")
"""Timelines in order of preference: the last moment of a recording is on the first of these that the recording has."""


class RecordingContent(NamedTuple):
    """The number of rows of each entity of a recording, and the recording's last moment, for a report after a repair.

    rows : number of rows by entity
    until : name of the timeline and last moment on it as text, "" for a recording without times
    """

    rows: dict[str, int]
    until: str


def verify(recording: Path) -> None:
    """Check with rerun's own tool that a recording is undamaged.

    Raise InputError with rerun's message if the recording is damaged, and also if rerun is not installed or its tool
    takes longer than LONGEST (600 s).
    """
    _rerun(recording, "refuses it", "verify", str(recording))


def rows_by_entity(recording: Path) -> dict[str, int]:
    """Return the number of rows of each entity in a recording; raise InputError if the file is not a recording."""
    return content_of(recording).rows


def bytes_by_entity(recording: Path) -> dict[str, int]:
    """Return the uncompressed size (bytes) of each entity's rows; raise InputError if the file is not a recording."""
    sizes: Counter[str] = Counter()
    for chunk in _chunks(recording):
        sizes[str(chunk.entity_path)] += chunk.to_record_batch().nbytes
    return dict(sizes)


def content_of(recording: Path) -> RecordingContent:
    """Return the rows of each entity and the last moment of a recording; raise InputError for another file."""
    rows: Counter[str] = Counter()
    last: dict[str, Any] = {}
    for chunk in _chunks(recording):
        rows[str(chunk.entity_path)] += chunk.num_rows
        if not chunk.is_static and chunk.num_rows and not str(chunk.entity_path).endswith(IN_FLIGHT):
            columns = chunk.to_record_batch()
            for name in set(TIMELINES) & set(columns.schema.names):
                moments = (moment for moment in columns.column(name).to_numpy(zero_copy_only=False))
                last[name] = max([*moments, *([last[name]] if name in last else [])])
    return RecordingContent(dict(rows), next((f"{name} {last[name]}" for name in TIMELINES if name in last), ""))


def repair(broken: Path, repaired: Path) -> RecordingContent:
    """Repair an incomplete recording: write its readable part to another file, and return the content of that file.

    Raise InputError if `broken` does not exist, `repaired` already exists, no row can be read, or the repaired
    recording is not valid; also if a tool of rerun is missing or takes too long. In these cases no new file remains.
    """
    if repaired.exists():
        raise InputError(f"{repaired}: already exists; delete it, or name another file with -o")
    if not broken.is_file():
        raise InputError(f"{broken}: there is no such file")
    part = repaired.with_name(f"{repaired.stem}.part.rrd")
    try:
        _rerun(broken, "cannot read it", "merge", "--continue-on-error", str(broken), "-o", str(part))
        content = _saved(broken, part)
        verify(part)
        part.replace(repaired)
    finally:
        part.unlink(missing_ok=True)
    return content


def _saved(broken: Path, part: Path) -> RecordingContent:
    try:
        content = content_of(part)
    except InputError as error:
        raise InputError(f"{broken}: cannot be repaired, because no recording can be read from it ({error})") from error
    if not any(not entity.startswith("/__") for entity in content.rows):
        raise InputError(f"{broken}: cannot be repaired, because no rows can be read from it")
    return content


def _chunks(recording: Path) -> Iterator[Any]:
    reader = import_rerun().chunk.RrdReader
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # rerun warns of a missing footer; `verify` reports it
            yield from reader(str(recording)).stream().to_chunks()
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{recording}: cannot be read back: {error}") from error


def _rerun(recording: Path, complaint: str, tool: str, *arguments: str) -> None:
    import_rerun()
    command = [sys.executable, "-m", "rerun", "rrd", tool, *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired as late:
        raise InputError(f"{recording}: rerun rrd {tool} took more than {LONGEST:g} s") from late
    if done.returncode:
        raise InputError(f"{recording}: rerun rrd {tool} {complaint}: {(done.stderr or done.stdout).strip()}")
