"""Nets and fences: vertical panels along lines. A panel catches a rock, or the rock breaks through it or flies over it.

The rule of RockGIS and Rockyfor3D (docs/reference/effects.md, `barriers`): a rock meets a panel where the rock crosses
the vertical plane of the panel, between the ground and the top of the panel. If the rock's translational energy E is at
most the capacity C, the panel catches the rock, which stays there. With more energy the rock breaks through, keeps its
direction and its spin, and has the energy E - s C left; s is the share of the capacity that the rock loses. A rock
above the panel flies over it, without any change of its path. The height of the rock is the height of its centre or, if
the scene says so, of the top of the sphere of equal volume.

Every rock meets a barrier as the scene defines it. Rocks are independent of each other and fly in no defined order, so
no rock meets a barrier that another rock has damaged. For a barrier that was hit before the simulation, the scene gives
the remaining share of its height. This model does not decide how high and how strong a barrier must be, because the
rules for this differ between countries.

Energy balance: D, derived here. The user gives heights and capacities of energy classes.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, position
from rpf3d_core.effects.hooks import AfterObstacle, Meeting, at_obstacle, first_obstacle
from rpf3d_core.effects.obstacle_cells import SLOWEST, ObstacleCells, first_in_cells, time_to
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import MOVING, ZERO, Motion, Outcome, Vec
from rpf3d_core.vectors import dot, scale

CAUGHT = int(Outcome.CAUGHT)
BELOW = 1e-3
"""Largest depth (m) of a rock below the foot of a panel at which the rock still meets the panel.

