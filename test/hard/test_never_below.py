"""No rock is ever below the ground that it was above: a small part of the campaign `test/never_below.py`."""

from pathlib import Path

import pytest
from never_below import engines_differ, flown
from on_both_engines import BOTH
from random_ground import DEEP, FAMILIES, case_of, fallen, in_the_air

import rpf3d_core as rpf3d
from rpf3d_core.values import Outcome

VERTEX = Path(__file__).parents[3] / "shared" / "data" / "audit" / "vertex.yaml"
CRACKED = [27, 42, 70, 82]
"""Seeds of meshes with T-junctions, rounded as survey coordinates are, through which rocks fell."""


@BOTH
@pytest.mark.skipif(not VERTEX.exists(), reason=f"needs {VERTEX.name}, which is not part of the project")
def test_a_rock_at_rest_on_a_vertex_stays_on_the_ground(engine):
    """The way that the rock is let go along leads over a facet whose square projection of that way misses it."""
    run = rpf3d.simulate(VERTEX, engine=engine)
    assert run.flights.deposits.outcome[0] == Outcome.STOPPED
    assert run.flights.deposits.x[0, 2] == pytest.approx(run.flights.deposits.release[0, 2], abs=1e-9)


@pytest.mark.parametrize("seed", CRACKED)
def test_no_rock_falls_through_a_crack_that_survey_coordinates_opened(seed):
    case = case_of("junctions", seed, 250)
    assert len(fallen(case, flown(case))) == 0, case.words


@pytest.mark.parametrize("family", sorted(FAMILIES))
@pytest.mark.parametrize("seed", [1, 2])
def test_no_rock_released_on_a_mesh_falls_through_it_or_hangs_above_it(family, seed):
    case = case_of(family, seed, 100)
    flights = flown(case)
    assert len(fallen(case, flights)) == 0, case.words
    assert len(in_the_air(case, flights)) == 0, case.words


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_both_engines_agree_on_a_mesh(family):
    assert not engines_differ(case_of(family, 4, 10))


def test_the_check_sees_a_rock_below_the_ground_and_one_that_hangs_above_it():
    case, stopped = case_of("steps", 1, 20), 3
    flights = flown(case)
    flights.deposits.outcome[stopped] = Outcome.STOPPED
    centre = case.terrain.vertices[case.terrain.triangles[5]].mean(axis=0)
    flights.deposits.x[stopped] = centre - (0.0, 0.0, 100.0 * DEEP)
    assert stopped in fallen(case, flights)
    flights.deposits.x[stopped] = centre + (0.0, 0.0, 100.0 * DEEP)
    assert stopped in in_the_air(case, flights)
    assert stopped not in fallen(case, flights)
