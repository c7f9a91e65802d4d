"""Refuse messages with wrong time stamps: older than the last stamp of the topic, or in the future."""

from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.stamps import SECOND


class StampGuards:
    """The last stamp of each topic: messages with an older stamp, or with a stamp from the future, are refused.

    If stamps from the future were accepted, one damaged stamp would block a topic for all messages that follow. The
    stamps are kept while the node is not active, because a program may publish an old message when the node is
    activated again.
    """

    def __init__(self, most_ahead: float) -> None:
        """Begin without stamps.

        most_ahead : time (s) that a stamp may be ahead of the clock
        """
        self._last: dict[str, int] = {}
        self._most_ahead = most_ahead

    def check(self, topic: str, stamp_ns: int, now_ns: int) -> None:
        """Raise MessageRefused if a stamp (ns) is older than the topic's last stamp, or too far ahead of the clock.

        now_ns : present time (ns); 0 if the clock does not run yet, so that no stamp counts as ahead
        """
        ahead = (stamp_ns - now_ns) / SECOND
        if now_ns > 0 and ahead > self._most_ahead:
            raise MessageRefused(
                f"its stamp is in the future, {ahead:.3f} s ahead of this clock; at most {self._most_ahead:g} s are "
                "allowed (most_ahead, clock_tolerance_s)"
            )
        last = self._last.get(topic, stamp_ns)
        if stamp_ns < last:
            back = (last - stamp_ns) / SECOND
            raise MessageRefused(f"its stamp is {back:.3f} s older than the last message on {topic}")

    def note(self, topic: str, stamp_ns: int) -> None:
        """Note the stamp (ns) of an accepted message; older messages of the topic are then refused."""
        self._last[topic] = max(stamp_ns, self._last.get(topic, stamp_ns))

    def reset(self) -> None:
        """Forget all stamps, because the clock went back."""
        self._last.clear()
