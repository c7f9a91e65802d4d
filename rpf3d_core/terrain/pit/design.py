"""The design of a synthetic pit, without any mesh: plan outline, haul ramp, bench widths, zones.

A place on the wall has two coordinates: p, the fraction of a turn around the pit (counter-clockwise, 0 at the foot of
the ramp), and the offset o (m) outwards from the floor outline, along the outline's normal. With offsets along the
normal, the bench faces keep their angle for any outline. A profile at p consists, from the floor up, of bench face,
berm, bench face, berm, ..., crest. The ramp is a strip cut into the profiles at a height that increases with p; the
wall above the strip is moved outwards. With every turn the wall therefore moves outwards by the width of the ramp minus
one berm, and all contour lines are slowly widening spirals that end at the ramp.
"""

import math
from dataclasses import dataclass

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.pit.parameters import Pit

SAMPLES = 4096
"""Number of places in one turn around the pit at which the plan is computed: about 1 m apart in the default pit."""
LOBES = ((3, 0.058, 3.13), (4, 0.022, 4.13), (5, 0.011, 3.47))
"""Waves of the outline: number of waves around the pit, amplitude over the radius (-), phase (rad); chosen by eye."""
WIDENINGS = ((2, 1.0, 0.4), (3, 0.7, 1.9), (7, 0.35, 4.0))
"""Waves of the bench width: number of waves around the pit, relative amplitude (-), phase (rad); chosen by eye."""
INNER_SHARE = 0.14
"""Width of the outer ring of the floor that is meshed together with the walls, over the floor's radius (-)."""
LEAST_STRETCH = 0.25
"""Least stretch (-) of a line at an offset from the floor outline: its length over the length of the outline there.

If the stretch is smaller anywhere, the plan counts as folded over itself.
"""
MOST_TURNS = 12
"""Largest number of turns of the ramp around the pit."""
FACES_BETWEEN_TURNS = 2.5
"""Least height between two turns of the ramp, over the height of the highest bench face (-)."""


