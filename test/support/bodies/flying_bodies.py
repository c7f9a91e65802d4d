"""Fly rocks with a shape (bodies) over small meshes, and compute their heights with code that no engine uses.

All tests use the same types (`RigidBody`, `Materials`, no caps), so the compiled flight loop is compiled once.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.effects.scarring import Scarring
from rpf3d_core.kinetics.rigid_body import RigidBody
from rpf3d_core.kinetics.slippage import SlipFriction
from rpf3d_core.materials.library import Surface, materials_of
from rpf3d_core.shapes.polyhedron import Polyhedron
from rpf3d_core.shapes.table import ShapeTable, shape_table
from rpf3d_core.simulation.engines import (
    BODY_COUNTS,
    BODY_FINALS,
    COUNT_COLUMNS,
    FINAL_COLUMNS,
    SPIN_FINALS,
    Engine,
    Models,
    engine_of,
)
from rpf3d_core.simulation.launches import Starts
from rpf3d_core.simulation.record import IMPACT_COLUMNS, POSE, Logbook, empty_record
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.values import STANDARD_GRAVITY, Mode, Outcome

G = STANDARD_GRAVITY
QUATERNION = len(FINAL_COLUMNS) + len(SPIN_FINALS)
"""First column of the orientation in `finals`."""
NO_TURN = (1.0, 0.0, 0.0, 0.0)
SOUND = (Outcome.STOPPED, Outcome.LEFT_TERRAIN, Outcome.MAX_TIME)
"""Outcomes of a body whose contacts could all be solved."""


# --- flights ----------------------------------------------------------------------------------------------------------


class Drop(NamedTuple):
    """R bodies at their release.

    x : (R, 3) m; v : (R, 3) m/s; shape : (R,) number of the shape; pose : (R, 4) orientation
    radius : (R,) m, of a sphere of equal volume
    """

    x: np.ndarray
    v: np.ndarray
    shape: np.ndarray
    pose: np.ndarray
    radius: np.ndarray


class Terms(NamedTuple):
    """The ground, the limits and the size of the record of flights.

    surfaces : coefficients of each zone; accuracy : accuracy (m) of contacts
    rows : number of rows for path segments, and for impacts, of all bodies together; 0 for no record
    max_time, max_impacts : time (s) and number of impacts at which a flight is cut off
    effects : effects on the bodies, in order; slip : slip friction of the zones; mass : mass (kg) of each body
    """

    surfaces: tuple[Surface, ...]
    accuracy: float = 2e-3
    rows: int = 0
    max_time: float = 200.0
    max_impacts: int = 100_000
    effects: tuple[object, ...] = ()
    slip: SlipFriction | None = None
    mass: float = 1.0


class Flown(NamedTuple):
    """The flights of R bodies; `simulation/record.py` defines the columns.

    finals, counts : (R, ...) final states; pieces, modes : segments of all paths, one row each
    impacts : all impacts, one row each; first : (R + 1, 2) first row of each body in `impacts` and in `pieces`
    facets : (I,) facet of each impact, below 0 for obstacles
    """

    finals: np.ndarray
    counts: np.ndarray
    pieces: np.ndarray
    modes: np.ndarray
    impacts: np.ndarray
    first: np.ndarray
    facets: np.ndarray

    @property
    def outcome(self) -> np.ndarray:
        """The outcomes of the flights (R,), numbers of `Outcome`."""
        return self.counts[:, 0]

    @property
    def t(self) -> np.ndarray:
        """The times (R,) s at which the flights end."""
        return self.finals[:, 0]

    @property
    def x(self) -> np.ndarray:
        """The centres of mass (R, 3) m at the ends of the flights."""
        return self.finals[:, 1:4]

    @property
    def q(self) -> np.ndarray:
        """The orientations (R, 4) at the ends of the flights."""
        return self.finals[:, QUATERNION : QUATERNION + 4]

    @property
    def lift(self) -> np.ndarray:
        """The heights (R,) m by which the bodies were lifted at their release."""
        return self.finals[:, QUATERNION + 4]

    def path(self, i: int = 0) -> "Path":
        """Return the recorded path of body number i."""
        rows = slice(self.first[i, 1], self.first[i + 1, 1])
        return Path(self.pieces[rows], self.modes[rows])

    def blows(self, i: int = 0) -> np.ndarray:
        """Return the impacts of body number i, one row each.

        The columns are time (s), place (3, m), normal (3), speed before and after (m/s), spin before and after (rad/s),
        number of contacts, kinetic energy before and after (J/kg).
        """
        rows = self.impacts[self.first[i, 0] : self.first[i + 1, 0]]
        speeds, spins = rows[:, 7:9], rows[:, IMPACT_COLUMNS : IMPACT_COLUMNS + 2]
        return np.hstack([rows[:, :7], speeds, spins, rows[:, IMPACT_COLUMNS + 2 :]])


class Path(NamedTuple):
    """The recorded path of a body: one row for each segment, and one for the end of the path.

    rows : (S, ...) as in `Flown.pieces`; modes : (S,) kind of motion
    """

    rows: np.ndarray
    modes: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Times (S,) s at which the segments begin."""
        return self.rows[:, 0]

    @property
    def x(self) -> np.ndarray:
        """Centres of mass (S, 3) m at the beginning of the segments."""
        return self.rows[:, 1:4]

    @property
    def v(self) -> np.ndarray:
        """Velocities (S, 3) m/s at the beginning of the segments."""
        return self.rows[:, 4:7]

    @property
    def v_end(self) -> np.ndarray:
        """Velocities (S, 3) m/s at the end of the segments."""
        return self.rows[:, 7:10]

    @property
    def q(self) -> np.ndarray:
        """Orientations (S, 4) at the beginning of the segments, as quaternions."""
        return self.rows[:, POSE : POSE + 4]

    @property
    def w(self) -> np.ndarray:
        """Spins (S, 3) rad/s at the beginning of the segments, in the body's axes."""
        return self.rows[:, POSE + 4 : POSE + 7]

    @property
    def energy(self) -> np.ndarray:
        """Sum of kinetic and potential energy (S,) J/kg at the beginning of the segments."""
        v = self.v
        return 0.5 * (v * v).sum(1) + self.rows[:, POSE + 7] + G * self.x[:, 2]

    @property
    def sliding(self) -> np.ndarray:
        """Flags (S,), True for segments that are steps in contact."""
        return self.modes == Mode.SLIDING


