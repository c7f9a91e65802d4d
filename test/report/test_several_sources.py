"""Tests that a report of several sources shows the worst source of each place, and warns where others hide it."""

import pytest
from scenes.small_pit import scene_file

from rpf3d_core.report.answer_part import OF_WORST
from rpf3d_core.report.content import report_elements
from rpf3d_core.report.elements import Element, Table, Text, Warnings
from rpf3d_core.report.run_files import read_run
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene

ROCKS = {"top": 20, "below": 400}


@pytest.fixture(scope="module")
def elements(tmp_path_factory: pytest.TempPathFactory) -> list[Element]:
    folder = tmp_path_factory.mktemp("sources")
    scene = read_scene(scene_file(folder, R_n=0.2, R_t=0.3))
    sources = tuple(each.model_copy(update={"rocks": ROCKS[each.name]}) for each in scene.sources)
    run_scene(scene.model_copy(update={"sources": sources}), folder / "run", engine="reference")
    return report_elements(read_run(folder / "run"), "pit")


def rows_of(elements: list[Element]) -> dict[str, list[str]]:
    return {row[0]: list(row[1:]) for table in elements if isinstance(table, Table) for row in table.rows}


def test_a_row_names_the_source_that_all_other_rocks_would_hide(elements: list[Element]) -> None:
    rows = rows_of(elements)
    assert "bench_1, from top" in rows
    assert "bench_1" not in list(rows)[: list(rows).index("bench_1, from top")]
    assert any(OF_WORST in text.text for text in elements if isinstance(text, Text))


def test_the_warning_comes_before_the_answer(elements: list[Element]) -> None:
    warnings = next(each for each in elements if isinstance(each, Warnings))
    assert any(warning.startswith("Of the rocks from top, ") for warning in warnings.sentences)


def test_what_no_rock_reached_has_the_interval_of_the_source_with_fewest_rocks(elements: list[Element]) -> None:
    """The sampling interval of 0 of 20 rocks ends at 16.1 % (Wilson)."""
    texts = [text.text for text in elements if isinstance(text, Text) and text.text.startswith("No rock reached")]
    (pointer, interval) = texts
    assert "The retention of the benches below states" in pointer
    assert "for the 20 rocks from top alone, 0-17 %" in interval


def test_distances_and_fences_name_the_source_that_all_other_rocks_would_hide(elements: list[Element]) -> None:
    rows = rows_of(elements)
    tables = [table for table in elements if isinstance(table, Table)]
    each = next(table for table in tables if table.header[0] == "source: holds 90 %")
    assert {row[0] for row in each.rows} <= {"top", "below"}
    answer = next(row for name, row in rows.items() if name.startswith("distance beyond the toe"))
    assert answer == next(row for name, row in rows.items() if name.startswith("90 % of the rocks"))
