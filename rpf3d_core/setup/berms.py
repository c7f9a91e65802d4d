"""Raise the terrain of a scene along the lines of its berms."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan
from rpf3d_core.formats.polylines import lines_along
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.terrain import BermSpec
from rpf3d_core.setup.coverage import extents
from rpf3d_core.terrain.berms import raised
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.ridge import Ridge, ridge_along
from rpf3d_core.terrain.sections import ground_at, section_of
from rpf3d_core.terrain.zones import with_zone

ZONE = "berm_"
"""Prefix of the zone names that berms get, followed by the name of the berm."""
STEEP_SIDE, STEEP_GROUND = 45.0, 35.0
"""Slopes (degrees) of a berm's sides, and of the ground at its foot, above which a berm is suspicious."""
LEAST_SHARE = 0.02
"""Share (-) of a berm's foot that may lie on steep ground without a warning."""
MANY, CELLS = 200_000, 64
"""Number of facets from which `_near` reduces a terrain, and number of cells along each side of its search grid."""
LOCAL = 2.0
"""Largest length (m), from the foot of a berm inwards, over which the second of two slopes is measured.

The first slope is measured from the foot to the berm's middle line. Single facets are not used, because they are often
rough.
"""
STEP, MOST_PLACES = 1.0, 100
"""Distance (m) between the places along a foot where slopes are measured; largest number of places on each side."""


def with_berms(terrain: Terrain, scene: Scene) -> Terrain:
    """Return the terrain with the scene's berms, added one after another; where berms cross, their heights add up.

    Raises
    ------
    InputError
        A line is damaged, has no length, bends too sharply for the width, leaves the terrain, or crosses a
        hole in it. The message names the key.
    """
    for number, spec in enumerate(scene.terrain.berms):
        key = f"{scene.path}: `terrain.berms[{number}].along`"
        for line in _lines(key, spec):
            plan = local_plan(terrain.frame, line)
            ridge = ridge_along(plan, spec.height, spec.width, spec.crest)
            if ridge is None:
                raise InputError(f"{key} of {spec.name!r} bends too sharply for a berm {spec.width:g} m wide")
            if any(section_of(terrain, begin, end) is None for begin, end in pairwise(plan)):
                raise InputError(f"{key} of {spec.name!r} leaves the terrain: {extents(terrain, line)}")
            terrain = raised(terrain, ridge, ZONE + spec.name)
    return terrain


def berm_warnings(terrain: Terrain, scene: Scene) -> tuple[str, ...]:
    """Return warnings on berms that no loose rock can form: steep sides, or a foot on a bench face.

    Call `with_berms` first, which refuses wrong lines.

    terrain : the terrain before its berms are added
    """
    found = []
    for number, spec in enumerate(scene.terrain.berms):
        key = f"{scene.path}: `terrain.berms[{number}].along`"
        place = f"`terrain.berms[{number}]` {spec.name!r}"
        steepness = math.degrees(math.atan2(spec.height, 0.5 * (spec.width - spec.crest)))
        if steepness > STEEP_SIDE:
            found.append(
                f"{place} has sides of {steepness:.0f} degrees on level ground, and loose rock stands at 35 to 40 "
                "degrees: are `height` and `width` right, and in metres? The width is that of the foot, both sides "
                "together"
            )
        ridges = (
            ridge_along(local_plan(terrain.frame, line), spec.height, spec.width, spec.crest)
            for line in _lines(key, spec)
        )
        slopes = np.concatenate(
            [_slopes_at_foot(terrain, ridge, 0.5 * spec.width) for ridge in ridges if ridge is not None]
        )
        if len(slopes) and (share := float((slopes > STEEP_GROUND).mean())) > LEAST_SHARE:
            found.append(
                f"{100.0 * share:.0f} % of the foot of {place} lie on ground steeper than {STEEP_GROUND:.0f} degrees, "
                f"up to {slopes.max():.0f} degrees: does a berm {spec.width:g} m wide reach a face? Check `width`, "
                "`height` and the line"
            )
    return tuple(found)


