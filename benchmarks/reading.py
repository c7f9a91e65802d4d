"""Measure the time to read a million triangles, or some million points, in each format.

python benchmarks/reading.py [--side 708]

The figures are CPU times, including those of child processes, and the peak memory of a process that reads one file. The
files are written to a temporary folder, in survey coordinates rounded to the millimetre.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "test" / "support")]

SIDE = 708
"""Number of points along a side of the terrain: 999,698 triangles."""
TIMES = 3
"""Number of times that each file is read; the table has the median time."""


def write_all(folder: Path, side: int) -> list[Path]:
    """Write a terrain of side x side points in each format, and clouds; return the files to read.

    With the default side, the clouds have 4 million points (LAS, LAZ), 2 million (E57) and 1 million (text).
    """
    from input_files.mine_files import at_site, write_e57, write_landxml, write_las, write_omf, write_surpac
    from input_files.terrain_files import grid

    from rpf3d_core.results.mesh_writer import write_mesh
    from rpf3d_core.terrain.survey import mesh_terrain

    vertices, triangles = grid(side, side, 2.0)
    vertices = at_site(vertices)
    terrain = mesh_terrain(vertices, triangles, "terrain")
    for extension in (".stl", ".ply", ".obj", ".vtp"):
        write_mesh(folder / f"pit{extension}", terrain)
    write_faces(folder / "pit.dxf", vertices[triangles])
    write_landxml(folder / "pit.xml", vertices, triangles)
    write_surpac(folder / "pit.dtm", vertices, triangles)
    write_omf(folder / "pit.omf", vertices, triangles)
    rng = np.random.default_rng(1)
    points = np.round(rng.random((8 * side * side, 3)) * [1400.0, 1400.0, 1.0] + vertices.min(axis=0), 3)
    write_las(folder / "cloud.laz", points)
    write_las(folder / "cloud.las", points)
    write_e57(folder / "cloud.e57", points[: len(points) // 2])
    np.savetxt(folder / "cloud.xyz", points[: len(points) // 4], "%.3f")
    return [path for path in sorted(folder.iterdir()) if path.suffix != ".str"]


def write_faces(path: Path, corners: np.ndarray) -> None:
    """Write triangles (F, 3, 3) m as 3DFACE entities of a DXF file, on one layer, as mine planning programs do."""
    head = "  0\n3DFACE\n  5\n%X\n100\nAcDbEntity\n  8\npit\n100\nAcDbFace\n"
    row = head + "".join(f" {axis}{corner}\n%.3f\n" for corner in range(4) for axis in (1, 2, 3))
    with path.open("w") as file:
        file.write("  0\nSECTION\n  2\nHEADER\n  9\n$INSUNITS\n 70\n     6\n  0\nENDSEC\n  0\nSECTION\n  2\nENTITIES\n")
        for number, facet in enumerate(corners[:, [0, 1, 2, 2]].reshape(-1, 12).tolist(), start=256):
            file.write(row % (number, *facet))
        file.write("  0\nENDSEC\n  0\nEOF\n")


def cpu() -> float:
    """Return the CPU time (s) of this process and of its children."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def own_memory() -> int:
    """Return the peak memory (kB) of this process since its start, without the memory of its parent."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def measure(path: Path) -> None:
    """Read one file several times, and print a table row: name, size (MB), triangles, CPU time (s), memory (MB).

    For a cloud of points, the number of triangles is a third of the number of points.
    """
    from rpf3d_core.setup.terrain import read_surface

    taken = []
    for _ in range(TIMES):
        began = cpu()
        surface = read_surface(path)
        taken.append(cpu() - began)
    most = max(own_memory(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) / 1000.0
    triangles = len(surface.points) // 3 if surface.triangles is None else len(surface.triangles)
    size = path.stat().st_size / 1e6
    print(f"| {path.name} | {size:.0f} | {triangles:,} | {sorted(taken)[TIMES // 2]:.1f} | {most:.0f} |", flush=True)


def main() -> None:
    """Write all files, and measure the reading of each file in a separate process; with --file, measure one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=SIDE)
    parser.add_argument("--file", type=Path)
    chosen = parser.parse_args()
    if chosen.file:
        measure(chosen.file)
        return
    print("| file | size (MB) | triangles | CPU (s) | memory (MB) |\n|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for path in write_all(Path(folder), chosen.side):
            subprocess.run([sys.executable, __file__, "--file", str(path)], check=True)


if __name__ == "__main__":
    main()
