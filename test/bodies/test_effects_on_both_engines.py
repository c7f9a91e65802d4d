"""Tests that both engines give the same bits for bodies with all effects at the same time."""

import numpy as np
import pytest
from bodies.flying_bodies import Terms, drop, flown, ground, random_poses, soft_ground
from flights.obstacles_made import ASIDE, fence, fences, rough_ground, trees

from rpf3d_core.effects.drag import Drag
from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.kinetics.slippage import SlipFriction
from rpf3d_core.shapes.families import box, family
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Outcome

COUNT, MASS, G = 12, 800.0, 9.80665
SLIP = SlipFriction(*(np.array([value]) for value in (0.4, 1.2, 2.0, 20.0)))


def every_effect(terrain: Terrain):
    """Return soft ground, two kinds of air, a wood and two fences, in the order in which a scene's effects act."""
    half = 0.9 * float(np.abs(terrain.vertices[:, 1]).max())
    stems = [(x, y) for x in (4.0, 9.0, 17.0) for y in np.arange(-half, half, 2.3)]
    wood = trees(terrain, stems, 50.0, 15.0, 3e4, ASIDE)
    weak, strong = (fence(terrain, [(x, -half), (x, half)], 2.0, joule, 0.5) for x, joule in ((13.0, 2e4), (22.0, 1e9)))
    net = fences(weak, strong)._replace(first=wood.obstacles)
    everywhere = np.empty((0, 4))
    return soft_ground(2e6), Drag(0.8, 1.2, 1e-3, G), DragLayer(40.0, 1.5, 1e-3, G, everywhere), wood, net


def fallen(engine: str):
    """Return bodies of two shapes that fall down an uneven incline under every effect."""
    terrain, rng = rough_ground(), np.random.default_rng(8)
    x = np.stack([rng.uniform(-1, 1, COUNT), rng.uniform(-4, 4, COUNT), rng.uniform(2.5, 5, COUNT)], 1)
    v = np.stack([rng.uniform(2, 9, COUNT), rng.uniform(-1, 1, COUNT), rng.uniform(-1, 1, COUNT)], 1)
    shapes = [box((1.0, 0.8, 0.5)), family("equant")]
    bodies = drop(shapes, x, random_poses(rng, COUNT), v)._replace(radius=np.full(COUNT, 0.45))
    effects = every_effect(terrain)
    terms = Terms((ground(0.6, 0.2, 0.1, 0.3),), 3e-3, 60_000, 40.0, effects=effects, slip=SLIP, mass=MASS)
    return flown(engine_over(engine, terrain), shapes, bodies, terms)


def test_bodies_meet_ground_and_obstacles_under_every_effect():
    end = fallen("reference")
    rows = end.facets[: end.first[-1, 0]]
    assert (rows < 0).sum() > COUNT // 2, "obstacles were met"
    assert (rows >= 0).sum() > COUNT, "the ground was hit"
    assert {int(Outcome.STOPPED), int(Outcome.CAUGHT)} <= set(end.outcome.tolist())


@pytest.mark.long
def test_both_engines_give_the_same_bits_under_every_effect():
    plain, compiled = fallen("reference"), fallen("compiled")
    np.testing.assert_array_equal(plain.first, compiled.first)
    impacts, pieces = plain.first[-1]
    for name in ("finals", "counts", "pieces", "modes", "impacts", "facets"):
        rows = {"pieces": pieces, "modes": pieces, "impacts": impacts, "facets": impacts}.get(name, COUNT)
        np.testing.assert_array_equal(getattr(plain, name)[:rows], getattr(compiled, name)[:rows], name)
