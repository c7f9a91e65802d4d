"""The end of bouncing: all remaining small bounces are summed up in one step, and the rock then stays on the ground."""

import math
from typing import Any

from rpf3d_core.arc import Arc
from rpf3d_core.detection.contact import PreviousContact
from rpf3d_core.detection.terrain_pieces import contact_on_way
from rpf3d_core.effects.hooks import felt_normal, first_obstacle, still_at
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.rebound import rest_of_bounces
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.physics import Physics, ground_of, rock_at
from rpf3d_core.simulation.record import Record, note_piece
from rpf3d_core.simulation.state import State, with_ground, with_piece
from rpf3d_core.terrain.facet_geometry import contains, on_line, on_plane
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Mode, Motion, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale, subtract

SETTLED = 1e-6
"""Share of smallest_bounce (-): bounces that rise less than this share are left out if they cannot be summed up.

In a corner between facets, for example, bounces never stay on one facet, so they are never summed up.
"""

SKIMMING = 1e-12
"""Least ratio (-) of the speed off a facet to the whole speed, for a rock that flies on after an impact.

A lower speed off the facet is raised to this ratio (`_kept_off`).
Rough ground turns the speed upwards in some later impact, so its bounces are not summed up. But R_n may reduce the
speed off the facet, impact after impact, to a rounding error of the velocity (1e-16). The rock would then be as likely
to move into the facet as off it, and could fall through. The raise adds 1e-24 of the kinetic energy.
"""

SETTLING = int(Mode.SETTLING)


@kernel
def stand(facets: Facets, state: State, held: PreviousContact, v: Vec) -> State:
    """Return the state of a rock at the start of sliding or rolling on the ground, with velocity v.

    The rock is moved exactly onto the plane of its facet, or onto the line of its gully.

    held : the facet that carries the rock, or both facets of its gully; v : (3,) m/s along the ground
    """
    x = on_plane(facets, held.facet, state.motion.x)
    if held.other >= 0:
        x = on_line(facets, held.facet, held.other, x)
    motion = Motion(t=state.motion.t, x=x, v=v, w=state.motion.w)
    tally = with_ground(state.tally, held.facet, norm(motion.v))
    return State(motion=motion, left=held, stands=True, tally=tally, outcome=state.outcome, passed=state.passed)


@kernel
def settle(physics: Physics, state: State, n: Vec, rock: RockContext, record: Record) -> State:
    """Return the state of a rock after an impact: the rock flies on, or it stays on the facet if its bounces are small.

    The rock flies on if gravity does not press it onto the facet, or if its bounces rise by smallest_bounce or more.
    Smaller bounces are summed up if all these conditions hold:

    - The sum of the bounces is known, and the bounces end before max_time.
    - The bounces stay on the facet, with no obstacle near them, and meet no other separate part of the terrain.

    If a condition fails, the rock flies on. There is one exception: if the bounces rise by less than SETTLED times
    smallest_bounce, they are left out, and the rock stays on the facet where it is. A rock that flies on gets a minimum
    speed away from the facet (`_kept_off`). If the ground properties are drawn for each impact, all remaining bounces
    use the properties of the next impact.

    n : (3,) normal of the facet of the impact, turned towards the rock
    record : receives the sum of the bounces as one path segment
    """
    facets, settings, f, motion = physics.facets, physics.settings, state.left.facet, state.motion
    g_n = settings.gravity * n[2]
    if g_n <= 0.0:
        return state
    rise2 = _rising2(physics, state, n, rock_at(rock, state))
    if not rise2 < 2.0 * g_n * settings.smallest_bounce:  # `checked` handles a rise that is NaN
        return _kept_off(state, n)
    surface = ground_of(physics, f, rock, state)
    rest = rest_of_bounces(physics.rebound, surface, motion, n, settings.gravity, rock_at(rock, state))
    way = add(rest.along, rest.down)
    x = add(motion.x, way)
    in_time = rest.ends and motion.t + rest.t <= settings.max_time
    clear = no_obstacle_near(physics.effects, motion.x, rest.along, rest.down, state.passed, rock_at(rock, state))
    stays = in_time and clear and _stays_on(facets, f, motion.x, rest.along, rest.down)
    if stays and contact_on_way(physics.pieces, facets, motion.x, way, state.left).t == math.inf:
        end = Motion(t=motion.t + rest.t, x=x, v=rest.v, w=motion.w)
        note_piece(record, state.tally, motion, rest.v, SETTLING)
        tally = with_piece(state.tally, norm(way), end, facets.tolerance)
        passed = still_at(physics.effects, end, state.passed, rock_at(rock, state))
        settled = State(motion=end, left=state.left, stands=True, tally=tally, outcome=MOVING, passed=passed)
        return stand(facets, settled, state.left, along(rest.v, n))
    if rise2 < 2.0 * g_n * settings.smallest_bounce * SETTLED:
        return stand(facets, state, state.left, along(motion.v, n))
    return _kept_off(state, n)


