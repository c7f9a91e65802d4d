"""Import an input folder of Rockyfor3D as a scene (docs/howto/imports.md)."""

from pathlib import Path

import numpy as np

from rpf3d_core.imports.classes import Classes, classes_of, facets_of_cells
from rpf3d_core.imports.folder import check_new_folder
from rpf3d_core.imports.grids import DEM, Grids, find_grids, read_grids, refuse_where, require
from rpf3d_core.imports.imported import (
    SOURCES,
    Imported,
    ImportedScene,
    binning,
    shifted_maps,
    terrain_name,
    write_imported,
    zones_of,
)
from rpf3d_core.imports.rockyfor3d_blocks import AXES, DENSITY, IGNORED_RIM, SHAPE, Blocks, blocks_of
from rpf3d_core.imports.rockyfor3d_forest import (
    FOREST,
    NETS,
    WOODED,
    ImportedForest,
    forest_lines,
    forest_of,
    has_forest,
    without_effect,
    without_effect_lines,
)
from rpf3d_core.imports.rockyfor3d_ground import SOILS, SWALLOWS, energy_share, tangential_restitution
from rpf3d_core.imports.scene_text import SceneText, comment, counted, names_of, normal, number, span, stopping, uniform

PROGRAM = "Rockyfor3D"
SOIL, ROUGHNESS = "soiltype", ("rg70", "rg20", "rg10")
NEEDED = (DEM, DENSITY, *AXES, SHAPE, *ROUGHNESS, SOIL)
ASSUMED_FRICTION_DEG = 30.0

HEAD = (
    f"Made by `rpf3d import rockyfor3d` from an input folder of {PROGRAM}; docs/howto/imports.md says how.",
    "R_n, the obstacles' shares and the formula of R_t are unconfirmed (general knowledge; the manual was not read): "
    "look at them before you trust a runout.",
)
ALWAYS_LEFT = (
    "how R_n falls with speed, and the spin: the model is `constant`, a lumped mass, unless you name another",
    "the depth that blocks sink into soft ground, which lowers R_t there as obstacles do: its formula depends on speed "
    "and is unconfirmed, so tangential_restitution of soils 1 to 4 is too high",
    "the classes of the fall direction after an impact: rocks leave in the plane of their velocity and the normal",
    "the settings of a calculation, which are not in the folder: rocks per cell (see `rocks`), variation of the "
    "volume, initial fall height",
    f"rolling as short bounces: ground is `sliding`, with a friction angle of {ASSUMED_FRICTION_DEG:g} degrees that is "
    "assumed and in no grid",
)


def import_rockyfor3d(folder: Path, out: Path) -> Imported:
    """Write a scene folder from an input folder of Rockyfor3D, so that rpf3d can simulate the same slope.

    Raises
    ------
    InputError
        A grid is missing, damaged, does not lie on the cells of dem, or has a value out of range; or `out` is not
        empty or cannot be written.
    """
    check_new_folder(out)
    found = find_grids(folder, (*NEEDED, *FOREST, *NETS))
    require(folder, found, NEEDED, PROGRAM)
    grids = read_grids(found)
    _refuse_wrong_ground(grids)
    blocks = blocks_of(grids)
    swallows = grids.values[SOIL] == SWALLOWS
    rough = tuple(np.where(swallows, 0.0, grids.values[name]) for name in ROUGHNESS)
    classes = classes_of((grids.values[SOIL], *rough), (False, True, True, True), facets_of_cells(grids.ground))
    return write_imported(out, _made(folder, grids, classes, blocks))


def _refuse_wrong_ground(grids: Grids) -> None:
    codes = f"must be a soil type from 0 to {len(SOILS) - 1}"
    refuse_where(grids, SOIL, grids.ground & ~np.isin(grids.values[SOIL], range(len(SOILS))), codes)
    for name in ROUGHNESS:
        refuse_where(grids, name, grids.ground & ~(grids.values[name] >= 0.0), "must be a height of at least 0 m")


def _made(folder: Path, grids: Grids, classes: Classes, blocks: Blocks) -> ImportedScene:
    """Return the content of the scene folder: scene text, zones, materials, source points and forest outline."""
    names = names_of([_zone_name(*row) for row in classes.values.tolist()])
    materials = [_material(int(soil), moh, blocks.radius) for soil, *moh in classes.values.tolist()]
    forest, extra = forest_of(folder, grids), without_effect(folder, grids.files)
    text = SceneText(
        head=HEAD,
        left=[*ALWAYS_LEFT, *_left(blocks), *_left_trees(forest, extra), *_binned(classes), *shifted_maps(grids)],
        terrain=terrain_name(grids), zones=zones_of(classes, names, materials), rock=_rock(blocks),
        sources=_sources(blocks, grids), models=[*_models(grids), *forest_lines(forest), *without_effect_lines(extra)],
    )  # fmt: skip
    points = {"cells.csv": grids.centres(blocks.cells)}
    outlines = {} if forest is None else {WOODED: forest.cells}
    return ImportedScene(
        text=text,
        taken=_taken(grids, classes, blocks),
        grids=grids,
        classes=classes,
        points=points,
        outlines=outlines,
        extra=extra,
    )


