"""Tests that `rpf3d check` prints the extents of all inputs before a refusal, and hints about coordinates."""

import json
import shlex
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from input_files.mine_files import EAST, NORTH, at_site, write_dxf, write_landxml, write_vector
from input_files.terrain_files import grid, with_models, write_binary_stl
from typer.testing import CliRunner

from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.formats.polylines import read_lines
from rpf3d_core.formats.units import LENGTHS
from rpf3d_core.runs.check import Check, check_scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.setup.warnings.extents import Extent
from rpf3d_core.setup.warnings.wrong_coordinates import placing_hints

VERTICES, TRIANGLES = grid(9, 11, 2.0)
SITE = at_site(VERTICES)
MIDDLE = [EAST + 10.0, NORTH + 8.0]
SCENE = """\
terrain:
  files: [{{path: {terrain}}}]
materials: {{default: {{normal_restitution: 0.5, tangential_restitution: 0.8}}}}
sources: [{{name: top, points: [{point}], above_ground: 1.0}}]
"""


def seen(
    folder: Path, terrain: str, point: list[float], more: str = "", of_terrain: str = ""
) -> tuple[dict[str, str], list[str], str, Check]:
    """Return the extents (by name) and hints that the check showed, the refusal ("" without), and the report.

    more, of_terrain : lines that are added to the scene, and to its terrain
    """
    text = SCENE.format(terrain=terrain, point=point).replace("materials:", f"{of_terrain}materials:") + more
    (folder / "scene.yaml").write_text(with_models(text))
    scene = read_scene(folder / "scene.yaml")
    shown: dict[str, str] = {}
    hints: list[str] = []

    def show(extents, sentences):  # type: ignore[no-untyped-def]
        shown.update({extent.name: extent.describe(scene.terrain.crs) for extent in extents})
        hints.extend(sentences)

    try:
        return shown, hints, "", check_scene(scene, show)
    except InputError as fault:
        return shown, hints, str(fault), None  # type: ignore[return-value]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_landxml(tmp_path / "pit.xml", SITE, TRIANGLES)
    return tmp_path


def area(folder: Path, corners: list[list[float]], **more: object) -> str:
    """Write an area of interest; return the lines of the scene that name it."""
    content = {"type": "Polygon", "coordinates": [[*corners, corners[0]]], **more}
    (folder / "ramp.geojson").write_text(json.dumps(content))
    return "areas_of_interest: [{name: ramp, polygons: ramp.geojson}]\n"


def box(x: float, y: float, width: float = 2.0, depth: float = 2.0) -> list[list[float]]:
    return [[x, y], [x + width, y], [x + width, y + depth], [x, y + depth]]


def test_the_extents_of_a_sound_scene_are_plain_decimals_with_their_reference_systems(folder):
    shown, hints, refusal, _ = seen(folder, "pit.xml", [*MIDDLE, 0], area(folder, box(EAST + 3.0, NORTH + 3.25)))
    low, high = SITE[:, 2].min(), SITE[:, 2].max()
    assert shown == {
        "terrain": f"x 457000 .. 457020  y 7654000 .. 7654016  z {low:g} .. {high:g}  (EPSG:32719)",
        "source top": "x 457010 .. 457010  y 7654008 .. 7654008  z on the ground + 1 m  (EPSG:32719)",
        "area ramp": "x 457003 .. 457005  y 7654003.25 .. 7654005.25  (CRS not stated)",
    }
    assert (hints, refusal) == ([], "")


@pytest.mark.parametrize(
    ("point", "hint"),
    [
        ([MIDDLE[1], MIDDLE[0], 0], "source top would lie on the terrain if x and y were swapped"),
        ([1000 * MIDDLE[0], 1000 * MIDDLE[1], 0], "source top would lie on the terrain if it were in millimetres"),
        ([MIDDLE[0] / 0.3048, MIDDLE[1] / 0.3048, 0], "source top would lie on the terrain if it were in feet"),
        ([MIDDLE[0], 801.0, MIDDLE[1]], "source top would lie on the terrain if y and z were swapped"),
        ([0.001 * MIDDLE[0], 0.001 * MIDDLE[1], 0], "if it were in kilometres"),
    ],
)
def test_extents_and_the_reason_are_shown_before_a_source_off_the_terrain_is_refused(folder, point, hint):
    shown, hints, refusal, _ = seen(folder, "pit.xml", point)
    assert list(shown) == ["terrain", "source top"] and "off the terrain" in refusal
    (told,) = hints
    assert hint in told


