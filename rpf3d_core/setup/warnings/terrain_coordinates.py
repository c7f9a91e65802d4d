"""Guess, from the terrain alone, whether its unit or axes are wrong: degrees, feet, y upwards, x and y swapped."""

from collections.abc import Iterator

import numpy as np

from rpf3d_core.formats.units import LENGTHS
from rpf3d_core.formats.words import either
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import plain
from rpf3d_core.setup.warnings.beyond_utm import beyond_utm
from rpf3d_core.setup.warnings.extents import Extent, terrain_extent
from rpf3d_core.setup.warnings.plan_boxes import is_northing_first, looks_like_degrees, plan_box
from rpf3d_core.terrain.mesh.faults import FaultReport

UNITS_OF_TERRAIN = ("mm", "cm", "ft")
"""Units in which a terrain may be that is too large if its unit is the metre: keys of LENGTHS."""
SURVEY = 10_000.0
"""Coordinate (m) above which a terrain is probably in a national or UTM system, not in a local grid."""
MOST_RELIEF, MOST_WIDTH = 4_000.0, 100_000.0
"""Largest plausible height difference and width (m) of a terrain for rockfall.

The deepest open pit is 1,200 m deep; the highest mountain faces have 4,000 m.
"""
HIGHEST, NO_HEIGHT = 9_000.0, 30_000.0
"""Height (m) that no terrain reaches, and a number that cannot be a height in metres or in feet.

Mount Everest is 8,849 m or 29,032 ft high.
"""
VERTICAL, TALL = 2.0, 2.0
"""A terrain may lie on its side if its facets seen along another axis cover more than VERTICAL times the area seen from
above, or if it is more than TALL times as high as wide. A pit wall with berms covers about the same area seen from the
front as seen from above.
"""
NEARLY_ALL = 0.95
"""Smallest share (-) of facets that were turned over for which the terrain may be mirrored."""


def is_misread(scene: Scene, faults: FaultReport) -> bool:
    """Return True if the terrain is larger than any slope or lies on its side, so that its unit or axis is wrong.

    faults : the report on the mesh of the terrain
    """
    terrain, up = terrain_extent(scene, faults), scene.terrain.up
    return is_on_its_side(terrain, up) or is_too_large(terrain, up)


def terrain_hints(terrain: Extent, crs: str | None, up: str) -> Iterator[str]:
    """Yield sentences on a terrain with implausible coordinates: degrees, wrong unit, swapped axes."""
    low, high = plan_box(terrain, up)
    width, relief = _size(terrain, up)
    if is_on_its_side(terrain, up):
        yield _on_its_side_in_words(terrain, up)
    elif looks_like_degrees((low, high)) and width < 1.0 and relief > 20.0 * width:
        yield "the terrain looks as if it were in degrees (longitude, latitude); export it in metres, such as in UTM"
    elif is_too_large(terrain, up):
        yield (
            f"the terrain is larger than any slope, {plain(round(width))} m wide and {plain(round(relief))} m high: "
            f"{_units_in_words(width, relief)}"
        )
    if up == "z" and is_northing_first((low, high)):
        yield "x of the terrain looks like a northing and y like an easting: are x and y swapped?"
    elif not is_too_large(terrain, up) and not is_on_its_side(terrain, up):
        yield from beyond_utm(low, high, relief, crs)
    if crs is None and terrain.file is not None and max(abs(low).max(), abs(high).max()) > SURVEY:
        yield (
            "the terrain states no coordinate reference system in metres; name it as `terrain.crs`, such as EPSG:32719"
        )


def _units_in_words(width: float, relief: float) -> str:
    """Return a question about the unit of a terrain that is too large in metres, with its width in each plausible unit.

    width, relief : m, as the scene reads the terrain; units in which the terrain is still too large are left out
    """
    fitting = {
        unit: LENGTHS[unit] for unit in UNITS_OF_TERRAIN
        if width * LENGTHS[unit][1] <= MOST_WIDTH and relief * LENGTHS[unit][1] <= MOST_RELIEF
    }  # fmt: skip
    if not fitting:
        return "compare its unit with your survey, and give its file the key `unit`"
    names = either([name for name, _ in fitting.values()])
    widths = either([f"{plain(round(width * length, 1))} m" for _, length in fitting.values()])
    keys = either([f"`unit: {unit}`" for unit in fitting])
    return (f"is it in {names}? It would be {widths} wide. Give its file {keys} (`rpf3d new`: "
            f"--unit {next(iter(fitting))})")  # fmt: skip


def _size(terrain: Extent, up: str) -> tuple[float, float]:
    """Return the larger width (m) of a terrain in plan, and its height difference (m)."""
    low, high = plan_box(terrain, up)
    return float((high - low).max()), float((terrain.high - terrain.low)[2 if up == "z" else 1])


