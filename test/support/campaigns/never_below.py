"""Release rocks on vertices, edges and facets of random meshes, and check that no rock falls below the ground.

    PYTHONPATH=test/support:. python -m campaigns.never_below --rocks 1250000 --first 1
    PYTHONPATH=test/support:. python -m campaigns.never_below --roughness 5    the same on rough ground

The program prints one line a family, and the seed of each fault.

A case is a mesh, 250 rocks and one set of models, drawn from a family and a seed
(`test/support/meshes/random_ground.py`).
"""

import argparse
import math
import sys
import time
from collections import Counter
from dataclasses import replace

import numpy as np
from flights.scenes_of_facets import engine_over, released, same_bits
from meshes.held_in_gullies import held_too_early
from meshes.random_ground import FAMILIES, Case, case_of, fallen, in_the_air
from numpy.typing import NDArray

from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.effects.roughness import RocfallRoughness
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.values import Outcome

ROCKS = 250
"""Rocks in each case."""
FEW = 20
"""Number of rocks of a case that also fly on the reference engine, which takes a thousand times as long."""


def flown(case: Case, engine: str = "compiled", some: slice = slice(None)) -> Flights:
    """Return the flights of a case's rocks on an engine; some : rows of the rocks to fly."""
    return fly_ensemble(engine_over(engine, case.terrain), case.flight, released(case.x[some], case.v[some]), threads=1)


def engines_differ(case: Case) -> bool:
    """Return True if any bit of the results differs between the engines for the first FEW rocks of a case."""
    first = slice(0, FEW)
    return not same_bits(flown(case, "compiled", first), flown(case, "reference", first))


def guarded(flights: Flights) -> NDArray[np.int64]:
    """Return the rows of the rocks that the simulator itself detected as fallen through the ground.

    docs/explanation/never-below.md explains how the simulator detects them.
    """
    return np.flatnonzero(flights.deposits.outcome == Outcome.FELL_THROUGH)


def on_rough_ground(case: Case, degrees: float) -> Case:
    """Return the case with a normal that is tilted at random in each impact.

    degrees : standard deviation of the tilt; 0 to return the case unchanged
    """
    if not degrees:
        return case
    models = case.flight.models._replace(effects=chain_of([RocfallRoughness(math.radians(degrees))]))
    flight = replace(case.flight, models=models)
    return replace(case, flight=flight, words=f"{case.words}, roughness {degrees:g} degrees")


def held(case: Case, flights: Flights) -> NDArray[np.int64]:
    """Return the rows of the rocks that a gully stopped although they would bounce out of it; none on rough ground."""
    if case.flight.models.effects is not None:
        return np.empty(0, dtype=np.int64)  # the check computes bounces with the normals of the facets
    facets = case.terrain.vertices[case.terrain.triangles]
    return held_too_early(facets, flights, case.flight.settings, float(case.flight.materials.R_n[0]))


def wrongs(case: Case, flights: Flights, both: bool) -> int:
    """Print the faults of a case's flights, with the seed of the case; return the number of faults.

    both : True to compare the engines as well; a difference is one fault
    """
    rows = {
        "fell": fallen(case, flights),
        "hang": in_the_air(case, flights),
        "guarded": guarded(flights),
        "held": held(case, flights),
    }
    for word, some in rows.items():
        if len(some):
            print(f"  {len(some)} {word}, rows {some[:5].tolist()}: {case.words}", flush=True)
    differ = both and engines_differ(case)
    if differ:
        print(f"  engines differ: {case.words}", flush=True)
    return sum(map(len, rows.values())) + differ


def campaign(family: str, seeds: range, rebounds: list[str], both: int, degrees: float = 0.0) -> int:
    """Fly the cases of a family and print one line; return the number of faults.

    rebounds : names of rebound models, which the seeds have in turn; both : n, every n-th seed flies on both engines
    degrees : roughness of the ground, as in `on_rough_ground`
    """
    began, outcomes, wrong = time.process_time(), Counter[str](), 0
    for seed in seeds:
        case = on_rough_ground(case_of(family, seed, ROCKS, rebounds[seed % len(rebounds)]), degrees)
        flights = flown(case)
        outcomes.update(Outcome(o).name.lower() for o in flights.deposits.outcome.tolist())
        wrong += wrongs(case, flights, seed % both == 0)
    counts = ", ".join(f"{number} {word}" for word, number in outcomes.most_common())
    seconds = time.process_time() - began
    print(f"{family}: {len(seeds) * ROCKS} rocks, {wrong} wrong ({counts}); {seconds:.0f} s", flush=True)
    return wrong


def main() -> int:
    """Fly the campaign; return 1 if there is a fault (`wrongs`), else 0."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rocks", type=int, default=1_250_000)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--family", choices=sorted(FAMILIES), action="append")
    parser.add_argument("--rebound", choices=["constant", "coulomb_limited"], action="append")
    parser.add_argument("--both", type=int, default=20, help="every n-th case flies on both engines")
    parser.add_argument("--roughness", type=float, default=0.0, help="standard deviation of the tilt (degrees)")
    asked = parser.parse_args()
    families, rebounds = asked.family or sorted(FAMILIES), asked.rebound or ["constant"]
    seeds = range(asked.first, asked.first + max(-(-asked.rocks // (ROCKS * len(families))), 1))
    wrong = sum(campaign(family, seeds, rebounds, asked.both, asked.roughness) for family in families)
    print(f"{len(seeds) * ROCKS * len(families)} rocks, seeds {seeds[0]} to {seeds[-1]}: {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
