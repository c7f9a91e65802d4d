"""Tests of two pits in one domain: each node works in its own namespace, with the shipped parameter file."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import with_alerts
from rcl_interfaces.srv import GetParameters

from rpf3d_ros.demo.processes import node_process
from rpf3d_ros.messages.refusals import TAKEN_UP
from rpf3d_ros.nodes.acknowledge import NOT_YET

ROOT = Path(__file__).resolve().parents[3]
FILE = ROOT / "config" / "rpf3d.yaml"
PITS = ("pit_a", "pit_b")
OF_THE_DOMAIN = {"/diagnostics", "/rosout", "/parameter_events", "/clock"}
"""Topics that all nodes of a domain share by convention."""


def in_pit(pit, folder, **parameters):
    """Start a simulator in the namespace of a pit with the shipped parameter file; return its process.

    Its files are in `folder`/`pit`, a new folder.
    """
    own = folder / pit
    own.mkdir()
    parameters = {**with_alerts(own), **parameters, "ground": "none", "engine": "reference"}
    given = [word for name, value in parameters.items() for word in ("-p", f"rpf3d_simulator:{name}:={value}")]
    return node_process("simulator_node", ["-r", f"__ns:=/{pit}", "--params-file", str(FILE), *given], own)


@pytest.fixture(scope="module")
def peer(shared_stage):
    """Return a peer of two active simulators."""
    shared_stage.processes += [in_pit(pit, shared_stage.folder) for pit in PITS]
    peer = shared_stage.peer()
    for pit in PITS:
        peer.wait_for_health(f"{pit}/rpf3d_simulator: lifecycle", "active")
    return peer


def acknowledged(*words):
    """Run rpf3d_acknowledge with further arguments; return its exit code and its output."""
    command = [sys.executable, "-m", "rpf3d_ros.nodes.acknowledge", "A. Foreman", "inspected", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize("pit", PITS)
def test_the_parameter_file_reaches_a_node_in_a_namespace(peer, pit):
    request = GetParameters.Request(names=["terrain_durability"])
    answer = peer.call(GetParameters, f"/{pit}/rpf3d_simulator/get_parameters", request)
    assert [value.string_value for value in answer.values] == ["transient_local"]


def test_no_topic_is_outside_the_namespaces(peer):
    own = peer.node.get_fully_qualified_name()
    found = lambda: {name for name, _kinds in peer.node.get_topic_names_and_types()}  # noqa: E731
    every = {f"/{pit}/{name}" for pit in PITS for name in ("alerts", "sources", "terrain/mesh", "results")}
    peer.wait(lambda: every <= found(), "the topics of both pits")
    topics = found()
    outside = {name for name in topics if not name.startswith(tuple(f"/{pit}/" for pit in PITS))}
    assert len(topics) > 20
    assert {name for name in outside if not name.startswith(own)} <= OF_THE_DOMAIN


def test_diagnostics_tell_the_pits_apart_by_name_and_by_hardware_id(shared_stage, peer):
    live = shared_stage.live_peer()
    for pit in PITS:
        status = live.wait(lambda pit=pit: live.health.get(f"{pit}/rpf3d_simulator: lifecycle"), f"a word of {pit}")
        assert status.hardware_id == f"rpf3d/{pit}"


def test_an_acknowledgement_goes_to_the_pit_that_is_named_and_to_no_other(peer):
    code, said = acknowledged("--patience", "10")  # enough time to find the other simulator, too
    assert code == 2
    assert "/rpf3d_simulator does not answer" in said
    assert "with --node: " in said
    for words in (("--node", "/pit_b/rpf3d_simulator"), ("--ros-args", "-r", "__ns:=/pit_b")):
        code, said = acknowledged("--patience", "60", *words)
        is_taken_up = (code, said) == (NOT_YET, f"{TAKEN_UP}\n")  # on a busy machine
        assert is_taken_up or (code == 1 and said.startswith("not lowered: ")), said
