"""Tests of the tools for the section on rocks with a shape: search, shapes of real blocks, contacts of a block."""

import numpy as np
import pytest
from field_cases.blocks.race import Round, race
from field_cases.blocks.shapes import DENSITY, equant, lengths_of, of_mass, stretched
from field_cases.blocks.striking import LONGEST, STEP, Law, after_contact
from field_cases.search import Free

from rpf3d_core.ensemble.bodies import random_orientations
from rpf3d_core.shapes.families import box, family
from rpf3d_core.values import STANDARD_GRAVITY as G

LEVEL = np.array([[0.0, 0.0, 1.0]])
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
BOX = box((1.2, 0.8, 0.5))


def test_the_race_finds_the_best_set_though_few_rocks_are_noisy() -> None:
    draws = np.random.default_rng(2)

    def error(parameters, rocks: int) -> float:
        return (parameters["a"] - 0.4) ** 2 + 0.1 * abs(draws.normal()) / rocks

    found = race(error, (Free("a", 0.0, 1.0, 11), Free("b", 0.0, 1.0, 2)), (Round(10, 8), Round(1000, 3)))
    assert len(found) == 3 and found[0].tried == 22
    assert found[0].parameters["a"] == 0.4 and found[0].error <= found[1].error <= found[2].error


def test_sets_that_an_early_round_drops_do_not_fly_again() -> None:
    seen: list[tuple[float, int]] = []

    def error(parameters, rocks: int) -> float:
        seen.append((parameters["a"], rocks))
        return float(parameters["a"])

    race(error, (Free("a", 0.0, 1.0, 3),), (Round(5, 2), Round(50, 1)))
    assert seen == [(0.0, 5), (0.5, 5), (1.0, 5), (0.0, 50), (0.5, 50)]


def test_a_stretched_block_has_the_proportions_and_the_mass_of_the_real_one() -> None:
    found = stretched(BOX, (0.5, 1.5, 1.0), 900.0)
    assert found.volume * DENSITY == pytest.approx(900.0)
    assert lengths_of(found) / lengths_of(found)[2] == pytest.approx([3.0, 2.0, 1.0])


def test_an_equant_body_in_a_mass_keeps_its_shape() -> None:
    body = of_mass(family("equant"), 50.0)
    assert body.volume == pytest.approx(50.0 / DENSITY)
    flat = equant((0.4, 0.4, 0.1), 50.0)
    assert flat.volume == pytest.approx(body.volume) and np.ptp(lengths_of(flat)) > np.ptp(lengths_of(body))


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_a_block_that_lands_flat_loses_what_friction_takes_and_does_not_rebound(mu: float) -> None:
    start = np.array([[4.0, 0.0, -3.0, 0.0, 0.0, 0.0, *UPRIGHT]])
    vx, vy, vz, ended = after_contact(BOX, start, LEVEL, Law(0.0, mu, 0.0))[0]
    assert (vx, vy, vz) == pytest.approx((4.0 - mu * (3.0 + G * ended), 0.0, 0.0), abs=2.0 * mu * G * STEP + 1e-9)
    assert ended == pytest.approx(LONGEST, abs=2.0 * STEP), "it slides on until the end"


def test_a_block_that_lands_flat_with_restitution_flies_again() -> None:
    start = np.array([[0.0, 0.0, -3.0, 0.0, 0.0, 0.0, *UPRIGHT]])
    after = after_contact(BOX, start, LEVEL, Law(0.5, 0.3, 0.0))[0]
    assert after == pytest.approx((0.0, 0.0, 1.5, 0.0), abs=1e-9)


@pytest.mark.parametrize("law", [Law(0.0, 0.5, 0.1), Law(0.3, 1.0, 0.0)])
def test_no_orientation_gains_speed_without_spin(law: Law) -> None:
    count = 300
    motion = np.tile([12.0, 0.0, -8.0, 0.0, 0.0, 0.0], (count, 1))
    starts = np.hstack([motion, random_orientations(5, 0, np.arange(count))])
    after = after_contact(BOX, starts, np.repeat(LEVEL, count, axis=0), law)
    speed = np.linalg.norm(after[:, :3], axis=1)
    fallen = 2.0 * G * 0.75  # m2/s2; the centre cannot fall farther than from the corner's distance to the ground
    assert (speed**2 <= 12.0**2 + 8.0**2 + fallen).all()
    assert np.ptp(speed) > 1.0, "the orientation matters"
