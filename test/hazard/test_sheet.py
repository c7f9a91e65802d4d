"""Tests of where terrain is one sheet in plan, and that walks over facets find the same as a search in buckets."""

import dataclasses

import numpy as np
import pytest
from flights import scenes_of_facets as made
from hazards.hazard_layers import laid_out_maps
from hazards.hazard_tallied import flown, numbers, over, rough

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.hazard.walks.ground import plain_ground
from rpf3d_core.hazard.walks.sheet import CROWDED, NO, NOTHING, UNKNOWN, YES, facet_beyond, is_alone, unknown_sheet
from rpf3d_core.terrain.facets import facets_of

ON_EDGES = 0.05
"""Largest share of visits that may count for another facet at an edge or vertex, where a track is over both."""


def asked(terrain):
    """Return the facet and side beyond each side of each facet (F, 3, 2), and whether facets are alone (F,)."""
    facets = facets_of(terrain)
    locator = bucket_locator(facets)
    sheet = unknown_sheet(facets, locator)
    count = range(len(terrain.triangles))
    found = np.array([[facet_beyond(sheet, locator, facets, f, k) for k in range(3)] for f in count])
    return found, np.array([is_alone(sheet, locator, facets, f) for f in count])


def sides(terrain):
    """Return the directed edges (F, 3, 2) of the facets, as pairs of vertex indices."""
    return np.stack([terrain.triangles, np.roll(terrain.triangles, -1, axis=1)], axis=2)


def inner(terrain, margin):
    """Return (F,) whether all corners of a facet are farther than `margin` (m) inside the terrain's box in plan."""
    corners = terrain.vertices[terrain.triangles][..., :2]
    low, high = terrain.vertices[:, :2].min(axis=0) + margin, terrain.vertices[:, :2].max(axis=0) - margin
    return ((corners > low) & (corners < high)).all(axis=(1, 2))


def test_beyond_each_side_lies_the_facet_that_runs_along_it_the_other_way():
    terrain = rough()
    found, _ = asked(terrain)
    directed = {tuple(side): (f, k) for f, three in enumerate(sides(terrain)) for k, side in enumerate(three)}
    for f, three in enumerate(sides(terrain)):
        for k, (a, b) in enumerate(three):
            g, m = directed.get((b, a), (NOTHING, 0))
            assert tuple(found[f, k]) == (g, m)
    assert (found[..., 0] == NOTHING).sum() == 4 * 12, "the rim"


def test_facets_are_alone_but_for_those_near_the_rim():
    terrain = made.rough_grid(20, 20.0, 0.5, 0.5, seed=1)
    _, alone = asked(terrain)
    assert alone[inner(terrain, 3.0)].all() and not alone[~inner(terrain, 1e-6)].any()


def test_nothing_is_alone_under_or_over_another_terrain():
    floor, slab = made.floor(10.0, cells=20), made.floor(10.0, z=5.0, cells=20)
    slab.vertices[:, 0] += 10.0
    terrain = made.joined(floor, slab)
    _, alone = asked(terrain)
    middle = terrain.vertices[terrain.triangles][..., 0].mean(axis=1)
    below = np.arange(len(middle)) < len(floor.triangles)
    assert alone[below & (middle < -2.0) & inner(terrain, 3.0)].all(), "where the floor lies bare"
    assert alone[below & (middle > 0.0)].sum() == 0 and not alone[~below & (middle < 10.0)].any()


def test_a_hole_a_flipped_facet_and_an_overhang_make_their_surroundings_unknown_ground():
    whole = made.floor(10.0, cells=20)
    at = int(np.argmin(np.abs(whole.vertices[whole.triangles].mean(axis=1)[:, :2]).sum(axis=1)))
    hole = made.without_facets(whole, at)
    flipped = dataclasses.replace(whole, triangles=whole.triangles.copy())
    flipped.triangles[at] = flipped.triangles[at, ::-1]
    folded = dataclasses.replace(whole, vertices=whole.vertices.copy())
    folded.vertices[whole.triangles[at, 0]] += (2.5, 0.0, 1.0)
    for terrain in (hole, flipped, folded):
        _, alone = asked(terrain)
        near = np.abs(terrain.vertices[terrain.triangles].mean(axis=1)[:, :2]).max(axis=1)
        assert not alone[near < 1.0].any()
        assert alone[(near > 6.0) & inner(terrain, 2.0)].all()


def test_a_spiral_ramp_over_itself_is_alone_nowhere():
    """The ramp makes two turns about a column, so nearly every place in plan has two facets."""
    turns, steps, rows = 2, 96, 8
    angle = np.linspace(0.0, 2.0 * np.pi * turns, turns * steps + 1)
    radius = np.linspace(4.0, 12.0, rows + 1)
    x, y = (np.outer(f(angle), radius).ravel() for f in (np.cos, np.sin))
    z = np.repeat(angle, rows + 1)
    terrain = made.terrain_of(np.column_stack([x, y, z]), made.grid_triangles(turns * steps, rows))
    _, alone = asked(terrain)
    assert not alone.any()


