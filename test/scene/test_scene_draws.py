"""Tests of distributions in place of numbers; a wrong one is refused with key, line, and what would be right."""

from pathlib import Path

import pytest

from rpf3d_core.errors import SceneError
from rpf3d_core.materials.distributions import (
    Distribution,
    fixed,
    triangular_between,
    truncated_lognormal,
    truncated_normal,
    truncated_power_law,
    truncated_weibull,
    uniform_between,
)
from rpf3d_core.scene.draws import distribution_of
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.scene.releases import RockSpec
from rpf3d_core.scene.zone_materials import material_of
from rpf3d_core.setup.sources import rock_of

SCENE = """\
terrain: {{files: [{{path: slope.obj, zone: hard}}]}}
materials:
  hard:
    normal_restitution: {R_n}
    tangential_restitution: 0.8
    friction_angle_deg: {angle}
rock: {{{rock}}}
sources:
  - {{name: crest, {source}}}
"""
GIVEN = {"R_n": "0.5", "angle": "30", "rock": "mass: 3", "source": "points: [[0, 0, 1]]"}
LINES = {"R_n": 4, "angle": 6, "rock": 7, "source": 9}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "slope.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path


def read(folder: Path, **written: str) -> Scene:
    (folder / "scene.yaml").write_text(SCENE.format(**{**GIVEN, **written}))
    return read_scene(folder / "scene.yaml")


@pytest.mark.parametrize(
    ("written", "distribution"),
    [
        ("0.5", fixed(0.5)),
        ("1", fixed(1.0)),
        ("{mean: 0.25, sd: 0.04, min: 0.1, max: 0.5}", truncated_normal(0.25, 0.04, 0.1, 0.5)),
        ("{mean: 0.25, sd: 0, min: 0.1, max: 0.5}", fixed(0.25)),
        ("{uniform: [0.2, 1]}", uniform_between(0.2, 1.0)),
        ("{lognormal: {mean: 0.4, sd: 0.3, min: 0.05, max: 1}}", truncated_lognormal(0.4, 0.3, 0.05, 1.0)),
        ("{power_law: {exponent: 0.5, min: 0.01, max: 0.8}}", truncated_power_law(0.5, 0.01, 0.8)),
        ("{weibull: {shape: 1.5, scale: 0.4, min: 0.05, max: 1}}", truncated_weibull(1.5, 0.4, 0.05, 1.0)),
        ("{triangular: {min: 0.1, mode: 0.3, max: 1}}", triangular_between(0.1, 0.3, 1.0)),
    ],
)
@pytest.mark.parametrize("key", ["R_n", "rock"])
def test_a_number_or_a_distribution_is_read_as_what_is_drawn(
    folder: Path, key: str, written: str, distribution: Distribution
) -> None:
    scene = read(folder, **{key: f"mass: {written}" if key == "rock" else written})
    value = scene.rock.mass if key == "rock" else material_of(scene, "hard").normal_restitution
    assert value is not None and distribution_of(value) == distribution


