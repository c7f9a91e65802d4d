"""Format tables and phrases for the sections of docs/explanation/validation.md."""

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from field_cases.models import CALIBRATED

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
    """Return a text with its paragraphs and bullets wrapped to lines of at most WIDTH characters."""
    blocks = re.split(r"\n(?=- |\n)", text.rstrip("\n"))
    return "\n".join(
        textwrap.fill(" ".join(block.split()), WIDTH, subsequent_indent="  " if block.startswith("- ") else "",
                      break_long_words=False, break_on_hyphens=False) for block in blocks
    ) + "\n"  # fmt: skip


def searched(search: Results, model: str = "") -> str:
    """Return a bullet with the result of a search: parameters, error and number of sets tried.

    model : name to begin with, "" for none
    """
    values = ", ".join(f"{NAMES[name]} {value:g}" for name, value in search["parameters"].items())
    edge = ", ".join(NAMES[name] for name in search["at_edge"])
    words = f"- {model}{': ' if model else ''}{values} ({search['error']:.2f}; {search['tried']})."
    return wrapped(words + (f" **At the edge of the search: {edge}.**" if edge else ""))


def label(line: Results) -> str:
    """Return the label of a line: its model, and where its values come from."""
    values = line["values"]
    return f"{line['model']}, **{values}**" if values == CALIBRATED else f"{line['model']}, {values}"


def interval_of(interval: Sequence[float], decimals: int = 1, sign: str = "") -> str:
    """Return an interval as a table cell; sign : "+" to show the sign of positive numbers."""
    low, high = (f"{value:{sign}.{decimals}f}" for value in interval)
    return f"{low} to {high}"


def among_sets(line: Results, name: str, decimals: int = 1, sign: str = "", unit: float = 1.0) -> str:
    """Return a figure of a line as a table cell, with the 5th and 95th percentile over its parameter sets, if any.

    unit : factor of the figure; decimals, sign : as in `interval_of`
    """
    cell = f"{unit * line[name]:{sign}.{decimals}f}"
    if "over_sets" not in line:
        return cell
    return f"{cell} ({interval_of([unit * end for end in line['over_sets'][name]], decimals, sign)})"


def listed(names: Sequence[str]) -> str:
    """Return names joined by commas, with "and" before the last name."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
