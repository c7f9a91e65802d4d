"""Report on a study of the thesis: which of the differences that the thesis found with 21 rocks rpf3d confirms.

The mesh of the thesis is not public, so the study is repeated on the synthetic pit. Therefore signs and sizes of the
differences can be compared, but not the shares.
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
"""Number of rocks in a run of the thesis.

The thesis states 20, but its printed 4, 19, 23, 28, 38, 43 and 57 % are all multiples of 1 / 21, rounded or cut off to
a whole percent.
"""
ON_A_BENCH = 1.0
"""A rock counts as on a bench down to this depth (m) below the altitude of the bench.

The relief of a bench is a few decimetres.
"""
SPILL = "spill"
NOT_SEEN = "no rock stops there"


class ThesisColumn(NamedTuple):
    """One column of the thesis' table: the counts of the thesis, and the counts of rpf3d for comparison.

    printed : the printed column; thesis_a, thesis_b : counts of run A and run B of the thesis, out of 21 rocks
    a, b, part : counts of rocks that stopped in the column's zones, in run A, run B and the third run of rpf3d; rocks
        on a spill count for the bench below
    """

    printed: Printed
    thesis_a: Counted
    thesis_b: Counted
    a: Counted
    b: Counted
    part: Counted | None = None

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval (-) of the difference B - A in the runs of rpf3d."""
        return newcombe_interval(*self.b, *self.a)

    @property
    def thesis_interval(self) -> tuple[float, float]:
        """The 95 % interval (-) of the difference B - A in the thesis, computed for 21 rocks in each run."""
        return newcombe_interval(*self.thesis_b, *self.thesis_a)

    @property
    def change(self) -> float:
        """The difference B - A (-) of the shares in the runs of rpf3d."""
        return self.b.share - self.a.share

    @property
    def thesis_change(self) -> float:
        """The difference B - A (-) of the shares in the thesis."""
        return self.thesis_b.share - self.thesis_a.share

    @property
    def half_width_of_21(self) -> float:
        """The uncertainty (-) that rpf3d's difference B - A would have if each run had only 21 rocks.

        The uncertainty is half the width of the 95 % interval in the normal approximation.
        """
        variance = sum(one.share * (1.0 - one.share) / ROCKS_OF_THESIS for one in (self.a, self.b))
        return NORMAL_QUANTILE_95 * math.sqrt(variance)

    @property
    def verdict(self) -> str:
        """A phrase that states whether the runs of rpf3d confirm the difference in the thesis."""
        if self.a.rocks == self.b.rocks == 0:
            return NOT_SEEN
        if self.thesis_change == 0.0 and _excludes_0(self.interval):
            return "a difference, where the thesis has none"
        if not _excludes_0(self.interval):
            return "no difference"
        return "holds in sign" if self.change * self.thesis_change > 0.0 else "reversed"


class Report(NamedTuple):
    """The report on a study: the thesis' table with the counts of rpf3d, and the comparisons of the rpf3d runs.

    findings : the columns of the thesis' table; comparison : comparison of run A and run B
    part : comparison of run A and the run that changes only the coefficients of the spills; None without such a run
    """

    study: Study
    findings: tuple[ThesisColumn, ...]
    comparison: Comparison
    part: Comparison | None


def report_of(study: Study, folders: Sequence[Path]) -> Report:
    """Return the report on a study; folders : result folders of its runs, in the order of `runs_of`.

    Raises
    ------
    InputError
        As `compare.compare_runs`.
    """
    comparison = compare_runs(*folders[:2])
    part = compare_runs(folders[0], folders[2]) if study.part else None
    stops = [stops_in_pit(folder, scene) for folder, scene in zip(folders, scene_files(study), strict=True)]
    a, b, *in_part = stops
    findings = (
        ThesisColumn(
            printed=printed,
            thesis_a=_of_21(printed.a),
            thesis_b=_of_21(printed.b),
            a=_stopped_in(printed, a),
            b=_stopped_in(printed, b),
            part=_stopped_in(printed, in_part[0]) if in_part else None,
        )
        for printed in study.printed
    )
    return Report(study=study, findings=tuple(findings), comparison=comparison, part=part)