def test_the_unit_that_a_drawing_states_is_told_before_another_input_is_refused(folder):
    """The drawing is in feet and says so, but is read in metres: the source is refused, although it is right."""
    write_dxf(folder / "feet.dxf", SITE / 0.3048, TRIANGLES, units=2)
    _, hints, refusal, _ = seen(folder, "feet.dxf", [*MIDDLE, 0])
    assert "source" in refusal and "off the terrain" in refusal
    assert hints[-1].startswith("feet.dxf: states that it is in feet, and is read in metres")
    assert sum("states that it is in feet" in hint for hint in hints) == 1


def test_areas_in_degrees_are_recognized_and_the_transformation_is_offered(folder):
    pytest.importorskip("pyproj", reason="pyproj is not installed: it is in the extra `mine`")
    from pyproj import Transformer

    back = Transformer.from_crs("EPSG:32719", "EPSG:4326", always_xy=True)
    corners = [list(back.transform(x, y)) for x, y in box(EAST + 3.0, NORTH + 3.0)]
    shown, hints, refusal, _ = seen(folder, "pit.xml", [*MIDDLE, 0], area(folder, corners))
    assert "lies off the terrain" in refusal and "e+" not in refusal
    assert "area ramp" in shown
    (told,) = hints
    assert "longitude and latitude" in told and "transformed to EPSG:32719 it lies on it" in told
    command = f"--kind polygon --from EPSG:4326 --to EPSG:32719 --out {folder / 'ramp_32719.geojson'}"
    assert f"rpf3d import layer {folder / 'ramp.geojson'} {command}" in told
    away = [[x + 0.1, y] for x, y in corners]
    (told,) = seen(folder, "pit.xml", [*MIDDLE, 0], area(folder, away))[1]
    assert "transformed to EPSG:32719, x 4673" in told and "it is off the terrain, x 457000 to " in told
    assert "of another site" in told and "rpf3d import" not in told, "a file that does not fit is not transformed"
    stated = area(folder, corners, crs={"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::4326"}})
    _, hints, refusal, _ = seen(folder, "pit.xml", [*MIDDLE, 0], stated)
    assert "area ramp is in EPSG:4326, and the terrain in EPSG:32719; transform it: rpf3d import layer" in refusal
    assert hints == [], "once is enough"


def test_a_file_in_another_zone_of_utm_is_refused_although_it_overlaps(folder):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    import shapely

    write_vector(folder / "a.gpkg", [shapely.box(EAST + 2, NORTH + 2, EAST + 5, NORTH + 5)], crs="EPSG:32718")
    named = "areas_of_interest: [{name: ramp, polygons: a.gpkg}]\n"
    shown, _, refusal, _ = seen(folder, "pit.xml", [*MIDDLE, 0], named)
    assert shown["area ramp"].endswith("(EPSG:32718)")
    assert "area ramp is in EPSG:32718, and the terrain in EPSG:32719" in refusal


@pytest.mark.parametrize("kind", ["line", "polygon", "point"])
def test_the_command_that_transforms_the_file_of_a_source_works_in_any_folder(folder, kind, monkeypatch):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    import shapely

    corners = box(EAST + 3, NORTH + 3)
    shape = {
        "line": shapely.LineString(corners), "polygon": shapely.Polygon(corners), "point": shapely.Point(corners[0])
    }[kind]  # fmt: skip
    (folder / "my sources").mkdir()
    write_vector(folder / "my sources" / "crest.shp", [shapely.force_3d(shape, 810.0)], crs="EPSG:32718")
    key = {"point": "points_file"}.get(kind, kind)
    text = SCENE.format(terrain="pit.xml", point=[0, 0]).replace("points: [[0, 0]]", f"{key}: my sources/crest.shp")
    (folder / "scene.yaml").write_text(with_models(text))
    for here in (folder, folder / "my sources", folder.parent):
        monkeypatch.chdir(here)
        with pytest.raises(InputError, match="transform it: ") as refused:
            check_scene(read_scene(folder / "scene.yaml"))
        command = shlex.split(str(refused.value).split("transform it: rpf3d ")[1])
        done = CliRunner().invoke(app, command)
        assert done.exit_code == 0, done.exception
        (folder / "my sources" / "crest_32719.geojson").unlink()


