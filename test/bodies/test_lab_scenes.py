"""Tests of the lab scenes of a cube and a plate, which stop on an incline where rolling resistance holds them.

A body at rest on a plane of angle a needs mu > tan a, and gravity's moment about its support is at most the rolling
moment mu_r R N, where N = m g cos a and R is the radius of the sphere of equal volume. So the horizontal distance of
its centre from its support is at most mu_r R cos a. scipy turns the corners; the check shares no code with the flight.
"""

import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

import rpf3d_core as rpf3d
from rpf3d_core.values import Outcome

SCENES = Path(__file__).parents[2] / "config" / "scenes"
SIDES = {"lab_40_cube": (0.04, 0.04, 0.04), "lab_40_plate": (0.08, 0.08, 0.02)}
"""Scene -> sides (m), the longest first, because the axes of a body have ascending moments of inertia."""
INCLINE = math.radians(40.0)
NORMAL = np.array([math.sin(INCLINE), 0.0, math.cos(INCLINE)])
"""Unit normal of the incline, which contains the origin of the input."""
ACCURACY = 1e-4
NEAR = 2.1 * ACCURACY
"""Largest distance from the ground of a body at rest (m), as in test/support/campaigns/bodies_on_meshes.py."""


def corners_at_rest(run: rpf3d.Run, sides: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the centres (N, 3) and the corners (N, 8, 3) of bodies at their ends, m in the input."""
    ends = run.flights.deposits
    assert ends.pose is not None
    centre = run.terrain.frame.points_to_input(ends.x)
    arms = np.array(list(product(*((-0.5 * side, 0.5 * side) for side in sides))))
    turns = [Rotation.from_quat(np.roll(q, -1)) for q in ends.pose]
    return centre, np.array([x + turn.apply(arms) for x, turn in zip(centre, turns, strict=True)])


def distance_from_support(centre: np.ndarray, support: np.ndarray) -> float:
    """Return the horizontal distance (m) of a centre (3,) from the convex hull of the corners that touch (K, 3)."""
    heavy = 1e3  # weight of the condition that the shares of the corners add up to 1
    system = np.vstack([support[:, :2].T, np.full(len(support), heavy)])
    return float(nnls(system, np.array([*centre[:2], heavy]))[1])


@pytest.mark.parametrize("name", SIDES)
def test_bodies_on_an_incline_that_holds_them_stop_where_rolling_resistance_balances_them(name: str) -> None:
    run = rpf3d.simulate(SCENES / f"{name}.yaml")
    assert run.flights.deposits.outcome.tolist() == [Outcome.STOPPED] * 10
    centres, corners = corners_at_rest(run, SIDES[name])
    heights = corners @ NORMAL
    radius = np.cbrt(0.75 * np.prod(SIDES[name]) / np.pi)
    most = run.scene.materials["plywood"].rolling_resistance * radius * math.cos(INCLINE)
    assert (heights.min(axis=1) > -1e-9).all() and (heights.min(axis=1) < NEAR).all()
    off = [distance_from_support(x, c[h < NEAR]) for x, c, h in zip(centres, corners, heights, strict=True)]
    assert max(off) <= most + NEAR
    if name == "lab_40_cube":
        assert max(off) > 0.25 * most, "rolling resistance holds a cube on an edge, so the bound is put to the test"
    else:
        assert (np.sort(heights, axis=1)[:, 3] < NEAR).sum() >= 8, "most plates lie on a face"


@pytest.mark.parametrize("name", SIDES)
def test_bodies_on_an_incline_steeper_than_their_friction_do_not_stop(name: str, tmp_path: Path) -> None:
    text = (SCENES / f"{name}.yaml").read_text(encoding="utf-8")
    assert "friction: 0.95" in text
    scene = tmp_path / "slippery.yaml"
    scene.write_text(text.replace("friction: 0.95", "friction: 0.7"), encoding="utf-8")
    (tmp_path / "lab_40.obj").write_bytes((SCENES / "lab_40.obj").read_bytes())
    outcomes = rpf3d.simulate(scene, rocks=3).flights.deposits.outcome
    assert (outcomes != Outcome.STOPPED).all(), "they leave the incline at its lower end"


def test_both_engines_end_the_cubes_at_the_same_bits() -> None:
    scene = SCENES / "lab_40_cube.yaml"
    ends = [rpf3d.simulate(scene, rocks=3, engine=engine).flights.deposits for engine in ("compiled", "reference")]
    for name in ("x", "pose", "t"):
        first, second = (getattr(end, name) for end in ends)
        assert first.tobytes() == second.tobytes(), name
