"""Fly rocks over small terrains, and count them with tallies."""

import numpy as np
from flights import scenes_of_facets as made

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE, Binning, scales_of
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.tallies import tallies_over
from rpf3d_core.hazard.walks.ground import ground_over
from rpf3d_core.terrain.facets import facets_of

MASS = 1000.0
"""Mass of the rocks of `scenes_of_facets.fly` (kg)."""
MEMORY = 1e9
"""Memory limit of the bins (bytes)."""


def over(terrain, cell=1.3, areas=None, compiled=True, limit=MEMORY):
    """Return empty tallies for a terrain; their raster is not aligned with the grid of the terrain.

    cell : size of a cell of the raster (m); areas : outlines of areas by name, None for no areas
    compiled : False for tallies in Python; limit : memory limit of the bins (bytes)
    """
    facets = facets_of(terrain)
    low = (facets.low[0] - 0.37, facets.low[1] - 0.53)
    raster = Raster(*low, cell, *(int((facets.high[k] + 1.0 - low[k]) / cell) + 1 for k in range(2)))
    scales, fine = (scales_of(30.0, 9.81, 12.0, MASS, MASS, per_octave) for per_octave in (PER_OCTAVE, FINE))
    ground = ground_over(facets, bucket_locator(facets), raster)
    return tallies_over(ground, areas_of(areas or {}), len(terrain.zones), 9.81, Binning(scales, fine, limit), compiled)


def rocks_above(count, size=18.0, seed=3):
    """Return random positions (R, 3) m at z = 6 m, and velocities (R, 3) m/s, of rocks over a square grid.

    count : R; size : side of the grid (m)
    """
    random = np.random.default_rng(seed)
    x = random.uniform(1.0, size - 1.0, (count, 3))
    x[:, 2] = 6.0
    return x, random.uniform(-4.0, 4.0, (count, 3))


def rough(slope=0.3, amplitude=0.6):
    """Return a rough grid of 12 by 12 squares of 1.5 m, with facets in three zones."""
    terrain = made.rough_grid(12, 18.0, slope, amplitude, seed=5)
    zone = (np.arange(len(terrain.triangles)) // 40 % 3).astype(np.int32)
    return type(terrain)(terrain.vertices, terrain.triangles, zone, ("a", "b", "c"), terrain.frame)


def flown(terrain, tallies, engine="compiled", count=60, model="sliding", **how):
    """Fly `count` random rocks over a terrain, let the tallies count them, and return the flights.

    model : name of the ground model; how : further arguments of `fly_ensemble`
    """
    x, v = rocks_above(count)
    physics = made.flight(made.surface(0.6, 0.85, 25.0), model)
    return made.fly(made.engine_over(engine, terrain), physics, x, v, watch=tallies, **how)


def numbers(maps):
    """Yield (name, array) for every array of hazard maps."""
    for kind in ("cells", "facets", "zones", "areas"):
        for name, value in vars(getattr(maps, kind)).items():
            parts = vars(value) if hasattr(value, "p95") else {"": value}
            yield from ((f"{kind}.{name}.{part}", array) for part, array in parts.items())