def radius_of(polyhedron: Polyhedron) -> float:
    """Return the radius (m) of the sphere that has the volume of a polyhedron."""
    return float(np.cbrt(polyhedron.volume / (4.0 / 3.0 * math.pi)))


def drop(
    shapes: Sequence[Polyhedron], x: np.ndarray, pose: np.ndarray | None = None, v: Sequence[float] | None = None
) -> Drop:
    """Return bodies released with their centres at points x, (3,) or (R, 3) m.

    shapes : polyhedra; body i has shape number i modulo their number
    pose : (R, 4) orientations, None for no rotation; v : velocity (3,) of all bodies, or (R, 3) m/s; None for 0
    """
    x = np.ascontiguousarray(np.atleast_2d(np.asarray(x, dtype=float)))
    count = len(x)
    shape = np.arange(count) % len(shapes)
    poses = np.tile(NO_TURN, (count, 1)) if pose is None else np.atleast_2d(np.asarray(pose, dtype=float))
    speeds = np.zeros((count, 3)) + (0.0 if v is None else np.asarray(v, dtype=float))
    radius = np.array([radius_of(shapes[k]) for k in shape])
    return Drop(x, np.ascontiguousarray(speeds), shape, np.ascontiguousarray(poses), radius)


def soft_ground(stiffness: float = 5e6, drag: float = 2.5, density: float = 1700.0) -> Scarring:
    """Return the effect `scarring` (soft ground) of one zone.

    stiffness : Pa; drag : drag coefficient (-); density : kg/m3. The friction in a scar is 0: bodies do not use it
    """
    columns = (stiffness, drag, density, 0.0, 0.0, 1.0)
    return Scarring(*(np.array([value]) for value in columns))


def table_of(shapes: Sequence[Polyhedron]) -> ShapeTable:
    """Return the shape table of a scene whose rocks have these polyhedra, all with the same weight."""
    return shape_table(shapes, [1.0] * len(shapes))


def flown(engine: Engine, shapes: Sequence[Polyhedron], bodies: Drop, terms: Terms) -> Flown:
    """Return the flights of bodies over the terrain of an engine."""
    count = len(bodies.x)
    numbers, mass = np.arange(count), np.full(count, terms.mass)
    starts = Starts(
        x=bodies.x, v=bodies.v, source=np.zeros(count, np.int64), rock=numbers, mass=mass, radius=bodies.radius,
        shape=bodies.shape, pose=bodies.pose,
    )  # fmt: skip
    finals = np.full((count, len(FINAL_COLUMNS) + len(SPIN_FINALS) + len(BODY_FINALS)), np.nan)
    counts = np.zeros((count, len(COUNT_COLUMNS) + len(BODY_COUNTS)), np.int64)
    record = empty_record(terms.rows, terms.rows, True, True)
    log = Logbook(record, np.zeros((count + 1, 2), np.int64), finals, counts)
    models = Models(RigidBody(table_of(shapes), terms.accuracy, terms.slip), None, chain_of(terms.effects))
    settings = Settings(max_time=terms.max_time, max_impacts=terms.max_impacts)
    done = engine.follow(models, materials_of(list(terms.surfaces)), settings, starts, log, 0)
    assert done == count, "the record is large enough"
    return Flown(finals, counts, record.pieces, record.modes, record.impacts, log.first, record.facets)


