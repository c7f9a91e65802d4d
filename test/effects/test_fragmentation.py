"""Tests of rocks that break: new surface by hand, mass, fragments as separate rocks, reproducible bits."""

import dataclasses
import math

import numpy as np
import pytest
from flights.scenes_of_facets import ENGINES, engine_over, flight, rough_grid, same_bits, surface

from rpf3d_core.effects.fragmentation import Fragmentation, new_surface_ratio, volume_of
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.broken import DUST_UNITS, SOURCES
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.pieces import thrown
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import Shown, Stream, shown_of, taken
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.values import Outcome, Rock

RADIUS = 0.5
BOULDER = Rock(2700.0 * 4.0 / 3.0 * math.pi * RADIUS**3, RADIUS)
ROUNDING = 1e-12
GROUND = rough_grid(12, 60.0, 0.9, 0.6)


def breaking(least_ratio: float = 0.2, generations: int = 3, **other: float) -> Fragmentation:
    """Return the defaults of RockGIS with a lower least ratio, which these rocks reach. other : values by name"""
    usual = {"spread": 0.06, "least_volume": 1e-3, "surface_factor": 0.0031} | other
    return Fragmentation(
        usual["surface_factor"], 0.7562, least_ratio, usual["spread"], usual["least_volume"], math.sqrt(0.99),
        math.radians(25.0), math.radians(5.0), generations,
    )  # fmt: skip


def with_breaking(effect: Fragmentation | None, seed: int = 3) -> Flight:
    physics = flight(surface(0.6, 0.9), "sliding", seed=seed)
    effects = None if effect is None else chain_of([effect])
    return dataclasses.replace(physics, models=physics.models._replace(effects=effects))


