"""Draw the pictures of the gallery: run each script of examples/ in a temporary folder, and draw its result.

python docs/example_pictures.py [NAME ...]

Without names, all pictures are drawn. The live node needs ROS 2.
"""

import contextlib
import math
import runpy
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pyarrow.parquet as parquet
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES, PICTURES = ROOT / "examples", ROOT / "docs" / "images" / "examples"
SIZE, DPI, COLOURS = (8.0, 4.2), 110, 256
LIGHT = np.array([-0.5, 0.5, 0.7])
"""Direction towards the light, for shaded ground."""
PATH, STOP, AREA, WORK = "#23406b", "#c8361e", "#d8a31a", "#8c1d82"
"""Colours of paths, of end points, of the road, and of a fence or berm."""
ZONES = np.array([[0.80, 0.78, 0.73], [0.95, 0.87, 0.70], [0.75, 0.82, 0.69], [0.90, 0.71, 0.48]])

Result = dict[str, Any]
"""The variables of a script after its run, by name."""
Box = tuple[float, float, float, float]
"""The drawn range: smallest and largest x, smallest and largest y (m); in sections z in place of y."""


def plan(axes: Axes, run: Any, box: Box, zones: bool = False) -> None:
    """Draw the shaded ground from above, with the paths of the rocks as straight lines between events, and their stops.

    zones : True to colour the ground by zone
    """
    points, triangles = run.terrain.frame.points_to_input(run.terrain.vertices), run.terrain.triangles
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    shade = np.clip(normals @ LIGHT / np.linalg.norm(normals, axis=1) / np.linalg.norm(LIGHT), 0.0, 1.0)
    colours = ZONES[run.terrain.zone % len(ZONES)] if zones else np.full((len(triangles), 3), 0.9)
    colours = colours * (0.55 + 0.45 * shade)[:, None]
    axes.add_collection(
        PolyCollection(points[triangles][..., :2], facecolors=colours, edgecolors=colours, linewidths=0.3)
    )
    paths = run.flights.paths
    lines = np.split(run.terrain.frame.points_to_input(paths.x)[:, :2], np.flatnonzero(np.diff(paths.row)) + 1)
    axes.add_collection(LineCollection(lines, colors=PATH, linewidths=0.6, alpha=0.6))
    stops = run.terrain.frame.points_to_input(run.flights.deposits.x)
    axes.plot(*stops[:, :2].T, ".", color=STOP, markersize=5, label="where a rock stops")
    axes.set(xlim=box[:2], ylim=box[2:], xlabel="x (m)", ylabel="y (m)", aspect="equal")


def section(axes: Axes, folder: Path, run: Any, box: Box) -> None:
    """Draw the paths in a result folder and the road from the side, over the ground near y = 0.

    box : range of x and z (m)
    """
    points = run.terrain.frame.points_to_input(run.terrain.vertices)
    near = points[np.abs(points[:, 1]) < 3.0]
    near = near[np.argsort(near[:, 0])]
    axes.fill_between(near[:, 0], near[:, 2], -50.0, color="#cfc8ba", zorder=0)
    table = parquet.read_table(folder / "trajectories.parquet").to_pydict()
    x, z, rock = (np.array(table[name]) for name in ("x", "z", "rock"))
    lines = np.split(np.column_stack([x, z]), np.flatnonzero(np.diff(rock)) + 1)
    axes.add_collection(LineCollection(lines, colors=PATH, linewidths=0.5, alpha=0.45))
    axes.plot(*np.array([line[-1] for line in lines]).T, ".", color=STOP, markersize=5)
    axes.plot([-132, -124], [-0.6, -0.6], color=AREA, linewidth=5, solid_capstyle="butt")
    axes.set(xlim=box[:2], ylim=box[2:], xlabel="x (m)", ylabel="z (m)", aspect="equal")


def ten_lines(figure: Figure, result: Result) -> None:
    """Draw the wall from above, with all paths and stops."""
    axes = figure.subplots()
    plan(axes, result["run"], (-625, -475, -70, 20))
    axes.legend(loc="lower right")


