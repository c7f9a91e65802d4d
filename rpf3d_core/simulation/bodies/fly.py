"""Fly all bodies with a shape of an ensemble, one after another; both engines use this module."""

import math
from typing import Any

import numpy as np

from rpf3d_core.body.clearance import set_arms
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.materials.rock_context import RockContext, key_of, rock_of
from rpf3d_core.simulation.bodies.follow import follow_body
from rpf3d_core.simulation.bodies.motion import BodyMotion, body_of
from rpf3d_core.simulation.bodies.release import lifted
from rpf3d_core.simulation.bodies.ride import NO_ROOM
from rpf3d_core.simulation.bodies.room import FEWEST_FACETS, BodyRoom, room_for
from rpf3d_core.simulation.launches import Launches
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import Logbook, close_rock, record_from
from rpf3d_core.values import ZERO

LARGEST_ROOM = 1 << 22
"""Largest number of facets near a body for which working memory is allocated."""


def follow_in_room(
    follow: Any, physics: Physics, locator: Any, launches: Launches, logbook: Logbook, begin: int
) -> int:  # fmt: skip
    """Fly bodies `begin` to R - 1 and write their flights into the logbook.

    The flights end at the first body whose path does not fit into the record; its number is returned. If all paths fit,
    R is returned. If the facets near a body do not fit into the working memory, the body flies again with larger
    memory.

    follow : the loop to call, `follow_each` or its plain Python form
    launches : the R bodies at their release; begin : number of the first body to fly

    Raises
    ------
    MemoryError
        More than LARGEST_ROOM facets lie near one body.
    """
    facets, corners = FEWEST_FACETS, int(np.diff(physics.rebound.shapes.first).max())
    while True:
        begin, fits = follow(physics, locator, launches, logbook, begin, room_for(facets, corners))
        if fits:
            return int(begin)
        facets *= 4
        if facets > LARGEST_ROOM:
            raise MemoryError(f"more than {LARGEST_ROOM} facets lie near one rock: the mesh is too fine for its size")


@loop
def follow_each(
    physics: Physics, locator: Any, launches: Launches, logbook: Logbook, begin: int, room: BodyRoom
) -> tuple[int, bool]:  # fmt: skip
    """Fly bodies from number `begin` on; return the number of the body that ended the loop, and a flag.

    The loop ends at the first body whose path does not fit into the record (flag True) or whose nearby facets do not
    fit into the working memory `room` (flag False). If all bodies have flown, the loop returns their total number
    and True.
    """
    x, v, finals, counts = launches.x, launches.v, logbook.finals, logbook.counts
    for i in range(begin, len(finals)):
        rock = RockContext(rock=rock_of(launches.sizes, i), key=key_of(launches.keys, i), impacts=0)
        radius = rock.rock.radius  # type: ignore[union-attr]  # asks_rock: the rock is never None
        body = body_of(physics.rebound, launches.shape[i], radius)
        set_arms(room.arms, body.shapes.corners, body.first, body.last, body.size)
        pose = launches.pose[i]
        motion = BodyMotion(
            t=0.0,
            x=(x[i][0], x[i][1], x[i][2]),
            v=(v[i][0], v[i][1], v[i][2]),
            q=(pose[0], pose[1], pose[2], pose[3]),
            w=ZERO,
        )
        written = record_from(logbook.record, logbook.first, i)
        released = lifted(body, room, locator, physics.facets, motion)
        end = follow_body(body, room, locator, physics, released, rock, written)
        if end.outcome == NO_ROOM:
            return i, False
        if not close_rock(logbook.record, end.tally, logbook.first, i):
            return i, True
        tally, at = end.tally, end.motion.x
        finals[i, 0], finals[i, 1], finals[i, 2], finals[i, 3] = end.motion.t, at[0], at[1], at[2]
        finals[i, 4], finals[i, 5] = tally.path, math.sqrt(tally.speed2)
        finals[i, 6], finals[i, 7] = math.nan, tally.ground_speed
        finals[i, 10], finals[i, 11], finals[i, 12], finals[i, 13] = end.motion.q
        finals[i, 14] = released.motion.x[2] - x[i][2]
        counts[i, 0], counts[i, 1] = end.outcome, tally.facet
        counts[i, 2], counts[i, 3] = tally.impacts, tally.pieces
        counts[i, 4] = end.why
    return len(finals), True
