"""Measure how much each unknown affects the results of a scene: fly parameter sets, and compare their results."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.even_rounds import words_on_left_out
from rpf3d_core.errors import InputError
from rpf3d_core.materials.distributions import quantiles
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.sensitivity.flown import Compared, compared, fly_all
from rpf3d_core.sensitivity.morris import Effects, effects_of, trajectories
from rpf3d_core.sensitivity.sobol import Indices, design, indices_of
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.setup.unknowns import unknowns_of

FloatArray = NDArray[np.float64]

ROCKS = 500
"""Default number of rocks of each parameter set."""
TRAJECTORIES = 20
"""Default number of Morris trajectories."""
FEWEST, MOST = 4, 100_000
"""Smallest and largest number of trajectories, of rocks of a parameter set, and of base sets other than 0."""
EDGE = 1e-6
"""Probability (-) that is cut off at both ends of a prior, because the normal quantiles of 0 and 1 are not finite."""


class Stopped(Exception):
    """Raised if the user stops the analysis before all parameter sets have flown."""


@dataclass(frozen=True)
class Asked:
    """Settings of a sensitivity analysis.

    rocks : number of rocks of each parameter set; trajectories : number of Morris' trajectories
    base_sets : number N of rows of Sobol's design, each of U + 2 parameter sets for U unknowns; 0 for no Sobol indices
    """

    rocks: int = ROCKS
    trajectories: int = TRAJECTORIES
    base_sets: int = 0


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The effects of the unknowns of a scene on its results.

    names : key paths of the U unknowns; results, units : names and units of the Y results
    middle : (Y,) mean of each result over all parameter sets, in the unit of the result
    effects : effects of the unknowns, by Morris; indices : Sobol indices, None if they were not asked for
    sets : number of parameter sets flown; rocks : number of rocks of each set
    left_out : sentences on sources of which no rock has flown
    """

    names: tuple[str, ...]
    results: tuple[str, ...]
    units: tuple[str, ...]
    middle: FloatArray
    effects: Effects
    indices: Indices | None
    sets: int
    rocks: int
    left_out: tuple[str, ...] = ()


def sensitivity(
    scene: Scene | str | Path, asked: Asked, advance: Callable[[int, int], None] = lambda done, of: None,
    stop: Callable[[], bool] = lambda: False,
) -> Sensitivity:  # fmt: skip
    """Simulate a scene with many values of its unknowns, and return how much each unknown affects each result.

    scene : the scene, or the path of its file; asked : numbers of rocks and of parameter sets
    advance : called with the number of flown sets and the number of all sets; stop : returns True to end the analysis

    Raises
    ------
    InputError
        The scene or a release point is refused; the scene has no unknowns, or has a sample of a calibration; or a
        number in `asked` is out of range.
    Stopped
        `stop` returned True.
    """
    read = scene if isinstance(scene, Scene) else read_scene(scene)
    priors = unknowns_of(read)
    _check(read, len(priors), asked)
    many = with_choices(read, 100_000, None, None) if read.engine == "auto" else read
    what = compared(prepare(many), tuple(priors), asked.rocks)
    paths = trajectories(asked.trajectories, len(priors), read.seed)
    points = design(asked.base_sets, len(priors), read.seed)
    quantile = np.concatenate([paths.reshape(-1, len(priors)), points.reshape(-1, len(priors))]).clip(EDGE, 1.0 - EDGE)
    each = [quantiles(prior.distribution, quantile[:, k]) for k, prior in enumerate(priors.values())]
    flown = fly_all(what, np.stack(each, axis=1), lambda done: advance(done, len(quantile)), stop)
    if flown is None:
        raise Stopped
    return _of(what, paths, points, flown)


def _check(scene: Scene, unknowns: int, asked: Asked) -> None:
    """Raise InputError if there is no unknown to vary, a sample would be ignored, or a number in `asked` is wrong.

    unknowns : number of unknowns of the scene
    """
    if scene.unknowns is not None and scene.unknowns.sample is not None:
        raise InputError(f"{scene.path}: `unknowns.sample` gives the values of a calibration, which a sensitivity "
                         "cannot vary one by one; use the scene that was calibrated, or remove the key")  # fmt: skip
    if not unknowns:
        raise InputError(f"{scene.path}: has no unknowns with a range; give coefficients a `prior` or a `library`, or "
                         "name them in `calibration: {unknowns: ...}`")  # fmt: skip
    limits = {"--trajectories": asked.trajectories, "--rocks": asked.rocks}
    limits |= {"--sobol": asked.base_sets} if asked.base_sets else {}
    for option, number in limits.items():
        if not FEWEST <= number <= MOST:
            raise InputError(f"{option} is {number}; it must be from {FEWEST} to {MOST:,}")


def _of(what: Compared, paths: FloatArray, points: FloatArray, flown: FloatArray) -> Sensitivity:
    """Return the effects of the unknowns from the results of all flown parameter sets.

    what : inputs of the analysis
    paths : (T, U + 1, U) points of Morris' trajectories; points : (N, U + 2, U) points of Sobol's design, in [0, 1]
    flown : (S, Y) results of the sets: first at all points of `paths`, then at all points of `points`
    """
    seed, results = what.prepared.scene.seed, len(what.results)
    count = paths.shape[0] * paths.shape[1]
    effects = effects_of(paths, flown[:count].reshape(*paths.shape[:2], results), seed)
    rest = flown[count:].reshape(*points.shape[:2], results)
    return Sensitivity(
        names=what.names, results=what.results, units=what.units, middle=flown.mean(axis=0), effects=effects,
        indices=indices_of(rest, seed) if len(points) else None, sets=len(flown), rocks=len(what.releases.x),
        left_out=tuple(words_on_left_out(what.prepared.sources, len(what.releases.x), 1, "--rocks")),
    )  # fmt: skip
