"""A hazard map as GeoTIFF.

`write_run` writes the hazard maps of a run as GeoTIFF files, which a GIS can open. The script reads the map of reach
probability. It prints the total area of the cells that at least 1 % of the rocks reach, and the same for 5 and 10 %.
"""

from pathlib import Path

import rasterio

import rpf3d_core as rpf3d

OUT = Path("out/hazard_map")
run = rpf3d.simulate(Path(__file__).parent / "scenes" / "hazard.yaml")
rpf3d.write_run(run, OUT)

with rasterio.open(OUT / "hazard" / "reach_probability.tif") as tif:
    reach = tif.read(1)  # share of all rocks that reached each cell; the first row is in the north
    cell, tags = tif.res[0], tif.tags()
    print(f"{tif.name}: {tif.width} x {tif.height} cells of {cell:g} m, {tif.crs}")
print(f"each cell: {tags['MEANING']}")
for share in (0.01, 0.05, 0.1):
    cells = int((reach >= share).sum())
    print(f"{share:4.0%} of the rocks or more reach {cells:4d} cells, {cells * cell**2:6.0f} m2")
