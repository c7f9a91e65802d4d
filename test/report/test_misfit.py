"""Tests that predictive intervals of a report include the misfit of the model, as those of the run do."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scenes.benches_fallen_from import TOE, fallen, thrown

from rpf3d_core.report.content import report_elements
from rpf3d_core.report.fences_part import HEIGHTS_LEAVE_OUT
from rpf3d_core.report.passing import places_beyond, shares_beyond
from rpf3d_core.report.run_files import read_run
from rpf3d_core.report.segments import segments_of
from rpf3d_core.report.toe import beyond_toe, held_beyond
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.unknowns import displacements_of_scene, sets_of_scene
from rpf3d_core.unknowns.displacements import displacements
from rpf3d_core.unknowns.parameter_sets import parameter_sets
from rpf3d_core.unknowns.predictive import ranked

SETS, EACH, MISFIT, STOP = 64, 50, 3.0, 30.0
STEP = 0.25
"""Largest error (m) of the toe that the report finds."""


def moved(misfit: float):
    """Return a run whose rocks all stop at one place, with a misfit (m) of its model."""
    sets = parameter_sets(["a.b"], np.zeros((SETS, 1)))
    return fallen(np.full(SETS * EACH, STOP), sets=SETS)._replace(moves=displacements(sets, misfit, 1))


@pytest.mark.parametrize("wanted", [50, 90, 95])
def test_a_distance_that_holds_rocks_is_uncertain_by_the_misfit(wanted: int) -> None:
    run = moved(MISFIT)
    figure = held_beyond(beyond_toe(run), SETS, wanted)
    assert figure.value == pytest.approx(STOP - TOE, abs=STEP)
    assert figure.predictive is not None
    low, high = ranked(run.moves[:, :1])  # the rocks run along x
    assert figure.predictive == pytest.approx((STOP - TOE + low[0], STOP - TOE + high[0]), abs=STEP)
    assert high[0] - low[0] > 3.0 * MISFIT


def test_without_a_misfit_rocks_that_stop_at_one_place_hold_no_uncertainty() -> None:
    figure = held_beyond(beyond_toe(moved(0.0)), SETS, 90)
    assert figure.predictive == pytest.approx((STOP - TOE, STOP - TOE), abs=STEP)


def test_a_share_beyond_a_place_holds_the_misfit_and_its_sampling_interval() -> None:
    beyond = beyond_toe(moved(MISFIT))
    near, at = shares_beyond(beyond, SETS, np.array([STOP - TOE - 2.0, STOP - TOE + 10.0 * MISFIT]))
    assert near.value == 1.0 and near.predictive == pytest.approx((0.0, 1.0), abs=0.01)
    assert at.value == 0.0 and at.predictive is not None and at.predictive[1] < 0.05, "no set moves so far"
    for figure in (near, at):
        assert figure.predictive[0] <= figure.sampling[0] and figure.predictive[1] >= figure.sampling[1]


def test_the_energy_at_a_fence_holds_the_misfit() -> None:
    def energy(misfit: float):
        run = thrown(moved(misfit), speed=12.0, height=2.5)
        fast = np.linspace(5.0, 25.0, 200)  # the speed grows along the path
        run = run._replace(paths=run.paths._replace(speed=np.tile(fast, SETS * EACH)))
        return places_beyond(run, beyond_toe(run), segments_of(run))[2].energy

    known, uncertain = energy(0.0), energy(MISFIT)
    assert known.value == uncertain.value
    assert known.predictive == pytest.approx((known.value, known.value), rel=0.02)
    grows = 2.0 * (25.0 - 5.0) / STOP * np.sqrt(2.0 * known.value / 1000.0) * 500.0  # J/m at this place
    low, high = uncertain.predictive
    assert high - low > 2.0 * 1.96 * 0.7 * MISFIT * grows


def test_a_report_displaces_rocks_as_its_run_did(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    inputs = json.loads((folder / "inputs.json").read_text())
    assert read_run(folder).moves is None
    inputs["scene"]["unknowns"]["misfit"] = MISFIT
    (folder / "inputs.json").write_text(json.dumps(inputs))
    scene = read_scene(Path(__file__).parents[2] / "config" / "scenes" / "bench_15m.yaml")
    scene = scene.model_copy(update={"unknowns": scene.unknowns.model_copy(update={"misfit": MISFIT})})
    run = read_run(folder)
    assert run.moves == pytest.approx(displacements_of_scene(scene, sets_of_scene(scene)), abs=0.0)
    texts = [element.text for element in report_elements(run, "site") if hasattr(element, "text")]
    assert HEIGHTS_LEAVE_OUT in texts
