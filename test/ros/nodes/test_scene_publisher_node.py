"""Tests of the process rpf3d_scene_publisher, over DDS."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import PATIENCE
from rclpy.serialization import serialize_message

from rpf3d_core.errors import InputError
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.scene_content import scene_content
from rpf3d_ros.messages.source_messages import sources_of_poses
from rpf3d_ros.messages.terrain_messages import mesh_of_cdr

SLOPE = """
v 0 0 20
v 40 0 0
v 40 40 0
v 0 40 20
f 1 2 3
f 1 3 4
"""
SCENE = """
terrain: {files: [{path: slope.obj}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}
sources:
  - {name: top, points: [[2, 10, 25], [2, 20.5, 25]], rocks: 4, velocity: [2, 0, 0]}
ground: sliding
"""
MAP = MapFrame()


@pytest.fixture
def scene(tmp_path):
    """Return the path of a scene with a slope of 27 degrees and four rocks above it."""
    (tmp_path / "slope.obj").write_text(SLOPE)
    path = tmp_path / "slope.yaml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def far_scene(tmp_path, scene):
    """Return the path of the same scene in survey coordinates."""
    lines = [line.split() for line in SLOPE.split("\n") if line.startswith("v")]
    moved = "\n".join(f"v {500_000 + float(x)} {4_500_000 + float(y)} {z}" for _, x, y, z in lines)
    (tmp_path / "slope.obj").write_text(moved + "\nf 1 2 3\nf 1 3 4\n")
    points = "[[500002, 4500010, 25], [500002, 4500020.5, 25]]"
    scene.write_text(SCENE.replace("[[2, 10, 25], [2, 20.5, 25]]", points))
    return scene


def test_the_content_of_a_scene_is_in_the_map_frame(far_scene):
    content = scene_content(far_scene, MapFrame(origin=(500_000.0, 4_500_000.0, 0.0)))
    assert (content.mesh.vertices.min(axis=0).tolist(), content.mesh.vertices.max(axis=0).tolist()) == (
        [0.0, 0.0, 0.0], [40.0, 40.0, 20.0],
    )  # fmt: skip
    assert content.positions[1].tolist() == [2.0, 20.5, 25.0]
    assert content.speeds == (2.0, 2.0)


def test_a_scene_far_from_the_origin_is_refused_with_the_origin_to_set(far_scene):
    with pytest.raises(InputError, match=r"set map_origin to \[500000.0, 4500000.0, 0.0\]"):
        scene_content(far_scene, MAP)


def test_terrain_and_sources_of_the_scene_are_published(stage, scene):
    stage.node("scene_publisher_node", scene=scene, repeat_every=0.2)
    peer = stage.peer(subscribes=("terrain/mesh", "sources"))
    peer.wait(
        lambda: peer.received["terrain/mesh"] and len(peer.received["sources"]) > 2, "terrain and repeated sources"
    )
    mesh = mesh_of_cdr(serialize_message(peer.received["terrain/mesh"][-1]), MAP, "map")
    assert (len(mesh.vertices), len(mesh.triangles)) == (4, 2)
    sources = sources_of_poses(peer.received["sources"][-1], MAP)
    assert sources.positions[:, 1].tolist() == [10.0, 20.5, 10.0, 20.5]
    assert np.allclose(sources.velocities, [1.0, 0.0, 0.0])
    first, second = (message.header.stamp for message in peer.received["sources"][:2])
    assert (first.sec, first.nanosec) < (second.sec, second.nanosec)


@pytest.mark.long
def test_sources_are_published_no_more_often_than_asked(stage, scene):
    stage.node("scene_publisher_node", scene=scene, repeat_every=0.1, repetitions=2)
    peer = stage.peer(subscribes=("sources",))
    peer.wait(lambda: len(peer.received["sources"]) == 2, "two publications")
    for _ in range(20):
        peer.executor.spin_once(timeout_sec=0.05)
    assert len(peer.received["sources"]) == 2


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({}, "parameter scene is not set"),
        ({"scene": "nowhere.yaml"}, "nowhere.yaml"),
    ],
)
def test_a_scene_that_cannot_be_read_ends_the_node_with_exit_code_2_and_a_sentence(stage, parameters, sentence):
    process = stage.node("scene_publisher_node", **parameters)
    assert process.wait(PATIENCE) == 2
    assert sentence in stage.output("scene_publisher_node")
    assert "Traceback" not in stage.output("scene_publisher_node")
