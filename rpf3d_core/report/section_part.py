"""Make the part of a report on the critical section: a vertical section through the release of one rock.

This rock stopped farthest from its release. The part states the place of the section and has its picture, which
includes the barriers that cross the section. A note below the picture names all other barriers of the scene.
"""

import io
from collections.abc import Iterator

import numpy as np

from rpf3d_core.formats.words import whole_degrees
from rpf3d_core.report.elements import Element, Heading, Picture, Text
from rpf3d_core.report.passing import shares_beyond
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.section import CriticalSection
from rpf3d_core.report.section_fences import fences_in
from rpf3d_core.report.source_toes import SourceToes, farthest
from rpf3d_core.report.toe import DESIGN, FAR, BeyondToe, held_beyond
from rpf3d_core.report.words import metres

OBLIQUE = 15.0
"""Largest angle (degrees) between the section and the direction in which its faces fall, without a sentence on it.

At this angle, berms look 4 % wider than they are.
"""
UNKNOWN_PATH = " The result does not have the path of this rock: run the scene again to draw it."


def section_part(run: RunFiles, toes: SourceToes, section: CriticalSection | None) -> Iterator[Element]:
    """Yield the elements on the critical section: its place, its picture, and the names of barriers not in the picture.

    With several sources, the shares of rocks that pass each distance are those of the source whose rocks stop clearly
    farther than all rocks, if there is one.

    toes : the distances beyond the toe; section : None if no rock stopped away from its release
    """
    yield Heading("Critical section")
    if section is None:
        yield Text("Not known: no rock stopped away from its release.")
        return
    (east, north), (source, rock, _) = section.start.tolist(), section.key
    known = ", and the path of this rock" if section.path is not None else ""
    yield Text(f"The section goes through E {east:,.1f}, N {north:,.1f}, where the rock started that stopped farthest "
               f"from its release (rock {rock} of source {source}, runout {metres(section.runout)}). Its "
               f"azimuth, {whole_degrees(section.azimuth)}, is the mean of the rocks that start there. It shows the "
               f"paths in a strip of {section.width:.0f} m{known}, projected onto the section: a path that "
               f"enters or leaves the strip begins or ends there.{'' if known else UNKNOWN_PATH}")  # fmt: skip
    if words := words_on_obliquity(section):
        yield Text(words)
    if unstopped := sum(run.unstopped.values()):
        yield Text(f"The choice of the section leaves out the {unstopped:,} rocks that did not stop on the terrain: "
                   "they may go farther than this rock.")  # fmt: skip
    fences, elsewhere = fences_in(run, section)
    above = "the ground, the paths and the barriers" if fences else "the ground and the paths"
    far = farthest(toes, DESIGN)
    whose, intervals = toes.name_of(far), "both intervals" if run.sets else "the sampling interval"
    yield Picture(_section_png(run, toes.of_source(far), section, whose),
                  f"Above: {above} in the section. Below: rocks{f' from {whose}' if whose else ''} of all sections "
                  f"that pass a distance, with {intervals}.")  # fmt: skip
    if elsewhere:
        yield Text(f"Barriers of the scene that the picture leaves out: {', '.join(elsewhere)}. They do not cross the "
                   "section, or the file of their line cannot be read any more.", quiet=True)  # fmt: skip


def words_on_obliquity(section: CriticalSection) -> str:
    """Return a sentence on a section that crosses its faces obliquely, by more than OBLIQUE (15 degrees); else "".

    The result is also "" for a section without faces.
    """
    if not section.obliquity > OBLIQUE:  # also if the obliquity is not known
        return ""
    return (f"Its faces fall towards {whole_degrees(section.downhill)}: the section crosses them at an angle, so they "
            "look flatter and berms wider than they are.")  # fmt: skip


def _section_png(run: RunFiles, beyond: BeyondToe, section: CriticalSection, source: str) -> bytes:
    """Return a picture (PNG): above, the critical section; below, the share of rocks that pass each distance.

    beyond : how far the rocks of one source, or all rocks, moved beyond the toe; source : its name, "" for all rocks
    """
    from rpf3d_core.results.plots.section import SectionDrawing, section_figure

    zero = section.toe if np.isfinite(section.toe) else 0.0
    at = np.linspace(0.0, max(float(section.distance[-1] - zero), 1.0), 120)
    shares = shares_beyond(beyond, run.sets, at) if len(beyond.rows) else []
    predictive = [figure.predictive for figure in shares]
    held = held_beyond(beyond, run.sets, DESIGN).value
    figure = section_figure(SectionDrawing(
        distance=section.distance - zero, ground=section.ground, paths=[path - (zero, 0.0) for path in section.paths],
        path=None if section.path is None else section.path - (zero, 0.0),
        held=held if held is not None and held < FAR else None, at=at if shares else np.empty(0),
        passed=np.array([figure.value for figure in shares], dtype=float),
        sampling=np.array([figure.sampling for figure in shares], dtype=float).reshape(-1, 2).T,
        predictive=None if not shares or None in predictive else np.array(predictive, dtype=float).T,
        origin="the toe of the first face" if np.isfinite(section.toe) else "the release",
        fences=[fence._replace(distance=fence.distance - zero) for fence in fences_in(run, section)[0]],
        source=source,
    ))  # fmt: skip
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=150)
    return content.getvalue()
