"""Draw the truth of a combination, and the correct messages of sensors and surveyors about it."""

from typing import NamedTuple

import numpy as np
from never_green import pit
from never_green.plan import END, ClockRule, Plan, Send, Speaker, TrueSource, Truth

RADAR_A, RADAR_B, LIDAR, CLICK = "sources", "radar_b/sources", "source_cloud", "clicked_point"
SENSORS = (RADAR_A, RADAR_B, LIDAR)
KINDS = {RADAR_A: "poses", RADAR_B: "poses", LIDAR: "cloud", CLICK: "point"}

EVERY, RESURVEYED = 2.0, 6.0
"""Time (s) between two messages of a sensor, and between two whole surveys."""

MAX_AGE, TERRAIN_MAX_AGE = 5.0, 12.0
"""Ages (s) at which sources and terrain are stale, in the site file."""

MOVED_AREA = 1.0
"""Time (s) for which an area that has moved may be judged at its former place, in the site file."""

CHANGED_TERRAIN = 1.0
"""Time (s) for which an answer over the former terrain may count, in the site file."""

STORIES = ("steady", "appears", "bank", "area", "machine", "clicked", "patched", "quiet")
"""Names of the stories (courses of events). In this order: a dangerous source exists from the start; or it appears
later; the bank is removed; the area grows; a machine stands below a source; a person clicks a source; the bank is
removed while patches of other places continue; nothing is dangerous."""


class Draw(NamedTuple):
    """The random generator of a combination, and its first draws.

    story : one of STORIES; sensors : topics of the sensors of the site; change : time of the story's change (s)
    """

    rng: np.random.Generator
    story: str
    sensors: tuple[str, ...]
    change: float

    def some(self, sensors: tuple[str, ...]) -> tuple[str, ...]:
        """Return a random selection of the sensors, at least one."""
        keeps = self.rng.random(len(sensors)) < 0.5
        keeps[self.rng.integers(len(sensors))] = True
        return tuple(np.array(sensors)[keeps].tolist())


def plan_of(rng: np.random.Generator, is_dangerous: bool) -> Plan:
    """Return a random combination without defects; is_dangerous : True if its true level must reach `restrict`."""
    stories = STORIES[:-1] if is_dangerous else STORIES
    sensors = (RADAR_A, *(topic for topic in (RADAR_B, LIDAR) if rng.random() < 0.6))
    draw = Draw(rng=rng, story=str(rng.choice(stories)), sensors=sensors, change=float(rng.uniform(6.0, 11.0)))
    truth = _truth(draw)
    limits = str(rng.choice(("restrict", "evacuate") if is_dangerous else ("watch", "restrict", "evacuate")))
    sends = (*_of_sensors(draw, truth), *_clicks(draw, truth), *_surveys(draw, truth), *_areas(draw, truth))
    topics = dict.fromkeys([*sensors, *(send.topic for send in sends if send.kind != "acknowledgement")])
    return Plan(
        truth=truth, sends=sends, speakers=tuple(Speaker(topic=topic, number=0) for topic in topics), sensors=sensors,
        limits=limits, expects=bool(rng.random() < 0.5), clock=ClockRule(),
    )  # fmt: skip


def _truth(draw: Draw) -> Truth:
    rng, story = draw.rng, draw.story
    harmless = tuple(
        TrueSource(place=pit.on_the_floor(rng), since=0.0, seen_by=draw.some(draw.sensors))
        for _ in range(rng.integers(0, 3))
    )
    road = pit.outline(pit.ROAD)
    areas = (pit.outline(pit.SHELTERED_ROAD), road) if story in ("area", "machine") else (road, road)
    dangerous = () if story == "quiet" else (_dangerous(draw),)
    machines = None
    if story == "machine":
        machines = pit.placed(48.0, dangerous[0].place[1] - pit.ORIGIN[1], 0.0)[None]
        areas = areas[0], areas[0]
    return Truth(
        sources=(*harmless, *dangerous), bank_until=draw.change if story in ("bank", "patched") else np.inf,
        areas=areas, area_since=draw.change, machines=machines,
    )  # fmt: skip


