"""Single trees: vertical stems that take energy from a rock and deflect it.

A rock meets a stem where the distance in plan from the rock to the stem's axis falls to the sum of both radii, if the
rock is then between the foot of the tree and its top. Dorren and Berger (2006, Tree Physiology 26:63-71): a stem with
the diameter d (cm) at breast height (DBH) takes at most

    E_max = FE 38.7 d^2.31 J                                       (UNCONFIRMED)

where FE is 1 for silver fir, about 0.93 for other conifers and 1.59 for broadleaved trees. A stem takes less energy if
the rock does not hit its axis. Let x be the offset of the path from the axis, divided by the distance at which rock and
stem just touch:

    E / E_max = a + (b - a) / (1 + 10^((c - x) s)),  a -0.046, b 0.98, c 0.58, s -8.007, not below 0   (UNCONFIRMED)

The energy that a stem takes falls linearly with the height of the blow, to zero at the top (UNCONFIRMED). A rock whose
energy is at most the energy that the stem takes loses all its speed and drops; a sliding or rolling rock stops at the
stem. Any other rock continues with the remaining energy and is turned away from the axis in plan. The angle is drawn
from one of three classes, whose chances depend on the offset of the blow (figures UNCONFIRMED, all set in the scene).
Spin is kept. Trees do not change: every rock meets all trees, even trees that another rock has felled.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, position
from rpf3d_core.effects.hooks import AfterObstacle, Meeting, at_obstacle, first_obstacle
from rpf3d_core.effects.obstacle_cells import ObstacleCells, first_in_cells, time_to
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.materials.streams import Purpose, uniform_at
from rpf3d_core.values import MOVING, ZERO, Motion
from rpf3d_core.vectors import dot

CLASS, ANGLE, SIDE = int(Purpose.TREE_CLASS), int(Purpose.TREE_ANGLE), int(Purpose.TREE_SIDE)
LOWER, UPPER, MIDDLE, STEEPNESS = -0.046, 0.98, 0.58, -8.007
ENERGY_FACTOR, ENERGY_EXPONENT = 38.7, 2.31
ROOTS = 2.0
"""Depth below the foot of a tree, in contact distances (-), down to which a rock still hits the tree.

