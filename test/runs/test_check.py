"""Tests that `rpf3d check` reports faults of the terrain, the places of the sources, and the time of the run."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import SLOPE, grid, with_models, write_binary_stl
from programs.command_line import python, rpf3d

from rpf3d_core import cli
from rpf3d_core.commands.check import _describe_cost
from rpf3d_core.ensemble.fly import REFERENCE_ROCKS
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.tally import BYTES_PER_CELL
from rpf3d_core.results.notes import warnings_of_run
from rpf3d_core.runs.check import check_scene
from rpf3d_core.runs.pilot_run import COMPILE_S, PILOT_ROCKS, Cost
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import chosen_scene

ABOVE = "  - {name: above, points: [[1.3, 1.2, 9], [2.5, 2.5, 8]], rocks: 4}\n"
UNDER = "  - {name: under, points: [[1.3, 1.2, 9], [1.3, 1.2, -9]], rocks: 5}\n"
BESIDE = "  - {name: beside, points: [[130, 1.2, 9]], rocks: 3}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    vertices, triangles = grid(5, 6)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    return tmp_path


def checked(folder: Path, text: str):  # type: ignore[no-untyped-def]
    (folder / "scene.yaml").write_text(with_models(text))
    return check_scene(read_scene(folder / "scene.yaml"))


def shown(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path) -> tuple[int, str, str]:
    """Return exit code, output (words separated by single blanks) and error output of `rpf3d check`."""
    monkeypatch.setattr(sys, "argv", ["rpf3d", "check", str(folder / "scene.yaml")])
    code = 0
    try:
        cli.main()
    except SystemExit as end:
        code = int(end.code or 0)
    printed = capsys.readouterr()
    return code, " ".join(printed.out.split()), printed.err


def test_a_good_scene_is_fit_and_its_cost_is_told(folder: Path) -> None:
    report = checked(folder, SLOPE + ABOVE)
    assert report.fit and [source.name for source in report.sources] == ["above"]
    assert report.faults.triangles == 40 and report.faults.flipped_facets == 0
    cost = report.cost
    assert cost is not None
    assert (cost.rocks, cost.pilot, cost.engine, cost.compile_s) == (4, 4, "reference", 0.0)
    assert cost.impacts >= 1.0 and cost.fly_s > 0.0


def test_the_heights_of_a_source_are_those_of_its_points_above_the_mesh(folder: Path) -> None:
    over = "  - {name: over, points: [[1, 1, 0], [3, 2, 0]], rocks: 6, above_ground: 2.5}\n"
    (source,) = checked(folder, SLOPE + over).sources
    assert (source.rocks, source.under_ground, source.off_terrain) == (6, 0, 0)
    assert (source.lowest, source.highest) == pytest.approx((2.5, 2.5), abs=1e-9), "rounding of heights of a few metres"
    assert source.describe() == "6 rocks, 2.50 m above the ground"


@pytest.mark.parametrize(("height", "is_noticed"), [(19, False), (21, True)])
def test_a_source_higher_above_the_ground_than_in_the_live_simulator_is_noticed(
    height: int, is_noticed: bool, folder: Path
) -> None:
    over = f"  - {{name: over, points: [[1, 1, 0], [3, 2, 0]], rocks: 6, above_ground: {height}}}\n"
    noticed = any("starts 21 m or more above the ground" in each for each in checked(folder, SLOPE + over).warnings)
    assert noticed == is_noticed


def test_rocks_under_the_ground_and_beside_the_terrain_are_told_apart(folder: Path) -> None:
    report = checked(folder, SLOPE + ABOVE + UNDER + BESIDE)
    assert not report.fit and report.cost is None, "what cannot be flown costs nothing"
    told = {source.name: (source.under_ground, source.off_terrain) for source in report.sources}
    assert told == {"above": (0, 0), "under": (2, 0), "beside": (0, 3)}
    described = {source.name: source.describe() for source in report.sources}
    assert described["under"].startswith("5 rocks, ") and described["under"].endswith("; 2 UNDER THE GROUND")
    assert described["beside"] == "3 rocks; 3 OFF THE TERRAIN"


def test_many_rocks_are_judged_by_a_pilot_and_go_to_the_compiled_engine(folder: Path) -> None:
    pytest.importorskip("numba", reason="numba is not installed: `auto` never takes the compiled engine")
    many = REFERENCE_ROCKS + 1
    cost = checked(folder, SLOPE + ABOVE.replace("rocks: 4", f"rocks: {many}")).cost
    assert (cost.rocks, cost.pilot, cost.engine) == (many, PILOT_ROCKS, "compiled")


def test_fewer_spheres_than_points_go_to_the_compiled_engine_for_each_takes_longer(folder: Path) -> None:
    sphere = "rock: {shape: sphere}\n"
    for rocks, more, engine in ((41, sphere, "compiled"), (40, sphere, "reference"), (41, "", "reference")):
        cost = checked(folder, SLOPE + ABOVE.replace("rocks: 4", f"rocks: {rocks}") + more).cost
        assert cost is not None and cost.engine == engine, (rocks, more)


@pytest.mark.long
def test_compiling_is_announced_where_nothing_has_been_compiled_before_and_nowhere_else(folder: Path) -> None:
    pytest.importorskip("numba", reason="numba is not installed: there is nothing to compile")
    (folder / "scene.yaml").write_text(with_models(SLOPE + ABOVE))
    home = folder / "home"
    asked = ("check", "scene.yaml", "--engine", "compiled")
    told = []
    for _ in range(2):
        done = rpf3d(*asked, cwd=folder, XDG_CACHE_HOME=str(home))
        assert done.returncode == 0, done.stderr
        told.append(" ".join(done.stdout.split()))
        simulate = f"import rpf3d_core as r; r.simulate({str(folder / 'scene.yaml')!r}, engine='compiled')"
        assert python(simulate, XDG_CACHE_HOME=str(home)).returncode == 0
    assert f"and some {COMPILE_S:.0f} to 45 s to compile, the first time" in told[0]
    assert "to compile," not in told[1] and "that have not been compiled yet also compiles" in told[1]
    (folder / "scene.yaml").write_text(with_models(SLOPE + ABOVE, ground="sliding"))
    done = rpf3d(*asked, cwd=folder, XDG_CACHE_HOME=str(home))
    assert "the first time" in done.stdout, "other models have not been compiled yet"


@pytest.mark.parametrize(
    ("engine", "compile_s", "words"),
    [
        ("compiled", COMPILE_S, "the compiled engine, and some 20 to 45 s to compile, the first time (from"),
        ("compiled", 0.0, "have not been compiled yet also compiles, for some 20 to 45 s (from a pilot"),
        ("reference", 0.0, "the reference engine (from a pilot of 20 rocks"),
    ],
)
def test_the_time_to_compile_is_never_left_out(engine: str, compile_s: float, words: str) -> None:
    """The cached loop may have other effects than the run: a run of 0.17 s may take 38 s with compilation."""
    cost = Cost(rocks=6400, auto=False, engine=engine, fly_s=0.17, compile_s=compile_s, impacts=60.0, pilot=20,
                unresolved=0)  # fmt: skip
    assert words in _describe_cost(cost)


def test_rocks_and_engine_can_be_chosen_and_the_scenes_own_number_counts(folder: Path) -> None:
    two = SLOPE + ABOVE + ABOVE.replace("above", "also").replace("rocks: 4", "rocks: 2")
    (folder / "scene.yaml").write_text(two + "rocks: 30\n")
    scene = read_scene(folder / "scene.yaml")
    for rocks, expected in ((None, [20, 10]), (3, [2, 1]), ("auto", [668, 334])):
        report = check_scene(chosen_scene(scene, rocks, "reference", None))
        assert [source.rocks for source in report.sources] == expected
        assert report.cost is not None and report.cost.engine == "reference"
        assert report.cost.rocks == (scene.target.most_rocks if rocks == "auto" else sum(expected))


def test_of_very_many_rocks_a_part_is_looked_at_and_said_to_be(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rpf3d_core.runs.check.MOST_CHECKED", 100)
    (source,) = checked(folder, SLOPE + ABOVE.replace("rocks: 4", "rocks: 1001")).sources
    assert (source.rocks, source.checked) == (1001, 91)
    assert source.describe().startswith("1,001 rocks (91 looked at), ")


def test_what_the_maps_need_is_told_and_too_much_is_refused_as_a_run_refuses_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    report = checked(folder, SLOPE + ABOVE + "hazard: {cell: 0.01, memory_gb: 0.2}\n")
    raster = report.maps.raster
    assert report.maps.least == pytest.approx((raster.nx * raster.ny + 40) * BYTES_PER_CELL / 1e9)
    code, said, _ = shown(monkeypatch, capsys, folder)
    assert code == 0
    cells = f"hazard maps {raster.nx:,} x {raster.ny:,} cells of 0.01 m and 40 facets: {report.maps.least:.3f} GB"
    assert f"{cells}, and percentiles in what is left of 0.2 GB" in said
    checked_text = SLOPE + ABOVE + "hazard: {cell: 0.01, memory_gb: 0.001}\n"
    with pytest.raises(InputError, match=r"memory_gb allows 0\.001 GB; a cell of 0\.25 m fits"):
        checked(folder, checked_text)


def test_the_compiled_engine_without_numba_is_refused_as_a_run_refuses_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rpf3d_core.setup.prepared.HAS_NUMBA", False)
    with pytest.raises(InputError, match="'compiled' cannot be used: numba is not installed"):
        checked(folder, SLOPE + ABOVE + "engine: compiled\n")


def test_checking_changes_nothing_on_disk(folder: Path) -> None:
    checked(folder, SLOPE + ABOVE)
    assert sorted(path.name for path in folder.iterdir()) == ["scene.yaml", "slope.stl"]


def test_the_report_on_the_screen_has_the_faults_the_sources_the_models_and_the_cost(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    checked(folder, SLOPE + ABOVE)
    code, said, complaints = shown(monkeypatch, capsys, folder)
    assert (code, complaints) == (0, "")
    for part in (
        "files slope.stl", "triangles 40 (30 vertices, 69 edges)", "boundary edges 18 (holes 0)", "flipped facets 0",
        "source above 4 rocks, ", "effects none named", "models rebound constant, ground none, stop_speed 0.5 m/s",
        "with the reference engine (from a pilot of 4 rocks: ",
    ):  # fmt: skip
        assert part in said


def test_sources_out_of_place_are_shown_and_end_with_exit_code_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    checked(folder, SLOPE + UNDER + BESIDE)
    code, said, complaints = shown(monkeypatch, capsys, folder)
    assert code == 2
    assert "2 UNDER THE GROUND" in said and "3 OFF THE TERRAIN" in said
    sentence = (
        "some rocks do not start above the ground; see the sources above: raise sources under the ground, or give "
        "`above_ground`; move sources that are off the terrain"
    )
    assert complaints == f"rpf3d: {folder / 'scene.yaml'}: {sentence}\n"


def test_a_mesh_with_faults_is_reported_and_still_fit(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    vertices, triangles = grid(5, 6)
    corners = vertices[triangles].copy()
    corners[5] = corners[5, ::-1]  # wound the other way
    corners = np.delete(corners, 24, axis=0)  # a hole in the middle
    thread = np.stack([corners[0, 0], corners[0, 1], 0.5 * (corners[0, 0] + corners[0, 1])])[None]  # zero area
    write_binary_stl(folder / "slope.stl", np.concatenate([corners, corners[:1], thread]))
    report = checked(folder, SLOPE + ABOVE)
    faults = dataclasses.asdict(report.faults)
    assert faults["triangles"] == 41 and faults["flipped_facets"] >= 1
    assert (faults["duplicate_facets"], faults["zero_area_facets"]) == (1, 1)
    assert faults["holes"] == 1 and faults["non_manifold_edges"] > 0
    assert report.fit
    code, said, _ = shown(monkeypatch, capsys, folder)
    assert code == 0 and "duplicate facets 1" in said and "zero-area facets 1" in said and "(holes 1)" in said


def test_a_pilot_that_ends_unresolved_says_which_ground_model_to_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    # Without losses along the ground, a rock still moves after its bounces, and `ground: none` has no sliding.
    high, low = [(-50, -50, 20), (-50, 50, 20)], [(50, -50, -20), (50, 50, -20)]
    write_binary_stl(folder / "slope.stl", np.array([[high[0], low[0], low[1]], [high[0], low[1], high[1]]], float))
    above = "  - {name: above, points: [[-40, 0, 18]], rocks: 4}\n"
    report = checked(folder, SLOPE.replace("tangential_restitution: 0.8", "tangential_restitution: 1.0") + above)
    assert report.cost is not None and report.cost.unresolved == 4
    code, _, said = shown(monkeypatch, capsys, folder)
    assert code == 0
    assert "4 of 4 pilot rocks ended unresolved_contact: name `ground: sliding`, or raise stop_speed" in said
    sphere = checked(folder, SLOPE + above.replace("18]", "19.5]") + "rock: {shape: sphere}\n").warnings
    assert len(sphere) == 1 and "name `ground: sphere`, or raise stop_speed" in sphere[0], "it does not slide"


def write_square(folder: Path, name: str, west: float, east: float) -> None:
    ring = [[west, 0.5], [east, 0.5], [east, 3.5], [west, 3.5], [west, 0.5]]
    (folder / name).write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))


def test_an_area_of_interest_off_the_terrain_is_refused_and_one_partly_off_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    area = "areas_of_interest: [{name: ramp, polygons: ramp.json}]\n"
    write_square(folder, "ramp.json", 30.0, 40.0)
    with pytest.raises(InputError, match=r"ramp\.json: the area of interest 'ramp' lies off the terrain: it goes from"):
        checked(folder, SLOPE + ABOVE + area)
    code, _, said = shown(monkeypatch, capsys, folder)
    assert code == 2 and "(30, 0.5) to (40, 3.5), the terrain from (0, 0) to (5, 4); it must be in the plan" in said
    write_square(folder, "ramp.json", 3.0, 11.0)
    (told,) = checked(folder, SLOPE + ABOVE + area).warnings
    part = "25 % of the area of interest 'ramp' lies on the terrain"
    assert told == f"{part}; the other part lies outside the terrain or over a hole"
    code, _, said = shown(monkeypatch, capsys, folder)
    assert code == 0 and said == f"rpf3d: note: {told}\n"
    run = simulate(folder / "scene.yaml", engine="reference")
    assert warnings_of_run(run) == [told], "a run and its report warn of it as well"
    write_square(folder, "ramp.json", 1.0, 4.0)
    assert checked(folder, SLOPE + ABOVE + area).warnings == []


def test_an_area_within_one_facet_is_on_the_terrain(folder: Path) -> None:
    write_binary_stl(folder / "slope.stl", np.array([[[0, 0, 0], [90, 0, 0], [0, 90, 0]]], float))
    write_square(folder, "ramp.json", 10.0, 13.0)
    area = "areas_of_interest: [{name: ramp, polygons: ramp.json}]\n"
    assert checked(folder, SLOPE + ABOVE + area).warnings == []


def test_a_source_half_off_the_terrain_says_how_much_of_it_is_on(folder: Path) -> None:
    scar = "  - {name: scar, polygon: [[-2, 1], [2, 1], [2, 3], [-2, 3]], rocks: 5}\n"
    told, *_ = checked(folder, SLOPE + scar).warnings
    assert told.startswith("50 % of the polygon of source 'scar' lies on the terrain")


def test_a_run_warns_of_the_polygon_that_it_flew_with_although_the_file_is_gone(folder: Path) -> None:
    write_square(folder, "scar.json", -2.0, 2.0)
    (folder / "scene.yaml").write_text(SLOPE + "  - {name: scar, polygon: scar.json, rocks: 5}\n")
    run = simulate(folder / "scene.yaml", engine="reference")
    (folder / "scar.json").unlink()
    assert any(told.startswith("50 % of the polygon of source 'scar' lies on") for told in warnings_of_run(run))


@pytest.mark.long
@pytest.mark.parametrize("command", ["run", "check"])
@pytest.mark.parametrize(
    ("written", "told"), [("slpoe", "did you mean 'slope'?"), ("bench_*", "the zones are slope; correct it, or remove")]
)
def test_a_material_of_a_zone_that_is_not_there_is_refused(folder: Path, command: str, written: str, told: str) -> None:
    materials = "{normal_restitution: 0.5, tangential_restitution: 0.8}"
    text = SLOPE.replace("zone: rock", "zone: slope").replace("  rock:", f"  default: {materials}\n  '{written}':")
    (folder / "scene.yaml").write_text(text + ABOVE)
    done = rpf3d(command, "scene.yaml", *(("--out", "out") if command == "run" else ()), cwd=folder)
    assert done.returncode == 2
    line = next(i for i, each in enumerate(text.splitlines(), start=1) if written in each)
    assert f"scene.yaml, line {line}: `materials.{written}` fits no zone of the terrain; {told}" in done.stderr


def test_the_size_and_mass_of_rocks_are_shown_so_that_a_slip_in_a_unit_is_seen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    for rock, told in (
        ("", "1,410 kg, 1 m in diameter"),
        ("rock: {mass: {uniform: [60, 1700]}}\n", "60-1,700 kg, 0.349-1.06 m in diameter"),
        ("rock: {volume: {uniform: [0.1, 1]}}\n", "270-2,700 kg, 0.576-1.24 m in diameter"),
    ):
        assert checked(folder, SLOPE + ABOVE + rock).rocks.describe() == told
        assert f"rocks {told} " in shown(monkeypatch, capsys, folder)[1]


def test_what_is_allowed_and_hardly_meant_is_told(folder: Path) -> None:
    friction = SLOPE.replace("restitution: 0.8}", "restitution: 0.8, friction_angle_deg: 0.6}")
    rolls = SLOPE.replace("restitution: 0.8}", "restitution: 0.8, rolling_friction: 0.5}")
    sphere = "rock: {shape: sphere}\nground: sphere\n"
    stems = "effects: {forest: {stems_per_ha: 9, dbh_mean_cm: 0.3}}\n"
    for text, told in (
        (SLOPE + ABOVE + sphere, "`materials.rock.rolling_friction` is not given and taken as 0: a sphere loses no"),
        (rolls.replace("n: 0.5", "n: 0") + ABOVE + sphere, "`materials.rock.rolling_friction` is 0: a sphere loses no"),
        (rolls + ABOVE + "ground: sliding\n", "`materials.rock.rolling_friction` has no effect with `ground: sliding`"),
        (SLOPE.replace("n: 0.5", "n: 0.1").replace("0.8}", "0.15}") + ABOVE,
         "`materials.rock.tangential_restitution` is at most 0.15, less than all published values"),
        (SLOPE.replace("n: 0.5", "n: 0.05") + ABOVE, "`materials.rock.normal_restitution` is at most 0.05, less than"),
        (SLOPE + ABOVE + "gravity: 0.981\n", "`gravity` is 0.981 m/s2; on Earth it is 9.76 to 9.84 m/s2"),
        (SLOPE + ABOVE + stems, "`effects.forest.dbh_mean_cm` is 0.3 cm; is it in metres?"),
        (SLOPE + ABOVE + "rock: {density: 2.7, diameter: 1}\n", "`rock.density` is 2.7 kg/m3; is it in t/m3?"),
        (friction + ABOVE + "ground: sliding\n", "`materials.rock.friction_angle_deg` is 0.6 degrees; is it in"),
        (SLOPE + ABOVE + "target: {half_width: 0.1}\n", "`target` has no effect, for `rocks` is not auto"),
        (SLOPE + ABOVE.replace("rocks: 4", "rocks: 1"), "source 'above' uses 1 of its 2 points, because it has no"),
    ):
        sentences = [sentence for sentence in checked(folder, text).warnings if "pilot" not in sentence]
        assert len(sentences) == 1 and sentences[0].startswith(told), sentences
    assert checked(folder, SLOPE + ABOVE + "target: {half_width: 0.1}\nrocks: auto\n").warnings == []
    assert checked(folder, friction + ABOVE).warnings == [], "without sliding there is no friction"
    degrees = checked(folder, rolls.replace("friction: 0.5", "friction: 30") + ABOVE + "ground: sliding\n").warnings
    assert any("30 is the tangent of a slope, not an angle in degrees" in sentence for sentence in degrees)
    assert checked(folder, rolls + ABOVE + sphere).warnings == [], "a sphere that rolls needs rolling friction"


@pytest.mark.long
def test_a_level_that_no_cell_reaches_is_told_on_the_screen_and_in_the_summary(folder: Path) -> None:
    spread = ABOVE.replace("rocks: 4", "rocks: 40, spread: [1, 1, 0]")
    (folder / "scene.yaml").write_text(
        SLOPE + spread + "ground: sliding\nhazard: {cell: 0.25, reach_levels: [0.01, 1]}\n"
    )
    done = rpf3d("run", "scene.yaml", "--out", "out", cwd=folder)
    assert done.returncode == 0
    note = "no cell of 0.25 m is reached by 100 % of the rocks: zones.geojson has no such zone. "
    note += "The share of a cell shrinks with the cell, so this says nothing about how many rocks reach an area"
    assert done.stderr == f"rpf3d: note: {note}\n"
    zones = json.loads((folder / "out" / "summary.json").read_text())["hazard"]["zones"]
    assert [(zone["level"], zone["cells"] > 0) for zone in zones] == [(0.01, True), (1.0, False)]


TETRAHEDRON = """\
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