def test_a_line_of_a_file_has_no_heights_because_its_rocks_start_on_the_ground(folder):
    line = {"type": "LineString", "coordinates": [[*MIDDLE, 2480.0], [MIDDLE[0] + 2.0, MIDDLE[1], 2480.0]]}
    (folder / "crest.geojson").write_text(json.dumps(line))
    text = SCENE.format(terrain="pit.xml", point=[0, 0]).replace("points: [[0, 0]]", "line: crest.geojson")
    shown = {}
    for height, ending in (("1.0", "z on the ground + 1 m  (CRS"), ("0", "z on the ground  (CRS")):
        (folder / "scene.yaml").write_text(with_models(text.replace("above_ground: 1.0", f"above_ground: {height}")))
        check_scene(
            read_scene(folder / "scene.yaml"), lambda found, _: shown.update({e.name: e.describe(None) for e in found})
        )
        assert shown["source top"] == f"x 457010 .. 457012  y 7654008 .. 7654008  {ending} not stated)"


def test_the_height_of_a_source_is_shown_on_the_axis_that_points_up(folder):
    turned = VERTICES[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    write_binary_stl(folder / "yup.stl", turned[TRIANGLES])
    shown, *_ = seen(folder, "yup.stl}]\n  up: y #", [10.0, 0.0, -8.0])
    assert shown["source top"] == "x 10 .. 10  y on the ground + 1 m  z -8 .. -8  (CRS not stated)"


@pytest.mark.parametrize("south", [False, True])
def test_a_terrain_on_its_side_is_noticed_and_the_axis_that_points_up_is_named(folder, south):
    sign = -1.0 if south else 1.0
    write_landxml(folder / "side.xml", SITE[:, [0, 2, 1]] * [1.0, 1.0, sign], TRIANGLES)
    _, hints, _, _ = seen(folder, "side.xml", [*MIDDLE, 0])
    (told,) = hints
    assert "of the terrain is" in told and "are y and z swapped? Give the terrain `up: y`" in told
    assert ("maps would be mirrored" in told) is not south
    (folder / "scene.yaml").write_text(
        (folder / "scene.yaml").read_text().replace("side.xml}]", "pit.xml}]\n  up: y").replace("0.0]", "0]")
    )
    found: list[str] = []
    with pytest.raises(InputError):
        check_scene(read_scene(folder / "scene.yaml"), lambda _, hints: found.extend(hints))
    assert "Give the terrain `up: z`" in found[0] and "mirrored" not in found[0]


@pytest.mark.parametrize("metres", [1.0, 0.3048, 0.001])
def test_high_terrain_in_any_unit_does_not_lie_on_its_side(metres):
    """Heights may be larger than the extent in plan, such as at Climax, Colorado (11,300 ft), or in millimetres."""
    low, high = np.array([3000.0, 2000.0, 3500.0]) / metres, np.array([3500.0, 2300.0, 4500.0]) / metres
    extent = Extent("terrain", low, high, Path("pit.dxf"))
    assert not any("swapped" in hint for hint in placing_hints([extent], None, "z"))


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ("areas_of_interest: [{name: ramp, polygons: ramp.csv}]", r"line 7: `areas_of_interest\[0\]\.polygons`"),
        ("zones: [{zone: ramp, polygons: ramp.csv}]", r"line 7: `zones\[0\]\.polygons`"),
        ("  - {name: b, above_ground: 1, line: ramp.csv}", r"line 7: `sources\[1\]\.line`"),
        ("  - {name: b, polygon: ramp.csv}", r"line 7: `sources\[1\]\.polygon`"),
    ],
)
def test_a_file_of_a_wrong_format_is_refused_by_its_key_before_the_terrain_is_read(folder, more, key):
    (folder / "ramp.csv").write_text("x,y\n457000,7654000\n")
    (folder / "pit.xml").write_text("no mesh")
    text = SCENE.format(terrain="pit.xml", point=[*MIDDLE, 0]).replace("[{name: top", "\n  - {name: top")
    (folder / "scene.yaml").write_text(with_models(text.replace("1.0}]", "1.0}\n") + more + "\n"))
    with pytest.raises(InputError, match=key + " names a file that cannot be used: .*not read from .csv files"):
        check_scene(read_scene(folder / "scene.yaml"))


