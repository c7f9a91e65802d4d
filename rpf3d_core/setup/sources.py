"""Convert the sources and rocks of a scene into the form for flights: local frame, angles in radians."""

import math
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import MultiPolygon

from rpf3d_core.ensemble.release_triangles import ReleaseTriangles, release_triangles
from rpf3d_core.ensemble.releases import Source
from rpf3d_core.ensemble.sizes import DrawnRock, SourceRocks
from rpf3d_core.ensemble.throws import Throw
from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan, plan_triangles, polygon_of, read_polygons
from rpf3d_core.formats.polylines import read_lines
from rpf3d_core.formats.yaml import place_in_file
from rpf3d_core.scene.draws import distribution_of
from rpf3d_core.scene.measured import sizes_from
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.releases import SIZES, RockSpec, SourceSpec, source_points
from rpf3d_core.scene.zone_materials import zone_meant
from rpf3d_core.setup.coverage import extents
from rpf3d_core.setup.file_keys import named_by_key
from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.benches.slope import brow_of
from rpf3d_core.terrain.clipping import areas_of, facets_within, normals_of
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray, Frame, Up
from rpf3d_core.values import Rock, Vec

NO_POINTS = np.empty((0, 3))


def scene_sources(scene: Scene, terrain: Terrain, polygons: Mapping[str, MultiPolygon] | None = None) -> list[Source]:
    """Return all sources of a scene in order, in the local frame, ready to release rocks.

    Sources without rocks are included, because random draws depend on the index of a source.

    polygons : from `read_source_files`, if they were read before

    Raises
    ------
    InputError
        A file is damaged, a polygon lies off the terrain, or a zone has no suitable facet; the message names the key,
        or for a damaged file of points only the file.
    """
    known = read_source_files(scene) if polygons is None else polygons
    return [_source(scene, number, terrain, known) for number in range(len(scene.sources))]


def read_source_files(scene: Scene) -> dict[str, MultiPolygon]:
    """Read the files of a scene's sources to find errors in them before the large terrain file is read.

    Returns
    -------
    dict
        The polygons of each source with the key `polygon`, by name of the source, in plan coordinates of the input.

    Raises
    ------
    InputError
        A file of points, lines or polygons is damaged; the message names the file.
    """
    polygons = {}
    for number, spec in enumerate(scene.sources):
        if spec.points_file:
            source_points(spec, scene.terrain.up)
        elif spec.polygon is not None:
            polygons[spec.name] = source_outline(scene, number)
        elif isinstance(spec.line, Path):
            with named_by_key(scene, "sources", number, "line"):
                read_lines(spec.line)
    return polygons


def rock_of(spec: RockSpec) -> Rock | DrawnRock:
    """Return the spherical rock of a scene from density and diameter, mass or volume; a DrawnRock for random sizes."""
    return _rock(spec.density, spec)


def rocks_of_sources(scene: Scene) -> Rock | DrawnRock | SourceRocks | None:
    """Return the sizes of a scene's rocks; None if all rocks have the size of their box or file.

    If a source states a size, the result is `SourceRocks`, with the size for each source.
    """
    common = None if scene.rock.has_own_size else rock_of(scene.rock)
    if all(source.size_key is None for source in scene.sources):
        return common
    return SourceRocks(tuple(
        common if source.size_key is None else _rock(scene.rock.density, source) for source in scene.sources
    ))  # fmt: skip


def _rock(density: float, spec: RockSpec | SourceSpec) -> Rock | DrawnRock:
    """Return the rock, as a sphere, from its density (kg/m3) and from the size in a section of the scene.

    The result is a `DrawnRock` if the size is a distribution or a list of measured sizes.
    """
    measure = next(name for name in SIZES if getattr(spec, name) is not None)
    size = getattr(spec, measure)
    if not isinstance(size, float):
        return DrawnRock(density=density, measure=measure, size=sizes_from(size, measure))
    if measure == "diameter":
        radius = 0.5 * size
        return Rock(density * 4.0 / 3.0 * math.pi * radius**3, radius)
    mass = size if measure == "mass" else density * size
    return Rock(mass, (3.0 * mass / (4.0 * math.pi * density)) ** (1.0 / 3.0))


def _source(scene: Scene, number: int, terrain: Terrain, polygons: Mapping[str, MultiPolygon]) -> Source:
    """Return one source of a scene in the local frame, ready to release rocks.

    number : index of the source in the scene; polygons : of the sources, by name, from `read_source_files`
    """
    spec, frame = scene.sources[number], terrain.frame
    is_crest = spec.crest is not None
    return Source(
        name=spec.name,
        points=_points(spec, terrain.frame, scene.terrain.benches),
        breaks=line_breaks(spec),
        rocks=spec.rocks,
        velocity=_vector(frame.directions_to_local(spec.velocity)),
        line=spec.line is not None or is_crest,
        spread=_vector(np.abs(frame.directions_to_local(spec.spread))),
        velocity_spread=_vector(np.abs(frame.directions_to_local(spec.velocity_spread))),
        above_ground=None if is_crest else spec.above_ground,
        triangles=_triangles(scene, number, terrain, polygons),
        throw=_throw(spec),
    )


def _points(spec: SourceSpec, frame: Frame, benches: Benches | None) -> FloatArray:
    """Return the release points (P, 3) m of a source in the local frame; (0, 3) for a source with an area.

    Points along a crest are already `above_ground` (m) above the edge of the face. For these points, no later step
    searches for the ground, because a search straight down might find the foot of the face.
    """
    if spec.crest is not None and benches is not None:
        return frame.points_to_local(crest_points(spec, benches))
    if spec.points_file:
        return frame.points_to_local(source_points(spec, frame.up))
    if isinstance(spec.line, Path):
        return frame.points_to_local(line_points(spec.line, frame.up))
    written = spec.points or spec.line
    return frame.points_to_local(np.array(written, dtype=float)) if written else NO_POINTS


