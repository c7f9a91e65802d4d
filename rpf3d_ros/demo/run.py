"""Five minutes of a shift, in time lapse: simulator and recorder run on a simulated clock in separate processes.

`python -m rpf3d_ros.demo.run --out out/demo-ros` plays survey, radar and operator (`shift.py`), while the nodes answer,
decide and record. The demo writes the decision log and a .rrd file that `rerun rrd verify` accepts. The exit code is 0
if both are complete, 1 otherwise, or 128 + the signal's number after a signal. The clock runs in real time while an
answer is awaited, and fast through quiet stretches; with `--real-time` the demo takes five minutes.
"""

import argparse
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from rpf3d_core.alerts.log_files import files_in
from rpf3d_core.errors import InputError
from rpf3d_core.recordings.content import rows_by_entity, verify
from rpf3d_ros.demo.processes import ended, isolated_environment, node_process, tails
from rpf3d_ros.demo.shift_content import ShiftContent, shift_content
from rpf3d_ros.nodes.leaving import unless_signalled

SOURCE_TREE = Path(__file__).resolve().parents[2]
INSTALLED = Path(sysconfig.get_path("data")) / "share" / "rpf3d"
"""Folder in which pip installs data files."""

EXPECTED = (
    "terrain/mesh", "terrain/update", "sources", "trajectories", "trajectories/points", "impacts", "deposits",
    "hazard/grid", "hazard/points", "hazard/zones", "results", "alerts", "alarm",
)  # fmt: skip
"""Topics that the recorder must have recorded."""

ENTITIES = ("/terrain", "/sources", "/trajectories", "/trajectories/points", "/impacts", "/alerts", "/alert_level")
"""Parts of the recording that must exist; /deposits is not among them, because possibly no rock stops."""

LEVELS = ("evacuate", "normal")
"""Alert levels that the site must show, in this order: one alert rises and falls."""

SPEED = 20.0
"""Seconds of the shift per second of wall-clock time, while no answer is awaited."""

BEGINS_NS = 1_767_250_800_000_000_000
"""The shift begins on 2026-01-01 at 07:00 UTC."""

EARLIER_NS = 600_000_000_000
"""Time (ns) by which the clock begins before the shift; when the nodes are ready, the clock jumps to the shift."""

SOURCES = 12

