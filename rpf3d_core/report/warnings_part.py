"""The warnings at the top of a report, and its notes, as sentences."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from rpf3d_core.report.changed_inputs import changed_inputs
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.toe import BeyondToe
from rpf3d_core.results.overconfidence import UNFINISHED
from rpf3d_core.terrain.faces import LOWEST, STEEP
from rpf3d_core.values import UNSTOPPED, Outcome

FILE_EXTENSION = re.compile(r"\.[A-Za-z]\w*")
"""Pattern of the extension of a file name, such as .dxf; the decimals of a number do not match."""
NOT_STOPPED = {
    Outcome.LEFT_TERRAIN: "flew past the edge of the terrain",
    Outcome.LOST_TO_HOLE: "fell through holes of the terrain",
    **UNFINISHED,
}
"""Words for the rocks with each outcome of `UNSTOPPED`, after their number."""
if missing := set(UNSTOPPED) - set(NOT_STOPPED):
    raise TypeError(f"no words for the outcomes {missing}")


def warnings_of(run: RunFiles, beyond: BeyondToe, steep: Sequence[str]) -> Iterator[str]:
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
    yield from (as_sentence(warning) for warning in run.inputs["warnings"])
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
        what = "; ".join(f"{unstopped[outcome]:,} {NOT_STOPPED[outcome]}" for outcome in most_first)
        kinds = "rocks and fragments" if broken else "rocks"
        yield (f"{number:,} of {len(run.ends.key) - broken:,} {kinds} did not stop on the terrain ({what}): they count "
               "as stopping farther than every distance.")  # fmt: skip
    if broken := run.ended(Outcome.FRAGMENTED):
        yield (f"{broken:,} rocks broke. In the distances, each of them counts as stopping farther than every "
               "distance, and its fragments count as rocks.")  # fmt: skip


def as_sentence(warning: str) -> str:
    """Return a warning of the run as a sentence with a capital letter and a full stop or question mark.

    If the warning begins with a file name, the first letter is not changed.
    """
    begins = (warning.partition(" ")[0].rstrip(":,"), warning.partition(":")[0])
    is_file = any(FILE_EXTENSION.fullmatch(Path(begin).suffix) for begin in begins)
    return f"{warning[:1] if is_file else warning[:1].upper()}{warning[1:]}{'' if warning.endswith('?') else '.'}"
