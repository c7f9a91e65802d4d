"""Write a sweep: sweep.csv with all figures, and sweep.png with a panel of curves for each place and percentile."""

from collections.abc import Sequence
from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.formats.words import scene_name
from rpf3d_core.hazard.benches import AREA
from rpf3d_core.results.hazard_files.benches_csv import write_csv
from rpf3d_core.results.series import Curve, Panel
from rpf3d_core.scene.listings.key_words import KeyWords, key_in_words
from rpf3d_core.sweep.cells import Cell, value_text
from rpf3d_core.sweep.figures import BARRIER, PREDICTIVE, REACHED, RETAINED, RUNOUT, STOPPED, UNKNOWN
from rpf3d_core.sweep.flying import CELLS, CellRecord
from rpf3d_core.sweep.tables import (
    BEYOND_TERRAIN,
    CSV_COLUMNS,
    RUN_HEADER,
    RUN_RESULTS,
    Place,
    csv_rows,
    figure_of,
    have_unknowns,
    place_name,
    places_that_hold,
)
from rpf3d_core.sweep.varied import Varied

NEARLY_ALL = 0.9
"""Smallest retained share (-), in all cells, for which the picture shows the share that reached a zone or barrier.

For example, a pit floor retains nearly all rocks that reach it.
"""
TABLE, PICTURE = "sweep.csv", "sweep.png"
MOST_PLACES = 6
"""Largest number of places in the picture; `_most_held` ranks the places."""


def check_out(out: str | Path) -> Path:
    """Return the absolute path of a folder for a sweep: a new or empty folder, or the folder of an earlier sweep.

    Raises
    ------
    InputError
        The path is a file, or the folder contains other files.
    """
    folder = Path(out).resolve()
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{out}: is a file; a sweep needs the path of a folder")
    foreign = sorted({entry.name for entry in folder.iterdir()} - {CELLS, TABLE, PICTURE}) if folder.exists() else []
    if foreign:
        raise InputError(f"{out}: holds {foreign[0]!r}, which is not of a sweep; give a new folder, or that of a sweep")
    return folder


def write_sweep(folder: Path, varied: Sequence[Varied], cells: Sequence[Cell], records: Sequence[CellRecord]) -> None:
    """Write sweep.csv and sweep.png into an existing folder.

    varied : the keys with their values; cells, records : the cells and, in the same order, their records

    Raises
    ------
    InputError
        A file could not be written.
    """
    from rpf3d_core.results.plots.sweep import write_curves  # the import of matplotlib takes most of a second

    keys, scene = [one.key for one in varied], cells[0].scene
    title = f"{scene_name(scene.path)}: {len(cells)} cells of {_rocks(records)} rocks, seed {scene.seed}"
    try:
        write_csv(folder / TABLE, [*keys, *CSV_COLUMNS], csv_rows(cells, records))
        axis = f"{key_in_words(keys[0]).label}\n{keys[0]}"
        write_curves(folder / PICTURE, title, axis, panels_of(varied, cells, records))
    except OSError as fault:
        raise InputError(f"{folder}: could not be written ({fault.strerror or fault})") from fault


def _rocks(records: Sequence[CellRecord]) -> str:
    """Return the number of rocks of a cell as text; of cells with different numbers, the smallest and the largest."""
    least, most = min(record.rocks for record in records), max(record.rocks for record in records)
    return f"{least:,}" if least == most else f"{least:,} to {most:,}"


