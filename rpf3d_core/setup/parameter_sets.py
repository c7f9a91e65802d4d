"""Build the flight settings of a parameter set: the materials and models with the values of the set.

All parameter sets of a run share the terrain and the compiled loop.
"""

from typing import Any, Protocol

from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.materials.library import Materials
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import check_may_be_unknown
from rpf3d_core.setup.named import models_of
from rpf3d_core.setup.prepared import scene_drawn_materials, scene_materials, scene_settings
from rpf3d_core.terrain.facets import Terrain

OF_THE_GROUND = ("materials", "stop_speed")
"""First keys of key paths that change materials only; other paths, and paths with `slip_friction`, change models."""


class Ready(Protocol):
    """The parts of a prepared scene that `flight_of_set` needs; `setup.prepared.Prepared` has them."""

    @property
    def scene(self) -> Scene:
        """The scene in which a parameter set replaces values."""

    @property
    def terrain(self) -> Terrain:
        """The terrain over which the parameter sets fly, with its zones."""

    @property
    def flight(self) -> Flight:
        """The flight settings (materials, settings, models) with the values of the scene, without a parameter set."""


def check_names(scene: Scene, names: tuple[str, ...]) -> None:
    """Refuse key paths that a parameter set cannot change, such as key paths of the terrain, releases or obstacles.

    Raises
    ------
    InputError
        A key path does not begin with a key in `scene.unknowns.ROOTS`, or belongs to an effect with obstacles, such as
        trees. The message names the key path.
    """
    for name in names:
        check_may_be_unknown(scene, name)


def flight_of_set(prepared: Ready, values: dict[str, float], drawn: bool | None = None) -> Flight:
    """Return the flight settings of a parameter set: materials, settings and models with the values of the set.

    The terrain is not read again. Models are built again only if a value changes one of them. No loop is compiled here:
    all parameter sets with materials of the same form use the same compiled loop.

    values : values by key path, as from `ParameterSets.at`
    drawn : form of the materials, for which the loop is compiled: True for the form with random coefficients, even if
        all coefficients are fixed; False for the form that the values need; None for the form of the prepared scene

    Raises
    ------
    InputError
        A parameter set cannot change a key path, a key path leads to no value, or a value is refused. The message names
        the key path.
    """
    check_names(prepared.scene, tuple(values))
    scene, zones = with_values(prepared.scene, values), prepared.terrain.zones
    fixed = isinstance(prepared.flight.materials, Materials) if drawn is None else not drawn
    materials: Any = scene_materials(scene, zones) if fixed else scene_drawn_materials(scene, zones)
    changed = any(_is_of_a_model(name) for name in values)
    models = models_of(scene, prepared.terrain) if changed else prepared.flight.models
    return Flight(materials=materials, settings=scene_settings(scene), models=models)


def _is_of_a_model(name: str) -> bool:
    """Return True if a key path changes a model, so that the models of a scene must be built again.

    `slip_friction` of a material counts too, because it is part of the contact model of bodies.

    name : a key path
    """
    keys = name.split(".")
    return keys[0] not in OF_THE_GROUND or "slip_friction" in keys
