"""The rock that falls: what a model may ask of it beside its motion, and the columns that this comes from.

A column that no model of a scene asks for is None, so it is neither filled in nor compiled.
"""

from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Rock


class RockKey(NamedTuple):
    """What tells a rock's draws from those of all others: the scene's seed, its source, and its number within it."""

    seed: int
    source: int
    rock: int


class RockContext(NamedTuple):
    """One rock that falls.

    rock : its mass and radius, None where no model of the scene asks for them
    key : for draws, None where nothing is drawn; impacts : how many it has had on the ground so far
    """

    rock: Rock | None
    key: RockKey | None
    impacts: int


ANY_ROCK = RockContext(None, None, 0)
"""For models that ask nothing of the rock."""


class RockColumns(NamedTuple):
    """Mass (R,) kg and radius (R,) m of R rocks."""

    mass: Any
    radius: Any


class RockKeys(NamedTuple):
    """`RockKey` for each of R rocks: the seed of all, and two columns of R rows."""

    seed: int
    source: Any
    rock: Any


@kernel
def rock_of(rocks: RockColumns | None, i: int) -> Rock | None:
    """Mass and radius of rock i."""
    if rocks is None:
        return None
    return Rock(rocks.mass[i], rocks.radius[i])


@kernel
def key_of(keys: RockKeys | None, i: int) -> RockKey | None:
    """The key of rock i."""
    if keys is None:
        return None
    return RockKey(keys.seed, keys.source[i], keys.rock[i])
