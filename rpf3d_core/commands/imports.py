"""`rpf3d import`: make a scene from Rockyfor3D or STONE, a terrain from point clouds, or GeoJSON from a layer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rpf3d_core.commands.screen import print_warnings
from rpf3d_core.errors import InputError

if TYPE_CHECKING:  # each command imports its own modules, so that `rpf3d --help` loads neither VTK nor numba
    from rpf3d_core.imports.imported import Imported

app = typer.Typer(
    help="Make a scene from the input of Rockyfor3D or STONE, a terrain from point clouds, or GeoJSON from a layer "
    "of a GIS or CAD file.",
    no_args_is_help=True,
)

Folder = Annotated[Path, typer.Argument(help="The folder that holds the grids.", show_default=False)]
Out = Annotated[Path, typer.Option(help="New or empty folder to write the scene to.", show_default=False)]


@app.command()
def rockyfor3d(folder: Folder, out: Out) -> None:
    """Rockyfor3D: make a scene from dem, rockdensity, d1, d2, d3, blshape, rg70, rg20, rg10 and soiltype (.asc)."""
    from rpf3d_core.imports.rockyfor3d import import_rockyfor3d

    _tell(import_rockyfor3d(folder, out))


@app.command()
def stone(folder: Folder, out: Out) -> None:
    """STONE and r.stone: make a scene from the grids dem, sources, nrest, trest and friction (.asc or .tif)."""
    from rpf3d_core.imports.stone import import_stone

    _tell(import_stone(folder, out))


@app.command()
def cloud(
    files: Annotated[list[Path], typer.Argument(help=".las, .laz, .e57, .xyz, .csv or .str.", show_default=False)],
    out: Annotated[Path, typer.Option(help="Mesh to write: .vtp, .ply, .obj or .stl.", show_default=False)],
    cell: Annotated[float | None, typer.Option(help="Side of a cell (m); the lowest point stays.", min=1e-3)] = None,
    widest: Annotated[float | None, typer.Option(help="Widest hole (m) to close; default: 4 cells.", min=0.0)] = None,
    classes: Annotated[str, typer.Option(help="Class numbers of ground points (LAS), such as 2,8.")] = "",
) -> None:
    """Point clouds: choose the ground points, thin them, and connect them to a terrain; wide gaps stay gaps."""
    from rpf3d_core.imports.cloud import import_cloud
    from rpf3d_core.terrain.cloud_surface import CloudChoice

    choice = CloudChoice(cell=cell, widest=widest, classes=_numbers(classes))
    imported = import_cloud(files, out, choice)
    for sentence in imported.sentences:
        typer.echo(sentence)
    print_warnings(imported.warnings)
    typer.echo(f"\nterrain in {out}")


@app.command()
def layer(
    file: Annotated[Path, typer.Argument(help=".gpkg, .shp, .dxf, .str or .geojson.", show_default=False)],
    out: Annotated[Path, typer.Option(help="New .geojson file.", show_default=False)],
    kind: Annotated[str, typer.Option(help="polygon, line or point.")] = "polygon",
    layer: Annotated[str, typer.Option(help="Layer of a GeoPackage or DXF; without it, the only layer or all.")] = "",
    begin: Annotated[str | None, typer.Option("--from", help="Reference system of the file, if not stated.")] = None,
    end: Annotated[str | None, typer.Option("--to", help="Reference system to transform to: EPSG:32719.")] = None,
) -> None:
    """Areas, lines or points: write a layer as GeoJSON; --to transforms it to the reference system of the terrain."""
    from rpf3d_core.imports.layer import TYPES, import_layer

    if kind not in TYPES:
        raise InputError(f"--kind is {kind!r}; it must be one of {', '.join(TYPES)}")
    written = import_layer(file, out, kind, layer, begin, end)  # type: ignore[arg-type]
    count = written.number
    typer.echo(f"{count:,} {'geometry' if count == 1 else 'geometries'} in {out}" + f", in {end}" * bool(end))
    print_warnings(written.notes)


def _numbers(text: str) -> tuple[int, ...]:
    """Return the whole numbers in a text such as "2,8"; () for an empty text. Raise InputError for other text."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not all(word.isdecimal() for word in words):
        raise InputError(f"--classes is {text!r}; it must be whole numbers between commas, such as 2,8")
    return tuple(int(word) for word in words)


def _tell(imported: "Imported") -> None:
    """Print the inputs that were imported, the inputs that were not imported, and the path of the new scene."""
    from rpf3d_core.imports.scene_text import NOT_CARRIED

    for sentence in imported.taken:
        typer.echo(sentence)
    typer.echo(f"\n{NOT_CARRIED}")
    for sentence in imported.left:
        typer.echo(f"- {sentence}")
    typer.echo(f"\nscene in {imported.scene}")
