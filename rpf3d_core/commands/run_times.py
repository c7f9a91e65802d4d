"""How long the user of `rpf3d run` waited, from the start of the process, in parts that follow each other."""

import os
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rpf3d_core.results.findings import Run

IMPORTED = time.perf_counter()
"""Start of the command where the system does not state the start of the process."""
STAT = Path("/proc/self/stat")
START_TIME = 19
"""Place of the start time (clock ticks since the boot) among the fields of STAT after the program's name (proc(5))."""


class Part(NamedTuple):
    """A part of the wall time of a command; seconds : s."""

    name: str
    seconds: float


class RunTimes:
    """The times of one command; work that runs at the same time as other work is in no part.

    began : start of the command, as `time.perf_counter()`
    measured_s : wall time (s) of the measurements for `--accuracy`, before the run
    """

    def __init__(self) -> None:
        """Begin with the start of the process; a second command of a process begins with this call."""
        self.began = next(_STARTS, time.perf_counter())
        self.measured_s = 0.0

    def parts(self, run: "Run", pictures_s: float, now: float) -> list[Part]:
        """Return the parts of the time from the start to `now`, in their order; they add up to this time.

        pictures_s : wall time (s) of the wait for the pictures after all other files were complete
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
    """Return parts of a time and their sum in words; the rounded parts add up to the rounded sum."""
    words, before, end = list[str](), 0.0, 0.0
    for part in parts:
        end += part.seconds
        words.append(f"{part.name} {round(end, 2) - before:.2f} s")
        before = round(end, 2)
    return f"{', '.join(words)}: {before:.2f} s"


def _process_start() -> float:
    """Return the start of this process as `time.perf_counter()`; IMPORTED where the system does not state it."""
    with suppress(OSError, ValueError, IndexError, AttributeError):
        fields = STAT.read_text().rpartition(")")[2].split()
        since_boot = int(fields[START_TIME]) / os.sysconf("SC_CLK_TCK")
        return time.perf_counter() - (time.clock_gettime(time.CLOCK_BOOTTIME) - since_boot)
    return IMPORTED


_STARTS = iter((_process_start(),))
"""The start of the process, for its first command."""
