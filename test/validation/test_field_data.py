"""Tests of the field data alone: published figures, and peculiarities that the report must respect.

Reference/validation.md sections 1, 3 and 4; sources in docs/explanation/validation.md.
"""

from pathlib import Path

import numpy as np
import pytest
from field_cases import authume, chant_sura, tschamut
from field_cases.models import MODELS, SHAPES, TSCHAMUT
from field_cases.scenes import write_scene

from rpf3d_core.calibration.observations import calibration_of, field_of
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare

WHOLE, TENTH, HUNDREDTH = 0.5, 0.05, 0.005
"""Half a unit of the last published digit: 1, 0.1 or 0.01."""
RATIO = 0.0151
"""Largest error of published ratios, which have two digits and follow from rounded energies."""

needs_authume = pytest.mark.skipif(not authume.DATA.is_dir(), reason=f"the Authume data is not there ({authume.DATA})")
needs_tschamut = pytest.mark.skipif(not tschamut.DATA.is_dir(), reason=f"no Tschamut data ({tschamut.DATA})")
needs_chant_sura = pytest.mark.skipif(not chant_sura.DATA.is_dir(), reason=f"no Chant Sura data ({chant_sura.DATA})")


@needs_authume
def test_authume_has_the_published_runout_spread_and_reach_angle() -> None:
    field = authume.field()
    assert (field["side_mean"], field["side_sd"]) == pytest.approx((5.39, 6.94), abs=HUNDREDTH)
    assert (field["angle_mean"], field["angle_sd"]) == pytest.approx((43.8, 3.8), abs=TENTH)
    runout = authume.seen(authume.end_points()).runout
    assert runout == pytest.approx(np.linalg.norm((authume.end_points() - authume.drop())[:, [0, 2]], axis=1))
    assert (runout.mean(), runout.std(ddof=1)) == pytest.approx((44.58, 11.68), abs=HUNDREDTH)
    assert runout.max() == pytest.approx(70.5, abs=TENTH)


@needs_authume
def test_authumes_shares_are_as_unsure_as_published() -> None:
    for low, high in list(authume.field()["section_intervals"].values())[1:]:
        assert 100.0 * (high - low) / 2.0 == pytest.approx(14.0, abs=1.0), "about 14 points"


@needs_tschamut
def test_tschamut_has_18_runs_of_which_one_is_a_copy() -> None:
    field = tschamut.runs()
    assert len(field.names) == tschamut.RUNS
    copies = set(range(18)) - set(field.distinct())
    assert [field.names[i] for i in copies] == ["v034"]


@needs_tschamut
def test_tschamuts_terrain_is_the_published_plane_with_residuals() -> None:
    heights = tschamut.heights()
    rows, columns = np.indices(heights.shape)
    west, south = tschamut.CORNER
    x, y = west + tschamut.CELL * columns.ravel(), south + tschamut.CELL * rows.ravel()
    off = heights.ravel() - (-0.25313 * x + 0.40657 * y - 15.010)
    assert heights.shape == (46, 43)
    assert np.degrees(np.arctan(np.hypot(0.25313, 0.40657))) == pytest.approx(25.6, abs=TENTH)
    assert abs(off.mean()) < 5.0, "the plane, not its mirror image: that would be off by tens of metres"
    assert np.abs(off).max() > 5.0, "the residuals are no rounding: wide tolerances only"


@needs_tschamut
def test_the_runouts_are_those_that_the_file_tells() -> None:
    told = np.array([float(line["observed_runout_m"]) for line in _lines()])
    assert tschamut.runs().seen().runout == pytest.approx(told, abs=1e-3)


@needs_chant_sura
def test_the_six_impacts_have_the_published_speeds_and_energy_ratios() -> None:
    speeds = [np.linalg.norm(impact.before) for impact in chant_sura.published()]
    assert speeds == pytest.approx([25.0, 16.74, 21.41, 28.8, 22.2, 22.0], abs=HUNDREDTH)
    ratios = chant_sura.measured_ratios(chant_sura.published())
    assert ratios == pytest.approx([0.21, 1.11, 0.55, 0.42, 0.50, 0.47], abs=RATIO)


@needs_chant_sura
def test_one_of_the_six_gains_translational_energy() -> None:
    assert (chant_sura.measured_ratios(chant_sura.published()) > 1.0).sum() == 1


@needs_chant_sura
def test_there_are_eleven_contacts_of_five_runs_that_come_down() -> None:
    contacts = chant_sura.contacts()
    assert len(contacts) == 11 and len({impact.run for impact in contacts}) == 5
    assert all(impact.before[2] < 0.0 for impact in contacts)


@needs_chant_sura
def test_some_contacts_leave_downwards_so_the_ground_there_is_no_level_floor() -> None:
    downwards = [impact for impact in chant_sura.contacts() if impact.after and impact.after[2] < 0.0]
    assert len(downwards) == 6


def _lines() -> list[dict[str, str]]:
    import csv

    with (tschamut.DATA / "observed_deposition.csv").open(newline="") as file:
        return sorted(csv.DictReader(file), key=lambda line: line["trajectory_id"])


@needs_tschamut
def test_the_scenes_of_tschamut_can_be_calibrated(tmp_path: Path) -> None:
    for model in MODELS:
        scene = read_scene(write_scene(tmp_path, TSCHAMUT, model))
        field = field_of(scene, prepare(scene).terrain.frame)
        assert len(field.stops) == tschamut.RUNS == len(scene.sources)
        assert len(calibration_of(scene).unknowns) == len(model.unknown)
        assert (field.shapes is None) == (model != SHAPES)
