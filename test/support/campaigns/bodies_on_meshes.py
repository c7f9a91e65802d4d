"""Fly bodies of random shapes over random meshes, and check that no part of a body passes through a facet.

    PYTHONPATH=test/support:. python -m campaigns.bodies_on_meshes --bodies 3000 --first 1

The program prints one line a family, and the seed of each fault.

A case is a mesh of `test/support/meshes/random_ground.py`, a few bodies, a ground and an accuracy, drawn from a family
and a seed. The check is `solid_overlap`: along the whole recorded path no facet may overlap a body, and the centre of a
body may not pass through a facet. The check uses the closed form of free rotation of the engines, but no code of their
search for contacts. No impact may increase the energy of a body. Sustained contact may increase the energy only as far
as the accuracy of the steps allows (`allowed_rise`).
"""

import argparse
import sys
import time
from typing import NamedTuple

import numpy as np
from bodies.flying_bodies import Drop, Flown, Terms, drop, flown, ground, random_poses
from bodies.solid_overlap import Solid, gaps, solid_of
from bodies.turning_bodies import turned
from meshes.random_ground import FAMILIES, SIDE

from rpf3d_core.shapes.families import box, family
from rpf3d_core.shapes.polyhedron import Polyhedron, polyhedron_of
from rpf3d_core.simulation.bodies.motion import SKIN
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.values import STANDARD_GRAVITY, Outcome

ROUNDING = 1e-9
"""Largest overlap (m) that may be due to rounding."""
STEP = 0.05
"""Largest path of any point of a body between two checked places, as a share of the body's largest radius (-)."""
MOST_SAMPLES = 400
"""Largest number of checked places in one segment of a path, even if STEP then is exceeded."""
IMPACT_GAIN = 1e-12
"""Largest increase of energy in an impact, as a share (-), that may be due to rounding."""
SKINS, LONGEST, TURN = 2.0, 0.02, 0.15
"""Terms of the largest allowed increase of energy in contact: a lift by SKINS skins, and the impulses of one step.

At its start, a step receives half of the velocity that gravity and the spin add during the step. A step takes at most
LONGEST (s), and at most the time in which the body rotates by TURN (rad).
"""
HANGS = 2.1
"""Largest distance of a stopped body from the ground, as a multiple of the skin (-)."""
ROWS = 40_000
"""Number of rows of the record that are reserved for each body."""
KINDS = ("box", "hull", "hull", "family", "plate", "needle")


class Case(NamedTuple):
    """A mesh, bodies released over it, and the terms of their flights; all drawn from one family and seed."""

    terrain: Terrain
    shapes: list[Polyhedron]
    bodies: Drop
    terms: Terms
    words: str


# --- cases ------------------------------------------------------------------------------------------------------------


