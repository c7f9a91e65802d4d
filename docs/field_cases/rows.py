"""The models of the validation page, one row each; a model that scenes cannot name has no row.

To add a model, add a `Row` with the keys of the scene and the parameters to calibrate, and published values.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from field_cases.search import Free
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.models.keys import GroundSpec, ReboundSpec
from rpf3d_core.scene.models.sphere import COULOMB_SPHERE

HOEK = "Hoek 1987"
STONE = "STONE"
SOURCES = {
    HOEK: "Hoek 1987 as in RocFall's default library (UNCONFIRMED); friction angles: Newcastle open-pit library",
    STONE: "lithologies of STONE: Alvioli et al. 2021, Eng. Geol. 293:106301, and the manual of r.stone; tan of the "
    "friction angle is STONE's friction",
}


class Values(NamedTuple):
    """Published coefficients of one kind of ground."""

    R_n: float
    R_t: float
    friction_angle_deg: float
    rolling_friction: float
    """Rolling friction (-) of the rigid sphere: STONE's value of the same ground, because no other library has one."""


PUBLISHED: dict[str, dict[str, dict[str, Values]]] = {
    "authume": {
        HOEK: {
            "blue": Values(0.32, 0.80, 35.0, 0.35),
            "gray": Values(0.35, 0.85, 30.0, 0.30),
            "red": Values(0.32, 0.82, 35.0, 0.35),
        },
        STONE: {
            "blue": Values(0.45, 0.55, 19.3, 0.35),
            "gray": Values(0.65, 0.75, 16.7, 0.30),
            "red": Values(0.45, 0.55, 19.3, 0.35),
        },
    },
    "tschamut": {
        HOEK: {"default": Values(0.30, 0.80, 35.0, 0.65)},
        STONE: {"default": Values(0.35, 0.55, 33.0, 0.65)},
    },
    "chant_sura": {
        HOEK: {"default": Values(0.30, 0.80, 35.0, 0.65)},
        STONE: {"default": Values(0.35, 0.55, 33.0, 0.65)},
    },
}
"""Published values by site, source and zone, chosen by the description of the ground only.

Authume: Hoek's talus with vegetation (blue), bedrock outcrop (gray), talus (red); STONE's loose clastic and carbonate.
Tschamut and Chant Sura, alpine meadows: Hoek's soft soil with some vegetation; STONE's glacial deposits.
"""


class Row(NamedTuple):
    """A model of the page: its name there, its names in scenes, and the parameters to calibrate, equal in all zones.

    free : parameters to calibrate with flights; of_rebound : names of those that belong to the rebound model
    fixed : parameters of the ground that keep their published value; at_impacts : parameters to calibrate with impacts
    rocks : number of rocks in each flight of the search at Authume
    """

    name: str
    rebound: str
    ground: str
    free: tuple[Free, ...]
    of_rebound: tuple[str, ...]
    fixed: dict[str, float]
    at_impacts: tuple[Free, ...]
    rocks: int

    @property
    def is_offered(self) -> bool:
        """True if scenes can name the model."""
        named = (*ReboundSpec.model_fields, COULOMB_SPHERE)
        return self.rebound in named and self.ground in GroundSpec.model_fields

    def rebound_keys(self, parameters: Mapping[str, float]) -> dict[str, Any]:
        """Return the rebound model, or the contact model of spheres, with the given ones of its parameters."""
        return {self.rebound: {name: parameters[name] for name in self.of_rebound if name in parameters}}

    def model_keys(self, parameters: Mapping[str, float]) -> dict[str, Any]:
        """Return the keys of a scene that choose the row's models, and spheres where the row is one of spheres."""
        return keys_of(self.rebound, self.rebound_keys(parameters)[self.rebound]) | {"ground": self.ground}

    def keys(self, parameters: Mapping[str, float]) -> dict[str, Any]:
        """Return the keys of a scene with one set of parameters for all zones."""
        ground = self.fixed | {name: value for name, value in parameters.items() if name not in self.of_rebound}
        return {**self.model_keys(parameters), "materials": {"default": ground}}

    def published(self, site: str, source: str) -> dict[str, Any]:
        """Return the keys of a scene with the published values of a site."""
        ground = {zone: material(values) for zone, values in PUBLISHED[site][source].items()}
        return {**self.model_keys({}), "materials": ground}


def keys_of(model: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a scene that choose a rebound model; spheres for the contact model of spheres."""
    if model == COULOMB_SPHERE:
        return {"rock": {"shape": "sphere"}, "contact": {model: dict(parameters)}}
    return {"rebound": {model: dict(parameters)}}


CONSTANT = Row(
    name="constant",
    rebound="constant",
    ground="sliding",
    free=(
        Free("normal_restitution", 0.10, 0.60, 6),
        Free("tangential_restitution", 0.0, 1.0, 11),
        Free("friction_angle_deg", 5.0, 40.0, 8, 1),
    ),
    of_rebound=(),
    fixed={},
    at_impacts=(
        Free("normal_restitution", 0.05, 0.95, 10),
        Free("tangential_restitution", 0.05, 0.95, 10),
    ),
    rocks=2000,
)
COULOMB_LIMITED = CONSTANT._replace(name="Coulomb-limited", rebound="coulomb_limited")
"""The same grids, rocks and ground as the constant model; only the rebound differs."""

ALL_ROWS = (
    CONSTANT,
    COULOMB_LIMITED,
    Row(
        name="rigid sphere",
        rebound="coulomb_sphere",
        ground="sphere",
        free=(
            Free("normal_restitution", 0.10, 0.60, 6),
            Free("rolling_friction", 0.05, 0.70, 14),
        ),
        of_rebound=(),
        fixed={"tangential_restitution": 1.0, "friction_angle_deg": 35.0},  # it has no R_t; Newcastle's talus
        at_impacts=(
            Free("normal_restitution", 0.05, 0.95, 10),
            Free("rolling_friction", 0.05, 1.5, 10),
        ),
        rocks=500,
    ),
)


def rows() -> tuple[Row, ...]:
    """Return the rows of the models that scenes can name."""
    return tuple(row for row in ALL_ROWS if row.is_offered)


def row_named(name: str) -> Row:
    """Return the row with a name."""
    return next(row for row in ALL_ROWS if row.name == name)


def material(values: Values) -> dict[str, float]:
    """Return published values as the keys of a material in a scene."""
    written = {
        "normal_restitution": values.R_n,
        "tangential_restitution": values.R_t,
        "friction_angle_deg": values.friction_angle_deg,
        "rolling_friction": values.rolling_friction,
    }
    return {key: value for key, value in written.items() if key in Material.model_fields}
