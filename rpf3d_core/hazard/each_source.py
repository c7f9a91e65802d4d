"""The hazard maps of one source, and the source that is worst for a zone or area of interest."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from rpf3d_core.hazard.benches import Bench, bench_table
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


class Worst(NamedTuple):
    """The source from which the largest share of rocks reaches a zone or area.

    source : its name; bench : its row of the bench table
    """

    source: str
    bench: Bench


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


def worst_sources(of_sources: list[SourceBenches]) -> list[Worst]:
    """Return for each row of the bench table the source that sends the largest share of its rocks there.

    Of two sources with equal shares, the source with fewer rocks counts, because its upper end is higher.

    of_sources : from `benches_of_sources`; [] gives []
    """
    rows = zip(*(each.benches for each in of_sources), strict=True)
    return [_worst_of(of_sources, list(row)) for row in rows]


def _worst_of(of_sources: list[SourceBenches], row: list[Bench]) -> Worst:
    """Return the worst source for a place; row : the row of the bench table of each source."""
    ranked = [(bench.reached["share"], -each.rocks) for each, bench in zip(of_sources, row, strict=True)]
    number = ranked.index(max(ranked))
    return Worst(source=of_sources[number].name, bench=row[number])
