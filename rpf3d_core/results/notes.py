"""Sentences for a reader of a run's results: warnings, and where the answer is surer than it can be."""

from rpf3d_core.ensemble.statistics import words_on_pieces
from rpf3d_core.hazard.benches import lost_in_words
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.zones_geojson import zones_without_cells
from rpf3d_core.setup.warnings import warnings_of, warnings_of_speed


def warnings_of_run(run: Run) -> list[str]:
    """Return the warnings about a run: those that weaken its figures, then its notes."""
    return [*doubts_of_run(run), *notes_of_run(run)]


def doubts_of_run(run: Run) -> list[str]:
    """Return the warnings that weaken the figures of a run: first inputs that look misplaced, then holes, terrain."""
    totals = run.totals
    return [
        *run.prepared.placing,
        *([lost_in_words(run.maps.lost, totals.rocks)] if run.maps.lost else []),
        *run.faults.remarks,
        *warnings_of(run.scene),
        *warnings_of_speed(totals.max_speed.high),
        *([words_on_pieces(totals.rocks, totals.pieces)] if totals.pieces else []),
    ]


def notes_of_run(run: Run) -> list[str]:
    """Return the last of the warnings about a run: those that concern files alone, such as hazard zones without cells.

    A report states them after everything that weakens its figures.
    """
    return zones_without_cells(run.terrain, run.maps, run.scene.hazard)
