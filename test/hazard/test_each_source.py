"""Tests that shares are known for each source, so that many harmless rocks hide no dangerous source."""

import csv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from small_pit import scene_file

import rpf3d_core as rpf3d
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.hazard.benches import (
    ALL_SOURCES,
    AREA,
    OF_SOURCES,
    ZONE,
    Bench,
    bench_table,
    notes_below,
    text_header,
    text_rows,
)
from rpf3d_core.hazard.each_source import benches_of_sources, hidden_by_other_sources, shown_benches
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.benches_csv import write_sources
from rpf3d_core.results.notes import doubts_of_run
from rpf3d_core.results.summary import summary
from rpf3d_core.runs.parallel import fly_parts
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene

UNKNOWN = """\
unknowns:
  sets: 40
  priors: {materials.default.normal_restitution: {min: 0.3, max: 0.6}}
"""
MISFIT = f"{UNKNOWN}  misfit: 12\n"


def scene_of(folder: Path, *sources: str, more: str = "", rocks: dict[str, int] | None = None) -> Scene:
    """Return the scene of the small pit with only the named sources, in this order.

    rocks : source -> number of rocks, where it differs
    """
    scene = read_scene(scene_file(folder, more=more))
    found = {source.name: source for source in scene.sources}
    changed = [
        found[name].model_copy(update={"rocks": (rocks or {}).get(name, found[name].rocks)})
        for name in sources or found
    ]  # fmt: skip
    return scene.model_copy(update={"sources": tuple(changed)})


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


def test_rocks_lost_to_holes_are_lost_to_places_below_their_own_source(folder: Path) -> None:
    run = rpf3d.simulate(scene_of(folder))
    run.maps.sources.lost[:] = (3, 0)
    top, below = tables_of(run).values()
    assert all(bench.lost["rocks"] == 3 for bench in top if bench.lost)
    assert all(bench.lost is None for bench in below)
    assert all(
        bench.reached_at_most["rocks"] == min(75, bench.reached["rocks"] + 3) for bench in top if bench.reached_at_most
    )
    assert len({len(row) for row in text_rows(shown_benches(run.terrain, run.maps))}) == 1


@pytest.fixture(scope="module")
def diluted(folder: Path) -> Run:
    """Return a run with 40 times as many rocks of the lower source as of the upper source."""
    return rpf3d.simulate(scene_of(folder, rocks={"top": 50, "below": 2000}))


def test_rocks_of_another_source_do_not_change_what_is_shown_of_the_worst(diluted: Run, folder: Path) -> None:
    alone = rpf3d.simulate(scene_of(folder, "top", rocks={"top": 50}))
    expected = {bench.name: bench for bench in bench_table(alone.terrain, alone.maps)}
    shown = {bench.name: bench for bench in shown_benches(diluted.terrain, diluted.maps)}
    together = {bench.name: bench for bench in bench_table(diluted.terrain, diluted.maps)}
    assert together["bench_1"].reached["share"] < 0.05
    assert shown["bench_1"] == expected["bench_1"]._replace(source="top")
    assert shown["bench_1"].reached["share"] > 0.9


def test_a_hidden_source_is_a_warning_and_a_source_like_all_others_is_none(diluted: Run, folder: Path) -> None:
    warning = doubts_of_run(diluted)[0]
    assert warning.startswith("of the rocks from top, ") and "all 2 sources together" in warning
    alike = scene_of(folder, rocks={"top": 40})
    twins = tuple(alike.sources[0].model_copy(update={"name": name}) for name in ("one", "two"))
    same = rpf3d.simulate(alike.model_copy(update={"sources": twins}))
    assert not any("sources together" in warning for warning in doubts_of_run(same))


def test_the_printed_table_names_the_source_of_each_row(diluted: Run, run: Run) -> None:
    benches = shown_benches(diluted.terrain, diluted.maps)
    rows = text_rows(benches)
    assert text_header(benches)[:3] == ("zone", "source", "reached")
    assert ("bench_1", "top") in {row[:2] for row in rows}
    assert OF_SOURCES in notes_below(diluted.maps, rows)
    assert not any("all rocks" in note for note in notes_below(diluted.maps, rows))


def bench(source: str, rocks: int, flown: int, kind: str = ZONE) -> Bench:
    share = share_of(rocks, flown)
    return Bench(kind=kind, name="road", reached=share, stopped=share, retained=share, energy_p95=None, source=source)


def test_the_most_hidden_area_is_named_before_any_zone() -> None:
    together = [bench(ALL_SOURCES, 100, 1000), bench(ALL_SOURCES, 100, 1000, AREA), bench(ALL_SOURCES, 5, 10)]
    shown = [bench("a", 100, 100), bench("a", 50, 100, AREA), bench("b", 6, 10)]
    assert hidden_by_other_sources(shown, together) is shown[1]
    assert hidden_by_other_sources(shown[:1], together[:1]) is shown[0]
    assert hidden_by_other_sources(shown[2:], together[2:]) is None


def test_one_rock_of_a_small_source_does_not_decide(folder: Path) -> None:
    run = rpf3d.simulate(scene_of(folder, rocks={"top": 1, "below": 300}))
    shown = {bench.name: bench for bench in shown_benches(run.terrain, run.maps)}
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
    assert (worst["source"], worst["rocks"]) == ("top", 50)
    row = rows["top", "bench_1"]
    assert int(row["source_rocks"]) == 50
    assert float(row["reached_share"]) == worst["reached"]["share"]
    assert int(row["reached_rocks"]) == worst["reached"]["rocks"]
    assert {name for name, _ in rows} == {"top", "below"}
