"""Gather what rock after rock does in each cell that it comes to: squares, facets, zones and areas of interest."""

import math
from typing import Any, NamedTuple

from rpf3d_core.hazard.areas import Areas, contains_point, walk_areas
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.along_sheet import NOWHERE, walk_sheet
from rpf3d_core.hazard.walks.buckets import Spans, walk_buckets
from rpf3d_core.hazard.walks.ground import WalkedTerrain
from rpf3d_core.hazard.walks.raster import walk_raster
from rpf3d_core.hazard.walks.tracks import Track, square_at, track_of, tracks_of
from rpf3d_core.hazard.walks.visits import (
    DEPOSITS,
    FULL,
    HEIGHT,
    IMPACTS,
    OF_ROCK,
    USED,
    Visits,
    empty_visits,
    next_rock,
    note_count,
    note_energy2,
    note_stay,
    take_back,
    visit,
)
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.values import Outcome

STOPPED, CAUGHT, FAILED = int(Outcome.STOPPED), int(Outcome.CAUGHT), int(Outcome.FAILED)


class Scratch(NamedTuple):
    """What one thread needs to look at rocks: visits to squares, facets, zones and areas, and spans."""

    squares: Visits
    facets: Visits
    zones: Visits
    areas: Visits
    spans: Spans


def with_more_room(scratch: Scratch) -> Scratch:
    """Scratch with twice the room, for a rock that goes to more cells than there was room for."""
    squares, facets, zones, areas = (
        empty_visits(len(visits.mark), 2 * len(visits.cell), visits.way is not None, visits.energy2 is not None)
        for visits in (scratch.squares, scratch.facets, scratch.zones, scratch.areas)
    )
    return Scratch(squares, facets, zones, areas, scratch.spans)


@loop
def visit_all(
    ground: WalkedTerrain, areas: Areas, scratch: Scratch, gravity: float, counts: Any, finals: Any, impacts: Any,
    facets: Any, pieces: Any, modes: Any, first: Any, mass: Any, spins: Any, begin: int, heights: Any,
) -> int:  # fmt: skip
    """Gather the visits of rock after rock from number `begin` on; the number of the first that found no room.

    Rows of the record begin at first[r, 0] for the impacts and at first[r, 1] for the pieces of rock r. spins : as of
    `ensemble.spin.spins_squared`; None where rocks do not spin
    """
    for r in range(begin, len(heights)):
        _next_rock(scratch)
        if counts[r, 0] == FAILED:
            heights[r] = math.nan  # and nothing of it in any map
            continue
        q, at = first[r, 0], NOWHERE
        for p in range(first[r, 1], first[r + 1, 1] - 1):
            at = _walk_piece(ground, areas, scratch, pieces, modes, _of_pieces(spins), p, gravity, mass[r], at)
            while q < first[r + 1, 0] and impacts[q, 0] <= pieces[p + 1, 0]:
                if facets[q] >= 0:  # an obstacle is no ground: the flights before and after it tell of it
                    _note_impact(ground, areas, scratch, impacts, spins, q, facets[q], mass[r])
                q += 1
        _come_to_rest(ground, areas, scratch, counts[r, 0], counts[r, 1], finals[r], mass[r])
        if not _fits(scratch):
            return r
        heights[r] = _largest_height(scratch.zones)
    return len(heights)


@kernel
def _next_rock(scratch: Scratch) -> None:
    next_rock(scratch.squares)
    next_rock(scratch.facets)
    next_rock(scratch.zones)
    next_rock(scratch.areas)


@kernel
def _fits(scratch: Scratch) -> bool:
    """Whether the rock at hand found room everywhere; if not, it has been nowhere yet."""
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
    """What the spins of the pieces of paths add to squared speeds; None where rocks do not spin."""
    if spins is None:
        return None
    return spins.pieces


@kernel
def _note_impact_energy(visits: Visits, k: int, spins: Any, q: int, speed2: float) -> None:
    """Note the energy that impact q came with, in a visit; nothing where rocks do not spin."""
    if spins is None:
        return
    note_energy2(visits.energy2, k, speed2 + spins.impacts[q])


@kernel
def _walk_piece(
    ground: WalkedTerrain, areas: Areas, scratch: Scratch, pieces: Any, modes: Any, spins: Any, p: int, gravity: float,
    mass: float, at: int,
) -> int:  # fmt: skip
    """Visit all that one piece of path passes over; the facet it ends over, from the one it may begin over."""
    count = tracks_of(pieces, modes, p)
    for k in range(count):
        track = track_of(pieces, modes, spins, p, k, count, gravity)
        walk_raster(ground.raster, scratch.squares, track, mass)
        at = _walk_facets(ground, scratch, track, mass, at)
        walk_areas(areas, scratch.areas, track, mass)
    return at


@kernel
def _walk_facets(ground: WalkedTerrain, scratch: Scratch, track: Track, mass: float, at: int) -> int:
    """Visit all facets that a track passes over: over their sides as far as that goes, then bucket by bucket."""
    squares, facets, zones = scratch.squares, scratch.facets, scratch.zones
    at, walked = walk_sheet(ground, squares, facets, zones, track, mass, at)
    if at == NOWHERE:
        walk_buckets(ground, scratch.spans, squares, facets, zones, track, mass, walked)
    return at


@kernel
def _square(raster: Raster, x: float, y: float) -> int:
    """The number of the square that a point lies in."""
    i = square_at(x, raster.x, raster.cell, raster.nx)
    return square_at(y, raster.y, raster.cell, raster.ny) * raster.nx + i


@kernel
def _note_impact(
    ground: WalkedTerrain, areas: Areas, scratch: Scratch, impacts: Any, spins: Any, q: int, facet: int,
    mass: float,
) -> None:  # fmt: skip
    """Count an impact where it is; a vertical facet is visited by nothing else."""
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
def _come_to_rest(
    ground: WalkedTerrain, areas: Areas, scratch: Scratch, outcome: int, facet: int, final: Any, mass: float
) -> None:
    """Count a rock that has stopped, where it lies; and one that never moved, where it was released."""
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
    """The largest height in the visits of the rock at hand (m)."""
    height = 0.0
    for k in range(visits.state[OF_ROCK], visits.state[USED]):
        height = max(height, visits.most[k, HEIGHT])
    return height
