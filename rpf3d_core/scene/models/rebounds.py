"""The rebound models that a scene may name, except `constant`, with their parameters."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, model_validator

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import Number, Vector, exactly_one, refuse

REBOUNDS = "rpf3d_core.kinetics.rebounds"
BUILDERS = "rpf3d_core.setup.builders.rebounds"
PFEIFFER = "Pfeiffer & Bowen 1989, Bull. AEG 26:135-146"
BOURRIER = "Bourrier et al. 2009, Geomorphology 110:68-79"
WYLLIE = "Wyllie 2014, Rock Fall Engineering, with the coefficients of RockGIS"

STEEPEST = 90.0
"""Largest impact angle (degrees): an impact at right angles to the ground."""
MOST_R_N = 10.0
"""Largest R_n (-) in an angle table of a scene; energy conservation limits R_n in addition.

Wyllie's law is cut off at 2.
"""
ROUNDING = 1e-9
"""Tolerance (-) for asymmetry and negative eigenvalues of a covariance, because users write rounded figures.

The tolerance is a share of the largest entry.
"""

Nine = tuple[Number, Number, Number, Number, Number, Number, Number, Number, Number]


class CoulombLimitedSpec(ModelSpec):
    """R_n and R_t of the material, but Coulomb friction limits the loss of speed along the ground.

    The loss of speed along the ground is at most mu (1 + R_n) |v_n|: mu is the tangent of `friction_angle_deg`, and (1
    + R_n) |v_n| the change of speed normal to the ground. If the loss by R_t is smaller, the rebound is that of
    `constant`.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.coulomb_limited:CoulombLimited"
    SOURCE: ClassVar[str] = "thesis, equations 3-1 to 3-3, with Coulomb's bound on the tangential impulse"
    CONFIRMED: ClassVar[Confirmed] = "D"

    @property
    def asks_friction(self) -> bool:
        """True: the friction angle of the materials limits the tangential impulse."""
        return True


class ThesisLiteralSpec(ModelSpec):
    """The thesis' equations 2-3 to 2-8 as printed, for reproduction only: they may lose or gain energy."""

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.thesis_literal:ThesisLiteral"
    SOURCE: ClassVar[str] = "thesis, equations 2-3 to 2-8"
    CONFIRMED: ClassVar[Confirmed] = "C"


class PfeifferBowenSpec(ModelSpec):
    """The sphere of CRSP: the rock rolls after every impact.

    R_n decreases with the speed into the ground. The faster the rock slips at the impact, the less of its energy along
    the ground remains. R_n and R_t are those of slow impacts, and R_t multiplies energy, so values for a lumped mass
    are not valid here.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.pfeiffer_bowen:PfeifferBowen"
    SOURCE: ClassVar[str] = PFEIFFER
    CONFIRMED: ClassVar[Confirmed] = "CC"

    K: Number = parameter(
        9.144, "a number above 0 (m/s), the speed into the ground at which R_n is halved", "m/s", PFEIFFER, "CC", gt=0
    )
    A: Number = parameter(
        6.096, "a number above 0 (m/s), A in CRSP's friction function R_t + (1 - R_t) / ((s / A)^2 + 1.2), where s is "
        "the slip (m/s); the function reduces the energy that is kept along the ground", "m/s", PFEIFFER, "CC", gt=0,
    )  # fmt: skip
    B: Number = parameter(
        76.2, "a number above 0 (m/s), B in CRSP's scaling factor R_t / ((v_n / (B R_n))^2 + 1), where v_n is the "
        "speed into the ground (m/s); the energy that is kept along the ground is multiplied by this factor and by the "
        "friction function", "m/s", PFEIFFER, "CC", gt=0,
    )  # fmt: skip


class VelocityScaledSpec(ModelSpec):
    """A lumped mass whose R_n is that of the material divided by 1 + (v_n / K)^2.

    v_n is the speed into the ground.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.velocity_scaled:VelocityScaled"
    SOURCE: ClassVar[str] = f"{PFEIFFER}; an option of RocFall"
    CONFIRMED: ClassVar[Confirmed] = "CC"

    K: Number = parameter(
        9.144, "a number above 0 (m/s), the speed into the ground at which R_n is halved", "m/s", PFEIFFER, "CC", gt=0
    )


class MassScaledSpec(ModelSpec):
    """A lumped mass whose R_n is that of the material divided by 1 + (m / C)^2; the formula is unconfirmed.

    m is the mass of the rock. If K is given, R_n is also divided by 1 + (v_n / K)^2, where v_n is the speed into the
    ground.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.mass_scaled:MassScaled"
    BUILDER: ClassVar[str] = f"{BUILDERS}:mass_scaled"
    SOURCE: ClassVar[str] = "an option of RocFall; the formula is that of a public implementation"
    CONFIRMED: ClassVar[Confirmed] = "UNCONFIRMED"

    C: Number = parameter(
        1000.0, "a number above 0 (kg), the mass at which R_n is halved; the formula is unconfirmed", "kg",
        "a public implementation of RocFall's option", "CC", gt=0,
    )  # fmt: skip
    K: Number | None = parameter(
        None, "a number above 0 (m/s), the speed into the ground at which R_n is halved; left out: speed has no effect",
        "m/s", PFEIFFER, "CC", gt=0,
    )  # fmt: skip


class VHalfSpec(ModelSpec):
    """A lumped mass with R_n = v_half / (v_n + v_half); the R_n of materials is not used.

    v_n is the speed into the ground; the parameter `speed` sets v_half. Bounces do not die out by themselves, so
    bouncing ends when the next bounce would be lower than `smallest_bounce`.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.v_half:VHalf"
    SOURCE: ClassVar[str] = "Bourrier and Dorren, as in PlatRock 2"
    CONFIRMED: ClassVar[Confirmed] = "CC"

    speed: Number = parameter(
        10.0, "a number above 0 and at most 50 (m/s), the speed into the ground at which R_n is 0.5", "m/s",
        "PlatRock 2", "CC", gt=0, le=50,
    )  # fmt: skip

    @property
    def idle_keys(self) -> tuple[str, ...]:
        """The material keys that this model ignores: R_n depends on `speed` instead."""
        return ("normal_restitution",)


