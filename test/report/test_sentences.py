"""Tests of a report's sentences: file names keep capitals, and one degree is singular."""

from pathlib import Path

import pytest

from rpf3d_core.formats.words import scene_name, whole_degrees
from rpf3d_core.report.warnings_part import as_sentence


@pytest.mark.parametrize(
    ("warning", "sentence"),
    [
        ("pit.dxf: has 3 holes", "pit.dxf: has 3 holes."),
        ("north wall.dxf: is its unit mm?", "north wall.dxf: is its unit mm?"),
        ("pit.dxf has 3 holes", "pit.dxf has 3 holes."),
        ("a rock reaches 160 m/s", "A rock reaches 160 m/s."),
        ("the factor is 1.5: too large", "The factor is 1.5: too large."),
        ("a hole in pit.dxf has 3 m2", "A hole in pit.dxf has 3 m2."),
        (
            "`rock.mass` has no rock above 1 kg; is its mass in t?",
            "`rock.mass` has no rock above 1 kg; is its mass in t?",
        ),
    ],
)
def test_a_file_name_keeps_its_letters_at_the_beginning_of_a_sentence(warning: str, sentence: str) -> None:
    assert as_sentence(warning) == sentence


@pytest.mark.parametrize(
    ("angle", "text"), [(1.0, "1 degree"), (0.6, "1 degree"), (0.0, "0 degrees"), (35.2, "35 degrees")]
)
def test_one_degree_is_singular(angle: float, text: str) -> None:
    assert whole_degrees(angle) == text


@pytest.mark.parametrize(
    ("path", "name"), [("pit/north/scene.yaml", "north"), ("pit/north.yaml", "north"), ("/scene.yaml", "scene")]
)
def test_a_scene_yaml_has_the_name_of_its_folder(path: str, name: str) -> None:
    assert scene_name(Path(path)) == name
