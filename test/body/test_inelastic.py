"""When the sweeps of the inelastic impact end: contacts in one plane pass impulses to each other without an effect."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.body import inelastic as solver
from rpf3d_core.body.contacts import ARM, CONTACT_COLUMNS, GOAL, MU, NORMAL, ROLLING, SOLVER_COLUMNS, put
from rpf3d_core.body.inelastic import Velocity, inelastic

NORMAL_OF_GROUND = (-0.7072, 0.6027, -0.3697)
ARMS = ((0.379, 0.079, 0.083), (0.044, -0.235, 0.212), (0.256, -0.203, -0.142))
GOALS = ((-0.0928, 0.0118, -0.0304), (-0.0926, 0.0116, -0.0303), (-0.0926, 0.0116, -0.0303))
MOMENTS = (0.0288, 0.0398, 0.05)
SLIDING = Velocity((4.619, 5.071, -0.342), (0.0, 0.0, 0.0))
WITHIN = 8.7e-5
"""Three corners of a face of 0.4 m that slides on a slope, as in a step in contact (m, m2, m/s)."""


class Solved(NamedTuple):
    """The velocity after an impact, and the number of sweeps that it took."""

    velocity: Velocity
    sweeps: int


def solved(monkeypatch, steady: float) -> Solved:
    """Return the solution for the sliding face; steady : value of STEADY."""
    points, rows = np.zeros((3, CONTACT_COLUMNS)), np.zeros((3, SOLVER_COLUMNS))
    n = np.array(NORMAL_OF_GROUND) / np.linalg.norm(NORMAL_OF_GROUND)
    for row, arm, goal in zip(points, ARMS, GOALS, strict=True):
        put(row, ARM, arm)
        put(row, NORMAL, n)
        put(row, GOAL, goal)
        row[MU], row[ROLLING] = 0.55, 0.046
    sweeps, share = [], solver._share
    with monkeypatch.context() as changed:
        changed.setattr(solver, "STEADY", steady)
        changed.setattr(solver, "_share", lambda sweep: sweeps.append(sweep) or share(sweep))
        return Solved(inelastic(points, rows, 3, MOMENTS, SLIDING, WITHIN), len(sweeps))


def test_the_sweeps_end_where_impulses_go_round_and_the_body_moves_on_as_it_did(monkeypatch):
    ended, full = solved(monkeypatch, solver.STEADY), solved(monkeypatch, 0.0)
    assert ended.sweeps < 10
    assert full.sweeps == solver.SWEEPS, "without this rule the sweeps do not end"
    assert np.abs(np.subtract(ended.velocity.v, full.velocity.v)).max() < WITHIN
    assert np.abs(ended.velocity.w).max() < 1e-12
