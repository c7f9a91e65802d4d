"""Measure the time from publishing a message to receiving the live simulator's answer, with real processes.

    python benchmarks/live.py [--only mesh cloud patch burst busy memory rest recorder] [--rounds 10]

Messages are transported over DDS, the network layer of ROS. The figures are medians of the rounds. The measuring
process publishes bytes that it prepared earlier, and notes the time of arrival before it reads a message. A third
process calls a service of the node every 20 ms, which shows how long the node's executor is blocked. The figures are
wall times, so run this on an idle machine: the load is printed.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from live_messages import MARKER, Heights, cloud_bytes, mesh_bytes, poses, raise_mesh, stamp_of, stamped
from live_recorder import recorder_rate
from live_rest import at_rest
from live_stack import Heartbeat, Stack, machine
from live_table import Row, Rows, gaps_of, print_table
from rclpy.serialization import serialize_message

from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain
from rpf3d_ros.demo.stand_in import StandIn

TRIANGLES = 2_332_287  # thesis, table 5-2
PATCH = 71
"""Number of points on each side of a patch of terrain, which has 2 x 70 x 70 (about 10,000) triangles."""
PATCH_AT = (-596.0, -35.0)
"""South-western corner (m) of the patch, on the benches below the sources."""
SOURCES = 20
MANY, FEW = 10_000, 200
"""Numbers of rocks of the first answer: for goals on terrain, and the node's default, for bursts of sources."""
FINEST = 20_000
"""Number of rocks at which an answer is complete, so that rounds do not overlap; the part `busy` has more rocks."""
START, ANSWER, QUIET = 120.0, 60.0, 0.4
"""Waiting times (s): for the start and compilation of a node, for an answer, and until no more results arrive."""
TOLD, BEATING = 2.5, 4.0
"""Waiting times (s): until the last report of a gap, and until the process that calls the node's service has found it.

A gap is a time in which the node's executor is busy and handles no messages. The node reports the longest gap of each
second, and repeats the report for another second. Calls during the discovery must not count: rmw_fastrtps holds a
reply, and the executor with it, for up to 100 ms if it has not yet discovered the caller.
"""

HEARD = ("hazard/grid", "trajectories", "results")
SIMULATOR = "simulator_node"
SERVICE = "rpf3d_simulator/get_parameter_types"
SCENE = """
terrain: {{pit: {{triangles: 2000}}}}
materials: {{default: {{normal_restitution: 0.5, tangential_restitution: 0.8}}}}
rock: {{density: 2700, diameter: 1.0}}
sources: [{{name: messages, points: [[0, 0, 0]]}}]
rebound: constant
ground: none
target: {{most_rocks: {most}}}
hazard: {{cell: 5}}
"""


