"""Tests of the advice of a refused calibration: more time only while rounds are left."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rpf3d_core.calibration.rounds import Result
from rpf3d_core.calibration.sampling import MOST_ROUNDS, sets_of_round
from rpf3d_core.calibration.verdict import advice_of


def flown(rounds: int, missing: int = 0) -> Result:
    """Return the result of a number of rounds; the last round lacks `missing` parameter sets."""
    counts = [sets_of_round(number, 2) for number in range(rounds)]
    numbers = np.repeat(np.arange(rounds), counts).tolist()[: sum(counts) - missing]
    posterior: Any = SimpleNamespace(z=np.zeros((len(numbers), 2)))
    nothing: Any = None
    return Result(posterior=posterior, proposed=nothing, flown=[], numbers=numbers, power=1.0)


@pytest.mark.parametrize(
    ("rounds", "missing", "complete"), [(MOST_ROUNDS, 0, True), (MOST_ROUNDS, 1, False), (MOST_ROUNDS - 1, 0, False)]
)
def test_all_rounds_are_flown_only_with_the_last_set(rounds: int, missing: int, complete: bool) -> None:
    assert flown(rounds, missing).is_complete == complete


def advice(noise: float, all_rounds: bool, effective: float = 40.0) -> str:
    """Return the advice for a refused calibration; the range of one of its two parameters did not shrink."""
    estimates = [SimpleNamespace(name="friction", shrinkage=0.5), SimpleNamespace(name="restitution", shrinkage=0.0)]
    found: Any = SimpleNamespace(
        noise=noise, all_rounds=all_rounds, rocks=128, estimates=estimates, effective=effective
    )
    return "; ".join(advice_of(found))


def test_more_time_is_proposed_only_while_rounds_are_left() -> None:
    assert "larger --budget" in advice(0.1, all_rounds=False)
    last = advice(0.1, all_rounds=True)
    assert "more time adds nothing" in last and "--budget" not in last
    assert "`calibration.rocks` above 128, in a new folder" in last


def test_noise_of_few_samples_is_a_reason_for_more_rocks_only_after_more_time() -> None:
    noisy = advice(9.0, all_rounds=False)
    assert noisy.index("--budget") < noisy.index("`calibration.rocks` above 128")
    assert "the noise of the log-likelihood is 9.0" in noisy


def test_a_parameter_is_not_judged_by_few_effective_samples() -> None:
    assert "remove restitution from the unknowns" in advice(0.1, all_rounds=False, effective=40.0)
    assert "from the unknowns" not in advice(0.1, all_rounds=False, effective=6.0)
