"""Predict the stops of a site on unknown ground, with 64 parameter sets that all have the same number of rocks.

The parameter sets come from ranges of the library, which were chosen by the description of the ground alone, or from a
calibration at this or the other site. The prediction is the distribution of all rocks; rocks that did not stop count as
beyond every observed stop.
"""

import tempfile
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import rpf3d_core
from field_cases import authume, tschamut
from field_cases.authume import REPORT_SEED
from field_cases.basis import EndPoints
from field_cases.blocks import meadow
from field_cases.calibrations import SETS, sample_of
from field_cases.flying import Ends, Keys, with_keys
from field_cases.models import AUTHUME, COULOMB_LIMITED, MODELS, SHAPES, SPHERE, TSCHAMUT, Model
from field_cases.scenes import scene_file
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.unknowns.dealing import sets_of_rocks
from rpf3d_core.unknowns.parameter_sets import write_parameter_sets
from rpf3d_core.values import Outcome

LIBRARY, SINGLE = "library", "library, one value for each assumed range"
"""Origins of the ground of a case, as on the page."""
STOPS = {AUTHUME: 41, TSCHAMUT: tschamut.RUNS}
"""Number of observed stops of each site."""
ROCKS_OF_A_SET = {AUTHUME: 200, TSCHAMUT: 18 * 12}
"""Number of rocks of each parameter set; at Tschamut, 12 for each run."""
GROUND = {
    (AUTHUME, False): {"blue": "talus", "gray": "bedrock", "red": "talus"},
    (AUTHUME, True): {"blue": "ramms_medium", "gray": "ramms_hard", "red": "ramms_medium"},
    (TSCHAMUT, False): {"default": "soil"},
    (TSCHAMUT, True): {"default": "ramms_medium_soft"},
}
"""Site, and True for rocks with a shape (False for points and spheres) -> entries of the library by zone.

The entries were chosen by the description of the ground: talus, an outcrop of bedrock, an alpine meadow."""
ONE_VALUE = {"friction_angle_deg": 30.0, "rolling_friction": 0.575, "rolling_resistance": 0.2}
"""One value for each range that a scene assumes: the default friction angle, and the middle of other ranges."""
ASSUMED_FOR = {COULOMB_LIMITED: ("friction_angle_deg",), SPHERE: ("friction_angle_deg", "rolling_friction"),
               SHAPES: ("rolling_resistance",)}  # fmt: skip
LOW, HIGH = 0.05, 0.95
"""The ends of a 90 % interval."""


class Case(NamedTuple):
    """A prediction.

    ground : origin of the ground, as on the page; keys : keys of the scene that define the ground
    """

    site: str
    model: Model
    ground: str
    keys: Keys


class Predicted(NamedTuple):
    """The rocks of a prediction: end points, and the number (N,) of the parameter set of each rock.

    At Tschamut, rocks with a shape are left out if their shape is not that of their run's block.
    """

    ends: Ends
    set: IntArray


def cases_of_books() -> Iterator[Case]:
    """Yield the cases with ground of the library, with assumed ranges, and with one value in place of each of them."""
    for site in (AUTHUME, TSCHAMUT):
        for model, assumed in ASSUMED_FOR.items():
            single = {key: ONE_VALUE[key] for key in assumed}
            for ground, more in ((LIBRARY, {}), (SINGLE, single)):
                zones = GROUND[site, model == SHAPES]
                materials = {zone: {"library": entry, **more} for zone, entry in zones.items()}
                yield Case(site, model, ground, {"materials": materials})


def cases_of_calibrations(calibrations: Mapping[str, Any], same_site: bool) -> Iterator[Case]:
    """Yield the cases of all models with the ground of a calibration at the same site, or at the other site.

    calibrations : results of `calibrations.calibrate`; same_site : False for the other site
    """
    for site, other in ((AUTHUME, TSCHAMUT), (TSCHAMUT, AUTHUME)):
        source = site if same_site else other
        for model in MODELS:
            sample = _written(f"{source}_{model.impact}", calibrations[source][model.name])
            yield Case(site, model, f"calibrated at {source}", {"unknowns": {"sample": sample, "sets": SETS}})


def _written(name: str, calibration: Mapping[str, Any]) -> Path:
    """Write the parameter sets of a calibration to a temporary file, and return its path."""
    path = Path(_folder().name) / f"{name}.parquet"
    write_parameter_sets(path, sample_of(calibration))
    return path


@lru_cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


def predicted(case: Case) -> Predicted:
    """Return the rocks of a case after their flight; with REPORT_SEED, they are not the rocks of the calibration."""
    scene = with_keys(_scene(case.site, case.model), {**case.keys, "observed": None, "calibration": None})
    run = rpf3d_core.simulate(scene, rocks=SETS * ROCKS_OF_A_SET[case.site])
    of = run.flights.deposits
    ends = Ends(of.source, run.terrain.frame.points_to_input(of.x), of.outcome == Outcome.STOPPED)
    found = Predicted(ends, _sets_of(of.source, of.rock))
    if case.site == TSCHAMUT and of.shape is not None:
        return some_of(found, meadow.of_its_block(of.source, of.shape))
    return found


