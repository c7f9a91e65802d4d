"""The bench table: for each zone and area of interest, how many rocks reached it and how many stopped there."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.outward import NEAREST, Side, fixed, interval_as, three_figures
from rpf3d_core.ensemble.statistics import sampling_of, share_of
from rpf3d_core.hazard.maps import HazardMaps, Layers
from rpf3d_core.terrain.facets import Terrain

SHOWN = 12
"""Largest number of zones in the printed table, because more do not fit a screen."""

TEXT_HEADER = ("zone", "reached", "stopped", "retained", "p95 (kJ)")
"""Header of the printed table, short so that it fits 80 columns; `text_rows` has the same columns."""

AT_MOST = "at most"
"""Header of the column with the share that counts every rock lost to a hole as a rock that reached the place.

The column is printed only if rocks were lost to holes of the terrain.
"""

SOURCE = "source"
"""Header of the column with the source of a row; the column is printed only for a scene with several sources."""

ALL_SOURCES = "(all)"
"""Text in the column SOURCE of a row that counts the rocks of all sources together."""

OF_SOURCES = (
    f"source: {ALL_SOURCES} for the rocks of all sources together, or a source from which clearly more rocks reach the "
    "place; retained and p95 are of the worst source, named if it is another; every source is in hazard/sources.csv"
)
"""Note under the printed table of a scene with several sources."""

TEXT_NOTE = "shares of {rocks} (retained: of the rocks that reached the place) with 95 % intervals"
"""Note under the printed table that explains its columns."""

OPEN = "intervals are of the number of rocks alone; ground and model leave more open"
"""Note under the printed table on uncertainties that its intervals do not include."""

OF_SETS = (
    "shares of {rocks} (retained: of the rocks that reached the place) and p95 energies, each with the 95 % "
    "predictive interval over {sets} parameter sets, which includes the unknowns of the scene, and then the sampling "
    "interval of the number of rocks"
)
"""Note under the printed table of a run over parameter sets that explains its columns."""

STILL_OPEN = "no interval includes the uncertainty of what the scene takes as known (models, terrain, sources)"
"""Note under the printed table of a run over parameter sets, on uncertainties that its intervals do not include."""

CAUGHT_COUNT = "rocks that barriers caught count as stopped (and retained) in the zone or area under the barrier"
"""Note under the tables of zones if barriers caught rocks; only the table of outcomes lists caught rocks separately."""

MOST_DECIMALS = 4
"""Largest number of decimals of a share in per cent: 4 show one rock in a million."""

SHORT = 1
"""Usual number of decimals in the printed table; hazard/benches.csv has all decimals."""

NOT_KNOWN, UNKNOWN_END = "not known", "?"
"""Texts in the printed table for an unknown interval, and for one unknown end of an interval."""

MEANINGS = {
    NOT_KNOWN: "fewer than {enough} parameter sets sent enough rocks there for a predictive interval; the sampling "
    "interval does not replace it",
    UNKNOWN_END: "too few rocks reached it to bound the p95 energy from above; it may be much larger",
}
"""Notes under the printed table on the texts for unknown intervals and ends, if the table has them."""

ZONE, AREA = "zone", "area"
"""The two kinds of rows in the bench table: zones of the terrain and areas of interest."""


class Bench(NamedTuple):
    """A row of the bench table, for a zone of the terrain (ZONE) or an area of interest (AREA).

    kind : ZONE or AREA; name : of the zone or area
    reached, stopped : shares of all rocks flown: `rocks`, `share` (-) and `interval_95`, as `share_of` returns them
    retained : of the rocks that reached the place, the share that stopped there
    energy_p95 : 95th percentile of each rock's largest energy in the place, J; None for fewer than 20 rocks
    lost : share of all rocks flown that were lost to holes of the terrain; None if no rock was lost
    reached_at_most : share of all rocks flown if every lost rock had also reached the place; None if no rock was lost
    energy_sampling, energy_predictive : 95 % intervals (J) of energy_p95, with None for an unknown end; None without
        parameter sets
    source : the source whose rocks alone are counted in `reached` and `stopped`, or ALL_SOURCES; None in a table
        without sources. The shares "of all rocks flown" are then shares of the rocks of this source
    retained_source : the source whose rocks alone are counted in `retained`, or ALL_SOURCES; None as for `source`
    energy_source : the source of `energy_p95` and its intervals, or ALL_SOURCES; None as for `source`
    """

    kind: str
    name: str
    reached: dict[str, Any]
    stopped: dict[str, Any]
    retained: dict[str, Any]
    energy_p95: float | None
    lost: dict[str, Any] | None = None
    reached_at_most: dict[str, Any] | None = None
    energy_sampling: list[float | None] | None = None
    energy_predictive: list[float | None] | None = None
    source: str | None = None
    retained_source: str | None = None
    energy_source: str | None = None


def bench_table(terrain: Terrain, maps: HazardMaps) -> list[Bench]:
    """Return the bench table: a row for each zone, in the terrain's order, then for each area, in the scene's order."""
    benches = [
        *_benches(ZONE, terrain.zones, maps.zones, maps), *_benches(AREA, maps.area_names, maps.areas, maps)
    ]  # fmt: skip
    return benches if maps.sets is None else _over_sets(benches, maps.sets)


def _over_sets(benches: Sequence[Bench], sets: Any) -> list[Bench]:
    """Return the rows of the bench table with predictive intervals over the parameter sets.

    sets : `hazard.by_set.sets.SetFigures`
    """
    intervals = {kind: sets.predictive(kind) for kind in (ZONE, AREA)}
    sampling = {kind: sets.sampling_of_energy(kind) for kind in (ZONE, AREA)}
    places, rows = {ZONE: 0, AREA: 0}, []
    for bench in benches:
        place, found = places[bench.kind], intervals[bench.kind]
        changes: dict[str, Any] = {
            name: with_predictive(getattr(bench, name), found[name].low[place], found[name].high[place])
            for name in ("reached", "stopped", "retained")
        }
        changes["energy_predictive"] = _known(found["energy"].low[place], found["energy"].high[place])
        changes["energy_sampling"] = _known(*sampling[bench.kind][place])
        rows.append(bench._replace(**changes))
        places[bench.kind] += 1
    return rows


def with_predictive(share: dict[str, Any], low: float, high: float) -> dict[str, Any]:
    """Return a share with its predictive interval added; the key `interval_95` then has the predictive interval, too.

    The result has the keys `rocks`, `share`, `interval_95`, `predictive` and `sampling`.

    If the predictive interval is unknown, `predictive` and `interval_95` are None. With the sampling interval as
    `interval_95`, the share would look more certain than it is.

    share : from `share_of`, with the sampling interval; low, high : ends of the predictive interval (-), NaN if unknown
    """
    predictive = None if math.isnan(low) else [float(low), float(high)]
    sampling = sampling_of(share)
    return {**share, "interval_95": predictive, "predictive": predictive, "sampling": sampling}


def _known(low: float, high: float) -> list[float | None]:
    """Return the ends [low, high] of an interval for JSON: None in place of NaN, which marks an unknown end."""
    return [None if math.isnan(end) else float(end) for end in (low, high)]


def notes_of(maps: HazardMaps) -> tuple[str, str]:
    """Return the notes under the printed table: on its columns, and on uncertainties that its intervals omit."""
    rocks = "all rocks" if maps.sources is None else "the rocks of the source in the row"
    if maps.sets is None:
        return TEXT_NOTE.format(rocks=rocks), OPEN
    return OF_SETS.format(rocks=rocks, sets=maps.sets.flown), STILL_OPEN


def notes_below(maps: HazardMaps, rows: Sequence[Sequence[str]]) -> list[str]:
    """Return all notes below the printed table; rows : from `text_rows`."""
    caught = [CAUGHT_COUNT] if any(barrier.caught for barrier in maps.barriers) else []
    of_sources = [] if maps.sources is None else [OF_SOURCES]
    return [*notes_of(maps), *of_sources, *caught, *notes_on_unknown(rows)]


def notes_on_unknown(rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the notes that explain the texts NOT_KNOWN and UNKNOWN_END, each only if a row of the table has the text.

    rows : from `text_rows`
    """
    texts = [text.partition(" (")[2] for _, *shown in rows for text in shown]
    meant = [(word, meaning) for word, meaning in MEANINGS.items() if any(word in text for text in texts)]
    if not meant:
        return []
    from rpf3d_core.unknowns.predictive import ENOUGH  # imported only if the scene has unknowns

    return [f"`{word}`: {meaning.format(enough=ENOUGH)}" for word, meaning in meant]


