"""Define the colours of zones, outcomes and speeds for all pictures and recordings.

Colours are sRGB, 0 to 255. Zones are muted so that paths stand out against the terrain.
"""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rpf3d_core.values import Outcome

Colours = NDArray[np.uint8]

GROUND_COLOURS = np.array(
    [
        (201, 184, 150), (150, 158, 150), (176, 141, 120), (192, 190, 184), (196, 178, 106),
        (157, 132, 104), (160, 170, 130), (190, 150, 150), (136, 163, 160), (170, 150, 175),
    ],
    dtype=np.uint8,
)  # fmt: skip
"""sRGB colours of groups of zones, in order of first appearance: sand, stone, clay, dust, ochre and others.

No colour looks like water.
"""

ALTERNATE = 0.86
"""Factor (-) on the brightness of every second zone of a group, so that neighbouring benches differ."""

OUTCOME_COLOURS: dict[Outcome, tuple[int, int, int]] = {
    Outcome.STOPPED: (200, 30, 30),
    Outcome.LEFT_TERRAIN: (30, 90, 200),
    Outcome.CAUGHT: (20, 130, 60),
    Outcome.FRAGMENTED: (230, 130, 20),
    Outcome.MAX_TIME: (120, 120, 120),
    Outcome.MAX_IMPACTS: (60, 60, 60),
    Outcome.UNRESOLVED_CONTACT: (140, 40, 160),
    Outcome.FAILED: (255, 0, 255),
    Outcome.LOST_TO_HOLE: (0, 190, 190),
    Outcome.FELL_THROUGH: (150, 0, 60),
}
"""The sRGB colour of each outcome in pictures."""

SPEED_COLOURS = np.array(
    [(44, 90, 182), (0, 166, 202), (120, 205, 120), (249, 208, 87), (242, 140, 46), (200, 20, 28)], dtype=float
)
"""Colours of evenly spaced speeds in pictures, from zero (blue) to the fastest (red)."""


def zone_groups(zones: Sequence[str]) -> tuple[list[str], NDArray[np.int64]]:
    """Return the names of the groups of Z zones, and the number (Z,) of each zone's group.

    Zones whose names differ only by a trailing number form a group.

    Examples
    --------
    >>> zone_groups(["bench_1", "face", "bench_2"])
    (['bench', 'face'], array([0, 1, 0]))
    """
    stems = [re.sub(r"[_\- ]?\d+$", "", zone) or zone for zone in zones]
    groups = list(dict.fromkeys(stems))
    return groups, np.array([groups.index(stem) for stem in stems], dtype=np.int64)


def zone_colours(zones: Sequence[str]) -> Colours:
    """Return the colours (Z, 3) of Z zones: one hue for each group of zones; every second zone of a group is darker."""
    _, group = zone_groups(zones)
    place = np.array([np.count_nonzero(group[:i] == group[i]) for i in range(len(group))], dtype=np.int64)
    brightness = np.where(place % 2 == 0, 1.0, ALTERNATE)[:, None]
    return (GROUND_COLOURS[group % len(GROUND_COLOURS)] * brightness).astype(np.uint8)


def speed_colours(speed: ArrayLike, fastest: float) -> Colours:
    """Return the colours (N, 3) of speeds (N,) from 0 to `fastest`, both m/s, for drawn paths."""
    at = np.clip(np.asarray(speed, dtype=float) / max(fastest, np.finfo(float).tiny), 0.0, 1.0)
    stops = np.linspace(0.0, 1.0, len(SPEED_COLOURS))
    return np.stack([np.interp(at, stops, channel) for channel in SPEED_COLOURS.T], axis=-1).astype(np.uint8)
