"""Draw a combination from its seed, run it on a node without a network, and compare shown levels with true levels."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from never_green.defects import DEFECTS
from never_green.dry_node import DryNode
from never_green.messages import SECOND, SPEED, TERRAIN, bytes_of, message_of
from never_green.narrow import NARROW
from never_green.oracle import LEVELS, LIMITS, SCENE, SPREAD, Oracle
from never_green.plan import END, TICK, Plan, Send, Speaker, TrueSource
from never_green.stories import (
    CHANGED_TERRAIN,
    MAX_AGE,
    MOVED_AREA,
    RESURVEYED,
    SENSORS,
    TERRAIN_MAX_AGE,
    plan_of,
)
from never_green.turns import scanning_by_turns
from never_green.watcher import Watcher
from rclpy.qos import qos_profile_sensor_data

from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.scene import live_scene
from rpf3d_ros.engine import flyer
from rpf3d_ros.engine.configuration import StationConfiguration
from rpf3d_ros.engine.terrain_faults import TerrainBefore
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.qos import given_qos
from rpf3d_ros.interface.recorded_topics import POSES, TOPICS

RADIUS = 4.0
"""Radius (m) of the area around a machine."""

DECIDED = 1.5
"""Time (s) that a decision may take, in addition to the ages that the site file allows."""

CLEAN, SINGLE = 1, 4
"""Number of combinations without a defect, and with one defect, in every ten consecutive seeds.

The other combinations have two to four defects, and their true level must reach `restrict`.
"""

FINE = 0.001
"""Step (s) in which the age of a click is computed; the time at which the click becomes too old is as exact as this."""

TURNING = 0.25
"""Share (-) of the combinations with two or more defects in which a sensor also scans by turns, if it can."""

TRIES = 40
"""Number of attempts to draw defects: a drawn defect may need an input that the combination does not have."""

SETTLED = 3.0
"""Time (s) after which a combination without defects must show the true level."""


class Green(NamedTuple):
    """A false green: a time `at` (s) at which the node's level was lower than the level that had to be shown.

    shown, true : the node's level, and the level that had to be shown, as words
    is_masked : True if only the level of the evidence was too low (then `shown`); the shown level was high enough
        because it was held
    """

    at: float
    shown: str
    true: str
    is_masked: bool


class Verdict(NamedTuple):
    """The result of a combination.

    greens : false greens; worst : the highest true level, as a word
    fault_s, shown_s : time (s) in fault, and in total, after the first SETTLED seconds
    wrong : for a combination without defects, one sentence for each time at which the shown level was wrong
    contact_closed : True if an alarm bridge closed its contact (no alarm) when the alarm had to sound
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
    """Return the combination of a seed as a plan; kinds : names of the kinds of defects to draw from."""
    rng, group = np.random.default_rng([seed, 19]), seed % 10
    is_dangerous = group >= CLEAN + SINGLE
    plan = plan_of(rng, is_dangerous)
    count = 0 if group < CLEAN else 1 if group < CLEAN + SINGLE else int(rng.integers(2, 5))
    for _ in range(TRIES):
        if len(plan.defects) < count:
            plan = (DEFECTS | NARROW)[str(rng.choice(kinds))](plan, rng) or plan
    if is_dangerous and tuple(kinds) == tuple(DEFECTS):
        # A generator of its own, so that every seed has the same other defects as without this kind.
        turning = np.random.default_rng([seed, 20])
        plan = (scanning_by_turns(plan, turning) if turning.random() < TURNING else None) or plan
    sources = tuple(known_by_its_node(source, plan) for source in plan.truth.sources)
    return plan._replace(truth=plan.truth._replace(sources=sources))


