"""The bench table of each source, and the source that is worst for each zone or area of interest."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.statistics import wilson_intervals
from rpf3d_core.hazard.benches import ALL_SOURCES, AREA, Bench, bench_table, share_text
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.source_tallies import part_of
from rpf3d_core.terrain.facets import Terrain


class SourceBenches(NamedTuple):
    """The bench table of one source.

    name : of the source; rocks : number of its rocks that flew; benches : its rows, as `bench_table` returns them
    """

    name: str
    rocks: int
    benches: list[Bench]


def maps_of_source(maps: HazardMaps, number: int) -> HazardMaps:
    """Return hazard maps whose zones and areas have the values of one source only.

    Map cells and facets still have the values of all sources.

    number : of the source, from 0; `maps.sources` must not be None
    """
    found = maps.sources
    assert found is not None
    zones, areas = (part_of(layers, number, len(found.names)) for layers in (found.zones, found.areas))
    sets = None if maps.sets is None else maps.sets.of_source(number)
    return replace(
        maps, flown=int(found.flown[number]), lost=int(found.lost[number]), zones=zones, areas=areas, sets=sets,
        sources=None,
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


def shown_benches(terrain: Terrain, maps: HazardMaps) -> list[Bench]:
    """Return the bench table for readers: for each place, the row of the source that is worst there.

    The worst source has the largest lower end of the sampling interval of the share reached, so that one rock of a
    small source does not decide. Where this lower end is larger for all rocks together, the row is that of all rocks
    (ALL_SOURCES). For a scene with one source, the table is `bench_table`.
    """
    everything = bench_table(terrain, maps)
    if maps.sources is None:
        return everything
    worst = _worst_sources(maps)
    tables = {number: bench_table(terrain, maps_of_source(maps, number)) for number in set(worst)}
    rows = []
    for place, (together, number) in enumerate(zip(everything, worst, strict=True)):
        bench = tables[number][place]
        is_worse = surely_reached(bench) > surely_reached(together)
        name = maps.sources.names[number] if is_worse else ALL_SOURCES
        rows.append((bench if is_worse else together)._replace(source=name))
    return rows


def _worst_sources(maps: HazardMaps) -> list[int]:
    """Return for each zone, then for each area, the number of the source with the largest lower end of `reached`.

    The ends are of sampling intervals. They are computed for all sources at once, because a scene may have thousands.
    """
    found = maps.sources
    assert found is not None
    rocks = found.flown[:, None]
    worst = list[int]()
    for layers in (found.zones, found.areas):
        reached = layers.everywhere(layers.rocks, 0).reshape(len(found.names), -1).astype(float)
        low, _ = wilson_intervals(reached, np.maximum(rocks, 1).astype(float))
        worst += np.argmax(np.where(rocks > 0, low, -1.0), axis=0).tolist()
    return worst


def surely_reached(bench: Bench) -> float:
    """Return the lower end (-) of the sampling interval of the share of rocks that reach a place."""
    return float(sampling_of(bench)[0])


def hidden_by_other_sources(shown: Sequence[Bench], everything: Sequence[Bench]) -> Bench | None:
    """Return the row with the source whose share is hidden most by the rocks of other sources; None if none is.

    A share is hidden if its sampling interval lies above that of all rocks together. Areas come before zones, because
    the user asked for them.

    shown : from `shown_benches`; everything : from `bench_table`, in the same order
    """
    gaps = [
        (bench.kind == AREA, surely_reached(bench) - float(sampling_of(together)[1]), number)
        for number, (bench, together) in enumerate(zip(shown, everything, strict=True))
        if surely_reached(bench) > sampling_of(together)[1]
    ]
    return shown[max(gaps)[2]] if gaps else None


def sampling_of(bench: Bench) -> Sequence[float]:
    """Return the sampling interval [low, high] (-) of the share of rocks that reach a place."""
    interval: Sequence[float] = bench.reached.get("sampling", bench.reached["interval_95"])
    return interval


def from_source(bench: Bench) -> str:
    """Return the source of a row of `shown_benches` as text for a sentence, such as ` from crest`; "" for all rocks."""
    return "" if bench.source in (None, ALL_SOURCES) else f" from {bench.source}"


def hidden_in_words(terrain: Terrain, maps: HazardMaps) -> str:
    """Return a warning that the rocks of other sources hide a share of one source; "" if this is not so."""
    if maps.sources is None:
        return ""
    everything = bench_table(terrain, maps)
    worst = hidden_by_other_sources(shown_benches(terrain, maps), everything)
    if worst is None:
        return ""
    together = next(each for each in everything if (each.kind, each.name) == (worst.kind, worst.name))
    return (
        f"of the rocks from {worst.source}, {share_text(worst.reached)} reach {worst.name}; of the rocks of all "
        f"{len(maps.sources.names)} sources together, {share_text(together.reached)}. Hazard maps, outcomes, barriers, "
        "fences and distances count all rocks together, so they depend on how many rocks each source has: run a "
        "dangerous source alone for its own maps, and see hazard/sources.csv"
    )
