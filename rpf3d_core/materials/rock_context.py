"""The data of a rock that a model may need in addition to its motion, for one rock and as columns for many rocks.

Data that no model of a scene needs are None; code that would use these data is not compiled.
"""

from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Rock


class RockKey(NamedTuple):
    """The key of a rock's random numbers: seed of the scene, number of the source, number of the rock in its source."""

    seed: int
    source: int
    rock: int


class RockContext(NamedTuple):
    """The data of one moving rock that models may need: its size, its random numbers and its impacts so far.

    rock : mass and radius; None if no model of the scene needs them
    key : key of the random numbers; None if nothing is drawn; impacts : number of impacts on the ground so far
    """

    rock: Rock | None
    key: RockKey | None
    impacts: int


class RockColumns(NamedTuple):
    """The sizes of R rocks: mass (R,) kg and radius (R,) m."""

    mass: Any
    radius: Any


class RockKeys(NamedTuple):
    """The keys of the random numbers of R rocks: one seed for all rocks, and columns `source`, `rock` (R,)."""

    seed: int
    source: Any
    rock: Any


@kernel
def rock_of(rocks: RockColumns | None, i: int) -> Rock | None:
    """Return mass and radius of rock i for the models; None if no model needs them."""
    if rocks is None:
        return None
    return Rock(rocks.mass[i], rocks.radius[i])


@kernel
def key_of(keys: RockKeys | None, i: int) -> RockKey | None:
    """Return the key of the random numbers of rock i; None if nothing is drawn."""
    if keys is None:
        return None
    return RockKey(seed=keys.seed, source=keys.source[i], rock=keys.rock[i])
