"""A synthetic open pit, like the Arturo mine of the thesis: `Pit` has the parameters, `pit_terrain` makes the terrain.

The pit looks like the drawing of a mine planner: level benches and steep faces around a floor, a haul ramp that climbs
counter-clockwise from the floor to the crest and widens the pit where it passes, berms that taper into the ramp.
"""

import math

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.pit.columns import Spacing, columns_of
from rpf3d_core.terrain.pit.design import Design, design_of
from rpf3d_core.terrain.pit.parameters import Pit
from rpf3d_core.terrain.pit.surface import floor_ring_sizes, surface_of

__all__ = ["Pit", "pit_terrain"]

TRIAL_COLUMNS = 240
"""Number of columns of the trial mesh; its point count predicts the number of columns for the requested triangles."""
FEWEST_COLUMNS = 12
"""Least number of columns: fewer would cut across the bends of the pit."""


def pit_terrain(pit: Pit) -> Terrain:
    """Return the pit as a watertight mesh.

    The number of triangles is `pit.triangles` within 3 %, or within 5 % if `pit.triangles` is below 5,000. The same
    pit always gives exactly the same mesh. Zones: `bench_1` (the first below the crest) and so on down, `face`, `ramp`,
    `floor`, `spill`, `ground` (outside the crest). x is east, y is north, the middle of the floor is at x = y = 0;
    vertices are local, z = 0 at the crest, and `frame.origin` is (0, 0, crest altitude). Every facet's normal points up
    (n_z > 0), so no point of the plan lies under two facets. Raises `TerrainError` if the plan would fold over itself,
    if the turns of the ramp are too many or too close, or if the triangles are too few for the number of benches.
    """
    design = design_of(pit)
    spacing = Spacing(math.sqrt(2.0 * design.surface_area / pit.triangles))
    count = column_count(design, spacing, pit.triangles)
    vertices, triangles, zone = surface_of(design, columns_of(design, spacing, count), spacing)
    return Terrain(vertices, triangles, zone, design.zones, Frame(origin=(0.0, 0.0, pit.crest_altitude)))


def column_count(design: Design, spacing: Spacing, triangles: int) -> int:
    """Return the number of columns of points for a mesh of about `triangles` triangles.

    A mesh has about two triangles for each point. Raises `TerrainError` if the triangles are too few for the benches.
    """
    trial = columns_of(design, spacing, TRIAL_COLUMNS)
    of_a_column = 2.0 * (len(trial.column) / TRIAL_COLUMNS - 1.0)
    count = triangles / of_a_column
    for _ in range(3):
        count = (triangles - floor_triangles(design, spacing, round(count))) / of_a_column
    if count < FEWEST_COLUMNS:
        least = math.ceil(FEWEST_COLUMNS * of_a_column + floor_triangles(design, spacing, FEWEST_COLUMNS))
        raise TerrainError(f"pit: triangles is {triangles}; a pit of so many benches needs at least {least}")
    return round(count)


def floor_triangles(design: Design, spacing: Spacing, columns: int) -> int:
    """Return the number of triangles that fill the middle of the floor, to plan the number of columns.

    Between a ring of m points and the next ring of n points lie m + n triangles. Between the innermost ring of n points
    and the middle lie n triangles.
    """
    sizes = [columns, *floor_ring_sizes(design, spacing, columns)]
    return sum(sizes[:-1]) + sum(sizes[1:-1])
