"""Assemble the content of a report from the result folder of a run: warnings first, limits and sign-off last."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.benches import AT_MOST, CAUGHT_COUNT, share_text
from rpf3d_core.hazard.filled_cells import ReachedCells, filling_cell, rocks_that_fill, share_of_cells
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.report.barriers_part import from_of, worst_of
from rpf3d_core.report.changed_inputs import changed_inputs
from rpf3d_core.report.distances_part import distances_part, further_faces
from rpf3d_core.report.draped_map import FEW, caption_of
from rpf3d_core.report.elements import Bullets, Element, Heading, Picture, SignOff, Table, Text, View, Warnings
from rpf3d_core.report.fences_part import barriers_on_faces, fences_part, from_source
from rpf3d_core.report.inputs_part import inputs_part
from rpf3d_core.report.run_files import HazardGrid, RunFiles, read_hazard
from rpf3d_core.report.section import CriticalSection, critical_section
from rpf3d_core.report.section_part import section_part
from rpf3d_core.report.segments import segments_of
from rpf3d_core.report.source_places import fence_places
from rpf3d_core.report.source_toes import SourceToes, farthest, source_toes
from rpf3d_core.report.toe import DESIGN, BeyondToe, directions, held_beyond
from rpf3d_core.report.view import MOST_TRIANGLES, maps_seen, terrain_seen, view_html
from rpf3d_core.report.words import (
    UNKNOWN,
    figure_cells,
    interval,
    kilojoules,
    metres,
    share_cells,
    share_interval,
)
from rpf3d_core.results.inputs import ASSUMED
from rpf3d_core.results.overconfidence import UNFINISHED
from rpf3d_core.terrain.faces import LOWEST, STEEP
from rpf3d_core.values import UNSTOPPED, Outcome

MOST_ROWS, FEWEST_BENCHES = 12, 3
"""Largest number of rows in the table of main figures, except that at least FEWEST_BENCHES zones have two rows each."""
FILE_EXTENSION = re.compile(r"\.[A-Za-z]\w*")
"""Pattern of the extension of a file name, such as .dxf; the decimals of a number do not match."""
MOST_NAMED = 8
"""Largest number of zones that a sentence names, of those that no rock reached."""
AT_BARRIERS = {
    "caught": "caught in the end by {}", "first_broken_through": "broke through {} at the first arrival",
    "first_flown_over": "flew over {} at the first arrival",
}  # fmt: skip
"""Words for what rocks did at a barrier, in the table of main figures, by name in summary.json; {} : its name."""
NOT_STOPPED = {
    Outcome.LEFT_TERRAIN: "flew past the edge of the terrain",
    Outcome.LOST_TO_HOLE: "fell through holes of the terrain",
    **UNFINISHED,
}
"""Words for the rocks with each outcome of `UNSTOPPED`, after their number."""
if missing := set(UNSTOPPED) - set(NOT_STOPPED):
    raise TypeError(f"no words for the outcomes {missing}")
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
ENERGY = "hazard/energy_p95.png"
WORST_REACH = "hazard/reach_probability_worst_source.png"
WORST_REACH_WORDS = "Largest share of the rocks of one source that reached the cell."
PICTURES = (
    (("map.png", "Map: paths, releases and ends of rocks."),),
    (
        ("hazard/reach_probability_high.png",
         "Reach probability of the cells: upper end of its 95 % predictive interval."),
        (WORST_REACH, WORST_REACH_WORDS),
        ("hazard/reach_probability.png", "Reach probability of the cells."),
    ),
    ((WORST_REACH, WORST_REACH_WORDS),),
    (("hazard/energy_p95_worst_source.png", "Largest p95 energy of all rocks together and of all sources with "
      f"{FEWEST_ROCKS} rocks in the cell."),),
    ((ENERGY, "95th percentile of the energy in each cell. It may be larger than the p95 energy of the cell's zone, "
      "because it counts only the rocks that reached the cell, often few."),),
)  # fmt: skip
"""Pictures of the run that a report shows: for each picture, possible files with captions.

