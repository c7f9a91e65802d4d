"""Tests that data kept after a patch equal those of a new search, and answers have the same bits."""

from itertools import count, islice

import numpy as np
import pytest
from live_sites.surveyed_hills import EAST, NORTH, cloud, grid, live_facets

from rpf3d_core.hazard.walks.sheet import UNKNOWN, facet_beyond, is_alone, unknown_sheet
from rpf3d_core.live.answers import EnsembleSize, answers
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import stand_after, stand_on
from rpf3d_core.live.triggers import trigger_of

pytest.importorskip("numba", reason="numba is not installed: nothing is kept for the reference engine")

PATCHES = {
    "inside": grid(10, 12, 12.37, 9.21, seed=1),
    "finer, so that there are more facets": grid(40, 40, 12.37, 9.21, step=0.25, seed=1),
    "coarser": grid(4, 4, 10.37, 9.21, step=6.0, seed=1),
    "turned": grid(14, 14, 15.3, 8.2, seed=1, turned=0.6),
    "a cloud": cloud(300, 12.37, 9.21, 14.0, seed=1),
    "at the rim": grid(10, 12, 0.0, 9.21, seed=1),
}
EACH = pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES.keys())


def standing_on(workshop, survey):
    return stand_on(workshop.whole(survey), live_scene({"hazard.cell": 2.0, "target.most_rocks": 800}))


def ask_everything(walked):
    """Fill the sheet: look up the neighbour beyond each side of each facet, and whether the facet is alone."""
    for f in range(len(walked.facets.zone)):
        for k in range(3):
            facet_beyond(walked.sheet, walked.locator, walked.facets, f, k)
        is_alone(walked.sheet, walked.locator, walked.facets, f)


def told(standing):
    """Return the maps of the first three stages of an answer with a prepared terrain."""
    places = np.array([[18.0, 14.0, 80.0], [14.0, 12.0, 80.0], [25.0, 25.0, 80.0]])
    places += EAST, NORTH, 0.0
    trigger = trigger_of(places, np.tile([1.0, 0.5, 0.0], (3, 1)), None, 1)
    some = answers(
        standing, trigger, ReleaseSpread(2.0, 0.5, 1.0), {}, EnsembleSize(200), lambda stage: False, count(1)
    )
    return [answer.maps for answer in islice(some, 3)]


def after(patch, survey=None):
    """Return the prepared terrain after a patch, and the number of facet sides whose neighbour is still known.

    Before the patch, all neighbours were looked up.
    """
    workshop = Workshop()
    before = standing_on(workshop, survey or grid())
    _ = told(before)
    ask_everything(before.tallies.ground)
    _ = before.cells
    standing = stand_after(before, workshop.patched(before.ground, patch))
    return standing, int((standing.tallies.ground.sheet.beyond != UNKNOWN).sum())


def known_of(standing, sheet):
    """Return the entries of a sheet for the facets that are not removed, and for the buckets, as one array."""
    live = live_facets(standing.ground)
    return np.concatenate([sheet.beyond[3 * live + k] for k in range(3)] + [sheet.alone[live], sheet.clear])


def found_anew(standing):
    """Return the same entries, found again from an empty sheet."""
    walked = standing.tallies.ground
    anew = walked._replace(sheet=unknown_sheet(walked.facets, walked.locator))
    ask_everything(anew)
    return known_of(standing, anew.sheet)


@pytest.mark.long
@EACH
def test_what_is_known_after_a_patch_is_what_is_found_anew(patch):
    standing, known = after(patch)
    kept = known_of(standing, standing.tallies.ground.sheet).copy()
    asked = kept != UNKNOWN
    assert np.array_equal(kept[asked], found_anew(standing)[asked])
    assert known > 100, "hardly anything is kept"


def test_after_a_patch_that_fills_a_hole_nothing_is_known_that_is_no_longer_so():
    coarse = grid(14, 15, step=3.0)
    coarse.points[5:8, 5:8] = np.nan
    standing, _ = after(grid(12, 12, 11.5, 11.5, step=1.15, seed=1), coarse)
    kept = known_of(standing, standing.tallies.ground.sheet).copy()
    asked = kept != UNKNOWN
    assert np.array_equal(kept[asked], found_anew(standing)[asked])


@EACH
def test_answers_after_a_patch_are_those_over_the_same_ground_stood_on_anew(patch):
    standing, _ = after(patch)
    for one, other in zip(told(standing), told(stand_on(standing.ground, standing.scene)), strict=True):
        a, b = one.reached_facets, other.reached_facets
        assert len(a.cell) > 0 and np.array_equal(a.cell, b.cell) and np.array_equal(a.rocks, b.rocks)
        for layers in ("cells", "zones"):
            a, b = getattr(one, layers), getattr(other, layers)
            assert len(a.cell) > 0
            assert np.array_equal(a.cell, b.cell) and np.array_equal(a.rocks, b.rocks)
            assert np.array_equal(a.energy.largest, b.energy.largest, equal_nan=True)
            assert np.array_equal(a.energy.p95, b.energy.p95, equal_nan=True)


@pytest.mark.long
@EACH
def test_threads_count_in_room_for_every_facet_there_is_after_a_patch(patch):
    standing, _ = after(patch)
    _ = told(standing)
    scratches, rows = standing.tallies.idle, len(standing.ground.facets.zone)
    assert not scratches.empty() and len(standing.tallies.reach.rocks) >= rows
    while not scratches.empty():
        assert len(scratches.get().facets.mark) >= rows


@pytest.mark.long
def test_patch_after_patch_keeps_what_is_known_of_the_rest():
    workshop = Workshop()
    standing = standing_on(workshop, grid())
    for number in range(4):
        _ = standing.cells
        patch = grid(30, 30, 10.0 + 2 * number, 9.2, step=0.3, seed=number)
        standing = stand_after(standing, workshop.patched(standing.ground, patch))
        ask_everything(standing.tallies.ground)
    assert np.array_equal(known_of(standing, standing.tallies.ground.sheet), found_anew(standing))
