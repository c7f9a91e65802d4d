"""Tests that a scene file is read into immutable values, or refused with one sentence per fault."""

from pathlib import Path

import numpy as np
import pytest
import rasterio
from programs.command_line import rpf3d
from pydantic import ValidationError
from rasterio.transform import from_origin

from rpf3d_core.errors import SceneError
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.scene.terrain import TerrainSpec
from rpf3d_core.scene.zone_materials import material_of
from rpf3d_core.terrain.pit.parameters import Pit

SCENES = Path(__file__).parents[2] / "config" / "scenes"

SMALL = """\
terrain:
  files:
    - {path: slope.obj, zone: hard}
materials:
  hard: {normal_restitution: 0.5, tangential_restitution: 0.8}
sources:
  - {name: crest, points: [[0, 0, 1]]}
"""
NEXT_LINE = SMALL.count("\n") + 1
"""Number of the line that a test adds after SMALL."""


A_SHARE = "a number from 0 to 1 (-),"
PLACES = "points, points_file, line, crest, polygon, zone"
NOT_THERE = "but there is no such file (looked for"
ONE_A_POINT = (
    "must be a whole number from 1 to 4000000000; left out: one for each point of a source of points, otherwise one"
)
SPREAD_SENTENCE = (
    "line 7: `sources[0].spread` is [1, -1, 0], but must be three numbers >= 0 (m), the largest distances of a rock "
    "from its place on the source, along x, y and z; uniformly distributed"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "slope.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path


def read(folder: Path, text: str) -> Scene:
    (folder / "scene.yaml").write_text(text)
    return read_scene(folder / "scene.yaml")


def refusal(folder: Path, text: str) -> list[str]:
    """Return the lines of the error that a scene text causes, without the folder of the file."""
    with pytest.raises(SceneError) as caught:
        read(folder, text)
    return str(caught.value).replace(f"{folder / 'scene.yaml'}", "scene.yaml").splitlines()


def test_a_small_scene_is_read_with_every_default(folder: Path) -> None:
    scene = read(folder, SMALL)
    assert scene.terrain.files is not None and scene.terrain.files[0].path == folder / "slope.obj"
    assert (scene.terrain.up, scene.terrain.weld, scene.terrain.crs) == ("z", 1e-4, None)
    assert scene.materials["hard"].friction_angle_deg == 30.0
    assert scene.materials["hard"].stop_speed is None
    assert (scene.rock.density, scene.rock.diameter, scene.rock.mass) == (2700.0, 1.0, None)
    source = scene.sources[0]
    assert (source.rocks, source.velocity, source.spread, source.velocity_spread) == (
        1,
        (0, 0, 0),
        (0, 0, 0),
        (0, 0, 0),
    )
    assert (scene.rebound.name, scene.ground.name) == ("coulomb_limited", "sliding")
    assert (scene.engine, scene.seed) == ("auto", 1)
    assert (scene.stop_speed, scene.gravity, scene.smallest_bounce) == (0.5, 9.81, 1e-3)
    assert (scene.max_time, scene.max_impacts, scene.outputs.trajectories) == (3600.0, 100_000, 200)


def test_a_source_that_does_not_say_how_many_rocks_has_one_for_each_of_its_points(folder: Path) -> None:
    (folder / "holes.csv").write_text("x,y,z\n" + 18 * "1,2,3\n")
    for places, rocks in (
        ("points_file: holes.csv", 18),
        ("points: [[0, 0, 1], [0, 1, 1]]", 2),
        ("line: [[0, 0, 1], [0, 1, 1]]", 1),
        ("points_file: holes.csv, rocks: 3", 3),
    ):
        assert read(folder, SMALL.replace("points: [[0, 0, 1]]", places)).sources[0].rocks == rocks


def test_corners_that_cross_enclose_an_area_and_are_said_to_cross(folder: Path) -> None:
    for corners, why in (
        ("[[0, 0], [2, 2], [2, 0], [0, 2]]", "it crosses itself: Self-intersection[1 1]"),
        ("[[0, 0], [1, 1], [2, 2]]", "it encloses no area"),
    ):
        (line,) = refusal(folder, SMALL.replace("points: [[0, 0, 1]]", f"polygon: {corners}"))
        assert line.startswith("scene.yaml, line 7: `sources[0].polygon`") and why in line


def write_geotiff(path: Path, crs: str | None) -> None:
    options = {"driver": "GTiff", "height": 3, "width": 3, "count": 1, "dtype": "float32", "crs": crs}
    with rasterio.open(path, "w", transform=from_origin(100, 230, 10, 10), **options) as grid:
        grid.write(np.zeros((3, 3), np.float32), 1)


def test_the_reference_system_is_that_of_geotiff_files_unless_it_is_told(folder: Path) -> None:
    write_geotiff(folder / "a.tif", "EPSG:31287")
    write_geotiff(folder / "plain.tif", None)
    scene = SMALL.replace("slope.obj", "a.tif")
    assert read(folder, scene).terrain.crs == "EPSG:31287"
    assert read(folder, scene.replace("terrain:", "terrain:\n  crs: epsg:31287")).terrain.crs == "epsg:31287"
    assert read(folder, scene.replace("a.tif", "plain.tif")).terrain.crs is None
    assert read(folder, SMALL.replace("terrain:", "terrain:\n  crs: EPSG:25833")).terrain.crs == "EPSG:25833"


def test_two_reference_systems_of_one_terrain_are_refused_with_both(folder: Path) -> None:
    write_geotiff(folder / "a.tif", "EPSG:31287")
    write_geotiff(folder / "b.tif", "EPSG:25833")
    scene = SMALL.replace("slope.obj", "a.tif")
    assert refusal(folder, scene.replace("terrain:", "terrain:\n  crs: EPSG:25833")) == [
        "scene.yaml, line 2: `terrain.crs` is 'EPSG:25833', but a.tif is in 'EPSG:31287'; name that, or leave crs out"
    ]
    both = scene.replace("{path: a.tif, zone: hard}", "{path: a.tif, zone: hard}\n    - {path: b.tif, zone: hard}")
    assert refusal(folder, both) == [
        "scene.yaml, line 4: `terrain.files[1].path` is in 'EPSG:25833', but files[0] in 'EPSG:31287'; reproject one"
    ]


def test_a_reference_system_in_another_unit_than_the_metre_is_refused_with_what_to_do(folder: Path) -> None:
    (line,) = refusal(folder, SMALL.replace("terrain:", "terrain:\n  crs: EPSG:2225"))
    assert line == (
        "scene.yaml, line 2: `terrain.crs` is 'EPSG:2225', which is in US survey feet; the terrain is in metres, and "
        "so must it be: give terrain files in US survey feet `unit: us_ft` (`rpf3d new`: --unit us_ft) and name the "
        "same projection in metres, such as EPSG:26941 in place of EPSG:2225, or leave it out"
    )
    for crs, unit, remedy in (
        ("EPSG:2222", "in feet;", "`unit: ft`"),
        ("EPSG:2314", "in the unit \"Clarke's foot\";", "reproject the terrain to a system in metres, or leave it out"),
    ):
        (line,) = refusal(folder, SMALL.replace("terrain:", f"terrain:\n  crs: {crs}"))
        assert unit in line and remedy in line
    german_metre = SMALL.replace("terrain:", "terrain:\n  crs: EPSG:29371")
    assert read(folder, german_metre).terrain.crs == "EPSG:29371", "its metre is 14 millionths longer"


def test_a_reference_system_in_feet_that_a_file_states_is_not_used_and_never_refuses(folder: Path) -> None:
    """The scene can name the same projection in metres; the file may be converted, or its statement wrong."""
    write_geotiff(folder / "a.tif", "EPSG:2225")
    scene = SMALL.replace("slope.obj, zone: hard", "a.tif, zone: hard, unit: us_ft")
    assert read(folder, scene).terrain.crs is None
    assert read(folder, scene.replace("terrain:", "terrain:\n  crs: EPSG:26941")).terrain.crs == "EPSG:26941"
    write_geotiff(folder / "b.tif", "EPSG:2226")
    both = scene.replace("us_ft}", "us_ft}\n    - {path: b.tif, zone: hard, unit: us_ft}")
    assert refusal(folder, both) == [
        "scene.yaml, line 4: `terrain.files[1].path` is in 'EPSG:2226', but files[0] in 'EPSG:2225'; reproject one"
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    ("crs", "why"),
    [("EPSG:999999", "is no known coordinate"), ("EPSG:4326", "is in degrees"), ("EPSG:2225", "is in US survey feet")],
)
def test_a_reference_system_that_cannot_be_used_is_refused_with_its_line_and_nothing_else_is_said(
    folder: Path, crs: str, why: str
) -> None:
    (folder / "scene.yaml").write_text(SMALL.replace("terrain:", f"terrain:\n  crs: {crs}"))
    for words in (("check", "scene.yaml"), ("run", "scene.yaml", "--out", "out")):
        done = rpf3d(*words, cwd=folder)
        (line,) = done.stderr.splitlines()
        assert done.returncode == 2
        assert line.startswith(f"rpf3d: scene.yaml, line 2: `terrain.crs` is '{crs}', which {why}")


def test_a_scene_does_not_change_after_it_is_read(folder: Path) -> None:
    scene = read(folder, SMALL)
    with pytest.raises(ValidationError):
        scene.seed = 2  # type: ignore[misc]


def test_a_number_in_scientific_notation_without_a_point_is_a_number(folder: Path) -> None:
    assert read(folder, SMALL + "smallest_bounce: 1e-4\n").smallest_bounce == 1e-4


def test_a_pit_is_read_as_the_parameters_of_the_synthetic_pit(folder: Path) -> None:
    scene = read(folder, SMALL.replace("files:\n    - {path: slope.obj, zone: hard}", "pit: {}"))
    assert scene.terrain.pit == Pit()
    assert type(scene.terrain.pit) is Pit


@pytest.mark.parametrize(
    ("addition", "sentence"),
    [
        ("stop_sped: 1", "`stop_sped` is not a key of a scene; did you mean `stop_speed`?"),
        ("rock: {mas: 3}", "`rock.mas` is not a key of a scene; did you mean `mass`?"),
        ("path: scene.yaml", "`path` is not a key of a scene; the keys here are terrain, "),
        ("rock: {mass: -3}", "`rock.mass` is -3, but must be a number above 0 (kg)"),
        (
            "rock: {mass: 1, diameter: 2}",
            "`rock` must have exactly one of diameter, mass, volume, but has diameter",
        ),
        (
            "stop_speed: {mean: 3, sd: 1}",
            "`stop_speed` is a mapping, but no distribution can stand here; it must be a number >= 0 (m/s)",
        ),
        ("stop_speed: .nan", "`stop_speed` is nan, but must be a number >= 0 (m/s)"),
        ("stop_speed: -.inf", "`stop_speed` is -inf, but must be a number >= 0 (m/s)"),
        ("stop_speed: 1e999", "`stop_speed` is inf, but must be a number >= 0 (m/s)"),
        ("stop_speed: '1'", "`stop_speed` is '1', but must be a number >= 0 (m/s)"),
        ("stop_speed: true", "`stop_speed` is true, but must be a number >= 0 (m/s)"),
        ("seed: 1.5", "`seed` is 1.5, but must be a whole number from 0 to"),
        ("seed: 9223372036854775808", "`seed` is 9223372036854775808, but must be a whole number from 0 to"),
        ("max_impacts: 0", "`max_impacts` is 0, but must be a whole number of at least 1"),
        *(
            (f"rocks: {written}", f"`rocks` is {shown}, but must be a whole number from 1 to 4000000000, or auto")
            for written, shown in (
                ("Auto", "'Auto'"),
                ("0", "0"),
                ("-5", "-5"),
                ("1e4", "10000.0"),
                ("10.5", "10.5"),
                ('"100"', "'100'"),
                ("10,000", "'10,000'"),
                ("[3]", "[3]"),
                ("1" + 20 * "0", "1" + 20 * "0"),
                ("true", "true"),
            )
        ),
        ("target: {most_rocks: 0}", "`target.most_rocks` is 0, but must be a whole number from 1 to 4000000000"),
        ("gravity: 0", "`gravity` is 0, but must be a number above 0 (m/s2)"),
        ("ground: slide", "`ground` is 'slide', but must be none, sliding, rolling, rolling_stone or sphere"),
        ("rebound: cubic", "`rebound` is 'cubic', but must be constant"),
        ("engine: fast", "`engine` is 'fast', but must be auto, reference or compiled"),
        ("effects: {dreg: {}}", "`effects.dreg` is not a key of a scene"),
        ("outputs: {trajectories: -1}", "`outputs.trajectories` is -1, but must be a whole number of at least 0"),
        ("zones: 3", "`zones` is 3, but must be a list of {zone, polygons}; where polygons overlap"),
        (
            "zones: [{zone: a, polygons: no.geojson}]",
            "`zones[0].polygons` names 'no.geojson', but there is no such file",
        ),
        ("zones: [{zone: a, polygons: .}]", "`zones[0].polygons` names '.', but that is a folder (looked for"),
        ("seed: 1\nseed: 2", "`seed` is given twice, first in line 8"),
        (
            "a: !!python/object:os.x {}",
            "`a` has the tag tag:yaml.org,2002:python/object:os.x, but tags are not read here",
        ),
        ("a: *a", "not valid YAML: found undefined alias 'a'"),
        ("a: &a [1, *a]", "the alias *a stands inside its own anchor, so the value has no end"),
        (
            "target: {<<: {most_rocks: 9}}",
            "`target.<<` is a merge key, but these are not read here; write the keys out",
        ),
        ("a: b: c", "not valid YAML: mapping values are not allowed here"),
        (
            "observed: {points_file: slope.obj, sections: {ledge: [45, 30]}}",
            "`observed.sections.ledge` is [45.0, 30.0], but must be [low, high] with low < high",
        ),
        (
            "observed: {points_file: slope.obj, along: [0, 0, 0]}",
            "`observed.along` is [0, 0, 0], which is no direction",
        ),
    ],
)
def test_a_wrong_top_level_entry_is_refused_with_its_line_and_what_would_be_right(
    folder: Path, addition: str, sentence: str
) -> None:
    line = refusal(folder, SMALL + addition + "\n")[0]
    last_line_added = NEXT_LINE + addition.count("\n")
    assert line.startswith(
        (f"scene.yaml, line {NEXT_LINE}: {sentence}", f"scene.yaml, line {last_line_added}: {sentence}")
    )


@pytest.mark.parametrize(
    ("written", "instead", "sentences"),
    [
        (
            "normal_restitution: 0.5",
            "normal_restitution: 1.5",
            [f"line 5: `materials.hard.normal_restitution` is 1.5, but must be {A_SHARE} R_n, or a distribution"],
        ),
        (
            "normal_restitution: 0.5",
            "normal_resitution: 0.5",
            ["line 5: `materials.hard.normal_resitution` is not a key of a scene; did you mean `normal_restitution`?"],
        ),
        (
            "normal_restitution: 0.5, ",
            "",
            [f"line 5: `materials.hard.normal_restitution` is missing; it must be {A_SHARE} R_n, or a distribution"],
        ),
        (
            "normal_restitution: 0.5, tangential_restitution: 0.8",
            "normal_restitution: 2, tangential_restitution: -1",
            [
                f"line 5: `materials.hard.normal_restitution` is 2, but must be {A_SHARE} R_n, or a distribution",
                f"line 5: `materials.hard.tangential_restitution` is -1, but must be {A_SHARE} R_t, or a distribution",
            ],
        ),
        (
            "[[0, 0, 1]]",
            "[[0, 0], [1, x, 2]]",
            [
                "line 7: `sources[0].points[0]` is [0, 0], but must be three numbers [x, y, z] (m)",
                'line 7: `sources[0].points[1]` is [1, "x", 2], but must be three numbers [x, y, z] (m)',
            ],
        ),
        (
            "[[0, 0, 1]]",
            "[[0, 0, 1]], velocity: [0, 1.0e+200, 0]",
            ["line 7: `sources[0].velocity` lets a rock start at 1e+200 m/s, but 10000 m/s is the most"],
        ),
        (
            "[[0, 0, 1]]",
            "[[0, 0, 1]], speed: {uniform: [2, 60000]}, azimuth_deg: 0",
            ["line 7: `sources[0].speed` lets a rock start at 60000 m/s, but 10000 m/s is the most"],
        ),
        ("[[0, 0, 1]]", "[]", ["line 7: `sources[0].points` is [], but must be a list of points [x, y, z] (m)"]),
        (
            "[[0, 0, 1]]",
            "[[0, 0, 1]], spread: [1, -1, 0], velocity: [0, .nan, 0], rocks: 0",
            [
                f"line 7: `sources[0].rocks` is 0, but {ONE_A_POINT}",
                SPREAD_SENTENCE,
                "line 7: `sources[0].velocity` is [0, nan, 0], but must be three numbers [vx, vy, vz] (m/s)",
            ],
        ),
        (
            "[[0, 0, 1]]",
            "[[0, 0, 1]], rocks: 100000000000000000000",
            [f"line 7: `sources[0].rocks` is 100000000000000000000, but {ONE_A_POINT}"],
        ),
        (
            "points: [[0, 0, 1]]",
            "rocks: 5",
            [f"line 7: `sources[0]` must have exactly one of {PLACES}, but has none of them"],
        ),
        (
            "points: [[0, 0, 1]]",
            "points: [[0, 0, 1]], line: [[0, 0, 1], [1, 0, 1]]",
            [f"line 7: `sources[0]` must have exactly one of {PLACES}, but has points and line"],
        ),
        (
            "points: [[0, 0, 1]]}",
            "points: [[0, 0, 1]]}\n  - {name: crest, points: [[0, 0, 1]]}",
            ["line 8: `sources[1].name` is 'crest', but so is the name of number 1 in the list; names must differ"],
        ),
        (
            "  files:\n    - {path: slope.obj, zone: hard}",
            "  up: x\n  weld: -1",
            [
                "line 2: `terrain.up` is 'x', but must be y or z, the input axis that points up",
                "line 3: `terrain.weld` is -1, but must be a distance >= 0 (m), vertices nearer than this become one",
            ],
        ),
    ],
)
def test_a_wrong_entry_further_down_is_refused_by_its_full_name(
    folder: Path, written: str, instead: str, sentences: list[str]
) -> None:
    lines = refusal(folder, SMALL.replace(written, instead))
    assert lines == [f"scene.yaml, {sentence}" for sentence in sentences]


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("face_angle", "3", "`terrain.pit.face_angle` is not a key of a scene; did you mean `face_angle_deg`?"),
        ("triangles", "1.5", "`terrain.pit.triangles` is 1.5, but must be a whole number"),
        ("roughness", ".nan", "`terrain.pit.roughness` is nan, but must be a number"),
        ("bench_widths", "[7, a]", '`terrain.pit.bench_widths` is [7, "a"], but must be a list of 2 numbers'),
        ("ramp_grade", "5", "`terrain.pit.ramp_grade` is refused: "),
    ],
)
def test_a_wrong_pit_parameter_is_refused_by_its_name_and_line(
    folder: Path, key: str, value: str, sentence: str
) -> None:
    pit = f"pit:\n    seed: 3\n    {key}: {value}"
    lines = refusal(folder, SMALL.replace("files:\n    - {path: slope.obj, zone: hard}", pit))
    assert len(lines) == 1
    assert lines[0].startswith(f"scene.yaml, line 4: {sentence}")


