"""Import the grids of STONE or r.stone as a scene (docs/howto/imports.md; the manual of r.stone)."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.imports.classes import Classes, classes_of, facets_of_cells
from rpf3d_core.imports.folder import check_new_folder
from rpf3d_core.imports.grids import DEM, Cells, Grids, find_grids, read_grids, refuse_where, require
from rpf3d_core.imports.imported import SOURCES as FOLDER
from rpf3d_core.imports.imported import (
    Imported,
    ImportedScene,
    binning,
    shifted_maps,
    terrain_name,
    write_imported,
    zones_of,
)
from rpf3d_core.imports.scene_text import (
    HOLDS_DEG,
    SceneText,
    comment,
    counted,
    names_of,
    normal,
    number,
    span,
    stopping,
)
from rpf3d_core.imports.stone_sources import SOURCES, STOP, Start, StoneStarts, source_rocks, starts_of
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.models.keys import GroundSpec

PROGRAM = "STONE"
NORMAL, TANGENTIAL, FRICTION = "nrest", "trest", "friction"
NEEDED = (DEM, SOURCES, NORMAL, TANGENTIAL, FRICTION)
"""Names of the grids that the import needs, as in the manual of r.stone."""

GRAVITY = 9.805
START_SPEED, START_VARIATION = 1.0, 0.1
"""Start speed of rocks (m/s), and its relative variation (-) among the rocks of a cell; both are r.stone's defaults.

The distribution of the variation is unconfirmed.
"""
STOP_SPEED = 3.0
"""Speed below which a rock stops (m/s): r.stone's default."""
VARIATION, SD = 0.1, 0.05
"""Largest relative change (-) and relative standard deviation (-) of a coefficient between impacts.

Coefficients have a normal distribution within a tenth of their value (manual). The standard deviation is unconfirmed.
"""
STEEPEST_TANGENT = 3.0
"""Largest value (-) of the friction grid; a larger number is probably an angle in degrees.

The value is the tangent of 71.6 degrees; the largest published tangent is 0.95.
"""
PERCENT = 100.0

ROLLING, ROLLING_KEY = "rolling_stone", "rolling_friction"
"""Name of the ground model with STONE's rolling rule, and the key of a material that this model needs.

If this version of rpf3d has both, the import writes the coefficient as a comment: the scene has another ground model.
"""
AT_REST = (
    "it stops every rock whose bounces have died out: with both restitutions between 0 and 1 they end at rest, and the "
    "rule holds a slow rock on any slope"
)

HEAD = (
    f"Made by `rpf3d import stone` from an input set of {PROGRAM} or r.stone; docs/howto/imports.md says how.",
    "Speeds, gravity and stop_speed are r.stone's defaults: no grid holds them. A rock stops below stop_speed where "
    "it rolls or slides, not in flight.",
)


class Restitution(NamedTuple):
    """The unit of the restitution grids.

    unit : name of the unit; whole : number in a grid that means a restitution of 1: 100 or 1
    """

    unit: str
    whole: float


def import_stone(folder: Path, out: Path) -> Imported:
    """Write a scene folder from a set of STONE's grids, so that rpf3d can simulate the same slope.

    Raises
    ------
    InputError
        A grid is missing, damaged, does not lie on the cells of dem, or has a value out of range; or `out` is not
        empty or cannot be written.
    """
    check_new_folder(out)
    found = find_grids(folder, NEEDED)
    require(folder, found, NEEDED, PROGRAM)
    grids = read_grids(found)
    stops = source_rocks(grids) == STOP
    unit = _refuse_wrong_ground(grids, grids.ground & ~stops)
    starts = starts_of(grids)
    stops |= grids.values[NORMAL] == 0.0
    ground = [np.where(stops, 0.0, grids.values[name]) for name in (NORMAL, TANGENTIAL, FRICTION)]
    classes = classes_of((stops.astype(float), *ground), (False, True, True, True), facets_of_cells(grids.ground))
    return write_imported(out, _made(grids, classes, starts, unit))


