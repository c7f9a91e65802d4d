"""Field case Chant Sura: speeds before and after single impacts on an alpine meadow.

EnviDat doi:10.16904/envidat.174, eleven contacts of five runs; Caviezel et al. 2019, ESurf 7:199, six impacts of a
block of 780 kg. Neither data set has the slope of the ground at the impact, or the spin.
"""

import csv
import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from field_cases.authume import ROOT
from field_cases.flying import with_keys
from field_cases.models import CHANT_SURA, HOEK, PUBLISHED, Model, Values, keys_of, model_named
from field_cases.search import Found, Free, search
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext, RockKey
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import ReboundSpec
from rpf3d_core.scene.models.sphere import COULOMB_SPHERE
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.named import models_of
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Motion, Rock, Vec

DATA = ROOT.parent / "shared" / "data" / "chant_sura"
ANY_SCENE = ROOT / "config" / "scenes" / "lab_22.yaml"
"""A scene from which rebound models are built; nothing else of the scene is used."""
PARAMETERS: dict[str, tuple[tuple[str, Any], ...]] = {"angle_table": (("law", "wyllie"),)}
"""Name of a rebound model without defaults -> parameters."""
SLOPES = (0.0, 15.0, 30.0)
SLOPE = Free("slope_deg", 0.0, 40.0, 9, 1)
SPIN = 27.0
"""Mean spin (rad/s) before four impacts of the 780 kg block (Lu et al. 2019, table 2: 23.85 to 29.33)."""


class Impact(NamedTuple):
    """One impact measured in the field, which the models must predict.

    before : velocity (3,) m/s; after : velocity (3,) m/s, None if only the speed is known; speed_after : m/s
    normal : unit normal (3,) of the ground, None if unknown
    """

    name: str
    run: str
    rock: Rock
    before: Vec
    after: Vec | None
    speed_after: float
    normal: Vec | None


@lru_cache
def contacts() -> tuple[Impact, ...]:
    """Return the eleven measured contacts of EnviDat 174."""
    return tuple(
        Impact(
            line["event_id"], line["source_trajectory_id"], Rock(float(line["mass_kg"]), float(line["radius_m"])),
            _vector(line, "incoming"), _vector(line, "outgoing"), math.hypot(*_vector(line, "outgoing")), None,
        )
        for line in _lines("observed_contact_events_extended.csv")
    )  # fmt: skip


@lru_cache
def published() -> tuple[Impact, ...]:
    """Return the six published impacts of 780 kg; their speed into the ground comes from the height of the jump."""
    found = []
    for line in _lines("esurf2019_impacts.csv"):
        mass, after = float(line["mass_kg"]), float(line["observed_post_rebound_translational_j"])
        into, along = float(line["incoming_normal_speed_mps"]), float(line["incoming_tangent_speed_mps"])
        speed = math.sqrt(2.0 * after / mass)
        rock = Rock(mass, float(line["radius_m"]))
        found.append(Impact(line["scar_id"], "", rock, (along, 0.0, -into), None, speed, (0.0, 0.0, 1.0)))
    return tuple(found)


@lru_cache(maxsize=100_000)
def model_of(name: str, values: tuple[tuple[str, Any], ...] = ()) -> object:
    """Return a rebound model; name : its name in scenes; values : pairs of a parameter and its value.

    Raises
    ------
    ValueError
        The model has parameters that only the user can give.
    """
    scene, terrain = _any_scene()
    return models_of(with_keys(scene, {**keys_of(name, dict(values)), "ground": "none"}), terrain).rebound


@lru_cache
def _any_scene() -> tuple[Scene, Terrain]:
    scene = read_scene(ANY_SCENE)
    return scene, read_terrain(scene)[0]


def all_models() -> dict[str, object | None]:
    """Return every rebound model of the package by name; None if only the user can give the model's parameters."""
    found: dict[str, object | None] = {}
    for name in (*ReboundSpec.model_fields, COULOMB_SPHERE):
        if name != "own":
            try:
                found[name] = model_of(name, PARAMETERS.get(name, ()))
            except ValueError:
                found[name] = None
    return found


def surface(values: Values) -> Surface:
    """Return the surface, as rebound models use it, with published values of a ground."""
    mu = math.tan(math.radians(values.friction_angle_deg))
    known = {"R_n": values.R_n, "R_t": values.R_t, "mu": mu, "mu_r": values.rolling_friction}
    return Surface(**{name: known.get(name, 0.0) for name in Surface._fields})


def predicted(model: object, ground: Surface, impact: Impact, slope_deg: float, spin: float = 0.0) -> Vec:
    """Return the velocity (3,) m/s after an impact as a model predicts it.

    slope_deg : assumed slope of the ground, which falls in the direction of motion; not used if the normal is known
    spin : assumed spin (rad/s) before the impact, positive for a rock that rolls forwards
    """
    n = impact.normal or dipping(impact.before, slope_deg)
    axis = np.cross(n, impact.before)
    size = float(np.linalg.norm(axis))
    w = tuple(float(c) for c in (spin / size * axis if size > 0.0 else axis))
    rock = RockContext(impact.rock, RockKey(1, 0, 0), 0)
    return rebound(model, ground, Motion(0.0, (0.0, 0.0, 0.0), impact.before, w), n, rock).v  # type: ignore[arg-type]