def _dangerous(draw: Draw) -> TrueSource:
    sheltered = draw.story in ("bank", "patched")
    place = pit.on_the_slope(draw.rng, pit.SHELTERED if sheltered else pit.OPEN)
    if draw.story == "clicked":
        known = draw.change - MAX_AGE  # MAX_AGE before the click, so that the node must count the click at once
        return TrueSource(place=place, since=known, seen_by=(CLICK,), until=draw.change + MAX_AGE)
    since = draw.change if draw.story == "appears" else 0.0
    return TrueSource(place=place, since=since, seen_by=draw.some(draw.sensors))


def seen(truth: Truth, topic: str, at: float) -> np.ndarray:
    """Return the places (N, 3) m of the sources that a sensor sees at a time (s); topic : topic of the sensor."""
    places = [source.place for source in truth.sources if topic in source.seen_by and source.since <= at]
    return np.array(places).reshape(-1, 3)


def _of_sensors(draw: Draw, truth: Truth) -> list[Send]:
    sends = []
    for topic in draw.sensors:
        for at in np.arange(draw.rng.uniform(0.6, 2.0), END, EVERY).tolist():
            sends.append(Send(sent=at, at=at, topic=topic, kind=KINDS[topic], places=seen(truth, topic, at)))
    return sends


def _clicks(draw: Draw, truth: Truth) -> list[Send]:
    """Return the click on the dangerous source, and sometimes a click on a harmless place below this source.

    The list is empty unless the story is `clicked`.
    """
    if draw.story != "clicked":
        return []
    at, place = draw.change, truth.sources[-1].place
    clicks = [Send(sent=at, at=at, topic=CLICK, kind="point", places=place[None])]
    if draw.rng.random() < 0.5:
        beside = pit.placed(41.0, place[1] - pit.ORIGIN[1], 0.5)[None]
        clicks.append(Send(sent=at + 0.3, at=at + 0.3, topic=CLICK, kind="point", places=beside))
    return clicks


def _surveys(draw: Draw, truth: Truth) -> list[Send]:
    """Return whole surveys at regular times; in some combinations also patches, such as after the bank is removed."""
    rng, is_mesh = draw.rng, draw.rng.random() < 0.3 and draw.story != "patched"
    topic, kind = ("terrain/mesh", "mesh") if is_mesh else ("terrain/points", "grid")
    times = np.arange(0.1, END, RESURVEYED).tolist()
    sends = [Send(sent=at, at=at, topic=topic, kind=kind, places=survey(truth, at)) for at in times]
    if draw.story == "bank" and rng.random() < 0.6:
        sends.append(patch_send(truth, draw.change + 0.1, ((32.0, 48.0), (40.0, 72.0))))
    if draw.story == "patched" or rng.random() < 0.3:
        for at in np.arange(3.0, END, 2.5).tolist():
            sends.append(patch_send(truth, at, ((16.0, 24.0), (8.0 + 2.0 * rng.integers(0, 8), 32.0))))
    return sends


def survey(truth: Truth, at: float) -> np.ndarray:
    """Return the points (rows, columns, 3) m of a correct whole survey at a time (s)."""
    points = pit.survey(truth.has_bank(at))
    points[0, 0, 2] += 1e-3 * at / RESURVEYED  # so that no two surveys are equal
    return points


def patch_send(truth: Truth, at: float, ranges: tuple[tuple[float, float], tuple[float, float]]) -> Send:
    """Return the message of a correct patch at a time (s); ranges : of x and of y (m), relative to `pit.ORIGIN`."""
    points = pit.patch_of(truth.has_bank(at), *ranges)
    return Send(sent=at, at=at, topic="terrain/update", kind="patch", places=points)


def _areas(draw: Draw, truth: Truth) -> list[Send]:
    sends = []
    for at in (0.2, draw.change) if draw.story == "area" else (0.2,):
        sends.append(Send(sent=at, at=at, topic="areas/polygon", kind="polygon", places=truth.area(at)))
    if truth.machines is not None:
        sends.append(Send(sent=0.3, at=0.3, topic="areas/equipment", kind="equipment", places=truth.machines))
    return sends