def _refuse_wrong_ground(grids: Grids, needed: Cells) -> Restitution:
    """Refuse coefficients out of range in the needed cells (H, W), and return the unit of the restitution grids."""
    unit = _unit_of(grids, needed)
    for name in (NORMAL, TANGENTIAL):
        value = grids.values[name]
        wrong = needed & ~((value >= 0.0) & (value <= unit.whole))
        refuse_where(grids, name, wrong, f"must be from 0 to {unit.whole:g}: both restitutions are {unit.unit}")
    friction = grids.values[FRICTION]
    wrong = needed & ~((friction >= 0.0) & (friction <= STEEPEST_TANGENT))
    right = f"must be the tangent of the friction angle, from 0 to {STEEPEST_TANGENT:g}, not an angle"
    refuse_where(grids, FRICTION, wrong, right)
    return unit


def _unit_of(grids: Grids, needed: Cells) -> Restitution:
    """Return the unit of the restitution grids: percent if any number is above 1, else shares.

    Grids with different units are refused. needed : (H, W) True for cells whose values count
    """
    most = {name: float(np.nanmax(grids.values[name][needed], initial=0.0)) for name in (NORMAL, TANGENTIAL)}
    low, high = sorted(most, key=lambda name: most[name])
    if most[high] > 1.0 >= most[low] > 0.0:
        raise InputError(
            f"{grids.files[low]}: reaches {most[low]:g}, as shares do, but {grids.files[high].name} {most[high]:g}, as "
            "percent do; give both in percent, or both as shares"
        )
    return Restitution("percent", PERCENT) if most[high] > 1.0 else Restitution("shares of 1", 1.0)


def _made(grids: Grids, classes: Classes, starts: StoneStarts, unit: Restitution) -> ImportedScene:
    """Return the content of the scene folder: scene text, zones, materials and source points."""
    names = names_of([_zone_name(*row) for row in classes.values.tolist()])
    materials = [_material(row, unit) for row in classes.values.tolist()]
    sources = ["sources:"] + [line for start in starts.starts for line in _source(start)]
    text = SceneText(
        head=HEAD, left=[*_left(starts), *_binned(classes, unit), *shifted_maps(grids)], terrain=terrain_name(grids),
        zones=zones_of(classes, names, materials),
        rock=["# STONE knows no size: energies hold for this one.", "rock: {density: 2700, diameter: 1.0}"],
        sources=sources, models=_models(grids),
    )  # fmt: skip
    points = {f"{start.direction}.csv": start.points for start in starts.starts}
    return ImportedScene(
        text=text, taken=_taken(grids, classes, starts, unit), grids=grids, classes=classes, points=points
    )


def _zone_name(stops: float, normal_: float, tangential: float, friction: float) -> str:
    """Return the name of a zone: "stop", or its coefficients such as rn_35_rt_55_mu_0.65, in the unit of the grids."""
    return "stop" if stops else f"rn_{normal_:.4g}_rt_{tangential:.4g}_mu_{friction:.4g}"


def _material(ground: Sequence[float], unit: Restitution) -> list[str]:
    """Return the lines of a zone's material in the scene file, from the values of STONE's grids.

    ground : four numbers: flag (not 0 if rocks stop in the zone), normal and tangential restitution in the grids'
        unit, and tangent of the friction angle (-)
    """
    stops, normal_, tangential, friction = ground
    if stops:
        holds = math.tan(math.radians(HOLDS_DEG))
        lines = stopping("cells of -1, or of no normal restitution: rocks that meet them stop")
        return [*lines, *_rolling(number(holds))]
    return [
        f"normal_restitution: {_within_a_tenth(normal_ / unit.whole)}",
        f"tangential_restitution: {_within_a_tenth(tangential / unit.whole)}",
        f"friction_angle_deg: {_angle(friction)}   # tan = {number(friction)}",
        *_rolling(_within_a_tenth(friction, math.inf)),
        "draw: per_impact",
    ]


def _within_a_tenth(value: float, most: float = 1.0) -> str:
    return normal(value, SD * value, (1.0 - VARIATION) * value, min((1.0 + VARIATION) * value, most))


def _angle(tangent: float) -> str:
    """Return the distribution of the friction angle (degrees) for the scene file, from the tangent of the mean angle.

    The tangents of the smallest and largest angle are a tenth smaller and a tenth larger than `tangent`.
    """
    low, mean, high = (math.degrees(math.atan(share * tangent)) for share in (1.0 - VARIATION, 1.0, 1.0 + VARIATION))
    return normal(mean, SD / VARIATION * 0.5 * (high - low), low, high)


