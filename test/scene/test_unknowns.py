"""Tests of unknown values of a scene, and of materials from the library."""

import re
from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.errors import SceneError
from rpf3d_core.live.scene import live_scene
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.library_entries import ENTRIES, POINTS, Range
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.scene.unknowns import PriorSpec
from rpf3d_core.setup.unknowns import sets_of_scene
from rpf3d_core.unknowns.parameter_sets import ParameterSets

KNOWN = """\
terrain: {pit: {triangles: 6000}}
materials:
  bench_1: {normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 31}
  default: {normal_restitution: 0.3, tangential_restitution: {mean: 0.7, sd: 0.05, min: 0.5, max: 0.9}}
sources: [{name: top, zone: bench_1, above_ground: 8, rocks: 75}]
effects: {roughness: {angle_sd_deg: 6}}
"""
CHANGES = {
    "normal_restitution: 0.4": "normal_restitution: {prior: {min: 0.3, max: 0.5}}",
    "mean: 0.7,": "mean: {prior: {mean: 0.7, sd: 0.02, min: 0.65, max: 0.75}},",
    "angle_sd_deg: 6": "angle_sd_deg: {prior: {min: 2, max: 10}}",
}
PATHS = (
    "materials.bench_1.normal_restitution",
    "materials.default.tangential_restitution.mean",
    "effects.roughness.angle_sd_deg",
)


def scene_of(folder: Path, text: str) -> Scene:
    (folder / "scene.yaml").write_text(text)
    return read_scene(folder / "scene.yaml")