def flown_over(terrain: Terrain, shapes: Sequence[Polyhedron], bodies: Drop, terms: Terms) -> Flown:
    """Return the flights of bodies over a terrain on the compiled engine."""
    return flown(engine_of("compiled", facets_of(terrain)), shapes, bodies, terms)


def ground(mu: float, e: float = 0.0, mu_r: float = 0.0, stop_speed: float = 0.0) -> Surface:
    """Return a surface with friction mu, restitution e and rolling resistance mu_r (-), and a stop speed (m/s)."""
    return Surface(R_n=e, R_t=0.0, mu=mu, stop_speed=stop_speed, mu_r=mu_r)


# --- orientations -----------------------------------------------------------------------------------------------------


def about(axis: Sequence[float], angle: float) -> np.ndarray:
    """Return the quaternion (4,) of a rotation about an axis (3,) by an angle (rad)."""
    a = np.asarray(axis, dtype=float)
    return np.array([math.cos(0.5 * angle), *(math.sin(0.5 * angle) * a / np.linalg.norm(a))])


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) of the rotation q followed by the rotation p."""
    a, b = p[1:], q[1:]
    return np.array([p[0] * q[0] - a @ b, *(p[0] * b + q[0] * a + np.cross(a, b))])


def random_poses(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return `count` uniformly distributed orientations (R, 4)."""
    q = rng.normal(size=(count, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1)[:, None])


def matrix(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of an orientation (4,), from the body's axes to the axes of the terrain."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def angle_between(p: np.ndarray, q: np.ndarray) -> float:
    """Return the angle (rad) of the rotation from one orientation p (4,) to another q (4,)."""
    away = p[0] * q[1:] - q[0] * p[1:] - np.cross(p[1:], q[1:])
    return 2.0 * math.asin(min(float(np.linalg.norm(away)), 1.0))


def corners_of(shape: Polyhedron, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the corners (C, 3) m of a body in the terrain's frame; x : centre (3,) m; q : orientation (4,)."""
    return np.asarray(x + shape.corners @ matrix(q).T)


# --- where bodies are -------------------------------------------------------------------------------------------------


def triangles_of(terrain: Terrain) -> np.ndarray:
    """Return the corners (F, 3, 3) m of all facets."""
    return np.asarray(terrain.vertices[terrain.triangles])


def heights_above(terrain: Terrain, points: np.ndarray) -> np.ndarray:
    """Return the smallest height (N,) m of each point (N, 3) m above the facets over or under it; inf without facets.

    The height is measured at right angles to a facet's plane, and is negative below the plane. Vertical facets do not
    count.
    """
    t = triangles_of(terrain)
    n = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    steep = np.abs(n[:, 2]) > 1e-9 * np.linalg.norm(n, axis=1)
    t, n = t[steep], n[steep] / np.linalg.norm(n[steep], axis=1)[:, None]
    inside = np.ones((len(points), len(t)), dtype=bool)
    for k in range(3):
        edge, away = t[:, (k + 1) % 3] - t[:, k], points[:, None] - t[None, :, k]
        inside &= (edge[:, 0] * away[:, :, 1] - edge[:, 1] * away[:, :, 0]) * np.sign(n[:, 2]) >= 0.0
    height = np.einsum("nfi,fi->nf", points[:, None] - t[None, :, 0], n)
    return np.asarray(np.where(inside, height, math.inf).min(axis=1))


def depths_of_vertices(terrain: Terrain, shape: Polyhedron, x: np.ndarray, q: np.ndarray) -> float:
    """Return the depth (m) of the deepest vertex of a terrain inside a body; negative if no vertex is inside.

    x : centre of the body (3,) m; q : orientation (4,)
    """
    local = (terrain.vertices - x) @ matrix(q)
    first = np.array([shape.corners[face[0]] for face in shape.faces])
    outside = np.einsum("vfi,fi->vf", local[:, None] - first[None], shape.normals)
    return float((-outside.max(axis=1)).max())


def lowest(terrain: Terrain, shape: Polyhedron, x: np.ndarray, q: np.ndarray) -> float:
    """Return the smallest height (m) of a body above a terrain; negative if they overlap.

    Only corners of the body and vertices of the terrain are checked, not edges. x : centre (3,) m; q : orientation (4,)
    """
    height = float(heights_above(terrain, corners_of(shape, x, q)).min())
    return min(height, -depths_of_vertices(terrain, shape, x, q))
