"""Tests that a layer with all berms of a wall causes a note, and is split from the top if the scene asks for it."""

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from input_files.mine_files import write_dxf_layers

from rpf3d_core import simulate
from rpf3d_core.errors import InputError
from rpf3d_core.imports.new_scene import FileChoice, write_new_scene
from rpf3d_core.runs.check import check_scene
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.scene.zone_materials import name_of_material
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.facets import Terrain

pytest.importorskip("ezdxf", reason="the walls are DXF files, which ezdxf writes")

SCENE = """\
terrain: {{files: [{{path: wall.dxf}}]{split}}}
materials:
  {materials}
rock: {{density: 2500, diameter: 0.8}}
sources: [{{name: top, points: [[-0.5, 15, 31]], rocks: 40, velocity: [3, 0, 0]}}]
"""
PROFILE = [(-10, 30, "BERMS"), (0, 30, "FACES"), (4, 18, "BERMS"), (9, 18, "FACES"), (14, 0, "BERMS"), (30, 0, "")]
"""Corners (x, z) in m of the wall's profile, each with the layer of the ground after it."""
BENCHES = {"BERMS_1": 30.0, "BERMS_2": 18.0, "BERMS_3": 0.0}
LENGTH = 30.0
Quad = tuple[str, list[tuple[float, float, float]]]
MATERIALS = "default: {normal_restitution: 0.4, tangential_restitution: 0.8}"


def wall(folder: Path, gap: bool = False, faces: str = "FACES") -> Path:
    """Write the wall as DXF and return the file. gap : whether the middle berm is in two parts; faces : their layer"""
    quads = []
    for (x, z, layer), (x2, z2, _) in pairwise(PROFILE):
        for y in np.arange(0.0, LENGTH, 5.0):
            name = "FACES" if gap and z == z2 == 18 and y == 10.0 else layer
            quads.append((name.replace("FACES", faces), [(x, y, z), (x2, y, z2), (x2, y + 5.0, z2), (x, y + 5.0, z)]))
    write_dxf_layers(folder / "wall.dxf", quads)
    return folder / "wall.dxf"


def scene(folder: Path, split: str = "", materials: str = MATERIALS, gap: bool = False) -> Path:
    wall(folder, gap)
    (folder / "scene.yaml").write_text(SCENE.format(split=split and f", split: [{split}]", materials=materials))
    return folder / "scene.yaml"


def heights(terrain: Terrain, zone: str) -> np.ndarray:
    mine = terrain.zone == terrain.zones.index(zone)
    return terrain.vertices[terrain.triangles[mine], 2] + terrain.frame.origin[2]


@pytest.mark.parametrize("gap", [False, True])
def test_a_layer_of_berms_is_split_into_benches_from_the_top(tmp_path: Path, gap: bool) -> None:
    terrain, faults = read_terrain(read_scene(scene(tmp_path, "BERMS", gap=gap)))
    assert [zone for zone in terrain.zones if zone.startswith("BERMS")] == list(BENCHES)
    assert all((heights(terrain, name) == z).all() for name, z in BENCHES.items())
    assert "FACES" in terrain.zones and heights(terrain, "FACES").std() > 1.0
    assert faults.area_by_zone["BERMS_2"] == pytest.approx(5.0 * (LENGTH - 5.0 * gap))


def test_a_slip_in_the_name_of_a_split_layer_suggests_the_layer_not_one_of_its_parts(tmp_path: Path) -> None:
    slip = MATERIALS.replace("default", "BEMRS") + f"\n  {MATERIALS}"
    with pytest.raises(InputError, match=r"`materials\.BEMRS` fits no zone of the terrain; did you mean 'BERMS'"):
        check_scene(read_scene(scene(tmp_path, "BERMS", materials=slip)))


def test_without_the_key_a_note_says_what_counts_as_one(tmp_path: Path) -> None:
    given = read_scene(scene(tmp_path))
    terrain, _ = read_terrain(given)
    assert set(terrain.zones) == {"BERMS", "FACES"}
    (note,) = [text for text in check_scene(given).warnings if "separate surfaces" in text]
    assert "BERMS (3 surfaces, on average at 30, 18, 0 m)" in note
    assert "`terrain: {split: [" in note


