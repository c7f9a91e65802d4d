"""Compare two runs: shares of rocks in each zone and area of interest, and which differences are significant.

A difference is significant if its 95 % interval (`ensemble.two_shares`) excludes 0. Of many comparisons of equal runs,
about 5 % are significant by chance; `p_holm` is corrected for the number of comparisons. Interval and p value assume
that the rocks of the two runs are independent. But two runs with the same sources and the same seed release the same
rocks; the intervals are then usually too wide.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.ensemble.statistics import wilson_interval, words_on_pieces
from rpf3d_core.ensemble.two_shares import holm, newcombe_interval, p_value
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.benches import AREA, CAUGHT_COUNT, ZONE
from rpf3d_core.results.earlier_results import read_summary

MEASURES = ("reached", "stopped", "retained")
"""The compared shares: of rocks that reached a place, that stopped in it, or that were retained in it.

`reached` and `stopped` are shares of all rocks, `retained` is a share of the rocks that reached the place.
"""
CAUGHT = "caught"
"""Measure for the share of all rocks that barriers caught; it has a row if at least one of the runs has such rocks."""
OUTCOME, ALL_ROCKS = "outcome", "all rocks"
"""Kind and place in the row of the measure CAUGHT, which belongs to no zone or area."""
SECTIONS = {ZONE: "benches", AREA: "areas_of_interest"}
LEVEL = 0.05

Facts = Mapping[str, Any]


class Counted(NamedTuple):
    """A share of rocks as two numbers.

    rocks : number of rocks that did what the share counts; of : number of all rocks to which the share refers
    """

    rocks: int
    of: int

    @property
    def share(self) -> float:
        """The share (-); `of` must be at least 1."""
        return self.rocks / self.of


class ShareDifference(NamedTuple):
    """One share of rocks in a zone or area of interest, in two runs A and B, with the test of the difference.

    kind : ZONE or AREA; place : name of the zone or area; measure : one of MEASURES, such as "stopped". For
        the share of all rocks that barriers caught, `kind` is OUTCOME, `place` ALL_ROCKS and `measure` CAUGHT
    a, b : the share in run A and in run B
    interval : 95 % interval of share B - share A (-); p : two-sided p value
    p_holm : p after Holm's correction for the number of differences
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
        """Share B - share A (-)."""
        return self.b.share - self.a.share

    @property
    def significant(self) -> bool:
        """True if the difference is significant: its 95 % interval excludes 0."""
        return not self.interval[0] <= 0.0 <= self.interval[1]


class Energies(NamedTuple):
    """The p95 energy (J) of a zone or area of interest in two runs A and B; None for fewer than 20 rocks.

    The p95 energy is the 95th percentile of the largest energy of each rock in the place.
    kind : ZONE or AREA; place : name of the zone or area; a, b : p95 energy in run A and in run B, J
    """

    kind: str
    place: str
    a: float | None
    b: float | None


class Comparison(NamedTuple):
    """The comparison of two runs: differences of shares and energies in each zone and area of interest.

    a, b : summaries of the runs
    differences, energies : for the places that exist in both runs and that rocks reached in at least one run
    only : for "a" and for "b", the places (kind, name) that exist only in this run
    """

    a: Facts
    b: Facts
    differences: tuple[ShareDifference, ...]
    energies: tuple[Energies, ...]
    only: Mapping[str, tuple[tuple[str, str], ...]]

    @property
    def notes(self) -> list[str]:
        """Notes for the reader of the comparison: on partial runs, unknowns, equal rocks, chance and percentiles."""
        return list(_notes(self))


def compare_runs(folder_a: str | Path, folder_b: str | Path) -> Comparison:
    """Compare the results in two folders: shares of rocks, energies, and which differences are significant.

    Raises
    ------
    InputError
        A folder contains no result, or a result without rocks; the message names the folder.
    """
    facts = [read_summary(folder) for folder in (folder_a, folder_b)]
    for folder, one in zip((folder_a, folder_b), facts, strict=True):
        if not one["rocks"]:
            raise InputError(f"{folder}: has flown no rock, so there is nothing to compare")
    return compare_summaries(*facts)