def test_a_missing_reference_system_warns_and_never_refuses(folder):
    pytest.importorskip("ezdxf", reason="ezdxf is not installed: it is in the extra `test`")
    write_dxf(folder / "pit.dxf", SITE, TRIANGLES)
    shown, hints, refusal, report = seen(folder, "pit.dxf", [*MIDDLE, 0])
    assert shown["terrain"].endswith("(CRS not stated)") and refusal == "" and report.fit
    assert hints == [
        "the terrain states no coordinate reference system in metres; name it as `terrain.crs`, such as EPSG:32719"
    ]
    told = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32719"}}
    _, hints, refusal, _ = seen(folder, "pit.dxf", [*MIDDLE, 0], area(folder, box(EAST + 3, NORTH + 3), crs=told))
    assert refusal == "" and "area ramp is in EPSG:32719; the terrain states none" in hints[1]


IN_METRES = "the same projection in metres, such as EPSG:26941 in place of EPSG:2225"


@pytest.mark.parametrize(
    ("unit", "crs", "notes"),
    [
        ("m", "", ["is read in metres: if its coordinates and heights are in US survey feet, give it `unit: us_ft`",
                   f"so maps have no reference system; name {IN_METRES}, as `terrain.crs`"]),
        ("m", "  crs: EPSG:26941\n", ["is read in metres: if its coordinates and heights are in US survey feet"]),
        ("us_ft", "", [f"so maps have no reference system; name {IN_METRES}, as `terrain.crs`"]),
        ("us_ft", "  crs: EPSG:26941\n", []),
    ],
)  # fmt: skip
def test_a_terrain_file_in_a_reference_system_in_feet_has_notes_until_unit_and_system_are_named(
    folder, unit, crs, notes
):
    """A wrong unit changes heights by a factor of three, but the file may also state a wrong system."""
    (folder / "pit.xml").write_text((folder / "pit.xml").read_text().replace("32719", "2225"))
    point = [LENGTHS[unit][1] * each for each in [*MIDDLE, 0]]
    _, _, refusal, report = seen(folder, f"pit.xml, unit: {unit}", point, of_terrain=crs)
    assert refusal == ""
    found = [each for each in report.faults.remarks if "states EPSG:2225, which is in US survey feet" in each]
    assert len(found) == len(notes) and all(note in each for note, each in zip(notes, found, strict=True))


def test_an_area_in_feet_asks_for_the_unit_of_the_terrain(folder):
    """The advice to name the area's system as that of the terrain would lead to a refusal."""
    pytest.importorskip("ezdxf", reason="ezdxf is not installed: it is in the extra `test`")
    write_dxf(folder / "pit.dxf", SITE, TRIANGLES)
    feet = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::2225"}}
    ramp = area(folder, box(EAST + 3, NORTH + 3), crs=feet)
    _, hints, refusal, _ = seen(folder, "pit.dxf", [*MIDDLE, 0], ramp)
    assert refusal == "" and hints[1:] == [
        "area ramp is in EPSG:2225, which is in US survey feet, and the terrain is in metres: if the coordinates of "
        "the terrain file are in US survey feet, too, give it `unit: us_ft` (`rpf3d new`: --unit us_ft); name "
        f"{IN_METRES}, as `terrain.crs`"
    ]
    _, _, refusal, _ = seen(folder, "pit.dxf", [*MIDDLE, 0], ramp, "  crs: EPSG:26941\n")
    assert "area ramp is in EPSG:2225, and the terrain in EPSG:26941; transform it: rpf3d import layer" in refusal


@pytest.mark.parametrize("of_terrain", ["", "  crs: EPSG:32719\n"])
def test_an_unknown_reference_system_of_an_area_is_noted_and_not_compared(folder, of_terrain):
    unknown = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::999999"}}
    ramp = area(folder, box(EAST + 3, NORTH + 3), crs=unknown)
    _, hints, refusal, report = seen(folder, "pit.xml", [*MIDDLE, 0], ramp, of_terrain)
    assert refusal == "" and report.fit and hints == [
        "area ramp: its file states EPSG:999999, which is no known coordinate reference system, so it is not compared "
        "with the terrain"
    ]


