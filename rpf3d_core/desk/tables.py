"""Make the tables of the desk as plain values for the page: bench table, outcomes, sources, areas and materials."""

from typing import Any

from rpf3d_core.desk.coefficients import drawn_elsewhere, materials_of
from rpf3d_core.hazard.benches import left_out, notes_below, text_header, text_rows
from rpf3d_core.hazard.by_source.each_source import worst_benches
from rpf3d_core.results.findings import Run
from rpf3d_core.results.notes import warnings_of_run
from rpf3d_core.results.outcomes import HEADER, outcome_rows, words_on_unstopped
from rpf3d_core.results.overconfidence import surer_than_it_may_be
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.releases import PLACES


def bench_section(run: Run) -> dict[str, Any]:
    """Return the bench table of the rocks flown so far, in the form that `rpf3d run` prints.

    The keys are `header` (texts), `rows` (lists of texts) and `notes` (sentences below the table).
    """
    benches = worst_benches(run.terrain, run.maps)
    more, rows = left_out(benches), list(text_rows(benches))
    also = [f"{more:,} more zones that rocks reached are in the report"] if more else []
    notes = [*notes_below(run.maps, rows), *also]
    return {"header": list(text_header(benches)), "rows": [list(row) for row in rows], "notes": notes}


def outcome_section(run: Run) -> dict[str, Any]:
    """Return the table of outcomes of the rocks flown so far: `header` (texts) and `rows` (lists of texts)."""
    return {"header": list(HEADER), "rows": [list(row) for row in outcome_rows(run)]}


def progress_words(run: Run, last: bool = True) -> str:
    """Return a text on the progress of a run: rocks flown, rocks planned, impacts, engine and flight time (s).

    last : False while further rocks fly
    """
    totals = run.totals
    partial = run.planned > totals.rocks
    planned = f" of {run.planned:,}" if partial else ""
    state = "" if not partial else "partial: " if last else "preliminary: "
    engine = f"{run.flights.engine} engine, {run.flights.fly_s:.1f} s"
    return f"{state}{totals.rocks:,}{planned} rocks, {totals.impacts:,} impacts ({engine})"


def run_notes(run: Run) -> list[str]:
    """Return the warnings of a run for the page, and the reasons why the results look more certain than they are.

    The first warning states how many rocks did not stop, if there are such rocks. The warnings of `rpf3d run` follow.
    """
    unstopped = words_on_unstopped(run)
    return [
        *([unstopped] if unstopped else []), *warnings_of_run(run),
        *(f"less certain than it looks: {why}" for why in surer_than_it_may_be(run)),
    ]  # fmt: skip


def scene_section(scene: Scene, values: dict[str, Any]) -> dict[str, Any]:
    """Return the sources, areas and materials of a scene as lists for the page, and the density of its rocks as text.

    values : plain values of the scene's file
    """
    return {
        "sources": [{"name": each.name, "rocks": each.rocks, "kind": _kind(each)} for each in scene.sources],
        "areas": [{"name": area.name} for area in scene.areas_of_interest],
        "materials": [
            {"name": name, "values": [each._asdict() for each in coefficients]}
            for name, coefficients in materials_of(values, drawn_elsewhere(scene, values))
        ],
        "rock": f"Rock density {scene.rock.density:g} kg/m3",
    }


def _kind(source: Any) -> str:
    """Return the kind of place that the rocks of a source start from, as text."""
    if source.points is not None:
        return f"{len(source.points)} points"
    return next(kind for kind in PLACES if getattr(source, kind) is not None)
