"""The demo's processes, its files, and what is left of it when it is ended."""

import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from rpf3d_ros import demo

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 60.0
"""Seconds; two nodes each have 15 to end."""


def is_alive(pid):
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def children_of(pid):
    return [int(child) for child in (Path("/proc") / str(pid) / "task" / str(pid) / "children").read_text().split()]


def wait(condition):
    deadline = time.monotonic() + PATIENCE
    while not (answer := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return answer


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_demo_that_is_ended_leaves_no_node_behind(tmp_path, number):
    command = [sys.executable, "-m", "rpf3d_ros.demo", "--out", str(tmp_path), "--timeout", "100"]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    nodes = wait(lambda: len(found := children_of(process.pid)) == 2 and found)
    process.send_signal(number)
    _, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == (-9 if number == signal.SIGKILL else 128 + number)
    assert "Traceback" not in error
    wait(lambda: not any(is_alive(node) for node in nodes))
    assert not (tmp_path / "demo.rrd").exists()


def test_files_come_from_the_source_tree_first_and_then_from_where_pip_put_them(tmp_path, monkeypatch):
    source, installed = tmp_path / "source", tmp_path / "share" / "rpf3d"
    for folder in (source, installed):
        (folder / "config").mkdir(parents=True)
        (folder / "config" / "rpf3d.yaml").touch()
    monkeypatch.setattr(demo, "SOURCE_TREE", source)
    monkeypatch.setattr(demo, "INSTALLED", installed)
    assert demo.shipped("config/rpf3d.yaml") == source / "config" / "rpf3d.yaml"
    (source / "config" / "rpf3d.yaml").unlink()
    assert demo.shipped("config/rpf3d.yaml") == installed / "config" / "rpf3d.yaml"


def test_pip_installs_what_the_demo_asks_for():
    assert Path(sysconfig.get_path("data")) / "share" / "rpf3d" == demo.INSTALLED
    assert "config/scenes/*" in (ROOT / "setup.py").read_text()


def test_a_recording_that_does_not_verify_does_not_get_its_final_name(tmp_path):
    part = tmp_path / "demo.part.rrd"
    part.write_bytes(b"RRF2 and then nothing")
    assert demo._report(part, tmp_path / "demo.rrd") == 1
    assert os.listdir(tmp_path) == ["demo.part.rrd"]
