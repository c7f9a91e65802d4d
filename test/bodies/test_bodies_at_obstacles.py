"""Tests of bodies at barriers, trees and holes: contacts against the rule, crossings against dense sampling."""

import math
from itertools import pairwise

import numpy as np
import pytest
from bodies.flying_bodies import Terms, drop, flown, ground, random_poses
from flights.obstacles_made import ASIDE, fence, fences, rough_ground, trees
from flights.scenes_of_facets import floor, terrain_of

from rpf3d_core.effects.forest import share_at_offset
from rpf3d_core.shapes.families import box, family
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.record import BLOW, FIRST_OBSTACLE, IMPACT_COLUMNS
from rpf3d_core.values import Outcome

BODIES, MASS = 20, 1000.0
GROUND = ground(0.6, 0.1, 0.2, 0.5)
CAPACITY, TAKEN, HEIGHT = (20e3, 60e3, 1e9), (1.0, 0.5, 1.0), (1.5, 2.5, 1.0)
LINES = [[(10.0, -30.0), (10.0, 30.0)], [(18.0, -30.0), (17.0, 0.0), (19.0, 30.0)], [(24.0, -30.0), (24.0, 30.0)]]
STEMS = [(x, y) for x in (6.0, 14.0, 21.0) for y in np.arange(-28.0, 28.0, 1.7)]


def hillside():
    """Return an uneven incline of 35 degrees, wide enough for bodies that leave their fall line."""
    return rough_ground()


def fences_of(terrain):
    """Return three fences: a weak one, one with corners that keeps half of its capacity, and a strong one."""
    y = terrain.vertices[:, 1]
    half = 0.98 * float(np.abs(y).max())
    lines = [[(x, math.copysign(min(abs(y), half), y)) for x, y in line] for line in LINES]
    parts = zip(lines, HEIGHT, CAPACITY, TAKEN, strict=True)
    return fences(*(fence(terrain, line, height, capacity, taken) for line, height, capacity, taken in parts))


def down(count: int, seed: int = 3):
    """Return bodies of two shapes, thrown down the incline in random orientations."""
    rng = np.random.default_rng(seed)
    x = np.stack([rng.uniform(-1, 1, count), rng.uniform(-6, 6, count), rng.uniform(2.5, 4, count)], 1)
    v = np.stack([rng.uniform(1, 8, count), rng.uniform(-1, 1, count), rng.uniform(-1, 1, count)], 1)
    shapes = [box((1.0, 0.8, 0.5)), family("equant")]
    bodies = drop(shapes, x, random_poses(rng, count), v)
    return shapes, bodies._replace(radius=np.full(count, 0.45))


def over(terrain, count, *effects, engine="reference", rows=60_000):
    shapes, bodies = down(count)
    terms = Terms((GROUND,), 4e-3, rows, 60.0, effects=effects, mass=MASS)
    return flown(engine_over(engine, terrain), shapes, bodies, terms), bodies


def meetings(end, i):
    """Return the rows of the impacts of body i that are meetings with obstacles, and the obstacles' numbers."""
    rows = slice(end.first[i, 0], end.first[i + 1, 0])
    met = end.facets[rows] < 0
    return end.impacts[rows][met], FIRST_OBSTACLE - end.facets[rows][met]


def check_spins(row):
    """Check that spin and speed fall by the same factor, which is the root of that of the energy."""
    kept = row[8] / row[7]
    assert row[IMPACT_COLUMNS + 1] == pytest.approx(kept * row[IMPACT_COLUMNS], rel=1e-12, abs=1e-12)
    assert row[BLOW + 2] == pytest.approx(kept * kept * row[BLOW + 1], rel=1e-12)


@pytest.fixture(scope="module")
def at_fences():
    """Return the terrain, three fences, and the flights of bodies that hit them."""
    terrain = hillside()
    net = fences_of(terrain)
    return terrain, net, over(terrain, BODIES, net)[0]


