"""Measure the wall time of `rpf3d run` from the start of its process, split into successive parts."""

import os
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rpf3d_core.results.findings import Run

IMPORTED = time.perf_counter()
"""Time at which this module was imported: the start of the process, if the system does not state the start."""
STAT = Path("/proc/self/stat")
START_TIME = 19
"""Index of the start time (clock ticks since the boot) in the fields of STAT after the program's name (proc(5))."""


class Part(NamedTuple):
    """A part of the wall time of a command: its name, such as `read`, and its duration (s)."""

    name: str
    seconds: float


class RunTimes:
    """The wall times of one command, split into successive parts; parallel work is not counted twice.

    began : start of the command, as `time.perf_counter()`
    measured_s : wall time (s) of the measurements for `--accuracy`, before the run
    """

    def __init__(self) -> None:
        """Set `began`: the start of the process or, for a second command in the same process, the current time."""
        self.began = next(_STARTS, time.perf_counter())
        self.measured_s = 0.0

    def parts(self, run: "Run", pictures_s: float, now: float) -> list[Part]:
        """Return the successive parts of the time from `began` to `now`; their sum is this time.

        pictures_s : time (s) spent waiting for the pictures after all other files were complete
        now : as from `time.perf_counter()`
        """
        prepared, flights = run.prepared, run.flights
        known = prepared.read_s + prepared.index_s + flights.compile_s + flights.fly_s
        parts = [
            Part("start", prepared.began - self.began - self.measured_s),
            Part("measure", self.measured_s),
            Part("read", prepared.read_s),
            Part("index", prepared.index_s),
            Part("compile", flights.compile_s),
            Part("fly", flights.fly_s),
            Part("count", run.wall_s - known),
            Part("write", now - prepared.began - run.wall_s - pictures_s),
            Part("pictures", pictures_s),
        ]
        return [part for part in parts if part.name not in ("measure", "pictures") or part.seconds > 0.0]


def words_of(parts: Sequence[Part]) -> str:
    """Return the parts of a time and their sum as text, rounded so that the parts add up to the sum."""
    words, before, end = list[str](), 0.0, 0.0
    for part in parts:
        end += part.seconds
        words.append(f"{part.name} {round(end, 2) - before:.2f} s")
        before = round(end, 2)
    return f"{', '.join(words)}: {before:.2f} s"


def _process_start() -> float:
    """Return the start of this process on the clock `time.perf_counter()` (s).

    If the system does not state the start, the result is the time at which this module was imported.
    """
    with suppress(OSError, ValueError, IndexError, AttributeError):
        fields = STAT.read_text().rpartition(")")[2].split()
        since_boot = int(fields[START_TIME]) / os.sysconf("SC_CLK_TCK")
        return time.perf_counter() - (time.clock_gettime(time.CLOCK_BOOTTIME) - since_boot)
    return IMPORTED


_STARTS = iter((_process_start(),))
"""Iterator with one item, the start of the process: only the first command of the process began at this time."""
