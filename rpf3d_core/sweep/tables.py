"""The tables of a sweep: all figures for sweep.csv, and shares and percentiles side by side for the screen."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rpf3d_core.ensemble.outward import interval_as, three_figures
from rpf3d_core.hazard.benches import (
    AREA,
    CAUGHT_COUNT,
    SHORT,
    UNKNOWN_END,
    ZONE,
    in_percent,
    interval_in_percent,
)
from rpf3d_core.sweep.cells import Cell, are_alike, value_text
from rpf3d_core.sweep.figures import (
    BARRIER,
    ENERGY,
    HEIGHT,
    PREDICTIVE,
    REACHED,
    RETAINED,
    RUNOUT,
    SAMPLING,
    STOPPED,
    Ends,
    Figure,
)
from rpf3d_core.sweep.flying import CellRecord
from rpf3d_core.values import UNSTOPPED, Outcome

CSV_COLUMNS = ("cell", "rocks", *Figure._fields)
"""Columns of sweep.csv after those of the keys; `cell` is the name of the cell's result folder."""
SHARES_HEADER = ("place", "reached", "retained")
RUN_HEADER = ("runout p95 (m)", "energy p95 (kJ)", "height p95 (m)")
RUN_RESULTS = ((RUNOUT, 1.0), (ENERGY, 1e-3), (HEIGHT, 1.0))
SUFFIX = {ZONE: "", AREA: " (area)", BARRIER: " (barrier)"}
COMMON = "all cells have seed {seed}: their rocks are drawn from the same random numbers"
WORST_NOTE = (
    "a scene has several sources: a figure of a place is that of the worst source there, which may differ between cells"
)
PREDICTIVE_NOTE = (
    "the 95 % predictive interval, which holds the unknowns of the scene, and then the sampling interval of the number "
    "of rocks"
)
SAMPLING_NOTE = "the 95 % sampling interval of the number of rocks"
BEYOND_TERRAIN = "beyond the terrain"
RUNOUT_NOTE = f"`{BEYOND_TERRAIN}`: more than 5 % of the rocks did not stop; most of them left the terrain"
STOPPED_NOTE = (
    "runout p95 is that of the rocks that stopped; it leaves out the others, up to {share} % of the rocks of a cell, "
    "most of which left the terrain and went farther"
)
SAMPLING_ONLY = "sampling only"
"""Words before a sampling interval if a cell has unknowns, because the interval does not cover the unknowns."""

Place = tuple[str, str]
"""Kind and name of a place: a zone, an area of interest or a barrier."""


def csv_rows(cells: Sequence[Cell], records: Sequence[CellRecord]) -> Iterator[list[Any]]:
    """Yield the rows of sweep.csv, one for each figure of each cell.

    A row has the values of the keys, the name of the cell's folder, the number of rocks, and the fields of `Figure`.
    """
    for cell, record in zip(cells, records, strict=True):
        for figure in record.figures:
            yield [*map(value_text, cell.values.values()), cell.name, record.rocks, *figure]


def places_that_hold(records: Sequence[CellRecord]) -> list[Place]:
    """Return the places in the tables: zones where rocks stopped in any cell, then all areas and all barriers."""
    found = dict[Place, None]()
    for record in records:
        for figure in record.figures:
            holds = figure.result == STOPPED and figure.kind and (figure.value or figure.kind == AREA)
            if holds or (figure.kind == BARRIER and figure.result == RETAINED):
                found[figure.kind, figure.place] = None
    return sorted(found, key=lambda place: (ZONE, AREA, BARRIER).index(place[0]))


def figure_of(record: CellRecord, result: str, place: Place = ("", "")) -> Figure | None:
    """Return one figure of a cell; None if the cell has no such place or result.

    result : as in `Figure`; place : kind and name of the place; ("", "") for the whole run
    """
    wanted = (result, *place)
    return next((each for each in record.figures if (each.result, each.kind, each.place) == wanted), None)


