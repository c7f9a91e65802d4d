"""The main figures of a report: the answer, and the tables of areas and zones (retention of each bench)."""

from collections.abc import Iterator
from typing import Any

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.benches import AT_MOST, CAUGHT_COUNT, share_text
from rpf3d_core.report.barriers_part import from_of, worst_of
from rpf3d_core.report.distances_part import further_faces
from rpf3d_core.report.elements import Element, Heading, Table, Text
from rpf3d_core.report.fences_part import from_source
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.source_toes import SourceToes, farthest
from rpf3d_core.report.toe import DESIGN, held_beyond
from rpf3d_core.report.warnings_part import as_sentence
from rpf3d_core.report.words import figure_cells, interval, kilojoules, metres, share_cells, share_interval
from rpf3d_core.results.inputs import ASSUMED

MOST_ROWS, FEWEST_BENCHES = 12, 3
"""Largest number of rows in the table of main figures, except that at least FEWEST_BENCHES zones have two rows each."""
MOST_NAMED = 8
"""Largest number of unreached zones that a sentence names."""
AT_BARRIERS = {
    "caught": "caught in the end by {}", "first_broken_through": "broke through {} at the first arrival",
    "first_flown_over": "flew over {} at the first arrival",
}  # fmt: skip
"""Words for what rocks did at a barrier, in the table of main figures, by name in summary.json; {} : its name."""
THREE = ("value", "95 % predictive", "95 % sampling")
NO_PREDICTIVE = (
    "Predictive intervals are unknown, because the scene takes every coefficient of the ground as known. Sampling "
    "intervals include only the uncertainty due to the number of rocks, so they are narrower than the true uncertainty."
)
BOTH = (
    "The predictive interval includes the unknowns of the ground. The sampling interval includes only the uncertainty "
    "due to the number of rocks. Design with the wider one."
)
IF_LOST_CAME = (
    f" Column `{AT_MOST}`: the share, with its sampling interval, if every rock lost to a hole had also reached the "
    "zone."
)
OF_WORST = (
    "A row with a source counts the rocks of this source only, because they are clearly worse than all rocks together. "
    "All other figures count the rocks of all sources together, and depend on how many rocks each source has."
)
"""Note under the main figures of a scene with several sources."""