def _zone_name(soil: float, *moh: float) -> str:
    """Return the name of a zone from its soil type and roughness, such as soil_4_rg_0.05_0.1_0.3."""
    return f"soil_{soil:g}" + ("" if soil == SWALLOWS else f"_rg_{'_'.join(f'{height:.4g}' for height in moh)}")


def _material(soil: int, moh: list[float], radius: float) -> list[str]:
    """Return the lines of a zone's material in the scene file, from Rockyfor3D's soil type and obstacle heights.

    soil : code of the soil type; moh : (3,) m, obstacle heights rg70, rg20 and rg10; radius : of the mean block, m
    """
    ground = SOILS[soil]
    if soil == SWALLOWS:
        return stopping(f"{ground.name}: rocks that meet it stop")
    spread, shares = tangential_restitution(moh, radius), energy_share(moh, radius)
    obstacles = ", ".join(f"{height:.4g}" for height in moh)
    return [
        *comment(ground.name, f"obstacles rg70, rg20 and rg10: {obstacles} m; {span(shares, 'R_t')}"),
        f"normal_restitution: {uniform(ground.low, ground.high)}   # unconfirmed: R_n of soil type {soil}",
        f"tangential_restitution: {normal(*spread)}   # unconfirmed: the root of R_t",
        f"friction_angle_deg: {ASSUMED_FRICTION_DEG:g}   # assumed: in no grid",
        "draw: per_impact",
    ]


def _rock(blocks: Blocks) -> list[str]:
    """Return the lines on the rocks in the scene file: mean density, and distribution of the volumes of all rocks."""
    volume, density = blocks.volume, blocks.density
    drawn = normal(float(volume.mean()), float(volume.std()), float(volume.min()), float(volume.max()))
    of_cells = f"The blocks of {counted(len(volume), 'source cell')}"
    return [
        *comment(f"{of_cells}: {span(density, 'kg/m3')}, {span(volume, 'm3')}"),
        "rock:", f"  density: {number(float(density.mean()))}", f"  volume: {drawn}",
    ]  # fmt: skip


def _sources(blocks: Blocks, grids: Grids) -> list[str]:
    """Return the lines on the sources in the scene file: one source, with a rock at a random point of each source cell.

    The start height above the ground is the radius of the mean block, so that the mean block touches the ground.
    """
    half = number(0.5 * grids.cell)
    return [
        "sources:",
        "  - name: cells",
        f"    points_file: {SOURCES}/cells.csv",
        f"    rocks: {int(blocks.cells.sum())}   # one for each cell; more with `rpf3d run --rocks`",
        f"    spread: [{half}, {half}, 0]   # unconfirmed: anywhere in the cell",
        f"    above_ground: {number(blocks.radius)}   # the mean block's radius; the initial fall height adds to it",
    ]


def _models(grids: Grids) -> list[str]:
    return ["rebound: constant", "ground: sliding", "stop_speed: 0.5", "hazard:", f"  cell: {number(grids.cell)}"]


def _left(blocks: Blocks) -> list[str]:
    """Return sentences for the user on input that is not imported from this folder, except trees and nets."""
    left = []
    rim, gaps = blocks.left_out
    if rim:
        where = f"in the outer {IGNORED_RIM} rows and columns, which {PROGRAM} ignores, too"
        left.append(f"{counted(rim, 'source cell')} {where}")
    if gaps:
        left.append(f"{counted(gaps, 'source cell')} next to missing ground: a rock might start off the terrain")
    if len(np.unique(blocks.volume)) > 1:
        left.append("which block falls from which cell: every rock draws its volume from those of all source cells, "
                    "and tangential_restitution holds for the mean one, of a radius of "
                    f"{number(blocks.radius)} m")  # fmt: skip
    if len(np.unique(blocks.density)) > 1:
        left.append(f"densities of {span(blocks.density, 'kg/m3')}: the scene has their mean")
    left.append(f"the blocks' shape ({', '.join(blocks.shapes)}) beyond their volume: rocks are spheres of the same")
    return left


def _left_trees(forest: ImportedForest | None, extra: list[Path]) -> list[str]:
    """Return sentences for the user on trees and nets that are not imported; extra : the files that are only copied."""
    left = []
    if forest is not None:
        means = "how the forest differs from cell to cell: the scene has its means over the wooded cells"
        left.append(means if has_forest() else "the forest: this version has no such effect (a comment in the scene)")
    if extra:
        left.append(f"{', '.join(path.name for path in extra)}: copied and not read")
    return left


def _binned(classes: Classes) -> list[str]:
    return binning(classes, [SOIL, *(f"{name} (m)" for name in ROUGHNESS)])


def _taken(grids: Grids, classes: Classes, blocks: Blocks) -> list[str]:
    """Return sentences for the user on what was imported: terrain, zones, sources and rocks."""
    rows, columns = grids.ground.shape
    return [
        f"terrain: {rows} by {columns} cells of {number(grids.cell)} m, {int(classes.facets.sum()):,} facets",
        f"zones: {len(classes.values)}, of soil type and obstacles alike",
        f"sources: {counted(len(blocks.volume), 'cell')}, a rock each",
        f"rocks: {span(blocks.volume, 'm3')}, {span(blocks.density, 'kg/m3')}",
    ]
