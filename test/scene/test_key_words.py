"""Tests of the words and units for keys on the axes of pictures."""

import re
from collections.abc import Iterator
from typing import Any

import pytest

from rpf3d_core.scene.listings.json_schema import scene_schema
from rpf3d_core.scene.listings.key_words import UNIT, key_in_words

SYMBOLS = {
    *("-", "1", "m", "m2", "m3", "cm", "mm", "km", "ha", "s", "s2", "h", "kg", "g", "t"),
    *("J", "kJ", "N", "kN", "Pa", "kPa", "MPa", "degrees", "rad"),
}
"""Symbols of which units are composed."""


def descriptions(part: Any) -> Iterator[str]:
    """Yield all descriptions of a schema or of a part of it."""
    if isinstance(part, dict) and isinstance(part.get("description"), str):
        yield part["description"]
    for below in part.values() if isinstance(part, dict) else part if isinstance(part, list) else ():
        yield from descriptions(below)


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
        ("rock.mass.power_law.exponent", "exponent (-)"),
        ("rock.diameter.weibull.shape", "shape (-)"),
        ("rock.diameter.weibull.scale", "scale (m)"),
        ("effects.fragmentation.surface_factor", "surface factor (m2/J^e)"),
        ("effects.fragmentation.surface_exponent", "surface exponent (-)"),
        ("materials.default.slip_friction.beta", "beta (1/s)"),
    ],
)
def test_a_key_is_named_in_words_with_its_unit(key: str, label: str) -> None:
    assert key_in_words(key).label == label


def test_each_unit_in_brackets_of_the_schema_is_known() -> None:
    found = {inside for text in descriptions(scene_schema()) for inside in re.findall(r"\(([^()]+)\)", text)}
    units = {inside for inside in found if set(inside.split("/")) <= SYMBOLS}
    assert len(units) > 10
    assert [unit for unit in sorted(units) if not UNIT.fullmatch(f"({unit})")] == []
