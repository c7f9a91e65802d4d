"""Draw a combination from its seed, run it on a node without a network, and compare what is shown with the truth."""

from collections.abc import Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from never_green.defects import DEFECTS
from never_green.dry_node import DryNode
from never_green.messages import SECOND, TERRAIN, bytes_of, message_of
from never_green.narrow import NARROW
from never_green.oracle import LEVELS, LIMITS, SCENE, SPREAD, Oracle
from never_green.plan import END, TICK, ClockRule, Plan, Send, Speaker, TrueSource
from never_green.stories import (
    CHANGED_TERRAIN,
    MAX_AGE,
    MOVED_AREA,
    RESURVEYED,
    SENSORS,
    TERRAIN_MAX_AGE,
    plan_of,
)
from never_green.watcher import Watcher
from rclpy.qos import qos_profile_sensor_data

from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.scene import live_scene
from rpf3d_ros.engine import flyer
from rpf3d_ros.engine.configuration import StationConfiguration
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.qos import given_qos
from rpf3d_ros.interface.recorded_topics import POSES, TOPICS

RADIUS = 4.0
"""Radius (m) of the area around a machine."""

DECIDED = 1.5
"""Time (s) for a decision, beyond the ages of the site file."""

CLEAN, SINGLE = 1, 4
"""Of ten seeds in a row, those without a defect, and those with one; the others have two to four over a danger."""

TRIES = 40
"""Largest number of defects that are drawn: some harm an input that the combination does not have."""

SETTLED = 3.0
"""Time (s) after which a combination without defects must show the true level."""


class Green(NamedTuple):
    """A time (s) at which too low a level was shown, with the true level.

    is_masked : True if only the evidence was too low, and the level was held
    """

    at: float
    shown: str
    true: str
    is_masked: bool


class Verdict(NamedTuple):
    """The result of a combination.

    greens : false greens; worst : the highest true level; reached : whether a limit was required at any time
    fault_s, shown_s : time (s) in fault, and in total, after the first SETTLED seconds
    wrong : for a combination without defects, what was not the true level
    """

    seed: int
    plan: Plan
    greens: tuple[Green, ...]
    worst: str
    fault_s: float
    shown_s: float
    wrong: tuple[str, ...]
    contact_closed: bool


def drawn(seed: int, kinds: Sequence[str] = tuple(DEFECTS)) -> Plan:
    """Return the combination of a seed, with defects of some kinds only."""
    rng, group = np.random.default_rng([seed, 19]), seed % 10
    is_dangerous = group >= CLEAN + SINGLE
    plan = plan_of(rng, is_dangerous)
    count = 0 if group < CLEAN else 1 if group < CLEAN + SINGLE else int(rng.integers(2, 5))
    for _ in range(TRIES):
        if len(plan.defects) < count:
            plan = (DEFECTS | NARROW)[str(rng.choice(kinds))](plan, rng) or plan
    sources = tuple(known_by_its_clock(source, plan.clock) for source in plan.truth.sources)
    return plan._replace(truth=plan.truth._replace(sources=sources))


def known_by_its_clock(source: TrueSource, clock: ClockRule) -> TrueSource:
    """Return a source; if it was clicked, the node knows of it until its age by the clock is too old.

    A clock that jumps ahead makes the click too old; a clock that goes back makes the node forget the click.
    """
    if np.isinf(source.until):
        return source
    clicked = source.until - MAX_AGE
    times = np.arange(clicked, source.until, TICK / 5.0).tolist()
    ages = [clock.now(at) - clock.now(clicked) for at in times]
    ends = [at for at, age in zip(times, ages, strict=True) if not 0.0 <= age < MAX_AGE]
    return source._replace(until=min(ends, default=source.until))


@cache
def workshop() -> Workshop:
    """Return the builder of grounds of this process."""
    return Workshop(must_face_up=True)


