"""Tests of live scenes: each scene field is a parameter or excluded with a reason; refusals equal those of files."""

import math

import pytest

from rpf3d_core.errors import SceneError
from rpf3d_core.live.scene import EXCLUDED, LISTED, STAND_INS, live_parameters, live_scene, why_excluded
from rpf3d_core.scene.listings.fields import SCALARS, scene_fields
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene

FILE = """\
terrain: {pit: {}}
sources: [{name: a, points: [[0, 0, 100]]}]
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
"""


@pytest.fixture
def written(tmp_path):
    """Return a function that writes `FILE` plus the given lines as a scene file and returns the scene read from it."""

    def read(lines):
        path = tmp_path / "scene.yaml"
        path.write_text(FILE + lines)
        return read_scene(path)

    return read


def without_terrain_and_sources(scene):
    return scene.model_dump(exclude={"path", "terrain", "sources"})


def refusal(**values):
    with pytest.raises(SceneError) as refused:
        live_scene({name.replace("__", "."): value for name, value in values.items()})
    return str(refused.value)


def test_a_file_whose_sources_have_sizes_of_their_own_is_refused(tmp_path):
    """Otherwise live rocks would silently have the default size of `rock`, and their energies would be too low."""
    path = tmp_path / "scene.yaml"
    path.write_text(FILE.replace("points:", "diameter: {uniform: [2, 3]}, points:"))
    with pytest.raises(SceneError, match=r"source 'a' has a `diameter`.*set `rock.diameter`"):
        live_scene({"scene": str(path)})


def test_every_field_of_the_scene_model_is_a_parameter_or_excluded_with_a_reason():
    for field in scene_fields():
        offered = any(each.key == field.key for each in live_parameters())
        assert offered != bool(why_excluded(field.key)), field.key


def test_no_exclusion_speaks_of_a_field_that_is_not_there():
    keys = [field.key for field in scene_fields()]
    for excluded in EXCLUDED:
        assert any(key == excluded or key.startswith(f"{excluded}.") for key in keys), excluded


def test_what_is_excluded_as_a_list_is_no_single_value():
    for field in scene_fields():
        if why_excluded(field.key) == LISTED:
            assert field.kind is None, field.key


def test_the_walk_misses_no_key_of_the_top():
    assert {field.key.split(".")[0] for field in scene_fields()} == set(Scene.model_fields)


@pytest.mark.parametrize("field", live_parameters(), ids=lambda field: field.key)
def test_a_parameter_has_a_type_a_description_and_a_default_that_the_scene_accepts(field):
    assert field.kind in SCALARS
    assert field.description
    if field.default is not None and not field.within:
        assert type(field.default) is field.kind
        live_scene({field.key: field.default})


NEEDED = {
    "effects.drag_layer": {"effects.drag_layer.coefficient": 250.0},
    "effects.forest": {"effects.forest.stems_per_ha": 100.0},
    "contact": {"rock.shape.sphere": True},
    "contact.coulomb_sphere": {"rock.shape.sphere": True},
    "ground.sphere": {"rock.shape.sphere": True},
    "ground.rolling_stone": {"materials.default.rolling_friction": 0.4},
}
"""Model or effect -> further keys, with values, that a scene needs if it names the model or effect."""


def example(field):
    """Return a value that the bounds of a field allow."""
    if field.choices:
        return field.choices[0]
    if field.kind is bool:
        return True
    if field.kind is str:
        return "EPSG:31287"
    return field.default or field.kind(field.bounds.get("ge", field.bounds.get("gt", 0.0)) + 1)


@pytest.mark.parametrize("field", [f for f in live_parameters() if f.bounds], ids=lambda field: field.key)
def test_the_bounds_that_are_told_are_those_of_the_model(field):
    just_outside = {
        "ge": lambda bound: field.kind(math.nextafter(bound, -math.inf)) if field.kind is float else bound - 1,
        "gt": field.kind,
        "le": lambda bound: field.kind(math.nextafter(bound, math.inf)) if field.kind is float else bound + 1,
        "lt": field.kind,
    }
    for kind, bound in field.bounds.items():
        assert f"parameter `{field.key}` is " in refusal(**{field.key: just_outside[kind](bound)}), kind


