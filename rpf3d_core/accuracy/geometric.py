"""What the resolution of the terrain does to the answer: the same rocks over fewer and fewer triangles."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.decimated import decimated
from rpf3d_core.accuracy.differences import AnswerDifference, difference
from rpf3d_core.accuracy.flown import FlownSample, fly
from rpf3d_core.accuracy.from_above import nearest_ground
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain

PARTS = (2, 4, 8, 16, 32, 64)
"""The terrain has a half of its triangles, a quarter, and so on."""
FEWEST = 8
"""Triangles; a terrain of fewer tells nothing."""


class Coarser(NamedTuple):
    """The answer over a terrain of some of the scene's triangles; `part` : one in so many."""

    part: int
    triangles: int
    off: AnswerDifference
    seconds_per_1000: float


def coarser_terrains(prepared: Prepared, releases: Releases, exact: FlownSample) -> Iterator[Coarser]:
    """The scene flown over coarser terrains, the same rocks from the same heights above the ground.

    exact : the same releases over the terrain as it is
    """
    some = taken(releases, exact.rows)
    for part in PARTS:
        if len(prepared.terrain.triangles) < FEWEST * part:
            return
        terrain = decimated(prepared.terrain, 1.0 / part)
        coarse = over_terrain(prepared, terrain, engine_over(prepared.engine.name, terrain))
        found = fly(coarse, put_back(some, prepared.engine, coarse.engine), paths=True)
        yield Coarser(
            part, len(terrain.triangles), difference(found, exact, prepared.scene.gravity), found.seconds_per_1000
        )


def over_terrain(prepared: Prepared, terrain: Terrain, engine: Engine) -> Prepared:
    """The same scene over another terrain of the same zones; its map keeps its cells."""
    return replace(prepared, terrain=terrain, engine=engine)


def put_back(releases: Releases, before: Engine, after: Engine) -> Releases:
    """Releases at the same height above another ground; where that has none there, at the same altitude.

    Heights are those above the ground straight below; of grounds that lie over each other the new one is that nearest
    to the old, so no rock under an overhang is put on top of it, and none starts under the ground.
    """
    height = before.ground_below(releases.x)[:, 0]
    ground = nearest_ground(after, releases.x, releases.x[:, 2] - height)
    x = np.array(releases.x)
    x[:, 2] = np.where(ground.facet >= 0, ground.z + height, x[:, 2])
    return replace(releases, x=x)
