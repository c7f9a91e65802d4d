"""Tests of the benchmark and soak programs of the live nodes: a limit that is exceeded must be reported."""

import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("live_stack", reason="the benchmarks are not part of an installed package")

import live_messages
import live_recorder
import soak_ledger
import soak_world
from live_table import Row, Rows, print_table
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2
from soak_ledger import Ledger

from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.site import read_site
from rpf3d_core.scene.reading import read_scene
from rpf3d_ros.messages.cloud_reading import positions_of_cloud
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.result_messages import ResultFacts, results_message
from rpf3d_ros.messages.terrain_messages import MeshSurvey, cdr_of_mesh, mesh_of_cdr

AT = 1_767_250_800_123_456_789


def test_a_message_that_was_laid_out_gets_a_stamp_and_keeps_everything_else():
    grid = np.arange(36.0).reshape(3, 4, 3)
    data = live_messages.stamped(live_messages.cloud_bytes(grid), AT)
    cloud = deserialize_message(data, PointCloud2)
    assert live_messages.stamp_of(data) == AT
    assert cloud.header.stamp.sec * 10**9 + cloud.header.stamp.nanosec == AT
    assert cloud.header.frame_id == "map" and (cloud.height, cloud.width) == (3, 4)
    np.testing.assert_array_equal(positions_of_cloud(cloud), grid)


@pytest.mark.parametrize("triangles", [1, 2, 3])
def test_a_mesh_differs_from_the_one_before_by_one_vertex_a_little_higher(triangles):
    vertices = np.arange(15.0).reshape(5, 3)
    survey = MeshSurvey(vertices, np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]], dtype=np.int32)[:triangles])
    raised = mesh_of_cdr(live_messages.raise_mesh(cdr_of_mesh(survey), 3), MapFrame(), "map")
    difference = raised.vertices - vertices
    assert difference[0, 2] == pytest.approx(3 * live_messages.HIGHER)
    assert np.count_nonzero(difference) == 1 and (raised.triangles == survey.triangles).all()


def test_a_demand_is_met_by_its_level_or_a_higher_one_and_by_no_lower_one():
    ledger = Ledger()
    demand = ledger.demand("somewhere", Level.RESTRICT, 1.0)
    for held in (None, Level.NORMAL, Level.WATCH):
        assert not ledger.settle(demand, held) and ledger.lost == [demand]
    assert ledger.settle(demand, Level.EVACUATE) and not ledger.lost
    met = demand.met
    ledger.settle(demand, Level.EVACUATE)
    assert demand.met == met, "the first time counts"


def test_what_takes_the_node_away_gives_an_open_demand_time_and_a_met_one_nothing():
    ledger = Ledger()
    demand = ledger.demand("somewhere", Level.WATCH, 1.0)
    ledger.disturb(demand, 60.0)
    assert demand.until > time.monotonic() + 50.0 and demand.disturbed == 1
    ledger.settle(demand, Level.WATCH)
    ledger.disturb(demand, 600.0)
    assert demand.disturbed == 1 and len(ledger.took(True)) == 1 and not ledger.took(False)


def test_the_slope_of_memory_is_that_of_the_longest_life_without_its_beginning():
    ledger = Ledger()
    ledger.memory = [("node", 1, float(at), 900.0) for at in range(50)]  # a short-lived process, then a long-lived one
    ledger.memory += [("node", 2, 100.0 + at, 300.0 + max(60.0 - at, 0.0) + at / 36.0) for at in range(360)]
    last, most, slope, life = ledger.slopes(settling=60.0)["node"]
    assert (most, life) == (900.0, 359.0) and last == pytest.approx(300.0 + 359.0 / 36.0)
    assert slope == pytest.approx(100.0)


def test_percentiles_of_nothing_are_told_as_nothing():
    assert soak_ledger.percentiles([]).startswith("0 |")
    assert soak_ledger.percentiles([0.1, 0.1]) == "2 | 100 | 100 | 100 | 100"


def result(seconds):
    facts = ResultFacts(1, 0, True, 200, 20, 1, seconds, "a", "b", {})
    return bytes(serialize_message(results_message(live_messages.poses(np.empty((0, 3))).header, facts)))


@pytest.mark.parametrize(("took", "gap", "code"), [(0.05, 0.01, 0), (0.2, 0.01, 1), (0.05, 0.08, 1)])
def test_a_table_tells_a_missed_goal_by_its_exit_code(capsys, took, gap, code):
    row = Row("burst", 0.1)
    for _ in range(3):
        row.add(0, {topic: round(took * 1e9) for topic in ("hazard/grid", "trajectories", "results")}, result(0.03))
    assert print_table([Rows(row, [(0, 0, 1_000_000)], [gap])]) == code
    assert "flying and tallies 30" in capsys.readouterr().out


def test_the_scene_and_the_site_that_the_recorder_is_measured_with_are_accepted(tmp_path):
    scene, site = tmp_path / "scene.yaml", tmp_path / "site.yaml"
    scene.write_text(live_recorder.SCENE)
    site.write_text(live_recorder.SITE)
    watched = {area.name for area in read_scene(scene).areas_of_interest}
    assert set(read_site(site).areas) == watched


def test_the_scene_and_the_site_of_the_soak_test_are_accepted():
    assert read_site(soak_world.SITE).areas and read_scene(soak_world.SCENE).areas_of_interest
