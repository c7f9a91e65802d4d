"""How many observed stops lie within predictive intervals that hold what is not known about the ground.

The ground is a range from books, chosen by its description alone, or the sample of a calibration at another site. Each
case flies 64 parameter sets, all sets with the same number of rocks. The prediction is the distribution of all these
rocks; rocks that did not stop count as beyond every observed stop.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import rpf3d_core
from field_cases import authume, calibrated_tschamut, tschamut
from field_cases.authume import REPORT_SEED
from field_cases.basis import EndPoints
from field_cases.blocks import quarry
from field_cases.flying import Keys, with_keys
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.values import Outcome

AUTHUME, TSCHAMUT = "Authume", "Tschamut"
LIBRARY, SINGLE = "library", "library, one value for each assumed range"
"""Where the ground of a case comes from, in words of the page."""
STOPS = {AUTHUME: 41, TSCHAMUT: tschamut.RUNS}
"""Number of observed stops of each site."""
POINTS, SPHERES, BLOCKS = "points", "spheres", "blocks"
ROCKS = {POINTS: 6400, SPHERES: 3200, BLOCKS: 1920}
"""Rocks over all parameter sets; more change no figure by more than a stop or two."""
MODELS: dict[str, Keys] = {
    POINTS: {"rebound": "coulomb_limited", "ground": "sliding"},
    SPHERES: {"rock": {"shape": "sphere"}, "contact": "coulomb_sphere", "ground": "sphere"},
    BLOCKS: {"contact": "rigid"},
}
GROUND = {
    (AUTHUME, POINTS): {"blue": "talus", "gray": "bedrock", "red": "talus"},
    (AUTHUME, BLOCKS): {"blue": "ramms_medium", "gray": "ramms_hard", "red": "ramms_medium"},
    (TSCHAMUT, POINTS): {"default": "soil"},
    (TSCHAMUT, BLOCKS): {"default": "ramms_medium_soft"},
}
"""Entries of the library by zone, by the description of the ground: talus, an outcrop of bedrock, an alpine meadow."""
ONE_VALUE = {"friction_angle_deg": 30.0, "rolling_friction": 0.575, "rolling_resistance": 0.2}
"""One value for each range that a scene assumes: the default angle, and the middle of the others."""
ASSUMED_FOR = {POINTS: ("friction_angle_deg",), SPHERES: ("friction_angle_deg", "rolling_friction"),
             BLOCKS: ("rolling_resistance",)}  # fmt: skip
BUDGET = 1800.0
"""Time (s) that a calibration may take at most."""
LOW, HIGH = 0.05, 0.95
"""The ends of a 90 % interval."""


class Case(NamedTuple):
    """A prediction: where, with which rocks, from which ground (words of the page), and the keys of its scene."""

    site: str
    rocks: str
    ground: str
    keys: Keys


def cases_of_books() -> Iterator[Case]:
    """Yield the cases with ground of the library, and the same with one value in place of each assumed range."""
    for site in (AUTHUME, TSCHAMUT):
        for rocks in (POINTS, SPHERES, BLOCKS):
            zones = GROUND[site, BLOCKS if rocks == BLOCKS else POINTS]
            single = {key: ONE_VALUE[key] for key in ASSUMED_FOR[rocks]}
            for ground, more in ((LIBRARY, {}), (SINGLE, single)):
                materials = {zone: {"library": entry, **more} for zone, entry in zones.items()}
                yield Case(site, rocks, ground, {**MODELS[rocks], "materials": materials})


def cases_of_calibrations(folder: Path) -> Iterator[Case]:
    """Yield the cases with the ground of a calibration at the other site; folder : as in `calibrate`."""
    for site, other in ((AUTHUME, TSCHAMUT), (TSCHAMUT, AUTHUME)):
        for rocks in (POINTS, BLOCKS):
            sample = folder / f"{other.lower()}_{rocks}" / "posterior.parquet"
            keys = {**MODELS[rocks], "unknowns": {"sample": sample.resolve()}}
            yield Case(site, rocks, f"calibrated at {other}", keys)


def calibrate(folder: Path, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Calibrate points and blocks at both sites with `rpf3d calibrate`, unless the folder has the results.

    folder : has a folder for each calibration

    Returns a line for each: how many stops that a fold kept out lie within its 90 % intervals.
    """
    lines = []
    for site in (AUTHUME, TSCHAMUT):
        for rocks in (POINTS, BLOCKS):
            out = folder / f"{site.lower()}_{rocks}"
            if not (out / "calibration.json").exists():
                say(f"ranges: calibrate {rocks} at {site}")
                words = ["calibrate", str(scene_file(site, rocks)), "--out", str(out), "--budget", f"{BUDGET:g}"]
                subprocess.run([sys.executable, "-m", "rpf3d_core.cli", *words], check=True)
            lines.append({"site": site, "rocks": rocks, **_kept_out(out / "calibration.json")})
    return lines


