"""Write a scene for a terrain file, with comments on the content of the file and on what the user must decide."""

import json
import os
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.errors import InputError, SceneError
from rpf3d_core.formats.reference_system import why_unusable
from rpf3d_core.formats.units import METRE
from rpf3d_core.imports.crests import Crest, crests_of, listed
from rpf3d_core.imports.folder import check_new_folder, new_folder
from rpf3d_core.imports.new_scene_text import (
    SCHEMA,
    NewScene,
    ZoneFound,
    crest_numbers,
    scene_text,
    words_on_crest,
)
from rpf3d_core.imports.scene_text import counted
from rpf3d_core.scene.listings.json_schema import scene_schema
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_of_values
from rpf3d_core.setup.split_zones import words_on_joined, words_on_merged, words_on_parts
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.setup.warnings.terrain_coordinates import is_misread
from rpf3d_core.setup.warnings.wrong_coordinates import placing_notes
from rpf3d_core.terrain.facets import Terrain, area_vectors
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.zone_parts import heights_of_zone, parts_by_height, with_parts

SCENE = "scene.yaml"
MOST_CRESTS = 8
"""Largest number of crests that a new scene lists."""


class FileChoice(NamedTuple):
    """The user's choices for reading a terrain file.

    up : axis that points up, "y" or "z"; unit : unit of the coordinates, a key of `units.LENGTHS`
    crs : name of the coordinate reference system, None for the system that the file states
    """

    up: str = "z"
    unit: str = METRE
    crs: str | None = None


class NewSceneFiles(NamedTuple):
    """The new scene file, and the sentences that the user reads after it was written.

    path : of the scene file
    sentences : sentences on the content of the terrain file; warnings : sentences on what the user must check
    """

    path: Path
    sentences: Sequence[str]
    warnings: Sequence[str]


def write_new_scene(folder: Path, terrain_file: Path, choice: FileChoice) -> NewSceneFiles:
    """Write a scene file for a terrain file into a new folder, and the JSON Schema of scene files as a second file.

    Raises
    ------
    InputError
        The folder is not empty or cannot be written, or the terrain file is refused.
    """
    check_new_folder(folder)
    scene = _bare_scene(terrain_file, choice)
    terrain, faults = read_terrain(scene)
    edges = edges_of(terrain.triangles, len(terrain.vertices))
    parts = parts_by_height(terrain, edges) if len(terrain.zones) > 1 else []
    unsplit = words_on_joined(terrain, edges) if len(terrain.zones) > 1 else ()
    for each in parts:
        terrain = with_parts(terrain, each)
    found = _found(scene, terrain, faults, choice)._replace(split=[each.zone for each in parts])
    with new_folder(folder) as part:
        target = folder.resolve()
        found = found._replace(path=Path(os.path.relpath(terrain_file.resolve(), target)).as_posix())
        (part / SCENE).write_text(scene_text(found), encoding="utf-8")
        (part / SCHEMA).write_text(json.dumps(scene_schema(), indent=2) + "\n", encoding="utf-8")
    read_scene(folder / SCENE)
    known = scene.model_copy(update={"terrain": scene.terrain.model_copy(update={"crs": found.crs})})
    split = [*unsplit, *([words_on_parts(parts, terrain.frame.origin[2])] if parts else [])]
    joined = words_on_joined(terrain, edges) if len(terrain.zones) > 1 else ()
    remarks = [remark for remark in faults.remarks if remark not in split]
    notes = (*placing_notes(known, faults, ()), *remarks, *words_on_merged(parts), *joined)
    return NewSceneFiles(path=folder / SCENE, sentences=_sentences(found), warnings=notes)


def _bare_scene(path: Path, choice: FileChoice) -> Scene:
    """Return a scene that only serves to read the terrain file; material and source of the scene are placeholders.

    Raises
    ------
    InputError
        The file is missing, or the reference system cannot be used; the message names the option of `rpf3d new`.
    """
    if not path.is_file():
        raise InputError(f"--terrain is {str(path)!r}, but there is no such file")
    if choice.crs is not None and (why := why_unusable(choice.crs)):
        raise InputError(f"--crs {why}")
    path = path.resolve()
    file: dict[str, Any] = {"path": path} if choice.unit == METRE else {"path": path, "unit": choice.unit}
    terrain = {"files": (file,), "up": choice.up} | ({} if choice.crs is None else {"crs": choice.crs})
    values = {
        "terrain": terrain, "materials": {"default": {"normal_restitution": 0.5, "tangential_restitution": 0.5}},
        "sources": ({"name": "none", "points": ((0.0, 0.0, 0.0),)},),
    }  # fmt: skip
    try:
        return scene_of_values(values, path)
    except SceneError as fault:
        raise InputError(str(fault).replace("parameter `terrain.crs`", "--crs")) from None