def rocks(count: int = 12) -> Releases:
    numbers, ones = np.arange(count), np.ones(count)
    x = np.stack([2.0 + 0.4 * numbers, 15.0 + 2.0 * numbers, 25.0 + 0.0 * numbers], axis=1)
    v = np.tile((8.0, 0.3, 0.0), (count, 1))
    return Releases(numbers % 2, numbers // 2, x, v, BOULDER.mass * ones, RADIUS * ones)


def stream(engine: Engine, effect: Fragmentation | None, blocks: int = 1, **how: object) -> tuple[Stream, Flights]:
    """Fly twelve rocks in `blocks` blocks; return the stream and its flights. effect : None for no fragmentation"""
    releases = rocks()
    flown = Stream(engine, with_breaking(effect), Shown(None, shown_of(12, None, 12).paths), **how)  # type: ignore[arg-type]
    assert flown.fly(taken(releases, np.arange(12)[k::blocks]) for k in range(blocks))
    return flown, flown.flights(0.0, 0.0)


def families(flights: Flights) -> dict[tuple[int, int, int], tuple[float, ...]]:
    """Return (source, rock, piece) -> (mass kg, outcome, time s, x, y, z m) of the end of each rock and fragment."""
    d = flights.deposits
    keys = zip(d.source.tolist(), d.rock.tolist(), d.piece.tolist(), strict=True)
    values = zip(d.mass.tolist(), d.outcome.tolist(), d.t.tolist(), *d.x.T.tolist(), strict=True)
    return dict(zip(keys, values, strict=True))


def test_the_ratio_of_surfaces_is_that_of_the_formula():
    """For a cube of 1 m3, 2,700 kg and 10 m/s: E = 135 kJ, A_new = 0.0031 * 135000^0.7562 = 23.48 m2, r = 0.7965."""
    cube = Rock(2700.0, (3.0 / (4.0 * math.pi)) ** (1.0 / 3.0))
    assert volume_of(cube) == pytest.approx(1.0, rel=1e-12)
    new = 0.0031 * math.exp(0.7562 * math.log(135_000.0))
    assert new_surface_ratio(breaking(), cube, 10.0) == pytest.approx(new / (new + 6.0), rel=1e-12)


def test_pieces_fly_in_their_cone_and_off_the_ground():
    v, n, draw = np.array([6.0, 2.0, 1.0]), np.array([0.0, 0.0, 1.0]), np.random.default_rng(1)
    ways = np.array([thrown(breaking(), v, n, *draw.uniform(size=2)) for _ in range(4000)])
    speed = math.sqrt(0.99) * np.linalg.norm(v)
    assert np.linalg.norm(ways, axis=1) == pytest.approx(speed, rel=ROUNDING)
    assert ways[:, 2].min() >= math.sin(math.radians(5.0)) * speed * (1.0 - ROUNDING)
    steep = np.array([thrown(breaking(), 7.0 * n, n, *draw.uniform(size=2)) for _ in range(4000)])
    cosines = steep[:, 2] / (7.0 * math.sqrt(0.99))
    assert cosines.min() >= math.cos(math.radians(25.0)) - ROUNDING
    assert cosines.mean() == pytest.approx(0.5 * (1.0 + math.cos(math.radians(25.0))), abs=3e-3)  # even on the cone


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("least_volume", [1e-3, 0.05])
def test_mass_is_kept_through_all_generations(engine, least_volume):
    flown, flights = stream(engine_over(engine, GROUND), breaking(least_volume=least_volume))
    whole = flights.deposits.outcome != Outcome.FRAGMENTED
    assert flown.pieces == (flights.deposits.piece > 0).sum() > 12
    dust = flown.dust / DUST_UNITS
    assert dust > 0.0
    assert flights.deposits.mass[whole].sum() + dust == pytest.approx(12.0 * BOULDER.mass, rel=ROUNDING)


def test_pieces_are_rocks_of_their_own():
    """Each fragment has its own number in the family of its rock, and no two fragments have the same end."""
    _, flights = stream(engine_over("reference", GROUND), breaking())
    family = families(flights)
    assert len(family) == len(flights.deposits.rock)
    ends = [value[2:] for key, value in family.items() if key[2] > 0]
    assert len(set(ends)) == len(ends)
    for source, rock in {key[:2] for key in family}:
        numbers = sorted(key[2] for key in family if key[:2] == (source, rock))
        assert numbers == list(range(len(numbers)))
        assert (family[source, rock, 0][1] == Outcome.FRAGMENTED) == (len(numbers) > 1)


def test_pieces_fly_from_where_and_when_their_rock_broke():
    flown, flights = stream(engine_over("reference", GROUND), breaking(generations=1))
    d = flights.deposits
    for row in np.flatnonzero(d.piece > 0):
        parent = np.flatnonzero((d.source == d.source[row]) & (d.rock == d.rock[row]) & (d.piece == 0))[0]
        assert np.array_equal(d.release[row], d.x[parent])
        begin = flights.paths.t[flights.paths.row == row][0]
        assert begin == d.t[parent] < d.t[row]
        assert np.all(flights.impacts.t[flights.impacts.row == row] >= begin)
    assert flown.pieces > 0


def test_the_last_generation_breaks_no_more():
    once, _ = stream(engine_over("reference", GROUND), breaking(0.05, generations=1))
    more, _ = stream(engine_over("reference", GROUND), breaking(0.05, generations=4))
    _, flights = stream(engine_over("reference", GROUND), breaking(0.05, generations=1))
    assert np.all(flights.deposits.outcome[flights.deposits.piece > 0] != Outcome.FRAGMENTED)
    assert more.pieces > once.pieces


def test_engines_threads_and_blocks_leave_the_same_families():
    compiled, reference = (engine_over(name, GROUND) for name in ("compiled", "reference"))
    _, one = stream(reference, breaking())
    _, other = stream(compiled, breaking(), threads=1)
    assert same_bits(one, other)
    for blocks, threads in ((1, 3), (3, 2), (5, 1)):
        _, parts = stream(compiled, breaking(), blocks, threads=threads)
        assert families(parts) == families(one)


def test_pieces_that_fly_a_few_parents_at_a_time_are_the_same(monkeypatch):
    """About PIECES fragments are in memory at the same time."""
    engine = engine_over("compiled", GROUND)
    whole, one = stream(engine, breaking())
    monkeypatch.setattr("rpf3d_core.ensemble.pieces.PIECES", 7)
    parts, other = stream(engine, breaking())
    assert families(one) == families(other) and whole.dust == parts.dust
    assert whole.pieces > 70


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("effect", [breaking(math.inf), breaking(0.2, surface_factor=0.0)], ids=["tough", "no-surface"])
def test_rocks_too_tough_to_break_leave_every_bit_as_it_was(engine, effect):
    over = engine_over(engine, GROUND)
    (_, calm), (flown, tough) = stream(over, None), stream(over, effect)
    assert same_bits(calm, tough)
    assert (flown.pieces, flown.dust) == (0, 0)


def test_a_draw_of_a_piece_is_no_other_rocks():
    """Keys of draws are (source number, rock number); source numbers of fragments lie beyond all real ones."""
    keys = {(source + SOURCES * piece, rock) for source in range(3) for rock in range(4) for piece in range(5)}
    assert len(keys) == 3 * 4 * 5
    assert all(key[0] < 2**32 for key in keys)