class Bench:
    """A running simulator with terrain and sources, and the messages received from it.

    came : topic -> time of arrival (ns, monotonic) and bytes of the messages that answer the last sources
    told : messages of /diagnostics; asked_ns : stamp (ns) of the last published sources
    """

    def __init__(self, stack: Stack, first_rocks: int, most_rocks: int, terrain: bytes, places: Any) -> None:
        self.stack, self.places = stack, places
        scene = stack.folder / "scene.yaml"
        scene.write_text(SCENE.format(most=most_rocks))
        stack.start(SIMULATOR, {"scene": scene, "first_rocks": first_rocks, "above_ground": 0.5, "release_speed": 2.0})
        self.stand_in = StandIn(("terrain/mesh", "terrain/points", "terrain/update", "sources"))
        self.came: dict[str, list[tuple[int, bytes]]] = {topic: [] for topic in HEARD}
        for topic, kept in self.came.items():
            self.stand_in.subscribe(topic, lambda data, at, kept=kept, topic=topic: self.take(topic, kept, data, at))  # type: ignore[misc]
        self.told: list[bytes] = []
        self.asked_ns = 0
        self.stand_in.subscribe("/diagnostics", lambda data, at: self.told.append(data))
        if not self.stand_in.wait_for_subscribers(START, alive=lambda: stack.alive(SIMULATOR)):
            raise TimeoutError(f"the simulator does not listen\n{stack.tails()}")
        self.stand_in.publish("terrain/mesh", terrain)
        self.until_answered(lambda: self.stand_in.publish("sources", self.burst()), START)
        self.rest()

    def take(self, topic: str, kept: list[tuple[int, bytes]], data: bytes, at: int) -> None:
        """Store a message in `kept` if it answers the last published sources; at : time of arrival (ns, monotonic)."""
        first = data[MARKER:] if topic == "trajectories" else data  # markers begin with their number
        if stamp_of(first) >= self.asked_ns:
            kept.append((at, data))

    def burst(self) -> bytes:
        """Return the sources as a message with the current time.

        Answers to earlier sources are ignored from now on.
        """
        self.asked_ns = time.time_ns()
        return bytes(serialize_message(poses(self.places, self.asked_ns)))

    def until_answered(self, send: Callable[[], int], seconds: float = ANSWER) -> tuple[int, dict[str, int]]:
        """Publish a message, and wait until an answer to it has arrived on each topic.

        Returns the time at which publishing began, and the time of the first answer on each topic (ns, monotonic).
        send : publishes the message; seconds : longest wait, then TimeoutError is raised
        """
        for kept in self.came.values():
            kept.clear()
        began = send()
        ended = not self.stand_in.wait(lambda: all(self.came.values()) or not self.stack.alive(SIMULATOR), seconds)
        missing = [topic for topic, kept in self.came.items() if not kept]
        if ended or missing:
            raise TimeoutError(f"no {', '.join(missing)} within {seconds:g} s\n{self.stack.tails()}")
        return began, {topic: kept[0][0] for topic, kept in self.came.items()}

    def rest(self, longest: float = ANSWER) -> None:
        """Wait until no more results arrive, so that rounds do not overlap."""
        deadline = time.monotonic() + longest
        while time.monotonic() < deadline:
            before = len(self.came["results"])
            self.stand_in.wait(lambda: len(self.came["results"]) > before, QUIET)  # noqa: B023
            if len(self.came["results"]) == before:
                return

    def rounds(self, name: str, goal: float, count: int, send: Callable[[int], Callable[[], int]]) -> Rows:
        """Return the measurements of `count` rounds: delays of answers, gaps reported by the node, service calls.

        name : name of the measurement in the table; goal : longest time (s) until the last required message
        send : prepares the message of round number n, and returns the function that publishes it
        """
        row = Row(name, goal)
        began, came = self.until_answered(send(0), START)  # includes compilation
        row.first = (max(came.values()) - began) / 1e9
        self.rest(3.0)
        with Heartbeat(SERVICE) as heartbeat:
            self.stand_in.wait(lambda: False, BEATING)  # receives the reports of this time, which must not count later
            begins = time.monotonic_ns()
            self.told.clear()
            for number in range(count):
                publish = send(number + 1)  # prepares the message before the measurement
                cpu = self.stack.cpu(SIMULATOR)
                began, came = self.until_answered(publish)
                row.add(began, came, self.came["results"][0][1])
                row.cpu.append(self.stack.cpu(SIMULATOR) - cpu)
                self.rest(3.0)
            self.stand_in.wait(lambda: False, TOLD)
            beats = [beat for beat in heartbeat.stop() if beat[1] >= begins]
        return Rows(row, beats, gaps_of(self.told))

    def close(self) -> None:
        """End the simulator of this measurement."""
        self.stand_in.__exit__()
        self.stack.end(SIMULATOR)


class Bytes:
    """All messages to publish, prepared as bytes, so that their preparation is not measured.

    mesh : the terrain as a mesh; grid : (H, W, 3) m, the terrain as a grid of points; patches : patches of terrain
    places : (S, 3) m, positions of the sources
    """

    def __init__(self, triangles: int) -> None:
        terrain = pit_terrain(Pit(triangles=triangles))
        heights, (low, high) = Heights(terrain), (terrain.vertices.min(axis=0), terrain.vertices.max(axis=0))
        self.mesh = mesh_bytes(terrain)
        points = 1 + int(np.sqrt(triangles / 2.0))
        step = float(min(high[:2] - low[:2])) / points
        x, y = (0.5 * (low[:2] + high[:2]) - 0.5 * step * (points - 1) + np.array(terrain.frame.origin[:2])).tolist()
        self.grid = heights.grid(x, y, step, points, points)
        self.patches = [cloud_bytes(_bump(heights, 0.5 + 0.05 * number)) for number in range(20)]
        line = np.column_stack([np.full(SOURCES, -606.7), np.linspace(-150.0, 150.0, SOURCES)])
        self.places = np.column_stack([line, heights.at(line)])

    def cloud(self, number: int) -> bytes:
        """Return the grid as a message; its first corner is raised by 0.02 m times `number`, so messages differ."""
        grid = self.grid.copy()
        grid[0, 0, 2] += 0.02 * number
        return cloud_bytes(grid)


