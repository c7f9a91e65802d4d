"""Make the shapes of a scene's rocks, from files or from a family, and the rocks with these shapes."""

import numpy as np

from rpf3d_core.ensemble.bodies import DrawnBody
from rpf3d_core.ensemble.sizes import AnyRock
from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.shapes import ShapeSpec
from rpf3d_core.setup.sources import rock_of, rocks_of_sources
from rpf3d_core.shapes.block_files import read_block
from rpf3d_core.shapes.families import box, family
from rpf3d_core.shapes.polyhedron import Polyhedron
from rpf3d_core.shapes.table import ShapeTable, shape_table


def polyhedra_of(scene: Scene) -> tuple[list[Polyhedron], list[str]]:
    """Return the polyhedra of a scene's rocks, and the findings about their files as sentences.

    Both lists are empty for points and spheres.

    Raises
    ------
    InputError
        A file has no usable block; the message names the key.
    """
    shape = scene.rock.shape
    if shape is None:
        return [], []
    if shape.box is not None:
        return [box(shape.box)], []
    if shape.family is not None:
        return [family(shape.family)], []
    found = [_block(scene, shape, number) for number in range(len(shape.files or ()))]
    return [block for block, _ in found], [sentence for _, sentences in found for sentence in sentences]


def _block(scene: Scene, shape: ShapeSpec, number: int) -> tuple[Polyhedron, list[str]]:
    """Return the convex polyhedron from one file of a scene, and sentences on what was found in the file.

    number : index of the file in `rock.shape.files`
    """
    path, key = (shape.files or ())[number], f"`rock.shape.files[{number}]`"
    try:
        block, findings = read_block(path, shape.corners)
    except InputError as fault:
        raise InputError(f"{scene.path}: {key} names a file that cannot be used: {fault}") from fault
    return block, [f"{key}: {sentence}" for sentence in findings]


def table_of(scene: Scene) -> ShapeTable:
    """Return the shapes of a scene's rocks as compiled code reads them.

    Raises
    ------
    InputError
        A file has no usable block; the message names the key.
    """
    polyhedra, _ = polyhedra_of(scene)
    return shape_table(polyhedra, weights_of(scene, len(polyhedra)))


def weights_of(scene: Scene, shapes: int) -> tuple[float, ...]:
    """Return the weight of each of a scene's shapes: how often the shape is drawn, relative to the other shapes.

    shapes : number of shapes
    """
    given = scene.rock.shape.weights if scene.rock.shape else None
    return given or (1.0,) * shapes


def rock_of_scene(scene: Scene) -> AnyRock:
    """Return the rocks of a scene: one rock for all or for each source, or distributions of size and shape.

    Raises
    ------
    InputError
        A file has no usable block; the message names the key.
    """
    if not scene.rock.is_body:
        return rocks_of_sources(scene) or rock_of(scene.rock)
    polyhedra, _ = polyhedra_of(scene)
    table = shape_table(polyhedra, weights_of(scene, len(polyhedra)))
    return DrawnBody(
        density=scene.rock.density,
        size=rocks_of_sources(scene),
        volumes=np.array([polyhedron.volume for polyhedron in polyhedra]),
        shares=table.shares,
    )
