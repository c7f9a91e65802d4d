"""Nets and fences: vertical panels along lines in plan. A panel catches a rock, gives way to it, or is flown over.

The rule (physics reference 5.1): a rock meets a panel where it crosses the vertical plane of the panel, between the
ground there and the height of the panel. If its translational energy E is at most the capacity C, the rock is caught
and hangs there. With more energy the rock breaks through, keeps its direction and its spin, and has E - s C left, where
s is the share of the capacity that a break takes. A rock above the panel flies over it and its path does not change at
all. The height compared is the height of the rock's centre or, if the scene says so, of the top of the sphere of its
volume.

Every rock meets a barrier exactly as the scene gives it: rocks are independent of each other and fly in no order, so no
rock can find what another rock has broken. For a barrier that has been hit before, the scene gives the share of its
height that is left. This model does not decide how high and how strong a barrier must be: rules for that differ between
countries.

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
"""Distance (m) below the foot of a panel at which a rock still meets the panel: the path of a slide that bends is
represented by its chord."""
CORNER = 1e-6
"""Distance (m) at a corner within which a rock that has broken through one side does not also meet the other side."""


class Panel(NamedTuple):
    """N panel segments, each over one facet, and the properties of B barriers; every array is (N,) or (B,).

    x, y, z : foot of the segment at its beginning, m; dx, dy, dz : from there to its end, m; facet : under the segment
    line : number of the straight line that the segment belongs to; barrier : number of its barrier
    height : of the standing panel, m; capacity : J; taken : share of the capacity that a break takes (-)
    top : 1.0 if the top of the rock counts, 0.0 if its centre counts
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
    """The barriers of a scene: their segments are the obstacles with numbers from `first` on.

    slack : m, distance within which a place is on the plane of a panel; cells : the segments sorted into cells of the
        plan
    """

    first: int
    panel: Panel
    slack: float
    cells: ObstacleCells

    @property
    def asks_rock(self) -> bool:
        """True: the rules need mass and radius of the rock."""
        return True

    @property
    def obstacles(self) -> int:
        """Number of obstacles."""
        return len(self.panel.x)


class PanelCrossing(NamedTuple):
    """The crossing of an arc with the plane of a segment after t seconds (inf: none), `height` (m) above the foot."""

    t: float
    height: float


@kernel
def crossing_of(panel: Panel, slack: float, k: int, arc: Arc, until: float) -> PanelCrossing:
    """Return where an arc crosses the plane of segment k, from 0 to `until` (s): linear in time.

    A place within `slack` (m) of the plane is on the plane, so that no crossing is missed between one arc and the next.
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
    """Return the time (s) at which an arc meets segment k; inf above the panel or if the rock has passed the segment.

    A rock that breaks through one segment of a straight line has passed the whole line. Panels at the same place are
    met in the order of their numbers, so a rock that has just broken through one of them has passed those with lower
    numbers. A panel that takes no energy, or has no height, is no obstacle.
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
    """True if a rock that met segment `passed` last (below 0: none) has passed segment k, crossed at t (s)."""
    if passed < 0:
        return False
    panel, way = barriers.panel, t * math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1])
    if panel.barrier[passed] == panel.barrier[k]:
        return bool(panel.line[passed] == panel.line[k] or way <= CORNER)
    return k < passed and way <= barriers.slack and _stands_at(panel, passed, arc.x)


@kernel
def _stands_at(panel: Panel, k: int, x: Vec) -> bool:
    """True if segment k stands at x (m) in plan, to within CORNER."""
    dx, dy = panel.dx[k], panel.dy[k]
    length = math.sqrt(dx * dx + dy * dy)
    east, north = x[0] - panel.x[k], x[1] - panel.y[k]
    off, on = (east * dy - north * dx) / length, (east * dx + north * dy) / length
    return bool(abs(off) <= CORNER and -CORNER <= on <= length + CORNER)


@first_obstacle.rule(Barriers)
def first_panel(barriers: Barriers, arc: Arc, passed: int, until: float, rock: RockContext) -> Meeting:
    """Return the first panel on an arc."""
    past = passed - barriers.first
    past = past if past < len(barriers.panel.x) else -1
    speed = math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1])
    instant = barriers.slack / speed if speed > SLOWEST else 0.0
    met = first_in_cells(barriers, arc, past, until, instant, rock)
    return Meeting(met.t, barriers.first + met.number) if met.t < math.inf else met


@at_obstacle.rule(Barriers)
def at_panel(barriers: Barriers, motion: Motion, number: int, met: int, rock: RockContext) -> AfterObstacle:
    """Return the result of a meeting with a panel: the rock is caught, or passes with the remaining energy."""
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