def crest_points(spec: SourceSpec, benches: Benches) -> FloatArray:
    """Return the points (P, 3) m of a source along the upper edge of a face, in the input's coordinates.

    The points lie above the edge by the source's `above_ground` (m).

    spec : a source with the key `crest`
    """
    above: FloatArray = np.array([0.0, 0.0, spec.above_ground or 0.0])
    return brow_of(benches, spec.crest or 1) + above


def line_points(path: Path, up: Up) -> FloatArray:
    """Return the points (P, 3) m of all lines of a file one after another, with a height of 0, in the input's axes.

    Raises
    ------
    InputError
        The file is damaged or has no lines.
    """
    plan = np.concatenate(read_lines(path))
    return np.insert(plan, 1 if up == "y" else 2, 0.0, axis=1)


def line_breaks(spec: SourceSpec) -> tuple[int, ...]:
    """Return the index of each line's last point in a source's file, except for the last line; () without a file."""
    if not isinstance(spec.line, Path):
        return ()
    return tuple((np.cumsum([len(line) for line in read_lines(spec.line)])[:-1] - 1).tolist())


def _throw(spec: SourceSpec) -> Throw | None:
    """Return the release speed (m/s) and direction (radians) of a source; None if it states `velocity` instead."""
    if spec.speed is None:
        return None
    return Throw(
        speed=distribution_of(spec.speed),
        azimuth=math.radians(spec.azimuth_deg or 0.0),
        elevation=math.radians(spec.elevation_deg or 0.0),
        spread=math.radians(spec.spread_deg or 0.0),
    )


def _triangles(
    scene: Scene, number: int, terrain: Terrain, polygons: Mapping[str, MultiPolygon]
) -> ReleaseTriangles | None:
    """Return the triangles on which a source with an area releases rocks; None for other sources.

    The area is a polygon or a zone.
    """
    spec = scene.sources[number]
    if spec.polygon is not None:
        return _within_polygon(scene, number, terrain, polygons[spec.name])
    return _steep_facets(scene, number, terrain) if spec.zone is not None else None


def _within_polygon(scene: Scene, number: int, terrain: Terrain, polygons: MultiPolygon) -> ReleaseTriangles:
    """Return the parts of the terrain's facets inside a source's polygons, on which its rocks start.

    Raise an InputError if the polygons lie off the terrain.
    """
    plan = plan_triangles(polygons)
    parts = facets_within(terrain.vertices[terrain.triangles], local_plan(terrain.frame, plan))
    if not len(parts):
        raise _refused(scene, number, "polygon", f"lies off the terrain: {extents(terrain, plan)}")
    return release_triangles(parts)


def _steep_facets(scene: Scene, number: int, terrain: Terrain) -> ReleaseTriangles:
    """Return the facets on which the rocks of a source with the key `zone` start.

    These are the facets of the zone with an area that are steeper than `steeper_than_deg`, or of any slope if this key
    is not set. Raise an InputError if there are none.
    """
    spec = scene.sources[number]
    pattern, least = spec.zone or "", spec.steeper_than_deg
    fits = np.array([name == pattern or fnmatchcase(name, pattern) for name in terrain.zones])
    corners = terrain.vertices[terrain.triangles[fits[terrain.zone]]]
    if not len(corners):
        near = zone_meant(pattern, terrain.zones)
        meant = f"; did you mean {near!r}?" if near else ""
        raise _refused(scene, number, "zone", f"is {pattern!r}, but the zones are {', '.join(terrain.zones)}{meant}")
    corners = corners[areas_of(corners) > 0.0]
    if not len(corners):
        raise _refused(scene, number, "zone", f"is {pattern!r}, but no facet of this zone has an area")
    slopes = _slopes(corners)
    if least is not None and not (slopes > least).any():
        steepest = f"the steepest facet of {pattern!r} has {slopes.max(initial=0.0):.1f} degrees"
        raise _refused(scene, number, "steeper_than_deg", f"is {least:g}, but {steepest}")
    return release_triangles(corners if least is None else corners[slopes > least])


def _slopes(corners: FloatArray) -> FloatArray:
    """Return the slopes (F,) (degrees from the horizontal) of facets (F, 3, 3) m; overhangs have more than 90."""
    x, y, z = normals_of(corners).T
    return np.asarray(np.degrees(np.arctan2(np.hypot(x, y), z)))


def source_outline(scene: Scene, number: int) -> MultiPolygon:
    """Return the polygons of a source with the key `polygon`, in the plan coordinates of the input.

    number : index of the source in the scene

    Raises
    ------
    InputError
        The file of polygons cannot be used, as in `read_polygons`; the message names the key.
    """
    polygon = scene.sources[number].polygon
    if isinstance(polygon, tuple):
        return polygon_of(polygon)
    with named_by_key(scene, "sources", number, "polygon"):
        return read_polygons(polygon)  # type: ignore[arg-type]


def _refused(scene: Scene, number: int, key: str, sentence: str) -> InputError:
    """Return the error for a wrong value of a source; the message names the key."""
    place = place_in_file(scene.path, ("sources", number, key))
    return InputError(f"{place}: `sources[{number}].{key}` {sentence}")


def _vector(values: Any) -> Vec:
    """Return three numbers as a tuple of floats; -0.0 becomes 0.0, so that equal input gives equal bits."""
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z
