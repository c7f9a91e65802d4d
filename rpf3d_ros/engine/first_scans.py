"""Notice topics whose first scan is not complete: the node does not yet know all places that the sensor reports."""

from typing import NamedTuple

from rpf3d_core.alerts.time_units import ns_of, span
from rpf3d_ros.engine.source_topics import BY_HAND


class FirstScans:
    """The first and the last message of each topic since the start, a restart, a step back of the clock, or a pause.

    Both the stamps and a steady clock must show the whole period, because the clock of the stamps may jump ahead.
    After a pause that is longer than the period, or so long that the topic counted as silent, a scan begins again: the
    sensor has not reported every place within the period.

    period_s : time (s) within which a sensor reports every place again; None or 0 if each message has all places
    silent_s : time (s) after which a topic without messages counts as silent
    """

    def __init__(self, period_s: float | None, silent_s: float) -> None:
        self._period_s, self._period_ns = period_s or 0.0, ns_of(period_s or 0.0)
        self._longest_ns = min(self._period_ns, ns_of(silent_s))
        self._scans: dict[str, Scan] = {}

    def note(self, topic: str, stamp_ns: int, now_s: float) -> None:
        """Note a message that is answered; do nothing for topic `clicked_point`.

        stamp_ns : stamp of the message (ns); now_s : present time (s, steady clock)
        """
        if topic == BY_HAND or not self._period_ns:
            return
        known = self._scans.get(topic)
        pause_ns = 0 if known is None else stamp_ns - known.last_ns
        if known is None or pause_ns > self._longest_ns:
            self._scans[topic] = Scan(first_ns=stamp_ns, first_s=now_s, last_ns=stamp_ns, paused_ns=pause_ns)
        else:
            received_ns = min(stamp_ns - known.first_ns, ns_of(now_s - known.first_s))
            self._scans[topic] = known._replace(
                last_ns=max(known.last_ns, stamp_ns), received_ns=max(known.received_ns, received_ns)
            )

    def faults(self) -> tuple[str, ...]:
        """Return a fault for each topic that has not been received for the whole period."""
        return tuple(
            f"the first scan of {topic}{_after(scan)} is not complete: the topic has been received for "
            f"{span(scan.received_ns)} of {self._period_s:g} s (evidence.scan_period_s)"
            for topic, scan in self._scans.items()
            if scan.received_ns < self._period_ns
        )

    def restart(self) -> None:
        """Forget all stamps, because they are invalid or messages were missed: the first scan begins again."""
        self._scans.clear()


class Scan(NamedTuple):
    """The messages of a topic since its first scan began.

    first_ns, last_ns : first and last stamp (ns); first_s : when the first message was answered (s, steady clock)
    received_ns : time (ns) for which the topic has been received, the shorter one by both clocks
    paused_ns : pause (ns) of the topic before the first message; 0 if there was none
    """

    first_ns: int
    first_s: float
    last_ns: int
    received_ns: int = 0
    paused_ns: int = 0


def _after(scan: Scan) -> str:
    return f" after a pause of {span(scan.paused_ns)}" if scan.paused_ns else ""
