"""Tables and phrases that the sections of docs/explanation/validation.md share."""

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from field_cases.measuring import CALIBRATED

Results = Mapping[str, Any]
WIDTH = 118
"""Largest number of characters in a line of text."""
NAMES = {
    "normal_restitution": "R_n", "tangential_restitution": "R_t", "friction_angle_deg": "friction angle",
    "rolling_friction": "rolling friction", "slope_deg": "slope", "restitution": "restitution", "friction": "friction",
    "rolling_resistance": "rolling resistance",
}  # fmt: skip
"""Names of the calibrated parameters on the page."""


def table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table from its head and its lines."""
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, rule, *lines)) + "\n"


def wrapped(text: str) -> str:
    """Return paragraphs and bullets, a line break before each, with lines of at most WIDTH characters."""
    blocks = re.split(r"\n(?=- |\n)", text.rstrip("\n"))
    return "\n".join(
        textwrap.fill(" ".join(block.split()), WIDTH, subsequent_indent="  " if block.startswith("- ") else "",
                      break_long_words=False, break_on_hyphens=False) for block in blocks
    ) + "\n"  # fmt: skip


def searched(calibrations: Results) -> str:
    """Return a list with the result of each search: parameters, error, number of sets tried."""
    lines = []
    for model, found in calibrations.items():
        values = ", ".join(f"{NAMES[name]} {value:g}" for name, value in found["parameters"].items())
        line = f"- {model}: {values} ({found['error']:.2f}; {found['tried']})."
        for which, half in zip(("First", "Second"), found.get("halves", ()), strict=False):
            line += f" {which} half: {', '.join(f'{value:g}' for value in half['parameters'].values())}."
        edge = ", ".join(NAMES[name] for name in found["at_edge"])
        lines.append(line + (f" **At the edge of the search: {edge}.**" if edge else ""))
    return wrapped("\n".join(lines))


def halves_table(results: Results, columns: Sequence[str], keys: Sequence[str] = ("errors",)) -> str:
    """Return a table of errors on all data and on its halves; errors on a kept-out half are in bold."""
    rows = [[label(line), *(f"{error:.1f}" for key in keys for error in line[key])] for line in results["lines"]]
    for model, found in results["calibrations"].items():
        for which, half in enumerate(found["halves"]):
            cells = [f"**{error:.1f}**" if k == 2 - which else f"{error:.1f}" for key in keys
                     for k, error in enumerate(half[key])]  # fmt: skip
            rows.append([f"{model}, {('first', 'second')[which]} half", *cells])
    return table(("values, or half of the data that they fit; kept-out half in bold", *columns), rows)


def mean_and_sd_of(figures: Results, name: str, decimals: int = 1) -> str:
    """Return mean and standard deviation of a quantity in the format of a table cell."""
    return f"{figures[f'{name}_mean']:.{decimals}f} ± {figures[f'{name}_sd']:.{decimals}f}"


def label(line: Results) -> str:
    """Return the label of a line: its model and its values."""
    values = line["values"]
    return f"{line['model']}, **{values}**" if values == CALIBRATED else f"{line['model']}, {values}"


def interval_of(interval: Sequence[float], decimals: int = 1, sign: str = "") -> str:
    """Return an interval in the format of a table cell."""
    low, high = (f"{value:{sign}.{decimals}f}" for value in interval)
    return f"{low} to {high}"


def listed(names: Sequence[str]) -> str:
    """Return names as a list in a sentence, with "and" before the last name."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
