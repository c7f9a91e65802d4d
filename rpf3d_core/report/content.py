"""Assemble the content of a report from the result folder of a run: warnings first, limits and sign-off last."""

from rpf3d_core.report.answer_part import answer_part, benches_part
from rpf3d_core.report.distances_part import distances_part
from rpf3d_core.report.elements import Bullets, Element, Heading, SignOff, Table, Warnings
from rpf3d_core.report.fences_part import barriers_on_faces, fences_part
from rpf3d_core.report.inputs_part import inputs_part
from rpf3d_core.report.pictures_part import pictures_part
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.section import critical_section
from rpf3d_core.report.section_part import section_part
from rpf3d_core.report.segments import segments_of
from rpf3d_core.report.source_places import fence_places
from rpf3d_core.report.source_toes import source_toes
from rpf3d_core.report.warnings_part import warnings_of
from rpf3d_core.report.words import UNKNOWN

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
    warnings = list(warnings_of(run, beyond, steep))
    return [
        Heading(f"Rockfall report: {site}", 1),
        *([Warnings("Read first", warnings)] if warnings else []),
        _run_facts(run, site),
        *answer_part(run, toes),
        *pictures_part(run, section),
        *section_part(run, toes, section),
        *benches_part(run),
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
