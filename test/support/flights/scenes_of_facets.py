"""Make test terrains (inclines, profiles, boxes, gullies, rough grids), and fly rocks over them.

All coordinates are in the local frame, z up. A slope falls towards +x; `strike` is an angle (degrees) by which the
terrain is rotated counter-clockwise about the z axis.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from flights.models_by_name import models_called
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights, given_columns
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.library import Surface, materials_of
from rpf3d_core.simulation.capped import piece_numbers
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain, facets_of

ENGINES = ("reference", "compiled")
"""Names of both engines; every test of flights runs on both. The compiled engine needs numba."""

AT_REST = (0.0, 0.0, 0.0)


# --- terrains ---------------------------------------------------------------------------------------------------------


def terrain_of(
    vertices: Iterable[Sequence[float]],
    triangles: Iterable[Sequence[int]],
    zone: Sequence[int] | None = None,
    zones: tuple[str, ...] = ("ground",),
) -> Terrain:
    """Return a terrain with the given vertices (m) and triangles, without welding, winding repair or checks.

    zone : number of the zone of each triangle, None for one zone; zones : names of the zones
    """
    corners = np.array([tuple(t) for t in triangles], dtype=np.int32).reshape(-1, 3)
    numbers = np.zeros(len(corners), np.int32) if zone is None else np.array(zone, np.int32)
    return Terrain(np.array([tuple(v) for v in vertices], dtype=float), corners, numbers, zones)


def grid_triangles(rows: int, columns: int) -> np.ndarray:
    """Return two triangles (F, 3) for each cell of a grid with rows by columns points, numbered row by row.

    The triangles face up if x grows with the row and y with the column.
    """
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    return np.concatenate([np.stack([a, a + columns, a + columns + 1], 1), np.stack([a, a + columns + 1, a + 1], 1)])


def turned(vertices: np.ndarray, degrees: float) -> np.ndarray:
    """Return points (V, 3), rotated counter-clockwise about the z axis; multiples of 90 degrees are exact."""
    quarter, rest = divmod(degrees, 90.0)
    c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    if rest:
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.stack(
        [c * vertices[:, 0] - s * vertices[:, 1], s * vertices[:, 0] + c * vertices[:, 1], vertices[:, 2]], 1
    )


def strip(
    profile: Sequence[tuple[float, float]], half_width: float = 10.0, across: int = 1, strike: float = 0.0
) -> Terrain:
    """Return a profile of points (x, z) m, extruded along y from -half_width to half_width (m).

    Each segment of the profile is a zone. across : number of cells along y
    """
    x, z = np.array(profile, dtype=float).T
    y = np.linspace(-half_width, half_width, across + 1)
    vertices = np.stack([np.repeat(x, across + 1), np.tile(y, len(x)), np.repeat(z, across + 1)], 1)
    triangles = grid_triangles(len(x), across + 1)
    segment = triangles[:, 0] // (across + 1)
    return terrain_of(turned(vertices, strike), triangles, segment, tuple(f"segment_{i}" for i in range(len(x) - 1)))


def incline(
    angle: float, strike: float = 0.0, down: float = 60.0, up: float = 5.0, cells: tuple[int, int] = (1, 1),
    jitter: int | None = None, half_width: float = 8.0,
) -> Terrain:  # fmt: skip
    """Return a plane through the origin that slopes down at `angle` degrees.

    up, down : lengths of the plane along the slope, above and below the origin (m)
    cells : number of cells down the slope and across; half_width : half of the width across the slope (m)
    jitter : seed of a random movement of the inner vertices within the plane; None for a regular grid
    """
    s, y = np.meshgrid(
        np.linspace(-up, down, cells[0] + 1), np.linspace(-half_width, half_width, cells[1] + 1), indexing="ij"
    )
    if jitter is not None:
        steps = 0.35 * np.array([(up + down) / cells[0], 2 * half_width / cells[1]])
        moved = np.random.default_rng(jitter).uniform(-1, 1, (2, *s.shape))
        s[1:-1, 1:-1] += steps[0] * moved[0, 1:-1, 1:-1]
        y[1:-1, 1:-1] += steps[1] * moved[1, 1:-1, 1:-1]
    a = math.radians(angle)
    vertices = np.stack([s * math.cos(a), y, -s * math.sin(a)], -1).reshape(-1, 3)
    return terrain_of(turned(vertices, strike), grid_triangles(*s.shape))


def down_the_slope(angle: float, strike: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors (3,) of an incline: the steepest descent, and the normal on the free side.

    angle, strike : as in `incline`
    """
    a = math.radians(angle)
    both = np.array([[math.cos(a), 0.0, -math.sin(a)], [math.sin(a), 0.0, math.cos(a)]])
    descent, normal = turned(both, strike)
    return descent, normal


