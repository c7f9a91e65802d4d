"""`rpf3d sensitivity`: measure how strongly each unknown of a scene changes each result."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.options import SceneFile
from rpf3d_core.commands.progress import interruptible
from rpf3d_core.commands.screen import end_interrupted, print_table, print_warnings, screen

HEADER = ("result", "unknown", "change", "95 % interval", "share of the variance")
OutOption = Annotated[Path | None, typer.Option(help="Folder for sensitivity.json and tornado.png.")]
SobolOption = Annotated[int, typer.Option(help="Base sets of Sobol indices, such as 128; 0 for none.")]


def sensitivity(
    scene: SceneFile,
    out: OutOption = None,
    trajectories: Annotated[int, typer.Option(help="Trajectories of the screening.")] = 20,
    sobol: SobolOption = 0,
    rocks: Annotated[int, typer.Option(help="Rocks of each parameter set.")] = 500,
) -> None:
    """Vary the unknowns of a scene within their ranges, and report which unknown affects each result most."""
    from rpf3d_core.sensitivity.analysis import Asked, Stopped
    from rpf3d_core.sensitivity.analysis import sensitivity as measure
    from rpf3d_core.sensitivity.files import write_sensitivity
    from rpf3d_core.sensitivity.words import is_clear, is_moved, rows_of, sentence_of

    with interruptible() as (stop, flying), screen.status("preparing: terrain, index, compiled code") as status:
        flying(True)
        try:
            asked = Asked(rocks=rocks, trajectories=trajectories, base_sets=sobol)
            found = measure(scene, asked, lambda done, of: status.update(f"{done:,} of {of:,} parameter sets"), stop)
        except Stopped:
            end_interrupted("nothing was written")
    print_table(HEADER, rows_of(found))
    screen.print("change: mean change of the result when the unknown moves by two thirds of its range "
                 f"({found.sets:,} parameter sets of {found.rocks:,} rocks)", soft_wrap=True)  # fmt: skip
    for y in range(len(found.results)):
        if is_moved(found, y):
            screen.print(sentence_of(found, y), soft_wrap=True)
    print_warnings(found.left_out)
    if not all(is_clear(found, y) for y in range(len(found.results))):
        print_warnings(["\"not clearly\" means that the intervals of two unknowns overlap; use more --trajectories, "
                        "--sobol sets or --rocks"])  # fmt: skip
    if out is not None:
        write_sensitivity(out, found)
        screen.print(f"results in {out.resolve()}", soft_wrap=True)
