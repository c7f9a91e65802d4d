"""Tests that shares are known for each source, so that many harmless rocks hide no dangerous source."""

import csv
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from scenes.sources_of_pit import MISFIT, UNKNOWN, scene_of

import rpf3d_core as rpf3d
from rpf3d_core.hazard.benches import (
    ALL_SOURCES,
    OF_SOURCES,
    Bench,
    bench_table,
    notes_below,
    text_header,
    text_rows,
)
from rpf3d_core.hazard.by_source.each_source import benches_of_sources, doubts_of_sources, worst_benches
from rpf3d_core.hazard.partial import add_packed_sources
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.benches_csv import write_sources
from rpf3d_core.results.notes import doubts_of_run
from rpf3d_core.results.summary import summary
from rpf3d_core.runs.parallel import fly_parts
from rpf3d_core.setup.prepared import empty_tallies, prepare


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sources")


@pytest.fixture(scope="module")
def run(folder: Path) -> Run:
    return rpf3d.simulate(scene_of(folder))


def tables_of(run: Run) -> dict[str, list[Bench]]:
    return {each.name: each.benches for each in benches_of_sources(run.terrain, run.maps)}


@pytest.mark.parametrize("engine", ["compiled", "reference"])
@pytest.mark.parametrize("more", ["", UNKNOWN, MISFIT], ids=["known", "unknowns", "misfit"])
@pytest.mark.parametrize(("name", "other"), [("top", "below"), ("below", "top")])
def test_a_source_is_counted_as_if_it_were_alone(name: str, other: str, more: str, engine: str, folder: Path) -> None:
    """The first source of a scene has the same random numbers with and without further sources."""
    few = {"top": 60, "below": 40}
    both = rpf3d.simulate(scene_of(folder, name, other, more=more, rocks=few), engine=engine)
    alone = rpf3d.simulate(scene_of(folder, name, more=more, rocks=few), engine=engine)
    assert alone.maps.sources is None
    assert tables_of(both)[name] == bench_table(alone.terrain, alone.maps)
    assert sum(bench.reached["rocks"] for bench in tables_of(both)[name]) > 0


def test_the_counts_of_all_sources_add_up_to_those_of_the_run(run: Run) -> None:
    tables = tables_of(run).values()
    for together, *each in zip(bench_table(run.terrain, run.maps), *tables, strict=True):
        for share in ("reached", "stopped"):
            assert getattr(together, share)["rocks"] == sum(getattr(bench, share)["rocks"] for bench in each)
    assert run.maps.sources.flown.tolist() == [75, 25]


