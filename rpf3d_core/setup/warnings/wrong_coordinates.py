"""Guess, from the extents of inputs and terrain, why an input is off the terrain or why coordinates look wrong."""

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.commands import path_in_a_command
from rpf3d_core.formats.reference_system import (
    IN_METRES,
    are_same,
    is_in_degrees,
    is_known,
    short_name,
    unit_unlike_metre,
)
from rpf3d_core.formats.transformation import transformed_places
from rpf3d_core.formats.units import LENGTHS
from rpf3d_core.formats.words import either
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import plain
from rpf3d_core.setup.warnings.beyond_utm import beyond_utm
from rpf3d_core.setup.warnings.extents import TERRAIN, Extent, terrain_extent
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.faults import FaultReport

SCALES = {
    0.001: "in millimetres", 0.01: "in centimetres", 0.3048: "in feet", 1000.0: "in kilometres",
}  # fmt: skip
"""Units in which an input off the terrain may be, by their length in metres."""
UNITS_OF_TERRAIN = ("mm", "cm", "ft")
"""Units in which a terrain may be that is too large if its unit is the metre: keys of LENGTHS."""
SURVEY = 10_000.0
"""Coordinate (m) above which a terrain is probably in a national or UTM system, not in a local grid."""
MOST_RELIEF, MOST_WIDTH = 4_000.0, 100_000.0
"""Largest plausible height difference and width (m) of a terrain for rockfall.

The deepest open pit is 1,200 m deep; the highest mountain faces have 4,000 m.
"""
EASTINGS, LEAST_NORTHING = (100_000.0, 900_000.0), 1_000_000.0
"""Range of UTM eastings (m), and a northing (m) that no easting reaches."""
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
WGS84 = "EPSG:4326"

Box = tuple[FloatArray, FloatArray]


def placing_notes(
    scene: Scene, faults: FaultReport, others: Sequence[Extent], is_run: bool = False
) -> tuple[str, ...]:
    """Return sentences on wrong-looking coordinates of the terrain, and on inputs that look misplaced.

    The result is empty if everything looks right. The function reads no file.
    faults : the report on the mesh of the terrain; others : from `extents.other_extents`
    is_run : True for the notes of a run: if the scene states `up`, there is no note on a terrain of vertical facets or
        below height 0
    """
    terrain = terrain_extent(scene, faults)
    up = scene.terrain.up
    notes = list(placing_hints([terrain, *others], scene.terrain.crs, up))
    is_on_its_side = _is_on_its_side(terrain, up)
    is_explained = is_on_its_side or _are_axes_known(terrain, others, up)
    is_trusted = is_run and "up" in scene.terrain.model_fields_set
    if not is_explained and not is_trusted and not _is_too_large(terrain, up):
        notes.extend(_mostly_vertical(terrain, faults, up))
    if _is_turned_over(faults) and not is_explained:
        notes.append(
            f"{faults.flipped_facets:,} of {faults.triangles:,} triangles faced down and were turned over: either the "
            "file lists their corners clockwise, which is harmless, or the terrain is mirrored, as by swapped axes, or "
            f"{up} points down; compare it with a map"
        )
    is_opposite = any(up == "z" and _is_in_opposite_heights(other, terrain) for other in others)
    if scene.terrain.files is not None and not is_on_its_side and not is_trusted and not is_opposite:
        notes.extend(_below_zero(terrain, up))
    return tuple(notes)


def _below_zero(terrain: Extent, up: str) -> Iterator[str]:
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


def _mostly_vertical(terrain: Extent, faults: FaultReport, up: str) -> Iterator[str]:
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


def is_misread(scene: Scene, faults: FaultReport) -> bool:
    """Return True if the terrain is larger than any slope or lies on its side, so that its unit or axis is wrong.

    faults : the report on the mesh of the terrain
    """
    terrain, up = terrain_extent(scene, faults), scene.terrain.up
    return _is_on_its_side(terrain, up) or _is_too_large(terrain, up)


