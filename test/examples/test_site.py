"""Tests that the commands of the tutorial of a first site show what the tutorial says, in separate processes."""

import contextlib
import importlib.util
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from programs.command_line import ROOT, environment
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.demo.domains import free_domain

PAGE = (ROOT / "docs/tutorial/first-site.md").read_text(encoding="utf-8")
PROGRAMS = {"rpf3d_simulator": "rpf3d_ros.nodes.simulator_node", "rpf3d_acknowledge": "rpf3d_ros.nodes.acknowledge"}
COMPILING, ANSWERING = 600.0, 60.0
"""Longest time (s) until the node has compiled, on a busy machine, and until it has answered."""


def command(start: str) -> list[str]:
    """Return the words of the command of the page that begins with `start`, with this Python."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(start) and "__ns:=/pit_a" in line]
    program, *words = shlex.split(line)
    return [sys.executable, "-u", *(["-m", PROGRAMS[program]] if program in PROGRAMS else []), *words]


class Site:
    """Runs the commands of the page in a folder; they end with the test."""

    def __init__(self, folder: Path, domain: int, ending: contextlib.ExitStack) -> None:
        (folder / "examples").symlink_to(ROOT / "examples")
        self.folder, self.ending = folder, ending
        self.environment = environment(
            ROS_DOMAIN_ID=str(domain), ROS_LOG_DIR=str(folder), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST"
        )

    def start(self, start: str, name: str) -> "subprocess.Popen[bytes]":
        """Start a command of the page; its output is in the file `name`."""
        output = self.ending.enter_context((self.folder / name).open("wb"))
        process = subprocess.Popen(command(start), cwd=self.folder, env=self.environment, stdout=output, stderr=output)
        self.ending.callback(stop, process, signal.SIGKILL)
        return process

    def wait(self, name: str, pattern: str, seconds: float = ANSWERING) -> None:
        """Wait until the last line of the file `name` matches a pattern; the test fails if that takes too long."""
        wait_for(lambda: re.search(pattern, (self.lines(name) or [""])[-1]), seconds, 0.1)

    def lines(self, name: str) -> list[str]:
        """Return the lines of the file `name`."""
        return (self.folder / name).read_text().splitlines()


def stop(process: "subprocess.Popen[bytes]", number: int = signal.SIGINT) -> None:
    """End a process by a signal."""
    process.send_signal(number)
    process.wait(30)


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    """Yield the site of the page in a free domain."""
    domain, lock = free_domain()
    with lock, contextlib.ExitStack() as ending:
        yield Site(tmp_path, domain, ending)


@pytest.mark.long
def test_the_level_of_the_first_site_rises_ends_in_a_fault_and_falls_as_the_tutorial_says(site: Site) -> None:
    simulator = site.start("rpf3d_simulator", "simulator")
    wait_for(lambda: "alert: fault: there is no evidence" in "\n".join(site.lines("simulator")), COMPILING, 0.1)
    site.start("python examples/site/read_alerts.py", "reader")
    site.wait("reader", "FAULT: there is no evidence")
    feed = site.start("python examples/site/feed.py --ros-args", "feed")
    site.wait("reader", "NORMAL: road: no limit is reached")
    stop(feed)
    feed = site.start("python examples/site/feed.py --danger", "danger")
    site.wait("reader", "RESTRICT: road: restrict because .* limit 10 %")
    stop(feed)
    site.wait("reader", "FAULT: the sources are stale")
    site.start("python examples/site/feed.py --ros-args", "feed")
    site.wait("reader", "RESTRICT: ")
    wait_for(lambda: acknowledged(site), ANSWERING, 1.0)
    site.wait("reader", "NORMAL: ")
    stop(simulator, signal.SIGKILL)
    site.wait("reader", "FAULT: ")
    levels = [line.split()[1].rstrip(":") for line in site.lines("reader")]
    changes = [level for level, before in zip(levels, ["", *levels], strict=False) if level != before]
    assert changes == ["FAULT", "NORMAL", "RESTRICT", "FAULT", "RESTRICT", "NORMAL", "FAULT"]


def acknowledged(site: Site) -> bool:
    """Run the acknowledgement of the page; return True if the level has fallen."""
    done = subprocess.run(
        command("rpf3d_acknowledge"), cwd=site.folder, env=site.environment, capture_output=True, text=True, timeout=60
    )
    assert done.returncode in (0, 1), done.stderr
    return done.returncode == 0


def test_the_files_of_the_first_site_are_valid_and_their_areas_have_limits() -> None:
    from rpf3d_core.alerts.site import read_site
    from rpf3d_core.scene.reading import read_scene

    folder = ROOT / "examples/site"
    scene = read_scene(folder / "scene.yaml")
    assert {area.name for area in scene.areas_of_interest} == set(read_site(folder / "site.yaml").areas)


@pytest.mark.parametrize(("nodes", "counts"), [
    ((["simulator"], ["simulator"]), True),
    (([], []), False),
    ((["simulator", "simulator"], ["simulator"]), False),
    ((["simulator"], ["simulator", "simulator"]), False),
    ((["simulator"], ["player"]), False),
])  # fmt: skip
def test_an_alert_counts_for_the_reader_only_if_one_node_publishes_it(nodes: tuple[list[str], ...], counts: bool):
    module = importlib.util.spec_from_file_location("read_alerts", ROOT / "examples/site/read_alerts.py")
    read_alerts = importlib.util.module_from_spec(module)
    module.loader.exec_module(read_alerts)
    now, clock = time.monotonic(), time.time()
    published = dict(zip(("alerts", "alarm"), nodes, strict=True))
    reader = SimpleNamespace(
        until=now + 5, in_order_since=now - 10, alarm=False, resolve_topic_name=str,
        site={"valid_until": str(clock + 5), "stamp": str(clock), "alarm": "false"},
        get_publishers_info_by_topic=lambda topic: [
            SimpleNamespace(node_name=name, node_namespace="") for name in published[topic]
        ],
    )  # fmt: skip
    assert (read_alerts.Reader.why_unknown(reader) == "") is counts
