"""Warn about lines and polygons from DXF files with several layers: the scene uses all of them."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.formats.commands import path_in_a_command
from rpf3d_core.formats.polylines import layers_of_lines
from rpf3d_core.scene.model import Scene

MOST_LAYERS = 8
"""Largest number of layers that a warning names."""


class Use(NamedTuple):
    """One use of a file of lines or polygons in a scene.

    place : key and name, for a message; content : value of the key, a path or the points themselves
    kind : "line" or "polygon"; wanted : what the geometries should be, in the plural, such as "crests"
    out : name, without extension, of the new file in the suggested command
    """

    place: str
    content: object
    kind: str
    wanted: str
    out: str


def warnings_of_layers(scene: Scene) -> Iterator[str]:
    """Yield a warning for each source, area, zone, berm or barrier that uses several layers of a DXF file."""
    for use in _uses(scene):
        if isinstance(use.content, Path) and len(layers := layers_of_lines(use.content)) > 1:
            yield f"{use.place} {_in_words(use, use.content, layers, scene.path.parent)}"


def _uses(scene: Scene) -> Iterator[Use]:
    """Yield all uses of lines and polygons in a scene."""
    for number, source in enumerate(scene.sources):
        place = f"`sources[{number}].{{}}` of {source.name!r}"
        yield Use(place.format("line"), source.line, "line", "crests", "crests")
        yield Use(place.format("polygon"), source.polygon, "polygon", "polygons of the source", source.name)
    for number, area in enumerate(scene.areas_of_interest):
        place = f"`areas_of_interest[{number}].polygons` of {area.name!r}"
        yield Use(place, area.polygons, "polygon", "polygons of the area", area.name)
    for number, zone in enumerate(scene.zones):
        place = f"`zones[{number}].polygons` of {zone.zone!r}"
        yield Use(place, zone.polygons, "polygon", "polygons of the zone", zone.zone)
    for number, berm in enumerate(scene.terrain.berms):
        place = f"`terrain.berms[{number}].along` of {berm.name!r}"
        yield Use(place, berm.along, "line", "lines of the berm", berm.name)
    barriers = scene.effects.barriers
    for number, panel in enumerate(() if barriers is None else barriers.panels):
        place = f"`effects.barriers.panels[{number}].along` of {panel.name!r}"
        yield Use(place, panel.along, "line", "lines of the barrier", panel.name)


def _in_words(use: Use, path: Path, layers: dict[str, int], folder: Path) -> str:
    """Return the end of a warning on a file with lines on several layers, with the command that writes one layer.

    layers : number of lines, by layer; folder : of the scene, for the new file with this layer
    """
    named = [f"{layer} ({lines:,})" for layer, lines in list(layers.items())[:MOST_LAYERS]]
    more = f" and {len(layers) - len(named):,} more" if len(layers) > len(named) else ""
    out = folder / (re.sub(r"[^\w-]+", "_", use.out) + ".geojson")
    return (
        f"uses all {sum(layers.values()):,} {use.kind}s of its file, on {len(layers):,} layers: "
        f"{', '.join(named)}{more}; if some are no {use.wanted}, write the layer of the {use.wanted} to a file of its "
        f"own: rpf3d import layer {path_in_a_command(path)} --kind {use.kind} --layer LAYER --out "
        f"{path_in_a_command(out)}"
    )
