"""Tests of patches that are joined to a terrain."""

from dataclasses import replace

import numpy as np
import pytest
from flights.scenes_of_facets import flight, fly, surface
from live_sites.surveyed_hills import EAST, NORTH, cloud, corner_sets, edge_counts, grid, live_facets, mesh

from rpf3d_core.ensemble.flights import given_columns
from rpf3d_core.errors import TerrainError
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey
from rpf3d_core.simulation.engines import Compiled
from rpf3d_core.terrain.facets import facets_of

ABOVE = 60.0
"""Height (m) above all terrain of these tests."""

PATCHES = {
    "beside the lines of the ground": grid(10, 12, 12.37, 9.21, seed=1),
    "on the points of the ground": grid(10, 12, 12.0, 9.0, seed=1),
    "turned": grid(14, 14, 15.3, 8.2, seed=1, turned=0.6),
    "turned over": GridSurvey(grid(10, 12, 12.37, 9.21, seed=1).points[::-1].copy()),
    "finer": grid(40, 40, 12.37, 9.21, step=0.25, seed=1),
    "coarser": grid(4, 4, 10.37, 9.21, step=6.0, seed=1),
    "smaller than a facet": grid(3, 3, 12.31, 9.22, step=0.05, seed=1),
    "a cloud": cloud(300, 12.37, 9.21, 14.0, seed=1),
}
INSIDE = pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES.keys())


def patched(patch, survey=None):
    workshop = Workshop()
    ground = workshop.whole(survey or grid())
    before = edge_counts(ground)
    return workshop.patched(ground, patch), before


def covered(ground, shrink=0.0):
    """Return places (N, 3) m at the height ABOVE over all facets of a terrain, dense near their corners."""
    facets = np.asarray(ground.facets.corners)[live_facets(ground)].reshape(-1, 3, 3)
    weights = np.random.default_rng(0).dirichlet((0.4, 0.4, 0.4), (4, len(facets)))
    places = np.einsum("nfk,fkx->nfx", weights, facets).reshape(-1, 3)
    return places * (1, 1, 0) + (0, 0, ABOVE)


def sheets(ground):
    """Return the number of facets below each of the places `covered` (N,); places on edges do not count."""
    places = covered(ground)
    corners = np.asarray(ground.facets.corners)[live_facets(ground)]
    count = np.zeros(len(places), int)
    for a in corners.reshape(-1, 3, 3):
        near = np.flatnonzero((np.abs(places[:, :2] - a[0, :2]) <= np.ptp(a[:, :2], axis=0)).all(axis=1))
        x, y = places[near, 0], places[near, 1]
        sides = [
            (b[0] - c[0]) * (y - c[1]) - (b[1] - c[1]) * (x - c[0]) for c, b in zip(a, np.roll(a, -1, 0), strict=True)
        ]
        count[near] += np.min(sides, axis=0) > 1e-9
    return count


def over_ground(ground, places):
    """Return whether there is ground below all places (m east and north of the corner of the hills)."""
    x = np.array([[EAST + east, NORTH + north, 0.0] for east, north in places]) - np.array(ground.terrain.frame.origin)
    x[:, 2] = ABOVE
    return bool((ground.engine.ground_below(x)[:, 1] >= 0).all())


@pytest.mark.long
@INSIDE
def test_the_seam_is_closed_without_t_junctions(patch):
    ground, before = patched(patch)
    assert edge_counts(ground) == before


@pytest.mark.long
@INSIDE
def test_the_patched_ground_is_still_one_sheet_in_plan(patch):
    ground, _ = patched(patch)
    assert sheets(ground).max() == 1
    assert (ground.facets.normals[live_facets(ground), 2] > 0.0).all()


@INSIDE
def test_the_patch_lies_in_the_ground_as_it_was_surveyed(patch):
    ground, _ = patched(patch)
    points = patch.points.reshape(-1, 3) - np.array(ground.terrain.frame.origin)
    below = ground.engine.ground_below(points + np.array([0, 0, 30.0]))
    assert np.allclose(below[:, 0], 30.0, atol=1e-9)


@INSIDE
def test_facets_that_the_footprint_does_not_touch_keep_every_bit(patch):
    workshop = Workshop()
    ground = workshop.whole(grid())
    low, high = (patch.points.reshape(-1, 3)[:, :2].min(0), patch.points.reshape(-1, 3)[:, :2].max(0))
    plan = np.asarray(ground.facets.corners).reshape(-1, 3, 3)[..., :2] + np.array(ground.terrain.frame.origin[:2])
    apart = ((plan.min(axis=1) > high + 1e-6) | (plan.max(axis=1) < low - 1e-6)).any(axis=1)
    kept = corner_sets(ground, np.flatnonzero(apart))
    after = workshop.patched(ground, patch)
    assert len(kept) > 100
    assert kept <= corner_sets(after, live_facets(after))


