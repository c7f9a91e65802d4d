"""Ground properties that are drawn at random: for each rock, or for each impact of a rock.

A draw is a function of seed, source, rock, zone, impact and coefficient. The draw is therefore the same on any engine
and in any order, and does not depend on other draws. Between two impacts of a rock the ground of a zone stays the same.
The last small bounces of a rock are computed as a sum: they all use one restitution, and the slide after them uses one
friction angle; both are drawn for the next impact. Otherwise the result would depend on the number of facets of the
mesh.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.distributions import FIXED, Distribution, fixed, quantile
from rpf3d_core.materials.library import Materials, Surface, materials_of, surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.materials.streams import ZONES, Purpose, uniform_at

PURPOSES = (
    int(Purpose.NORMAL_RESTITUTION), int(Purpose.TANGENTIAL_RESTITUTION), int(Purpose.FRICTION_ANGLE),
    int(Purpose.ROLLING_FRICTION),
)  # fmt: skip
"""Purpose of the random number of each coefficient, in the order of COEFFICIENTS."""
COEFFICIENTS = ("R_n", "R_t", "friction_angle", "rolling_friction")
"""Names of the ground coefficients that may be drawn at random, in the order of `DrawnMaterials.kind`."""
RADIANS = math.pi / 180.0


class Drawn(Protocol):
    """The ground of a zone with a distribution for each coefficient, for lumped masses or for rocks with a shape."""

    @property
    def coefficients(self) -> tuple[Distribution, ...]:
        """The four distributions: normal restitution, tangential restitution, friction, rolling friction."""

    @property
    def stop_speed(self) -> float:
        """Speed (m/s) below which a rock on the ground stops."""

    @property
    def per_impact(self) -> bool:
        """True for a new draw for each impact, False for one draw per rock."""


class DrawnSurface(NamedTuple):
    """The ground of a zone, with a distribution for each coefficient; a distribution may be a fixed value.

    R_n, R_t : normal and tangential restitution, distributions (-) within [0, 1]
    friction_angle : distribution, degrees, within [0, 90); rolling_friction : distribution (-), >= 0
    stop_speed : m/s; per_impact : True for a new draw for each impact, False for one draw per rock
    """

    R_n: Distribution
    R_t: Distribution
    friction_angle: Distribution
    stop_speed: float
    per_impact: bool
    rolling_friction: Distribution = fixed(0.0)

    @property
    def coefficients(self) -> tuple[Distribution, ...]:
        """The four distributions: R_n, R_t, friction angle, rolling friction."""
        return self.R_n, self.R_t, self.friction_angle, self.rolling_friction


class DrawnMaterials(NamedTuple):
    """The ground of all Z zones with distributions, as arrays that compiled code can read.

    kind : (Z, 4) kind of the distribution of each coefficient: R_n, R_t, friction angle, rolling friction
    numbers : (Z, 4, 6) the fields of `Distribution` after `kind`, in their order
    stop_speed : (Z,) m/s; per_impact : (Z,) 1 for a new draw for each impact, 0 for one draw per rock
    """

    kind: Any
    numbers: Any
    stop_speed: Any
    per_impact: Any


def drawn_materials(surfaces: list[DrawnSurface]) -> Materials | DrawnMaterials:
    """Return the materials of Z zones as the simulation reads them; plain `Materials` if all coefficients are fixed."""
    if are_fixed(surfaces):
        return materials_of([_certain(surface) for surface in surfaces])
    return as_drawn(surfaces)


def as_drawn(surfaces: list[DrawnSurface]) -> DrawnMaterials:
    """Return the materials of Z zones as `DrawnMaterials`, even if no coefficient is random."""
    return DrawnMaterials(**drawn_columns(surfaces))


def are_fixed(surfaces: Sequence[Drawn]) -> bool:
    """Return True if no coefficient of any zone is random."""
    return all(draw.kind == FIXED for surface in surfaces for draw in surface.coefficients)


def drawn_columns(surfaces: Sequence[Drawn]) -> dict[str, Any]:
    """Return the fields of `DrawnMaterials` or `DrawnBodyMaterials` by name, from the ground of Z zones."""
    draws = [surface.coefficients for surface in surfaces]
    return {
        "kind": np.array([[draw.kind for draw in row] for row in draws], dtype=np.int64),
        "numbers": np.array([[draw[1:] for draw in row] for row in draws], dtype=float),
        "stop_speed": np.array([surface.stop_speed for surface in surfaces], dtype=float),
        "per_impact": np.array([surface.per_impact for surface in surfaces], dtype=np.int64),
    }


@surface_of.rule(DrawnMaterials)
def drawn_surface(materials: DrawnMaterials, zone: int, rock: RockContext) -> Surface:
    """Return the ground properties of a zone for a rock: the rule of `surface_of` for drawn materials.

    The coefficients are drawn once per rock, or for the rock's next impact if the zone has `per_impact`.
    """
    number = rock.impacts + 1 if materials.per_impact[zone] else 0
    R_n = coefficient(materials, zone, rock, number, 0)
    R_t = coefficient(materials, zone, rock, number, 1)
    angle = coefficient(materials, zone, rock, number, 2)
    mu_r = coefficient(materials, zone, rock, number, 3)
    return Surface(R_n=R_n, R_t=R_t, mu=math.tan(angle * RADIANS), stop_speed=materials.stop_speed[zone], mu_r=mu_r)


@kernel
def coefficient(materials: Any, zone: int, rock: RockContext, number: int, k: int) -> float:
    """Return one coefficient of a zone for a rock: the fixed value, or a drawn value.

    The unit is that of the distribution: degrees for a friction angle, (-) for all others.

    materials : `DrawnMaterials` or `DrawnBodyMaterials`
    number : number of the impact, from 1; 0 for one draw per rock
    k : index of the coefficient: 0 R_n, 1 R_t, 2 friction angle (for bodies: friction), 3 rolling friction
    """
    numbers = materials.numbers
    if materials.kind[zone, k] == FIXED:
        return numbers[zone, k, 2]  # type: ignore[no-any-return]
    d = Distribution(
        kind=materials.kind[zone, k],
        low=numbers[zone, k, 0],
        high=numbers[zone, k, 1],
        location=numbers[zone, k, 2],
        scale=numbers[zone, k, 3],
        first=numbers[zone, k, 4],
        span=numbers[zone, k, 5],
    )
    key: Any = rock.key  # these materials draw: the key is never None
    return quantile(d, uniform_at(key.seed, key.source, key.rock, PURPOSES[k] + ZONES * zone, number))


def _certain(surface: DrawnSurface) -> Surface:
    """Return the ground of a zone whose coefficients are all fixed, without distributions."""
    mu = math.tan(surface.friction_angle.location * RADIANS)
    R_n, R_t, mu_r = surface.R_n.location, surface.R_t.location, surface.rolling_friction.location
    return Surface(R_n=R_n, R_t=R_t, mu=mu, stop_speed=surface.stop_speed, mu_r=mu_r)
