"""Add relief to a designed pit: rough surfaces, cones of loose rock (spills) on the benches, and hills around the pit.

All relief depends only on place and seed, so meshes of any resolution have the same surface.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.columns import Columns
from rpf3d_core.terrain.pit.design import Design
from rpf3d_core.terrain.pit.rows import BENCH, CREST, FACE, TOE

OCTAVES = (24.0, 12.0, 6.0, 3.0)
"""Wavelengths of the roughness, m; facets of 1 m^2 are too large to show shorter waves."""
HURST = 0.8
"""Exponent by which the roughness grows with its wavelength (-): a common value for rough rock surfaces."""
WAVES = 6
"""Number of plane waves of random direction for each wavelength of the roughness."""
SMOOTH_SHARE = 1.0 / 3.0
"""Roughness of the graded surfaces, ramp and floor, over the roughness of faces and benches (-)."""
HILLS = (900.0, 420.0)
"""Wavelengths of the hills on the natural ground, m."""
HILL_HEIGHT = 8.0
"""Standard deviation of the natural ground at the outer edge, m; it increases from zero at the crest."""
LEAST_SPILL, MOST_SPILL = 0.6, 0.95
"""Least and greatest reach of a spill across its bench, over the bench width (-), after figure 5-9 of the thesis."""
LONGEST_SPILL = 3.0
"""Largest reach of a spill along its bench, over its reach across the bench (-)."""
HIGHEST_SPILL = 0.8
"""Largest height of a spill over the height of the bench face behind the spill (-)."""
SLACK = 1.3
"""Number of columns that are searched for a spill's points, over the number needed for evenly spaced columns (-)."""
RAISED = 0.1
"""Least height (m) by which a spill raises a point that counts as a point of the spill."""
TRIES = 40
"""Number of random places tried for a spill; the spill is omitted if the ramp is too near to all of them."""


class ReliefWaves(NamedTuple):
    """A sum of K plane waves that makes relief: wave vector (K, 3) rad/m, phase (K,) rad, amplitude (K,) (-)."""

    vector: FloatArray
    phase: FloatArray
    amplitude: FloatArray


def drawn_waves(random: np.random.Generator, lengths: tuple[float, ...], plan: bool) -> ReliefWaves:
    """Return waves of random direction for relief; their sum has a standard deviation of 1.

    random : generator from which directions and phases are drawn; lengths : wavelengths, m
    plan : true for horizontal directions only
    """
    vectors, amplitudes = [], []
    for length in lengths:
        direction = random.normal(size=(WAVES, 3))
        if plan:
            direction[:, 2] = 0.0
        vectors.append(direction / np.linalg.norm(direction, axis=1, keepdims=True) * (2.0 * math.pi / length))
        amplitudes += [length**HURST] * WAVES
    amplitude = np.array(amplitudes)
    amplitude *= math.sqrt(2.0) / np.linalg.norm(amplitude)
    return ReliefWaves(
        vector=np.concatenate(vectors), phase=random.uniform(0.0, 2.0 * math.pi, len(amplitude)), amplitude=amplitude
    )


