"""Read the terrain of a scene from files, or make it: one welded mesh whose facets all have the same winding."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.grids import DEM_EXTENSIONS, read_dem
from rpf3d_core.formats.meshes import EXPORTS, MESH_READERS
from rpf3d_core.formats.precision import lost_precision
from rpf3d_core.formats.reference_system import (
    IN_METRES,
    short_name,
    stated_reference_system,
    system_in_metres,
    unit_unlike_metre,
)
from rpf3d_core.formats.surface import FileMesh, facet_count, in_metres, usable
from rpf3d_core.formats.units import LENGTHS, METRE
from rpf3d_core.formats.whole_file import read_whole
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.terrain import TerrainFile, TerrainSpec
from rpf3d_core.setup.berms import berm_warnings, with_berms, with_zones_of_berms
from rpf3d_core.setup.drawn_zones import with_drawn_zones
from rpf3d_core.setup.split_zones import split_zones
from rpf3d_core.setup.warnings.open_seams import open_seams
from rpf3d_core.setup.warnings.overlapping_files import duplicate_warnings, overlap_warnings, shared_window
from rpf3d_core.terrain.benches.slope import benches_terrain
from rpf3d_core.terrain.closed_seams import ClosedTerrain, with_closed_seams
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray, Frame, Up
from rpf3d_core.terrain.mesh.edges import Index, edges_of
from rpf3d_core.terrain.mesh.faults import FaultReport, fault_report
from rpf3d_core.terrain.mesh.welding import weld
from rpf3d_core.terrain.mesh.winding import Winding, repair_winding
from rpf3d_core.terrain.mesh.zero_area import NO_AREA_AT_ALL
from rpf3d_core.terrain.pit.synthetic import pit_terrain

BLOCK = 2**14
"""Number of points that are rotated at a time, so that they stay in the processor's cache."""

IN_SMALL_UNITS = "is the file in millimetres or centimetres? Give it `unit: mm` or `unit: cm` (`rpf3d new`: --unit mm)"
"""Advice in the error about a terrain that is too far from the origin in metres."""


def read_terrain(scene: Scene) -> tuple[Terrain, FaultReport]:
    """Return the terrain of a scene, ready to fly over, and the faults that were found and repaired.

    Files are read in order, rotated to z up, moved to a local origin of whole metres and welded; a synthetic terrain is
    made instead. All facets keep their order, faulty facets included, so facet numbers in the run equal facet numbers
    in the files. Then berms are added: the first part of each facet that a berm cuts keeps the number, and the other
    parts follow after all facets. Then zones drawn as polygons are assigned: later polygons replace earlier polygons,
    but a berm stays a separate zone. Then narrow open seams are closed (`terrain.mesh.close_seams`); cut facets keep
    their numbers as with berms. Last, the zones in `terrain.split` are split by height.

    Raises
    ------
    InputError
        If a file is refused (see `read_surface`), a file is a grid although `up` is y, no facet has an area, or a
        polygon contains the middle of no facet (the message names the file); or if a berm or a zone to split is refused
        (the message names the key).
    """
    raw, files, remarks = _raw_terrain(scene.terrain)
    bare, raw = raw, with_berms(raw, scene)
    remarks = (*remarks, *berm_warnings(bare, scene))
    del bare
    edges = edges_of(raw.triangles, len(raw.vertices))
    winding = repair_winding(raw.vertices, raw.triangles, edges)
    drawn, sizes = with_drawn_zones(replace(raw, triangles=winding.triangles), scene)
    terrain = with_zones_of_berms(drawn, raw, scene)
    closed = with_closed_seams(terrain, edges)
    terrain, edges, _, seams = closed
    if seams.closed:
        winding = _winding_after(closed, winding)
        terrain = replace(terrain, triangles=winding.triangles)
    terrain, notes = split_zones(terrain, scene, edges)
    report = fault_report(terrain, winding, edges, files)
    report = replace(
        report,
        remarks=(*remarks, *sizes, *duplicate_warnings(report), *open_seams(terrain, seams), *notes),
        closed_seams=seams.closed,
        added_facets=len(closed.parent),
        widest_closed_seam=seams.widest,
    )
    if report.zero_area_facets == report.triangles:
        raise TerrainError(f"{', '.join(str(file.path) for file in scene.terrain.files or ())}: {NO_AREA_AT_ALL}")
    return terrain, report


