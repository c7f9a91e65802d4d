"""Refuse messages with wrong time stamps: negative, older than the topic's last stamp, too old, or in the future."""

import math
import threading
from collections.abc import Mapping

from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.stamps import SECOND


class StampGuards:
    """The last stamp of each topic: messages with an older stamp, or with a stamp from the future, are refused.

    If stamps from the future were accepted, one damaged stamp would block a topic for all messages that follow. The
    stamps are kept while the node is not active, because a program may publish an old message when the node is
    activated again. Any thread may call.
    """

    def __init__(self, most_ahead: float, most_behind: Mapping[str, float] | None = None) -> None:
        """Begin without stamps.

        most_ahead : time (s) that a stamp may be ahead of the clock
        most_behind : time (s) that a stamp may be behind the clock, by topic; other topics have no such limit
        """
        self._last: dict[str, int] = {}
        self._most_ahead, self._most_behind, self._is_continued = most_ahead, dict(most_behind or {}), False
        self._changing = threading.Lock()

    def continue_from(self, stamps: Mapping[str, int]) -> None:
        """Continue with the stamps (ns) of each topic from before a restart, unless a topic has a later stamp.

        A stamp that is in the future at the first check shows that the clock went back during the restart. `check` then
        lowers the stamps as `clock_went_back` does.
        """
        for topic, stamp_ns in stamps.items():
            self.note(topic, stamp_ns)
        self._is_continued = True

    @property
    def stamps(self) -> dict[str, int]:
        """The last stamp (ns) of each topic."""
        with self._changing:
            return dict(self._last)

    def check(self, topic: str, stamp_ns: int, now_ns: int) -> None:
        """Raise MessageRefused if a stamp (ns) is negative, older than the topic's last, or too far from the clock.

        now_ns : current time (ns); 0 if the clock does not run yet, so that no stamp counts as ahead or behind
        """
        if stamp_ns < 0:
            raise MessageRefused(f"its stamp is negative, {stamp_ns / SECOND:.3f} s: set the stamp of its header")
        ahead = (stamp_ns - now_ns) / SECOND
        if now_ns > 0 and ahead > self._most_ahead:
            raise MessageRefused(
                f"its stamp is in the future, {ahead:.3f} s ahead of this clock; at most {self._most_ahead:g} s are "
                "allowed (most_ahead, clock_tolerance_s)"
            )
        if now_ns > 0 and -ahead > self._most_behind.get(topic, math.inf):
            raise MessageRefused(
                f"its stamp is {-ahead:.3f} s behind this clock; at most {self._most_behind[topic]:g} s are allowed on "
                f"{topic} (half of sources_max_age_s): set the clock of the computer that publishes it"
            )
        if self._is_continued and now_ns > 0:
            self._is_continued = False
            self.clock_went_back(now_ns)
        last = self._last.get(topic, stamp_ns)
        if stamp_ns < last:
            back = (last - stamp_ns) / SECOND
            raise MessageRefused(f"its stamp is {back:.3f} s older than the last message on {topic}")

    def note(self, topic: str, stamp_ns: int) -> None:
        """Note the stamp (ns) of an accepted message; older messages of the topic are then refused."""
        with self._changing:
            self._last[topic] = max(stamp_ns, self._last.get(topic, stamp_ns))

    def clock_went_back(self, now_ns: int) -> None:
        """Lower all stamps in the future to the current time (ns), because the clock went back.

        So messages with stamps from after the step are accepted, and older messages are still refused.
        """
        with self._changing:
            self._last = {topic: min(stamp_ns, now_ns) for topic, stamp_ns in self._last.items()}