def is_too_large(terrain: Extent, up: str) -> bool:
    """Return True if a terrain is higher or wider (m) than any slope, so that its unit is probably wrong."""
    width, relief = _size(terrain, up)
    return relief > MOST_RELIEF or width > MOST_WIDTH


def is_on_its_side(terrain: Extent, up: str) -> bool:
    """Return True if a terrain's heights can only be northings or eastings, and the values of y or z look like heights.

    The tested axis is y if z points up in the scene, and z if y points up.
    """
    height, other = (2, 1) if up == "z" else (1, 2)
    largest = np.maximum(np.abs(terrain.low), np.abs(terrain.high))
    relief = float(terrain.high[other] - terrain.low[other])
    width = float((terrain.high - terrain.low)[[0, height]].max())
    is_survey = largest[0] > SURVEY and largest[height] > NO_HEIGHT
    return bool(is_survey and largest[other] < HIGHEST and relief <= MOST_RELIEF and width <= MOST_WIDTH)


def _on_its_side_in_words(terrain: Extent, up: str) -> str:
    """Return a sentence on a terrain whose heights are northings, with the value of `up` that would be right.

    up : the axis that points up according to the scene
    """
    height, other = ("z", "y") if up == "z" else ("y", "z")
    low, high = (plain(float(corner["xyz".index(height)])) for corner in (terrain.low, terrain.high))
    sentence = (
        f"{height} of the terrain is {low} to {high} m, which is no height, and {other} looks like heights: are y and "
        f"z swapped? Give the terrain `up: {other}` (`rpf3d new`: --up {other})"
    )
    if other == "z" or terrain.high[2] < 0.0:
        return sentence
    return (
        f"{sentence}. Then z points south; here z looks like a northing, so maps would be mirrored; "
        "it is better to export the file with z up"
    )


def mostly_vertical(terrain: Extent, faults: FaultReport, up: str) -> Iterator[str]:
    """Yield a sentence on a terrain that looks as if it lay on its side, so that another axis points up.

    Most facets are then vertical, or the terrain is far higher than wide. There is no sentence if the coordinates along
    the other axis are too large to be heights, as in survey coordinates.

    terrain : extent of the terrain; faults : the report on its mesh; up : the axis that points up in the input
    """
    other = "y" if up == "z" else "z"
    along = "xyz".index(other)
    width, relief = _size(terrain, up)
    _, from_front, from_above = faults.seen
    is_steep, is_tall = from_front > VERTICAL * from_above, relief > TALL * width
    if (is_steep or is_tall) and max(abs(terrain.low[along]), abs(terrain.high[along])) < HIGHEST:
        why = (
            f"its facets cover {from_front:,.0f} m2 seen along {other}, and {from_above:,.0f} m2 seen from above"
            if is_steep else f"it is {plain(round(relief))} m high and {plain(round(width))} m wide"
        )  # fmt: skip
        yield (
            f"the terrain looks as if it lay on its side: {why}; if {other} points up in its file, give the terrain "
            f"`up: {other}` (`rpf3d new`: --up {other})"
        )


def turned_over(faults: FaultReport, up: str) -> Iterator[str]:
    """Yield a sentence on a terrain of which nearly all facets were turned over, so that it may be mirrored.

    faults : the report on the mesh of the terrain; up : the axis that points up in the input
    """
    if _is_turned_over(faults):
        yield (
            f"{faults.flipped_facets:,} of {faults.triangles:,} triangles faced down and were turned over: either the "
            "file lists their corners clockwise, which is harmless, or the terrain is mirrored, as by swapped axes, or "
            f"{up} points down; compare it with a map"
        )


def _is_turned_over(faults: FaultReport) -> bool:
    """Return True if nearly all facets with an area were turned over, as in a mirrored terrain."""
    of = faults.triangles - faults.zero_area_facets
    return faults.flipped_facets > 0 and faults.flipped_facets >= NEARLY_ALL * of


def below_zero(terrain: Extent, up: str) -> Iterator[str]:
    """Yield a sentence on a terrain that lies below height 0 everywhere, as if its file counted heights downwards.

    Such a file is read upside down, so that pits are hills. No scene key turns heights over. If heights are right, as
    those below a local datum, the user states the axis that points up, and a run has no note.
    """
    axis = "xyz".index(up)
    low, high = float(terrain.low[axis]), float(terrain.high[axis])
    if high < 0.0:
        yield (
            f"all heights of the terrain are negative, {plain(low)} to {plain(high)} m: if its file counts heights or "
            f"depths downwards, the terrain is read upside down; export the file with {up} upwards. If the heights are "
            f"right, give the terrain `up: {up}`: runs then have no such note"
        )