@pytest.mark.parametrize(
    ("key", "written", "sentences"),
    [
        ("rock", "mass: {mean: 3, sd: 1}", ["`rock.mass.max` is missing; it must be a number above min",
                                            "`rock.mass.min` is missing; it must be a number below max"]),
        ("rock", "mass: {mean: 3, sd: 1, min: 1, max: 2}", [
            "`rock.mass.mean` is 3, but must lie between min 1 and max 2: the bounds exclude the mean"]),
        ("rock", "mass: {mean: 3, sd: -1, min: 1, max: 5}", ["`rock.mass.sd` is -1, but must be a number >= 0"]),
        ("rock", "mass: {mean: 3, sd: 1, min: 3, max: 3}", ["`rock.mass.min` is 3, but must be a number below max 3"]),
        ("rock", "mass: {mean: 3, sd: .nan, min: 1, max: 5}", ["`rock.mass.sd` is nan, but must be a number >= 0"]),
        ("rock", "mass: {mean: 3, sd: 1, min: -1, max: 5}", [
            "`rock.mass` may be drawn from -1 to 5, but must be above 0"]),
        ("rock", "diameter: {lognormal: {mean: 1, sd: 1, min: 0, max: 5}}", [
            "`rock.diameter` may be drawn from 0 to 5, but must be above 0"]),
        ("rock", "mass: {uniform: [2, 1]}", ["`rock.mass.uniform` is [2, 1], but must be two numbers [low, high]"]),
        ("rock", "mass: {uniform: [1, a]}", ['`rock.mass.uniform` is [1, "a"], but must be two numbers [low, high]']),
        ("rock", "mass: {uniform: 3}", ["`rock.mass.uniform` is 3, but must be two numbers [low, high]"]),
        ("rock", "mass: {uniform: [1, 2], mean: 3}", ["`rock.mass.mean` is not allowed with the other keys there"]),
        ("rock", "volume: {power_law: {exponent: 0, min: 1, max: 2}}", [
            "`rock.volume.power_law.exponent` is 0, but must be a number above 0 (-), b in N(> x) ~ x^-b"]),
        ("rock", "volume: {power_law: {exponnt: 1, min: 1, max: 2}}", [
            "`rock.volume.power_law.exponnt` is not a key of a scene; did you mean `exponent`?"]),
        ("rock", "volume: {power_law: {exponent: 1, min: 3, max: 2}}", [
            "`rock.volume.power_law.min` is 3, but must be a number below max 2"]),
        ("rock", "mass: {lognormal: {mean: 1, sd: 1, min: 2, max: 5}}", [
            "`rock.mass.lognormal.mean` is 1, but must lie between min 2 and max 5: the bounds exclude the mean"]),
        ("rock", "mass: {lognormal: 3}", ["`rock.mass.lognormal` is 3, but must be a mapping with the keys mean, sd,"]),
        ("rock", "mass: {normal: {mean: 1, sd: 1, min: 0, max: 5}}", [
            "`rock.mass.normal` is not a key: a normal distribution is written {mean, sd, min, max}"]),
        ("rock", "mass: {men: 3, sd: 1, min: 1, max: 5}", ["`rock.mass.men` is not a key of a scene; did you mean"]),
        ("rock", "mass: {weibull: {shape: 1.5, scale: 0, min: 1, max: 2}}", [
            "`rock.mass.weibull.scale` is 0, but must be a number above 0"]),
        ("rock", "mass: {weibull: {shape: .nan, scale: 1, min: 1, max: 2}}", [
            "`rock.mass.weibull.shape` is nan, but must be a number above 0"]),
        ("rock", "mass: {weibull: {shape: 2, scale: 1, min: 2, max: 1}}", [
            "`rock.mass.weibull.min` is 2, but must be a number below max 1"]),
        ("rock", "mass: {weibull: {shape: 9, scale: 1, min: 50, max: 90}}", [
            "`rock.mass.weibull.scale` is 1, but min 50 and max 90 cut off all its numbers"]),
        ("rock", "diameter: {weibull: {shape: 2, scale: 1, min: 0, max: 5}}", [
            "`rock.diameter` may be drawn from 0 to 5, but must be above 0"]),
        ("rock", "mass: {triangular: {min: 1, mode: 3, max: 2}}", [
            "`rock.mass.triangular.mode` is 3, but must lie between min 1 and max 2"]),
        ("rock", "mass: {triangular: {min: 1, max: 2}}", [
            "`rock.mass.triangular.mode` is missing; it must be a number from min to max, the most frequent one"]),
        ("rock", "mass: {measured: []}", [
            "`rock.mass.measured` is [], but must be a list of at least one number, or the path of a file"]),
        ("rock", "mass: {measured: [1, .nan]}", ["`rock.mass.measured"]),
        ("rock", "mass: {measured: [3, 0, 1]}", ["`rock.mass` may be drawn from 0 to 3 kg, but must be above 0"]),
        ("rock", "mass: {measured: none.csv}", ["`rock.mass.measured` names 'none.csv', but there is no such file"]),
        ("R_n", "{measured: [0.3, 0.4]}", [
            "`materials.hard.normal_restitution.measured` is for sizes of rocks; give a number or a distribution"]),
        ("rock", "mass: 1, volume: 2", ["`rock` must have exactly one of diameter, mass, volume, but has mass"]),
        ("rock", "mass: [1]", ["`rock.mass` is [1], but must be a number above 0 (kg), or a distribution"]),
        ("R_n", "{mean: 0.5, sd: 0.1, min: 0.2, max: 1.2}", [
            "`materials.hard.normal_restitution` may be drawn from 0.2 to 1.2, but must be at least 0 and at most 1"]),
        ("R_n", "{uniform: [-0.1, 0.5]}", ["`materials.hard.normal_restitution` may be drawn from -0.1 to 0.5,"]),
        ("R_n", "35", [
            "`materials.hard.normal_restitution` is 35, but must be a number from 0 to 1 (-), R_n, or a distribution; "
            "35 % is 0.35"]),
        ("R_n", "35 %", [
            "`materials.hard.normal_restitution` is '35 %', but must be a number from 0 to 1 (-), R_n, or a "
            "distribution; 35 % is 0.35"]),
        ("R_n", "0.3 to 0.45", [
            "`materials.hard.normal_restitution` is '0.3 to 0.45', but must be a number from 0 to 1 (-), R_n, or a "
            "distribution; a range is {prior: {min: 0.3, max: 0.45}}"]),
        ("rock", "mass: 300 to 450", [
            "`rock.mass` is '300 to 450', but must be a number above 0 (kg), or a distribution or measured list; a "
            "range is {prior: {min: 300, max: 450}}"]),
        ("R_n", "1.5", ["`materials.hard.normal_restitution` is 1.5, but must be a number from 0 to 1 (-), R_n, or a"]),
        ("angle", "{mean: 80, sd: 5, min: 60, max: 90}", [
            "`materials.hard.friction_angle_deg` may be drawn from 60 to 90, but must be at least 0 and below 90"]),
        ("source", "points: [[0, 0, 1]], azimuth_deg: 9, speed: {uniform: [-1, 2]}", [
            "`sources[0].speed` may be drawn from -1 to 2, but must be at least 0 (m/s)"]),
        ("source", "points: [[0, 0, 1]], speed: 3", ["`sources[0]` has a speed and no `azimuth_deg`; it must say"]),
        ("source", "points: [[0, 0, 1]], speed: 3, azimuth_deg: 9, velocity: [1, 0, 0]", [
            "`sources[0]` must have velocity or speed, but has both"]),
        ("source", "points: [[0, 0, 1]], spread_deg: 9", [
            "`sources[0].spread_deg` is the direction of a `speed`, and there is none"]),
        ("source", "points: [[0, 0, 1]], steeper_than_deg: 9", [
            "`sources[0].steeper_than_deg` is for the facets of a `zone`, and there is none"]),
        ("source", "zone: hard, spread: [1, 0, 0]", ["`sources[0].spread` is for points and lines; a polygon or zone"]),
        ("source", "polygon: [[0, 0], [1, 0]]", [
            "`sources[0].polygon` is [[0, 0], [1, 0]], but must be three or more corners [x, y] (m) in plan, or the"]),
        ("source", "polygon: []", ["`sources[0].polygon` is [], but must be three or more corners [x, y] (m) in plan"]),
        ("source", "polygon: [[0, 0], [1, 0], [2, 0]]", [
            "`sources[0].polygon` must be the corners of a polygon in their order around it, but is none (it"]),
        ("source", "polygon: [[0, 0], [4, 4], [4, 0], [0, 1]]", [
            "`sources[0].polygon` must be the corners of a polygon in their order around it, but is none (it crosses"]),
        ("source", "polygon: [[0, 0], [1, 0], [1, x]]", [
            '`sources[0].polygon[2]` is [1, "x"], but must be two numbers [x, y] (m)']),
        ("source", "polygon: no.geojson", ["`sources[0].polygon` names 'no.geojson', but there is no such file"]),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused_with_its_line_and_what_would_be_right(
    folder: Path, key: str, written: str, sentences: list[str]
) -> None:
    with pytest.raises(SceneError) as caught:
        read(folder, **{key: written})
    lines = str(caught.value).splitlines()
    assert len(lines) == len(sentences)
    for line, sentence in zip(lines, sentences, strict=True):
        assert line.startswith(f"{folder / 'scene.yaml'}, line {LINES[key]}: {sentence}")


def test_a_pattern_of_zones_in_brackets_is_no_mark_of_a_type(folder: Path) -> None:
    with pytest.raises(SceneError, match=r"`materials\.\[hr\]ard\.normal_restitution` is 2, but must"):
        text = SCENE.format(**{**GIVEN, "R_n": "2"}).replace("  hard:", "  '[hr]ard':")
        (folder / "scene.yaml").write_text(text)
        read_scene(folder / "scene.yaml")


def test_the_digest_tells_a_distribution_from_its_mean(folder: Path) -> None:
    one, other, same = (
        scene_digest(read(folder, rock=f"mass: {mass}"))
        for mass in ("3", "{mean: 3, sd: 1, min: 1, max: 5}", "{max: 5, mean: 3.0, min: 1, sd: 1}")
    )
    assert one != other == same


def test_a_volume_is_a_size_too() -> None:
    by_volume, by_mass = rock_of(RockSpec(density=2000.0, volume=0.5)), rock_of(RockSpec(density=2000.0, mass=1000.0))
    assert by_volume == by_mass
