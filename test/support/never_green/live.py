"""Run the campaign with real processes: a simulator node, and a peer that publishes each combination over DDS.

    PYTHONPATH=test/support:. python -m never_green.live --count 300

One node serves many combinations. Before each combination, the peer publishes inputs without danger and acknowledges
the alert until the level is `normal`. The clock of the node is `/clock`, which runs RATE times as fast as real time.
"""

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from messages.live_peer import PATIENCE, LivePeer
from never_green import pit
from never_green.combination import DECIDED, RADIUS, drawn, required, site_values
from never_green.defects import DEFECTS
from never_green.messages import SECOND, SPEED, TERRAIN, bytes_of, message_of
from never_green.oracle import LEVELS, SCENE, SPREAD, Oracle
from never_green.plan import BEGAN, END, Plan, Send, Truth
from never_green.stories import KINDS, RADAR_A, SENSORS, survey
from never_green.watcher import Watcher
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from rpf3d_ros.demo.domains import free_domain
from rpf3d_ros.demo.processes import ended, node_process
from rpf3d_ros.interface.qos import EVENTS, given_qos
from rpf3d_ros.interface.recorded_topics import TOPICS
from rpf3d_ros.messages.stamps import stamp_of
from rpf3d_ros.nodes.acknowledge import acknowledged_by_request

RATE = 4.0
"""Seconds of `/clock` per second of real time."""

SLOWER = 8.0
"""Time (s of `/clock`) that a message, a decision and a busy machine take, in addition to DECIDED."""

ONLY_DRY = ("clock begins late", "answers fail", "missing terrain", "missing areas", "restarted")
"""Kinds of defects that are left out here, because they need a new node or a failing function in the node."""

LIVE_KINDS = tuple(kind for kind in DEFECTS if kind not in ONLY_DRY)
CORNER = pit.placed(66.0, 76.0, 0.0)[None]
"""Place (1, 3) m of a machine that no rock reaches, for combinations without machines."""

CLASSES = {topic: TOPICS[topic].message_class if topic in TOPICS else TOPICS[RADAR_A].message_class
           for topic in (*SENSORS, "clicked_point", "terrain/points", "terrain/mesh", "terrain/update",
                         "areas/polygon", "areas/equipment")}  # fmt: skip


class LiveVerdict(NamedTuple):
    """The result of a combination.

    greens : one sentence for each false green, a time at which the node showed too low a level
    worst : highest true level, as a word
    required : highest level that the node had to show, as a word; if it is `normal`, the combination cannot fail
    looks : number of comparisons of the shown level with the truth
    """

    seed: int
    defects: tuple[str, ...]
    greens: tuple[str, ...]
    worst: str
    required: str
    looks: int


def live_plan(seed: int, limits: str) -> Plan:
    """Return the combination of a seed, changed for a node with all sensors, a machine and given limits.

    limits : the highest level for which the site has limits
    """
    plan = drawn(seed, LIVE_KINDS)
    truth = plan.truth if plan.truth.machines is not None else plan.truth._replace(machines=CORNER)
    missing = [topic for topic in SENSORS if topic not in plan.sensors]
    calm = tuple(
        Send(sent=at, at=at, topic=topic, kind=KINDS[topic], places=np.empty((0, 3)))
        for topic in missing for at in np.arange(1.0, END, 2.0).tolist()
    )  # fmt: skip
    return plan._replace(truth=truth, limits=limits, sends=(*plan.sends, *calm), sensors=SENSORS)


