"""Release rocks for the sources of one message over a terrain.

Monitoring gives the place of a source with an error of some metres, and a rough speed. Therefore the rocks of a source
are spread around the source, and the answer includes this uncertainty.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.ensemble.release_heights import ground_below_releases
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING, Releases
from rpf3d_core.ensemble.sizes import sizes_of
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.errors import InputError
from rpf3d_core.live.standing import PreparedTerrain, density_of, mass_of
from rpf3d_core.live.triggers import Trigger
from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.terrain.frame import FloatArray

Flags = NDArray[np.bool_]

SAME_GROUND = 1e-6
"""Largest difference (m) between two heights of a source that count as equal.

The two heights are measured above the ground straight below the source, and above the highest ground at its place in
plan.
"""

MOST_NAMED = 3
"""Largest number of sources that are named one by one in a sentence."""

AT_ONCE = 16_384
"""Largest number of rocks whose releases are all computed before the first of them flies."""

Draw = Callable[[Sequence[range | IntArray], IntArray], Releases]
"""A function that returns the releases of rocks: from a range or an array of rock numbers for each of some sources."""

IN_PLAN = (Purpose.POSITION_X, Purpose.POSITION_Y)
IN_SPEED = (Purpose.VELOCITY_X, Purpose.VELOCITY_Y, Purpose.VELOCITY_Z)


@dataclass(frozen=True)
class ReleaseSpread:
    """Settings of the spread of rocks around each source: monitoring gives only a rough place and speed.

    position, velocity : half-widths of a uniform spread, m in plan and m/s in each direction
    above_ground : height above the ground (m) to which each source is moved; None to keep the height in the message
    highest : largest distance from the ground (m); a source farther away is reported as doubtful, because z may point
        down in the input
    map_origin : (east, north, height) m, survey coordinates of the origin of the map frame
    """

    position: float = 0.0
    velocity: float = 0.0
    above_ground: float | None = None
    highest: float = math.inf
    map_origin: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Released:
    """The S sources of one message, in the order of the message, and which of them release rocks.

    A source keeps its number even if other sources are left out, so the random numbers of its rocks do not change.

    places : (S, 3) m, local frame; velocities : (S, 3) m/s
    diameters : (S,) m, NaN for the size of the scene's rocks; None if all rocks have the size of the scene's rocks
    heights : (S,) m, height of each source above the highest ground at its place in plan; spread rocks start at the
        same height above the ground at their own places; NaN for a source whose rocks are not spread in plan
    sound : (S,) True for sources that release rocks; left_out : a sentence on the other sources, "" if there are none
    doubtful : a sentence on sound sources that are too far from the ground, "" if there are none
    around : how rocks are spread around each source
    """

    places: FloatArray
    velocities: FloatArray
    diameters: FloatArray | None
    heights: FloatArray
    sound: Flags
    left_out: str
    around: ReleaseSpread
    doubtful: str = ""

    def highest(self, top: float) -> float:
        """Return an upper bound of the height of the releases (m, local frame); -inf without sources.

        The bins of the maps are chosen from this bound. A spread rock may start over higher ground than its source.

        top : height of the terrain's highest point (m, local frame)
        """
        highest = np.where(np.isfinite(self.heights), top + self.heights, self.places[:, 2])
        return float(np.nanmax(highest, initial=-np.inf))

    @property
    def fastest(self) -> float:
        """Upper bound of the speed at release (m/s), from which the bins of the maps are chosen."""
        spread = self.around.velocity * len(IN_SPEED) ** 0.5
        return float(np.linalg.norm(self.velocities, axis=1).max(initial=0.0) + spread)


def released_over(standing: PreparedTerrain, trigger: Trigger, around: ReleaseSpread) -> Released:
    """Return the sources of one message placed over a terrain: where they can release rocks, and which are left out.

    Raises
    ------
    InputError
        There are sources, but none can release rocks: all lie off the terrain or under the ground.
    """
    places = standing.ground.terrain.frame.points_to_local(np.asarray(trigger.positions, dtype=float).reshape(-1, 3))
    velocities = np.asarray(trigger.velocities, dtype=float).reshape(-1, 3)
    depth, heights, off = _measured(standing, places, around.above_ground)
    sound = ~off & ~(depth > 0.0)
    left_out = _sentence(trigger.positions, off, depth)
    if len(places) and not sound.any():
        raise InputError(left_out)
    doubtful = _too_far(trigger.positions, _distances(standing, places, around.above_ground), sound, around.highest)
    if around.above_ground is not None:
        places = _raised(standing, places, np.where(sound, around.above_ground, np.nan))
    if around.position == 0.0:
        heights = np.full(len(places), np.nan)
    return Released(places, velocities, trigger.diameters, heights, sound, left_out, around, doubtful)


def releases_of(
    standing: PreparedTerrain, released: Released, ranges: Sequence[range | IntArray], seed: int,
    sources: IntArray | None = None,
) -> Releases:  # fmt: skip
    """Return the releases of the rocks with the given numbers, source after source.

    ranges : for each source, a range or an array (N,) of rock numbers
    sources : the source number for each item of `ranges`; None for all sources in order

    The release of a rock depends only on its source and number, not on the ranges. A spread rock starts as high above
    the ground as its source, so no rock starts in the wall behind the source. If there is no ground at its place, the
    rock starts at the place of its source. Random numbers are drawn as in `ensemble.releases`.
    """
    numbers = _arrays_of(ranges)
    which = np.arange(len(ranges)) if sources is None else sources
    source = np.repeat(which, [len(some) for some in numbers])
    rock = np.concatenate(numbers)
    mass, radius = sizes_of(standing.rock, seed, source, rock)
    if released.diameters is not None:
        mass, radius = _sized(mass, radius, released.diameters[source], density_of(standing.rock))
    x = _placed(standing, released, seed, source, rock)
    v = released.velocities[source] + _spread(released.around.velocity, IN_SPEED, seed, source, rock)
    return Releases(source, rock, x, v, mass, radius)


def drawn_for(
    standing: PreparedTerrain, released: Released, numbers: tuple[Sequence[int], Sequence[int]]
) -> Draw:
    """Return a function that returns releases of rocks with some of the given numbers, as `releases_of` does.

    For at most AT_ONCE (16,384) rocks, all releases are computed here at once. For many clusters of a few rocks each,
    separate computations would take much longer.

    numbers : two lists over all sources: number of the first rock, and the number after the last rock
    """
    seed, (first, last) = standing.scene.seed, (np.asarray(some, dtype=np.int64) for some in numbers)
    counts = last - first
    if counts.sum() > AT_ONCE:
        return lambda ranges, sources: releases_of(standing, released, ranges, seed, sources)
    every = releases_of(standing, released, list(map(range, first.tolist(), last.tolist())), seed)
    row = np.cumsum(counts) - counts - first  # added to the number of a rock, this is the row of its release
    return lambda ranges, sources: taken(
        every, np.concatenate([rocks + row[source] for rocks, source in zip(_arrays_of(ranges), sources, strict=True)])
    )


def _arrays_of(ranges: Sequence[range | IntArray]) -> list[IntArray]:
    """Return ranges or arrays of rock numbers as arrays."""
    return [np.arange(some.start, some.stop, some.step) if isinstance(some, range) else some for some in ranges]


def _placed(standing: PreparedTerrain, released: Released, seed: int, source: IntArray, rock: IntArray) -> FloatArray:
    """Return the start points (R, 3) m of rocks, spread around their sources.

    source, rock : (R,) numbers of the source and of the rock
    """
    places, heights = released.places[source], released.heights[source]
    spread = np.isfinite(heights)
    if not spread.any():
        return places
    x = places.copy()
    x[:, :2] += np.where(spread[:, None], _spread(released.around.position, IN_PLAN, seed, source, rock), 0.0)
    x = _raised(standing, x, heights)
    return np.where(np.isnan(x[:, 2:]), places, x)


def _spread(half: float, purposes: Sequence[Purpose], seed: int, source: IntArray, rock: IntArray) -> FloatArray:
    """Return random deviations (R, K), uniform from -half to half, one column for each of K purposes.

    source, rock : (R,) numbers of the source and of the rock
    """
    if half == 0.0:
        return np.zeros((len(rock), len(purposes)))
    return half * (2.0 * np.stack([uniform(seed, source, rock, purpose) for purpose in purposes], axis=1) - 1.0)


def _sized(mass: FloatArray, radius: FloatArray, diameter: FloatArray, density: float) -> tuple[FloatArray, FloatArray]:
    """Return masses (R,) kg and radii (R,) m from the diameters (R,) m of the message.

    A rock with the diameter NaN keeps its mass and radius. density : kg/m^3
    """
    known = np.isfinite(diameter)
    return np.where(known, mass_of(diameter, density), mass), np.where(known, 0.5 * diameter, radius)


def _measured(standing: PreparedTerrain, x: FloatArray, above: float | None) -> tuple[FloatArray, FloatArray, Flags]:
    """Return depth under the ground, height above the ground, and a flag "off the terrain" of sources (S, 3) m.

    The result is three arrays (S,): depth under the ground (m; 0 above the ground); height above the highest ground at
    the place in plan (m; NaN for a source under the ground, under an overhang or off the terrain); True for sources off
    the terrain. If `above` is given, the depth is 0, and the height is `above` for each source over the terrain.

    above : height above the ground (m) to which all sources are moved, or None
    """
    over = _over_top(standing, x)
    off = over[:, 1] < 0
    if above is not None:
        return np.zeros(len(x)), np.where(off, np.nan, above), off
    below = ground_below_releases(standing.ground.engine, x)
    under = ~off & ((below[:, 1] < 0) | (below[:, 2] < 0))
    height = x[:, 2] - _tops(standing, x, over)
    open_above = ~off & ~under & (np.abs(height - below[:, 0]) <= SAME_GROUND)
    return np.where(under, np.maximum(-height, np.finfo(float).tiny), 0.0), np.where(open_above, height, np.nan), off


def _distances(standing: PreparedTerrain, x: FloatArray, above: float | None) -> FloatArray:
    """Return the distance (S,) m of sources (S, 3) m from the ground straight below them.

    If all sources are moved to a height `above` (m), the function returns the distance from the highest ground straight
    above or below them instead. The distance of a source off the terrain has no meaning: 0 or NaN.
    """
    if above is None:
        return np.asarray(standing.ground.engine.ground_below(x)[:, 0])
    return np.asarray(np.abs(x[:, 2] - _tops(standing, x, _over_top(standing, x))))


def _too_far(positions: FloatArray, distances: FloatArray, sound: Flags, highest: float) -> str:
    """Return a sentence on the sound sources farther from the ground than `highest` (m); "" if there are none.

    positions : (S, 3) m, map frame; distances : (S,) m, from the ground; sound : (S,) True if a source releases rocks
    """
    far = np.flatnonzero(sound & (distances > highest))
    if not len(far):
        return ""
    first = int(far[0])
    where = ", ".join(f"{c:.3f}" for c in positions[first])
    return (f"{len(far)} of {len(positions)} sources are more than {highest:g} m from the ground (highest_source), "
            f"such as source {first} at ({where}), {three_figures(distances[first])} m: check map_origin, and that "
            "z points up in terrain and sources")  # fmt: skip


def _over_top(standing: PreparedTerrain, x: FloatArray) -> FloatArray:
    """Return the highest ground at places (S, 3) m in plan, as three columns (S, 3).

    The columns are those of `Engine.ground_below` for a point at each place, ABOVE_EVERYTHING above the whole terrain:
    height (m) of this point above the ground; number of the facet, below 0 where there is no ground; side of the facet,
    1 for the free side, -1 for the back.
    """
    top = np.array(x)
    top[:, 2] = standing.ground.facets.high[2] + ABOVE_EVERYTHING
    return standing.ground.engine.ground_below(top)


def _tops(standing: PreparedTerrain, x: FloatArray, over: FloatArray) -> FloatArray:
    """Return the height (S,) m, local frame, of the highest ground at places (S, 3) m; NaN where there is none.

    over : result of `_over_top` for these places
    """
    tops = standing.ground.facets.high[2] + ABOVE_EVERYTHING - over[:, 0]
    return np.where(over[:, 1] < 0, np.nan, tops)


def _raised(standing: PreparedTerrain, x: FloatArray, heights: FloatArray) -> FloatArray:
    """Return points (N, 3) m moved up or down to the given heights (N,) m above the highest ground there.

    z is NaN where there is no ground. Points whose height is NaN are not moved.
    """
    moved, known = np.array(x), np.isfinite(heights)
    some = moved[known]
    moved[known, 2] = _tops(standing, some, _over_top(standing, some)) + heights[known]
    return moved


def _sentence(positions: FloatArray, off: Flags, depth: FloatArray) -> str:
    """Return a sentence for the user on the sources that release no rocks, and why; "" if there are none.

    positions : (S, 3) m, of the sources, map frame; off : (S,) True off the terrain
    depth : (S,) m under the ground, 0 above the ground
    """
    parts = []
    for which, why in ((off, "off the terrain"), (depth > 0.0, "under the ground")):
        bad = np.flatnonzero(which)
        if len(bad):
            parts.append(f"{len(bad)} of {len(positions)} sources {'is' if len(bad) == 1 else 'are'} {why}: "
                         + _named(positions, bad, depth))  # fmt: skip
    return "; ".join(parts)


def _named(positions: FloatArray, bad: IntArray, depth: FloatArray) -> str:
    names = []
    for i in bad[:MOST_NAMED].tolist():
        where = ", ".join(f"{c:.3f}" for c in positions[i])
        deep = f", {depth[i]:.3g} m under the ground" if depth[i] > 0.0 else ""
        names.append(f"source {i} at ({where}){deep}")
    return "; ".join(names) + (" and others" if len(bad) > MOST_NAMED else "")
