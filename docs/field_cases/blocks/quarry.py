"""Rocks with a shape at Authume, profile P1: four scanned blocks, and the search for the set of the shipped scene.

The search uses x of the end points alone, so that the lateral spread is an independent check of the model.
"""

from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np

from field_cases import authume
from field_cases.blocks.flying import BlockSite, Flown, Ground, joined
from field_cases.blocks.race import Parameters, Round, race
from field_cases.blocks.shapes import DENSITY, of_mass, stretched
from field_cases.figures import SEED, distance
from field_cases.search import Found, Free
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.choices import chosen_scene
from rpf3d_core.shapes.polyhedron import Polyhedron

SCENE = authume.ROOT / "config" / "scenes" / "authume_p1_blocks.yaml"

FREE = (
    Free("restitution", 0.0, 0.3, 4),
    Free("friction", 0.45, 0.65, 5),
    Free("rolling_resistance", 0.06, 0.30, 13),
)
ROUNDS = (Round(60, 40), Round(240, 8), Round(1000, 8))
"""The first round has 260 sets. Most of the rocks fly in the last round, where the sets differ least."""
SEARCH_SEED = 1
ROCKS = 4000
"""Rocks of the figures on the page, with another seed than the search."""
OTHER_ROCKS = 2000
"""Rocks of the variants."""
CHANCE_SAMPLES = 1000
BARS = {"mean": (41.0, 47.0), "sd": (9.0, 14.0), "side_sd": (5.5, 8.2), "beyond": (0.08, 1.0)}
"""Goals: mean and sd of x (m), lateral sd (m, the field's interval; in no fit), share beyond 55 m."""


def scene(rocks: int, seed: int) -> Scene:
    """Return the scene of the blocks with a number of rocks and a seed."""
    return chosen_scene(SCENE, rocks, "compiled", seed)


@lru_cache
def site(seed: int) -> BlockSite:
    """Return the quarry with the four scanned blocks in their own sizes."""
    return BlockSite(scene(ROCKS, seed))


@lru_cache
def blocks() -> FloatArray:
    """Return mass (kg) and lengths L1 >= L2 >= L3 (m) of the 41 blocks, (41, 4)."""
    return np.loadtxt(authume.DATA / "Endpoints_P1.txt")[:, 3:7]


def best_in_x() -> list[Found]:
    """Return the best sets for all zones: those whose x of end points is nearest to that of the blocks, best first."""
    x = authume.end_points()[:, 0]
    return race(lambda parameters, rocks: distance(_found_x(parameters, rocks), x), FREE, ROUNDS)


def searched(parameters: Parameters) -> Flown:
    """Return the rocks of a set that flew in all rounds of the search."""
    return _searched(tuple(parameters.items()), ROUNDS[-1].rocks)


def _found_x(parameters: Parameters, rocks: int) -> FloatArray:
    return _searched(tuple(parameters.items()), rocks).ends.end[:, 0]


@cache
def _searched(parameters: tuple[tuple[str, float], ...], rocks: int) -> Flown:
    """Return a number of rocks that flew with a set; those of earlier rounds do not fly again."""
    before = max((one.rocks for one in ROUNDS if one.rocks < rocks), default=0)
    new = site(SEARCH_SEED).fly(dict(parameters), range(before, rocks))
    return joined([_searched(parameters, before), new]) if before else new


def simulated(ground: Ground, rocks: int = ROCKS) -> tuple[dict[str, Any], Flown]:
    """Fly the four scanned blocks with a set of parameters; return the figures of the page, and the end points."""
    flown = site(authume.REPORT_SEED).fly(ground, range(rocks))
    return compared(flown), flown


def compared(flown: Flown) -> dict[str, Any]:
    """Return the figures of flown rocks, as of any model, and whether they reach each bar."""
    found = authume.compared(flown.ends)
    return {**found, "bars": {name: low <= found[name] <= high for name, (low, high) in BARS.items()}}


