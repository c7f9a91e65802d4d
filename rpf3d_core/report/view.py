"""Make the 3D view of a report with plotly: terrain, kept paths, hazard maps, barriers and areas of interest.

The HTML file of the report contains the script of plotly (4.8 MB), so that a report needs no network. The script is
part of plotly's wheel.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.accuracy.decimated import decimated_mesh
from rpf3d_core.hazard.scales import FEW_COLOUR, FEW_WORDS, reach_scale, round_values, scale_of_energy
from rpf3d_core.report.draped_map import FEW, draped_facets
from rpf3d_core.report.need import needed
from rpf3d_core.report.run_files import HazardGrid, RunFiles, has_hazard, read_hazard
from rpf3d_core.report.section_fences import barrier_lines, height_of, panels_of
from rpf3d_core.terrain.draped_outlines import draped_lines, draped_outlines
from rpf3d_core.terrain.facets import Terrain, unit_normals
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.obstacles import Wall, standing_wall

MOST_TRIANGLES = 300_000
"""Largest number of triangles of the terrain in a report; browsers cannot turn more of them smoothly."""
MARGIN = 0.5
"""Width of the terrain shown around the rocks, as a share (-) of the larger extent of the rocks in plan."""
LEAST_MARGIN = 25.0
"""Smallest width (m) of the terrain shown around the rocks."""
RAISED, LEAST_RAISED = 0.003, 0.25
"""Distance of a hazard map from the ground, so that the terrain does not hide the map: as a share (-) of the extent of
the view in plan, and smallest distance (m)."""
GROUND_SCALE = [[0.0, "#4c4437"], [0.5, "#9c8f76"], [1.0, "#e6dfd0"]]
LIGHT = np.array([-0.5, 0.5, 0.7071])
"""Direction (3,) towards the light: unit vector, local frame."""
UNLIT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0}
EYE, LOWER = 1.25, 0.08
"""Distance of the eye from the middle of the terrain, and depth below this middle of the point that the eye looks at.

Both are multiples of the diagonal of the terrain's box.
"""
ABOVE_MAPS = 1.3
"""Height of the outlines of areas above the ground, as a multiple of the distance of the hazard maps."""
PATH, AREA, BARRIER, CRITICAL = "#10203a", "#0059bf", "#008577", "#d1480f"
Key = tuple[str, int, int]
"""A rock, as (source, rock, fragment)."""
UPPER_REACH = "reach probability, upper end of the predictive interval"
"""Title of the map that the report and the desk show first for a run over parameter sets."""
WORST_REACH, WORST_ENERGY = "reach probability, worst source", "p95 energy, worst source"
"""Titles of the maps of the worst source of each cell, which the report and the desk show for several sources."""
MAPS = (
    ("reach_probability_high", None, UPPER_REACH, 100.0, "%"),
    ("reach_probability_worst_source", "value", WORST_REACH, 100.0, "%"),
    ("reach_probability", None, "reach probability", 100.0, "%"),
    ("energy_j_worst_source", "value", WORST_ENERGY, 1e-3, "kJ"),
    ("energy_j", "p95", "p95 energy", 1e-3, "kJ"),
)
"""Hazard maps of the view: file, band, title, factor from the file's unit to the unit shown, and the unit shown."""


class Seen(NamedTuple):
    """The part of the terrain that the 3D view shows; vertices (V, 3) m, local frame, and triangles (F, 3).

    of : number of triangles of this part before it was reduced
    """

    vertices: FloatArray
    triangles: NDArray[np.int32]
    of: int

    @property
    def terrain(self) -> Terrain:
        """This part of the terrain as a `Terrain` with a single zone."""
        return Terrain(self.vertices, self.triangles, np.zeros(len(self.triangles), np.int32), ("ground",))


class MapSeen(NamedTuple):
    """A hazard map of the 3D view: corners (N, 3, 3) m and values (N,) of its triangles, from `draped`.

    what : entry of MAPS; cell : side (m) of a cell of the map
    """

    what: tuple[str, str | None, str, float, str]
    corners: FloatArray
    values: FloatArray
    cell: float