def random_shape(draw: np.random.Generator) -> Polyhedron:
    """Return a random shape: a box, a plate or needle of up to 1:20, a hull of 4 to 40 corners, or a named shape."""
    kind, size = draw.choice(KINDS), 10.0 ** draw.uniform(-1.0, 0.2)
    if kind == "hull":
        points = draw.normal(size=(int(draw.integers(4, 41)), 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        return polyhedron_of(size * points * draw.uniform(0.15, 1.0, 3), "hull")
    if kind == "family":
        block = family(str(draw.choice(["equant", "plate", "column", "eota111", "eota221"])))
        return polyhedron_of(size * block.corners, block.name)
    if kind == "plate":
        return box(size * np.array([1.0, draw.uniform(0.3, 1.0), draw.uniform(0.05, 0.1)]))
    if kind == "needle":
        return box(size * np.array([1.0, *draw.uniform(0.05, 0.1, 2)]))
    return box(size * draw.choice([1.0, 0.5, draw.uniform(0.1, 1.0)], 3))


def case_of(family_name: str, seed: int, count: int) -> Case:
    """Return the case of a family and a seed, with `count` bodies."""
    draw = np.random.default_rng([7, list(FAMILIES).index(family_name), seed])
    terrain = FAMILIES[family_name](draw)
    shapes = [random_shape(draw) for _ in range(count)]
    mu = float(draw.choice([0.0, 0.3, 0.5, 1.0, 2.0, 100.0, draw.uniform(0.0, 2.0)]))
    e = float(draw.choice([0.0, 0.0, 0.3, 1.0, draw.uniform()]))
    mu_r = float(draw.choice([0.0, 0.1, 0.3]))
    accuracy = float(draw.choice([2e-3, 2e-3, 1e-3, 1e-4, 1e-2]))
    terms = Terms((ground(mu, e, mu_r, float(draw.choice([0.0, 0.05, 0.5]))),), accuracy, ROWS * count, 20.0, 20_000)
    reach = np.array([np.linalg.norm(shape.corners, axis=1).max() for shape in shapes])
    plan = draw.uniform(0.1, 0.9, (count, 2)) * SIDE
    if family_name in ("fans", "seams"):
        plan = draw.uniform(-0.3, 0.3, (count, 2)) * SIDE
    if family_name == "overhangs":
        corners = terrain.vertices[draw.integers(0, len(terrain.vertices), count), :2]
        plan = corners + draw.uniform(-0.5, 0.5, (count, 2))
    top = highest_around(terrain, plan, reach)
    height = 10.0 ** draw.uniform(-3.0, 0.7, count)
    x = np.column_stack([plan, top + 1.01 * reach + 1e-2 + height])
    v = np.where(draw.uniform(size=(count, 1)) < 0.5, draw.normal(0.0, 3.0, (count, 3)), 0.0)
    words = f"{family_name} seed {seed}: mu {mu:.3g}, e {e:.3g}, mu_r {mu_r:g}, accuracy {accuracy:g}"
    return Case(terrain, shapes, drop(shapes, x, random_poses(draw, count), v), terms, words)


def highest_around(terrain: Terrain, plan: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return the height (N,) m of the highest vertex of all facets whose box in plan meets a square around a place.

    Without such a facet: the height of the lowest vertex. plan : (N, 2) m, centres of the squares
    reach : (N,) m, half of the sides of the squares
    """
    t = terrain.vertices[terrain.triangles]
    low, high, top = t[:, :, :2].min(1), t[:, :, :2].max(1), t[:, :, 2].max(1)
    above, below = plan[:, None] + reach[:, None, None], plan[:, None] - reach[:, None, None]
    near = ((low[None] <= above) & (high[None] >= below)).all(-1)
    return np.asarray(np.where(near, top[None], terrain.vertices[:, 2].min()).max(axis=1))


def fly_case(case: Case, engine: str = "compiled", some: slice = slice(None)) -> Flown:
    """Return the flights of a case's bodies on an engine; some : rows of the bodies to fly."""
    bodies = Drop(*(column[some] for column in case.bodies))
    return flown(engine_of(engine, facets_of(case.terrain)), case.shapes, bodies, case.terms)


# --- where bodies are along their paths -------------------------------------------------------------------------------


def along(shape: Polyhedron, end: Flown, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return closely spaced times (S,) s, centres (S, 3) m and orientations (S, 4) along the whole path of body i."""
    path = end.path(i)
    lasts = np.diff(path.t)
    speed = np.linalg.norm(path.v[:-1], axis=1) + STANDARD_GRAVITY * lasts
    reach, slow = np.linalg.norm(shape.corners, axis=1).max(), shape.moments[2] / shape.moments[0]
    spin = np.linalg.norm(path.w[:-1], axis=1) * np.sqrt(slow)
    samples = np.ceil(lasts * (speed + spin * reach) / (STEP * reach)).clip(1, MOST_SAMPLES).astype(int)
    row = np.repeat(np.arange(len(lasts)), samples)
    share = np.concatenate([np.arange(n) / n for n in samples]) if len(samples) else np.empty(0)
    t = share * lasts[row]
    q, _, _ = turned(shape.moments, path.q[row], path.w[row], t)
    x = path.x[row] + path.v[row] * t[:, None]
    x[:, 2] -= 0.5 * STANDARD_GRAVITY * t * t
    return (
        np.append(path.t[row] + t, path.t[-1]), np.vstack([x, path.x[-1:]]), np.vstack([q, path.q[-1:]])
    )  # fmt: skip


def crossings(x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the numbers of the legs between successive points (S, 3) m that pass through a triangle (N, 3, 3) m."""
    a, b = x[:-1, None], x[1:, None]
    p = triangles[None, :, 0]
    n = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[None]
    above, below = ((a - p) * n).sum(-1), ((b - p) * n).sum(-1)
    crosses = above * below < 0.0
    at = a + (above / np.where(crosses, above - below, 1.0))[..., None] * (b - a)
    for k in range(3):
        side = np.cross(triangles[:, (k + 1) % 3] - triangles[:, k], at - triangles[None, :, k])
        crosses &= (side * n).sum(-1) >= 0.0
    return np.flatnonzero(crosses.any(axis=1))


def passes(x: np.ndarray, triangles: np.ndarray) -> bool:
    """Return True if a path through points (S, 3) m passes through one of triangles (N, 3, 3) m."""
    parts = range(0, max(len(x) - 1, 1), 500)
    return any(len(crossings(x[first : first + 501], triangles)) for first in parts)


# --- faults -----------------------------------------------------------------------------------------------------------


def faults_of(case: Case, end: Flown, i: int) -> list[str]:
    """Return the faults of the flight of body i, as sentences; empty if there is no fault."""
    shape, triangles = case.shapes[i], np.asarray(case.terrain.vertices[case.terrain.triangles])
    solid = solid_of(shape)
    t, x, q = along(shape, end, i)
    gap, faults = gaps(solid, x, q, triangles), []
    if gap.min() < -ROUNDING:
        k, first = int(gap.argmin()), int(np.argmax(gap < -ROUNDING))
        faults.append(f"overlaps by {-gap[k]:.2e} m at {t[k]:.4f} s, first by {-gap[first]:.2e} at {t[first]:.4f} s")
    if passes(x, triangles):
        faults.append("its centre passes through a facet")
    faults += energy_faults(case, end, i)
    outcome = Outcome(int(end.outcome[i]))
    if outcome in (Outcome.FAILED, Outcome.MAX_IMPACTS):
        faults.append(outcome.name.lower())
    if outcome == Outcome.STOPPED and not rests_near(solid, x[-1:], q[-1:], triangles, case.terms.accuracy):
        faults.append("stopped away from the ground")
    return faults


def energy_faults(case: Case, end: Flown, i: int) -> list[str]:
    """Return the forbidden increases of energy of body i as sentences: in an impact, in contact, since the release."""
    blows, energy, faults = end.blows(i), end.path(i).energy, []
    gain = (blows[:, -1] - blows[:, -2] * (1.0 + IMPACT_GAIN)).max(initial=0.0)
    if gain > 0.0:
        faults.append(f"gains {gain:.2e} J/kg in an impact")
    rise, allowed = (energy - np.minimum.accumulate(energy)).max(), allowed_rise(case, end, i)
    if rise > allowed:
        faults.append(f"gains {rise:.2e} J/kg in contact, {allowed:.2e} are allowed")
    if energy.max() > energy[0] + ROUNDING:
        faults.append(f"has {energy.max() - energy[0]:.2e} J/kg more than at its release")
    return faults


def allowed_rise(case: Case, end: Flown, i: int) -> float:
    """Return the largest increase of energy (J/kg) in contact that the accuracy of the steps allows."""
    reach = float(np.linalg.norm(case.shapes[i].corners, axis=1).max())
    path = end.path(i)
    w, v = (np.linalg.norm(a[path.sliding], axis=1) for a in (path.w, path.v))
    lasts = np.minimum(LONGEST, TURN / np.maximum(w, 1e-9))
    spins = (0.5 * lasts * w * w * reach * (v + w * reach)).max(initial=0.0)
    skin = min(case.terms.accuracy, SKIN * reach)
    return SKINS * STANDARD_GRAVITY * skin + 0.125 * (STANDARD_GRAVITY * LONGEST) ** 2 + float(spins)


def rests_near(solid: Solid, x: np.ndarray, q: np.ndarray, triangles: np.ndarray, accuracy: float) -> bool:
    """Return True if a body is within HANGS skins of one of triangles (N, 3, 3) m.

    x : (1, 3) m, centre; q : (1, 4) orientation; accuracy : accuracy (m) of contacts
    """
    band = HANGS * min(accuracy, SKIN * np.linalg.norm(solid.corners, axis=1).max())
    return bool(gaps(solid, x, q, triangles, band)[0] <= band)


def campaign(name: str, seeds: range, count: int) -> int:
    """Fly the cases of a family of meshes; print each fault and a summary; return the number of faulty bodies.

    name : family of meshes; seeds : seeds of the cases; count : number of bodies in each case
    """
    began, wrong, outcomes = time.process_time(), 0, np.zeros(len(Outcome) + 1, dtype=int)
    flying, blows, segments = 0.0, 0, 0
    for seed in seeds:
        case = case_of(name, seed, count)
        start = time.process_time()
        end = fly_case(case)
        flying += time.process_time() - start
        blows, segments = blows + int(end.counts[:, 2].sum()), segments + int(end.counts[:, 3].sum())
        for i in range(count):
            outcomes[int(end.outcome[i])] += 1
            faults = faults_of(case, end, i)
            if faults:
                wrong += 1
                print(f"  {case.words}, body {i} ({case.shapes[i].name}): {'; '.join(faults)}", flush=True)
    counts = ", ".join(f"{outcomes[int(o)]} {o.name.lower()}" for o in Outcome if outcomes[int(o)])
    bodies = len(seeds) * count
    took = f"flights {flying:.0f} s, all {time.process_time() - began:.0f} s"
    print(f"{name}: {bodies} bodies, {wrong} wrong ({counts}; {blows} impacts, {segments} parts); {took}", flush=True)
    return wrong


def main() -> int:
    """Fly the campaign; return 1 if any body was faulty, else 0."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bodies", type=int, default=3000)
    parser.add_argument("--each", type=int, default=8, help="bodies in each case")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--family", choices=sorted(FAMILIES), action="append")
    asked = parser.parse_args()
    families = asked.family or sorted(FAMILIES)
    cases = max(-(-asked.bodies // (asked.each * len(families))), 1)
    wrong = sum(campaign(name, range(asked.first, asked.first + cases), asked.each) for name in families)
    bodies, last = cases * asked.each * len(families), asked.first + cases - 1
    print(f"{bodies} bodies, seeds {asked.first} to {last}: {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