@kernel
def _kept_off(state: State, n: Vec) -> State:
    """Return the state of a rock that flies on after an impact, with at least a minimum speed away from the facet.

    The minimum is SKIMMING times the total speed; a lower speed away from the facet is raised to the minimum.

    n : (3,) normal of the facet, turned towards the rock
    """
    motion = state.motion
    off = dot(motion.v, n)
    if off > 0.0 and off * off > 4.0 * SKIMMING * SKIMMING * dot(motion.v, motion.v):
        return state  # surely above the minimum: nearly all rocks, without the square root of the next line
    missing = SKIMMING * norm(motion.v) - off
    if missing <= 0.0:
        return state
    raised = Motion(t=motion.t, x=motion.x, v=add(motion.v, scale(missing, n)), w=motion.w)
    return State(
        motion=raised, left=state.left, stands=state.stands, tally=state.tally, outcome=state.outcome,
        passed=state.passed,
    )  # fmt: skip


@kernel
def _rising2(physics: Physics, state: State, n: Vec, rock: RockContext) -> float:
    """Return the largest squared speed (m^2/s^2) with which a rock may rise from a facet in this or a later bounce.

    This speed decides whether the bounces are small. Usually the result is the speed off the facet. But if an effect
    changes the normal of the next impact, the result is the total speed, because such an impact may turn the whole
    speed upwards.

    n : (3,) normal of the facet, turned towards the rock
    """
    v = state.motion.v
    off = dot(v, n)
    down = Motion(t=state.motion.t, x=state.motion.x, v=subtract(v, scale(2.0 * off, n)), w=state.motion.w)
    felt = felt_normal(physics.effects, n, down, rock)
    as_a_plane = felt[0] == n[0] and felt[1] == n[1] and felt[2] == n[2]
    return off * off if as_a_plane else dot(v, v)


@kernel
def no_obstacle_near(effects: Any, x: Vec, along: Vec, down: Vec, passed: int, rock: RockContext) -> bool:
    """Return True if no obstacle lies on any side of the triangle that contains all remaining bounces of a rock.

    The corners of the triangle are x, x + along and x + along + down. The path leads from the first corner to the last:
    the speed and its losses act along the first side, gravity bends the path only towards the second side. An obstacle
    on the path crosses a side of the triangle, unless the whole obstacle is inside the triangle.

    x : (3,) m, start of the bounces
    along, down : (3,) m, total displacements of the bounces: due to the speed along the facet, and due to gravity
    passed : number of the obstacle that the rock has just passed, which does not count
    effects : parameters of all effects of the scene
    """
    return (
        _no_obstacle_on(effects, x, add(along, down), passed, rock)
        and _no_obstacle_on(effects, x, along, passed, rock)
        and _no_obstacle_on(effects, add(x, along), down, passed, rock)
    )


@kernel
def _no_obstacle_on(effects: Any, x: Vec, way: Vec, passed: int, rock: RockContext) -> bool:
    """Return True if no obstacle lies on the straight line from x (3,) m to x + way (3,) m.

    effects : parameters of all effects of the scene
    passed : number of the obstacle that the rock has just passed, which does not count
    """
    return first_obstacle(effects, Arc(x=x, v=way, gravity=0.0), passed, 1.0, rock).t == math.inf  # type: ignore[no-any-return]


@kernel
def _stays_on(facets: Facets, f: int, x: Vec, along: Vec, down: Vec) -> bool:
    """Return True if all remaining bounces of a rock stay within facet f, so that they can be summed up.

    x : (3,) m, start of the bounces
    along, down : (3,) m, total displacements of the bounces: due to the speed along the facet, and due to gravity

    Both displacements grow from bounce to bounce, so every bounce lies in the parallelogram that they span. A facet is
    convex, so it is enough that the corners of the parallelogram lie in the facet. Corner x lies in it already.
    """
    corners = (add(x, along), add(x, down), add(x, add(along, down)))
    inside = True
    for each in corners:
        inside = inside and contains(facets, f, each, False, facets.tolerance)
    return inside
