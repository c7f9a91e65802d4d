"""From sources to releases: where each rock starts, how fast, and how heavy it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import WORLD
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Rock, Vec

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ABOVE_EVERYTHING = 1.0
"""How far above the highest point of the terrain a plumb line starts (m)."""


@dataclass(frozen=True, eq=False)
class Source:
    """A place that rocks may fall from, in the terrain's local frame.

    points : (P, 3) m; rocks are dealt to them in turn, or, if `line`, spread uniformly over the length of the line
    through them; rocks : how many; velocity : (3,) m/s
    spread, velocity_spread : (3,) half-widths of a uniform spread about the position (m) and the velocity (m/s)
    above_ground : m; replaces the height of each position by the terrain's plus this, where given
    """

    name: str
    points: FloatArray
    rocks: int
    velocity: Vec = (0.0, 0.0, 0.0)
    line: bool = False
    spread: Vec = (0.0, 0.0, 0.0)
    velocity_spread: Vec = (0.0, 0.0, 0.0)
    above_ground: float | None = None


@dataclass(frozen=True, eq=False)
class Releases:
    """R rocks about to fall, in order of source, then rock.

    source, rock : (R,) indices; x : (R, 3) m, local; v : (R, 3) m/s; mass : (R,) kg; radius : (R,) m
    """

    source: IntArray
    rock: IntArray
    x: FloatArray
    v: FloatArray
    mass: FloatArray
    radius: FloatArray


def releases_of(
    sources: Sequence[Source], rock: Rock, seed: int, engine: Engine, frame: Frame = WORLD
) -> Releases:
    """Draw the releases of all sources; the engine's terrain gives heights for `above_ground`.

    Raises
    ------
    InputError
        `above_ground` where there is no terrain; names the source and the position, in the input's coordinates.
    """
    counts = np.array([source.rocks for source in sources])
    number = np.repeat(np.arange(len(sources)), counts)
    rocks = np.concatenate([np.arange(n) for n in counts])
    x = np.concatenate([_positions(source, i, seed, engine, frame) for i, source in enumerate(sources)])
    v = np.concatenate([_velocities(source, i, seed) for i, source in enumerate(sources)])
    return Releases(number, rocks, x, v, np.full(len(x), rock.mass), np.full(len(x), rock.radius))


def share_out(sources: Sequence[int], total: int) -> list[int]:
    """Deal `total` rocks to sources in proportion to their numbers: largest remainders first, then earliest."""
    numbers = np.array(sources, dtype=float)
    exact = numbers / numbers.sum() * total
    shares = np.floor(exact).astype(int)
    order = np.argsort(-(exact - shares), kind="stable")
    shares[order[: total - shares.sum()]] += 1
    return [int(n) for n in shares]


def _positions(source: Source, number: int, seed: int, engine: Engine, frame: Frame) -> FloatArray:
    """Positions (R, 3) of a source's rocks."""
    rocks = np.arange(source.rocks)
    if source.line:
        x = _along(source.points, uniform(seed, number, rocks, Purpose.ALONG_LINE))
    else:
        x = source.points[rocks % len(source.points)]
    purposes = (Purpose.POSITION_X, Purpose.POSITION_Y, Purpose.POSITION_Z)
    x = x + _spread(source.spread, purposes, seed, number, rocks)
    return x if source.above_ground is None else _over_ground(source, x, engine, frame)


def _velocities(source: Source, number: int, seed: int) -> FloatArray:
    """Velocities (R, 3) of a source's rocks."""
    purposes = (Purpose.VELOCITY_X, Purpose.VELOCITY_Y, Purpose.VELOCITY_Z)
    rocks = np.arange(source.rocks)
    return np.array(source.velocity) + _spread(source.velocity_spread, purposes, seed, number, rocks)


def _spread(half: Vec, purposes: Sequence[Purpose], seed: int, number: int, rocks: IntArray) -> FloatArray:
    """Uniform deviations (R, 3) of given half-widths."""
    draws = np.stack([uniform(seed, number, rocks, purpose) for purpose in purposes], axis=1)
    deviations: FloatArray = (2.0 * draws - 1.0) * np.array(half)
    return deviations


def _along(points: FloatArray, share: FloatArray) -> FloatArray:
    """Points (R, 3) at given shares (R,) of the length of the line through points (P, 3)."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    return np.stack([np.interp(share * reached[-1], reached, points[:, k]) for k in range(3)], axis=1)


def _over_ground(source: Source, x: FloatArray, engine: Engine, frame: Frame) -> FloatArray:
    """Positions with their height replaced by the highest terrain there plus `above_ground`."""
    top = np.array(x)
    top[:, 2] = engine.facets.high[2] + ABOVE_EVERYTHING
    found = engine.ground_below(top)
    for i in np.flatnonzero(found[:, 1] < 0)[:1]:
        where = ", ".join(f"{c:.3f}" for c in frame.points_to_input(x[i]))
        raise InputError(f"source {source.name!r} is off the terrain: there is no ground below or above ({where})")
    top[:, 2] -= found[:, 0] - (source.above_ground or 0.0)
    return top


def check_above_ground(releases: Releases, names: Sequence[str], engine: Engine, frame: Frame) -> None:
    """Refuse rocks that start under the ground or beside the terrain.

    Raises
    ------
    InputError
        Names the source, the rock and its position in input coordinates, and how far it is under the ground.
    """
    below = engine.ground_below(releases.x)
    for i in np.flatnonzero((below[:, 1] < 0) | (below[:, 2] < 0))[:1]:
        where = ", ".join(f"{c:.3f}" for c in frame.points_to_input(releases.x[i]))
        which = f"source {names[releases.source[i]]!r}: rock {releases.rock[i]} at ({where})"
        top = np.array(releases.x[i : i + 1])
        top[0, 2] = max(engine.facets.high[2], top[0, 2]) + ABOVE_EVERYTHING
        over = engine.ground_below(top)[0]
        if over[1] < 0:
            raise InputError(f"{which} is off the terrain: there is no ground below or above it")
        depth = top[0, 2] - over[0] - releases.x[i, 2]
        raise InputError(f"{which} is {depth:.3g} m under the ground; raise it, or give the source above_ground")
