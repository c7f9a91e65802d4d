"""Name a key of a scene in words, with its unit, for the axes and legends of pictures: `friction angle (degrees)`."""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple

from rpf3d_core.scene.listings.json_schema import DEFINITIONS, scene_schema
from rpf3d_core.terrain.benches import parameters as benches
from rpf3d_core.terrain.pit import parameters as pit

UNIT = re.compile(r"\((-|m|m2|m3|m/s|m/s2|kg|kg/m3|kg/s|kJ|J|s|Pa|cm|1/m|1/s|1/ha|degrees)\)")
"""Pattern of a unit in the description of a key."""
ENDS = {"_deg": "degrees", "_cm": "cm", "_kj": "kJ", "_per_ha": "1/ha"}
"""Unit of a key whose name states the unit at its end, by this end."""
RATIOS = ("elongation", "ramp_grade")
"""Names of the parameters of synthetic terrains that are ratios."""
TERRAINS = {"terrain.benches.": benches, "terrain.pit.": pit}
"""Modules with the meanings of the parameters of synthetic terrains, by the beginning of their key paths."""


class KeyWords(NamedTuple):
    """The last key of a key path in words, for the axes and legends of pictures.

    name : the key without a unit, such as `face angle`
    words : for a parameter of a synthetic terrain, the meaning of the key; for all other keys, the same as `name`
    unit : "-" for a number without a unit, "" for an unknown unit or no number
    """

    name: str
    words: str
    unit: str

    @property
    def label(self) -> str:
        """The words with the unit in brackets, such as `friction angle (degrees)`; no brackets without a known unit."""
        return f"{self.words} ({self.unit})" if self.unit else self.words


def key_in_words(path: str) -> KeyWords:
    """Return the last key of a key path such as `materials.default.friction_angle_deg` in words, with its unit."""
    last = path.rpartition(".")[2]
    end = next((each for each in ENDS if last.endswith(each)), "")
    name = last.removesuffix(end).replace("_", " ")
    for beginning, module in TERRAINS.items():
        if path == beginning + last and last in module.MEANINGS:
            unit = "-" if last in (*module.WHOLE, *RATIOS) else ENDS.get(end, "m")
            return KeyWords(name, re.split(r"[;,:]", module.MEANINGS[last])[0], unit)
    return KeyWords(name, name, ENDS.get(end) or _unit(path.split(".")))


def _unit(keys: list[str]) -> str:
    """Return the unit stated in the description of a key, or else of a section around the key; "" if there is none.

    keys : the keys of a key path, from the top of the scene
    """
    unit, places = "", [_schema()]
    for key in keys:
        places = [below for place in places for below in _below(place, key)]
        unit = next(filter(None, map(_stated, places)), unit)
    return unit


def _stated(place: Mapping[str, Any]) -> str:
    """Return the unit that the schema of a key states, or else the first unit in its description; "" for none.

    place : JSON Schema of the key
    """
    match = UNIT.search(place.get("description", ""))
    return str(place.get("unit", match[1] if match else ""))


@cache
def _schema() -> dict[str, Any]:
    return scene_schema()


def _below(place: Mapping[str, Any], key: str) -> Iterator[dict[str, Any]]:
    """Yield the JSON Schemas that a key may have in a section.

    In a list, or in a mapping whose keys are names of the user, these are the schemas of the entries.

    place : JSON Schema of the section
    """
    if "$ref" in place:
        yield from _below(_schema()["$defs"][place["$ref"].removeprefix(DEFINITIONS)], key)
    for each in (*place.get("anyOf", ()), *place.get("oneOf", ()), *place.get("allOf", ())):
        yield from _below(each, key)
    properties, entries = place.get("properties", {}), place.get("additionalProperties")
    if key in properties:
        yield properties[key]
    elif isinstance(entries, dict):
        yield entries
    if isinstance(place.get("items"), dict):
        yield place["items"]
