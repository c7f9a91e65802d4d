"""Tests that a report of several benches and a fence states from which toe it counts, and draws the fence."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import with_models

from rpf3d_core.report.content import report_elements
from rpf3d_core.report.elements import Picture, Table, Text
from rpf3d_core.report.footing import footing_at
from rpf3d_core.report.run_files import RunFiles, read_hazard, read_run
from rpf3d_core.report.section import critical_section
from rpf3d_core.report.section_fences import fences_in, footings_of_barriers
from rpf3d_core.report.toe import beyond_toe
from rpf3d_core.report.view import _layout, terrain_seen, view_html
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene

SCENE = """\
terrain: {{benches: {{number: {number}, height: 12, berm: {berm}, width: 60}}}}
materials:
  default: {{normal_restitution: {{mean: 0.3, sd: 0.15, min: 0, max: 0.6}}, tangential_restitution: 0.85}}
rock: {{density: 2500, diameter: 0.8}}
sources: [{{name: top, crest: 1, above_ground: 1, rocks: 120, velocity: [2, 0, 0], velocity_spread: [3, 0, 0]}}]
effects:
  barriers:
    panels:
      - {{name: fence, along: {along}, height: 3, capacity_kj: 1}}
      - {{name: beside, along: [[{x}, 900], [{x}, 901]], height: 3, capacity_kj: 1}}
