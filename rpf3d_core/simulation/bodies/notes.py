"""Write the path segments of a body, with its orientation, and its impacts, with energies, into the record."""

from rpf3d_core.body.quaternions import turned
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, kinetic_energy, rotational_energy
from rpf3d_core.simulation.record import BLOW, POSE, Record, note_impact, note_piece, note_piece_spins
from rpf3d_core.simulation.state import RockTally
from rpf3d_core.values import Motion, Vec


@kernel
def motion_of(motion: BodyMotion) -> Motion:
    """Return the motion of a body as a `Motion`, without orientation and with the spin in the terrain's axes."""
    return Motion(t=motion.t, x=motion.x, v=motion.v, w=turned(motion.q, motion.w))


@kernel
def note_segment(
    record: Record, tally: RockTally, body: Body, start: BodyMotion, end: BodyMotion, mode: int
) -> None:  # fmt: skip
    """Write the body's next path segment into the record if there is room.

    start, end : motion at both ends; mode : number of a `Mode`; tally : running totals, which select the record's row
    """
    i = record.first_piece + tally.pieces
    if i >= len(record.modes):
        return
    note_piece(record, tally, motion_of(start), end.v, mode)
    note_piece_spins(record, tally, turned(start.q, start.w), turned(end.q, end.w))
    row = record.pieces[i]
    row[POSE], row[POSE + 1], row[POSE + 2], row[POSE + 3] = start.q
    row[POSE + 4], row[POSE + 5], row[POSE + 6] = start.w
    row[POSE + 7] = rotational_energy(body, start)


@kernel
def note_blow(
    record: Record, tally: RockTally, body: Body, before: BodyMotion, after: BodyMotion, contact: tuple[int, int, Vec]
) -> None:  # fmt: skip
    """Write the body's next impact, or its next meeting with an obstacle, into the record if there is room.

    before, after : motion just before and just after; tally : running totals, which select the record's row
    contact : three values. The number of the facet that the body approached fastest, or `FIRST_OBSTACLE` minus the
        number of the obstacle; the number of contacts; the normal (3,) of this facet or obstacle, in the axes of the
        terrain
    """
    i = record.first_impact + tally.impacts + tally.meetings
    if i >= len(record.facets):
        return
    note_impact(record, tally, motion_of(before), motion_of(after), contact[0], contact[2])
    row = record.impacts[i]
    row[BLOW], row[BLOW + 1], row[BLOW + 2] = contact[1], kinetic_energy(body, before), kinetic_energy(body, after)