def height_of_waves(waves: ReliefWaves, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Return the sum (P,) (-) of waves at points x, y, z (P,) m: relief with a standard deviation of 1."""
    total = np.zeros(len(x))
    for (kx, ky, kz), phase, amplitude in zip(waves.vector, waves.phase, waves.amplitude, strict=True):
        total += amplitude * np.sin(kx * x + ky * y + (kz * z + phase))
    return total


def roughness(design: Design, points: FloatArray) -> FloatArray:
    """Return the height (P,) m of the small-scale relief (roughness) at points (P, 3) m, from the pit's parameters."""
    random = np.random.Generator(np.random.Philox(key=design.pit.seed, counter=1))
    return design.pit.roughness * height_of_waves(drawn_waves(random, OCTAVES, plan=False), *points.T)


def steepness(design: Design, columns: Columns) -> FloatArray:
    """Return the factor (P,) that turns roughness normal to the surface into a displacement along z, for all points.

    On bench faces the factor is above 1; at the edges of bench faces it follows from the mean slope. On benches and
    natural ground the factor is 1, on the floor and the ramp SMOOTH_SHARE. Points move along z and not along the
    normal, so that every facet's normal points upwards for any roughness.
    """
    steep = math.radians(design.pit.face_angle_deg)
    of_kind = np.ones(max(TOE, FACE, CREST, BENCH) + 1)
    of_kind[FACE], of_kind[[TOE, CREST]] = 1.0 / math.cos(steep), 1.0 / math.cos(0.5 * steep)
    factor = np.where(columns.row >= 0, of_kind[columns.rows.kind[columns.row]], 1.0)
    graded = (columns.row < 0) & (columns.height < design.pit.levels[-1])
    factor[graded | (columns.ramp >= 0)] = SMOOTH_SHARE
    return factor


def hills(design: Design, columns: Columns, points: FloatArray) -> FloatArray:
    """Return the height (P,) m of the hills at points (P, 3) m: 0 at the crest, full at the outer edge.

    The hills grow over the outermost `Pit.rim_width` of the natural ground.
    """
    ground = np.flatnonzero((columns.row < 0) & (columns.ramp < 0) & (columns.height == design.pit.levels[-1]))
    random = np.random.Generator(np.random.Philox(key=design.pit.seed, counter=2))
    waves = drawn_waves(random, HILLS, plan=True)
    rim = (columns.offset[ground] - design.outer) / design.pit.rim_width + 1.0
    share = np.clip(rim, 0.0, 1.0)
    relief = np.zeros(len(points))
    relief[ground] = HILL_HEIGHT * share**2 * (3.0 - 2.0 * share) * height_of_waves(waves, *points[ground].T)
    return relief


class Spill(NamedTuple):
    """A cone of loose rock (spill) that lies on bench `level`, against the bench face behind it.

    p : fraction of a turn around the pit; level : number of the level, counted from the floor
    across, along : reach of the spill across and along the bench, m; height : m
    """

    p: float
    level: int
    across: float
    along: float
    height: float


def drawn_spills(design: Design) -> list[Spill]:
    """Return the spills (cones of loose rock) on the benches of a pit, at random places that depend on the pit's seed.

    No spill lies where the ramp cuts or narrows its bench. A spill for which no place is found is omitted, so the pit
    may have fewer spills than `Pit.spills`.
    """
    if not design.benches:
        return []
    random = np.random.Generator(np.random.Philox(key=design.pit.seed, counter=3))
    return [spill for _ in range(design.pit.spills) if (spill := drawn_spill(design, random))]


def drawn_spill(design: Design, random: np.random.Generator) -> Spill | None:
    """Return one spill at a random place; None if no place away from the ramp was found."""
    for _ in range(TRIES):
        p, level = float(random.uniform()), int(random.integers(1, design.benches + 1))
        across = random.uniform(LEAST_SPILL, MOST_SPILL) * float(design.width_at(np.array([p]))[0])
        along = across * float(random.uniform(1.0, LONGEST_SPILL))
        face = float(design.pit.levels[level + 1] - design.pit.levels[level])
        height = min(across * math.tan(math.radians(design.pit.repose_deg)), HIGHEST_SPILL * face)
        if not near_ramp(design, p, level):
            return Spill(p=p, level=level, across=across, along=along, height=height)
    return None


def near_ramp(design: Design, p: float, level: int) -> bool:
    """Return True if the ramp passes less than 1.3 bench heights above or below a bench: a spill has no room there.

    p : fraction of a turn around the pit; level : number of the bench, counted from the floor
    """
    turns = np.arange(p, max(design.turns, 0.0), 1.0)
    coordinate = design.bench_coordinate(design.ramp_height(turns))
    return bool(np.any(np.abs(coordinate - level) < 1.3))


def pile_spills(design: Design, columns: Columns, points: FloatArray) -> NDArray[np.bool_]:
    """Raise the points (P, 3) m under the spills, in place; return flags (P,): true on a spill."""
    raised = np.zeros(len(points), dtype=bool)
    first = np.searchsorted(columns.column, np.arange(columns.around + 1))
    for spill in drawn_spills(design):
        near = points_near(design, columns, first, spill)
        lift = design.pit.levels[spill.level] + cone(design, columns, spill, points[near]) - points[near, 2]
        raised[near[lift > RAISED]] = True
        points[near, 2] += np.maximum(lift, 0.0)
    return raised


def cone(design: Design, columns: Columns, spill: Spill, points: FloatArray) -> FloatArray:
    """Return the height (P,) m of a spill's cone above its bench at points (P, 3) m; negative outside the cone."""
    apex_x, apex_y = on_toe_line(design, columns, spill, spill.p)
    x, y = points[:, 0] - apex_x, points[:, 1] - apex_y
    nx, ny = design.outward(np.array([spill.p]))
    out, sideways = x * nx + y * ny, x * ny - y * nx
    return spill.height * (1.0 - np.hypot(out / spill.across, sideways / spill.along))


def on_toe_line(design: Design, columns: Columns, spill: Spill, p: float) -> tuple[float, float]:
    """Return x and y, m, of a point on the toe of the bench face behind a spill; p : fraction of a turn."""
    toe = columns.wall[toe_row(columns, spill)]
    offset = np.interp(p * columns.around, np.arange(columns.around + 1), np.append(toe, toe[0]))
    x, y = design.plan(np.array([p]), np.array([offset]))
    return float(x[0]), float(y[0])


def toe_row(columns: Columns, spill: Spill) -> int:
    """Return the row number of the toe of the bench face behind a spill."""
    return int(np.flatnonzero((columns.rows.kind == TOE) & (columns.rows.face == spill.level + 1))[0])


def points_near(design: Design, columns: Columns, first: NDArray[np.int64], spill: Spill) -> NDArray[np.int64]:
    """Return the numbers (M,) of the points that a spill can cover: on its bench and the face above, in nearby columns.

    first : (N + 1,) number of the first point of each column
    """
    middle = round(spill.p * columns.around)
    here, beside = (
        on_toe_line(design, columns, spill, column % columns.around / columns.around) for column in (middle, middle + 1)
    )
    half = 2 + math.ceil(SLACK * spill.along / math.dist(here, beside))
    there = np.unique(np.arange(middle - half, middle + half + 1) % columns.around)
    near = np.concatenate([np.arange(first[column], first[column + 1]) for column in there])
    near = near[columns.row[near] >= 0]
    face, kind = columns.rows.face[columns.row[near]], columns.rows.kind[columns.row[near]]
    bench = (face == spill.level) & ((kind == CREST) | (kind == BENCH))
    found: NDArray[np.int64] = near[bench | ((face == spill.level + 1) & (kind != BENCH))]
    return found