def view_html(
    run: RunFiles, seen: Seen, looking: FloatArray, critical: Key | None = None, maps: Sequence[MapSeen] | None = None
) -> str:
    """Return the 3D view of a report as an HTML fragment, without the script of plotly that the fragment needs.

    seen : the terrain of the view, from `terrain_seen`
    looking : (2,) unit vector in plan, the mean direction of the rocks; the view looks in the opposite direction
    critical : the rock of the critical section, as (source, rock, fragment); None if there is none
    maps : the hazard maps, from `maps_seen`; None to make them here

    Raises
    ------
    InputError
        plotly is not installed.
    """
    go = needed("plotly.graph_objects")
    traces = [
        _terrain(go, seen), *_hazard(go, maps_seen(run, seen) if maps is None else maps, int(run.summary["rocks"])),
        _paths(go, run),
        *_critical(go, run, critical), _releases(go, run), *_barriers(go, run, seen),
        *_areas(go, run, seen, looking),
    ]  # fmt: skip
    figure = go.Figure(data=traces, layout=_layout(run, seen, looking))
    html: str = figure.to_html(full_html=False, include_plotlyjs=False, default_height="640px", config={
        "displaylogo": False, "responsive": True,
    })  # fmt: skip
    return html


def script() -> str:
    """Return the script of plotly, from its wheel; `InputError` if plotly is not installed."""
    return str(needed("plotly.offline").get_plotlyjs())


def terrain_seen(run: RunFiles) -> Seen:
    """Return the terrain around the rocks, with at most about MOST_TRIANGLES triangles."""
    vertices, triangles = run.terrain.vertices, run.terrain.triangles
    places = np.concatenate([run.ends.release[:, :2], run.ends.end[:, :2], run.paths.x[:, :2]])
    low, high = places.min(axis=0), places.max(axis=0)
    margin = max(MARGIN * float((high - low).max()), LEAST_MARGIN)
    corners = vertices[triangles][:, :, :2]
    near = ((corners.max(axis=1) >= low - margin) & (corners.min(axis=1) <= high + margin)).all(axis=1)
    used, inverse = np.unique(triangles[near], return_inverse=True)
    points, facets = vertices[used], inverse.reshape(-1, 3).astype(np.int32)
    if len(facets) > MOST_TRIANGLES:
        points, small = decimated_mesh(points, facets, MOST_TRIANGLES / len(facets))
        return Seen(vertices=points, triangles=small, of=len(facets))
    return Seen(vertices=points, triangles=facets, of=len(facets))


def _terrain(go: Any, seen: Seen) -> Any:
    """Return the terrain as a plotly mesh, shaded by a light in the north-west; go : module plotly.graph_objects."""
    points = seen.vertices.astype(np.float32)
    i, j, k = seen.triangles.T
    shade = (unit_normals(seen.vertices, seen.triangles) @ LIGHT).astype(np.float32)
    return go.Mesh3d(
        x=points[:, 0], y=points[:, 1], z=points[:, 2], i=i, j=j, k=k, intensity=shade, intensitymode="cell",
        colorscale=GROUND_SCALE, cmin=-0.6, cmax=1.0, showscale=False, name="terrain", showlegend=True,
        hoverinfo="skip", lighting=UNLIT,
    )  # fmt: skip


def maps_seen(run: RunFiles, seen: Seen) -> list[MapSeen]:
    """Return the hazard maps of a run, draped over the terrain of the 3D view."""
    found = [(each, grid) for each in MAPS if (grid := with_few(run, each[0], each[1])) is not None]
    return [MapSeen(each, *draped(seen, grid), grid.cell) for each, grid in found]


def _hazard(go: Any, maps: Sequence[MapSeen], flown: int) -> list[Any]:
    """Return the hazard maps as plotly meshes; only the first map is shown until the reader chooses another.

    go : module plotly.graph_objects; flown : number of rocks
    """
    return [trace for i, one in enumerate(maps) for trace in _map(go, one, i == 0, flown)]


def with_few(run: RunFiles, name: str, band: str | None = None) -> HazardGrid | None:
    """Return a hazard map with the value FEW in cells that rocks reached, but too few rocks for a value.

    The result is None if the run did not write the map or the band, or if no rock reached a cell.

    name, band : as for `read_hazard`
    """
    if not has_hazard(run, name, band):
        return None
    grid, reached = read_hazard(run, name, band), read_hazard(run, "reach_probability")
    if reached is None or (grid is not None and reached.values.shape != grid.values.shape):
        return grid
    values = np.full(reached.values.shape, np.nan) if grid is None else grid.values
    return reached._replace(values=np.where(np.isnan(values) & (reached.values > 0.0), FEW, values))


