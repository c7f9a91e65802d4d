"""Build the section of docs/explanation/validation.md on Tschamut from the file of results."""

from field_cases import page_calibrations, tschamut
from field_cases.models import TSCHAMUT
from field_cases.page_tables import Results, among_sets, interval_of, label, table
from field_cases.predictions import held_of_all
from field_cases.prose import OWN_RELEASE, TSCHAMUT_FAILS
from field_cases.prose import TSCHAMUT as WORDS


def section(results: Results) -> str:
    """Return the section on Tschamut as Markdown."""
    return "\n".join([
        WORDS, "![Tschamut](../pictures/validation_tschamut.png)\n", _runouts(results), OWN_RELEASE,
        page_calibrations.section(TSCHAMUT, results["calibrations"]), TSCHAMUT_FAILS,
    ])  # fmt: skip


def _runouts(results: Results) -> str:
    """Return the table of runouts, for the field, another program, published values and calibrated values."""
    head = ("error of runout (m)", "mean", "mean absolute", "correlation over runs", "sd of runout (m)",
            "lateral sd (m)", "contained along", "across", "not at rest (%)")  # fmt: skip
    field = results["field"]
    return table(head, [
        ("**field, 18 runs**", "", "", "", f"{field['runout_sd']:.1f}", f"{field['side_sd']:.1f}", "", "", ""),
        *((f"another program, {name}", f"{off:+.1f}", *[""] * 7) for name, off in tschamut.OTHER_CODE.items()),
        *map(_line, results["lines"]),
    ])  # fmt: skip


def _line(line: Results) -> tuple[str, ...]:
    over_sets = "over_sets" in line
    mean = (among_sets(line, "error_mean", 0, "+") if over_sets
            else f"{line['error_mean']:+.0f} ({interval_of(line['error_interval'], 0, '+')})")  # fmt: skip
    return (
        label(line), mean, f"{line['error_absolute']:.0f}", f"{line['correlation']:+.2f}",
        among_sets(line, "runout_sd"), among_sets(line, "side_sd"),
        *(held_of_all(line, way) if over_sets else "" for way in ("along", "across")), f"{100 * line['left']:.0f}",
    )  # fmt: skip