def placing_hints(extents: Sequence[Extent], crs: str | None, up: str) -> Iterator[str]:
    """Yield sentences on wrong-looking coordinates of the terrain, and on inputs that look misplaced.

    Yield nothing if the first extent is not that of the terrain.
    extents : the terrain first; crs : reference system of the terrain; up : the axis that points up in the input
    """
    if not extents or extents[0].name != TERRAIN:
        return
    terrain, others = extents[0], extents[1:]
    yield from _terrain_hints(terrain, crs, up)
    yield from _unknown_systems(terrain, others, crs)
    if _is_on_its_side(terrain, up):
        return  # no input fits such a plan
    for other in others:
        if _is_in_another_system(other, crs):
            continue  # `refuse_other_systems` offers the transformation
        if not _overlaps(_plan(other, up), _plan(terrain, up)):
            yield from _off_the_terrain(other, terrain, crs, up)
        elif up == "z" and _is_in_opposite_heights(other, terrain):
            yield (
                f"{other.name}: its heights have the opposite sign of the terrain's heights: "
                "does z point down in one of them?"
            )


def _plan(extent: Extent, up: str) -> Box:
    axes = [0, 1] if up == "z" else [0, 2]
    return extent.low[axes], extent.high[axes]


def _overlaps(first: Box, second: Box) -> bool:
    return bool((first[0] <= second[1]).all() and (second[0] <= first[1]).all())


def _looks_like_degrees(box: Box) -> bool:
    low, high = box
    limits = np.array([180.0, 90.0])
    return bool((low >= -limits).all() and (high <= limits).all())


def _terrain_hints(terrain: Extent, crs: str | None, up: str) -> Iterator[str]:
    """Yield sentences on a terrain with implausible coordinates: degrees, wrong unit, swapped axes."""
    low, high = _plan(terrain, up)
    width, relief = _size(terrain, up)
    if _is_on_its_side(terrain, up):
        yield _on_its_side_in_words(terrain, up)
    elif _looks_like_degrees((low, high)) and width < 1.0 and relief > 20.0 * width:
        yield "the terrain looks as if it were in degrees (longitude, latitude); export it in metres, such as in UTM"
    elif _is_too_large(terrain, up):
        yield (
            f"the terrain is larger than any slope, {plain(round(width))} m wide and {plain(round(relief))} m high: "
            f"{_units_in_words(width, relief)}"
        )
    if up == "z" and _is_northing_first((low, high)):
        yield "x of the terrain looks like a northing and y like an easting: are x and y swapped?"
    elif not _is_too_large(terrain, up) and not _is_on_its_side(terrain, up):
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
    low, high = _plan(terrain, up)
    return float((high - low).max()), float((terrain.high - terrain.low)[2 if up == "z" else 1])


def _is_too_large(terrain: Extent, up: str) -> bool:
    width, relief = _size(terrain, up)
    return relief > MOST_RELIEF or width > MOST_WIDTH


def _is_on_its_side(terrain: Extent, up: str) -> bool:
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


def _is_northing_first(box: Box) -> bool:
    """Return True if the first coordinates of a box can only be northings, and the second look like eastings."""
    low, high = box
    return bool(low[0] > LEAST_NORTHING and EASTINGS[0] < low[1] < high[1] < EASTINGS[1])


def _is_turned_over(faults: FaultReport) -> bool:
    """Return True if nearly all facets with an area were turned over, as in a mirrored terrain."""
    of = faults.triangles - faults.zero_area_facets
    return faults.flipped_facets > 0 and faults.flipped_facets >= NEARLY_ALL * of


def _are_axes_known(terrain: Extent, others: Sequence[Extent], up: str) -> bool:
    """Return True if coordinates show which of the terrain's axes points north.

    The coordinates of the terrain show the order of the axes if the northings are larger than any easting can be. The
    file of another input shows the order if the input lies on the terrain, but would lie elsewhere with swapped axes.
    Coordinates in the scene file show nothing, because `rpf3d new` takes these coordinates from the terrain.
    terrain : extent of the terrain; others : extents of the other inputs; up : the axis that points up in the input
    """
    ground = _plan(terrain, up)
    if up == "z" and (_is_northing_first(ground) or _is_northing_first(_swapped(ground))):
        return True
    boxes = [_plan(other, up) for other in others if other.file is not None]
    return any(_overlaps(box, ground) and not _overlaps(_swapped(box), ground) for box in boxes)


