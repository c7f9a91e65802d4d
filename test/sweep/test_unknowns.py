"""Tests that a varied coefficient has an effect in a scene with unknowns, or is refused with the unknown's name."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rpf3d_core.errors import InputError
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.setup.unknowns import sets_of_scene
from rpf3d_core.sweep.cells import cells_of
from rpf3d_core.sweep.varied import Varied
from rpf3d_core.unknowns.parameter_sets import parameter_sets, write_parameter_sets

LIBRARY = "materials.default.library"
SCENE = """\
terrain: {{benches: {{number: 1, height: 10, floor: 60}}}}
materials:
  face_*: {face}
  default: {default}
sources: [{{name: top, crest: 1, above_ground: 0.5, rocks: 40, velocity: [2, 0, 0]}}]
{more}
engine: reference
"""
KNOWN = "{normal_restitution: 0.4, tangential_restitution: 0.8}"


def scene_of(folder: Path, default: str, more: str = "", face: str = KNOWN) -> Scene:
    (folder / "scene.yaml").write_text(SCENE.format(default=default, face=face, more=more))
    return read_scene(folder / "scene.yaml")


def cells(scene: Scene, varied: dict[str, tuple[Any, ...]]) -> list[Scene]:
    return [cell.scene for cell in cells_of(scene, [Varied(key=key, values=varied[key]) for key in varied])]


@pytest.mark.parametrize(
    ("given", "other"),
    [("bedrock", "talus"), ("bedrock", "pit_talus"), ("pit_talus", "bedrock"), ("bedrock", "hoek_soil")],
)
@pytest.mark.parametrize("face", [KNOWN, "{library: soil}"])
def test_a_varied_entry_of_the_library_is_that_of_a_scene_file(
    tmp_path: Path, given: str, other: str, face: str
) -> None:
    scene = scene_of(tmp_path, f"{{library: {given}}}", face=face)
    made = with_values(scene, {LIBRARY: other})
    written = scene_of(tmp_path, f"{{library: {other}}}", face=face)
    assert made.materials == written.materials
    assert made.unknowns is not None
    assert written.unknowns is not None
    assert list(made.unknowns.priors.items()) == list(written.unknowns.priors.items())
    assert scene_digest(made) == scene_digest(written)
    assert np.array_equal(sets_of_scene(made).values, sets_of_scene(written).values)


def test_a_varied_entry_of_blocks_is_that_of_a_scene_file(tmp_path: Path) -> None:
    more = "rock: {shape: {box: [1, 0.8, 0.6]}}"
    scenes = [scene_of(tmp_path, f"{{library: {name}}}", more, "{library: ramms_hard}")
              for name in ("ramms_soft", "leine_block")]  # fmt: skip
    assert scene_digest(with_values(scenes[0], {LIBRARY: "leine_block"})) == scene_digest(scenes[1])


def test_a_coefficient_of_the_scene_itself_stays_when_the_entry_varies(tmp_path: Path) -> None:
    own = "normal_restitution: 0.2, tangential_restitution: {prior: {min: 0.7, max: 0.8}}"
    made = with_values(scene_of(tmp_path, f"{{library: bedrock, {own}}}"), {LIBRARY: "pit_talus"})
    written = scene_of(tmp_path, f"{{library: pit_talus, {own}}}")
    assert made.materials["default"].normal_restitution == 0.2
    assert scene_digest(made) == scene_digest(written)


def test_entry_and_coefficient_vary_together(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "{library: bedrock}")
    made = with_values(scene, {LIBRARY: "talus", "materials.default.normal_restitution": 0.25})
    written = scene_of(tmp_path, "{normal_restitution: 0.25, library: talus}")
    assert scene_digest(made) == scene_digest(written)


def test_a_prior_that_covers_more_than_the_varied_key_is_refused_by_name(tmp_path: Path) -> None:
    unknowns = "unknowns: {priors: {materials.*.normal_restitution: {min: 0.2, max: 0.6}}}"
    scene = scene_of(tmp_path, KNOWN, unknowns)
    with pytest.raises(InputError, match=r"`materials\.face_\*\.normal_restitution` is varied, but the prior of "
                       r"`materials\.\*\.normal_restitution` gives its value too"):  # fmt: skip
        cells(scene, {"materials.face_*.normal_restitution": (0.3, 0.4)})
    with pytest.raises(InputError, match=r"`materials\.face_\*` is varied, but the prior of"):
        cells(scene, {"materials.face_*": ({"normal_restitution": 0.3, "tangential_restitution": 0.7},)})


def test_a_prior_that_the_varied_keys_cover_gives_way(tmp_path: Path) -> None:
    unknowns = "unknowns: {priors: {materials.*.normal_restitution: {min: 0.2, max: 0.6}}}"
    scene = scene_of(tmp_path, KNOWN, unknowns)
    both = {"materials.face_*.normal_restitution": (0.3,), "materials.default.normal_restitution": (0.4, 0.5)}
    for varied in ({"materials.*.normal_restitution": (0.3, 0.4)}, both):
        assert not any(cell.has_unknowns for cell in cells(scene, varied))
    assert all(cell.has_unknowns for cell in cells(scene, {"materials.*.tangential_restitution": (0.7, 0.8)}))


def test_a_coefficient_of_a_calibrated_sample_cannot_vary(tmp_path: Path) -> None:
    names = ["materials.default.normal_restitution"]
    write_parameter_sets(tmp_path / "posterior.parquet", parameter_sets(names, [[0.3], [0.4], [0.5]]))
    scene = scene_of(tmp_path, "{library: bedrock}", "unknowns: {sample: posterior.parquet}")
    refused: tuple[dict[str, tuple[Any, ...]], ...] = (
        {"materials.default.normal_restitution": (0.3, 0.4)}, {"materials.default.library": ("talus", "soil")},
        {"materials.*.normal_restitution": (0.3, 0.4)}, {"materials.default": ({"library": "talus"},)},
    )  # fmt: skip
    for varied in refused:
        with pytest.raises(InputError, match=r"is varied, but `materials\.default\.normal_restitution` has its values "
                           r"in the sample .*posterior\.parquet"):  # fmt: skip
            cells(scene, varied)
    assert len(cells(scene, {"materials.face_*.normal_restitution": (0.3, 0.4)})) == 2
    assert len(cells(scene, {"materials.default.tangential_restitution": (0.7, 0.8)})) == 2


def test_an_entry_whose_coefficients_the_material_gives_itself_cannot_vary(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, KNOWN)
    for key in (LIBRARY, "materials.*.library"):
        with pytest.raises(InputError, match=r"library` is varied, but the material gives all coefficients"):
            cells(scene, {key: ("bedrock", "talus")})
    assert len(cells(scene, {LIBRARY: ("pit_talus", "pit_coal")})) == 2, "the entries give the friction angle"
    some = scene_of(tmp_path, "{library: soil, normal_restitution: 0.3}")
    assert len(cells(some, {"materials.*.library": ("bedrock", "talus")})) == 2, "one material takes one coefficient"
