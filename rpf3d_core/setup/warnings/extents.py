"""Find where the terrain, sources, areas and other inputs of a scene lie, to print and to compare."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.formats.polylines import lines_along, read_lines
from rpf3d_core.formats.reference_system import stated_reference_system
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.releases import SourceSpec, source_points
from rpf3d_core.setup.areas import area_polygons
from rpf3d_core.setup.coverage import plain
from rpf3d_core.setup.sources import crest_points, source_outline
from rpf3d_core.setup.terrain import surfaces_in_metres
from rpf3d_core.terrain.frame import FloatArray, Up
from rpf3d_core.terrain.mesh.faults import FaultReport

TERRAIN = "terrain"
NOT_STATED = "CRS not stated"


class Extent(NamedTuple):
    """The extent of one input of a scene, in the input's own axes.

    name : of the input, such as "source west"; low, high : (3,) m, NaN along an axis without coordinates
    file : the file of the input; None if the scene has the coordinates
    crs : the input's own coordinate reference system; None if the input states none
    kind : of the input's geometries: "polygon", "line" or "point", as in `rpf3d import layer`
    above_ground : height (m) over the ground at which rocks start, in place of heights in the input; None if not given
    up : the axis that points up in the input
    """

    name: str
    low: FloatArray
    high: FloatArray
    file: Path | None = None
    crs: str | None = None
    kind: str = "point"
    above_ground: float | None = None
    up: Up = "z"

    def describe(self, system: str | None) -> str:
        """Return extent and reference system as one line of text, with plain decimals.

        system : the reference system of the terrain, which also holds for coordinates in the scene file
        """
        axes = zip("xyz", self.low.tolist(), self.high.tolist(), strict=True)
        spans = filter(None, (self._span(axis, low, high) for axis, low, high in axes))
        crs = self.crs or (NOT_STATED if self.file is not None or self.name == TERRAIN else system or NOT_STATED)
        return f"{'  '.join(spans)}  ({crs})"

    def _span(self, axis: str, low: float, high: float) -> str:
        """Return the extent along an axis as text; "" if the input has no coordinates along this axis."""
        if axis == self.up and self.above_ground is not None:
            return f"{axis} on the ground" + f" + {self.above_ground:g} m" * (self.above_ground > 0.0)
        return "" if np.isnan(low) else f"{axis} {plain(low)} .. {plain(high)}"


def input_extents(scene: Scene, faults: FaultReport | None) -> list[Extent]:
    """Return the extents of all inputs of a scene, the terrain first.

    An input that cannot be read is left out, because a later step of `rpf3d check` reports the error.

    faults : the report on the mesh of the terrain; None if the terrain was refused, so that its files are read again
    """
    ground = _extent_of_files(scene) if faults is None else terrain_extent(scene, faults)
    return [*([] if ground is None else [ground]), *other_extents(scene)]


def other_extents(scene: Scene) -> list[Extent]:
    """Return the extents of all inputs of a scene except the terrain, and except inputs that cannot be read."""
    found = [*_sources(scene), *_areas(scene), *_lines(scene), *_regions(scene), *_observed(scene)]
    return [extent for extent in found if extent is not None]


def terrain_extent(scene: Scene, faults: FaultReport) -> Extent:
    """Return the extent of a terrain that was read, from the report on its mesh."""
    file = scene.terrain.files[0].path if scene.terrain.files else None
    low, high = np.array(faults.low), np.array(faults.high)
    return Extent(name=TERRAIN, low=low, high=high, file=file, crs=scene.terrain.crs)


def _extent_of_files(scene: Scene) -> Extent | None:
    """Return the extent of the files of a terrain; None if there are none, or if they cannot be read."""
    if scene.terrain.files is None:
        return None
    try:
        parts = [surface.points for surface in surfaces_in_metres(scene.terrain)]
    except InputError:
        return None
    return _extent(TERRAIN, parts, scene.terrain.files[0].path, scene.terrain.crs)


def _sources(scene: Scene) -> Iterator[Extent | None]:
    for number, spec in enumerate(scene.sources):
        name = f"source {spec.name}"
        found = None
        with suppress(InputError):
            if spec.polygon is not None:
                file = spec.polygon if isinstance(spec.polygon, Path) else None
                found = _in_plan(name, shapely.get_coordinates(source_outline(scene, number)), scene.terrain.up, file)
            elif isinstance(spec.line, Path):
                lines = np.concatenate(read_lines(spec.line))
                found = _in_plan(name, lines, scene.terrain.up, spec.line, "line")
            elif spec.zone is None:
                file = spec.points_file
                crs = None if file is None else stated_reference_system(file, "point")
                found = _extent(name, [_source_points(spec, scene)], file, crs)
        # The points of a crest already have the height of the brow.
        above = spec.above_ground if spec.crest is None else None
        yield None if found is None else found._replace(above_ground=above, up=scene.terrain.up)


def _source_points(spec: SourceSpec, scene: Scene) -> FloatArray:
    up, benches = scene.terrain.up, scene.terrain.benches
    if spec.crest is not None and benches is not None:
        return crest_points(spec, benches)
    return source_points(spec, up) if spec.points_file else np.array(spec.points or spec.line, dtype=float)


def _areas(scene: Scene) -> Iterator[Extent | None]:
    for area in scene.areas_of_interest:
        file = area.polygons if isinstance(area.polygons, Path) else None
        with suppress(InputError):
            yield _in_plan(f"area {area.name}", shapely.get_coordinates(area_polygons(area)), scene.terrain.up, file)
    for zone in scene.zones:
        file = zone.polygons
        with suppress(InputError):
            yield _of_polygons(f"zone {zone.zone}", file, scene)


def _lines(scene: Scene) -> Iterator[Extent | None]:
    """Yield the extents of berms and barriers."""
    barriers = scene.effects.barriers
    named = [(f"berm {berm.name}", berm.along) for berm in scene.terrain.berms]
    named += [(f"barrier {panel.name}", panel.along) for panel in (barriers.panels if barriers is not None else ())]
    for name, along in named:
        file = along if isinstance(along, Path) else None
        with suppress(InputError):
            yield _in_plan(name, np.concatenate(lines_along(along)), scene.terrain.up, file, "line")


def _regions(scene: Scene) -> Iterator[Extent | None]:
    """Yield the extents of the polygons in which effects act."""
    forest, drag_layer = scene.effects.forest, scene.effects.drag_layer
    for name, file in (
        ("forest", None if forest is None else forest.within),
        ("drag_layer", None if drag_layer is None else drag_layer.polygons),
    ):
        if file is not None:
            with suppress(InputError):
                yield _of_polygons(name, file, scene)


def _observed(scene: Scene) -> Iterator[Extent | None]:
    if scene.observed is not None:
        file = scene.observed.points_file
        try:
            points, up = read_points(file, scene.terrain.up, heights=False), "xyz".index(scene.terrain.up)
            if not points[:, up].any():
                points[:, up] = np.nan  # without heights, which are never compared
            yield _extent("observed", [points], file, stated_reference_system(file, "point"))
        except InputError:
            return


def _of_polygons(name: str, file: Path, scene: Scene) -> Extent | None:
    """Return the extent of a file of polygons; errors are as in `read_polygons`."""
    return _in_plan(name, shapely.get_coordinates(read_polygons(file)), scene.terrain.up, file)


def _in_plan(name: str, plan: FloatArray, up: Up, file: Path | None, kind: str = "polygon") -> Extent | None:
    """Return the extent of places (N, 2) m in plan (x and y, or x and z if y is up); None without places.

    kind : of the input's geometries: "polygon", "line" or "point"
    """
    missing = np.full(len(plan), np.nan)
    columns = (plan[:, 0], plan[:, 1], missing) if up == "z" else (plan[:, 0], missing, plan[:, 1])
    crs = None if file is None else stated_reference_system(file, kind)
    extent = _extent(name, [np.stack(columns, axis=1)], file, crs)
    return None if extent is None else extent._replace(kind=kind)


def _extent(name: str, parts: Sequence[FloatArray], file: Path | None, crs: str | None) -> Extent | None:
    some = [part for part in parts if len(part)]
    if not some:
        return None
    low = np.min([part.min(axis=0) for part in some], axis=0).astype(float)
    high = np.max([part.max(axis=0) for part in some], axis=0).astype(float)
    return Extent(name=name, low=low, high=high, file=file, crs=crs)
