"""A bench of two flat parts with a face between them, and rocks that stop at chosen distances, for tests of reports."""

import math
from pathlib import Path

import numpy as np

from rpf3d_core.report.run_files import Ends, KeptPaths, RunFiles
from rpf3d_core.terrain.facets import Terrain

HEIGHT, SLOPE_DEG = 15.0, 70.0
TOE = HEIGHT / math.tan(math.radians(SLOPE_DEG))
"""Distance (m) in plan from the crest, at x = 0, to the toe."""
HALF = 50.0


def bench() -> Terrain:
    """Return a bench with a face of 15 m at 70 degrees; it reaches from x = -20 m to 200 m, with the crest at x = 0."""
    profile = [(-20.0, HEIGHT), (0.0, HEIGHT), (TOE, 0.0), (200.0, 0.0)]
    vertices = np.array([(x, y, z) for x, z in profile for y in (-HALF, HALF)])
    quads = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32)
    return Terrain(vertices, triangles, np.zeros(6, dtype=np.int32), ("bench",))


def fallen(runouts, at_rest=None, sets=0, paths=None, source=None) -> RunFiles:
    """Return the result files of a run whose rocks start at the crest and end (N,) m from the crest in plan.

    at_rest : (N,) True for rocks that stopped on the ground; None if all rocks stopped there
    sets : number of parameter sets S, of which rock i has number i modulo S; 0 for a run without unknowns
    paths : kept paths of the run, None for no paths
    source : (N,) number of the source of each rock; None if all rocks are from one source
    """
    runouts = np.asarray(runouts, dtype=float)
    count = len(runouts)
    y = np.linspace(-10.0, 10.0, count)
    ends = Ends(
        key=[("crest", i, 0) for i in range(count)],
        source=np.zeros(count, dtype=np.int64) if source is None else np.asarray(source),
        at_rest=np.ones(count, dtype=bool) if at_rest is None else np.asarray(at_rest),
        on_ground=np.ones(count, dtype=bool) if at_rest is None else np.asarray(at_rest),
        since=np.zeros(count), t=np.full(count, 10.0), max_speed=np.full(count, 20.0),
        release=np.column_stack([np.zeros(count), y, np.full(count, HEIGHT + 0.5)]),
        end=np.column_stack([runouts, y, np.zeros(count)]),
        runout=runouts, mass=np.full(count, 1000.0), set=np.arange(count) % sets if sets else None,
    )  # fmt: skip
    none = KeptPaths(key=[], starts=np.zeros(1, dtype=np.int64), x=np.empty((0, 3)), speed=np.empty(0))
    summary = {"rocks": count, "unknowns": {"sets": sets}} if sets else {"rocks": count}
    return RunFiles(
        folder=Path(), summary=summary, inputs={}, terrain=bench(), ends=ends, paths=none if paths is None else paths
    )  # fmt: skip


def thrown(run: RunFiles, speed: float, height: float) -> RunFiles:
    """Return the result files with a straight, level path from release to end for each rock.

    speed : m/s, of all rocks; height : m above the floor
    """
    x, starts = [], [0]
    for release, end in zip(run.ends.release, run.ends.end, strict=True):
        along = np.linspace(0.0, 1.0, 200)[:, None]
        path = release + along * (end - release)
        path[:, 2] = height
        x.append(path)
        starts.append(starts[-1] + len(path))
    points = np.concatenate(x)
    paths = KeptPaths(key=run.ends.key, starts=np.array(starts), x=points, speed=np.full(len(points), speed))
    return run._replace(paths=paths)
