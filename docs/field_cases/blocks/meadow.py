"""Rocks with a shape at Tschamut: each run's rocks have the mass and the proportions of the run's block."""

import csv
from collections.abc import Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from field_cases import tschamut
from field_cases.authume import REPORT_SEED, SEARCH_SEED
from field_cases.blocks.flying import BlockSite, Flown, Ground, joined
from field_cases.blocks.race import Parameters, Round, race
from field_cases.blocks.shapes import DENSITY, equant
from field_cases.search import Found, Free
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.choices import chosen_scene
from rpf3d_core.shapes.polyhedron import Polyhedron

FREE = (
    Free("restitution", 0.0, 0.3, 4),
    Free("friction", 0.40, 0.80, 5),
    Free("rolling_resistance", 0.06, 0.42, 13),
)
"""The range of friction and rolling resistance is higher than at Authume: soil is softer than rock."""
ROUNDS = (Round(4, 40), Round(16, 8), Round(60, 8))
"""Rocks of each of the 18 runs."""
ROCKS_A_RUN = 150
ABOVE = 3.0
"""Height of the centre of mass above the ground at the release, in radii of the sphere of equal volume.

A corner of the flattest block is 2.2 radii from its centre, and the ground near a release may rise.
"""


@lru_cache
def blocks() -> dict[str, tuple[str, Polyhedron]]:
    """Return the name and the shape of each block, by its number in the files: its mass, and its three lengths."""
    return {
        line["block_id"]: (line["name"], equant([float(line[f"size_{a}_m"]) for a in "xyz"], float(line["mass_kg"])))
        for line in _lines("block_metadata")
    }


@lru_cache
def block_of_run() -> list[str]:
    """Return the number of the block of each run, in the order of `tschamut.runs()`."""
    of = {line["trajectory_id"]: line["block_id"] for line in _lines("release_points")}
    return [of[name] for name in tschamut.runs().names]


@lru_cache
def site(seed: int) -> BlockSite:
    """Return the meadow; each run is a source, and its rocks have the shape of its block."""
    names = list(blocks())
    shapes = [shape for _, shape in blocks().values()]
    return BlockSite(_scene(seed), shapes, [names.index(block) for block in block_of_run()])


def _scene(seed: int) -> Scene:
    field = tschamut.runs()
    sources = [
        {
            "name": name, "points": [[*map(float, field.release[i, :2]), 0.0]],
            "above_ground": ABOVE * float(np.cbrt(field.mass[i] / DENSITY / (4.0 / 3.0 * np.pi))),
            "velocity": [*map(float, field.velocity[i])],
            "spread": [tschamut.SPREAD, tschamut.SPREAD, 0.0], "rocks": ROCKS_A_RUN,
        }
        for i, name in enumerate(field.names)
    ]  # fmt: skip
    scene = Scene.model_validate({
        "path": Path("tschamut_2014_blocks.yaml"),
        "terrain": {"files": [{"path": str(tschamut.DATA / "terrain.asc"), "zone": "meadow"}]},
        "materials": {"default": {"restitution": 0.0, "friction": 0.5, "rolling_resistance": 0.1}},
        "rock": {"density": DENSITY, "shape": {"family": "equant"}},
        "sources": sources,
        "contact": "rigid",
        "stop_speed": 0.5,
    })  # fmt: skip
    return chosen_scene(scene, None, "compiled", seed)


def calibrate(some: Sequence[int]) -> list[Found]:
    """Return the sets with the smallest mean absolute error of runout over some runs, the best first."""

    def error(parameters: Parameters, rocks: int) -> float:
        return float(np.abs(_searched_errors(tuple(parameters.items()), rocks)[list(some)]).mean())

    return race(error, FREE, ROUNDS)


@cache
def _searched_errors(parameters: tuple[tuple[str, float], ...], rocks: int) -> FloatArray:
    return tschamut.errors_of(by_run(_searched(parameters, rocks)).ends)


@cache
def _searched(parameters: tuple[tuple[str, float], ...], rocks: int) -> Flown:
    """Return rocks of each run that flew with a set; those of earlier rounds do not fly again."""
    before = max((one.rocks for one in ROUNDS if one.rocks < rocks), default=0)
    new = site(SEARCH_SEED).fly(dict(parameters), range(before, rocks))
    return joined([_searched(parameters, before), new]) if before else new


def by_run(flown: Flown) -> Flown:
    """Return flown rocks in the order of their runs, as the tables of Tschamut need them."""
    order = np.argsort(flown.ends.source, kind="stable")
    ends = flown.ends
    return Flown(type(ends)(ends.source[order], ends.end[order], ends.stopped[order]), flown.shape[order])


def simulated(ground: Ground) -> tuple[dict[str, Any], Flown]:
    """Fly the rocks of all runs with a set of parameters; return the figures of the page, and the end points."""
    flown = site(REPORT_SEED).fly(ground, range(ROCKS_A_RUN))
    return tschamut.compared(flown.ends), flown


def by_block(flown: Flown) -> list[dict[str, Any]]:
    """Return the observed and the simulated mean runout of each block's distinct runs."""
    errors, seen = tschamut.errors_of(flown.ends), tschamut.runs().seen().runout
    distinct, of_run = tschamut.runs().distinct(), block_of_run()
    found = []
    for number, (name, shape) in blocks().items():
        runs = [i for i in distinct if of_run[i] == number]
        found.append({
            "block": name, "mass": DENSITY * shape.volume, "runs": len(runs), "field": float(seen[runs].mean()),
            "simulated": float((seen + errors)[runs].mean()),
        })  # fmt: skip
    return found


def _lines(name: str) -> list[dict[str, str]]:
    with (tschamut.DATA / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))
