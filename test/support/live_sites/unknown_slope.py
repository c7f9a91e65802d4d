"""Prepare the slope of `watched_road` with unknown coefficients, and answer sources on it with parameter sets."""

from itertools import count
from pathlib import Path

import numpy as np

from live_sites.alert_evidence import NOW, S
from live_sites.watched_road import WANTED, slope
from rpf3d_core.live.answers import Answer, EnsembleSize, answers
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import PreparedTerrain, stand_on
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.live.triggers import trigger_of

SETS = 40
SCENE = """\
terrain: {{pit: {{}}}}
sources: [{{name: sources, points: [[0, 0, 0]]}}]
materials:
  default: {{normal_restitution: {R_n}, tangential_restitution: 0.8, friction_angle_deg: 30}}
ground: sliding
target: {{most_rocks: 1000}}
engine: compiled
unknowns: {{sets: 40{misfit}}}
"""
RANGE = "{prior: {min: 0.2, max: 0.7}}"
FAR = np.array([[66.0, 2.0], [72.0, 2.0], [72.0, 158.0], [66.0, 158.0]])
"""Corners (x, y) m of a road that rocks reach only if the normal restitution is high."""


def standing_with(
    folder: Path, R_n: str = RANGE, misfit: str = "", points: np.ndarray | None = None
) -> PreparedTerrain:
    """Return the prepared terrain of the slope, for a live scene with unknowns, which is written to a folder.

    R_n : YAML of the normal restitution; misfit : YAML of further keys of `unknowns`, with a leading comma
    points : (rows, columns, 3) m of another terrain, None for the slope
    """
    path = folder / "live.yaml"
    path.write_text(SCENE.format(R_n=R_n, misfit=misfit))
    survey = GridSurvey(slope() if points is None else points)
    return stand_on(Workshop().whole(survey), live_scene({"scene": str(path)}))


def stages(
    standing: PreparedTerrain, places, cluster: float = 5.0, road: np.ndarray = FAR, least: int = WANTED
) -> list[Answer]:
    """Return all stages of the answer to sources, in order.

    standing : prepared terrain; places : (x, y, z) m of the sources; cluster : side of the squares of clusters (m)
    road : corners (P, 2) m of the area; least : fewest rocks of each cluster
    """
    at = np.array(places, dtype=float).reshape(-1, 3)
    trigger = trigger_of(at, np.zeros_like(at), None, NOW - S)
    size, spread = EnsembleSize(100, least=least, cluster=cluster), ReleaseSpread(position=1.0, velocity=0.5)
    return list(answers(standing, trigger, spread, {"road": [road]}, size, lambda stage: False, count(1)))
