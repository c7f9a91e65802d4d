"""Tests of the JSON Schema of scene files: scenes are valid, scenes with a refused structure are not."""

import json
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from golden_results.golden_scenes import ENTRIES, Entry
from jsonschema import Draft202012Validator
from pydantic import ValidationError
from typer.testing import CliRunner

from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.cli import app
from rpf3d_core.formats.yaml import read_yaml
from rpf3d_core.scene.listings.json_schema import model_schema, scene_schema
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.values import MISSING_FILE

ROOT = Path(__file__).parents[2]
SCENES = [
    *sorted((ROOT / "config" / "scenes").glob("*.yaml")),
    *(path for path in sorted((ROOT / "examples" / "scenes").glob("*.yaml")) if not path.stem.endswith("_site")),
]
SCHEMA = scene_schema()
VALID = Draft202012Validator(SCHEMA)
BEYOND = {("rock", "shape"), ("observed", "sections", "west", 0)}
"""Places where a mutated scene is refused because values contradict one another, which no JSON Schema can check."""
WRONG: tuple[Any, ...] = ("wrong", 7.5, [], {}, None, {"zzz": 1})

Path_ = tuple[str | int, ...]


def plain(path: Path) -> Any:
    return json.loads(json.dumps(read_yaml(path).values))


def faults(values: Any) -> list[str]:
    return [f"{error.json_path}: {error.message}" for error in VALID.iter_errors(values)]


def at(values: Any, path: Path_) -> Any:
    for step in path:
        values = values[step]
    return values


def places(values: Any, path: Path_ = ()) -> Iterator[Path_]:
    yield path
    inner = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, value in inner:
        yield from places(value, (*path, key))


def mutants(values: Any) -> Iterator[tuple[Path_, Any]]:
    """Yield (place, scene) for each place, with one more key, one key less, or a value of another type there."""
    for path in places(values):
        if isinstance(at(values, path), dict):
            changed = deepcopy(values)
            at(changed, path)["zzz"] = 1
            yield path, changed
        if not path:
            continue
        if isinstance(at(values, path[:-1]), dict):
            changed = deepcopy(values)
            del at(changed, path[:-1])[path[-1]]
            yield path, changed
        for wrong in WRONG:
            if is_alike(wrong, at(values, path)):
                continue
            changed = deepcopy(values)
            at(changed, path[:-1])[path[-1]] = wrong
            yield path, changed


def is_alike(one: Any, other: Any) -> bool:
    """True if two values have the same type in JSON; numbers are alike."""
    numbers = [isinstance(each, int | float) and not isinstance(each, bool) for each in (one, other)]
    return all(numbers) or type(one) is type(other)


def is_refused(values: Any, path: Path) -> bool:
    """True if rpf3d refuses the scene for anything but a file that does not exist."""
    try:
        Scene.model_validate({**values, "path": path}, context={"folder": path.parent})
    except ValidationError as error:
        details = [detail for detail in error.errors() if detail["type"] != MISSING_FILE]
        # Pydantic also reports a list as too short if its only item is refused.
        return any(detail["type"] != "too_short" for detail in details) or len(details) == len(error.errors())
    return False


def test_the_schema_is_a_json_schema() -> None:
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_shipped_scene_is_valid(path: Path) -> None:
    assert faults(plain(path)) == []


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: getattr(entry, "name", entry))
def test_a_scene_of_each_model_and_effect_is_valid(entry: Any, tmp_path: Path) -> None:
    entry = entry if isinstance(entry, Entry) else ENTRIES[entry]
    assert faults(plain(entry.write(tmp_path))) == []


@pytest.mark.long
def test_what_rpf3d_refuses_for_its_structure_is_refused_by_the_schema(tmp_path: Path) -> None:
    passed, refused, tried = [], 0, set[str]()
    for entry in ENTRIES.values():
        path = entry.write(tmp_path)
        for place, changed in mutants(plain(path)):
            name = json.dumps(
                [step if isinstance(step, str) else "[]" for step in place] + [at_or_gone(changed, place)]
            )
            if name in tried or place in BEYOND:
                continue
            tried.add(name)
            if is_refused(changed, path):
                refused += 1
                if not faults(changed):
                    passed.append(f"{entry.name}: {name}")
    assert passed == []
    assert refused > 1000


def at_or_gone(values: Any, path: Path_) -> Any:
    try:
        return at(values, path)
    except KeyError:
        return "gone"


