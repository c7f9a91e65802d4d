"""The library of ground materials in a scene: `{library: hoek_bedrock}` gives a material the ranges of an entry.

Each range of the entry becomes an unknown of the scene (`scene.unknowns`), unless the material gives the coefficient.
If the models of the scene use a coefficient that the entry does not have, the range of this coefficient is assumed
(`_assumed_for`). A prior in `unknowns.priors` of the file, also a prior with `*`, replaces the range of the entry.
"""

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from rpf3d_core.scene.releases import RockSpec
from rpf3d_core.scene.shapes import is_point, names_sphere
from rpf3d_core.scene.unknowns import PRIOR, PriorSpec
from rpf3d_core.scene.values import refuse

LIMITED, SLIDING = "coulomb_limited", "sliding"
"""Names of the default rebound model and of the default ground model of points, which use the friction angle."""
LIBRARY = "library"
"""Key of a material that names an entry of the library of ground materials."""


def with_libraries(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the values of a scene in which materials that name a library entry have the ranges of the entry as priors.

    values : values of the scene by key of the top level, before pydantic checks them

    Raises
    ------
    PydanticCustomError
        There is no such entry, or the entry is for another kind of rocks; the error names the key.
    """
    materials = values.get("materials")
    if not isinstance(materials, Mapping) or not any(map(_names_an_entry, materials.values())):
        return values
    return {
        **values,
        "materials": {
            name: _with_entry(material, values, str(name)) if _names_an_entry(material) else material
            for name, material in materials.items()
        },
    }


def _with_entry(material: Mapping[str, Any], scene: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return a material with the ranges of its library entry as priors; coefficients that the material states stay.

    If the scene has its own prior for a coefficient, the material has the middle of the entry's range as a placeholder.
    A material with `slip_friction` does not take the `friction` of the entry.

    scene : values of the scene; name : name of the material
    """
    own = _own_priors(scene)
    ranges = _ranges(material[LIBRARY], scene, name)
    if "slip_friction" in material:
        ranges.pop("friction", None)
    replaced = [key for key in ranges if not own.isdisjoint({f"materials.{name}.{key}", f"materials.*.{key}"})]
    return {**ranges, **{key: _middle(ranges[key]) for key in replaced}, **material}


def _own_priors(scene: Mapping[str, Any]) -> set[str]:
    """Return the key paths of the priors that a scene file gives in `unknowns.priors`.

    The result is empty for values of a scene that was already read: its `unknowns` is an object that also contains the
    priors of library entries, and its materials already have a number in place of each prior.
    """
    unknowns = scene.get("unknowns")
    priors = unknowns.get("priors") if isinstance(unknowns, Mapping) else None
    return {str(path) for path in priors} if isinstance(priors, Mapping) else set()


def _middle(coefficient: Any) -> Any:
    """Return the number that replaces a coefficient with a range until a prior sets the value of the coefficient.

    The number is the mean of the range if the source gives a mean, else the middle of the range.

    coefficient : `{prior: ...}`, or a plain number, which is returned unchanged
    """
    if not isinstance(coefficient, Mapping):
        return coefficient
    prior = coefficient[PRIOR]
    return prior.get("mean", 0.5 * (prior["min"] + prior["max"]))


def ranges_of(name: Any, scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the published and assumed ranges of a library entry, by key of a material; {} if there is no such entry.

    A known value is a plain number in place of a range.

    scene : `rock`, `rebound` and `ground` of a scene, which decide which ranges are assumed
    """
    from rpf3d_core.scene.library_entries import UNSTATED  # imported only if a scene names an entry

    published = published_ranges(name)
    return {**{key: UNSTATED[key] for key in _assumed_for(scene)}, **published} if published else {}


def models_of(scene: Any) -> Mapping[str, Any]:
    """Return rocks, rebound model and ground model of a scene, by key; they decide which coefficients a run uses."""
    return {"rock": scene.rock, "rebound": scene.rebound, "ground": scene.ground}


def published_ranges(name: Any) -> Mapping[str, Any]:
    """Return the ranges of a library entry from its source, by key of a material; {} if there is no such entry.

    A known value is a plain number in place of a range.
    """
    from rpf3d_core.scene.library_entries import ENTRIES  # imported only if a scene names an entry

    return ENTRIES[name].ranges if isinstance(name, str) and name in ENTRIES else {}


def keys_of_entry(material: Any, name: str, priors: Mapping[str, PriorSpec], scene: Mapping[str, Any]) -> set[str]:
    """Return the keys of the coefficients that a checked material took from its library entry.

    A coefficient for which the scene gives another number or range than the entry is not included.

    material : a material that names an entry; name : its name; priors : priors of the scene, by key path
    scene : as in `ranges_of`
    """
    return {
        key
        for key, span in ranges_of(material.library, scene).items()
        if _is_of_entry(span, getattr(material, key), priors.get(f"materials.{name}.{key}"))
    }


def _is_of_entry(span: Any, value: Any, prior: PriorSpec | None) -> bool:
    """Return True if the scene has the coefficient of a library entry unchanged.

    span : coefficient of the entry, a number or a range
    value : number of the coefficient in the scene, compared if the entry has a number
    prior : prior of the coefficient in the scene, or None; compared if the entry has a range
    """
    if isinstance(span, float):
        return bool(value == span)
    return prior is not None and prior == PriorSpec.model_validate(_as_prior(span)[PRIOR])


def _names_an_entry(material: Any) -> bool:
    return isinstance(material, Mapping) and material.get(LIBRARY) is not None


def _has_shape(rock: Any) -> bool:
    """Return True if the rocks are bodies with a shape, neither points nor spheres; rock : value of the key `rock`."""
    if isinstance(rock, RockSpec):
        return rock.is_body
    return isinstance(rock, Mapping) and not is_point(rock.get("shape")) and not names_sphere(rock)


def _ranges(name: Any, scene: Mapping[str, Any], material: str) -> dict[str, Any]:
    """Return the coefficients of a library entry as a scene states them: plain numbers, or `{prior: ...}` for ranges.

    Raise a PydanticCustomError if there is no such entry, or if the entry is for another kind of rocks.

    name : name of the entry; scene : values of the scene; material : name of the material, for the error
    """
    from rpf3d_core.scene.library_entries import BODIES, ENTRIES, POINTS, UNSTATED  # imported only if one is named

    kind = BODIES if _has_shape(scene.get("rock")) else POINTS
    at = ("materials", material, LIBRARY)
    if not isinstance(name, str) or name not in ENTRIES:
        near = get_close_matches(str(name), ENTRIES, n=1)
        advice = f"did you mean {near[0]}?" if near else "`rpf3d materials` lists the entries"
        raise refuse(f"is {name!r}, which is not an entry of the library; {advice}", *at)
    entry = ENTRIES[name]
    if entry.kind != kind:
        raise refuse(f"is {name}, which is for {entry.kind}, but the rocks of this scene are {kind}", *at)
    assumed = {key: UNSTATED[key] for key in _assumed_for(scene)}
    return {key: _as_prior(span) for key, span in {**assumed, **entry.ranges}.items()}


def _assumed_for(scene: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the keys of the coefficients whose range is assumed if an entry has none, because the models need them.

    For points, this is the friction angle if the rebound model is LIMITED or the ground model is SLIDING. No rolling
    friction is assumed for points: a scene whose ground model needs it is refused if neither the entry nor the material
    has it.
    """
    rocks = scene.get("rock")
    if _has_shape(rocks):
        return ("rolling_resistance",)
    if _is_sphere(rocks):
        return ("friction_angle_deg", "rolling_friction")
    slides = _name_of(scene.get("ground"), SLIDING) == SLIDING
    return ("friction_angle_deg",) if slides or _name_of(scene.get("rebound"), LIMITED) == LIMITED else ()


def _name_of(model: Any, default: str) -> str:
    """Return the name of a rebound or ground model from its value in a scene.

    model : a name, a mapping of a name to parameters, an object of the scene model, or None; default : name for None
    """
    if model is None:
        return default
    if isinstance(model, Mapping):
        return str(next(iter(model), default))
    return str(getattr(model, "name", model))


def _is_sphere(rock: Any) -> bool:
    """Return True if the rocks are spheres; rock : value of the key `rock`."""
    return rock.is_sphere if isinstance(rock, RockSpec) else names_sphere(rock)


def _as_prior(span: Any) -> Any:
    """Return the range of a coefficient as `{prior: ...}`, as in a scene; a plain number is returned unchanged."""
    if isinstance(span, float):
        return span
    normal = {} if span.mean is None else {"mean": span.mean, "sd": span.sd}
    return {PRIOR: {"min": span.low, "max": span.high, **normal}}
