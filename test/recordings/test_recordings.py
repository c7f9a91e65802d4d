"""Tests that a recording contains the flights in the local frame, with a layout of views."""

import sys

import numpy as np
import pyarrow as pa
import pytest
from flights.flights_on_a_floor import MASS, SOURCES, SURVEY, SURVEY_Y_UP, floor, none_thrown, scene, thrown
from programs.command_line import rpf3d

from rpf3d_core.ensemble.colours import zone_colours
from rpf3d_core.ensemble.paths import positions_at, sample_paths
from rpf3d_core.errors import InputError
from rpf3d_core.recordings import replay as replaying
from rpf3d_core.recordings.blueprint import point_of_view
from rpf3d_core.recordings.hazard import LIFT
from rpf3d_core.recordings.log import FRAMES, RecordedGround, import_rerun, write_recording
from rpf3d_core.recordings.log_text import frame_line, material_line
from rpf3d_core.recordings.replay import recording_of, viewer_command
from rpf3d_core.recordings.shapes import coloured_mesh, strips_by_speed
from rpf3d_core.scene.material import Material
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome

pytest.importorskip("rerun", reason="rerun is not installed")

SINGLE = 1e-5
"""Largest rounding error of values stored by rerun as float32, with some margin."""

SUMMARY = {"outcomes": {"stopped": {"rocks": 5}}, "terrain": {"faults": {"flipped_facets": 3, "holes": 0}}}


def read_back(path):
    """Return entity -> column -> list of the values of all rows of a recording."""
    import rerun.chunk

    entities = {}
    for chunk in rerun.chunk.RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = entities.setdefault(str(chunk.entity_path), {})
        for name in batch.schema.names:
            values = batch.column(name)
            whole = values.cast(pa.int64()) if pa.types.is_duration(values.type) else values
            columns.setdefault(name, []).extend(whole.to_pylist())
    return entities


def seconds(times):
    """Return times in seconds from those of rerun, which are in nanoseconds."""
    return np.array(times) * 1e-9


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    terrain = floor(SURVEY)
    write_recording(folder / "run.rrd", scene(folder), RecordedGround(terrain), thrown(terrain), SUMMARY)
    return read_back(folder / "run.rrd")


@pytest.fixture
def flights():
    return thrown(floor(SURVEY))


def test_the_terrain_is_a_mesh_near_zero_with_the_colours_of_its_zones(recording):
    mesh = recording["/world/terrain"]
    vertices = np.array(mesh["Mesh3D:vertex_positions"][0])
    assert np.abs(vertices).max() == 20.0
    assert len(mesh["Mesh3D:triangle_indices"][0]) == 128
    assert len(set(mesh["Mesh3D:vertex_colors"][0])) == 2


def test_the_view_is_right_handed_and_z_up(recording):
    assert recording["/"]["ViewCoordinates:xyz"][0] == [[3, 5, 1]]  # right, forward, up


def test_trajectories_are_strips_from_release_to_end(recording, flights):
    strips = [np.array(strip) for strip in recording["/world/trajectories"]["LineStrips3D:strips"][0]]
    np.testing.assert_allclose(strips[0][0], flights.deposits.release[0], atol=SINGLE)
    np.testing.assert_allclose(strips[-1][-1], flights.deposits.x[-1], atol=SINGLE)
    assert len(recording["/world/trajectories"]["LineStrips3D:colors"][0]) == len(strips)


def test_rocks_move_along_simulated_time(recording, flights):
    rocks = recording["/world/rocks"]
    times = seconds([time for time in rocks["sim_time"] if time is not None])
    frames = [frame for frame in rocks["Points3D:positions"] if frame is not None]
    assert len(frames) == len(times) == FRAMES
    assert times[-1] == pytest.approx(flights.deposits.t.max(), abs=1e-6)
    for row in range(6):
        np.testing.assert_allclose(
            [frame[row] for frame in frames], positions_at(flights.paths, row, times), atol=SINGLE
        )


@pytest.mark.parametrize("row", range(6))
def test_speed_and_energy_are_series_of_each_rock(recording, flights, row):
    name = f"{flights.deposits.source[row]}/{flights.deposits.rock[row]}"
    samples = sample_paths(flights.paths, [row])
    speed = [value[0] for value in recording[f"/speed/{name}"]["Scalars:scalars"] if value is not None]
    energy = [value[0] for value in recording[f"/energy/{name}"]["Scalars:scalars"] if value is not None]
    np.testing.assert_allclose(speed, samples.speed)
    np.testing.assert_allclose(energy, 0.5 * MASS * samples.speed**2)
    series = [value for value in recording[f"/speed/{name}"]["SeriesLines:names"] if value is not None]
    assert series == [[f"{SOURCES[flights.deposits.source[row]]} {flights.deposits.rock[row]}"]]


