"""Build the section of docs/explanation/validation.md on Tschamut from the file of results."""

from collections.abc import Sequence

from field_cases import tschamut
from field_cases.page_tables import Results, halves_table, interval_of, label, mean_and_sd_of, searched, table
from field_cases.prose import TSCHAMUT, TSCHAMUT_FAILS


def section(results: Results) -> str:
    """Return the section on Tschamut as Markdown."""
    field, bar = results["field"], tschamut.OTHER_CODE
    head = ("runout, simulated minus observed (m)", "mean", "mean absolute", "correlation over runs",
            "mean end off (m)", "not at rest (%)")  # fmt: skip
    rows = [
        *((f"another program, {name}", f"{value:+.1f}", *[""] * 4) for name, value in bar.items()),
        *((label(line), f"{line['error_mean']:+.1f} ({interval_of(line['error_interval'], 0, '+')})",
           f"{line['error_absolute']:.1f}",
           f"{line['correlation']:+.2f}", f"{line['end_off']:.1f}", f"{100 * line['left']:.0f}")
          for line in results["lines"]),
    ]  # fmt: skip
    halves = halves_table(results, ("all 17 distinct runs", "first half, 9", "second half, 8"))
    picture = "![Tschamut](../pictures/validation_tschamut.png)\n"
    return "\n".join([
        TSCHAMUT, searched(results["calibrations"]), picture, table(head, rows), _ends(field, results["lines"]),
        f"Mean absolute error of runout (m):\n\n{halves}", TSCHAMUT_FAILS,
    ])  # fmt: skip


def _ends(field: Results, lines: Sequence[Results]) -> str:
    """Return the table of runout, lateral position and reach angle over all runs."""
    head = ("from the run's release", "runout (m)", "lateral mean (m)", "lateral sd (m)", "reach angle (degrees)")
    named = [("**field, 18 runs**", field), *((label(line), line) for line in lines)]
    rows = [
        (name, mean_and_sd_of(of, "runout"), f"{of['side_mean']:+.1f}", f"{of['side_sd']:.1f}",
         mean_and_sd_of(of, "angle")) for name, of in named
    ]  # fmt: skip
    return table(head, rows)