"""
BERM, FLOOR = 6.0, 4.0
"""Width (m) of a berm, and distance (m) of the fence in front of the lowest toe."""
RUN = 12.0 / np.tan(np.radians(70.0))


def flown(folder: Path, number: int, in_a_file: bool = False, berm: float = BERM, more: str = "") -> RunFiles:
    x = float(number * RUN + (number - 1) * berm + FLOOR)
    line = [[x, -29.0], [x, 29.0]]
    folder.mkdir(exist_ok=True)
    text = SCENE.replace("900", "28").replace("901", "29").format(number=number, berm=berm, along=line, x=x + 3.0)
    text = text.replace("capacity_kj: 1}", f"capacity_kj: 1{more}}}", 1)
    if in_a_file:
        (folder / "fence.geojson").write_text(f'{{"type": "LineString", "coordinates": {line}}}')
        text = text.replace(str(line), "fence.geojson")
    (folder / "scene.yaml").write_text(with_models(text, ground='sliding'))
    run_scene(read_scene(folder / "scene.yaml"), folder / "run", 120, "reference")
    return read_run(folder / "run")


@pytest.fixture(scope="module")
def two_benches(tmp_path_factory: pytest.TempPathFactory) -> RunFiles:
    return flown(tmp_path_factory.mktemp("two"), 2)


def words(run: RunFiles) -> str:
    return " ".join(element.text for element in report_elements(run, "wall") if isinstance(element, Text))


def test_rocks_that_go_down_a_second_face_are_counted(two_benches: RunFiles) -> None:
    beyond, second = beyond_toe(two_benches), 2.0 * RUN + BERM
    x = two_benches.ends.end[beyond.rows, 0] + two_benches.terrain.frame.origin[0]
    down, clear = x > second, np.abs(x - second) > 1.0
    assert 0 < down.sum() < len(down) and clear.mean() > 0.8
    assert np.array_equal(beyond.further[clear], down[clear])
    assert f"{beyond.further.sum():,} of {len(down):,} rocks went down a further face" in words(two_benches)


def test_the_answer_names_the_face_whose_toe_it_counts_from(two_benches: RunFiles) -> None:
    tables = [element for element in report_elements(two_benches, "wall") if isinstance(element, Table)]
    rows = [row for table in tables for row in table.rows]
    assert any(row[0] == "distance beyond the toe of the first face that holds 90 % of the rocks" for row in rows)


def test_one_face_has_no_further_one(tmp_path: Path) -> None:
    run = flown(tmp_path / "one", 1)
    assert not beyond_toe(run).further.any()
    assert "further face" not in words(run)


def test_a_place_of_a_fence_on_a_face_is_named_as_one(tmp_path: Path) -> None:
    """From the first toe, the berm extends to 8 m, the second face of 70 degrees to 8 m + RUN, then the floor."""
    run = flown(tmp_path / "site", 2, berm=8.0)
    places = [footing_at(run.terrain, along_the_toe(run, distance)) for distance in (0.0, 4.0, 8.0 + 0.5 * RUN, 16.0)]
    assert [footing.is_on_a_face for footing in places] == [False, False, True, False]
    assert [footing.slope for footing in places] == pytest.approx([0.0, 0.0, 70.0, 0.0], abs=0.1)
    elements = report_elements(run, "wall")
    ground, figures = (
        next(element for element in elements if isinstance(element, Table) and element.header[:2] == header)
        for header in (("beyond the toe", "ground there"), ("beyond the toe", "known paths"))
    )
    assert [row[:2] for row in ground.rows][:4] == [
        ["0.0 m", "0 degrees"], ["5.0 m", "0 degrees"], ["10.0 m", "face of 70 degrees"], ["15.0 m", "0 degrees"],
    ]  # fmt: skip
    assert [row[0] for row in figures.rows][:4] == ["0.0 m", "5.0 m", "10.0 m (on a face)", "15.0 m"]
    assert "No fence can be built 10.0 m beyond the toe: the ground there is a face" in words(run)


def along_the_toe(run: RunFiles, distance: float) -> np.ndarray:
    """Return places (N, 2) m at a distance (m) beyond the first toe, in the local frame of the run."""
    east, north, _ = run.terrain.frame.origin
    return np.column_stack([np.full(20, RUN + distance - east), np.linspace(-20.0, 20.0, 20) - north])


def test_a_fence_of_the_scene_on_a_face_is_named(tmp_path: Path, two_benches: RunFiles) -> None:
    assert "is on a face for" not in words(two_benches)
    run = flown(tmp_path / "site", 2)
    panel = run.summary["scene"]["effects"]["barriers"]["panels"][0]
    panel["along"] = [[0.5 * RUN, -20.0], [0.5 * RUN, 0.0], [RUN + 3.0, 0.0], [RUN + 3.0, 17.0]]
    footing = footings_of_barriers(run)["fence"]
    assert footing.steep == pytest.approx(0.5, abs=0.1)
    assert "the barrier fence is on a face for" in words(run)


@pytest.mark.parametrize("in_a_file", [False, True])
def test_the_section_shows_the_fence_where_it_stands(two_benches: RunFiles, tmp_path: Path, in_a_file: bool) -> None:
    run = flown(tmp_path / "site", 2, in_a_file) if in_a_file else two_benches
    section = critical_section(run)
    assert section is not None
    (fence,), elsewhere = fences_in(run, section)
    assert elsewhere == ["beside"]
    heading = np.radians(section.azimuth)
    x = section.start[0] + fence.distance * np.sin(heading)
    assert x == pytest.approx(2.0 * RUN + BERM + FLOOR, abs=1e-6)
    assert (fence.foot, fence.top) == pytest.approx((0.0, 3.0), abs=1e-6)
    assert "the picture leaves out: beside." in words(run)


def test_the_legend_is_below_the_view_and_the_eye_sees_the_whole_terrain(two_benches: RunFiles) -> None:
    """A legend over the view hid the rocks in a narrow window, and titles of axes were out of the view."""
    seen = terrain_seen(two_benches)
    layout = _layout(two_benches, seen, np.array([1.0, 0.0]))
    assert (layout["legend"]["y"], layout["legend"]["yanchor"]) == (0.0, "top")
    eye = np.array([layout["scene"]["camera"]["eye"][axis] for axis in "xyz"])
    sides = np.ptp(seen.vertices, axis=0)
    assert np.linalg.norm(eye) > np.linalg.norm(sides) / np.cbrt(sides.prod()), "farther than the box is long"


def test_the_view_shows_the_fence_as_a_wall_on_the_ground(two_benches: RunFiles) -> None:
    html = view_html(two_benches, terrain_seen(two_benches), np.array([1.0, 0.0]))
    figure = json.loads(re.search(r"Plotly\.newPlot\(\s*\S+,\s*(\[.*?\]),\s*\{\"", html, re.DOTALL)[1])
    (top,) = [trace for trace in figure if trace.get("name") == "barrier fence (3 m high)"]
    (panel,) = [trace for trace in figure if trace["type"] == "mesh3d" and trace.get("legendgroup") == "fence"]
    assert "fence" in top["text"]
    heights = decoded(panel["z"])
    assert (heights.min(), heights.max()) == pytest.approx((0.0, 3.0), abs=1e-3)


def decoded(values: dict[str, str]) -> np.ndarray:
    """Return the array that plotly wrote into a page in base64."""
    return np.frombuffer(base64.b64decode(values["bdata"]), dtype=values["dtype"])


def test_the_section_and_the_view_show_the_part_of_a_damaged_fence_that_still_stands(tmp_path: Path) -> None:
    run = flown(tmp_path / "site", 2, more=", residual_height: 0.5")
    section = critical_section(run)
    assert section is not None
    ((fence,), _) = fences_in(run, section)
    assert fence.top - fence.foot == pytest.approx(1.5, abs=1e-6)
    assert "barrier fence (1.5 m high)" in view_html(run, terrain_seen(run), np.array([1.0, 0.0]))


def test_a_fence_whose_file_is_gone_is_named_and_not_drawn(tmp_path: Path) -> None:
    run = flown(tmp_path / "site", 2, in_a_file=True)
    (tmp_path / "site" / "fence.geojson").unlink()
    section = critical_section(run)
    assert section is not None
    assert fences_in(run, section) == ([], ["fence", "beside"])


def test_the_energy_map_says_how_many_cells_are_empty(two_benches: RunFiles) -> None:
    reached, energy = read_hazard(two_benches, "reach_probability"), read_hazard(two_benches, "energy_j", "p95")
    assert reached is not None
    rocks = np.nan_to_num(reached.values) * 120.0
    few = int(((rocks > 0.5) & (rocks < 19.5)).sum())
    assert energy is None or np.isfinite(energy.values).sum() == (rocks > 19.5).sum()
    (caption,) = [element.caption for element in report_elements(two_benches, "wall")
                  if isinstance(element, Picture) and "95th percentile of the energy" in element.caption]  # fmt: skip
    assert re.search(r"More than [\d,]+ rocks are needed to fill half of them, because .+ cells; ", caption)
    assert re.search(r"; (no larger cell fills|`hazard.cell: [\d.]+` fills) half of them\.", caption)
    assert f"{few:,} of the {int((rocks > 0.5).sum()):,} cells that rocks reached have no value" in caption