def of_contacts(
    model: object, ground: Surface, slope_deg: float, some: tuple[Impact, ...] | None = None
) -> dict[str, float]:
    """Return the errors of a model over the eleven contacts by name: rms error of velocity (m/s), and `speed_errors`.

    slope_deg : as in `predicted`; some : contacts to use, None for all eleven
    """
    impacts = contacts() if some is None else some
    after = [predicted(model, ground, impact, slope_deg) for impact in impacts]
    off = [math.dist(v, impact.after) for v, impact in zip(after, impacts, strict=True) if impact.after]
    return {"velocity": float(np.sqrt(np.mean(np.square(off)))), **speed_errors(after, impacts)}


def of_published(model: object, ground: Surface, spin: float = 0.0) -> dict[str, Any]:
    """Return `speed_errors` of a model over the six published impacts, and the predicted energy ratio of each impact.

    spin : as in `predicted`
    """
    after = [predicted(model, ground, impact, 0.0, spin) for impact in published()]
    ratio = ratios(speeds(after), published())
    return {"ratios": [round(float(r), 3) for r in ratio], **speed_errors(after, published())}


def speed_errors(after: list[Vec], impacts: tuple[Impact, ...]) -> dict[str, float]:
    """Return the mean and rms error of speed (m/s), and the mean and mean absolute error of the energy ratio, by name.

    after : predicted velocity after each impact
    """
    speed = speeds(after)
    off = speed - [impact.speed_after for impact in impacts]
    ratio = ratios(speed, impacts) - measured_ratios(impacts)
    return {
        "speed_mean": float(off.mean()),
        "speed_rms": float(np.sqrt(np.mean(off**2))),
        "ratio_mean": float(ratio.mean()),
        "ratio_absolute": float(np.abs(ratio).mean()),
    }


def speeds(velocities: list[Vec]) -> FloatArray:
    """Return the speed (I,) m/s of each velocity."""
    return np.array([math.hypot(*v) for v in velocities])


def ratios(speed_after: FloatArray, impacts: tuple[Impact, ...]) -> FloatArray:
    """Return the energy ratios (I,) (-) of impacts: translational energy after over before; from speeds (I,) m/s."""
    return (speed_after / speeds([impact.before for impact in impacts])) ** 2


def measured_ratios(impacts: tuple[Impact, ...]) -> FloatArray:
    """Return the measured energy ratios (I,) (-) of impacts, as in `ratios`."""
    return ratios(np.array([impact.speed_after for impact in impacts]), impacts)


def calibrate(model: Model, some: tuple[Impact, ...] | None = None) -> Found:
    """Find the coefficients of a model, and one slope for all contacts, with the smallest rms error of speed.

    some : contacts to use, None for all eleven. The error is one of speed, not of velocity, because the direction after
    an impact depends on the local slope, which was not measured. With wrong directions, the velocity with the smallest
    error would be almost 0.
    """
    base = PUBLISHED[CHANT_SURA][HOEK]["default"]
    free = (*model.at_impacts, SLOPE)

    def error(parameters: Mapping[str, float]) -> float:
        ground = calibrated_surface(base, parameters)
        return of_contacts(model_of(model.impact), ground, parameters[SLOPE.name], some)["speed_rms"]

    return search(error, free)


def calibrated_surface(base: Values, parameters: Mapping[str, float]) -> Surface:
    """Return the surface with calibrated coefficients; coefficients that are not calibrated have the values of base."""
    names = {"normal_restitution": "R_n", "tangential_restitution": "R_t", "friction_angle_deg": "friction_angle_deg",
             "rolling_friction": "rolling_friction"}  # fmt: skip
    return surface(base._replace(**{names[key]: value for key, value in parameters.items() if key in names}))


def calibrated_speeds(model_name: str, parameters: Mapping[str, float]) -> list[float]:
    """Return the speed (m/s) after each of the eleven contacts as a calibrated model of the page predicts it."""
    ground = calibrated_surface(PUBLISHED[CHANT_SURA][HOEK]["default"], parameters)
    model, slope = model_of(model_named(model_name).impact), parameters[SLOPE.name]
    return speeds([predicted(model, ground, impact, slope) for impact in contacts()]).tolist()


def kept_out(model: Model) -> dict[str, float]:
    """Predict each run with a calibration on the other four runs; return the rms error of speed (m/s) of all contacts.
    """
    base, squares = PUBLISHED[CHANT_SURA][HOEK]["default"], 0.0
    for run in sorted({impact.run for impact in contacts()}):
        others = tuple(impact for impact in contacts() if impact.run != run)
        its = tuple(impact for impact in contacts() if impact.run == run)
        found = calibrate(model, others).parameters
        ground = calibrated_surface(base, found)
        error = of_contacts(model_of(model.impact), ground, found[SLOPE.name], its)["speed_rms"]
        squares += len(its) * error**2
    return {"speed_rms": math.sqrt(squares / len(contacts()))}


def dipping(v: Vec, slope_deg: float) -> Vec:
    """Return the unit normal (3,) of a slope that falls in the horizontal direction of v (3,)."""
    level, angle = math.hypot(v[0], v[1]), math.radians(slope_deg)
    return (math.sin(angle) * v[0] / level, math.sin(angle) * v[1] / level, math.cos(angle))


def _vector(line: dict[str, str], side: str) -> Vec:
    x, y, z = (float(line[f"{side}_v{axis}_mps"]) for axis in "xyz")
    return (x, y, z)


def _lines(name: str) -> list[dict[str, str]]:
    with (DATA / name).open(newline="") as file:
        return list(csv.DictReader(file))
