"""Notice topics whose first scan is not complete: the node does not yet know all places that the sensor reports."""

import threading
from typing import NamedTuple

from rpf3d_core.alerts.time_units import ns_of, span
from rpf3d_ros.alerts.source_topics import BY_HAND

PAUSES = "; if the sensor pauses so long in each scan, state a longer time"
"""End of the sentence of a fault after a pause: what to do if a scan takes longer than the site file states."""


class FirstScans:
    """The first scan of each topic since the start, a restart, a step back of the clock, or a pause.

    A scan is complete when messages have been received for the whole period, and a message from after the period has
    been answered. Both the stamps and a steady clock must show the period, because the clock of the stamps may jump
    ahead.
    After a pause that is longer than the period, or so long that the topic counted as silent, a scan begins again: the
    sensor has not reported every place within the period. Any thread may call.

    period_s : time (s) within which a sensor reports every place again; None or 0 if each message has all places
    silent_s : time (s) after which a topic without messages counts as silent
    """

    def __init__(self, period_s: float | None, silent_s: float) -> None:
        self._period_s, self._period_ns = period_s or 0.0, ns_of(period_s or 0.0)
        self._longest_ns = min(self._period_ns, ns_of(silent_s))
        self._scans: dict[str, Scan] = {}
        self._lock = threading.Lock()

    def received(self, topic: str, stamp_ns: int, now_s: float) -> None:
        """Note a received message, before it is answered; do nothing for topic `clicked_point`, or without a period.

        stamp_ns : stamp of the message (ns); now_s : current time (s, steady clock)
        """
        if topic == BY_HAND or not self._period_ns:
            return
        with self._lock:
            known = self._scans.get(topic)
            pause_ns = 0 if known is None else stamp_ns - known.last_ns
            if known is None or pause_ns > self._longest_ns:
                self._scans[topic] = Scan(first_ns=stamp_ns, first_s=now_s, last_ns=stamp_ns, paused_ns=pause_ns)
                return
            received_ns = min(stamp_ns - known.first_ns, ns_of(now_s - known.first_s))
            if known.whole_ns is None and received_ns >= self._period_ns:
                known = known._replace(whole_ns=stamp_ns)
            self._scans[topic] = known._replace(
                last_ns=max(known.last_ns, stamp_ns), received_ns=max(known.received_ns, received_ns)
            )

    def answered(self, topic: str, stamp_ns: int) -> None:
        """Note the answer to a message; do nothing if the message is from before the end of the first period.

        stamp_ns : stamp of the message (ns)
        """
        with self._lock:
            scan = self._scans.get(topic)
            if scan is not None and scan.whole_ns is not None and stamp_ns >= scan.whole_ns:
                self._scans[topic] = scan._replace(is_answered=True)

    def is_complete(self, topic: str) -> bool:
        """Return True if the first scan of a topic is complete, or if each of its messages has all places."""
        with self._lock:
            scan = self._scans.get(topic)
        return not self._period_ns or topic == BY_HAND or (scan is not None and scan.is_answered)

    def faults(self) -> tuple[str, ...]:
        """Return the sentence of a fault for each topic whose first scan has begun and is not complete."""
        with self._lock:
            return tuple(self._fault_of(topic, scan) for topic, scan in self._scans.items() if not scan.is_answered)

    def _fault_of(self, topic: str, scan: "Scan") -> str:
        after = f" after a pause of {span(scan.paused_ns)}" if scan.paused_ns else ""
        if scan.whole_ns is not None:
            return f"the first scan of {topic}{after} is not complete: its sources have no answer yet"
        return (
            f"the first scan of {topic}{after} is not complete: the topic has been received for "
            f"{span(scan.received_ns)} of {self._period_s:g} s (evidence.scan_period_s){PAUSES if after else ''}"
        )

    def restart(self) -> None:
        """Forget all stamps, because they are invalid or messages were missed: the first scan begins again."""
        with self._lock:
            self._scans.clear()


class Scan(NamedTuple):
    """The messages of a topic since its first scan began.

    first_ns, last_ns : first and last stamp (ns); first_s : when the first message was received (s, steady clock)
    received_ns : time (ns) for which the topic has been received: the shorter of the times by stamps and steady clock
    paused_ns : pause (ns) of the topic before the first message; 0 if there was none
    whole_ns : stamp (ns) of the first message after the whole period; None as long as there is none
    is_answered : True if the message with the stamp `whole_ns`, or a later message, is answered
    """

    first_ns: int
    first_s: float
    last_ns: int
    received_ns: int = 0
    paused_ns: int = 0
    whole_ns: int | None = None
    is_answered: bool = False