def panels_of(varied: Sequence[Varied], cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[Panel]:
    """Return the panels of the picture: shares in at most MOST_PLACES (6) places, then percentiles of the runs.

    Barriers come first, then areas of interest, then the zones where most rocks stopped.
    """
    places = sorted(places_that_hold(records), key=lambda place: -_most_held(records, place))[:MOST_PLACES]
    panels = [_panel(varied, cells, records, place) for place in places]
    for title, (result, scale) in zip(RUN_HEADER, RUN_RESULTS, strict=True):
        curves = _curves(varied, cells, records, (result, ("", "")), scale)
        panel = Panel(title=title.partition(" (")[0], axis=title, curves=curves)
        panels.append(panel._replace(unknown=BEYOND_TERRAIN) if result == RUNOUT else panel)
    return panels


def _panel(varied: Sequence[Varied], cells: Sequence[Cell], records: Sequence[CellRecord], place: Place) -> Panel:
    """Return the panel of a place: the share that a zone or barrier retained, or the share that reached an area.

    An area, such as a ramp, is to stay clear: the share that it retains says nothing about that. If the share that a
    zone or barrier retained is known in at least one cell, and at least NEARLY_ALL (90 %) in all cells in which it is
    known, its panel, as that of an area, shows the share of rocks that reached the place.
    """
    retained = [figure.value for record in records if (figure := figure_of(record, RETAINED, place))]
    least = min((value for value in retained if value is not None), default=0.0)
    result = REACHED if place[0] == AREA or least >= NEARLY_ALL else RETAINED
    name = place_name(place)
    title, of = f"retained by {name}", "rocks that reached it"
    if result == REACHED:
        title, of = f"reached {name}", "all rocks"
    curves = _curves(varied, cells, records, (result, place), 100.0)
    return Panel(title=title, axis=f"share of {of} (%)", curves=curves)


def _most_held(records: Sequence[CellRecord], place: Place) -> float:
    """Return the rank of a place, by which the places of the picture are sorted: the largest rank comes first.

    The rank of a zone is the largest share of all rocks that stopped in the zone in any cell of the sweep. The rank of
    an area is the largest share that reached it plus 1, so that areas come before all zones. The rank of a barrier is
    3, so that barriers come first.
    """
    if place[0] == BARRIER:
        return 3.0
    result = REACHED if place[0] == AREA else STOPPED
    shares = [figure.value or 0.0 for record in records if (figure := figure_of(record, result, place))]
    return max(shares, default=0.0) + (place[0] == AREA)


def _curves(
    varied: Sequence[Varied],
    cells: Sequence[Cell],
    records: Sequence[CellRecord],
    what: tuple[str, Place],
    scale: float,
) -> list[Curve]:
    """Return the curves of a figure over the values of the first key: one for each combination of the other keys.

    what : result, and kind and name of its place; scale : factor from the figure to the axis
    """
    found, keys = dict[str, list[tuple[object, CellRecord]]](), _short([one.key for one in varied])[1:]
    for cell, record in zip(cells, records, strict=True):
        first, *others = cell.values.values()
        first = first if isinstance(first, int | float) else value_text(first)
        name = ", ".join(_named(key, value_text(value)) for key, value in zip(keys, others, strict=True))
        found.setdefault(name, []).append((first, record))
    has_unknowns = have_unknowns(cells)
    return [_curve(name, points, what, scale, has_unknowns) for name, points in found.items()]


def _short(keys: Sequence[str]) -> Sequence[KeyWords]:
    """Return a short name, label and unit of each key; if two keys had the same name, the names are the key paths."""
    words = [key_in_words(key) for key in keys]
    if len({each.name for each in words}) == len(words):
        return words
    return [each._replace(name=key) for key, each in zip(keys, words, strict=True)]


def _named(key: KeyWords, value: str) -> str:
    """Return a key with its value and its unit, such as `face angle 60 degrees`."""
    return f"{key.name} {value}{f' {key.unit}' if key.unit not in ('', '-') else ''}"


def _curve(
    name: str,
    points: Sequence[tuple[object, CellRecord]],
    what: tuple[str, Place],
    scale: float,
    has_unknowns: bool,
) -> Curve:
    """Return a curve with the predictive interval of each point, or the sampling interval if the scene has no unknowns.

    In a scene with unknowns, a point without a predictive interval has no ends, because the sampling interval leaves
    the unknowns out.

    points : value of the first key, and record of the cell; what : result, and kind and name of its place
    scale : factor from the figure to the axis; has_unknowns : True if any cell of the sweep has unknowns
    """
    found = [(at, figure_of(record, *what)) for at, record in points]
    figures = [(at, figure) for at, figure in found if figure is not None and figure.value is not None]
    is_predictive = has_unknowns or any(figure.interval == PREDICTIVE for _, figure in figures)
    ends = [
        (one.sampling_low, one.sampling_high) if not is_predictive
        else (one.low, one.high) if one.interval == PREDICTIVE else UNKNOWN
        for _, one in figures
    ]  # fmt: skip
    values, low, high = (
        [None if number is None else scale * number for number in numbers]
        for numbers in ([one.value for _, one in figures], [end for end, _ in ends], [end for _, end in ends])
    )
    return Curve(
        name=name, at=[at for at, _ in figures], values=values, low=low, high=high, is_predictive=is_predictive
    )  # fmt: skip
