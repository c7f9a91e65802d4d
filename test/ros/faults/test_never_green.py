"""Some combinations of the never-green campaign: with defective inputs the level is never too low.

`make never-green` runs many more combinations.
"""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from pathlib import Path

import numpy as np
from never_green.campaign import NO_DEFECT, failures_of, verdicts, words_of
from never_green.combination import CLEAN, SINGLE, drawn, run
from never_green.defects import DEFECTS
from never_green.guards import GUARDS, ROOT, listed
from never_green.live import several
from never_green.narrow import NARROW
from programs.ending import load

from rpf3d_ros.alerts.region_evidence import TopicEvidence

PAGE = Path(__file__).parents[3] / "docs" / "explanation" / "never-green.md"
FOUND = {
    "answers of one wall fail, of others not": (7, ("answers fail",)),
    "a patch renews the age of the survey": (3, ("missing surveys",)),
    "a click is removed by another": (7, ("acknowledged early", "duplicated")),
    "an empty message has the stamp of one with sources": (1, ("contradicting itself",)),
    "a silent radar is forgotten when the clock goes back": (57, ("missing sources", "clock back")),
    "a radar that no one expects is connected and never heard": (1, ("connected and mute",)),
    "a click just after the clock went back is forgotten": (612, tuple(DEFECTS)[:-4]),
    "the mesh from before a patch is published again": (3, ("mesh after the patch",)),
}
"""Name -> (seed, kinds of defects) of combinations for which the node once showed too low a level."""


def test_ten_combinations_show_at_least_the_true_level_or_a_fault():
    assert [words_of(each) for each in verdicts(range(10), 1, tuple(DEFECTS)) if failures_of(each)] == []


@pytest.mark.parametrize("name", FOUND)
def test_what_was_too_green_once_is_not(name):
    seed, kinds = FOUND[name]
    assert failures_of(run(seed, kinds)) == []


def test_the_campaign_finds_a_radar_that_clears_what_another_sees(monkeypatch):
    monkeypatch.setattr(TopicEvidence, "clears", lambda self, other: other.stamp_ns < self.stamp_ns)
    assert failures_of(run(2, ("contradicting", "acknowledged early")))


def test_a_seed_gives_the_same_combination_again():
    one, other = drawn(17), drawn(17)
    assert one.defects == other.defects and len(one.sends) == len(other.sends)
    assert all(np.array_equal(a.places, b.places, equal_nan=True) for a, b in zip(one.sends, other.sends, strict=True))


def test_half_of_the_combinations_have_several_defects_over_a_danger_and_some_have_none():
    plans = {seed: drawn(seed) for seed in range(100)}
    several_of = [seed for seed, plan in plans.items() if len(plan.defects) > 1]
    assert len(several_of) >= 50 and all(seed % 10 >= CLEAN + SINGLE for seed in several_of)
    assert [seed for seed, plan in plans.items() if not plan.defects] == list(range(0, 100, 10))


def test_every_guard_stands_once_in_its_file_and_its_defects_exist():
    for guard in GUARDS:
        assert (ROOT / guard.file).read_text().count(guard.text) == 1, guard.guard
        assert set(guard.kinds.split(",")) <= {*DEFECTS, *NARROW, NO_DEFECT}, guard.guard
        assert not guard.also or guard.also in {each.guard for each in GUARDS}


def test_the_page_has_the_list_of_guards():
    assert f"\n\n{listed()}\n\n" in PAGE.read_text(encoding="utf-8")


@pytest.mark.long
@pytest.mark.parametrize("first", range(10, 130, 20))
def test_more_combinations_show_at_least_the_true_level_or_a_fault(first):
    seeds = range(first, first + 20)
    assert [words_of(each) for each in verdicts(seeds, 1, tuple(DEFECTS)) if failures_of(each)] == []


@pytest.mark.long
def test_combinations_with_real_processes_show_at_least_the_true_level_or_a_fault():
    verdicts = several(range(10_000, 10_008), 0, words=False, load=load())
    assert [each for each in verdicts if each.greens] == []
