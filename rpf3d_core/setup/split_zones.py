"""Split the zones that a scene names into their surfaces at different heights, and note other zones to split."""

from collections.abc import Sequence

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.yaml import place_in_file
from rpf3d_core.scene.model import Scene
from rpf3d_core.terrain.faces import LOWEST
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.edges import Edges
from rpf3d_core.terrain.zone_parts import Merged, ZoneParts, joined_benches, names_of_parts, parts_by_height, with_parts

MOST_NAMED = 6
"""Largest number of parts whose heights a note states."""


def split_zones(terrain: Terrain, scene: Scene, edges: Edges) -> tuple[Terrain, tuple[str, ...]]:
    """Return the terrain with the zones of `terrain.split` split by height, and notes on surfaces that share a zone.

    A first note names the other zones with surfaces at different heights, which could be split, too. A further note for
    each split zone states which surfaces belong to a part at another height (`words_on_merged`), and a note for each
    zone states benches that a ramp joins (`words_on_joined`). If the scene names no zone, two kinds of terrain have no
    note: synthetic terrain, where each zone is one bench, and terrain of a single zone, where benches are not
    distinguished.

    edges : edges of the terrain's facets

    Raises
    ------
    TerrainError
        The scene names a zone that does not exist, is one surface, or has a part with the name of another zone.
    """
    wanted = scene.terrain.split or ()
    if not wanted and (scene.terrain.files is None or len(terrain.zones) < 2):
        return terrain, ()
    found = parts_by_height(terrain, edges)
    split = []
    for name in wanted:
        split.append(_wanted(terrain, scene, found, name))
        terrain = with_parts(terrain, split[-1])
    left = [parts for parts in found if parts.zone not in wanted]
    notes = (words_on_parts(left, terrain.frame.origin[2]),) if left else ()
    return terrain, (*notes, *words_on_merged(split), *words_on_joined(terrain, edges))


def _wanted(terrain: Terrain, scene: Scene, found: Sequence[ZoneParts], name: str) -> ZoneParts:
    """Return the parts of a zone that the scene asks to split; errors are as in `split_zones`."""
    where = f"{place_in_file(scene.path, ('terrain', 'split'))}: `terrain.split` names the zone {name!r}, "
    if name not in terrain.zones:
        raise TerrainError(f"{where}which the terrain does not have; its zones are {', '.join(terrain.zones)}")
    parts = next((parts for parts in found if parts.zone == name), None)
    if parts is None:
        raise TerrainError(f"{where}which is one surface, or has surfaces at one height only: remove it there")
    if taken := [part for part in names_of_parts(parts) if part in terrain.zones]:
        raise TerrainError(f"{where}but the name of its part {taken[0]!r} is that of another zone: rename that layer")
    return parts


def words_on_parts(found: Sequence[ZoneParts], origin: float) -> str:
    """Return a note on zones that could be split, because their surfaces lie at different heights.

    found : the parts of each zone; origin : height (m) of the local origin in the input
    """
    zones = ", ".join(f"{parts.zone} ({_heights(parts, origin)})" for parts in found)
    names = ", ".join(parts.zone for parts in found)
    return (
        f"separate surfaces at different heights count as one zone in all tables and in retention: {zones}; to have "
        f"each as a zone of its own, numbered from the top, give the scene `terrain: {{split: [{names}]}}`"
    )


def words_on_merged(split: Sequence[ZoneParts]) -> tuple[str, ...]:
    """Return a note for each split zone with surfaces that belong to the nearest part, although the heights differ.

    Such surfaces are small, or lie within the heights of a large surface (`terrain.zone_parts.parts_by_height`).
    split : the parts of each split zone
    """
    return tuple(_merged_in_words(parts.zone, parts.merged) for parts in split if parts.merged)


def words_on_joined(terrain: Terrain, edges: Edges) -> tuple[str, ...]:
    """Return a note for each zone with a surface that joins benches, which `terrain.split` does not separate."""
    origin = terrain.frame.origin[2]
    return tuple(
        f"{zone}: one connected surface has level ground at {_listed(heights, origin)} m, as if a ramp or a face "
        "joined benches: they count as one zone in all tables and in retention, and `terrain.split` does not separate "
        "them; to count them apart, draw a polygon around each bench and give the scene "
        "`zones: [{zone: NAME, polygons: FILE}]`"
        for zone, heights in joined_benches(terrain, edges)
    )


def _listed(heights: Sequence[float] | FloatArray, origin: float) -> str:
    """Return the first heights (m, local frame) as text; origin : height (m) of the local origin in the input."""
    more = ", ..." if len(heights) > MOST_NAMED else ""
    return ", ".join(f"{height + origin:,.0f}" for height in heights[:MOST_NAMED]) + more


def _merged_in_words(zone: str, merged: Merged) -> str:
    found, verb = ("surface", "counts") if merged.surfaces == 1 else ("surfaces", "count")
    return (
        f"`terrain.split`: {merged.surfaces:,} {found} of {zone} ({merged.area:,.0f} m2 in all, the largest of "
        f"{merged.largest:,.0f} m2) {verb} with the part nearest in height, although the mean heights differ by more "
        f"than {LOWEST:g} m, by up to {merged.farthest:,.1f} m"
    )


def _heights(parts: ZoneParts, origin: float) -> str:
    """Return the number of parts of a zone and the mean heights (m) of the highest parts, as text.

    origin : height (m) of the local origin in the input
    """
    return f"{len(parts.heights)} surfaces, on average at {_listed(parts.heights, origin)} m"