SHORTHANDS: dict[str, dict[str, Any]] = {
    "shape by name": {"rock": {"shape": "sphere"}},
    "shape as a mapping": {"rock": {"shape": {"box": [1, 1, 0.5]}}},
    "rebound by name": {"rebound": "v_half"},
    "rebound with parameters": {"rebound": {"v_half": {"speed": 5}}},
    "rebound without parameters": {"rebound": {"v_half": None}},
    "a user's rebound": {"rebound": "sand.Sand"},
    "a user's effect": {"effects": {"sand.Sand": {"depth": 1}}},
    "an unknown number": {"stop_speed": {"prior": {"min": 0.1, "max": 1}}},
    "an unknown number of a user's effect": {"effects": {"sand.Sand": {"depth": {"prior": {"min": 0.1, "max": 1}}}}},
    "an unknown mean": {"materials": {"default": {"normal_restitution": {
        "mean": {"prior": {"min": 0.3, "max": 0.5}}, "sd": 0.1, "min": 0.1, "max": 0.8}, "tangential_restitution": 1}}},
    "a material of the library": {"materials": {"default": {"library": "hoek_bedrock"}}},
    "a material of a body": {"materials": {"default": {"restitution": 0.1, "friction": 0.6}}},
    "automatic rocks": {"rocks": "auto"},
    "points in plan": {"sources": [{"name": "a", "points": [[0, 0], [1, 1, 5]], "above_ground": 1}]},
    "a line in plan": {"sources": [{"name": "a", "line": [[0, 0], [1, 1]], "above_ground": 1}]},
    "a line from a file": {"sources": [{"name": "a", "line": "crest.geojson", "above_ground": 1}]},
    "the exact method": {"method": "events"},
}  # fmt: skip
BARE: dict[str, Any] = {
    "terrain": {"pit": {}}, "materials": {"default": {"normal_restitution": 0.4, "tangential_restitution": 0.8}},
    "sources": [{"name": "a", "points": [[0, 0, 0]]}],
}  # fmt: skip


@pytest.mark.parametrize("change", SHORTHANDS.values(), ids=SHORTHANDS)
def test_a_shorthand_is_valid(change: dict[str, Any]) -> None:
    assert faults(BARE | change) == []


REFUSED: dict[str, dict[str, Any]] = {
    "two models": {"rebound": {"constant": {}, "v_half": {}}},
    "a model that is none": {"ground": "slippery"},
    "a prior where nothing may be unknown": {"rock": {"diameter": {"prior": {"min": 1, "max": 2}}}},
    "a prior within a drawn size": {
        "rock": {"mass": {"mean": {"prior": {"min": 1, "max": 2}}, "sd": 1, "min": 1, "max": 9}}
    },
    "half a normal prior": {"stop_speed": {"prior": {"min": 0.1, "max": 1, "mean": 0.5}}},
    "two places": {"sources": [{"name": "a", "points": [[0, 0, 0]], "line": [[0, 0, 0], [1, 0, 0]]}]},
    "two sizes": {"rock": {"mass": 1, "diameter": 1}},
    "coefficients of points and bodies": {
        "materials": {"default": {"restitution": 0.1, "friction": 1, "normal_restitution": 1}}
    },
    "points in plan without a height": {"sources": [{"name": "a", "points": [[0, 0]]}]},
    "a line from a file without a height": {"sources": [{"name": "a", "line": "crest.geojson"}]},
    "a word for a number": {"stop_speed": "1 m/s"},
    "the path of the scene": {"path": "scene.yaml"},
}  # fmt: skip


@pytest.mark.parametrize("change", REFUSED.values(), ids=REFUSED)
def test_a_wrong_scene_is_refused(change: dict[str, Any]) -> None:
    assert faults(BARE | change) != []


def test_every_key_of_the_top_level_is_described() -> None:
    assert [name for name, each in SCHEMA["properties"].items() if not each.get("description")] == []


def test_the_command_prints_the_schema_and_nothing_else() -> None:
    assert json.loads(CliRunner().invoke(app, ["schema"]).stdout) == json.loads(json.dumps(SCHEMA))


def test_the_example_of_a_site_file_is_valid() -> None:
    printed = json.loads(CliRunner().invoke(app, ["schema", "--site"]).stdout)
    assert printed == json.loads(json.dumps(model_schema(Thresholds, "rpf3d site file")))
    site = plain(ROOT / "config" / "site_example.yaml")
    assert list(Draft202012Validator(printed).iter_errors(site)) == []
    assert list(Draft202012Validator(printed).iter_errors(site | {"sight": 1})) != []