def _winding_after(closed: ClosedTerrain, before: Winding) -> Winding:
    """Return the winding of a terrain whose seams were closed; a closed seam may have joined components of the mesh.

    In the result, `flipped` compares with the file: True for a facet that only one of the two repairs turned over.

    before : winding of the terrain before its seams were closed
    """
    after = repair_winding(closed.terrain.vertices, closed.terrain.triangles, closed.edges)
    flipped = np.concatenate([before.flipped, before.flipped[closed.parent]])
    return after._replace(flipped=flipped ^ after.flipped)


def read_surface(path: Path, unit: str | None = None) -> FileMesh:
    """Return the points and triangles of one terrain file after checks, in the file's coordinates.

    unit : key of the unit in which the scene reads the file; metres if None

    Raises
    ------
    TerrainError
        If the file is missing, empty, damaged, of unknown format, in degrees, has too many facets, or has facets with
        vertices that are not finite or too far from the origin.
    """
    extension = _extension(path)
    reader = MESH_READERS.get(extension, read_dem if extension in DEM_EXTENSIONS else None)
    if reader is None:
        known = f"; known are {', '.join([*MESH_READERS, *DEM_EXTENSIONS])}"
        advice = f"; {EXPORTS[extension]}" if extension in EXPORTS else ""
        raise TerrainError(f"{path}: {extension or 'no extension'} is no known terrain format{advice}{known}")
    surface = read_whole(path, reader)
    surface = usable(path, surface, LENGTHS[unit or METRE][1], _remedy_of_distance(surface, unit or METRE))
    crs, remarks = system_in_metres(path, surface.crs, surface.points)
    return surface._replace(crs=crs, remarks=(*surface.remarks, *remarks))


def _remedy_of_distance(surface: FileMesh, unit: str) -> str:
    """Return advice for the error about a terrain that is too far from the origin.

    unit : key of the unit in which the scene reads the file
    """
    if surface.unit and surface.unit != unit:
        name, key = LENGTHS[surface.unit][0], surface.unit
        return f"the file states that it is in {name}: give it `unit: {key}` (`rpf3d new`: --unit {key})"
    return IN_SMALL_UNITS if unit == METRE else f"the file is read in {LENGTHS[unit][0]}: is this its unit?"


def _extension(path: Path) -> str:
    name = path.name.lower()
    return ".asc.gz" if name.endswith(".asc.gz") else path.suffix.lower()


def _raw_terrain(spec: TerrainSpec) -> tuple[Terrain, tuple[str, ...], tuple[str, ...]]:
    """Return the terrain, read or synthetic, the names of its files, and remarks on the files as sentences.

    For synthetic terrain, the only name describes the terrain, such as "synthetic pit", and there are no remarks.
    """
    if spec.pit is not None:
        return pit_terrain(spec.pit), ("synthetic pit",), ()
    if spec.benches is not None:
        return benches_terrain(spec.benches), ("slope of benches",), ()
    return _read_files(spec)


def _read_files(spec: TerrainSpec) -> tuple[Terrain, tuple[str, ...], tuple[str, ...]]:
    """Return the terrain of all files as one welded mesh, the file names, and remarks on the files as sentences.

    The facets still have the winding of the files.
    """
    files = spec.files or ()
    for file in files:
        if spec.up != "z" and _extension(file.path) in DEM_EXTENSIONS:
            raise TerrainError(f"{file.path}: the heights of a grid are z, so it cannot be read with `up: {spec.up}`")
    surfaces = [read_surface(file.path, file.unit) for file in files]
    remarks = tuple(
        remark
        for file, surface in zip(files, surfaces, strict=True)
        for remark in (*_remarks(file, surface), *_on_system_in_feet(file, surface, spec.crs))
    )
    surfaces = [in_metres(surface, file.unit) for file, surface in zip(files, surfaces, strict=True)]
    zone, zones = _zones(files, surfaces)
    points, frame = _local_points([surface.points for surface in surfaces], spec.up)
    corners, facets = _corners(surfaces), [facet_count(surface) for surface in surfaces]
    shared = shared_window(points[:, :2], [len(surface.points) for surface in surfaces])
    del surfaces
    vertices, index = weld(points, spec.weld)
    triangles = (index if corners is None else index[corners]).reshape(-1, 3)
    terrain = Terrain(vertices=vertices, triangles=triangles, zone=zone, zones=zones, frame=frame)
    overlaps = overlap_warnings(terrain, facets, [file.path for file in files], shared)
    return terrain, tuple(file.path.name for file in files), (*remarks, *overlaps)


