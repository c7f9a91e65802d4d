"""The geometric error: results of the same rocks over terrains with fewer and fewer triangles."""

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
"""Divisors of the number of triangles: half of the triangles, a quarter, and so on."""
FEWEST = 8
"""Smallest number of triangles; results over fewer triangles are useless."""


class Coarser(NamedTuple):
    """The result over a terrain with 1 / `part` of the scene's triangles; off : difference from the full terrain."""

    part: int
    triangles: int
    off: AnswerDifference
    seconds_per_1000: float


def coarser_terrains(prepared: Prepared, releases: Releases, exact: FlownSample) -> Iterator[Coarser]:
    """Yield the results over coarser and coarser terrains, of the same rocks at the same heights above the ground.

    exact : result of the same releases over the full terrain
    """
    some = taken(releases, exact.rows)
    for part in PARTS:
        if len(prepared.terrain.triangles) < FEWEST * part:
            return
        terrain = decimated(prepared.terrain, 1.0 / part)
        coarse = over_terrain(prepared, terrain, engine_over(prepared.engine.name, terrain))
        found = fly(coarse, put_back(some, prepared.engine, coarse.engine), paths=True)
        yield Coarser(
            part=part,
            triangles=len(terrain.triangles),
            off=difference(found, exact, prepared.scene.gravity),
            seconds_per_1000=found.seconds_per_1000,
        )


def over_terrain(prepared: Prepared, terrain: Terrain, engine: Engine) -> Prepared:
    """Return the scene over another terrain with the same zones; the cells of its map do not change."""
    return replace(prepared, terrain=terrain, engine=engine)


def put_back(releases: Releases, before: Engine, after: Engine) -> Releases:
    """Return releases at the same height above another ground; at the same altitude where that ground is missing.

    Heights are those above the ground straight below. If several sheets of ground lie above each other, the new ground
    is the sheet nearest to the old ground. So no rock under an overhang is put on top of it, and no rock starts under
    the ground.
    """
    height = before.ground_below(releases.x)[:, 0]
    ground = nearest_ground(after, releases.x, releases.x[:, 2] - height)
    x = np.array(releases.x)
    x[:, 2] = np.where(ground.facet >= 0, ground.z + height, x[:, 2])
    return replace(releases, x=x)
