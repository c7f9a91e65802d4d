"""Tests of each cell of the table of effects by shape: the effect changes the flights or is refused by name."""

import sys
from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.errors import SceneError
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))
import effects_by_shape as page  # noqa: E402

EXAMPLES = {
    "roughness": "{angle_sd_deg: 8}",
    "scarring": "{}",
    "drag": "{coefficient: 2}",
    "drag_layer": "{coefficient: 200}",
    "forest": "{stems_per_ha: 2000}",
    "barriers": "{panels: [{name: net, along: [[14, -35], [14, 35]], height: 8, capacity_kj: 20}]}",
    "fragmentation": "{least_ratio: 0.2, least_volume: 0.01}",
}
"""Parameters with which each effect acts on the rocks of the scene."""
POINT = "{normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 30, rolling_friction: 0.4}"
BODY = "{restitution: 0.3, friction: 0.6, rolling_resistance: 0.2}"
SHAPES = {"point": ("point", POINT), "sphere": ("sphere", POINT), "body": ("{box: [1, 0.8, 0.6]}", BODY)}
SLOPE = "v 0 -40 40\nv 60 -40 0\nv 60 40 0\nv 0 40 40\nf 1 2 3\nf 1 3 4\n"


def flown(folder: Path, shape: str, effect: str = ""):
    """Return the places (N, 3) m of the ends and of the impacts of a few rocks of a shape. effect : "" for none"""
    kind, material = SHAPES[shape]
    named = f"effects: {{{effect}: {EXAMPLES[effect]}}}\n" if effect else ""
    (folder / "slope.obj").write_text(SLOPE)
    (folder / "scene.yaml").write_text(
        f"terrain: {{files: [{{path: slope.obj, zone: slope}}]}}\nmaterials: {{default: {material}}}\n"
        f"rock: {{density: 2700, diameter: 0.9, shape: {kind}}}\n"
        "sources: [{name: top, line: [[4, -9, 0], [4, 9, 0]], above_ground: 6, rocks: 4, velocity: [4, 0.5, 0]}]\n"
        f"engine: reference\nmax_time: 6\nhazard: {{cell: 5}}\n{named}"
    )
    done = simulate(read_scene(folder / "scene.yaml")).flights
    return done.deposits.x, done.impacts.x


@pytest.mark.parametrize("shape", page.SHAPES)
@pytest.mark.parametrize("effect", list(page.specs()))
def test_a_cell_of_the_table_is_what_a_scene_does(tmp_path, effect, shape):
    if page.cell(page.specs()[effect], shape) == page.REFUSED:
        with pytest.raises(SceneError, match=rf"`effects\.{effect}` does not act on rocks with a shape: \w+"):
            flown(tmp_path, shape, effect)
        return
    stops, impacts = flown(tmp_path, shape, effect)
    plain, blows = flown(tmp_path, shape)
    assert len(blows) and not (np.array_equal(stops, plain) and np.array_equal(impacts, blows)), "the effect acts"


def test_the_page_is_what_its_program_writes():
    assert page.PAGE.read_text(encoding="utf-8") == page.document(), "run python docs/effects_by_shape.py"


def test_parameters_of_scarring_that_are_for_points_are_refused_with_the_key_to_give(tmp_path, monkeypatch):
    for key, instead in page.specs()["scarring"].REPLACED_FOR_BODIES.items():
        monkeypatch.setitem(EXAMPLES, "scarring", f"{{{key}: 1}}")
        with pytest.raises(SceneError, match=rf"`effects\.scarring\.{key}` is for points and spheres") as caught:
            flown(tmp_path, "body", "scarring")
        assert instead in str(caught.value)