def replaced(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes or CHANGES.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(SceneError) as caught:
        scene_of(folder, text)
    return str(caught.value)


def test_a_prior_is_an_unknown_and_its_middle_stands_in_its_place(tmp_path: Path) -> None:
    scene, known = scene_of(tmp_path, replaced(KNOWN)), scene_of(tmp_path, KNOWN)
    assert scene.unknowns is not None and scene.has_unknowns and not known.has_unknowns
    assert tuple(scene.unknowns.priors) == PATHS
    assert scene.unknowns.priors[PATHS[0]] == PriorSpec(min=0.3, max=0.5)
    assert scene.unknowns.sets == 64
    assert scene.materials == known.materials and scene.effects == known.effects


def test_priors_may_also_be_named_by_key_path_for_all_zones(tmp_path: Path) -> None:
    text = replaced(KNOWN) + "unknowns: {sets: 128, priors: {materials.*.friction_angle_deg: {min: 25, max: 35}}}\n"
    unknowns = scene_of(tmp_path, text).unknowns
    assert unknowns is not None and unknowns.sets == 128
    assert set(unknowns.priors) == {*PATHS, "materials.*.friction_angle_deg"}


def test_the_unknowns_of_a_calibration_are_ignored_by_a_run(tmp_path: Path) -> None:
    text = KNOWN + "calibration: {unknowns: {materials.*.friction_angle_deg: {min: 25, max: 35}}}\n"
    scene = scene_of(tmp_path, text)
    assert not scene.has_unknowns and scene.calibration is not None
    assert scene_digest(scene) == scene_digest(scene_of(tmp_path, KNOWN))
    assert scene_digest(scene_of(tmp_path, replaced(KNOWN))) != scene_digest(scene)


OWN_CLASSES = """\
from typing import NamedTuple


class Sand(NamedTuple):
    speed: float = 5.0
    prior: float = 1.0
"""
"""A file of a user with a class that may be named as rebound model or effect; one parameter has the name `prior`."""
OWN_SCENE = KNOWN.replace("effects: {roughness: {angle_sd_deg: 6}}", "{own}")
UNKNOWN_SPEED = "{own.Sand: {speed: {prior: {min: 2, max: 8}}}}"
STOP_SPEED = "stop_speed: {prior: {min: 0.4, max: 0.6}}"


def of_own_class(folder: Path, lines: str) -> Scene:
    """Return a scene with further lines that may name the class `own.Sand`."""
    (folder / "own.py").write_text(OWN_CLASSES)
    return scene_of(folder, OWN_SCENE.replace("{own}", lines))


@pytest.mark.parametrize("more", ["", STOP_SPEED])
@pytest.mark.parametrize("key", ["rebound", "effects"])
def test_a_prior_of_a_users_own_class_is_an_unknown(tmp_path: Path, key: str, more: str) -> None:
    scene, path = of_own_class(tmp_path, f"{key}: {UNKNOWN_SPEED}\n{more}"), f"{key}.own.Sand.speed"
    known = of_own_class(tmp_path, f"{key}: {{own.Sand: {{speed: 5}}}}")
    assert scene.unknowns is not None
    assert list(scene.unknowns.priors) == [path, *(["stop_speed"] if more else [])]
    assert scene.unknowns.priors[path] == PriorSpec(min=2, max=8)
    assert (scene.rebound, scene.effects) == (known.rebound, known.effects)
    drawn = sets_of_scene(scene).at(3)
    flown, written = with_values(scene, drawn), of_own_class(tmp_path, f"{key}: {{own.Sand: {{speed: {drawn[path]}}}}}")
    assert drawn[path] != 5.0
    assert (flown.rebound, flown.effects) == (written.rebound, written.effects)


def test_a_wrong_prior_of_a_users_own_class_is_refused_with_its_key(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"line 6: `effects\.own\.Sand\.speed\.prior` must be .* but has no max"):
        of_own_class(tmp_path, "effects: {own.Sand: {speed: {prior: {min: 2}}}}")


@pytest.mark.parametrize("key", ["rebound", "effects"])
def test_a_users_own_class_may_have_a_parameter_named_prior(tmp_path: Path, key: str) -> None:
    scene = of_own_class(tmp_path, f"{key}: {{own.Sand: {{prior: 3, speed: 5}}}}\n{STOP_SPEED}")
    assert scene.unknowns is not None and list(scene.unknowns.priors) == ["stop_speed"]
    changed = with_values(scene, {f"{key}.own.Sand.speed": 4})
    (own,) = changed.effects.own or (changed.rebound.own,)
    assert own is not None and own.values == {"prior": 3, "speed": 4}


def test_a_value_that_is_given_is_no_longer_unknown(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, replaced(KNOWN))
    changed = with_values(scene, {PATHS[0]: 0.33, "materials.default.tangential_restitution": 0.6})
    assert changed.unknowns is not None and tuple(changed.unknowns.priors) == PATHS[2:]
    assert changed.materials["bench_1"].normal_restitution == 0.33


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.3}}",
         "line 3: `materials.bench_1.normal_restitution.prior` must be {min, max} or {mean, sd, min, max}, but has no "
         "max"),
        ("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.5, max: 0.3}}",
         "line 3: `materials.bench_1.normal_restitution.prior.min` is 0.5, but must be a number below max 0.3"),
        ("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.3, max: 0.5, mean: 0.6, sd: 0.1}}",
         "`materials.bench_1.normal_restitution.prior.mean` is 0.6, but must lie between min 0.3 and max 0.5"),
        ("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.3, max: 0.5, mean: 0.4}}",
         "mean and sd go together"),
        ("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.3, max: 0.5}, sd: 0.1}",
         "`materials.bench_1.normal_restitution.sd` cannot stand next to `prior`"),
        ("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.3, max: 1.5}}",
         "`materials.bench_1.normal_restitution` is 1.5, but must be a number from 0 to 1 (-)"),
        ("", "unknowns: {priors: {materials.face.friction: {min: 0, max: 1}}}",
         "`face` is not one of bench_1, default"),
        ("", "unknowns: {sets: 12}", "`unknowns.sets` is 12, but must be a whole number"),
        ("", "unknowns: {priors: {rock.density: {min: 2000, max: 3000}}}",
         "`rock.density` cannot be an unknown"),
        ("", "unknowns: {sample: none.parquet}", "there is no such file"),
    ],
)  # fmt: skip
def test_a_wrong_prior_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert message in refusal(tmp_path, replaced(KNOWN, (old, new)) if old else f"{KNOWN}{new}\n")


def test_a_material_from_the_library_has_its_ranges_as_unknowns_unless_given(tmp_path: Path) -> None:
    text = replaced(KNOWN, ("{normal_restitution: 0.4, tangential_restitution: 0.8,", "{library: hoek_bedrock,"))
    scene = scene_of(tmp_path, text)
    assert scene.unknowns is not None
    prior = scene.unknowns.priors["materials.bench_1.normal_restitution"]
    assert prior == PriorSpec(min=0.27, max=0.43, mean=0.35, sd=0.04)
    assert scene.materials["bench_1"].library == "hoek_bedrock"
    given = scene_of(tmp_path, text.replace("hoek_bedrock,", "hoek_bedrock, normal_restitution: 0.4,"))
    assert given.unknowns is not None
    assert set(given.unknowns.priors) == {"materials.bench_1.tangential_restitution"}
    assert given.materials["bench_1"].normal_restitution == 0.4


