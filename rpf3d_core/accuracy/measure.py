"""Measure the whole price list of a scene, the error and the cost of each setting, for `rpf3d cost`."""

import math
from collections.abc import Callable, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from rpf3d_core.accuracy.flown import FlownSample, fly, some_rocks
from rpf3d_core.accuracy.geometric import coarser_terrains
from rpf3d_core.accuracy.in_contact import BUDGET, accuracies
from rpf3d_core.accuracy.numerical import SETTINGS, Steps, raster_answers, rounding, stepped_answers
from rpf3d_core.accuracy.parametric import over_sets
from rpf3d_core.accuracy.precise import ImpactErrors, off_exact
from rpf3d_core.accuracy.price_list import (
    EVENTS,
    Priced,
    PriceList,
    contact_setting,
    priced_contact,
    priced_events,
    priced_full_terrain,
    priced_sample,
    priced_steps,
    priced_terrain,
    priced_unknowns,
    steps_setting,
)
from rpf3d_core.accuracy.statistical import Sampled, doublings
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.errors import InputError
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.scene.method import MethodSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.prepared import Prepared, places_of, prepare
from rpf3d_core.setup.rounds import rounds_of

PAIRED = 2000
"""Number of rocks that are flown with exact contacts and in fixed steps, to compare the two flights of each rock.

Rocks with a shape are flown with several accuracies of contact instead. The number is large enough to resolve a share
of 0.01, and small enough to fly the rocks in short time steps.
"""
OVER_TERRAINS = 16_000
"""Number of rocks that are flown over each terrain, to measure the geometric error."""
DOUBLINGS_S = 8.0
"""Time budget to measure the statistical error with 125, 250, 500, ... rocks: seconds of one core."""

Tell = Callable[[str], None]
"""A function that receives a progress text, for example to print it."""


def price_list(scene: Scene | str | Path, tell: Tell = lambda _: None) -> PriceList:
    """Return the price list of a scene: measure the error and the cost of each setting.

    The rocks fly with the compiled engine. The cost of fixed steps is also measured with VTK, as in the thesis.

    tell : receives progress texts

    Raises
    ------
    InputError
        The scene, one of its files or a source is invalid; or numba is not installed.
    """
    scene = scene if isinstance(scene, Scene) else read_scene(scene)
    if not HAS_NUMBA:
        raise InputError(f"{scene.path}: what accuracy costs is measured with the compiled engine, which needs numba")
    tell("preparing: terrain, index, compiled code")
    prepared = prepare(scene.model_copy(update={"engine": "compiled", "method": MethodSpec()}))
    tell("statistical: doubling the number of rocks")
    sampled = doublings(prepared, DOUBLINGS_S)
    numerical, exact = (_in_contact if scene.rock.is_body else _numerical)(prepared, scene, sampled, tell)
    return PriceList(
        scene=scene.path.name,
        digest=scene_digest(scene),
        rocks=rocks_of(scene, prepared),
        auto=scene.rocks == "auto",
        method=_own_method(prepared, scene),
        cell=prepared.raster.cell,
        triangles=len(prepared.terrain.triangles),
        numerical=numerical,
        geometric=_geometric(prepared, sampled, tell),
        statistical=[priced_sample(found) for found in sampled],
        parametric=_parametric(prepared, tell),
        off_exact=exact,
    )


def rocks_of(scene: Scene, prepared: Prepared) -> int:
    """Return the number of rocks that a run of the scene flies; with `rocks: auto`, in its first round."""
    numbers = rounds_of(with_choices(scene, None, None, None), places_of(prepared))[0].last
    return sum(numbers)


def _own_steps(scene: Scene) -> Steps | None:
    """Return the fixed-step method that a scene names, to measure it too; None if the scene uses exact contacts."""
    its = scene.method.stepping
    return None if its is None else Steps(dt=its.dt, threshold=its.threshold, squared=its.squared)


