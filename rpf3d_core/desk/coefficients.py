"""Convert coefficients of materials to and from the user's text: a number, a range `0.3 to 0.5`, or a distribution."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError, SceneError
from rpf3d_core.formats.yaml import parse_yaml, yaml_text
from rpf3d_core.scene.key_paths import Steps, steps_to
from rpf3d_core.scene.material import BODY_KEYS
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.unknowns import sampled

MATERIALS = "materials"

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
RANGE = re.compile(rf"\s*({NUMBER})\s*(?:to|-|\.\.)\s*({NUMBER})\s*")
OF_POINTS = ("normal_restitution", "tangential_restitution", "friction_angle_deg")
OF_BODIES = ("restitution", "friction", "rolling_resistance")
"""Coefficients that are always shown, even if the scene does not state them: for points and spheres, and for bodies."""


class Coefficient(NamedTuple):
    """A coefficient of a material, as a field of the page shows it.

    key : key in the scene file; text : the value as the user types it, "" if the scene does not state it
    fixed : why the desk cannot edit the value; "" if it can
    """

    key: str
    text: str
    fixed: str = ""


def coefficients_of(material: Mapping[str, Any]) -> list[Coefficient]:
    """Return all values of a material, and the usual coefficients that the material does not state.

    material : the plain values that the scene states for the material, by key
    """
    usual = OF_BODIES if any(key in material for key in BODY_KEYS) else OF_POINTS
    keys = dict.fromkeys((*material, *usual))
    return [Coefficient(key, coefficient_text(material[key]) if key in material else "") for key in keys]


def coefficient_text(value: Any) -> str:
    """Return a value of a scene as the user types it: `0.45`, a word, `0.3 to 0.5` (an unknown), or a mapping."""
    if isinstance(value, Mapping):
        prior = value.get("prior")
        if set(value) == {"prior"} and isinstance(prior, Mapping) and set(prior) == {"min", "max"}:
            return f"{prior['min']:.12g} to {prior['max']:.12g}"
        return "{" + ", ".join(f"{key}: {coefficient_text(item)}" for key, item in value.items()) + "}"
    return yaml_text(value).removesuffix("...\n").strip()


def coefficient_of(text: str) -> Any:
    """Return the value to write into the scene for a text of the user; a range becomes the prior of an unknown.

    Raises
    ------
    InputError
        The text is not a number, a range, a word or a mapping.
    """
    if found := RANGE.fullmatch(text):
        low, high = (float(end) for end in found.groups())
        return {"prior": {"min": low, "max": high}}
    try:
        document = parse_yaml(text, Path("value"), "value")
    except SceneError:
        document = None
    if document is None or document.faults or isinstance(document.values, tuple) or document.values is None:
        raise InputError(f"{text!r} is not a value; type a number, a range such as 0.3 to 0.5, or "
                         "{mean: 0.4, sd: 0.1, min: 0.2, max: 0.6}")  # fmt: skip
    return document.values


def materials_of(
    values: Mapping[str, Any], fixed: Mapping[Steps, str] = MappingProxyType({})
) -> Iterator[tuple[str, list[Coefficient]]]:
    """Yield the name and the coefficients of each material.

    values : plain values of the scene's file; fixed : the values that the desk cannot edit, from `drawn_elsewhere`
    """
    for name, material in values[MATERIALS].items():
        yield name, [
            each._replace(fixed=fixed.get((MATERIALS, str(name), each.key), "")) for each in coefficients_of(material)
        ]


def drawn_elsewhere(scene: Scene, values: Mapping[str, Any]) -> dict[Steps, str]:
    """Return the values of a scene that its section `unknowns` draws, and why the desk cannot edit each value.

    A key of the result has the steps of a key path, such as ("materials", "rock", "friction"). A value of the result is
    the reason, as text for the user. If the scene is refused, the result is empty.

    values : the plain values of the scene's file
    """
    own = values.get("unknowns") or {}
    priors = own.get("priors") or ()
    found = {path: f"drawn from `unknowns.priors`, key path `{path}`; change it there" for path in priors}
    try:
        found |= dict.fromkeys(sampled(scene), f"drawn from the sample {own.get('sample')}; change it there")
        return {steps: why for path, why in found.items() for steps in steps_to(scene, path)}
    except InputError:
        return {}  # the scene is refused, with the reason, when it is prepared
