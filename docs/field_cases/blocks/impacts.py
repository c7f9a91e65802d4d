"""Rocks with a shape at Chant Sura: norm blocks with 24 corners that strike the ground in random orientations."""

import csv
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np

from field_cases import chant_sura
from field_cases.blocks.race import Parameters, Round, race
from field_cases.blocks.shapes import of_mass
from field_cases.blocks.striking import Law, after_contact
from field_cases.chant_sura import Impact
from field_cases.search import Found, Free
from rpf3d_core.ensemble.bodies import random_orientations
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.shapes.families import family
from rpf3d_core.shapes.polyhedron import Polyhedron

WHEEL, EQUANT = "eota221", "eota111"
SEED = 3
ORIENTATIONS = 1000
"""Orientations of each impact on the page."""
FREE = (
    Free("restitution", 0.0, 0.3, 4),
    Free("friction", 0.2, 1.0, 5),
    Free("rolling_resistance", 0.0, 0.4, 5),
    Free("slope_deg", 0.0, 40.0, 5, 1),
)
ROUNDS = (Round(25, 60), Round(100, 10), Round(400, 1))
"""Orientations of each contact."""
INTERVAL = (5.0, 95.0)


@lru_cache
def outlines() -> dict[str, list[float]]:
    """Return the published lengths (3,) m of the norm blocks of 1 m3, by family."""
    with (chant_sura.DATA / "rock_shapes.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    return {
        name: [float(line[f"max_{a}_m"]) - float(line[f"min_{a}_m"]) for a in "xyz"]
        for name, line in ((_family_of(line["shape_file"]), line) for line in lines)
    }


def _family_of(file: str) -> str:
    return WHEEL if "221" in file else EQUANT


def shape_of(impact: Impact) -> Polyhedron:
    """Return the norm block of an impact: equant if its run is named RFnnE, else the wheel; in its mass.

    The runs RFnnW and the six published impacts, of 780 kg, are wheels of 1:1:0.5 (Leine et al. 2021).
    """
    return _norm_block(EQUANT if impact.run[4:5].upper() == "E" else WHEEL, impact.rock.mass)


@cache
def _norm_block(name: str, mass: float) -> Polyhedron:
    return of_mass(family(name), mass)


@lru_cache
def _orientations(count: int) -> FloatArray:
    return random_orientations(SEED, 0, np.arange(count))


def speeds_after(parameters: Mapping[str, float], impact: Impact, count: int, spin: float = 0.0) -> FloatArray:
    """Return the speeds (count,) m/s after a contact, in as many random orientations.

    parameters : the ground's three numbers and, for a ground of unknown normal, the slope (degrees)
    spin : rad/s before the impact, positive for a block that rolls forwards
    """
    normal = impact.normal or chant_sura.dipping(impact.before, parameters["slope_deg"])
    axis = np.cross(normal, impact.before)
    w = spin / np.linalg.norm(axis) * axis
    starts = np.hstack([np.tile([*impact.before, *w], (count, 1)), _orientations(count)])
    law = Law(*(parameters[name] for name in Law._fields))
    after = after_contact(shape_of(impact), starts, np.tile(normal, (count, 1)), law)
    return np.asarray(np.linalg.norm(after[:, :3], axis=1))


def of_impacts(parameters: Mapping[str, float], impacts: Sequence[Impact], spin: float = 0.0) -> dict[str, Any]:
    """Return the predicted energy ratio of each impact, and the errors of the mean prediction, as for other models.

    intervals : 5 and 95 % of the orientations; inside : number of measured ratios within them
    """
    speed = [speeds_after(parameters, impact, ORIENTATIONS, spin) for impact in impacts]
    before = chant_sura.speeds([impact.before for impact in impacts])
    ratio = [(after / of) ** 2 for after, of in zip(speed, before, strict=True)]
    seen = chant_sura.measured_ratios(tuple(impacts))
    off = np.array([after.mean() for after in speed]) - [impact.speed_after for impact in impacts]
    mean = np.array([one.mean() for one in ratio])
    intervals = [tuple(float(v) for v in np.percentile(one, INTERVAL)) for one in ratio]
    return {
        "ratios": mean.tolist(),
        "intervals": intervals,
        "largest": [float(one.max()) for one in ratio],
        "inside": sum(bool(low <= of <= high) for (low, high), of in zip(intervals, seen, strict=True)),
        "ratio_mean": float((mean - seen).mean()),
        "ratio_absolute": float(np.abs(mean - seen).mean()),
        "speed_mean": float(off.mean()),
        "speed_rms": float(np.sqrt((off**2).mean())),
    }


def calibrate(some: Sequence[Impact]) -> Found:
    """Return the ground's numbers, and one slope, with the smallest rms error of the mean speed after some contacts."""

    def error(parameters: Parameters, count: int) -> float:
        given = tuple(parameters.items())
        off = [_mean_speed(given, impact, count) - impact.speed_after for impact in some]
        return float(np.sqrt(np.mean(np.square(off))))

    return race(error, FREE, ROUNDS)[0]


@cache
def _mean_speed(parameters: tuple[tuple[str, float], ...], impact: Impact, count: int) -> float:
    return float(speeds_after(dict(parameters), impact, count).mean())


def kept_out() -> float:
    """Return the rms error of speed (m/s) if each run is predicted with a calibration on the other four runs."""
    contacts, squares = chant_sura.contacts(), 0.0
    for run in sorted({impact.run for impact in contacts}):
        found = calibrate([impact for impact in contacts if impact.run != run]).parameters
        its = [impact for impact in contacts if impact.run == run]
        squares += len(its) * of_impacts(found, its)["speed_rms"] ** 2
    return float(np.sqrt(squares / len(contacts)))
