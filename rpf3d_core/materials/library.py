"""What the ground of each zone does to a rock, as arrays that the kernels index by zone."""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.compiling import kernel, model_function


class Surface(NamedTuple):
    """The ground at a contact.

    R_n, R_t : normal and tangential restitution (-), in [0, 1]; mu : Coulomb friction, tan of the friction angle (-)
    stop_speed : m/s below which a rock in sustained contact has stopped
    """

    R_n: float
    R_t: float
    mu: float
    stop_speed: float


class Materials(NamedTuple):
    """`Surface` for each of Z zones; every array has Z rows."""

    R_n: Any
    R_t: Any
    mu: Any
    stop_speed: Any


class RockKey(NamedTuple):
    """What tells a rock's draws from those of all others: its source, and its number within it."""

    source: int
    rock: int


class RockKeys(NamedTuple):
    """`RockKey` for each of R rocks; both columns have R rows."""

    source: Any
    rock: Any


def materials_of(surfaces: list[Surface]) -> Materials:
    """Arrays of Z surfaces, in order of zone."""
    columns = np.array(surfaces, dtype=float).reshape(-1, 4).T
    return Materials(*(np.ascontiguousarray(column) for column in columns))


def keys_of(materials: Any, source: Any, rock: Any) -> RockKeys | None:
    """What draws need of R rocks; None for `Materials`, which draw nothing: then no key is compiled either."""
    return None if isinstance(materials, Materials) else RockKeys(source, rock)


@kernel
def key_of(keys: RockKeys | None, i: int) -> RockKey | None:
    """The key of rock i."""
    if keys is None:
        return None
    return RockKey(keys.source[i], keys.rock[i])


@model_function
def surface_of(materials: object, zone: int, key: RockKey | None, impacts: int) -> Surface:
    """The ground of a zone under a rock that has had so many impacts; one rule per class of materials."""


@surface_of.rule(Materials)
def fixed_surface(materials: Materials, zone: int, key: None, impacts: int) -> Surface:
    """The same for every rock and every impact."""
    return Surface(materials.R_n[zone], materials.R_t[zone], materials.mu[zone], materials.stop_speed[zone])
