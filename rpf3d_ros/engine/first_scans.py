"""Notice topics whose first scan is not complete: the node does not yet know all places that the sensor reports."""

from rpf3d_core.alerts.time_units import ns_of, span
from rpf3d_ros.engine.source_topics import BY_HAND


class FirstScans:
    """The first and the last stamp of each topic since the start, a restart, or a step back of the clock.

    period_s : time (s) within which a sensor reports every place again; None or 0 if each message has all places
    """

    def __init__(self, period_s: float | None) -> None:
        self._period_s, self._period_ns = period_s or 0.0, ns_of(period_s or 0.0)
        self._stamps: dict[str, tuple[int, int]] = {}

    def note(self, topic: str, stamp_ns: int) -> None:
        """Note the stamp (ns) of a message that is answered; do nothing for topic `clicked_point`."""
        if topic != BY_HAND:
            first, last = self._stamps.get(topic, (stamp_ns, stamp_ns))
            self._stamps[topic] = min(first, stamp_ns), max(last, stamp_ns)

    def faults(self) -> tuple[str, ...]:
        """Return a fault for each topic that has not been received for the whole period."""
        return tuple(
            f"the first scan of {topic} is not complete: the topic has been received for {span(last - first)} of "
            f"{self._period_s:g} s (evidence.scan_period_s)"
            for topic, (first, last) in self._stamps.items()
            if last - first < self._period_ns
        )

    def restart(self) -> None:
        """Forget all stamps, because they are invalid or messages were missed: the first scan begins again."""
        self._stamps.clear()
