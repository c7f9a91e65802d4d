"""Two runs side by side: shares of each zone and area of interest, their differences, and which of them are more than
chance.

A difference is significant where its 95 % interval (`ensemble.two_shares`) excludes 0. Of many comparisons of equal
runs some 5 % are significant by chance; `p_holm` is corrected for that. Both take the rocks of the two runs as
independent. Runs from the same sources with the same seed release their rocks alike; as a rule that makes the
intervals too wide rather than too narrow.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.ensemble.statistics import wilson_interval, words_on_pieces
from rpf3d_core.ensemble.two_shares import holm, newcombe_interval, p_value
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.benches import AREA, ZONE
from rpf3d_core.results.earlier_results import read_summary

MEASURES = ("reached", "stopped", "retained")
"""Shares of all rocks, but for the last: of those that reached the place."""
SECTIONS = {ZONE: "benches", AREA: "areas_of_interest"}
LEVEL = 0.05

Facts = Mapping[str, Any]


class Counted(NamedTuple):
    """So many rocks of a total."""

    rocks: int
    of: int

    @property
    def share(self) -> float:
        """Share (-) of a total of at least one."""
        return self.rocks / self.of


class ShareDifference(NamedTuple):
    """One share in two runs.

    kind : ZONE or AREA; place : its name; measure : one of MEASURES
    interval : 95 %, of the share of B less the share of A (-); p : two-sided; p_holm : corrected for all of the table
    """

    kind: str
    place: str
    measure: str
    a: Counted
    b: Counted
    interval: tuple[float, float]
    p: float
    p_holm: float

    @property
    def change(self) -> float:
        """Share of B less share of A (-)."""
        return self.b.share - self.a.share

    @property
    def significant(self) -> bool:
        """Whether the interval excludes 0."""
        return not self.interval[0] <= 0.0 <= self.interval[1]


class Energies(NamedTuple):
    """The 95th percentile (J) of each rock's largest energy in a place, in two runs; None below 20 rocks."""

    kind: str
    place: str
    a: float | None
    b: float | None


class Comparison(NamedTuple):
    """Two runs, place by place.

    a, b : the summaries; differences : of places that both have and rocks came to; energies : of the same places
    only : "a" and "b" -> places (kind, name) that the other run does not have
    """

    a: Facts
    b: Facts
    differences: tuple[ShareDifference, ...]
    energies: tuple[Energies, ...]
    only: Mapping[str, tuple[tuple[str, str], ...]]

    @property
    def notes(self) -> list[str]:
        """What a reader must know of the two runs before the figures."""
        return list(_notes(self))


def compare_runs(folder_a: str | Path, folder_b: str | Path) -> Comparison:
    """Compare two result folders.

    Raises
    ------
    InputError
        One of them is no result, or has flown no rock; says which.
    """
    facts = [read_summary(folder) for folder in (folder_a, folder_b)]
    for folder, one in zip((folder_a, folder_b), facts, strict=True):
        if not one["rocks"]:
            raise InputError(f"{folder}: has flown no rock, so there is nothing to compare")
    return compare_summaries(*facts)


def compare_summaries(a: Facts, b: Facts) -> Comparison:
    """Compare two summaries of at least one rock each."""
    both = [(kind, name) for kind, name in _places(a) if (kind, name) in _places(b)]
    counts = [
        (kind, name, measure, *counted)
        for kind, name in both
        for measure in MEASURES
        if (counted := _counted_in_both(a, b, kind, name, measure)) is not None
    ]
    p_values = [p_value(*one, *other) for *_, one, other in counts]
    differences = tuple(
        ShareDifference(kind, name, measure, one, other, newcombe_interval(*other, *one), p, p_holm)
        for (kind, name, measure, one, other), p, p_holm in zip(counts, p_values, holm(p_values), strict=True)
    )
    came = {(row.kind, row.place) for row in differences}
    energies = tuple(
        Energies(kind, name, *(_place(facts, kind, name)["energy_p95_j"] for facts in (a, b)))
        for kind, name in both
        if (kind, name) in came
    )
    only = {"a": tuple(p for p in _places(a) if p not in both), "b": tuple(p for p in _places(b) if p not in both)}
    return Comparison(a, b, differences, energies, only)


