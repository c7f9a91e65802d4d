"""`rpf3d pit`: write the mesh of an artificial open pit, to try rpf3d without a survey."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.screen import screen


def pit(
    out: Annotated[Path, typer.Argument(help="File to write: .vtp (keeps the zones), .stl, .ply or .obj.")],
    triangles: Annotated[int, typer.Option(help="How many triangles, within 3 %.")] = 150_000,
    seed: Annotated[int, typer.Option(help="Seed of roughness, spills and relief.")] = 1,
) -> None:
    """Write a synthetic open pit modelled on the Arturo mine in the thesis of B. Peik (2020)."""
    from rpf3d_core.results.mesh_writer import check_mesh_path, write_mesh
    from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain

    check_mesh_path(out)  # before the terrain is made, which takes time
    terrain = pit_terrain(Pit(triangles=triangles, seed=seed))
    write_mesh(out, terrain)
    screen.print(f"{len(terrain.triangles):,} triangles in {out}", soft_wrap=True)
