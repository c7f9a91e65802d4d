"""`rpf3d new`: write a scene with comments for a terrain file; the scene can be run without changes."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.screen import print_warnings, screen
from rpf3d_core.errors import InputError


def new(
    folder: Annotated[Path, typer.Argument(help="New or empty folder to write the scene to.", show_default=False)],
    terrain: Annotated[Path, typer.Option(help="Terrain file: mesh, grid or cloud.", show_default=False)],
    up: Annotated[str, typer.Option(help="Axis of the file that points up: y or z.")] = "z",
    unit: Annotated[str, typer.Option(help="Unit of the file's coordinates: mm, ft, ...")] = "m",
    crs: Annotated[str | None, typer.Option(help="Reference system of the file, such as EPSG:32719.")] = None,
) -> None:
    """Write a scene for a terrain file; print the zones and crests found in the terrain, and what you must check."""
    from rpf3d_core.formats.units import LENGTHS
    from rpf3d_core.imports.new_scene import FileChoice, write_new_scene

    if up not in ("y", "z"):
        raise InputError(f"--up is {up!r}; it must be y or z")
    if unit not in LENGTHS:
        raise InputError(f"--unit is {unit!r}; it must be one of {', '.join(LENGTHS)}")
    with screen.status("reading the terrain, and searching crests"):
        written = write_new_scene(folder, terrain, FileChoice(up=up, unit=unit, crs=crs))
    for sentence in written.sentences:
        screen.print(sentence, highlight=False, soft_wrap=True)
    print_warnings(written.warnings)
    screen.print(f"scene in {written.path.resolve()}\nnext: rpf3d check {written.path}", soft_wrap=True)
    screen.print(f"then: rpf3d run {written.path} --out OUT", soft_wrap=True)
