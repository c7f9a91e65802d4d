"""Describe scene files as JSON Schema (draft 2020-12), with which editors complete keys and mark errors.

The schema of the pydantic models describes their fields. A scene file also has shorthands, which validators expand
before the fields are checked: names of models, `{prior: ...}` in place of a number, `library` in place of coefficients.
This file adds the shorthands, and which keys exclude each other or need another key. The schema cannot check limits
that depend on several values, such as low < high; `rpf3d check` checks these limits.
"""

from collections.abc import Iterable, Mapping
from types import ModuleType
from typing import Any

from pydantic import BaseModel

from rpf3d_core.scene.library_entries import ENTRIES
from rpf3d_core.scene.material import BODY_KEYS, POINT_KEYS
from rpf3d_core.scene.method import EVENTS
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import EffectsSpec, GroundSpec, OneOf, ReboundSpec
from rpf3d_core.scene.models.own import OWN
from rpf3d_core.scene.releases import PLACES, SIZES
from rpf3d_core.scene.shapes import KINDS, POINT, SPHERE, ContactSpec
from rpf3d_core.scene.unknowns import PRIOR, ROOTS
from rpf3d_core.terrain.benches import parameters as benches
from rpf3d_core.terrain.pit import parameters as pit

DIALECT = "https://json-schema.org/draft/2020-12/schema"
DEFINITIONS = "#/$defs/"
OWN_PATH = r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)+$"
"""Pattern of the import path of a user's class, such as `sand.Sand`."""
UNKNOWN = "Unknown"
"""Suffix of the name of a definition in which numbers may be unknown."""
ONE_OF = {
    "TerrainSpec": ("files", "pit", "benches"), "SourceSpec": PLACES, "ShapeSpec": KINDS,
    "AngleTableSpec": ("rows", "law"), "RoughnessSpec": ("amplitude", "angle_sd_deg"),
    "ForestSpec": ("file", "stems_per_ha"),
}  # fmt: skip
"""Keys of which exactly one is given, by section."""
TOGETHER = {
    "SourceSpec": (
        ("speed", "azimuth_deg"), ("azimuth_deg", "speed"), ("elevation_deg", "speed"), ("spread_deg", "speed"),
        ("steeper_than_deg", "zone"),
    ),
    "PriorSpec": (("mean", "sd"), ("sd", "mean")),
}  # fmt: skip
"""Pairs of keys, by section: a section with the first key also needs the second."""

Schema = dict[str, Any]


def scene_schema() -> Schema:
    """Return the JSON Schema of scene files, shorthands included."""
    schema = Scene.model_json_schema()
    definitions = schema["$defs"]
    _without_path(schema)
    _add_choices(definitions)
    _add_models(definitions)
    _add_effects(definitions)
    _add_points_in_plan(definitions)
    _add_shapes(definitions)
    _add_materials(definitions)
    _add_parameters(definitions["Pit"], pit)
    _add_parameters(definitions["Benches"], benches)
    definitions["MethodSpec"] = _any_of({"const": EVENTS}, {**definitions["MethodSpec"], "minProperties": 1})
    _add_unknowns(schema)
    _prune(schema)
    return {"$schema": DIALECT, "title": "rpf3d scene", **{k: v for k, v in schema.items() if k != "title"}}


def model_schema(model: type[BaseModel], title: str) -> Schema:
    """Return the JSON Schema of a file whose pydantic model has no shorthands."""
    schema = model.model_json_schema()
    return {"$schema": DIALECT, "title": title, **{k: v for k, v in schema.items() if k != "title"}}


def _without_path(schema: Schema) -> None:
    """Remove `path` from the schema of a scene: it is a field of the pydantic model and not a key of the file."""
    del schema["properties"]["path"]
    schema["required"].remove("path")


def _any_of(*schemas: Schema) -> Schema:
    return {"anyOf": list(schemas)}


def _ref(name: str) -> Schema:
    return {"$ref": DEFINITIONS + name}


def _given(key: str) -> Schema:
    """Return the JSON Schema of a mapping in which a key is present and not null."""
    return {"required": [key], "properties": {key: {"not": {"type": "null"}}}}


def _at_most_one(keys: Iterable[str]) -> list[Schema]:
    """Return the alternatives for at most one of some keys in a mapping: one schema for each key, one for no key."""
    keys = list(keys)
    return [*map(_given, keys), {"not": {"anyOf": [{"required": [key]} for key in keys]}}]


def _add_choices(definitions: Schema) -> None:
    """Add to the JSON Schema of a scene which keys exclude each other, and which keys need another key.

    definitions : definitions of the schema, by name, changed in place
    """
    for name, keys in ONE_OF.items():
        definitions[name]["oneOf"] = [_given(key) for key in keys]
    definitions["RockSpec"]["oneOf"] = _at_most_one(SIZES)
    for name, together in TOGETHER.items():
        definitions[name]["allOf"] = [{"if": _given(key), "then": _given(other)} for key, other in together]
    definitions["SourceSpec"]["allOf"].append({"oneOf": _at_most_one(SIZES)})