def site_values(limits: str, has_machines: bool) -> dict[str, Any]:
    """Return the site file of a combination as a mapping; limits : the highest level that has a limit."""
    words = LEVELS[1 : LEVELS.index(limits) + 1]
    names = ("live_area", *(("equipment",) if has_machines else ()))
    terms = {"sources_max_age_s": MAX_AGE, "terrain_max_age_s": TERRAIN_MAX_AGE, "clock_tolerance_s": 0.5,
             "fewest_rocks": 80, "most_unfinished": 0.1, "cluster_m": 0.0,
             "moved_area_s": MOVED_AREA, "changed_terrain_s": CHANGED_TERRAIN}  # fmt: skip
    areas = {name: {word: {"reach_probability": LIMITS[word]} for word in words} for name in names}
    return {"site": "pit", "valid_s": 2.0, "alarm_from": limits, "evidence": terms, "areas": areas}


def configuration_of(plan: Plan) -> StationConfiguration:
    """Return the configuration of a node for a combination."""
    parameters = SimulatorParameters(
        source_topics=tuple(topic for topic in SENSORS[:2]), source_cloud_topics=(SENSORS[2],),
        expected_topics=plan.sensors if plan.expects else ("",), optional_topics=("",) if plan.expects else SENSORS,
        publisher_overlap=1.0, position_spread=SPREAD, first_rocks=80, equipment_radius=RADIUS,
    )  # fmt: skip
    thresholds = Thresholds.model_validate(site_values(plan.limits, plan.truth.machines is not None))
    return StationConfiguration(
        parameters=parameters, scene=live_scene(SCENE), workshop=workshop(), store=None, standing=None,
        standing_report="", thresholds=thresholds, log=None, log_fault="", compile_s=0.0,
    )  # fmt: skip


class Run:
    """A combination while it runs: a steady time, the node, and what a subscriber sees."""

    def __init__(self, plan: Plan) -> None:
        """Start the node."""
        self.plan, self.at = plan, 0.0
        self.node = DryNode(configuration_of(plan), self.now_ns, lambda: self.at, self._publishers)
        self.watcher = Watcher(self.node.ros.published, self.now_ns)

    def now_ns(self) -> int:
        """Return the time of the node's clock (ns)."""
        return round(self.plan.clock.now(self.at) * SECOND)

    def deliver(self, send: Send) -> None:
        """Let the node receive a message, if its publisher can be received when the message is sent."""
        self.at = max(self.at, send.at)
        if send.kind == "acknowledgement":
            self.node.station.acknowledged(send.words)
            self.node.settle()
        elif self._speaks(send):
            sent = self.plan.clock.now(send.sent)
            message = message_of(send, round((sent + send.offset) * SECOND))
            if send.kind in TERRAIN:
                self.node.receive(send.topic, bytes_of(message), round((1e9 + send.sent) * SECOND))
            else:
                self.node.receive(send.topic, message)

    def evident(self) -> str:
        """Return the level of the evidence, `fault` if it has a fault, also where evacuate is shown in its place."""
        desk = self.node.station.desk
        alert = None if desk is None else desk.alert
        return "fault" if alert is None or alert.faults else self.watcher.evident(self.at)

    def _speaks(self, send: Send) -> bool:
        return any(
            one.is_received and one.number == send.publisher and one.since <= send.sent < one.until
            for one in self.plan.speakers if one.topic == send.topic
        )  # fmt: skip

    def _publishers(self, topic: str) -> list[Any]:
        there = [one for one in self.plan.speakers if one.topic == topic and one.since <= self.at < one.until]
        return [_info_of(one) for one in there]


def _info_of(speaker: Speaker) -> Any:
    known = TOPICS.get(speaker.topic)
    kind, qos = (POSES, given_qos("event")) if known is None else (known.kind, given_qos(known.offered))
    if not speaker.is_received:
        qos, kind = (qos, "std_msgs/msg/String") if not speaker.is_of_type else (qos_profile_sensor_data, kind)
    return SimpleNamespace(
        node_namespace="/", node_name=f"speaker_{speaker.number}", topic_type=kind, qos_profile=qos,
        endpoint_gid=[speaker.number, speaker.is_received],
    )  # fmt: skip


def run(seed: int, kinds: Sequence[str] = tuple(DEFECTS)) -> Verdict:
    """Run the combination of a seed, with defects of some kinds only, and return the verdict."""
    plan = drawn(seed, kinds)
    oracle = Oracle(plan.truth, plan.limits, RADIUS)
    with failing_answers(plan) as moment:
        one = Run(plan)
        moment.run = one
        try:
            return _judged(seed, one, oracle)
        finally:
            one.node.close()


