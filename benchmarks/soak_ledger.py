"""Record a soak test: which alert levels were demanded, when they were reached, delays, memory.

A demand is a level that must be published by a time. A deliberate disturbance (a kill, a jump of the clock) postpones
this time and is counted, so that the report shows the number of disturbed demands.
"""

import sys
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field

import numpy as np

from rpf3d_core.alerts.levels import Level

SECOND = 1_000_000_000


@dataclass
class Demand:
    """One alert level that the nodes must reach by a time.

    what : description, for messages; level : lowest alert level that meets the demand
    since, until : start of the demand, and time by which it must be met (s, monotonic)
    disturbed : number of disturbances; met : time at which the demand was met (s, monotonic), None if it was not met
    """

    what: str
    level: Level
    since: float
    until: float
    disturbed: int = 0
    met: float | None = None


@dataclass
class Ledger:
    """The record of a soak test, from which the report is made.

    demands : all demands so far; delays : name of a kind of delay -> delays (s); counts : event -> number
    memory : samples: name of the node, number of its start, time (s) since the start of the test, memory (MB)
    failures : one sentence for each failure; began : start of the test (s, monotonic)
    """

    demands: list[Demand] = field(default_factory=list)
    delays: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    memory: list[tuple[str, int, float, float]] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)
    began: float = field(default_factory=time.monotonic)

    def demand(self, what: str, level: Level, within: float) -> Demand:
        """Add and return a demand: the nodes must reach this alert level within a time (s) from now."""
        now = time.monotonic()
        self.demands.append(Demand(what, level, now, now + within))
        return self.demands[-1]

    def disturb(self, demand: Demand | None, seconds: float) -> None:
        """Extend a demand that is not met yet to at least `seconds` from now, because of a disturbance.

        demand : None if there is no demand
        """
        if demand is not None and demand.met is None:
            demand.until = max(demand.until, time.monotonic() + seconds)
            demand.disturbed += 1

    def settle(self, demand: Demand, held: Level | None) -> bool:
        """Return True if a held level meets a demand, or met it earlier; store the time when the demand is first met.

        held : the held alert level, None if it is not known
        """
        if held is not None and held >= demand.level and demand.met is None:
            demand.met = time.monotonic()
        return demand.met is not None

    def fail(self, sentence: str, seen: str = "") -> None:
        """Record a failure of the test.

        seen : text that is printed at once, but is not part of the report
        """
        self.failures.append(f"after {time.monotonic() - self.began:.0f} s: {sentence}")
        print(f"FAILURE {self.failures[-1]}\n{seen}", file=sys.stderr, flush=True)

    @property
    def lost(self) -> list[Demand]:
        """The demands that are not met: the lost alerts."""
        return [demand for demand in self.demands if demand.met is None]

    @property
    def summary(self) -> str:
        """A line of text on the progress of the test: numbers of bursts, failures and results."""
        return f"{len(self.demands)} bursts, {len(self.failures)} failures, {self.counts['results']} results"

    def took(self, disturbed: bool) -> list[float]:
        """Return the time (s) from the start of each demand until the demand was met, for demands that were met.

        disturbed : True for the disturbed demands, False for the undisturbed demands
        """
        return [d.met - d.since for d in self.demands if d.met is not None and (d.disturbed > 0) == disturbed]

    def slopes(self, settling: float) -> dict[str, tuple[float, float, float, float]]:
        """Return by name of a node how its memory grew between the start and the end of its longest-lived process.

        The figures are the memory at the end (MB), the largest memory of all processes of the node (MB), the slope
        (MB/h, NaN with few samples) and the length of the life (s).

        settling : first seconds of a life that are left out of the slope
        """
        found = {}
        for node in sorted({name for name, *_ in self.memory}):
            lives: defaultdict[int, list[tuple[float, float]]] = defaultdict(list)
            for name, life, at, size in self.memory:
                if name == node and np.isfinite(size):
                    lives[life].append((at, size))
            longest = max(lives.values(), key=lambda life: life[-1][0] - life[0][0])
            most = max(size for life in lives.values() for _, size in life)
            kept = np.array([each for each in longest if each[0] - longest[0][0] >= settling])
            slope = float(np.polyfit(kept[:, 0] / 3600.0, kept[:, 1], 1)[0]) if len(kept) > 10 else float("nan")
            found[node] = (longest[-1][1], most, slope, longest[-1][0] - longest[0][0])
        return found


def percentiles(seconds: list[float]) -> str:
    """Return cells of a table row: the number of delays, their median, 95 % and 99 % percentile, and maximum (ms).

    seconds : delays (s)
    """
    if not seconds:
        return "0 | - | - | - | -"
    figures = [1e3 * float(np.percentile(seconds, share)) for share in (50, 95, 99, 100)]
    return f"{len(seconds)} | " + " | ".join(f"{figure:.0f}" for figure in figures)