def test_the_log_tells_the_scene_the_origin_and_the_faults(recording):
    text = "\n".join(line[0] for line in recording["/log/scene"]["TextLog:text"])
    for words in ("floor.yaml", "seed 1", "128 triangles", "bench_1, floor", "500000, 4500000, 1200"):
        assert words in text
    assert "flipped_facets 3" in text
    assert "normal_restitution=0.5" in text and "holes" not in text and "stopped 5" in text


def test_the_log_tells_each_rocks_outcome_with_its_sentence_when_it_ended(recording, flights):
    log = recording["/log/rocks"]
    lines = [line[0] for line in log["TextLog:text"]]
    assert len(lines) == 6
    np.testing.assert_allclose(seconds(log["sim_time"]), np.sort(flights.deposits.t), atol=1e-6)
    left = next(line for line in lines if line.startswith("ledge 2: left_terrain"))
    assert OUTCOME_SENTENCES[Outcome.LEFT_TERRAIN] in left
    assert log["TextLog:level"][lines.index(left)] == ["WARN"]
    assert all(OUTCOME_SENTENCES[Outcome.STOPPED] in line for line in lines if line is not left)


def test_the_document_holds_the_scene_file_and_the_summary(recording):
    text = recording["/document"]["TextDocument:text"][0][0]
    assert "terrain: {pit: {}}" in text and '"flipped_facets": 3' in text and "add the origin" in text


def test_an_input_that_points_up_along_y_is_told_how_to_turn_back():
    line = frame_line(SURVEY_Y_UP)
    assert "(x, z, -y)" in line and "(500000, 4500000, 1200)" in line
    assert "turn" not in frame_line(SURVEY)
    np.testing.assert_array_equal(
        SURVEY_Y_UP.points_to_input([1.0, 2.0, 3.0]), [500_001.0, 1_203.0, -4_500_002.0]
    )  # which is what the line says


def test_a_run_of_no_rocks_can_be_recorded(tmp_path):
    write_recording(tmp_path / "run.rrd", scene(tmp_path), RecordedGround(floor()), none_thrown())
    assert "/world/terrain" in read_back(tmp_path / "run.rrd")


def test_barriers_are_recorded_with_their_names_and_trees_at_their_feet(tmp_path):
    foot = np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 2.0]])
    stems = np.array([[3.0, 2.0, 1.0, 0.4]])
    obstacles = Obstacles(("barriers.fence", "forest"), np.array([0, 1]), (("fence", foot),), stems, (3.0,))
    write_recording(tmp_path / "run.rrd", scene(tmp_path), RecordedGround(floor(), obstacles=obstacles), none_thrown())
    entities = read_back(tmp_path / "run.rrd")
    barriers, trees = entities["/world/barriers"], entities["/world/trees"]
    assert barriers["LineStrips3D:labels"] == [["fence"]]
    np.testing.assert_array_equal(barriers["LineStrips3D:strips"][0][0], foot)
    panel = entities["/world/barriers/panels/0"]["Mesh3D:vertex_positions"][0]
    np.testing.assert_array_equal(panel, np.concatenate([foot, foot + np.array([0.0, 0.0, 3.0])]))
    np.testing.assert_array_equal(trees["Points3D:positions"][0], [[3.0, 2.0, 1.0]])


def test_areas_are_recorded_with_their_names_above_the_ground_and_its_maps(tmp_path):
    terrain = floor()
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    x, y = low + 0.25 * (high - low), low + 0.75 * (high - low)
    ring = np.array([[x[0], x[1]], [y[0], x[1]], [y[0], y[1]], [x[0], y[1]], [x[0], x[1]]])
    ground = RecordedGround(terrain, areas={"ramp": [ring]})
    write_recording(tmp_path / "run.rrd", scene(tmp_path), ground, none_thrown())
    areas = read_back(tmp_path / "run.rrd")["/world/areas"]
    assert areas["LineStrips3D:labels"] == [["ramp"]]
    ((line,),) = areas["LineStrips3D:strips"]
    above = np.array(line)[:, 2] - terrain.vertices[:, 2].max()
    assert (above > 2 * LIFT * np.linalg.norm(np.ptp(terrain.vertices, axis=0))).all() and above.max() < 0.5


def test_a_scene_without_obstacles_and_areas_has_none_in_its_recording(recording):
    assert not {"/world/barriers", "/world/trees", "/world/areas"} & set(recording)


def test_a_recording_passes_rerun_s_own_check(tmp_path):
    import subprocess

    terrain = floor()
    write_recording(tmp_path / "run.rrd", scene(tmp_path), RecordedGround(terrain), thrown(terrain))
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(tmp_path / "run.rrd")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and "verified without error" in done.stdout + done.stderr


