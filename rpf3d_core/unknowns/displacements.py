"""Draw displacements: how far, and in which direction in plan, the error of a model moves all rocks of a set.

A calibration estimates a misfit: observed stops lie farther from simulated stops than the simulated spread explains.
Here the misfit is an error that all rocks of one parameter set share, like an unknown offset of their paths. The error
has a normal distribution with the same standard deviation in both directions of the plan, as in the likelihood of the
calibration.
"""

import numpy as np

from rpf3d_core.materials.normal_quantile import normal_quantile
from rpf3d_core.unknowns.parameter_sets import FloatArray, ParameterSets
from rpf3d_core.unknowns.points import SMALLEST, spread_points

IN_PLAN = 2
"""Number of directions of a displacement."""


def displacements(sets: ParameterSets, misfit: float, seed: int) -> FloatArray:
    """Return the displacement in plan (S, 2) m of each of S parameter sets, evenly spread over a normal distribution.

    The displacement of a set depends only on the misfit, the seed, the number of the set, and the number of parameters.
    Parameters and displacements are dimensions of one sequence of evenly spread points, the displacements last. So both
    together are spread evenly.

    misfit : m, standard deviation of a displacement in each direction; seed : of the evenly spread points
    """
    points = spread_points(len(sets), len(sets.names) + IN_PLAN, seed)[:, -IN_PLAN:]
    normal = [[normal_quantile(max(u, SMALLEST)) for u in row] for row in points.tolist()]
    return np.asarray(misfit * np.array(normal))
