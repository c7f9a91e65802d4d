"""Tests that the report's part on barriers has both intervals of each figure, and states unknown ones."""

import pytest

from rpf3d_core.report.barriers_part import LEAVES_OUT, SAMPLING_ONLY, barriers_part
from rpf3d_core.report.elements import Table, Text


def section(over_sets: bool, **more):
    share = {"rocks": 403, "share": 0.655, "interval_95": [0.617, 0.692]}
    design = {"rocks": 615, "p95": 227e3, "max": 1410e3, "p95_interval_95": [172e3, None]}
    high = {"rocks": 615, "p95": 10.2, "max": 15.6, "p95_interval_95": [9.0, 12.2]}
    if over_sets:
        share |= {"interval_95": [0.03, 1.0], "predictive": [0.03, 1.0], "sampling": [0.617, 0.692]}
        design |= {"p95_predictive": [None, None]}
        high |= {"p95_predictive": [4.0, 14.0]}
    did = dict.fromkeys(("caught", "first_broken_through", "first_flown_over"), share)
    facts = {"height_m": 2.0, "capacity_j": 500e3, "came": 615, **did, "first_energy_j": design,
             "first_height_over_ground_m": high}  # fmt: skip
    return {"fence": {**facts, **more}}


def tables_of(barriers):
    return [element for element in barriers_part(barriers, 939) if isinstance(element, Table)]


def words_of(barriers):
    return " ".join(element.text for element in barriers_part(barriers, 939) if isinstance(element, Text))


def test_shares_energies_and_heights_have_both_intervals():
    shares, energies, heights = tables_of(section(True))
    assert list(shares.rows[0]) == ["fence", "615", "came", "65.5 %", "not known", "62-69 %"]
    assert list(shares.rows[1]) == ["", "", "caught in the end", "65.5 %", "3-100 %", "61-70 %"]
    assert list(energies.rows[0]) == [
        "fence", "227 kJ", "not known", "at least 172 kJ", "1,410 kJ", "500 kJ",
    ]  # fmt: skip
    assert list(heights.rows[0]) == ["fence", "10.2 m", "4.0 m to 14.0 m", "9.0 m to 12.2 m", "2 m"]
    assert SAMPLING_ONLY in words_of(section(True))


def test_without_unknowns_no_predictive_interval_is_known():
    shares, energies, heights = tables_of(section(False))
    assert {row[4] for row in shares.rows} == {"not known"} == {row[2] for row in (*energies.rows, *heights.rows)}
    assert shares.rows[1][5] == "61-70 %"


@pytest.mark.parametrize("stated", [True, False])
def test_a_misfit_that_intervals_leave_out_is_named(stated):
    assert (LEAVES_OUT in words_of(section(True, **({"leaves_out": "the misfit"} if stated else {})))) == stated
