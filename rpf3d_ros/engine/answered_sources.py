"""Keep the last trigger of each region until the trigger is too old, so that all regions can be answered again.

This is needed when the terrain or an area changes. `WaitingSources.region_of` defines the regions.
"""

from collections.abc import Hashable

from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.messages.stamps import SECOND

NEVER = 2**63
"""A time (ns) after every stamp."""


class AnsweredSources:
    """The last trigger (sources of one message) of each region, to be answered again when terrain or areas change."""

    def __init__(self, age_s: float = 0.0, most: int = 0) -> None:
        """Keep at most `most` triggers of reported sources; with 0, none is ever kept.

        Triggers of places that are no longer reported are kept in addition; they do not count in `most`.

        age_s : largest age (s), relative to the newest trigger, of a trigger that is answered again
        """
        self._age, self._most = round(age_s * SECOND), most
        self._last: dict[Hashable, Trigger] = {}

    def note(self, region: Hashable, trigger: Trigger) -> None:
        """Keep a trigger as the last trigger of its region; if too many are kept, forget the trigger noted first.

        A trigger without sources is not kept, but removes the triggers of its topic that have an older stamp. Places
        that are no longer reported stay until `end`.
        """
        if not len(trigger.positions):
            self._last = {
                each: one for each, one in self._last.items()
                if one.stamp_ns >= trigger.stamp_ns or trigger.topic != one.topic or one.is_unreported
            }  # fmt: skip
            return
        self._last.pop(region, None)
        self._last[region] = trigger
        counted = [each for each, one in self._last.items() if not one.is_unreported]
        if len(counted) > self._most:
            del self._last[counted[0]]

    def others(self, latest: Trigger | None) -> list[Trigger]:
        """Return the kept triggers except `latest`, in the order in which they were noted.

        A trigger is left out if its stamp is more than `age_s` before the stamp of `latest`, the newest trigger. Places
        that are no longer reported have no age limit; if `latest` is None, only these are returned.
        """
        oldest_ns = NEVER if latest is None else latest.stamp_ns - self._age
        return [
            one for one in self._last.values()
            if one is not latest and (one.is_unreported or one.stamp_ns >= oldest_ns)
        ]  # fmt: skip

    def end(self, region: Hashable) -> None:
        """Forget the trigger of a region, if there is one."""
        self._last.pop(region, None)

    def holds(self, trigger: Trigger) -> bool:
        """True if a trigger is still the last trigger of its region."""
        return any(one is trigger for one in self._last.values())

    def clear(self) -> None:
        """Forget all triggers."""
        self._last.clear()