The ground is lower on the downhill side. The contact distance is the distance at which rock and stem touch.
"""
DEGREES = math.pi / 180.0
NEAREST = 1e-9
"""Overlap (m) of rock and stem up to which the rock still counts as outside the stem, to allow for rounding."""


class Stems(NamedTuple):
    """The stems of the T trees of a scene; every array is (T,).

    x, y, z : foot of the tree (m); radius : of the stem (m); height : of the tree (m)
    energy : E_max (J), the largest energy that the stem can take from a rock
    """

    x: Any
    y: Any
    z: Any
    radius: Any
    height: Any
    energy: Any


class Deflection(NamedTuple):
    """The parameters that decide by which angle a tree turns a rock away from its path.

    frontal, lateral : largest offset (-) of a frontal and of a lateral blow; a blow with a larger offset is scratching.
        The offset is the distance of the path from the stem's axis, over the distance at which rock and stem just touch
    chances : (9,) chances of the three angle classes for frontal, for lateral and for scratching blows; each three
        chances add up to 1
    angles : (4,) degrees, the limits of the three angle classes
    """

    frontal: float
    lateral: float
    chances: Any
    angles: Any


class Forest(NamedTuple):
    """The trees of a scene, in the form that the simulation reads.

    first : number, among all obstacles of the scene, of the first tree; the other trees have the next numbers
    deflection : parameters of the angle of deflection; cells : the trees, sorted into the cells of a grid in plan
    """

    first: int
    stems: Stems
    deflection: Deflection
    cells: ObstacleCells

    @property
    def asks_rock(self) -> bool:
        """True: the rules for trees need mass and radius of the rock."""
        return True

    @property
    def draws(self) -> bool:
        """True: the rules draw random numbers, for the angle by which a tree turns a rock."""
        return True

    @property
    def obstacles(self) -> int:
        """Number of obstacles: the trees."""
        return len(self.stems.x)


def most_energy(dbh_cm: Any, factor: Any) -> Any:
    """Return the largest energy (J) that the stem of a tree can take from a rock.

    dbh_cm : DBH (cm), the stem's diameter at breast height; factor : FE of the species (-); numbers or arrays
    """
    return factor * ENERGY_FACTOR * dbh_cm**ENERGY_EXPONENT


@kernel
def share_at_offset(x: float) -> float:
    """Return the share of E_max (-) that a stem takes from a rock; x : offset of the blow (-), 0 head on, 1 grazing."""
    share = LOWER + (UPPER - LOWER) / (1.0 + math.exp((MIDDLE - x) * STEEPNESS * LN_10))
    return max(share, 0.0)


LN_10 = math.log(10.0)


@time_to.rule(Forest)
def time_to_stem(forest: Forest, k: int, arc: Arc, passed: int, until: float, rock: RockContext) -> float:
    """Return the time (s), at most `until`, at which a rock on an arc hits stem k; inf if never.

    The rock hits the stem when the distance in plan from the rock to the stem's axis falls to the sum of both radii.
    The rock must then be below the top of the tree and not too far below its foot (ROOTS, twice the sum of both radii).
    A rock that is nearer to the axis already at the start of the arc, or moves away from the axis, does not hit.

    passed : index of the tree that the rock hit last and does not hit on this arc; below 0 for none
    """
    if k == passed:
        return math.inf
    stems = forest.stems
    x, y = arc.x[0] - stems.x[k], arc.x[1] - stems.y[k]
    reach = stems.radius[k] + rock.rock.radius  # type: ignore[union-attr]
    speed2 = arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1]
    closing = -(x * arc.v[0] + y * arc.v[1])
    away2 = x * x + y * y - reach * reach
    if closing <= 0.0 or away2 < -2.0 * NEAREST * reach:
        return math.inf
    discriminant = closing * closing - speed2 * away2
    if discriminant <= 0.0:
        return math.inf
    t = max(away2, 0.0) / (closing + math.sqrt(discriminant))
    if t > until:
        return math.inf
    above = position(arc, t)[2] - stems.z[k]
    return t if -ROOTS * reach <= above <= stems.height[k] else math.inf


@first_obstacle.rule(Forest)
def first_tree(forest: Forest, arc: Arc, passed: int, until: float, rock: RockContext) -> Meeting:
    """Return the first tree that a rock on an arc hits up to the time `until` (s), or NO_MEETING.

    passed : number of the obstacle that the rock met last; below 0 for none
    """
    met = first_in_cells(forest, arc, passed - forest.first, until, 0.0, rock)
    return Meeting(met.t, forest.first + met.number) if met.t < math.inf else met


@at_obstacle.rule(Forest)
def at_tree(forest: Forest, motion: Motion, number: int, met: int, rock: RockContext) -> AfterObstacle:
    """Return the result for a rock that hits a tree: the rock loses all speed, or is slowed down and deflected.

    The position, time and spin of the rock do not change.

    motion : at the hit; number : of the obstacle in the scene; for another obstacle than a tree, nothing changes
    met : number of meetings of the rock with obstacles so far, which selects random numbers
    """
    k = number - forest.first
    if k < 0 or k >= len(forest.stems.x):
        return AfterObstacle(motion=motion, outcome=MOVING, facet=-1)
    stems, v, body = forest.stems, motion.v, rock.rock
    x, y = motion.x[0] - stems.x[k], motion.x[1] - stems.y[k]
    level = math.sqrt(v[0] * v[0] + v[1] * v[1])
    if level == 0.0:  # the rock leans against the stem
        return AfterObstacle(motion=Motion(t=motion.t, x=motion.x, v=ZERO, w=motion.w), outcome=MOVING, facet=-1)
    aside = (v[0] * y - v[1] * x) / level
    offset = min(abs(aside) / (stems.radius[k] + body.radius), 1.0)  # type: ignore[union-attr]
    up = min(max((motion.x[2] - stems.z[k]) / stems.height[k], 0.0), 1.0)
    taken = stems.energy[k] * share_at_offset(offset) * (1.0 - up)
    energy = 0.5 * body.mass * dot(v, v)  # type: ignore[union-attr]
    if energy <= taken:
        return AfterObstacle(motion=Motion(t=motion.t, x=motion.x, v=ZERO, w=motion.w), outcome=MOVING, facet=-1)
    turn = _turn(forest.deflection, offset, aside, met, rock)
    kept = math.sqrt((energy - taken) / energy)
    c, s = kept * math.cos(turn), kept * math.sin(turn)
    turned = (c * v[0] - s * v[1], s * v[0] + c * v[1], kept * v[2])
    return AfterObstacle(motion=Motion(t=motion.t, x=motion.x, v=turned, w=motion.w), outcome=MOVING, facet=-1)


@kernel
def _turn(deflection: Deflection, offset: float, aside: float, met: int, rock: RockContext) -> float:
    """Return the angle (rad, counter-clockwise in plan) by which a tree turns a rock's path away from the stem's axis.

    offset : of the blow (-), >= 0; met : as in `at_tree`
    aside : m, distance of the path from the stem's axis, positive if the rock passes to the left of the axis
    """
    key, number = rock.key, met + 1
    blow = 0 if offset <= deflection.frontal else (1 if offset <= deflection.lateral else 2)
    chance = uniform_at(key.seed, key.source, key.rock, CLASS, number)  # type: ignore[union-attr]
    which = 0
    if chance >= deflection.chances[3 * blow]:
        which = 1 if chance < deflection.chances[3 * blow] + deflection.chances[3 * blow + 1] else 2
    share = uniform_at(key.seed, key.source, key.rock, ANGLE, number)  # type: ignore[union-attr]
    low, high = deflection.angles[which], deflection.angles[which + 1]
    angle = (low + share * (high - low)) * DEGREES
    left = aside > 0.0
    if aside == 0.0:
        left = uniform_at(key.seed, key.source, key.rock, SIDE, number) < 0.5  # type: ignore[union-attr]
    return angle if left else -angle  # type: ignore[no-any-return]
