"""What a combination of the campaign consists of: the truth, what is sent, who sends it, and the clock."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from never_green.pit import FloatArray

END = 24.0
"""Duration of a combination (s of simulated time)."""

TICK = 0.25
"""Time (s) between two regular calls of the node."""

BEGAN = 100_000.0
"""Time of the node's clock at the begin of a combination (s)."""


class TrueSource(NamedTuple):
    """A source that is there from a time (s) on, until the end of the combination.

    seen_by : topics of the sensors that see the source
    until : time (s) until which the monitoring knows of the source; a click counts as long as sources may be old
    """

    place: FloatArray
    since: float
    seen_by: tuple[str, ...]
    until: float = np.inf


class Truth(NamedTuple):
    """What is there, whatever the messages say: sources, whether the bank stands, and the watched outlines.

    bank_until : time (s) at which the bank is removed; infinite if it stays, 0 if there is none
    area, area_since : corners (P, 2) m of live_area until and from `area_since` (s)
    machines : places (N, 3) m of equipment, None if the site watches none
    """

    sources: tuple[TrueSource, ...]
    bank_until: float
    areas: tuple[FloatArray, FloatArray]
    area_since: float
    machines: FloatArray | None = None

    def has_bank(self, at: float) -> bool:
        """True if the bank stands at a time (s)."""
        return at < self.bank_until

    def area(self, at: float) -> FloatArray:
        """Return the corners (P, 2) m of live_area at a time (s)."""
        return self.areas[int(at >= self.area_since)]


class Send(NamedTuple):
    """A message as its publisher means it, and what a defect has made of it.

    sent, at : time (s) at which the message is published, and arrives
    kind : poses, cloud, point, grid, mesh, patch, polygon, equipment or acknowledgement
    places : (N, 3) or (rows, columns, 3) m; corners (P, 2) m of a polygon
    offset : s, added to the stamp, which is else the time of the clock at `sent`
    publisher : number of the publisher of the topic; damage : what a defect does to the finished message
    """

    sent: float
    at: float
    topic: str
    kind: str
    places: FloatArray
    frame: str = "map"
    offset: float = 0.0
    publisher: int = 0
    damage: Callable[[Any], Any] | None = None
    words: str = ""


class Speaker(NamedTuple):
    """A publisher of a topic in the graph, from a time (s) until another.

    is_received : False if its quality of service or type does not fit, so that nothing of it arrives
    """

    topic: str
    number: int
    since: float = 0.0
    until: float = np.inf
    is_received: bool = True
    is_of_type: bool = True


class ClockRule(NamedTuple):
    """How the node's clock differs from a steady one.

    begins : time (s) before which the clock shows 0; stands : from and until (s) it shows the same
    jump, jump_at : step (s) of the clock and its time (s)
    """

    begins: float = 0.0
    stands: tuple[float, float] = (np.inf, np.inf)
    jump: float = 0.0
    jump_at: float = np.inf

    def now(self, steady: float) -> float:
        """Return the time (s) of the clock at a steady time (s) since the begin; 0 before the clock runs."""
        if steady < self.begins:
            return 0.0
        shown = self.stands[0] if self.stands[0] <= steady < self.stands[1] else steady
        return BEGAN + shown + (self.jump if steady >= self.jump_at else 0.0)


class Plan(NamedTuple):
    """A combination: truth, messages, publishers, clock, the site, and the names of its defects.

    limits : highest level that the site has limits for; expects : True if the site names its sensors as expected
    answers_fail : range of time (s) in which answers to sources on the slope fail, None if none do
    graces : times (s) from which a fault may take some seconds more, and these seconds
    """

    truth: Truth
    sends: tuple[Send, ...]
    speakers: tuple[Speaker, ...]
    sensors: tuple[str, ...]
    limits: str
    expects: bool
    clock: ClockRule = ClockRule()
    answers_fail: tuple[float, float] | None = None
    graces: tuple[tuple[float, float], ...] = ()
    defects: tuple[str, ...] = ()

    def with_defect(self, name: str, **changes: Any) -> "Plan":
        """Return the plan with one more defect and other changes."""
        return self._replace(defects=(*self.defects, name), **changes)