def test_a_pit_made_in_python_is_a_terrain_too() -> None:
    pit = Pit(triangles=5000)
    assert pit.levels.size > 0
    assert TerrainSpec(pit=pit).pit == pit


def test_two_areas_of_one_name_are_refused(folder: Path) -> None:
    twice = "areas_of_interest: [{name: ramp, polygons: slope.obj}, {name: ramp, polygons: slope.obj}]\n"
    assert "`areas_of_interest[1].name` is 'ramp'" in refusal(folder, SMALL + twice)[0]


def test_a_missing_file_is_named_with_where_it_was_looked_for_and_the_scenes_own_hint_once(folder: Path) -> None:
    text = (
        SMALL.replace("slope.obj", "no/slope.stl")
        + "zones: [{zone: a, polygons: b.geojson}]\ndata_hint: ask the surveyor\n"
    )
    mesh, polygons = folder / "no" / "slope.stl", folder / "b.geojson"
    assert refusal(folder, text) == [
        f"scene.yaml, line 3: `terrain.files[0].path` names 'no/slope.stl', {NOT_THERE} {mesh})",
        f"scene.yaml, line 8: `zones[0].polygons` names 'b.geojson', {NOT_THERE} {polygons})",
        "ask the surveyor",
    ]


@pytest.mark.parametrize(
    "content", [b"", b"# nothing\n", b"- 1\n", b"word\n", b"\xff\xfe\x00", b"a: \x01\n", b"[" * 5000]
)
def test_what_is_no_scene_at_all_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "scene.yaml"
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        read_scene(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_scene_file_that_is_not_there_or_is_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="there is no such scene file"):
        read_scene(tmp_path / "none.yaml")
    with pytest.raises(SceneError, match="cannot be read as a scene file"):
        read_scene(tmp_path)


