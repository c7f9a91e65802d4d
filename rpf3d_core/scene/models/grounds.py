"""The ground models that a scene may name, except `none`, `sliding` and `sphere`, with their parameters."""

from typing import ClassVar

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter


class RollingSpec(ModelSpec):
    """A sphere that rolls against the material's rolling friction.

    2/7 of the work of gravity becomes rotational energy. A rock has no spin before it begins to roll, and keeps its
    whole speed when it begins. So it may rise to 7/5 of the height that its kinetic energy before rolling allows.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.rolling:Rolling"
    SOURCE: ClassVar[str] = "Azzoni et al. 1995, Int. J. Rock Mech. Min. Sci. 32:709"
    CONFIRMED: ClassVar[Confirmed] = "CC"
    MATERIAL_KEYS: ClassVar[tuple[str, ...]] = ("rolling_friction",)


class RollingStoneSpec(ModelSpec):
    """STONE's rule: gravity along the ground, minus a deceleration of g sin(atan(rolling friction)).

    A rock slower than `stop_speed` stops on any slope.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.rolling_stone:RollingStone"
    SOURCE: ClassVar[str] = "Guzzetti et al. 2002, Comput. Geosci. 28:1079, as implemented in r.stone"
    CONFIRMED: ClassVar[Confirmed] = "CC"
    MATERIAL_KEYS: ClassVar[tuple[str, ...]] = ("rolling_friction",)
    STOPPED: ClassVar[str | None] = (
        "was slower than the stop_speed of `ground: rolling_stone`, which does not ask whether friction holds it "
        "there, so it may rest on any slope"
    )

    stop_speed: float = parameter(
        3.0, "a number >= 0 (m/s), the speed below which a rock on the ground has stopped, on any slope", "m/s",
        "r.stone's default", "CC", ge=0, strict=True, allow_inf_nan=False,
    )  # fmt: skip
