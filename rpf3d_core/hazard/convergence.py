"""Decide if enough rocks have flown: compare the results in zones or areas after each doubling of the number of rocks.

Two conditions must hold (docs/explanation/statistics.md). Half the width of the 95 % Wilson interval of each share is
at most the target for shares. No p95 energy has changed by more than the target for energies over the last two
doublings of the number of rocks. Mean values are not compared.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.maps import HazardMaps

DOUBLINGS = 2
"""Number of last doublings of the rocks in which p95 energies must stay nearly the same."""


@dataclass(frozen=True)
class Place:
    """The results in one zone or area of interest, from which the program decides whether more rocks must fly.

    reached, stopped : shares of all rocks (-); half_width : half the width of the wider of their 95 % intervals (-)
    energy_p95 : J, None for fewer than 20 rocks
    """

    reached: float
    stopped: float
    half_width: float
    energy_p95: float | None


@dataclass(frozen=True)
class Step:
    """The results in all places, by name, after `rocks` rocks have flown: one step of the convergence."""

    rocks: int
    places: Mapping[str, Place]

    @property
    def half_width(self) -> float:
        """The largest half-width (-) of the 95 % interval of a share, over all places; 0 without places."""
        return max((place.half_width for place in self.places.values()), default=0.0)


def step_of(maps: HazardMaps, zones: Sequence[str]) -> Step:
    """Return the results in all areas of interest or, if the scene has no areas, in the zones that rocks reached.

    maps : hazard maps of at least one rock
    zones : names of all zones, in the terrain's order
    """
    layers, names = (maps.areas, maps.area_names) if maps.area_names else (maps.zones, zones)
    rocks, deposits = layers.everywhere(layers.rocks, 0), layers.everywhere(layers.deposits, 0)
    energy = layers.everywhere(layers.energy.p95, np.nan)
    places = {
        name: _place(int(rocks[i]), int(deposits[i]), maps.flown, float(energy[i]))
        for i, name in enumerate(names)
        if maps.area_names or rocks[i] > 0
    }
    return Step(maps.flown, places)


def _place(reached: int, stopped: int, rocks: int, energy: float) -> Place:
    intervals = [wilson_interval(count, rocks) for count in (reached, stopped)]
    half_width = max(0.5 * (high - low) for low, high in intervals)
    return Place(reached / rocks, stopped / rocks, half_width, energy if np.isfinite(energy) else None)


def p95_change(steps: Sequence[Step]) -> float | None:
    """Return the largest relative change (-) of a p95 energy over the last two doublings of the number of rocks.

    The result is None after fewer than two doublings. The last step is compared with each of the two steps before it.
    If a place has a p95 energy in the last step, but none in an earlier step, the change is 1. Places without a p95
    energy in the last step are skipped; if all are, the result is 0.
    """
    if len(steps) <= DOUBLINGS:
        return None
    changes = [0.0]
    for step in steps[-1 - DOUBLINGS : -1]:
        for name, place in steps[-1].places.items():
            before = step.places.get(name)
            if place.energy_p95 is not None:
                changes.append(_relative_change(before.energy_p95 if before is not None else None, place.energy_p95))
    return max(changes)


def _relative_change(before: float | None, last: float) -> float:
    """Return the relative change (-) from an energy to the last energy; 1 if the former is unknown or the last is 0.

    If both are 0, as for rocks that rest where they start, the result is 0.
    """
    if before == last:
        return 0.0
    return abs(before / last - 1.0) if before is not None and last > 0.0 else 1.0


def is_enough(steps: Sequence[Step], half_width: float, p95_energy: float) -> bool:
    """Return True if enough rocks have flown: the last step reaches the targets for shares and for p95 energies.

    The result is False after fewer than two doublings of the number of rocks.

    half_width : target for half the width of the interval of a share (-)
    p95_energy : target for the relative change of a p95 energy (-)
    """
    change = p95_change(steps)
    return change is not None and change <= p95_energy and steps[-1].half_width <= half_width


def convergence_section(steps: Sequence[Step], half_width: float, p95_energy: float) -> dict[str, Any]:
    """Return the convergence for summary.json: targets, whether they were reached, last values, and all steps.

    half_width : target for half the width of the interval of a share (-)
    p95_energy : target for the relative change of a p95 energy (-)
    """
    return {
        "target": {"half_width": half_width, "p95_energy": p95_energy},
        "reached": is_enough(steps, half_width, p95_energy),
        "half_width": steps[-1].half_width,
        "p95_energy_change": p95_change(steps),
        "steps": [
            {"rocks": step.rocks, "places": {name: vars(place) for name, place in step.places.items()}}
            for step in steps
        ],
    }