def test_a_wrong_entry_of_the_library_is_refused(tmp_path: Path) -> None:
    of_library = ("{normal_restitution: 0.4, tangential_restitution: 0.8,", "{library: %s,")
    text = replaced(KNOWN, of_library)
    assert (
        "line 3: `materials.bench_1.library` is 'hoek_rock', which is not an entry of the library; did you mean "
        in (refusal(tmp_path, text % "hoek_rock"))
    )
    assert "is ramms_hard, which is for rocks with a shape" in refusal(tmp_path, text % "ramms_hard")
    assert "`materials.bench_1.tangential_restitution` is missing" in refusal(tmp_path, text % "rockyfor3d_bedrock")


def test_rocks_with_a_shape_have_entries_of_their_own(tmp_path: Path) -> None:
    text = """\
terrain: {pit: {triangles: 6000}}
rock: {shape: {box: [1, 1, 0.5]}}
materials: {default: {library: ramms_hard, rolling_resistance: 0.1}}
sources: [{name: top, zone: bench_1, above_ground: 8, rocks: 75}]
"""
    scene = scene_of(tmp_path, text)
    assert scene.unknowns is not None
    assert dict(scene.unknowns.priors) == {"materials.default.friction": PriorSpec(min=0.55, max=2.0)}
    assert "which is for points and spheres" in refusal(tmp_path, text.replace("ramms_hard", "hoek_soil"))
    slip = "slip_friction: {mu_min: 0.4, mu_max: {prior: {min: 1, max: 2}}, kappa: 2, beta: 150}"
    own = scene_of(tmp_path, text.replace("rolling_resistance: 0.1", slip))
    assert own.unknowns is not None and set(own.unknowns.priors) == {
        "materials.default.slip_friction.mu_max", "materials.default.rolling_resistance",
    }  # fmt: skip


def test_spheres_have_the_entries_of_points(tmp_path: Path) -> None:
    text = replaced(KNOWN, ("{normal_restitution: 0.4, tangential_restitution: 0.8,", "{library: hoek_bedrock,"))
    text = text.replace("effects: {roughness: {angle_sd_deg: 6}}", "rock: {shape: sphere}")
    scene = scene_of(tmp_path, text.replace("friction_angle_deg: 31", "rolling_friction: 0.3"))
    assert scene.unknowns is not None
    assert set(scene.unknowns.priors) == {
        f"materials.bench_1.{key}" for key in ("normal_restitution", "tangential_restitution", "friction_angle_deg")
    }
    changed = with_values(scene, {"materials.bench_1.normal_restitution": 0.31})
    assert changed.rock.is_sphere and changed.ground.name == "sphere"


@pytest.mark.parametrize("shape", ["point", "{sphere: false}", "null"])
def test_points_may_be_named_as_such_with_an_entry_of_the_library(tmp_path: Path, shape: str) -> None:
    scene, usual = of_library(tmp_path, "hoek_bedrock", rock=f"shape: {shape}"), of_library(tmp_path, "hoek_bedrock")
    assert scene.unknowns == usual.unknowns and scene.materials == usual.materials


LIBRARY_SCENE = """\
terrain: {{pit: {{triangles: 6000}}}}
rock: {{{rock}}}
materials: {{default: {{library: {entry}}}}}
sources: [{{name: top, zone: bench_1, above_ground: 8, rocks: 75}}]
{more}
"""


def of_library(folder: Path, entry: str, more: str = "", rock: str = "diameter: 1") -> Scene:
    """Return a scene whose ground is an entry of the library."""
    return scene_of(folder, LIBRARY_SCENE.format(entry=entry, more=more, rock=rock))


@pytest.mark.parametrize(
    ("rock", "entry", "ranges"),
    [
        ("diameter: 1", "hoek_bedrock", {"friction_angle_deg": (10, 45)}),
        ("diameter: 1", "pit_talus", {"friction_angle_deg": (25, 45)}),  # from the source of the entry
        ("shape: sphere", "hoek_bedrock", {"friction_angle_deg": (10, 45), "rolling_friction": (0.27, 0.88)}),
        ("shape: sphere", "stone_schist", {"friction_angle_deg": (10, 45), "rolling_friction": (0.315, 0.385)}),
        ("shape: {box: [1, 1, 0.5]}", "ramms_hard", {"rolling_resistance": (0, 0.4)}),
    ],
)
def test_what_the_source_of_an_entry_leaves_out_is_no_known_number(
    tmp_path: Path, rock: str, entry: str, ranges: dict[str, tuple[float, float]]
) -> None:
    scene = of_library(tmp_path, entry, rock=rock)
    assert scene.unknowns is not None
    priors = {path.rpartition(".")[2]: (prior.min, prior.max) for path, prior in scene.unknowns.priors.items()}
    beyond = ("friction_angle_deg", "rolling_friction", "rolling_resistance")
    assert {key: ends for key, ends in priors.items() if key in beyond} == ranges


