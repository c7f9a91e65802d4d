"""`rpf3d materials`: list the library of ground materials, with their ranges, sources and confirmation."""

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from rpf3d_core.commands.screen import GAP, print_table, screen
from rpf3d_core.errors import InputError

if TYPE_CHECKING:
    from rpf3d_core.scene.library_entries import LibraryMaterial, Range

SHORT = {
    "normal_restitution": "R_n", "tangential_restitution": "R_t", "friction_angle_deg": "friction (degrees)",
    "rolling_friction": "rolling friction", "restitution": "restitution", "friction": "friction",
}  # fmt: skip
"""Heading of each coefficient's column in the list, by key."""
NOTE = (
    "A range is unknown: each parameter set of a run has another value from it. R_n is normal_restitution, R_t "
    "tangential_restitution. `rpf3d materials NAME` shows the source.\n"
    "-: the entry has no value. A scene then assumes a range: {}."
)
NEEDED_BY = {"rolling_friction": " of spheres", "rolling_resistance": " of rocks with a shape"}
"""Text that names the rocks for which the range of a coefficient is assumed, by key of the coefficient.

The friction angle has no text; its range is assumed for points and spheres.
"""


def materials(
    name: Annotated[str | None, typer.Argument(help="Show the source of this one.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all ranges.")] = False,
) -> None:
    """List the ground materials that a scene may name with `library`, with ranges, sources and confirmation."""
    from rpf3d_core.scene.library_entries import ENTRIES

    listed = {key: entry for key, entry in ENTRIES.items() if name in (None, key)}
    if not listed:
        raise InputError(f"there is no material {name!r} in the library; `rpf3d materials` lists them")
    if as_json:
        print(json.dumps({key: _facts(entry) for key, entry in listed.items()}, indent=2, allow_nan=False))
    elif name is None:
        _print_list(listed)
    else:
        _print_one(name, listed[name])


def _facts(entry: "LibraryMaterial") -> dict[str, Any]:
    """Return an entry of the library as plain values for JSON.

    The key `assumed` has the ranges that a scene assumes for coefficients without a published figure.
    """
    ranges = {key: span if isinstance(span, float) else span._asdict() for key, span in entry.ranges.items()}
    assumed = {key: span._asdict() for key, span in entry.assumed.items()}
    return {**entry._asdict(), "ranges": ranges, "assumed": assumed}


def _print_list(listed: "dict[str, LibraryMaterial]") -> None:
    """Print a table for each kind of rocks, with a line for each entry: name, ground, ranges and confirmation."""
    for kind in dict.fromkeys(entry.kind for entry in listed.values()):
        entries = {name: entry for name, entry in listed.items() if entry.kind == kind}
        keys = [key for key in SHORT if any(key in entry.ranges for entry in entries.values())]
        rows = [(name, entry.ground, *(_span(entry.ranges.get(key)) for key in keys), entry.confirmed)
                for name, entry in entries.items()]  # fmt: skip
        screen.print(f"for {kind}", style="bold")
        print_table(("name", "ground", *(SHORT[key] for key in keys), "confirmed"), rows)
    screen.print(NOTE.format(_assumed()), style="dim", soft_wrap=True, highlight=False)


def _assumed() -> str:
    """Return the ranges that a scene assumes for coefficients without a published figure, as text."""
    from rpf3d_core.scene.library_entries import UNSTATED

    return ", ".join(f"{key}{NEEDED_BY.get(key, '')} {_span(span)}" for key, span in UNSTATED.items())


def _span(span: "Range | float | None") -> str:
    """Return a range or a single number as text for a table; "-" if the source has no figure."""
    if span is None:
        return "-"
    return f"{span:g}" if isinstance(span, float) else f"{span.low:.3g}-{span.high:.3g}"


def _print_one(name: str, entry: "LibraryMaterial") -> None:
    """Print one entry of the library, with its source and its ranges."""
    from rpf3d_core.scene.library_entries import Range

    screen.print(f"{name}: {entry.ground}, for {entry.kind}", style="bold")
    screen.print(f"Source: {entry.source} ({entry.confirmed})", soft_wrap=True)
    if entry.note:
        screen.print(f"Note: {entry.note}", soft_wrap=True)
    table = Table("coefficient", "from", "to", "mean", "sd", "", box=None, padding=GAP, pad_edge=False)
    for key, span in entry.ranges.items():
        ends = span if isinstance(span, Range) else Range(span, span)
        table.add_row(key, *("" if number is None else f"{number:g}" for number in ends))
    for key, span in entry.assumed.items():
        table.add_row(key, f"{span.low:g}", f"{span.high:g}", "", "", f"assumed{NEEDED_BY.get(key, '')}")
    screen.print(table)