def answer_part(run: RunFiles, toes: SourceToes) -> list[Element]:
    """Return the section with the main figures: distance beyond the toe, areas, barriers and zones.

    If there are too many zones for the table, the table has only the zones in which most rocks stopped.
    """
    far = farthest(toes, DESIGN)
    beyond = toes.of_source(far)
    some = "" if len(beyond.rows) == beyond.of else f" ({len(beyond.rows):,} of {beyond.of:,} have a face below)"
    name = f"distance beyond the toe of the first face that holds {DESIGN} % of the rocks"
    rows = [[f"{name}{from_source(toes.name_of(far))}{some}",
             *figure_cells(held_beyond(beyond, run.sets, DESIGN), metres)]]  # fmt: skip
    for name, area in _worst(run, "areas_of_interest").items():
        rows.append([f"rocks that reach the area {name}{_from(area, 'source')}", *share_cells(area["reached"])])
        if most := area.get("reached_at_most"):
            rows.append([f"{AT_MOST}: rocks that reach the area {name} or were lost to holes", *share_cells(most)])
    for name, barrier in run.summary.get("barriers", {}).items():
        found = worst_of(barrier, run.summary["rocks"])
        rows.append([f"rocks that come to {name}{from_of(found['reached'])}", *share_cells(found["reached"])])
        rows += [[f"{words.format(name)}, of the rocks that reached it{from_of(found[did])}", *share_cells(found[did])]
                 for did, words in AT_BARRIERS.items()]  # fmt: skip
    retained = {name: bench for name, bench in _worst(run, "benches").items() if bench["reached"]["rocks"]}
    together = run.summary["benches"]
    order = sorted(retained, key=lambda name: [-together[name][did]["rocks"] for did in ("stopped", "reached")])
    holding = order[: max((MOST_ROWS - len(rows)) // 2, FEWEST_BENCHES)]
    for name, bench in retained.items():
        if name in holding:  # a zone that retains almost all rocks may still be reached by most of them
            of_source = _from(bench, "retained_source")
            rows += [[f"rocks that reach {name}{_from(bench, 'source')}", *share_cells(bench["reached"])],
                     [f"retained by {name}, of the rocks that reached it{of_source}", *share_cells(bench["retained"])]]
    note = NO_PREDICTIVE if run.inputs["ground"] == ASSUMED else BOTH
    note = f"{note} {OF_WORST}" if "sources" in run.summary else note
    left = len(retained) - len(holding)
    sentence = f"These zones are those in which most rocks stopped; {left} more are in the table of retention below."
    more = [Text(sentence)] if left else []
    more += [Text(caught)] if (caught := _caught(run).strip()) else []
    without = [name for name, bench in together.items() if not bench["reached"]["rocks"]]
    more += [Text(f"No rock reached {_some(without)}. The retention of the benches below states how many rocks may "
                  "reach them all the same.")] if without else []  # fmt: skip
    return [
        Heading("The answer"), Table(("", *THREE), rows), *more, *further_faces(toes.together),
        Text(note, quiet=True),
    ]  # fmt: skip


def benches_part(run: RunFiles) -> Iterator[Element]:
    """Yield tables on the areas and the zones that rocks reached: shares reached, shares retained and p95 energies."""
    places = {name: bench for name, bench in _worst(run, "benches").items() if bench["reached"]["rocks"]}
    places |= {f"{name} (area)": area for name, area in _worst(run, "areas_of_interest").items()}
    yield Heading("Retention of each bench")
    lost = any(place.get("reached_at_most") for place in places.values())
    yield Table(("zone", "reached", *THREE[1:], *([AT_MOST] if lost else [])), [
        [
            f"{name}{_from(place, 'source')}",
            *share_cells(place["reached"]),
            *([share_text(place.get("reached_at_most") or place["reached"])] if lost else []),
        ]
        for name, place in places.items()
    ])  # fmt: skip
    yield Table(("zone", "retained", *THREE[1:]), [
        [f"{name}{_from(place, 'retained_source')}", *share_cells(place["retained"])] for name, place in places.items()
    ])  # fmt: skip
    whose = "of all rocks" if "sources" not in run.summary else "of the rocks of the named source, or of all rocks"
    yield Text(f"Reached: share {whose}. Retained: share of the rocks that reached the zone and stopped there. "
               "A zone is one row, however many surfaces it has: `terrain.split` makes a zone of each."
               f"{IF_LOST_CAME if lost else ''}{_caught(run)}", quiet=True)  # fmt: skip
    yield from _not_reached(run)
    yield Table(("zone", "p95 energy", *THREE[1:]), [
        [f"{name}{_from(place, 'energy_source')}", kilojoules(place["energy_p95_j"]),
         interval(place.get("energy_p95_predictive_j"), kilojoules),
         interval(place.get("energy_p95_sampling_j"), kilojoules)]
        for name, place in places.items()
    ])  # fmt: skip
    yield Text("p95 energy: 95th percentile of the largest energy of each rock in the zone; not known for fewer than "
               f"20 rocks.{'' if run.sets else ' Its intervals are known only for runs with unknowns.'}",
               quiet=True)  # fmt: skip


def _worst(run: RunFiles, kind: str) -> dict[str, dict[str, Any]]:
    """Return the sections of all zones or areas in summary.json, by name.

    With several sources, each figure is that of the source that is worst for this figure.

    kind : key in summary.json, `benches` for zones or `areas_of_interest`
    """
    return {name: {**place, **(place.get("worst_source") or {})} for name, place in run.summary[kind].items()}


def _from(place: dict[str, Any], figure: str) -> str:
    """Return the source of a figure as text, such as `, from crest`; "" for a figure of all rocks.

    place : from `_worst`; figure : `source` (of the shares reached and stopped), `retained_source` or `energy_source`
    """
    return f", from {place[figure]}" if place.get(figure) else ""


def _not_reached(run: RunFiles) -> list[Element]:
    """Return a sentence on the zones that no rock reached; [] if rocks reached all zones.

    The sentence gives the intervals of the share of rocks that may still reach such a zone.
    """
    places = {name: bench for name, bench in run.summary["benches"].items() if not bench["reached"]["rocks"]}
    if not places:
        return []
    reached = [place["reached"] for place in places.values()]
    widest = max(reached, key=lambda found: (found.get("predictive") or [0.0, 0.0])[1])
    _, predictive, sampling = share_cells(widest)
    return [Text(f"No rock reached {_some(list(places))}. That does not mean that none can: the share "
                 f"of rocks that reach such a zone has the 95 % predictive interval {predictive} and the sampling "
                 f"interval {sampling}{_for_fewest_rocks(run)}.{_if_lost_came(places)}")]  # fmt: skip


def _some(zones: list[str]) -> str:
    """Return the names of zones as text, at most MOST_NAMED of them, and the number of further zones."""
    more = f" and {len(zones) - MOST_NAMED} more zones" if len(zones) > MOST_NAMED else ""
    return f"{', '.join(zones[:MOST_NAMED])}{more}"


def _for_fewest_rocks(run: RunFiles) -> str:
    """Return the words after the sampling interval of a share of 0 rocks; "" for a scene with one source.

    The words state that the interval counts the rocks of all sources, and give the wider interval of the source with
    the fewest rocks.
    """
    flown = [source for source in run.summary.get("sources", ()) if source["rocks"]]
    if not flown:
        return ""
    fewest = min(flown, key=lambda source: source["rocks"])
    rocks, interval = f"{fewest['rocks']:,} rocks", share_interval(wilson_interval(0, fewest["rocks"]))
    return f" for the rocks of all sources together; for the {rocks} from {fewest['name']} alone, {interval}"


def _if_lost_came(places: dict[str, dict[str, Any]]) -> str:
    """Return a sentence on the share of rocks that reach a zone if each lost rock counts as reaching it.

    Lost rocks fell through holes of the terrain. The result is "" if no rock was lost.

    places : sections of zones in summary.json, which no rock reached
    """
    most = next((place["reached_at_most"] for place in places.values() if place.get("reached_at_most")), None)
    return f" If every rock lost to a hole reached such a zone, the share is {share_text(most)}." if most else ""


def _caught(run: RunFiles) -> str:
    """Return a sentence that zones count rocks caught by barriers as retained; "" if no barrier caught a rock."""
    return f" {as_sentence(CAUGHT_COUNT)}" if run.summary["outcomes"].get("caught", {}).get("rocks") else ""