def test_a_model_in_millimetres_is_noticed_by_its_relief_and_by_the_speed_of_its_rocks(folder):
    write_binary_stl(folder / "mm.stl", 5000.0 * VERTICES[TRIANGLES])
    _, hints, refusal, report = seen(folder, "mm.stl", [50_000.0, 40_000.0, 0.0])
    assert refusal == "" and "is it in millimetres or centimetres? It would be 100 m or 1000 m wide. " in hints[0]
    assert "Give its file `unit: mm` or `unit: cm`" in hints[0], "in feet it is still too high"
    assert not any("faster" in told for told in report.warnings)
    high = (folder / "scene.yaml").read_text().replace("above_ground: 1.0", "above_ground: 4000.0")
    (folder / "scene.yaml").write_text(high)
    warnings = check_scene(read_scene(folder / "scene.yaml")).warnings
    assert any("faster than any rockfall" in told for told in warnings), "a fall of 4,000 m ends at 280 m/s"


def test_swapped_axes_of_the_terrain_are_noticed(folder):
    write_landxml(folder / "swapped.xml", SITE[:, [1, 0, 2]], TRIANGLES)
    _, hints, _, _ = seen(folder, "swapped.xml", [MIDDLE[1], MIDDLE[0], 0])
    assert hints == ["x of the terrain looks like a northing and y like an easting: are x and y swapped?"]


def mirrored(folder: Path, vertices: np.ndarray, triangles: np.ndarray, point: list[float], more: str = "") -> bool:
    """Return True if the check of an STL file of these facets notes that the terrain may be mirrored."""
    write_binary_stl(folder / "pit.stl", vertices[triangles])
    _, hints, refusal, _ = seen(folder, "pit.stl", point, more)
    assert refusal == ""
    return any(f"{len(triangles)} of {len(triangles)} triangles faced down" in hint for hint in hints)


def test_a_terrain_whose_triangles_all_faced_down_may_be_mirrored(folder):
    swapped = VERTICES[:, [1, 0, 2]] + [0.0, 100.0, 0.0]
    assert mirrored(folder, swapped, TRIANGLES, [8.0, 110.0, 0.0])
    assert not mirrored(folder, swapped, TRIANGLES[:, ::-1], [8.0, 110.0, 0.0])
    half = np.concatenate([TRIANGLES[:80, ::-1], TRIANGLES[80:]])
    write_binary_stl(folder / "half.stl", swapped[half])
    assert seen(folder, "half.stl", [8.0, 110.0, 0.0])[1] == []


def test_a_terrain_is_not_mirrored_if_coordinates_show_which_axis_points_north(folder):
    away, point = VERTICES + np.array([0.0, 100.0, 0.0]), [10.0, 108.0, 0.0]
    down = TRIANGLES[:, ::-1]
    assert mirrored(folder, away, down, point), "only that its corners are clockwise"
    assert not mirrored(folder, away, down, point, area(folder, box(3.0, 103.0))), "a file fits in one way"
    near = VERTICES, down, [10.0, 8.0, 0.0]
    assert mirrored(folder, *near, area(folder, box(3.0, 4.0))), "a file fits in both ways"
    write_landxml(folder / "down.xml", SITE, down)
    assert seen(folder, "down.xml", [*MIDDLE, 0])[1] == [], "eastings and northings"


def test_a_terrain_in_degrees_is_noticed(folder):
    write_binary_stl(folder / "degrees.stl", VERTICES[TRIANGLES] * [1e-5, 1e-5, 1.0] + [-70.2, -21.1, 0.0])
    _, hints, _, _ = seen(folder, "degrees.stl", [-70.19995, -21.09995, 0])
    assert "the terrain looks as if it were in degrees" in hints[0]


def test_elevations_of_the_other_sign_are_noticed(folder):
    text = "  - {name: low, points: [[457010, 7654008, -801]]}\n"
    shown, hints, _, _ = seen(folder, "pit.xml", [*MIDDLE, 0], "")
    assert hints == []
    scene = SCENE.format(terrain="pit.xml", point=[*MIDDLE, 0]).replace("sources: [", "sources:\n  - ")
    scene = scene.replace("1.0}]", "1.0}") + text
    (folder / "scene.yaml").write_text(with_models(scene))
    found: list[str] = []
    check_scene(read_scene(folder / "scene.yaml"), lambda _, hints: found.extend(hints))
    assert found == [
        "source low: its heights have the opposite sign of the terrain's heights: does z point down in one of them?"
    ]
    assert "terrain" in shown


