"""What a soak demanded of the nodes and when it came: demands on alerts, delays, memory.

A demand is a level that has to be told by a time. What takes the node away from it on purpose (a kill, a jump of the
clock) moves that time, and is counted, so that the report says how often that was so.
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
    """level : at least this must be held; since, until : s, monotonic; met : when it was, or None"""

    what: str
    level: Level
    since: float
    until: float
    disturbed: int = 0
    met: float | None = None


@dataclass
class Ledger:
    """demands : all so far; delays : name -> seconds; memory : node -> (s, MB) since it started; counts : of events"""

    demands: list[Demand] = field(default_factory=list)
    delays: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    memory: list[tuple[str, int, float, float]] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)
    began: float = field(default_factory=time.monotonic)

    def demand(self, what: str, level: Level, within: float) -> Demand:
        """Demand that a level be held within a time (s) from now."""
        now = time.monotonic()
        self.demands.append(Demand(what, level, now, now + within))
        return self.demands[-1]

    def disturb(self, demand: Demand | None, seconds: float) -> None:
        """Give an open demand so many seconds from now, for what it needs was taken away."""
        if demand is not None and demand.met is None:
            demand.until = max(demand.until, time.monotonic() + seconds)
            demand.disturbed += 1

    def settle(self, demand: Demand, held: Level | None) -> bool:
        """Whether the demand is met by what is held now; noted the first time."""
        if held is not None and held >= demand.level and demand.met is None:
            demand.met = time.monotonic()
        return demand.met is not None

    def fail(self, sentence: str, seen: str = "") -> None:
        """Note what must not be; what was seen is printed at once, and not in the report."""
        self.failures.append(f"after {time.monotonic() - self.began:.0f} s: {sentence}")
        print(f"FAILURE {self.failures[-1]}\n{seen}", file=sys.stderr, flush=True)

    @property
    def lost(self) -> list[Demand]:
        """Demands that were never met."""
        return [demand for demand in self.demands if demand.met is None]

    @property
    def summary(self) -> str:
        """How it goes, in a few words."""
        return f"{len(self.demands)} bursts, {len(self.failures)} failures, {self.counts['results']} results"

    def took(self, disturbed: bool) -> list[float]:
        """Seconds until each demand was met, of those that were disturbed, or of the others."""
        return [d.met - d.since for d in self.demands if d.met is not None and (d.disturbed > 0) == disturbed]

    def slopes(self, settling: float) -> dict[str, tuple[float, float, float, float]]:
        """Node -> memory at the end of its longest life and its most (MB), slope (MB/h) over it, and its length (s).

        settling : first seconds of a life that are left out
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
    """Median, 95 %, 99 % and the longest, in ms, as cells of a table."""
    if not seconds:
        return "0 | - | - | - | -"
    figures = [1e3 * float(np.percentile(seconds, share)) for share in (50, 95, 99, 100)]
    return f"{len(seconds)} | " + " | ".join(f"{figure:.0f}" for figure in figures)
