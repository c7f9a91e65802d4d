"""Measure the rounding error of exact contacts: compute the impacts of some rocks again with 50 digits.

The sequence of facets is taken from the recorded flight, so only places and times are compared. Rounding can select a
wrong facet only if this facet is nearer to the exact impact than the error of place. So the errors of place also show
whether a wrong facet is possible. Python's decimal numbers are enough, because an impact needs only basic arithmetic
and one square root.
"""

from collections.abc import Callable, Sequence
from decimal import Decimal, localcontext
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.kinetics.rebound import ConstantRestitution
from rpf3d_core.kinetics.rebounds.coulomb_limited import CoulombLimited
from rpf3d_core.materials.library import Surface, surface_of
from rpf3d_core.materials.rock_context import RockContext, RockKey
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Mode

DIGITS = 50
ROCKS = 50
"""Number of rocks whose impacts are computed again with 50 digits."""

Point = tuple[Decimal, Decimal, Decimal]
Rebound = Callable[[Surface, Point, Point], Point]
"""A function that returns the velocity after an impact from three values.

The values are the ground, the velocity before the impact, and a normal of any length.
"""


class Struck(NamedTuple):
    """An impact computed with 50 digits: time t (s), place x (m), and velocity v (m/s) after the impact."""

    t: Decimal
    x: Point
    v: Point


class RecordedImpact(NamedTuple):
    """A recorded impact that is computed again with 50 digits: its facet, its ground and its time t (s).

    The ground includes the random values that were drawn for this impact.
    """

    facet: int
    surface: Surface
    t: float


class ImpactErrors(NamedTuple):
    """Rounding errors of recorded impacts, found with 50 digits: median and largest error of place (m) and time (s).

    impacts : number of compared impacts
    """

    impacts: int
    place_median: float
    place_max: float
    time_median: float
    time_max: float


def off_exact(prepared: Prepared, flights: Flights, rocks: int = ROCKS) -> list[ImpactErrors]:
    """Return the rounding errors of the impacts of some rocks, as a list in the order of the impacts.

    The first item is for the first impacts of all these rocks, the second item for their second impacts, and so on.
    The list is empty if the impacts cannot be computed again: if the scene has effects, or a rebound model other than
    constant restitution and `coulomb_limited` (`FOLLOWED`).

    flights : flights of the rocks, with all impacts and paths; rocks : number of rocks to compute again
    """
    models = prepared.flight.models
    if type(models.rebound) not in FOLLOWED or models.effects is not None:
        return []
    rows = np.unique(np.linspace(0, len(flights.deposits.rock) - 1, rocks).astype(int))
    gaps = [gap for row in rows for gap in _gaps(prepared, flights, int(row))]
    numbers = sorted({number for number, _, _ in gaps})
    return [_off([(place, time) for its, place, time in gaps if its == number]) for number in numbers]


def impact_errors(impacts: int, place: Sequence[float], time: Sequence[float]) -> ImpactErrors:
    """Return `ImpactErrors` from the medians and the largest values of errors, for example from cost.json.

    impacts : number of impacts; place, time : (2,) median and largest error of place (m) and of time (s)
    """
    (place_median, place_max), (time_median, time_max) = place, time
    return ImpactErrors(
        impacts=impacts,
        place_median=place_median,
        place_max=place_max,
        time_median=time_median,
        time_max=time_max,
    )


def _off(gaps: list[tuple[float, float]]) -> ImpactErrors:
    """Return the median and largest rounding error, from the place error (m) and time error (s) of each impact."""
    place, time = ((float(np.median(some)), float(max(some))) for some in zip(*gaps, strict=True))
    return impact_errors(len(gaps), place, time)


def _gaps(prepared: Prepared, flights: Flights, row: int) -> list[tuple[int, float, float]]:
    """Return number (from 0), place error (m) and time error (s) of each impact of a rock.

    The errors are the differences from the impacts computed with 50 digits. The list ends when the rock first slides,
    settles or hits an obstacle.

    row : row of the rock in `Deposits`
    """
    struck = np.flatnonzero(flights.impacts.row == row)
    modes = flights.paths.mode[flights.paths.row == row]
    alone = int(np.argmax(modes != Mode.FLIGHT))  # until the rock leaves free flight; the last row is END
    facets = [int(f) for f in takewhile(lambda f: f >= 0, flights.impacts.facet[struck[:alone]])]
    start = np.flatnonzero(flights.paths.row == row)[0]
    x, v = flights.paths.x[start].tolist(), flights.paths.v[start].tolist()
    surfaces, times = _surfaces(prepared, flights, row, facets), flights.impacts.t[struck].tolist()
    recorded = [
        RecordedImpact(facet=f, surface=surface, t=t)
        for f, surface, t in zip(facets, surfaces, times, strict=False)
    ]  # fmt: skip
    gravity, rebound = prepared.flight.settings.gravity, FOLLOWED[type(prepared.flight.models.rebound)]
    exact = impacts_in_digits(prepared.engine.facets, recorded, gravity, x, v, rebound)
    places = flights.impacts.x[struck].tolist()
    return [
        (number, *_gap(impact, place, time))
        for number, (impact, place, time) in enumerate(zip(exact, places, times, strict=False))
    ]


def _gap(impact: Struck, place: Sequence[float], time: float) -> tuple[float, float]:
    """Return the place error (m) and the time error (s) of a recorded impact, compared with the exact impact.

    The differences are rounded to floats only at the end.

    impact : the exact impact, with 50 digits; place, time : of the recorded impact, (3,) m and s
    """
    with localcontext(prec=DIGITS):
        gap = _minus(impact.x, _decimals(place))
        return float(_dot(gap, gap).sqrt()), abs(float(impact.t - Decimal(time)))


