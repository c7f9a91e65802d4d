"""Keep the places of sources that messages of a topic reported, and find the places that later messages do not report.

A sensor may report wall after wall, each in its own message. A place that is missing in a message then is either gone
or merely not part of this message. `evidence.scan_period_s` of the site file decides (docs/explanation/alerts.md):

- A number: a place counts as a source until its topic has not reported it for this time.
- Absent: a place that its topic no longer reports is *unreported*. Unreported places are simulated like sources, but
  their answer can only be a fault (`unreported_evidence.py`).

Several messages of a topic with the same stamp count as one message: a sensor may divide a scan into parts, which may
overlap. So a part never replaces a place of another part. The sources to simulate after a further part are those of all
parts until then. Their stamp is one nanosecond later for each further message with the same stamp, so that each answer
belongs to one message.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from rpf3d_core.alerts.time_units import NS, ns_of
from rpf3d_core.live.triggers import Trigger, trigger_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.alerts.source_topics import BY_HAND

MOST = 1000
"""Largest number of unreported places of a topic; of more places, the longest unreported places are forgotten."""

MOST_IN_A_SCAN = 20_000
"""Largest number of places of earlier messages of a topic that count as sources together with a new message."""

KEPT_S = 3600.0
"""Time (s) for which harmless unreported places are kept, because later terrain or areas may make them dangerous."""

REMEMBERED = 300
"""Largest number of places of all topics that are remembered for the next start, to limit the size of its file."""

NEAREST = 1.0
"""Smallest distance (m) within which two reports are about the same place; `position_spread` if that is larger."""


@dataclass(frozen=True, eq=False)
class Places:
    """N places of sources, as in `Trigger`, and when each was last reported.

    positions : (N, 3) m, map frame; velocities : (N, 3) m/s; diameters : (N,) m, NaN where unknown
    at_ns : (N,) stamp of the last message with the place (ns); 0 if it is from before the start of the node
    at_s : (N,) when this message was received (s, steady clock). For places from before the start: -infinite without a
        scan period, the time of the start with a scan period
    """

    positions: FloatArray
    velocities: FloatArray
    diameters: FloatArray
    at_ns: np.ndarray
    at_s: FloatArray

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.positions)

    def only(self, chosen: np.ndarray) -> "Places":
        """Return the chosen places; chosen : (N,) True for each place to return, or a slice."""
        return Places(
            self.positions[chosen], self.velocities[chosen], self.diameters[chosen], self.at_ns[chosen],
            self.at_s[chosen],
        )  # fmt: skip

    def and_also(self, others: "Places") -> "Places":
        """Return these places followed by others."""
        return Places(
            np.concatenate([self.positions, others.positions]), np.concatenate([self.velocities, others.velocities]),
            np.concatenate([self.diameters, others.diameters]), np.concatenate([self.at_ns, others.at_ns]),
            np.concatenate([self.at_s, others.at_s]),
        )  # fmt: skip

    def younger_than(self, period_ns: int, stamp_ns: int, now_s: float) -> "Places":
        """Return the places that were reported within a period (ns), by their stamps or by a steady clock.

        A clock that jumps ahead must not end a place.

        stamp_ns, now_s : current time, by the stamp of the newest message (ns) and by the steady clock (s)
        """
        return self.only((stamp_ns - self.at_ns <= period_ns) | (now_s - self.at_s <= period_ns / NS))

    def far_from(self, others: "Places", distance: float) -> "Places":
        """Return the places that are farther than a distance (m) from each of `others`."""
        return self.only(~is_near(self.positions, others.positions, distance))

    def not_in(self, others: "Places") -> "Places":
        """Return the places that `others` do not have with equal position, velocity and diameter."""
        if not len(self) or not len(others):
            return self
        known = {bytes(row + 0.0) for row in others.rows}  # -0.0 becomes 0.0
        return self.only(np.array([bytes(row + 0.0) not in known for row in self.rows], dtype=bool))

    @property
    def rows(self) -> np.ndarray:
        """The rows (N, 7): position x, y, z (m), velocity x, y, z (m/s), and diameter (m), NaN where unknown."""
        return np.column_stack([self.positions, self.velocities, self.diameters])

    def trigger(self, stamp_ns: int, topic: str) -> Trigger:
        """Return the places as a trigger; without diameters if none is known. stamp_ns : stamp of the trigger (ns)."""
        diameters = None if bool(np.isnan(self.diameters).all()) else self.diameters
        return trigger_of(self.positions, self.velocities, diameters, stamp_ns, topic)


NOWHERE = Places(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0, dtype=np.int64), np.empty(0))
"""No places."""


class TopicPlaces(NamedTuple):
    """The places of a topic.

    reported : places of the last message and of earlier messages with its stamp; with a scan period, also the places of
        earlier messages within this period
    unreported : places that the topic no longer reports; always empty with a scan period
    stamp_ns : stamp of the last message (ns), 0 if it is not valid any more because the clock went back or the node was
        not active; parts : number of further messages with this stamp
    is_due : True if the unreported places must be simulated again, because their last answer does not count
    before_empty : all places before the last message, if this message has no places. If a further part has some, the
        sensor has not reported that it sees no source
    empty_ns : stamp of the last message (ns) if it has no places, else 0; it stays when `stamp_ns` becomes 0
    was_suspect : True if the places of `before_empty` were, or might have been, dangerous
    """

    reported: Places = NOWHERE
    unreported: Places = NOWHERE
    stamp_ns: int = 0
    parts: int = 0
    is_due: bool = False
    before_empty: Places = NOWHERE
    empty_ns: int = 0
    was_suspect: bool = False


class Update(NamedTuple):
    """The result of `ReportedPlaces.received`: the sources and unreported places to simulate after a message.

    trigger : the sources to simulate: of the message, of earlier messages with the same stamp, and of earlier messages
        within the scan period; None for a message without sources that has the stamp of a message with sources
    unreported : unreported places to simulate; None if they are the same as before, or if there are none
    last_ns : latest time (ns) at which one of the unreported places was last reported; 0 if not known
    is_ended : True if the topic had unreported places, and has none now
    is_nothing : True if the message has no sources and a later stamp than the last message, so the topic sees no
        source at all; always False with a scan period
    too_many : text such as "more than 1,000 places" if places had to be forgotten that may be dangerous; "" otherwise
    are_parts : True if these are places of several messages with one stamp
    is_resumed : True if the last message had no sources, but was only a part of a scan: earlier places count again
    was_suspect : True if these earlier places were, or might have been, dangerous
    """

    trigger: Trigger | None
    unreported: Trigger | None = None
    last_ns: int = 0
    is_ended: bool = False
    is_nothing: bool = False
    too_many: str = ""
    are_parts: bool = False
    is_resumed: bool = False
    was_suspect: bool = False


class ReportedPlaces:
    """The places that each topic of sensors has reported. Only one thread may call, except `to_remember` (any thread).

    period_s : `evidence.scan_period_s` of the site file (s); None if it is absent
    distance : distance (m) within which two reports are about the same place; at least NEAREST is used
    """

    def __init__(self, period_s: float | None, distance: float) -> None:
        self._period_ns = None if period_s is None else ns_of(period_s)
        self._distance = max(distance, NEAREST)
        self._topics: Mapping[str, TopicPlaces] = {}

    def received(
        self, trigger: Trigger, now_s: float, is_suspect: bool = False, is_due: bool = False
    ) -> Update:  # fmt: skip
        """Store the places of a message of sources, and return what to simulate; clicked sources stay unchanged.

        now_s : current time (s, steady clock)
        is_suspect : True if earlier sources of the topic are, or may be, dangerous
        is_due : True if the unreported places must be simulated again
        """
        if trigger.topic == BY_HAND:
            return Update(trigger)
        if self._period_ns is not None:
            return self._of_scan(trigger, self._period_ns, now_s)
        known = self._topics.get(trigger.topic, TopicPlaces())
        return self._compared(trigger, now_s, known._replace(is_due=known.is_due or is_due), is_suspect)

    def _of_scan(self, trigger: Trigger, period_ns: int, now_s: float) -> Update:
        new, known = places_of(trigger, now_s), self._topics.get(trigger.topic, TopicPlaces())
        parts, before = _parts_and_before(known.reported, new, trigger.stamp_ns)
        before = before.younger_than(period_ns, trigger.stamp_ns, now_s) if period_ns else NOWHERE
        kept, too_many = _at_most(before.far_from(new, self._distance).and_also(parts))
        every, number = kept.and_also(new), _part_number(known, trigger.stamp_ns)
        self._note(trigger.topic, TopicPlaces(reported=every, stamp_ns=trigger.stamp_ns, parts=number))
        whole = every.trigger(trigger.stamp_ns + number, trigger.topic) if len(kept) or number else trigger
        return Update(whole, too_many=too_many, are_parts=len(parts) > MOST_IN_A_SCAN)

    def _compared(self, trigger: Trigger, now_s: float, known: TopicPlaces, is_suspect: bool) -> Update:
        new, topic, stamp_ns = places_of(trigger, now_s), trigger.topic, trigger.stamp_ns
        if not len(new):
            # Of two messages with one stamp, the message with sources counts; a second empty message changes nothing.
            if stamp_ns <= known.stamp_ns or (stamp_ns > 0 and stamp_ns == known.empty_ns):
                return Update(None if len(known.reported) else trigger)
            before = known.unreported.and_also(known.reported)
            empty = TopicPlaces(stamp_ns=stamp_ns, before_empty=before, empty_ns=stamp_ns, was_suspect=is_suspect)
            self._note(topic, empty)
            return Update(trigger, is_ended=bool(len(known.unreported)), is_nothing=True)
        number = _part_number(known, stamp_ns)
        is_resumed = stamp_ns > 0 and stamp_ns == known.empty_ns
        if is_resumed and len(known.before_empty):
            is_suspect = is_suspect or known.was_suspect
            known = known._replace(unreported=known.before_empty, is_due=True)
        parts, reported_before = NOWHERE, known.reported
        if number:
            parts, reported_before = _parts_and_before(known.reported, new, stamp_ns)
        parts, too_many = _at_most(parts)
        are_parts = bool(too_many)
        if number:
            new = parts.and_also(new)
            trigger = new.trigger(stamp_ns + number, topic)
        before, gone = known.unreported, reported_before.far_from(new, self._distance)
        if not is_suspect:
            before = before.younger_than(ns_of(KEPT_S), stamp_ns, now_s)
        unreported = before.far_from(new, self._distance).far_from(gone, self._distance).and_also(gone)
        is_same = not len(gone) and len(unreported) == len(known.unreported) and not known.is_due
        if len(unreported) > MOST:
            too_many = too_many or (f"more than {MOST:,} places" if is_suspect else "")
            unreported = unreported.only(slice(-MOST, None))
        self._note(topic, TopicPlaces(reported=new, unreported=unreported, stamp_ns=stamp_ns, parts=number))
        update = Update(
            trigger, too_many=too_many, are_parts=are_parts, is_resumed=is_resumed,
            was_suspect=is_resumed and known.was_suspect,
        )  # fmt: skip
        if is_same or not len(unreported):
            return update._replace(is_ended=not is_same and bool(len(known.unreported)))
        checked = replace(unreported.trigger(stamp_ns, topic), is_unreported=True)
        return update._replace(unreported=checked, last_ns=int(unreported.at_ns.max()))

    def _note(self, topic: str, places: TopicPlaces) -> None:
        self._topics = {**self._topics, topic: places}

    def restart(self) -> None:
        """Record that all answers were forgotten, because the clock went back or the node was not active.

        With a scan period, all places are forgotten, because their stamps are not valid: the first scan is then a fault
        (`FirstScans`). Otherwise, unreported places are simulated again after the next message of their topic.
        """
        if self._period_ns is not None:
            self._topics = {}
            return
        self._topics = {
            topic: places._replace(stamp_ns=0, is_due=bool(len(places.unreported)))
            for topic, places in self._topics.items()
        }

    def forget(self, topic: str, places: Collection[tuple[float, ...]]) -> bool:
        """Forget unreported places of a topic, because persons have acknowledged them; return True if none is left.

        Other unreported places of the topic are simulated again after its next message.

        places : their coordinates x, y, z (m)
        """
        known = self._topics.get(topic, TopicPlaces())
        left = np.array([tuple(place) not in places for place in known.unreported.positions.tolist()], dtype=bool)
        self._note(topic, known._replace(unreported=known.unreported.only(left), is_due=bool(left.any())))
        return not left.any()

    def to_remember(self, suspects: Collection[str], forgotten: Collection[str] = ()) -> dict[str, Any]:
        """Return the places to save for the next start, as plain values; {} if there are none.

        suspects : topics whose sources are, or may be, dangerous. Of other topics, no place is saved
        forgotten : topics of which places were forgotten, and which have a fault for that reason

        The result has for each topic the rows (x, y, z, velocity x, y, z, diameter), in m and m/s, rounded to two
        decimals. At most REMEMBERED places are saved. A topic whose places do not fit is left out, and is listed under
        the key "" together with the topics in `forgotten`.
        """
        saved: dict[str, Any] = {}
        room, lacking = REMEMBERED, list(forgotten)
        for topic, places in sorted(self._topics.items()):
            if topic not in suspects:
                continue
            rows = places.unreported.and_also(places.reported).rows
            if len(rows) > room:
                lacking.append(topic)
            elif len(rows):
                room -= len(rows)
                saved[topic] = [[None if np.isnan(x) else round(x, 2) for x in row] for row in rows.tolist()]
        return {**saved, **({"": sorted(set(lacking))} if lacking else {})}

    def restore(
        self, saved: Mapping[str, Any], topics: Collection[str], now_s: float
    ) -> tuple[list[str], list[str]]:  # fmt: skip
        """Continue from the places that `to_remember` saved before a restart, for topics that the node still has.

        With a scan period, the places count as sources for this period. Return the topics with places, and the topics
        whose places could not be saved; none of the latter with a scan period, because the first scan is a fault then.

        now_s : current time (s, steady clock)
        """
        for topic, rows in saved.items():
            if topic and topic in topics:
                values = np.array([[np.nan if x is None else x for x in row] for row in rows], dtype=float)
                at_ns = np.zeros(len(values), dtype=np.int64)
                at_s = np.full(len(values), -np.inf if self._period_ns is None else now_s)
                places = Places(values[:, :3], values[:, 3:6], values[:, 6], at_ns, at_s)
                self._note(topic, TopicPlaces(reported=places))
        lacking = saved.get("", ()) if self._period_ns is None else ()
        return list(self._topics), [topic for topic in lacking if topic in topics]


def _parts_and_before(known: Places, new: Places, stamp_ns: int) -> tuple[Places, Places]:
    """Return the places of earlier messages with the same stamp, and the places of messages from before.

    The former have only places that the new message does not repeat exactly, as it does if it is sent twice.

    known : the places of a topic so far; new : the places of its new message; stamp_ns : stamp of this message (ns)
    """
    is_part = (known.at_ns == stamp_ns) & (stamp_ns > 0)  # places from before a restart have the stamp 0
    return known.only(is_part).not_in(new), known.only(~is_part)


def _part_number(known: TopicPlaces, stamp_ns: int) -> int:
    """Return the number of a message among the messages with its stamp; 0 for the first one.

    known : the topic so far; stamp_ns : stamp of the message (ns)
    """
    return known.parts + 1 if stamp_ns == known.stamp_ns and stamp_ns > 0 else 0


def _at_most(places: Places) -> tuple[Places, str]:
    """Return the last MOST_IN_A_SCAN places, and text that there are more places; "" if there are not more."""
    if len(places) <= MOST_IN_A_SCAN:
        return places, ""
    return places.only(slice(-MOST_IN_A_SCAN, None)), f"more than {MOST_IN_A_SCAN:,} places"


def places_of(trigger: Trigger, now_s: float) -> Places:
    """Return the sources of a trigger as places that were last reported at its stamp; now_s : as in `received`."""
    count = len(trigger.positions)
    diameters = np.full(count, np.nan) if trigger.diameters is None else np.asarray(trigger.diameters, dtype=float)
    positions = np.asarray(trigger.positions, dtype=float).reshape(-1, 3)
    velocities = np.asarray(trigger.velocities, dtype=float).reshape(-1, 3)
    at_ns = np.full(count, trigger.stamp_ns, dtype=np.int64)
    return Places(positions, velocities, diameters, at_ns, np.full(count, now_s))


def is_near(positions: FloatArray, others: FloatArray, distance: float) -> np.ndarray:
    """Return for each position whether one of `others` is within a distance (m) of it.

    positions : (N, 3) m; others : (M, 3) m; the result has the shape (N,)
    """
    if not len(positions) or not len(others):
        return np.zeros(len(positions), dtype=bool)
    apart, _ = KDTree(others).query(positions, distance_upper_bound=np.nextafter(distance, np.inf))  # exclusive
    return np.asarray(apart <= distance)