def test_without_rerun_the_error_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match="pip install 'rerun-sdk"):
        import_rerun()


def test_vertices_are_parted_where_two_zones_meet():
    terrain = floor()
    mesh = coloured_mesh(terrain)
    assert len(mesh.vertices) == len(terrain.vertices) + 9  # those on the border, x = 0
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], terrain.vertices[terrain.triangles])
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (len(mesh.vertices), 1)))
    colours = zone_colours(terrain.zones)
    for corner in range(3):
        np.testing.assert_array_equal(mesh.colours[mesh.triangles[:, corner]], colours[terrain.zone])


def test_strips_join_end_to_end_and_never_join_two_rocks():
    samples = sample_paths(thrown(floor()).paths)
    strips, speed = strips_by_speed(samples, float(samples.speed.max()))
    assert len(strips) == len(speed) > 6
    breaks = [i for i in range(len(strips) - 1) if np.any(strips[i][-1] != strips[i + 1][0])]
    assert len(breaks) == 5
    drawn = sum(np.linalg.norm(np.diff(strip, axis=0), axis=1).sum() for strip in strips)
    step = np.linalg.norm(np.diff(samples.x, axis=0), axis=1)[np.diff(samples.row) == 0]
    assert drawn == pytest.approx(step.sum())


def test_a_strip_has_nearly_the_speed_of_its_points():
    samples = sample_paths(thrown(floor()).paths, [0])
    fastest = float(samples.speed.max())
    strips, speed = strips_by_speed(samples, fastest)
    at = {tuple(x): v for x, v in zip(samples.x, samples.speed, strict=True)}
    assert abs(at[tuple(strips[0][0])] - speed[0]) <= fastest / 32 * (1 + SINGLE)


def test_the_eye_looks_back_at_the_wall_that_the_rocks_come_down():
    terrain = floor()
    samples = sample_paths(thrown(terrain).paths)
    target, eye = point_of_view(terrain, samples)
    assert eye[0] > target[0] + 5.0 and eye[2] > target[2]  # these rocks fly east
    target, eye = point_of_view(terrain, sample_paths(none_thrown().paths))
    np.testing.assert_array_equal(target, np.zeros(3))
    assert eye[1] < 0.0


def test_replay_opens_the_recording_for_this_machine_only(tmp_path):
    (tmp_path / "run.rrd").write_bytes(b"RRF2")
    command = viewer_command(recording_of(tmp_path))
    assert command[-1] == str(tmp_path / "run.rrd")
    assert command[command.index("--bind") + 1] == "127.0.0.1"


def test_replay_without_a_display_says_so_in_one_sentence(tmp_path):
    (tmp_path / "run.rrd").write_bytes(b"RRF2")
    done = rpf3d("replay", tmp_path, DISPLAY="", WAYLAND_DISPLAY="")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and done.stdout == ""
    assert line.startswith(f"rpf3d: {tmp_path / 'run.rrd'}: there is no display to show it on")


def test_a_viewer_that_cannot_open_its_window_is_reported(tmp_path, monkeypatch):
    """On a busy machine, the viewer needs longer than SETTLED to fail, so the test waits longer."""
    (tmp_path / "run.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr(replaying, "SETTLED", 120.0)
    monkeypatch.setenv("DISPLAY", ":987")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match=r"run\.rrd: the rerun viewer could not open it \("):
        replaying.replay(tmp_path)


def test_replay_of_a_folder_without_a_recording_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"contains no run\.rrd"):
        recording_of(tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        recording_of(tmp_path / "nowhere")


def test_the_log_shows_an_unknown_as_its_range_and_not_as_the_number_that_stands_for_it():
    rock = Material(normal_restitution=0.49, tangential_restitution={"mean": 0.8, "sd": 0.04, "min": 0.7, "max": 0.9})
    one, mean = {"low": 0.33, "high": 0.642, "mean": 0.49}, {"low": 0.75, "high": 0.85, "mean": 0.8}
    unknowns = {"sets": 64, "parameters": {
        "materials.FACE.normal_restitution": one, "materials.*.normal_restitution": mean,
        "materials.FACE.tangential_restitution.mean": mean, "materials.RAMP.friction_angle_deg": one,
        "rock.density": one,
    }}  # fmt: skip
    line = material_line("FACE", rock, unknowns)
    assert "normal_restitution='unknown, 0.33 to 0.642 in 64 parameter sets'" in line and "0.49" not in line
    assert "mean unknown, 0.75 to 0.85 in 64 parameter sets" in line and "sd=0.04" in line
    assert "friction_angle_deg=30.0" in line
    assert "normal_restitution='unknown, 0.75 to 0.85 in" in material_line("BERM", rock, unknowns)
    assert material_line("FACE", rock, {}) == f"material FACE: {rock}"
