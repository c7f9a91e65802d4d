"""Print the measurements of the live benchmark as tables: delays with their goals, and the parts of each delay."""

from dataclasses import dataclass, field

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message

MS = 1e6
BLOCKED = 0.05
"""Goal: longest time (s) for which the node's executor, which handles its messages, may be blocked."""


@dataclass
class Row:
    """The rounds of one measurement: delays, results and CPU time of each round.

    name : name of the measurement in the table; goal : longest time (s) until the last required message
    first : delay (s) of the first round, which does not count, because the node compiles
    cpu : CPU seconds of the node in each round
    seconds : topic -> delay (s), for each round; results : the message of `results` of each round
    """

    name: str
    goal: float
    first: float = float("nan")
    cpu: list[float] = field(default_factory=list)
    seconds: list[dict[str, float]] = field(default_factory=list)
    results: list[bytes] = field(default_factory=list)

    def add(self, began_ns: int, came_ns: dict[str, int], result: bytes) -> None:
        """Add a round.

        began_ns : when publishing began; came_ns : topic -> when its first answer arrived (both ns, monotonic)
        result : the first message of `results` (CDR bytes)
        """
        self.seconds.append({topic: (at - began_ns) / 1e9 for topic, at in came_ns.items()})
        self.results.append(result)

    def of(self, topic: str) -> "np.ndarray":
        """Return the delays (s) of the answers on a topic, one for each round."""
        return np.array([each[topic] for each in self.seconds])

    def stages(self) -> dict[str, float]:
        """Return the medians (s) of three parts of the delay, by name: before the flight, the flight, and publishing.

        The first part covers transport, building the terrain, and the wait for the thread that flies. The third part is
        the time from `hazard/grid` to `results`.
        """
        flown = np.array([float(figures_of(result)["seconds"]) for result in self.results])
        grid = self.of("hazard/grid")
        parts = {"until it flies": grid - flown, "flying and tallies": flown, "publishing": self.of("results") - grid}
        return {name: float(np.median(seconds)) for name, seconds in parts.items()}


@dataclass(frozen=True)
class Rows:
    """The rounds of one measurement, with signs that the node was blocked: service calls and gaps of the executor.

    beats : times at which each call was due, sent and answered (ns)
    gaps : longest gap (s) of each second, as reported by the node

    The goal is for `gaps`, which the node measures itself: the times for which its executor was busy. The calls show
    the same delays from outside, plus the transport of request and reply and the scheduling of two processes.
    """

    row: Row
    beats: list[tuple[int, int, int]]
    gaps: list[float]

    @property
    def longest_gap(self) -> float:
        """The longest gap (s) of the executor that the node reported; NaN if the node reported none."""
        return max(self.gaps, default=float("nan"))

    @property
    def longest_call(self) -> float:
        """The longest call of the service (s); NaN if no call was answered."""
        return max((answered - sent for _, sent, answered in self.beats), default=float("nan")) / 1e9

    @property
    def longest_delay(self) -> float:
        """The longest delay (s) of the calling process itself, by which the machine may extend any call."""
        return max((sent - due for due, sent, _ in self.beats), default=float("nan")) / 1e9

    @property
    def usual_call(self) -> float:
        """The time (s) that 99 % of the service calls do not exceed; NaN if no call was answered."""
        gaps = [answered - sent for _, sent, answered in self.beats]
        return float(np.percentile(gaps, 99)) / 1e9 if gaps else float("nan")


def figures_of(result: bytes) -> dict[str, str]:
    """Return the values of a `results` message by key, from its CDR bytes."""
    array = deserialize_message(result, DiagnosticArray)
    return {pair.key: pair.value for status in array.status for pair in status.values}


def gaps_of(diagnostics: list[bytes]) -> list[float]:
    """Return the longest gap (s) of the node's executor in each second, from messages of /diagnostics."""
    told = [pair.value for data in diagnostics for status in deserialize_message(data, DiagnosticArray).status
            if status.name.endswith(": executor") for pair in status.values if pair.key == "gap_ms"]  # fmt: skip
    return [float(value) / 1e3 for value in told]


def print_table(rows: list[Rows]) -> int:
    """Print the tables of all measurements; return 1 if a goal is missed."""
    if not rows:
        return 0
    print(f"\n{'milliseconds':52} {'goal':>6} {'median':>7} {'least':>7} {'most':>7} {'first':>7} "
          f"{'CPU':>6} {'trajectories':>12} {'rounds':>6}")  # fmt: skip
    missed = False
    for each in rows:
        row, grid = each.row, each.row.of("hazard/grid")
        last = np.maximum(grid, row.of("trajectories"))
        missed |= float(np.median(last)) > row.goal
        figures = f"{1e3 * np.median(last):7.0f} {1e3 * last.min():7.0f} {1e3 * last.max():7.0f}"
        cpu = 1e3 * float(np.median(row.cpu)) if row.cpu else float("nan")
        print(f"{row.name:52} {1e3 * row.goal:6.0f} {figures} {1e3 * row.first:7.0f} {cpu:6.0f} "
              f"{1e3 * np.median(row.of('trajectories')):12.0f} {len(grid):6}")  # fmt: skip
    print(f"\n{'executor of the node, milliseconds':52} {'goal':>6} {'longest':>7}   {'calls':>6} {'99 %':>7} "
          f"{'longest':>7}   {'own delay':>9}")  # fmt: skip
    for each in rows:
        missed |= not each.longest_gap <= BLOCKED
        calls = f"{len(each.beats):6} {1e3 * each.usual_call:7.1f} {1e3 * each.longest_call:7.0f}"
        print(f"{each.row.name:52} {1e3 * BLOCKED:6.0f} {1e3 * each.longest_gap:7.0f}   {calls}   "
              f"{1e3 * each.longest_delay:9.0f}")  # fmt: skip
    print("\nwhere the time goes, milliseconds, medians")
    for each in rows:
        print(f"{each.row.name:52} {', '.join(f'{k} {1e3 * v:.0f}' for k, v in each.row.stages().items())}")
    return int(missed)
