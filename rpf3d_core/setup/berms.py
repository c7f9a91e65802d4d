"""Raise the terrain of a scene along the lines of its berms."""

from itertools import pairwise

from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan
from rpf3d_core.formats.polylines import lines_along
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.terrain import BermSpec
from rpf3d_core.setup.coverage import extents
from rpf3d_core.terrain.berms import raised
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.ridge import ridge_along
from rpf3d_core.terrain.sections import section_of
from rpf3d_core.terrain.zones import with_zone

ZONE = "berm_"
"""Prefix of the zone names that berms get, followed by the name of the berm."""


def with_berms(terrain: Terrain, scene: Scene) -> Terrain:
    """Return the terrain with the scene's berms, added one after another; where berms cross, their heights add up.

    Raises
    ------
    InputError
        A line is damaged, has no length, bends too sharply for the width, or leaves the terrain. The message
        names the key.
    """
    for number, spec in enumerate(scene.terrain.berms):
        key = f"{scene.path}: `terrain.berms[{number}].along`"
        for line in _lines(key, spec):
            plan = local_plan(terrain.frame, line)
            ridge = ridge_along(plan, spec.height, spec.width, spec.crest)
            if ridge is None:
                raise InputError(f"{key} of {spec.name!r} bends too sharply for a berm {spec.width:g} m wide")
            if any(section_of(terrain, begin, end) is None for begin, end in pairwise(plan)):
                raise InputError(f"{key} of {spec.name!r} leaves the terrain: {extents(terrain, line)}")
            terrain = raised(terrain, ridge, ZONE + spec.name)
    return terrain


def with_zones_of_berms(terrain: Terrain, berms: Terrain, scene: Scene) -> Terrain:
    """Return the terrain with the zones of all berms set again, because zones drawn later must not hide berms.

    terrain : the terrain whose zones are changed; scene : the scene that states the berms
    berms : the same mesh before other zones were drawn, with the zones of the berms
    """
    for zone in dict.fromkeys(ZONE + spec.name for spec in scene.terrain.berms):
        if zone in berms.zones:
            terrain = with_zone(terrain, zone, berms.zone == berms.zones.index(zone))
    return terrain


def _lines(key: str, spec: BermSpec) -> list[FloatArray]:
    try:
        return lines_along(spec.along)
    except InputError as fault:
        raise InputError(f"{key} {fault}") from fault
