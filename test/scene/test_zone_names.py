"""Tests that a name in a scene that matches no zone is compared with similar zone names of drawings."""

import pytest

from rpf3d_core.scene.zone_materials import zone_meant

LAYERS = ("FACES_NORTH", "FACES_EAST", "BERMS", "RAMP_01", "RAMP_02", "topo")


@pytest.mark.parametrize(
    ("written", "meant"),
    [("face_*", "FACES_*"), ("faces", "FACES_*"), ("Face*", "FACES_*"), ("berm_*", "BERMS"), ("ramp", "RAMP_*"),
     ("faces_north", "FACES_NORTH"), ("FACE_EAST", "FACES_EAST"), ("tpo", "topo"), ("floor", None)],
)  # fmt: skip
def test_capitals_and_plurals_of_layers_are_no_hindrance(written: str, meant: str | None) -> None:
    assert zone_meant(written, LAYERS) == meant