def _slopes_at_foot(terrain: Terrain, ridge: Ridge, half: float) -> FloatArray:
    """Return the slopes (N,) of the ground (degrees) at places along the foot of a berm.

    At each place, the steeper of two slopes counts. The slope from the foot to the middle line of the berm shows a foot
    below a face. The slope from the foot to a place at most LOCAL (m) inwards shows a foot just beyond a crest. Places
    without ground are left out, so N may be 0.

    half : m, distance of the foot from the line
    """
    places, inwards = [], []
    for corners, heights in zip(ridge.corners, ridge.heights, strict=True):
        low = (heights == 0.0) & (np.roll(heights, -1) == 0.0)
        for begin, end in zip(corners[low], np.roll(corners, -1, axis=0)[low], strict=True):
            count = min(MOST_PLACES, max(1, round(float(np.hypot(*(end - begin)) / STEP))))
            places.append(begin + (np.arange(count)[:, None] + 0.5) / count * (end - begin))
            left = np.array([begin[1] - end[1], end[0] - begin[0]])  # the corners are counter-clockwise
            inwards.append(np.broadcast_to(left / np.hypot(*left), (count, 2)))
    foot, inward = np.concatenate(places), np.concatenate(inwards)
    lengths = (half, min(half, LOCAL))
    compared = np.concatenate([foot, *(foot + length * inward for length in lengths)])
    heights, facets = ground_at(_near(terrain, compared), compared)
    known = (facets >= 0).reshape(3, -1).all(axis=0)
    at_foot, at_line, close = heights.reshape(3, -1)[:, known]
    rises = np.abs([at_line - at_foot, close - at_foot]) / np.array(lengths)[:, None]
    return np.asarray(np.degrees(np.arctan(rises.max(axis=0))))


def _near(terrain: Terrain, foot: FloatArray) -> Terrain:
    """Return a large terrain reduced to the facets near places (P, 2) m, because a search of all facets would be slow.

    A facet is kept if one of its vertices is near a place. The facet at a place may be lost if it is much larger than a
    cell of the search grid; a few lost places do not matter. A small terrain is returned unchanged.
    """
    if len(terrain.triangles) < MANY:
        return terrain
    low = foot.min(axis=0)
    size = max(float((foot.max(axis=0) - low).max()) / CELLS, STEP)
    marked = np.zeros((CELLS + 6, CELLS + 6), dtype=bool)
    x, y = (np.floor((foot - low) / size).astype(np.int64) + 2).T
    for shift_x in (-1, 0, 1):
        for shift_y in (-1, 0, 1):
            marked[x + shift_x, y + shift_y] = True
    u, w = (
        np.clip(np.floor((column - begin) * (1.0 / size)) + 2.0, 0, CELLS + 5).astype(np.int32)
        for column, begin in zip(terrain.vertices[:, :2].T, low, strict=True)
    )
    inside = marked[u, w]
    a, b, c = (inside[corner] for corner in terrain.triangles.T)
    return replace(terrain, triangles=terrain.triangles[a | b | c])


def with_zones_of_berms(terrain: Terrain, berms: Terrain, scene: Scene) -> Terrain:
    """Return the terrain with the zones of all berms set again, because zones drawn later must not hide berms.

    terrain : the terrain whose zones are changed; scene : the scene that states the berms
    berms : the same mesh before other zones were drawn, with the zones of the berms
    """
    for zone in dict.fromkeys(ZONE + spec.name for spec in scene.terrain.berms):
        if zone in berms.zones:
            terrain = with_zone(terrain, zone, berms.zone == berms.zones.index(zone))
    return terrain


def _lines(key: str, spec: BermSpec) -> list[FloatArray]:
    try:
        return lines_along(spec.along)
    except InputError as fault:
        raise InputError(f"{key} {fault}") from fault
