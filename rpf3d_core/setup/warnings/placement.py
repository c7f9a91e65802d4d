"""Warn about sources and outlines that can be used but look misplaced: high in the air, or partly off the terrain.

`wrong_coordinates.py` compares only the extents of the inputs; this module compares the inputs with the ground itself.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rpf3d_core.detection.closest import closest_facet
from rpf3d_core.ensemble.release_heights import ground_below_releases
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.setup.coverage import covered_share
from rpf3d_core.setup.prepared import Prepared, places_of, releases_in_ranges
from rpf3d_core.setup.rounds import rounds_of
from rpf3d_core.setup.warnings.source_heights import SourceHeight, heights_of
from rpf3d_core.terrain.frame import FloatArray

MOST_ABOVE = 20.0
"""Height (m) above the ground, as `highest_source` of the live simulator.

A source is suspicious if all its rocks start higher.
"""
AT_CREST = 5.0
"""Distance (m) to the nearest ground up to which a rock is at a crest, although the face's foot may be far below."""
FIRST_LOOK = 100
"""Approximate number of rocks that are checked first; if one of them is misplaced, no further rocks are checked."""
MOSTLY = 0.5
"""Smallest share (-) of a source's rocks at a crest for which the source is at a crest."""
MOST_TRIED = 500
"""Approximate number of rocks of a source for which the nearest ground is searched in all directions."""
WHOLE = 0.99
"""Smallest share (-) of an outline's area on the terrain without a warning; below 1, because users draw roughly."""


def rocks_of_sources(prepared: Prepared) -> list[int]:
    """Return the number of rocks of each source in the first round: all rocks, unless the scene has `rocks: auto`."""
    return list(rounds_of(prepared.scene, places_of(prepared))[0].last)


def some_releases(prepared: Prepared, most: int) -> Releases:
    """Return the releases of at most about `most` rocks of the first round, evenly spread over each source."""
    rocks = rocks_of_sources(prepared)
    every = max(1, -(-sum(rocks) // most))
    steps = [_step_over(places, every) for places in places_of(prepared)]
    return releases_in_ranges(prepared, [range(0, its, step) for its, step in zip(rocks, steps, strict=True)])


def _step_over(places: int, every: int) -> int:
    """Return the step between the numbers of a source's chosen rocks, for which these rocks use all release points.

    Rocks use the release points in turn, so the step has no common divisor with the number of release points.

    places : number of release points of the source; every : smallest step
    """
    while math.gcd(places, every) > 1:
        every += 1
    return every


def looked_at(prepared: Prepared, most: int) -> tuple[Releases, list[SourceHeight]]:
    """Return the releases of about `most` rocks, and the start heights of each source's rocks above the terrain.

    First, about FIRST_LOOK rocks are checked. If one of these rocks is under the ground or off the terrain, the result
    has only these rocks, because the search for the ground is a hundred times slower if none is below a rock.
    """
    for number in (FIRST_LOOK, most):
        releases = some_releases(prepared, number)
        heights = source_heights(prepared, releases)
        if any(source.under_ground or source.off_terrain for source in heights):
            break
    return releases, heights


def source_heights(prepared: Prepared, releases: Releases) -> list[SourceHeight]:
    """Return the start heights of each source's rocks above the terrain; releases : from `some_releases`."""
    names, rocks = [source.name for source in prepared.sources], rocks_of_sources(prepared)
    return heights_of(names, rocks, releases, ground_below_releases(prepared.engine, releases.x), prepared.engine)


def placement_warnings(prepared: Prepared, releases: Releases, heights: Sequence[SourceHeight]) -> list[str]:
    """Return a warning for each source in the air or with unused points, and each outline partly off the terrain.

    releases : from `some_releases`; heights : start heights of the sources, from `source_heights`
    """
    return [*_high_above(prepared, releases, heights), *_unused_points(prepared), *_partly_off(prepared)]


def _high_above(prepared: Prepared, releases: Releases, heights: Sequence[SourceHeight]) -> Iterator[str]:
    """Yield a warning for each source whose rocks all start more than MOST_ABOVE (20 m) above the ground.

    A source close to a crest gets no warning, although the ground straight below may be the foot of a high face.
    """
    for number, source in enumerate(heights):
        if not np.isfinite(source.lowest) or source.lowest <= MOST_ABOVE:
            continue
        if not _at_a_crest(prepared, releases.x[releases.source == number]):
            yield (
                f"source {source.name!r} starts {source.lowest:,.0f} m or more above the ground; are its heights "
                "right? `above_ground` is the height above the ground"
            )


def _at_a_crest(prepared: Prepared, x: FloatArray) -> bool:
    """Return True if at least the share MOSTLY of points have ground within AT_CREST (m); only some points are tested.

    x : (N, 3) m, local frame
    """
    engine = prepared.engine
    places = [(float(point[0]), float(point[1]), float(point[2])) for point in x[:: max(1, len(x) // MOST_TRIED)]]
    near = [closest_facet(engine.locator, engine.facets, place, AT_CREST).facet >= 0 for place in places]
    return float(np.mean(near)) >= MOSTLY


def _unused_points(prepared: Prepared) -> Iterator[str]:
    """Yield a warning for each source with fewer rocks than release points, so that some points are not used."""
    for source, places, its in zip(prepared.sources, places_of(prepared), rocks_of_sources(prepared), strict=True):
        if 0 < its < places:
            yield f"source {source.name!r} uses {its:,} of its {places:,} points, because it has no more rocks"


def _partly_off(prepared: Prepared) -> Iterator[str]:
    """Yield a warning for each outline of a source or an area of interest that reaches beyond the terrain.

    A part over a hole counts as beyond the terrain.
    """
    outlines = {f"the area of interest {name!r}": area for name, area in prepared.polygons.items()}
    outlines |= {f"the polygon of source {name!r}": area for name, area in prepared.source_polygons.items()}
    for name, polygons in outlines.items():
        share = covered_share(prepared.terrain, polygons)
        if share < WHOLE:
            part = f"{100.0 * share:.0f} % of {name} lies on the terrain"
            yield f"{part}; the other part lies outside the terrain or over a hole"