def known_by_its_node(source: TrueSource, plan: Plan) -> TrueSource:
    """Return a clicked source that ends as soon as the node's clock or a restart makes the click void.

    A clock that jumps ahead makes the click too old; a clock that goes back, or a restart, makes the node forget the
    click. Other sources are returned unchanged.
    """
    if np.isinf(source.until):
        return source
    clock, clicked = plan.clock, source.until - MAX_AGE
    voids = (plan.restart_at, clock.jump_at if clock.jump < 0.0 else np.inf)
    source = source._replace(until=min([source.until, *(at for at in voids if at >= clicked)]))
    times = np.arange(clicked, source.until, FINE).tolist()
    ages = [clock.now(at) - clock.now(clicked) for at in times]
    ends = [at - FINE for at, age in zip(times, ages, strict=True) if not 0.0 <= age < MAX_AGE]
    return source._replace(until=min(ends, default=source.until))


@cache
def workshop() -> Workshop:
    """Return the terrain builder that all test combinations of this process share."""
    return Workshop(must_face_up=True)


def site_values(limits: str, has_machines: bool, scan_period: float | None = None) -> dict[str, Any]:
    """Return the content of a combination's site file.

    limits : highest level that has a limit, as a word; has_machines : True if the area `equipment` has limits as well
    scan_period : `evidence.scan_period_s` (s), None to leave it out
    """
    words = LEVELS[1 : LEVELS.index(limits) + 1]
    names = ("live_area", *(("equipment",) if has_machines else ()))
    terms = {"sources_max_age_s": MAX_AGE, "terrain_max_age_s": TERRAIN_MAX_AGE, "clock_tolerance_s": 0.5,
             "fewest_rocks": 80, "most_unfinished": 0.1, "cluster_m": 0.0,
             "moved_area_s": MOVED_AREA, "changed_terrain_s": CHANGED_TERRAIN}  # fmt: skip
    if scan_period is not None:
        terms["scan_period_s"] = scan_period
    areas = {name: {word: {"reach_probability": LIMITS[word]} for word in words} for name in names}
    return {"site": "pit", "valid_s": 2.0, "alarm_from": limits, "evidence": terms, "areas": areas}


def configuration_of(plan: Plan) -> StationConfiguration:
    """Return the configuration of a node for a combination."""
    parameters = SimulatorParameters(
        source_topics=tuple(topic for topic in SENSORS[:2]), source_cloud_topics=(SENSORS[2],),
        expected_topics=plan.sensors if plan.expects else ("",), optional_topics=("",) if plan.expects else SENSORS,
        publisher_overlap=1.0, position_spread=SPREAD, first_rocks=80, equipment_radius=RADIUS,
        release_speed=SPEED,
    )  # fmt: skip
    thresholds = Thresholds.model_validate(
        site_values(plan.limits, plan.truth.machines is not None, plan.scan_period)
    )
    return StationConfiguration(
        parameters=parameters, scene=live_scene(SCENE), workshop=workshop(), store=None, standing=None,
        standing_report="", thresholds=thresholds, log=None, log_fault="", compile_s=0.0,
    )  # fmt: skip


class Run:
    """A combination while it runs: its steady time `at` (s), the node, and a subscriber of its alerts."""

    def __init__(self, plan: Plan) -> None:
        """Start a node without a network for a plan."""
        self.plan, self.at = plan, 0.0
        self._log = tempfile.TemporaryDirectory()
        self._start(self._logged(configuration_of(plan)) if np.isfinite(plan.restart_at) else configuration_of(plan))

    def _start(self, configuration: StationConfiguration) -> None:
        self.node = DryNode(configuration, self.now_ns, lambda: self.at, self._publishers)
        self.watcher = Watcher(self.node.ros.published, self.now_ns)

    def _logged(self, configuration: StationConfiguration) -> StationConfiguration:
        return replace(configuration, log=DecisionLog(Path(self._log.name), "0.1.0"))

    def restart(self) -> None:
        """End the node and start it again with its decision log, and with its terrain as if it were from the store."""
        standing, read_ns = self.node.station.flyer.standing, published_ns(self.at)
        self.node.close()
        before = TerrainBefore(read_ns=read_ns)
        if standing is not None:
            count = standing.ground.patches
            before = before._replace(patches_ns=(read_ns,) * count, stamps_ns=(standing.ground.stamp_ns,) * count)
        configuration = self._logged(configuration_of(self.plan))
        self._start(replace(configuration, standing=standing, standing_report="restored", before=before))

    def close(self) -> None:
        """End the node and delete its decision log."""
        self.node.close()
        self._log.cleanup()

    def now_ns(self) -> int:
        """Return the time of the node's clock (ns)."""
        return round(self.plan.clock.now(self.at) * SECOND)

    def deliver(self, send: Send) -> None:
        """Deliver an acknowledgement or a message to the node, and wait until the node has processed it.

        A message is dropped if its publisher does not exist when the message is sent, or cannot be received.
        """
        self.at = max(self.at, send.at)
        if send.kind == "acknowledgement":
            self.node.station.acknowledged(send.words)
            self.node.settle()
        elif self._speaks(send):
            sent = self.plan.clock.now(send.sent)
            message = message_of(send, round((sent + send.offset) * SECOND))
            if send.kind in TERRAIN:
                self.node.receive(send.topic, bytes_of(message), published_ns(send.sent))
            else:
                self.node.receive(send.topic, message)

    def evident(self) -> str:
        """Return the level of the evidence alone, without held levels.

        The level is `fault` if there is no decision, or if the last decision has a fault.
        """
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


