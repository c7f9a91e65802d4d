"""Compute the true level of a combination: fly rocks of the true sources over the true terrain, and count them.

The oracle uses no code of `rpf3d_core.alerts` or `rpf3d_ros`, and of `rpf3d_core.live` only the function that makes the
scene. The events of a path, joined by straight lines in plan, are the track of a rock; a rock whose track touches an
area has reached the area.
"""

import math
from functools import cache

import numpy as np
import shapely
from never_green.pit import THROW, FloatArray, survey
from never_green.plan import TrueSource, Truth

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.live.scene import live_scene
from rpf3d_core.setup.prepared import scene_flight
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.grid_rows import grid_mesh

ROCKS = 300
"""Number of rocks of each source."""

SPREAD, SPEED = 1.0, 0.5
"""Largest offset of a rock from its source along x and y (m), and largest component of its velocity (m/s)."""

SCENE = {"ground": "sliding", "target.most_rocks": 100}
"""Values of the scene of node and oracle, as parameters of the node."""

LEVELS = ("normal", "watch", "restrict", "evacuate")
LIMITS = {"watch": 0.05, "restrict": 0.2, "evacuate": 0.5}
"""Limit of each level: smallest share (-) of the rocks that reach an area."""

HIGH = 1000.0
"""Height (m, local frame) above all ground, from which the ground below is searched."""

QUANTILE = 1.959963984540054
"""The 97.5 % quantile of the normal distribution, for 95 % intervals."""


class Oracle:
    """Computes the true levels of one truth; each source is simulated only once over each state of the terrain."""

    def __init__(self, truth: Truth, limits: str, radius: float) -> None:
        """Begin without flights.

        limits : highest level for which the site has a limit, as a word; radius : radius (m) around a machine
        """
        self._truth, self._highest, self._radius = truth, LEVELS.index(limits), radius
        self._tracks: dict[tuple[int, bool], FloatArray] = {}
        self._known: dict[tuple[object, ...], tuple[int, int]] = {}

    def range_at(self, sources_at: float, terrain_at: float, area_at: float) -> tuple[int, int]:
        """Return the lowest and the highest level that the true share of rocks may have, as indices in LEVELS.

        The share is known only within its 95 % interval. The truth is taken at three times (s): the sources at
        `sources_at`, the terrain at `terrain_at`, and the areas at `area_at`.
        """
        sources, truth = self._truth.sources, self._truth
        there = tuple(n for n, one in enumerate(sources) if one.since <= sources_at < one.until)
        key = there, truth.has_bank(terrain_at), area_at >= truth.area_since
        if key not in self._known:
            self._known[key] = self._range_of(there, truth.has_bank(terrain_at), area_at)
        return self._known[key]

    def _range_of(self, there: tuple[int, ...], has_bank: bool, area_at: float) -> tuple[int, int]:
        levels = [(0, 0)]
        for number in there:
            tracks = self._tracks_of(number, has_bank)
            levels += [self._level(int(shapely.intersects(tracks, area).sum())) for area in self._areas(area_at)]
        return max(low for low, _ in levels), max(high for _, high in levels)

    def _areas(self, at: float) -> list[shapely.Geometry]:
        machines = self._truth.machines
        circles = [] if machines is None else [shapely.Point(place[:2]).buffer(self._radius) for place in machines]
        return [shapely.Polygon(self._truth.area(at)), *([shapely.union_all(circles)] if circles else [])]

    def _level(self, reached: int) -> tuple[int, int]:
        low, high = interval(reached, ROCKS)
        levels = [sum(share >= LIMITS[word] for word in LEVELS[1 : self._highest + 1]) for share in (low, high)]
        return levels[0], levels[1]

    def _tracks_of(self, number: int, has_bank: bool) -> FloatArray:
        key = number, has_bank
        if key not in self._tracks:
            self._tracks[key] = np.array(tracks_from(self._truth.sources[number], has_bank))
        return self._tracks[key]


def interval(reached: int, flown: int) -> tuple[float, float]:
    """Return the 95 % Wilson interval (-) of the share of rocks that reached a place."""
    share, z2 = reached / flown, QUANTILE**2
    middle = (share + z2 / (2 * flown)) / (1 + z2 / flown)
    half = QUANTILE / (1 + z2 / flown) * math.sqrt(share * (1 - share) / flown + z2 / (4 * flown**2))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def tracks_from(source: TrueSource, has_bank: bool) -> list[shapely.Geometry]:
    """Return the tracks in plan of the rocks of a source over the true terrain, as lines (shapely) in the map frame."""
    engine, flight, origin = flying_over(has_bank)
    releases = releases_around(source.place - origin, THROW if source.is_thrown else (0.0, 0.0, 0.0), engine)
    flights = fly_ensemble(engine, flight, releases, threads=1)
    paths = flights.paths
    starts = np.flatnonzero(np.diff(paths.row, prepend=-1))
    ways = np.split(paths.x[:, :2], starts[1:])
    return [shapely.LineString(np.vstack([way, way[-1]]) + origin[:2]) for way in ways]


def releases_around(place: FloatArray, velocity: tuple[float, float, float], engine: Engine) -> Releases:
    """Return the releases of the rocks of a source, spread in plan, all at the source's height above the ground.

    place : (3,) m, local frame; velocity : of the source (m/s), to which a random velocity of each rock is added
    """
    rng = np.random.default_rng(int(abs(place).sum() * 1e6) % 2**63)
    x = np.repeat(place[None], ROCKS, axis=0)
    x[:, :2] += rng.uniform(-SPREAD, SPREAD, (ROCKS, 2))
    top = np.vstack([place, x])
    top[:, 2] = HIGH
    ground = HIGH - engine.ground_below(top)[:, 0]
    x[:, 2] = ground[1:] + place[2] - ground[0]
    velocities, numbers, ones = rng.uniform(-SPEED, SPEED, (ROCKS, 3)) + velocity, np.arange(ROCKS), np.ones(ROCKS)
    return Releases(np.zeros_like(numbers), numbers, x, velocities, 1000.0 * ones, 0.5 * ones)


@cache
def flying_over(has_bank: bool) -> tuple[Engine, object, FloatArray]:
    """Return the engine over the true terrain, materials and models of flights, and the terrain's origin (3,) m."""
    mesh = grid_mesh(survey(has_bank))
    zone = np.zeros(len(mesh.triangles), np.int32)
    terrain = Terrain(mesh.vertices, mesh.triangles, zone, ("terrain",), Frame(mesh.origin))
    return engine_of("compiled", facets_of(terrain)), scene_flight(live_scene(SCENE), terrain), np.array(mesh.origin)