def _kept_out(file: Path) -> dict[str, Any]:
    """Return the coverage of a calibration, without and with the misfit of the model, and its misfit (m)."""
    found = json.loads(file.read_text(encoding="utf-8"))["coverage"]
    return {**found["90"], "with_misfit": found["with_misfit"]["90"], "misfit": found["with_misfit"]["misfit"]}


def covered(case: Case) -> dict[str, Any]:
    """Fly a case; return the shares of the observed stops within its 90 % intervals, and of the rocks still moving."""
    scene = with_keys(_scene(case.site, case.rocks), {**case.keys, "observed": None, "calibration": None})
    run = rpf3d_core.simulate(scene, rocks=ROCKS[case.rocks])
    deposits = run.flights.deposits
    stopped = deposits.outcome == Outcome.STOPPED
    ends = run.terrain.frame.points_to_input(deposits.x)
    found = _authume(ends, stopped) if case.site == AUTHUME else _tschamut(deposits.source, ends, stopped)
    return {**dict(zip(("along", "across"), found, strict=True)), "moving": float(1.0 - stopped.mean())}


def measured(cases: Iterator[Case], say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Return the lines of the page's table, one for each case."""
    lines = []
    for case in cases:
        say(f"ranges: {case.site}, {case.rocks}, {case.ground}")
        lines.append({"site": case.site, "rocks": case.rocks, "ground": case.ground, **covered(case)})
    return lines


def held(line: Mapping[str, Any], way: str) -> int:
    """Return how many observed stops the intervals of a line of the page hold; way : `along` or `across` the slope."""
    return round(float(line[way]) * STOPS[line["site"]])


def held_of_all(line: Mapping[str, Any], way: str) -> str:
    """Return how many of the observed stops the intervals of a line hold, such as `40 of 41`; way : as in `held`."""
    return f"{held(line, way)} of {STOPS[line['site']]}"


def _authume(ends: FloatArray, stopped: FloatArray) -> tuple[float, float]:
    """Return the shares of the 41 blocks within the intervals, along and across; ends : (N, 3) m of all rocks."""
    field, rocks = authume.seen(authume.end_points()), authume.seen(authume.in_field_datum(ends))
    places = [_places(rocks, stopped, field.along[k], field.across[k]) for k in range(len(field.along))]
    return _within(places)


def _tschamut(source: IntArray, ends: FloatArray, stopped: FloatArray) -> tuple[float, float]:
    """Return the shares of the 18 runs within the intervals of their rocks; source : (N,) run of each rock."""
    field, places = tschamut.runs().seen(), []
    for run in range(tschamut.RUNS):
        rocks = tschamut.seen(source[source == run], ends[source == run])
        places.append(_places(rocks, stopped[source == run], field.along[run], field.across[run]))
    return _within(places)


def _places(rocks: EndPoints, stopped: FloatArray, along: float, across: float) -> tuple[float, float]:
    """Return the share of the rocks before a stop, and the share of the stopped rocks on one side of it."""
    beyond = np.where(stopped, rocks.along, np.inf)
    beside = rocks.across[stopped] < across
    return float((beyond < along).mean()), float(beside.sum() / max(len(beside), 1))


def _within(places: list[tuple[float, float]]) -> tuple[float, float]:
    along, across = (((values > LOW) & (values < HIGH)).mean() for values in np.array(places).T)
    return float(along), float(across)


@lru_cache
def _scene(site: str, rocks: str) -> Scene:
    """Return the scene of a site for points, spheres or blocks; its ground is replaced."""
    kind = BLOCKS if rocks == BLOCKS else POINTS
    return read_scene(scene_file(site, kind)).model_copy(update={"seed": REPORT_SEED})


def scene_file(site: str, kind: str) -> Path:
    """Return the scene file of a site for points or blocks."""
    if site == AUTHUME:
        return quarry.SCENE if kind == BLOCKS else authume.SCENE
    return Path(_meadow().name) / f"{kind}.yaml"


@lru_cache
def _meadow() -> tempfile.TemporaryDirectory[str]:
    """Return the folder of Tschamut's scenes; it is removed when the program ends."""
    folder = tempfile.TemporaryDirectory()
    calibrated_tschamut.write_scenes(Path(folder.name))
    return folder
