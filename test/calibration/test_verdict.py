"""Tests of the warnings of a calibration: scores, coverage, and observations on one side of all predictions."""

from dataclasses import replace

import numpy as np

from rpf3d_core.calibration.files import content_of
from rpf3d_core.calibration.findings import Findings
from rpf3d_core.calibration.folds import Score
from rpf3d_core.calibration.verdict import warnings_of

BLOCKS = 25


def found(held_out: float = -8.0, curve: float = -9.0, book: float | None = None, rank: np.ndarray | None = None,
          whole: np.ndarray | None = None) -> Findings:  # fmt: skip
    """Return findings of a calibration.

    held_out, curve, book : mean scores; rank, whole_rank : (N, 2), predicted probabilities of nearer stops
    """
    scatter = np.linspace(-0.5, 0.5, BLOCKS)
    even = np.column_stack([(np.arange(BLOCKS) + 0.5) / BLOCKS] * 2)
    rank = even if rank is None else rank
    return Findings(
        estimates=[], correlation=np.empty((0, 0)), effective=200.0, noise=0.1, held_out=Score(held_out + scatter),
        prior=None, book=None if book is None else Score(np.full(BLOCKS, book)), curve=Score(np.full(BLOCKS, curve)),
        rank=rank, whole_rank=rank if whole is None else whole, misfit=1.0, left=0.0, sets=100, rocks=128, of_data=(),
    )  # fmt: skip


def test_a_calibration_that_predicts_well_has_no_warning() -> None:
    assert warnings_of(found()) == []


def test_blocks_without_a_prediction_are_named() -> None:
    (one,) = warnings_of(replace(found(), unpredicted=1))
    assert one.startswith("1 kept-out block has no prediction") and "count as outside their intervals" in one
    (more,) = warnings_of(replace(found(), unpredicted=3))
    assert more.startswith("3 kept-out blocks have no prediction")


def test_blocks_without_a_prediction_are_outside_their_intervals() -> None:
    all_predicted, some = found().coverage(), replace(found(), unpredicted=25).coverage()
    assert all_predicted is not None and some is not None
    assert some["blocks"] == 2 * all_predicted["blocks"] == 2 * BLOCKS
    for axis in ("along", "across"):
        assert some["90"][axis] == all_predicted["90"][axis] / 2
        assert some["with_misfit"]["50"][axis] == all_predicted["with_misfit"]["50"][axis] / 2
    assert len(warnings_of(replace(found(), unpredicted=25))) == 1  # the cause is named, and no other cause
    none = np.empty((0, 2))
    lost = replace(found(rank=none), unpredicted=BLOCKS)
    assert content_of(lost)["coverage"]["90"] == {"along": 0.0, "across": 0.0}
    assert any(each.startswith(f"{BLOCKS} kept-out blocks have no prediction") for each in warnings_of(lost))


def test_a_score_worse_than_a_curve_is_not_called_not_better() -> None:
    (worse,) = warnings_of(found(held_out=-9.7))
    assert "clearly worse than the score of a normal curve" in worse and "do not use this calibration" in worse
    (no_better,) = warnings_of(found(held_out=-9.05))
    assert "not clearly better than the score of a normal curve" in no_better


def test_book_values_that_predict_as_well_are_named() -> None:
    (sentence,) = warnings_of(found(book=-7.9))
    assert "not clearly better than the score of the book values (-7.90; difference -0.10 +- 0.06)" in sentence


def test_coverage_is_judged_by_chance() -> None:
    """With correct 90 % intervals, at most 19 of 25 blocks are inside in 3 of 100 calibrations, at most 20 in 10."""
    rank = found().rank
    assert rank is not None
    for outside, warned in ((5, False), (6, True)):
        some = rank.copy()
        some[:, 1] = np.linspace(0.1, 0.9, BLOCKS)
        some[:outside, 1] = np.where(np.arange(outside) % 2, 0.01, 0.99)
        sentences = warnings_of(found(rank=some, whole=rank))
        assert [("across the slope" in each) for each in sentences] == [True] * warned


def test_coverage_that_the_misfit_does_not_mend_is_named() -> None:
    rank = np.column_stack([np.linspace(0.1, 0.9, BLOCKS), np.linspace(0.1, 0.9, BLOCKS)])
    rank[::3, 0] = np.where(np.arange(9) % 2, 0.01, 0.99)
    (sentence,) = warnings_of(found(rank=rank))
    assert "90 % intervals hold 64 % of the kept-out blocks along the slope" in sentence
    assert "with the misfit of the model they still hold only 64 %" in sentence


def test_end_points_of_another_grid_lie_to_one_side() -> None:
    rank = np.column_stack([np.linspace(0.1, 0.9, BLOCKS), np.linspace(0.7, 0.94, BLOCKS)])
    (sentence,) = warnings_of(found(rank=rank))
    assert "on average at percentile 82 of the predicted stops across the slope" in sentence


def test_ranks_that_pile_up_at_both_ends_are_not_called_one_sided() -> None:
    """If a model spreads its rocks too little, 16 of 25 stops on one side are chance, not wrong coordinates."""
    rank = np.column_stack([np.where(np.arange(BLOCKS) < 16, 0.99, 0.01)] * 2)
    assert not any("percentile" in sentence for sentence in warnings_of(found(rank=rank)))


def test_few_values_do_not_condemn_a_calibration() -> None:
    few = replace(found(held_out=-9.7), held_out=Score(np.array([-9.7, -9.71])), curve=Score(np.array([-9.0, -9.0])))
    assert not any("do not use" in sentence for sentence in warnings_of(few))


def test_many_end_points_are_judged_as_well() -> None:
    rank = np.column_stack([(np.arange(2000) + 0.5) / 2000] * 2)
    assert not any("90 % intervals hold" in sentence for sentence in warnings_of(found(rank=rank)))
    rank[:400, 0] = np.where(np.arange(400) % 2, 0.01, 0.99)
    assert any("90 % intervals hold" in sentence for sentence in warnings_of(found(rank=rank)))
