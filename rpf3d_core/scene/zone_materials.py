"""Find the material of each zone of the terrain: by the zone's name, by a pattern, or by default."""

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase

from rpf3d_core.errors import SceneError
from rpf3d_core.formats.yaml import place_in_file
from rpf3d_core.scene.material import POINT_KEYS, Material
from rpf3d_core.scene.model import Scene

BEGIN = re.compile(r"([^\W\d_]+)_?")
"""Pattern of the first word of the name of a zone (letters only), with the underscore that follows it."""
WILD = frozenset("*?[")
"""Characters that make the name of a material a pattern of zones."""
MOST_NAMED = 12
"""Largest number of zones that a message lists, because a pit has dozens of zones."""


def material_of(scene: Scene, zone: str) -> Material:
    """Return the material of a zone: by exact name, else by the first matching pattern in the file, else `default`.

    For a part of a split zone, the order is: name of the part, name of the whole zone, first pattern that fits the
    part, first pattern that fits the whole zone, `default`.

    Raises
    ------
    SceneError
        No name or pattern in the scene's materials fits the zone.
    """
    return scene.materials[name_of_material(scene, zone)]


def name_of_material(scene: Scene, zone: str) -> str:
    """Return the key in `materials` of the material of a zone: the zone's name, a pattern, or `default`.

    Raises
    ------
    SceneError
        No name or pattern in the scene's materials fits the zone.
    """
    whole = _whole(scene, zone)
    fitting = (pattern for each in (zone, whole) for pattern in scene.materials if fnmatchcase(each, pattern))
    name = zone if zone in scene.materials else whole if whole in scene.materials else next(fitting, "default")
    if name in scene.materials:
        return name
    known, place = ", ".join(scene.materials), place_in_file(scene.path, ("materials",))
    raise SceneError(
        f"{place}: no material for the zone {zone!r}; materials has {known}: add {zone!r} or `default`"
    )


def _whole(scene: Scene, zone: str) -> str:
    """Return the name of the zone from which `terrain.split` made a part; the same name if the zone is not a part.

    zone : name of a zone or of a part, such as `bench_2`
    """
    name, _, number = zone.rpartition("_")
    return name if number.isdigit() and name in (scene.terrain.split or ()) else zone


