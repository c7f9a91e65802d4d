"""Tests of the rule that decides whether enough rocks have flown, for places with unknown energies or with none."""

import pytest

from rpf3d_core.hazard.convergence import Place, Step, is_enough, p95_change


def steps(*energies: float | None) -> list[Step]:
    """Return steps with twice the rocks each, in which one place has these p95 energies (J)."""
    return [Step(100 * 2**k, {"ramp": Place(0.1, 0.0, 0.001, energy)}) for k, energy in enumerate(energies)]


@pytest.mark.parametrize(
    ("energies", "change"),
    [
        ((10.0, 10.0), None),
        ((10.0, 12.5, 10.0), 0.25),
        ((None, 10.0, 10.0), 1.0),
        ((0.0, 10.0, 10.0), 1.0),
        ((10.0, 10.0, None), 0.0),
        ((0.0, 0.0, 0.0), 0.0),
        ((10.0, 10.0, 0.0), 1.0),
    ],
)
def test_the_change_of_an_energy_is_relative_to_the_last_step_and_known_for_rocks_that_all_rest(energies, change):
    assert p95_change(steps(*energies)) == (None if change is None else pytest.approx(change))


def test_rocks_that_all_rest_need_no_further_step():
    assert is_enough(steps(0.0, 0.0, 0.0), half_width=0.01, p95_energy=0.05)
    assert not is_enough(steps(0.0, 0.0), half_width=0.01, p95_energy=0.05)
