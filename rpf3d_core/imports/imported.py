"""What all imports do at their end: terrain, zones and scene are written, read again, and told."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from rpf3d_core.imports.classes import MOST_CLASSES, Classes
from rpf3d_core.imports.folder import new_folder
from rpf3d_core.imports.grids import DEM, SAME_CORNER, Cells, Grids
from rpf3d_core.imports.scene_text import MaterialZone, SceneText, number
from rpf3d_core.results.cell_outlines import cell_outlines, write_outlines
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.frame import FloatArray

SCENE, ZONES, SOURCES = "scene.yaml", "zones", "sources"
COMPANIONS = (".prj",)
"""Files beside a grid that say more of it."""


class Imported(NamedTuple):
    """A scene that was made of an input folder.

    scene : its file ; taken, left : sentences about what was carried over, and what was not
    """

    scene: Path
    taken: Sequence[str]
    left: Sequence[str]


class ImportedScene(NamedTuple):
    """What an import has made of its grids, to be written.

    points : (N, 2) m in plan, of the rocks of each source, by the file's name
    outlines : cells (H, W) whose outlines are wanted, by the file's name
    extra : files that the scene does not use, to be copied beside it
    """

    text: SceneText
    taken: Sequence[str]
    grids: Grids
    classes: Classes
    points: Mapping[str, FloatArray]
    outlines: Mapping[str, Cells] = MappingProxyType({})
    extra: Sequence[Path] = ()


def write_imported(out: Path, made: ImportedScene) -> Imported:
    """Write a scene folder and read the scene in it.

    Raises
    ------
    InputError
        As `new_folder`; nothing is left then.
    """
    with new_folder(out) as folder:
        _copy_terrain(made.grids.files[DEM], folder)
        _write_zones(folder, made)
        _write_points(folder, made.points)
        for name, cells in made.outlines.items():
            write_outlines(folder / name, cell_outlines(cells.astype(np.int32), made.grids.transform)[1])
        for path in made.extra:
            shutil.copyfile(path, folder / path.name.lower())
        (folder / SCENE).write_text(str(made.text), encoding="utf-8")
        read_scene(folder / SCENE)
    return Imported(out.resolve() / SCENE, made.taken, made.text.left)


def terrain_name(grids: Grids) -> str:
    """The name of the elevation grid in the scene folder."""
    return grids.files[DEM].name.lower()


def zones_of(classes: Classes, names: Sequence[str], materials: Sequence[Sequence[str]]) -> list[MaterialZone]:
    """A zone for each class; the one with most facets is what the terrain is where no polygon says otherwise."""
    largest = int(np.argmax(classes.facets))
    files = [None if i == largest else f"{ZONES}/{name}.geojson" for i, name in enumerate(names)]
    return [MaterialZone(name, lines, file) for name, lines, file in zip(names, materials, files, strict=True)]


def binning(classes: Classes, what: Sequence[str]) -> list[str]:
    """A sentence where numbers were binned: how many classes there were, and what it changes at most.

    what : the name and unit of each of the K numbers
    """
    if classes.distinct <= MOST_CLASSES:
        return []
    errors = [f"{name} by {number(error)}" for name, error in zip(what, classes.error, strict=True) if error > 0.0]
    return [
        f"{classes.distinct:,} different grounds were put into {len(classes.values)} classes, each with the mean of "
        f"its cells; this changes at most {', '.join(errors)}"
    ]


def shifted_maps(grids: Grids) -> list[str]:
    """A sentence where the cells of hazard maps, which lie on whole multiples of a cell, are not those of the grids."""
    shift = [corner / grids.cell - round(corner / grids.cell) for corner in (grids.transform.c, grids.transform.f)]
    if max(map(abs, shift)) < SAME_CORNER:
        return []
    by = ", ".join(number(part * grids.cell) for part in shift)
    return [f"the place of the grids' cells in hazard maps: those lie on whole multiples of a cell, ({by}) m off"]


def _copy_terrain(dem: Path, folder: Path) -> None:
    shutil.copyfile(dem, folder / dem.name.lower())
    for companion in (dem.with_suffix(suffix) for suffix in COMPANIONS):
        if companion.is_file():
            shutil.copyfile(companion, folder / companion.name.lower())


def _write_zones(folder: Path, made: ImportedScene) -> None:
    rings = cell_outlines(made.classes.number, made.grids.transform)
    drawn = [(i, zone.polygons) for i, zone in enumerate(made.text.zones, start=1) if zone.polygons]
    if drawn:
        (folder / ZONES).mkdir()
    for i, path in drawn:
        write_outlines(folder / path, rings[i])


def _write_points(folder: Path, points: Mapping[str, FloatArray]) -> None:
    (folder / SOURCES).mkdir()
    for name, plan in points.items():
        lines = [f"{x!r},{y!r}" for x, y in plan.tolist()]
        (folder / SOURCES / name).write_text("\n".join(["x,y", *lines]) + "\n", encoding="utf-8")