def test_a_zones_material_is_its_own_then_the_first_fitting_pattern_then_the_default(folder: Path) -> None:
    rates = "tangential_restitution: 0.8"
    materials = (
        f"  bench_*: {{normal_restitution: 0.1, {rates}}}\n"
        f"  bench_1*: {{normal_restitution: 0.2, {rates}}}\n"
        f"  bench_12: {{normal_restitution: 0.3, {rates}}}\n"
        f"  default: {{normal_restitution: 0.4, {rates}}}\n"
    )
    scene = read(folder, SMALL.replace("materials:\n", "materials:\n" + materials))
    of = {zone: material_of(scene, zone).normal_restitution for zone in ("bench_12", "bench_1", "ramp", "hard")}
    assert of == {"bench_12": 0.3, "bench_1": 0.1, "ramp": 0.4, "hard": 0.5}


def test_a_zone_without_a_material_is_named(folder: Path) -> None:
    with pytest.raises(
        SceneError, match="no material for the zone 'ramp'; materials has hard: add 'ramp' or `default`"
    ):
        material_of(read(folder, SMALL), "ramp")


def test_the_digest_depends_on_what_the_scene_says_and_not_on_where_it_lies(folder: Path, tmp_path: Path) -> None:
    digest = scene_digest(read(folder, SMALL))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "other.obj").write_bytes((folder / "slope.obj").read_bytes())
    moved = SMALL.replace("slope.obj", "other.obj") + "# a comment\nseed: 1\ndata_hint: unused\n"
    assert scene_digest(read(elsewhere, moved)) == digest
    assert scene_digest(read(folder, SMALL + "seed: 2\n")) != digest
    (folder / "slope.obj").write_text("v 0 0 0\n")
    assert scene_digest(read(folder, SMALL)) != digest