def _found(scene: Scene, terrain: Terrain, faults: FaultReport, choice: FileChoice) -> NewScene:
    """Return a summary of a terrain file (extents, zones, crests), from which the text of the new scene is made.

    `path` of the result is "", and `split` is empty: the caller sets both.

    faults : report on the mesh; choice : what the user stated about the file
    """
    points = terrain.frame.points_to_input(terrain.vertices)
    crs = choice.crs or next(iter(scene.terrain.crs_of_files().values()), None)
    misread = is_misread(scene, faults)
    crests = [] if misread else [_in_input(terrain, crest) for crest in listed(crests_of(terrain), MOST_CRESTS)]
    return NewScene(
        path="", choice_up=choice.up, unit=choice.unit, crs=crs, crs_is_stated=choice.crs is None,
        triangles=len(terrain.triangles), holes=faults.holes, low=points.min(axis=0).tolist(),
        high=points.max(axis=0).tolist(), zones=_zones(terrain),
        crests=crests, misread=misread,
        highest=points[int(np.argmax(terrain.vertices[:, 2]))].tolist(),
    )  # fmt: skip


def _zones(terrain: Terrain) -> list[ZoneFound]:
    """Return the area (m2), mean slope (degrees, weighted by area) and heights (m) of each zone of a terrain."""
    areas = area_vectors(terrain.vertices, terrain.triangles)
    size = np.linalg.norm(areas, axis=1)
    flatness = np.clip(np.divide(areas[:, 2], size, out=np.ones_like(size), where=size > 0.0), -1.0, 1.0)
    slope = np.degrees(np.arccos(flatness))
    found = []
    for number, name in enumerate(terrain.zones):
        mine = terrain.zone == number
        weight = float(size[mine].sum())
        mean = float((slope[mine] * size[mine]).sum() / weight) if weight else 0.0
        low, high = heights_of_zone(terrain, number) if mine.any() else (float("nan"),) * 2
        base = terrain.frame.origin[2]
        found.append(ZoneFound(name=name, area=weight, slope=mean, low=low + base, high=high + base))
    return found


def _in_input(terrain: Terrain, crest: Crest) -> Crest:
    """Return a crest with its points in the coordinates of the input."""
    points: FloatArray = terrain.frame.points_to_input(crest.points)
    return crest._replace(points=points)


def _sentences(found: NewScene) -> list[str]:
    """Return sentences for the screen on the content of the terrain file: triangles, holes, zones and crests."""
    zones = ", ".join(zone.name for zone in found.zones[:12]) + (", ..." if len(found.zones) > 12 else "")
    split = [f"split by height, numbered from the top: {', '.join(found.split)}"] if found.split else []
    size = f"{counted(found.triangles, 'triangle')}, {counted(found.holes, 'hole')}"
    return [size, f"zones: {zones}", *split, *_on_crests(found)]


def _on_crests(found: NewScene) -> list[str]:
    """Return sentences on the crests of a new scene: number and data of the crests, and why one is the source."""
    if found.misread:
        return ["no crest searched, because the unit or the axes look wrong: see the first note"]
    if not found.crests:
        return ["no crest found: the source is a guess, so place it yourself"]
    numbers = crest_numbers(found)
    words = [f"crest_{number}: {words_on_crest(crest, found.choice_up)}"
             for number, crest in sorted(zip(numbers, found.crests, strict=True), key=itemgetter(0))]  # fmt: skip
    reason = ", because rocks from there may fall farthest; the others are comments in the scene"
    why = "" if len(words) == 1 else reason
    return [f"{counted(len(words), 'crest candidate')}; the source is crest_{numbers[0]}{why}", *words]
