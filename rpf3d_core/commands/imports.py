"""`rpf3d import`: make a scene from the input folder of another program."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:  # each command imports its own modules, so that `rpf3d --help` loads neither VTK nor numba
    from rpf3d_core.imports.imported import Imported

app = typer.Typer(help="Make a scene of the input folder of another program.", no_args_is_help=True)

Folder = Annotated[Path, typer.Argument(help="The folder that holds the grids.", show_default=False)]
Out = Annotated[Path, typer.Option(help="New or empty folder to write the scene to.", show_default=False)]


@app.command()
def rockyfor3d(folder: Folder, out: Out) -> None:
    """Rockyfor3D: dem, rockdensity, d1, d2, d3, blshape, rg70, rg20, rg10 and soiltype, each as .asc."""
    from rpf3d_core.imports.rockyfor3d import import_rockyfor3d

    _tell(import_rockyfor3d(folder, out))


@app.command()
def stone(folder: Folder, out: Out) -> None:
    """STONE and r.stone: dem, sources, nrest, trest and friction, each as .asc or .tif."""
    from rpf3d_core.imports.stone import import_stone

    _tell(import_stone(folder, out))


def _tell(imported: "Imported") -> None:
    """Print which input of the other program is in the scene, which input is not, and the path of the scene."""
    from rpf3d_core.imports.scene_text import NOT_CARRIED

    for sentence in imported.taken:
        typer.echo(sentence)
    typer.echo(f"\n{NOT_CARRIED}")
    for sentence in imported.left:
        typer.echo(f"- {sentence}")
    typer.echo(f"\nscene in {imported.scene}")
