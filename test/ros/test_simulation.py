"""What the simulator node keeps between requests."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from std_msgs.msg import Header

from rpf3d_core.ensemble.fly import REFERENCE_ROCKS
from rpf3d_core.errors import TerrainError
from rpf3d_core.live.scene import live_scene
from rpf3d_ros import simulation
from rpf3d_ros.parameters import SimulatorParameters
from rpf3d_ros.simulation import Simulator
from rpf3d_ros.simulator import UNTRIED, Request, SimulatorNode, merged
from rpf3d_ros.source_messages import Sources
from rpf3d_ros.terrain_messages import GridSurvey


def floor():
    y, x = np.mgrid[0:6, 0:6].astype(float)
    return GridSurvey(np.stack([x, y, np.zeros_like(x)], axis=-1))


def rocks(count):
    places = np.tile([[2.3, 2.4, 3.0]], (count, 1))
    return Sources(Header(frame_id="map"), places, np.zeros((count, 3)))


@pytest.fixture
def built(monkeypatch):
    """Names of the engines that were built, in order."""
    names, engine_of = [], simulation.engine_of
    monkeypatch.setattr(simulation, "engine_of", lambda name, facets: names.append(name) or engine_of(name, facets))
    return names


def test_few_and_many_rocks_in_turn_build_each_index_once(built):
    pytest.importorskip("numba", reason="numba is not installed: there is one engine only")
    simulator = Simulator(SimulatorParameters(), live_scene({}))
    simulator.stand_on(survey := floor())
    for count in (1, REFERENCE_ROCKS + 1) * 2:
        simulator.stand_on(survey)
        assert simulator.fly(rocks(count)).figures["rocks"] == str(count)
    assert built == ["reference", "compiled"]


def test_a_new_ground_builds_a_new_index(built):
    simulator = Simulator(SimulatorParameters(), live_scene({"engine": "reference"}))
    for _ in range(2):
        simulator.stand_on(floor())
        simulator.fly(rocks(1))
    assert built == ["reference", "reference"]


def test_two_simulators_share_nothing():
    one, other = Simulator(SimulatorParameters(), live_scene({})), Simulator(SimulatorParameters(), live_scene({}))
    one.stand_on(floor())
    assert other.ground is None


def test_a_survey_that_is_no_terrain_leaves_the_ground_as_it_was_and_is_tried_once():
    simulator = Simulator(SimulatorParameters(), live_scene({}))
    simulator.stand_on(floor())
    good = simulator.ground
    holes = floor()
    holes.points[::2] = np.nan
    with pytest.raises(TerrainError, match="no square of four points"):
        simulator.stand_on(holes)
    simulator.stand_on(holes)
    assert simulator.ground is good
    assert simulator.fly(rocks(1)).figures["stopped"] == "1"


def test_an_unforeseen_error_does_not_mark_a_survey_as_tried(monkeypatch):
    simulator, survey = Simulator(SimulatorParameters(), live_scene({})), floor()
    monkeypatch.setattr(simulation, "facets_of", lambda terrain: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        simulator.stand_on(survey)
    monkeypatch.undo()
    simulator.stand_on(survey)
    assert simulator.ground is not None


class Node(SimulatorNode):
    """The simulator node without ROS."""

    def __init__(self):
        self.simulator = Simulator(SimulatorParameters(), live_scene({}))
        self.health, self.last_mesh, self.refused = self, b"", 0

    def set(self, part, level, message, values=None):
        self.refused += 1


def test_a_good_survey_that_a_bad_one_overtakes_becomes_the_terrain():
    good, bad = floor(), floor()
    bad.points[::2] = np.nan
    node, source = Node(), rocks(1)
    request = merged(merged(Request((good,), None), Request((bad,), None)), Request((bad,), source))
    assert request.surveys == (bad, good) and request.sources is source
    node._stand_on(request.surveys)
    assert node.simulator.ground is not None
    assert node.refused == 1


def test_only_so_many_surveys_wait():
    request = Request((floor(),), None)
    for _ in range(10):
        request = merged(request, Request((floor(),), None))
    assert len(request.surveys) == UNTRIED


def test_only_an_accepted_terrain_changes_which_mesh_counts_as_a_repetition():
    node = Node()
    answers = iter([True, False, False, False, True, True])
    taken = []
    node._take_terrain = lambda convert: taken.append(next(answers)) or taken[-1]
    for data in (b"good", b"bad", b"bad"):  # a bad mesh is refused each time
        node.on_mesh(data)
    assert taken == [True, False, False]
    node.on_points(None)  # refused: the good mesh is still the terrain
    node.on_mesh(b"good")
    assert taken == [True, False, False, False]
    node.on_points(None)  # accepted: the good mesh would be news
    node.on_mesh(b"good")
    assert taken == [True, False, False, False, True, True]
