"""The scene's effect `fragmentation`: rocks that break."""

from typing import ClassVar

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import Count, Number

GIS = "RockGIS, defaults"


class FragmentationSpec(ModelSpec):
    """Rocks break at hard impacts, and the fragments fly on as separate rocks.

    Unconfirmed: not validated against measured fragments.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.fragmentation:Fragmentation"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.fragmentation:fragmentation"
    SOURCE: ClassVar[str] = (
        "for the new surface, RockGIS' source code (Matas et al. 2017 and 2020); for the sizes, the fractal of Perfect "
        "1997, whose parameters rpf3d computes from the rock's volume and the new surface"
    )
    CONFIRMED: ClassVar[Confirmed] = "UNCONFIRMED"
    NOT_FOR_BODIES: ClassVar[str | None] = "no publication gives the shapes of the fragments"

    surface_factor: Number = parameter(
        0.0031, "a number >= 0, the factor a in A = a E^e: A is the new surface (m2), E the kinetic energy (J) of the "
        "rock's speed away from the ground after the rebound", "m2/J^e", GIS, "CC", ge=0,
    )  # fmt: skip
    surface_exponent: Number = parameter(
        0.7562, "a number from 0 to 2, the exponent e in A = a E^e", "-", GIS, "CC", ge=0, le=2
    )
    least_ratio: Number = parameter(
        0.7, "a number >= 0; a rock breaks if new surface / (new surface + surface of the unbroken rock) is "
        "above this number; 0.25 to 0.7 are usual in RockGIS; the default is the upper end of this range and "
        "unconfirmed", "-", "RockGIS", "UNCONFIRMED", ge=0,
    )  # fmt: skip
    spread: Number = parameter(
        0.06, "a number from 0 to 1, largest change of `least_ratio` from impact to impact, as a share of "
        "`least_ratio`", "-", GIS, "CC", ge=0, le=1,
    )  # fmt: skip
    least_volume: Number = parameter(
        1e-4, "a number of at least 1e-6 (m3), the volume of the smallest fragment that is simulated; a rock smaller "
        "than 8 times this volume stays whole", "m3", GIS, "CC", ge=1e-6,
    )  # fmt: skip
    energy_lost: Number = parameter(
        0.01, "a number from 0 to 1, share of the energy after the impact that the fragments lose in total", "-", GIS,
        "CC", ge=0, le=1,
    )  # fmt: skip
    cone_deg: Number = parameter(
        50.0, "a number from 0 to 180 (degrees), the whole angle of the cone in which the fragments start", "deg", GIS,
        "CC", ge=0, le=180,
    )  # fmt: skip
    least_angle_deg: Number = parameter(
        5.0,
        "a number from 0 to 45 (degrees), smallest angle between the ground and the initial direction of a fragment",
        "deg", GIS, "CC", ge=0, le=45,
    )  # fmt: skip
    generations: Count = parameter(
        3, "a whole number from 1 to 5, the number of successive breaks: with 1 only the released rock breaks, with 2 "
        "also its fragments, and so on", "-", "none", "D", ge=1, le=5,
    )  # fmt: skip