def test_a_run_in_parts_has_the_same_counts_of_each_source(run: Run, folder: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        assert tables_of(fly_parts(scene_of(folder), 3, pool)) == tables_of(run)


def test_rocks_lost_to_holes_may_have_reached_any_place_from_their_own_source(folder: Path) -> None:
    """The share `at most` is that of the worst source, even if the row is of another source or of all rocks."""
    run = rpf3d.simulate(scene_of(folder))
    run.maps.sources.lost[:] = (0, 20)
    maps = replace(run.maps, lost=20)
    tables = {each.name: each.benches for each in benches_of_sources(run.terrain, maps)}
    assert all(bench.lost is None for bench in tables["top"])
    for row, below in zip(worst_benches(run.terrain, maps), tables["below"], strict=True):
        assert below.reached_at_most["rocks"] == min(25, below.reached["rocks"] + 20)
        assert row.reached_at_most["share"] >= max(row.reached["share"], below.reached_at_most["share"])
    rows = text_rows(worst_benches(run.terrain, maps))
    assert {len(row) for row in rows} == {len(text_header(worst_benches(run.terrain, maps)))}


@pytest.fixture(scope="module")
def diluted(folder: Path) -> Run:
    """Return a run with 40 times as many rocks of the lower source as of the upper source."""
    return rpf3d.simulate(scene_of(folder, rocks={"top": 50, "below": 2000}))


def test_rocks_of_another_source_do_not_change_what_is_shown_of_the_worst(diluted: Run, folder: Path) -> None:
    alone = rpf3d.simulate(scene_of(folder, "top", rocks={"top": 50}))
    expected = {bench.name: bench for bench in bench_table(alone.terrain, alone.maps)}
    shown = {bench.name: bench for bench in worst_benches(diluted.terrain, diluted.maps)}
    together = {bench.name: bench for bench in bench_table(diluted.terrain, diluted.maps)}
    assert together["bench_1"].reached["share"] < 0.05
    assert shown["bench_1"].source == "top"
    assert shown["bench_1"].reached == expected["bench_1"].reached
    assert shown["bench_1"].stopped == expected["bench_1"].stopped
    assert shown["bench_1"].reached["share"] > 0.9


def test_each_figure_is_that_of_the_source_that_is_worst_for_it(folder: Path) -> None:
    """Few rocks hit hardest or are retained least, while others reach the place more often."""
    run = rpf3d.simulate(scene_of(folder, rocks={"top": 2000, "below": 2000}))
    tables, together = tables_of(run), bench_table(run.terrain, run.maps)
    differs = 0
    for place, row in enumerate(worst_benches(run.terrain, run.maps)):
        every = [tables["top"][place], tables["below"][place], together[place]]
        energies = [bench.energy_p95 for bench in every if bench.energy_p95 is not None]
        assert row.energy_p95 == max(energies, default=None)
        held = [bench.retained["share"] for bench in every if bench.reached["rocks"] >= 400]
        assert row.retained["share"] is None or row.retained["share"] <= min(held, default=1.0) + 0.05
        differs += row.energy_source not in (row.source, ALL_SOURCES)
        text = next((text for text in text_rows([row]) if row.energy_source != row.source), None)
        assert text is None or text[-1].endswith(f", {row.energy_source}")
    assert differs


def test_chance_does_not_select_one_of_many_equal_sources(folder: Path) -> None:
    """All rows of 200 equal sources are of all rocks, except by chance in at most a few of their places."""
    scene = scene_of(folder, "top")
    twins = tuple(scene.sources[0].model_copy(update={"name": f"s{i}", "rocks": 10}) for i in range(200))
    run = rpf3d.simulate(scene.model_copy(update={"sources": twins}))
    rows = worst_benches(run.terrain, run.maps)
    lowest = [max(bench.reached["interval_95"][0] for bench in benches)
              for benches in zip(*tables_of(run).values(), strict=True)]  # fmt: skip
    chosen = sum(low > row.reached["interval_95"][1] for low, row in zip(lowest, rows, strict=True))
    assert chosen > 1, "at the level of 95 %, chance selects sources"
    assert sum(row.source != ALL_SOURCES for row in rows) <= 1


def test_a_hidden_source_is_a_warning_and_a_source_like_all_others_is_none(diluted: Run, folder: Path) -> None:
    warning = doubts_of_run(diluted)[0]
    assert warning.startswith("of the rocks from top, ") and "all 2 sources together" in warning
    alike = scene_of(folder, rocks={"top": 40})
    twins = tuple(alike.sources[0].model_copy(update={"name": name}) for name in ("one", "two"))
    same = rpf3d.simulate(alike.model_copy(update={"sources": twins}))
    assert not any("sources together" in warning for warning in doubts_of_run(same))


def test_the_printed_table_names_the_source_of_each_row(diluted: Run, run: Run) -> None:
    benches = worst_benches(diluted.terrain, diluted.maps)
    rows = text_rows(benches)
    assert text_header(benches)[:3] == ("zone", "source", "reached")
    assert ("bench_1", "top") in {row[:2] for row in rows}
    assert OF_SOURCES in notes_below(diluted.maps, rows)
    assert not any("all rocks" in note for note in notes_below(diluted.maps, rows))


def test_sources_with_few_or_no_rocks_are_a_warning(folder: Path) -> None:
    """Of 3 rocks, none is up to 56.2 % (Wilson)."""
    few = rpf3d.simulate(scene_of(folder, rocks={"top": 3, "below": 300}))
    assert any("only 3 rocks flew from top" in doubt and "up to 57 %" in doubt for doubt in doubts_of_run(few))
    few.maps.sources.flown[0] = 0
    assert any("no rock flew from top" in doubt for doubt in doubts_of_sources(few.terrain, few.maps))
    many = rpf3d.simulate(scene_of(folder, rocks={"top": 100, "below": 100}))
    assert not any("flew from" in doubt for doubt in doubts_of_run(many))


def test_one_rock_of_a_small_source_does_not_decide(folder: Path) -> None:
    run = rpf3d.simulate(scene_of(folder, rocks={"top": 1, "below": 300}))
    shown = {bench.name: bench for bench in worst_benches(run.terrain, run.maps)}
    assert shown["bench_1"].reached["rocks"] == 1
    assert shown["bench_3"].source != "top"


def test_files_have_the_shares_of_each_source(diluted: Run, tmp_path: Path) -> None:
    write_sources(tmp_path / "sources.csv", benches_of_sources(diluted.terrain, diluted.maps))
    with (tmp_path / "sources.csv").open(encoding="utf-8") as file:
        rows = {(row["source"], row["name"]): row for row in csv.DictReader(file)}
    facts: dict[str, Any] = summary(diluted)
    assert facts["sources"] == [
        {"name": "top", "rocks": 50, "lost_to_holes": 0}, {"name": "below", "rocks": 2000, "lost_to_holes": 0}
    ]  # fmt: skip
    worst = facts["benches"]["bench_1"]["worst_source"]
    assert worst["source"] == "top"
    row = rows["top", "bench_1"]
    assert int(row["source_rocks"]) == 50
    assert float(row["reached_share"]) == worst["reached"]["share"]
    assert int(row["reached_rocks"]) == worst["reached"]["rocks"]
    assert {name for name, _ in rows} == {"top", "below"}


def test_a_part_without_counts_of_sources_is_refused(folder: Path) -> None:
    tallies = empty_tallies(prepare(scene_of(folder)))
    with pytest.raises(ValueError, match="only one of both counts each source"):
        add_packed_sources(tallies, None)
