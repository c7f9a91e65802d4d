"""The data with which a track is followed: the terrain below the track, and the memory for the rock's visits."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.hazard.walks.ground import WalkedTerrain
from rpf3d_core.hazard.walks.tracks import Track, time_at, top_speed2
from rpf3d_core.hazard.walks.visits import Visits, empty_visits, note_track_energy, visit_for
from rpf3d_core.jit.dispatch import kernel

ROOM = 4096
"""Largest number of facets below the part of a track over one bucket; a usual terrain has about a dozen."""


class Spans(NamedTuple):
    """Working memory for up to M facets below the part of a track over one bucket.

    facet : (M,) numbers of the facets
    times : (M, 3) for each facet, the times (s) at which the track enters and leaves it, and the largest height (m) of
        the rock above it
    cuts : (2 M,) all times at which the track enters or leaves a facet, ascending (s)
    """

    facet: Any
    times: Any
    cuts: Any


class Scratch(NamedTuple):
    """Working memory of one thread that counts rocks.

    squares, facets, zones, areas : visits to map cells, facets, zones and areas of interest
    spans : memory for the facets below a part of a track
    """

    squares: Visits
    facets: Visits
    zones: Visits
    areas: Visits
    spans: Spans


class Walk(NamedTuple):
    """One track of a rock, the terrain below it, and the memory for the rock's visits.

    mass : of the rock (kg)
    """

    ground: WalkedTerrain
    scratch: Scratch
    track: Track
    mass: float


def empty_spans() -> Spans:
    """Return empty working memory for the facets below the part of a track over one bucket."""
    return Spans(facet=np.empty(ROOM, dtype=np.int64), times=np.empty((ROOM, 3)), cuts=np.empty(2 * ROOM))


def with_more_room(scratch: Scratch) -> Scratch:
    """Return empty working memory for twice as many visits as `scratch`, because the visits of one rock did not fit."""
    squares, facets, zones, areas = (
        empty_visits(
            len(visits.mark),
            2 * len(visits.cell),
            visits.way is not None,
            visits.energy2 is not None,
            visits.rock is not None,
            visits.times is not None,
        )
        for visits in (scratch.squares, scratch.facets, scratch.zones, scratch.areas)
    )
    return Scratch(squares=squares, facets=facets, zones=zones, areas=areas, spans=scratch.spans)


@kernel
def visit_facet(walk: Walk, f: int, low: float, high: float, height: float) -> None:
    """Record a visit to facet f, and its zone, between two times of the track (s).

    low, high : the two times; height : largest height of the rock above the facet, m
    """
    track, facets, zones = walk.track, walk.scratch.facets, walk.scratch.zones
    speed2, t, until = top_speed2(track, low, high), time_at(track, low), time_at(track, high)
    k = visit_for(facets, f, t, until, speed2, height, walk.mass)
    note_track_energy(facets.energy2, k, track, low, high)
    k = visit_for(zones, walk.ground.facets.zone[f], t, until, speed2, height, walk.mass)
    note_track_energy(zones.energy2, k, track, low, high)
