"""Measure the recorder while the simulator answers messages of sources: CPU time, bytes written, memory, delays.

Simulator and recorder are separate processes. The sources move a little from message to message, as measured positions
do, so no answer repeats an earlier answer. An area on the benches has thresholds, so alerts are published as well.
"""

import time
from pathlib import Path

import numpy as np
from live_messages import Floats, poses, stamp_of
from live_stack import Stack
from rclpy.serialization import serialize_message

from rpf3d_core.recordings.content import bytes_by_entity
from rpf3d_ros.demo.stand_in import StandIn

SIMULATOR, RECORDER = "simulator_node", "recorder_node"
PERIOD = 2.0
"""Time (s) between two messages of sources."""
START, WARM, MEASURED = 300.0, 60.0, 60.0
"""Times (s): longest wait for the start of the nodes, time to warm up, and duration of the measurement."""
MOVED = 0.2
"""Largest offset (m), along x and along y, of a source from its place in a message."""
CORES, RATE = 0.1, 0.5
"""Goals: cores that the recorder uses (-), megabytes per second that its file grows."""
MEDIAN, P95 = 0.1, 0.3
"""Goals (s): time from publishing sources to receiving the first `results`."""
SHIFT = 12 * 3600.0
"""Length (s) of a shift of 12 hours, for the size of its recording."""
LARGEST = 8
"""Number of entities of the recording that are printed; they are those with the most bytes."""
MB = 1e6

SCENE = """
terrain: {pit: {triangles: 2000}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
rock: {density: 2700, diameter: 1.0}
sources: [{name: messages, points: [[0, 0, 0]]}]
ground: sliding
target: {half_width: 0.02, most_rocks: 100000}
areas_of_interest: [{name: bench, polygons: [[-575, -100], [-545, -100], [-545, 100], [-575, 100]]}]
"""
SITE = """
site: benchmark
valid_s: 10
alarm_from: restrict
evidence: {sources_max_age_s: 30, terrain_max_age_s: 86400, clock_tolerance_s: 0.5, fewest_rocks: 40,
           most_unfinished: 0.02, reach_probability_is: share}
areas: {bench: {watch: {reach_probability: 0.1}, restrict: {reach_probability: 0.5}}}
"""


class Shift:
    """Runs simulator and recorder, publishes sources every PERIOD seconds, and notes the delays of the answers.

    file : the recording
    seconds : stamp of a message of sources (ns) -> time (s) from its publication to its first `results`
    """

    def __init__(self, stack: Stack, terrain: bytes, places: Floats) -> None:
        """Start both nodes and publish the terrain.

        terrain : CDR bytes of the mesh; places : (S, 3) m, positions of the sources
        """
        self._stack, self._places, self._rng = stack, places, np.random.default_rng(1)
        self.file, self.seconds = stack.folder / "live.rrd", dict[int, float]()
        for name, text in (("scene.yaml", SCENE), ("site.yaml", SITE)):
            (stack.folder / name).write_text(text)
        given = {"scene": stack.folder / "scene.yaml", "site_file": stack.folder / "site.yaml"}
        stack.start(SIMULATOR, {**given, "above_ground": 0.5, "release_speed": 2.0})
        stack.start(RECORDER, {"file": self.file})
        self._stand_in = StandIn(("terrain/mesh", "sources"))
        self._stand_in.subscribe("results", self._note)
        if not self._stand_in.wait_for_subscribers(START, count=2, alive=self._alive):
            raise TimeoutError(f"a node does not listen\n{stack.tails()}")
        self._stand_in.publish("terrain/mesh", terrain)

    def live(self, seconds: float) -> None:
        """Publish sources every PERIOD seconds for some time (s), and receive results in the meantime."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            due, stamp = time.monotonic() + PERIOD, time.time_ns()
            moved = self._places.copy()
            moved[:, :2] += self._rng.uniform(-MOVED, MOVED, (len(moved), 2))
            self._stand_in.publish("sources", bytes(serialize_message(poses(moved, stamp))))
            self._stand_in.wait(lambda: not self._alive(), max(due - time.monotonic(), 0.0))
            if not self._alive():
                raise RuntimeError(f"a node has ended\n{self._stack.tails()}")

    def close(self) -> None:
        """End both nodes, the recorder first."""
        self._stand_in.__exit__()
        self._stack.end(RECORDER)
        self._stack.end(SIMULATOR)

    def _note(self, data: bytes, at: int) -> None:
        stamp = stamp_of(data)
        self.seconds.setdefault(stamp, (time.time_ns() - stamp) / 1e9)

    def _alive(self) -> bool:
        return self._stack.alive(SIMULATOR) and self._stack.alive(RECORDER)


def recorder_rate(terrain: bytes, places: Floats) -> bool:
    """Print what the recorder uses in MEASURED seconds of messages; return True if a goal is missed.

    terrain, places : as in `Shift`
    """
    with Stack() as stack:
        shift = Shift(stack, terrain, places)
        shift.live(WARM)
        shift.seconds.clear()
        before, began = _state(stack, shift.file), time.monotonic()
        shift.live(MEASURED)
        took, after = time.monotonic() - began, _state(stack, shift.file)
        shift.close()
        rates = {name: (after[name] - before[name]) / took for name in before}
        missed = _report(rates, after["memory"], list(shift.seconds.values()))
        for entity, count in sorted(bytes_by_entity(shift.file).items(), key=lambda item: -item[1])[:LARGEST]:
            print(f"  {entity:40} {count / MB:8.2f} MB of the whole file")
    return missed


def _state(stack: Stack, file: Path) -> dict[str, float]:
    """Return the CPU time (s) of both nodes so far, the present size of the file and the recorder's memory (bytes)."""
    used = {name: stack.cpu(name) for name in (SIMULATOR, RECORDER)}
    return {**used, "file": float(file.stat().st_size), "memory": MB * stack.memory(RECORDER)[0]}


def _report(rates: dict[str, float], memory: float, seconds: list[float]) -> bool:
    """Print the figures, and return True if a goal is missed.

    rates : growth per second of the values of `_state`, by name; memory : memory of the recorder (bytes)
    seconds : delays of the answers (s)
    """
    cores, rate = rates[RECORDER], rates["file"] / MB
    median, p95 = (float(np.percentile(seconds, share)) for share in (50, 95)) if seconds else (np.nan, np.nan)
    print(f"recorder, {len(seconds)} bursts: {100 * cores:.1f} % of a core (goal {100 * CORES:g}), "
          f"{rate:.3f} MB/s (goal {RATE:g}), in a shift of 12 hours {rate * SHIFT / 1e3:.1f} GB; memory "
          f"{memory / MB:.0f} MB, {rates['memory'] * 60.0 / MB:+.1f} MB per minute")  # fmt: skip
    print(f"simulator: {100 * rates[SIMULATOR]:.1f} % of a core; sources to results: median {1e3 * median:.0f} ms "
          f"(goal {1e3 * MEDIAN:g}), 95 % {1e3 * p95:.0f} ms (goal {1e3 * P95:g})", flush=True)  # fmt: skip
    return not (cores <= CORES and rate <= RATE and median <= MEDIAN and p95 <= P95)
