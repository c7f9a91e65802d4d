"""Collect the visits of flown rocks, one rock after another, to map cells, facets, zones and areas of interest."""

import math
from typing import Any

from rpf3d_core.hazard.areas import Areas, contains_point, walk_areas
from rpf3d_core.hazard.flown import FlownRocks
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.along_sheet import NOWHERE, walk_sheet
from rpf3d_core.hazard.walks.buckets import walk_buckets
from rpf3d_core.hazard.walks.ground import WalkedTerrain
from rpf3d_core.hazard.walks.raster import walk_raster
from rpf3d_core.hazard.walks.tracks import square_at, track_of, tracks_of
from rpf3d_core.hazard.walks.visits import (
    DEPOSITS,
    FULL,
    HEIGHT,
    IMPACTS,
    OF_ROCK,
    USED,
    Visits,
    next_rock,
    note_count,
    note_energy2,
    note_stay,
    take_back,
    visit,
)
from rpf3d_core.hazard.walks.walk import Scratch, Walk
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.values import Outcome

STOPPED, CAUGHT, FAILED = int(Outcome.STOPPED), int(Outcome.CAUGHT), int(Outcome.FAILED)


@loop
def visit_all(
    ground: WalkedTerrain, areas: Areas, scratch: Scratch, flown: FlownRocks, begin: int, heights: Any
) -> int:
    """Collect the visits of flown rocks, from number `begin` on.

    Return the number of the first rock whose visits did not fit into `scratch`, or N if all fitted.
    heights : (N,) m, receives the largest height of each rock above the terrain; NaN for a failed rock
    """
    counts, impacts, first = flown.counts, flown.impacts, flown.first
    for r in range(begin, len(heights)):
        _next_rock(scratch, r)
        if counts[r, 0] == FAILED:
            heights[r] = math.nan  # a failed rock is in no map
            continue
        q, at = first[r, 0], NOWHERE
        for p in range(first[r, 1], first[r + 1, 1] - 1):
            at = _walk_piece(ground, areas, scratch, flown, r, p, at)
            while q < first[r + 1, 0] and impacts[q, 0] <= flown.pieces[p + 1, 0]:
                if flown.facets[q] >= 0:  # obstacles are skipped: the flights before and after them count
                    _note_impact(ground, areas, scratch, flown, r, q)
                q += 1
        _come_to_rest(ground, areas, scratch, flown, r)
        if not _fits(scratch):
            return r
        heights[r] = _largest_height(scratch.zones)
    return len(heights)


@kernel
def _next_rock(scratch: Scratch, r: int) -> None:
    """Begin the visits of a new rock, in row r of its batch, to all kinds of cells."""
    next_rock(scratch.squares, r)
    next_rock(scratch.facets, r)
    next_rock(scratch.zones, r)
    next_rock(scratch.areas, r)


@kernel
def _fits(scratch: Scratch) -> bool:
    """Return True if `scratch` had room for all visits of the current rock; otherwise remove all of its visits."""
    full = scratch.squares.state[FULL] + scratch.facets.state[FULL]
    if full + scratch.zones.state[FULL] + scratch.areas.state[FULL] == 0:
        return True
    take_back(scratch.squares)
    take_back(scratch.facets)
    take_back(scratch.zones)
    take_back(scratch.areas)
    return False


@kernel
def _of_pieces(spins: Any) -> Any:
    """Return twice the rotational energy per mass (S, 2), m^2/s^2, at both ends of path segments; None without spin.

    spins : `ensemble.spin.Spins` of the flown rocks; None if rocks do not spin
    """
    if spins is None:
        return None
    return spins.pieces


@kernel
def _note_impact_energy(visits: Visits, k: int, spins: Any, q: int, speed2: float) -> None:
    """Record in visit k the energy, with rotation, just before the impact in row q; do nothing if rocks do not spin.

    speed2 : squared speed before the impact (m^2/s^2)
    spins : `ensemble.spin.Spins` of the flown rocks; None if rocks do not spin
    """
    if spins is None:
        return
    note_energy2(visits.energy2, k, speed2 + spins.impacts[q])


