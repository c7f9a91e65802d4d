"""Builds the trees of a scene: read from a file or drawn, and placed on the terrain."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.effects.forest import Deflection, Forest, Stems, most_energy
from rpf3d_core.effects.obstacle_cells import cells_of
from rpf3d_core.ensemble.sizes import diameter_of, mass_range
from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan, read_polygons
from rpf3d_core.formats.trees import KINDS, Tree, read_trees
from rpf3d_core.materials.gamma import gamma_of
from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.scene.forest import ForestSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import extents, lies_off
from rpf3d_core.setup.sources import rock_of
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.terrain.sections import ground_at
from rpf3d_core.terrain.zones import covered, in_plan

ANGLES = (0.0, 22.5, 67.5, 76.0)
"""Degrees at which the classes of angles begin and end (physics reference 4.1)."""
CENTIMETRE = 0.01
SQUARE_METRES_PER_HA = 10_000.0
MOST_TREES = 20_000_000
"""Largest number of trees of a scene; they take 1 GB."""
OFF_GROUND = 2.0
"""Metres allowed between the foot of a tree in a file and the ground: surveys of trees and of the ground differ."""
ROOM = 1.0 + 1e-9
"""Factor on the largest rock's radius, so that rounding assigns no tree to too few cells."""


class _Stand(NamedTuple):
    """T trees in plan: plan (T, 2) m, local; diameter (T,) m, height (T,) m; kind (T,) of KINDS."""

    plan: FloatArray
    diameter: FloatArray
    height: FloatArray
    kind: NDArray[np.int64]


def forest_of(spec: ForestSpec, scene: Scene, terrain: Terrain) -> Forest:
    """Return the trees of a scene.

    Raises
    ------
    InputError
        A file is damaged, a tree of the file stands off the terrain or its foot off the ground, the polygons lie off
        the terrain, or too many trees would be drawn; names the key.
    """
    stand = _drawn(spec, scene, terrain) if spec.file is None else _written(spec, scene, terrain)
    z, facet = ground_at(terrain, stand.plan)
    there = facet >= 0
    stand, z = _some(stand, there), z[there]
    factors = np.array([getattr(spec.energy_factors, kind) for kind in KINDS])
    energy = most_energy(stand.diameter / CENTIMETRE, factors[stand.kind])
    stems = Stems(
        x=np.ascontiguousarray(stand.plan[:, 0]), y=np.ascontiguousarray(stand.plan[:, 1]), z=z,
        radius=0.5 * stand.diameter, height=np.ascontiguousarray(stand.height), energy=np.ascontiguousarray(energy),
    )  # fmt: skip
    aside = spec.deflection
    chances = tuple(chance for blow in (aside.frontal, aside.lateral, aside.scratch) for chance in blow)
    reach = stems.radius[:, None] + ROOM * _largest_radius(scene)
    cells = cells_of(stand.plan - reach, stand.plan + reach)
    return Forest(
        first=0,
        stems=stems,
        deflection=Deflection(
            frontal=aside.frontal_within, lateral=aside.lateral_within, chances=chances, angles=ANGLES
        ),
        cells=cells,
    )


def forest_as_obstacles(name: str, spec: ForestSpec, forest: Forest) -> Obstacles:
    """Return the trees as obstacles with one name: stems (T, 4) m with foot and diameter."""
    stems = forest.stems
    feet = np.stack([stems.x, stems.y, stems.z, 2.0 * stems.radius], axis=1)
    return Obstacles(names=(name,), owner=np.zeros(len(feet), dtype=np.int64), lines=(), stems=feet)


def _largest_radius(scene: Scene) -> float:
    """Return the largest radius of a rock of the scene, m."""
    return 0.5 * float(diameter_of(mass_range(rock_of(scene.rock))[1], scene.rock.density))


def _written(spec: ForestSpec, scene: Scene, terrain: Terrain) -> _Stand:
    """Return the trees of a file."""
    key = f"{scene.path}: `effects.forest.file`"
    try:
        trees = read_trees(spec.file, terrain.frame.up)  # type: ignore[arg-type]
    except InputError as fault:
        raise InputError(f"{key} names a file that cannot be used: {fault}") from fault
    plan = local_plan(terrain.frame, np.array([(tree.east, tree.north) for tree in trees]))
    ground, facet = ground_at(terrain, plan)
    for tree, z, f in zip(trees, ground.tolist(), facet.tolist(), strict=True):
        _check_foot(key, spec, tree, terrain, z, f)
    return _Stand(
        plan=plan,
        diameter=CENTIMETRE * np.array([tree.dbh for tree in trees]),
        height=np.array([spec.height if tree.height is None else tree.height for tree in trees]),
        kind=np.array([KINDS.index(tree.kind) for tree in trees]),
    )


