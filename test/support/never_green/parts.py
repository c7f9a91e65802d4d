"""A sensor that publishes each scan as several messages with one stamp; each message has a part of the places.

The messages are correct. They are a defect only for a node that takes each message as a whole scan. The places are
divided at random in each scan, so any part may have the dangerous source, and a part may have no place at all.

All parts of a scan arrive between two readings of the campaign: until the last part arrives, the evidence may be too
low (docs/explanation/alerts.md, "The same stamp").
"""

import numpy as np
from never_green import pit
from never_green.pit import FloatArray
from never_green.plan import TICK, Plan, Send, Truth
from never_green.stories import MAX_AGE, SENSORS
from never_green.turns import NAME as TURNS
from never_green.turns import is_at

NAME = "scan in parts"
PARTS = (2, 3)
"""Numbers of messages of a scan."""

PERIODS = (0.0, MAX_AGE)
"""Scan periods (s) that a site file may state: each scan has all places; or places count for two further scans."""

LOW = 0.5
"""Height (m) above the floor of a thrown source; a source on the slope lies higher."""

FROM_ROAD = (57.0, 60.0)
"""Range of x (m) of a thrown source, relative to `pit.ORIGIN`; rocks that start there at rest do not reach the road."""

BESIDE = (0.2, 0.5)
"""Range of the distance along x and along y (m) of a harmless source from a thrown source.

Both together are shorter than `position_spread`, so the two sources count as the same place.
"""


def scan_in_parts(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let all sensors that see the last source publish their scans in parts; at most once in a plan.

    If no sensor sees the last source, this is true of all sensors. Two further changes are made only if no sensor scans
    by turns. The site file states a scan period in half of the plans. If a dangerous source is in the pit all the time,
    or appears, it is moved beyond the road and thrown over the road in three quarters of the plans. Each scan with this
    source then also has a harmless source at rest at almost the same place, in another part.
    """
    is_stated, period = bool(rng.random() < 0.5), float(rng.choice(PERIODS))
    count, is_moved = int(rng.choice(PARTS)), bool(rng.random() < 0.75)
    topics = _topics(plan)
    if not topics or _has(plan, NAME):
        return None
    if not _has(plan, TURNS):
        plan = plan._replace(scan_period=period if is_stated else None)
        plan = _with_thrown(plan, rng) if is_moved and _can_be_thrown(plan.truth) else plan
    thrown = [source.place for source in plan.truth.sources if source.is_thrown]
    sends: list[Send] = []
    for send in plan.sends:
        sends += _divided(send, count, thrown, rng) if send.topic in topics else [send]
    return plan.with_defect(f"{NAME}: {', '.join(topics)}", sends=tuple(sends))


def _has(plan: Plan, name: str) -> bool:
    return any(each.startswith(name) for each in plan.defects)


def _topics(plan: Plan) -> list[str]:
    """Return the topics of the sensors that see the last source, or else of all sensors; only topics with messages."""
    published = {send.topic for send in plan.sends}
    seeing = [topic for source in plan.truth.sources[-1:] for topic in source.seen_by if topic in plan.sensors]
    return [topic for topic in seeing or plan.sensors if topic in published]


def _can_be_thrown(truth: Truth) -> bool:
    """Return True if sensors see a source on the slope, and neither the bank, the area nor machines matter."""
    if np.isfinite(truth.bank_until) or truth.machines is not None or truth.areas[0] is not truth.areas[1]:
        return False
    last = truth.sources[-1:]
    return any(source.seen_by[0] in SENSORS and source.place[2] > pit.ORIGIN[2] + LOW for source in last)


def _with_thrown(plan: Plan, rng: np.random.Generator) -> Plan:
    """Return the plan with its last source moved beyond the road and thrown, in the truth and in the messages."""
    *others, last = plan.truth.sources
    across = last.place[1] - pit.ORIGIN[1]
    moved = last._replace(place=pit.placed(rng.uniform(*FROM_ROAD), across, LOW), is_thrown=True)
    sends = tuple(
        send._replace(places=np.where(is_at(send, last.place)[:, None], moved.place, send.places))
        if send.topic in last.seen_by else send for send in plan.sends
    )  # fmt: skip
    return plan._replace(truth=plan.truth._replace(sources=(*others, moved)), sends=sends)


def _divided(send: Send, count: int, thrown: list[FloatArray], rng: np.random.Generator) -> list[Send]:
    """Return the messages of a scan, all with its stamp; count : their number; thrown : places (3,) m, at most one.

    The thrown source is the only source of its message, because a message reports one velocity for all its sources.
    """
    places, parts = send.places.reshape(-1, 3), rng.integers(count, size=len(send.places))
    own = -1
    for place in thrown:
        if is_at(send, place).any():
            own, shifts = int(rng.integers(count)), rng.integers(1, count, size=len(places) + 1)
            places = np.vstack([places, _beside(place, rng)])
            parts = np.where(is_at(send._replace(places=places), place), own, (own + shifts) % count)
    apart = (TICK - send.at % TICK) / count
    return [
        send._replace(at=send.at + number * apart, places=places[parts == number], is_thrown=number == own)
        for number in range(count)
    ]


def _beside(place: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return a random place (3,) m that counts as the same place as `place` (3,) m, at the same height."""
    x, y = rng.uniform(*BESIDE, 2) * rng.choice((-1.0, 1.0), 2)
    return np.asarray(place + np.array([x, y, 0.0]))
