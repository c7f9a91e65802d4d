"""Make the part of a report on places for fences: the rocks that pass each place, and the ground there."""

from collections.abc import Iterator, Sequence

from rpf3d_core.formats.words import whole_degrees
from rpf3d_core.hazard.benches import in_percent
from rpf3d_core.report.barriers_part import BOTH, barriers_part
from rpf3d_core.report.elements import Element, Heading, Table, Text
from rpf3d_core.report.footing import BUILDABLE, Footing
from rpf3d_core.report.passing import FencePlace
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.section_fences import footings_of_barriers
from rpf3d_core.report.segments import FOR_HEIGHTS, IMPACTS, KEPT, MOSTLY, Segments
from rpf3d_core.report.toe import STEP, BeyondToe
from rpf3d_core.report.words import (
    UNKNOWN,
    figure_cells,
    height,
    kilojoules,
    metres,
    share,
    share_interval,
)

SLIDES = (
    "A rock that slid before it left the ground counts with the larger speed of both ends of its way; its height is "
    "not known and counts as larger than all others."
)
HEIGHTS_LEAVE_OUT = (
    "The predictive intervals of heights leave out the misfit of the model; those of rocks that pass and of energies "
    "hold it."
)
NO_IMPACTS = "Fewer than all, because the result has no impacts (`outputs.impacts`)."
FEW_FLIGHTS = (
    f"Kept paths are used where fewer than {in_percent(MOSTLY, 0)} % of the passages are flights between two impacts, "
    "because rocks slide or roll or air slows them: impacts do not show energies and heights there."
)
FEW_HEIGHTS = (
    f"where at most {in_percent(FOR_HEIGHTS, 0)} % of the passages are flights between two impacts: the other heights "
    "are not known from impacts."
)
NOT_STOPPED = (
    "Rocks that did not stop on the terrain, such as rocks lost to holes, count as rocks that pass every place. Where "
    "their path ends before a place, they are not in its energy and height, which may be larger or smaller with them."
)
KEEP_MORE = "`outputs.trajectories` keeps more paths."
OF_WORST = (
    "A row with a source counts the rocks from this source only: clearly more of them pass, or their p95 energy or "
    "height is the largest of all sources and of all rocks together. Known paths are those of the energy."
)
"""Note under the tables of a scene with several sources."""
ALL_ROCKS = "all rocks"
SLIGHT = 0.05
"""Smallest share (-) of a fence's line on steep ground that a report states."""


def from_source(name: str) -> str:
    """Return the source of a figure as text, such as `, from crest`; "" for the empty name, which means all rocks."""
    return f", from {name}" if name else ""


def too_few_toes(beyond: BeyondToe) -> str:
    """Return a sentence that distances beyond the toe are not known, because no rock or only few have a toe."""
    if len(beyond.rows) == 0:
        return "Not known: no face lies below the releases."
    return f"Not known: only {len(beyond.rows):,} of {beyond.of:,} rocks have a face below their release."


def with_barriers(run: RunFiles) -> list[Element]:
    """Return a sentence that the barriers of the scene were in place; [] if no rock came to a barrier."""
    names = [name for name, found in run.summary.get("barriers", {}).items() if found["came"]]
    if not names:
        return []
    return [Text(f"These figures are with the barriers of the scene in place ({', '.join(names)}): a rock that a "
                 "barrier catches ends there, so fewer rocks go farther than without barriers. To design another "
                 "fence, run the scene without them.")]  # fmt: skip


def fences_part(
    run: RunFiles, places: list[FencePlace], choices: list[Segments], beyond: BeyondToe, steep: Sequence[str]
) -> Iterator[Element]:
    """Yield the elements of the report for the design of fences.

    These are tables of the rocks that pass places beyond the toe, tables of the barriers, and notes on steep ground.

    places : the places beyond the toe; empty if too few rocks have a toe
    choices : the possible path segments, from `segments_of`; beyond : the rocks' distances beyond the toe
    steep : a clause on each barrier on a face, from `barriers_on_faces`
    """
    yield Heading("Where a fence would stand")
    if not places:
        yield Text(too_few_toes(beyond))
    else:
        yield from with_barriers(run)
        yield from _fence_tables(run, places, choices)
    if run.summary.get("barriers"):
        yield from barriers_part(run.summary["barriers"], run.summary["rocks"])
    if steep:
        yield Text(f"No fence can be built where the ground is steeper than {BUILDABLE:g} degrees: {'; '.join(steep)}.")


