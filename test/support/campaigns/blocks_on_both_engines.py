"""Fly rocks (blocks) of the first source of a scene on both engines, and compare their results bit by bit.

PYTHONPATH=test/support:. python -m campaigns.blocks_on_both_engines config/scenes/authume_p1_blocks.yaml --blocks 1000

The reference engine is plain Python and takes seconds for a block, so several processes share the work. The program
prints each group of blocks in which a number differs; its exit code is 1 if there is such a group, else 0.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.flights import Deposits, Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare, releases_in_ranges

ENGINES = ("reference", "compiled")
GROUP = 10
"""Number of blocks that a process flies at a time."""


def flown(scene_file: Path, engine: str, first: int, count: int) -> Flights:
    """Return the flights of `count` blocks of a scene's first source.

    engine : name of the engine; first : number of the first block, from 0
    """
    prepared = prepare(read_scene(scene_file).model_copy(update={"engine": engine}))
    ranges = [range(first, first + count), *[range(0)] * (len(prepared.sources) - 1)]
    return fly_ensemble(prepared.engine, prepared.flight, releases_in_ranges(prepared, ranges))


def differences(one: Flights, other: Flights) -> list[str]:
    """Return the names of the columns of deposits, impacts and paths whose bits differ."""
    return [f"{table}.{name}" for table in ("deposits", "impacts", "paths")
            for name, a, b in _columns(getattr(one, table), getattr(other, table))
            if not _same_bits(a, b)]  # fmt: skip


def _columns(one: object, other: object) -> Iterator[tuple[str, object, object]]:
    for column in fields(one):  # type: ignore[arg-type]
        yield column.name, getattr(one, column.name), getattr(other, column.name)


def _same_bits(a: object, b: object) -> bool:
    """Return True if two columns have the same type, shape and bits, or if both are None."""
    if a is None or b is None:
        return a is b
    x, y = np.asarray(a), np.asarray(b)
    return x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes()


def _compared(scene_file: Path, first: int) -> tuple[int, list[str], Deposits, int]:
    """Fly GROUP blocks from number `first` on with both engines, and compare their results.

    Returns `first`, the names of the columns that differ, and the compiled engine's deposits and number of impacts.
    """
    one, other = (flown(scene_file, engine, first, GROUP) for engine in ENGINES)
    return first, differences(one, other), other.deposits, len(other.impacts.t)


def main() -> int:
    """Compare all blocks and print the report; return the exit code."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("scene", type=Path)
    asked.add_argument("--blocks", type=int, default=1000)
    given, began, wrong = asked.parse_args(), time.monotonic(), 0
    deposits, impacts = [], 0
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        groups = range(0, given.blocks, GROUP)
        for first, names, ends, hits in pool.map(_compared, [given.scene] * len(groups), groups):
            deposits.append(ends)
            impacts += hits
            wrong += bool(names)
            if names:
                print(f"blocks {first} to {first + GROUP - 1} differ in {', '.join(names)}", flush=True)
    blocks = sum(len(ends.rock) for ends in deposits)
    path = sum(float(ends.path.sum()) for ends in deposits)
    print(f"{given.scene.stem}: {blocks:,} blocks, {impacts:,} impacts, {path:,.0f} m of path on both engines, "
          f"{wrong} groups of {GROUP} with a different bit; {time.monotonic() - began:.0f} s")  # fmt: skip
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