def test_a_terrain_below_zero_everywhere_may_count_heights_downwards(folder):
    """An inverted hill is a valid pit: without heights in other inputs, only the user knows which of them it is."""
    turned = SITE * [1.0, 1.0, -1.0] + [0.0, 0.0, -1000.0]
    write_landxml(folder / "down.xml", turned, TRIANGLES)
    _, hints, refused, _ = seen(folder, "down.xml", MIDDLE, area(folder, [[x, y] for x, y in box(*MIDDLE)]))
    assert refused == "" and len(hints) == 1
    assert hints[0].startswith("all heights of the terrain are negative, ") and "read upside down" in hints[0]
    scene = (folder / "scene.yaml").read_text()
    assert prepare(read_scene(folder / "scene.yaml")).placing == tuple(hints), "the note is also in the report"
    (folder / "scene.yaml").write_text(scene.replace("terrain:\n", "terrain:\n  up: z\n"))
    assert prepare(read_scene(folder / "scene.yaml")).placing == ()


def test_facets_that_face_down_may_show_that_z_points_down(folder):
    write_binary_stl(folder / "down.stl", (VERTICES * [1.0, 1.0, -1.0])[TRIANGLES[:, ::-1]])
    assert any("faced down" in hint and "z points down" in hint for hint in seen(folder, "down.stl", [10.0, 8.0])[1])


@pytest.mark.parametrize(
    ("rock", "told"),
    [
        ("{diameter: 800}", "`rock` reaches 800 m in diameter"),
        ("{mass: 1.5e9}", "more than any rock of a rockfall"),
        ("{mass: 1.0e-6}", "less than gravel"),
        ("{diameter: 2}", None),
        ("{mass: {mean: 807, sd: 400, min: 178, max: 1751}}", None),
    ],
)
def test_sizes_beyond_any_rock_are_warned_of(folder, rock, told):
    *_, report = seen(folder, "pit.xml", [*MIDDLE, 0], f"rock: {rock}\n")
    found = [warning for warning in report.warnings if "`rock`" in warning]
    assert [told in warning for warning in found] == [True] if told else found == []


def test_rocks_too_large_and_too_small_in_one_scene_are_both_warned_of(folder):
    *_, report = seen(folder, "pit.xml", [*MIDDLE, 0], "rock: {diameter: {mean: 5, sd: 9, min: 0.001, max: 50}}\n")
    found = [warning for warning in report.warnings if "`rock`" in warning]
    assert ["50 m" in found[0], "less than gravel" in found[1]] == [True, True]


def test_a_source_high_in_the_air_is_warned_of(folder):
    text = SCENE.format(terrain="pit.xml", point=[*MIDDLE, 930.0]).replace(", above_ground: 1.0", "")
    (folder / "scene.yaml").write_text(with_models(text))
    warnings = check_scene(read_scene(folder / "scene.yaml")).warnings
    assert any("source 'top' starts 1" in told and "are its heights right?" in told for told in warnings)


@pytest.mark.parametrize(
    ("last", "height", "told"), [(5.2, 0.5, False), (5.2, 60.0, True), (6.2, 0.5, False), (40.0, 0.5, True)]
)
def test_a_source_over_the_crest_of_a_high_overhang_is_not_high_in_the_air(folder, last, height, told):
    """The face leans out by 5 m over its height of 60 m, so the ground vertically below the source is at its foot.

    A line of rocks from the crest to x = `last` (m) is in the air if only one end is near the crest.
    """
    brow, foot, back, far = (5.0, 60.0), (0.0, 0.0), (-30.0, 60.0), (40.0, 0.0)
    quads = [[(*one, -20.0), (*other, -20.0), (*other, 20.0), (*one, 20.0)]
             for one, other in ((far, foot), (foot, brow), (brow, back))]  # fmt: skip
    corners = np.array(quads)[:, :, [0, 2, 1]]
    write_binary_stl(folder / "wall.stl", np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]))
    text = SCENE.format(terrain="wall.stl", point=[5.2, 0.0, 60.0 + height]).replace(", above_ground: 1.0", "")
    points = [[float(x), 0.0, 60.0 + height] for x in np.linspace(5.2, last, 4)]
    text = text.replace(str([points[0]]), f"{points}, rocks: 4")
    (folder / "scene.yaml").write_text(with_models(text))
    warnings = check_scene(read_scene(folder / "scene.yaml")).warnings
    assert any("are its heights right?" in warning for warning in warnings) is told


