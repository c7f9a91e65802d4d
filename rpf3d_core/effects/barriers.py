"""Nets and fences: vertical panels along lines in plan, that catch a rock, give way to it, or are flown over.

The rule (physics reference 5.1): a rock meets a panel where it crosses the panel's vertical plane between the ground
there and the panel's height. With translational energy E up to the capacity C it is caught and hangs there; with more
it breaks through, keeps its direction and its spin, and has E - s C left, where s is the share of the capacity that a
break takes. Higher up it flies over, and not a bit of its path is changed. Height is that of the rock's centre or, if
the scene says so, of the top of the sphere of its volume.

Every rock finds a barrier as the scene gives it: rocks are independent of each other and fly in no order, so none can
find what another has broken. A barrier that has been hit before is described by the share of its height that is left.
How high and how strong it must be is not decided here: rules for that differ between countries.

Energy balance: D, derived here. Heights and capacities of energy classes are the user's.
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
"""Metres that a rock may be below the foot of a panel and still meet it: a slide that bends is told by its chord."""
CORNER = 1e-6
"""Metres within which a rock that has broken through one side of a corner does not meet the other side of it, too."""


class Panel(NamedTuple):
    """N pieces of panels, over one facet each, and what B barriers are made of; every array (N,) or (B,).

    x, y, z : foot of the piece's beginning, m; dx, dy, dz : from there to its end; facet : that it stands on
    line : number of the straight line that it is part of; barrier : of the barrier
    height : m, that stands; capacity : J; taken : share of it that a break takes; top : 1.0 where the top of the rock
        counts, 0.0 where its centre does
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
    """The barriers of a scene: their pieces are obstacles number `first` and those that follow.

    slack : m within which a place is on a panel's plane; cells : of the pieces in plan
    """

    first: int
    panel: Panel
    slack: float
    cells: ObstacleCells

    @property
    def asks_rock(self) -> bool:
        """Its rules ask for mass and radius."""
        return True

    @property
    def obstacles(self) -> int:
        """How many obstacles there are."""
        return len(self.panel.x)


class PanelCrossing(NamedTuple):
    """An arc crosses the plane of a piece after t seconds (inf: not within it), `height` metres above its foot."""

    t: float
    height: float


@kernel
def crossing_of(panel: Panel, slack: float, k: int, arc: Arc, until: float) -> PanelCrossing:
    """Where an arc crosses the plane of piece k, from 0 to `until` (s): linear in time.

    A place within `slack` (m) of the plane is on it, so that none is missed between one arc and the next.
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
def time_to_panel(barriers: Barriers, k: int, arc: Arc, passed: int, until: float, falling: RockContext) -> float:
    """When an arc meets piece k of the panels: not above it, and not where the rock has just broken through.

    Broken through one piece of a straight line it is past all of that line. Panels that stand in one place are met in
    the order of their numbers, so a rock that has just broken through one of them is past those before it. A panel that
    takes no energy, or has no height, is no obstacle.
    """
    panel = barriers.panel
    b = panel.barrier[k]
    if panel.capacity[b] <= 0.0 or panel.height[b] <= 0.0:
        return math.inf
    crossing = crossing_of(panel, barriers.slack, k, arc, until)
    high = crossing.height + (panel.top[b] * falling.rock.radius)  # type: ignore[union-attr]
    if crossing.t == math.inf or crossing.height < -BELOW or high > panel.height[b]:
        return math.inf
    return math.inf if _is_past(barriers, k, crossing.t, passed, arc) else crossing.t


@kernel
def _is_past(barriers: Barriers, k: int, t: float, passed: int, arc: Arc) -> bool:
    """Whether a rock that has met piece `passed` last (below 0: none) is past piece k, crossed at t (s)."""
    if passed < 0:
        return False
    panel, way = barriers.panel, t * math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1])
    if panel.barrier[passed] == panel.barrier[k]:
        return bool(panel.line[passed] == panel.line[k] or way <= CORNER)
    return k < passed and way <= barriers.slack and _stands_at(panel, passed, arc.x)


@kernel
def _stands_at(panel: Panel, k: int, x: Vec) -> bool:
    """Whether piece k stands where x (m) is in plan, to within CORNER."""
    dx, dy = panel.dx[k], panel.dy[k]
    length = math.sqrt(dx * dx + dy * dy)
    east, north = x[0] - panel.x[k], x[1] - panel.y[k]
    off, on = (east * dy - north * dx) / length, (east * dx + north * dy) / length
    return bool(abs(off) <= CORNER and -CORNER <= on <= length + CORNER)


@first_obstacle.rule(Barriers)
def first_panel(barriers: Barriers, arc: Arc, passed: int, until: float, falling: RockContext) -> Meeting:
    """The first panel on an arc."""
    past = passed - barriers.first
    past = past if past < len(barriers.panel.x) else -1
    speed = math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1])
    instant = barriers.slack / speed if speed > SLOWEST else 0.0
    met = first_in_cells(barriers, arc, past, until, instant, falling)
    return Meeting(met.t, barriers.first + met.number) if met.t < math.inf else met


@at_obstacle.rule(Barriers)
def at_panel(barriers: Barriers, motion: Motion, number: int, met: int, falling: RockContext) -> AfterObstacle:
    """Caught, or through with the energy that is left."""
    k = number - barriers.first
    if k < 0 or k >= len(barriers.panel.x):
        return AfterObstacle(motion, MOVING, -1)
    panel = barriers.panel
    b = panel.barrier[k]
    energy = 0.5 * falling.rock.mass * dot(motion.v, motion.v)  # type: ignore[union-attr]
    if energy <= panel.capacity[b]:
        return AfterObstacle(Motion(motion.t, motion.x, ZERO, ZERO), CAUGHT, panel.facet[k])
    kept = math.sqrt((energy - panel.taken[b] * panel.capacity[b]) / energy)
    return AfterObstacle(Motion(motion.t, motion.x, scale(kept, motion.v), motion.w), MOVING, -1)
