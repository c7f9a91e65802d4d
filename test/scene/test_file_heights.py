"""Tests that heights in a source file are compared with the ground even if `above_ground` replaces them."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.formats.polylines import read_lines_with_heights
from rpf3d_core.results.notes import doubts_of_run
from rpf3d_core.runs.check import check_scene
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.benches.slope import brow_of

SCENE = """\
terrain: {{benches: {{number: 2, height: 10, berm: 4, floor: 60, width: 80}}}}
materials: {{default: {{normal_restitution: 0.4, tangential_restitution: 0.8}}}}
sources: [{{name: crest, {key}: {file}, above_ground: 0.5, rocks: 20}}]
engine: reference
"""


def brow() -> np.ndarray:
    """Return points (10, 3) m at the upper edge of the upper face, 0.2 m behind it."""
    ends = brow_of(Benches(number=2, height=10.0, berm=4.0, floor=60.0, width=80.0), 1)
    points = ends[0] + np.linspace(0.1, 0.9, 10)[:, None] * (ends[-1] - ends[0])
    return shifted(points, x=-0.2)


def shifted(points: np.ndarray, x: float = 0.0, z: float = 0.0) -> np.ndarray:
    return points + np.array([x, 0.0, z])


def geojson(points: np.ndarray) -> str:
    return json.dumps({"type": "LineString", "coordinates": points.tolist()})


def csv(points: np.ndarray) -> str:
    return "x,y,z\n" + "\n".join(",".join(map(str, point)) for point in points.tolist())


def dxf(points: np.ndarray) -> str:
    rows = ["0", "SECTION", "2", "ENTITIES", "0", "POLYLINE", "8", "CREST", "66", "1", "70", "8"]
    for x, y, z in points.tolist():
        rows += ["0", "VERTEX", "8", "CREST", "70", "32", "10", str(x), "20", str(y), "30", str(z)]
    return "\n".join([*rows, "0", "SEQEND", "0", "ENDSEC", "0", "EOF", ""])


def told(folder: Path, key: str, name: str, content: str) -> list[str]:
    (folder / name).write_text(content)
    (folder / "scene.yaml").write_text(SCENE.format(key=key, file=name))
    warnings = check_scene(read_scene(folder / "scene.yaml")).warnings
    assert [each for each in doubts_of_run(simulate(folder / "scene.yaml")) if "the heights in" in each] == [
        each for each in warnings if "the heights in" in each
    ]
    return [each for each in warnings if "the heights in" in each]


@pytest.mark.parametrize(
    ("key", "name", "write"), [("line", "crest.geojson", geojson), ("line", "crest.dxf", dxf),
                               ("points_file", "crest.csv", csv)],
)  # fmt: skip
def test_heights_in_another_datum_are_asked_for(
    tmp_path: Path, key: str, name: str, write: Callable[[np.ndarray], str]
) -> None:
    points = brow()
    (found,) = told(tmp_path, key, name, write(shifted(points, z=30.0)))
    assert found.startswith(f"`sources[0].{key}` of 'crest': the heights in {name} are 30 m above the ground in the ")
    (found,) = told(tmp_path, key, name, write(shifted(points, z=-30.0)))
    assert "30 m below the ground in the median, and differ from it by up to 30 m: is the file or the terrain" in found
    for right in (points, shifted(points, z=2.4), points * [1.0, 1.0, 0.0]):
        assert not told(tmp_path, key, name, write(right))


def test_heights_that_count_downwards_are_asked_for(tmp_path: Path) -> None:
    (found,) = told(tmp_path, "line", "crest.geojson", geojson(brow() * [1.0, 1.0, -1.0]))
    assert "below the ground in the median" in found
    assert ": does z point down in the file or in the terrain, or is one of them in another datum? The heights" in found


def test_a_datum_near_height_0_is_not_a_z_that_points_down(tmp_path: Path) -> None:
    """The ground at the line is at 0.2 m, so that heights in another datum also fit with the other sign."""
    line = brow() * [1.0, 1.0, 0.0] + [0.0, 0.0, -2.6]
    line[:, 0] += 70.0
    (found,) = told(tmp_path, "line", "floor.geojson", geojson(line))
    assert "in another unit or datum, or does the source lie next to its crest" in found


def test_a_crest_that_was_drawn_a_little_beyond_the_edge_of_its_face_is_right(tmp_path: Path) -> None:
    assert not told(tmp_path, "line", "crest.geojson", geojson(shifted(brow(), x=0.9)))


def test_a_file_in_plan_has_no_heights(tmp_path: Path) -> None:
    assert not told(tmp_path, "line", "crest.geojson", geojson(brow()[:, :2]))


def test_a_third_coordinate_that_is_no_number_is_no_height(tmp_path: Path) -> None:
    """The file is valid for a source with `above_ground`, which needs no heights."""
    path = tmp_path / "crest.geojson"
    path.write_text('{"type": "LineString", "coordinates": [[0, 0, "n/a"], [1, 0, null], [2, 0, [5]], [3, 0, 7.5]]}')
    heights = read_lines_with_heights(path)[0][:, 2]
    assert np.isnan(heights[:3]).all() and heights[3] == 7.5
