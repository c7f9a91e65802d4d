"""Make terrain and sources for tests of answers over a small pit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scenes import small_pit

from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.triggers import trigger_of
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.terrain.facets import facets_of

ENGINES = ["reference", *(["compiled"] if HAS_NUMBA else [])]


@dataclass(frozen=True, eq=False)
class Ground:
    """A replacement for a live terrain with only the attributes that the computation of an answer reads."""

    terrain: Any
    facets: Any
    engine: Any
    digest: str = "0" * 64
    stamp_ns: int = 0
    whole_ns: int = 0


def pit_scene(folder, more="", **of_pit):
    """Return the scene of the small pit, written to a folder; more, of_pit : as in `small_pit.scene_file`."""
    return read_scene(small_pit.scene_file(folder, more=more, **of_pit))


def pit_ground(scene, engine=ENGINES[-1]):
    """Return the terrain of a scene as a live terrain; engine : name of the engine."""
    terrain, _ = read_terrain(scene)
    facets = facets_of(terrain)
    return Ground(terrain, facets, engine_of(engine, facets))


def pit_standing(folder, engine=ENGINES[-1], more="", **of_pit):
    """Return the prepared terrain of the small pit, which all answers share; arguments as in `pit_scene`."""
    scene = pit_scene(folder, more, **of_pit)
    return stand_on(pit_ground(scene, engine), scene)


def over_the_wall(count=5, height=4.0, stamp_ns=7, topic=""):
    """Return a trigger of `count` sources above the pit's wall, with velocities of 6 m/s towards the pit's middle.

    height : height (m) of the sources above z = 60 m
    """
    angle = np.linspace(0.0, 1.5 * np.pi, count)
    towards = np.stack([-np.cos(angle), -np.sin(angle), np.zeros(count)], axis=1)
    places = -170.0 * towards
    places[:, 2] = 60.0 + height
    return trigger_of(places, 6.0 * towards, None, stamp_ns, topic)
