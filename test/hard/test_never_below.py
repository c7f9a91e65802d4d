"""Tests that no rock gets below the ground: a small part of the campaign `test/support/campaigns/never_below.py`."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns.never_below import engines_differ, flown, guarded, held
from flights.on_both_engines import BOTH
from flights.scenes_of_facets import AT_REST, engine_over, flight, fly, surface, terrain_of
from meshes.held_in_gullies import held_too_early
from meshes.random_ground import FAMILIES, OVERHANGING, case_of, fallen, in_the_air
from meshes.side_of_ground import DEEP, has_odd_above

import rpf3d_core as rpf3d
from rpf3d_core.ensemble.flights import Paths
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Mode, Outcome

VERTEX = Path(__file__).parents[3] / "shared" / "data" / "audit" / "vertex.yaml"
CRACKED = [27, 42, 70, 82]
"""Seeds of meshes with T-junctions, rounded like survey coordinates, through which rocks once fell."""


FALLEN = [
    ("junctions", 35, "coulomb_limited", 17),  # released at a crack
    ("junctions", 145, "coulomb_limited", 24),
    ("junctions", 419, "coulomb_limited", 163),
    ("walls", 1, "constant", 26),  # along the foot of an upright wall, past a seam of the mesh
    ("walls", 4, "coulomb_limited", 0),
    ("walls", 473, "coulomb_limited", 174),  # up a wall in bounces of 5e-10 m, over the edge between two of its facets
    ("overhangs", 140, "constant", 115),  # where the foot of an overhang bends, into the corner under it
    ("overhangs", 303, "coulomb_limited", 17),
    ("overhangs", 401, "coulomb_limited", 137),
    ("seams", 30, "constant", 15),  # along a T-junction, down the dip
    ("seams", 32, "coulomb_limited", 37),
    ("scattered", 35, "coulomb_limited", 206),  # over a vertex where facets of all sizes meet
    ("ridges", 250, "constant", 136),  # along a sharp gully, at 1e-9 of its speed towards the other side
    ("crests", 4, "constant", 120),  # after its release into a crack, and off the back of the next facet
    ("crests", 10, "constant", 93),
    ("crests", 17, "coulomb_limited", 17),
]
"""(Family of cases, seed, rebound model, number of the rock) of rocks that once fell through the ground."""

FAN = [(1.0, -0.02, -0.52), (1.0, 1.0, 0.5), (-0.2, 1.0, 0.2), (-1.0, 0.6, 1.0), (-0.5, -1.0, 0.3)]
"""Outer corners (m) of five facets around a vertex at the origin.

