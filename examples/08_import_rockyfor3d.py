"""A project of Rockyfor3D.

The script writes a small input folder of Rockyfor3D, with one grid in each file. `rpf3d import` makes a scene from
the folder, and prints two lists: what it imported, and what it left out. Read both lists before you trust a runout.
The script then flies 100 rocks, and prints the share of the rocks that reach level ground.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

import rpf3d_core as rpf3d

OUT = Path("out/import_rockyfor3d")
ROWS, COLUMNS, CELL = 40, 24, 5  # CELL in m
HEAD = f"ncols {COLUMNS}\nnrows {ROWS}\nxllcorner 601000\nyllcorner 201000\ncellsize {CELL}\nNODATA_value -9999\n"

row, column = np.mgrid[0:ROWS, 0:COLUMNS]  # the first row is in the north
slope = 400 + 0.6 * CELL * np.maximum(24 - row, 0) + 0.5 * np.cos(column)  # m: falls to the south, then level
sources = (row >= 3) & (row < 5) & (column >= 10) & (column < 14)
grids = {
    "dem": slope,
    "rockdensity": 2650 * sources,  # kg/m3 where rocks start, 0 elsewhere
    "d1": 1.2 * sources,  # m: the three diameters of a block
    "d2": 1.0 * sources,
    "d3": 0.8 * sources,
    "blshape": 2 * sources,  # an ellipsoid
    "soiltype": np.where(row < 24, 4, 1),  # talus, then fine soil
    "rg70": np.where(row < 24, 0.05, 0.02),  # m: height of obstacles in 70, 20 and 10 of 100 impacts
    "rg20": np.where(row < 24, 0.1, 0.05),
    "rg10": np.where(row < 24, 0.3, 0.1),
}
shutil.rmtree(OUT, ignore_errors=True)  # the import writes only to a new folder
(OUT / "rockyfor3d").mkdir(parents=True, exist_ok=True)
for name, values in grids.items():
    lines = [" ".join(f"{value:g}" for value in line) for line in values]
    (OUT / "rockyfor3d" / f"{name}.asc").write_text(HEAD + "\n".join(lines) + "\n")

command = [sys.executable, "-m", "rpf3d_core.cli", "import", "rockyfor3d"]  # the command `rpf3d import rockyfor3d`
subprocess.run([*command, str(OUT / "rockyfor3d"), "--out", str(OUT / "scene")], check=True)
run = rpf3d.simulate(OUT / "scene" / "scene.yaml", rocks=100)
ends = run.terrain.frame.points_to_input(run.flights.deposits.x)
level = (ends[:, 1] < 201000 + CELL * (ROWS - 24)).mean()
print(f"{level:.0%} of the rocks reach the level ground; the farthest stops at y {ends[:, 1].min():.0f} m")
