"""The queue of sources that wait for an answer: the newest message of each region; dropped messages are counted.

Any thread may put triggers in the queue; `put` is quick. The thread that flies rocks takes them, region after region.
"""

from collections.abc import Hashable
from typing import NamedTuple

import numpy as np

from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.source_topics import BY_HAND


class Region(NamedTuple):
    """The part of the pit that the sources of a message lie in.

    topic : the topic of the message; squares : column and row in plan of each square that has a source; none if the
        message has no sources
    """

    topic: str
    squares: frozenset[tuple[float, ...]]

    def includes(self, other: "Region") -> bool:
        """True if a message about this region has news of every source in the other region.

        A message without sources is in no square, and only a further message without sources replaces it.
        """
        return self == other or (self.topic == other.topic and bool(other.squares) and other.squares <= self.squares)


class WaitingSources:
    """Waiting triggers (the sources of one message each): a new trigger replaces those in regions that it includes.

    After a flood of messages about one wall, only the newest message is answered; triggers of other walls stay.
    """

    def __init__(self, region_size: float, most: int) -> None:
        """Begin with an empty queue.

        region_size : side of the square regions (m); most : largest number of triggers that may wait
        """
        self._size, self._most = region_size, most
        self._waiting: dict[Region, Trigger] = {}
        self._served: dict[Hashable, int] = {}
        self._turn = 0
        self.dropped = 0

    def put(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in the queue; if too many then wait, remove and return the one that has waited longest.

        The trigger replaces the waiting triggers in regions that its own region includes. A trigger with a source in
        another square stays, because nothing newer is known about this source. Replaced and removed triggers count in
        `dropped`.
        """
        region = self.region_of(trigger)
        for replaced in [waiting for waiting in self._waiting if region.includes(waiting)]:
            del self._waiting[replaced]
            self.dropped += 1
        self._waiting[region] = trigger
        if len(self._waiting) <= self._most:
            return None
        self.dropped += 1
        return self._waiting.pop(next(iter(self._waiting)))

    def take(self) -> Trigger | None:
        """Remove and return the trigger of the region whose last turn is longest ago; None if nothing waits.

        Regions without a turn so far come first; among these, the newest trigger.
        """
        if not self._waiting:
            return None
        newest_first = reversed(self._waiting)
        region = min(newest_first, key=lambda region: self._served.get(region, 0))
        self._turn += 1
        self._served[region] = self._turn
        for forgotten in sorted(self._served, key=lambda each: self._served[each])[: -2 * self._most]:
            del self._served[forgotten]
        return self._waiting.pop(region)

    def clear(self) -> None:
        """Remove all waiting triggers without counting them as dropped."""
        self._waiting.clear()

    def __len__(self) -> int:
        return len(self._waiting)

    def region_of(self, trigger: Trigger) -> Region:
        """Return the region of a trigger: its topic, and the squares in plan that contain its sources.

        The topic is part of the region, because a message of `clicked_point` must not hide a radar's sources. Each
        clicked place is a separate region, because a second clicked source does not replace the first source.
        """
        if trigger.topic == BY_HAND:
            squares = np.round(trigger.positions[:1], 2)
        else:
            squares = np.unique(np.floor(trigger.positions[:, :2] / self._size), axis=0)
        return Region(trigger.topic, frozenset(map(tuple, squares.tolist())))