def published_ns(sent: float) -> int:
    """Return when a message that is sent at a time (s) is published, by the clock of the middleware (ns)."""
    return round((1e9 + sent) * SECOND)


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
    """Run the combination of a seed, and return the verdict; kinds : names of the kinds of defects to draw from."""
    plan = drawn(seed, kinds)
    oracle = Oracle(plan.truth, plan.limits, RADIUS)
    with failing_answers(plan) as moment:
        one = Run(plan)
        moment.run = one
        try:
            return _judged(seed, one, oracle)
        finally:
            one.close()


def _judged(seed: int, one: Run, oracle: Oracle) -> Verdict:
    plan, waiting = one.plan, sorted(one.plan.sends, key=lambda send: send.at)
    greens, wrong, shown_s, fault_s, worst, closed = [], [], 0.0, 0.0, 0, False
    for tick in np.arange(0.0, END, TICK).tolist():
        is_restarted = plan.restart_at <= tick < plan.restart_at + TICK
        while waiting and waiting[0].at <= tick:
            if is_restarted and waiting[0].at >= plan.restart_at:
                one.restart()
                is_restarted = False
            one.deliver(waiting.pop(0))
        one.at = tick
        if is_restarted:
            one.restart()
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
    """Return a list with the false green at a time (s); empty if there is none.

    shown, evident : shown level and level of the evidence; least : index in LEVELS of the lowest allowed level
    """
    if "fault" in (shown, evident) or min(LEVELS.index(shown), LEVELS.index(evident)) >= least:
        return []
    is_masked = LEVELS.index(shown) >= least
    return [Green(at=at, shown=evident if is_masked else shown, true=LEVELS[least], is_masked=is_masked)]


def required(oracle: Oracle, plan: Plan, at: float, decided: float = DECIDED) -> int:
    """Return the lowest level, as an index in LEVELS, that may be shown at a time (s).

    The result is the lowest of several true levels. Sources, terrain and areas are each taken at the time `at`, or at
    the earliest time that the site file allows a decision to use, minus `decided`. In the grace times of the plan, the
    result is 0.

    decided : time (s) that a decision may take, in addition to the ages that the site file allows
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
    """Return a sentence if the shown level of a combination without defects is wrong; an empty list if it is right.

    Without an acknowledgement, no level falls. So the shown level is at most the highest true level until now, and at
    least the highest true level until RESURVEYED + SETTLED seconds ago.
    """
    ranges = [(each, oracle.range_at(each, each, each)) for each in np.arange(0.0, at + TICK, TICK).tolist()]
    least = max((low for each, (low, _) in ranges if each <= at - RESURVEYED - SETTLED), default=0)
    most = max(high for _, (_, high) in ranges)
    is_true = shown in LEVELS[least : most + 1]
    return [] if is_true else [f"{shown} at {at:g} s, true is {LEVELS[least]} to {LEVELS[most]}"]


class failing_answers:
    """Context manager in which answers to sources on the slope raise an error during `answers_fail` of a plan.

    run : the `Run` whose time counts; to be set by the caller
    """

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
