"""Tests of the sizes of fragments: balance of volume and surface; harder impacts give more and smaller fragments."""

import cProfile
import math

import numpy as np
import pytest

from rpf3d_core.effects.fragment_sizes import cascade_of, count_from, share_at, zeta_less_one
from rpf3d_core.effects.fragmentation import Fragmentation
from rpf3d_core.ensemble.broken import DUST_UNITS, Broken
from rpf3d_core.ensemble.pieces import pieces_of
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.runs.run import simulate

DENSITY = 2700.0
FACTOR, POWER = 0.0031, 0.7562
"""Factor and exponent of the new surface over the energy: defaults of RockGIS."""
TERMS = 2_000_000
CREATED = np.geomspace(1e-3, 1e3, 61)
"""New surface over the surface of the rock; the ratio r of new to total surface is then 0.001 to 0.999."""
CRUSHED = 21.0
"""Volume of a rock over the least volume: from this ratio on, more new surface never gives fewer fragments that fly."""


def effect(least_volume: float = 1e-4, least_ratio: float = 0.0) -> Fragmentation:
    return Fragmentation(
        FACTOR, POWER, least_ratio, 0.0, least_volume, math.sqrt(0.99), math.radians(25.0), math.radians(5.0), 1
    )


def pieces_at(
    speeds: np.ndarray, volume: float, least_volume: float = 1e-4, compiled: bool = True
) -> tuple[list[np.ndarray], float, float]:
    """Let rocks of one volume (m3) break, each at one of the speeds (K,) m/s.

    Return the volumes (m3) of the fragments of each rock, the mass (kg) of all dust, and the mass (kg) of one rock.
    """
    count = len(speeds)
    mass, radius = DENSITY * volume, (3.0 * volume / (4.0 * math.pi)) ** (1.0 / 3.0)
    ones, zero, up = np.ones(count), np.zeros((count, 3)), np.tile((0.0, 0.0, 1.0), (count, 1))
    rocks = Releases(np.zeros(count, dtype=np.int64), np.arange(count), zero, zero, mass * ones, radius * ones)
    broken = Broken(np.arange(count), np.zeros(count), zero, speeds[:, None] * up, up)
    made, dust = pieces_of(effect(least_volume), 7, rocks, broken, {}, compiled)
    return [made.mass[made.rock == k] / DENSITY for k in range(count)], dust / DUST_UNITS, mass


def sum_over_ranks(exponent: float) -> float:
    """Return the sum of k^-exponent over all k >= 1: TERMS terms, and an integral for the rest."""
    terms = np.arange(1, TERMS + 1, dtype=float) ** -exponent
    return math.fsum(terms) + (TERMS + 0.5) ** (1.0 - exponent) / (exponent - 1.0)


@pytest.mark.parametrize("exponent", [1.05, 1.2, 1.5, 2.0, 2.5, 4.0, 9.0, 40.0])
def test_the_zeta_function_is_its_sum(exponent):
    assert zeta_less_one(exponent - 1.0) == pytest.approx(sum_over_ranks(exponent) - 1.0, rel=1e-11)


def test_the_zeta_function_has_its_closed_forms():
    assert zeta_less_one(1.0) + 1.0 == pytest.approx(math.pi**2 / 6.0, rel=4e-15)
    assert zeta_less_one(3.0) + 1.0 == pytest.approx(math.pi**4 / 90.0, rel=4e-15)


@pytest.mark.parametrize("created", [1e-3, 0.1, 1 / 3, 1.0, 7 / 3, 9.0, 99.0, 1e3])
def test_fragments_have_the_volume_of_their_rock_and_the_surface_that_was_created(created):
    cascade = cascade_of(created)
    volume = cascade.largest * sum_over_ranks(cascade.exponent)
    surface = cascade.largest ** (2.0 / 3.0) * sum_over_ranks(2.0 / 3.0 * cascade.exponent)
    assert volume == pytest.approx(1.0, rel=1e-10)
    assert surface == pytest.approx(1.0 + created, rel=1e-10)


def test_the_largest_fragment_is_what_rockgis_calls_the_rate_of_survival_where_it_is_used():
    """The rate of survival 1 - 0.5125 r was fitted to measured fragments; the cascade was not fitted to it."""
    for ratio in (0.25, 0.3, 0.4, 0.5):
        assert cascade_of(ratio / (1.0 - ratio)).largest == pytest.approx(1.0 - 0.5125 * ratio, abs=0.06)


@pytest.mark.parametrize("least", [1 / CRUSHED, 0.01, 1e-3, 1e-4, 1e-5])
def test_more_surface_gives_more_fragments_above_any_volume(least):
    counts = [count_from(cascade_of(created), least) for created in CREATED]
    assert np.all(np.diff(counts) >= 0) and counts[-1] > counts[0]


def test_more_surface_gives_a_smaller_largest_fragment_and_a_greater_dimension():
    cascades = [cascade_of(created) for created in CREATED]
    assert np.all(np.diff([cascade.largest for cascade in cascades]) < 0.0)
    assert np.all(np.diff([3.0 / cascade.exponent for cascade in cascades]) > 0.0)
    assert 3.0 / cascades[-1].exponent < 2.0