def lost_in_words(lost: int, flown: int) -> str:
    """Return a warning that rocks (at least one) were lost to holes of the terrain, and what this means for shares.

    lost, flown : numbers of rocks
    """
    return (
        f"{lost:,} of {flown:,} rocks ({in_percent(lost / flown, SHORT)} %) were lost to holes in the terrain and are "
        "followed no further: each might have come to any zone, cell or area downhill, so a share of 0 there is no "
        f"evidence (column `{AT_MOST}`: the share if all of them had come); close the holes to know"
    )


def benches_section(benches: Sequence[Bench]) -> dict[str, Any]:
    """Return the bench table for summary.json: `zones` and `areas_of_interest`, by name."""
    sections: dict[str, Any] = {"zones": {}, "areas_of_interest": {}}
    for bench in benches:
        sections["zones" if bench.kind == ZONE else "areas_of_interest"][bench.name] = {
            "reached": bench.reached,
            "stopped": bench.stopped,
            "retained": bench.retained,
            "energy_p95_j": bench.energy_p95,
            **_energy_section(bench),
            **_lost_section(bench),
        }
    return sections


def _energy_section(bench: Bench) -> dict[str, Any]:
    """Return both 95 % intervals (J) of a place's p95 energy for summary.json; {} without parameter sets."""
    if bench.energy_predictive is None:
        return {}
    return {"energy_p95_predictive_j": bench.energy_predictive, "energy_p95_sampling_j": bench.energy_sampling}


