"""Flights on a flat floor, computed in closed form without an engine, and the scene of these flights.

The bounces follow the closed form for R_n and R_t on a flat floor. After the last bounce the rock slides until
Coulomb friction stops the rock.
"""

import math
from pathlib import Path

import numpy as np

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.flights import Deposits, Flights, Impacts, Paths
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import Binning, scales_of
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.raster import raster_over
from rpf3d_core.hazard.tallies import tallies_over
from rpf3d_core.hazard.walks.ground import ground_over
from rpf3d_core.results.findings import Run
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.areas import local_outlines, read_areas
from rpf3d_core.setup.observed import position_along
from rpf3d_core.setup.prepared import Prepared, scene_flight
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.faults import FaultReport, fault_report
from rpf3d_core.terrain.mesh.winding import repair_winding
from rpf3d_core.values import STANDARD_GRAVITY, Mode, Outcome

NORMAL, TANGENTIAL, FRICTION, BOUNCES = 0.5, 0.8, 0.6, 4
MASS = 12.0
SIDE, CELLS = 40.0, 8
G = STANDARD_GRAVITY


SOURCES = ["crest", "ledge"]
SURVEY = Frame((500_000.0, 4_500_000.0, 1_200.0))
SURVEY_Y_UP = Frame((500_000.0, 4_500_000.0, 1_200.0), up="y")
UNMOVED = Frame()
FRAMES = [UNMOVED, SURVEY, SURVEY_Y_UP]

SCENE = """\
terrain: {pit: {}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
rock: {mass: 12.0}
ground: sliding
sources:
  - {name: crest, points: [[0, 0, 1]], rocks: 3}
  - {name: ledge, points: [[0, 0, 1]], rocks: 3}
"""


def scene(folder: Path, more: str = "") -> Scene:
    """Return the scene of the flights, written to a folder; `more` is further YAML.

    The terrain that the scene names is not used; the flights are over `floor`.
    """
    path = folder / "floor.yaml"
    path.write_text(SCENE + more)
    return read_scene(path)


def faults(terrain: Terrain) -> FaultReport:
    """Return the fault report of a terrain."""
    edges = edges_of(terrain.triangles, len(terrain.vertices))
    return fault_report(terrain, repair_winding(terrain.vertices, terrain.triangles, edges), edges, ("floor",))


def floor(frame: Frame = UNMOVED, cells: int = CELLS) -> Terrain:
    """Return a square floor at z = 0, with x and y from -SIDE/2 to SIDE/2.

    The western half is the zone `bench_1`, the other half the zone `floor`. cells : number of cells on each side
    """
    ticks = np.linspace(-SIDE / 2, SIDE / 2, cells + 1)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    low = np.stack([corner, corner + cells + 1, corner + cells + 2], axis=1)
    high = np.stack([corner, corner + cells + 2, corner + 1], axis=1)
    triangles = np.concatenate([low, high]).astype(np.int32)
    zone = (vertices[triangles].mean(axis=1)[:, 0] > 0.0).astype(np.int32)
    return Terrain(vertices, triangles, zone, ("bench_1", "floor"), frame)


def facet_under(terrain: Terrain, x: np.ndarray) -> int:
    """Return the facet whose centroid is nearest to a point in plan: usually the facet below the point."""
    centroids = terrain.vertices[terrain.triangles].mean(axis=1)
    return int(np.argmin(np.linalg.norm(centroids[:, :2] - x[:2], axis=1)))


def events_of_a_throw(x: np.ndarray, v: np.ndarray) -> tuple[list, list]:
    """Return the events (t, x, v, v_end, mode) and the impacts (t, x, v_in, v_out) of a rock that is thrown.

    x : position (3,) m of the release; v : velocity (3,) m/s there. The rock stops at the last event. Units: s, m, m/s
    """
    events, impacts, t = [], [], 0.0
    for _ in range(BOUNCES):
        fall = (v[2] + np.sqrt(v[2] ** 2 + 2 * G * x[2])) / G
        hit = v - (0, 0, G * fall)
        events.append((t, x, v, hit, Mode.FLIGHT))
        t, x = t + fall, np.append(x[:2] + v[:2] * fall, 0.0)
        v = np.array([*(TANGENTIAL * hit[:2]), -NORMAL * hit[2]])
        impacts.append((t, x, hit, v))
    flat = np.array([v[0], v[1], 0.0])
    settle = 2 * v[2] / (G * (1 - NORMAL))
    events.append((t, x, v, flat, Mode.SETTLING))
    t, x = t + settle, x + flat * settle * 0.8
    events.append((t, x, flat, np.zeros(3), Mode.SLIDING))
    speed = np.linalg.norm(flat)
    t, x = t + speed / (FRICTION * G), x + flat * speed / (2 * FRICTION * G)
    events.append((t, x, np.zeros(3), np.zeros(3), Mode.END))
    return events, impacts


def thrown(terrain: Terrain, rocks: int = 6) -> Flights:
    """Return the flights of rocks of two sources, thrown from x = -10 m; the last rock's outcome is `left_terrain`."""
    throws = [events_of_a_throw(*start_of(i)) for i in range(rocks)]
    events = [(row, *event) for row, throw in enumerate(throws) for event in throw[0]]
    impacts = [(row, *impact) for row, throw in enumerate(throws) for impact in throw[1]]
    return Flights(_deposits(terrain, throws), _impacts(terrain, impacts), _paths(events), "reference", 0.25, 0.5)


