"""Tests of a track on the border of two map cells: rounding must not give a cell a speed or a time of its own."""

import math

import numpy as np
import pytest

from rpf3d_core.arc import Arc
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.raster import walk_raster
from rpf3d_core.hazard.walks.tracks import Track
from rpf3d_core.hazard.walks.visits import SPEED2, USED, empty_visits

RASTER = Raster(x=-6.0, y=-6.0, cell=0.5, nx=24, ny=24)


def walked(x, v, duration):
    """Return the visits of a rock to map cells during one flight. x : m; v : m/s; duration : s"""
    speed = math.sqrt(sum(c * c for c in v))
    track = Track(arc=Arc(x=x, v=v, gravity=9.81), begin=4.0, until=4.0 + duration, duration=duration, start=speed,
                  end=speed, spin=None)  # fmt: skip
    visits = empty_visits(RASTER.nx * RASTER.ny, 32, ways=True, spins=True)
    walk_raster(RASTER, visits, track, 1000.0)
    return visits, slice(0, int(visits.state[USED]))


@pytest.mark.parametrize("duration", [0.0, 1e-14, 1e-3, 1.0])
def test_a_flight_that_starts_on_a_border_to_within_rounding_gives_no_cell_another_speed(duration):
    """The rock counts to the cell north of y = 0, which it would have left 10 s before it starts."""
    x, v = (1.2, -1.8447438039337938e-17, 0.25), (0.0104, -1.734723475976807e-18, -0.0065)
    visits, used = walked(x, v, duration)
    most = max(v[0] ** 2 + v[1] ** 2 + (v[2] - 9.81 * t) ** 2 for t in (0.0, duration))
    assert (visits.most[used, SPEED2] <= most * (1.0 + 1e-12)).all()
    assert (visits.energy2[used] <= most * (1.0 + 1e-12)).all()
    assert (visits.way[used] >= 0.0).all() and visits.way[used].sum() == pytest.approx(0.0208 * duration, rel=1e-9)


def test_no_visit_of_a_flight_near_borders_ends_before_it_begins_or_is_faster_than_the_rock():
    draws = np.random.default_rng(20261128)
    for _ in range(300):
        off, v = draws.choice([-1.0, 0.0, 1.0], (2, 3)) * 10.0 ** draws.uniform((-18, -18), (-9, 1), (3, 2)).T
        x, v = tuple((draws.integers(-11, 11, 3) * 0.5 + off).tolist()), tuple(v.tolist())
        duration = 10.0 ** draws.uniform(-15, 0)
        visits, used = walked(x, v, duration)
        most = max(sum(c * c for c in v[:2]) + (v[2] - 9.81 * t) ** 2 for t in (0.0, duration))
        assert (visits.most[used, SPEED2] <= most * (1.0 + 1e-12) + 1e-300).all()
        assert (visits.times[used, 0] <= visits.times[used, 1]).all() and (visits.way[used] >= 0.0).all()