def _fence_tables(run: RunFiles, places: list[FencePlace], choices: list[Segments]) -> Iterator[Element]:
    yield Table(("beyond the toe", "ground there", "rocks that pass", *BOTH), [
        [f"{metres(place.distance)}{from_source(place.passed_of)}", _ground(place.footing), share(place.passed.value),
         share_interval(place.passed.predictive), share_interval(place.passed.sampling)] for place in places
    ])  # fmt: skip
    if faces := [metres(place.distance) for place in places if place.footing.is_on_a_face]:
        yield Text(f"No fence can be built {', '.join(faces)} beyond the toe: the ground there is a face, steeper than "
                   f"{BUILDABLE:g} degrees. Figures of these places only show how the rocks go on.")  # fmt: skip
    header = ("beyond the toe", "known paths", "p95 energy", *BOTH, "p95 height", *BOTH)
    yield Table(header, [
        [_place(place), f"{place.crossed:,}", *figure_cells(place.energy, kilojoules),
         *figure_cells(place.height, height)] for place in places
    ])  # fmt: skip
    if any(place.passed_of or place.energy_of or place.height_of for place in places):
        yield Text(OF_WORST, quiet=True)
    yield Text(f"Energies (translational) and heights (of the centre) at the first passage, "
               f"{_from(run, places, choices)} Not known for fewer than 20 rocks. At an impact within {STEP:g} m of a "
               f"place, the larger of the energies before and after it counts. Known paths: number of rocks that pass "
               "and whose path is known at the place.", quiet=True)  # fmt: skip
    if not run.ends.at_rest.all():
        yield Text(NOT_STOPPED)
    if run.moves is not None:
        yield Text(HEIGHTS_LEAVE_OUT, quiet=True)


def _from(run: RunFiles, places: list[FencePlace], choices: list[Segments]) -> str:
    """Return text that names the data behind the energies and heights: impacts, kept paths or both.

    The text completes a sentence that the caller begins; further sentences give the reason.

    choices : the possible path segments, from `segments_of`
    """
    rocks, used = run.summary["rocks"], {place.source for place in places}
    count = {each.source: f"{each.rocks:,} of {rocks:,} rocks" for each in choices}
    kept = ", ".join(metres(place.distance) for place in places if place.source == KEPT)
    heights = [place for place in places if place.source == IMPACTS and place.height_source == KEPT]
    more = ""
    if heights:
        distances = ", ".join(metres(place.distance) for place in heights)
        more = f" Heights for {distances} are from {KEPT} ({count[KEPT]}), {FEW_HEIGHTS}"
    if len(used) > 1:
        return (f"from {IMPACTS} ({count[IMPACTS]}), and for {kept} from {KEPT} ({count[KEPT]}).{more} {SLIDES} "
                f"{FEW_FLIGHTS} {KEEP_MORE}")  # fmt: skip
    if used == {IMPACTS}:
        return f"from {IMPACTS}: {count[IMPACTS]}.{more} {SLIDES}{f' {KEEP_MORE}' if heights else ''}"
    why = f" {FEW_FLIGHTS if len(choices) > 1 else NO_IMPACTS} {KEEP_MORE}"
    return f"from {KEPT}: {count[KEPT]}.{why if choices[-1].rocks < rocks else ''}"


def _place(place: FencePlace) -> str:
    """Return the distance of a place beyond the toe as text, with the sources of energy and height.

    A mark follows if no fence can be built there.
    """
    energy, high = place.energy_of or ALL_ROCKS, place.height_of or ALL_ROCKS
    each = f", energy from {energy}, height from {high}" if energy != high else from_source(place.energy_of)
    return f"{metres(place.distance)}{' (on a face)' if place.footing.is_on_a_face else ''}{each}"


def _ground(footing: Footing) -> str:
    """Return as text the slope of the ground where a fence would stand, and the share of the fence's line on a face."""
    if footing.steep is None or footing.slope is None:
        return UNKNOWN
    slope = whole_degrees(footing.slope)
    if footing.is_on_a_face:
        return f"face of {slope}"
    return slope if footing.steep < SLIGHT else f"{slope}; {in_percent(footing.steep, 0)} % on a face"


def barriers_on_faces(run: RunFiles) -> list[str]:
    """Return a clause for each barrier that stands on a face with at least the share SLIGHT of its line."""
    footings = footings_of_barriers(run).items()
    return [f"the barrier {name} is on a face for {in_percent(footing.steep, 0)} % of its line"
            for name, footing in footings if footing.steep is not None and footing.steep >= SLIGHT]  # fmt: skip
