"""The queue of sources that wait for an answer: the newest message of each wall; dropped messages are counted.

Any thread may put triggers in the queue; `put` is quick. The thread that flies rocks takes them, wall after wall.
"""

from collections.abc import Hashable

import numpy as np

from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.source_topics import BY_HAND

NO_SOURCES = "no sources"
"""Replaces the square in the region of a message without sources, because such a message applies to all walls."""


class WaitingSources:
    """Waiting triggers (the sources of one message each), one for each region: a new trigger replaces the old trigger.

    After a flood of messages about one wall, only the newest message is answered; triggers of other walls stay.
    """

    def __init__(self, region_size: float, most: int) -> None:
        """Begin with an empty queue.

        region_size : side of the square regions (m); most : largest number of triggers that may wait
        """
        self._size, self._most = region_size, most
        self._waiting: dict[Hashable, Trigger] = {}
        self._served: dict[Hashable, int] = {}
        self._turn = 0
        self.dropped = 0

    def put(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in the queue; if too many then wait, remove and return the one that has waited longest.

        The trigger replaces the waiting trigger of its region. Replaced and removed triggers count in `dropped`.
        """
        region = self.region_of(trigger)
        if self._waiting.pop(region, None) is not None:
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

    def region_of(self, trigger: Trigger) -> Hashable:
        """Return the region of a trigger: its topic, and the square in plan that contains the middle of its sources.

        The topic is part of the region, because a message of `clicked_point` must not hide a radar's sources. Each
        clicked place is a separate region, because a second clicked source does not replace the first source.
        """
        if not len(trigger.positions):
            return trigger.topic, NO_SOURCES
        if trigger.topic == BY_HAND:
            return trigger.topic, *np.round(trigger.positions[0], 2).tolist()
        column, row = np.floor(np.mean(trigger.positions[:, :2], axis=0) / self._size).astype(int).tolist()
        return trigger.topic, column, row