def floor(half: float = 20.0, z: float = 0.0, cells: int = 1) -> Terrain:
    """Return a level square with its centre at x = y = 0 and sides of 2 `half` (m), at a height z (m)."""
    return rough_grid(cells, 2.0 * half, 0.0, 0.0, centred=True, z=z)


def rough_grid(
    cells: int, size: float, slope: float, amplitude: float, seed: int = 0, centred: bool = False, z: float = 0.0
) -> Terrain:
    """Return a square grid with sides of `size` (m) and with `cells` cells on each side.

    The heights fall by `slope` (m per m) along x, from the height z (m) at x = 0. amplitude : largest noise (m)
    centred : True if the origin is in the middle of the square, False if it is a corner
    """
    ticks = np.linspace(0.0, size, cells + 1) - (0.5 * size if centred else 0.0)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    heights = z - slope * x + amplitude * np.random.default_rng(seed).uniform(-1, 1, x.shape)
    return terrain_of(np.stack([x, y, heights], -1).reshape(-1, 3), grid_triangles(cells + 1, cells + 1))


def box(half: float = 5.0, height: float = 10.0) -> Terrain:
    """Return a box open at the top: a level floor at z = 0 and four vertical walls."""
    low = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    high = [(x, y, height) for x, y, _ in low]
    walls = [t for i in range(4) for t in ((i, i + 4, (i + 1) % 4 + 4), (i, (i + 1) % 4 + 4, (i + 1) % 4))]
    return terrain_of([*low, *high], [(0, 1, 2), (0, 2, 3), *walls])


def gully(
    left: float, right: float, dip: float, length: float = 60.0, side: float = 5.0, cells: int = 1, strike: float = 0.0
) -> Terrain:
    """Return a V-shaped gully; its line passes through the origin and slopes down towards +x at `dip` degrees.

    The sides rise at the angles `left` (at +y) and `right` (at -y) in degrees, measured in the profile across x. The
    zones are `left` and `right`. length : m, along x; side : width (m) of each side; cells : number of cells along x
    """
    x = np.linspace(-2.0, length, cells + 1)
    z = -x * math.tan(math.radians(dip))
    rise = [side * math.tan(math.radians(angle)) for angle in (right, 0.0, left)]
    vertices = [(a, y, b + r) for a, b in zip(x, z, strict=True) for y, r in zip((-side, 0.0, side), rise, strict=True)]
    triangles = grid_triangles(cells + 1, 3)
    zone = [0 if all(t % 3 >= 1) else 1 for t in triangles]
    return terrain_of(turned(np.array(vertices), strike), triangles, zone, ("left", "right"))


def cone(sides: int, radius: float = 5.0, height: float = 5.0) -> Terrain:
    """Return a cone of `sides` facets around a vertex at the origin; its rim is at the height `height` (m).

    radius : m, of the rim. A negative height gives a hill.
    """
    angles = 2.0 * np.pi * np.arange(sides) / sides
    rim = [(radius * math.cos(a), radius * math.sin(a), height) for a in angles]
    return terrain_of([(0, 0, 0), *rim], [(0, 1 + i, 1 + (i + 1) % sides) for i in range(sides)])


