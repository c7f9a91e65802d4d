"""Make a slope above a road (an area of interest), answer sources on the slope, and decide on alerts."""

from itertools import count

import numpy as np

from live_sites.alert_evidence import NOW, S, evidence, site
from rpf3d_core.alerts.decide import decide
from rpf3d_core.live.answers import EnsembleSize, answers
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.live.triggers import trigger_of

LENGTH, WIDTH, DROP = 80, 160, 40.0
"""The slope of 45 degrees falls along x from 0 to 40 m, then the ground is level; it is 160 m wide along y."""

ROAD = np.array([[44.0, 2.0], [52.0, 2.0], [52.0, 158.0], [44.0, 158.0]])
"""Corners (x, y) m of the road at the toe; nearly every rock from the slope reaches the road."""

ON_THE_SLOPE = (10.0, 20.0, 31.0)
"""Place (x, y, z) m of a source 1 m above the slope."""

LIMITS = {"watch": {"reach_probability": 0.02}, "restrict": {"reach_probability": 0.1}}
WANTED = 500
"""Fewest rocks of each cluster of sources for a level below `fault` (`evidence.fewest_rocks`)."""


def slope():
    """Return the points (rows, columns, 3) m of the terrain, one metre apart."""
    y, x = np.mgrid[0 : WIDTH + 1, 0 : LENGTH + 1].astype(float)
    return np.stack([x, y, np.maximum(DROP - x, 0.0)], axis=-1)


def behind_a_bank(points):
    """Add a bank at the toe of the slope, 8 m high, to points (rows, columns, 3) m in place, and return the points.

    The bank protects the road for y > 60 m: rocks from the slope above stop at the bank.
    """
    x, y = points[..., 0], points[..., 1]
    points[..., 2] += np.where((y > 60.0) & (np.abs(x - 41.0) <= 1.0), 8.0, 0.0)
    return points


def road_site(**terms):
    """Return the thresholds of a site with the road as its area; terms : as in `alert_evidence.site`."""
    return site({"road": LIMITS}, fewest_rocks=WANTED, **terms)


def standing_over(points, **fields):
    """Return the prepared terrain of a survey with points in a grid, (rows, columns, 3) m.

    fields : further values of the live scene, by key path
    """
    scene = live_scene({"ground": "sliding", "target.most_rocks": 1000, **fields})
    return stand_on(Workshop().whole(GridSurvey(points)), scene)


def last_answer(standing, places, cluster=5.0, road=ROAD, rings=None):
    """Return the last stage of the answer to sources.

    standing : prepared terrain; places : (x, y, z) m of the sources; cluster : side of the squares of clusters (m)
    road : corners (P, 2) m of the area; rings : rings (P, 2) m of an area with several outlines, instead of `road`
    """
    at = np.array(places, dtype=float).reshape(-1, 3)
    trigger = trigger_of(at, np.zeros_like(at), None, NOW - S)
    size, spread = EnsembleSize(100, least=WANTED, cluster=cluster), ReleaseSpread(position=1.0, velocity=0.5)
    *_, answer = answers(standing, trigger, spread, {"road": rings or [road]}, size, lambda stage: False, count(1))
    return answer


def decided_on(answer, thresholds=None):
    """Return the alert that follows from one answer, without an earlier alert; thresholds : None for `road_site()`."""
    told = evidence(*answer.evidence, sources=answer.sources, unfinished=answer.unfinished)
    return decide(None, told, thresholds or road_site(), NOW)
