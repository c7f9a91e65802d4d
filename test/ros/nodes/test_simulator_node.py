"""Tests of the process rpf3d_simulator, over DDS."""

import math
import signal

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from messages.live_peer import PATIENCE
from programs.ending import ended_in_time
from std_msgs.msg import Header

from rpf3d_core.live.survey import GridSurvey, MeshSurvey
from rpf3d_core.values import STANDARD_GRAVITY
from rpf3d_ros.interface.answer_publishers import TOPICS
from rpf3d_ros.messages.cloud_messages import cloud_of_columns, cloud_of_grid
from rpf3d_ros.messages.cloud_reading import columns_of_cloud
from rpf3d_ros.messages.health import OK, WARN
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_reading import facets_of_markers, strips_of_markers
from rpf3d_ros.messages.result_messages import facts_of
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

SIDE, HEIGHT = 20, 5.0
NODE = "rpf3d_simulator"
MAP = MapFrame()
RESULTS = tuple(TOPICS)
FLOAT32 = 1e-5
"""Largest rounding error of results, which are published as float32 and are at most 100."""

COMPUTING, WALL = 6.0, 8.0
"""Longest CPU time (s) and wall time (s) until a node ends that gives its run 2 s; the whole run takes a minute."""

ONE_EACH = {"first_rocks": 1, "target.most_rocks": 1, "position_spread": 0.0, "velocity_spread": 0.0}
"""Parameters for one rock per source, which starts exactly at the source."""

QUIET_PARAMETERS = {
    "engine": "reference", "rebound": "constant", "ground": "sliding", "materials.default.normal_restitution": 0.5,
    **ONE_EACH,
}  # fmt: skip
STAMPS = iter(range(1, 1000))


def floor():
    """Return the survey of a level floor at z = 0 m, with x and y from 0 to 20 m."""
    y, x = np.mgrid[0 : SIDE + 1, 0 : SIDE + 1].astype(float)
    return GridSurvey(np.stack([x, y, np.zeros_like(x)], axis=-1))


def floor_cloud(frame="map"):
    return cloud_of_grid(Header(frame_id=frame), floor())


def floor_mesh(**changes):
    mesh = grid_mesh(floor().points)
    return cdr_of_mesh(MeshSurvey(changes.get("vertices", mesh.vertices), changes.get("triangles", mesh.triangles)))


def poses(*places, frame="map"):
    """Return a message of sources at places (m), with a stamp that no other message has."""
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0)) for x, y, z in places]
    return PoseArray(header=Header(frame_id=frame, stamp=Time(sec=next(STAMPS))), poses=each)


def answers(peer, sent):
    """Wait for the results of the message `sent`; return the last message of each result topic, by topic."""

    def complete():
        last = {topic: messages[-1] for topic, messages in peer.received.items() if messages}
        stamps = [getattr(m, "header", None) or m.markers[0].header for m in last.values()]
        return len(last) == len(RESULTS) and all(h.stamp == sent.header.stamp for h in stamps) and last

    return peer.wait(complete, f"results of the sources stamped {sent.header.stamp.sec}")


def column(cloud, name):
    return columns_of_cloud(cloud, (name,))[name].ravel()