def _lost_section(bench: Bench) -> dict[str, Any]:
    """Return the shares of a place that concern rocks lost to holes, for summary.json; {} if no rock was lost."""
    return {} if bench.lost is None else {"lost_to_holes": bench.lost, "reached_at_most": bench.reached_at_most}


def text_header(benches: Sequence[Bench]) -> tuple[str, ...]:
    """Return the header of the printed table.

    The table has the column SOURCE if its rows have sources, and the column AT_MOST if rocks were lost to holes.
    """
    source = (SOURCE,) if any(bench.source is not None for bench in benches) else ()
    most = (AT_MOST,) if _any_lost(benches) else ()
    return (*TEXT_HEADER[:1], *source, *TEXT_HEADER[1:2], *most, *TEXT_HEADER[2:])


def _any_lost(benches: Sequence[Bench]) -> bool:
    return any(bench.lost is not None for bench in benches)


def text_rows(benches: Sequence[Bench]) -> list[tuple[str, ...]]:
    """Return the rows of the printed table: at most SHOWN (12) zones, then all areas.

    The zones are those with the largest shares of rocks that reached them, in descending order of these shares. An area
    that no rock reached also has a row, because the user asked for the area, and its interval is a result.
    """
    areas = [bench for bench in benches if bench.kind == AREA]
    lost = _any_lost(benches)
    return [_text_row(bench, lost) for bench in (*_reached_zones(benches)[:SHOWN], *areas)]


def left_out(benches: Sequence[Bench]) -> int:
    """Return the number of zones that rocks reached, but that have no row in the printed table."""
    return max(0, len(_reached_zones(benches)) - SHOWN)


def _reached_zones(benches: Sequence[Bench]) -> list[Bench]:
    """Return the zones that rocks reached, in descending order of the shares reached."""
    zones = [bench for bench in benches if bench.kind == ZONE and bench.reached["rocks"]]
    return sorted(zones, key=lambda bench: -bench.reached["share"])


def _benches(kind: str, names: Sequence[str], layers: Layers, maps: HazardMaps) -> Iterator[Bench]:
    """Yield a row of the bench table for each of C zones or areas; a place that no rock reached also has a row.

    kind : ZONE or AREA; names : of the C zones or areas; maps : hazard maps of the run
    layers : `maps.zones` or `maps.areas`, the values of the zones or areas
    """
    rocks, deposits = layers.everywhere(layers.rocks, 0), layers.everywhere(layers.deposits, 0)
    energy = layers.everywhere(layers.energy.p95, np.nan)
    for name, reached, stopped, p95 in zip(names, rocks.tolist(), deposits.tolist(), energy.tolist(), strict=True):
        bench = _bench(kind, name, reached, stopped, p95, maps.flown)
        yield _with_lost(bench, maps.lost, maps.flown) if maps.lost else bench


def _with_lost(bench: Bench, lost: int, flown: int) -> Bench:
    """Return a row of the bench table with the shares `lost` and `reached_at_most` filled in, as in `Bench`.

    lost, flown : number of rocks lost to holes, and of all rocks flown
    """
    most = min(bench.reached["rocks"] + lost, flown)
    return bench._replace(lost=share_of(lost, flown), reached_at_most=share_of(most, flown))


