"""Tests of a node's process, from its first import to its exit code."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

ROOT = Path(__file__).resolve().parents[3]
NODES = ("simulator_node", "recorder_node", "scene_publisher_node")
IMPORTED_EARLY = ("rclpy", "rclpy.executors", "rpf3d_ros.interface.parameters", "rpf3d_ros.interface.health_report")
ENDS_WITHIN = 60.0
"""Longest time (s) until a process ends, on a busy machine."""

INTERRUPTED_IN_AN_IMPORT = """
import os, signal, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.{number})

sys.meta_path.insert(0, Interrupt())
from rpf3d_ros.nodes.{node} import main
sys.exit(main())
"""


def python(*arguments):
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=ENDS_WITHIN, check=False)


@pytest.mark.long
@pytest.mark.parametrize("node", NODES)
@pytest.mark.parametrize("module", IMPORTED_EARLY)
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_a_node_that_is_interrupted_while_it_starts_ends_with_exit_code_0(node, module, number):
    done = python("-c", INTERRUPTED_IN_AN_IMPORT.format(node=node, module=module, number=number))
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("node", NODES)
def test_a_node_that_is_asked_for_help_tells_what_it_is_and_starts_nothing(node, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", f"rpf3d_ros.nodes.{node}", "--help"], cwd=tmp_path, capture_output=True, text=True,
        timeout=ENDS_WITHIN, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0 and "--params-file" in done.stdout and "signals" not in done.stdout
    assert done.stdout.startswith(f"rpf3d_{node.removesuffix('_node')}: ")
    assert not any(tmp_path.iterdir())


def test_arguments_that_no_node_knows_are_refused():
    done = python("-m", "rpf3d_ros.nodes.simulator_node", "--params-file", "config/rpf3d.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert "unknown argument --params-file" in done.stderr and "after --ros-args" in done.stderr


@pytest.mark.parametrize("content", [None, "a: [1\n", "rpf3d_simulator: 3\n"])
def test_a_parameter_file_that_cannot_be_read_ends_a_node_with_exit_code_2_and_a_sentence(tmp_path, content):
    path = tmp_path / "parameters.yaml"
    if content is not None:
        path.write_text(content)
    done = python("-m", "rpf3d_ros.nodes.simulator_node", "--ros-args", "--params-file", path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    (sentence,) = [line for line in done.stderr.splitlines() if line.startswith("rpf3d: ")]
    assert str(path) in sentence
    assert "src/" not in sentence