def test_fragments_from_the_fifth_on_grow_with_the_surface_and_the_first_four_shrink_as_stated():
    shares = np.array([[share_at(cascade_of(created), rank) for rank in range(1, 40)] for created in CREATED])
    assert np.all(np.diff(shares[:, 4:], axis=0) >= 0.0)
    shrunk = 1.0 - shares[-1, 1:4] / shares[:, 1:4].max(axis=0)
    assert np.all(shrunk <= (0.125, 0.03, 0.0025))


@pytest.mark.parametrize("volume", [0.01, 0.5, 4.0])
def test_harder_impacts_never_give_fewer_pieces(volume):
    pieces, _, _ = pieces_at(np.linspace(0.5, 40.0, 200), volume)
    counts = [len(some) for some in pieces]
    assert np.all(np.diff(counts) >= 0) and counts[-1] > counts[0] >= 1


def test_the_surface_of_pieces_follows_the_energy():
    """The surfaces 6 V^(2/3) of all fragments sum to A_0 + A_new; those too small to fly follow the power law."""
    volume, speeds = 1.0, np.array([1.0, 2.0, 4.0, 6.0, 8.0])
    pieces, _, mass = pieces_at(speeds, volume, 1e-6)
    for some, speed in zip(pieces, speeds, strict=True):
        wanted = 6.0 * volume ** (2 / 3) + FACTOR * (0.5 * mass * speed * speed) ** POWER
        some = np.sort(some)[::-1]
        if len(some) < 4:
            continue
        power = 2 / 3 * math.log(some[0] / some[-1]) / math.log(len(some))
        beyond = 6.0 * some[0] ** (2 / 3) * (len(some) + 0.5) ** (1.0 - power) / (power - 1.0)
        assert 6.0 * math.fsum(some ** (2 / 3)) + beyond == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize("least_volume", [1e-6, 1e-4, 1e-2])
def test_pieces_and_dust_have_the_mass_of_their_rocks(least_volume):
    speeds = np.linspace(0.5, 40.0, 50)
    pieces, dust, mass = pieces_at(speeds, 0.3, least_volume)
    flying = math.fsum(DENSITY * piece for some in pieces for piece in some)
    assert flying + dust == pytest.approx(len(speeds) * mass, rel=1e-12)
    assert min(some.min() for some in pieces) >= least_volume * (1.0 - 1e-12)


def test_both_engines_make_the_same_pieces():
    """The fragments agree to the last bit."""
    random = np.random.default_rng(11)
    count = 60
    v, n = random.normal(size=(count, 3)) * 9.0, random.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    radius = random.uniform(0.1, 1.5, count)
    rocks = Releases(
        np.arange(count) % 3, np.arange(count) // 3, 0.0 * v, v, DENSITY * 4.0 / 3.0 * np.pi * radius**3, radius
    )
    broken = Broken(np.arange(count), np.arange(count) * 0.1, v, v, n)
    compiled, plain = (pieces_of(effect(), 5, rocks, broken, {}, how) for how in (True, False))
    assert compiled[1] == plain[1] and len(compiled[0].x) > 10 * count
    for name in ("source", "rock", "x", "v", "mass", "radius", "piece", "t"):
        assert np.array_equal(getattr(compiled[0], name), getattr(plain[0], name)), name


def test_no_python_code_runs_for_each_fragment():
    """Otherwise a fragment costs several times as much as the flight of a rock."""
    few, many = (calls_for_pieces(least_volume, compiled=True) for least_volume in (1e-3, 1e-6))
    assert many[1] > 50 * few[1] > 1_000 and many[0] <= few[0] + 10
    called, made = calls_for_pieces(1e-3, compiled=False)
    assert called > made, "Python code for each fragment is counted"


def calls_for_pieces(least_volume: float, compiled: bool) -> tuple[int, int]:
    """Make the fragments of 20 rocks; return the number of Python calls, and the number of fragments."""
    pieces_at(np.full(1, 20.0), 0.3)  # compiles
    profile = cProfile.Profile()
    profile.enable()
    pieces, _, _ = pieces_at(np.full(20, 20.0), 0.3, least_volume, compiled)
    profile.disable()
    return sum(entry.callcount for entry in profile.getstats()), sum(map(len, pieces))


@pytest.mark.long
def test_the_default_does_not_break_nearly_all_rocks_of_a_pit(tmp_path):
    """With least_ratio = 0.5, 198 of these 200 rocks would break."""
    scene = tmp_path / "pit.yaml"
    scene.write_text(
        "terrain: {pit: {triangles: 20000, seed: 1}}\n"
        "materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}\n"
        "rock: {density: 2700, diameter: 1.0}\n"
        "sources:\n  - {name: wall, line: [[-603.49, -150, 1687], [-607.44, -25, 1687], [-607.03, 0, 1687],"
        " [-596.49, 100, 1687], [-584.23, 150, 1687]], above_ground: 0.5, rocks: 200, velocity: [2, 0, 0]}\n"
        "rebound: constant\nground: none\nstop_speed: 0.5\nseed: 1\neffects: {fragmentation: {}}\n"
    )
    deposits = simulate(scene, engine="compiled").flights.deposits
    broken = (deposits.piece == 0) & np.isin(deposits.rock, deposits.rock[deposits.piece > 0])
    assert 0 < broken.sum() < 50