def _add_models(definitions: Schema) -> None:
    """Allow, for `rebound`, `ground` and `contact`, the name of a model, or a mapping of a name to parameters.

    definitions : definitions of the schema, by name, changed in place
    """
    for spec in (ReboundSpec, GroundSpec, ContactSpec):
        definitions[spec.__name__] = _model_choice(definitions[spec.__name__], spec, definitions)


def _model_choice(section: Schema, spec: type[OneOf], definitions: Schema) -> Schema:
    """Return the schema of a key that names one of several models; a model with required keys needs a mapping.

    section : schema of the class `spec` as pydantic generates it; definitions : definitions of the schema, by name
    """
    properties = _of_models(section, definitions)
    names = [name for name in properties if not _needs_keys(_target(properties[name], definitions))]
    mapping: Schema = {"type": "object", "properties": properties, "additionalProperties": False,
                       "minProperties": 1, "maxProperties": 1}  # fmt: skip
    forms: list[Schema] = [{"enum": names}]
    if OWN in section["properties"]:
        forms.append({"type": "string", "pattern": OWN_PATH})
        mapping["patternProperties"] = {OWN_PATH: _own_numbers()}
    return {"description": section["description"], **_any_of(*forms, mapping)}


def _of_models(section: Schema, definitions: Schema) -> Schema:
    """Return the schemas of the models in a section, by name of the model.

    A model without required keys may also be null, which means all defaults. Models of users are left out.
    """
    return {
        name: {"anyOf": each["anyOf"][:1]} | {"description": each["description"]}
        if _needs_keys(_target(each, definitions)) else each
        for name, each in section["properties"].items() if name != OWN
    }  # fmt: skip


def _target(schema: Schema, definitions: Schema) -> Schema:
    """Return the definition that a schema `{anyOf: [{$ref}, null]}` refers to."""
    ref = next(each["$ref"] for each in schema["anyOf"] if "$ref" in each)
    return definitions[ref.removeprefix(DEFINITIONS)]  # type: ignore[no-any-return]


def _needs_keys(section: Schema) -> bool:
    return bool(section.get("required")) or "oneOf" in section


def _own_numbers() -> Schema:
    """Return the schema of the parameters of a user's model or effect."""
    return _any_of({"type": "object", "additionalProperties": {"type": "number"}}, {"type": "null"})


def _add_effects(definitions: Schema) -> None:
    """Allow the import paths of users' effects as keys of `effects`; definitions : changed in place."""
    section = definitions[EffectsSpec.__name__]
    section["properties"] = _of_models(section, definitions)
    section["patternProperties"] = {OWN_PATH: _own_numbers()}


def _add_points_in_plan(definitions: Schema) -> None:
    """Allow [x, y] as points of sources with `above_ground`; allow the name of a file as `line` only for such sources.

    definitions : changed in place
    """
    source = definitions["SourceSpec"]
    number = {"type": "number"}
    plan: Schema = {"type": "array", "prefixItems": [number, number], "minItems": 2, "maxItems": 2}
    points, line = source["properties"]["points"], source["properties"]["line"]
    space = next(each for each in points["anyOf"] if each.get("type") == "array")["items"]
    anywhere = {"items": _any_of(space, plan)}
    points["anyOf"] = [{"type": "array", "minItems": 1, **anywhere}, {"type": "null"}]
    line["anyOf"] = [{"type": "array", "minItems": 2, **anywhere}, {"type": "string", "minLength": 1}, {"type": "null"}]
    listed = {"items": space}
    kept = {"properties": {"points": listed, "line": {"not": {"type": "string"}, **listed}}}
    source["allOf"] = [*source.get("allOf", []), {"if": _given("above_ground"), "else": kept}]


def _add_shapes(definitions: Schema) -> None:
    """Allow `point`, `sphere`, `{sphere: false}` and null as values of `rock.shape`; definitions : changed in place."""
    named: Schema = {"enum": [POINT, SPHERE, None]}
    no_sphere: Schema = {"const": {SPHERE: False}}
    shape = definitions["RockSpec"]["properties"]["shape"]
    shape["anyOf"] = [named, no_sphere, *(each for each in shape["anyOf"] if "$ref" in each)]