def joined(*parts: Terrain) -> Terrain:
    """Return several terrains as one terrain, with the facets in order; each of the terrains is a zone."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return Terrain(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.triangles + np.int32(start) for part, start in zip(parts, starts, strict=False)]),
        np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.triangles) for part in parts]),
        tuple(f"part_{i}" for i in range(len(parts))),
    )


def without_facets(terrain: Terrain, *numbers: int) -> Terrain:
    """Return the terrain without the facets with the given numbers."""
    keep = np.setdiff1d(np.arange(len(terrain.triangles)), numbers)
    return Terrain(terrain.vertices, terrain.triangles[keep], terrain.zone[keep], terrain.zones, terrain.frame)


# --- flights ----------------------------------------------------------------------------------------------------------


def surface(R_n: float = 0.5, R_t: float = 0.8, friction_angle: float = 30.0, stop_speed: float = 0.5) -> Surface:
    """Return the coefficients of the ground; friction_angle : degrees; stop_speed : m/s."""
    return Surface(R_n, R_t, math.tan(math.radians(friction_angle)), stop_speed)


def engine_over(name: str, terrain: Terrain) -> Engine:
    """Return an engine over a terrain, with the terrain's components but without caps; name : name of the engine."""
    return engine_of(name, facets_of(terrain), pieces=piece_numbers(terrain))


def flight(
    ground: Surface | Sequence[Surface], model: str = "sliding", rebound: str = "constant", **settings: float
) -> Flight:
    """Return materials, settings and models of flights.

    ground : one surface for all zones, or one for each zone; model : name of the ground model
    rebound : name of the rebound model; settings : further fields of `Settings`
    """
    surfaces = [ground] if isinstance(ground, Surface) else list(ground)
    return Flight(materials_of(surfaces), Settings(**settings), models_called(rebound, model))  # type: ignore[arg-type]


def fly(
    engine: Engine, physics: Flight, x: Sequence[float] | np.ndarray, v: Sequence[float] | np.ndarray = AT_REST,
    **how: Any,
) -> Flights:  # fmt: skip
    """Return the flights of rocks from positions x, (3,) or (R, 3) m, with velocities v of either shape (m/s).

    how : further arguments of `fly_ensemble`
    """
    zones = len(physics.materials.R_n)
    needed = int(np.max(engine.facets.zone)) + 1
    if zones == 1 < needed:
        physics = Flight(
            type(physics.materials)(*(np.repeat(c, needed) for c in physics.materials)),
            physics.settings,
            physics.models,
        )
    return fly_ensemble(engine, physics, released(x, v), **how)


def released(x: Sequence[float] | np.ndarray, v: Sequence[float] | np.ndarray = AT_REST) -> Releases:
    """Return releases of R rocks of 1 t and 0.5 m radius from positions x, (3,) or (R, 3) m.

    v : velocities (m/s) of either shape
    """
    places = np.atleast_2d(np.array(x, dtype=float))
    speeds = np.ascontiguousarray(np.broadcast_to(np.array(v, dtype=float), places.shape))
    rocks, ones = np.arange(len(places)), np.ones(len(places))
    return Releases(np.zeros_like(rocks), rocks, places, speeds, 1000.0 * ones, 0.5 * ones)


def specific_energy(flights: Flights, gravity: float = 9.81) -> tuple[np.ndarray, np.ndarray]:
    """Return the energies (N,) J/kg of the rocks just after each event of the paths, and just before the next event."""
    paths = flights.paths
    after = gravity * paths.x[:, 2] + 0.5 * (paths.v**2).sum(1)
    z_end = np.append(paths.x[1:, 2], paths.x[-1:, 2])
    return after, gravity * z_end + 0.5 * (paths.v_end**2).sum(1)


def same_bits(one: Flights, other: Flights) -> bool:
    """Return True if all results of two ensembles are equal to the last bit."""
    return all(
        np.array_equal(a, b, equal_nan=True)
        for name in ("deposits", "impacts", "paths")
        for a, b in zip(
            given_columns(getattr(one, name)).values(), given_columns(getattr(other, name)).values(), strict=True
        )
    )