def _swapped(box: Box) -> Box:
    """Return a box in plan with both axes swapped."""
    return box[0][::-1], box[1][::-1]


def _unknown_systems(terrain: Extent, others: Sequence[Extent], crs: str | None) -> Iterator[str]:
    """Yield a sentence for each reference system of other inputs that cannot be compared with that of the terrain.

    The stated system is unknown, or the system of the terrain is unknown. A system in degrees is left out.

    others : extents of the inputs other than the terrain; crs : reference system of the terrain, None if unknown
    """
    stated = {other.crs: other for other in others if other.crs is not None and not is_in_degrees(other.crs)}
    for system, other in stated.items():
        if not is_known(system):
            yield (
                f"{other.name}: its file states {short_name(system)}, which is no known coordinate reference system, "
                "so it is not compared with the terrain"
            )
        elif crs is None:
            yield _unknown_in_words(other, system)


def _unknown_in_words(other: Extent, system: str) -> str:
    """Return a sentence on an input that states a reference system, over a terrain without one.

    other : extent of the input; system : the reference system that it states
    """
    unit = unit_unlike_metre(system)
    if unit is None:
        return f"{other.name} is in {system}; the terrain states none: name it as `terrain.crs` if it is the same"
    same = "" if unit.key is None else (
        f": if the coordinates of the terrain file are in {unit.name}, too, give it `unit: {unit.key}` (`rpf3d new`: "
        f"--unit {unit.key})"
    )  # fmt: skip
    return (
        f"{other.name} is in {short_name(system)}, which is in {unit.name}, and the terrain is in metres{same}; name "
        f"{IN_METRES}, as `terrain.crs`"
    )


def _off_the_terrain(other: Extent, terrain: Extent, crs: str | None, up: str) -> Iterator[str]:
    """Yield a sentence with the most plausible reason why an input lies off the terrain; nothing if no reason fits.

    other : extent of the input; crs : reference system of the terrain; up : the axis that points up in the input
    """
    box, ground = _plan(other, up), _plan(terrain, up)
    if _looks_like_degrees(box) and not _looks_like_degrees(ground):
        yield _degrees_in_words(other, ground, crs)
    elif _overlaps(_swapped(box), ground):
        yield f"{other.name} would lie on the terrain if x and y were swapped: is the northing first?"
    elif up == "z" and not np.isnan(other.low[2]) and _overlaps((other.low[[0, 2]], other.high[[0, 2]]), ground):
        yield f"{other.name} would lie on the terrain if y and z were swapped: does y point up in it?"
    elif _is_near_the_origin(ground):
        return
    elif unit := _unit_of(box, ground):
        yield f"{other.name} would lie on the terrain if it were {unit}"
    elif unit := _unit_of(ground, box):
        yield f"{other.name} would lie on the terrain if the terrain were {unit}; give its file `unit`"


def _is_near_the_origin(ground: Box) -> bool:
    """Return True if the middle of the terrain's box is nearer to the origin than the box is long (diagonal).

    Near the origin, an input in almost any unit would lie on the terrain, so scaled coordinates do not show the unit.
    """
    return bool(np.linalg.norm(0.5 * (ground[0] + ground[1])) < np.linalg.norm(ground[1] - ground[0]))


def _unit_of(box: Box, ground: Box) -> str | None:
    """Return the unit, such as "in feet", in which a misplaced box would lie on the terrain; None if no unit fits.

    box : extent of the input in plan; ground : extent of the terrain in plan
    """
    return next((unit for scale, unit in SCALES.items() if _overlaps((box[0] * scale, box[1] * scale), ground)), None)


