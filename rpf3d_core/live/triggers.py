"""What sets an answer off: sources as they were seen, and the rocks that are released for them.

Each source becomes a cloud of rocks around it: monitoring tells a place to metres and a speed roughly, and how far
that matters is part of the answer.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING, Releases, Source, releases_in
from rpf3d_core.errors import InputError
from rpf3d_core.live.standing import Standing, density_of, mass_of
from rpf3d_core.terrain.frame import FloatArray

SAME_GROUND = 1e-6
"""m; a source's height above the ground below it and above the highest ground there are the same up to rounding."""

MOST_NAMED = 3
"""Sources that a sentence names one by one."""


@dataclass(frozen=True, eq=False)
class Trigger:
    """S sources of one message; none of them means that the walls were watched and nothing was seen.

    positions : (S, 3) m, map frame; velocities : (S, 3) m/s; diameters : (S,) m, NaN where unknown, or None
    digest : sha256 (hex) of all that, as `digest_of`
    """

    positions: FloatArray
    velocities: FloatArray
    diameters: FloatArray | None
    stamp_ns: int
    digest: str


@dataclass(frozen=True)
class Around:
    """How rocks are spread around a source.

    position, velocity : half-widths of a uniform spread, m in plan and m/s in each direction
    above_ground : height of each source above the ground (m); None for the height that it was seen at
    """

    position: float = 0.0
    velocity: float = 0.0
    above_ground: float | None = None


