"""Follow a path over the cells of a map; the times at the borders of cells are exact."""

from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.tracks import Track, leaving_time, next_square, pace_of, square_at, time_at, top_speed2
from rpf3d_core.hazard.walks.visits import Visits, note_stay, note_track_energy, visit
from rpf3d_core.hazard.walks.ways import note_length, square_of
from rpf3d_core.jit.dispatch import kernel


@kernel
def walk_raster(raster: Raster, visits: Visits, track: Track, mass: float) -> None:
    """Record a visit to every map cell that a track crosses, but not to a cell touched only at a corner.

    By rounding, a track that starts on the border of two cells may count as starting in the wrong cell. The computed
    time at which the track leaves this cell may then be long before the start of the track. In this case, the visit
    ends when it begins.

    mass : of the rock (kg)
    """
    x, v = track.arc.x, track.arc.v
    i = square_at(x[0], raster.x, raster.cell, raster.nx)
    j = square_at(x[1], raster.y, raster.cell, raster.ny)
    begin, pace_x, pace_y, here = 0.0, pace_of(v[0]), pace_of(v[1]), True
    while True:
        leave_i = leaving_time(i, raster.nx, raster.x, raster.cell, x[0], pace_x)
        leave_j = leaving_time(j, raster.ny, raster.y, raster.cell, x[1], pace_y)
        leave = max(begin, min(leave_i, leave_j, track.duration))
        if leave > begin or here:
            t = time_at(track, begin)
            k = visit(visits, j * raster.nx + i, t, mass)
            note_stay(visits, k, t, time_at(track, leave), top_speed2(track, begin, leave))
            note_track_energy(visits.energy2, k, track, begin, leave)
            note_length(visits.way, k, square_of(raster, i, j), track, begin, leave)
        if leave >= track.duration:
            return
        begin, here = leave, False
        i, j = next_square(i, j, leave_i, leave_j, v)
