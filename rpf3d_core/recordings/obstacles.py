"""Write the obstacles of a scene (barriers and trees) to a recording."""

from typing import Any

from rpf3d_core.terrain.obstacles import Obstacles

BARRIER_COLOUR, TREE_COLOUR = (30, 60, 200), (30, 120, 50)
PANEL_COLOUR = (30, 60, 200, 150)
"""Colour of the panels of barriers: red, green, blue and opacity, 0 to 255."""
BARRIER_PIXELS, TREE_PIXELS = 1.5, 2.0
"""Radii of the lines of barriers and of trees in the viewer, in pixels.

In metres, a stem could not be seen in a pit of 1 km. rerun interprets negative radii as pixels on the screen.
"""


def log_obstacles(recording: Any, obstacles: Obstacles) -> None:
    """Write barriers and trees to a recording; nothing is written for a kind of obstacle that the scene does not have.

    Barriers are named lines on the ground, `world/barriers`, with their panels as walls, `world/barriers/panels`. Trees
    are points, `world/trees`.
    """
    import rerun as rr

    if obstacles.lines:
        names, lines = zip(*obstacles.lines, strict=True)
        strips = rr.LineStrips3D(lines, colors=[BARRIER_COLOUR], radii=[-BARRIER_PIXELS], labels=names)
        recording.log("world/barriers", strips, static=True)
    for number, wall in enumerate(obstacles.walls):
        mesh = rr.Mesh3D(vertex_positions=wall.vertices, triangle_indices=wall.triangles, albedo_factor=PANEL_COLOUR)
        recording.log(f"world/barriers/panels/{number}", mesh, static=True)
    if len(obstacles.stems):
        feet = rr.Points3D(obstacles.stems[:, :3], colors=[TREE_COLOUR], radii=[-TREE_PIXELS])
        recording.log("world/trees", feet, static=True)
