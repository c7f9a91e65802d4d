"""Ground properties for rocks with a shape, fixed or drawn at random; friction is a coefficient, not an angle."""

from typing import Any, NamedTuple

from rpf3d_core.materials.distributions import Distribution, fixed
from rpf3d_core.materials.draws import are_fixed, coefficient, drawn_columns
from rpf3d_core.materials.library import Materials, Surface, materials_of, surface_of
from rpf3d_core.materials.rock_context import RockContext


class DrawnBodySurface(NamedTuple):
    """The ground of a zone for rocks with a shape, with a distribution for each coefficient.

    restitution : (-) within [0, 1]; friction, rolling_resistance : (-) >= 0; stop_speed : m/s
    per_impact : True for a new draw for each impact, False for one draw per rock
    """

    restitution: Distribution
    friction: Distribution
    rolling_resistance: Distribution
    stop_speed: float
    per_impact: bool

    @property
    def coefficients(self) -> tuple[Distribution, ...]:
        """The distributions: restitution, tangential restitution (always 0), friction, rolling resistance."""
        return self.restitution, fixed(0.0), self.friction, self.rolling_resistance


class DrawnBodyMaterials(NamedTuple):
    """The ground of all Z zones for rocks with a shape, with distributions, as arrays that compiled code can read.

    kind : (Z, 4) kind of the distribution of each coefficient, in the order of `DrawnBodySurface.coefficients`
    numbers : (Z, 4, 6) the fields of `Distribution` after `kind`, in their order; stop_speed : (Z,) m/s
    per_impact : (Z,) 1 for a new draw for each impact, 0 for one draw per rock
    """

    kind: Any
    numbers: Any
    stop_speed: Any
    per_impact: Any


def drawn_body_materials(surfaces: list[DrawnBodySurface]) -> Materials | DrawnBodyMaterials:
    """Return the ground of Z zones as the simulation reads it; plain `Materials` if all coefficients are fixed."""
    if are_fixed(surfaces):
        return materials_of([_certain(surface) for surface in surfaces])
    return bodies_as_drawn(surfaces)


def bodies_as_drawn(surfaces: list[DrawnBodySurface]) -> DrawnBodyMaterials:
    """Return the ground of Z zones for rocks with a shape as `DrawnBodyMaterials`, even if no coefficient is random."""
    return DrawnBodyMaterials(**drawn_columns(surfaces))


@surface_of.rule(DrawnBodyMaterials)
def drawn_body_surface(materials: DrawnBodyMaterials, zone: int, rock: RockContext) -> Surface:
    """Return the ground properties of a zone for a rock with a shape: the rule of `surface_of` for drawn materials.

    The coefficients are drawn once per rock, or for the rock's next impact if the zone has `per_impact`.
    """
    number = rock.impacts + 1 if materials.per_impact[zone] else 0
    return Surface(
        R_n=coefficient(materials, zone, rock, number, 0),
        R_t=0.0,
        mu=coefficient(materials, zone, rock, number, 2),
        stop_speed=materials.stop_speed[zone],
        mu_r=coefficient(materials, zone, rock, number, 3),
    )


def _certain(surface: DrawnBodySurface) -> Surface:
    """Return the ground properties of a zone as plain numbers; all coefficients of the zone must be fixed."""
    return Surface(
        R_n=surface.restitution.location, R_t=0.0, mu=surface.friction.location, stop_speed=surface.stop_speed,
        mu_r=surface.rolling_resistance.location,
    )  # fmt: skip