def own_mesh(figure: Figure, result: Result) -> None:
    """Draw the four zones from above, with all paths and stops."""
    axes = figure.subplots()
    run = result["run"]
    plan(axes, run, (0, 120, 0, 60), zones=True)
    for zone, (x, y) in {"face": (4, 54), "bench": (27, 54), "floor": (85, 54), "gravel bed": (43, 2)}.items():
        axes.text(
            x, y, zone, fontsize=11, weight="bold", bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none"}
        )
    axes.legend(loc="lower right")


def own_rebound(figure: Figure, result: Result) -> None:
    """Draw the share of rocks that go further than a distance, for both models."""
    axes = figure.subplots()
    for (model, runout), colour in zip(result["results"].items(), (PATH, STOP), strict=True):
        axes.step(np.sort(runout), 100 * (1 - np.arange(len(runout)) / len(runout)), color=colour, label=model)
    axes.set(xscale="log", xlabel="runout (m)", ylabel="rocks that go further (%)", ylim=(0, 102))
    axes.set_xticks([5, 10, 20, 50, 100, 200, 500], ["5", "10", "20", "50", "100", "200", "500"])
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(title="rebound model")


def hazard_map(figure: Figure, result: Result) -> None:
    """Draw the map of reach probability over the shaded ground."""
    axes = figure.subplots()
    plan(axes, result["run"], (-625, -475, -75, 25))
    for drawn in [*axes.collections[1:], *axes.lines]:
        drawn.remove()
    bounds = result["tif"].bounds
    reach = np.ma.masked_less_equal(100 * result["reach"], 0)
    shown = axes.imshow(reach, extent=(bounds.left, bounds.right, bounds.bottom, bounds.top), cmap="YlOrRd",
                        norm=LogNorm(0.5, 50), alpha=0.85, zorder=3)  # fmt: skip
    axes.set(xlim=(-625, -475), ylim=(-75, 25))
    figure.colorbar(shown, ax=axes, label="rocks that reach a cell of 5 m (%)", shrink=0.8, format="%g")


def barrier_design(figure: Figure, result: Result) -> None:
    """Draw the rocks from the side, without and with the fence."""
    import rpf3d_core as rpf3d

    upper, lower = figure.subplots(2, 1, sharex=True)
    for axes, name in ((upper, "no_fence"), (lower, "with_fence")):
        run = rpf3d.simulate(result["OUT"] / f"{name}.yaml", rocks=1)
        section(axes, result["OUT"] / name, run, (-180, -60, -4, 32))
        axes.set_title(name.replace("_", " "), loc="left", fontsize=10)
    upper.set_xlabel("")
    lower.plot([-145, -145], [0, result["high"]], color=WORK, linewidth=3)
    lower.annotate(f"{result['high']:.1f} m, {result['capacity']} kJ", (-144.5, 1.5), (-138, 12), color=WORK,
                   arrowprops={"arrowstyle": "-", "color": WORK})  # fmt: skip
    upper.text(-128, -3.4, "road", ha="center", fontsize=9)


def price_of_accuracy(figure: Figure, result: Result) -> None:
    """Draw the error of fixed time steps against the number of steps per rock."""
    axes = figure.subplots()
    axes.loglog(result["steps"], result["errors"], "o-", color=STOP, label="fixed time steps")
    axes.axvline(result["events"], color=PATH, label="event by event: exact")
    axes.set(xlabel="steps, or impacts, a rock", ylabel="first impact is off by (m)")
    axes.grid(alpha=0.3, which="both")
    axes.legend()


def compare_designs(figure: Figure, result: Result) -> None:
    """Draw the rocks of both designs from the side."""
    for axes, name in zip(figure.subplots(2, 1, sharex=True), "AB", strict=True):
        section(axes, result[name.lower()], result[f"run_{name.lower()}"], (-180, -60, -4, 32))
        axes.set_title(f"design {name}", loc="left", fontsize=10)
        axes.text(-128, -3.4, "road", ha="center", fontsize=9)
        axes.set_xlabel("x (m)" if name == "B" else "")