def body_scene(folder: Path, shape: str) -> Path:
    """Write a scene with one rock of a shape high above the slope, so that the check is short; return its path."""
    text = (
        "terrain: {files: [{path: slope.stl, zone: face}]}\n"
        "materials: {face: {restitution: 0.1, friction: 0.6, rolling_resistance: 0.2}}\n"
        f"rock: {{density: 2000, shape: {shape}}}\nmax_time: 0.1\nsources:\n"
        "  - {name: above, points: [[1.3, 1.2, 9]], rocks: 1}\n"
    )
    (folder / "scene.yaml").write_text(text)
    return folder / "scene.yaml"


def test_shapes_are_reported_with_corners_volume_and_share(folder: Path) -> None:
    (folder / "solid.obj").write_text(TETRAHEDRON)
    (folder / "open.obj").write_text(TETRAHEDRON.rsplit("f", 1)[0])
    report = check_scene(read_scene(body_scene(folder, "{files: [solid.obj, open.obj], weights: [3, 1]}")))
    assert report.shapes[:2] == (
        "solid, 4 corners, 4 faces, 0.167 m3, 75 % of the rocks",
        "open, 4 corners, 4 faces, 0.167 m3, 25 % of the rocks",
    ), "a sixth of the cube on its edges"
    assert (report.rocks.lightest, report.rocks.heaviest) == pytest.approx((2000.0 / 6.0, 2000.0 / 6.0))
    solid = [sentence for sentence in report.shapes[2:] if sentence.startswith("`rock.shape.files[0]`: ")]
    other = [sentence for sentence in report.shapes[2:] if sentence.startswith("`rock.shape.files[1]`: ")]
    assert len(solid) == 1 and "4 corners; 40 were asked for" in solid[0], "it is closed and convex"
    assert any("the solid is open: 3 edges" in sentence for sentence in other)


def test_a_shape_that_is_scaled_has_no_volume_of_its_own(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    body_scene(folder, "{family: eota221}")
    code, told, _ = shown(monkeypatch, capsys, folder)
    assert code == 0 and "shape eota221, 24 corners, 26 faces" in told and " m3" not in told


def test_points_have_no_shape_to_report(folder: Path) -> None:
    assert checked(folder, SLOPE + ABOVE).shapes == ()