def without_friction(scene: Scene, zones: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the materials for which the scene states no friction angle; () if no model needs the angle.

    zones : names of the zones of the terrain; materials that no zone uses are left out

    Raises
    ------
    SceneError
        No name or pattern in the scene's materials fits a zone.
    """
    if not _asks_friction(scene):
        return ()
    names = dict.fromkeys(name_of_material(scene, zone) for zone in zones)
    return tuple(name for name in names if "friction_angle_deg" not in scene.materials[name].model_fields_set)


def _asks_friction(scene: Scene) -> bool:
    """Return True if a model of the scene uses the friction angle of its materials."""
    return scene.impact_model.model_spec.asks_friction or scene.ground_model.model_spec.asks_friction


def used_coefficients(scene: Scene, material: Material) -> tuple[str, ...]:
    """Return the keys of the coefficients of a material that the models of the scene use.

    A key with a default, such as rolling friction 0, is included even if the material does not state the key.
    """
    if material.is_of_a_body:
        return ("restitution", "friction" if material.slip_friction is None else "slip_friction", "rolling_resistance")
    rolls = scene.rock.is_sphere or "rolling_friction" in scene.ground_model.model_spec.MATERIAL_KEYS
    idle = {*scene.impact_model.model_spec.idle_keys, *(() if _asks_friction(scene) else ("friction_angle_deg",)),
            *(() if rolls else ("rolling_friction",))}  # fmt: skip
    return tuple(key for key in POINT_KEYS if key not in idle)


def words_on_friction(materials: Sequence[str]) -> str:
    """Return a warning about materials that use the default friction angle."""
    default = Material.model_fields["friction_angle_deg"].default
    return f"`friction_angle_deg` is not given for {', '.join(materials)}: the default of {default:g} degrees is used"


def unused_materials(scene: Scene, zones: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return, for each material that no zone uses, the materials that are used in the zones that it fits (all by name).

    A material fits a zone if its name or pattern matches the zone, or the zone of which this zone is a part. The tuple
    of a material is empty if it fits no zone.

    zones : names of the zones that have facets

    Raises
    ------
    SceneError
        No name or pattern in the scene's materials fits a zone.
    """
    chosen = {zone: name_of_material(scene, zone) for zone in zones}
    idle = [name for name in scene.materials if name not in chosen.values()]
    return {name: tuple(dict.fromkeys(chosen[zone] for zone in zones if _fits(scene, zone, name))) for name in idle}


def _fits(scene: Scene, zone: str, name: str) -> bool:
    """Return True if a zone, or the zone of which it is a part, fits the name or pattern of a material."""
    return any(fnmatchcase(each, name) or each == name for each in (zone, _whole(scene, zone)))


def words_on_unused(scene: Scene, zones: Sequence[str]) -> Iterator[str]:
    """Yield a warning for each material other than `default` that no zone has; zones : as in `unused_materials`."""
    for name, hiding in unused_materials(scene, zones).items():
        if name == "default":
            continue
        patterns = [each for each in hiding if not WILD.isdisjoint(each)]
        shown = ", ".join(f"`{each}`" for each in (patterns or hiding)[:MOST_NAMED])
        if not hiding:
            why = "no triangle is in a zone that it fits; remove it"
        elif patterns:
            why = f"its zones have the material of {shown}, the first pattern that fits; write {name!r} before {shown}"
        else:
            why = f"each of its zones has a material of its own name ({shown}); remove it"
        yield f"`materials.{name}` is not used: {why}"


def zone_meant(name: str, zones: Sequence[str]) -> str | None:
    """Return the zone, or the pattern of zones, that a name in a scene probably means; None if none is similar.

    Capital letters and the plural of the first word make no difference: `face_*` probably means `FACES_*`, the layers
    of many drawings. If the name has only one word, and several zones begin with this word, the result is a pattern of
    zones.

    name : name or pattern that fits no zone
    """
    word = BEGIN.fullmatch(name.rstrip("*"))
    same = [] if word is None else [zone for zone in zones if _kind(zone) == _kind(name)]
    if len(same) > 1:
        return f"{min(map(_begin, same), key=len)}*"
    lower = {zone.lower(): zone for zone in zones}
    near = get_close_matches(name.lower(), lower, n=1)
    return same[0] if same else lower[near[0]] if near else None


def _kind(name: str) -> str:
    """Return the first word of a zone's name in small letters and in the singular, such as "face" for `FACES_N`."""
    return _begin(name).rstrip("_").lower().removesuffix("s")


def _begin(name: str) -> str:
    """Return the first word of a zone's name, with the underscore after it; "" if the name begins with no letter."""
    found = BEGIN.match(name)
    return "" if found is None else found[0]


def check_materials(scene: Scene, zones: Sequence[str]) -> None:
    """Raise a SceneError for a material other than `default` whose name or pattern fits no zone of the terrain.

    Raises
    ------
    SceneError
        A material fits no zone; the message names it and the nearest zone, or the existing zones.
    """
    for name in scene.materials:
        known = (*zones, *(scene.terrain.split or ()))
        if name == "default" or any(zone == name or fnmatchcase(zone, name) for zone in known):
            continue
        near = zone_meant(name, tuple(dict.fromkeys((*(scene.terrain.split or ()), *zones))))
        shown = ", ".join(zones[:MOST_NAMED]) + (", ..." if len(zones) > MOST_NAMED else "")
        advice = f"did you mean {near!r}?" if near else f"the zones are {shown}; correct it, or remove it"
        place = place_in_file(scene.path, ("materials", name))
        raise SceneError(f"{place}: `materials.{name}` fits no zone of the terrain; {advice}")
