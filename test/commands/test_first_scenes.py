"""Tests of the first scenes of a new user: each mistake gets a helpful answer, and the last scene is right.

The terrain is a DXF in UTM coordinates with layers. Each test has a scene as a new user would write it.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from input_files.mine_files import EAST, NORTH, write_dxf, write_vector
from scenes.benches_fallen_from import HEIGHT, TOE
from typer.testing import CliRunner

from rpf3d_core.cli import app
from rpf3d_core.errors import InputError

CREST = [[EAST + 0.2, NORTH - 8.0], [EAST + 0.2, NORTH + 8.0]]
SCENE = """\
terrain: {{files: [{{path: pit.dxf}}], crs: EPSG:32719}}
materials: {{default: {{{material}}}}}
rock: {rock}
sources: [{{name: crest, {source}, rocks: 40}}]
outputs: {{pictures: false, recording: false}}
{more}
"""
GROUND = "normal_restitution: 0.35, tangential_restitution: 0.85"
ON_LINE = f"line: {CREST}, above_ground: 0.5"


@pytest.fixture
def pit(tmp_path: Path) -> Path:
    """Return a folder with a bench of 15 m as DXF, and its crest as GeoJSON in the same coordinates."""
    pytest.importorskip("ezdxf", reason="ezdxf is not installed: it is in the extra `test`")
    profile = [(-20.0, HEIGHT), (0.0, HEIGHT), (TOE, 0.0), (60.0, 0.0)]
    vertices = np.array([(EAST + x, NORTH + y, 800.0 + z) for x, z in profile for y in (-20.0, 20.0)])
    triangles = np.array([(2 * i + a, 2 * i + b, 2 * i + c) for i in range(3) for a, b, c in ((0, 2, 3), (0, 3, 1))])
    write_dxf(tmp_path / "pit.dxf", vertices, triangles)
    (tmp_path / "crest.geojson").write_text(json.dumps({"type": "LineString", "coordinates": CREST}))
    return tmp_path


def scene(
    pit: Path, source: str = ON_LINE, material: str = GROUND, rock: str = "{diameter: 1}", more: str = ""
) -> Path:
    path = pit / "scene.yaml"
    path.write_text(SCENE.format(source=source, material=material, rock=rock, more=more))
    return path


def run(path: Path) -> tuple[str, dict]:
    """Run a scene; return everything that was printed, and the summary."""
    out = path.parent / "out"
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(out), "--engine", "reference"])
    assert done.exit_code == 0, done.exception or done.output
    return " ".join(done.output.split()), json.loads((out / "summary.json").read_text())


def check(path: Path) -> tuple[str, str]:
    """Check a scene; return everything that was printed, and the sentence of a refusal, or "" without one."""
    done = CliRunner().invoke(app, ["check", str(path), "--engine", "reference"])
    assert done.exception is None or isinstance(done.exception, InputError), done.exception
    return " ".join(done.output.split()), str(done.exception or "")


def test_1_a_crest_from_a_file_asks_for_its_height_and_then_runs(pit: Path) -> None:
    assert "needs `above_ground`, a height (m) over ground" in check(scene(pit, "line: crest.geojson"))[1]
    _, summary = run(scene(pit, "line: crest.geojson, above_ground: 0.5"))
    assert summary["outcomes"]["stopped"]["rocks"] == 40


def test_2_points_in_plan_start_above_the_ground(pit: Path) -> None:
    _, summary = run(scene(pit, f"points: {CREST}, above_ground: 0.5"))
    assert summary["runout_m"]["p50"] > TOE


def test_3_an_area_from_a_shapefile_is_counted(pit: Path) -> None:
    pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    road = shapely.box(EAST + TOE, NORTH - 20.0, EAST + 30.0, NORTH + 20.0)
    write_vector(pit / "road.shp", [road], layer="road")
    _, summary = run(scene(pit, more="areas_of_interest: [{name: road, polygons: road.shp}]"))
    assert summary["areas_of_interest"]["road"]["reached"]["rocks"] == 40


@pytest.mark.parametrize(
    ("place", "hint"),
    [
        ([1000 * EAST, 1000 * NORTH, 815_000.0], "in millimetres"),
        ([NORTH, EAST, 815.0], "if x and y were swapped"),
        ([-69.4, -21.2, 815.0], "degrees"),
    ],
)
def test_4_a_source_off_the_terrain_is_shown_with_its_extents_and_the_reason(pit: Path, place, hint: str) -> None:
    printed, refusal = check(scene(pit, f"points: [{place}]"))
    assert f"x {EAST - 20:.0f} .. {EAST + 60:.0f}" in printed, "the extents come before the refusal"
    assert hint in printed and "source" in refusal


def test_5_friction_is_known_by_its_meaning(pit: Path) -> None:
    assert "did you mean `friction_angle_deg`" in check(scene(pit, material=GROUND + ", friction: 35"))[1]


def test_6_a_diameter_in_millimetres_is_noticed(pit: Path) -> None:
    printed, _ = run(scene(pit, rock="{diameter: 800}"))
    assert "`rock` reaches 800 m in diameter" in printed


@pytest.mark.parametrize("command", [check, run])
def test_7_a_source_high_in_the_air_is_noticed(pit: Path, command: Callable[[Path], tuple[str, str]]) -> None:
    printed, _ = command(scene(pit, f"points: [[{EAST}, {NORTH}, 945]]"))
    assert "starts 130 m or more above the ground" in printed


@pytest.mark.parametrize("command", [check, run])
def test_8_a_source_behind_the_crest_is_noticed(pit: Path, command: Callable[[Path], tuple[str, str]]) -> None:
    printed, _ = command(scene(pit, f"points: [[{EAST - 7}, {NORTH}]], above_ground: 0.5, spread: [1, 1, 0]"))
    assert re.search("all [0-9]+ (pilot )?rocks of source '[^']+' stopped less than 2 m below their release", printed)


def test_8b_r_n_and_r_t_in_the_wrong_order_are_noticed(pit: Path) -> None:
    printed, _ = run(scene(pit, material="normal_restitution: 0.85, tangential_restitution: 0.35"))
    assert "are R_n and R_t swapped?" in printed
    assert "are R_n and R_t swapped?" not in run(scene(pit))[0]


def test_9_the_scene_that_rpf3d_writes_is_right_at_the_first_try_and_makes_a_report(pit: Path) -> None:
    made = CliRunner().invoke(app, ["new", str(pit / "site"), "--terrain", str(pit / "pit.dxf"), "--crs", "EPSG:32719"])
    assert made.exit_code == 0, made.output
    out = pit / "out"
    flown = CliRunner().invoke(
        app, ["run", str(pit / "site" / "scene.yaml"), "--out", str(out), "--rocks", "64", "--engine", "reference"]
    )
    assert flown.exit_code == 0, flown.exception or flown.output
    summary = json.loads((out / "summary.json").read_text())
    assert summary["runout_m"]["p5"] > 1.0, "rocks leave the crest"
    assert summary["terrain"]["crs"] == "EPSG:32719" and summary["unknowns"]["sets"] == 64
    report = CliRunner().invoke(app, ["report", str(out), "--out", str(pit / "r.html"), "--pdf", str(pit / "r.pdf")])
    assert report.exit_code == 0, report.exception or report.output
    assert (pit / "r.pdf").read_bytes().startswith(b"%PDF")