def _rising_within_limits(rows: tuple[tuple[float, float, float], ...]) -> tuple[tuple[float, float, float], ...]:
    limits = (STEEPEST, MOST_R_N, 1.0)
    for i, row in enumerate(rows):
        for k, (name, most) in enumerate(zip(("angle", "R_n", "R_t"), limits, strict=True)):
            if not 0.0 <= row[k] <= most:
                raise refuse(f"is {row[k]:g}, but {name} must be a number from 0 to {most:g}", i, k)
        if i and row[0] <= rows[i - 1][0]:
            raise refuse(f"is {row[0]:g}, but angles must rise, and the one before is {rows[i - 1][0]:g}", i, 0)
    return rows


class AngleTableSpec(ModelSpec):
    """A lumped mass whose R_n and R_t depend on the angle between velocity and surface.

    R_n may be above 1 for impacts at a shallow angle. The energy gained normal to the ground is limited to the energy
    lost along the ground, so energy never rises.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.angle_table:AngleTable"
    BUILDER: ClassVar[str] = f"{BUILDERS}:angle_table"
    SOURCE: ClassVar[str] = f"`rows`: your own table; `law: wyllie`: {WYLLIE}"
    CONFIRMED: ClassVar[Confirmed] = "CC"

    rows: Annotated[tuple[Vector, ...], AfterValidator(_rising_within_limits)] | None = parameter(
        None, "a list of [angle, R_n, R_t]: angles in ascending order from 0 to 90 degrees, R_n from 0 to 10, R_t from "
        "0 to 1",
        "", "the user's", "D", min_length=1,
    )  # fmt: skip
    law: Literal["wyllie"] | None = parameter(
        None, "wyllie: R_n = 19.5 angle^-1.03, but at most 2, with R_t of the material; give either `law` or `rows`",
        "", WYLLIE, "CC",
    )  # fmt: skip

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        exactly_one(self, "rows", "law")
        return self

    @property
    def idle_keys(self) -> tuple[str, ...]:
        """The material keys that this model ignores: the table `rows` replaces R_n and R_t, `law` only R_n."""
        return ("normal_restitution",) if self.rows is None else ("normal_restitution", "tangential_restitution")


def _covariance(rows: Sequence[Nine]) -> Sequence[Nine]:
    matrix = np.array(rows, dtype=float)
    room = ROUNDING * float(np.abs(matrix).max(initial=0.0))
    for i, k in np.argwhere(np.abs(matrix - matrix.T) > room)[:1].tolist():
        raise refuse(f"is {matrix[i, k]:g}, but a covariance is symmetric, and [{k}][{i}] is {matrix[k, i]:g}", i, k)
    least = float(np.linalg.eigvalsh(matrix).min())
    if least < -room:
        raise refuse(
            f"is no covariance: some sum of the coefficients would have a variance of {least:.3g}; its eigenvalues "
            "must be >= 0"
        )
    return rows


class StochasticMatrixSpec(ModelSpec):
    """(v_t, v_n, R w) after an impact is a random matrix times the values before the impact.

    The scene states the mean of the matrix and the covariances of its coefficients. v_t is the speed along the ground
    in the direction of motion. v_n is the speed into the ground before the impact, and away from the ground after the
    impact. R w is the radius times the spin, positive for a rolling rock. The matrix [[R_t, 0, 0], [0, R_n, 0], [0, 0,
    0]] describes a lumped mass. If the drawn matrix would send the rock into the ground, v_n is computed with the mean
    matrix instead, and is at least zero. Energy never rises.
    """

    PHYSICS: ClassVar[str] = f"{REBOUNDS}.stochastic_matrix:StochasticMatrix"
    BUILDER: ClassVar[str] = f"{BUILDERS}:stochastic_matrix"
    SOURCE: ClassVar[str] = BOURRIER
    CONFIRMED: ClassVar[Confirmed] = "C"

    mean: tuple[Vector, Vector, Vector] = parameter(
        ..., "three rows of three numbers (-), the mean of the matrix that turns v_t, v_n and R w before an impact "
        "into the values after it", "-", "the user's", "D",
    )  # fmt: skip
    covariance: Annotated[
        tuple[Nine, Nine, Nine, Nine, Nine, Nine, Nine, Nine, Nine], AfterValidator(_covariance)
    ] = parameter(
        ..., "nine rows of nine numbers, the covariances of the coefficients of `mean`, row by row; symmetric, with no "
        "negative eigenvalue", "-", "the user's", "D",
    )  # fmt: skip

    @property
    def idle_keys(self) -> tuple[str, ...]:
        """The material keys that this model ignores: the matrix replaces both restitutions."""
        return ("normal_restitution", "tangential_restitution")
