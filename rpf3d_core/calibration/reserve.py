"""Compute the time of a calibration that is reserved for the work after the flights: scores, pictures and files."""

import time
from dataclasses import dataclass
from typing import NamedTuple

LARGEST = 0.25
"""Largest part (-) of the budget that is reserved; until the time is measured, this whole part is reserved."""
WORTH_S = 15.0
"""Largest possible reserve (s) up to which the time is not measured, because measuring takes some seconds itself."""
MEASURED_AT = 0.5
"""Part (-) of the budget after which the time is measured, because a calibration that ends earlier needs no reserve."""
MARGIN = 1.25
"""Factor (-) on measured times, because other programs may become busier."""


class Reserve(NamedTuple):
    """The data from which the time reserved for the work after the flights (scores, files) is computed.

    began : `time.monotonic()` at the start of the budget; budget : s
    scores_s, files_s : s, times of scores and of files, measured with `sets` parameter sets; all three are 0 if the
        times have not been measured
    """

    began: float
    budget: float
    scores_s: float = 0.0
    files_s: float = 0.0
    sets: int = 0

    def seconds(self, sets: int) -> float:
        """Return the reserve (s): how long before the deadline the last of `sets` flown sets must end."""
        most = LARGEST * self.budget
        if not self.sets:
            return most
        grown = (sets / self.sets) ** 2  # each set is weighed with its neighbours among all others
        return min(MARGIN * (self.scores_s * grown + self.files_s), most)

    def should_measure(self, now: float) -> bool:
        """Return True if it is time to measure the work after the flights; now : `time.monotonic()`."""
        large = LARGEST * self.budget > WORTH_S
        return large and not self.sets and now - self.began > MEASURED_AT * self.budget


@dataclass
class Pace:
    """Measures the time that a parameter set takes, to decide whether another set would end in time.

    workers : number of sets that fly at the same time; set_s : s, time of one set, 0 before the first set has flown
    began : `time.monotonic()` at the start of the round; flown : number of sets of the round that have flown
    """

    workers: int
    set_s: float = 0.0
    began: float = 0.0
    flown: int = 0

    def begin(self) -> None:
        """Start to measure the flights of a round: no set has flown yet, and the time between rounds does not count."""
        self.began, self.flown = time.monotonic(), 0

    def count(self) -> None:
        """Count a set that has flown."""
        self.flown += 1
        self.set_s = (time.monotonic() - self.began) * min(self.workers, self.flown) / self.flown

    def is_too_late(self, until: float) -> bool:
        """Return True if a set that begins now would end after `until`, a `time.monotonic()`."""
        return time.monotonic() + self.set_s > until


def first_reserve(began: float, deadline: float) -> Reserve:
    """Return the reserve before the first flight.

    began, deadline : `time.monotonic()` at the start and at the end of the budget
    """
    return Reserve(began=began, budget=max(deadline - began, 0.0))
