"""Tests of the Authume quarry by the command line: published mesh, comparison with the field, nothing tuned.

Reference/validation.md section 1. Garcia, Villard, Richefeu, Daudon, Eng. Geol.; Bourrier et al. 2021, Landslides
18:639-654; data set richefeu/AuthumeQuarryRockfalls_Data-in-Brief (2025).
"""

import csv
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from input_files.terrain_files import SHARED_DATA
from programs.command_line import rpf3d

from rpf3d_core.setup.terrain import read_surface
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome

DATA = SHARED_DATA / "authume"
SCENE = Path(__file__).parents[2] / "config" / "scenes" / "authume_p1.yaml"
ROCKS = 1000

WHOLE, TENTH, HUNDREDTH = 0.5, 0.05, 0.005
"""Half a unit of the last published digit: 1, 0.1 or 0.01."""

TWICE = 0.055
"""Largest error (m) of percentiles: the median, 40.247 m in the file, was rounded twice, by 40.25 to 40.3."""

TRIANGLES = {"blue": 5300, "gray": 2953, "red": 748}
AREAS = {"blue": 11_511, "gray": 12_836, "red": 2_420}
FIELD = {"p5": 34.8, "p10": 36.1, "p25": 38.0, "p50": 40.3, "p75": 50.6, "p90": 61.9, "p95": 62.2}
SECTIONS = {"upper_slope": 2, "ledge": 21, "floor": 18}

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the Authume data is not there ({DATA})")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("authume") / "out"
    done = rpf3d("run", SCENE, "--rocks", ROCKS, "--out", out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def facts(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "summary.json").read_text()))


def test_the_three_files_weld_into_one_mesh_with_the_published_counts(facts: dict[str, Any]) -> None:
    found = facts["terrain"]["faults"]
    names = ("triangles", "vertices", "edges", "boundary_edges", "non_manifold_edges", "zero_area_facets")
    assert [found[name] for name in names] == [9001, 4640, 13_640, 277, 0, 0]
    assert found["pieces"] == 1


def test_the_zones_have_the_published_areas_and_triangles(folder: Path, facts: dict[str, Any]) -> None:
    assert facts["terrain"]["faults"]["area_by_zone"] == pytest.approx(AREAS, abs=WHOLE)
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(folder / "terrain.vtp"))
    reader.Update()
    mesh = reader.GetOutput()
    names = mesh.GetFieldData().GetAbstractArray("zone_names")
    counts = np.bincount(vtk_to_numpy(mesh.GetCellData().GetArray("zone")))
    assert {names.GetValue(i): int(n) for i, n in enumerate(counts)} == TRIANGLES


def test_the_mesh_lies_where_the_input_has_it_with_y_up(facts: dict[str, Any]) -> None:
    found = facts["terrain"]["faults"]
    assert found["low"] == pytest.approx([-7.4, 153.2, 217.7], abs=TENTH)
    assert found["high"] == pytest.approx([108.4, 214.2, 427.9], abs=TENTH)


def test_facets_that_the_files_wind_downwards_are_turned_and_counted(facts: dict[str, Any]) -> None:
    points = [read_surface(DATA / f"DTM_{zone}_zone.stl").points for zone in ("Blue", "Gray", "Red")]
    corners = np.concatenate(points).reshape(-1, 3, 3)
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1]
    assert round((up < 0.0).mean(), 2) == 0.99
    # A connected component is turned as a whole: the 1 % of facets that faced up are overhangs.
    assert facts["terrain"]["faults"]["flipped_facets"] == 9001
    assert facts["terrain"]["faults"]["steepest_deg"] > 90.0


def test_every_rock_has_an_outcome_and_a_sentence(folder: Path, facts: dict[str, Any]) -> None:
    with (folder / "deposits.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    outcomes = Counter(line["outcome"] for line in lines)
    assert len(lines) == ROCKS and sorted(int(line["rock"]) for line in lines) == list(range(ROCKS))
    assert set(outcomes) <= {outcome.name.lower() for outcome in Outcome}
    assert {name: entry["rocks"] for name, entry in facts["outcomes"].items()} == outcomes
    for name, entry in facts["outcomes"].items():
        assert entry["sentence"] == OUTCOME_SENTENCES[Outcome[name.upper()]]


def test_no_rock_is_left_in_unresolved_contact_because_the_scene_names_sliding(facts: dict[str, Any]) -> None:
    assert facts["scene"]["ground"] == "sliding"
    assert "unresolved_contact" not in facts["outcomes"]


def test_the_summary_has_the_41_field_end_points_as_published(facts: dict[str, Any]) -> None:
    field = facts["observed"]["field"]
    assert field["rocks"] == 41
    assert field["mean"] == pytest.approx(44.09, abs=HUNDREDTH)
    assert field["sd"] == pytest.approx(11.46, abs=HUNDREDTH)
    assert {name: field[name] for name in FIELD} == pytest.approx(FIELD, abs=TWICE)
    assert (field["min"], field["max"]) == pytest.approx((3.8, 68.5), abs=TENTH)
    assert {name: part["rocks"] for name, part in field["sections"].items()} == SECTIONS


def test_the_simulated_stops_are_compared_along_the_same_axis(folder: Path, facts: dict[str, Any]) -> None:
    observed = facts["observed"]
    with (folder / "deposits.csv").open(newline="") as file:
        x = np.array([float(line["x"]) for line in csv.DictReader(file) if line["outcome"] == "stopped"])
    simulated = observed["simulated"]
    assert simulated["rocks"] == len(x) == sum(part["rocks"] for part in simulated["sections"].values())
    assert simulated["mean"] == pytest.approx(x.mean(), rel=1e-12), "the same numbers, summed up twice"
    assert observed["mean_difference_m"] == pytest.approx(simulated["mean"] - observed["field"]["mean"], abs=1e-9)
    assert simulated["sections"]["ledge"]["rocks"] == int(((x >= 30.0) & (x < 45.0)).sum())


def test_rocks_leave_the_square_of_the_four_drop_points(folder: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow.parquet")
    paths = pyarrow.read_table(folder / "trajectories.parquet").to_pydict()
    starts = np.array([(x, y, z) for x, y, z, t in zip(*(paths[c] for c in "xyzt"), strict=True) if t == 0.0])
    drops = np.loadtxt(DATA / "positions_P1.xyz")[:, :3]
    assert np.ptp(drops, axis=0) == pytest.approx([4.0, 0.0, 4.0], abs=0.1)
    off = np.abs(starts[:, None] - drops[None]).min(axis=1)
    assert (off[:, 1] < 1e-9).all(), "the spread is horizontal"
    assert (np.abs(starts[:, None] - drops[None])[..., [0, 2]].max(axis=2).min(axis=1) <= 1.0 + 1e-9).all()
