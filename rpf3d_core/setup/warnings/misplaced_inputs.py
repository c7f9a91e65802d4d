"""Compare systems and places of inputs with those of the terrain; guess why an input lies off the terrain."""

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
from rpf3d_core.setup.warnings.extents import TERRAIN, Extent
from rpf3d_core.setup.warnings.plan_boxes import (
    Box,
    box_in_words,
    is_near_the_origin,
    is_northing_first,
    looks_like_degrees,
    overlaps,
    plan_box,
    swapped,
)

SCALES = {
    0.001: "in millimetres", 0.01: "in centimetres", 0.3048: "in feet", 1000.0: "in kilometres",
}  # fmt: skip
"""Units in which an input off the terrain may be, by their length in metres."""
WGS84 = "EPSG:4326"


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
        if crs is not None and other.crs is not None and is_in_another_system(other, crs):
            raise InputError(
                f"{other.file}: {other.name} is in {other.crs}, and the terrain in {crs}; transform it: "
                f"{transforming(other, other.crs, crs)}"
            )


def is_in_another_system(other: Extent, crs: str | None) -> bool:
    """Return True if a file states another reference system than the terrain, and its coordinates are possible there.

    A stated system that is unknown counts as none.

    crs : reference system of the terrain; None if unknown
    """
    if crs is None or other.crs is None or other.name == TERRAIN or are_same(other.crs, crs):
        return False
    if not is_known(other.crs):
        return False
    return not is_in_degrees(other.crs) or looks_like_degrees(plan_box(other, "z"))


def unknown_systems(terrain: Extent, others: Sequence[Extent], crs: str | None) -> Iterator[str]:
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


def off_the_terrain(other: Extent, terrain: Extent, crs: str | None, up: str) -> Iterator[str]:
    """Yield a sentence with the most plausible reason why an input lies off the terrain; nothing if no reason fits.

    other : extent of the input; crs : reference system of the terrain; up : the axis that points up in the input
    """
    box, ground = plan_box(other, up), plan_box(terrain, up)
    if looks_like_degrees(box) and not looks_like_degrees(ground):
        yield _degrees_in_words(other, ground, crs)
    elif overlaps(swapped(box), ground):
        yield f"{other.name} would lie on the terrain if x and y were swapped: is the northing first?"
    elif up == "z" and not np.isnan(other.low[2]) and overlaps((other.low[[0, 2]], other.high[[0, 2]]), ground):
        yield f"{other.name} would lie on the terrain if y and z were swapped: does y point up in it?"
    elif is_near_the_origin(ground):
        return
    elif unit := _unit_of(box, ground):
        yield f"{other.name} would lie on the terrain if it were {unit}"
    elif unit := _unit_of(ground, box):
        yield f"{other.name} would lie on the terrain if the terrain were {unit}; give its file `unit`"


def _unit_of(box: Box, ground: Box) -> str | None:
    """Return the unit, such as "in feet", in which a misplaced box would lie on the terrain; None if no unit fits.

    box : extent of the input in plan; ground : extent of the terrain in plan
    """
    return next((unit for scale, unit in SCALES.items() if overlaps((box[0] * scale, box[1] * scale), ground)), None)


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
        corners = transformed_places(other.file or Path(other.name), np.array(plan_box(other, "z")), WGS84, crs)
    except InputError:
        return sentence
    low, high = corners.min(axis=0), corners.max(axis=0)
    if not overlaps((low, high), ground):
        return (f"{sentence}; transformed to {crs}, {box_in_words(low, high)}, it is off the terrain, "
                f"{box_in_words(*ground)}: is it of another site, or has the terrain another reference system or a "
                "local grid?")  # fmt: skip
    command = "" if other.file is None else f": {transforming(other, WGS84, crs)}"
    return f"{sentence}; transformed to {crs} it lies on it{command}"


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


def is_in_opposite_heights(other: Extent, terrain: Extent) -> bool:
    """Return True if an input lies on the terrain in plan and at its heights, but only after a change of their sign.

    z must point up in the scene. The result is False for an input without heights.
    """
    is_on_it = overlaps(plan_box(other, "z"), plan_box(terrain, "z"))
    return is_on_it and not np.isnan(other.low[2]) and _is_upside_down(other, terrain)


def _is_upside_down(other: Extent, terrain: Extent) -> bool:
    """Return True if the elevations of an input overlap those of the terrain only after a change of sign."""
    low, high = terrain.low[2], terrain.high[2]
    if other.low[2] <= high and low <= other.high[2]:
        return False
    return bool(-other.high[2] <= high and low <= -other.low[2])


def are_axes_known(terrain: Extent, others: Sequence[Extent], up: str) -> bool:
    """Return True if coordinates show which of the terrain's axes points north.

    The coordinates of the terrain show the order of the axes if the northings are larger than any easting can be. The
    file of another input shows the order if the input lies on the terrain, but would lie elsewhere with swapped axes.
    Coordinates in the scene file show nothing, because `rpf3d new` takes these coordinates from the terrain.
    terrain : extent of the terrain; others : extents of the other inputs; up : the axis that points up in the input
    """
    ground = plan_box(terrain, up)
    if up == "z" and (is_northing_first(ground) or is_northing_first(swapped(ground))):
        return True
    boxes = [plan_box(other, up) for other in others if other.file is not None]
    return any(overlaps(box, ground) and not overlaps(swapped(box), ground) for box in boxes)
