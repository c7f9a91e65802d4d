"""Write the hazard maps of the terrain's facets to a recording, as coloured meshes, with the bench table.

rerun colours vertices, not facets. Each hazard map is therefore a separate mesh, slightly above the terrain, with
duplicated vertices where the colour changes. Each facet then has exactly its own colour. The mesh has only the
facets that rocks reached, so the size of the recording depends on these facets and not on the whole terrain.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.hazard.benches import OF_SOURCES, lost_in_words, notes_of, text_header, text_rows
from rpf3d_core.hazard.by_source.each_source import worst_benches
from rpf3d_core.hazard.maps import FEWEST_ROCKS, HazardMaps, reach_probability
from rpf3d_core.hazard.raster import typical_size
from rpf3d_core.hazard.scales import (
    FEW_COLOUR,
    Scale,
    Values,
    colours_at,
    places,
    reach_scale,
    scale_of_energy,
    value_at,
)
from rpf3d_core.recordings.shapes import ColouredMesh, parted_mesh
from rpf3d_core.terrain.facets import Terrain

HAZARD, BENCHES = "world/hazard", "benches"
REACH, ENERGY = f"{HAZARD}/reach_probability", f"{HAZARD}/energy_p95"
"""Names of the meshes of the hazard maps in the recording."""

STEPS = 24
"""Number of colours of a hazard map: many enough to look continuous, few enough for most facets to share vertices."""

LIFT = 2e-4
"""Height of a hazard map above the terrain (-), as a share of the terrain's diagonal: 0.4 m on a pit of 2 km.

The height is enough for the viewer's depth buffer when the whole terrain is in view.
"""

LEGEND_STEPS = 5
"""Number of values in the colour legend of the document; the legend names the colour of each value."""

JOULE_PER_KJ = 1000.0


class Layer(NamedTuple):
    """One hazard map of the S facets that rocks reached: its values, colour scale and unit.

    entity : name of the mesh in the recording
    values : (S,) in SI units; scale : colour scale of `values`; unit : the unit shown
    per_unit : number of SI units in one unit shown, such as 1000 for kJ
    """

    entity: str
    title: str
    values: Values
    scale: Scale
    unit: str
    per_unit: float


def hazard_layers(maps: HazardMaps) -> list[Layer]:
    """Return the hazard maps of a recording, in the order of their heights above the terrain, lowest first."""
    share, energy = reach_probability(maps.facets, maps.flown), maps.facets.energy.p95
    return [
        Layer(
            entity=REACH,
            title="Reach probability",
            values=share,
            scale=reach_scale(maps.flown, share),
            unit="%",
            per_unit=0.01,
        ),
        Layer(
            entity=ENERGY,
            title="Energy, p95",
            values=energy,
            scale=scale_of_energy(energy),
            unit="kJ",
            per_unit=JOULE_PER_KJ,
        ),
    ]


def log_hazard(recording: Any, terrain: Terrain, maps: HazardMaps) -> None:
    """Write each hazard map as a mesh under `world/hazard`, and the bench table with the colour legend as `benches`."""
    import rerun as rr

    layers = hazard_layers(maps)
    for number, layer in enumerate(layers, start=1):
        mesh = hazard_mesh(terrain, maps, layer, number)
        if len(mesh.triangles) == 0:
            continue
        shape = rr.Mesh3D(
            vertex_positions=mesh.vertices,
            triangle_indices=mesh.triangles,
            vertex_normals=mesh.normals,
            vertex_colors=mesh.colours,
        )
        recording.log(layer.entity, shape, static=True)
    text = bench_document(terrain, maps, layers)
    recording.log(BENCHES, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def hazard_mesh(terrain: Terrain, maps: HazardMaps, layer: Layer, number: int) -> ColouredMesh:
    """Return the mesh of one hazard map: the reached facets in the map's colours, lifted above terrain and lower maps.

    number : number of the map, from 1; the map is lifted by `number` times LIFT (2e-4) times the diagonal of the
        terrain's box
    """
    place = places(layer.scale, layer.values)
    step = np.where(np.isnan(place), STEPS, np.clip(place * STEPS, 0, STEPS - 1)).astype(np.int64)
    mesh = parted_mesh(terrain.vertices, terrain.triangles[maps.facets.cell], step, _palette())
    low, high = terrain.vertices.min(axis=0), terrain.vertices.max(axis=0)
    lift = number * LIFT * float(np.linalg.norm(high - low))
    return mesh._replace(vertices=mesh.vertices + np.float32(lift) * mesh.normals)


def bench_document(terrain: Terrain, maps: HazardMaps, layers: list[Layer]) -> str:
    """Return the bench table and the colour legend as a Markdown document for the viewer."""
    benches, (note, still_open) = worst_benches(terrain, maps), notes_of(maps)
    file = "benches" if maps.sources is None else "sources"
    parts = [
        f"# Benches\n{maps.flown:,} rocks; {note} (Wilson); {still_open}. p95 energy is {maps.energy_kind}, of each "
        f"rock's largest there, and needs {FEWEST_ROCKS} rocks. All zones are in `hazard/{file}.csv`.",
        _table([text_header(benches), *text_rows(benches)]),
        *([] if maps.sources is None else [f"{OF_SOURCES[:1].upper()}{OF_SOURCES[1:]}."]),
        *([lost_in_words(maps.lost, maps.flown) + "."] if maps.lost else []),
        "# Colours\nColours of the facets that rocks reached, under `world/hazard`, from low to high:",
        _table([("layer", *_ordinals()), *(_legend(layer) for layer in layers)]),
        f"Reach probability is of a facet as a whole, so it grows with the facet: half of them are at least as large "
        f"as a square of {three_figures(math.sqrt(0.5) * typical_size(terrain))} m. Cells of the rasters in "
        f"`hazard/` have {maps.raster.cell:g} m.",
        f"Blue-grey facets were reached by fewer than {FEWEST_ROCKS} rocks: too few for a percentile. The layers lie a "
        "little above the terrain, so that they can be seen.",
    ]
    return "\n\n".join(parts)


def _palette() -> NDArray[np.uint8]:
    """Return the colours (STEPS + 1, 3) of a hazard map: from low to high values, then the colour for too few rocks."""
    return np.vstack([colours_at((np.arange(STEPS) + 0.5) / STEPS), np.array([FEW_COLOUR], dtype=np.uint8)])


def _ordinals() -> list[str]:
    """Return the legend's colours in words, from low to high values, because the viewer's Markdown shows no colours."""
    return ["pale yellow", "orange", "orange red", "crimson", "dark purple"]


def _legend(layer: Layer) -> tuple[str, ...]:
    """Return a row of the colour legend: the title of a hazard map, and its values at evenly spaced colours."""
    values = (value_at(layer.scale, step / (LEGEND_STEPS - 1)) / layer.per_unit for step in range(LEGEND_STEPS))
    return (layer.title, *(f"{three_figures(value)} {layer.unit}" for value in values))


def _table(rows: list[tuple[str, ...]]) -> str:
    """Return rows of text as a Markdown table; the first row is the header. A `|` in a name ends no cell."""
    bar = r"\|"
    lines = [f"| {' | '.join(text.replace('|', bar) for text in row)} |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
