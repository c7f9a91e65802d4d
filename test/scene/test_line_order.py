"""Tests that a line whose points are not in order along the crest is reported, and a crest that bends is not."""

import json
from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.imports.crests import crests_of
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.setup.warnings.line_order import sharp_turns, shorter_order
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of

SCENES = Path(__file__).parents[2] / "config" / "scenes"
SCENE = """\
terrain: {{pit: {{triangles: 6000}}, up: {up}}}
materials: {{default: {{normal_restitution: 0.4, tangential_restitution: 0.8, rolling_friction: 0.4}}}}
sources: [{{name: north, points: [[0, 0, 0]]}}, {{name: crest, above_ground: 0.5, line: {line}}}]
"""
ALONG = np.linspace(-1.0, 1.0, 25)
CRESTS = {
    "straight": np.column_stack([50.0 * ALONG, 20.0 * ALONG]),
    "bent": np.column_stack([50.0 * ALONG, 8.0 * np.sin(6.0 * ALONG)]),
    "nose": np.column_stack([30.0 * np.abs(ALONG), 4.0 * ALONG]),
    "half a pit": np.column_stack([60.0 * np.cos(2.0 * ALONG), 60.0 * np.sin(2.0 * ALONG)]),
    "a closed pit": np.column_stack([60.0 * np.cos(np.pi * ALONG), 60.0 * np.sin(np.pi * ALONG)]).round(6),
    "two levels of a ramp": np.array([*((x, 0.0) for x in range(0, 60, 5)), *((x, 12.0) for x in range(60, 0, -5))]),
}  # fmt: skip


@pytest.mark.parametrize("name", CRESTS)
def test_a_crest_in_order_is_right_however_it_bends(name: str) -> None:
    assert shorter_order(CRESTS[name]) is None
    assert shorter_order(CRESTS[name][::-1]) is None


@pytest.mark.parametrize("name", CRESTS)
def test_points_out_of_order_are_noticed(name: str) -> None:
    line = CRESTS[name]
    mixed = line[np.random.default_rng(1).permutation(len(line))]
    order = shorter_order(mixed)
    assert order is not None and sorted(order) == list(range(len(line)))


@pytest.mark.parametrize("name", [name for name in CRESTS if name != "nose"])
def test_two_points_that_changed_places_are_noticed(name: str) -> None:
    """A narrow nose is an exception, because the nearest point may be on its other side."""
    line = CRESTS[name]
    swapped = line.copy()
    swapped[[10, 13]] = line[[13, 10]]
    assert shorter_order(swapped) is not None and {10, 13} & {*sharp_turns(swapped)}


def warned(folder: Path, line: object, up: str = "z") -> list[str]:
    (folder / "scene.yaml").write_text(SCENE.format(line=json.dumps(line), up=up))
    return [warning for warning in warnings_of(read_scene(folder / "scene.yaml")) if "turns back" in warning]


def test_the_warning_names_the_source_the_point_and_the_lengths(tmp_path: Path) -> None:
    line = [[0, 0], [10, 0], [30, 0], [20, 0], [40, 0]]
    (told,) = warned(tmp_path, line)
    assert told.startswith("`sources[1].line` of 'crest' turns back at 2 of its 5 points, first at point 3 (30, 0)")
    assert told.endswith("The line is 60 m long; in another order it would be 40 m")
    assert warned(tmp_path, [[x, 7, y] for x, y in line], "y") and not warned(tmp_path, sorted(line))


def test_each_line_of_a_file_is_judged_alone(tmp_path: Path) -> None:
    """No rock starts between the end of one line and the start of the next, so their directions may differ."""
    lines = [[[x, 0] for x in range(0, 60, 10)], [[x, 3] for x in range(0, 60, 10)]]
    mixed = [lines[0], [lines[1][i] for i in (0, 3, 1, 2, 5)]]
    for name, written in (("both.geojson", lines), ("mixed.geojson", mixed)):
        (tmp_path / name).write_text(json.dumps({"type": "MultiLineString", "coordinates": written}))
    assert [len(warned(tmp_path, name)) for name in ("both.geojson", "mixed.geojson")] == [0, 1]


@pytest.mark.parametrize("name", ["demo.yaml", "study_high.yaml"])
def test_the_crests_that_are_found_on_a_terrain_are_in_order(name: str) -> None:
    crests = crests_of(read_terrain(read_scene(SCENES / name))[0])
    assert crests and not any(len(sharp_turns(crest.points[:, :2])) for crest in crests)