@pytest.mark.parametrize("path", ["materials.default", "materials.*"])
@pytest.mark.parametrize("key", ["friction_angle_deg", "normal_restitution"])
def test_a_prior_of_the_scene_replaces_the_range_of_an_entry(tmp_path: Path, path: str, key: str) -> None:
    more = f"unknowns: {{priors: {{{path}.{key}: {{min: 0.4, max: 0.42}}}}}}"
    scene = of_library(tmp_path, "bedrock", more)
    assert scene.unknowns is not None
    of_key = {name: prior for name, prior in scene.unknowns.priors.items() if name.endswith(key)}
    assert of_key == {f"{path}.{key}": PriorSpec(min=0.4, max=0.42)}
    assert len(scene.unknowns.priors) == 3
    sets = sets_of_scene(scene)
    drawn = np.array([values_of(sets, number, key) for number in range(len(sets))])
    assert (drawn >= 0.4).all() and (drawn <= 0.42).all()


def values_of(sets: ParameterSets, number: int, key: str) -> float:
    (value,) = [value for name, value in sets.at(number).items() if name.endswith(key)]
    return value


@pytest.mark.parametrize(
    ("rebound", "ground", "asked"),
    [
        ("constant", "none", False), ("constant", "rolling", False), ("constant", "rolling_stone", False),
        ("constant", "{rolling_stone: {stop_speed: 2}}", False), ("constant", "sliding", True),
        ("coulomb_limited", "none", True), ("coulomb_limited", "rolling", True),
    ],
)  # fmt: skip
def test_a_friction_angle_that_no_model_uses_is_no_unknown(
    tmp_path: Path, rebound: str, ground: str, asked: bool
) -> None:
    more = f"rebound: {rebound}\nground: {ground}"
    scene = of_library(tmp_path, "stone_schist", more)
    assert scene.unknowns is not None
    assert ("materials.default.friction_angle_deg" in scene.unknowns.priors) is asked


@pytest.mark.parametrize("ground", ["rolling", "rolling_stone"])
def test_rolling_friction_of_points_is_not_assumed_but_asked_for(tmp_path: Path, ground: str) -> None:
    message = f"line 3: `materials.default.rolling_friction` is not given, but `ground: {ground}` needs it"
    with pytest.raises(SceneError, match=re.escape(message)):
        of_library(tmp_path, "hoek_bedrock", f"ground: {ground}")


@pytest.mark.parametrize("old", ["stone_schist", "hoek_bedrock", "pit_talus"])
@pytest.mark.parametrize("new", ["stone_schist", "hoek_bedrock", "pit_talus"])
@pytest.mark.parametrize("rock", ["diameter: 1", "shape: sphere"])
def test_another_entry_gives_the_scene_of_a_file_with_that_entry(tmp_path: Path, old: str, new: str, rock: str) -> None:
    changed = with_values(of_library(tmp_path, old, rock=rock), {"materials.default.library": new})
    written = of_library(tmp_path, new, rock=rock)
    assert changed.unknowns == written.unknowns and changed.materials == written.materials


def test_every_entry_is_a_range_that_a_scene_may_have() -> None:
    for name, entry in ENTRIES.items():
        spans = [span for span in entry.ranges.values() if isinstance(span, Range)]
        assert spans and entry.source and entry.ground, name
        for key, span in entry.ranges.items():
            if isinstance(span, Range):
                most = {"friction_angle_deg": 90.0, "friction": 10.0, "rolling_friction": 2.0}.get(key, 1.0)
                assert 0.0 <= span.low < span.high <= most, (name, key)
                assert span.mean is None or span.low <= span.mean <= span.high, (name, key)


def test_the_bedrock_of_all_books_holds_that_of_each() -> None:
    every = ENTRIES["bedrock"].ranges
    for name in ("hoek_clean_bedrock", "hoek_bedrock", "pfeiffer_bedrock", "rockyfor3d_bedrock", "stone_carbonate"):
        assert ENTRIES[name].kind == POINTS
        for key, span in every.items():
            other = ENTRIES[name].ranges.get(key)
            if isinstance(span, Range) and isinstance(other, Range):
                middle = other.mean if other.mean is not None else 0.5 * (other.low + other.high)
                assert span.low <= round(middle, 9) <= span.high, (name, key)


def test_a_live_scene_may_have_unknowns(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, replaced(KNOWN))
    live = live_scene({"scene": str(scene.path)})
    assert live.has_unknowns and live.unknowns == scene.unknowns
