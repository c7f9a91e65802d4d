"""What a study of the thesis comes to: what the thesis printed, what it could know from 21 rocks, what comes out here.

The thesis' percentages are k / 21, and its mesh is not public: here the same comparison is made on the synthetic pit.
So signs and sizes of differences compare, not the shares themselves.
"""

import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.ensemble.statistics import NORMAL_QUANTILE_95
from rpf3d_core.ensemble.two_shares import fisher_p, newcombe_interval, p_value
from rpf3d_core.errors import InputError
from rpf3d_core.results.earlier_results import stops_by_zone
from rpf3d_core.runs.compare import Comparison, Counted, compare_runs, comparison_section, counted_section
from rpf3d_core.runs.compare_tables import markdown_of, markdown_table, p_text, percent, points
from rpf3d_core.runs.thesis import REPORTS, Printed, Study, scene_files
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.pit.parameters import Pit

ROCKS_OF_THESIS = 21
"""The thesis says 20, but 4, 19, 23, 28, 38, 43 and 57 % are all k / 21 (reference, validation 6)."""
ON_A_BENCH = 1.0
"""A spill lies on a bench, whose relief is a few decimetres: its rocks rest at most so far below its level (m)."""
SPILL = "spill"
NOT_SEEN = "no rock stops there"


class ThesisColumn(NamedTuple):
    """One column of the thesis' table, as it was and as it is here.

    thesis_a, thesis_b : what it counted, of 21; a, b, part : what stopped there here, spills counted with their benches
    """

    printed: Printed
    thesis_a: Counted
    thesis_b: Counted
    a: Counted
    b: Counted
    part: Counted | None = None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of B - A here (-)."""
        return newcombe_interval(*self.b, *self.a)

    @property
    def thesis_interval(self) -> tuple[float, float]:
        """95 % interval of B - A with the thesis' number of rocks (-)."""
        return newcombe_interval(*self.thesis_b, *self.thesis_a)

    @property
    def change(self) -> float:
        """B - A here (-)."""
        return self.b.share - self.a.share

    @property
    def thesis_change(self) -> float:
        """B - A in the thesis (-)."""
        return self.thesis_b.share - self.thesis_a.share

    @property
    def half_width_of_21(self) -> float:
        """Half-width of the 95 % interval (normal) that 21 rocks a run would give to the difference found here (-)."""
        variance = sum(one.share * (1.0 - one.share) / ROCKS_OF_THESIS for one in (self.a, self.b))
        return NORMAL_QUANTILE_95 * math.sqrt(variance)

    @property
    def verdict(self) -> str:
        """What the rocks flown here say about the thesis' difference."""
        if self.a.rocks == self.b.rocks == 0:
            return NOT_SEEN
        if self.thesis_change == 0.0 and _excludes_0(self.interval):
            return "a difference, where the thesis has none"
        if not _excludes_0(self.interval):
            return "no difference"
        return "holds in sign" if self.change * self.thesis_change > 0.0 else "reversed"


class Report(NamedTuple):
    """What a study has found."""

    study: Study
    findings: tuple[ThesisColumn, ...]
    comparison: Comparison
    part: Comparison | None


def report_of(study: Study, folders: Sequence[Path]) -> Report:
    """What the results of a study's runs come to, in the order of `runs_of`.

    Raises
    ------
    InputError
        As `compare.compare_runs`.
    """
    comparison = compare_runs(*folders[:2])
    part = compare_runs(folders[0], folders[2]) if study.part else None
    stops = [stops_in_pit(folder, scene) for folder, scene in zip(folders, scene_files(study), strict=True)]
    findings = (
        ThesisColumn(printed, _of_21(printed.a), _of_21(printed.b), *(_stopped_in(printed, some) for some in stops))
        for printed in study.printed
    )
    return Report(study, tuple(findings), comparison, part)


def stops_in_pit(folder: Path, scene: Path) -> Counter[str]:
    """Rocks of a run on the synthetic pit by where they stopped; one on a spill counts with the bench below it.

    The thesis counts so too: 14 % of its rocks stopped on spills, and its areas sum up to 98 % without them.

    Raises
    ------
    InputError
        The scene or the result is damaged, or the scene has no synthetic pit.
    """
    pit = read_scene(scene).terrain.pit
    if pit is None:
        raise InputError(f"{scene}: has no synthetic pit, so where its benches are is not known")
    stops: Counter[str] = Counter()
    for zone, altitude in stops_by_zone(folder):
        stops[_bench_below(pit, altitude) if zone == SPILL else zone] += 1
    return stops


def _bench_below(pit: Pit, altitude: float) -> str:
    """The highest bench that does not lie above an altitude (m); bench_1 is the first below the crest."""
    depths = pit.levels[-1] - pit.levels[-2:0:-1]
    return f"bench_{1 + int((depths < pit.crest_altitude - altitude - ON_A_BENCH).sum())}"


def _stopped_in(printed: Printed, stops: Counter[str]) -> Counted:
    return Counted(sum(stops[zone] for zone in printed.zones), stops.total())


def write_report(report: Report, out: Path) -> None:
    """Write comparison.json and comparison.md into the folder of a study.

    Raises
    ------
    InputError
        They cannot be written.
    """
    text = json.dumps(report_section(report), indent=2, allow_nan=False) + "\n"
    try:
        (out / REPORTS[0]).write_text(text, encoding="utf-8")
        (out / REPORTS[1]).write_text(report_markdown(report), encoding="utf-8")
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault


