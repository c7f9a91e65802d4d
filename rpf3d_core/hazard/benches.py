"""The bench table: of each zone of the terrain and each area of interest, how many rocks came, stopped and stayed."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.hazard.maps import HazardMaps, Layers
from rpf3d_core.terrain.facets import Terrain

SHOWN = 12
"""Zones of the printed table: more do not fit a screen."""

TEXT_HEADER = ("zone", "reached", "stopped", "retained", "p95 (kJ)")
"""Of the printed table, short so that it fits 80 columns; `text_rows` has its columns."""

AT_MOST = "at most"
"""Of the printed table, where rocks were lost to holes."""

TEXT_NOTE = "shares of all rocks (retained: of those that came) with 95 % intervals"
"""What the columns of the printed table are."""

OPEN = "intervals are of the number of rocks alone; ground and model leave more open"
"""What the intervals of the printed table do not include."""

MOST_DECIMALS = 4
"""Of a share in per cent: one of ten million rocks needs no more to be seen not to be 0."""

SHORT = 1
"""Decimals that are enough otherwise: hazard/benches.csv has them all."""

ZONE, AREA = "zone", "area"


class Bench(NamedTuple):
    """A row of the bench table.

    kind : ZONE of the terrain, or AREA of interest; reached, stopped : shares of all rocks flown, as `share_of`
    retained : of the rocks that reached it, the share that stopped in it; energy_p95 : J, of each rock's maximum
        there, None below 20 rocks
    lost : share of all rocks flown that were lost to holes of the terrain, None where none were
    reached_at_most : share of all rocks flown that would have reached it if all lost ones had; None where none were
    """

    kind: str
    name: str
    reached: dict[str, Any]
    stopped: dict[str, Any]
    retained: dict[str, Any]
    energy_p95: float | None
    lost: dict[str, Any] | None = None
    reached_at_most: dict[str, Any] | None = None


def bench_table(terrain: Terrain, maps: HazardMaps) -> list[Bench]:
    """A row for each zone of the terrain, in its order, then for each area of interest, in the scene's."""
    zones = _benches(ZONE, terrain.zones, maps.zones, maps)
    return [*zones, *_benches(AREA, maps.area_names, maps.areas, maps)]


def lost_in_words(lost: int, flown: int) -> str:
    """Return a sentence on rocks lost to holes (at least one), and what it means for every share."""
    return (
        f"{lost:,} of {flown:,} rocks ({_percent(lost / flown, SHORT)} %) were lost to holes in the terrain and are "
        "followed no further: each might have come to any zone, cell or area downhill, so a share of 0 there is no "
        f"evidence (column `{AT_MOST}`: the share if all of them had come); close the holes to know"
    )


def benches_section(benches: Sequence[Bench]) -> dict[str, Any]:
    """The table for summary.json: `zones` and `areas_of_interest`, name -> shares with intervals and energy (J)."""
    sections: dict[str, Any] = {"zones": {}, "areas_of_interest": {}}
    for bench in benches:
        sections["zones" if bench.kind == ZONE else "areas_of_interest"][bench.name] = {
            "reached": bench.reached,
            "stopped": bench.stopped,
            "retained": bench.retained,
            "energy_p95_j": bench.energy_p95,
            **_lost_section(bench),
        }
    return sections


def _lost_section(bench: Bench) -> dict[str, Any]:
    """Return the entries of a zone or area that only runs with rocks lost to holes have."""
    return {} if bench.lost is None else {"lost_to_holes": bench.lost, "reached_at_most": bench.reached_at_most}


def text_header(benches: Sequence[Bench]) -> tuple[str, ...]:
    """Return the header over `text_rows`: with AT_MOST where rocks were lost to holes."""
    return TEXT_HEADER if not _any_lost(benches) else (*TEXT_HEADER[:2], AT_MOST, *TEXT_HEADER[2:])


def _any_lost(benches: Sequence[Bench]) -> bool:
    return any(bench.lost is not None for bench in benches)


def text_rows(benches: Sequence[Bench]) -> list[tuple[str, ...]]:
    """Rows under `text_header`: the SHOWN zones that most rocks reached, most first, then every area of interest.

    An area that no rock reached is told with its interval: that is what it was drawn to find out.
    """
    areas = [bench for bench in benches if bench.kind == AREA]
    return [_text_row(bench) for bench in (*_reached_zones(benches)[:SHOWN], *areas)]


def left_out(benches: Sequence[Bench]) -> int:
    """How many zones that rocks reached have no row in `text_rows`."""
    return max(0, len(_reached_zones(benches)) - SHOWN)


def _reached_zones(benches: Sequence[Bench]) -> list[Bench]:
    """Zones that rocks reached, most rocks first."""
    zones = [bench for bench in benches if bench.kind == ZONE and bench.reached["rocks"]]
    return sorted(zones, key=lambda bench: -bench.reached["rocks"])


def three_figures(value: float) -> str:
    """A number with three significant digits and no exponent, such as 0.0299, 2,460."""
    return f"{float(f'{value:.3g}'):,.12g}"


def _benches(kind: str, names: Sequence[str], layers: Layers, maps: HazardMaps) -> Iterator[Bench]:
    """A row for each of all C zones or areas, (C,) names, those that no rock came to included."""
    rocks, deposits = layers.everywhere(layers.rocks, 0), layers.everywhere(layers.deposits, 0)
    energy = layers.everywhere(layers.energy.p95, np.nan)
    for name, reached, stopped, p95 in zip(names, rocks.tolist(), deposits.tolist(), energy.tolist(), strict=True):
        bench = _bench(kind, name, reached, stopped, p95, maps.flown)
        yield _with_lost(bench, maps.lost, maps.flown) if maps.lost else bench


def _with_lost(bench: Bench, lost: int, flown: int) -> Bench:
    """Return a row with what is not known of it because rocks were lost to holes."""
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


def _text_row(bench: Bench) -> tuple[str, ...]:
    name = bench.name if bench.kind == ZONE else f"{bench.name} (area)"
    energy = "-" if bench.energy_p95 is None else three_figures(bench.energy_p95 / 1000.0)
    most = () if bench.reached_at_most is None else (bench.reached_at_most,)
    return (name, *(_text(share) for share in (bench.reached, *most, bench.stopped, bench.retained)), energy)


def _text(share: dict[str, Any]) -> str:
    """A share in per cent with its interval, such as `84.5 % (79-89)`."""
    if share["share"] is None:
        return "-"
    low, high = share["interval_95"]
    decimals = min(_decimals(0.5 * (high - low)), SHORT)
    return f"{_percent(share['share'], SHORT)} % ({_percent(low, decimals)}-{_percent(high, decimals)})"


def _percent(share: float, decimals: int) -> str:
    """With so many decimals, or as many more as keep a share that is not 0 or 1 from looking so; those have none."""
    rest = min(share, 1.0 - share)
    return f"{100.0 * share:.{max(decimals, _decimals(rest)) if rest > 0.0 else 0}f}"


def _decimals(share: float) -> int:
    """Decimals of a share > 0 in per cent that show its first digit, MOST_DECIMALS at most."""
    return min(max(0, -math.floor(math.log10(100.0 * share))), MOST_DECIMALS)