@pytest.mark.parametrize("model", ["none", "sliding"])
def test_walking_from_facet_to_facet_finds_what_buckets_find(model):
    terrain = rough()
    walked, searched = over(terrain), over(terrain)
    searched.ground.sheet.alone[:] = NO
    for tallies in (walked, searched):
        flown(terrain, tallies, count=400, model=model)
    assert (walked.ground.sheet.alone == YES).sum() > 100 and (walked.ground.sheet.alone == UNKNOWN).sum() < 100
    one, other = dict(numbers(walked.maps(400, ()))), dict(numbers(searched.maps(400, ())))
    for name, values in one.items():
        percentile = name.split(".")[-1].startswith("p9") or name.endswith("p50")
        near = {"rtol": 0.1} if percentile else {"rtol": 1e-5, "atol": 1e-6}
        np.testing.assert_allclose(values, other[name], err_msg=name, **near)


def test_plain_python_asks_the_same_sheet():
    terrain = rough()
    tallies = over(terrain)
    ground, middle = plain_ground(tallies.ground), int(np.flatnonzero(inner(terrain, 6.0))[0])
    assert is_alone(ground.sheet, ground.locator, ground.facets, middle)
    assert tallies.ground.sheet.alone[middle] == YES, "what it has found out is kept in the arrays"


def test_a_fold_narrower_than_a_bucket_is_no_clear_ground():
    """The fold has no border and does not contain the middle of a bucket; only its facets that face down reveal it."""
    ticks = [(float(x), 0.0) for x in range(-10, 11)]
    fold = [(0.30, 0.05), (0.12, 0.10)]
    terrain = made.strip([*ticks[:11], *fold, *ticks[11:]], across=20)
    assert bucket_locator(facets_of(terrain)).cell == pytest.approx(1.0), "wider than the fold"
    _, alone = asked(terrain)
    x = terrain.vertices[terrain.triangles][..., 0]
    assert not alone[(x.max(axis=1) > 0.12) & (x.min(axis=1) < 0.30)].any()
    assert alone[(np.abs(x).min(axis=1) > 3.0) & inner(terrain, 3.0)].all()


@pytest.mark.parametrize("which", [0, 1])
def test_a_facet_that_is_there_twice_is_not_alone(which):
    """This holds whether or not the facet lies over the middle of its bucket."""
    whole = made.floor(10.0, cells=20)
    at = which * len(whole.triangles) // 2 + 20 * 10 + 10
    twice = np.concatenate([whole.triangles, whole.triangles[at : at + 1]])
    terrain = dataclasses.replace(whole, triangles=twice, zone=np.zeros(len(twice), dtype=np.int32))
    _, alone = asked(terrain)
    assert asked(whole)[1][at] and not alone[at] and not alone[-1]


def test_a_crowded_bucket_is_not_asked_for_pairs():
    """A fine patch over a coarse mesh puts many facets into a bucket; comparing all pairs would take seconds."""
    terrain = made.joined(made.floor(50.0, cells=10), made.floor(2.0, z=-30.0, cells=40))
    facets = facets_of(terrain)
    locator = bucket_locator(facets)
    sheet = unknown_sheet(facets, locator)
    assert np.diff(locator.starts).max() > 10 * CROWDED
    assert not is_alone(sheet, locator, facets, len(terrain.triangles) - 1)
    assert not sheet.beyond.any(), "nothing was asked"


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (0.3, 0.7)])
def test_tracks_from_vertices_and_along_edges_pass_what_buckets_find(along):
    terrain = rough()
    walked, searched = over(terrain), over(terrain)
    searched.ground.sheet.alone[:] = NO
    corners = terrain.vertices[terrain.triangles[inner(terrain, 3.0)]]
    places = np.concatenate([corners[:, 0], 0.5 * (corners[:, 0] + corners[:, 1])])
    places[:, 2] += 2.0
    physics = made.flight(made.surface(0.5, 0.9), "none")
    for tallies in (walked, searched):
        made.fly(made.engine_over("compiled", terrain), physics, places, (*along, 3.0), watch=tallies)
    one, other = (laid_out_maps(tallies.maps(len(places), ())) for tallies in (walked, searched))
    assert np.array_equal(one.cells.rocks, other.cells.rocks)
    assert np.abs(one.facets.rocks - other.facets.rocks).sum() <= ON_EDGES * one.facets.rocks.sum()
    np.testing.assert_allclose(one.cells.height.largest, other.cells.height.largest, rtol=1e-5, atol=1e-6)