def share_rows(cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[tuple[str, ...]]:
    """Return the rows of shares for the screen: for each place, one row for each cell that has the place.

    A row has the values of the keys, the place, the share of rocks that reached the place, and the retained share (%).
    """
    has_unknowns = have_unknowns(cells)
    return [
        (
            *_values(cell), place_name(place),
            *(_percent(figure_of(record, one, place), has_unknowns) for one in (REACHED, RETAINED)),
        )
        for place in places_that_hold(records)
        for cell, record in zip(cells, records, strict=True)
        if figure_of(record, RETAINED, place) is not None
    ]  # fmt: skip


def run_rows(cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[tuple[str, ...]]:
    """Return the rows of percentiles for the screen, one for each cell.

    A row has the values of the keys, then the p95 of runout (m), energy (kJ) and height (m).
    """
    has_unknowns = have_unknowns(cells)
    return [
        (*_values(cell), *(_number(figure_of(record, result), scale, has_unknowns) for result, scale in RUN_RESULTS))
        for cell, record in zip(cells, records, strict=True)
    ]


def have_unknowns(cells: Sequence[Cell]) -> bool:
    """Return True if the scene of any cell has an unknown value, which sampling intervals do not cover."""
    return any(cell.scene.has_unknowns for cell in cells)


def notes_of(cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[str]:
    """Return notes for the reader of the tables, as sentences.

    The notes state what the shares and intervals mean. If true, they also state that barriers caught rocks, that
    figures are those of the worst source, that the cells share random numbers, that a p95 runout is unknown or leaves
    rocks out, and that an end of an interval is unknown.
    """
    brackets = _on_brackets(cells, records)
    notes = [f"reached: of all rocks; retained: of the rocks that reached the place; in brackets {brackets}"]
    notes += [CAUGHT_COUNT] if any(_has_caught(record) for record in records) else []
    notes += [WORST_NOTE] if any(len(cell.scene.sources) > 1 for cell in cells) else []
    notes += [COMMON.format(seed=cells[0].scene.seed)] if are_alike(cells) else []
    printed = [figure for record in records for figure in record.figures if _is_printed(figure)]
    notes += [RUNOUT_NOTE] if any(map(is_beyond_terrain, _of_runs(records))) else []
    left_out = max((_left_out(record) for record in records), default=0.0)
    notes += [STOPPED_NOTE.format(share=in_percent(left_out, 2))] if left_out else []
    open_ends = any((one.sampling_low is None) != (one.sampling_high is None) for one in printed)
    return [*notes, f"`{UNKNOWN_END}`: too few rocks determine this end of an interval"] if open_ends else notes


def _has_caught(record: CellRecord) -> bool:
    """Return True if barriers caught rocks of a cell."""
    caught = figure_of(record, Outcome.CAUGHT.name.lower())
    return caught is not None and bool(caught.value)


def _left_out(record: CellRecord) -> float:
    """Return the share (-) of rocks that did not stop, and so have no part in the p95 runout of a cell.

    The result is 0 if the p95 runout is unknown.
    """
    runout = figure_of(record, RUNOUT)
    if runout is None or runout.value is None:
        return 0.0
    shares = (figure_of(record, outcome.name.lower()) for outcome in UNSTOPPED)
    return sum(share.value or 0.0 for share in shares if share is not None)


def is_beyond_terrain(figure: Figure) -> bool:
    """Return True for a p95 runout that is unknown because too many rocks did not stop."""
    return figure.result == RUNOUT and figure.value is None


def place_name(place: Place) -> str:
    """Return the name of a place as the tables show it; the kind is added if the place is not a zone."""
    kind, name = place
    return name + SUFFIX[kind]


def _values(cell: Cell) -> tuple[str, ...]:
    return tuple(map(value_text, cell.values.values()))


def _on_brackets(cells: Sequence[Cell], records: Sequence[CellRecord]) -> str:
    """Return text that explains which intervals the brackets in the tables contain."""
    if not have_unknowns(cells):
        return f"{SAMPLING_NOTE}; the scene has no unknowns"
    shown = {figure.interval for record in records for figure in record.figures if _is_printed(figure)}
    first = [PREDICTIVE_NOTE] if PREDICTIVE in shown else []
    only = [f"`{SAMPLING_ONLY}`: {SAMPLING_NOTE}, which leaves the unknowns out"] if SAMPLING in shown else []
    return "; ".join([*first, *only])


def _of_runs(records: Sequence[CellRecord]) -> Iterator[Figure]:
    """Yield the figures of the cells' whole runs, without the figures of zones, areas and barriers."""
    return (figure for record in records for figure in record.figures if not figure.kind)


def _is_printed(figure: Figure) -> bool:
    """Return True if the tables may show a figure: it is known, and is `reached`, `retained` or of the whole run."""
    return figure.value is not None and (figure.result in (REACHED, RETAINED) or not figure.kind)


def _percent(figure: Figure | None, has_unknowns: bool) -> str:
    """Return a share in per cent with its intervals, such as `84.5 % (79-89; 83-86)`; "-" if the share is unknown.

    has_unknowns : True if a cell of the sweep has unknowns
    """
    if figure is None or figure.value is None:
        return "-"
    return f"{in_percent(figure.value, SHORT)} %{_brackets(figure, has_unknowns, _interval_in_percent)}"


def _number(figure: Figure | None, scale: float, has_unknowns: bool) -> str:
    """Return a figure times a scale with its intervals, as text such as `84.8 (11.2-136; 83.1-86.6)`.

    The predictive interval comes first. An unknown figure gives "-"; a p95 runout that is unknown because too many
    rocks did not stop gives BEYOND_TERRAIN ("beyond the terrain").

    has_unknowns : True if a cell of the sweep has unknowns
    """
    if figure is None or figure.value is None:
        return BEYOND_TERRAIN if figure is not None and is_beyond_terrain(figure) else "-"

    def interval(ends: Ends) -> str:
        return interval_as(ends, lambda end, side: three_figures(scale * end, side), UNKNOWN_END)

    return f"{three_figures(scale * figure.value)}{_brackets(figure, has_unknowns, interval)}"


def _brackets(figure: Figure, has_unknowns: bool, text: Callable[[Ends], str]) -> str:
    """Return the predictive and the sampling interval of a figure, in brackets, as text.

    Without a predictive interval, the text has only the sampling interval. If a cell of the sweep has unknowns, the
    sampling interval then begins with SAMPLING_ONLY ("sampling only").

    has_unknowns : True if a cell of the sweep has unknowns
    text : function that returns the ends of an interval as text
    """
    sampling = text((figure.sampling_low, figure.sampling_high))
    if figure.interval == PREDICTIVE:
        return f" ({text((figure.low, figure.high))}; {sampling})"
    return f" ({SAMPLING_ONLY} {sampling})" if has_unknowns else f" ({sampling})"


def _interval_in_percent(ends: Ends) -> str:
    """Return an interval of a share in per cent as text, such as `79-89`, with "?" for an unknown end."""
    low, high = ends
    if low is not None and high is not None:
        return interval_in_percent(low, high)
    return interval_as(ends, lambda end, side: in_percent(end, SHORT, side), UNKNOWN_END)
