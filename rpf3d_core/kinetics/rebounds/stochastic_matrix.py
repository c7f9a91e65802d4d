"""Rebound by a random matrix: the state after the impact is A times the state before.

Bourrier et al. 2009, Geomorphology 110:68-79 (form: thesis, equation 2-11):
(v_t', v_n', R w') = A (v_t, v_n, R w), the nine coefficients of A jointly normal. Means and covariances belong to one
site and one roughness, calibrated on detailed simulations; published values are not valid for other sites.

Signs, which a user's values must follow: v_t is the speed along the ground, in its direction t before the impact. v_n
is the speed into the ground before the impact, and away from the ground after it. w is the spin about n x t, positive
for a rolling rock. So diag(R_t, R_n, 0) is a lumped mass that leaves without spin. Spin about n and t is kept.

Normal numbers have no bounds, so rpf3d adds two rules. If the drawn matrix would send the rock into the ground, v_n'
is computed with the mean matrix, and is at least zero. If the kinetic energy, with the rotation 2/5 (R w)^2, would
rise, all three components are scaled down so that the energy stays the same.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import RemainingBounces, endless, rebound, rest_of_bounces
from rpf3d_core.kinetics.rebounds.spin import heading
from rpf3d_core.materials.distributions import standard_normal
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext, RockKey
from rpf3d_core.materials.streams import ZONES, Purpose, uniform_at
from rpf3d_core.values import SPHERE_INERTIA_RATIO, Motion, Vec
from rpf3d_core.vectors import add, along, cross, dot, norm, scale

STREAM = int(Purpose.REBOUND_MATRIX)

Nine = tuple[float, float, float, float, float, float, float, float, float]


class StochasticMatrix(NamedTuple):
    """Rebound model with a matrix A that is drawn at random for each impact.

    mean : (3, 3) mean of A
    root : (9, 9) lower triangular; root root^T is the covariance of the nine coefficients of A, row by row
    """

    mean: Any
    root: Any
    asks_rock = True  # type: ignore[misc]
    draws = True  # type: ignore[misc]
    spins = True  # type: ignore[misc]


@rebound.rule(StochasticMatrix)
def drawn_rebound(model: StochasticMatrix, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion after an impact with a randomly drawn matrix; coefficients of the material are not used.

    n : (3,) unit normal of the ground
    """
    radius = rock.rock.radius  # type: ignore[union-attr]  # asks_rock
    v_t = along(motion.v, n)
    t = heading(v_t, cross(motion.w, n))
    axis = cross(n, t)
    spin = dot(motion.w, axis)
    before = (norm(v_t), -dot(motion.v, n), radius * spin)
    z = _nine_normals(rock.key, rock.impacts + 1)  # type: ignore[arg-type]  # draws
    off = _row(model, 1, z, before)
    if off < 0.0:
        off = max(_mean_row(model, 1, before), 0.0)
    after = _no_faster(before, (_row(model, 0, z, before), off, _row(model, 2, z, before)))
    v = add(scale(after[0], t), scale(after[1], n))
    return Motion(t=motion.t, x=motion.x, v=v, w=add(motion.w, scale(after[2] / radius - spin, axis)))


@kernel
def _nine_normals(key: RockKey, number: int) -> Nine:
    """Return the nine independent standard normal numbers from which the matrix of an impact is computed.

    key : seed, source and number of the rock; number : the rock's impacts so far, plus 1
    """
    return (
        _normal(key, 0, number), _normal(key, 1, number), _normal(key, 2, number), _normal(key, 3, number),
        _normal(key, 4, number), _normal(key, 5, number), _normal(key, 6, number), _normal(key, 7, number),
        _normal(key, 8, number),
    )  # fmt: skip


@kernel
def _normal(key: RockKey, k: int, number: int) -> float:
    """Return the k-th (0 to 8) of the nine normal numbers of impact `number`; each k has a separate random stream."""
    return standard_normal(uniform_at(key.seed, key.source, key.rock, STREAM + k * ZONES, number))


@kernel
def _row(model: StochasticMatrix, i: int, z: Nine, before: Vec) -> float:
    """Return component i (0 to 2) of the state (v_t, v_n, R w), m/s, after an impact.

    This component is row i of the drawn matrix times the state `before`.

    z : the nine normal numbers of the impact; before : the state before the impact (m/s)
    """
    total = 0.0
    for j in range(3):
        coefficient = float(model.mean[i, j])
        for k in range(3 * i + j + 1):
            coefficient += float(model.root[3 * i + j, k]) * z[k]
        total += coefficient * before[j]
    return total


@kernel
def _mean_row(model: StochasticMatrix, i: int, before: Vec) -> float:
    """Return component i (0 to 2) of the mean state (v_t, v_n, R w), m/s, after an impact.

    This component is row i of the mean matrix times the state `before` the impact (m/s).
    """
    total = 0.0
    for j in range(3):
        total += float(model.mean[i, j]) * before[j]
    return total


@kernel
def _no_faster(before: Vec, after: Vec) -> Vec:
    """Return the state `after` an impact, scaled down to at most the kinetic energy of the state `before`.

    Both are states (v_t, v_n, R w) in m/s.
    """
    had, has = _energy(before), _energy(after)
    return scale(math.sqrt(had / has), after) if has > had else after


@kernel
def _energy(state: Vec) -> float:
    """Return twice the kinetic energy per unit of mass (m^2/s^2) of a sphere in the state (v_t, v_n, R w), in m/s."""
    return state[0] * state[0] + state[1] * state[1] + SPHERE_INERTIA_RATIO * state[2] * state[2]


@rest_of_bounces.rule(StochasticMatrix)
def drawn_rest(
    model: StochasticMatrix, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    """Return `RemainingBounces` with `ends` False, which means that the sum of the remaining bounces is unknown.

    A new matrix is drawn for every bounce. So each bounce is computed as a flight.
    """
    return endless(motion)
