"""Build the section of docs/explanation/validation.md on Chant Sura from the file of results."""

from collections.abc import Sequence

from field_cases.page_tables import Results, label, listed, searched, table, wrapped
from field_cases.prose import CHANT_SURA


def section(results: Results) -> str:
    """Return the section on Chant Sura as Markdown."""
    parts = [
        CHANT_SURA.format(widest=widest(results)),
        "![Chant Sura](../pictures/validation_chant_sura.png)\n",
        _six(results),
        _eleven(results["lines"]),
        _calibrated_impacts(results["calibrations"]),
    ]
    if results["left_out"]:
        names = ", ".join(f"`{name}`" for name in results["left_out"])
        parts.append(f"Not in the tables: {names}, because the user gives all of its figures.\n")
    return "\n".join(parts)


def widest(results: Results) -> float:
    """Return the largest factor (-) between the energy ratios that one model predicts for two of the six impacts."""
    found = [line["published"]["ratios"] for line in (*results["lines"], *results["calibrations"].values())]
    return max(max(ratios) / min(ratios) for ratios in found)


def _six(results: Results) -> str:
    head = ("energy ratio of the six impacts", *("2.1", "2.2", "2.3", "4.1", "4.2", "4.3"), "mean error",
            "mean absolute", "speed after, mean error (m/s)", "rms (m/s)", "27 rad/s")  # fmt: skip
    rows = [("**field**", *(f"{ratio:.2f}" for ratio in results["field"]["published"]), *[""] * 5)]
    calibrated = [
        {"model": model, "values": "calibrated on the eleven contacts", **found}
        for model, found in results["calibrations"].items()
    ]
    for line in [*results["lines"], *calibrated]:
        six = line["published"]
        rows.append((label(line), *(f"{ratio:.2f}" for ratio in six["ratios"]), f"{six['ratio_mean']:+.2f}",
                     f"{six['ratio_absolute']:.2f}", f"{six['speed_mean']:+.1f}", f"{six['speed_rms']:.1f}",
                     f"{line['spinning']['ratio_absolute']:.2f}"))  # fmt: skip
    words = (
        "*Mean absolute*: the mean absolute error of the energy ratio without spin before the impact. *27 rad/s*: the "
        "mean absolute error with this spin.\n"
    )
    return f"{table(head, merged(rows))}\n{wrapped(words)}"


def _eleven(lines: Sequence[Results]) -> str:
    slopes = list(lines[0]["contacts"])
    head = (f"eleven contacts; slopes of {listed(slopes)} degrees", "error of velocity (m/s)",
            "speed after, mean error (m/s)", "energy ratio, mean error")  # fmt: skip
    rows = [
        (label(line), *(", ".join(f"{line['contacts'][slope][key]:{form}}" for slope in slopes)
                        for key, form in (("velocity", ".1f"), ("speed_mean", "+.1f"), ("ratio_mean", "+.2f"))))
        for line in lines
    ]  # fmt: skip
    return table(head, merged(rows))


def merged(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the rows of a table, with rows that differ only in their labels merged into one row."""
    labels: dict[tuple[str, ...], list[str]] = {}
    for name, *cells in rows:
        labels.setdefault(tuple(cells), []).append(name)
    return [["; ".join(names), *cells] for cells, names in labels.items()]


def _calibrated_impacts(calibrations: Results) -> str:
    head = ("model, calibrated", "speed after, rms (m/s)", "rms, each run kept out", "mean error (m/s)",
            "error of velocity (m/s)", "energy ratio, mean absolute error")  # fmt: skip
    rows = [
        (model, f"{found['contacts']['speed_rms']:.2f}", f"{found['kept_out']['speed_rms']:.2f}",
         f"{found['contacts']['speed_mean']:+.2f}", f"{found['contacts']['velocity']:.2f}",
         f"{found['contacts']['ratio_absolute']:.2f}")
        for model, found in calibrations.items()
    ]  # fmt: skip
    words = (
        "Calibrated values (in brackets: the error of the speeds after the eleven contacts in m/s, and the number of "
        "sets tried):\n\n"
    )
    lines = "".join(searched(found, model) for model, found in calibrations.items())
    return f"{words}{lines}\nErrors in the eleven contacts with these values:\n\n{table(head, rows)}"
