"""Replace the figures of places for fences by those of the source that is worst for each figure."""

from collections.abc import Sequence

import numpy as np

from rpf3d_core.hazard.by_source.worst import ALL, Counts, with_largest_share, with_largest_value
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.report.passing import (
    P95,
    FencePlace,
    energy_at,
    height_at,
    passing,
    places_beyond,
    places_for,
    shares_beyond,
)
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.segments import Segments
from rpf3d_core.report.source_toes import SourceToes, farthest
from rpf3d_core.report.toe import DESIGN, FAR, ResultWithIntervals
from rpf3d_core.terrain.frame import FloatArray


def fence_places(run: RunFiles, toes: SourceToes, choices: Sequence[Segments]) -> list[FencePlace]:
    """Return the places for fences with the figures for design; [] if too few rocks have a toe.

    If the rocks of a source stop clearly farther than all rocks (`farthest`), the places reach as far as the rocks of
    this source. If too few of all rocks have a toe, but enough rocks of a source, the figures are those of this source.

    choices : possible path segments, from `segments_of`
    """
    number = farthest(toes, DESIGN)
    own, name = toes.of_source(number), toes.name_of(number)
    if toes.together.enough:
        return with_worst_sources(run, toes, choices, places_beyond(run, toes.together, choices, places_for(own)))
    if number == ALL:
        return []
    places = places_beyond(run, own, choices)
    return [place._replace(passed_of=name, energy_of=name, height_of=name) for place in places]


def with_worst_sources(
    run: RunFiles, toes: SourceToes, choices: Sequence[Segments], places: Sequence[FencePlace]
) -> list[FencePlace]:
    """Return places for fences in which each figure is that of the source that is worst for this figure.

    - `passed`: the source with the largest lower end, if it is clearly worse than all rocks (`hazard.by_source.worst`).
    - `energy`, `height`: the largest p95 of all sources with 20 rocks at the place, and of all rocks together.

    choices : possible path segments, from `segments_of`; places : of all rocks together, from `places_beyond`
    """
    if not toes.enough:
        return list(places)
    by_name = {segments.source: segments for segments in choices}
    return [
        _with_height(run, toes, (by_name[place.height_source], choices[-1]),
                     _with_energy(run, toes, by_name[place.source], place))
        for place in _with_passed(run, toes, places)
    ]  # fmt: skip


def _with_passed(run: RunFiles, toes: SourceToes, places: Sequence[FencePlace]) -> list[FencePlace]:
    """Return places in which the share of rocks that pass is the share of the worst source.

    At places where no source is clearly worse than all rocks, the share of all rocks is kept.
    """
    at, numbers = np.array([place.distance for place in places]), toes.enough
    each = toes.distances
    counts = Counts(
        each=np.array([(distance[:, None] > at).sum(axis=0) for distance in each]),
        each_of=np.array([[len(distance)] for distance in each]),
        all=(toes.together.distance[:, None] > at).sum(axis=0), all_of=np.array(len(toes.together.distance)),
    )  # fmt: skip
    worst = [ALL if place == ALL else numbers[place] for place in with_largest_share(counts).tolist()]
    shares = {number: shares_beyond(toes.of_source(number), run.sets, at) for number in {*worst} - {ALL}}
    return [
        place if number == ALL else place._replace(passed=shares[number][i], passed_of=toes.name_of(number))
        for i, (place, number) in enumerate(zip(places, worst, strict=True))
    ]


def _with_energy(run: RunFiles, toes: SourceToes, segments: Segments, place: FencePlace) -> FencePlace:
    """Return a place with the largest p95 energy of a source, if this energy is above that of all rocks.

    Otherwise the place is returned unchanged.

    segments : path segments from which the energies are computed
    """
    number = _largest(_p95(run, toes, segments, place.distance, height=False), place.energy)
    if number == ALL:
        return place
    energy, crossed = energy_at(run, toes.of_source(number), segments, place.distance)
    return place._replace(energy=energy, crossed=crossed, energy_of=toes.name_of(number))


def _with_height(
    run: RunFiles, toes: SourceToes, segments: tuple[Segments, Segments], place: FencePlace
) -> FencePlace:
    """Return a place with the largest p95 height of a source, if this height is above that of all rocks.

    Otherwise the place is returned unchanged.

    segments : two choices of path segments; the second is used for sources whose height is unknown from the first
    """
    first, second = segments
    heights = _p95(run, toes, first, place.distance, height=True)
    again = np.zeros(len(heights), dtype=bool)
    if second is not first and (heights >= FAR).any():
        kept = _p95(run, toes, second, place.distance, height=True)
        again = (heights >= FAR) & np.isfinite(kept)
        heights = np.where(again, kept, heights)
    number = _largest(heights, place.height)
    if number == ALL:
        return place
    used = second if again[number] else first
    height = height_at(run, toes.of_source(number), used, place.distance)
    return place._replace(height=height, height_of=toes.name_of(number), height_source=used.source)


def _largest(each: FloatArray, together: ResultWithIntervals) -> int:
    """Return the number of the source with the largest value; ALL if none is above that of all rocks together.

    each : (N,) value of each source, NaN if unknown; together : of all rocks
    """
    value = np.nan if together.value is None else together.value
    return int(with_largest_value(each[:, None], np.array([value]))[0])


def _p95(run: RunFiles, toes: SourceToes, segments: Segments, distance: float, height: bool) -> FloatArray:
    """Return the p95 energy (N,) J or height (N,) m of the rocks of each source that pass a distance (m).

    The result is NaN for fewer than 20 rocks, and for sources with too few rocks that have a toe.

    height : True for the height, False for the energy
    """
    rows, energies, heights = passing(run, toes.known, segments, distance)
    values, source = heights if height else energies, run.ends.source[rows]
    found = np.full(len(toes.names), np.nan)
    for number in toes.enough:
        mine = values[source == number]
        if len(mine) >= FEWEST_ROCKS:
            found[number] = np.percentile(mine, P95)
    return found