def test_fences_hold_or_are_broken_by_the_energy_of_translation_and_rotation(at_fences):
    _, net, end = at_fences
    held = broken = turning = 0
    for i in range(BODIES):
        rows, numbers = meetings(end, i)
        for row, k in zip(rows, numbers, strict=True):
            b = net.panel.barrier[k]
            energy = MASS * row[BLOW + 1]
            assert energy >= 0.5 * MASS * row[7] ** 2 * (1.0 - 1e-12)
            turning += energy > 1.02 * 0.5 * MASS * row[7] ** 2
            if energy <= CAPACITY[b]:
                assert row[8] == 0.0 and row[BLOW + 2] == 0.0 and (row == rows[-1]).all()
                assert end.outcome[i] == Outcome.CAUGHT
                np.testing.assert_array_equal(end.x[i], row[1:4])
                held += 1
            else:
                assert MASS * row[BLOW + 2] == pytest.approx(energy - TAKEN[b] * CAPACITY[b], rel=1e-9)
                check_spins(row)
                broken += 1
    assert held >= 5 and broken >= 5 and turning >= 5


def crossings(path, line, z_of):
    """Return the times (s) and heights (m) at which a densely sampled path crosses a line in plan."""
    found = []
    t, x, v = path.t, path.x, path.v
    for a in range(len(t) - 1):
        steps = np.linspace(0.0, t[a + 1] - t[a], 40)
        points = x[a] + steps[:, None] * v[a] + np.outer(-0.5 * 9.80665 * steps**2, (0.0, 0.0, 1.0))
        for begin, end in pairwise(line):
            way = np.subtract(end, begin)
            off = (points[:, 0] - begin[0]) * way[1] - (points[:, 1] - begin[1]) * way[0]
            along = ((points[:, :2] - begin) @ way) / (way @ way)
            for k in np.flatnonzero(np.sign(off[1:]) * np.sign(off[:-1]) < 0):
                share = off[k] / (off[k] - off[k + 1])
                if 0.0 <= along[k] + share * (along[k + 1] - along[k]) <= 1.0:
                    p = points[k] + share * (points[k + 1] - points[k])
                    found.append((t[a] + steps[k] + share * (steps[k + 1] - steps[k]), p[2] - z_of(p)))
    return found


