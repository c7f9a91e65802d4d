"""Collect the warnings about a run for its printed tables, inputs.json, the desk and sweeps.

Doubts are warnings that figures of the run may be wrong or less certain than they look. Notes concern only the files of
the run.
"""

from rpf3d_core.ensemble.statistics import words_on_pieces
from rpf3d_core.hazard.benches import lost_in_words
from rpf3d_core.hazard.by_source.each_source import doubts_of_sources
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.zones_geojson import zones_without_cells
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of_speed

UNEQUAL = 1.2
"""Ratio (-) of the largest to the smallest number of rocks of a parameter set, above which `_unequal_sets` warns."""


def warnings_of_run(run: Run) -> list[str]:
    """Return all warnings about a run: first warnings about its figures (`doubts_of_run`), then about its files."""
    return [*doubts_of_run(run), *notes_of_run(run)]


def doubts_of_run(run: Run) -> list[str]:
    """Return the warnings that the figures of a run may be wrong or less certain than they look.

    The order of the warnings: sources whose figures are worse than those of all rocks together, sources with few rocks,
    parameter sets with unequal numbers of rocks, misplaced inputs, sources in the air or with unused points, outlines
    partly off the terrain, rocks lost to holes, faults of the terrain, settings of the scene, speeds, fragments.
    """
    totals = run.totals
    return [
        *doubts_of_sources(run.terrain, run.maps),
        *_unequal_sets(run),
        *run.prepared.placing,
        *run.placement,
        *([lost_in_words(run.maps.lost, totals.rocks)] if run.maps.lost else []),
        *run.faults.remarks,
        *run.prepared.doubts,
        *warnings_of_speed(totals.max_speed.high),
        *([words_on_pieces(totals.rocks, totals.pieces)] if totals.pieces else []),
    ]


def _unequal_sets(run: Run) -> list[str]:
    """Return a list with a warning if an interrupted run has flown unequal numbers of rocks with its parameter sets.

    The list is empty if the numbers are nearly equal, or if the run was not interrupted.
    """
    sets = run.maps.sets
    if sets is None or run.totals.rocks >= run.planned or not sets.flown:
        return []
    least, most = (int(bound) for bound in (sets.rocks[sets.rocks > 0].min(), sets.rocks.max()))
    if most <= UNEQUAL * least:
        return []
    return [f"the interrupted run has flown parameter sets with {least:,} to {most:,} rocks each: figures of all rocks "
            "together give more weight to the sets with more rocks"]  # fmt: skip


def notes_of_run(run: Run) -> list[str]:
    """Return the warnings that only concern the files of a run, such as hazard zones without cells.

    A report shows them after the warnings of `doubts_of_run`.
    """
    return zones_without_cells(run.terrain, run.maps, run.scene.hazard)
