"""Tests of YAML anchors and aliases: they are resolved, messages keep line numbers, and expansion is limited."""

import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from rpf3d_core.errors import SceneError
from rpf3d_core.formats import yaml as reader
from rpf3d_core.formats.yaml import read_yaml
from rpf3d_core.scene.reading import read_scene, scene_digest

MATERIAL = "{normal_restitution: 0.5, tangential_restitution: 0.8}"
SCENE = """\
terrain: {{pit: {{}}}}
materials:
  default: {first}
  ramp: {second}
sources:
  - {{name: west, points: {points}, rocks: 2}}
  - {{name: east, points: {again}}}
"""
LAUGHS = "a0: &a0 [ha, ha, ha, ha, ha, ha, ha, ha, ha, ha]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12)
)
"""YAML text whose aliases expand to 10^12 words."""
SOON = 20.0
"""Longest time (s) until a file is refused, on a busy machine."""


def read(folder: Path, text: str) -> Any:
    path = folder / "file.yaml"
    path.write_text(text)
    return read_yaml(path)


def scene(folder: Path, **values: str) -> Path:
    """Write a scene file with material and points, each replaced by `values` of its name; return its path."""
    path = folder / "scene.yaml"
    points = "[[-570.0, -10.0, 0.0], [-570.0, 40.0, 0.0]]"
    given = {"first": MATERIAL, "second": MATERIAL, "points": points, "again": points}
    path.write_text(SCENE.format(**given | values))
    return path


def test_an_alias_is_a_copy_of_the_value_with_the_anchor(tmp_path: Path) -> None:
    document = read(tmp_path, "a: &a {x: 1, y: [2, no]}\nb: *a\nc: [*a, 3, *a]\n")
    value = {"x": 1, "y": (2, "no")}
    assert document.values == {"a": value, "b": value, "c": (value, 3, value)} and not document.faults
    assert document.values["b"] is not document.values["a"], "a change of one would change the other"


def test_what_a_program_writes_with_aliases_is_read_as_the_program_reads_it(tmp_path: Path) -> None:
    point, shared = [1.5, 2.0, 3.0], {"k": 1}
    content = {"a": [point, point], "b": {"c": shared, "d": [shared, {"e": point}]}}
    text = yaml.safe_dump(content)
    assert "*id001" in text and "*id002" in text
    assert read(tmp_path, text).values == read(tmp_path, yaml.safe_dump(content, default_flow_style=True)).values
    assert read(tmp_path, text).values["b"]["d"] == ({"k": 1}, {"e": (1.5, 2.0, 3.0)})


def test_a_scene_with_aliases_is_the_scene_written_out(tmp_path: Path) -> None:
    whole = read_scene(scene(tmp_path))
    short = scene(tmp_path, first=f"&rock {MATERIAL}", second="*rock", points="&line [[-570, -10, 0], [-570, 40, 0]]",
                  again="*line")  # fmt: skip
    assert scene_digest(read_scene(short)) == scene_digest(whole)


def test_a_fault_in_a_copied_value_has_the_copys_key_and_the_line_where_the_value_is_written(tmp_path: Path) -> None:
    wrong = MATERIAL.replace("0.5", "1.5")
    with pytest.raises(SceneError) as caught:
        read_scene(scene(tmp_path, first=f"&rock {wrong}", second="*rock"))
    faults = str(caught.value).splitlines()
    assert ["`materials.default.normal_restitution` is 1.5" in fault for fault in faults] == [True, False]
    assert ["`materials.ramp.normal_restitution` is 1.5" in fault for fault in faults] == [False, True]
    assert all("scene.yaml, line 3:" in fault for fault in faults)


def test_a_fault_of_the_copy_itself_has_the_line_of_the_alias(tmp_path: Path) -> None:
    anchored = "{normal_restitution: &half 0.5, tangential_restitution: *half, draw: &part {normal_restitution: 0.5}}"
    with pytest.raises(SceneError) as caught:
        read_scene(scene(tmp_path, first=anchored, second="*part"))
    assert "scene.yaml, line 4: `materials.ramp.tangential_restitution` is missing" in str(caught.value)


def test_aliases_that_repeat_without_end_are_refused_by_name_and_line_at_once(tmp_path: Path) -> None:
    began = time.process_time()
    with pytest.raises(SceneError, match=r"file.yaml, line 5: the alias \*a3 brings the values that aliases repeat to "
                                         r"more than 100,000; use fewer aliases"):  # fmt: skip
        read(tmp_path, LAUGHS)
    assert time.process_time() - began < SOON


def test_the_limit_counts_what_aliases_repeat_and_not_what_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "MOST_REPEATED", 12)
    written = "a: &a [1, 2, 3]\nb: " + str(list(range(50)))
    assert len(read(tmp_path, f"{written}\nc: [*a, *a, *a]\n").values["c"]) == 3, "12 values: three lists of three"
    with pytest.raises(SceneError, match=r"line 4: the alias \*a "):
        read(tmp_path, f"{written}\nc: [*a, *a, *a]\nd: *a\n")


@pytest.mark.parametrize(
    "text", ["a: &a {b: *a}\n", "a: &a [[*a]]\n", "x: 1\na: &a {b: &b [*a], c: *b}\n"], ids=["map", "list", "twice"]
)
def test_an_alias_inside_its_own_anchor_is_refused_by_name_and_line(tmp_path: Path, text: str) -> None:
    line = text.count("\n")
    with pytest.raises(SceneError, match=rf"file.yaml, line {line}: the alias \*a stands inside its own anchor"):
        read(tmp_path, text)


def test_a_long_chain_of_aliases_is_refused_and_breaks_nothing(tmp_path: Path) -> None:
    chain = "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 2000))
    with pytest.raises(SceneError):
        read(tmp_path, f"a0: &a0 x\n{chain}")


def test_merge_keys_are_refused_by_key_and_line_and_a_quoted_one_is_a_word(tmp_path: Path) -> None:
    document = read(tmp_path, "a: &a {x: 1}\nb:\n  <<: *a\n  y: 2\n'<<': 3\n")
    (fault,) = document.faults
    assert fault.line == 3 and "`b.<<` is a merge key" in fault.sentence
    assert document.values == {"a": {"x": 1}, "b": {"y": 2}, "<<": 3}


def test_an_alias_in_place_of_a_key_and_an_anchor_given_twice_are_refused(tmp_path: Path) -> None:
    assert [fault.line for fault in read(tmp_path, "a: &a x\nb: {*a : 1}\n").faults] == [2]
    with pytest.raises(SceneError, match="duplicate anchor 'a'"):
        read(tmp_path, "a: &a 1\nb: &a 2\n")