def height_under(terrain):
    """Return a function that returns the height (m) of the terrain below a point, by a search of all triangles."""
    corners = terrain.vertices[terrain.triangles]

    def z_of(p):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        det = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        u = ((p[0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (p[1] - a[:, 1]) * (c[:, 0] - a[:, 0])) / det
        w = ((b[:, 0] - a[:, 0]) * (p[1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (p[0] - a[:, 0])) / det
        k = int(np.argmax(np.minimum(np.minimum(u, w), 1.0 - u - w)))
        return a[k, 2] + u[k] * (b[k, 2] - a[k, 2]) + w[k] * (c[k, 2] - a[k, 2])

    return z_of


def test_no_body_crosses_a_fence_below_its_top_without_a_meeting(at_fences):
    terrain, net, end = at_fences
    half = 0.98 * float(np.abs(terrain.vertices[:, 1]).max())
    z_of, over_it, at_it = height_under(terrain), 0, 0
    for i in range(BODIES):
        rows, numbers = meetings(end, i)
        path = end.path(i)
        for b, line in enumerate(LINES):
            clipped = [(x, math.copysign(min(abs(y), half), y)) for x, y in line]
            times = rows[net.panel.barrier[numbers] == b, 0]
            for t, height in crossings(path, clipped, z_of):
                low = height <= HEIGHT[b] - 1e-3
                near = np.abs(times - t).min() if len(times) else math.inf
                if low:
                    at_it += 1
                    assert near < 1e-6 or (near < math.inf and times.min() < t), "broken before, or met here"
                elif height > HEIGHT[b] + 1e-3:
                    over_it += 1
                    assert near > 1e-6
    assert at_it >= 5 and over_it >= 1


def test_trees_take_energy_by_the_offset_and_the_height_of_the_blow():
    terrain = hillside()
    half = 0.95 * float(np.abs(terrain.vertices[:, 1]).max())
    wood = trees(terrain, [p for p in STEMS if abs(p[1]) < half], energy=8e4, deflection=ASIDE)
    end, bodies = over(terrain, BODIES // 2, wood)
    stems, stopped, passed = wood.stems, 0, 0
    for i in range(BODIES // 2):
        rows, numbers = meetings(end, i)
        for row, k in zip(rows, numbers, strict=True):
            way, at = -row[4:6], row[1:3] - (stems.x[k], stems.y[k])
            reach = stems.radius[k] + bodies.radius[i]
            assert math.hypot(*at) <= reach * (1.0 + 1e-9), "the centre comes within both radii"
            offset = min(abs(way[0] * at[1] - way[1] * at[0]) / math.hypot(*way) / reach, 1.0)
            up = min(max((row[3] - stems.z[k]) / stems.height[k], 0.0), 1.0)
            taken, energy = 8e4 * share_at_offset(offset) * (1.0 - up), MASS * row[BLOW + 1]
            if energy <= taken * (1.0 - 1e-9):
                assert row[8] == 0.0 and row[BLOW + 2] == 0.0 and row[IMPACT_COLUMNS + 1] == 0.0
                stopped += 1
            elif energy > taken * (1.0 + 1e-9):
                assert MASS * row[BLOW + 2] == pytest.approx(energy - taken, rel=1e-6, abs=1e-3)
                check_spins(row)
                passed += 1
    assert stopped >= 5 and passed >= 5


def test_a_body_in_contact_stops_against_a_tree():
    terrain = floor(cells=4)
    wood = trees(terrain, [(3.0, 0.1)], energy=1e6)
    terms = Terms((ground(0.2),), 2e-3, 20_000, 20.0, effects=(wood,), mass=MASS)
    shape = box((1.0, 0.9, 0.4))
    end = flown(
        engine_over("reference", terrain), [shape], drop([shape], [(0.0, 0.0, 0.203)], None, (6.0, 0.0, 0.0)), terms
    )
    assert end.outcome[0] == Outcome.STOPPED and end.counts[0, 4] == 3, "it leans"
    reach = 0.2 + drop([shape], [(0.0, 0.0, 0.0)]).radius[0]
    assert math.hypot(end.x[0, 0] - 3.0, end.x[0, 1] - 0.1) == pytest.approx(reach, abs=1e-6)
    row, _ = meetings(end, 0)
    assert row[0, 7] ** 2 == pytest.approx(36.0 - 2.0 * 0.2 * 9.80665 * end.x[0, 0], rel=0.02)


def plate_with_a_hole(size: float):
    """Return a level ground of 40 m by 40 m with a square hole in its middle."""
    ticks = np.array([-20.0, -0.5 * size, 0.5 * size, 20.0])
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    triangles = []
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                a, b, c, d = 4 * i + j, 4 * (i + 1) + j, 4 * (i + 1) + j + 1, 4 * i + j + 1
                triangles += [(a, b, c), (a, c, d)]
    return terrain_of(np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3), triangles)


@pytest.mark.parametrize("slides", [True, False])
def test_a_body_falls_into_a_hole_that_its_centre_passes(slides):
    terrain = plate_with_a_hole(4.0)
    shape = box((1.0, 0.9, 0.4))
    x, v = ((-6.0, 0.0, 0.203), (4.0, 0.0, 0.0)) if slides else ((0.3, 0.2, 3.0), (0.0, 0.0, 0.0))
    terms = Terms((ground(0.1),), 2e-3, 20_000, 20.0)
    end = flown(engine_over("reference", terrain), [shape], drop([shape], [x], None, v), terms)
    assert end.outcome[0] == Outcome.LOST_TO_HOLE
    assert max(abs(end.x[0, 0]), abs(end.x[0, 1])) < 2.0 and end.x[0, 2] == pytest.approx(0.0, abs=0.02)


def test_a_body_on_a_hole_smaller_than_itself_stays_on_the_ground():
    terrain = plate_with_a_hole(0.3)
    shape = box((1.0, 0.9, 0.4))
    terms = Terms((ground(0.3),), 2e-3, 20_000, 20.0)
    end = flown(
        engine_over("reference", terrain), [shape], drop([shape], [(-2.0, 0.0, 0.203)], None, (5.0, 0.0, 0.0)), terms
    )
    assert end.outcome[0] == Outcome.STOPPED and end.x[0, 2] == pytest.approx(0.2, abs=5e-3)
