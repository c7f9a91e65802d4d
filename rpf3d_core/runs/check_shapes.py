"""Describe the shapes of a scene's rocks for the report of `rpf3d check`."""

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.scene.measured import MeasuredList
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.shapes import polyhedra_of, weights_of
from rpf3d_core.shapes.polyhedron import Polyhedron

UNITS = {"diameter": "m", "mass": "kg", "volume": "m3"}
"""Unit of each measure of a rock's size in a scene."""


def shapes_in_words(scene: Scene) -> tuple[str, ...]:
    """Return a sentence for each shape of a scene's rocks, then sentences on the shapes' files.

    The result is empty for points and spheres.

    A sentence states the volume (m3) only if the rocks have the size of their box or file. If the scene states a size,
    the volume of the shape is not the volume of the rocks.

    Raises
    ------
    InputError
        The file of a shape cannot be used.
    """
    polyhedra, findings = polyhedra_of(scene)
    weights = weights_of(scene, len(polyhedra))
    total = sum(weights)
    shares = [weight / total for weight in weights]
    sizes = zip(polyhedra, shares, strict=True)
    return (*(_describe(block, share, scene.rock.has_own_size) for block, share in sizes), *findings)


def measured_sizes(scene: Scene) -> tuple[str, ...]:
    """Return a sentence for each file of measured sizes: its column, unit and range; equal sentences only once."""
    sizes = [(getattr(each, measure), measure, unit)
             for each in (scene.rock, *scene.sources) for measure, unit in UNITS.items()]  # fmt: skip
    found = (size.describe(measure, unit) for size, measure, unit in sizes if isinstance(size, MeasuredList))
    return tuple(dict.fromkeys(sentence for sentence in found if sentence))


def _describe(block: Polyhedron, share: float, own_size: bool) -> str:
    """Return the sentence on a shape: its name, corners, faces, volume (m3) and share of the rocks.

    share : of the rocks (-); own_size : True if rocks have the size of the shape, so that its volume is stated
    """
    text = f"{block.name}, {len(block.corners)} corners, {len(block.faces)} faces"
    if own_size:
        text += f", {three_figures(block.volume)} m3"
    return text if share == 1.0 else f"{text}, {100.0 * share:.3g} % of the rocks"
