"""Collect the warnings about the settings of a scene and about its terrain, before the rocks fly."""

from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.zone_materials import words_on_unused
from rpf3d_core.setup.warnings.file_heights import height_warnings
from rpf3d_core.setup.warnings.layers import warnings_of_layers
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.zones import zones_with_facets


def doubts_of(scene: Scene, terrain: Terrain, engine: Engine) -> tuple[str, ...]:
    """Return the warnings about a scene: its settings, its materials, and its files in comparison with the terrain.

    engine : engine of the scene, with its search structure over the terrain
    """
    return (
        *warnings_of(scene),
        *warnings_of_layers(scene),
        *words_on_unused(scene, zones_with_facets(terrain)),
        *height_warnings(scene, engine, terrain.frame),
    )
