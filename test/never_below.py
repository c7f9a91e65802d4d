"""The campaign of releases on vertices, edges and faces: no rock may be below the ground that it was above.

    python test/never_below.py --rocks 1000000 --first 1     print a line for each family, and each fall by its seed

A case is a mesh, 250 rocks and one physics, drawn from a family and a seed (`test/random_ground.py`).
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from random_ground import FAMILIES, Case, case_of, fallen, in_the_air
from scenes_of_facets import engine_over, released, same_bits

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.values import Outcome

ROCKS = 250
"""Rocks of a case."""
FEW = 20
"""Rocks of a case that the reference engine flies as well: it takes a thousand times as long."""


def flown(case: Case, engine: str = "compiled", some: slice = slice(None)) -> Flights:
    """The flights of a case's rocks, or of some of them, on an engine."""
    return fly_ensemble(engine_over(engine, case.terrain), case.flight, released(case.x[some], case.v[some]), threads=1)


def engines_differ(case: Case) -> bool:
    """Whether the engines give other bits for the first rocks of a case."""
    first = slice(0, FEW)
    return not same_bits(flown(case, "compiled", first), flown(case, "reference", first))


def main() -> int:
    """Fly the campaign; the exit code is 1 if a rock fell, hung in the air, or differed between the engines."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rocks", type=int, default=1_000_000)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--family", choices=sorted(FAMILIES), action="append")
    parser.add_argument("--rebound", choices=["constant", "coulomb_limited"], action="append")
    parser.add_argument("--both", type=int, default=20, help="every n-th case flies on both engines")
    asked = parser.parse_args()
    families, rebounds = asked.family or sorted(FAMILIES), asked.rebound or ["constant"]
    cases = max(asked.rocks // (ROCKS * len(families)), 1)
    bad = 0
    for family in families:
        began, seen, wrong = time.perf_counter(), Counter(), 0
        for seed in range(asked.first, asked.first + cases):
            case = case_of(family, seed, ROCKS, rebounds[seed % len(rebounds)])
            flights = flown(case)
            seen.update(Outcome(o).name.lower() for o in flights.deposits.outcome.tolist())
            both = seed % asked.both == 0
            for word, rows in (("fell", fallen(case, flights)), ("hang", in_the_air(case, flights))):
                if len(rows):
                    wrong += len(rows)
                    print(f"  {len(rows)} {word}, rows {rows[:5].tolist()}: {case.words}", flush=True)
            if both and engines_differ(case):
                wrong += 1
                print(f"  engines differ: {case.words}", flush=True)
        counts = ", ".join(f"{number} {word}" for word, number in seen.most_common())
        print(f"{family}: {cases * ROCKS} rocks, {wrong} wrong ({counts}); {time.perf_counter() - began:.0f} s", flush=True)
        bad += wrong
    print(f"{cases * ROCKS * len(families)} rocks, seeds {asked.first} to {asked.first + cases - 1}: {bad} wrong")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