From the vertex, the line of steepest descent of no facet lies on that facet, so the rock starts along that of the
steepest facet, +x. In plan, this direction lies over the facet of the first two corners and leads into this facet; its
perpendicular projection onto the plane of the facet lies outside the facet.
"""


def fan() -> Terrain:
    return terrain_of([(0.0, 0.0, 0.0), *FAN], [(0, 1 + i, 1 + (i + 1) % 5) for i in range(5)])


@BOTH
def test_a_rock_at_rest_on_a_vertex_finds_the_gully_that_leads_down_from_it(engine):
    """The gully is the edge to the first corner: it is 1.13 m long and has a slope of 27.5 degrees."""
    deposits = fly(engine_over(engine, fan()), flight(surface(0.35, 0.85, 5.0)), AT_REST).deposits
    assert deposits.x[0].tolist() == pytest.approx(FAN[0], abs=1e-6)
    assert 2.0 < deposits.max_speed[0] < math.sqrt(2.0 * 9.81 * 0.52)


@BOTH
def test_a_rock_at_rest_on_a_vertex_whose_gully_friction_holds_stays_there(engine):
    deposits = fly(engine_over(engine, fan()), flight(surface(0.35, 0.85, 30.0)), AT_REST).deposits
    assert deposits.outcome[0] == Outcome.STOPPED
    assert deposits.x[0].tolist() == pytest.approx(AT_REST, abs=1e-6)


TURNED = math.cos(math.radians(33.0)), math.sin(math.radians(33.0))


def wall_over_a_floor(lean: float) -> Terrain:
    """Return a plateau, a 10 m wall and a floor in two strips along y; the foot of the wall dips towards +y.

    lean : how far (m) the top of the wall leans back; negative for an overhang
    """
    profile = [(-10.0 - lean, 10.0), (-lean, 10.0), (0.0, 0.0), (20.0, 6.0)]
    vertices = [(x, y, z - 0.5 * y) for y in (0.0, 20.0, 40.0) for x, z in profile]
    corners = [4 * row + column for row in range(2) for column in range(3)]
    return terrain_of(vertices, [facet for a in corners for facet in ((a, a + 1, a + 5), (a, a + 5, a + 4))])


@BOTH
@pytest.mark.parametrize("lean", [0.0, -1e-6, -0.3], ids=["upright", "nearly upright", "overhanging"])
def test_a_rock_that_slides_along_the_foot_of_a_wall_passes_the_seams_of_the_mesh(engine, lean):
    """From rest at (3, 8) m, the rock slides to the wall and along its foot past y = 20 m, where new facets begin."""
    physics = flight(surface(0.0, 0.85, math.degrees(math.atan(0.2))))
    ends = fly(engine_over(engine, wall_over_a_floor(lean)), physics, (3.0, 8.0, 0.3 * 3.0 - 0.5 * 8.0)).deposits
    assert ends.outcome[0] == Outcome.LEFT_TERRAIN
    assert ends.x[0].tolist() == pytest.approx((0.0, 40.0, -20.0), abs=1e-6), "over the rim, not through the floor"


@BOTH
def test_a_rock_in_the_corner_under_an_overhang_does_not_fall_through_the_floor(engine):
    """The rock starts at rest where a dipping floor meets an overhanging wall, and slides along their common line."""
    vertices = [(x, y, z + 0.3 * y) for y in (-3.0, 3.0) for x, z in [(1.0, 4.0), (0.0, 0.0), (4.0, 1.0)]]
    notch = terrain_of(vertices, [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)])
    ends = fly(engine_over(engine, notch), flight(surface(0.0, 0.85, 5.0)), (0.0, 1.0, 0.3)).deposits
    assert ends.outcome[0] == Outcome.LEFT_TERRAIN
    assert ends.x[0].tolist() == pytest.approx((0.0, -3.0, -0.9), abs=1e-6), "over the rim, not through the floor"


@BOTH
@pytest.mark.parametrize("rounded", [np.float32, np.float64])
def test_a_wall_of_many_strips_is_never_hit_from_behind(engine, rounded):
    """The wall is upright and turned by 33 degrees; rounding to float32 turns its strips by 1e-7 rad to each other."""
    along, up = np.linspace(-4.0, 4.0, 9), (0.0, 3.0)
    corners = [(float(rounded(a * TURNED[1])), float(rounded(-a * TURNED[0])), z) for a in along for z in up]
    wall = terrain_of(corners, [t for k in range(0, 16, 2) for t in ((k, k + 3, k + 1), (k, k + 2, k + 3))])
    outward = -np.array((*TURNED, 0.0))
    draw = np.random.default_rng(5)
    x = outward + (0.0, 0.0, 2.0) + draw.uniform(-1.0, 1.0, (40 if engine == "reference" else 4_000, 3)) * 0.5
    v = np.stack(
        [6.0 + draw.normal(0.0, 2.0, len(x)), 6.0 + draw.normal(0.0, 2.0, len(x)), draw.normal(0.0, 1.0, len(x))], 1
    )
    normals = fly(engine_over(engine, wall), flight(surface(0.0, 0.9, 30.0), "none"), x, v).impacts.normal
    assert len(normals) > 0.3 * len(x)
    assert (normals @ outward).min() > 0.9


@BOTH
def test_a_rock_under_the_ground_is_not_counted_as_one_that_left(engine):
    """Such a rock ends where it was, with an outcome that alerts count as danger, whatever the cause."""
    plane = terrain_of([(0.0, 0.0, 0.0), (9.0, 0.0, 0.0), (9.0, 9.0, 0.0), (0.0, 9.0, 0.0)], [(0, 1, 2), (0, 2, 3)])
    start = [(3.0, 4.0, -1.0), (3.0, 4.0, 1.0)]
    ends = fly(
        engine_over(engine, plane), flight(surface(0.5, 0.9, 30.0)), start, [(1.0, 0.5, 0.0), (9.0, 9.0, 9.0)]
    ).deposits
    assert ends.outcome.tolist() == [Outcome.FELL_THROUGH, Outcome.LEFT_TERRAIN]
    assert ends.x[0].tolist() == [3.0, 4.0, -1.0]


@BOTH
@pytest.mark.skipif(not VERTEX.exists(), reason=f"needs {VERTEX.name}, which is not part of the project")
def test_a_rock_at_rest_on_a_vertex_stays_on_the_ground(engine):
    """The terrain is eight triangles of a real survey; the rock once fell through their common vertex."""
    run = rpf3d.simulate(VERTEX, engine=engine)
    assert run.flights.deposits.outcome[0] == Outcome.STOPPED
    assert run.flights.deposits.x[0, 2] == pytest.approx(run.flights.deposits.release[0, 2], abs=1e-9)


@pytest.mark.parametrize("seed", CRACKED)
def test_no_rock_falls_through_a_crack_that_survey_coordinates_opened(seed):
    case = case_of("junctions", seed, 250)
    assert len(fallen(case, flown(case))) == 0, case.words


@pytest.mark.long
@pytest.mark.parametrize(("family", "seed", "rebound", "row"), FALLEN)
def test_rocks_that_a_campaign_saw_fall_stay_above_the_ground(family, seed, rebound, row):
    case = case_of(family, seed, 250, rebound)
    flights = flown(case, "compiled", slice(row, row + 1))
    assert len(fallen(case, flights)) == len(guarded(flights)) == 0, case.words


@pytest.mark.long
@pytest.mark.parametrize("family", sorted(FAMILIES))
@pytest.mark.parametrize("seed", [1, 2])
def test_no_rock_released_on_a_mesh_falls_through_it_or_hangs_above_it(family, seed):
    case = case_of(family, seed, 100)
    flights = flown(case)
    assert len(fallen(case, flights)) == len(guarded(flights)) == 0, case.words
    assert len(in_the_air(case, flights)) == len(held(case, flights)) == 0, case.words


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_both_engines_agree_on_a_mesh(family):
    assert not engines_differ(case_of(family, 4, 10))


def test_the_check_sees_a_point_just_inside_the_ground_in_the_corner_under_an_overhang():
    """The overhanging face leans over the floor; the points lie 9 um from their line, across the face and the floor."""
    profile = [(-5.0, 4.0), (1.0, 4.0), (0.0, 0.0), (5.0, 0.0)]
    corners = np.array([(x, y, z) for y in (0.0, 6.0) for x, z in profile])
    facets = corners[[t for a in range(3) for t in ((a, a + 1, a + 5), (a, a + 5, a + 4))]]
    around = np.radians([10.0, 60.0, 90.0, 150.0, 200.0, 300.0])  # the face rises at 76 degrees
    points = np.array([(9e-6 * math.cos(a), 2.0, 9e-6 * math.sin(a)) for a in around])
    assert has_odd_above(facets, points).tolist() == [False, False, True, True, True, True]


@pytest.mark.parametrize("seed", [8, 192])
def test_no_rock_of_a_campaign_starts_in_the_ground_under_an_overhang(seed):
    """In mesh 192, row 170 lies on an arc through ground: 9 um inside the corner under an overhang."""
    for family in OVERHANGING:
        case = case_of(family, seed, 250)
        facets = case.terrain.vertices[case.terrain.triangles]
        assert not has_odd_above(facets, case.x, 1e-8).any(), case.words
        assert len(fallen(case, flown(case))) == 0, case.words


@BOTH
def test_a_rock_at_rest_at_a_vertex_of_the_foot_of_an_overhang_begins_to_slide(engine):
    """Without friction, the rock gains speed in more than a hundred segments of up to 1e-13 m."""
    case = case_of("overhangs", 27, 250, "coulomb_limited")
    flights = flown(case, engine, slice(10, 11))
    assert case.flight.materials.mu[0] == 0.0
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert fallen(replace(case, x=case.x[10:11], v=case.v[10:11]), flights).tolist() == []


def test_the_check_sees_a_rock_below_the_ground_and_one_that_hangs_above_it():
    case, stopped = case_of("steps", 1, 20), 3
    flights = flown(case)
    flights.deposits.outcome[stopped] = Outcome.STOPPED
    centre = case.terrain.vertices[case.terrain.triangles[5]].mean(axis=0)
    above = np.array([0.0, 0.0, 100.0 * DEEP])
    flights.deposits.x[stopped] = centre - above
    assert stopped in fallen(case, flights)
    flights.deposits.x[stopped] = centre + above
    assert stopped in in_the_air(case, flights)
    assert stopped not in fallen(case, flights)


def test_the_check_sees_a_gully_that_holds_a_rock_too_early():
    """In this invented path, a rock slides down the wall y = z / 2 to the upright wall y = 0 and on along their line.

    With R_n = 1 it would leave the gully at 0.8 m/s across, the speed of its arrival, so the gully must not hold it.
    """
    walls = np.array([[(-5, 0, 0), (5, 0, 0), (5, 2, 4)], [(-5, 0, 0), (5, 0, 5), (5, 0, 0)]], dtype=float)
    down, line = (0.6, -0.8 * math.sqrt(0.2), -1.6 * math.sqrt(0.2)), (0.6, 0.0, 0.0)
    paths = Paths(
        row=np.zeros(4, np.int64),
        t=np.array([0.0, 1.0, 1.0, 2.0]),
        x=np.array([np.negative(down) + line, line, line, np.add(line, line)]),
        v=np.array([down, down, line, line]),
        v_end=np.array([down, down, line, line]),
        mode=np.array([Mode.SLIDING, Mode.FLIGHT, Mode.SLIDING, Mode.END]),
    )
    by_hand = SimpleNamespace(paths=paths, impacts=SimpleNamespace(row=np.zeros(0), t=np.zeros(0)))
    assert held_too_early(walls, by_hand, Settings(), 1.0).tolist() == [0]
    assert held_too_early(walls, by_hand, Settings(), 0.0).tolist() == []
