"""Tests that "did you mean" offers the key of the same meaning even if it is spelled quite differently."""

from pathlib import Path

import pytest

from rpf3d_core.errors import SceneError
from rpf3d_core.scene.meanings import SAME, keys_meant
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene

SCENE = """\
terrain: {{pit: {{triangles: 2000}}{terrain}}}
materials: {{default: {{normal_restitution: 0.5, tangential_restitution: 0.8{material}}}}}
sources: [{{name: top, points: [[0, 0, 900]]{source}}}]
{more}
"""
NOTHING = {"terrain": "", "material": "", "source": "", "more": ""}


def refusal(folder: Path, **parts: str) -> str:
    (folder / "scene.yaml").write_text(SCENE.format(**{**NOTHING, **parts}))
    with pytest.raises(SceneError) as caught:
        read_scene(folder / "scene.yaml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("part", "written", "meant"),
    [
        ("material", ", friction: 30", "`friction_angle_deg`"),
        ("material", ", phi: 30", "`friction_angle_deg`"),
        ("material", ", r_n: 0.4", "`normal_restitution`"),
        ("material", ", Rt: 0.4", "`tangential_restitution`"),
        ("material", ", rolling: 0.4", "`rolling_friction`"),
        ("source", ", count: 5", "`rocks`"),
        ("source", ", height: 5", "`above_ground`"),
        ("source", ", bearing: 5", "`azimuth_deg`"),
        ("source", ", crest: [[0, 0, 0], [1, 1, 1]]", "`line`"),
        ("terrain", ", epsg: 32719", "`crs`"),
        ("more", "rock: {size: 2}", "`diameter`"),
        ("more", "hazard: {resolution: 2}", "`cell`"),
        ("more", "gravitation: 9.8", "`gravity`"),
        ("more", "density: 2700", "`rock.density`"),
        ("more", "friction_angle: 30", "`materials.ZONE.friction_angle_deg`"),
        ("more", "stop_sped: 0.5", "`stop_speed`"),
        ("more", "rock: {diametre: 2}", "`diameter`"),
    ],
)
def test_the_key_of_the_same_meaning_is_offered(tmp_path, part, written, meant):
    assert f"did you mean {meant}" in refusal(tmp_path, **{part: written})


def test_each_group_of_words_has_a_key_of_the_scene():
    keys: set[str] = set()
    waiting = [Scene.model_json_schema(by_alias=False)]
    while waiting:
        part = waiting.pop()
        if isinstance(part, dict):
            keys |= set(part.get("properties", {}))
            waiting += list(part.values())
        elif isinstance(part, list):
            waiting += part
    assert [group for group in SAME if not keys.intersection(group)] == []


def test_a_word_without_a_group_means_nothing():
    assert keys_meant("xyzzy", ["cell", "rock"]) == []
    assert keys_meant("friction", ["friction", "friction_angle_deg"]) == ["friction_angle_deg"]
