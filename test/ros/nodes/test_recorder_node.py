"""Tests of the process rpf3d_recorder, over DDS; the tests read its recordings."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from messages.live_peer import PATIENCE
from std_msgs.msg import Header

from rpf3d_core.errors import InputError
from rpf3d_core.live.zones import ShownZone
from rpf3d_core.recordings.content import rows_by_entity, verify
from rpf3d_ros.messages.cloud_messages import cloud_of_columns, cloud_of_grid
from rpf3d_ros.messages.health import WARN
from rpf3d_ros.messages.marker_messages import trajectory_markers, zone_markers
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import GridSurvey, cdr_of_mesh

EVERYTHING = (
    "terrain/points", "terrain/mesh", "sources", "trajectories", "trajectories/points", "impacts", "deposits",
    "hazard/zones",
)  # fmt: skip
NODE = "rpf3d_recorder"


def header(second, frame="map"):
    return Header(frame_id=frame, stamp=Time(sec=second))


def survey():
    y, x = np.mgrid[0:5, 0:5].astype(float)
    return GridSurvey(np.stack([x, y, np.zeros_like(x)], axis=-1))


def columns(rocks=2, points=4):
    along = np.tile(np.arange(points, dtype=float), rocks)
    names = ("x", "y", "z", "t", "speed", "energy")
    return dict.fromkeys(names, along) | {"rock": np.repeat(np.arange(rocks), points)}


def zone(name, corners):
    return ShownZone(name, corners, np.empty((0, 2, 3)))


def pose(z):
    return Pose(position=Point(x=1.0, y=1.0, z=z), orientation=Quaternion(w=1.0))


def event(second):
    """Return topic -> message of an event, in the order of sending; events of different seconds differ."""
    cloud = cloud_of_columns(header(second), columns() | {"energy": np.full(8, float(second))})
    corners = np.full((1, 3, 3), float(second))
    return {
        "sources": PoseArray(header=header(second), poses=[pose(5.0)]),
        "trajectories/points": cloud,
        "impacts": cloud,
        "deposits": cloud,
        "trajectories": trajectory_markers(header(second), columns(), 200, 50),
        "hazard/zones": zone_markers(header(second), [zone(name, corners) for name in ("passed", "stopped")]),
    }


def recorded(peer, counts):
    """Wait until the recorder reports at least these numbers of recorded messages (topic -> number)."""
    peer.wait(
        lambda: (
            (health := peer.health.get(f"{NODE}: recording"))
            and all(int(health.values.get(topic, 0)) >= count for topic, count in counts.items())
        ),
        f"{counts} recorded",
    )


@pytest.mark.long
def test_everything_that_is_published_is_in_a_recording_that_verifies(stage):
    file = stage.folder / "live.rrd"
    stage.node("recorder_node", file=file)
    peer = stage.peer(publishes=EVERYTHING)
    peer.wait_for_subscribers()
    peer.send("terrain/points", cloud_of_grid(header(1), survey()))
    recorded(peer, {"terrain/points": 1})
    mesh = cdr_of_mesh(grid_mesh(survey().points))
    peer.send("terrain/mesh", mesh)
    for second in (5, 6):
        for topic, message in event(second).items():
            peer.send(topic, message)
        recorded(peer, dict.fromkeys(event(second), second - 4))
    peer.send("terrain/mesh", mesh)
    recorded(peer, {"terrain/mesh": 2})
    peer.send("impacts", cloud_of_columns(header(7, "lidar"), columns()))
    peer.wait_for_health(f"{NODE}: impacts", "refused")
    peer.send("terrain/mesh", mesh)
    recorded(peer, {"terrain/mesh": 3})
    for _ in range(2):  # the recorder may count the messages some time after they were sent
        seen = peer.health[f"{NODE}: impacts"]
        peer.wait(lambda seen=seen: peer.health[f"{NODE}: impacts"] is not seen, "a repetition of the diagnostics")
    assert stage.clear() == [0]
    verify(file)
    rows = rows_by_entity(file)
    twice = ("/sources", "/trajectories", "/trajectories/points", "/impacts", "/deposits")
    assert {entity: rows[entity] for entity in twice} == dict.fromkeys(twice, 2)
    assert rows["/hazard/stopped"] == 3, "the facets of the first event are taken away before those of the second"
    assert rows["/terrain"] == 2, "a mesh that is repeated is recorded once"
    assert rows["/diagnostics"] >= 1


@pytest.mark.long
def test_an_event_without_deposits_clears_those_of_the_last_event(stage):
    file = stage.folder / "live.rrd"
    stage.node("recorder_node", file=file)
    peer = stage.peer(publishes=("deposits",))
    peer.wait_for_subscribers()
    nothing = {name: column[:0] for name, column in columns().items()}
    for number, content in enumerate((columns(), nothing), start=1):
        peer.send("deposits", cloud_of_columns(header(number), content))
        recorded(peer, {"deposits": number})
    assert stage.clear() == [0]
    verify(file)
    assert rows_by_entity(file)["/deposits"] == 2


BAD = {
    "cloud_in_a_foreign_frame": ("impacts", lambda: cloud_of_columns(header(1, "lidar"), columns()), "'lidar'"),
    "cloud_without_energy": (
        "deposits", lambda: cloud_of_columns(header(1), {name: np.zeros(2) for name in "xyz"}), "field 'energy'",
    ),
    "truncated_mesh": ("terrain/mesh", lambda: cdr_of_mesh(grid_mesh(survey().points))[:-5], "ends after"),
    "pose_that_is_not_finite": ("sources", lambda: PoseArray(header=header(1), poses=[pose(math.nan)]), "not finite"),
    "markers_in_a_foreign_frame": (
        "trajectories", lambda: trajectory_markers(header(1, "lidar"), columns(), 9, 9), "'lidar'",
    ),
    "hazard_that_is_not_finite": (
        "hazard/zones", lambda: zone_markers(header(1), [zone("passed", np.full((1, 3, 3), np.nan))]), "not finite",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def running(shared_stage):
    """Yield a peer of a recorder, for all tests that send invalid messages."""
    process = shared_stage.node("recorder_node", file=shared_stage.folder / "live.rrd")
    peer = shared_stage.peer(publishes=EVERYTHING)
    peer.wait_for_subscribers()
    yield peer
    assert process.poll() is None, "the node has died"


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_recorded_is_refused_with_a_diagnostic_and_the_node_lives_on(running, case):
    topic, message, sentence = BAD[case]
    running.send(topic, message())
    health = running.wait_for_health(f"{NODE}: {topic}", sentence)
    assert health.level == WARN
    assert "refused" in health.message


def test_a_folder_that_does_not_exist_ends_the_node_with_exit_code_2_and_a_sentence(stage):
    process = stage.node("recorder_node", file=stage.folder / "nowhere" / "live.rrd")
    assert process.wait(PATIENCE) == 2
    assert "there is no folder" in stage.output("recorder_node")
    assert "Traceback" not in stage.output("recorder_node")


def test_a_file_that_is_no_recording_does_not_verify(tmp_path):
    broken = tmp_path / "broken.rrd"
    broken.write_bytes(b"RRF2 and then nothing")
    with pytest.raises(InputError, match="rerun rrd verify refuses it"):
        verify(broken)