def comparison_section(comparison: Comparison) -> dict[str, Any]:
    """A comparison for JSON; shares and differences (-), energies (J)."""
    return {
        "a": run_section(comparison.a),
        "b": run_section(comparison.b),
        "notes": comparison.notes,
        "interval": "95 %, of B - A: Newcombe 1998, method 10; of a share: Wilson 1927",
        "p": "two-sided: pooled z, or Fisher's exact where a count is expected below 5; p_holm: Holm's correction",
        "differences": [_difference_section(row) for row in comparison.differences],
        "energy_p95_j": [row._asdict() for row in comparison.energies],
        "only_in_a": [_named(kind, name) for kind, name in comparison.only["a"]],
        "only_in_b": [_named(kind, name) for kind, name in comparison.only["b"]],
    }


def run_section(facts: Facts) -> dict[str, Any]:
    """What tells a run from others, for JSON."""
    scene = facts["scene"]
    run = {name: facts[name] for name in ("rocks", "rocks_planned", "partial")}
    triangles = facts.get("terrain", {}).get("triangles")
    return {"scene": scene.get("file"), "digest": scene.get("digest"), "seed": scene.get("seed"), **run,
            "triangles": triangles}  # fmt: skip


def _difference_section(row: ShareDifference) -> dict[str, Any]:
    return {
        "kind": row.kind,
        "place": row.place,
        "measure": row.measure,
        "a": counted_section(row.a),
        "b": counted_section(row.b),
        "difference": row.change,
        "interval_95": list(row.interval),
        "p": row.p,
        "p_holm": row.p_holm,
        "significant": row.significant,
    }


def counted_section(counted: Counted) -> dict[str, Any]:
    """A share for JSON, with its 95 % Wilson interval (-)."""
    return {**counted._asdict(), "share": counted.share,
            "interval_95": list(wilson_interval(*counted))}  # fmt: skip


def _places(facts: Facts) -> list[tuple[str, str]]:
    return [(kind, name) for kind, section in SECTIONS.items() for name in facts[section]]


def _place(facts: Facts, kind: str, name: str) -> Facts:
    place: Facts = facts[SECTIONS[kind]][name]
    return place


def _counted_in_both(a: Facts, b: Facts, kind: str, name: str, measure: str) -> tuple[Counted, Counted] | None:
    """The share in both runs; None where no rock came in either, or, of those retained, in one."""
    reached = [_place(facts, kind, name)["reached"]["rocks"] for facts in (a, b)]
    if not any(reached) or (measure == "retained" and not all(reached)):
        return None
    totals = reached if measure == "retained" else [a["rocks"], b["rocks"]]
    one, other = (
        Counted(_place(facts, kind, name)[measure]["rocks"], total) for facts, total in zip((a, b), totals, strict=True)
    )
    return one, other


def _notes(comparison: Comparison) -> Iterator[str]:
    a, b = comparison.a["scene"], comparison.b["scene"]
    for name, facts in (("A", comparison.a), ("B", comparison.b)):
        if facts["partial"]:
            yield f"{name} is partial: {facts['rocks']:,} of {facts['rocks_planned']:,} rocks have flown"
        if pieces := facts.get("pieces"):
            yield f"of {name}, {words_on_pieces(facts['rocks'], pieces)}"
    if a.get("seed") == b.get("seed") and (alike := _alike(a, b)):
        yield (
            f"these are {alike} with the same seed: their rocks start alike, so intervals are, as a rule, rather too "
            "wide than too narrow"
        )
    rows, chance = comparison.differences, LEVEL * len(comparison.differences)
    found, kept = sum(row.significant for row in rows), sum(row.p_holm < LEVEL for row in rows)
    yield (
        f"{found} of {len(rows)} differences are significant; between equal runs about {chance:.0f} would "
        f"be, by chance. {kept} stay below p = {LEVEL} after Holm's correction for their number"
    )
    within = max(facts["hazard"].get("percentiles_within") or 0.0 for facts in (comparison.a, comparison.b))
    yield (
        f"p95 energies have no interval: their bins alone can make a difference of {200.0 * within:.0f} %, and chance "
        "can make a larger one, the fewer rocks came the larger; fly other seeds to see how large"
    )


def _alike(a: Facts, b: Facts) -> str | None:
    """What two scenes share that makes their rocks start alike; None where they do not, or nobody knows."""
    if a.get("digest") == b.get("digest"):
        return "the same scene"
    known = a.get("releases_digest")
    return "runs from the same sources" if known is not None and known == b.get("releases_digest") else None


def _named(kind: str, name: str) -> str:
    return name if kind == ZONE else f"{name} (area)"
