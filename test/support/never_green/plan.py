"""Types for the parts of a combination: the truth, the messages, their publishers, and the node's clock."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from never_green.pit import FloatArray

END = 24.0
"""Duration of a combination (s of simulated time)."""

TICK = 0.25
"""Time (s) between two calls of the node's timer."""

BEGAN = 100_000.0
"""Time (s) of the node's clock at the start of a combination."""


class TrueSource(NamedTuple):
    """A true source of rocks, from the time `since` (s) until the end of the combination.

    place : (3,) m, map frame
    seen_by : topics of the sensors that see the source
    until : time (s) until which the node must count the source; for a click, until the click is too old
    is_thrown : True if its rocks start at the velocity `pit.THROW`, False if they start at rest
    """

    place: FloatArray
    since: float
    seen_by: tuple[str, ...]
    until: float = np.inf
    is_thrown: bool = False


class Truth(NamedTuple):
    """The true state of the pit, independent of the messages: sources, the bank, and the areas of interest.

    bank_until : time (s) at which the bank is removed; infinite if it stays, 0 if there is no bank
    areas : corners (P, 2) m of the area `live_area` before, and after, the time `area_since` (s)
    machines : places (N, 3) m of equipment, None if the site watches no equipment
    """

    sources: tuple[TrueSource, ...]
    bank_until: float
    areas: tuple[FloatArray, FloatArray]
    area_since: float
    machines: FloatArray | None = None

    def has_bank(self, at: float) -> bool:
        """Return True if the bank exists at a time (s)."""
        return at < self.bank_until

    def area(self, at: float) -> FloatArray:
        """Return the corners (P, 2) m of live_area at a time (s)."""
        return self.areas[int(at >= self.area_since)]


class Send(NamedTuple):
    """A message of a publisher, with the changes that a defect makes.

    sent, at : times (s) at which the message is published, and at which the node receives it
    kind : poses, cloud, point, grid, mesh, patch, polygon, equipment or acknowledgement
    places : (N, 3) or (rows, columns, 3) m; corners (P, 2) m of a polygon
    offset : time (s) added to the stamp; without it, the stamp is the time of the node's clock at `sent`
    publisher : number of the publisher (`Speaker.number`)
    damage : function of a defect that changes the finished message, None for no change
    words : "NAME: REASON" of an acknowledgement
    is_thrown : True if the message reports the velocity `pit.THROW` for all its sources
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
    is_thrown: bool = False


class Speaker(NamedTuple):
    """A publisher of a topic in the ROS graph, from the time `since` until the time `until` (s).

    number : distinguishes the publishers of a topic; 0 for the usual publisher
    is_received : False if its quality of service or type does not fit, so that none of its messages arrives
    is_of_type : False if it publishes messages of another type
    """

    topic: str
    number: int
    since: float = 0.0
    until: float = np.inf
    is_received: bool = True
    is_of_type: bool = True


class ClockRule(NamedTuple):
    """The difference between the node's clock and a steady clock.

    begins : time (s) before which the clock shows 0
    stands : start and end (s) of the time in which the clock stands still
    jump, jump_at : length (s) of a jump of the clock, negative if the clock jumps back, and time (s) of the jump
    """

    begins: float = 0.0
    stands: tuple[float, float] = (np.inf, np.inf)
    jump: float = 0.0
    jump_at: float = np.inf

    def now(self, steady: float) -> float:
        """Return the time (s) of the node's clock; 0 before the clock runs.

        steady : time (s) of a steady clock since the start of the combination
        """
        if steady < self.begins:
            return 0.0
        shown = self.stands[0] if self.stands[0] <= steady < self.stands[1] else steady
        return BEGAN + shown + (self.jump if steady >= self.jump_at else 0.0)


class Plan(NamedTuple):
    """A combination: truth, messages, publishers, clock, properties of the site, and the names of the defects.

    sensors : topics of the sensors; limits : highest level for which the site has limits, as a word
    expects : True if `expected_topics` of the node are the sensors, False if `optional_topics` are
    answers_fail : start and end (s) of the time in which answers to sources on the slope fail, None if none fails
    restart_at : time (s) at which the node is ended and started again, with its decision log and its terrain
    scan_period : `evidence.scan_period_s` of the site file (s); None if the site file does not state it
    stays : True if a sensor that scans by turns stops at the harmless part of its scan
    graces : pairs of a start (s) and a duration (s) in which any level is accepted, plus the time of a decision
    """

    truth: Truth
    sends: tuple[Send, ...]
    speakers: tuple[Speaker, ...]
    sensors: tuple[str, ...]
    limits: str
    expects: bool
    clock: ClockRule = ClockRule()
    answers_fail: tuple[float, float] | None = None
    restart_at: float = np.inf
    scan_period: float | None = None
    stays: bool = False
    graces: tuple[tuple[float, float], ...] = ()
    defects: tuple[str, ...] = ()

    def with_defect(self, name: str, **changes: Any) -> "Plan":
        """Return the plan with one more defect; changes : fields to replace."""
        return self._replace(defects=(*self.defects, name), **changes)