def _add_materials(definitions: Schema) -> None:
    """Allow materials without coefficients of points if they name a library entry or have coefficients of bodies.

    definitions : changed in place
    """
    material = definitions["Material"]
    required = material.pop("required")
    point: Schema = {"required": required}
    of_body = [key for key in BODY_KEYS if key in material["properties"]]
    bodies: Schema = {"required": ["restitution"], "anyOf": [_given("friction"), _given("slip_friction")],
                      "not": {"anyOf": [{"required": [key]} for key in POINT_KEYS]}}  # fmt: skip
    no_body: Schema = {"not": {"anyOf": [{"required": [key]} for key in of_body]}}
    material["properties"]["library"]["anyOf"] = [{"enum": [*ENTRIES, None]}]
    material["anyOf"] = [{**point, **no_body}, bodies, _given("library")]


def _add_parameters(definition: Schema, parameters: ModuleType) -> None:
    """Add a description and bounds to each property in the JSON schema of a synthetic terrain.

    definition : schema of the terrain, changed in place
    parameters : module with the constants MEANINGS, RANGES and WHOLE
    """
    for name, section in definition["properties"].items():
        section["description"] = parameters.MEANINGS[name]
        if name in parameters.RANGES:
            section["minimum"], section["maximum"] = parameters.RANGES[name]
        if name in parameters.WHOLE:
            section["type"] = "integer"


def _add_unknowns(schema: Schema) -> None:
    """Allow `{prior: ...}` in place of each number that may be unknown; schema : of a scene, changed in place.

    Definitions are copied before this change, because other sections use the originals, in which no prior is allowed.
    """
    definitions, copies = schema["$defs"], dict[str, Schema]()
    for root in ROOTS:
        schema["properties"][root] = _with_priors(schema["properties"][root], definitions, copies)
    definitions.update(copies)
    definitions["Prior"] = {
        "type": "object", "properties": {PRIOR: _ref("PriorSpec")}, "required": [PRIOR], "additionalProperties": False,
        "description": "An unknown value: a range {min, max}, or {mean, sd, min, max}.",
    }  # fmt: skip


def _with_priors(schema: Any, definitions: Schema, copies: Schema) -> Any:
    """Return a schema in which each number outside of lists may be unknown: a number or `{prior: ...}`.

    definitions : all definitions of the schema, by name
    copies : receives a changed copy of each definition that the schema refers to
    """
    if isinstance(schema, list):
        return [_with_priors(each, definitions, copies) for each in schema]
    if not isinstance(schema, dict):
        return schema
    if "$ref" in schema:
        return {**schema, "$ref": DEFINITIONS + _copied(schema["$ref"].removeprefix(DEFINITIONS), definitions, copies)}
    if schema.get("type") == "number":
        return _number_or_prior(schema)
    if schema.get("type") == "array":  # priors are searched in mappings only
        return schema
    return {key: _inside(key, value, definitions, copies) for key, value in schema.items()}


def _inside(key: str, value: Any, definitions: Schema, copies: Schema) -> Any:
    """Return the value of a keyword of JSON Schema; if the keyword contains schemas, their numbers may be unknown.

    key : the keyword, such as `properties`; value : its value; definitions : all definitions of the schema, by name
    copies : receives a changed copy of each definition that the value refers to
    """
    if key in ("properties", "patternProperties"):
        return {name: _with_priors(each, definitions, copies) for name, each in value.items()}
    holds = key in ("anyOf", "oneOf", "additionalProperties")
    return _with_priors(value, definitions, copies) if holds else value


def _copied(name: str, definitions: Mapping[str, Schema], copies: Schema) -> str:
    """Return the name of a definition's copy in which numbers may be unknown; the copy is made at the first use.

    name : name of the definition; definitions : all definitions of the schema, by name; copies : receives the copy
    """
    new = name + UNKNOWN
    if new not in copies:
        copies[new] = {}  # a placeholder while the definitions below refer to the copy
        copies[new] = _with_priors(definitions[name], dict(definitions), copies)
    return new


def _prune(schema: Schema) -> None:
    """Remove the definitions that no part of a schema refers to; schema : changed in place."""
    definitions = schema.pop("$defs")
    used, waiting = set[str](), _refs_in(schema)
    while waiting:
        name = waiting.pop()
        if name not in used:
            used.add(name)
            waiting |= _refs_in(definitions[name])
    schema["$defs"] = {name: definitions[name] for name in sorted(used)}


def _refs_in(schema: Any) -> set[str]:
    """Return the names of the definitions that a schema refers to."""
    items = schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ()
    below = set().union(*map(_refs_in, items))
    ref = schema.get("$ref") if isinstance(schema, dict) else None
    return below | {ref.removeprefix(DEFINITIONS)} if isinstance(ref, str) else below


def _number_or_prior(schema: Schema) -> Schema:
    """Return the schema of a number that may be unknown: a number or `{prior: ...}`.

    Description and default are not repeated in the two alternatives, because editors look for them one level above.
    """
    outer = ("description", "default", "title", "unit", "source", "confirmed")
    number = {key: value for key, value in schema.items() if key not in outer}
    return {**{key: schema[key] for key in outer if key in schema}, **_any_of(number, _ref("Prior"))}
