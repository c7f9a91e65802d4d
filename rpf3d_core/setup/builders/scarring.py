"""Build the effect scarring of a scene (soft ground that slows rocks), with parameters for each zone."""

from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from rpf3d_core.effects.scarring import Scarring
from rpf3d_core.errors import SceneError
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.scarring import ScarringSpec
from rpf3d_core.terrain.facets import Terrain

HARD = {"form_drag": 0.0, "soil_drag": 0.0, "mu_min": 0.0, "mu_max": 0.0}
"""Parameters of a zone with hard ground, which does not slow rocks."""


def scarring(spec: ScarringSpec, scene: Scene, terrain: Terrain) -> Scarring:
    """Return the parameters of soft ground for each zone, in the form that the flight loops read.

    Raises
    ------
    SceneError
        A name fits no zone of the terrain, or friction decreases as a rock slips; the message names the key.
    """
    for name in spec.zones:
        if not any(zone == name or fnmatchcase(zone, name) for zone in terrain.zones):
            raise SceneError(f"{scene.path}: `effects.scarring.zones.{name}` fits no zone of the terrain")
    rows = [ground_of_zone(spec, zone) for zone in terrain.zones]
    for zone, row in zip(terrain.zones, rows, strict=True):
        if row["mu_max"] < row["mu_min"]:
            found = f"is {row['mu_max']:g} in zone {zone!r}, but must be at least mu_min, {row['mu_min']:g}"
            raise SceneError(f"{scene.path}: `effects.scarring.mu_max` {found}")
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    drag = columns.pop("form_drag") + columns.pop("soil_drag")
    if scene.rock.is_body:  # contacts of bodies have their own friction
        columns |= {name: np.zeros(len(rows)) for name in spec.REPLACED_FOR_BODIES}
    return Scarring(drag=drag, **columns)


def ground_of_zone(spec: ScarringSpec, zone: str) -> dict[str, Any]:
    """Return the parameters of soft ground for a zone: by its exact name, else by the first pattern that fits.

    Without `zones`, all zones have the parameters of the effect. With `zones`, a zone that fits no name is hard ground,
    which does not slow rocks (HARD).
    """
    everywhere = {name: getattr(spec, name) for name in type(spec).model_fields if name != "zones"}
    if not spec.zones:
        return everywhere
    fitting = [zone] if zone in spec.zones else [name for name in spec.zones if fnmatchcase(zone, name)]
    if not fitting:
        return everywhere | HARD
    return everywhere | spec.zones[fitting[0]].model_dump(exclude_none=True)
