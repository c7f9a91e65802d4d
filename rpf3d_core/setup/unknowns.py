"""The parameter sets of a scene with unknowns: from priors, from a sample, or from both."""

from collections.abc import Mapping, Sequence

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.materials.distributions import quantile
from rpf3d_core.scene.key_paths import steps_to
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.unknowns import PriorSpec
from rpf3d_core.scene.zone_materials import name_of_material, used_coefficients
from rpf3d_core.unknowns.displacements import displacements
from rpf3d_core.unknowns.parameter_sets import (
    FloatArray,
    ParameterSets,
    parameter_sets,
    read_parameter_sets,
    read_place,
)
from rpf3d_core.unknowns.places import Surroundings, share_away
from rpf3d_core.unknowns.points import spread_points


def sets_of_scene(scene: Scene) -> ParameterSets:
    """Return the parameter sets that a run of a scene with unknowns flies; all sets have the same weight.

    Each set belongs to a point of an evenly spread sequence. Each coordinate u of the point, from 0 to 1, selects the
    quantile u of one prior. If the scene has a sample, the first coordinate instead selects a row of the sample, in
    proportion to the weights. A parameter that has a column in the sample is taken from the sample, whatever its prior.

    Raises
    ------
    InputError
        The file of the sample is refused, or a column of it leads to no value of the scene.
    """
    spec = scene.unknowns
    assert spec is not None
    sample = None if spec.sample is None else read_parameter_sets(spec.sample)
    known = () if sample is None else sample.names
    priors = left_over(scene, spec.priors, known)
    points = spread_points(spec.sets, len(priors) + (sample is not None), scene.seed)
    columns = [] if sample is None else [_picked(sample, points[:, 0], scene)]
    for place, prior in enumerate(priors.values(), start=len(columns)):
        drawn = [quantile(prior.distribution, u) for u in points[:, place].tolist()]
        columns.append(np.array(drawn)[:, None])
    return parameter_sets([*known, *priors], np.concatenate(columns, axis=1))


def displacements_of_scene(scene: Scene, sets: ParameterSets) -> FloatArray | None:
    """Return a random displacement in plan (S, 2) m for each parameter set; None if the scene states no misfit.

    The misfit (m) is the standard deviation of a displacement in each direction.
    """
    spec = scene.unknowns
    if spec is None or not spec.misfit:
        return None
    return displacements(sets, spec.misfit, scene.seed)


def sampled(scene: Scene) -> tuple[str, ...]:
    """Return the key paths whose values a scene draws from its sample; () for a scene without a sample.

    Raises
    ------
    InputError
        The file of the sample is refused.
    """
    spec = scene.unknowns
    return () if spec is None or spec.sample is None else read_parameter_sets(spec.sample).names


def share_calibrated_elsewhere(scene: Scene, releases: FloatArray) -> float:
    """Return the share (-) of the rocks that start far from the place where the scene's sample was calibrated.

    The share is 0 without releases or without a sample, and if the file of the sample does not state the place.

    releases : (N, 2) m, places in plan, in the coordinates of the input, with z turned up

    Raises
    ------
    InputError
        The file of the sample is refused.
    """
    place = place_of_sample(scene)
    return 0.0 if place is None or not len(releases) else share_away(place, releases)


def place_of_sample(scene: Scene) -> Surroundings | None:
    """Return the place where the sample of a scene was calibrated; None without a sample or if the place is unknown.

    Raises
    ------
    InputError
        The file of the sample is refused.
    """
    spec = scene.unknowns
    return None if spec is None or spec.sample is None else read_place(spec.sample)


def outside_sample(scene: Scene) -> tuple[str, ...]:
    """Return the key paths of the priors that a scene with a sample still uses, because the sample has no such column.

    The result is empty for a scene without a sample.

    Raises
    ------
    InputError
        The file of the sample is refused.
    """
    spec = scene.unknowns
    return () if spec is None or spec.sample is None else tuple(left_over(scene, spec.priors, sampled(scene)))


def unknowns_of(scene: Scene) -> dict[str, PriorSpec]:
    """Return the unknowns that a calibration or a sensitivity analysis varies: their priors, by key path.

    The unknowns of the key `calibration` come first. Then follow the other unknowns of the scene, such as ranges of a
    library, for which `calibration` has no prior.
    """
    named = {} if scene.calibration is None else dict(scene.calibration.unknowns)
    own = {} if scene.unknowns is None else scene.unknowns.priors
    return named | left_over(scene, own, tuple(named))


def counted_as_known(scene: Scene, zones: Sequence[str]) -> list[str]:
    """Return the key paths of the ground coefficients that a scene states as known: equal in all parameter sets.

    zones : names of the zones of the terrain; materials that no zone uses are left out

    Raises
    ------
    InputError
        The file of the sample is refused, or a zone has no material.
    """
    unknown = () if scene.unknowns is None else (*scene.unknowns.priors, *sampled(scene))
    places = {steps[:3] for path in unknown for steps in steps_to(scene, path)}
    used = dict.fromkeys(name_of_material(scene, zone) for zone in zones)
    steps = [("materials", name, key) for name in used for key in used_coefficients(scene, scene.materials[name])]
    return [".".join(each) for each in steps if each not in places]


def left_over(scene: Scene, priors: Mapping[str, PriorSpec], known: Sequence[str]) -> dict[str, PriorSpec]:
    """Return the priors that are still needed if the values at other key paths are known.

    A prior is left out if the other key paths cover all its values. The key path `materials.*.friction`, for example,
    covers a prior of the friction of any material.
    priors : priors by key path; known : the other key paths

    Raises
    ------
    SceneError
        A key path leads to no value of the scene.
    """
    places = {steps for path in known for steps in steps_to(scene, path)}
    return {path: prior for path, prior in priors.items() if not places.issuperset(steps_to(scene, path))}


def _picked(sample: ParameterSets, places: FloatArray, scene: Scene) -> FloatArray:
    """Return S rows of a sample: values (S, U) of its U parameters; a row is chosen in proportion to its weight.

    places : (S,) evenly spread numbers in [0, 1), which select the rows; scene : names the file, for the error

    Raises
    ------
    InputError
        A column leads to no value of the scene; the message names the file.
    """
    try:
        for name in sample.names:
            steps_to(scene, name)
    except InputError as fault:
        raise InputError(f"{scene.unknowns.sample if scene.unknowns else ''}: {fault}") from fault
    rows = np.searchsorted(np.cumsum(sample.shares), places, side="right")
    return sample.values[np.minimum(rows, len(sample) - 1)]
