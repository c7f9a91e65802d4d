"""The blocks of Tschamut's runs: each has the mass and the three lengths of a real block."""

import csv
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from field_cases import tschamut
from field_cases.blocks.shapes import equant
from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.shapes.polyhedron import Polyhedron

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


def of_its_block(run: IntArray, shape: IntArray) -> NDArray[np.bool_]:
    """Return for each rock (N,) whether its shape is that of the block of its run."""
    numbers = list(blocks())
    own = np.array([numbers.index(block) for block in block_of_run()])
    return np.asarray(shape == own[run])


def _lines(name: str) -> list[dict[str, str]]:
    with (tschamut.DATA / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))