def rocks(ground, seed, count=400):
    rng = np.random.default_rng(seed)
    x = covered(ground)
    x = x[rng.integers(0, len(x), count)]
    height = ground.engine.ground_below(x)[:, 0]
    x[:, 2] -= height - rng.uniform(0.5, 6.0, count)
    return x, rng.normal(0.0, 6.0, (count, 3))


def bits_of(flights):
    """Return all columns of the flights' tables except the facet numbers."""
    return [
        array
        for name in ("deposits", "impacts", "paths")
        for key, array in given_columns(getattr(flights, name)).items()
        if key != "facet"
    ]


def made_anew(ground):
    """Return a new compiled engine for the same facets in another order, with a new index."""
    some = live_facets(ground)[::-1]
    triangles, zone = ground.terrain.triangles[some].copy(), ground.terrain.zone[some].copy()
    terrain = replace(ground.terrain, triangles=triangles, zone=zone)
    return Compiled(facets_of(terrain)._replace(tolerance=ground.facets.tolerance, crack=ground.facets.crack))


def flown(ground, engine, seed):
    return fly(engine, flight(surface()), *rocks(ground, seed))


@INSIDE
def test_flights_are_those_over_the_same_facets_made_whole_to_the_last_bit(patch):
    ground, _ = patched(patch)
    anew = made_anew(ground)
    ours, theirs = (bits_of(flown(ground, engine, 3)) for engine in (ground.engine, anew))
    assert ground.facets[4:] == anew.facets[4:]
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(ours, theirs, strict=True))


@pytest.mark.long
def test_hundred_patches_upon_each_other_leave_a_closed_sheet_and_the_same_flights():
    workshop, rng = Workshop(), np.random.default_rng(5)
    ground = workshop.whole(grid())
    before = edge_counts(ground)
    for k in range(100):
        east, north, turned = rng.uniform(6.0, 26.0), rng.uniform(6.0, 22.0), rng.uniform(-0.4, 0.4)
        step = rng.choice([0.4, 1.0, 1.7])
        size = rng.integers(2, 8)
        ground = workshop.patched(ground, grid(size, size + 1, east, north, step=step, seed=k, turned=turned), k)
        assert edge_counts(ground) == before, k
    assert sheets(ground).max() == 1
    anew = made_anew(ground)
    ours, theirs = (bits_of(flown(ground, engine, 3)) for engine in (ground.engine, anew))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(ours, theirs, strict=True))
    assert ground.patches == 100


@pytest.mark.long
def test_a_patch_upon_one_that_has_outgrown_its_memory_replaces_it_whole():
    workshop = Workshop()
    ground = workshop.whole(grid())
    before, memory = edge_counts(ground), ground.room.memory.longer("marks", 1).base
    ground = workshop.patched(ground, grid(80, 80, 8.37, 6.21, step=0.2, seed=1))
    assert ground.room.memory.longer("marks", 1).base is not memory
    ground = workshop.patched(ground, grid(16, 16, 8.37, 6.21, seed=2))
    assert edge_counts(ground) == before and sheets(ground).max() == 1
    anew = made_anew(ground)
    ours, theirs = (bits_of(flown(ground, engine, 3)) for engine in (ground.engine, anew))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(ours, theirs, strict=True))


@pytest.mark.parametrize("heading", [(1.0, 0.0), (0.0, 1.0), (0.8, 0.6)])
def test_no_rock_falls_through_the_seam_flown_along_and_across(heading):
    ground, _ = patched(PATCHES["on the points of the ground"])
    corners = np.asarray(ground.facets.corners).reshape(-1, 3, 3)
    edges = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
    plan = edges[..., :2] + np.array(ground.terrain.frame.origin[:2])
    near = ((plan > (EAST + 10, NORTH + 7)) & (plan < (EAST + 25, NORTH + 20))).all(axis=(1, 2))
    points = np.concatenate([edges[near].mean(axis=1), edges[near][:, 0]])
    below = ground.engine.ground_below(points + np.array([0, 0, 20.0]))
    assert (below[:, 1] >= 0).all()
    x, v = points + np.array([0, 0, 1e-3]), np.tile(np.array([*heading, 0.0]) * 8.0, (len(points), 1))
    flights = fly(ground.engine, flight(surface()), x, v)
    assert (flights.deposits.x[:, 2] > corners[..., 2].min() - 1.0).all()


def test_a_patch_over_the_rim_of_the_terrain_is_joined_where_there_is_ground():
    ground, _ = patched(grid(20, 14, 36.4, 9.3, seed=1))
    assert sheets(ground).max() == 1
    assert edge_counts(ground)[1] == 0
    inner = [[36.1, 15.0], [44.0, 15.0], [48.0, 20.0], [35.9, 20.0]]
    assert over_ground(ground, inner)
    anew = made_anew(ground)
    assert ground.facets[4:] == anew.facets[4:]


