"""Warnings about a run, for its table, summary and report: warnings that weaken the figures, and notes on the files."""

from rpf3d_core.ensemble.statistics import words_on_pieces
from rpf3d_core.hazard.benches import lost_in_words
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.zones_geojson import zones_without_cells
from rpf3d_core.setup.warnings import warnings_of, warnings_of_speed


def warnings_of_run(run: Run) -> list[str]:
    """Return all warnings about a run: first `doubts_of_run`, which weaken the figures, then `notes_of_run`."""
    return [*doubts_of_run(run), *notes_of_run(run)]


def doubts_of_run(run: Run) -> list[str]:
    """Return the warnings that weaken the figures of a run.

    Their order: misplaced inputs, sources in the air and outlines partly off the terrain, rocks lost to holes, faults
    of the terrain, the scene's settings, speeds, fragments.
    """
    totals = run.totals
    return [
        *run.prepared.placing,
        *run.placement,
        *([lost_in_words(run.maps.lost, totals.rocks)] if run.maps.lost else []),
        *run.faults.remarks,
        *warnings_of(run.scene),
        *warnings_of_speed(totals.max_speed.high),
        *([words_on_pieces(totals.rocks, totals.pieces)] if totals.pieces else []),
    ]


def notes_of_run(run: Run) -> list[str]:
    """Return the warnings that only concern the files of a run, such as hazard zones without cells.

    A report shows them after the warnings of `doubts_of_run`.
    """
    return zones_without_cells(run.terrain, run.maps, run.scene.hazard)
