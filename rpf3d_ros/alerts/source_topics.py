"""Notice topics of sources (one for each sensor) that fall silent: it is then unknown what happens at their walls."""

from collections.abc import Sequence

from rpf3d_core.alerts.time_units import span

BY_HAND = "clicked_point"
"""Topic of clicked sources: a click by a person is a single event, so no further message is expected."""

REMOVED = "if its sensor was removed: clean up the node, remove the topic from its parameters, and configure the node"
"""Advice in the fault of a silent topic: how a person ends the fault if the sensor will not publish again."""

OPTIONAL = "start its publisher, or name the topic in optional_topics"
"""Advice in the fault of a topic that must publish and never has."""

ONLY_CLICKS = "no sensor has reported, so only clicked sources are known: start the publishers of source topics"
"""Fault of a node with topics of sensors that has received clicks only: a click says nothing about other walls."""

ANY_STAMP = -1
"""A time (ns) before every stamp, which stands for a topic without a known stamp."""


class SourceTopics:
    """The stamp of the last message of each topic of sources; a topic that has published must continue to publish.

    expected : topics that must publish even if they have never published
    heard : topics that had published before a restart, and must publish again
    has_sensors : True if the node subscribes to topics of sensors; messages of topic `clicked_point` alone are then not
        enough evidence
    scan_ns : time (ns) within which a sensor reports every place again; 0 if each message has all places
    """

    def __init__(
        self, expected: Sequence[str] = (), has_sensors: bool = False, heard: Sequence[str] = (), scan_ns: int = 0
    ) -> None:  # fmt: skip
        self._expected, self._has_sensors, self._scan_ns = tuple(expected), has_sensors, scan_ns
        self._last: dict[str, int] = {}
        # Topics from before a restart, or before all was forgotten: a message counts only after this stamp.
        self._heard = dict.fromkeys(heard, ANY_STAMP)
        self._missed: dict[str, int] = {}  # when messages of a topic were lost on their way (ns)
        self._is_new_time = True  # the clock may have gone back, also during a restart
        self._lost_click: int | None = None

    def miss(self, topic: str, now_ns: int) -> None:
        """Record that messages of a topic were lost before they could be read; now_ns : current time (ns).

        The lost messages may have reported danger at any wall, so a later message does not replace them. The loss is a
        fault until the lost sources would be too old, and at least for the time `scan_ns`, within which the sensor
        reports every place again. For lost clicks, only the age counts. `forget` and `lose` do not end the fault.
        """
        self._missed[topic] = max(now_ns, self._missed.get(topic, now_ns))

    @property
    def missed(self) -> dict[str, int]:
        """The time (ns) at which messages were last lost, by topic; `silent` drops losses that are too old to count."""
        return dict(self._missed)

    @property
    def heard(self) -> tuple[str, ...]:
        """The topics that have published, also before a restart, sorted."""
        return tuple(sorted({*self._heard, *self._last}))

    def note(self, topic: str, stamp_ns: int) -> None:
        """Note the stamp (ns) of a message, with or without sources; do nothing for topic `clicked_point`.

        A message that is answered again is not newer than the last message of its topic, so the call changes nothing.
        After `lose`, do nothing for a stamp that is not later than the last stamp before the error.
        """
        if topic != BY_HAND and stamp_ns > self._heard.get(topic, ANY_STAMP):
            self._last[topic] = max(stamp_ns, self._last.get(topic, stamp_ns))

    def silent(self, oldest_ns: int, now_ns: int) -> tuple[str, ...]:
        """Return a sentence for each silent topic: its last message is too old, or the topic has yet to publish.

        The result also has a sentence for each topic with lost messages, a sentence for a clicked source that was lost
        by an error, and a sentence if the node has sensors but has received messages of topic `clicked_point` only.

        oldest_ns : stamp (ns) before which a message is too old; now_ns : current time (ns)
        """
        fell_silent = tuple(
            f"nothing has been received on {topic} for {span(max(now_ns - stamp, 0))}; {REMOVED}"
            for topic, stamp in self._last.items()
            if stamp < oldest_ns
        )
        never = [topic for topic in self._expected if topic not in self._last]
        again = [topic for topic in self._heard if topic not in (*self._last, *never)]
        return (
            *fell_silent,
            *(f"nothing has been received on {topic}, which must publish ({OPTIONAL})" for topic in never),
            *(f"nothing has been received on {topic} since the start or the last reset; {REMOVED}" for topic in again),
            *self._missing(oldest_ns, now_ns),
            *self._click_lost(oldest_ns, now_ns),
            *((ONLY_CLICKS,) if self._has_sensors and not (self._last or never or again) else ()),
        )

    @property
    def oldest_ns(self) -> int | None:
        """The oldest of the topics' last stamps (ns): this topic will be silent first; None if no topic has a stamp."""
        return min(self._last.values(), default=None)

    def forget(self) -> None:
        """Forget all stamps, because the stamps are invalid or the node was not subscribed for some time.

        Every topic that has published must then publish again: a sensor that had fallen silent still counts as silent.
        """
        self._heard = dict.fromkeys((*self._heard, *self._last), ANY_STAMP)
        self._last.clear()
        self._lost_click = None
        self._is_new_time = True

    def lose(self, click_ns: int | None = None) -> None:
        """Record that an error of the program lost the evidence of all messages; every topic must publish again.

        A message from before the error may be answered again, although other messages of its topic are lost. Therefore
        only messages with later stamps count. A person does not repeat a message of topic `clicked_point`, so its lost
        source is a fault until the source would be too old.

        click_ns : stamp of the newest lost message of `clicked_point` (ns); None if no such message was lost
        """
        self._heard.update(self._last)
        self._last.clear()
        self._lost_click = self._lost_click if click_ns is None else click_ns

    def _missing(self, oldest_ns: int, now_ns: int) -> tuple[str, ...]:
        """Return a fault for each topic with lost messages whose sources would not be too old yet; forget older losses.

        After a restart or `forget`, a loss with a time in the future happened before the clock went back. The loss then
        counts as if it happened at `now_ns`. In all other cases the clock may be wrong for a moment only, so the time
        of the loss stays.

        oldest_ns : time (ns) before which sources are too old; now_ns : current time (ns)
        """
        latest_ns = now_ns if self._is_new_time else max((now_ns, *self._missed.values()))
        self._is_new_time = False
        of_scan_ns = min(oldest_ns, now_ns - self._scan_ns)  # a click is no part of a scan
        self._missed = {
            topic: min(at, latest_ns) for topic, at in self._missed.items()
            if at >= (oldest_ns if topic == BY_HAND else of_scan_ns)
        }  # fmt: skip
        ago = {topic: span(max(now_ns - missed_ns, 0)) for topic, missed_ns in self._missed.items()}
        return tuple(
            f"a clicked source was forgotten {since} ago, so click it again; this fault ends after sources_max_age_s"
            if topic == BY_HAND else f"messages on {topic} were lost {since} ago, before they could be read"
            for topic, since in ago.items()
        )  # fmt: skip

    def _click_lost(self, oldest_ns: int, now_ns: int) -> tuple[str, ...]:
        """Return the fault of a clicked source that was lost by an error; empty if the source would be too old now.

        oldest_ns, now_ns : as in `_missing`
        """
        if self._lost_click is None or self._lost_click < oldest_ns:
            return ()
        return (f"a source clicked {span(max(now_ns - self._lost_click, 0))} ago was lost because of an error",)