@pytest.mark.parametrize(("up", "told"), [("z", True), ("y", False)])
def test_a_terrain_of_a_local_grid_with_y_up_is_noticed_by_its_facets(folder, up, told):
    """The heights of a bench are in y, so its level ground is vertical if it is read with z up."""
    x, north = np.meshgrid(np.linspace(0.0, 80.0, 41), np.linspace(0.0, 60.0, 31))
    heights = np.interp(x, [30.0, 36.0], [15.0, 0.0])
    points = np.stack([x, heights, -north], axis=-1)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    corners = np.concatenate([np.stack(half, axis=2).reshape(-1, 3, 3) for half in ((a, b, c), (a, c, d))])
    write_binary_stl(folder / "bench.stl", corners)
    scene = SCENE.format(terrain="bench.stl", point=[10.0, 20.0, -10.0])
    (folder / "scene.yaml").write_text(with_models(scene.replace("terrain:\n", f"terrain:\n  up: {up}\n")))
    hints = []
    with suppress(InputError):
        check_scene(read_scene(folder / "scene.yaml"), lambda extents, sentences: hints.extend(sentences))
    found = [hint for hint in hints if "lay on its side" in hint]
    assert len(found) == told and all("give the terrain `up: y` (`rpf3d new`: --up y)" in hint for hint in found)


@pytest.mark.parametrize(("up", "told"), [("", True), ("  up: z\n", False)])
def test_a_run_trusts_an_axis_that_the_scene_states(folder, up, told):
    """A scan of a steep wall is correct as it is; a scene that states the axis gets no note."""
    write_binary_stl(folder / "wall.stl", np.array([[[0, 0, 0], [0, 10, 0], [15, 5, 40]]], float))
    scene = SCENE.format(terrain="wall.stl", point=[5.0, 5.0, 13.0]).replace("terrain:\n", f"terrain:\n{up}")
    (folder / "scene.yaml").write_text(with_models(scene))
    placing = prepare(read_scene(folder / "scene.yaml")).placing
    assert any("lay on its side" in note for note in placing) is told


def test_a_terrain_that_is_far_higher_than_wide_is_noticed(folder):
    write_binary_stl(folder / "wall.stl", np.array([[[0, 0, 0], [0, 10, 0], [15, 5, 40]]], float))
    _, hints, *_ = seen(folder, "wall.stl", [5.0, 5.0, 0.0])
    assert any("it is 40 m high and 15 m wide; if y points up in its file" in hint for hint in hints)


def test_the_extent_of_the_terrain_is_that_of_its_vertices_and_in_metres(folder):
    feet = np.round(SITE / 0.3048, 3)
    write_landxml(folder / "feet.xml", feet, TRIANGLES)
    shown, hints, refusal, _ = seen(folder, "feet.xml, unit: ft", [*MIDDLE, 0])
    assert shown["terrain"].startswith("x 457000 .. 457020  y 7654000 .. 7654016") and (hints, refusal) == ([], "")