def test_a_patch_just_inside_the_rim_leaves_the_strip_outside_it():
    ground, _ = patched(grid(38, 42, 0.7, 0.7, seed=1))
    rim = [[0.05, 20.0], [42.95, 20.0], [20.0, 0.05], [20.0, 38.95]]
    assert over_ground(ground, rim)
    assert edge_counts(ground) == (2 * (39 + 43), 0)


def test_a_patch_that_covers_everything_is_a_whole_survey():
    patch = grid(60, 60, -5.0, -5.0, seed=2)
    ground, _ = patched(patch)
    assert ground.digest == Workshop().whole(patch).digest
    assert ground.patches == 0


def test_a_large_hole_of_the_patch_leaves_the_ground_that_was_there():
    survey, patch = grid(), grid(20, 20, 10.3, 9.2, seed=1)
    patch.points[5:15, 5:15] = np.nan
    ground, before = patched(patch, survey)
    assert edge_counts(ground) == before
    node = survey.points[19, 20] - np.array(ground.terrain.frame.origin)
    assert ground.engine.ground_below(node[None] + (0, 0, 9.0))[0, 0] == pytest.approx(9.0, abs=1e-9)


def test_a_small_hole_of_the_patch_is_closed():
    patch = grid(20, 20, 10.3, 9.2, seed=1)
    patch.points[9, 9] = patch.points[14, 5:8] = np.nan
    ground, before = patched(patch)
    assert edge_counts(ground) == before
    assert sheets(ground).max() == 1


@pytest.mark.long
def test_the_patch_may_come_over_a_mesh_with_walls_and_overhangs_beneath_it():
    survey = mesh(grid())
    vertices = survey.vertices.reshape(40, 44, 3)
    vertices[18:22, 20] += (1.6, 0.0, 5.0)  # leans over the next column
    workshop = Workshop()
    ground = workshop.whole(MeshSurvey(survey.vertices, survey.triangles))
    assert (ground.facets.normals[:, 2] < 0.0).any()
    after = workshop.patched(ground, grid(20, 20, 12.3, 10.2, seed=1))
    assert (after.facets.normals[live_facets(after), 2] > 0.0).all()


REFUSED = {
    "outside the terrain": (grid(5, 5, 100.0, 100.0), "outside the terrain"),
    "without a square": (GridSurvey(np.full((4, 4, 3), np.nan)), "no square"),
    "far too wide": (grid(4, 4, 20.0, 20.0, step=30.0), "far beyond the terrain"),
    "too many points": (GridSurvey(np.broadcast_to(np.zeros(3), (5_000, 10_000, 3))), "at most 5,000,000"),
    "points on a line": (CloudSurvey(np.linspace(0, 1, 9)[:, None] + np.array([EAST, NORTH, 0.0])), "no triangle"),
}


@pytest.mark.parametrize(("patch", "reason"), REFUSED.values(), ids=REFUSED.keys())
def test_a_patch_that_cannot_be_joined_is_refused_and_the_ground_is_as_it_was(patch, reason):
    workshop = Workshop()
    ground = workshop.whole(grid())
    before = [np.copy(array) for array in (ground.facets.geometry, *ground.locator[5:8], *ground.locator.slabs)]
    with pytest.raises(TerrainError, match=reason):
        workshop.patched(ground, patch)
    after = (ground.facets.geometry, *ground.locator[5:8], *ground.locator.slabs)
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
    assert workshop.patched(ground, PATCHES["turned"]).patches == 1


def test_a_patch_that_folds_over_itself_is_refused():
    patch = grid(10, 10, 12.0, 9.0)
    patch.points[5, 5, 0] += 3.0
    with pytest.raises(TerrainError, match="folds over itself"):
        patched(patch)


def test_a_rim_where_the_ground_overhangs_is_refused_and_the_ground_is_as_it_was():
    survey = mesh(grid())
    survey.vertices.reshape(40, 44, 3)[10:30, 20] += (1.7, 0.0, 5.0)
    workshop = Workshop()
    ground = workshop.whole(survey)
    before = ground.facets.geometry.copy()
    with pytest.raises(TerrainError, match="overhangs"):
        workshop.patched(ground, grid(10, 9, 13.3, 14.2, seed=1))
    assert np.array_equal(ground.facets.geometry, before)


def test_a_ground_that_has_been_patched_is_not_patched_again():
    workshop = Workshop()
    ground = workshop.whole(grid())
    workshop.patched(ground, PATCHES["turned"])
    with pytest.raises(ValueError, match="patched already"):
        workshop.patched(ground, PATCHES["turned"])


def test_the_digest_of_a_patched_ground_follows_on_that_of_the_ground():
    digests = set()
    for seed, patch in ((0, "turned"), (0, "finer"), (1, "turned")):
        workshop = Workshop()
        digests.add(workshop.patched(workshop.whole(grid(seed=seed)), PATCHES[patch]).digest)
    assert len(digests) == 3