def _bump(heights: Heights, height: float) -> Any:
    """Return the ground of a patch with a heap of `height` (m) in its middle, as points (PATCH, PATCH, 3) m."""
    grid = heights.grid(*PATCH_AT, 1.0, PATCH, PATCH)
    i, j = np.ogrid[:PATCH, :PATCH]
    distance = np.hypot(i - PATCH // 2, j - PATCH // 2) / (0.4 * PATCH)
    grid[..., 2] += height * np.clip(1.0 - distance, 0.0, None)
    return grid


def memory(bench: Bench, data: Bytes, updates: int) -> None:
    """Print how the node's memory (MB) changes over many updates of the whole terrain.

    Each update is answered before the next update is published.
    """
    sizes = []
    for number in range(updates):
        mesh = raise_mesh(data.mesh, 100 + number)
        bench.until_answered(lambda mesh=mesh: bench.stand_in.publish("terrain/mesh", mesh))  # type: ignore[misc]
        sizes.append(bench.stack.memory(SIMULATOR))
        if number % max(updates // 10, 1) == 0:
            print(f"  after {number + 1:4} updates {sizes[-1][0]:8.0f} MB, at most {sizes[-1][1]:8.0f} MB", flush=True)
    half = np.array([now for now, _ in sizes])[updates // 2 :]
    slope = float(np.polyfit(np.arange(len(half)), half, 1)[0]) if len(half) > 1 else float("nan")
    print(f"memory over {updates} whole updates: {half[-1]:.0f} MB at the end, at most {sizes[-1][1]:.0f} MB (goal "
          f"3000), {slope:+.3f} MB an update over the second half (goal: flat)")  # fmt: skip


def measure(options: argparse.Namespace, data: Bytes) -> list[Rows]:
    """Measure the requested parts that are rows of the table, and return these rows; measure and print `memory`."""
    rows, wanted, count = [], options.only, options.rounds
    if {"mesh", "cloud", "patch", "memory"} & set(wanted):
        with Stack() as stack:
            bench = Bench(stack, MANY, MANY, bytes(data.mesh), data.places)
            try:
                rows += [_terrain(bench, data, part, count) for part in ("mesh", "cloud", "patch") if part in wanted]
                if "memory" in wanted:
                    memory(bench, data, options.updates)
            finally:
                bench.close()
    for part, most in (("burst", FINEST), ("busy", 10_000_000)):
        if part in wanted:
            with Stack() as stack:
                bench = Bench(stack, FEW, most, bytes(data.mesh), data.places)
                try:
                    rows += _bursts(bench, data, part, count)
                finally:
                    bench.close()
    return rows


def _terrain(bench: Bench, data: Bytes, part: str, count: int) -> Rows:
    def mesh(number: int) -> Callable[[], int]:
        laid_out = raise_mesh(data.mesh, number + 1)
        return lambda: bench.stand_in.publish("terrain/mesh", laid_out)

    def cloud(number: int) -> Callable[[], int]:
        laid_out = stamped(data.cloud(number))
        return lambda: bench.stand_in.publish("terrain/points", laid_out)

    what = {
        "mesh": (f"Mesh of {options_triangles(data)}", 1.5, mesh),
        "cloud": (f"organised cloud, {2 * (len(data.grid) - 1) ** 2:,} triangles", 1.5, cloud),
        "patch": ("patch of 9,800 triangles", 0.15, lambda number: _patch(bench, data, number)),
    }
    name, goal, send = what[part]
    return bench.rounds(f"{name}, {MANY:,} rocks", goal, count, send)


def options_triangles(data: Bytes) -> str:
    """Return the number of triangles of the mesh as text for the table."""
    return f"{int.from_bytes(data.mesh[4:8], 'little'):,} triangles"


def _patch(bench: Bench, data: Bytes, number: int) -> Callable[[], int]:
    laid_out = stamped(data.patches[number % len(data.patches)])
    return lambda: bench.stand_in.publish("terrain/update", laid_out)


def _bursts(bench: Bench, data: Bytes, part: str, count: int) -> list[Rows]:
    def burst(number: int) -> Callable[[], int]:
        laid_out = bench.burst()
        return lambda: bench.stand_in.publish("sources", laid_out)

    if part == "busy":
        return [bench.rounds(f"burst of {SOURCES}, while one is refined", 0.1, count, burst)]
    rows = [bench.rounds(f"burst of {SOURCES} sources, {FEW} rocks", 0.1, count, burst)]
    return [*rows, bench.rounds(f"patch, {FEW} rocks", 0.15, count, lambda number: _patch(bench, data, number))]


def _at_rest(data: Bytes) -> bool:
    """Measure the node after an answer, without messages; return True if the goal is missed."""
    with Stack() as stack:
        bench = Bench(stack, FEW, FINEST, bytes(data.mesh), data.places)
        try:
            return at_rest(bench, SIMULATOR)
        finally:
            bench.close()


PARTS = ("mesh", "cloud", "patch", "burst", "busy", "memory", "rest", "recorder")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the table, and return 1 if a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, help="parts to measure")
    parser.add_argument("--rounds", type=int, default=10, help="rounds of each")
    parser.add_argument("--triangles", type=int, default=TRIANGLES, help="of the terrain")
    parser.add_argument("--updates", type=int, default=50, help="whole terrains of the part `memory`")
    options = parser.parse_args(arguments)
    if not HAS_NUMBA:
        print("the goals are for the compiled engine, which needs numba", file=sys.stderr)
        return 1
    print(machine(), flush=True)
    data = Bytes(options.triangles)
    rows = measure(options, data)
    missed = "rest" in options.only and _at_rest(data)
    missed |= "recorder" in options.only and recorder_rate(bytes(data.mesh), data.places)
    return print_table(rows) or int(missed)


if __name__ == "__main__":
    sys.exit(main())
