"""The material of a zone in a scene: the coefficients of points and spheres, or of rocks with a shape."""

from collections.abc import Iterator
from typing import Any, Literal

from pydantic import Field, model_validator

from rpf3d_core.scene.draws import Coefficient, FrictionAngle, Share
from rpf3d_core.scene.shapes import SlipFrictionSpec
from rpf3d_core.scene.values import Name, Number, StrictModel, refuse

BODY_KEYS = ("restitution", "friction", "rolling_resistance", "slip_friction")
"""Keys of a material for rocks with a shape."""

POINT_KEYS = ("normal_restitution", "tangential_restitution", "friction_angle_deg", "rolling_friction")
"""Keys of a material for points and spheres."""


class Material(StrictModel):
    """The ground material of a zone: coefficients (-), friction angle in degrees, stop speed in m/s."""

    normal_restitution: Share = Field(description="a number from 0 to 1 (-), R_n, or a distribution")
    tangential_restitution: Share = Field(description="a number from 0 to 1 (-), R_t, or a distribution")
    friction_angle_deg: FrictionAngle = Field(
        30.0, description="a number from 0 to below 90 (degrees), or a distribution"
    )
    stop_speed: Number | None = Field(
        None, ge=0, description="a number >= 0 (m/s); left out: `stop_speed` of the scene"
    )
    rolling_friction: Coefficient | None = Field(
        None, description="a number >= 0 (-), or a distribution: mu_r, the tangent of the slope on which a rolling "
        "rock keeps its speed; for ground models that roll, and for impacts of spheres",
    )  # fmt: skip
    restitution: Share | None = Field(
        None, description="a number from 0 to 1 (-), or a distribution; for rocks with a shape"
    )
    friction: Coefficient | None = Field(
        None, description="a number >= 0 (-), mu, or a distribution; for rocks with a shape"
    )
    rolling_resistance: Coefficient | None = Field(
        None, description="a number >= 0 (-), or a distribution; for rocks with a shape"
    )
    slip_friction: SlipFrictionSpec | None = Field(
        None, description="a mapping with mu_min, mu_max, kappa and beta, friction that grows as a rock with a shape "
        "slips, instead of `friction`",
    )  # fmt: skip
    draw: Literal["per_rock", "per_impact"] = Field(
        "per_rock", description="per_rock or per_impact, how often a distribution is drawn"
    )
    library: Name | None = Field(
        None, description="the name of an entry that `rpf3d materials` lists; its ranges are unknowns, except those of "
        "coefficients that the material gives",
    )  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _of_a_body(cls, values: Any) -> Any:
        """Fill in unused coefficients of points if the material is for rocks with a shape.

        Raise a PydanticCustomError if the material has keys for both kinds of rocks, or lacks `restitution`. Raise it
        also unless the material has exactly one of `friction` and `slip_friction`.
        """
        if not isinstance(values, dict) or not any(key in values for key in BODY_KEYS):
            return values
        if [key for key in BODY_KEYS if key in values] == ["friction"] and any(key in values for key in POINT_KEYS[:2]):
            raise refuse("is for rocks with a shape; did you mean `friction_angle_deg` (degrees)?", "friction")
        for key in values:
            if key in POINT_KEYS:
                raise refuse(
                    f"is for points, and {', '.join(BODY_KEYS)} are for rocks with a shape; give one kind", key
                )
        if "slip_friction" in values and "friction" in values:
            raise refuse("is given, and so is `friction`; give one of them", "slip_friction")
        for key in ("restitution", "friction"):
            if key not in values and not (key == "friction" and "slip_friction" in values):
                raise refuse(f"is missing; it must be {cls.model_fields[key].description}", key)
        return {**values, "normal_restitution": 0.0, "tangential_restitution": 0.0}

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Yield the keys and values, except None, that apply to the material's kind of rocks; recordings log them.

        The two kinds are points and spheres, and rocks with a shape.
        """
        idle = POINT_KEYS if self.is_of_a_body else BODY_KEYS
        return ((key, value) for key, value in super().__repr_args__() if key not in idle and value is not None)

    @property
    def is_of_a_body(self) -> bool:
        """True if the material is for rocks with a shape, False if it is for points and spheres."""
        return self.friction is not None or self.slip_friction is not None