def _own_method(prepared: Prepared, scene: Scene) -> Mapping[str, Any]:
    """Return the scene's own method of finding contacts, as names and values (`Priced.setting`).

    The result identifies the line of the price list that belongs to the scene's own setting.
    """
    if scene.rock.is_body:
        return contact_setting(prepared.flight.models.rebound.accuracy)
    own = _own_steps(scene)
    return EVENTS if own is None else steps_setting(own)


def _in_contact(
    prepared: Prepared, scene: Scene, sampled: list[Sampled], tell: Tell
) -> tuple[list[Priced], list[ImpactErrors]]:  # fmt: skip
    """Return the numerical lines of the price list for rocks with a shape, one line for each accuracy of contact.

    The second result is always an empty list. For points and spheres, the second result of `_numerical` is the rounding
    errors of single impacts. For rocks with a shape, these errors are not measured, because a comparison with 50 digits
    would have to repeat all steps in contact.

    sampled : statistical errors, which state how much of a difference is chance; tell : receives progress texts
    """
    tell("numerical: the finest accuracy of contact")
    lines = []
    for found in accuracies(prepared, some_rocks(prepared, PAIRED)):
        tell(f"numerical: accuracy {found.accuracy:g} m done")
        lines.append(priced_contact(found, sampled))
    return lines, []


def _numerical(
    prepared: Prepared, scene: Scene, sampled: list[Sampled], tell: Tell
) -> tuple[list[Priced], list[ImpactErrors]]:  # fmt: skip
    """Return the numerical lines of the price list for points and spheres, and the rounding errors of single impacts.

    Fixed steps find only contacts of points, so spheres have one line, for exact contacts.

    sampled : statistical errors, which state how much of a difference is chance; tell : receives progress texts
    """
    tell("numerical: events, and 50 digits")
    releases = some_rocks(prepared, PAIRED)
    exact = fly(prepared, releases, paths=True)
    events = priced_events(rounding(prepared, releases, exact), exact.seconds_per_1000)
    steps = _in_steps(prepared, scene, (releases, exact), sampled, tell) if _can_step(scene) else []
    return [events, *steps], off_exact(prepared, exact.flights)


def _can_step(scene: Scene) -> bool:
    """Return True if contacts of the scene's rocks may be found in fixed steps, as for points."""
    return scene.impact_model.model_spec.STEPS


def _in_steps(
    prepared: Prepared, scene: Scene, flown: tuple[Releases, FlownSample], sampled: list[Sampled], tell: Tell
) -> list[Priced]:
    """Return the lines of the price list for fixed steps on the mesh and on rasters.

    flown : releases, and their result with exact contacts; sampled : statistical errors; tell : receives progress texts
    """
    own = _own_steps(scene)
    settings = SETTINGS if own is None or own in SETTINGS else (*SETTINGS, own)
    lines = []
    for found in chain(stepped_answers(prepared, *flown, settings), raster_answers(prepared, *flown)):
        tell(f"numerical: {', '.join(f'{name} {value}' for name, value in found.setting._asdict().items())}: done")
        lines.append(priced_steps(found, sampled))
    return lines


def _geometric(prepared: Prepared, sampled: list[Sampled], tell: Tell) -> list[Priced]:
    tell("geometric: the terrain as it is")
    bodies = prepared.scene.rock.is_body
    releases = some_rocks(prepared, OVER_TERRAINS)
    exact = fly(prepared, releases, BUDGET if bodies else math.inf, paths=True)
    lines = [priced_full_terrain(len(prepared.terrain.triangles), exact.seconds_per_1000)]
    for found in coarser_terrains(prepared, releases, exact):
        tell(f"geometric: 1/{found.part} of the triangles done")
        lines.append(priced_terrain(found, len(exact.rows), sampled))
    return lines


def _parametric(prepared: Prepared, tell: Tell) -> list[Priced]:
    """Return the parametric line of the price list as a list; an empty list for a scene without unknowns."""
    tell("parametric: the parameter sets of the unknowns")
    found = over_sets(prepared)
    return [] if found is None else [priced_unknowns(found)]