@pytest.mark.parametrize("angle", [22, 40, 50, 59])
def test_the_lab_scenes_are_the_thesis_ramps(angle: int) -> None:
    scene = read_scene(SCENES / f"lab_{angle}.yaml")
    material = material_of(scene, "plywood")
    assert (material.normal_restitution, material.tangential_restitution) == (0.84, 0.70)
    assert scene.sources[0].points == ((0.0, 0.0, 0.3),)
    assert scene.ground.name == "none"


def test_the_authume_scene_reads_the_quarry_or_says_where_its_data_comes_from(tmp_path: Path) -> None:
    if (SCENES / "../../../shared/data/authume").is_dir():
        scene = read_scene(SCENES / "authume_p1.yaml")
        assert [file.zone for file in scene.terrain.files or ()] == ["blue", "gray", "red"]
        assert scene.sources[0].rocks == 250
    away = tmp_path / "a" / "b" / "c"
    away.mkdir(parents=True)
    (away / "authume_p1.yaml").write_bytes((SCENES / "authume_p1.yaml").read_bytes())
    with pytest.raises(SceneError, match="richefeu/AuthumeQuarryRockfalls_Data-in-Brief"):
        read_scene(away / "authume_p1.yaml")


def test_a_material_is_shown_with_the_keys_of_its_kind_of_rocks() -> None:
    point = str(Material(normal_restitution=0.5, tangential_restitution=0.8))
    assert "normal_restitution=0.5" in point and "friction_angle_deg=30.0" in point
    assert "rolling_resistance" not in point and "None" not in point
    body = str(Material.model_validate({"restitution": 0.1, "friction": 0.6}))
    assert "restitution=0.1" in body and "friction=0.6" in body
    assert "normal_restitution" not in body and "friction_angle_deg" not in body and "None" not in body


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("scene.yaml", "rock: {}  # Größe".encode("utf-16"), "byte 0 is not UTF-8 text; if this is a scene file"),
        ("scene.yaml", "rock: {}  # Größe".encode("cp1252"), "if this is a scene file, save it as UTF-8"),
        ("scene.yaml", b"PK\x03\x04\x00\x00\xff", "is not a text file, so this is no scene file"),
        ("my pit.dxf", b"0\nSECTION\n", "is a terrain file, .*: rpf3d new FOLDER --terrain '.*my pit"),
    ],
)
def test_a_file_that_is_no_scene_in_utf_8_is_refused_with_what_to_do(tmp_path, name, content, sentence):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError, match=sentence):
        read_scene(tmp_path / name)
