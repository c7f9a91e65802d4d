"""The hazard of the terrain's facets in a recording: coloured meshes to switch on and off, and the bench table.

rerun colours vertices, not facets. So only the facets that rocks came to are drawn, parted where the colour changes, a
little above the terrain: each has exactly its own colour, and a recording of a large terrain grows by what was hit.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.hazard.benches import OPEN, TEXT_NOTE, bench_table, lost_in_words, text_header, text_rows, three_figures
from rpf3d_core.hazard.maps import FEWEST_ROCKS, HazardMaps, reach_probability
from rpf3d_core.hazard.raster import typical_size
from rpf3d_core.hazard.scales import Scale, Values, colours_at, places, reach_scale, scale_of_energy, value_at
from rpf3d_core.recordings.shapes import ColouredMesh, parted_mesh
from rpf3d_core.terrain.facets import Terrain

HAZARD, BENCHES = "world/hazard", "benches"
REACH, ENERGY = f"{HAZARD}/reach_probability", f"{HAZARD}/energy_p95"
"""Entities."""

STEPS = 24
"""Colours of a scale: steps that the eye cannot tell apart, and few enough to share most vertices."""

FEW_COLOUR = (125, 143, 179)
"""Facets that rocks came to, but too few for a percentile."""

LIFT = 2e-4
"""Height of a layer above the terrain, over the terrain's diagonal (-): enough for a depth buffer at arm's length from
the whole terrain; 0.4 m on a pit of 2 km."""

LEGEND_STEPS = 5
"""Values of a scale that the document tells the colours of."""

JOULE_PER_KJ = 1000.0


class Layer(NamedTuple):
    """One hazard of the S facets that rocks came to: its entity, its title, values (S,) with their scale, unit shown.

    per_unit : of the values' own unit in one of the unit shown
    """

    entity: str
    title: str
    values: Values
    scale: Scale
    unit: str
    per_unit: float


def hazard_layers(maps: HazardMaps) -> list[Layer]:
    """The layers of a recording, in the order in which they lie over the terrain."""
    share, energy = reach_probability(maps.facets, maps.flown), maps.facets.energy.p95
    return [
        Layer(REACH, "Reach probability", share, reach_scale(maps.flown, share), "%", 0.01),
        Layer(ENERGY, "Energy, p95", energy, scale_of_energy(energy), "kJ", JOULE_PER_KJ),
    ]


def log_hazard(recording: Any, terrain: Terrain, maps: HazardMaps) -> None:
    """Each layer as a mesh below `world/hazard`, and the bench table with the colours' meaning as `benches`."""
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
    """The facets that rocks came to in the colours of a layer, lifted by `number` times LIFT so that none hides."""
    place = places(layer.scale, layer.values)
    step = np.where(np.isnan(place), STEPS, np.clip(place * STEPS, 0, STEPS - 1)).astype(np.int64)
    mesh = parted_mesh(terrain.vertices, terrain.triangles[maps.facets.cell], step, _palette())
    low, high = terrain.vertices.min(axis=0), terrain.vertices.max(axis=0)
    lift = number * LIFT * float(np.linalg.norm(high - low))
    return mesh._replace(vertices=mesh.vertices + np.float32(lift) * mesh.normals)


def bench_document(terrain: Terrain, maps: HazardMaps, layers: list[Layer]) -> str:
    """Markdown: the printed bench table, and what the colours mean."""
    benches = bench_table(terrain, maps)
    parts = [
        f"# Benches\n{maps.flown:,} rocks; {TEXT_NOTE} (Wilson); {OPEN}. p95 energy is {maps.energy_kind}, of each "
        f"rock's largest there, and needs {FEWEST_ROCKS} rocks. All zones are in `hazard/benches.csv`.",
        _table([text_header(benches), *text_rows(benches)]),
        *([lost_in_words(maps.lost, maps.flown) + "."] if maps.lost else []),
        "# Colours\nOf facets that rocks came to, under `world/hazard`, from little to much:",
        _table([("layer", *_ordinals()), *(_legend(layer) for layer in layers)]),
        f"Reach probability is of a facet as a whole, so it grows with the facet: half of them are at least as large "
        f"as a square of {three_figures(math.sqrt(0.5) * typical_size(terrain))} m. Cells of the rasters in "
        f"`hazard/` have {maps.raster.cell:g} m.",
        f"Blue-grey facets were reached by fewer than {FEWEST_ROCKS} rocks: too few for a percentile. The layers lie a "
        "little above the terrain, so that they can be seen.",
    ]
    return "\n\n".join(parts)


def _palette() -> NDArray[np.uint8]:
    """Colours (STEPS + 1, 3) of the steps, and of too few rocks."""
    return np.vstack([colours_at((np.arange(STEPS) + 0.5) / STEPS), np.array([FEW_COLOUR], dtype=np.uint8)])


def _ordinals() -> list[str]:
    """The colours of the legend by name: markdown in the viewer has no colours."""
    return ["pale yellow", "orange", "orange red", "crimson", "dark purple"]


def _legend(layer: Layer) -> tuple[str, ...]:
    """The values at evenly spaced colours."""
    values = (value_at(layer.scale, step / (LEGEND_STEPS - 1)) / layer.per_unit for step in range(LEGEND_STEPS))
    return (layer.title, *(f"{three_figures(value)} {layer.unit}" for value in values))


def _table(rows: list[tuple[str, ...]]) -> str:
    """Rows as a markdown table, the first of them its header."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