def chance(flown: Flown) -> dict[str, float]:
    """Return the standard error of each figure of `BARS` that the number of flown rocks leaves, by resampling rocks."""
    ends, draws = authume.in_field_datum(flown.ends.end), np.random.default_rng(SEED)
    x, across = ends[:, 0], authume.seen(ends).across
    found = []
    for _ in range(CHANCE_SAMPLES):
        some = draws.integers(0, len(x), len(x))
        beyond = (x[some] > authume.FAR).mean()
        found.append((x[some].mean(), x[some].std(ddof=1), across[some].std(ddof=1), beyond))
    return dict(zip(BARS, np.std(found, axis=0).tolist(), strict=True))


def by_shape(flown: Flown) -> list[dict[str, Any]]:
    """Return the figures of the rocks of each scanned block."""
    shapes = site(authume.REPORT_SEED).shapes
    return [
        {"shape": shape.name, "mass": DENSITY * shape.volume, **_brief(flown, flown.shape == k)}
        for k, shape in enumerate(shapes)
    ]


def variants(ground: Ground) -> dict[str, Any]:
    """Return the figures of rocks with the blocks' masses, and with their proportions too; and from one drop point."""
    own = site(authume.REPORT_SEED).shapes
    masses = [of_mass(shape, mass) for mass, *_ in blocks() for shape in own]
    alike = [stretched(shape, lengths, mass) for mass, *lengths in blocks() for shape in own]
    weighed, shaped = _flown(ground, masses, OTHER_ROCKS), _flown(ground, alike, ROCKS)
    single = BlockSite(_from_one_point()).fly(ground, range(OTHER_ROCKS))
    return {
        "masses": compared(weighed),
        "proportions": compared(shaped),
        "one_point": compared(single),
        "by_mass": by_block(weighed, len(own)),
        "by_block": by_block(shaped, len(own)),
    }


def _flown(ground: Ground, shapes: Sequence[Polyhedron], rocks: int) -> Flown:
    return BlockSite(scene(rocks, authume.REPORT_SEED), shapes).fly(ground, range(rocks))


def _from_one_point() -> Scene:
    """Return the scene with all rocks released at the mean drop point, so that only their orientations differ."""
    whole = scene(OTHER_ROCKS, authume.REPORT_SEED)
    source = {"name": "one", "points": [authume.drop().tolist()], "rocks": OTHER_ROCKS, "velocity": [0.0, 0.0, 0.0]}
    written = {name: getattr(whole, name) for name in whole.model_fields_set if name != "sources"}
    return Scene.model_validate({**written, "sources": [source]})


def by_block(flown: Flown, hulls: int) -> dict[str, Any]:
    """Return how mean simulated x and observed x of the 41 blocks correlate, and what each is correlated with.

    hulls : number of shapes in a row that belong to one block
    """
    seen, (mass, L1, L2, L3) = authume.end_points()[:, 0], blocks().T
    block = flown.shape // hulls
    mean = np.array([flown.ends.end[block == k, 0].mean() for k in range(len(seen))])
    within = np.array([flown.ends.end[block == k, 0].std(ddof=1) for k in range(len(seen))])
    causes = {"mass": mass, "L2/L1": L2 / L1, "L3/L1": L3 / L1}
    return {
        "correlation": _correlation(mean, seen),
        "sd_of_means": float(mean.std(ddof=1)),
        "sd_within": float(np.sqrt((within**2).mean())),
        "rocks_a_block": float(len(block) / len(seen)),
        "simulated": {name: _correlation(mean, cause) for name, cause in causes.items()},
        "field": {name: _correlation(seen, cause) for name, cause in causes.items()},
        "by_chance": chance_of_correlation(len(seen)),
    }


def chance_of_correlation(n: int) -> float:
    """Return the correlation of n independent pairs that 95 % stay below (Fisher's transform)."""
    return float(np.tanh(1.645 / np.sqrt(n - 3)))


def _correlation(a: FloatArray, b: FloatArray) -> float:
    return float(np.corrcoef(a, b)[0, 1])


def _brief(flown: Flown, chosen: Any) -> dict[str, float]:
    found = authume.figures_of(authume.in_field_datum(flown.ends.end[chosen]))
    names = ("mean", "sd", "side_mean", "side_sd", "beyond")
    return {"rocks": int(chosen.sum()), **{name: found[name] for name in names}}
