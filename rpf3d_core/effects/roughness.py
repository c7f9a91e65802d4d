"""Rough ground: for each impact, the normal of the facet is tilted at random.

There are two laws; a scene uses one of them.

CRSP's law, as in the public code of PlatRock: S is the height of the surface irregularities (m) within a length of the
rock's radius R. The tilt is theta = U atan(S / R), U uniform in [0, 1). The tilt is against the motion, so it always
increases the angle of the impact (at a steep impact the rock is thrown back). The ground is rougher for smaller rocks.
`deviates` is PlatRock's form of the law in three dimensions: a second uniform number U' divides the tilt into U' theta
against the motion and (1 - U') theta to a randomly drawn side, so that rocks leave their fall line.

RocFall's law, as in the public program pyrockfall: the tilt along the motion is Normal(0, sd), independent of the size
of the rock. It may decrease or increase the angle of the impact. The published law has no tilt to the side, so rocks on
a plane stay on their fall line. `SpreadRoughness` adds a separately drawn side tilt, Normal(0, lateral_sd), which is
not part of RocFall.

Bounces on rough ground are summed up only if the rock would rise by less than `smallest_bounce` with its total speed
straight off the ground, because a tilted normal may turn the total speed upwards. Roughness of this module does not act
on a sphere in sustained contact (`rock.shape: sphere`).

In this module, motion means the component of the velocity along the ground. If this component is zero or only a
rounding error, there is no tilt. A tilt of zero gives exactly the facet's normal.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.effects.hooks import felt_normal
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.distributions import standard_normal
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.materials.streams import Purpose, uniform_at
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, along, cross, norm, scale, without

TILT, SHARE, SIDE = int(Purpose.ROUGHNESS), int(Purpose.ROUGHNESS_SHARE), int(Purpose.ROUGHNESS_SIDE)
LATERAL = int(Purpose.ROUGHNESS_LATERAL)
STEEPEST = math.radians(89.0)
"""Largest tilt (rad) of the normal of an impact.

A normally distributed tilt has no bounds, but a tilt of 90 degrees or more is not possible.
"""


class CrspRoughness(NamedTuple):
    """Rough ground by CRSP's law: a random tilt of the normal, larger for small rocks.

    amplitude : S (m), >= 0; deviates : true if part of the tilt is to the side
    """

    amplitude: float
    deviates: bool
    asks_rock = True  # type: ignore[misc]
    draws = True  # type: ignore[misc]


class RocfallRoughness(NamedTuple):
    """Rough ground by RocFall's law: a random tilt of the normal, equal for rocks of any size.

    angle_sd : standard deviation of the tilt (rad), >= 0
    """

    angle_sd: float
    draws = True  # type: ignore[misc]


class SpreadRoughness(NamedTuple):
    """Rough ground by RocFall's law, with a tilt to the side as well.

    angle_sd, lateral_sd : standard deviations of the tilts along the motion and to the side (rad), >= 0
    """

    angle_sd: float
    lateral_sd: float
    draws = True  # type: ignore[misc]


@felt_normal.rule(CrspRoughness)
def crsp_normal(effect: CrspRoughness, n: Vec, motion: Motion, rock: RockContext) -> Vec:
    """Return the unit normal (3,) of an impact by CRSP's law: n, tilted at random against the motion.

    If `effect.deviates` is true, part of the tilt is to a side.
    """
    most = math.atan(effect.amplitude / rock.rock.radius)  # type: ignore[union-attr]  # asks_rock
    tilt = most * _drawn(rock, TILT)
    if not effect.deviates:
        return tilted(n, motion.v, tilt, 0.0)
    share = _drawn(rock, SHARE)
    aside = tilt * (1.0 - share)
    return tilted(n, motion.v, tilt * share, aside if _drawn(rock, SIDE) < 0.5 else -aside)


@felt_normal.rule(RocfallRoughness)
def rocfall_normal(effect: RocfallRoughness, n: Vec, motion: Motion, rock: RockContext) -> Vec:
    """Return the unit normal (3,) of an impact by RocFall's law: n, tilted at random against the motion or along it."""
    return tilted(n, motion.v, _normal_tilt(effect.angle_sd, rock, TILT), 0.0)


@felt_normal.rule(SpreadRoughness)
def spread_normal(effect: SpreadRoughness, n: Vec, motion: Motion, rock: RockContext) -> Vec:
    """Return the unit normal (3,) of an impact: n, tilted at random as in RocFall's law, and then to a side."""
    back = _normal_tilt(effect.angle_sd, rock, TILT)
    return tilted(n, motion.v, back, _normal_tilt(effect.lateral_sd, rock, LATERAL))


@kernel
def _normal_tilt(sd: float, rock: RockContext, stream: int) -> float:
    """Return a random tilt (rad) of the normal for the next impact, within +-STEEPEST (89 degrees).

    sd : rad, standard deviation of the tilt; stream : purpose of the random number, which makes it independent of
        the numbers for other purposes
    """
    tilt = sd * standard_normal(_drawn(rock, stream))
    return min(max(tilt, -STEEPEST), STEEPEST)


@kernel
def _drawn(rock: RockContext, stream: int) -> float:
    """Return a random number in [0, 1) for the next impact of a rock.

    stream : purpose of the random number, which makes it independent of the numbers for other purposes
    """
    key: Any = rock.key  # draws: the key is never None
    return uniform_at(key.seed, key.source, key.rock, stream, rock.impacts + 1)


@kernel
def tilted(n: Vec, v: Vec, back: float, aside: float) -> Vec:
    """Return the normal n, tilted by `back` (rad) against the motion, then by `aside` (rad) to the left of the motion.

    The result is n itself if there is no motion along the ground.

    v : (3,) velocity, whose component along the ground is the motion
    """
    level = without(along(v, n), n)  # twice, so that the rounding error across the plane is small in slow motion
    speed = norm(level)
    if speed == 0.0 or (back == 0.0 and aside == 0.0):
        return n
    t = scale(1.0 / speed, level)
    felt = turned(n, t, -back)
    return felt if aside == 0.0 else turned(felt, cross(n, t), aside)


@kernel
def turned(n: Vec, towards: Vec, angle: float) -> Vec:
    """Return the unit vector n turned by an angle (rad) towards another unit vector, which is perpendicular to n."""
    return add(scale(math.cos(angle), n), scale(math.sin(angle), towards))
