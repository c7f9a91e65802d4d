"""Choose for each figure of each barrier the source that is worst, and warn of shares that other sources hide."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.hazard.benches import share_text
from rpf3d_core.hazard.by_source.worst import (
    ALL,
    Counts,
    further_figures,
    with_largest_share,
    with_largest_value,
    with_smallest_share,
)
from rpf3d_core.hazard.maps import FEWEST_ROCKS, HazardMaps

P95 = 95
LARGEST = {"first_broken_through": "break through", "first_flown_over": "fly over"}
"""Shares of the rocks that arrived at a barrier that are worst if they are large, with words on what the rocks do."""
SMALLEST = {"first_caught": "are caught at once by", "caught": "are caught in the end by"}
"""Shares of the rocks that arrived at a barrier that are worst if they are small, with words on what the rocks do."""
P95_OF = {"first_energy_j": "energy", "first_height_over_ground_m": "height"}
"""Distributions at a barrier by name in summary.json, with their names in `AtBarrier`."""


def has_source_barriers(maps: HazardMaps) -> bool:
    """Return True if barriers are counted for each source: the scene has several sources, and barriers."""
    return maps.sources is not None and bool(maps.sources.barriers)


def worst_at_barriers(maps: HazardMaps) -> dict[str, list[int]]:
    """Return for each figure of summary.json the number of the worst source at each of B barriers; ALL for all rocks.

    - `reached`, and the shares named in LARGEST: the source whose interval has the largest lower end, if the source is
      clearly worse than all rocks (`hazard.by_source.worst`).
    - The shares named in SMALLEST: the source whose interval has the smallest upper end, if it is clearly worse.
    - The energy and the height named in P95_OF: the source with the largest p95, if this p95 is above the p95 of all
      rocks. Only sources with at least 20 rocks there count.

    maps : of a scene for which `has_source_barriers` is True
    """
    came, flown = _rocks(maps, "came"), (maps.sources.flown[:, None], np.array(maps.flown))
    counts = {name: _counts(_rocks(maps, name), came) for name in (*LARGEST, *SMALLEST)}
    worst = {
        "reached": with_largest_share(_counts(came, flown)),
        **{name: with_largest_share(counts[name]) for name in LARGEST},
        **{name: with_smallest_share(counts[name]) for name in SMALLEST},
    }
    for name, of in P95_OF.items():
        each = [[_p95(getattr(at.counted, of), FEWEST_ROCKS) for at in barriers] for barriers in maps.sources.barriers]
        together = [_p95(getattr(at.counted, of), 1) for at in maps.barriers]
        worst[name] = with_largest_value(np.array(each), np.array(together))
    return {name: numbers.tolist() for name, numbers in worst.items()}


def hidden_at_barriers(maps: HazardMaps) -> list[str]:
    """Return a warning that shares of all rocks at barriers hide worse shares of single sources; [] if none is hidden.

    The warning states the share with the largest difference, and the number of further shares.
    """
    if not has_source_barriers(maps):
        return []
    found = sorted(_hidden(maps), key=lambda each: -each[0])
    if not found:
        return []
    more = further_figures(len(found) - 1, "barriers")
    return [f"{found[0][1]}.{more} hazard/source_barriers.csv has the figures of all sources"]


def _hidden(maps: HazardMaps) -> Iterator[tuple[float, str]]:
    """Yield a difference (-) and words for each share of a source at a barrier that the share of all rocks hides.

    The difference is between the share of the source and the share of all rocks. The shares are those named in LARGEST
    and SMALLEST.
    """
    worst = worst_at_barriers(maps)
    for name, words in {**LARGEST, **SMALLEST}.items():
        for b, number in enumerate(worst[name]):
            if number == ALL:
                continue
            own, all_rocks = (
                share_of(getattr(at, name), at.came) for at in (maps.sources.barriers[number][b], maps.barriers[b])
            )
            yield abs(own["share"] - all_rocks["share"]), (
                f"of the rocks from {maps.sources.names[number]} that reach barrier {maps.barriers[b].name}, "
                f"{share_text(own)} {words} it; of the rocks of all {len(maps.sources.names):,} sources together, "
                f"{share_text(all_rocks)}"
            )  # fmt: skip


def _rocks(maps: HazardMaps, name: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return numbers of rocks at B barriers, of each source (S, B) and of all rocks (B,).

    name : of the number in `BarrierFigures`
    """
    each = np.array([[getattr(at, name) for at in barriers] for barriers in maps.sources.barriers])
    return each, np.array([getattr(at, name) for at in maps.barriers])


def _counts(rocks: tuple[Any, Any], of: tuple[Any, Any]) -> Counts:
    """Return the counts of shares; rocks, of : numerators and denominators, of each source and of all rocks."""
    return Counts(each=rocks[0], each_of=of[0], all=rocks[1], all_of=of[1])


def _p95(sample: Sample, fewest: int) -> float:
    """Return the 95th percentile of a sample; NaN for fewer values than `fewest`."""
    return sample.percentiles((P95,))[0] if sample.count >= fewest else np.nan
