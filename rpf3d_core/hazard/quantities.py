"""Names and units of the quantities of a hazard map, the same in rasters, meshes and pictures.

Arrays (S,) have the values of the S cells that rocks reached; all other cells have the value `Quantity.elsewhere`.
"""

import math
from typing import NamedTuple

from rpf3d_core.hazard.maps import (
    PERCENTILES,
    CellStatistics,
    CountArray,
    HazardMaps,
    Layers,
    StatisticArray,
    reach_probability,
)
from rpf3d_core.terrain.frame import FloatArray

STATISTICS = ("max", "mean", *(f"p{p}" for p in PERCENTILES))
"""Names of the statistics of a quantity in files, in the order of bands.

Each statistic is over the distinct rocks that reached a cell, of each rock's largest value there.
"""


class Quantity(NamedTuple):
    """A quantity of a hazard map, as files describe it: name, unit, meaning, and its value in cells without rocks."""

    name: str
    unit: str
    meaning: str
    elsewhere: float = math.nan


REACH = Quantity(
    name="reach_probability",
    unit="1",
    meaning="share of all simulated rocks that reached this cell, given that they fall",
    elsewhere=0,
)
REACH_LOW = Quantity(
    name="reach_probability_low",
    unit="1",
    meaning="lower end of the 95 % predictive interval of reach probability over the parameter sets",
    elsewhere=0,
)
REACH_HIGH = Quantity(
    name="reach_probability_high",
    unit="1",
    meaning="upper end of the 95 % predictive interval of reach probability over the parameter sets",
    elsewhere=0,
)
PER_METRE = Quantity(
    name="passage_per_metre",
    unit="1/m",
    meaning="passages per metre across the rocks' way over all rocks flown, given that they fall",
    elsewhere=0,
)
PASSAGES = Quantity(name="passages", unit="1", meaning="times a rock entered, or was released here", elsewhere=0)
IMPACTS = Quantity(name="impacts", unit="1", meaning="impacts on the ground", elsewhere=0)
DEPOSITS = Quantity(name="deposits", unit="1", meaning="rocks that stopped here", elsewhere=0)
ARRIVAL = Quantity(name="first_arrival_s", unit="s", meaning="time from its release until the fastest rock came")
ENERGY = Quantity(name="energy_j", unit="J", meaning="kinetic energy, as `HazardMaps.energy_kind`")
SPEED = Quantity(name="speed_m_s", unit="m/s", meaning="speed")
HEIGHT = Quantity(name="height_m", unit="m", meaning="vertical height above the terrain straight below")


REACH_WORST = Quantity(
    name="reach_probability_worst_source",
    unit="1",
    meaning="largest share of the rocks of one source that reached this cell, given that they fall; band source: "
    "number of this source in the scene, from 1",
    elsewhere=0,
)
ENERGY_WORST = Quantity(
    name="energy_j_worst_source",
    unit="J",
    meaning="largest p95 energy of all rocks together and of all sources with 20 rocks in this cell; band source: "
    "number of this source in the scene, from 1, or 0 for all rocks together",
)


def shares_of(maps: HazardMaps, layers: Layers) -> list[tuple[Quantity, FloatArray]]:
    """Return the quantities reach probability (-) and first arrival (s), each with its values (S,) in cells."""
    return [(REACH, reach_probability(layers, maps.flown)), (ARRIVAL, layers.first_arrival)]


def counts_of(layers: Layers) -> list[tuple[Quantity, CountArray]]:
    """Return the quantities passages, impacts and deposits, each with its counts (S,) in cells."""
    return [(PASSAGES, layers.passages), (IMPACTS, layers.impacts), (DEPOSITS, layers.deposits)]


def spreads_of(layers: Layers) -> list[tuple[Quantity, CellStatistics]]:
    """Return the quantities energy (J), speed (m/s) and height (m), each with its statistics (S,) in cells."""
    return [(ENERGY, layers.energy), (SPEED, layers.speed), (HEIGHT, layers.height)]


def statistics_of(spread: CellStatistics) -> tuple[StatisticArray, ...]:
    """Return the arrays (S,) of a quantity's statistics in the order in which files store them (`STATISTICS`)."""
    return (spread.largest, spread.mean, spread.p50, spread.p90, spread.p95, spread.p99)