@kernel
def _walk_piece(
    ground: WalkedTerrain, areas: Areas, scratch: Scratch, flown: FlownRocks, r: int, p: int, at: int
) -> int:
    """Record visits to all cells that segment p of the path of rock r passes over.

    at : the facet over which the segment may begin, NOWHERE if unknown
    Returns the facet below the end of the segment, NOWHERE if unknown.
    """
    pieces, modes, spins, mass = flown.pieces, flown.modes, _of_pieces(flown.spins), flown.mass[r]
    count = tracks_of(pieces, modes, p)
    for k in range(count):
        track = track_of(pieces, modes, spins, p, k, count, flown.gravity)
        walk_raster(ground.raster, scratch.squares, track, mass)
        at = _walk_facets(Walk(ground=ground, scratch=scratch, track=track, mass=mass), at)
        walk_areas(areas, scratch.areas, track, mass)
    return at


@kernel
def _walk_facets(walk: Walk, at: int) -> int:
    """Record visits to all facets that a track passes over: without search where possible, else with search.

    at : the facet over which the track may begin, NOWHERE if unknown
    Returns the facet below the end of the track, NOWHERE if unknown.
    """
    at, walked = walk_sheet(walk, at)
    if at == NOWHERE:
        walk_buckets(walk, walked)
    return at


@kernel
def _square(raster: Raster, x: float, y: float) -> int:
    """Return the number of the map cell that contains the place x, y (m) in plan."""
    i = square_at(x, raster.x, raster.cell, raster.nx)
    return square_at(y, raster.y, raster.cell, raster.ny) * raster.nx + i


@kernel
def _note_impact(ground: WalkedTerrain, areas: Areas, scratch: Scratch, flown: FlownRocks, r: int, q: int) -> None:
    """Count the impact of rock r in row q of the impacts, in the map cell, facet, zone and areas where it happened.

    A vertical facet is visited by impacts only, not by rocks that pass it.
    """
    impacts, spins, facet, mass = flown.impacts, flown.spins, flown.facets[q], flown.mass[r]
    t, speed2 = impacts[q, 0], impacts[q, 7] * impacts[q, 7]
    x = (impacts[q, 1], impacts[q, 2], impacts[q, 3])
    k = visit(scratch.squares, _square(ground.raster, x[0], x[1]), t, mass)
    note_stay(scratch.squares, k, t, t, speed2)
    note_count(scratch.squares, k, IMPACTS)
    _note_impact_energy(scratch.squares, k, spins, q, speed2)
    k = visit(scratch.facets, facet, t, mass)
    note_stay(scratch.facets, k, t, t, speed2)
    note_count(scratch.facets, k, IMPACTS)
    _note_impact_energy(scratch.facets, k, spins, q, speed2)
    k = visit(scratch.zones, ground.facets.zone[facet], t, mass)
    note_stay(scratch.zones, k, t, t, speed2)
    note_count(scratch.zones, k, IMPACTS)
    _note_impact_energy(scratch.zones, k, spins, q, speed2)
    for a in range(len(areas.boxes)):
        if contains_point(areas, a, x):
            k = visit(scratch.areas, a, t, mass)
            note_stay(scratch.areas, k, t, t, speed2)
            note_count(scratch.areas, k, IMPACTS)
            _note_impact_energy(scratch.areas, k, spins, q, speed2)


@kernel
def _come_to_rest(ground: WalkedTerrain, areas: Areas, scratch: Scratch, flown: FlownRocks, r: int) -> None:
    """Record a visit to the map cell in which the path of rock r ends.

    If the rock stopped or was caught by a barrier, also count a deposit in this cell, and in the facet, zone and areas.
    """
    outcome, facet, final, mass = flown.counts[r, 0], flown.counts[r, 1], flown.finals[r], flown.mass[r]
    t, x = final[0], (final[1], final[2], final[3])
    k = visit(scratch.squares, _square(ground.raster, x[0], x[1]), t, mass)
    note_stay(scratch.squares, k, t, t, 0.0)
    if outcome != STOPPED and outcome != CAUGHT:
        return
    note_count(scratch.squares, k, DEPOSITS)
    if facet >= 0:
        note_count(scratch.facets, visit(scratch.facets, facet, t, mass), DEPOSITS)
        note_count(scratch.zones, visit(scratch.zones, ground.facets.zone[facet], t, mass), DEPOSITS)
    for a in range(len(areas.boxes)):
        if contains_point(areas, a, x):
            note_count(scratch.areas, visit(scratch.areas, a, t, mass), DEPOSITS)


@kernel
def _largest_height(visits: Visits) -> float:
    """Return the largest height (m) above the terrain in all visits of the current rock, at least 0."""
    height = 0.0
    for k in range(visits.state[OF_ROCK], visits.state[USED]):
        height = max(height, visits.most[k, HEIGHT])
    return height
