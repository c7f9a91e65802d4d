"""Tests that a name in a scene that matches no zone is compared with similar zone names of drawings."""

from pathlib import Path

import pytest

from rpf3d_core.scene.reading import scene_of_text
from rpf3d_core.scene.zone_materials import words_on_unused, zone_meant

LAYERS = ("FACES_NORTH", "FACES_EAST", "BERMS", "RAMP_01", "RAMP_02", "topo")


@pytest.mark.parametrize(
    ("written", "meant"),
    [("face_*", "FACES_*"), ("faces", "FACES_*"), ("Face*", "FACES_*"), ("berm_*", "BERMS"), ("ramp", "RAMP_*"),
     ("faces_north", "FACES_NORTH"), ("FACE_EAST", "FACES_EAST"), ("tpo", "topo"), ("floor", None)],
)  # fmt: skip
def test_capitals_and_plurals_of_layers_are_no_hindrance(written: str, meant: str | None) -> None:
    assert zone_meant(written, LAYERS) == meant


MATERIAL = "{normal_restitution: 0.3, tangential_restitution: 0.7}"
ZONES = ("FACES_1", "FACES_2", "BERMS_1", "BERMS_2", "FLOOR")


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("default", "*", "BERMS_*"), "`materials.BERMS_*` is not used: its zones have the material of `*`, the first "
         "pattern that fits; write 'BERMS_*' before `*`"),
        (("default", "BERMS_1", "BERMS_2", "BERMS_*"), "`materials.BERMS_*` is not used: each of its zones has a "
         "material of its own name (`BERMS_1`, `BERMS_2`); remove it"),
        (("default", "*", "GONE"), "`materials.GONE` is not used: no triangle is in a zone that it fits; remove it"),
        (("default", "BERMS_*", "*"), None),
        (("default", "FLOOR", "BERMS_*", "FACES_*"), None),
    ],
)  # fmt: skip
def test_a_material_that_no_zone_has_is_named_with_what_hides_it(names: tuple[str, ...], told: str | None) -> None:
    materials = "".join(f"  '{name}': {MATERIAL}\n" for name in names)
    text = f"terrain: {{pit: {{}}}}\nmaterials:\n{materials}sources: [{{name: a, points: [[0, 0, 0]]}}]\n"
    assert list(words_on_unused(scene_of_text(text, Path("scene.yaml")), ZONES)) == ([] if told is None else [told])
