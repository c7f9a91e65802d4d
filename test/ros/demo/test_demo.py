"""Tests of the demo: its processes, its files, and that nothing still runs after it was interrupted."""

import os
import signal
import subprocess
import sys
import sysconfig
from functools import partial
from pathlib import Path

import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from rpf3d_ros.demo import run as demo

ROOT = Path(__file__).resolve().parents[3]
PATIENCE = 120.0
"""Time limit (s) of a wait: two nodes have 15 s each to end, and a busy machine takes some time to start them."""
wait = partial(wait_for, seconds=PATIENCE, pause=0.05)

PLAYED_WITHIN = 700.0
"""Time limit (s) of a whole demo: the shift takes about 60 s, and its nodes compile first if the cache is empty."""

ELSEWHERE = """
terrain: {files: [{path: slope.obj}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}
sources:
  - {name: top, points: [[2, 10, 25]], rocks: 4}
"""


def is_alive(pid):
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def children_of(pid):
    return [int(child) for child in (Path("/proc") / str(pid) / "task" / str(pid) / "children").read_text().split()]


def play(*arguments):
    """Run the demo to its end with command-line arguments; return the completed process with its output as text."""
    command = [sys.executable, "-m", "rpf3d_ros.demo", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PLAYED_WITHIN, check=False)


@pytest.mark.long
def test_the_shift_leaves_a_recording_that_verifies(tmp_path):
    done = play("--out", tmp_path, "--timeout", 600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "levels of the alert: fault, normal, evacuate, normal\n" in done.stdout, done.stdout
    assert sorted(os.listdir(tmp_path)) == ["demo-decisions", "demo.rrd"]
    audit = [sys.executable, "-m", "rpf3d_core.cli", "audit", str(tmp_path / "demo-decisions")]
    assert subprocess.run(audit, cwd=ROOT, capture_output=True, check=False).returncode == 0
    for entity in demo.ENTITIES:
        assert f"  {entity} " in done.stdout


@pytest.mark.parametrize(("name", "sentence"), [("nowhere", "there is no such scene"), ("slope", "no ground or has")])
def test_a_scene_that_the_shift_cannot_be_played_on_is_refused_in_a_sentence(tmp_path, name, sentence):
    (tmp_path / "slope.obj").write_text("v 0 0 20\nv 40 0 0\nv 40 40 0\nv 0 40 20\nf 1 2 3\nf 1 3 4\n")
    (tmp_path / "slope.yaml").write_text(ELSEWHERE)
    done = play("--scene", tmp_path / f"{name}.yaml", "--out", tmp_path / "out")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert f"{name}.yaml" in done.stderr and sentence in done.stderr


@pytest.mark.long
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
