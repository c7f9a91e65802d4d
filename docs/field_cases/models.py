"""The models of the validation page: their keys in a scene, the ranges to calibrate, and published values.

To add a model, add a `Model` to `POINTS_AND_SPHERES`, and the ranges of new coefficients to `PRIORS`.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from field_cases.search import Free
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.models.sphere import COULOMB_SPHERE

AUTHUME, TSCHAMUT, CHANT_SURA = "Authume", "Tschamut", "Chant Sura"
HOEK = "Hoek 1987"
STONE = "STONE"
SOURCES = {
    HOEK: "Hoek 1987 as in RocFall's default library (UNCONFIRMED); friction angles: Newcastle open-pit library",
    STONE: "lithologies of STONE: Alvioli et al. 2021, Eng. Geol. 293:106301, and the manual of r.stone; tan of the "
    "friction angle is STONE's friction",
}
CALIBRATED = "calibrated"


class Values(NamedTuple):
    """Published coefficients of one kind of ground: restitution (-), friction angle (degrees), rolling friction (-)."""

    R_n: float
    R_t: float
    friction_angle_deg: float
    rolling_friction: float
    """Rolling friction (-) of the rigid sphere: STONE's value of the same ground, because no other library has one."""


MEADOW = {HOEK: {"default": Values(0.30, 0.80, 35.0, 0.65)}, STONE: {"default": Values(0.35, 0.55, 33.0, 0.65)}}
PUBLISHED: dict[str, dict[str, dict[str, Values]]] = {
    AUTHUME: {
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
    TSCHAMUT: MEADOW,
    CHANT_SURA: MEADOW,
}
"""Published values by site, source and zone; they were chosen by the description of the ground only.

Authume: Hoek's talus with vegetation (blue), bedrock outcrop (gray), talus (red); STONE's loose clastic and carbonate.
Tschamut and Chant Sura, alpine meadows: Hoek's soft soil with some vegetation; STONE's glacial deposits.
"""

OF_ROCK = {
    "normal_restitution": (0.1, 0.6), "tangential_restitution": (0.5, 0.99), "friction_angle_deg": (15.0, 45.0),
    "rolling_friction": (0.05, 0.9), "restitution": (0.0, 0.3), "friction": (0.2, 1.2),
    "rolling_resistance": (0.02, 0.4),
}  # fmt: skip
OF_SOIL = OF_ROCK | {
    "normal_restitution": (0.05, 0.6), "tangential_restitution": (0.2, 0.99), "rolling_resistance": (0.02, 0.6),
}  # fmt: skip
PRIORS: dict[str, dict[str, tuple[float, float]]] = {AUTHUME: OF_ROCK, TSCHAMUT: OF_SOIL}
"""Range of each coefficient as prior of `rpf3d calibrate`: values that are possible for the ground of the site, not
values that fit. Soil takes more energy than rock from a rock that bounces or rolls."""


class Model(NamedTuple):
    """A model of the page: its name on the page, its names in scenes, and its coefficients to calibrate.

    impact : rebound model, or contact model of spheres and of rocks with a shape; ground : ground model, None for none
    unknown : coefficients to calibrate with stops, equal in all zones
    at_impacts : coefficients to calibrate with single impacts, with their ranges
    """

    name: str
    impact: str
    ground: str | None
    unknown: tuple[str, ...]
    at_impacts: tuple[Free, ...] = ()

    def keys(self) -> dict[str, Any]:
        """Return the keys of a scene, with values, that select the model."""
        ground = {} if self.ground is None else {"ground": self.ground}
        return keys_of(self.impact) | ground

    def published(self, site: str, source: str) -> dict[str, Any]:
        """Return the keys of a scene, with values, for the model and the published values of a site and source."""
        ground = {zone: material(values) for zone, values in PUBLISHED[site][source].items()}
        return {**self.keys(), "materials": ground}

    def unknowns(self, site: str) -> dict[str, dict[str, float]]:
        """Return the value of the key `unknowns` in `calibration`, for the model's scene at a site."""
        spans = {name: PRIORS[site][name] for name in self.unknown}
        return {f"materials.*.{name}": {"min": low, "max": high} for name, (low, high) in spans.items()}


def keys_of(impact: str, parameters: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the keys of a scene, with values, that select a rebound or contact model with the given parameters."""
    chosen = {impact: dict(parameters or {})}
    if impact == RIGID:
        return {"contact": chosen}
    return {"rock": {"shape": "sphere"}, "contact": chosen} if impact == COULOMB_SPHERE else {"rebound": chosen}


RIGID = "rigid"
POINT = ("normal_restitution", "tangential_restitution", "friction_angle_deg")
TWO_COEFFICIENTS = (Free("normal_restitution", 0.05, 0.95, 10), Free("tangential_restitution", 0.05, 0.95, 10))
CONSTANT = Model("constant", "constant", "sliding", POINT, TWO_COEFFICIENTS)
COULOMB_LIMITED = CONSTANT._replace(name="coulomb_limited", impact="coulomb_limited")
SPHERE = Model(
    "rigid sphere", COULOMB_SPHERE, "sphere", ("normal_restitution", "rolling_friction", "friction_angle_deg"),
    (TWO_COEFFICIENTS[0], Free("rolling_friction", 0.05, 1.5, 10)),
)  # fmt: skip
SHAPES = Model("rocks with a shape", RIGID, None, ("restitution", "friction", "rolling_resistance"))
POINTS_AND_SPHERES = (CONSTANT, COULOMB_LIMITED, SPHERE)
MODELS = (*POINTS_AND_SPHERES, SHAPES)


def model_named(name: str) -> Model:
    """Return the model with a name on the page."""
    return next(model for model in MODELS if model.name == name)


def material(values: Values) -> dict[str, float]:
    """Return published values as a material of a scene: key -> value."""
    written = {
        "normal_restitution": values.R_n,
        "tangential_restitution": values.R_t,
        "friction_angle_deg": values.friction_angle_deg,
        "rolling_friction": values.rolling_friction,
    }
    return {key: value for key, value in written.items() if key in Material.model_fields}
