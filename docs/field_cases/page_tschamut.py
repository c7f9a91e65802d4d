"""The section of docs/validation.md on Tschamut."""

from field_cases import tschamut
from field_cases.page_tables import Results, halves_table, interval_of, label, searched, table
from field_cases.prose import TSCHAMUT, TSCHAMUT_FAILS


def section(results: Results) -> str:
    """What was measured at Tschamut."""
    field, bar = results["field"], tschamut.OTHER_CODE
    head = ("runout, simulated less seen (m)", "mean", "mean absolute", "correlation over runs",
            "mean end off by (m)", "not at rest there (%)")  # fmt: skip
    rows = [
        *((f"another code, {name}, untuned, survey of 2 m", f"{value:+.1f}", *[""] * 4) for name, value in bar.items()),
        *((label(line), f"{line['error_mean']:+.1f} ({interval_of(line['error_interval'], 0, '+')})",
           f"{line['error_absolute']:.1f}",
           f"{line['correlation']:+.2f}", f"{line['end_off']:.1f}", f"{100 * line['left']:.0f}")
          for line in results["lines"]),
    ]  # fmt: skip
    said = (
        f"{field['runs']} runs, {field['distinct']} distinct; runout {field['runout_mean']:.1f} ± "
        f"{field['runout_sd']:.1f} m, reach angle {field['angle_mean']:.1f} ± {field['angle_sd']:.1f} degrees.\n"
    )
    found = searched(results["calibrations"], "m mean absolute error")
    halves = "Mean absolute error of runout (m):\n\n"
    halves += halves_table(results, ("all 17 distinct runs", "first half, 9", "second half, 8"))
    picture = "![Tschamut](pictures/validation_tschamut.png)\n"
    return "\n".join([TSCHAMUT, said, found, picture, table(head, rows), halves, TSCHAMUT_FAILS])