class Mine(LivePeer):
    """The peer of the simulator node: it publishes `/clock` and all inputs, and keeps what the node publishes."""

    def __init__(self, number: int) -> None:
        """Join the ROS domain; number : number of the worker, from 1; each worker has another start of /clock."""
        super().__init__()
        self._other_context = Context()
        self._other_context.init()
        self._other_node = Node("mine_with_other_types", context=self._other_context, start_parameter_services=False)
        self.clock_publisher = self.node.create_publisher(Clock, "/clock", EVENTS)
        self.own: dict[tuple[str, int], Any] = {(topic, 0): publisher for topic, publisher in self.publishers.items()}
        for topic in SENSORS[1:2]:
            self.own[topic, 0] = self.node.create_publisher(CLASSES[topic], topic, EVENTS)
        self.others: list[Any] = []
        self.published: list[tuple[str, Any]] = []
        self.watcher = Watcher(self.published, lambda: round(self.ros_now() * SECOND))
        self.node.create_subscription(Bool, "alarm", lambda message: self.published.append(("alarm", message)), 10)
        self.base, self.began, self.plan = BEGAN * number, time.monotonic(), None
        self._last_clock = 0.0

    def at(self) -> float:
        """Return the steady time since the start of the combination, in seconds of `/clock` (RATE per second)."""
        return (time.monotonic() - self.began) * RATE

    def ros_now(self) -> float:
        """Return the time (s) that `/clock` shows."""
        at = self.at()
        return self.base + (at if self.plan is None else self.plan.clock.now(at) - BEGAN)

    def begin(self, plan: Plan | None) -> None:
        """Begin a combination; plan : None for a time without a combination.

        `/clock` continues 0.1 s after the largest time that it has shown.
        """
        self.base = max(self.ros_now(), self._last_clock) + 0.1
        self.began, self.plan = time.monotonic(), plan

    def turn(self, longest: float = 0.02) -> None:
        """Publish `/clock`, and receive a message; longest : longest wait for the message (s)."""
        now = self.ros_now()
        self._last_clock = max(self._last_clock, now)
        self.clock_publisher.publish(Clock(clock=stamp_of(round(now * SECOND))))
        seen = len(self.alerts)
        self.executor.spin_once(timeout_sec=longest)
        self.published += [("alerts", message) for message in self.alerts[seen:]]

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Publish the clock and receive messages until a condition holds.

        Raises RuntimeError after PATIENCE seconds. what : description of the condition, for the error message
        """
        deadline = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > deadline:
                raise RuntimeError(f"waited for {what}: {[a.status[0].message for a in self.alerts[-1:]]}")
            self.turn()

    def give(self, send: Send) -> None:
        """Publish the message of a `Send`; do nothing if the message's publisher does not exist now."""
        publisher = self.own.get((send.topic, send.publisher))
        if publisher is None:
            return
        stamp = self.base + (self.plan.clock.now(send.sent) - BEGAN if self.plan else send.sent) + send.offset
        message = message_of(send, round(stamp * SECOND))
        publisher.publish(bytes_of(message) if send.kind in TERRAIN else message)

    def acknowledge_as(self, words: str) -> None:
        """Acknowledge the alert by the services of the node, and wait for their replies; words : "NAME: REASON"."""
        self._call(SetParameters, "set_parameters", acknowledged_by_request(words))
        self._call(Trigger, "acknowledge", Trigger.Request())

    def _call(self, kind: Any, name: str, request: Any) -> None:
        client = self.node.create_client(kind, f"rpf3d_simulator/{name}")
        self.until(client.service_is_ready, name)
        future = client.call_async(request)
        self.until(future.done, name)
        self.node.destroy_client(client)

    def calm(self) -> None:
        """Bring the node back to `normal`: publish a survey, areas and messages without sources, and acknowledge."""
        self._restore()
        self.begin(None)
        truth = Truth(sources=(), bank_until=np.inf, areas=(pit.outline(pit.ROAD),) * 2, area_since=0.0)
        deadline, said = time.monotonic() + PATIENCE, -np.inf
        while self.watcher.shown(self.at()) != "normal" or said == -np.inf:
            if time.monotonic() > deadline:
                raise RuntimeError(f"not calm: {self.alerts[-1].status[0].message}")
            if self.at() - said > 2.0:
                said = self.at()
                self._say_all_is_well(truth, said)
                self.acknowledge_as("Campaign: calm again")
            self.turn()

    def _say_all_is_well(self, truth: Truth, at: float) -> None:
        none = np.empty((0, 3))
        self.give(Send(sent=at, at=at, topic="terrain/points", kind="grid", places=survey(truth, at)))
        self.give(Send(sent=at, at=at, topic="areas/polygon", kind="polygon", places=truth.area(at)))
        self.give(Send(sent=at, at=at, topic="areas/equipment", kind="equipment", places=CORNER))
        for topic in SENSORS:
            self.give(Send(sent=at, at=at, topic=topic, kind=KINDS[topic], places=none))

    def _restore(self) -> None:
        """Destroy the publishers that defects have added or changed, and create the usual publishers again."""
        for publisher in self.others:
            for node in (self.node, self._other_node):
                node.destroy_publisher(publisher)  # the node that does not own the publisher ignores the call
        self.others = []
        self.own = {key: publisher for key, publisher in self.own.items() if key[1] == 0}
        for topic in CLASSES:
            if (topic, 0) not in self.own:
                self.own[topic, 0] = self._publisher(topic, received=True)
                self.until(lambda t=topic: self.own[t, 0].get_subscription_count(), topic)

    def change_speakers(self, plan: Plan, at: float) -> None:
        """Create the publishers that the plan adds by a time `at` (s), and replace those that it makes unreadable."""
        for one in plan.speakers:
            key = one.topic, one.number
            if one.number and one.since <= at and key not in self.own:
                self.own[key] = self._publisher(one.topic, received=True)
                self.others.append(self.own[key])
            if not one.is_received and one.since <= at and key in self.own:
                self.node.destroy_publisher(self.own.pop(key))
                self.others.append(self._publisher(one.topic, received=False, of_type=one.is_of_type))

    def close(self) -> None:
        """Destroy both nodes and leave the ROS domain."""
        self._other_node.destroy_node()
        self._other_context.try_shutdown()
        super().close()

    def _publisher(self, topic: str, received: bool, of_type: bool = True) -> Any:
        """Return a new publisher of a topic; received : False if the simulator must not receive its messages.

        of_type : False for a type that the simulator does not read. The publisher then belongs to a node with a context
        of its own, because in one context all publishers of a topic must have one type.
        """
        known = TOPICS.get(topic)
        qos = given_qos("event" if known is None else known.offered)
        if not of_type:
            return self._other_node.create_publisher(String, topic, qos)
        if not received:
            qos = qos_profile_sensor_data
        return self.node.create_publisher(CLASSES[topic], topic, qos)