def _sets_of(source: IntArray, rock: IntArray) -> IntArray:
    """Return the number (N,) of the parameter set of each rock, from its source and its number within the source."""
    found = np.empty_like(rock)
    for one in np.unique(source).tolist():
        found[source == one] = sets_of_rocks(rock[source == one], SETS, one)
    return found


def some_of(rocks: Predicted, chosen: FloatArray) -> Predicted:
    """Return some rocks of a prediction; chosen : (N,) True for these rocks."""
    ends = rocks.ends
    return Predicted(Ends(ends.source[chosen], ends.end[chosen], ends.stopped[chosen]), rocks.set[chosen])


def figures_of(site: str, rocks: Predicted) -> dict[str, Any]:
    """Return the figures of a prediction by name: of all rocks, coverage, and ranges over the parameter sets.

    `along` and `across` are the shares of `coverage`. `over_sets` has the 5th and 95th percentile, over the parameter
    sets alone, of the figures in OVER_SETS.
    """
    compared = authume.compared if site == AUTHUME else tschamut.compared
    along, across = coverage(site, rocks)
    return {**compared(rocks.ends), "along": along, "across": across, "over_sets": _over_sets(site, rocks)}


OVER_SETS = {AUTHUME: ("mean", "sd", "side_sd", "beyond"), TSCHAMUT: ("error_mean", "runout_sd", "side_sd")}


def _over_sets(site: str, rocks: Predicted) -> dict[str, tuple[float, float]]:
    names = OVER_SETS[site]
    alone = [_brief(site, some_of(rocks, rocks.set == number).ends) for number in range(SETS)]
    found = np.quantile([[of[name] for name in names] for of in alone], (LOW, HIGH), axis=0)
    return {name: (float(low), float(high)) for name, low, high in zip(names, *found, strict=True)}


def _brief(site: str, ends: Ends) -> dict[str, Any]:
    """Return the figures of the rocks of one parameter set."""
    if site == AUTHUME:
        return authume.figures_of(authume.in_field_datum(ends.end))
    return {**tschamut.figures_of(ends.source, ends.end), "error_mean": float(np.nanmean(tschamut.errors_of(ends)))}


def coverage(site: str, rocks: Predicted) -> tuple[float, float]:
    """Return the shares of the observed stops within the 90 % intervals of a prediction, along and across the slope."""
    places = _places_at_authume(rocks) if site == AUTHUME else _places_at_tschamut(rocks)
    return _within(places)


def held(line: Mapping[str, Any], way: str) -> int:
    """Return the number of observed stops in the 90 % intervals of a line of the page; way : `along` or `across`."""
    return round(float(line[way]) * STOPS[line["site"]])


def held_of_all(line: Mapping[str, Any], way: str) -> str:
    """Return the number of `held` and the number of all observed stops as text, such as `40 of 41`."""
    return f"{held(line, way)} of {STOPS[line['site']]}"


Places = list[tuple[float, float]]
"""For each observed stop, the two shares (-) that `_places` returns."""


def _places_at_authume(rocks: Predicted) -> Places:
    """Return the places of the stops of the 41 blocks among the stops of all rocks."""
    field, simulated = authume.seen(authume.end_points()), authume.seen(authume.in_field_datum(rocks.ends.end))
    return [_places(simulated, rocks.ends.stopped, field.along[k], field.across[k]) for k in range(len(field.along))]


def _places_at_tschamut(rocks: Predicted) -> Places:
    """Return the places of the stops of the 18 runs among the stops of all rocks of the same run."""
    field, ends, places = tschamut.runs().seen(), rocks.ends, []
    for run in range(tschamut.RUNS):
        its = ends.source == run
        simulated = tschamut.seen(ends.source[its], ends.end[its])
        places.append(_places(simulated, ends.stopped[its], field.along[run], field.across[run]))
    return places


def _places(rocks: EndPoints, stopped: FloatArray, along: float, across: float) -> tuple[float, float]:
    """Return the share of the rocks that end before a stop along the slope, and of the stopped rocks on one side of it.

    along, across : position (m) of the stop; stopped : (N,) False for rocks that count as beyond every stop
    """
    beyond = np.where(stopped, rocks.along, np.inf)
    beside = rocks.across[stopped] < across
    return float((beyond < along).mean()), float(beside.sum() / max(len(beside), 1))


def _within(places: Places) -> tuple[float, float]:
    along, across = (((values > LOW) & (values < HIGH)).mean() for values in np.array(places).T)
    return float(along), float(across)


@lru_cache
def _scene(site: str, model: Model) -> Scene:
    """Return the scene of a site and a model; a case replaces its ground."""
    return read_scene(scene_file(site, model)).model_copy(update={"seed": REPORT_SEED})
