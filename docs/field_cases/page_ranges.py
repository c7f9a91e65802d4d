"""The section of docs/explanation/validation.md on predictive intervals of ground that is not known."""

from field_cases.page_tables import Results, table
from field_cases.prose_ranges import BOOKS, CALIBRATED, ELSEWHERE, HEAD, TOO_SURE
from field_cases.ranges import held_of_all

OPEN = 0.05
"""Share of rocks that did not stop (-), from which a 90 % interval has no far end."""


def section(results: Results) -> str:
    """Return the section: ranges of books, calibrations on the same slope, calibrations on another slope."""
    return "\n".join([
        HEAD, BOOKS, _predicted(results["books"]), CALIBRATED, _kept_out(results["calibrations"]), ELSEWHERE,
        _predicted(results["elsewhere"]), TOO_SURE,
    ])  # fmt: skip


def _predicted(lines: list[Results]) -> str:
    """Return the table of predictions: how many of the observed stops their 90 % intervals hold."""
    head = ("site", "rocks", "ground", "held along the slope", "held across", "did not stop (%)", "far end")
    return table(head, (
        (line["site"], line["rocks"], line["ground"], held_of_all(line, "along"), held_of_all(line, "across"),
         f"{100.0 * line['moving']:.0f}", "open" if line["moving"] >= OPEN else "closed") for line in lines
    ))  # fmt: skip


def _kept_out(lines: list[Results]) -> str:
    """Return the table of calibrations: how many stops that a fold kept out their 90 % intervals hold."""
    head = ("site", "rocks", "held along the slope", "held across", "misfit (m)", "with the misfit: along", "across")
    return table(head, ((line["site"], line["rocks"], held_of_all(line, "along"), held_of_all(line, "across"),
                         f"{line['misfit']:.1f}", *(held_of_all({**line, **line["with_misfit"]}, way)
                                                    for way in ("along", "across"))) for line in lines))  # fmt: skip
