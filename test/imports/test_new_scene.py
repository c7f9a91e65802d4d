"""Tests that new scenes run unedited for all terrain formats, state what was found, and have a source on a crest."""

import json
from pathlib import Path

import numpy as np
import pytest
import rasterio
from input_files.mine_files import (
    EAST,
    NORTH,
    at_site,
    write_dxf_layers,
    write_landxml,
    write_las,
    write_omf,
    write_surpac,
)
from input_files.terrain_files import ascii_stl
from jsonschema import Draft202012Validator
from scenes.benches_fallen_from import HEIGHT, TOE, bench
from typer.testing import CliRunner

from rpf3d_core import simulate
from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.formats.yaml import read_yaml
from rpf3d_core.imports import crests, new_scene
from rpf3d_core.imports.crests import OVER, _on_the_brow, crests_of
from rpf3d_core.imports.new_scene import FileChoice, write_new_scene
from rpf3d_core.scene.listings.json_schema import scene_schema
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.height_image import HeightImage, height_image, heights_at

FALLEN = 5.0
"""Drop (m) that shows that a rock left the crest and fell down the face of 15 m."""


def surveyed() -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (V, 3) m and triangles (F, 3) of the bench, as a survey with points every metre."""
    x, y = np.arange(-20.0, 61.0), np.arange(-20.0, 21.0)
    z = np.interp(x, [-20.0, 0.0, TOE, 60.0], [HEIGHT, HEIGHT, 0.0, 0.0])
    vertices = np.array([(a, b, c) for b in y for a, c in zip(x, z, strict=True)])
    first = np.array([i + len(x) * j for j in range(len(y) - 1) for i in range(len(x) - 1)])
    squares = first[:, None] + np.array([0, 1, len(x) + 1, len(x)])
    halves = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])
    return vertices, np.ascontiguousarray(halves, dtype=np.int32)


def write_obj(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    path.write_text("\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles.tolist())]) + "\n")
    return path


def write_stl(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    path.write_text(ascii_stl(vertices[triangles]))
    return path


def write_dxf(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    """Write the bench as DXF on two layers, `floor` for the lowest level ground and `wall`; return the file."""
    corners, low = vertices[triangles], vertices[:, 2].min()
    layers = np.where((corners[:, :, 2] - low).max(axis=1) < 0.01, "floor", "wall").tolist()
    return write_dxf_layers(path, list(zip(layers, corners.tolist(), strict=True)))


def write_asc(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    """Write the bench as an elevation grid with cells of 1 m; return the file."""
    rows = [" ".join(f"{z:.3f}" for z in vertices[vertices[:, 1] == y][:, 2]) for y in np.unique(vertices[:, 1])[::-1]]
    left, low = vertices[:, 0].min() - 0.5, vertices[:, 1].min() - 0.5
    head = f"ncols {len(rows[0].split())}\nnrows {len(rows)}\nxllcorner {left}\nyllcorner {low}\ncellsize 1\n"
    path.write_text(head + "\n".join(rows) + "\n")
    return path


def write_cloud(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    return write_las(path, vertices, crs=32719)


FORMATS = {
    "pit.obj": (write_obj, ()), "pit.stl": (write_stl, ()), "pit.asc": (write_asc, ()),
    "pit.dxf": (write_dxf, ("ezdxf",)), "pit.xml": (write_landxml, ()), "pit.dtm": (write_surpac, ()),
    "pit.omf": (write_omf, ("omf",)), "pit.las": (write_cloud, ("laspy", "pyproj")),
}  # fmt: skip


def drops(scene: Path) -> np.ndarray:
    """Fly 64 rocks of a scene, one for each parameter set; return the heights (N,) m that they fell."""
    deposits = simulate(read_scene(scene), engine="reference", rocks=64).flights.deposits
    return deposits.release[:, 2] - deposits.x[:, 2]


@pytest.mark.parametrize("name", FORMATS)
def test_a_new_scene_of_each_format_runs_unedited_and_its_rocks_fall(name: str, tmp_path: Path) -> None:
    write, libraries = FORMATS[name]
    for library in libraries:
        pytest.importorskip(library)
    vertices, triangles = surveyed()
    write(tmp_path / name, at_site(vertices), triangles)
    written = write_new_scene(tmp_path / "site", tmp_path / name, FileChoice())
    fallen = drops(written.path)
    assert len(fallen) == 64
    assert (fallen > FALLEN).mean() > 0.9


def test_a_new_scene_keeps_survey_coordinates_layers_and_reference_system(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    vertices, triangles = surveyed()
    write_dxf(tmp_path / "pit.dxf", at_site(vertices), triangles)
    text = write_new_scene(tmp_path / "site", tmp_path / "pit.dxf", FileChoice(crs="EPSG:32719")).path.read_text()
    assert '"wall": {library: bedrock' in text and '"floor": {library: bedrock' in text
    assert 'crs: "EPSG:32719"   # as you stated' in text
    assert f"x {EAST - 20:.0f} to {EAST + 60:.0f}, y {NORTH - 20:.0f} to {NORTH + 20:.0f}, z 800 to 815" in text
    (source,) = read_scene(tmp_path / "site" / "scene.yaml").sources
    x, y, _ = np.array(source.line).T
    assert x == pytest.approx(np.full(len(x), EAST + OVER), abs=0.3)
    assert y.min() >= NORTH - 20 and y.max() <= NORTH + 20


@pytest.mark.parametrize("end", ["\x85", "\u2028", "\u2029", "\x9f", "\x7f"])
def test_a_name_of_a_layer_adds_no_key_to_the_scene(tmp_path: Path, end: str) -> None:
    pytest.importorskip("ezdxf")
    vertices, triangles = surveyed()
    bad = f"wall{end}rocks: 7 #"
    path = write_dxf(tmp_path / "pit.dxf", at_site(vertices), triangles)
    path.write_bytes(path.read_bytes().replace(b"wall", bad.encode()))
    text = write_new_scene(tmp_path / "site", tmp_path / "pit.dxf", FileChoice()).path.read_text(encoding="utf-8")
    assert end not in text and f"wall\\u{ord(end):04x}rocks: 7" in text
    assert "rocks" not in read_yaml(tmp_path / "site" / "scene.yaml").values
    zone = next(line for line in text.splitlines() if "wall" in line)
    assert json.loads(zone.strip().removeprefix("# ").split(": {library")[0]) == bad


def test_a_crest_with_one_point_over_ground_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, triangles = surveyed()
    terrain = Terrain(vertices, triangles, np.zeros(len(triangles), dtype=np.int32), ("bench",))
    assert crests_of(terrain)

    def with_holes(image: HeightImage, plan: np.ndarray) -> np.ndarray:
        """Return the heights, without those over the brow after the first point."""
        heights = heights_at(image, plan)
        return heights if plan.ndim > 2 else np.where(np.arange(len(heights)) > 0, np.nan, heights)

    image = height_image(terrain, vertices[:, :2], 1.0, 0.2)
    line = np.column_stack([np.zeros(6), np.linspace(8.0, -8.0, 6)])
    assert any(len(list(_on_the_brow(image, way))) == 1 for way in (line, line[::-1]))
    monkeypatch.setattr(crests, "heights_at", with_holes)
    assert all(list(_on_the_brow(image, way)) == [] for way in (line, line[::-1]))


def test_a_reference_system_that_the_file_states_is_kept(tmp_path: Path) -> None:
    written = write_new_scene(tmp_path / "site", geotiff(tmp_path, "EPSG:32719"), FileChoice())
    assert 'crs: "EPSG:32719"   # as the file states' in written.path.read_text()
    assert read_scene(written.path).terrain.crs == "EPSG:32719"


def geotiff(folder: Path, crs: str) -> Path:
    """Write the surveyed terrain as a GeoTIFF with a reference system; return its path."""
    vertices, triangles = surveyed()
    mesh = write_asc(folder / "pit.asc", at_site(vertices), triangles)
    with rasterio.open(mesh) as grid:
        facts = {**grid.profile, "driver": "GTiff", "crs": crs}
        with rasterio.open(folder / "pit.tif", "w", **facts) as file:
            file.write(grid.read())
    return folder / "pit.tif"


def test_a_reference_system_in_feet_is_not_that_of_a_new_scene(tmp_path: Path) -> None:
    pit = geotiff(tmp_path, "EPSG:2225")
    written = write_new_scene(tmp_path / "site", pit, FileChoice(unit="us_ft"))
    assert "# CHECK: the file states no coordinate reference system in metres; name yours" in written.path.read_text()
    assert any("states EPSG:2225, which is in US survey feet" in warning for warning in written.warnings)
    with pytest.raises(InputError, match=r"--crs is 'EPSG:2225', which is in US survey feet; .*--unit us_ft"):
        write_new_scene(tmp_path / "other", pit, FileChoice(unit="us_ft", crs="EPSG:2225"))
    written = write_new_scene(tmp_path / "named", pit, FileChoice(unit="us_ft", crs="EPSG:26941"))
    assert read_scene(written.path).terrain.crs == "EPSG:26941"
    assert not any("EPSG:2225" in warning for warning in written.warnings)


def test_millimetres_and_y_up_are_read_as_told(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    turned = 1000.0 * np.column_stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]])
    write_obj(tmp_path / "pit.obj", turned, triangles)
    written = write_new_scene(tmp_path / "site", tmp_path / "pit.obj", FileChoice(up="y", unit="mm"))
    assert (drops(written.path) > FALLEN).mean() > 0.9


@pytest.mark.parametrize("told", ["mm", "m"])
def test_coordinates_of_seven_digits_in_millimetres_are_read_only_as_told(told: str, tmp_path: Path) -> None:
    """A northing of 7,450 km is 7.45e9 mm, which is plausible in millimetres but not in metres."""
    vertices, triangles = surveyed()
    far = 1e3 * (vertices + np.array([450_000.0, 7_450_000.0, 2_000.0]))
    pit = write_obj(tmp_path / "pit.obj", far, triangles)
    if told == "m":
        with pytest.raises(InputError, match="1,000,000,000 m or more"):
            write_new_scene(tmp_path / "new", pit, FileChoice(unit=told))
        return
    write_new_scene(tmp_path / "new", pit, FileChoice(unit=told))
    terrain = simulate(read_scene(tmp_path / "new" / "scene.yaml"), rocks=4).terrain
    points = terrain.frame.points_to_input(terrain.vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    assert low == pytest.approx([449_980.0, 7_449_980.0, 2_000.0], abs=1e-3)
    assert high == pytest.approx([450_060.0, 7_450_020.0, 2_000.0 + HEIGHT], abs=1e-3)


@pytest.mark.parametrize("units", [4, 6])
def test_a_drawing_that_is_too_far_away_is_refused_with_the_unit_that_it_states(units: int, tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    pit = write_dxf(tmp_path / "pit.dxf", 1000.0 * at_site(vertices), triangles)
    header = f"  0\nSECTION\n  2\nHEADER\n  9\n$INSUNITS\n 70\n{units}\n  0\nENDSEC\n"
    pit.write_text(header + pit.read_text())
    with pytest.raises(InputError) as refused:
        write_new_scene(tmp_path / "new", pit, FileChoice())
    count = f"({len(triangles):,} of {len(triangles):,} facets have one)"
    told = {4: "the file states that it is in millimetres: give it `unit: mm`",
            6: "is the file in millimetres or centimetres? Give it `unit: mm` or `unit: cm`"}[units]  # fmt: skip
    assert f"or more from the origin {count}; {told} (`rpf3d new`: --unit mm)" in str(refused.value)
    with pytest.raises(InputError, match="the file is read in kilometres: is this its unit"):
        write_new_scene(tmp_path / "new", write_obj(tmp_path / "a.obj", at_site(vertices), triangles),
                        FileChoice(unit="km"))  # fmt: skip


@pytest.mark.parametrize("case", ["mm", "on its side"])
def test_crests_are_not_searched_on_a_terrain_that_is_misread(case: str, tmp_path: Path, monkeypatch) -> None:
    vertices, triangles = surveyed()
    points = 1000.0 * vertices if case == "mm" else at_site(vertices)[:, [0, 2, 1]]
    monkeypatch.setattr(new_scene, "crests_of", lambda terrain: pytest.fail("crests were searched"))
    found = write_new_scene(tmp_path / "new", write_obj(tmp_path / "pit.obj", points, triangles), FileChoice())
    assert any("no crest searched, because the unit or the axes look wrong" in told for told in found.sentences)
    assert ("`unit: mm`" if case == "mm" else "`up: y` (`rpf3d new`: --up y)") in found.warnings[0]
    assert "so no crest was searched: correct them first" in " ".join(found.path.read_text().replace("#", "").split())


def test_a_folder_with_files_is_refused_before_the_terrain_is_read(tmp_path: Path) -> None:
    (tmp_path / "pit.obj").write_text("no mesh")
    with pytest.raises(InputError, match="is not empty"):
        write_new_scene(tmp_path, tmp_path / "pit.obj", FileChoice())


def test_the_area_of_a_zone_is_that_of_its_facets(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    written = write_new_scene(tmp_path / "new", write_obj(tmp_path / "pit.obj", vertices, triangles), FileChoice())
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert f"{area:,.0f} m2" in written.path.read_text()


def test_a_crest_lies_just_over_the_brow() -> None:
    (crest,) = crests_of(bench())
    assert crest.height == pytest.approx(HEIGHT, abs=0.2)
    assert crest.length == pytest.approx(100.0, abs=6.0)
    assert crest.points[:, 0] == pytest.approx(np.full(len(crest.points), OVER), abs=0.15)
    assert (crest.points[:, 2] < HEIGHT).all(), "over the brow, on the face"


@pytest.mark.parametrize("turn_deg", [37.0, 90.0, 180.0, 270.0])
def test_crests_are_found_in_every_direction(turn_deg: float) -> None:
    flat = bench()
    cosine, sine = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    crests = crests_of(Terrain(flat.vertices @ turn.T, flat.triangles, flat.zone, flat.zones))
    back = np.concatenate([crest.points for crest in crests]) @ turn
    assert back[:, 0] == pytest.approx(np.full(len(back), OVER), abs=0.4)
    assert sum(crest.length for crest in crests) > 75.0


def test_no_crest_lies_at_the_toe_or_on_low_steps() -> None:
    flat = bench()
    low = Terrain(flat.vertices * (1.0, 1.0, 0.1), flat.triangles, flat.zone, flat.zones)
    assert crests_of(low) == []
    assert all((crest.points[:, 2] > 0.5 * HEIGHT).all() for crest in crests_of(flat))


def test_without_a_crest_the_scene_says_so_and_still_runs(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    write_obj(tmp_path / "hill.obj", vertices * (1.0, 1.0, 0.2), triangles)
    written = write_new_scene(tmp_path / "site", tmp_path / "hill.obj", FileChoice())
    assert any("no crest found" in sentence for sentence in written.sentences)
    assert "CHECK: no crest was found" in written.path.read_text()
    assert len(drops(written.path)) == 64


def test_a_new_scene_is_valid_by_the_schema_that_its_first_line_names(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    write_obj(tmp_path / 'north "wall" #2.obj', vertices, triangles)
    written = write_new_scene(tmp_path / "site", tmp_path / 'north "wall" #2.obj', FileChoice())
    first = written.path.read_text().splitlines()[0]
    assert first == "# yaml-language-server: $schema=scene.schema.json"
    schema = json.loads((tmp_path / "site" / "scene.schema.json").read_text())
    assert schema == json.loads(json.dumps(scene_schema()))
    values = json.loads(json.dumps(read_yaml(written.path).values))
    assert list(Draft202012Validator(schema).iter_errors(values)) == []


def test_intervals_of_a_new_scene_are_predictive(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    write_obj(tmp_path / "pit.obj", vertices, triangles)
    scene = read_scene(write_new_scene(tmp_path / "site", tmp_path / "pit.obj", FileChoice()).path)
    assert scene.has_unknowns and scene.unknowns is not None and scene.unknowns.sets == 64


def test_commented_crests_are_valid_sources(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    two = np.concatenate([vertices, vertices * (-1.0, -1.0, 1.0) - (60.0, 0.0, 0.0)])
    write_obj(tmp_path / "pit.obj", two, np.concatenate([triangles, triangles + len(vertices)]))
    path = write_new_scene(tmp_path / "site", tmp_path / "pit.obj", FileChoice()).path
    lines = path.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("  # - name: crest_2"))
    last = next(i for i, line in enumerate(lines) if i > first and "rocks:" in line)
    lines[first : last + 1] = [line.replace("# ", "", 1) for line in lines[first : last + 1]]
    path.write_text("\n".join(lines) + "\n")
    assert [source.name for source in read_scene(path).sources] == ["crest_1", "crest_2"]


def test_the_source_is_the_crest_from_which_rocks_fall_farthest(tmp_path: Path) -> None:
    """The lower face is twice as high as the upper one, but rocks from the upper crest reach both berm and floor."""
    vertices, triangles = surveyed()
    z = np.interp(vertices[:, 0], [-20.0, 0.0, 4.0, 12.0, 20.0, 60.0], [30.0, 30.0, 20.0, 20.0, 0.0, 0.0])
    write_obj(tmp_path / "pit.obj", np.column_stack([vertices[:, :2], z]), triangles)
    written = write_new_scene(tmp_path / "site", tmp_path / "pit.obj", FileChoice())
    (source,) = read_scene(written.path).sources
    x, _, heights = np.array(source.line).T
    assert x == pytest.approx(np.full(len(x), OVER), abs=0.3) and heights.min() > 28.0
    (count, first, second) = written.sentences[-3:]
    assert count.startswith("2 crest candidates; the source is crest_1, because rocks from there may fall farthest")
    assert first.startswith("crest_1: ") and first.endswith("above a face of 10 m, fall 30 m")
    assert second.startswith("crest_2: ") and second.endswith("above a face of 20 m, fall 20 m")


def test_crests_are_numbered_from_the_top_as_zones_are(tmp_path: Path) -> None:
    """Rocks fall farther from the lower crest, which is the source, because a wide berm holds those from the upper."""
    vertices, triangles = surveyed()
    z = np.interp(vertices[:, 0], [-20.0, 0.0, 2.0, 40.0, 48.0, 60.0], [30.0, 30.0, 24.0, 24.0, 0.0, 0.0])
    write_obj(tmp_path / "pit.obj", np.column_stack([vertices[:, :2], z]), triangles)
    written = write_new_scene(tmp_path / "site", tmp_path / "pit.obj", FileChoice())
    assert [source.name for source in read_scene(written.path).sources] == ["crest_2"]
    (count, first, second) = written.sentences[-3:]
    assert "the source is crest_2, because" in count
    assert first.startswith("crest_1: ") and first.endswith("a face of 6 m, fall 6 m")
    assert second.startswith("crest_2: ") and second.endswith("a face of 24 m, fall 24 m")


def test_a_folder_with_files_is_not_touched(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    write_obj(tmp_path / "pit.obj", vertices, triangles)
    with pytest.raises(InputError, match="is not empty"):
        write_new_scene(tmp_path, tmp_path / "pit.obj", FileChoice())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--terrain", "no.obj"], "--terrain is 'no.obj', but there is no such file"),
        (["--terrain", "pit.obj", "--crs", "32719"], "--crs is '32719', which is no known coordinate reference system; "
         "did you mean EPSG:32719?"),
        (["--terrain", "pit.obj", "--crs", "EPSG:4326"], "--crs is 'EPSG:4326', which is in degrees"),
        (["--terrain", "pit.00t"], "export the triangulation from Vulcan as DXF"),
        (["--terrain", "pit.obj", "--up", "x"], "--up is 'x'; it must be y or z"),
        (["--terrain", "pit.obj", "--unit", "feet"], "--unit is 'feet'; it must be one of mm, "),
    ],
)
def test_wrong_input_is_refused_and_leaves_nothing(
    options: list[str], message: str, tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    vertices, triangles = surveyed()
    write_obj(tmp_path / "pit.obj", vertices, triangles)
    (tmp_path / "pit.00t").write_bytes(b"\0")
    done = CliRunner().invoke(app, ["new", "site", *options])
    assert isinstance(done.exception, InputError) and message in str(done.exception)
    assert not (tmp_path / "site").exists()


def test_the_command_says_what_was_found_and_what_comes_next(tmp_path: Path) -> None:
    vertices, triangles = surveyed()
    write_obj(tmp_path / "pit.obj", vertices, triangles)
    done = CliRunner().invoke(app, ["new", str(tmp_path / "site"), "--terrain", str(tmp_path / "pit.obj")])
    assert done.exit_code == 0, done.output
    assert "1 crest candidate; " in done.output and "above a face of 15 m" in done.output
    scene = tmp_path / "site" / "scene.yaml"
    assert f"next: rpf3d check {scene}\nthen: rpf3d run {scene} --out OUT\n" in done.output