def compare_summaries(a: Facts, b: Facts) -> Comparison:
    """Compare two runs by their summaries; a, b : content of the summaries, each of a run with at least one rock."""
    both = [(kind, name) for kind, name in _places(a) if (kind, name) in _places(b)]
    counts = [
        (kind, name, measure, *counted)
        for kind, name in both
        for measure in MEASURES
        if (counted := _counted_in_both(a, b, kind, name, measure)) is not None
    ]
    if any(map(_caught, (a, b))):
        one, other = (Counted(_caught(facts), facts["rocks"]) for facts in (a, b))
        counts.append((OUTCOME, ALL_ROCKS, CAUGHT, one, other))
    p_values = [p_value(*one, *other) for *_, one, other in counts]
    differences = tuple(
        ShareDifference(
            kind=kind,
            place=name,
            measure=measure,
            a=one,
            b=other,
            interval=newcombe_interval(*other, *one),
            p=p,
            p_holm=p_holm,
        )
        for (kind, name, measure, one, other), p, p_holm in zip(counts, p_values, holm(p_values), strict=True)
    )
    came = {(row.kind, row.place) for row in differences}
    energies = tuple(
        Energies(kind=kind, place=name, a=_energy_p95(a, kind, name), b=_energy_p95(b, kind, name))
        for kind, name in both
        if (kind, name) in came
    )
    only = {"a": tuple(p for p in _places(a) if p not in both), "b": tuple(p for p in _places(b) if p not in both)}
    return Comparison(a=a, b=b, differences=differences, energies=energies, only=only)


def comparison_section(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as plain values for JSON; shares and differences are in (-), energies in J."""
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
    """Return the facts that identify a run, for JSON: scene, digest, seed, numbers of rocks and triangles."""
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
    """Return a share with its 95 % Wilson interval (-), for JSON."""
    return {**counted._asdict(), "share": counted.share,
            "interval_95": list(wilson_interval(*counted))}  # fmt: skip


def _caught(facts: Facts) -> int:
    """Return the number of rocks that barriers caught in a run; facts : content of its summary."""
    return int(facts.get("outcomes", {}).get(CAUGHT, {}).get("rocks", 0))


def _places(facts: Facts) -> list[tuple[str, str]]:
    return [(kind, name) for kind, section in SECTIONS.items() for name in facts[section]]


def _place(facts: Facts, kind: str, name: str) -> Facts:
    place: Facts = facts[SECTIONS[kind]][name]
    return place


def _energy_p95(facts: Facts, kind: str, name: str) -> float | None:
    energy: float | None = _place(facts, kind, name)["energy_p95_j"]
    return energy


def _counted_in_both(a: Facts, b: Facts, kind: str, name: str, measure: str) -> tuple[Counted, Counted] | None:
    """Return a share in run A and in run B; None if rocks reached the place in neither run.

    For `retained`, a share of the rocks that reached the place, the result is also None if no rock reached the place in
    one of the two runs.

    kind, name : of the place; measure : one of MEASURES
    """
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
        if facts.get("unknowns"):
            yield (f"{name} flew parameter sets of unknown values: intervals of differences hold the number of rocks "
                   "only, not what the unknowns leave open")  # fmt: skip
        if pieces := facts.get("pieces"):
            yield f"of {name}, {words_on_pieces(facts['rocks'], pieces)}"
        if _caught(facts):
            yield f"{name}: {CAUGHT_COUNT}"
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
    yield (
        "p95 energies have no interval here: chance can make a difference, a larger one with fewer rocks; fly other "
        "seeds to see how large"
    )


def _alike(a: Facts, b: Facts) -> str | None:
    """Return why two runs with equal seeds release the same rocks, as a phrase; None if they may release other rocks.

    a, b : content of the summaries of the runs
    """
    if a.get("digest") == b.get("digest"):
        return "the same scene"
    known = a.get("releases_digest")
    return "runs from the same sources" if known is not None and known == b.get("releases_digest") else None


def _named(kind: str, name: str) -> str:
    return name if kind == ZONE else f"{name} (area)"
