"""Draw the changes that defects make to a message; a change is a function from a `Send` to the changed `Send`."""

from collections.abc import Callable

import numpy as np
from never_green.messages import dense, truncated, with_nan
from never_green.plan import Send

Change = Callable[[Send], Send]
AXES = np.array([[-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]])
UNITS = (0.3048, 1.0 / 0.3048, 1000.0, 0.001, 0.01)
"""Factors of coordinates in a wrong unit: metres in a foot, feet in a metre, millimetres in a metre, kilometres in a
metre, and metres in a centimetre."""

NO_DATA = -9999.0
"""Height (m) that means "no data" in many grid files."""


def framed(rng: np.random.Generator) -> Change:
    """Return a change to a frame that the node does not know."""
    frame = str(rng.choice(("", "radar", "utm", "Map", "odom")))
    return lambda send: send._replace(frame=frame)


def scaled(rng: np.random.Generator) -> Change:
    """Return a change of all coordinates to another unit."""
    unit = float(rng.choice(UNITS))
    return lambda send: send._replace(places=send.places * unit)


def heights_scaled(rng: np.random.Generator) -> Change:
    """Return a change of the heights to another unit."""
    unit = np.array([1.0, 1.0, float(rng.choice(UNITS))])
    return lambda send: send._replace(places=send.places * unit)


def mirrored(rng: np.random.Generator) -> Change:
    """Return a change of the sign of one coordinate, or of x and y."""
    signs = AXES[rng.integers(len(AXES))]
    return lambda send: send._replace(places=send.places * signs[: send.places.shape[-1]])


def mirrored_heights(rng: np.random.Generator) -> Change:
    """Return a change that mirrors the heights of a survey about 510 m, within the pit, so that the road is high."""
    return lambda send: send._replace(places=send.places * AXES[2] + (0.0, 0.0, 1020.0))


def exchanged(rng: np.random.Generator) -> Change:
    """Return a change that exchanges x and y."""
    return lambda send: send._replace(places=send.places[..., [1, 0, 2][: send.places.shape[-1]]])


def upside_down(rng: np.random.Generator) -> Change:
    """Return a change of the sign of the heights."""
    return lambda send: send._replace(places=send.places * AXES[2])


def late(rng: np.random.Generator) -> Change:
    """Return a change to an older stamp; in half of all cases, the message also arrives later by the same amount."""
    by, waits = float(rng.uniform(6.0, 40.0)), rng.random() < 0.5
    return lambda send: send._replace(offset=-by, at=send.at + (by if waits else 0.0))


def stamped_late(rng: np.random.Generator) -> Change:
    """Return a change to an older stamp; the message arrives at the same time."""
    by = float(rng.uniform(1.0, 40.0))
    return lambda send: send._replace(offset=-by)


def early(rng: np.random.Generator) -> Change:
    """Return a change to a stamp in the future."""
    by = float(rng.choice((rng.uniform(0.7, 9.0), rng.uniform(10.5, 1e4))))
    return lambda send: send._replace(offset=by)


def not_finite(rng: np.random.Generator) -> Change:
    """Return a change that makes one place NaN, or adds a NaN if there are no places; a cloud is marked as dense."""
    row = int(rng.integers(100))

    def change(send: Send) -> Send:
        if not len(send.places):
            return send._replace(places=np.full((1, 3), np.nan), damage=dense if send.kind == "cloud" else None)
        damage = dense if send.kind in ("cloud", "grid", "patch") else None
        return send._replace(places=with_nan(send.places, row), damage=damage)

    return change


def all_nan(rng: np.random.Generator) -> Change:
    """Return a change that makes all places NaN."""
    return lambda send: send._replace(places=np.full((max(len(send.places), 4), 3), np.nan))


def damaged(rng: np.random.Generator) -> Change:
    """Return a change that damages the finished message (`truncated`), unless the message has no places."""
    return lambda send: send._replace(damage=truncated if len(send.places) else None)


def two_corners(rng: np.random.Generator) -> Change:
    """Return a change that leaves only the first two corners of an outline."""
    return lambda send: send._replace(places=send.places[:2])


def strip(rng: np.random.Generator) -> Change:
    """Return a change that removes two columns of points of a survey, on the slope above the road."""
    column = int(rng.integers(10, 20))

    def change(send: Send) -> Send:
        places = send.places.copy()
        places[:, column : column + 2] = np.nan
        return send._replace(places=places)

    return change


def no_data(rng: np.random.Generator) -> Change:
    """Return a change of two columns of a survey, on the slope above the road, to the height NO_DATA."""
    holes = strip(rng)

    def change(send: Send) -> Send:
        places = send.places.copy()
        places[..., 2] = np.where(np.isnan(holes(send).places[..., 2]), NO_DATA, places[..., 2])
        return send._replace(places=places)

    return change


def folded(rng: np.random.Generator) -> Change:
    """Return a change that appends a second scan to a survey, which begins some columns before the first ends.

    The second scan is higher by 0.5 to 3 m, because facets that are copies of others do no harm.
    """
    begin, end = sorted(rng.choice(np.arange(8, 20), 2, replace=False).tolist())
    higher = np.array([0.0, 0.0, rng.uniform(0.5, 3.0)])

    def change(send: Send) -> Send:
        first, second = send.places[:, : end + 3], send.places[:, begin:] + higher
        return send._replace(places=np.concatenate([first, second], axis=1))

    return change


def cut(rng: np.random.Generator) -> Change:
    """Return a change that cuts a survey off at a random column, before the road."""
    columns = int(rng.integers(8, 22))
    return lambda send: send._replace(places=send.places[:, :columns])