def start_of(i: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the position (3,) m and the velocity (3,) m/s of throw number i."""
    return np.array([-10.0, -6.0 + 2.0 * i % 12, 5.0 + i % 7]), np.array([2.0 + 0.5 * (i % 9), 0.3, 1.0])


def findings(named: Scene, terrain: Terrain, flights: Flights, planned: int | None = None, steps=()) -> Run:
    """Return a run of a scene over a floor with the given flights as its result; no engine is needed.

    planned : number of planned rocks, None for the number that flew; steps : field of `Run`
    """
    rocks = len(flights.deposits.rock)
    position = None if named.observed is None else position_along(named.observed, terrain.frame)
    totals = Totals(position)
    totals.add(flights.deposits)
    polygons = read_areas(named)
    prepared = Prepared(
        scene=named, terrain=terrain, faults=faults(terrain), engine=None, flight=scene_flight(named, terrain),
        sources=(), rock=None, raster=None, polygons=polygons,
        outlines={name: local_outlines(terrain.frame, area) for name, area in polygons.items()},
        read_s=0.5, index_s=0.25, began=0.0,
    )  # fmt: skip
    run = Run(
        prepared=prepared, flights=flights, totals=totals, maps=maps_of(named, terrain, flights),
        planned=rocks if planned is None else planned, wall_s=2.0, steps=tuple(steps),
    )  # fmt: skip
    vars(run)["placement"] = []  # there is no engine to find the ground below sources
    return run


def maps_of(named: Scene, terrain: Terrain, flights: Flights) -> HazardMaps:
    """Return the hazard maps that the tallies compute from flights with complete paths."""
    facets = facets_of(terrain)
    ground = ground_over(facets, bucket_locator(facets), raster_over(terrain, named.hazard.cell))
    outlines = {name: local_outlines(terrain.frame, area) for name, area in read_areas(named).items()}
    scales = scales_of(math.dist(facets.low, facets.high), G, 10.0, MASS, MASS)
    binning = Binning(scales, scales, 1e9)
    tallies = tallies_over(ground, areas_of(outlines), len(terrain.zones), G, binning, compiled=False)
    deposits = flights.deposits
    moved = np.zeros_like(deposits.x)
    tallies(
        batch_of(flights), Releases(deposits.source, deposits.rock, deposits.release, moved, deposits.mass, moved[:, 0])
    )
    return tallies.maps(len(deposits.rock), tuple(outlines))


def batch_of(flights: Flights) -> Batch:
    """Return flights as the batch that an engine passes to tallies: all impacts and path segments, grouped by rock."""
    deposits, impacts, paths = flights.deposits, flights.impacts, flights.paths
    edges = np.arange(len(deposits.rock) + 1)
    events = np.bincount(paths.row, minlength=len(deposits.rock))
    return Batch(
        rows=edges[:-1],
        finals=np.column_stack(
            [deposits.t, deposits.x, deposits.path, deposits.max_speed, deposits.max_height, deposits.ground_speed]
        ),
        counts=np.column_stack([deposits.outcome, deposits.facet, deposits.impacts, events]),
        impacts=np.column_stack([impacts.t, impacts.x, impacts.normal, impacts.speed_in, impacts.speed_out]),
        facets=impacts.facet,
        pieces=np.column_stack([paths.t, paths.x, paths.v, paths.v_end]),
        modes=paths.mode,
        first=np.column_stack([np.searchsorted(rows, edges) for rows in (impacts.row, paths.row)]),
    )


def none_thrown() -> Flights:
    """Return flights without rocks."""
    whole, real, points = np.empty(0, np.int64), np.empty(0), np.empty((0, 3))
    return Flights(
        Deposits(whole, whole, whole, whole, points, points, real, real, whole, real, real, real, real, real),
        Impacts(whole, real, points, whole, points, real, real),
        Paths(whole, real, points, points, points, whole),
        "reference", 0.0, 0.0,
    )  # fmt: skip


def _deposits(terrain: Terrain, throws: list) -> Deposits:
    rocks = len(throws)
    first = rocks - rocks // 2
    number = np.arange(rocks)
    ends = np.array([throw[0][-1][1] for throw in throws])
    outcome = np.full(rocks, int(Outcome.STOPPED))
    outcome[-1] = Outcome.LEFT_TERRAIN
    fastest = np.array([max(np.linalg.norm(event[3]) for event in throw[0]) for throw in throws])
    return Deposits(
        source=(number >= first).astype(np.int64),
        rock=np.where(number >= first, number - first, number),
        outcome=outcome,
        facet=np.array([facet_under(terrain, x) for x in ends]),
        release=np.array([throw[0][0][1] for throw in throws]),
        x=ends,
        t=np.array([throw[0][-1][0] for throw in throws]),
        path=np.full(rocks, 30.0),
        impacts=np.full(rocks, BOUNCES),
        max_speed=fastest,
        max_energy=0.5 * MASS * fastest**2,
        max_height=np.where(number == 0, np.nan, 5.0),
        ground_speed=np.array([np.linalg.norm(throw[0][-2][2]) for throw in throws]),
        mass=np.full(rocks, MASS),
    )


def _impacts(terrain: Terrain, rows: list) -> Impacts:
    return Impacts(
        row=np.array([r[0] for r in rows]),
        t=np.array([r[1] for r in rows]),
        x=np.array([r[2] for r in rows]),
        facet=np.array([facet_under(terrain, r[2]) for r in rows]),
        normal=np.tile([0.0, 0.0, 1.0], (len(rows), 1)),
        speed_in=np.array([np.linalg.norm(r[3]) for r in rows]),
        speed_out=np.array([np.linalg.norm(r[4]) for r in rows]),
    )


def _paths(rows: list) -> Paths:
    return Paths(
        row=np.array([r[0] for r in rows]),
        t=np.array([r[1] for r in rows]),
        x=np.array([r[2] for r in rows]),
        v=np.array([r[3] for r in rows], dtype=float),
        v_end=np.array([r[4] for r in rows], dtype=float),
        mode=np.array([int(r[5]) for r in rows]),
    )
