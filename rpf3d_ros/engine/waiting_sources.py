"""The queue of sources that wait for an answer: the newest message of each region; dropped messages are counted.

`put` is quick. The thread that flies rocks takes the triggers from the queue; the regions take turns.
"""

import numpy as np

from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.alerts.regions import Region, unreported_region
from rpf3d_ros.alerts.source_topics import BY_HAND


class WaitingSources:
    """Waiting triggers (the sources of one message each); a new trigger replaces triggers whose regions it contains.

    After a flood of messages about one wall, only the newest message is answered; triggers of other walls stay.
    """

    def __init__(self, region_size: float, most: int, are_whole: bool = False) -> None:
        """Begin with an empty queue.

        region_size : side of the square regions (m); most : largest number of triggers that may wait
        are_whole : True if each trigger of a sensor has all sources of its topic, so that it replaces all earlier
            triggers of the topic
        """
        self._size, self._most, self._are_whole = region_size, most, are_whole
        self._waiting: dict[Region, Trigger] = {}
        self._served: list[Region] = []  # regions whose triggers were taken, the latest last
        self.dropped = 0

    def put(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in the queue; if more than `most` then wait, remove and return the longest-waiting trigger.

        Return None if no trigger must be removed. The new trigger replaces the waiting triggers whose places are all in
        its own region. A trigger with a source at another place stays, because nothing newer is known about this
        source. Replaced and removed triggers count in `dropped`. Places that are no longer reported do not count in
        `most`: there is at most one trigger of them for each topic.
        """
        region = self.region_of(trigger)
        for replaced in [waiting for waiting in self._waiting if waiting <= region]:
            del self._waiting[replaced]
            self.dropped += 1
        self._waiting[region] = trigger
        counted = [each for each, one in self._waiting.items() if not one.is_unreported]
        if len(counted) <= self._most:
            return None
        self.dropped += 1
        return self._waiting.pop(counted[0])

    def take(self) -> Trigger | None:
        """Remove and return the trigger with the place that was answered longest ago; None if no trigger waits.

        A place is a square in plan or a clicked place (`region_of`). Triggers with a place that was never answered come
        first; if several triggers have the same rank, the newest comes first.
        """
        if not self._waiting:
            return None
        newest_first = reversed(self._waiting)
        region = min(newest_first, key=self._last_turn)
        self._served = [*(served for served in self._served if served != region), region][-2 * self._most :]
        return self._waiting.pop(region)

    def remove(self, region: Region) -> None:
        """Remove the waiting trigger of a region, if there is one, without counting it as dropped."""
        self._waiting.pop(region, None)

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
        if trigger.is_unreported:
            return unreported_region(trigger.topic)
        if self._are_whole and trigger.topic != BY_HAND:
            return frozenset({(trigger.topic,)})
        if trigger.topic == BY_HAND:
            places = np.round(trigger.positions[:1], 2)
        else:
            places = np.floor(trigger.positions[:, :2] / self._size)
        return frozenset((trigger.topic, *place) for place in places.tolist()) or frozenset({(trigger.topic,)})

    def _last_turn(self, region: Region) -> int:
        """Return the number of the turn in which the longest-waiting place of a region was last answered.

        A turn is one call of `take` that returned a trigger; later turns have larger numbers. The result is 0 if a
        place of the region has had no turn, or if its last turn is no longer in the list of recent turns.
        """
        for turn in range(len(self._served), 0, -1):
            region -= self._served[turn - 1]
            if not region:
                return turn
        return 0