def _map(go: Any, one: MapSeen, shown: bool, flown: int) -> Iterator[Any]:
    """Yield a hazard map as a plotly mesh just above the terrain, and a second mesh for cells with too few rocks.

    The colours are logarithmic, as in the pictures of a run: on a linear scale, almost all cells would look the same.

    go : module plotly.graph_objects; one : the map; shown : False to hide the map at first; flown : number of rocks
    """
    name, _, title, factor, unit = one.what
    corners, values = one.corners, one.values
    style = {"legendgroup": name, "visible": True if shown else "legendonly", "hoverinfo": "skip", "lighting": UNLIT,
             "opacity": 0.8, "showlegend": True}  # fmt: skip
    few = values == FEW
    if not few.all():
        known = values[~few]
        scale = reach_scale(flown, known) if unit == "%" else scale_of_energy(known)
        ticks = round_values(factor * scale.low, factor * scale.high)
        yield go.Mesh3d(
            **_mesh(corners[~few]), intensity=np.log10(factor * known).astype(np.float32), intensitymode="cell",
            colorscale="YlOrRd", cmin=math.log10(factor * scale.low), cmax=math.log10(factor * scale.high),
            name=f"{title} ({unit})", **style,
            colorbar={"title": {"text": unit}, "len": 0.6, "thickness": 14, "tickvals": np.log10(ticks).tolist(),
                      "ticktext": [f"{tick:,.6g}" for tick in ticks]},
        )  # fmt: skip
    if few.any():
        yield go.Mesh3d(**_mesh(corners[few]), color=f"rgb{FEW_COLOUR}", name=f"{title}: {FEW_WORDS}", **style)


def _mesh(corners: FloatArray) -> dict[str, Any]:
    """Return triangles (N, 3, 3) m as the arguments x, y, z, i, j and k of a plotly mesh."""
    x, y, z = corners.reshape(-1, 3).astype(np.float32).T
    first = 3 * np.arange(len(corners), dtype=np.int32)
    return {"x": x, "y": y, "z": z, "i": first, "j": first + 1, "k": first + 2}


