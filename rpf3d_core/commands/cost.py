"""`rpf3d cost`: measure the price list of a scene, error and time of each setting, for `rpf3d run --accuracy`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rpf3d_core.commands.options import SceneFile
from rpf3d_core.commands.screen import end_interrupted, print_table, screen

if TYPE_CHECKING:
    from rpf3d_core.scene.model import Scene

TargetOption = Annotated[float, typer.Option(help="What the total error (-) is to keep to, between 0 and 1.")]


def cost(
    scene: SceneFile,
    out: Annotated[Path, typer.Option(help="Folder to write the price list to.", show_default=False)],
    target: TargetOption = 0.05,
) -> None:
    """Measure error and computing time of the settings of a scene: contact methods, terrains and numbers of rocks.

    The list also has the error due to the unknowns of the scene, which no setting reduces.
    """
    from rpf3d_core.accuracy.command import measured
    from rpf3d_core.accuracy.tables import NOTE, findings, tables

    try:
        with screen.status("measuring") as status:
            prices = measured(scene, out, target, status.update)
    except KeyboardInterrupt:
        end_interrupted("nothing was written")
    for header, rows in tables(prices):
        print_table(header, rows)
    screen.print(NOTE, style="dim", highlight=False, soft_wrap=True)
    for line in findings(prices, target):
        screen.print(line, soft_wrap=True)
    screen.print(f"price list in {out.resolve()}", soft_wrap=True)


def rocks_within(accuracy: float, scene: Path, out: Path) -> tuple["Scene", int]:
    """Return the scene with exact contacts, and the number of rocks for `rpf3d run --accuracy`; print the findings.

    accuracy : largest allowed total error (-)
    scene : scene file
    out : folder of the price list; if it has no price list of this scene, the list is measured and written there
    """
    from rpf3d_core.accuracy.choice import exact_run
    from rpf3d_core.accuracy.command import kept_or_measured
    from rpf3d_core.accuracy.tables import findings

    with screen.status("measuring") as status:
        prices = kept_or_measured(scene, out, accuracy, status.update)
    for line in findings(prices, accuracy):
        screen.print(line, soft_wrap=True)
    return exact_run(scene, prices, accuracy)