The depth is above 0, because the chord of a curved slide, which replaces the true path, may be below the ground.
"""
CORNER = 1e-6
"""Largest distance (m) from a corner of a barrier at which a rock that breaks through one side passes both sides."""


class PanelSegments(NamedTuple):
    """N panel segments, each over one facet, and the properties of the B barriers to which the segments belong.

    x, y, z : (N,) m, foot of the segment at its start; dx, dy, dz : (N,) m, vector from start to end
    facet : (N,) number of the facet below the segment
    line : (N,) number of the straight line that the segment belongs to; barrier : (N,) number of its barrier
    height : (B,) m, remaining height of the panels; capacity : (B,) J
    taken : (B,) energy that a rock loses when it breaks through, as a share of the capacity (-)
    top : (B,) 1.0 if a rock whose top is above the panel flies over it, 0.0 if the rock's centre must be above it
    """

    x: Any
    y: Any
    z: Any
    dx: Any
    dy: Any
    dz: Any
    facet: Any
    line: Any
    barrier: Any
    height: Any
    capacity: Any
    taken: Any
    top: Any


class Barriers(NamedTuple):
    """The barriers of a scene, in the form that the simulation reads.

    first : number, among all obstacles of the scene, of the first panel segment; the other segments have the next
        numbers
    panel : the panel segments; slack : m, a point within this distance of a panel's plane counts as on the plane
    cells : the panel segments, sorted into the cells of a grid in plan
    """

    first: int
    panel: PanelSegments
    slack: float
    cells: ObstacleCells

    @property
    def asks_rock(self) -> bool:
        """True: the rules for barriers need mass and radius of the rock."""
        return True

    @property
    def obstacles(self) -> int:
        """Number of obstacles: the panel segments."""
        return len(self.panel.x)


class PanelCrossing(NamedTuple):
    """Where an arc crosses the vertical plane of a panel segment.

    t : s since the start of the arc, inf for no crossing
    height : m, of the rock's centre above the foot of the panel; 0 for no crossing
    """

    t: float
    height: float


@kernel
def crossing_of(panel: PanelSegments, slack: float, k: int, arc: Arc, until: float) -> PanelCrossing:
    """Return where an arc crosses panel segment k in plan, between the times 0 and `until` (s), at any height.

    A point within `slack` (m) of the segment's plane counts as on the plane, so that no crossing is missed between two
    arcs.
    """
    x, y, dx, dy = panel.x[k], panel.y[k], panel.dx[k], panel.dy[k]
    length2 = dx * dx + dy * dy
    length = math.sqrt(length2)
    off = ((arc.x[0] - x) * dy - (arc.x[1] - y) * dx) / length
    rate = (arc.v[0] * dy - arc.v[1] * dx) / length
    if rate == 0.0:
        return PanelCrossing(math.inf, 0.0)
    t = -off / rate
    if t < 0.0:
        t = 0.0 if abs(off) <= slack else math.inf
    elif t > until:
        t = until if abs(off + rate * until) <= slack else math.inf
    if t == math.inf:
        return PanelCrossing(math.inf, 0.0)
    at = position(arc, t)
    along = ((at[0] - x) * dx + (at[1] - y) * dy) / length2
    if along * length < -slack or (along - 1.0) * length > slack:
        return PanelCrossing(math.inf, 0.0)
    return PanelCrossing(t, at[2] - (panel.z[k] + along * panel.dz[k]))


@time_to.rule(Barriers)
def time_to_panel(barriers: Barriers, k: int, arc: Arc, passed: int, until: float, rock: RockContext) -> float:
    """Return the time (s), at most `until`, at which a rock on an arc meets panel segment k; inf if never.

    A rock does not meet a panel that it flies over or has already passed. A rock that breaks through one segment of a
    straight line has passed the whole line. If segments of several barriers are at the same place, a rock meets them in
    the order of the segments' indices (`first_panel`). So a rock that has just broken through one of them has passed
    the segments with lower indices whose planes are within the slack of the rock, whichever way the rock moves on.
    A panel without capacity, or without height, is not an obstacle.

    passed : index of the segment that the rock met last; below 0 for none
    """
    panel = barriers.panel
    b = panel.barrier[k]
    if panel.capacity[b] <= 0.0 or panel.height[b] <= 0.0:
        return math.inf
    crossing = crossing_of(panel, barriers.slack, k, arc, until)
    high = crossing.height + (panel.top[b] * rock.rock.radius)  # type: ignore[union-attr]
    if crossing.t == math.inf or crossing.height < -BELOW or high > panel.height[b]:
        return math.inf
    return math.inf if _is_past(barriers, k, crossing.t, passed, arc) else crossing.t


@kernel
def _is_past(barriers: Barriers, k: int, t: float, passed: int, arc: Arc) -> bool:
    """Return True if a rock has already passed panel segment k, so that the crossing at t (s) does not count.

    `time_to_panel` states which segments a rock has passed.

    passed : index of the segment that the rock met last; below 0 for none
    """
    if passed < 0:
        return False
    panel, way = barriers.panel, t * math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1])
    if panel.barrier[passed] == panel.barrier[k]:
        return bool(panel.line[passed] == panel.line[k] or way <= CORNER)
    return k < passed and stands_at(panel, k, arc.x, barriers.slack) and stands_at(panel, passed, arc.x, CORNER)


@kernel
def stands_at(panel: PanelSegments, k: int, x: Vec, reach: float) -> bool:
    """Return True if the position x (3,) m of a rock is on panel segment k in plan.

    reach : m, largest distance from the segment's plane; the rock may be up to CORNER (1e-6 m) past an end
    """
    dx, dy = panel.dx[k], panel.dy[k]
    length = math.sqrt(dx * dx + dy * dy)
    east, north = x[0] - panel.x[k], x[1] - panel.y[k]
    off, on = (east * dy - north * dx) / length, (east * dx + north * dy) / length
    return bool(abs(off) <= reach and -CORNER <= on <= length + CORNER)


@first_obstacle.rule(Barriers)
def first_panel(barriers: Barriers, arc: Arc, passed: int, until: float, rock: RockContext) -> Meeting:
    """Return the first panel segment that a rock on an arc meets up to the time `until` (s), or NO_MEETING.

    Segments whose planes are within the slack of the meeting count as at the same place, even if the arc crosses their
    planes later because it is nearly parallel to them. Of these, the rock meets the segment with the smallest index.

    passed : number of the obstacle that the rock met last; below 0 for none
    """
    past = passed - barriers.first
    past = past if past < len(barriers.panel.x) else -1
    speed = math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1])
    instant = barriers.slack / speed if speed > SLOWEST else 0.0
    met = first_in_cells(barriers, arc, past, until, instant, rock)
    if met.t < until:
        met = first_in_cells(barriers, arc, past, met.t, instant, rock)
    return Meeting(met.t, barriers.first + met.number) if met.t < math.inf else met


@at_obstacle.rule(Barriers)
def at_panel(barriers: Barriers, motion: Motion, number: int, met: int, rock: RockContext) -> AfterObstacle:
    """Return the result for a rock that meets a panel: the panel catches the rock, or the rock breaks through.

    A caught rock has no velocity and no spin. A rock that breaks through keeps its direction and its spin; its energy
    falls by the share `taken` of the capacity.

    motion : at the meeting; number : of the obstacle in the scene; for another obstacle than a panel, nothing changes
    met : not used by this effect
    """
    k = number - barriers.first
    if k < 0 or k >= len(barriers.panel.x):
        return AfterObstacle(motion=motion, outcome=MOVING, facet=-1)
    panel = barriers.panel
    b = panel.barrier[k]
    energy = 0.5 * rock.rock.mass * dot(motion.v, motion.v)  # type: ignore[union-attr]
    if energy <= panel.capacity[b]:
        return AfterObstacle(
            motion=Motion(t=motion.t, x=motion.x, v=ZERO, w=ZERO), outcome=CAUGHT, facet=panel.facet[k]
        )
    kept = math.sqrt((energy - panel.taken[b] * panel.capacity[b]) / energy)
    return AfterObstacle(
        motion=Motion(t=motion.t, x=motion.x, v=scale(kept, motion.v), w=motion.w), outcome=MOVING, facet=-1
    )