@pytest.mark.parametrize(
    ("place", "crs", "named", "in_feet"),
    [
        ((1_569_283.0, 24_319_733.0), None, "Name it as `terrain.crs`", "around (478317, 7412655)"),
        ((1_569_283.0, 24_319_733.0), "EPSG:32719", "Name it as `terrain.crs`, in place of EPSG:32719", "7412655"),
        ((1_750_000.0, 5_900_000.0), None, "Name it as `terrain.crs`", "around (533400, 1798320)"),  # New Zealand
        ((2_600_000.0, 5_600_000.0), None, "Name it as `terrain.crs`", "around (792480, 1706880)"),  # Gauss-Krueger 2
        ((1_650_000.0, 8_200_000.0), None, "Name it as `terrain.crs`", "around (502920, 2499360)"),  # France, CC
        ((478_318.0, 40_000_000.0), None, "Name it as `terrain.crs`", None),
        ((478_318.0, 7_412_654.0), None, None, None),
        ((2_600_000.0, 1_200_000.0), None, None, None),
        ((5_412_000.0, 5_700_000.0), "EPSG:31469", None, None),
        ((60.0, 40.0), None, None, None),
    ],
)
def test_coordinates_outside_every_zone_of_utm_are_asked_for_their_system_before_feet(place, crs, named, in_feet):
    """A metric grid that is read in feet gives energies 3.3 times too small: no sentence asks to set the unit."""
    middle = np.array([*place, 1500.0])
    extent = Extent("terrain", middle - 200.0, middle + 200.0, Path("pit.dxf"))
    found = [hint for hint in placing_hints([extent], crs, "z") if "UTM zone" in hint]
    assert len(found) == (named is not None)
    if named is not None:
        assert f"below 10,000,000 m: which coordinate system is it? {named}" in found[0]
        assert ("in feet" in found[0]) == (in_feet is not None) and "give its file" not in found[0]
    if in_feet is not None:
        words = ". If the coordinates are in feet, the terrain would be 122 m wide and 122 m high instead of 400 m wide"
        assert f"{named}{words}" in found[0] and in_feet in found[0]


BERM = "  berms: [{name: b, along: a.gpkg, height: 1.0, width: 3.0}]\n"
ELSEWHERE = {
    "barrier b": ("line", "effects: {barriers: {panels: [{name: b, along: a.gpkg, height: 3, capacity_kj: 100}]}}\n"),
    "forest": ("polygon", "effects: {forest: {stems_per_ha: 100, within: a.gpkg}}\n"),
    "drag_layer": ("polygon", "effects: {drag_layer: {coefficient: 1.0, height: 1.0, polygons: a.gpkg}}\n"),
    "zone soft": ("polygon", "zones: [{zone: soft, polygons: a.gpkg}]\n"),
    "berm b": ("line", ""),
}


@pytest.mark.parametrize("crs", ["EPSG:32718", "EPSG:4326"])
@pytest.mark.parametrize("name", ELSEWHERE)
def test_a_file_of_an_effect_zone_or_berm_in_another_reference_system_is_refused(folder, name, crs):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    import shapely

    kind, text = ELSEWHERE[name]
    x, y = (EAST, NORTH) if crs != "EPSG:4326" else (-69.4, -21.2)
    size = 1.0 if crs != "EPSG:4326" else 1e-5
    made = shapely.box(x, y, x + 9 * size, y + 9 * size)
    write_vector(folder / "a.gpkg", [made if kind == "polygon" else shapely.LineString(made.exterior.coords[:3])], crs)
    shown, _, refusal, _ = seen(folder, "pit.xml", [*MIDDLE, 0], text, BERM if name == "berm b" else "")
    assert shown[name].endswith(f"({crs})")
    assert f"{name} is in {crs}, and the terrain in EPSG:32719; transform it: rpf3d import layer" in refusal
    assert f"--kind {kind} --from {crs}" in refusal


def test_an_incomplete_shapefile_and_an_empty_file_are_refused_with_what_to_do(folder):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    import shapely

    write_vector(folder / "a.shp", [shapely.box(EAST, NORTH, EAST + 9, NORTH + 9)])
    (folder / "a.shx").unlink()
    with pytest.raises(InputError, match=r"lacks its index, the file a\.shx: copy all files of the Shapefile together"):
        read_polygons(folder / "a.shp")
    (folder / "b.gpkg").touch()
    with pytest.raises(InputError, match=r"b\.gpkg: is empty$"):
        read_polygons(folder / "b.gpkg")


@pytest.mark.parametrize("kind", ["line", "polygon"])
@pytest.mark.parametrize("suffix", [".gpkg", ".shp"])
def test_a_layer_without_a_shape_is_refused_as_such(folder, kind, suffix):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    write_vector(folder / f"a{suffix}", [], kind={"line": "LineString"}.get(kind, "Polygon"))
    read = {"line": read_lines, "polygon": read_polygons}[kind]
    with pytest.raises(InputError, match=f"holds no {kind}; it must have at least one"):
        read(folder / f"a{suffix}")