@pytest.mark.long
@pytest.mark.parametrize("engine", ["reference", "compiled"])
def test_a_dropped_rock_is_simulated_and_published_with_the_stamp_of_its_source(stage, engine):
    stage.node("simulator_node", **{**QUIET_PARAMETERS, "engine": engine})
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    peer.wait_for_health(f"{NODE}: run", "waiting for sources")
    sent = poses((10.3, 10.4, HEIGHT))
    peer.send("sources", sent)
    last = answers(peer, sent)
    assert column(last["impacts"], "speed")[0] == pytest.approx(math.sqrt(2 * STANDARD_GRAVITY * HEIGHT), rel=FLOAT32)
    assert [column(last["deposits"], name)[0] for name in "xyz"] == pytest.approx([10.3, 10.4, 0.0], abs=FLOAT32)
    assert column(last["trajectories/points"], "z").max() == pytest.approx(HEIGHT, rel=FLOAT32)
    assert len(strips_of_markers(last["trajectories"], MAP)) == 1
    assert [len(corners) for corners, _ in facets_of_markers(last["hazard/zones"], MAP).values() if len(corners)] == [1]
    grid = np.array(last["hazard/grid"].data)
    assert (np.count_nonzero(grid == 100), np.count_nonzero(grid > 0)) == (1, 1)
    assert column(last["hazard/points"], "reach_probability").tolist() == [1.0]
    facts = facts_of(last["results"])
    assert (facts.rocks, facts.sources, facts.complete, facts.outcomes) == (1, 1, True, {"stopped": 1})
    numbers = [column(last[name], "result").tolist() for name in ("impacts", "deposits", "hazard/points")]
    assert {number for each in numbers for number in each} == {facts.result}
    assert all(m.header.frame_id == "map" for m in last["trajectories"].markers)
    health = peer.wait_for_health(f"{NODE}: run", "every rock has an outcome")
    assert (health.level, health.values["rocks"], health.values["stopped"]) == (OK, "1", "1")
    assert health.values["engine"] == engine


