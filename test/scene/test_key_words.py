"""Keys are named in words with their units on the axes of pictures."""

import pytest

from rpf3d_core.scene.listings.key_words import key_in_words


@pytest.mark.parametrize(
    ("key", "label"),
    [
        ("materials.default.normal_restitution", "normal restitution (-)"),
        ("materials.*.friction_angle_deg", "friction angle (degrees)"),
        ("terrain.benches.berm", "width of each berm between two faces (m)"),
        ("terrain.benches.face_angle_deg", "angle of the faces from the horizontal (degrees)"),
        ("terrain.benches.number", "number of faces (-)"),
        ("terrain.pit.ramp_grade", "slope of the ramp (-)"),
        ("rock.diameter", "diameter (m)"),
        ("rock.mass.mean", "mean (kg)"),
        ("sources.top.speed", "speed (m/s)"),
        ("effects.barriers.panels.fence.height", "height (m)"),
        ("effects.roughness.angle_sd_deg", "angle sd (degrees)"),
        ("rebound", "rebound"),
    ],
)
def test_a_key_is_named_in_words_with_its_unit(key: str, label: str) -> None:
    assert key_in_words(key).label == label
