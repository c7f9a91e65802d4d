"""Tests that distances beyond the toe and figures of fences are those of the worst source, not of all rocks."""

import numpy as np
import pytest
from scenes.benches_fallen_from import TOE, fallen, thrown

from rpf3d_core.hazard.by_source.worst import ALL
from rpf3d_core.report import source_toes as toes_of_sources
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.segments import segments_of
from rpf3d_core.report.source_places import fence_places
from rpf3d_core.report.source_toes import farthest, source_toes
from rpf3d_core.report.toe import BEYOND, FAR, STEP, beyond_toe, held_beyond

HARMLESS, DANGEROUS = 10, 10
"""Number of harmless sources, and number of the dangerous source."""


def run_of(distances: list[np.ndarray], sets: int = 0, at_rest: list[np.ndarray] | None = None) -> RunFiles:
    """Return a run whose sources have rocks that stop at these distances (N,) m beyond the toe."""
    source = np.concatenate([np.full(len(each), number) for number, each in enumerate(distances)])
    rest = None if at_rest is None else np.concatenate(at_rest)
    run = fallen(TOE + np.concatenate(distances), rest, sets, source=source)
    names = [{"name": f"s{number}"} for number in range(len(distances))]
    return run._replace(inputs={"scene": {"sources": names}})


def diluted(dangerous: int = 100) -> RunFiles:
    """Return a run with 10 harmless sources of 200 rocks each and one source whose rocks stop ten times as far."""
    harmless = [np.linspace(0.0, 4.0, 200)] * HARMLESS
    return run_of([*harmless, np.linspace(0.0, 40.0, dangerous)])


def test_the_distance_is_that_of_the_dangerous_source() -> None:
    run = diluted()
    toes = source_toes(run)
    together = held_beyond(toes.together, 0, 90).value
    assert together == pytest.approx(4.0, abs=1.0)
    assert farthest(toes, 90) == DANGEROUS and farthest(toes, 50) == DANGEROUS
    alone = beyond_toe(run_of([np.linspace(0.0, 40.0, 100)]))
    assert held_beyond(toes.of_source(DANGEROUS), 0, 90).value == pytest.approx(36.0, abs=2 * STEP)
    assert held_beyond(alone, 0, 90).value == pytest.approx(36.0, abs=2 * STEP)


def test_distances_of_a_source_are_those_of_its_rows() -> None:
    toes = source_toes(diluted())
    for number in (0, DANGEROUS):
        own = toes.of_source(number)
        mine = toes.together.source == number
        assert own.distance.tolist() == toes.together.distance[mine].tolist()
        assert own.rows.tolist() == toes.together.rows[mine].tolist() and own.of == mine.sum()
    for number, distance in zip(toes.enough, toes.distances, strict=True):
        assert distance.tolist() == toes.of_source(number).distance.tolist()


def test_sources_like_all_others_and_sources_with_few_rocks_are_not_named() -> None:
    rng = np.random.default_rng(5)
    alike = source_toes(run_of([rng.exponential(5.0, 30) for _ in range(100)]))
    assert [farthest(alike, wanted) for wanted in (50, 75, 90, 95)] == [ALL] * 4
    assert farthest(source_toes(diluted(dangerous=10)), 90) == ALL, "10 rocks are too few to state a distance"


def test_one_source_has_no_source() -> None:
    run = run_of([np.linspace(0.0, 40.0, 50)])
    toes = source_toes(run)
    assert toes.enough == [] and farthest(toes, 90) == ALL
    assert all(
        np.array_equal(ours, theirs) for ours, theirs in zip(toes.of_source(ALL), beyond_toe(run), strict=True)
        if isinstance(ours, np.ndarray)
    )  # fmt: skip


def test_many_rocks_of_other_sources_leave_enough_rocks_of_each_source(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 2,100 rocks, 110 are selected evenly, five of the dangerous source; then ten more of each source."""
    monkeypatch.setattr(toes_of_sources, "MOST_ROCKS", 110)
    monkeypatch.setattr(toes_of_sources, "FEWEST_WITH_TOE", 10)
    toes = source_toes(diluted())
    assert len(toes.together.rows) == toes.together.of == 110
    assert (toes.together.source == DANGEROUS).sum() <= 6
    assert len(toes.of_source(DANGEROUS).rows) >= 10 and toes.of.min() >= 10
    assert len(toes.known.rows) <= 2 * 110
    assert farthest(toes, 90) == DANGEROUS


def test_rocks_that_did_not_stop_are_the_farthest() -> None:
    stops, rest = np.linspace(0.0, 4.0, 200), np.ones(200, dtype=bool)
    toes = source_toes(run_of([stops] * 11, at_rest=[*[rest] * 10, ~rest]))
    assert held_beyond(toes.together, 0, 90).value < FAR
    assert farthest(toes, 90) == DANGEROUS
    assert held_beyond(toes.of_source(DANGEROUS), 0, 90).value == BEYOND


def test_a_source_with_a_toe_is_reported_if_few_of_all_rocks_have_one() -> None:
    """1,000 rocks stop on the crest, far behind the face: 30 of all 1,030 rocks have a toe, fewer than 5 %."""
    run = run_of([np.full(1000, 5.0), np.linspace(0.0, 40.0, 30)])
    back = run.ends.source == 0
    move = np.where(back[:, None], (-60.0, 0.0, 0.0), 0.0)
    ends = run.ends._replace(release=run.ends.release + move, end=run.ends.end + move)
    run = thrown(run._replace(ends=ends._replace(runout=np.where(back, 5.0, ends.runout))), 10.0, 2.0)
    toes = source_toes(run)
    assert not toes.together.enough
    assert farthest(toes, 90) == 1
    places = fence_places(run, toes, segments_of(run))
    assert {place.passed_of for place in places} == {"s1"} == {place.energy_of for place in places}


def test_the_figures_of_a_fence_are_those_of_the_worst_source() -> None:
    """Rocks of the dangerous source have 9 times the mass, and so 9 times the energy."""
    run = thrown(diluted(), 10.0, 2.0)
    danger = run.ends.source == DANGEROUS
    run = run._replace(ends=run.ends._replace(mass=np.where(danger, 9000.0, 1000.0)))
    toes, choices = source_toes(run), segments_of(run)
    places = fence_places(run, toes, choices)
    assert places[-1].distance > 30.0, "the places reach as far as the rocks of the dangerous source"
    near = places[0]
    assert near.energy_of == "s10" and near.height_of == ""
    assert near.energy.value == pytest.approx(0.5 * 9000.0 * 100.0)
    assert places[1].passed_of == "s10"
    own = toes.of_source(DANGEROUS).distance
    assert places[1].passed.value == (own > places[1].distance).mean()
    assert near.crossed == (own > 0.0).sum()


def test_a_source_has_the_distances_of_its_rocks_alone() -> None:
    run = diluted()
    alone = beyond_toe(run, np.flatnonzero(run.ends.source == DANGEROUS))
    for ours, theirs in zip(source_toes(run).of_source(DANGEROUS), alone, strict=True):
        assert np.array_equal(ours, theirs) if isinstance(ours, np.ndarray) else ours == theirs
