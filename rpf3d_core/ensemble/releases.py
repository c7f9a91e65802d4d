"""Draw the releases of all sources at random: start position, velocity and mass of each rock."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.bodies import DrawnBody, random_orientations, shape_numbers
from rpf3d_core.ensemble.flights import no_pieces
from rpf3d_core.ensemble.release_heights import ground_below_releases
from rpf3d_core.ensemble.release_triangles import ReleaseTriangles, places_on
from rpf3d_core.ensemble.sizes import AnyRock, sizes_of
from rpf3d_core.ensemble.throws import Throw, thrown
from rpf3d_core.errors import InputError
from rpf3d_core.materials.distributions import quantiles
from rpf3d_core.materials.streams import Purpose, uniform
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import WORLD
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Vec

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ABOVE_EVERYTHING = 1.0
"""Height (m) above the highest point of the terrain at which a vertical search for the ground starts."""


@dataclass(frozen=True, eq=False)
class Source:
    """A place from which rocks may fall, in the terrain's local frame: points, a line or an area.

    points : (P, 3) m; rocks start at the points in turn or, if `line`, spread uniformly along the line through the
        points
    breaks : with `line`, numbers of points, from 0, after which another line begins
    rocks : number of rocks; velocity : (3,) m/s
    spread, velocity_spread : (3,) half-widths of a uniform spread about the position (m) and the velocity (m/s)
    above_ground : m; if given, each position's height is replaced by the terrain's height plus this value
    triangles : used instead of points: rocks are spread uniformly over the area of these triangles, without `spread`;
        above_ground is then the height above the triangle
    throw : speed and direction, used instead of velocity; velocity_spread is added to the result
    """

    name: str
    points: FloatArray
    rocks: int
    velocity: Vec = (0.0, 0.0, 0.0)
    line: bool = False
    spread: Vec = (0.0, 0.0, 0.0)
    velocity_spread: Vec = (0.0, 0.0, 0.0)
    above_ground: float | None = None
    triangles: ReleaseTriangles | None = None
    throw: Throw | None = None
    breaks: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Releases:
    """The releases of R rocks: place, velocity and size at the start, in order of source, then rock.

    source, rock : (R,) indices; x : (R, 3) m, local; v : (R, 3) m/s; mass : (R,) kg; radius : (R,) m
    piece : (R,) number of a fragment within its rock, from 1; 0 for the rock itself; zeros by default
    t : (R,) s, start of a fragment's flight after the release of its rock; zeros by default
    shape, pose : (R,) number of each rock's shape, and (R, 4) its orientation w, x, y, z; None for points and spheres
    """

    source: IntArray
    rock: IntArray
    x: FloatArray
    v: FloatArray
    mass: FloatArray
    radius: FloatArray
    piece: IntArray = field(default_factory=no_pieces)
    t: FloatArray = field(default_factory=lambda: np.empty(0))
    shape: IntArray | None = None
    pose: FloatArray | None = None

    def __post_init__(self) -> None:
        """Fill in `piece` and `t` if they are not given: whole rocks, released at 0 s."""
        if len(self.piece) != len(self.source):
            object.__setattr__(self, "piece", np.zeros(len(self.source), dtype=np.int64))
            object.__setattr__(self, "t", np.zeros(len(self.source)))


def releases_of(
    sources: Sequence[Source],
    rock: AnyRock,
    seed: int,
    engine: Engine,
    frame: Frame = WORLD,
    first: int = 0,
    count: int | None = None,
) -> Releases:
    """Return the releases of all sources, or only `count` releases from row `first` on, drawn at random.

    A release has the same bits whether all releases are drawn or only some.

    rock : size of the rocks; first : row of the first release to draw; count : number of releases, None for all
    engine : engine over the terrain, which gives the terrain height for `above_ground`
    frame : frame of the terrain, for coordinates in messages

    Raises
    ------
    InputError
        `above_ground` at a position without terrain; the message names the source and the position in input
        coordinates.
    """
    ranges = ranges_of([source.rocks for source in sources], first, count)
    return releases_in(sources, ranges, rock, seed, engine, frame)


def releases_in(
    sources: Sequence[Source],
    ranges: Sequence[range | IntArray],
    rock: AnyRock,
    seed: int,
    engine: Engine,
    frame: Frame = WORLD,
) -> Releases:
    """Return the releases of some rocks of each source, drawn at random; rock numbers may exceed `Source.rocks`.

    ranges : for each source, a range of rock numbers, or the numbers themselves (N,)
    rock, seed, engine, frame : as in `releases_of`

    Raises
    ------
    InputError
        As `releases_of`.
    """
    numbers = [np.arange(span.start, span.stop, span.step) if isinstance(span, range) else span for span in ranges]
    each = [(source, i, rocks) for i, (source, rocks) in enumerate(zip(sources, numbers, strict=True))]
    sizes = [sizes_of(rock, seed, i, rocks) for _, i, rocks in each]
    return Releases(
        source=np.repeat(np.arange(len(sources)), [len(rocks) for rocks in numbers]),
        rock=np.concatenate(numbers),
        x=np.concatenate([_positions(source, i, rocks, seed, engine, frame) for source, i, rocks in each]),
        v=np.concatenate([_velocities(source, i, rocks, seed) for source, i, rocks in each]),
        mass=np.concatenate([mass for mass, _ in sizes]),
        radius=np.concatenate([radius for _, radius in sizes]),
        **(_shapes(rock, seed, [(i, rocks) for _, i, rocks in each]) if isinstance(rock, DrawnBody) else {}),
    )


def _shapes(rock: DrawnBody, seed: int, each: Sequence[tuple[int, IntArray]]) -> dict[str, Any]:
    """Return the columns `shape` and `pose` of `Releases` for the rocks of all sources, drawn at random.

    each : number of each source, and the numbers of its rocks
    """
    return {
        "shape": np.concatenate([shape_numbers(rock, seed, i, rocks) for i, rocks in each]),
        "pose": np.concatenate([random_orientations(seed, i, rocks) for i, rocks in each]),
    }


def ranges_of(rocks: Sequence[int], first: int = 0, count: int | None = None) -> list[range]:
    """Return, for each source, the range of its rocks that lie in a given part of the rows of the ensemble.

    Rows are numbered through all sources, in order of source; rocks are numbered within their source.
    rocks : number of rocks of each source
    first, count : first row of the part, and its number of rows; None for all rows to the end
    """
    last = sum(rocks) if count is None else first + count
    ranges, row = [], 0
    for its in rocks:
        ranges.append(range(*(min(max(edge - row, 0), its) for edge in (first, last))))
        row += its
    return ranges


def share_out(sources: Sequence[int], total: int) -> list[int]:
    """Return how many of `total` rocks each source gets, in proportion to the sources' own numbers of rocks.

    The largest remainder method gives whole numbers. If remainders are equal, the first source gets the additional
    rock.

    sources : number of rocks of each source
    """
    numbers = np.array(sources, dtype=float)
    exact = numbers / numbers.sum() * total
    shares = np.floor(exact).astype(int)
    order = np.argsort(-(exact - shares), kind="stable")
    shares[order[: total - shares.sum()]] += 1
    return [int(n) for n in shares]


def _positions(source: Source, number: int, rocks: IntArray, seed: int, engine: Engine, frame: Frame) -> FloatArray:
    """Return the release positions (R, 3) m of the rocks of a source, from their numbers (R,).

    number : of the source, from 0, which selects the random numbers; rocks : (R,) numbers of the rocks
    """
    if source.triangles is not None:
        purposes = (Purpose.IN_AREA, Purpose.ACROSS_FACET, Purpose.ALONG_FACET)
        places = places_on(source.triangles, *(uniform(seed, number, rocks, purpose) for purpose in purposes))
        places[:, 2] += source.above_ground or 0.0
        return places
    if source.line:
        x = _along(source.points, source.breaks, uniform(seed, number, rocks, Purpose.ALONG_LINE))
    else:
        x = source.points[rocks % len(source.points)]
    purposes = (Purpose.POSITION_X, Purpose.POSITION_Y, Purpose.POSITION_Z)
    x = x + _spread(source.spread, purposes, seed, number, rocks)
    return x if source.above_ground is None else _over_ground(source, x, engine, frame)


def _velocities(source: Source, number: int, rocks: IntArray, seed: int) -> FloatArray:
    """Return the release velocities (R, 3) m/s of the rocks of a source, from their numbers (R,).

    number, rocks : as in `_positions`
    """
    purposes = (Purpose.VELOCITY_X, Purpose.VELOCITY_Y, Purpose.VELOCITY_Z)
    spread = _spread(source.velocity_spread, purposes, seed, number, rocks)
    return spread + (np.array(source.velocity) if source.throw is None else _thrown(source.throw, number, rocks, seed))


def _thrown(throw: Throw, number: int, rocks: IntArray, seed: int) -> FloatArray:
    """Return the release velocities (R, 3) m/s of rocks thrown with a drawn speed in a drawn direction.

    number, rocks : as in `_positions`
    """
    speed = quantiles(throw.speed, uniform(seed, number, rocks, Purpose.SPEED))
    if throw.spread == 0.0:
        return thrown(throw, speed, speed, speed)
    tilt, turn = (uniform(seed, number, rocks, purpose) for purpose in (Purpose.TILT, Purpose.TURN))
    return thrown(throw, speed, tilt, turn)


def _spread(half: Vec, purposes: Sequence[Purpose], seed: int, number: int, rocks: IntArray) -> FloatArray:
    """Return random deviations (R, 3) of positions or velocities, within given half-widths (3,).

    No number is drawn for a half-width of 0.
    half : half-widths along the three axes; purposes : of the random numbers, one for each axis
    number : index of the source; rocks : (R,) numbers of the rocks within the source
    """
    deviations = np.zeros((len(rocks), 3))
    for k, purpose in enumerate(purposes):
        if half[k] > 0.0:
            deviations[:, k] = (2.0 * uniform(seed, number, rocks, purpose) - 1.0) * half[k]
    return deviations


def _along(points: FloatArray, breaks: Sequence[int], share: FloatArray) -> FloatArray:
    """Return points (R, 3) m on a line source through points (P, 3) m, at given shares (R,) of the line's length.

    breaks : indices of the points after which the line is interrupted; gaps do not count in its length
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    steps[list(breaks)] = 0.0
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    return np.stack([np.interp(share * reached[-1], reached, points[:, k]) for k in range(3)], axis=1)


def _over_ground(source: Source, x: FloatArray, engine: Engine, frame: Frame) -> FloatArray:
    """Return positions (R, 3) m: x and y of the given positions, z the highest terrain there plus `above_ground` (m).

    x : (R, 3) m. Raises `InputError` if there is no terrain at a position.
    """
    top = np.array(x)
    top[:, 2] = engine.facets.high[2] + ABOVE_EVERYTHING
    found = engine.ground_below(top)
    for i in np.flatnonzero(found[:, 1] < 0)[:1]:
        where = ", ".join(f"{c:.3f}" for c in frame.points_to_input(x[i]))
        raise InputError(f"source {source.name!r} is off the terrain: there is no ground below or above ({where})")
    top[:, 2] -= found[:, 0] - (source.above_ground or 0.0)
    return top


def check_above_ground(releases: Releases, names: Sequence[str], engine: Engine, frame: Frame) -> None:
    """Raise an error if a rock starts under the ground or outside the terrain.

    names : names of the sources, by number; frame : frame of the terrain, for coordinates in messages

    Raises
    ------
    InputError
        The message names the source, the rock and its position in input coordinates. It also states the depth of the
        rock under the ground, unless the rock is outside the terrain.
    """
    below = ground_below_releases(engine, releases.x)
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
