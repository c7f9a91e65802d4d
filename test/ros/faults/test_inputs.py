"""Tests that unusable terrain, patches, sources and areas are refused with a reason, and the previous input stays."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import FEW_ROCKS, ON_THE_SLOPE, SECOND, TOE, cloud, polygon, poses, ramp, resident

from rpf3d_ros.messages.health import WARN
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import LITTLE_ENDIAN_CDR, cdr_of_mesh

MOST = 20_000
"""Most points that the simulator of these tests accepts; the default is 10 million."""

MANY = 50_000_000
MEMORY = 100.0
"""Memory (MB) that a message that announces 50 million points may take: the points would take 1,200 MB."""

HOUR = 3600 * SECOND


@pytest.fixture(scope="module")
def bare(shared_stage):
    """Return the peer and the process of a simulator that has no terrain yet."""
    process = shared_stage.node("simulator_node", most_points=MOST, **FEW_ROCKS)
    peer = shared_stage.live_peer()
    peer.wait_for_simulator()
    return peer, process


@pytest.fixture(scope="module")
def living(bare):
    """Yield the peer and the process of the simulator of `bare`, after it has answered with a ramp as its terrain."""
    peer, process = bare
    peer.stand_on_ramp()
    peer.answered()
    yield bare
    assert process.poll() is None, "the simulator has died"


def test_a_patch_before_any_terrain_is_refused(bare):
    peer, _ = bare
    peer.refused("terrain/update", cloud(ramp()[20:30, 20:30], peer.now()), "no terrain")


def scattered(*points):
    return np.array(points, dtype=float)


def announcing(count):
    """Return a function of a stamp (ns) that returns a cloud which announces `count` points but contains fewer."""

    def made(stamp):
        message = cloud(ramp()[:2], stamp)
        message.width = count // 2
        message.row_step = message.point_step * message.width
        return message

    return made


def mesh_announcing(count):
    return LITTLE_ENDIAN_CDR + count.to_bytes(4, "little") + cdr_of_mesh(grid_mesh(ramp()))[8:]


def fine(stamp):
    y, x = np.mgrid[0:150, 0:150] * 0.4
    return cloud(np.stack([x, y, 0.0 * x], axis=-1), stamp)


def holes():
    points = ramp()
    points[1::2] = np.nan
    return points


LINE = scattered(*[(i, 2.0 * i, 1.0) for i in range(50)])
TERRAIN = {
    "nan_in_every_point_of_a_grid": (lambda stamp: cloud(ramp() * np.nan, stamp), "NaN"),
    "nan_in_every_point_of_a_cloud": (lambda stamp: cloud(ramp().reshape(-1, 3) * np.nan, stamp), "NaN"),
    "no_square_without_a_hole": (lambda stamp: cloud(holes(), stamp), "no square of four points"),
    "one_point": (lambda stamp: cloud(scattered((5.0, 5.0, 1.0)), stamp), "1 points"),
    "two_points": (lambda stamp: cloud(scattered((5.0, 5.0, 1.0), (6.0, 5.0, 1.0)), stamp), "2 points"),
    "points_in_a_line": (lambda stamp: cloud(LINE, stamp), "refused"),
    "points_in_one_place": (lambda stamp: cloud(scattered(*[(5.0, 5.0, 1.0)] * 40), stamp), "refused"),
    "points_above_each_other": (lambda stamp: cloud(scattered(*[(5.0, 5.0, z) for z in range(40)]), stamp), "refused"),
    "fifty_million_announced": (announcing(MANY), f"50,000,000 points; at most {MOST:,}"),
    "more_than_the_limit": (fine, f"22,500 points; at most {MOST:,}"),
    "fifty_million_triangles_announced": (lambda stamp: mesh_announcing(MANY), f"at most {MOST:,}"),
    "another_frame": (lambda stamp: cloud(ramp(), stamp, "lidar"), "frame_id is 'lidar'"),
    "an_older_stamp": (lambda stamp: cloud(ramp(), stamp - HOUR), "older than the last message"),
    "a_stamp_from_the_future": (lambda stamp: cloud(ramp(), stamp + HOUR), "future"),
}


@pytest.mark.parametrize("case", TERRAIN)
def test_terrain_that_is_none_is_refused_and_the_last_good_one_stays(living, case):
    peer, process = living
    message, sentence = TERRAIN[case]
    digest, memory = peer.answered()["terrain_digest"], resident(process.pid)
    topic = "terrain/mesh" if "triangles" in case else "terrain/points"
    said = peer.refused(topic, message(peer.now()), sentence)
    assert said.level == WARN
    assert "refused" in said.message
    assert resident(process.pid) < memory + MEMORY
    assert peer.answered()["terrain_digest"] == digest


def test_a_level_floor_of_scattered_points_is_terrain(living):
    peer, _ = living
    points = ramp().reshape(-1, 3)
    before = peer.answered()["terrain_digest"]
    peer.send("terrain/points", cloud(points * (1.0, 1.0, 0.0), peer.now()))
    peer.wait(lambda: peer.answered([(20.0, 20.0, 3.0)])["terrain_digest"] != before, "the floor to be flown over")
    peer.stand_on_ramp()
    peer.wait(lambda: peer.answered()["terrain_digest"] == before, "the ramp again, with the digest that it had")


PATCHES = {
    "off_the_terrain": (lambda stamp: cloud(ramp()[:5, :5] + (500.0, 0.0, 0.0), stamp), "refused"),
    "of_nan": (lambda stamp: cloud(ramp()[:5, :5] * np.nan, stamp), "NaN"),
    "of_one_point": (lambda stamp: cloud(scattered((5.0, 5.0, 1.0)), stamp), "1 points"),
    "of_fifty_million_points_announced": (announcing(MANY), f"at most {MOST:,}"),
    "in_another_frame": (lambda stamp: cloud(ramp()[:5, :5], stamp, "lidar"), "frame_id is 'lidar'"),
    "older_than_the_terrain": (lambda stamp: cloud(ramp()[:5, :5], stamp - HOUR), "older than the last message"),
}


@pytest.mark.parametrize("case", PATCHES)
def test_a_patch_that_is_none_is_refused_and_the_terrain_stays(living, case):
    peer, _ = living
    message, sentence = PATCHES[case]
    digest = peer.answered()["terrain_digest"]
    assert "refused" in peer.refused("terrain/update", message(peer.now()), sentence).message
    assert peer.answered()["terrain_digest"] == digest


SOURCES = {
    "beside_the_terrain": (lambda stamp: poses([(500.0, 5.0, 50.0)], stamp), "off the terrain"),
    "under_the_ground": (lambda stamp: poses([(10.0, 30.0, 1.0)], stamp), "under the ground"),
    "nowhere": (lambda stamp: poses([(10.0, np.nan, 50.0)], stamp), "pose 0 is not finite"),
    "in_another_frame": (lambda stamp: poses([ON_THE_SLOPE], stamp, "radar"), "frame_id is 'radar'"),
    "without_a_frame": (lambda stamp: poses([ON_THE_SLOPE], stamp, ""), "frame_id is ''"),
    "older_than_the_last": (lambda stamp: poses([ON_THE_SLOPE], stamp - HOUR), "older than the last message"),
    "from_the_future": (lambda stamp: poses([ON_THE_SLOPE], stamp + HOUR), "future"),
}


@pytest.mark.parametrize("case", SOURCES)
def test_sources_that_cannot_be_flown_are_refused_and_the_next_are_answered(living, case):
    peer, _ = living
    message, sentence = SOURCES[case]
    assert "refused" in peer.refused("sources", message(peer.now()), sentence).message
    assert int(peer.answered()["rocks"]) > 0


def test_of_sources_some_of_which_lie_beside_the_terrain_the_others_are_answered_with_a_warning(living):
    peer, _ = living
    answer = peer.answered([ON_THE_SLOPE, (500.0, 5.0, 50.0)])
    assert answer["sources"] == "1"
    assert "off the terrain" in answer["warning"]


def test_no_sources_are_answered_with_no_rocks(living):
    peer, _ = living
    answer = peer.answered([])
    assert (answer["sources"], answer["rocks"]) == ("0", "0")


AREAS = {
    "of_two_corners": (lambda stamp: polygon(TOE[:2], stamp), "must have at least 3"),
    "not_finite": (lambda stamp: polygon([*TOE, (np.nan, 1.0)], stamp), "not finite"),
    "in_another_frame": (lambda stamp: polygon(TOE, stamp, "gps"), "frame_id is 'gps'"),
}


@pytest.mark.parametrize("case", AREAS)
def test_an_area_that_is_none_is_refused(living, case):
    peer, _ = living
    message, sentence = AREAS[case]
    assert "refused" in peer.refused("areas/polygon", message(peer.now()), sentence).message
    peer.watch_toe()
    assert peer.answered()


def test_a_second_publisher_of_terrain_in_another_frame_changes_nothing(living, shared_stage):
    peer, _ = living
    digest = peer.answered()["terrain_digest"]
    other = shared_stage.live_peer()
    other.wait_for_simulator()
    other.refused("terrain/points", cloud(ramp(5.0), other.now(), "drone"), "frame_id is 'drone'")
    assert peer.answered()["terrain_digest"] == digest


@pytest.mark.long
def test_who_joins_late_gets_the_last_answer(living, shared_stage):
    peer, _ = living
    answer = peer.answered()
    late = shared_stage.live_peer()
    late.wait(lambda: late.results and late.grids, "latched results")
    assert late.answer_values()["sources_digest"] == answer["sources_digest"]