def import_rockyfor3d(figure: Figure, result: Result) -> None:
    """Draw the imported zones from above, with all paths and stops."""
    axes = figure.subplots()
    plan(axes, result["run"], (601000, 601120, 201000, 201200), zones=True)
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.locator_params(nbins=4, axis="x")
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False)
    axes.text(1.04, 0.7, "talus (soil type 4)", transform=axes.transAxes)
    axes.text(1.04, 0.15, "fine soil (soil type 1)", transform=axes.transAxes)


def live_node(figure: Figure, result: Result) -> None:
    """Draw the map of reach probability that the node published, with the alert level of the site."""
    axes = figure.subplots()
    grid = result["grids"][-1]
    info, share = grid.info, np.array(grid.data).reshape(grid.info.height, grid.info.width)
    left, low = info.origin.position.x, info.origin.position.y
    extent = (left, left + info.width * info.resolution, low, low + info.height * info.resolution)
    axes.set_facecolor("#e4e0d8")
    shown = axes.imshow(np.ma.masked_less(share, 1), origin="lower", extent=extent, cmap="YlOrRd", norm=LogNorm(1, 100))
    axes.fill([-132, -124, -124, -132], [-60, -60, 60, 60], facecolor="none", edgecolor="black", linestyle="--")
    axes.text(-123, 31, "road", va="top")
    axes.set(xlim=(-185, -55), ylim=(-35, 35), xlabel="x (m)", ylabel="y (m)")
    axes.set_title(f"level of the site: {result['sites'][-1]['level']}", loc="left")
    figure.colorbar(shown, ax=axes, label="rocks that reach a cell (%)", shrink=0.8, format="%g")


def replay(figure: Figure, result: Result) -> None:
    """Draw the paths of the recording in space, over the ground near them."""
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    run = result["run"]
    points = run.terrain.frame.points_to_input(run.terrain.vertices)
    middle = points[run.terrain.triangles].mean(axis=1)
    x, y = middle[:, 0], middle[:, 1]
    near = run.terrain.triangles[(x > -185) & (x < -60) & (np.abs(y) < 40)]
    axes.plot_trisurf(*points.T, triangles=near, color="#d5ccb9", linewidth=0, antialiased=False, zorder=0)
    table = parquet.read_table(result["folder"] / "trajectories.parquet").to_pydict()
    place, rock = np.column_stack([table["x"], table["y"], table["z"]]), np.array(table["rock"])
    for line in np.split(place, np.flatnonzero(np.diff(rock)) + 1):
        axes.plot(*line.T, color=PATH, linewidth=0.6, alpha=0.8, zorder=2)
    axes.set(xlim=(-185, -60), ylim=(-40, 40), zlim=(0, 70))
    axes.set_box_aspect((125, 80, 70), zoom=1.25)
    axes.view_init(elev=24, azim=-58)
    axes.set_axis_off()


DRAW: dict[str, Callable[[Figure, Result], None]] = {
    "01_ten_lines": ten_lines, "02_own_mesh": own_mesh, "03_own_rebound": own_rebound, "04_hazard_map": hazard_map,
    "05_barrier_design": barrier_design, "06_price_of_accuracy": price_of_accuracy,
    "07_compare_designs": compare_designs, "08_import_rockyfor3d": import_rockyfor3d, "09_live_node": live_node,
    "10_replay": replay,
}  # fmt: skip


def draw(name: str) -> int:
    """Run a script in a temporary folder, write the picture of its result, and return the picture's size (bytes)."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        result = runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
        figure = Figure(SIZE, layout="constrained")
        DRAW[name](figure, result)
        figure.savefig("picture.png", dpi=DPI)
        picture = Image.open("picture.png").convert("RGB").quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
        PICTURES.mkdir(parents=True, exist_ok=True)
        picture.save(PICTURES / f"{name}.png", optimize=True)
    return (PICTURES / f"{name}.png").stat().st_size


def main(names: Sequence[str]) -> None:
    """Draw the pictures with the given names, or all pictures without names."""
    mpl.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
    sys.argv = sys.argv[:1]
    for name in names or DRAW:
        print(f"{name}.png: {math.ceil(draw(name) / 1000)} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
