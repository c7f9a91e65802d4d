"""The mechanical properties of the ground in each zone, as the simulation reads them."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import model_function
from rpf3d_core.materials.rock_context import RockContext


class Surface(NamedTuple):
    """The mechanical properties of the ground at one contact of a rock.

    R_n, R_t : normal and tangential restitution (-), in [0, 1]; mu : Coulomb friction, tan of the friction angle (-)
    stop_speed : m/s below which a rock in sustained contact has stopped
    mu_r : rolling friction (-), tan of the angle beta of rolling friction; for rocks with a shape, rolling resistance
        (-)
    """

    R_n: float
    R_t: float
    mu: float
    stop_speed: float
    mu_r: float = 0.0


class Materials(NamedTuple):
    """The ground of all Z zones: the properties of `Surface` as arrays of Z elements, which compiled code can read."""

    R_n: Any
    R_t: Any
    mu: Any
    stop_speed: Any
    mu_r: Any


def materials_of(surfaces: list[Surface]) -> Materials:
    """Return the materials of Z zones as the simulation reads them, from one `Surface` for each zone."""
    columns = np.array(surfaces, dtype=float).reshape(-1, 5).T
    R_n, R_t, mu, stop_speed, mu_r = (np.ascontiguousarray(column) for column in columns)
    return Materials(R_n=R_n, R_t=R_t, mu=mu, stop_speed=stop_speed, mu_r=mu_r)


@model_function
def surface_of(materials: object, zone: int, rock: RockContext) -> Surface:
    """Return the ground properties of a zone for a rock's next impact.

    A rule computes the properties for each type of `materials`; they are fixed, or drawn at random for the rock.

    materials : `Materials`, `DrawnMaterials` or `DrawnBodyMaterials`; zone : number of the zone
    """


@surface_of.rule(Materials)
def fixed_surface(materials: Materials, zone: int, rock: RockContext) -> Surface:
    """Return the ground properties of a zone, which are the same for every rock and every impact."""
    return Surface(
        R_n=materials.R_n[zone],
        R_t=materials.R_t[zone],
        mu=materials.mu[zone],
        stop_speed=materials.stop_speed[zone],
        mu_r=materials.mu_r[zone],
    )
