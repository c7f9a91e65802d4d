"""Make the sentences under "less certain than it looks": why results of a run look more certain than they are."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.hazard.benches import AREA, bench_table, in_percent, share_text
from rpf3d_core.hazard.by_source.each_source import worst_benches
from rpf3d_core.hazard.filled_cells import filling_cell, reached_cells
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.results.calibration_folder import FOUND
from rpf3d_core.results.findings import Run
from rpf3d_core.setup.coverage import covered_share
from rpf3d_core.setup.warnings.placement import WHOLE
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Outcome

FEW_PATHS = 20
"""A sentence is shown if rocks fly along fewer different paths than this number; further rocks only repeat paths."""
HARDLY_FELL = 2.0
"""A stopped rock hardly fell if its drop from release to end is below this (m), for example behind a bench's crest."""
MANY_BEHIND = 0.2
"""A sentence is shown if more than this share (-) of the rocks of a source hardly fell (HARDLY_FELL)."""
MOSTLY_THIN = 0.5
"""A sentence is shown if more than this share (-) of the visits of rocks to map cells is in cells with few rocks.

A cell has few rocks if fewer than 20 rocks reached it.
"""
NOTABLE = 0.5
"""A sentence is shown if the misfit of the calibration (m) is at least this large."""
MANY_LEFT = 0.01
"""A sentence is shown if more than this share (-) of the rocks flew past the edge of the terrain, or did not finish."""
UNFINISHED = {
    Outcome.MAX_TIME: "were still moving at `max_time`",
    Outcome.MAX_IMPACTS: "reached `max_impacts`",
    Outcome.UNRESOLVED_CONTACT: "were still in motion when their bounces had died out",
    Outcome.FAILED: "failed",
    Outcome.FELL_THROUGH: "were found below the ground, a fault of rpf3d",
}
"""Words for outcomes of rocks that end before they stop or leave the terrain."""
SIDE, PARTS = 25.0, 40
"""Smallest width (m) of the squares in which rocks that left the terrain are counted, to name one place.

On a large terrain, the width is one of PARTS parts of its larger extent.
"""
NAMED = 3
"""Largest number of places or unknowns that a sentence names."""
SOME_ELSEWHERE = 0.05
"""Smallest share (-) of the rocks that start far from the place of the calibration for a sentence on these rocks.

The ground then counts as calibrated elsewhere.
"""
ELSEWHERE_HELD = "0, 1, 2 and 2 of 18 and 9, 33, 40 and 40 of 41"
"""Numbers of observed stops within the 90 % intervals that the calibration sample of another slope predicted.

There are eight cases: four with 18 observed stops, and four with 41.

docs/explanation/validation.md states the same figures; test/validation/test_predictions.py compares them.
"""
OF_ANOTHER_SLOPE = (
    f"Samples of another slope held {ELSEWHERE_HELD} observed stops in eight cases (90 % intervals along the slope, "
    "without misfit): take ranges of the library, or calibrate here"
)
"""Sentence on how well samples of another slope predict, for the table of a run and for alerts."""
MISFIT_HELD = (
    "predictive intervals of shares of zones and areas, of their p95 energies, of the runout and of reach probability "
    "hold the misfit of the model: the paths of each parameter set are displaced by a draw of it"
)
"""Sentence of summary.json on the intervals that include the misfit."""
MISFIT_LEFT_OUT = "the misfit of the model, a distance that says nothing about this number"
"""Text in summary.json at a predictive interval that does not include the misfit."""

MISFIT_LEFT_OUT_AT_BARRIERS = "the misfit of the model, because paths at barriers are not displaced by it"
"""Text in summary.json at the predictive intervals of a barrier, which do not include the misfit."""


def surer_than_it_may_be(run: Run) -> list[str]:
    """Return the reasons why the results of a run look more certain than they are, as sentences; [] without reasons."""
    return [
        *_of_the_ground(run), *_of_the_edge(run), *_of_the_unfinished(run), *_of_places(run), *_of_areas(run),
        *_of_barriers(run), *_of_paths(run), *_of_releases(run), *_of_cells(run), *_of_energies(run),
    ]  # fmt: skip