def _rolling(friction: str) -> list[str]:
    """Return the line of a material for STONE's rolling rule; [] if this version of rpf3d does not have the rule.

    The line is a comment, because the ground model of the scene does not use the coefficient.

    friction : coefficient or distribution, as text
    """
    return [f"# {ROLLING_KEY}: {friction}"] if _has_rolling() else []


def _has_rolling() -> bool:
    return ROLLING in GroundSpec.model_fields and ROLLING_KEY in Material.model_fields


def _source(start: Start) -> list[str]:
    """Return the lines of a source in the scene file; a source has all rocks that start in one direction."""
    length = math.hypot(*start.step)
    vx, vy = (number(START_SPEED * step / length) for step in start.step)
    spread = number(START_SPEED * START_VARIATION)
    return [
        f"  - name: {start.direction}",
        f"    points_file: {FOLDER}/{start.direction}.csv",
        f"    rocks: {start.rocks}",
        "    above_ground: 0",
        f"    velocity: [{vx}, {vy}, 0]   # {START_SPEED:g} m/s towards the steepest neighbour",
        f"    velocity_spread: [{spread}, {spread}, 0]   # unconfirmed: r.stone's law is not known",
    ]


def _models(grids: Grids) -> list[str]:
    needs = f"it needs the {ROLLING_KEY} of each material, left as a comment above"
    rolling = comment(f"{ROLLING} is STONE's own rule ({needs}), but {AT_REST}") if _has_rolling() else []
    return [
        "rebound: constant", *rolling, "ground: sliding", f"stop_speed: {STOP_SPEED:g}", f"gravity: {GRAVITY:g}",
        "hazard:", f"  cell: {number(grids.cell)}   # that of the grids, to compare with r.stone's counter",
    ]  # fmt: skip


def _left(starts: StoneStarts) -> list[str]:
    """Return sentences for the user on features of STONE that the scene does not have."""
    left = [
        "when flight turns to rolling (below 5 m/s and 3 m between impacts): here a rock bounces until it would rise "
        "less than smallest_bounce, and slides from then on",
        "rolling: rocks slide with the friction angle whose tangent the grid gives, and stop sooner than by STONE's "
        "rule (at a speed of 10 m/s on a slope of 20 degrees with friction 0.5: after 36.3 m instead of 44.1 m)",
        "new random coefficients in each cell: here each impact has random coefficients, within "
        f"{VARIATION:.0%} of their value, with a standard deviation of {SD:.0%} of it, which is unconfirmed",
        "parameters of a calculation, which are in no grid: velocities of start and stop are r.stone's defaults",
    ]
    if starts.rising:
        cells = counted(starts.rising, "source cell")
        left.append(f"{cells} without a lower neighbour: rocks start towards the neighbour that rises least")
    if starts.left_out:
        cells = counted(starts.left_out, "source cell")
        left.append(f"{cells} at the rim of the ground, without all eight neighbours")
    return left


def _binned(classes: Classes, unit: Restitution) -> list[str]:
    restitution = [f"{name} ({unit.unit})" for name in (NORMAL, TANGENTIAL)]
    return binning(classes, ["stop cells", *restitution, f"{FRICTION} (-)"])


def _taken(grids: Grids, classes: Classes, starts: StoneStarts, unit: Restitution) -> list[str]:
    """Return sentences for the user on what was imported: terrain, zones and sources."""
    rows, columns = grids.ground.shape
    _, *coefficients = classes.values[classes.values[:, 0] == 0.0].T
    spans = [span(values, "") for values in coefficients if len(values)]
    ranges = [f"{name} {text}".rstrip() for name, text in zip((NORMAL, TANGENTIAL, FRICTION), spans, strict=False)]
    return [
        f"terrain: {rows} by {columns} cells of {number(grids.cell)} m, {int(classes.facets.sum()):,} facets",
        f"zones: {len(classes.values)}; restitution read as {unit.unit}; {', '.join(ranges)}",
        f"sources: {counted(starts.cells, 'cell')}, {counted(sum(start.rocks for start in starts.starts), 'rock')}",
    ]