@pytest.mark.parametrize("field", [f for f in live_parameters() if f.within and not f.names], ids=lambda f: f.key)
def test_a_parameter_of_a_model_or_an_effect_names_it(field):
    beside = NEEDED.get(field.within, {})
    if field.key == "effects.roughness.deviates":
        beside = {"effects.roughness.amplitude": 0.1}
    if field.key == "effects.roughness.lateral_sd_deg":
        beside = {"effects.roughness.angle_sd_deg": 4.0}
    scene = live_scene({**beside, field.key: example(field)})
    if field.within == "rock.shape":
        assert scene.rock.is_sphere
        return
    part, name = field.within.split(".")
    assert name in (scene.effects.named if part == "effects" else getattr(scene, part).name)


def test_nothing_given_is_the_scene_of_the_stand_ins(written):
    assert without_terrain_and_sources(live_scene({})) == without_terrain_and_sources(written(""))
    assert set(STAND_INS) == {"terrain", "sources", "materials"}


def test_values_are_what_a_scene_file_with_the_same_keys_says(written):
    lines = "rock: {mass: 300.0}\nground: sliding\neffects: {drag: {density: 1.0}, roughness: {angle_sd_deg: 4.0}}\n"
    values = {
        "rock.mass": 300.0, "ground": "sliding", "effects.drag.density": 1.0, "effects.roughness.angle_sd_deg": 4.0,
    }  # fmt: skip
    assert without_terrain_and_sources(live_scene(values)) == without_terrain_and_sources(written(lines))


def test_a_name_alone_takes_a_model_or_an_effect_with_its_defaults(written):
    ours = live_scene({"rebound": "v_half", "effects.drag": True})
    assert without_terrain_and_sources(ours) == without_terrain_and_sources(
        written("rebound: v_half\neffects: {drag: {}}")
    )


def test_a_refusal_has_the_words_of_a_scene_file(written):
    with pytest.raises(SceneError) as refused:
        written("rock: {diameter: 0.0}\n")
    words = str(refused.value).partition(": ")[2]
    assert refusal(rock__diameter=0.0) == f"parameter {words}"


def test_every_wrong_value_has_a_line_of_its_own():
    lines = refusal(rock__diameter=-1.0, gravity=0.0, engine="fast").splitlines()
    assert [line.split("`")[1] for line in lines] == ["engine", "gravity", "rock.diameter"]


@pytest.mark.parametrize(
    ("values", "saying"),
    [
        ({"rock.diametre": 1.0}, "parameter `rock.diametre` is not a key of a scene; did you mean `rock.diameter`?"),
        ({"hazard.reach_levels": [0.1]}, "parameter `hazard.reach_levels` is a list, a file or a mapping"),
        ({"rebound": "my.own.Model"}, "any other model needs a scene file"),
        ({"effects.[own].path": "os.system"}, "is a user's program"),
        ({"effects.drag": False, "effects.drag.density": 1.0}, "`effects.drag` is false, but `effects.drag.density`"),
        ({"rebound": "constant", "rebound.v_half.speed": 3.0}, "parameter `rebound` must have exactly one of"),
        ({"rock.shape.sphere": True, "ground": "sliding"}, "`rock.shape: sphere` goes with none or sphere"),
        ({"rock.mass": 1.0, "rock.diameter": 1.0}, "but has diameter and mass"),
        ({"gravity": True}, "parameter `gravity` is true"),
        ({"gravity": "9.81"}, "parameter `gravity` is '9.81'"),
    ],
)
def test_what_makes_no_scene_is_refused_by_name(values, saying):
    assert saying in refusal(**values)


def test_a_scene_file_is_read_as_it_stands(tmp_path, written):
    theirs = written("hazard: {reach_levels: [0.2, 0.7]}")
    assert live_scene({"scene": theirs.path}) == theirs


def test_a_scene_file_and_values_beside_it_are_refused_with_their_names(written):
    sentence = refusal(scene=str(written("").path), gravity=9.81, rock__mass=3.0)
    assert sentence.endswith("remove it, or these parameters: `gravity`, `rock.mass`")


def test_an_empty_name_of_a_scene_file_is_none():
    assert live_scene({"scene": "", "gravity": 1.6}).gravity == 1.6