def _check_foot(key: str, spec: ForestSpec, tree: Tree, terrain: Terrain, ground: float, facet: int) -> None:
    """Refuse a tree off the terrain, or with a foot in the file that is not on the ground."""
    where = f"{key}: the tree at ({tree.east:g}, {tree.north:g}) of {spec.file}, line {tree.line},"
    if facet < 0:
        raise InputError(f"{where} stands off the terrain: {extents(terrain, np.array([(tree.east, tree.north)]))}")
    if tree.foot is None:
        return
    above = tree.foot - (ground + terrain.frame.origin[2])
    if abs(above) > OFF_GROUND:
        place = "inside the ground" if above < 0.0 else "in the air"
        raise InputError(f"{where} stands {place}: its foot is {above:+.1f} m from the ground, {OFF_GROUND:g} at most")


def _drawn(spec: ForestSpec, scene: Scene, terrain: Terrain) -> _Stand:
    """Return trees drawn evenly in plan in the box of the terrain, or in polygons on it.

    Trees for polygons are drawn in the box around the polygons; trees outside the polygons are dropped.
    """
    within = None if spec.within is None else _outline(spec, scene, terrain)
    low, high = _box(terrain, within)
    number = _number(spec, scene, float(np.prod(np.maximum(high - low, 0.0))))
    tree = np.arange(number)
    share = np.stack([uniform(scene.seed, 0, tree, stream) for stream in (Purpose.TREE_X, Purpose.TREE_Y)], axis=1)
    plan = low + share * (high - low)
    diameter = CENTIMETRE * gamma_of(scene.seed, Purpose.TREE_DIAMETER, tree, spec.dbh_mean_cm, spec.dbh_sd_cm)
    conifers = uniform(scene.seed, 0, tree, Purpose.TREE_KIND) < spec.conifer_share
    stand = _Stand(plan=plan, diameter=diameter, height=np.full(number, spec.height), kind=np.where(conifers, 0, 1))
    if within is None:
        return stand
    inside = covered(within, in_plan(terrain.frame, np.pad(plan, ((0, 0), (0, 1)))))
    return _some(stand, inside)


def _some(stand: _Stand, chosen: NDArray[np.bool_]) -> _Stand:
    """Return the chosen trees of a stand, by a mask (T,)."""
    return _Stand(
        plan=stand.plan[chosen], diameter=stand.diameter[chosen], height=stand.height[chosen], kind=stand.kind[chosen]
    )


def _box(terrain: Terrain, within: Any | None) -> tuple[FloatArray, FloatArray]:
    """Return the corners (2,), (2,) m, in plan and local, of the box in which trees are drawn."""
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    if within is None:
        return low, high
    corners = local_plan(terrain.frame, np.reshape(within.bounds, (2, 2)))
    return np.maximum(low, corners.min(axis=0)), np.minimum(high, corners.max(axis=0))


def _number(spec: ForestSpec, scene: Scene, area: float) -> int:
    """Return the number of trees to draw over an area (m^2) in plan."""
    stems = (spec.stems_per_ha or 0.0) * area / SQUARE_METRES_PER_HA
    if stems > MOST_TREES:
        raise InputError(
            f"{scene.path}: `effects.forest.stems_per_ha` makes {stems:,.0f} trees, but {MOST_TREES:,} are the most"
        )
    return math.floor(stems + 0.5)


def _outline(spec: ForestSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return the polygons in which trees are drawn, in the input's plan coordinates."""
    key = f"{scene.path}: `effects.forest.within`"
    try:
        polygons = read_polygons(spec.within)  # type: ignore[arg-type]
    except InputError as fault:
        raise InputError(f"{key} names a file that cannot be used: {fault}") from fault
    if lies_off(terrain, polygons):
        raise InputError(f"{key} lies off the terrain: {extents(terrain, np.reshape(polygons.bounds, (2, 2)))}")
    return polygons