@dataclass(frozen=True, eq=False)
class Design:
    """The design of a pit: all data from which the mesh is made.

    pit : the parameters of the pit; cot : run over rise of the faces (-)
    angle : (SAMPLES + 1,) polar angle of the floor outline at p = 0 ... 1, rad
    width : (SAMPLES + 1,) bench width at the same places, m
    climb : (L,) heights of the ramp above the floor, m, at evenly spaced p from 0 to `turns`
    turns : number of turns of the ramp around the pit; -1 for a pit without a ramp
    strip : width of the ramp measured along the outline's normal, m
    inner, outer : m, offsets of the first and the last line of the walls' mesh; inner is negative (on the floor)
    """

    pit: Pit
    cot: float
    angle: FloatArray
    width: FloatArray
    climb: FloatArray
    turns: float
    strip: float
    inner: float
    outer: float

    @property
    def zones(self) -> tuple[str, ...]:
        """Names of the pit's zones: the benches from the top, then the other zones."""
        benches = tuple(f"bench_{number}" for number in range(1, self.benches + 1))
        return (*benches, "face", "ramp", "floor", "spill", "ground")

    @property
    def benches(self) -> int:
        """Number of catch benches of the pit."""
        return len(self.pit.levels) - 2 if self.pit.bench_widths[1] > 0.0 else 0

    @property
    def surface_area(self) -> float:
        """Approximate area of the pit's surface, m^2; the target length of the mesh's edges follows from it."""
        rings = np.linspace(0.0, self.crest_offset, 2)
        plan = math.pi * (self.pit.floor_radius + rings) ** 2
        steepness = 1.0 / math.sin(math.radians(self.pit.face_angle_deg)) * self.pit.levels[-1] / self.crest_offset
        wall = (plan[1] - plan[0]) * (steepness + 1.0 - self.cot * self.pit.levels[-1] / self.crest_offset)
        return float(plan[0] + wall + math.pi * (self.pit.floor_radius + self.outer) ** 2 - plan[1])

    @property
    def crest_offset(self) -> float:
        """Mean horizontal distance of the crest from the floor outline, m."""
        berms = (len(self.pit.levels) - 2) * float(self.width.mean())
        return float(self.pit.levels[-1]) * self.cot + berms + float(self.push(0.5, 0.5))

    def width_at(self, p: FloatArray) -> FloatArray:
        """Return the bench width (m), in the shape of p, at places around the pit; p : fraction of a turn (-)."""
        return sampled(p % 1.0, 1.0, self.width)

    def plan(self, p: FloatArray, offset: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return x and y (m) of places on the wall, each in the shape to which NumPy broadcasts `p` and `offset`.

        p : position around the pit, as a fraction of one full turn
        offset : horizontal distance (m) from the outline of the pit floor, outwards along the outline's normal
        """
        x, y, nx, ny, _, _ = outline(self.pit, self.angle_at(p))
        return x + offset * nx, y + offset * ny

    def outward(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the x and y components of the floor outline's outward unit normal at places around the pit.

        Both results have the shape of `p`.

        p : fraction of a turn (-)
        """
        _, _, nx, ny, _, _ = outline(self.pit, self.angle_at(p))
        return nx, ny

    def angle_at(self, p: FloatArray) -> FloatArray:
        """Return the polar angle (rad), in the shape of p, of the floor outline; p : fraction of a turn (-)."""
        return sampled(p % 1.0, 1.0, self.angle)

    def push(self, p: FloatArray | float, ramps_below: FloatArray | float) -> FloatArray:
        """Return the distance (m) by which the wall is moved outwards, because the ramp needs room below the wall.

        p : fraction of a turn around the pit; ramps_below : number of turns of the ramp below the place
        """
        if self.pit.ramp_width == 0.0:
            return np.zeros(np.broadcast(p, ramps_below).shape)
        p = np.asarray(p, dtype=float)
        pushed: FloatArray = (self.strip - self.width[0]) * p + ramps_below * (self.strip - self.width_at(p))
        return pushed

    def ramp_height(self, turn: FloatArray) -> FloatArray:
        """Return the height (m) of the ramp above the floor, in the shape of `turn`.

        turn : turns around the pit from the ramp's foot, with fractions (-)
        """
        return sampled(turn, self.turns, self.climb)

    def bench_coordinate(self, height: FloatArray) -> FloatArray:
        """Return the bench coordinate (-) of heights: 0 on the floor, i at the top of face i, linear in between.

        Faces are numbered from 1, the lowest.

        height : m above the floor, any shape, as in the result
        """
        benches: FloatArray = np.interp(height, self.pit.levels, np.arange(len(self.pit.levels), dtype=float))
        return benches

    def wall_offset(
        self, p: FloatArray, height: FloatArray, berms: FloatArray, ramps_below: FloatArray | float
    ) -> FloatArray:
        """Return the horizontal distance (offset, m) of the wall from the floor outline, at a place around the pit.

        p : fraction of a turn around the pit; height : m above the floor
        berms : number of bench widths below the place; ramps_below : number of turns of the ramp below the place

        At the inner edge of the ramp, `berms` is the bench coordinate minus one. Where the ramp reaches level i, its
        inner edge is therefore the crest of face i: the berm at level i has no width there, and continues on the outer
        side of the ramp.
        """
        offset: FloatArray = height * self.cot + berms * self.width_at(p) + self.push(p, ramps_below)
        return offset


def sampled(place: FloatArray, end: float, samples: FloatArray) -> FloatArray:
    """Return the values of a function at places from 0 to `end`, by linear interpolation of its samples.

    place : the places, any shape, as in the result; samples : (N,) values at evenly spaced places from 0 to `end`
    """
    values: FloatArray = np.interp(place, np.linspace(0.0, end, len(samples)), samples)
    return values


def design_of(pit: Pit) -> Design:
    """Return the design of a pit: compute outline, bench widths and ramp.

    Raises `TerrainError` if the plan folds over itself, or if the turns of the ramp are too many or too close.
    """
    cot = 1.0 / math.tan(math.radians(pit.face_angle_deg))
    berms = max(0, len(pit.levels) - 2) * 0.5 * sum(pit.bench_widths)
    middle = 0.5 * (pit.levels[-1] * cot + berms + pit.ramp_width)
    angle = evenly_round(pit, middle)
    width = bench_width(pit)
    strip = pit.ramp_width * obliqueness(pit, cot)
    climb, turns = climb_ramp(pit, cot, angle, width, strip) if strip > 0.0 else (np.zeros(2), -1.0)
    farthest = pit.levels[-1] * cot + (len(pit.levels) - 2) * width.max() + strip * (max(turns, 0.0) + 1.0)
    inner, outer = -INNER_SHARE * pit.floor_radius, float(farthest) + pit.rim_width
    refuse_folds(pit, inner, outer)
    refuse_close_turns(pit, climb, turns)
    return Design(pit, cot, angle, width, climb, turns, strip, inner, outer)


def outline(pit: Pit, angle: FloatArray) -> tuple[FloatArray, ...]:
    """Return points of the pit's floor outline at polar angles (rad), with normal, speed and curvature.

    Results, each in the shape of `angle`: x, y (m), outward unit normal nx, ny, speed along the outline (m/rad),
    curvature (1/m).

    The outline is an ellipse of the given elongation with a few waves, a polar curve r(angle). All results come
    from exact formulas, without numerical derivatives.
    """
    r, r1, r2 = radius(pit, angle)
    cos, sin = np.cos(angle), np.sin(angle)
    speed = np.sqrt(r * r + r1 * r1)
    nx, ny = (r1 * sin + r * cos) / speed, (r * sin - r1 * cos) / speed
    return r * cos, r * sin, nx, ny, speed, (r * r + 2.0 * r1 * r1 - r * r2) / speed**3


def radius(pit: Pit, angle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the radius (m) of the floor outline at polar angles, and its first and second derivative (m/rad, m/rad^2).

    angle : rad
    """
    a2, turned = pit.elongation, angle - math.radians(pit.long_axis_deg)
    g = 0.5 * (1.0 / a2 + a2) + 0.5 * (1.0 / a2 - a2) * np.cos(2.0 * turned)
    g1, g2 = -(1.0 / a2 - a2) * np.sin(2.0 * turned), -2.0 * (1.0 / a2 - a2) * np.cos(2.0 * turned)
    r, r1 = g**-0.5, -0.5 * g**-1.5 * g1
    r2 = 0.75 * g**-2.5 * g1**2 - 0.5 * g**-1.5 * g2
    for number, amplitude, phase in LOBES:
        r = r + amplitude * np.cos(number * turned + phase)
        r1 = r1 - amplitude * number * np.sin(number * turned + phase)
        r2 = r2 - amplitude * number**2 * np.cos(number * turned + phase)
    return pit.floor_radius * r, pit.floor_radius * r1, pit.floor_radius * r2


def evenly_round(pit: Pit, offset: float) -> FloatArray:
    """Return the polar angles (SAMPLES + 1,) rad of the places p = 0 ... 1 around the pit, from the foot of the ramp.

    The places are at equal distances along a closed line around the pit, not at equal angles.

    offset : m, constant distance of this line from the floor outline
    """
    start = math.radians(pit.ramp_foot_deg)
    angle = start + np.linspace(0.0, 2.0 * math.pi, SAMPLES + 1)
    _, _, _, _, speed, curvature = outline(pit, angle)
    density = speed * (1.0 + curvature * offset)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    even: FloatArray = np.interp(np.linspace(0.0, way[-1], SAMPLES + 1), way, angle)
    return even


def bench_width(pit: Pit) -> FloatArray:
    """Return the bench width (SAMPLES + 1,) around the pit, m; it varies between the limits that the user gave."""
    p = np.linspace(0.0, 1.0, SAMPLES + 1)
    wave = np.zeros(SAMPLES + 1)
    for number, amplitude, phase in WIDENINGS:
        wave += amplitude * np.cos(2.0 * math.pi * number * p + phase)
    wave = (wave - wave.min()) / np.ptp(wave)
    wave[-1] = wave[0]
    width: FloatArray = pit.bench_widths[0] + (pit.bench_widths[1] - pit.bench_widths[0]) * wave
    return width


def obliqueness(pit: Pit, cot: float) -> float:
    """Return the ramp width along the outline's normal over the true ramp width (-), to place the ramp in a profile.

    The ratio is above 1, because the ramp moves outwards while it climbs.

    cot : run over rise of the faces (-)
    """
    drift = pit.ramp_grade * (cot + 0.5 * sum(pit.bench_widths) * (len(pit.levels) - 1) / pit.levels[-1])
    return math.sqrt(1.0 + drift**2)


def climb_ramp(pit: Pit, cot: float, angle: FloatArray, width: FloatArray, strip: float) -> tuple[FloatArray, float]:
    """Return the heights (L,) m of the ramp at even steps around the pit, and the number of its turns around the pit.

    The ramp climbs from its foot on the floor to the crest. The rise per step is the grade times the distance along the
    ramp's middle line (explicit Euler, steps of about 1 m).

    cot : run over rise of the faces (-)
    angle, width : (SAMPLES + 1,) polar angle (rad) of the floor outline, and bench width (m), at p = 0 ... 1
    strip : width of the ramp along the outline's normal, m

    Raises `TerrainError` if the ramp needs more than MOST_TURNS turns.
    """
    _, _, _, _, speed, curvature = outline(pit, angle)
    along = speed * np.gradient(angle)
    levels, benches = pit.levels, np.arange(len(pit.levels), dtype=float)
    per_turn = strip - width[0]
    heights, top = [0.0], float(levels[-1])
    while heights[-1] < top:
        k, step = len(heights) - 1, (len(heights) - 1) % SAMPLES
        turn = k // SAMPLES
        berms = (float(np.interp(heights[-1], levels, benches)) - 1.0) * width[step]
        push = per_turn * step / SAMPLES + turn * (strip - width[step])
        offset = heights[-1] * cot + berms + push + 0.5 * strip
        heights.append(heights[-1] + pit.ramp_grade * float(along[step] * (1.0 + curvature[step] * offset)))
        if turn >= MOST_TURNS:
            raise TerrainError("pit: the ramp needs too many turns; make the pit wider or the grade steeper")
    last = (top - heights[-2]) / (heights[-1] - heights[-2])
    turns = (len(heights) - 2 + last) / SAMPLES
    even = np.interp(np.linspace(0.0, turns, len(heights)), np.arange(len(heights)) / SAMPLES, heights)
    even[0], even[-1] = 0.0, top
    return even, turns


def refuse_folds(pit: Pit, inner: float, outer: float) -> None:
    """Raise `TerrainError` if the plan of the pit folds over itself at the innermost or outermost offset.

    inner, outer : m, offsets of the innermost and outermost line from the outline of the floor, positive outwards
    """
    curvature = outline(pit, np.linspace(0.0, 2.0 * math.pi, SAMPLES))[5]
    stretch = min(float(np.min(1.0 + curvature * inner)), float(np.min(1.0 + curvature * outer)))
    if stretch < LEAST_STRETCH:
        raise TerrainError("pit: the plan folds over itself; lower elongation or rim_width, or raise floor_radius")


def refuse_close_turns(pit: Pit, climb: FloatArray, turns: float) -> None:
    """Raise `TerrainError` if two turns of the ramp are less than FACES_BETWEEN_TURNS times the highest face apart.

    climb : (L,) m, heights of the ramp above the floor, at evenly spaced places around the pit
    turns : length of the ramp, in full turns around the pit
    """
    place = np.linspace(0.0, turns, len(climb))
    between = np.diff(pit.levels).max() * FACES_BETWEEN_TURNS
    if turns > 1.0 and np.any((sampled(place + 1.0, turns, climb) - climb)[place <= turns - 1.0] < between):
        raise TerrainError("pit: the ramp's turns lie too close; make the grade steeper or the pit wider")