def surfaces_in_metres(spec: TerrainSpec) -> list[FileMesh]:
    """Return the points and triangles of all terrain files in metres; errors are as in `read_surface`."""
    return [in_metres(read_surface(file.path, file.unit), file.unit) for file in spec.files or ()]


def _remarks(file: TerrainFile, surface: FileMesh) -> Iterator[str]:
    """Yield sentences on a terrain file: what was left out, lost precision of its coordinates, and its unit."""
    yield from surface.remarks
    if lost := lost_precision(file.path, surface, LENGTHS[file.unit or METRE][1]):
        yield lost
    if surface.unit and (file.unit or METRE) != surface.unit:
        name, used = LENGTHS[surface.unit][0], LENGTHS[file.unit or METRE][0]
        advice = f"give the file `unit: {surface.unit}` (`rpf3d new`: --unit {surface.unit})"
        yield (
            f"{file.path.name}: states that it is in {name}, and is read in {used}; templates often have a wrong unit, "
            f"so compare the extents: if it is in {name}, "
            f"{f'leave out its `unit: {file.unit}`' if surface.unit == METRE else advice}"
        )


def _on_system_in_feet(file: TerrainFile, surface: FileMesh, crs: str | None) -> Iterator[str]:
    """Yield sentences on a file that states a reference system in feet or another unit than the metre.

    The terrain is in metres, so it does not have this system. The statement may be wrong, so the file is not refused.

    surface : content of the file; crs : reference system of the terrain, None if unknown
    """
    stated = stated_reference_system(file.path)
    unit = None if stated is None else unit_unlike_metre(stated)
    if stated is None or unit is None:
        return
    states = f"{file.path.name}: states {short_name(stated)}, which is in {unit.name}"
    if unit.key is None:
        yield f"{states}, and is read in {LENGTHS[file.unit or METRE][0]}; reproject it to a system in metres"
    elif file.unit != unit.key and surface.unit != unit.key:  # `_remarks` reports a unit that the file itself states
        yield (
            f"{states}, and is read in {LENGTHS[file.unit or METRE][0]}: if its coordinates and heights are in "
            f"{unit.name}, give it `unit: {unit.key}` (`rpf3d new`: --unit {unit.key})"
        )
    if crs is None:
        yield (
            f"{states}, but the terrain is in metres, so maps have no reference system; name {IN_METRES}, as "
            "`terrain.crs` (`rpf3d new`: --crs)"
        )


def _zones(files: Sequence[TerrainFile], surfaces: list[FileMesh]) -> tuple[IntArray, tuple[str, ...]]:
    """Return the zone (F,) of each facet of all files, and the names of the zones.

    Layers of a file are zones, unless the scene names one zone for the file.
    """
    parts, names = [], list[str]()
    for file, surface in zip(files, surfaces, strict=True):
        layers = surface.zone is not None and file.has_layers_as_zones
        own = surface.zones if layers else (file.zone,)
        names += [name for name in own if name not in names]
        number = np.array([names.index(name) for name in own], np.int32)
        within = surface.zone if layers else np.zeros(facet_count(surface), np.int32)
        parts.append(number[within])
    return np.concatenate(parts), tuple(names)


def _local_points(parts: list[FloatArray], up: Up) -> tuple[FloatArray, Frame]:
    """Return all points (N, 3) m in the local frame, and the frame; its origin is the box centre in whole metres."""
    low = np.min([[column.min() for column in part.T] for part in parts], axis=0)
    high = np.max([[column.max() for column in part.T] for part in parts], axis=0)
    x, y, z = np.round(Frame(up=up).directions_to_local(0.5 * low + 0.5 * high)).tolist()
    frame = Frame((x + 0.0, y + 0.0, z + 0.0), up)
    points = np.empty((3, sum(len(part) for part in parts))).T
    begin = 0
    for part in parts:
        for row in range(0, len(part), BLOCK):
            block = frame.points_to_local(part[row : row + BLOCK])
            points[begin + row : begin + row + len(block)] = block
        begin += len(part)
    return points, frame


def _corners(surfaces: list[FileMesh]) -> Index | None:
    """Return the corners of all facets as point numbers (F, 3); None if all files list three points for each facet.

    In this case, the corners of facet f are the points 3 f, 3 f + 1 and 3 f + 2.
    """
    if all(surface.triangles is None for surface in surfaces):
        return None
    parts, begin = [], 0
    for surface in surfaces:
        own = surface.triangles
        if own is None:
            own = np.arange(len(surface.points), dtype=np.int32).reshape(-1, 3)
        parts.append(own + np.int32(begin))
        begin += len(surface.points)
    return np.concatenate(parts)