def draped(seen: Seen, grid: HazardGrid) -> tuple[FloatArray, FloatArray]:
    """Return a hazard map draped over the terrain: corners (N, 3, 3) m and values (N,) of triangles.

    The triangles are lifted a little (`raised_by`); the values are as in `draped_facets`.
    """
    fine, values = draped_facets(grid, seen.vertices[seen.triangles])
    normal = np.cross(fine[:, 1] - fine[:, 0], fine[:, 2] - fine[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return fine + raised_by(seen) * normal[:, None, :], values


def raised_by(seen: Seen) -> float:
    """Return the height (m) above the ground at which hazard maps are drawn, so that the terrain does not hide them."""
    return max(LEAST_RAISED, RAISED * float(np.ptp(seen.vertices[:, :2], axis=0).max()))


def _paths(go: Any, run: RunFiles) -> Any:
    """Return the kept paths as one plotly line with gaps between the paths; go : module plotly.graph_objects."""
    parts = [run.paths.x[a:b] for a, b in zip(run.paths.starts[:-1], run.paths.starts[1:], strict=True)]
    gap = np.full((1, 3), np.nan)
    points = np.concatenate([part for path in parts for part in (path, gap)] or [gap]).astype(np.float32)
    return go.Scatter3d(
        x=points[:, 0], y=points[:, 1], z=points[:, 2], mode="lines", line={"color": PATH, "width": 1.5},
        name=f"paths ({len(parts):,} of {run.summary['rocks']:,} rocks)", connectgaps=False, hoverinfo="skip",
    )  # fmt: skip


def _critical(go: Any, run: RunFiles, critical: Key | None) -> Iterator[Any]:
    """Yield the path of the rock of the critical section as a plotly line; nothing if the path is not known.

    go : module plotly.graph_objects; critical : the rock, None without a critical section
    """
    path = None if critical is None else run.path_of(critical)
    if path is not None and critical is not None:
        x, y, z = path.T.astype(np.float32)
        yield go.Scatter3d(
            x=x, y=y, z=z, mode="lines", line={"color": CRITICAL, "width": 6}, hoverinfo="skip",
            name=f"rock that stopped farthest away ({critical[0]}, {critical[1]})",
        )  # fmt: skip


def _releases(go: Any, run: RunFiles) -> Any:
    some = np.unique(np.linspace(0, len(run.ends.release) - 1, 500).astype(np.int64))
    x, y, z = run.ends.release[some].T.astype(np.float32)
    marker = {"size": 2.5, "color": "#b3007a"}
    return go.Scatter3d(x=x, y=y, z=z, mode="markers", marker=marker, name="releases", hoverinfo="skip")


def _barriers(go: Any, run: RunFiles, seen: Seen) -> Iterator[Any]:
    """Yield the barriers of the scene: the panel of each as a wall on the ground, and its upper edge with its name.

    Barriers far from the rocks are left out.

    go : module plotly.graph_objects
    """
    gap = np.full((1, 3), np.nan)
    for panel in panels_of(run):
        height = height_of(panel)
        walls = [standing_wall(foot, height) for foot in draped_lines(seen.terrain, barrier_lines(run, panel))]
        for vertices, triangles in walls:
            (x, y, z), (i, j, k) = vertices.T.astype(np.float32), triangles.T
            yield go.Mesh3d(
                x=x, y=y, z=z, i=i, j=j, k=k, color=BARRIER, opacity=0.55, lighting=UNLIT, hoverinfo="skip",
                legendgroup=panel["name"],
            )  # fmt: skip
        if not walls:
            continue
        x, y, z = np.concatenate([part for wall in walls for part in (_top(wall), gap)]).T.astype(np.float32)
        names = [panel["name"], *[""] * (len(x) - 1)]
        yield go.Scatter3d(
            x=x, y=y, z=z, mode="lines+text", line={"color": BARRIER, "width": 5}, text=names,
            textposition="top center", textfont={"color": BARRIER, "size": 13}, legendgroup=panel["name"],
            name=f"barrier {panel['name']} ({height:g} m high)", connectgaps=False, hoverinfo="skip",
        )  # fmt: skip


def _top(wall: Wall) -> FloatArray:
    """Return the upper edge (P, 3) m of a wall."""
    return wall.vertices[len(wall.vertices) // 2 :]


def _areas(go: Any, run: RunFiles, seen: Seen, looking: FloatArray) -> Iterator[Any]:
    """Yield the outline of each area of interest as a plotly line with its name, just above the hazard maps.

    go : module plotly.graph_objects
    looking : (2,) unit vector in plan, the mean direction of the rocks; the name is at the point nearest to the eye
    """
    gap = np.full((1, 3), np.nan)
    for name, rings in run.areas.items():
        lines = draped_outlines(seen.terrain, rings, ABOVE_MAPS * raised_by(seen))
        if not lines:
            continue  # the area is far from the rocks
        points = np.concatenate([part for line in lines for part in (line, gap)]).astype(np.float32)
        nearest = int(np.nanargmax(points[:, :2] @ looking))
        yield go.Scatter3d(
            x=points[:, 0], y=points[:, 1], z=points[:, 2], mode="lines+text", line={"color": AREA, "width": 4},
            text=[name if row == nearest else "" for row in range(len(points))], textposition="top center",
            textfont={"color": AREA, "size": 13},
            name=f"area {name}", connectgaps=False, hoverinfo="skip",
        )  # fmt: skip


def _layout(run: RunFiles, seen: Seen, looking: FloatArray) -> dict[str, Any]:
    """Return the layout of the 3D view: equal scales on all axes, titles with the origin of the coordinates, camera.

    The legend is below the view, because it would hide the rocks in a narrow window. The eye is so far away that the
    whole terrain and the titles of its axes are in the view.

    looking : (2,) unit vector in plan, the mean direction of the rocks; the eye looks in the opposite direction
    """
    titles = [
        f"{axis} - {origin:,.0f} (m)" for axis, origin in zip(("E", "N", "z"), run.terrain.frame.origin, strict=True)
    ]
    axes = {f"{name}axis": {"title": {"text": title}, "backgroundcolor": "#f4f4f2", "gridcolor": "#dddddd"}
            for name, title in zip("xyz", titles, strict=True)}  # fmt: skip
    towards = np.array([1.2 * looking[0] + 0.35, 1.2 * looking[1] + 0.35, 0.7])
    sides = np.maximum(np.ptp(seen.vertices, axis=0), 1e-9)
    diagonal = float(np.linalg.norm(sides / np.cbrt(sides.prod())))  # in plotly's unit: a box of volume 1
    eye = EYE * diagonal * towards / np.linalg.norm(towards)
    camera = {"eye": dict(zip("xyz", eye.tolist(), strict=True)), "center": {"x": 0, "y": 0, "z": -LOWER * diagonal}}
    return {
        "scene": {**axes, "aspectmode": "data", "camera": camera, "dragmode": "turntable"},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "legend": {"x": 0.0, "y": 0.0, "yanchor": "top", "orientation": "h"}, "paper_bgcolor": "white",
    }  # fmt: skip