def _of_the_ground(run: Run) -> Iterator[str]:
    """Yield sentences on coefficients of the ground that are assumed or not calibrated on this slope.

    Further sentences are on the misfit, the warnings of the calibration, and parameter sets that have not flown.
    """
    spec = run.scene.unknowns
    if not run.scene.has_unknowns or spec is None:
        yield ("every coefficient counts as known, so no interval includes the uncertainty of the ground; "
               "give ranges with `library` or `prior`")  # fmt: skip
    elif spec.sample is None:
        yield "ranges of the ground are from books or estimates, not from a calibration on this slope"
    elif ranges := _outside_sample(run):
        yield (f"ranges of {_named(ranges)} are from books or estimates, because the sample of the "
               "calibration does not have them")  # fmt: skip
    if (share := share_calibrated_elsewhere(run)) >= SOME_ELSEWHERE:
        yield (f"{100 * share:.0f} % of the rocks start away from the place where the sample was calibrated. "
               f"{OF_ANOTHER_SLOPE}")  # fmt: skip
    if run.scene.has_unknowns and (known := _counted_as_known(run)):
        yield (f"{_named(known)}: one value in all parameter sets, so no interval includes its "
               "uncertainty; give a range with `prior`")  # fmt: skip
    if run.scene.has_unknowns and spec is not None and spec.misfit is not None and spec.misfit >= NOTABLE:
        yield (f"the calibration found that observed stops differ from the model's by {spec.misfit:.1f} m (standard "
               "deviation) beyond its own spread: predictive intervals of shares, runout and reach probability "
               "include this misfit; those of speed, height, outcomes and barriers do not")  # fmt: skip
    if spec is not None and spec.sample is not None and spec.misfit is None:
        yield ("the sample states no misfit: how far the model is wrong is in no interval, so all of them are too "
               "narrow where the model is poor")  # fmt: skip
    if spec is not None and spec.sample is not None:
        yield from _of_the_calibration(spec.sample)
    if (figures := run.maps.sets) is not None and not figures.enough_flown:
        flown = f"{figures.flown} of {len(figures.sets)} parameter sets"
        if run.totals.rocks < run.planned:
            yield f"the run was stopped after {flown}: predictive intervals are not known; let the run end"
        else:
            yield (f"only {flown} have flown: predictive intervals are not known; fly at least {FEWEST_ROCKS} rocks "
                   "for each set")  # fmt: skip