def verdict_of(report: Report) -> str:
    """What the study says about the thesis' conclusion, in a few sentences."""
    known = [found.printed.area for found in report.findings if _excludes_0(found.thesis_interval)]
    widest = max(half_width(found.thesis_a) for found in report.findings)
    rocks = " and ".join(sorted({f"{facts['rocks']:,}" for facts in (report.comparison.a, report.comparison.b)}))
    return (
        f"With {ROCKS_OF_THESIS} rocks a share is known to within {100 * widest:.0f} points: of the thesis' "
        f"{len(report.findings)} differences {', '.join(known) if known else 'none'} stood out from chance. "
        f"With {rocks} rocks a run on the synthetic pit: {'; '.join(map(_sentence, report.findings))}. "
        "The intervals are those of chance on this one relief: other reliefs of the same pit differ by more "
        "(docs/studies.md)."
    )


def half_width(counted: Counted) -> float:
    """Half-width (-) of a share's 95 % interval by the normal approximation, which is what is quoted for 21 rocks."""
    return NORMAL_QUANTILE_95 * math.sqrt(counted.share * (1.0 - counted.share) / counted.of)


FINDINGS_HEADER = (
    "stopped in", "thesis A", "thesis B", "thesis B - A in points", "thesis p (Fisher)", "here A", "here B",
    "here B - A in points", "here p", "21 rocks would know it to", "verdict", "spills alone - A",
)  # fmt: skip


def finding_header(report: Report) -> tuple[str, ...]:
    """The header of a report's rows."""
    return FINDINGS_HEADER if report.part else FINDINGS_HEADER[:-1]


def finding_rows(report: Report) -> list[tuple[str, ...]]:
    """Rows under FINDINGS_HEADER, of which the last column is for a study with a part only."""
    return [tuple(_finding_row(found)) for found in report.findings]


def report_markdown(report: Report) -> str:
    """The report as Markdown: the thesis' table, the verdict, then every zone."""
    sections = [
        f"# {report.study.title}",
        f"The thesis' table {report.study.table}, read as counts of {ROCKS_OF_THESIS}, and the same here. "
        "A rock on a spill counts with the bench below it.",
        markdown_table(finding_header(report), finding_rows(report)),
        verdict_of(report),
        f"## Every zone\n\n{markdown_of(report.comparison)}",
    ]
    if report.part:
        sections.append(f"## The spills alone: A as above, B with the spills' coefficients only\n\n"
                        f"{markdown_of(report.part)}")  # fmt: skip
    return "\n\n".join(sections)


def report_section(report: Report) -> dict[str, Any]:
    """The report for JSON; shares and differences (-)."""
    return {
        "program": "rpf3d",
        "study": report.study.name,
        "title": report.study.title,
        "thesis_table": report.study.table,
        "verdict": verdict_of(report),
        "findings": [_finding_section(found) for found in report.findings],
        "comparison": comparison_section(report.comparison),
        "spills_alone": comparison_section(report.part) if report.part else None,
    }


def _of_21(percentage: float) -> Counted:
    """A printed percentage as the count that it must have been (27 % fits none: 6 is nearest)."""
    return Counted(round(percentage / 100.0 * ROCKS_OF_THESIS), ROCKS_OF_THESIS)


def _excludes_0(interval: tuple[float, float]) -> bool:
    return not interval[0] <= 0.0 <= interval[1]


def _sentence(found: ThesisColumn) -> str:
    then = f"{100.0 * found.thesis_change:+.0f}"
    if found.verdict == NOT_SEEN:
        return f"{found.printed.area}: {NOT_SEEN} (thesis {then} points)"
    now = points(found.change, found.interval)
    return f"{found.printed.area} {now} points against the thesis' {then}: {found.verdict}"


def _finding_row(found: ThesisColumn) -> Iterator[str]:
    yield found.printed.area
    yield from (f"{one.rocks} of {one.of}" for one in (found.thesis_a, found.thesis_b))
    yield points(found.thesis_change, found.thesis_interval)
    yield p_text(fisher_p(*found.thesis_a, *found.thesis_b))
    yield from (percent(one) for one in (found.a, found.b))
    yield points(found.change, found.interval)
    yield p_text(p_value(*found.a, *found.b))
    yield "-" if found.verdict == NOT_SEEN else f"± {100 * found.half_width_of_21:.0f} points"
    yield found.verdict
    if found.part:
        yield points(found.part.share - found.a.share, newcombe_interval(*found.part, *found.a))


def _finding_section(found: ThesisColumn) -> dict[str, Any]:
    counted = {"thesis_a": found.thesis_a, "thesis_b": found.thesis_b, "a": found.a, "b": found.b}
    part = {} if found.part is None else {"spills_alone": counted_section(found.part)}
    return {
        "area": found.printed.area,
        "zones": list(found.printed.zones),
        "printed_percent": [found.printed.a, found.printed.b],
        **{name: counted_section(one) for name, one in counted.items()},
        **part,
        "thesis_difference": {"share": found.thesis_change, "interval_95": list(found.thesis_interval),
                              "p": fisher_p(*found.thesis_a, *found.thesis_b)},
        "difference": {"share": found.change, "interval_95": list(found.interval),
                       "p": p_value(*found.a, *found.b)},
        "half_width_of_21_rocks": found.half_width_of_21,
        "verdict": found.verdict,
    }  # fmt: skip
