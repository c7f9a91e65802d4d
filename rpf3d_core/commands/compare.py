"""`rpf3d compare`: compare two results, for example of two designs, and print which differences are significant."""

import json
from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.screen import print_table, screen


def compare(
    run_a: Annotated[Path, typer.Argument(help="The folder of a result, A.", show_default=False)],
    run_b: Annotated[Path, typer.Argument(help="The folder of the other result, B.", show_default=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Compare two results: shares and p95 energies of zones and areas, and which shares differ significantly."""
    from rpf3d_core.runs.compare import compare_runs, comparison_section
    from rpf3d_core.runs.compare_tables import ENERGIES_HEADER, SHARES_HEADER, energy_rows, lines_of, share_rows

    comparison = compare_runs(run_a, run_b)
    if as_json:
        print(json.dumps(comparison_section(comparison), indent=2, allow_nan=False))
        return
    for line in lines_of(comparison):
        screen.print(line, soft_wrap=True)
    for header, rows in ((SHARES_HEADER, share_rows(comparison)), (ENERGIES_HEADER, energy_rows(comparison))):
        print_table(header, rows)
