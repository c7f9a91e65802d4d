"""Check that a gully does not stop a rock that would bounce out of it.

The check shares no code with the simulation. It examines rocks that lose velocity between a flight and a slide without
a recorded impact. If such a rock came down one facet and met another, the check computes its further bounces between
the two facets in NumPy, until the rock leaves both facets. Each bounce is a reflection with the ground's R_n and
without a loss along the facets. After the last bounce, the rock must not rise by more than a slight bounce.
"""

import numpy as np

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import Mode

ON = 1e-6
"""Limit below which values count as zero: distances from a facet (m), speeds into a facet as a share of the rock's."""
MOST = 32
"""Largest number of bounces between two facets that the check computes."""
RISE = 2.0
"""Ratio of a rock's rise to `smallest_bounce` above which the rock was held too early.

The ratio is above 1, because the simulation measures the height of a bounce along a facet.
"""


def held_too_early(facets: np.ndarray, flights: Flights, settings: Settings, R_n: float) -> np.ndarray:
    """Return the rows of the rocks that a gully between two of facets (F, 3, 3) m held too early.

    R_n : normal restitution (-) of all facets
    """
    paths, n = flights.paths, _normals(facets)
    noted = set(zip(flights.impacts.row.tolist(), flights.impacts.t.tolist(), strict=True))
    lands = np.flatnonzero((paths.mode[:-1] == Mode.FLIGHT) & (paths.mode[1:] == Mode.SLIDING))
    lost = paths.v[lands + 1] - paths.v_end[lands]
    rows = set()
    for k in lands[(lost**2).sum(1) > 2.0 * settings.gravity * settings.smallest_bounce].tolist():
        row = int(paths.row[k])
        if row in rows or (row, float(paths.t[k + 1])) in noted:
            continue
        near = n[_are_near(facets, n, paths.x[k + 1])]
        if _rises(near, paths.v_end[k], paths.v[k + 1], settings, R_n):
            rows.add(row)
    return np.array(sorted(rows), dtype=np.int64)


def _rises(near: np.ndarray, v: np.ndarray, kept: np.ndarray, settings: Settings, R_n: float) -> bool:
    """Return True if facets hold a rock in pairs, although it would bounce out of each of these pairs.

    near : (N, 3) unit normals of the facets at the place of the rock
    v, kept : (3,) m/s, velocities of the rock before and after the gully holds it
    """
    zero, least2 = ON * (1.0 + np.linalg.norm(v)), 2.0 * settings.gravity * settings.smallest_bounce
    rises = []
    for i, n in enumerate(near):
        into = min(v @ n, 0.0)
        slight = into * into < least2 * max(n[2], 0.0)
        if slight and np.linalg.norm(kept - v + into * n) < zero:
            return False  # a slight kink: only the speed into one facet is lost
        for m in near[:i]:
            for met, slid in ((n, m), (m, n)):
                between = np.linalg.norm(np.cross(n, m)) > 1e-4 and max(abs(kept @ n), abs(kept @ m)) < zero
                if between and abs(v @ slid) < zero and v @ met < -zero:
                    light = (v @ met) ** 2 < least2 * max(met[2], 0.0)
                    up = _thrown(v - _along_line(v, met, slid), met, slid, R_n)[2]
                    rises.append(0.0 if light else max(up, 0.0) ** 2 / least2)
    return bool(rises) and min(rises) > RISE


def _along_line(v: np.ndarray, n: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Return the component (3,) of a velocity v (3,) along the common line of two facets; n, m : (3,) unit normals."""
    line = np.cross(n, m)
    return np.asarray((v @ line) / (line @ line) * line)


def _thrown(v: np.ndarray, met: np.ndarray, slid: np.ndarray, R_n: float) -> np.ndarray:
    """Return the velocity (3,) m/s with which a rock bounces out from between two facets; 0 after MOST bounces.

    v : (3,) m/s, velocity before the first bounce; met, slid : (3,) unit normals of the facets
    """
    for _ in range(MOST):
        n = min((met, slid), key=lambda each: float(v @ each))
        if v @ n >= -1e-12:
            return v
        v = v - (1.0 + R_n) * (v @ n) * n
    return np.zeros(3)


def _normals(facets: np.ndarray) -> np.ndarray:
    n = np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])
    return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])


def _are_near(facets: np.ndarray, n: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return flags (F,), True for the facets within ON of a place x (3,) m; n : (F, 3) unit normals of the facets."""
    near = np.abs(((x - facets[:, 0]) * n).sum(1)) <= ON
    for k in range(3):
        edge = facets[:, (k + 1) % 3] - facets[:, k]
        inward = np.cross(n, edge) / np.linalg.norm(edge, axis=1)[:, None]
        near &= ((x - facets[:, k]) * inward).sum(1) >= -ON
    return near
