"""Notice topics whose first scan is not complete: the node does not yet know all places that the sensor reports."""

from rpf3d_core.alerts.time_units import ns_of, span
from rpf3d_ros.engine.source_topics import BY_HAND


class FirstScans:
    """The first and the last message of each topic since the start, a restart, or a step back of the clock.

    Both the stamps and a steady clock must show the whole period, because the clock of the stamps may jump ahead.

    period_s : time (s) within which a sensor reports every place again; None or 0 if each message has all places
    """

    def __init__(self, period_s: float | None) -> None:
        self._period_s, self._period_ns = period_s or 0.0, ns_of(period_s or 0.0)
        self._first: dict[str, tuple[int, float]] = {}
        self._received_ns: dict[str, int] = {}

    def note(self, topic: str, stamp_ns: int, now_s: float) -> None:
        """Note a message that is answered; do nothing for topic `clicked_point`.

        stamp_ns : stamp of the message (ns); now_s : present time (s, steady clock)
        """
        if topic != BY_HAND:
            first_ns, first_s = self._first.setdefault(topic, (stamp_ns, now_s))
            received_ns = min(stamp_ns - first_ns, ns_of(now_s - first_s))
            self._received_ns[topic] = max(self._received_ns.get(topic, 0), received_ns)

    def faults(self) -> tuple[str, ...]:
        """Return a fault for each topic that has not been received for the whole period."""
        return tuple(
            f"the first scan of {topic} is not complete: the topic has been received for {span(received_ns)} of "
            f"{self._period_s:g} s (evidence.scan_period_s)"
            for topic, received_ns in self._received_ns.items()
            if received_ns < self._period_ns
        )

    def restart(self) -> None:
        """Forget all stamps, because they are invalid or messages were missed: the first scan begins again."""
        self._first.clear()
        self._received_ns.clear()
