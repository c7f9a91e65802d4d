"""Rebound models by name, with example parameters, and functions for single impacts and flights with a model."""

from dataclasses import replace
from typing import Any

import numpy as np

from flights.scenes_of_facets import flight
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.kinetics.rebound import ConstantRestitution, rebound
from rpf3d_core.kinetics.rebounds.coulomb_limited import CoulombLimited
from rpf3d_core.kinetics.rebounds.pfeiffer_bowen import PfeifferBowen
from rpf3d_core.kinetics.rebounds.stochastic_matrix import StochasticMatrix
from rpf3d_core.kinetics.rebounds.thesis_literal import ThesisLiteral
from rpf3d_core.kinetics.rebounds.v_half import VHalf
from rpf3d_core.kinetics.rebounds.velocity_scaled import VelocityScaled
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext, RockKey
from rpf3d_core.scene.models.rebounds import AngleTableSpec, MassScaledSpec
from rpf3d_core.setup.builders.rebounds import angle_table, cholesky, mass_scaled
from rpf3d_core.simulation.engines import Models
from rpf3d_core.values import ZERO, Motion, Rock, Vec

UP: Vec = (0.0, 0.0, 1.0)
NO_TERRAIN: Any = None
"""Placeholder for scene and terrain, which the builders of rebounds do not use."""

ROWS = ((5.0, 1.6, 0.6), (30.0, 0.7, 0.7), (60.0, 0.35, 0.85), (90.0, 0.25, 0.9))
"""Rows of an angle table with invented values: R_n falls with the angle and R_t rises, as in experiments."""
MEAN = ((0.75, 0.05, 0.1), (0.1, 0.4, 0.0), (0.4, 0.1, 0.3))
SPREAD = 0.15
"""Invented standard deviation (-) of the elements of the matrix, which have correlations of 0.3."""


def table_of(rows: Any) -> Any:
    """Return an `AngleTable` from a scene's rows."""
    return angle_table(AngleTableSpec(rows=rows), NO_TERRAIN, NO_TERRAIN)


def matrix_of(spread: float = SPREAD, mean: Any = MEAN) -> StochasticMatrix:
    """Return a `StochasticMatrix` model.

    spread : standard deviation (-) of the elements of the matrix; mean : (3, 3) their means
    """
    covariance = spread * spread * (0.7 * np.eye(9) + 0.3)
    return StochasticMatrix(np.array(mean), cholesky(covariance))


MODELS = {
    "constant": ConstantRestitution(),
    "coulomb_limited": CoulombLimited(),
    "pfeiffer_bowen": PfeifferBowen(9.144, 6.096, 76.2),
    "velocity_scaled": VelocityScaled(9.144),
    "mass_scaled": mass_scaled(MassScaledSpec(K=9.144), NO_TERRAIN, NO_TERRAIN),
    "v_half": VHalf(10.0),
    "angle_table": table_of(ROWS),
    "wyllie": angle_table(AngleTableSpec(law="wyllie"), NO_TERRAIN, NO_TERRAIN),
    "stochastic_matrix": matrix_of(),
}
"""Name -> model, for the models in which an impact never increases the kinetic energy."""
ALL = {**MODELS, "thesis_literal": ThesisLiteral()}


def falling_rock(mass: float = 1000.0, radius: float = 0.5, impacts: int = 0, rock: int = 0) -> RockContext:
    """Return the context of a rock in flight, with all attributes that a model may read.

    mass : kg; radius : m; impacts : number of earlier impacts; rock : number of the rock
    """
    return RockContext(Rock(mass, radius), RockKey(7, 1, rock), impacts)


def struck(model: Any, ground: Surface, v: Vec, w: Vec = ZERO, n: Vec = UP, rock: RockContext | None = None) -> Motion:
    """Return the motion of a rock after an impact.

    v, w : velocity (m/s) and spin (rad/s) before; n : unit normal of the ground; rock : None for `falling_rock()`
    """
    after: Motion = rebound(model, ground, Motion(0.0, ZERO, v, w), n, rock or falling_rock())
    return after


def energy(motion: Motion, radius: float = 0.5) -> float:
    """Return the kinetic energy (J/kg) of a motion, with the rotation of a solid sphere; radius : m."""
    return 0.5 * float(np.dot(motion.v, motion.v) + 0.4 * radius * radius * np.dot(motion.w, motion.w))


def flight_with(model: Any, ground: Any, resting: str = "sliding", effects: Any = None, **settings: Any) -> Flight:
    """Return materials, settings and models of flights with a rebound model.

    ground : surface of all zones, or of each zone; resting : name of the ground model; settings : fields of `Settings`
    """
    plain = flight(ground, resting, **settings)
    return replace(plain, models=Models(model, plain.models.ground, effects))