The first existing file is shown, unless an earlier picture shows the same file.
"""
LIMITS = (
    "The results describe rocks after a release. They say nothing about how often rocks are released.",
    "No interval includes the uncertainty of what the scene takes as known: the form of the models, the terrain, the "
    "sources, the sizes.",
    "Terrain changes with every blast and every muck pile; the results hold for the surveyed surface only.",
    "Reach probability of a map cell grows with the cell; compare maps with equal cells only.",
    "Energies are translational unless a table states otherwise. Heights are those of the centre of the rock: add the "
    "radius of the rock for a fence.",
)
FIELDS = (
    "Prepared by, date",
    "Checked by, date",
    "Approved by, date",
    "Valid until, or until these changes of the pit",
)


def report_elements(run: RunFiles, site: str) -> list[Element]:
    """Return the elements of the report in order.

    site : name of the site, as the report shows it

    Raises
    ------
    InputError
        plotly is not installed.
    """
    toes, section = source_toes(run), critical_section(run)
    beyond, segments = toes.together, segments_of(run)
    measured = fence_places(run, toes, segments)
    steep = barriers_on_faces(run)
    warnings = list(_warnings(run, beyond, steep))
    return [
        Heading(f"Rockfall report: {site}", 1),
        *([Warnings("Read first", warnings)] if warnings else []),
        _run_facts(run, site),
        *_answer(run, toes),
        *_pictures(run, section),
        *section_part(run, toes, section),
        *_benches(run),
        *distances_part(run, toes),
        *fences_part(run, measured, segments, beyond, steep),
        *inputs_part(run),
        Heading("Limits of the answer"), Bullets(LIMITS),
        Heading("Sign-off"), SignOff(FIELDS),
    ]  # fmt: skip


def _run_facts(run: RunFiles, site: str) -> Table:
    """Return the table that identifies the run: site, date, scene, digest, version, seed, rocks, sets."""
    facts, scene = run.summary, run.summary["scene"]
    rows = [
        ("site", site), ("date of the run", run.inputs.get("date", UNKNOWN).replace("T", " ")),
        ("scene file", scene["file"]), ("scene digest (SHA-256)", scene["digest"]),
        ("rpf3d version", facts["versions"]["rpf3d"] or UNKNOWN), ("seed", str(scene["seed"])),
        ("rocks flown", f"{facts['rocks']:,} of {facts['rocks_planned']:,}"),
        ("parameter sets", f"{run.sets:,}" if run.sets else "none: nothing counts as unknown"),
    ]  # fmt: skip
    return Table(("this run", ""), rows, right=False)


def _warnings(run: RunFiles, beyond: BeyondToe, steep: Sequence[str]) -> Iterator[str]:
    """Yield the warnings at the top of the report.

    The order is: changed inputs; an interruption of the run; missing hazard maps; the warnings of the run; reasons why
    results look too certain; rocks without a face below their release; barriers on faces; rocks that did not stop;
    rocks that broke.

    steep : a clause on each barrier on a face, from `barriers_on_faces`
    """
    yield from changed_inputs(run)
    if run.summary["partial"]:
        yield f"The run was interrupted: {run.summary['rocks']:,} of {run.summary['rocks_planned']:,} rocks have flown."
    if not (run.folder / "hazard" / "reach_probability.tif").is_file():
        yield ("The result folder has no hazard maps (`hazard/`): the 3D view does not show which ground rocks "
               "reached. Copy the whole folder, or run the scene again.")  # fmt: skip
    yield from (_as_sentence(warning) for warning in run.inputs["warnings"])
    for sentence in run.inputs["surer_than_it_may_be"]:
        yield f"Less certain than it looks: {sentence}."
    of = beyond.of
    missing = of - len(beyond.rows)
    if len(beyond.rows) == 0:
        yield (f"No face steeper than {STEEP:g} degrees and {LOWEST:g} m high lies below the releases: there is no "
               "toe, so distances beyond a toe and figures of fences are not known.")  # fmt: skip
    elif missing:
        yield (f"{missing:,} of {of:,} rocks are in no figure of distances beyond the toe, because no face steeper "
               f"than {STEEP:g} degrees and {LOWEST:g} m high ends below their release.")  # fmt: skip
    yield from (f"No fence can be built there: {words}." for words in steep)
    if unstopped := run.unstopped:
        number, broken = sum(unstopped.values()), run.ended(Outcome.FRAGMENTED)
        most_first = sorted(unstopped, key=lambda outcome: -unstopped[outcome])
        what = ", ".join(f"{unstopped[outcome]:,} {NOT_STOPPED[outcome]}" for outcome in most_first)
        kinds = "rocks and fragments" if broken else "rocks"
        yield (f"{number:,} of {len(run.ends.key) - broken:,} {kinds} did not stop on the terrain ({what}): they count "
               "as stopping farther than every distance.")  # fmt: skip
    if broken := run.ended(Outcome.FRAGMENTED):
        yield (f"{broken:,} rocks broke. In the distances, each of them counts as stopping farther than every "
               "distance, and its fragments count as rocks.")  # fmt: skip


def _as_sentence(warning: str) -> str:
    """Return a warning of the run as a sentence with a capital letter and a full stop or question mark.

    If the warning begins with a file name, the first letter is not changed.
    """
    begins = (warning.partition(" ")[0].rstrip(":,"), warning.partition(":")[0])
    is_file = any(FILE_EXTENSION.fullmatch(Path(begin).suffix) for begin in begins)
    return f"{warning[:1] if is_file else warning[:1].upper()}{warning[1:]}{'' if warning.endswith('?') else '.'}"


def _answer(run: RunFiles, toes: SourceToes) -> list[Element]:
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


def _pictures(run: RunFiles, section: CriticalSection | None) -> Iterator[Element]:
    """Yield the part with the 3D view, the map of the rocks and the hazard maps; pictures without a file are left out.

    section : the critical section, None if there is none
    """
    seen, along = terrain_seen(run), directions(run.ends).mean(axis=0)
    looking = along / max(float(np.linalg.norm(along)), 1e-9)
    small = f", reduced from {seen.of:,} triangles to {len(seen.triangles):,}" if seen.of > MOST_TRIANGLES else ""
    maps = maps_seen(run, seen)
    about = caption_of([(each.corners, each.cell) for each in maps], any((each.values == FEW).any() for each in maps))
    caption = (f"Terrain around the rocks{small}. Drag to turn, scroll to zoom; a click on the legend shows or hides "
               f"maps and paths. {about}")  # fmt: skip
    yield Heading("Terrain, paths and hazard")
    view = view_html(run, seen, looking, None if section is None else section.key, maps)
    yield View(view, caption, "The rotatable 3D view is in the HTML file of this report.")
    done: set[str] = set()
    for choices in PICTURES:
        shown = next(((name, words) for name, words in choices if (run.folder / name).is_file()), None)
        if shown is not None and shown[0] not in done:
            name, words = shown
            done.add(name)
            more = _cells_without_energy(run) if name == ENERGY else ""
            yield Picture(_trimmed(run.folder / name), f"{words}{more}", 0.9)
    if notes := run.inputs.get("notes", ()):
        yield Text(" ".join(_as_sentence(note) for note in notes), quiet=True)
    if not (run.folder / "map.png").is_file():
        yield Text("The run wrote no maps (`outputs.pictures` is false).", quiet=True)


def _cells_without_energy(run: RunFiles) -> str:
    """Return a sentence on the reached cells without an energy: too few rocks reached them; "" without such cells."""
    reached, energy = read_hazard(run, "reach_probability"), read_hazard(run, "energy_j", "p95")
    if reached is None:
        return ""
    cells = np.isfinite(reached.values)
    without = int(cells.sum()) if energy is None else int((cells & ~np.isfinite(energy.values)).sum())
    if not without:
        return ""
    of = int(cells.sum())
    return (f" A cell needs {FEWEST_ROCKS} rocks: {without:,} of the {of:,} cells that rocks reached have no value. "
            "That does not mean that they are safe; fly more rocks to fill them."
            f"{_filling(run, reached) if 2 * without > of else ''}")  # fmt: skip


def _filling(run: RunFiles, reached: HazardGrid) -> str:
    """Return a sentence with a number of rocks, and a cell size, that would give half of the reached cells an energy.

    The number of rocks is a lower bound, because more rocks also reach more cells.

    reached : the map of the reach probability
    """
    flown = int(run.summary["rocks"])
    row, column = np.nonzero(np.isfinite(reached.values))
    rocks = np.rint(reached.values[row, column] * flown).astype(np.int64)
    cells = ReachedCells(column, row, rocks, cell=reached.cell, widest=reached.cell * max(reached.values.shape))
    size = filling_cell(cells, share_of_cells)
    larger = "no larger cell fills half of them" if size is None else f"`hazard.cell: {size:g}` fills half of them"
    return (f" More than {rocks_that_fill(cells, flown):,} rocks are needed to fill half of them, because more rocks "
            f"also reach more cells; {larger}.")  # fmt: skip


def _trimmed(path: Path) -> bytes:
    """Return a picture of the run as PNG without its white margin."""
    from rpf3d_core.results.plots.trimmed import trimmed  # imported late, because it imports matplotlib

    return trimmed(path)


def _benches(run: RunFiles) -> Iterator[Element]:
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


def _caught(run: RunFiles) -> str:
    """Return a sentence that zones count rocks caught by barriers as retained; "" if no barrier caught a rock."""
    return f" {_as_sentence(CAUGHT_COUNT)}" if run.summary["outcomes"].get("caught", {}).get("rocks") else ""
