"""Barriers and trees in a recording: what stands in the rocks' way has to be seen with their paths."""

from typing import Any

from rpf3d_core.terrain.obstacles import Obstacles

BARRIER_COLOUR, TREE_COLOUR = (30, 60, 200), (30, 120, 50)
BARRIER_PIXELS, TREE_PIXELS = 1.5, 2.0
"""Radii on the screen: a stem of half a metre cannot be seen in a pit of 1 km. rerun reads negative radii so."""


def log_obstacles(recording: Any, obstacles: Obstacles) -> None:
    """Barriers as lines along their feet with their names, `world/barriers`; trees at their feet, `world/trees`.

    What a scene does not have is not logged.
    """
    import rerun as rr

    if obstacles.lines:
        names, lines = zip(*obstacles.lines, strict=True)
        strips = rr.LineStrips3D(lines, colors=[BARRIER_COLOUR], radii=[-BARRIER_PIXELS], labels=names)
        recording.log("world/barriers", strips, static=True)
    if len(obstacles.stems):
        feet = rr.Points3D(obstacles.stems[:, :3], colors=[TREE_COLOUR], radii=[-TREE_PIXELS])
        recording.log("world/trees", feet, static=True)