def test_the_same_rocks_stop_in_the_same_places_and_are_counted_for_each_bench(tmp_path: Path) -> None:
    one, split = (tmp_path / name for name in ("one", "split"))
    one.mkdir(), split.mkdir()
    whole, parts = (simulate(scene(folder, names), engine="reference")
                    for folder, names in ((one, ""), (split, "BERMS")))  # fmt: skip
    assert np.array_equal(whole.flights.deposits.x, parts.flights.deposits.x)
    for name, z in BENCHES.items():
        mine = parts.terrain.zone[parts.flights.deposits.facet] == parts.terrain.zones.index(name)
        assert np.array_equal(mine, np.isclose(parts.flights.deposits.x[:, 2] + parts.terrain.frame.origin[2], z))


def test_a_material_may_name_the_layer_or_one_bench(tmp_path: Path) -> None:
    hard = "{normal_restitution: 0.4, tangential_restitution: 0.8}"
    lines = f"BERMS: {hard}\n  BERMS_2: {hard}\n  default: {hard}"
    given = read_scene(scene(tmp_path, "BERMS", lines))
    names = [name_of_material(given, zone) for zone in ("BERMS_1", "BERMS_2", "BERMS_3", "FACES")]
    assert names == ["BERMS", "BERMS_2", "BERMS", "default"]
    check_scene(given)


@pytest.mark.parametrize(
    ("faces", "split", "sentence"),
    [
        ("FACES", "BERM", "which the terrain does not have; its zones are"),
        ("BERMS", "BERMS", "which is one surface"),
        ("BERMS_2", "BERMS", "the name of its part 'BERMS_2' is that of another zone"),
    ],
)
def test_a_zone_that_cannot_be_split_is_refused(tmp_path: Path, faces: str, split: str, sentence: str) -> None:
    path = scene(tmp_path, split)
    wall(tmp_path, faces=faces)
    with pytest.raises(InputError, match=sentence):
        read_terrain(read_scene(path))


def test_the_digest_of_a_scene_counts_the_key(tmp_path: Path) -> None:
    plain = scene_digest(read_scene(scene(tmp_path)))
    assert scene_digest(read_scene(scene(tmp_path, "BERMS"))) != plain


def test_a_new_scene_splits_such_layers_and_runs(tmp_path: Path) -> None:
    written = write_new_scene(tmp_path / "site", wall(tmp_path), FileChoice())
    given = read_scene(written.path)
    assert "BERMS" in (given.terrain.split or ())
    assert not [text for text in (*written.warnings, *check_scene(given).warnings) if "separate surfaces" in text]
    assert any("split by height" in sentence for sentence in written.sentences)
    assert '"BERMS_3": {library: bedrock}   # 480 m2' in written.path.read_text()


def berms(folder: Path, heights: Sequence[float], extra: Sequence[Quad] = ()) -> Path:
    """Write berms of 300 m x 6 m at some heights (m), all on one layer with a floor of 300 m x 1,000 m at 0 m."""
    steps = [*((10.0 * k, 6.0, z) for k, z in enumerate(heights, start=1)), (-1000.0, 1000.0, 0.0)]
    quads = [("BERM", [(x, 0, z), (x + w, 0, z), (x + w, 300, z), (x, 300, z)]) for x, w, z in steps]
    face = [(0, 0, 0), (10, 0, 15), (10, 300, 15), (0, 300, 0)]
    return write_dxf_layers(folder / "wall.dxf", [*quads, ("FACE", face), *extra])


def ramp(low: float, high: float) -> Quad:
    """Return a ramp of 8 m, 10 %, between the ends (y = 300 m) of two berms of `berms` next to each other."""
    return ("BERM", [(10.0, 300, low), (16.0, 300, low), (26.0, 450, high), (20.0, 450, high)])


def test_benches_that_a_ramp_joins_are_noted_because_they_count_as_one(tmp_path: Path) -> None:
    upper = ("BERM", [(20, 450, 30), (26, 450, 30), (26, 700, 30), (20, 700, 30)])
    berms(tmp_path, [15.0], [ramp(15.0, 30.0), upper])
    given = read_scene(split_scene(tmp_path))
    (note,) = [text for text in check_scene(given).warnings if "one connected surface" in text]
    assert note.startswith("BERM_1: one connected surface has level ground at 30, 15 m, as if a ramp")
    written = write_new_scene(tmp_path / "site", tmp_path / "wall.dxf", FileChoice())
    assert [text for text in written.warnings if "one connected surface" in text] == [note], "new says so, once"


