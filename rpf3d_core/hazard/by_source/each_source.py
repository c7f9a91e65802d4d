"""The bench table of each source, and the worst source for each figure of each zone or area of interest."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.outward import HIGH
from rpf3d_core.ensemble.statistics import sampling_of, wilson_interval
from rpf3d_core.hazard.benches import ALL_SOURCES, AREA, Bench, bench_table, in_percent, share_text
from rpf3d_core.hazard.by_source.source_tallies import part_of
from rpf3d_core.hazard.by_source.worst import (
    ALL,
    Counts,
    further_figures,
    with_largest_share,
    with_largest_value,
    with_smallest_share,
)
from rpf3d_core.hazard.by_source.worst_barriers import hidden_at_barriers
from rpf3d_core.hazard.maps import HazardMaps, Layers
from rpf3d_core.terrain.facets import Terrain

UNNOTICED = 0.05
"""Largest share (-) of a source's rocks that may go unnoticed without a warning: few flown rocks may miss a place.

The upper end of the 95 % interval of a share of 0 rocks is compared with this limit.
"""


class SourceBenches(NamedTuple):
    """The bench table of one source.

    name : of the source; rocks : number of its rocks that flew; benches : its rows, as `bench_table` returns them
    """

    name: str
    rocks: int
    benches: list[Bench]


def maps_of_source(maps: HazardMaps, number: int) -> HazardMaps:
    """Return hazard maps whose zones, areas and barriers have the values of one source only.

    Map cells and facets still have the values of all sources.

    number : of the source, from 0; `maps.sources` must not be None
    """
    found = maps.sources
    assert found is not None
    zones, areas = (part_of(layers, number, len(found.names)) for layers in (found.zones, found.areas))
    sets = None if maps.sets is None else maps.sets.of_source(number)
    return replace(
        maps, flown=int(found.flown[number]), lost=int(found.lost[number]), zones=zones, areas=areas, sets=sets,
        barriers=found.barriers[number] if found.barriers else (), sources=None,
    )  # fmt: skip


def benches_of_sources(terrain: Terrain, maps: HazardMaps) -> list[SourceBenches]:
    """Return the bench table of each source that flew rocks, in the order of the scene; [] for a scene with one source.

    With parameter sets, the intervals are predictive, as in `bench_table`.
    """
    return list(_each_source(terrain, maps)) if maps.sources is not None else []


def _each_source(terrain: Terrain, maps: HazardMaps) -> Iterator[SourceBenches]:
    assert maps.sources is not None
    for number, (name, rocks) in enumerate(zip(maps.sources.names, maps.sources.flown.tolist(), strict=True)):
        if rocks:
            yield SourceBenches(name=name, rocks=rocks, benches=bench_table(terrain, maps_of_source(maps, number)))


def worst_benches(terrain: Terrain, maps: HazardMaps) -> list[Bench]:
    """Return the bench table for readers: each figure is of the source that is worst in this figure, or of all rocks.

    - `reached` and `stopped` are of the source whose interval of `reached` has the largest lower end, if this end is
      above the interval of all rocks together. Otherwise both are of all rocks.
    - `retained` is of the source whose interval has the smallest upper end, if this end is below the interval of all
      rocks. Otherwise `retained` is of all rocks or of the source of `reached`, whichever has the smaller upper end.
    - `energy_p95` is the largest of all sources and of all rocks together.
    - `reached_at_most` is the largest of all sources; `lost` is of all rocks.

    To select sources, the interval of each of S sources has the level 1 - 0.05 / S. So if all sources are equal, chance
    selects one of them with a probability of at most 5 %. The table shows 95 % intervals. For a scene with
    one source, the table is `bench_table`.
    """
    everything = bench_table(terrain, maps)
    if maps.sources is None:
        return everything
    worst = _worst_sources(maps)
    tables: dict[int, list[Bench]] = {
        number: bench_table(terrain, maps_of_source(maps, number))
        for number in {*worst.reached, *worst.retained, *worst.energy, *worst.lost} - {ALL}
    }
    tables[ALL] = everything
    names = {ALL: ALL_SOURCES, **dict(enumerate(maps.sources.names))}
    rows = []
    for place, (reached, retained, energy, lost) in enumerate(zip(*worst, strict=True)):
        most = tables[lost][place]
        own = tables[reached][place]
        if retained == ALL and _retained_at_most(own) <= _retained_at_most(everything[place]):
            retained = reached
        if energy == ALL and own.energy_p95 == everything[place].energy_p95:
            energy = reached
        rows.append(own._replace(
            retained=tables[retained][place].retained, lost=everything[place].lost,
            reached_at_most=(most.reached_at_most or most.reached) if maps.lost else None,
            energy_p95=tables[energy][place].energy_p95, energy_sampling=tables[energy][place].energy_sampling,
            energy_predictive=tables[energy][place].energy_predictive,
            source=names[reached], retained_source=names[retained], energy_source=names[energy],
        ))  # fmt: skip
    return rows


def _retained_at_most(bench: Bench) -> float:
    """Return the upper end (-) of the sampling interval of the share retained; 1 if no rock reached the place."""
    interval = sampling_of(bench.retained)
    return 1.0 if interval is None else float(interval[1])


class _Worst(NamedTuple):
    """For each figure, the number of the worst source in each zone, then in each area; ALL (-1) for all rocks together.

    lost : the source with the largest share of rocks that reached the place or were lost to holes
    """

    reached: list[int]
    retained: list[int]
    energy: list[int]
    lost: list[int]


def _worst_sources(maps: HazardMaps) -> _Worst:
    """Return the number of the worst source for each figure of each place.

    The computation uses arrays over all sources, because a scene may have thousands of sources.
    """
    found = maps.sources
    assert found is not None
    worst = _Worst([], [], [], [])
    for layers, together in ((found.zones, maps.zones), (found.areas, maps.areas)):
        for numbers, more in zip(worst, _worst_in(layers, together, maps), strict=True):
            numbers.extend(more)
    return worst


def _worst_in(layers: Layers, together: Layers, maps: HazardMaps) -> _Worst:
    """Return the worst sources for P places; layers, together : values for each source, and of all rocks."""
    sources, flown = len(maps.sources.names), maps.sources.flown[:, None]
    reached, stopped, energy = (
        layers.everywhere(values, missing).reshape(sources, -1)
        for values, missing in ((layers.rocks, 0), (layers.deposits, 0), (layers.energy.p95, np.nan))
    )
    all_reached, all_stopped, all_energy = (
        together.everywhere(values, missing)
        for values, missing in ((together.rocks, 0), (together.deposits, 0), (together.energy.p95, np.nan))
    )
    most = np.minimum((reached + maps.sources.lost[:, None]) / np.maximum(flown, 1), 1.0)
    return _Worst(
        reached=with_largest_share(Counts(reached, flown, all_reached, np.array(maps.flown))).tolist(),
        retained=with_smallest_share(Counts(stopped, reached, all_stopped, all_reached)).tolist(),
        energy=with_largest_value(energy, all_energy).tolist(),
        lost=most.argmax(axis=0).tolist() if maps.lost else [ALL] * len(all_reached),
    )


def from_source(source: str | None) -> str:
    """Return a source of `worst_benches` as text for a sentence, such as ` from crest`; "" for all rocks."""
    return "" if source in (None, ALL_SOURCES) else f" from {source}"


def doubts_of_sources(terrain: Terrain, maps: HazardMaps) -> list[str]:
    """Return warnings that figures of all rocks hide worse figures of a source, or that a source has few rocks.

    The list is empty for a scene with one source.
    """
    if maps.sources is None:
        return []
    pairs = list(zip(worst_benches(terrain, maps), bench_table(terrain, maps), strict=True))
    return [*_hidden(pairs, maps), *hidden_at_barriers(maps), *_with_few_rocks(maps)]


def _hidden(pairs: Sequence[tuple[Bench, Bench]], maps: HazardMaps) -> list[str]:
    """Return a warning that figures of all rocks hide worse shares of single sources; [] if none is hidden.

    The warning states one share, with the largest difference, and the number of further shares. Shares of rocks that
    reach a place come before shares retained, and areas before zones, because the user asked for areas.

    pairs : rows of `worst_benches`, each with the row of all rocks together
    """
    reached = [pair for pair in pairs if pair[0].source != ALL_SOURCES]
    retained = [pair for pair in pairs if pair[0].retained_source not in (pair[0].source, ALL_SOURCES)]
    if reached:
        worst, together = max(reached, key=lambda pair: (pair[0].kind == AREA, _gap(pair, "reached")))
        begin = f"of the rocks from {worst.source}, {share_text(worst.reached)} reach {worst.name}"
        rest = share_text(together.reached)
    elif retained:
        worst, together = min(retained, key=lambda pair: (pair[0].kind != AREA, _gap(pair, "retained")))
        begin = f"{worst.name} retains {share_text(worst.retained)} of the rocks from {worst.retained_source}"
        rest = share_text(together.retained)
    else:
        return []
    others = further_figures(len(reached) + len(retained) - 1, "the bench table")
    return [
        f"{begin}; of the rocks of all {len(maps.sources.names):,} sources together, {rest}.{others} Outcomes and "
        "hazard maps of all sources count all rocks together, so they depend on how many rocks each source has: "
        f"{_advice(maps)}, and see hazard/sources.csv"
    ]


def _advice(maps: HazardMaps) -> str:
    """Return advice where to find the hazard maps of a dangerous source."""
    alone = "run a dangerous source alone for its own maps"
    worst = "" if maps.worst_cells is None else "hazard/*_worst_source.* have the worst source of each cell; "
    return f"{worst}{alone}"


def _gap(pair: tuple[Bench, Bench], name: str) -> float:
    """Return the difference (-) of a share of a place between its worst source and all rocks; name : of the share."""
    return float(getattr(pair[0], name)["share"] - getattr(pair[1], name)["share"])


def _with_few_rocks(maps: HazardMaps) -> list[str]:
    """Return a warning if so few rocks of a source flew that a share of 0 in a place may be wrong by much; else []."""
    found = maps.sources
    assert found is not None
    fewest = int(found.flown.min())
    end = wilson_interval(0, fewest)[1] if fewest else 1.0
    if end <= UNNOTICED:
        return []
    few = [name for name, rocks in zip(found.names, found.flown.tolist(), strict=True) if rocks == fewest]
    named = f"{', '.join(few[:3])}{f' and {len(few) - 3:,} more' if len(few) > 3 else ''}"
    if not fewest:
        return [f"no rock flew from {named}: the results say nothing about {'it' if len(few) == 1 else 'them'}"]
    rocks = "1 rock" if fewest == 1 else f"{fewest:,} rocks"
    each = "" if len(few) == 1 else "each of "
    return [
        f"only {rocks} flew from {each}{named}: where none of these rocks arrived, up to {in_percent(end, 0, HIGH)} % "
        "of the rocks from there may arrive; fly more rocks from each source"
    ]