def test_sources_wait_for_terrain_and_a_new_terrain_is_flown_with_the_last_sources(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/mesh", "terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    sent = poses((5.0, 5.2, HEIGHT), (6.0, 6.1, HEIGHT))
    peer.send("sources", sent)
    assert peer.wait_for_health(f"{NODE}: run", "waiting for terrain").level == WARN
    peer.send("terrain/mesh", floor_mesh())
    assert column(answers(peer, sent)["deposits"], "z") == pytest.approx([0.0, 0.0], abs=FLOAT32)
    lowered = GridSurvey(floor().points - np.array([0.0, 0.0, 3.0]))
    count = len(peer.received["deposits"])
    peer.send("terrain/points", cloud_of_grid(Header(frame_id="map"), lowered))
    peer.wait(lambda: len(peer.received["deposits"]) > count, "results over the new terrain")
    assert column(peer.received["deposits"][-1], "z") == pytest.approx([-3.0, -3.0], abs=FLOAT32)


@pytest.mark.long
def test_rocks_are_thrown_along_the_x_axis_of_their_pose(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS, release_speed=2.0)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    sent = poses((2.0, 10.4, HEIGHT))
    half = math.sqrt(0.5)
    sent.poses[0].orientation = Quaternion(z=half, w=half)
    peer.send("terrain/points", floor_cloud())
    peer.send("sources", sent)
    first = answers(peer, sent)["impacts"]
    flown = 2.0 * math.sqrt(2 * HEIGHT / STANDARD_GRAVITY)
    assert [column(first, name)[0] for name in "xy"] == pytest.approx([2.0, 10.4 + flown], rel=FLOAT32)


@pytest.mark.long
def test_who_joins_late_gets_the_last_results(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    sent = poses((10.3, 10.4, HEIGHT))
    peer.send("terrain/points", floor_cloud())
    peer.send("sources", sent)
    answers(peer, sent)
    assert answers(stage.peer(subscribes=RESULTS), sent)


@pytest.mark.long
def test_rocks_that_leave_make_an_empty_cloud_of_deposits(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS, release_speed=50.0)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    sent = poses((15.0, 10.4, HEIGHT))
    peer.send("terrain/points", floor_cloud())
    peer.send("sources", sent)
    last = answers(peer, sent)
    assert (last["deposits"].width, last["impacts"].width) == (0, 0)
    assert peer.wait_for_health(f"{NODE}: run", "every rock").values["left_terrain"] == "1"


def busy(stage, rocks, normal_restitution):
    """Return a peer of a node that takes long to simulate rocks with many bounces, and the message of their sources."""
    ground = {"normal_restitution": normal_restitution, "tangential_restitution": 1.0}
    material = {f"materials.default.{name}": value for name, value in ground.items()}
    stage.node("simulator_node", engine="reference", **material, **ONE_EACH)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    peer.wait_for_health(f"{NODE}: run", "waiting for sources")
    many = poses(*[(5.0 + 0.001 * i, 10.0, HEIGHT) for i in range(rocks)])
    peer.send("sources", many)
    peer.wait_for_health(f"{NODE}: sources", "received")
    return peer, many


def test_a_node_interrupted_in_a_long_run_abandons_it(stage):
    busy(stage, rocks=400, normal_restitution=0.99)
    (process,) = stage.processes
    code = ended_in_time(process, signal.SIGINT, computing=COMPUTING, wall=WALL)
    assert code == 0, stage.output("simulator_node")


@pytest.mark.long
def test_the_node_hears_bad_input_while_a_long_run_is_under_way(stage):
    peer, many = busy(stage, rocks=200, normal_restitution=0.95)
    peer.send("sources", poses((1.0, 1.0, math.nan)))
    peer.wait_for_health(f"{NODE}: sources", "pose 0 is not finite")
    assert not peer.received["deposits"], "the run ended before it could be seen that the node listens: make it longer"
    assert answers(peer, many)


@pytest.fixture(scope="module")
def running(shared_stage):
    """Yield a peer of a simulator that has a terrain, for all tests that send invalid messages."""
    process = shared_stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = shared_stage.peer(publishes=("terrain/points", "terrain/mesh", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    peer.wait_for_health(f"{NODE}: terrain", "received")
    yield peer
    assert process.poll() is None, "the node has died"


def dense_with_nan():
    cloud = floor_cloud()
    points = floor().points
    points[3, 3] = np.nan
    cloud = cloud_of_grid(cloud.header, GridSurvey(points))
    cloud.is_dense = True
    return cloud


def far_float32():
    return cloud_of_grid(Header(frame_id="map"), GridSurvey(floor().points + 500_000.0))


def flat_cloud():
    points = floor().points.reshape(-1, 3)
    return cloud_of_columns(Header(frame_id="map"), {name: points[:, i] for i, name in enumerate("xyz")})


def no_heights():
    points = floor().points
    return cloud_of_columns(Header(frame_id="map"), {"x": points[..., 0], "y": points[..., 1]})


def integer_heights():
    points = floor().points
    columns = {"x": points[..., 0], "y": points[..., 1], "z": points[..., 2].astype(np.int64)}
    return cloud_of_columns(Header(frame_id="map"), columns)


def nan_vertex():
    vertices = grid_mesh(floor().points).vertices.copy()
    vertices[7, 2] = np.nan
    return floor_mesh(vertices=vertices)


def wrong_index():
    triangles = grid_mesh(floor().points).triangles.copy()
    triangles[5, 1] = 10_000
    return floor_mesh(triangles=triangles)


def one_place():
    return cloud_of_grid(Header(frame_id="map"), GridSurvey(np.full((2, 2, 3), 5.0)))


def one_zero_triangle():
    return cdr_of_mesh(MeshSurvey(np.full((3, 3), 5.0), np.array([[0, 1, 2]])))


BAD = {
    "cloud_of_equal_points": ("terrain/points", one_place, "refused"),
    "mesh_of_one_triangle_without_area": ("terrain/mesh", one_zero_triangle, "refused"),
    "cloud_in_a_foreign_frame": ("terrain/points", lambda: floor_cloud("lidar"), "frame_id is 'lidar'"),
    "cloud_with_nan_that_says_it_is_dense": ("terrain/points", dense_with_nan, "NaN points but is_dense is true"),
    "float32_survey_coordinates": ("terrain/points", far_float32, "float32 coordinates beyond"),
    "cloud_without_z": ("terrain/points", no_heights, "must have one field 'z'"),
    "cloud_of_integers": ("terrain/points", integer_heights, "'z' is uint32"),
    "truncated_mesh": ("terrain/mesh", lambda: floor_mesh()[:-5], "the mesh ends after"),
    "mesh_of_another_encapsulation": ("terrain/mesh", lambda: b"\0\0\0\0" + floor_mesh()[4:], "little-endian CDR"),
    "mesh_with_a_nan_vertex": ("terrain/mesh", nan_vertex, "vertex 7 of the mesh is not finite"),
    "mesh_with_a_wrong_index": ("terrain/mesh", wrong_index, "triangle 5 of the mesh names a vertex beyond"),
    "poses_in_a_foreign_frame": ("sources", lambda: poses((5.0, 5.0, 5.0), frame="radar"), "frame_id is 'radar'"),
    "pose_that_is_not_finite": ("sources", lambda: poses((5.0, math.inf, 5.0)), "pose 0 is not finite"),
    "source_under_the_ground": ("sources", lambda: poses((5.0, 5.2, -2.0)), "2 m under the ground"),
    "source_off_the_terrain": ("sources", lambda: poses((50.0, 5.0, 5.0)), "off the terrain"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_with_a_diagnostic_and_the_node_lives_on(running, case):
    topic, message, sentence = BAD[case]
    part = "run" if case.startswith("source_") else topic.split("/")[0]
    running.send(topic, message())
    health = running.wait_for_health(f"{NODE}: {part}", sentence)
    assert health.level == WARN
    assert "refused" in health.message
    good = poses((10.0, 10.4, HEIGHT))
    running.send("sources", good)
    assert answers(running, good)


@pytest.mark.long
def test_a_survey_that_is_no_terrain_is_refused_as_terrain_and_the_last_good_one_stays(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/points", "terrain/mesh", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    peer.wait_for_health(f"{NODE}: terrain", "received")
    columns = floor().points
    columns[1::2] = np.nan
    peer.send("terrain/points", cloud_of_grid(Header(frame_id="map"), GridSurvey(columns)))
    assert peer.wait_for_health(f"{NODE}: terrain", "no square of four points").level == WARN
    sent = poses((10.3, 10.4, HEIGHT))
    peer.send("sources", sent)
    assert column(answers(peer, sent)["deposits"], "z") == pytest.approx([0.0], abs=FLOAT32)
    assert peer.health[f"{NODE}: terrain"].level == WARN
    assert "refused" not in peer.health[f"{NODE}: run"].message
    peer.send("terrain/mesh", floor_mesh())
    assert peer.wait_for_health(f"{NODE}: terrain", "received").level == OK


@pytest.mark.long
def test_a_refused_mesh_does_not_hide_the_last_one_from_its_repetition(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/mesh",))
    peer.wait_for_subscribers()
    peer.send("terrain/mesh", floor_mesh())
    peer.wait_for_health(f"{NODE}: terrain", "received")
    peer.send("terrain/mesh", floor_mesh()[:-5])
    peer.wait_for_health(f"{NODE}: terrain", "refused")
    peer.send("terrain/mesh", floor_mesh())
    assert peer.wait_for_health(f"{NODE}: terrain", "received").level == OK


@pytest.mark.long
def test_each_reason_of_refusal_is_logged_once_in_a_while(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("sources",))
    peer.wait_for_subscribers()
    for _ in range(5):
        peer.send("sources", poses((1.0, 1.0, math.nan)))
    peer.send("sources", poses((1.0, 1.0, 1.0), frame="radar"))
    peer.wait_for_health(f"{NODE}: sources", "frame_id is 'radar'")
    peer.wait(lambda: "frame_id is 'radar'" in stage.output("simulator_node"), "the reason in the node's output")
    assert stage.output("simulator_node").count("pose 0 is not finite") == 1
    assert stage.output("simulator_node").count("frame_id is 'radar'") == 1


def test_an_interrupted_node_ends_with_exit_code_0(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    stage.peer().wait_for_health(f"{NODE}: terrain", "no terrain yet")
    assert stage.clear() == [0]
    assert "Traceback" not in stage.output("simulator_node")


def test_a_node_with_a_wrong_parameter_ends_with_exit_code_2_and_a_sentence(stage):
    process = stage.node("simulator_node", **{"rock.diameter": 0.0})
    assert process.wait(PATIENCE) == 2
    assert "parameter `rock.diameter` is 0.0, but must be a number above 0 (m)" in stage.output("simulator_node")
    assert "Traceback" not in stage.output("simulator_node")


@pytest.mark.long
def test_no_sources_are_an_answer_that_clears_what_was_shown(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    seen, nothing = poses((10.3, 10.4, HEIGHT)), poses()
    peer.send("sources", seen)
    answers(peer, seen)
    peer.send("sources", nothing)
    last = answers(peer, nothing)
    assert (last["deposits"].width, last["hazard/points"].width, max(last["hazard/grid"].data)) == (0, 0, 0)
    assert facts_of(last["results"]).sources == 0
    assert peer.wait_for_health(f"{NODE}: sources", "sees no sources").level == OK


@pytest.mark.long
def test_a_scattered_cloud_is_terrain_too(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", flat_cloud())
    sent = poses((10.3, 10.4, HEIGHT))
    peer.send("sources", sent)
    assert column(answers(peer, sent)["deposits"], "z") == pytest.approx([0.0], abs=FLOAT32)


def test_a_patch_changes_the_ground_in_its_footprint_and_what_goes_back_is_refused(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/points", "terrain/update", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", cloud_of_grid(Header(frame_id="map", stamp=Time(sec=50)), floor()))
    sent = poses((10.3, 10.4, HEIGHT), (2.3, 2.4, HEIGHT))
    peer.send("sources", sent)
    answers(peer, sent)
    raised = GridSurvey(floor().points[7:14, 7:14] + (0.0, 0.0, 1.5))
    count = len(peer.received["deposits"])
    peer.send("terrain/update", cloud_of_grid(Header(frame_id="map", stamp=Time(sec=60)), raised))
    peer.wait(lambda: len(peer.received["deposits"]) > count, "an answer over the patched terrain")
    assert column(peer.received["deposits"][-1], "z") == pytest.approx([1.5, 0.0], abs=FLOAT32)
    assert column(answers(peer, sent)["hazard/points"], "rocks").sum() > 0
    peer.send("terrain/update", cloud_of_grid(Header(frame_id="map", stamp=Time(sec=55)), floor()))
    assert peer.wait_for_health(f"{NODE}: terrain", "is 5.000 s older").level == WARN
    peer.send("terrain/points", cloud_of_grid(Header(frame_id="map", stamp=Time(sec=49)), floor()))
    assert peer.wait_for_health(f"{NODE}: terrain", "is 1.000 s older").level == WARN


def test_a_burst_is_answered_at_once_and_refined_until_the_target_is_met(stage):
    stage.node("simulator_node", first_rocks=50, **{"target.most_rocks": 400, "target.half_width": 0.0001})
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=("results", "hazard/grid"))
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    sent = poses((10.3, 10.4, HEIGHT), (5.3, 5.4, HEIGHT))
    peer.send("sources", sent)
    facts = lambda: [facts_of(message) for message in peer.received["results"]]  # noqa: E731
    peer.wait(lambda: facts() and facts()[-1].complete, "the last answer")
    told = facts()
    assert told[-1].rocks == 400 and {each.rocks for each in told} <= {50, 100, 200, 400}
    assert [each.result for each in told] == sorted(each.result for each in told)
    assert len({each.sources_digest for each in told}) == len({each.terrain_digest for each in told}) == 1
    assert all(message.header.stamp == sent.header.stamp for message in peer.received["results"])


def test_sources_off_the_terrain_are_left_out_and_named_and_the_others_are_answered(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=("terrain/points", "sources"), subscribes=RESULTS)
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    sent = poses((10.3, 10.4, HEIGHT), (50.0, 5.0, 5.0))
    peer.send("sources", sent)
    assert facts_of(answers(peer, sent)["results"]).sources == 1
    assert peer.wait_for_health(f"{NODE}: run", "1 of 2 sources is off the terrain: source 1").level == WARN


def test_sources_without_a_pose_say_that_nothing_is_seen(stage):
    stage.node("simulator_node", **QUIET_PARAMETERS)
    peer = stage.peer(publishes=["terrain/points", "sources"])
    peer.wait_for_subscribers()
    peer.send("terrain/points", floor_cloud())
    peer.wait_for_health(f"{NODE}: terrain", "received")
    peer.send("sources", poses())
    peer.wait_for_health(f"{NODE}: run", "the sensors see no sources")
