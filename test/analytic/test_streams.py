"""Tests of random numbers: vectors published with the generator, and properties that draws must have."""

import numpy as np
import pytest

from rpf3d_core.materials.streams import MANY, Purpose, philox, philox_words, uniform, uniform_at

ONES = 0xFFFFFFFF
KNOWN_ANSWERS = [
    ((0, 0, 0, 0), (0, 0), "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ((ONES,) * 4, (ONES,) * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]


@pytest.mark.parametrize(
    ("counter", "key", "words"), KNOWN_ANSWERS, ids=["Random123-kat-zeros", "Random123-kat-ones", "Random123-kat-pi"]
)
def test_philox_gives_the_published_words(counter, key, words):
    found = philox(np.array(counter, dtype=np.uint64).reshape(4, 1), key)
    assert " ".join(f"{int(word):08x}" for word in found[:, 0]) == words


def test_many_counters_at_once_are_each_as_if_alone():
    counters = np.stack([np.array(c, dtype=np.uint64) for c, _, _ in KNOWN_ANSWERS], axis=1)
    together = philox(counters, (1, 2))
    alone = [philox(counters[:, [i]], (1, 2))[:, 0] for i in range(3)]
    np.testing.assert_array_equal(together.T, alone)


def test_the_numbers_of_a_rock_do_not_depend_on_how_many_are_drawn_or_in_what_order():
    rocks = np.arange(1000)
    every = uniform(7, 3, rocks, Purpose.POSITION_X)
    np.testing.assert_array_equal(uniform(7, 3, rocks[::-1], Purpose.POSITION_X), every[::-1])
    np.testing.assert_array_equal(uniform(7, 3, [512], Purpose.POSITION_X), every[[512]])


@pytest.mark.parametrize("change", ["seed", "high_seed", "source", "purpose"])
def test_another_seed_source_or_purpose_gives_other_numbers(change):
    arguments = {"seed": (8, 3, 1), "high_seed": (7 + 2**32, 3, 1), "source": (7, 4, 1), "purpose": (7, 3, 2)}[change]
    rocks = np.arange(100)
    one, other = uniform(7, 3, rocks, Purpose(1)), uniform(arguments[0], arguments[1], rocks, Purpose(arguments[2]))
    assert not np.any(one == other)


def test_a_hundred_thousand_numbers_are_spread_evenly_over_zero_to_one():
    draws = uniform(1, 0, np.arange(100_000), Purpose.ALONG_LINE)
    assert draws.min() >= 0.0 and draws.max() < 1.0
    counts = np.bincount((draws * 100).astype(int), minlength=100)
    chi_squared = ((counts - 1000.0) ** 2 / 1000.0).sum()
    assert 60.0 < chi_squared < 150.0  # 99 degrees of freedom: outside in fewer than 1 of 1,000 sound generators
    assert abs(np.corrcoef(draws[:-1], draws[1:])[0, 1]) < 0.013  # 4 standard errors


@pytest.mark.parametrize(("counter", "key", "words"), KNOWN_ANSWERS, ids=["zeros", "ones", "pi"])
@pytest.mark.parametrize("run", ["plain", "compiled"])
def test_the_kernel_gives_the_published_words_in_both_engines(run, counter, key, words):
    call = philox_words
    if run == "compiled":
        numba = pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine")
        call = numba.njit(lambda a, b, c, d, e, f: philox_words(a, b, c, d, e, f))
    assert " ".join(f"{int(word):08x}" for word in call(*counter, *key)) == words


def test_a_rock_draws_in_a_kernel_what_it_draws_in_an_array():
    seed = 2**62 + 12345678901
    alone = [uniform_at(seed, 3, rock, int(Purpose.SPEED), 0) for rock in range(50)]
    np.testing.assert_array_equal(uniform(seed, 3, np.arange(50), Purpose.SPEED), alone)


def test_so_many_numbers_that_they_are_compiled_have_the_same_bits():
    rocks = np.arange(MANY + 10)
    seed = 2**40 + 5
    together = uniform(seed, 2, rocks, Purpose.TURN)
    np.testing.assert_array_equal(together[-100:], uniform(seed, 2, rocks[-100:], Purpose.TURN))
    np.testing.assert_array_equal(together[:100], uniform(seed, 2, rocks[:100], Purpose.TURN))


def test_purposes_keep_the_numbers_that_answers_were_given_with():
    assert [purpose.value for purpose in Purpose] == sorted({purpose.value for purpose in Purpose})
    assert [purpose.value for purpose in list(Purpose)[:17]] == list(range(17))
    assert Purpose.VELOCITY_Z == 6 and Purpose.FRICTION_ANGLE == 16 and Purpose.REBOUND_MATRIX == 20
    assert Purpose.ROUGHNESS == 28 and Purpose.TREE_CLASS == 32 and Purpose.BREAKING == 48
    assert Purpose.ROUGHNESS_LATERAL == 31
    assert Purpose.ROLLING_FRICTION == 60 and max(Purpose) < 200, "from 200 on they are the user's own"