DECISIONS = "demo-decisions"
"""Folder of the decision log, next to the recording; no node uses this name by default."""


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo; return the exit code: 0 after success, 1 after a failure, 128 + N after signal N."""
    options = _options(args)
    return unless_signalled(lambda: _demo(options))


def _demo(options: argparse.Namespace) -> int:
    try:
        return _played(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1


def _played(options: argparse.Namespace) -> int:
    options.out.mkdir(parents=True, exist_ok=True)
    finished, recording = options.out / "demo.rrd", options.out / "demo.part.rrd"
    for old in (finished, recording):
        old.unlink(missing_ok=True)
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="rpf3d_ros_") as logs:
        missing = _record(options, recording, Path(logs))
        if not missing:
            _keep_decisions(Path(logs) / DECISIONS, options.out / DECISIONS)
    if missing:
        print(f"after {options.timeout:g} s nothing was received on: {', '.join(missing)}", file=sys.stderr)
        return 1
    print(f"recorded in {time.monotonic() - began:.1f} s; decisions: rpf3d audit {options.out / DECISIONS}")
    return _report(recording, finished)


def _keep_decisions(made: Path, kept: Path) -> None:
    """Replace the decision log in the folder `kept` by a copy of the decision log in `made`; other files stay."""
    kept.mkdir(exist_ok=True)
    for _, old in files_in(kept):
        old.unlink()
    for _, new in files_in(made):
        shutil.copy(new, kept)


def shipped(name: str) -> Path:
    """Return the path of a data file of the package, such as config/rpf3d.yaml, in the source tree or as installed.

    If the file is in neither place, return the path in the folder for installed files.
    """
    return next((folder / name for folder in (SOURCE_TREE, INSTALLED) if (folder / name).is_file()), INSTALLED / name)


def _options(args: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", type=Path, default=shipped("config/scenes/shift.yaml"), help="scene file")
    parser.add_argument("--site", type=Path, default=shipped("config/site_shift.yaml"), help="thresholds of the alerts")
    parser.add_argument("--out", type=Path, default=Path("out/demo-ros"), help="folder for demo.rrd")
    parser.add_argument("--speed", type=_speed, default=SPEED, help="of the clock in quiet stretches, at least 1")
    parser.add_argument("--real-time", dest="speed", action="store_const", const=1.0, help="take the five minutes")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds to wait for nodes to start and to record")
    return parser.parse_args(args)


def _speed(text: str) -> float:
    """Return the speed of the clock (-). Raises ArgumentTypeError below 1, at which the clock would jump back."""
    speed = float(text)
    if not 1.0 <= speed < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of at least 1")
    return speed


def _record(options: argparse.Namespace, recording: Path, logs: Path) -> list[str]:
    """Start the nodes, play the shift, wait until everything is recorded, and end the nodes.

    Return what is missing, as words for a message: topics, alert levels, or nodes that failed; empty if all is well.
    """
    # This process subscribes in the same domain, so it takes the same environment. Child processes start before rclpy.
    os.environ.update(isolated_environment(logs))
    content = shift_content(options.scene, SOURCES)
    nodes = {
        "recorder": {"file": recording},
        "simulator": {
            "scene": options.scene, "site_file": options.site, "decision_log": logs / DECISIONS,
            "above_ground": 0.5, "release_speed": content.speed, "position_spread": 1.0, "velocity_spread": 0.3,
        },
    }  # fmt: skip
    processes: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, own in nodes.items():
            given = [word for key, value in own.items() for word in ("-p", f"{key}:={value}")]
            processes[name] = node_process(f"{name}_node", ["-p", "use_sim_time:=true", *given], logs)
        missing = _play(options, content, list(processes.values()))
    except InputError as error:
        print(error, file=sys.stderr)
        missing = ["an answer"]
    finally:
        codes = {name: ended(process) for name, process in reversed(list(processes.items()))}
    if missing or any(codes.values()):
        print(f"exit codes: {codes}", file=sys.stderr)
        print(tails(logs), file=sys.stderr)
    return missing or [name for name, code in codes.items() if code]


def _play(options: argparse.Namespace, content: ShiftContent, processes: list[subprocess.Popen[bytes]]) -> list[str]:
    """Play the shift to the nodes; return what is missing, as words for a message: nodes, alert levels or topics."""
    from rpf3d_ros.demo.shift import LENGTH, Shift
    from rpf3d_ros.demo.stand_in import StandIn  # starts DDS threads, so it is imported after the child processes start
    from rpf3d_ros.interface.simulated_clock import SimulatedClock

    published = ("terrain/mesh", "terrain/update", "sources")
    with StandIn(published) as stand_in, SimulatedClock(stand_in.node, BEGINS_NS - EARLIER_NS) as clock:
        if not stand_in.wait_for_subscribers(options.timeout, len(processes), lambda: _all_run(processes)):
            return ["the nodes"]
        clock.skip_to(BEGINS_NS)
        shift = Shift(content, stand_in, clock, options.speed)
        print(f"a shift of {LENGTH:g} s, its quiet stretches {options.speed:g} times as fast", flush=True)
        shift.play(lambda sentence: print(sentence, flush=True))
        print(f"  levels of the alert: {', '.join(shift.levels)}")
        missing_levels = [] if _in_order(LEVELS, shift.levels) else [f"the levels {' and '.join(LEVELS)}"]
        return missing_levels + _wait_for_topics(options.timeout, processes)


def _all_run(processes: list[subprocess.Popen[bytes]]) -> bool:
    return all(process.poll() is None for process in processes)


def _in_order(wanted: Sequence[str], received: Sequence[str]) -> bool:
    """True if the received alert levels contain all wanted levels, in the wanted order."""
    rest = iter(received)
    return all(level in rest for level in wanted)


def _wait_for_topics(timeout: float, processes: list[subprocess.Popen[bytes]]) -> list[str]:
    """Wait until the recorder has recorded every expected topic, or a node has ended; return the missing topics.

    timeout : longest time to wait (s)
    """
    from rpf3d_ros.demo.diagnostic_listener import DiagnosticListener  # starts DDS threads, so not at the top
    from rpf3d_ros.recording.alert_entries import COUNT_OF_RECORDED

    deadline = time.monotonic() + timeout
    missing = list(EXPECTED)
    with DiagnosticListener() as listener:
        while missing and time.monotonic() < deadline and _all_run(processes):
            recorded = listener.spin_once().get(COUNT_OF_RECORDED)
            missing = [topic for topic in EXPECTED if recorded is None or topic not in recorded.values]
        for health in listener.healths.values():
            print(f"  {health.name}: {health.message}", *(f"{k}={v}" for k, v in health.values.items()))
    return missing


def _report(recording: Path, finished: Path) -> int:
    """Verify the recording and print its numbers of rows; return 1 if the recording is damaged or incomplete, else 0.

    A complete recording is renamed to `finished`.
    """
    try:
        verify(recording)
        rows = rows_by_entity(recording)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    missing = [entity for entity in ENTITIES if not rows.get(entity)]
    if not missing:
        recording = recording.rename(finished)
    print(f"{recording} ({recording.stat().st_size / 1e6:.1f} MB) verifies; rows by entity:")
    for entity, count in sorted(rows.items()):
        print(f"  {entity:28} {count:6}")
    if missing:
        print(f"missing: {', '.join(missing)}", file=sys.stderr)
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
