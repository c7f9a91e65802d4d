"""Tests that patches published after a mesh are applied to the mesh even if they are received before it."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import FEW_ROCKS, cloud, ramp, ramp_of

from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

SIDE = 600
"""Points along a side of a mesh whose 15 MB arrive in many fragments of the network."""

WHOLE = 2 * (SIDE - 1) ** 2
"""Number of triangles of this mesh."""


def test_a_patch_that_overtakes_the_mesh_it_follows_is_in_the_terrain(stage):
    stage.node("simulator_node", **FEW_ROCKS)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.stand_on_ramp()
    peer.wait_for_sentence("received")
    mesh = cdr_of_mesh(grid_mesh(ramp_of(SIDE)))
    patch = cloud(ramp()[20:30, 20:30] + (0.5, 0.5, 1.0), peer.now())
    peer.send("terrain/mesh", mesh)
    peer.send("terrain/update", patch)

    def patched():
        status = peer.health["rpf3d_simulator: terrain"]
        values = {pair.key: pair.value for pair in status.values}
        return status.message == "patch received" and int(values["triangles"]) > 0.9 * WHOLE

    peer.wait(patched, "the mesh with the patch in it")