def test_benches_with_a_polygon_of_their_own_are_counted_apart_without_a_note(tmp_path: Path) -> None:
    """The way that the note names works."""
    upper = ("BERM", [(20, 450, 30), (26, 450, 30), (26, 700, 30), (20, 700, 30)])
    berms(tmp_path, [15.0], [ramp(15.0, 30.0), upper])
    corners = [[19, 449], [27, 449], [27, 701], [19, 701], [19, 449]]
    (tmp_path / "b.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [corners]}))
    path = split_scene(tmp_path)
    path.write_text(path.read_text() + "zones: [{zone: upper, polygons: b.geojson}]\n")
    terrain, faults = read_terrain(read_scene(path))
    assert (heights(terrain, "upper") == 30.0).all()
    assert not [text for text in faults.remarks if "one connected surface" in text]


def test_a_ramp_and_separate_berms_are_no_joined_benches(tmp_path: Path) -> None:
    berms(tmp_path, [15.0, 30.0], [("RAMP", [(100, 0, 0), (120, 0, 0), (120, 400, 40), (100, 400, 40)])])
    assert not [text for text in read_terrain(read_scene(split_scene(tmp_path)))[1].remarks if "connected" in text]


def split_scene(folder: Path) -> Path:
    (folder / "scene.yaml").write_text(SCENE.format(split=", split: [BERM]", materials=MATERIALS))
    return folder / "scene.yaml"


def test_each_berm_is_a_part_beside_a_large_floor(tmp_path: Path) -> None:
    berms(tmp_path, [15.0, 30.0, 45.0, 60.0])
    given = read_scene(split_scene(tmp_path))
    terrain, _ = read_terrain(given)
    parts = [heights(terrain, zone) for zone in terrain.zones if zone.startswith("BERM")]
    assert [(part.min(), part.max()) for part in parts] == [(z, z) for z in (60.0, 45.0, 30.0, 15.0, 0.0)]
    assert not [text for text in check_scene(given).warnings if "mean heights differ" in text]


def test_small_fragments_join_a_part_with_a_note(tmp_path: Path) -> None:
    stray = ("BERM", [(500, 0, 24), (502, 0, 24), (502, 4, 24), (500, 4, 24)])
    terrain_file = berms(tmp_path, [15.0, 30.0], [stray])
    given = read_scene(split_scene(tmp_path))
    terrain, _ = read_terrain(given)
    assert [zone for zone in terrain.zones if zone.startswith("BERM")] == ["BERM_1", "BERM_2", "BERM_3"]
    assert 24.0 in heights(terrain, "BERM_1")
    (note,) = [text for text in check_scene(given).warnings if "mean heights differ" in text]
    assert "1 surface of BERM (8 m2 in all, the largest of 8 m2) counts with the part nearest in height" in note
    assert "by up to 6.0 m" in note
    written = write_new_scene(tmp_path / "site", terrain_file, FileChoice())
    assert note in written.warnings
    text = written.path.read_text()
    assert '"BERM_1": {library: bedrock}   # 1,808 m2, mean slope 0 degrees, at 30 to 30 m' in text


def test_fragments_within_the_heights_of_a_ramp_join_it(tmp_path: Path) -> None:
    ramp = ("RAMP", [(600, 0, 0), (640, 0, 0), (640, 1000, 60), (600, 1000, 60)])
    end, top = (("RAMP", [(x, 0, z), (x + 20, 0, z), (x + 20, 10, z), (x, 10, z)]) for x, z in ((700, 0), (800, 90)))
    berms(tmp_path, [15.0], [ramp, end])
    (tmp_path / "scene.yaml").write_text(SCENE.format(split=", split: [RAMP]", materials=MATERIALS))
    with pytest.raises(InputError, match="which is one surface"):
        read_terrain(read_scene(tmp_path / "scene.yaml"))
    berms(tmp_path, [15.0], [ramp, end, top])
    terrain, _ = read_terrain(read_scene(tmp_path / "scene.yaml"))
    assert set(heights(terrain, "RAMP_1").ravel()) == {90.0}
