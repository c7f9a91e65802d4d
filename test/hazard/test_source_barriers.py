"""Tests that barriers are counted for each source, so that harmless sources do not hide what a dangerous one does."""

import csv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes.sources_of_pit import UNKNOWN, scene_of

import rpf3d_core as rpf3d
from rpf3d_core.hazard.barriers import AtBarrier, BarrierFigures
from rpf3d_core.hazard.benches import ALL_SOURCES, SOURCE
from rpf3d_core.hazard.by_source.each_source import maps_of_source
from rpf3d_core.hazard.by_source.worst import ALL
from rpf3d_core.hazard.by_source.worst_barriers import has_source_barriers, hidden_at_barriers, worst_at_barriers
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.barriers_report import (
    barriers_section,
    worst_section,
    write_barriers,
    write_source_barriers,
)
from rpf3d_core.results.hazard_files.barriers_text import notes_below, text_header, text_rows
from rpf3d_core.results.summary import summary
from rpf3d_core.runs.parallel import fly_parts
from rpf3d_core.runs.run import run_scene
from rpf3d_core.setup.prepared import empty_tallies, prepare

FENCES = """\
effects:
  barriers:
    panels:
      - name: ring
        along: [[-190, -190], [190, -190], [190, 190], [-190, 190], [-190, -190]]
        height: 4
        capacity_kj: 100
      - {name: far, along: [[-150, -5], [-150, 5]], height: 2, capacity_kj: 0}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("barriers")


@pytest.fixture(scope="module")
def diluted(folder: Path) -> Run:
    """Return a run with ten times as many rocks of the lower source as of the upper source."""
    return rpf3d.simulate(scene_of(folder, more=FENCES, rocks={"top": 200, "below": 2000}))


def content(figures: BarrierFigures) -> list[Any]:
    counted = figures.counted
    samples = [sample.sorted() for sample in (counted.energy, counted.height, counted.over)]
    values = [column.tolist() for sample in samples for column in sample]
    return [figures[:11], counted.first[1:].tolist(), counted.events.tolist(), values]


def numbers_in(section: Any) -> list[float]:
    """Return all numbers of a section of summary.json in order; NaN for None."""
    if isinstance(section, dict | list):
        values = section.values() if isinstance(section, dict) else section
        return [number for value in values for number in numbers_in(value)]
    return [float("nan") if section is None else float(section)]


@pytest.mark.parametrize("engine", ["compiled", "reference"])
@pytest.mark.parametrize("more", ["", UNKNOWN], ids=["known", "unknowns"])
def test_a_source_is_counted_as_if_it_were_alone(more: str, engine: str, folder: Path) -> None:
    """The first source of a scene has the same random numbers with and without further sources."""
    few = {"top": 90, "below": 60}
    both, alone = (
        rpf3d.simulate(scene_of(folder, *names, more=FENCES + more, rocks=few), engine=engine)
        for names in (("top", "below"), ("top",))
    )
    assert not has_source_barriers(alone.maps) and worst_section(alone.maps) == {}
    own = maps_of_source(both.maps, 0)
    assert [content(at) for at in own.barriers] == [content(at) for at in alone.maps.barriers]
    ours, theirs = (numbers_in(barriers_section(maps)) for maps in (own, alone.maps))
    assert ours == pytest.approx(theirs, rel=1e-12, nan_ok=True)  # predictive ends: sums over sets in another order
    assert own.barriers[0].came > 20


def test_the_counts_of_all_sources_add_up_to_those_of_the_run(diluted: Run) -> None:
    for b, together in enumerate(diluted.maps.barriers):
        each = [barriers[b] for barriers in diluted.maps.sources.barriers]
        for name in ("came", "first_caught", "first_broken_through", "first_flown_over", "caught", "caught_events",
                     "broken_through_events", "flown_over_events"):  # fmt: skip
            assert getattr(together, name) == sum(getattr(at, name) for at in each), name
        for name in ("energy", "height", "over"):
            values = [np.repeat(*getattr(at.counted, name).sorted()) for at in each]
            expected = np.repeat(*getattr(together.counted, name).sorted())
            assert np.array_equal(np.sort(np.concatenate(values)), expected), name
    assert min(at.came for at in (source[0] for source in diluted.maps.sources.barriers)) > 20


def test_a_run_in_parts_has_the_same_counts_of_each_source(diluted: Run, folder: Path) -> None:
    scene = scene_of(folder, more=FENCES, rocks={"top": 200, "below": 2000})
    with ThreadPoolExecutor(2) as pool:
        parts = fly_parts(scene, 3, pool)
    for one, other in zip(parts.maps.sources.barriers, diluted.maps.sources.barriers, strict=True):
        assert [content(at) for at in one] == [content(at) for at in other]


def test_a_part_without_counts_of_sources_is_refused(folder: Path) -> None:
    both, alone = (
        empty_tallies(prepare(scene_of(folder, *names, more=FENCES))).barriers
        for names in ((), ("top",))
    )  # fmt: skip
    with pytest.raises(ValueError, match="only one of both counts each source"):
        both.join(alone.counts)


def test_the_worst_source_is_in_the_summary_and_in_the_table(diluted: Run) -> None:
    """Shares are of a source only if they are clearly worse; p95 values are the largest of both and of all rocks."""
    facts = summary(diluted)["barriers"]["ring"]
    each = {name: barriers_section(maps_of_source(diluted.maps, number))["ring"]
            for number, name in enumerate(("top", "below"))}  # fmt: skip
    worst = facts["worst_source"]
    assert worst["reached"]["source"] == "top"
    assert worst["reached"]["share"] == each["top"]["came"] / 200 > facts["came"] / 2200
    for name in ("first_energy_j", "first_height_over_ground_m"):
        largest = max((each["top"], each["below"], facts), key=lambda found: found[name]["p95"])
        assert worst[name]["p95"] == largest[name]["p95"]
        assert worst[name]["source"] == next((of for of, found in each.items() if found is largest), None)
    assert text_header(diluted.maps)[2] == SOURCE
    rows = {row[1]: row for row in text_rows(diluted.maps)[:9]}
    assert rows["came"][2] == "top" and rows["largest energy (kJ)"][2] == ALL_SOURCES
    assert {len(row) for row in rows.values()} == {len(text_header(diluted.maps))}
    assert any("source_barriers.csv" in note for note in notes_below(diluted.maps))


def figures_of(broken: int, came: int, energy: float) -> BarrierFigures:
    """Return the figures of a fence that `came` rocks reach with this energy (J), of which `broken` break through."""
    counted = AtBarrier()
    counted.energy.add(np.full(came, energy))
    counted.height.add(np.full(came, 1.0))
    return BarrierFigures("fence", 2.0, 1e5, came, came - broken, broken, 0, came - broken, 0, 0, 0, counted)


def maps_of(*sources: BarrierFigures, rocks: int = 100) -> Any:
    """Return what is used of hazard maps with one fence; each source flew `rocks` rocks."""
    together = figures_of(sum(at.first_broken_through for at in sources), sum(at.came for at in sources), 0.0)
    for at in sources:
        together.counted.energy.join(at.counted.energy)
    names = tuple(f"s{number}" for number in range(len(sources)))
    each = SimpleNamespace(names=names, flown=np.full(len(sources), rocks), barriers=tuple((at,) for at in sources))
    return SimpleNamespace(sources=each, barriers=(together,), flown=rocks * len(sources))


def test_a_dangerous_source_among_ten_harmless_ones_is_named_and_is_a_warning() -> None:
    """Of the dangerous rocks, 45 of 50 break through the fence; of all rocks, 45 of 1,050 (4.3 %)."""
    harmless = [figures_of(0, 100, 1e4)] * 10
    maps = maps_of(*harmless, figures_of(45, 50, 9e5))
    worst = worst_at_barriers(maps)
    assert {name: numbers[0] for name, numbers in worst.items()} == {
        "reached": ALL, "first_broken_through": 10, "first_flown_over": ALL, "first_caught": 10, "caught": 10,
        "first_energy_j": 10, "first_height_over_ground_m": ALL,
    }  # fmt: skip
    (doubt,) = hidden_at_barriers(maps)
    assert "of the rocks from s10 that reach barrier fence, 90.0 % (78-96) break through it" in doubt
    assert "of all 11 sources together, 4.3 % (" in doubt
    assert "2 more figures of barriers differ" in doubt


def test_few_rocks_of_a_source_have_no_p95_and_do_not_decide() -> None:
    maps = maps_of(figures_of(30, 300, 1e4), figures_of(1, 3, 9e5), rocks=400)
    assert {numbers[0] for name, numbers in worst_at_barriers(maps).items() if name != "reached"} == {ALL}


def test_sources_of_equal_rocks_are_not_named(folder: Path) -> None:
    alike = scene_of(folder, "top", more=FENCES, rocks={"top": 200})
    twins = tuple(alike.sources[0].model_copy(update={"name": name}) for name in ("one", "two"))
    run = rpf3d.simulate(alike.model_copy(update={"sources": twins}))
    assert {figure["source"] for name, figure in worst_section(run.maps)["ring"].items() if "share" in figure} == {None}
    assert hidden_at_barriers(run.maps) == []


def test_the_file_has_the_rows_of_each_source(diluted: Run, folder: Path, tmp_path: Path) -> None:
    write_source_barriers(tmp_path / "each.csv", diluted.maps)
    write_barriers(tmp_path / "alone.csv", maps_of_source(diluted.maps, 0))
    each, alone = (list(csv.DictReader((tmp_path / f"{name}.csv").open())) for name in ("each", "alone"))
    assert [(row.pop("source"), row.pop("source_rocks"), row["name"]) for row in each] == [
        (source, rocks, name) for source, rocks in (("top", "200"), ("below", "2000")) for name in ("ring", "far")
    ]  # fmt: skip
    assert each[:2] == alone


def test_a_scene_with_one_source_has_no_sources_at_barriers(folder: Path, tmp_path: Path) -> None:
    scene = scene_of(folder, "top", more=FENCES, rocks={"top": 10})
    run = run_scene(scene, tmp_path / "run", engine="reference", recording=False)
    assert not (tmp_path / "run" / "hazard" / "source_barriers.csv").exists()
    assert SOURCE not in text_header(run.maps)
    assert "worst_source" not in summary(run)["barriers"]["ring"]