def run_live(mine: Mine, seed: int, limits: str, load: float = 1.0) -> LiveVerdict:
    """Run a combination on the node, and compare the shown levels with the truth.

    limits : highest level for which the site has limits
    load : number of programs that share a core; the node may take `load` times SLOWER seconds longer
    """
    plan = live_plan(seed, limits)
    oracle = Oracle(plan.truth, limits, RADIUS)
    mine.calm()
    mine.begin(plan)
    waiting, greens, worst, most, looks = sorted(plan.sends, key=lambda send: send.at), [], 0, 0, 0
    mine.give(Send(sent=0.0, at=0.0, topic="areas/equipment", kind="equipment", places=plan.truth.machines))
    while (at := mine.at()) < END:
        mine.change_speakers(plan, at)
        while waiting and waiting[0].at <= at:
            send = waiting.pop(0)
            if send.kind == "acknowledgement":
                mine.acknowledge_as(send.words)
            else:
                mine.give(send)
        mine.turn()
        at = mine.at()
        shown, least = mine.watcher.shown(at), required(oracle, plan, at, DECIDED + SLOWER * load)
        worst, most, looks = max(worst, oracle.range_at(at, at, at)[0]), max(most, least), looks + 1
        if shown != "fault" and LEVELS.index(shown) < least:
            greens.append(f"{at:.1f} s: {shown}, true is {LEVELS[least]}")
    return LiveVerdict(
        seed=seed, defects=plan.defects, greens=tuple(greens), worst=LEVELS[worst], required=LEVELS[most], looks=looks
    )  # fmt: skip


def node_parameters(folder: Path, limits: str) -> list[str]:
    """Write the site file of a node to a folder, and return the ROS arguments of the node.

    limits : highest level for which the site has limits
    """
    site = folder / "site.yaml"
    site.write_text(yaml.safe_dump({**site_values(limits, has_machines=True), "valid_s": 10.0}))
    given = {
        **SCENE, "use_sim_time": True, "site_file": site, "decision_log": folder / "decisions", "first_rocks": 80,
        "source_topics": f"[{(names := ', '.join(SENSORS[:2]))}]", "optional_topics": f"[{names}]",
        "position_spread": SPREAD, "release_speed": SPEED, "publisher_overlap": 1.0,
        "clock_patience": 0.5, "equipment_radius": RADIUS,
    }  # fmt: skip
    return [word for name, value in given.items() for word in ("-p", f"{name}:={value}")]


def several(seeds: Sequence[int], number: int, words: bool = True, load: float = 1.0) -> list[LiveVerdict]:
    """Start a node, run combinations on it one after the other, and return their verdicts.

    number : number of the worker, from 0; workers with odd numbers have no limit for `evacuate`
    words : True to print each verdict; load : as in `run_live`
    """
    limits, verdicts = ("evacuate", "restrict")[number % 2], []
    with tempfile.TemporaryDirectory() as name:
        domain, lock = free_domain()
        os.environ |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_LOG_DIR": name}
        process = node_process("simulator_node", node_parameters(Path(name), limits), Path(name))
        mine = Mine(number + 1)
        try:
            mine.until(lambda: any("active" in said.message for said in mine.said), "the node to be active")
            for seed in seeds:
                verdicts.append(run_live(mine, seed, limits, load))
                if words:
                    print(words_of(verdicts[-1]), flush=True)
            assert process.poll() is None, "the simulator has died"
        finally:
            mine.close()
            ended(process)
            lock.close()
    return verdicts


def words_of(verdict: LiveVerdict) -> str:
    """Return a line of text about a verdict: its seed, its defects and its first false green."""
    well = verdict.greens[0] if verdict.greens else "well"
    return f"seed {verdict.seed} ({', '.join(verdict.defects) or 'no defect'}; true up to {verdict.worst}): {well}"


def main() -> int:
    """Run the campaign; return 1 if a combination failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=10_000, help="the first seed")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    began, seeds = time.monotonic(), range(asked.first, asked.first + asked.count)
    parts = [list(seeds[number :: asked.workers]) for number in range(asked.workers)]
    with multiprocessing.get_context("spawn").Pool(asked.workers) as pool:
        found = [one for part in pool.starmap(several, zip(parts, range(len(parts)), strict=True)) for one in part]
    failed = [each for each in found if each.greens]
    can_fail = [each for each in found if each.required != "normal"]
    of_danger = sum(len(each.defects) > 1 and each.required in ("restrict", "evacuate") for each in can_fail)
    print(f"{len(found)} combinations with real processes, seeds {asked.first} to {seeds[-1]}: {len(failed)} failed; "
          f"{len(can_fail)} had to show a level, {of_danger} of them with two or more defects and restrict or worse; "
          f"{sum(each.looks for each in found):,} looks; "
          f"{time.monotonic() - began:.0f} s")  # fmt: skip
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
