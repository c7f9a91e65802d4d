"""Build the trees of a scene: read them from a file or draw them at random, and place them on the terrain."""

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
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.forest import ForestSpec
from rpf3d_core.setup.coverage import extents, lies_off
from rpf3d_core.setup.shapes import rock_of_scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.terrain.sections import ground_at
from rpf3d_core.terrain.zones import covered, in_plan

ANGLES = (0.0, 22.5, 67.5, 76.0)
"""Limits (degrees) of the three ranges of angles by which a tree deflects rocks, after Rockyfor3D; unconfirmed."""
CENTIMETRE = 0.01
SQUARE_METRES_PER_HA = 10_000.0
MOST_TREES = 20_000_000
"""Largest number of randomly placed trees; they take 1 GB of memory."""
OFF_GROUND = 2.0
"""Largest allowed height (m) of a tree's foot above or below the ground: surveys of trees and of ground differ."""
ROOM = 1.0 + 1e-9
"""Factor (-) that enlarges the largest rock's radius, so that rounding never leaves a tree out of a search cell."""


class _Stand(NamedTuple):
    """The T trees of a scene before they are placed on the terrain.

    plan : (T, 2) m, local frame; diameter, height : (T,) m; kind : (T,) index into KINDS
    """

    plan: FloatArray
    diameter: FloatArray
    height: FloatArray
    kind: NDArray[np.int64]


def forest_of(spec: ForestSpec, scene: Scene, terrain: Terrain) -> Forest:
    """Return the trees of a scene in the form that the flight loops read.

    Raises
    ------
    InputError
        A file is damaged, a tree of the file stands off the terrain or its foot off the ground, the polygons lie off
        the terrain, or too many trees would be drawn; the message names the key.
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
    """Return the trees of a scene for pictures and recordings: stems (T, 4) m with foot and diameter.

    All trees have the same name, the name of the effect.
    """
    stems = forest.stems
    feet = np.stack([stems.x, stems.y, stems.z, 2.0 * stems.radius], axis=1)
    return Obstacles(names=(name,), owner=np.zeros(len(feet), dtype=np.int64), lines=(), stems=feet)


def _largest_radius(scene: Scene) -> float:
    """Return the radius (m) of the scene's largest rock as a sphere, to find the cells where rocks can meet a stem."""
    return 0.5 * float(diameter_of(mass_range(rock_of_scene(scene))[1], scene.rock.density))


def _written(spec: ForestSpec, scene: Scene, terrain: Terrain) -> _Stand:
    """Return the trees of the scene's tree file; raise an InputError if the file or a tree in it is refused."""
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
    """Raise an InputError if a tree of the file stands off the terrain, or if its foot is not on the ground.

    The foot may be up to OFF_GROUND (m) above or below the ground.

    key : key of the file in the scene, for the message; ground : height (m) of the ground, local frame
    facet : facet below the tree, -1 for none
    """
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
    """Return trees at random places, evenly distributed over the box around the terrain or over the scene's polygons.

    For polygons, trees are drawn in the box around the polygons; trees outside the polygons are left out. `forest_of`
    leaves out trees off the terrain.
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
    """Return the trees for which `chosen` (T,) is True."""
    return _Stand(
        plan=stand.plan[chosen], diameter=stand.diameter[chosen], height=stand.height[chosen], kind=stand.kind[chosen]
    )


def _box(terrain: Terrain, within: Any | None) -> tuple[FloatArray, FloatArray]:
    """Return the corners (2,), (2,) m, local frame, of the box in plan in which trees are drawn.

    within : polygons in which trees are drawn; None for the whole terrain
    """
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    if within is None:
        return low, high
    corners = local_plan(terrain.frame, np.reshape(within.bounds, (2, 2)))
    return np.maximum(low, corners.min(axis=0)), np.minimum(high, corners.max(axis=0))


def _number(spec: ForestSpec, scene: Scene, area: float) -> int:
    """Return the number of trees to draw on an area (m^2) in plan, from the scene's stems per hectare.

    Raise an InputError if the number is above MOST_TREES.
    """
    stems = (spec.stems_per_ha or 0.0) * area / SQUARE_METRES_PER_HA
    if stems > MOST_TREES:
        raise InputError(
            f"{scene.path}: `effects.forest.stems_per_ha` makes {stems:,.0f} trees, but {MOST_TREES:,} are the most"
        )
    return math.floor(stems + 0.5)


def _outline(spec: ForestSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return the polygons in which trees are drawn, in the plan coordinates of the input.

    Raise an InputError if the file is damaged, or if the polygons lie off the terrain.
    """
    key = f"{scene.path}: `effects.forest.within`"
    try:
        polygons = read_polygons(spec.within)  # type: ignore[arg-type]
    except InputError as fault:
        raise InputError(f"{key} names a file that cannot be used: {fault}") from fault
    if lies_off(terrain, polygons):
        raise InputError(f"{key} lies off the terrain: {extents(terrain, np.reshape(polygons.bounds, (2, 2)))}")
    return polygons
