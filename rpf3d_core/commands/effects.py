"""`rpf3d effects`: list the models and effects that a scene may name."""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from rpf3d_core.commands.screen import GAP, screen
from rpf3d_core.errors import InputError

if TYPE_CHECKING:
    from rpf3d_core.scene.listings.catalogue import CatalogueEntry


def effects(
    name: Annotated[str | None, typer.Argument(help="Show the parameters of this one.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all parameters.")] = False,
) -> None:
    """List the rebound models, ground models and effects that a scene may name, with parameters, sources and cost."""
    from rpf3d_core.scene.listings.catalogue import entries

    listed = [entry for entry in entries() if name in (None, entry.name, f"{entry.kind}.{entry.name}")]
    if not listed:
        raise InputError(f"there is no model or effect {name!r}; `rpf3d effects` lists them")
    if as_json:
        print(json.dumps([asdict(entry) for entry in listed], indent=2, allow_nan=False, default=str))
    elif name is None:
        _print_list(listed)
    else:
        for entry in listed:
            _print_one(entry)


def _print_list(listed: "list[CatalogueEntry]") -> None:
    """Print a table of the given models and effects (name, summary, confirmation, cost), and a note on its columns."""
    table = Table("named", "what it is", "confirmed", "time", "runout", box=None, padding=GAP, pad_edge=False)
    for entry in listed:
        table.add_row(f"{entry.kind}: {entry.name}", escape(entry.summary), entry.confirmed, *_cost(entry))
    screen.print(table)
    screen.print(
        "time and runout: against the default models (`coulomb_limited`, `sliding`), on a wall of a synthetic pit; "
        "`rpf3d effects NAME` lists its parameters. Models of your own: docs/howto/own-models.md",
        soft_wrap=True,
    )


def _print_one(entry: "CatalogueEntry") -> None:
    """Print one model or effect that a scene may name, with its source, cost and parameters."""
    screen.print(f"{entry.kind}: {entry.name}", style="bold")
    screen.print(entry.summary, soft_wrap=True, markup=False)
    time, runout = _cost(entry)
    ratios = f"; on a wall of a synthetic pit time {time}, runout {runout}" if time else ""
    screen.print(f"Source: {entry.source} ({entry.confirmed}){ratios}", soft_wrap=True, markup=False)
    table = Table("parameter", "value", "default", "source", "confirmed", box=None, padding=GAP, pad_edge=False)
    for each in entry.parameters:
        default = "must be given" if each.required else "none" if each.default in (None, ()) else str(each.default)
        table.add_row(*map(escape, (each.name, each.meaning, default, each.source, each.confirmed)))
    if entry.parameters:
        screen.print(table)


def _cost(entry: "CatalogueEntry") -> tuple[str, str]:
    """Return the cost of a model or effect as two texts for the table: computing time and runout.

    The first text is the computing time with the model or effect, divided by the time with the default models; the
    second text is the change of the runout in per cent. Both texts are "" if the cost was not measured.
    """
    if entry.cost is None:
        return "", ""
    return f"{entry.cost['time']:.2f}", f"{100.0 * entry.cost['runout']:+.0f} %"