def _surfaces(prepared: Prepared, flights: Flights, row: int, facets: Sequence[int]) -> list[Surface]:
    """Return the ground at each impact of a rock, with the random values drawn for this impact.

    row : row of the rock in `Deposits`; facets : facet of each impact, in order of time
    """
    materials: Any = prepared.flight.materials
    source, rock = int(flights.deposits.source[row]), int(flights.deposits.rock[row])
    key = RockKey(seed=prepared.flight.settings.seed, source=source, rock=rock)
    zone = prepared.engine.facets.zone
    return [
        surface_of(materials, int(zone[f]), RockContext(rock=None, key=key, impacts=number))
        for number, f in enumerate(facets)
    ]


def impacts_in_digits(
    facets: Facets, recorded: Sequence[RecordedImpact], gravity: float, x: Sequence[float], v: Sequence[float],
    rebound: Rebound | None = None,
) -> list[Struck]:  # fmt: skip
    """Return the impacts of a rock, computed with DIGITS (50) digits on the facets that its recorded impacts name.

    Input numbers are used as stored: a coefficient of 0.1 is the nearest float.

    recorded : the recorded impacts; each time selects one of the two roots of a parabola
    gravity : m/s^2; x, v : (3,) m and m/s, start of the rock
    rebound : function for the velocity after an impact; None for constant restitution
    """
    bounce = constant if rebound is None else rebound
    with localcontext(prec=DIGITS):
        found, last, g = [], Struck(t=Decimal(0), x=_decimals(x), v=_decimals(v)), Decimal(gravity)
        for impact in recorded:
            corners = np.asarray(facets.corners)[impact.facet].reshape(3, 3).tolist()
            flown = _flown_onto(last, corners, g, Decimal(impact.t))
            last = flown.struck._replace(v=bounce(impact.surface, flown.struck.v, flown.n))
            found.append(last)
    return found


class Landed(NamedTuple):
    """A rock on a facet just before the rebound.

    struck : time, place and velocity of arrival; n : a normal of the facet, of any length and to either side
    """

    struck: Struck
    n: Point


def _flown_onto(last: Struck, corners: Sequence[Sequence[float]], g: Decimal, recorded: Decimal) -> Landed:
    """Return the rock at its next impact, just before the rebound.

    last : the rock after its previous impact; corners : (3, 3) m, of the facet of the next impact
    g : m/s^2, gravity; recorded : s, recorded time of the next impact, which selects one of the two roots
    """
    a, b, c = (_decimals(corner) for corner in corners)
    n, at, v = _cross(_minus(b, a), _minus(c, a)), last.x, last.v
    fall = _root(-g * n[2] / 2, _dot(n, v), _dot(n, _minus(at, a)), recorded - last.t)
    x = at[0] + v[0] * fall, at[1] + v[1] * fall, at[2] + (v[2] - g * fall / 2) * fall
    return Landed(Struck(t=last.t + fall, x=x, v=(v[0], v[1], v[2] - g * fall)), n)


def _root(a: Decimal, b: Decimal, c: Decimal, near: Decimal) -> Decimal:
    """Return the time (s) at which a t^2 + b t + c is 0: of the two roots, the root nearer to the time `near` (s)."""
    if a == 0:
        return -c / b
    root = max(b * b - 4 * a * c, Decimal(0)).sqrt()
    return min(((-b - root) / (2 * a), (-b + root) / (2 * a)), key=lambda t: abs(t - near))


def constant(surface: Surface, v: Point, n: Point) -> Point:
    """Return the velocity after an impact with constant restitution, with DIGITS digits.

    The model is that of `kinetics.rebound.constant_restitution`: equations 3-1 to 3-3 of the thesis as vectors.

    surface : ground at the impact; v : m/s, velocity before the impact; n : normal of the facet, of any length
    """
    return _lumped(surface, v, n, Decimal(float(surface.R_t)))


def coulomb_limited(surface: Surface, v: Point, n: Point) -> Point:
    """Return the velocity after an impact in which friction limits the loss of speed along the ground (DIGITS digits).

    The model is that of `kinetics.rebounds.coulomb_limited`.

    surface, v, n : as in `constant`
    """
    R_n, R_t, mu = (Decimal(float(value)) for value in (surface.R_n, surface.R_t, surface.mu))
    into2 = _dot(v, n) ** 2 / _dot(n, n)
    speed = max(_dot(v, v) - into2, Decimal(0)).sqrt()
    kept = max(R_t * speed, speed - mu * (1 + R_n) * into2.sqrt())
    return _lumped(surface, v, n, kept / speed if speed > 0 else R_t)


def _lumped(surface: Surface, v: Point, n: Point, kept: Decimal) -> Point:
    """Return the velocity after an impact of a lumped mass; surface, v, n : as in `constant`.

    kept : speed along the ground after the impact, as a share of the speed along the ground before the impact (-)
    """
    into, R_n = _dot(v, n) / _dot(n, n), Decimal(float(surface.R_n))
    x, y, z = (kept * (a - into * b) - R_n * into * b for a, b in zip(v, n, strict=True))
    return x, y, z


FOLLOWED: dict[type, Rebound] = {ConstantRestitution: constant, CoulombLimited: coulomb_limited}
"""Rebound models that can be computed with DIGITS digits, each with its function; others are not compared."""


def _decimals(values: Sequence[float]) -> Point:
    x, y, z = (Decimal(value) for value in values)
    return x, y, z


def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Point, b: Point) -> Decimal:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