def _bench(kind: str, name: str, reached: int, stopped: int, energy: float, flown: int) -> Bench:
    return Bench(
        kind=kind,
        name=name,
        reached=share_of(reached, flown),
        stopped=share_of(stopped, flown),
        retained=share_of(stopped, reached),
        energy_p95=energy if np.isfinite(energy) else None,
    )


def _text_row(bench: Bench, lost: bool) -> tuple[str, ...]:
    """Return a row of the printed table; lost : True if the table has the column AT_MOST.

    If no rock of the row's source was lost, the share in this column is the share reached.
    """
    name = bench.name if bench.kind == ZONE else f"{bench.name} (area)"
    source = () if bench.source is None else (bench.source,)
    most = (bench.reached_at_most or bench.reached,) if lost else ()
    shares = (share_text(share) for share in (bench.reached, *most, bench.stopped))
    retained = f"{share_text(bench.retained)}{_other_source(bench, bench.retained_source)}"
    return (name, *source, *shares, retained, f"{_energy_text(bench)}{_other_source(bench, bench.energy_source)}")


def _other_source(bench: Bench, source: str | None) -> str:
    """Return the source of a figure as text to append, such as `, crest`; "" if the whole row has the same source."""
    return "" if source == bench.source else f", {source}"


def _energy_text(bench: Bench) -> str:
    """Return the p95 energy (kJ) of a zone or area as text; over parameter sets, with predictive and sampling interval.

    An interval without a known end reads NOT_KNOWN, as in `496 (not known; 443-778)`, because a number without an
    interval looks certain.
    """
    if bench.energy_p95 is None:
        return "-"
    value = three_figures(bench.energy_p95 / 1000.0)
    if bench.energy_predictive is None:
        return value
    intervals = (bench.energy_predictive, bench.energy_sampling)
    return f"{value} ({'; '.join(interval_text(ends, 1000.0) for ends in intervals)})"


def interval_text(ends: Sequence[float | None] | None, unit: float) -> str:
    """Return an interval as text, rounded outward, such as `443-778`; NOT_KNOWN if neither end is known.

    If only one end is unknown, UNKNOWN_END replaces this end in the text.

    unit : number by which the ends are divided, such as 1000 for ends in J and text in kJ
    """
    if ends is None or all(end is None for end in ends):
        return NOT_KNOWN
    return interval_as(ends, lambda end, side: three_figures(end / unit, side), UNKNOWN_END)


def share_text(share: dict[str, Any]) -> str:
    """Return a share in per cent with its intervals as text, such as `84.5 % (79-89)`; `-` if the share is unknown.

    With parameter sets, the predictive interval precedes the sampling interval, and reads NOT_KNOWN if unknown.
    """
    if share["share"] is None:
        return "-"
    intervals = [share["predictive"], share["sampling"]] if "predictive" in share else [share["interval_95"]]
    # Equal intervals are shown once.
    texts = dict.fromkeys(interval_in_percent(*ends) if ends else NOT_KNOWN for ends in intervals)
    return f"{in_percent(share['share'], SHORT)} % ({'; '.join(texts)})"


def interval_in_percent(low: float, high: float) -> str:
    """Return an interval of a share in per cent as text, rounded outward, such as `79-89`; low, high : ends (-)."""
    decimals = min(_decimals(0.5 * (high - low)), SHORT)
    return interval_as((low, high), lambda end, side: in_percent(end, decimals, side))


def in_percent(share: float, decimals: int, side: Side = NEAREST) -> str:
    """Return a share (-) in per cent as text, without the sign %.

    A share that would look like 0 or 100 %, but is not, gets more decimals. A share of exactly 0 or 1 has no decimals.

    decimals : usual number of decimals; side : rounding, LOW (down), NEAREST or HIGH (up)
    """
    rest = min(share, 1.0 - share)
    return fixed(100.0 * share, max(decimals, _decimals(rest)) if rest > 0.0 else 0, side)


def _decimals(share: float) -> int:
    """Return the number of decimals that a share > 0 (-), written in per cent, needs to show its first non-zero digit.

    The result is at most MOST_DECIMALS (4), and 0 for shares of 1 % or more.
    """
    return min(max(0, -math.floor(math.log10(100.0 * share))), MOST_DECIMALS)