def _judged(seed: int, one: Run, oracle: Oracle) -> Verdict:
    plan, waiting = one.plan, sorted(one.plan.sends, key=lambda send: send.at)
    greens, wrong, shown_s, fault_s, worst, closed = [], [], 0.0, 0.0, 0, False
    for tick in np.arange(0.0, END, TICK).tolist():
        while waiting and waiting[0].at <= tick:
            one.deliver(waiting.pop(0))
        one.at = tick
        one.node.tick()
        shown, evident = one.watcher.shown(tick), one.evident()
        least = required(oracle, plan, tick)
        worst = max(worst, oracle.range_at(tick, tick, tick)[0])
        greens += _greens(tick, shown, evident, least)
        closed |= one.watcher.is_closed(tick) and least >= LEVELS.index(plan.limits)
        if tick >= SETTLED:
            shown_s, fault_s = shown_s + TICK, fault_s + TICK * (shown == "fault")
            wrong += [] if plan.defects else _not_exact(oracle, tick, shown)
    return Verdict(
        seed=seed, plan=plan, greens=tuple(greens), worst=LEVELS[worst], fault_s=fault_s, shown_s=shown_s,
        wrong=tuple(wrong), contact_closed=closed,
    )  # fmt: skip


def _greens(at: float, shown: str, evident: str, least: int) -> list[Green]:
    """Return the false green at a time (s), if there is one; least : the level that must be shown, of LEVELS."""
    if "fault" in (shown, evident) or min(LEVELS.index(shown), LEVELS.index(evident)) >= least:
        return []
    is_masked = LEVELS.index(shown) >= least
    return [Green(at=at, shown=evident if is_masked else shown, true=LEVELS[least], is_masked=is_masked)]


def required(oracle: Oracle, plan: Plan, at: float, decided: float = DECIDED) -> int:
    """Return the level that must be shown at least at a time (s): that of the truth throughout the stated time.

    decided : time (s) for a decision, beyond the ages of the site file
    """
    if any(since <= at < since + grace + decided for since, grace in plan.graces):
        return 0
    sources_before, terrain_before = at - MAX_AGE - decided, at - TERRAIN_MAX_AGE - decided
    area_before = at - MOVED_AREA - decided
    return min(
        oracle.range_at(sources_at, terrain_at, area_at)[0]
        for sources_at in (sources_before, at)
        for terrain_at in (terrain_before, at)
        for area_at in (area_before, at)
    )


def _not_exact(oracle: Oracle, at: float, shown: str) -> list[str]:
    """Return what is wrong with the level of a combination without defects.

    Nothing lowers a level here. So the level is at least the highest true one until a survey ago, and at most the
    highest until now.
    """
    ranges = [(each, oracle.range_at(each, each, each)) for each in np.arange(0.0, at + TICK, TICK).tolist()]
    least = max((low for each, (low, _) in ranges if each <= at - RESURVEYED - SETTLED), default=0)
    most = max(high for _, (_, high) in ranges)
    is_true = shown in LEVELS[least : most + 1]
    return [] if is_true else [f"{shown} at {at:g} s, true is {LEVELS[least]} to {LEVELS[most]}"]


class failing_answers:
    """A context in which answers to sources on the slope fail with an error at the times of the plan."""

    def __init__(self, plan: Plan) -> None:
        self._during, self._answers, self.run = plan.answers_fail, flyer.answers, None

    def __enter__(self) -> "failing_answers":
        if self._during is not None:
            flyer.answers = self._fail
        return self

    def __exit__(self, *error: object) -> None:
        flyer.answers = self._answers

    def _fail(self, standing: Any, trigger: Any, *rest: Any) -> Any:
        begin, end = self._during or (0.0, 0.0)
        is_hit = self.run is not None and begin <= self.run.at < end
        if is_hit and len(trigger.positions) and trigger.positions[:, 2].max() > 505.0:
            raise MemoryError("drawn by the campaign")
        return self._answers(standing, trigger, *rest)