def _of_the_calibration(sample: Path) -> Iterator[str]:
    """Yield a sentence with the first warnings of the calibration that wrote a sample file.

    The warnings are read from calibration.json in the folder of the sample. No sentence is yielded if the calibration
    has no warnings, or if this file cannot be read. If the file has no list of warnings, a sentence states this.
    """
    try:
        found = json.loads((sample.parent / FOUND).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return  # the sample file is not in the folder of a calibration
    warnings = found.get("warnings") if isinstance(found, dict) else None
    if not isinstance(warnings, list):
        yield "the warnings of the calibration of the sample are not known: its calibration.json does not list them"
    elif warnings:
        more = f"; {len(warnings) - NAMED:,} more in report.md next to the sample" if len(warnings) > NAMED else ""
        yield f"the calibration of the sample warned: {'; '.join(map(str, warnings[:NAMED]))}{more}"


def share_calibrated_elsewhere(run: Run) -> float:
    """Return the share (-) of the rocks that start far from the place of the calibration; 0 without a sample."""
    if run.scene.unknowns is None or run.scene.unknowns.sample is None:
        return 0.0
    from rpf3d_core.setup import unknowns  # imported only if the scene has a sample

    releases = run.flights.deposits.release[:, :2] + np.array(run.terrain.frame.origin[:2])
    return unknowns.share_calibrated_elsewhere(run.scene, releases)


def _outside_sample(run: Run) -> tuple[str, ...]:
    """Return the key paths of the scene's priors for which the sample has no values; empty without a sample."""
    from rpf3d_core.setup.unknowns import outside_sample  # imported only if the scene has unknowns

    return outside_sample(run.scene)


def _counted_as_known(run: Run) -> list[str]:
    """Return the key paths of the ground's coefficients that have the same value in all parameter sets."""
    from rpf3d_core.setup.unknowns import counted_as_known  # imported only if the scene has unknowns

    return counted_as_known(run.scene, run.terrain.zones)


def _of_the_edge(run: Run) -> Iterator[str]:
    """Yield a sentence if many rocks flew past the edge of the terrain: how many, where most of them, and what to do.

    The place is that of the rocks to display, which are some of all rocks in a large run.
    """
    rocks, left = run.totals.rocks, run.totals.outcomes[Outcome.LEFT_TERRAIN]
    deposits, frame = run.flights.deposits, run.terrain.frame
    ends = deposits.x[deposits.outcome == Outcome.LEFT_TERRAIN]
    if left <= MANY_LEFT * rocks or not len(ends):
        return
    extent = float(np.ptp(run.terrain.vertices[:, :2], axis=0).max())
    place, share = busiest_place(ends, max(SIDE, extent / PARTS))
    x, *middle, last = frame.points_to_input(place).tolist()
    where = f"E {x:,.0f}, N {middle[0]:,.0f}" if frame.up == "z" else f"x {x:,.0f}, z {last:,.0f}"
    yield (f"{left:,} of {rocks:,} rocks flew past the edge of the terrain, so nothing is known about where they stop; "
           f"{in_percent(share, 0)} % of them did near {where}. Take a terrain that reaches farther")  # fmt: skip


def _of_the_unfinished(run: Run) -> Iterator[str]:
    """Yield a sentence on each outcome of many rocks that did not stop, and did not leave the terrain either."""
    rocks = run.totals.rocks
    for outcome, words in UNFINISHED.items():
        if (number := run.totals.outcomes[outcome]) > MANY_LEFT * rocks:
            yield (f"{number:,} of {rocks:,} rocks {words}: they may go on, so shares of rocks that reach zones and "
                   "areas may be too small")  # fmt: skip


def busiest_place(points: FloatArray, side: float) -> tuple[FloatArray, float]:
    """Return the place (3,) m where most of the points (N, 3) m lie, and the share (-) of the points there.

    The plan is divided into squares of the width `side` (m). Of the square with most points, the place is the point
    closest to the mean of its points.
    """
    _, square, count = np.unique(np.floor(points[:, :2] / side), axis=0, return_inverse=True, return_counts=True)
    inside = points[square.ravel() == count.argmax()]
    return inside[np.linalg.norm(inside - inside.mean(axis=0), axis=1).argmin()], len(inside) / len(points)


def _of_places(run: Run) -> Iterator[str]:
    """Yield a sentence on zones and areas that rocks reached, but whose retained share has no predictive interval."""
    if run.maps.sets is None or not run.maps.sets.enough_flown:
        return
    from rpf3d_core.unknowns.predictive import ENOUGH  # imported only if the scene has unknowns

    few = [bench.name for bench in worst_benches(run.terrain, run.maps)
           if bench.reached["rocks"] and bench.retained["predictive"] is None]  # fmt: skip
    if few:
        yield (f"the predictive interval of the retained share in {_named(few)} is not known: fewer than {ENOUGH} "
               "parameter sets sent a rock there")  # fmt: skip


def _of_areas(run: Run) -> Iterator[str]:
    """Yield a sentence on each area of interest partly off the terrain or over a hole, if rocks left the terrain.

    Such a rock may have reached the part of the area that is not in the survey.
    """
    left = run.totals.outcomes[Outcome.LEFT_TERRAIN] + run.totals.outcomes[Outcome.LOST_TO_HOLE]
    together = " of all sources together" if len(run.prepared.sources) > 1 else ""
    if not left:
        return
    for area in (bench for bench in bench_table(run.terrain, run.maps) if bench.kind == AREA):
        covered = covered_share(run.terrain, run.prepared.polygons[area.name])
        if covered < WHOLE:
            most = share_of(min(area.reached["rocks"] + left, run.maps.flown), run.maps.flown)
            yield (
                f"only {100.0 * covered:.0f} % of {area.name} (area) lies on the terrain: with the {left:,} rocks that "
                f"left the terrain, up to {share_text(most)} of the rocks{together} may reach it, not "
                f"{share_text(area.reached)}"
            )


def _of_barriers(run: Run) -> Iterator[str]:
    """Yield sentences on barriers that rocks reached, but whose figures have no predictive interval.

    The first sentence is about shares, the second about p95 energies and heights. Without parameter sets, there are no
    sentences.
    """
    sets = run.maps.sets
    if sets is None:
        return
    from rpf3d_core.unknowns.predictive import ENOUGH  # imported only if the scene has unknowns

    came = [(one.name, band) for one, band in zip(run.maps.barriers, sets.barriers, strict=True) if one.came]
    without_shares = [name for name, band in came if np.isnan(band["caught"]).any()]
    without_p95 = [name for name, band in came if np.isnan([*band["energy"], *band["height"]]).any()]
    for names, what, rocks in (
        (without_shares, "shares", "a rock"), (without_p95, "p95 energies and heights", f"{FEWEST_ROCKS} rocks")
    ):  # fmt: skip
        if names:
            yield (f"intervals of {what} at {_named(names)} (barrier) hold the number of rocks only, not what is not "
                   f"known about the ground: fewer than {ENOUGH} parameter sets sent {rocks} there")  # fmt: skip


def _of_paths(run: Run) -> Iterator[str]:
    """Yield a sentence if the rocks of a run have fewer than FEW_PATHS different paths, so that paths repeat."""
    deposits = run.flights.deposits
    rocks = len(deposits.x)
    paths = len(np.unique(np.column_stack([deposits.x, deposits.t, deposits.max_speed]), axis=0)) if rocks else 0
    if 0 < paths < min(FEW_PATHS, rocks):
        which = "one path" if paths == 1 else f"{paths} paths"
        yield (f"the rocks fly along {which}, because nothing else differs between them: more rocks add nothing, and "
               "intervals of shares are too narrow; add a spread, distributions or roughness")  # fmt: skip


def _of_releases(run: Run) -> Iterator[str]:
    """Yield a sentence for each source with many rocks that stopped near the height of their release.

    This happens if the source lies on level ground behind a crest. See `behind_a_crest`.
    """
    yield from behind_a_crest(run.flights.deposits, [source.name for source in run.prepared.sources])


def behind_a_crest(deposits: Deposits, names: Sequence[str], rocks: str = "rocks") -> Iterator[str]:
    """Yield a sentence for each source with many rocks that hardly fell, because the source lies behind a crest.

    A source is reported if more than the share MANY_BEHIND of its rocks stopped less than HARDLY_FELL (m) below the
    release. Sources are judged singly, because the share of all rocks would hide one such source. At most NAMED sources
    have a sentence; a last sentence states the number of further sources.

    names : names of the sources; rocks : the word for rocks in the sentences, in the plural
    """
    if not names:  # a program released the rocks itself, without sources
        return
    drop = deposits.release[:, 2] - deposits.x[:, 2]
    stayed = (deposits.outcome == Outcome.STOPPED) & (drop < HARDLY_FELL)
    of, behind = (np.bincount(rows, minlength=len(names)) for rows in (deposits.source, deposits.source[stayed]))
    found = np.flatnonzero(behind > MANY_BEHIND * of)
    for number in found[:NAMED].tolist():
        yield (f"{_all_or_some(int(behind[number]), int(of[number]), rocks)} of source {names[number]!r} stopped less "
               f"than {HARDLY_FELL:g} m below their release, as behind a crest: shares of all rocks count them as "
               "safe; move the source to where rocks fall")  # fmt: skip
    if len(found) > NAMED:
        yield (f"further sources with rocks that stopped less than {HARDLY_FELL:g} m below their release: "
               f"{len(found) - NAMED}")  # fmt: skip


def _all_or_some(some: int, of: int, rocks: str) -> str:
    """Return a number of rocks as text: "all 200 rocks", "150 of 200 rocks" or "the only rock".

    A share in per cent is avoided, because it may round to 100 %.

    some : number of rocks meant; of : number of all rocks; rocks : the word for rocks, in the plural
    """
    if of == 1:
        return f"the only {rocks.removesuffix('s')}"
    return f"{'all ' if some == of else f'{some:,} of '}{of:,} {rocks}"


def _of_cells(run: Run) -> Iterator[str]:
    """Yield a sentence if most visits of the map are in cells with too few rocks for a percentile."""
    cells = run.maps.cells
    visits = int(cells.rocks.sum(dtype=np.int64))
    thin = int(cells.rocks[cells.rocks < FEWEST_ROCKS].sum(dtype=np.int64))
    if visits and thin > MOSTLY_THIN * visits:
        size = filling_cell(reached_cells(run.maps))
        advice = "fly more rocks" if size is None else f"fly more rocks or set `hazard.cell: {size:g}`"
        yield (f"cells of {run.maps.raster.cell:g} m are finer than the rocks fill: fewer than {FEWEST_ROCKS} rocks "
               f"came to most; {advice}")  # fmt: skip


def _of_energies(run: Run) -> Iterator[str]:
    """Yield a sentence on zones and areas without a p95 energy, because too few rocks reached them."""
    few = [bench for bench in bench_table(run.terrain, run.maps) if 0 < bench.reached["rocks"] < FEWEST_ROCKS]
    if few:
        names = [f"{bench.name} (area)" if bench.kind == AREA else bench.name for bench in few]
        yield f"energies in {_named(names)} are unknown: fewer than {FEWEST_ROCKS} rocks reached them"


def _named(names: Sequence[str]) -> str:
    """Return the first names as text, at most NAMED of them, and the number of further names."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{', '.join(names[:NAMED])}{more}"
