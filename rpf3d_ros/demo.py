"""The three nodes on one scene, each in a process of its own, until the results are recorded.

`python -m rpf3d_ros.demo --scene config/scenes/demo.yaml --out out/demo-ros` leaves a .rrd that
`rerun rrd verify` accepts; exit code 0 where it does and nothing is missing in it, 1 otherwise,
128 + its number after a signal.
"""

import argparse
import os
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.content import rows_by_entity, verify
from rpf3d_ros.demo_processes import ended, isolated_environment, node_process, tails

SOURCE_TREE = Path(__file__).resolve().parent.parent
INSTALLED = Path(sysconfig.get_path("data")) / "share" / "rpf3d"
"""Where pip puts the files that are no code."""

EXPECTED = ("terrain/mesh", "sources", "trajectories", "trajectories/points", "impacts", "deposits", "hazard/zones")
"""Topics that must have been recorded."""

ENTITIES = ("/terrain", "/sources", "/trajectories", "/trajectories/points", "/impacts", "/hazard/passed")
"""What the recording must hold; /deposits and /hazard/stopped depend on whether a rock stays."""


def main(args: Sequence[str] | None = None) -> int:
    """Run the demo; 0 or 1."""
    options = _options(args)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end)
    options.out.mkdir(parents=True, exist_ok=True)
    finished, recording = options.out / "demo.rrd", options.out / "demo.part.rrd"
    for old in (finished, recording):
        old.unlink(missing_ok=True)
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="rpf3d_ros_") as logs:
        missing = _record(options, recording, Path(logs))
    if missing:
        print(f"after {options.timeout:g} s nothing was recorded from: {', '.join(missing)}", file=sys.stderr)
        return 1
    print(f"recorded in {time.monotonic() - began:.1f} s")
    return _report(recording, finished)


def shipped(name: str) -> Path:
    """A file of the package that is no code, such as config/rpf3d.yaml: of the source tree, or as installed."""
    return next((folder / name for folder in (SOURCE_TREE, INSTALLED) if (folder / name).is_file()), INSTALLED / name)


def _end(number: int, frame: object) -> None:
    """Leave through every `finally`, which ends the nodes; a second signal does not disturb that."""
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)
    sys.exit(128 + number)


def _options(args: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", type=Path, default=shipped("config/scenes/demo.yaml"), help="scene file")
    parser.add_argument("--out", type=Path, default=Path("out/demo-ros"), help="folder for demo.rrd")
    parser.add_argument("--params-file", type=Path, default=shipped("config/rpf3d.yaml"), help="ROS parameter file")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds to wait for the results")
    return parser.parse_args(args)


def _record(options: argparse.Namespace, recording: Path, logs: Path) -> list[str]:
    """Run the nodes until every expected topic was recorded, or time is up; the topics that are missing."""
    # The environment is this process' own: it listens in the same domain. Children start before rclpy does.
    os.environ.update(isolated_environment(logs))
    common = ["--params-file", str(options.params_file)]
    nodes = {
        "recorder": ["-p", f"file:={recording}"],
        "simulator": [],
        "scene_publisher": ["-p", f"scene:={options.scene}", "-p", "subscribers:=2"],
    }
    processes: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, own in nodes.items():
            processes[name] = node_process(f"{name}_node", [*common, *own], logs)
        missing = _wait_for_topics(options.timeout, list(processes.values()))
    finally:
        codes = {name: ended(process) for name, process in reversed(list(processes.items()))}
    if missing or any(codes.values()):
        print(f"exit codes: {codes}", file=sys.stderr)
        print(tails(logs), file=sys.stderr)
    return missing or [name for name, code in codes.items() if code]


def _wait_for_topics(timeout: float, processes: list[subprocess.Popen[bytes]]) -> list[str]:
    """Listen to the recorder's diagnostics until it has recorded every expected topic; those still missing."""
    from rpf3d_ros.diagnostic_listener import DiagnosticListener  # starts DDS threads: after the children
    from rpf3d_ros.message_log import COUNT_OF_RECORDED

    deadline = time.monotonic() + timeout
    missing = list(EXPECTED)
    with DiagnosticListener() as listener:
        while missing and time.monotonic() < deadline and all(process.poll() is None for process in processes):
            recorded = listener.spin_once().get(COUNT_OF_RECORDED)
            missing = [topic for topic in EXPECTED if recorded is None or topic not in recorded.values]
        for health in listener.healths.values():
            print(f"  {health.name}: {health.message}", *(f"{k}={v}" for k, v in health.values.items()))
    return missing


def _report(recording: Path, finished: Path) -> int:
    """Verify the recording, give it its final name and print what it holds; 0 where nothing is missing."""
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
