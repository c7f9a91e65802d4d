"""Tests of the part of a budget reserved for the work after the flights, and of the last start of a set."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

from rpf3d_core.calibration import flying
from rpf3d_core.calibration.reserve import LARGEST, MARGIN, Pace, first_reserve


def test_a_quarter_of_the_budget_is_kept_until_the_time_is_measured() -> None:
    reserve = first_reserve(began=100.0, deadline=1000.0)
    assert reserve.seconds(100) == LARGEST * 900.0
    measured = reserve._replace(scores_s=2.0, files_s=3.0, sets=100)
    assert measured.seconds(100) == pytest.approx(MARGIN * 5.0)
    assert measured.seconds(200) == pytest.approx(MARGIN * (8.0 + 3.0))
    assert measured.seconds(10_000) == LARGEST * 900.0


def test_the_time_is_measured_once_and_only_where_it_gains_something() -> None:
    reserve = first_reserve(began=0.0, deadline=900.0)
    assert not reserve.should_measure(400.0)
    assert reserve.should_measure(500.0)
    assert not reserve._replace(files_s=3.0, sets=100).should_measure(500.0)
    assert not first_reserve(began=0.0, deadline=32.0).should_measure(20.0)


def test_no_set_begins_that_would_end_too_late() -> None:
    pace, began = Pace(workers=2), time.monotonic()
    pace.begin()
    assert not pace.is_too_late(time.monotonic() + 1.0)
    time.sleep(0.1)
    for _ in range(4):
        pace.count()
    assert 0.05 <= pace.set_s <= (time.monotonic() - began) / 2  # two at a time, four in 0.1 s or more
    assert pace.is_too_late(time.monotonic() + 0.5 * pace.set_s)
    assert not pace.is_too_late(time.monotonic() + 2.0 * pace.set_s + 1.0)


def test_sets_that_have_not_begun_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = list[float]()

    def fly(_slope: object, row: np.ndarray, _releases: object) -> float:
        begun.append(float(row[0]))
        return float(row[0])

    monkeypatch.setattr(flying, "fly_set", fly)
    monkeypatch.setattr(flying, "releases_of_round", lambda *_: None)
    monkeypatch.setattr(flying, "workers_of", lambda *_: 1)
    flown = list(flying.fly_sets(SimpleNamespace(), np.arange(9.0)[:, None], 0, lambda: len(begun) == 3))
    assert flown == begun == [0.0, 1.0, 2.0]  # and not the set that waited while the last one flew