def stops_in_pit(folder: Path, scene: Path) -> Counter[str]:
    """Return the number of rocks that stopped in each zone of the pit; a rock on a spill counts for the bench below it.

    The thesis counts in the same way: it states that 14 % of the rocks stopped on spills, and yet the shares of all
    other areas sum to 98 %.

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
    """Return the name of the highest bench that lies below a rock, or at most ON_A_BENCH (1 m) above the rock.

    altitude : of the rock (m)

    Names count from the top: bench_1 is the first bench below the crest.
    """
    depths = pit.levels[-1] - pit.levels[-2:0:-1]
    return f"bench_{1 + int((depths < pit.crest_altitude - altitude - ON_A_BENCH).sum())}"


def _stopped_in(printed: Printed, stops: Counter[str]) -> Counted:
    return Counted(sum(stops[zone] for zone in printed.zones), stops.total())


def write_report(report: Report, out: Path) -> None:
    """Write comparison.json and comparison.md into the folder of a study.

    Raises
    ------
    InputError
        A file cannot be written.
    """
    text = json.dumps(report_section(report), indent=2, allow_nan=False) + "\n"
    try:
        (out / REPORTS[0]).write_text(text, encoding="utf-8")
        (out / REPORTS[1]).write_text(report_markdown(report), encoding="utf-8")
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault


def verdict_of(report: Report) -> str:
    """Return the conclusion of a study in a few sentences: which differences of the thesis the rpf3d runs confirm."""
    known = [found.printed.area for found in report.findings if _excludes_0(found.thesis_interval)]
    widest = max(half_width(found.thesis_a) for found in report.findings)
    rocks = " and ".join(sorted({f"{facts['rocks']:,}" for facts in (report.comparison.a, report.comparison.b)}))
    return (
        f"With {ROCKS_OF_THESIS} rocks a share is known to within {100 * widest:.0f} points: of the thesis' "
        f"{len(report.findings)} differences {', '.join(known) if known else 'none'} stood out from chance. "
        f"With {rocks} rocks a run on the synthetic pit: {'; '.join(map(_sentence, report.findings))}. "
        "The intervals are those of chance on this one relief: other reliefs of the same pit differ by more "
        "(docs/explanation/studies.md)."
    )


def half_width(counted: Counted) -> float:
    """Return the uncertainty (-) of a share: half the width of its 95 % interval in the normal approximation."""
    return NORMAL_QUANTILE_95 * math.sqrt(counted.share * (1.0 - counted.share) / counted.of)


FINDINGS_HEADER = (
    "stopped in", "thesis A", "thesis B", "thesis B - A in points", "thesis p (Fisher)", "here A", "here B",
    "here B - A in points", "here p", "21 rocks would know it to", "verdict", "spills alone - A",
)  # fmt: skip


def finding_header(report: Report) -> tuple[str, ...]:
    """Return the header of the report's table; only a study with a third run has the last column."""
    return FINDINGS_HEADER if report.part else FINDINGS_HEADER[:-1]


def finding_rows(report: Report) -> list[tuple[str, ...]]:
    """Return the rows of the report's table as text: one for each difference, with the columns of `finding_header`."""
    return [tuple(_finding_row(found)) for found in report.findings]


def report_markdown(report: Report) -> str:
    """Return the report on a study as Markdown: the thesis' table, the conclusion, and the comparison of all zones."""
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
    """Return the report on a study as plain values for JSON; shares and differences are in (-)."""
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
    """Return the count out of 21 rocks that is nearest to a printed percentage of the thesis.

    All printed percentages are shares of 21 rocks, rounded or cut off to a whole percent, except 27 %: the nearest
    count is 6 (28.6 %).
    """
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
