"""What a recording holds, read back with rerun's own tools."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.log import import_rerun

VERIFYING = 60.0
"""Seconds that `rerun rrd verify` may take."""


def verify(recording: Path) -> None:
    """Let `rerun rrd verify` read the recording. Raises InputError with what it says where it does not accept it."""
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(recording)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=VERIFYING, check=False)
    if done.returncode:
        raise InputError(f"{recording}: rerun rrd verify refuses it: {(done.stderr or done.stdout).strip()}")


def rows_by_entity(recording: Path) -> dict[str, int]:
    """Rows of each entity, over all its chunks. Raises InputError for a file that is no recording."""
    reader = import_rerun().chunk.RrdReader
    rows: Counter[str] = Counter()
    try:
        for chunk in reader(str(recording)).stream().to_chunks():
            rows[str(chunk.entity_path)] += chunk.num_rows
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{recording}: cannot be read back: {error}") from error
    return dict(rows)