def _degrees_in_words(other: Extent, ground: Box, crs: str | None) -> str:
    """Return a sentence on an input in longitude and latitude: whether it lies on the terrain, and how to transform it.

    The sentence has no command if the coordinates are in the scene file. Without a reference system of the terrain, it
    only asks for this system.

    other : extent of the input; ground : extent of the terrain in plan
    crs : reference system of the terrain; None if unknown
    """
    sentence = f"{other.name} looks like longitude and latitude (WGS84), and the terrain is in metres"
    if crs is None:
        return f"{sentence}; name the reference system of the terrain as `terrain.crs` to have it compared"
    try:
        corners = transformed_places(other.file or Path(other.name), np.array(_plan(other, "z")), WGS84, crs)
    except InputError:
        return sentence
    low, high = corners.min(axis=0), corners.max(axis=0)
    if not _overlaps((low, high), ground):
        return (f"{sentence}; transformed to {crs}, {_box_in_words(low, high)}, it is off the terrain, "
                f"{_box_in_words(*ground)}: is it of another site, or has the terrain another reference system or a "
                "local grid?")  # fmt: skip
    command = "" if other.file is None else f": {transforming(other, WGS84, crs)}"
    return f"{sentence}; transformed to {crs} it lies on it{command}"


def _box_in_words(low: FloatArray, high: FloatArray) -> str:
    """Return a box in plan as text, in whole metres; low, high : (2,) m, its corners."""
    return " and ".join(f"{axis} {plain(round(a))} to {plain(round(b))} m"
                        for axis, a, b in zip("xy", low.tolist(), high.tolist(), strict=True))  # fmt: skip


def transforming(other: Extent, begin: str, end: str) -> str:
    """Return the command that transforms the file of an input from one reference system to another.

    begin : reference system of the file; end : reference system to which the file is transformed
    """
    file = other.file or Path(other.name)
    code = end.rpartition(":")[2]
    out = file.with_name(f"{file.stem}_{code if code.isalnum() else 'transformed'}.geojson")
    return (
        f"rpf3d import layer {path_in_a_command(file)} --kind {other.kind} --from {shlex.quote(begin)} "
        f"--to {shlex.quote(end)} --out {path_in_a_command(out)}"
    )


def _is_in_opposite_heights(other: Extent, terrain: Extent) -> bool:
    """Return True if an input lies on the terrain in plan and at its heights, but only after a change of their sign.

    z must point up in the scene. The result is False for an input without heights.
    """
    is_on_it = _overlaps(_plan(other, "z"), _plan(terrain, "z"))
    return is_on_it and not np.isnan(other.low[2]) and _is_upside_down(other, terrain)


def _is_upside_down(other: Extent, terrain: Extent) -> bool:
    """Return True if the elevations of an input overlap those of the terrain only after a change of sign."""
    low, high = terrain.low[2], terrain.high[2]
    if other.low[2] <= high and low <= other.high[2]:
        return False
    return bool(-other.high[2] <= high and low <= -other.low[2])


def refuse_other_systems(extents: Sequence[Extent], crs: str | None) -> None:
    """Refuse a file that states another coordinate reference system than the terrain, and offer the transformation.

    A file that states degrees, but has coordinates outside the range of degrees, states a wrong system and is not
    refused.

    Raises
    ------
    InputError
        A file is in another reference system; the message has the command that transforms it.
    """
    for other in extents:
        if crs is not None and other.crs is not None and _is_in_another_system(other, crs):
            raise InputError(
                f"{other.file}: {other.name} is in {other.crs}, and the terrain in {crs}; transform it: "
                f"{transforming(other, other.crs, crs)}"
            )


def _is_in_another_system(other: Extent, crs: str | None) -> bool:
    """Return True if a file states another reference system than the terrain, and its coordinates are possible there.

    A stated system that is unknown counts as none.

    crs : reference system of the terrain; None if unknown
    """
    if crs is None or other.crs is None or other.name == TERRAIN or are_same(other.crs, crs):
        return False
    if not is_known(other.crs):
        return False
    return not is_in_degrees(other.crs) or _looks_like_degrees(_plan(other, "z"))