@dataclass(frozen=True, eq=False)
class Released:
    """The sources that rocks fall from, local frame, and those that were left out.

    sources : one for each of the trigger's, in its order, so that draws stay as they are
    heights : (S,) m above the highest ground at each; NaN where its rocks keep its own height
    sound : (S,) which are released; left_out : a sentence on the others, "" if there are none
    """

    sources: Sequence[Source]
    heights: FloatArray
    sound: "np.ndarray"
    left_out: str
    diameters: FloatArray | None

    def rounds(self, first_rocks: int) -> list[int]:
        """How many rocks each source has in a first round of at least `first_rocks`."""
        each = -(-first_rocks // max(int(self.sound.sum()), 1))
        return [each if sound else 0 for sound in self.sound.tolist()]


def trigger_of(positions: FloatArray, velocities: FloatArray, diameters: FloatArray | None, stamp_ns: int) -> Trigger:
    """A trigger with its digest."""
    return Trigger(positions, velocities, diameters, stamp_ns, digest_of(positions, velocities, diameters, stamp_ns))


def digest_of(positions: FloatArray, velocities: FloatArray, diameters: FloatArray | None, stamp_ns: int) -> str:
    """sha256 (hex) of sources: the same for the same numbers, whatever message they came in."""
    found = hashlib.sha256(f"sources {len(positions)} {stamp_ns}".encode())
    for column in (positions, velocities, diameters):
        found.update(b"-" if column is None else np.ascontiguousarray(column, dtype="<f8").tobytes())
    return found.hexdigest()


def released_over(standing: Standing, trigger: Trigger, around: Around) -> Released:
    """The sources of a trigger over a ground.

    Raises
    ------
    InputError
        None of them can be released: all lie off the terrain or under the ground. (Of no sources none has to be.)
    """
    local = standing.ground.terrain.frame.points_to_local(np.asarray(trigger.positions, dtype=float).reshape(-1, 3))
    depth, own, off = _measured(standing, local, around.above_ground)
    sound = ~off & ~(depth > 0.0)
    left_out = _sentence(trigger.positions, off, depth)
    if len(local) and not sound.any():
        raise InputError(left_out)
    heights = own if around.position > 0.0 else np.full(len(local), np.nan)
    if around.above_ground is not None:
        local = _raised(standing, local, np.where(sound, around.above_ground, np.nan))
    in_plan, any_way = (around.position, around.position, 0.0), (around.velocity,) * 3
    sources = [
        Source(str(i), local[i : i + 1], 0, (float(v[0]), float(v[1]), float(v[2])), False, in_plan, any_way)
        for i, v in enumerate(np.asarray(trigger.velocities, dtype=float).reshape(-1, 3))
    ]
    sources = [
        source if np.isfinite(heights[i]) else replace(source, spread=(0.0, 0.0, 0.0))
        for i, source in enumerate(sources)
    ]
    return Released(sources, heights, sound, left_out, trigger.diameters)


def releases_of_ranges(standing: Standing, released: Released, ranges: Sequence[range], seed: int) -> Releases:
    """Some rocks of each source, the same bits whatever is asked for together.

    A rock that is spread keeps its source's height above the ground, so that none starts in the wall behind it; where
    there is no ground it starts at its source.
    """
    ground = standing.ground
    drawn = releases_in(released.sources, ranges, standing.rock, seed, ground.engine, ground.terrain.frame)
    heights, diameters = released.heights, released.diameters
    if np.isfinite(heights).any():
        x = _raised(standing, drawn.x, heights[drawn.source])
        nowhere = np.isnan(x[:, 2])
        places = np.concatenate([source.points for source in released.sources])
        x[nowhere] = places[drawn.source[nowhere]]
        drawn = replace(drawn, x=x)
    if diameters is None:
        return drawn
    return _sized(drawn, diameters[drawn.source], density_of(standing.rock))


def _sized(drawn: Releases, diameter: FloatArray, density: float) -> Releases:
    """The releases with diameters (R,) m; NaN leaves a rock as it is."""
    known = np.isfinite(diameter)
    mass, radius = (
        np.where(known, mass_of(diameter, density), drawn.mass),
        np.where(known, 0.5 * diameter, drawn.radius),
    )
    return replace(drawn, mass=mass, radius=radius)


def _measured(standing: Standing, x: FloatArray, above: float | None) -> tuple[FloatArray, FloatArray, "np.ndarray"]:
    """How far points (S, 3) are under the ground (m; 0 where they are not), their height above the highest ground
    there (NaN where another ground hangs over them), and which are off the terrain.
    """
    over = _over_top(standing, x)
    off = over[:, 1] < 0
    if above is not None:
        return np.zeros(len(x)), np.where(off, np.nan, above), off
    below = standing.ground.engine.ground_below(x)
    under = ~off & ((below[:, 1] < 0) | (below[:, 2] < 0))
    height = x[:, 2] - _tops(standing, x, over)
    open_above = ~off & ~under & (np.abs(height - below[:, 0]) <= SAME_GROUND)
    return np.where(under, np.maximum(-height, np.finfo(float).tiny), 0.0), np.where(open_above, height, np.nan), off


def _over_top(standing: Standing, x: FloatArray) -> FloatArray:
    """`Engine.ground_below` of points above everything, at places (S, 3)."""
    top = np.array(x)
    top[:, 2] = standing.ground.facets.high[2] + ABOVE_EVERYTHING
    return standing.ground.engine.ground_below(top)


def _tops(standing: Standing, x: FloatArray, over: FloatArray) -> FloatArray:
    """Height (S,) m, local, of the highest ground at places (S, 3); NaN where there is none."""
    tops = standing.ground.facets.high[2] + ABOVE_EVERYTHING - over[:, 0]
    return np.where(over[:, 1] < 0, np.nan, tops)


def _raised(standing: Standing, x: FloatArray, heights: FloatArray) -> FloatArray:
    """Points (N, 3) put at heights (N,) m above the highest ground there, NaN where there is none; those whose height
    is NaN stay where they are.
    """
    moved, known = np.array(x), np.isfinite(heights)
    some = moved[known]
    moved[known, 2] = _tops(standing, some, _over_top(standing, some)) + heights[known]
    return moved


def _sentence(positions: FloatArray, off: "np.ndarray", depth: FloatArray) -> str:
    """Which sources are left out and why."""
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
