"""The rigid sphere that a scene may name: its rebound and its ground model, which belong together."""

from typing import ClassVar

from rpf3d_core.io.scene_offers import Confirmed, Offer, parameter

SPHERE, SPHERE_GROUND = "coulomb_sphere", "sphere"


class CoulombSphereSpec(Offer):
    """A spinning rigid sphere of the rock's size: it touches faces, edges and corners, and sticks or slips there."""

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.coulomb_sphere:CoulombSphere"
    BUILDER: ClassVar[str | None] = "rpf3d_core.builders.coulomb_sphere:sphere_of"
    SOURCE: ClassVar[str] = "rigid-body mechanics; Leine et al. 2014, Multibody Syst. Dyn. 32:241, for e_t = 0"
    CONFIRMED: ClassVar[Confirmed] = "D"
    GROUNDS: ClassVar[tuple[str, ...] | None] = ("none", SPHERE_GROUND)
    STEPS: ClassVar[bool] = False

    impact_friction: float | None = parameter(
        None, "a number >= 0 (-), mu of impacts, or left out for the tangent of the material's friction angle", "-",
        "Coulomb friction", "D", ge=0, strict=True, allow_inf_nan=False,
    )  # fmt: skip
    tangential_restitution: float = parameter(
        0.0, "a number from 0 to 1 (-), the share of slip that an impact turns round", "-",
        "0 for rock: Leine et al. 2014", "C", ge=0, le=1, strict=True, allow_inf_nan=False,
    )  # fmt: skip
    damping: float = parameter(
        1.0, "a number from 0 to 1 (-), the share of tangential speed and spin that an impact leaves", "-",
        "for calibration; 1 is none", "D", ge=0, le=1, strict=True, allow_inf_nan=False,
    )  # fmt: skip

    @property
    def asks_friction(self) -> bool:
        """It does unless impacts have a friction of their own."""
        return self.impact_friction is None


class SphereGroundSpec(Offer):
    """A sphere that skids with the material's friction angle until it rolls; with the rebound `coulomb_sphere` only."""

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.sphere_ground:SphereGround"
    BUILDER: ClassVar[str | None] = "rpf3d_core.builders.coulomb_sphere:sphere_ground_of"
    SOURCE: ClassVar[str] = "rigid-body mechanics; rolling friction as of Azzoni et al. 1995"
    CONFIRMED: ClassVar[Confirmed] = "D"
    REBOUNDS: ClassVar[tuple[str, ...] | None] = (SPHERE,)

    @property
    def asks_friction(self) -> bool:
        """It does."""
        return True
