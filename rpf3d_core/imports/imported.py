"""Write the scene folder of an import (terrain, zones, sources, scene file), and read the scene as a check."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from rpf3d_core.formats.cell_outlines import cell_outlines, write_outlines
from rpf3d_core.imports.classes import MOST_CLASSES, Classes
from rpf3d_core.imports.folder import new_folder
from rpf3d_core.imports.grids import DEM, SAME_CORNER, Cells, Grids
from rpf3d_core.imports.scene_text import MaterialZone, SceneText, number
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.frame import FloatArray

SCENE, ZONES, SOURCES = "scene.yaml", "zones", "sources"
COMPANIONS = (".prj",)
"""Extensions of files that are copied together with the elevation grid: a .prj file states its reference system."""


class Imported(NamedTuple):
    """The report of an import.

    scene : path of the scene file; taken : sentences on imported input; left : sentences on input that is not imported
    """

    scene: Path
    taken: Sequence[str]
    left: Sequence[str]


class ImportedScene(NamedTuple):
    """The content of a scene folder that an import is about to write.

    text : content of the scene file; taken : sentences on imported input; grids : input grids
    classes : classes of the cells; points : source points (N, 2) m in plan, by file name
    outlines : cells (H, W) whose outlines are written to a file, by file name
    extra : files that are copied into the folder, but not used by the scene
    """

    text: SceneText
    taken: Sequence[str]
    grids: Grids
    classes: Classes
    points: Mapping[str, FloatArray]
    outlines: Mapping[str, Cells] = MappingProxyType({})
    extra: Sequence[Path] = ()


def write_imported(out: Path, made: ImportedScene) -> Imported:
    """Write the scene folder of an import, then read the new scene to check that it is valid.

    out : the new folder; made : its content

    Raises
    ------
    InputError
        As `new_folder`, or the scene is not valid; no folder is left in this case.
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
    return Imported(scene=out.resolve() / SCENE, taken=made.taken, left=made.text.left)


def terrain_name(grids: Grids) -> str:
    """Return the file name that the elevation grid gets in the scene folder."""
    return grids.files[DEM].name.lower()


def zones_of(classes: Classes, names: Sequence[str], materials: Sequence[Sequence[str]]) -> list[MaterialZone]:
    """Return the zones of an imported scene, one for each class of cells.

    The class with most facets needs no polygons: its zone is all terrain outside the other zones.

    names : (C,) zone names; materials : (C,) lines of YAML that describe the material of each zone
    """
    largest = int(np.argmax(classes.facets))
    files = [None if i == largest else f"{ZONES}/{name}.geojson" for i, name in enumerate(names)]
    return [
        MaterialZone(name=name, material=lines, polygons=file)
        for name, lines, file in zip(names, materials, files, strict=True)
    ]


def binning(classes: Classes, what: Sequence[str]) -> list[str]:
    """Return a warning if bins put cells with different values into one class; [] if each class has equal cells.

    The warning states the number of classes, and the largest differences between the values of a cell and the values of
    its class.

    what : (K,) name and unit of each value of a class
    """
    if classes.distinct <= MOST_CLASSES:
        return []
    errors = [f"{name} by {number(error)}" for name, error in zip(what, classes.error, strict=True) if error > 0.0]
    return [
        f"{classes.distinct:,} different grounds were put into {len(classes.values)} classes, each with the mean of "
        f"its cells; this changes at most {', '.join(errors)}"
    ]


def shifted_maps(grids: Grids) -> list[str]:
    """Return a warning if the cells of hazard maps do not coincide with the cells of the grids; [] if they coincide.

    The cells of hazard maps begin at whole multiples of the cell size.
    """
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
