"""Tests of warnings about closed source lines and lines on several DXF layers: rocks start along all of them."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.errors import InputError
from rpf3d_core.formats.mine import dxf_lines
from rpf3d_core.formats.mine.dxf_drawing import read_drawing
from rpf3d_core.formats.mine.dxf_lines import read_dxf_lines
from rpf3d_core.formats.polylines import read_lines
from rpf3d_core.imports.layer import import_layer
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.warnings.layers import warnings_of_layers
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of

SCENE = """\
terrain: {{pit: {{triangles: 6000}}, up: {up}}}
materials: {{default: {{normal_restitution: 0.4, tangential_restitution: 0.8}}}}
sources: [{{name: crest, above_ground: 0.5, line: {line}}}]
"""
CREST = [[10.0 * x, 0.02 * (x - 6) ** 2] for x in range(13)]
TURN = np.linspace(0.0, 2.0 * np.pi, 41)[:-1]
RING = np.column_stack([60.0 * np.cos(TURN), 60.0 * np.sin(TURN)]).round(3).tolist()


def warned(folder: Path, line: object, up: str = "z") -> list[str]:
    (folder / "scene.yaml").write_text(SCENE.format(line=json.dumps(line), up=up))
    scene = read_scene(folder / "scene.yaml")
    sentences = (*warnings_of(scene), *warnings_of_layers(scene))
    found = [each for each in sentences if each.startswith("`sources[0].line`")]
    return [each for each in found if "turns back" not in each]


def dxf(*lines: tuple[str, bool, list[list[float]]]) -> str:
    """Return a DXF text with one LWPOLYLINE for each (layer, whether it is closed, points (P, 2) m)."""
    rows = ["0", "SECTION", "2", "ENTITIES"]
    for layer, is_closed, points in lines:
        rows += ["0", "LWPOLYLINE", "8", layer, "90", str(len(points)), "70", str(int(is_closed))]
        rows += [text for x, y in points for text in ("10", str(x), "20", str(y))]
    return "\n".join([*rows, "0", "ENDSEC", "0", "EOF", ""])


def test_the_closing_segment_of_a_crest_is_warned_of_with_its_length(tmp_path: Path) -> None:
    (tmp_path / "crest.dxf").write_text(dxf(("CREST", True, CREST)))
    (found,) = warned(tmp_path, "crest.dxf")
    assert found.startswith("`sources[0].line` of 'crest' is closed: rocks start along its closing segment, too, 12")
    assert "too, 120 m from (120, 0.72) to (0, 0.72); if this segment is no crest, open the line" in found
    (tmp_path / "crest.dxf").write_text(dxf(("CREST", False, CREST)))
    assert not warned(tmp_path, "crest.dxf")


@pytest.mark.parametrize("up", ["z", "y"])
def test_a_closed_line_in_the_scene_is_warned_of(tmp_path: Path, up: str) -> None:
    assert len(warned(tmp_path, [*CREST, CREST[0]], up)) == 1
    assert len(warned(tmp_path, [[0, 0], [60, 0], [60, 60], [0, 0]], up)) == 1
    assert not warned(tmp_path, CREST, up)


def test_a_crest_around_a_whole_pit_is_right(tmp_path: Path) -> None:
    assert not warned(tmp_path, [*RING, RING[0]])
    (tmp_path / "ring.dxf").write_text(dxf(("CREST", True, RING)))
    assert not warned(tmp_path, "ring.dxf")


def test_lines_on_several_layers_are_named_and_counted(tmp_path: Path) -> None:
    other = [[x, y + 50.0] for x, y in CREST]
    (tmp_path / "pit.dxf").write_text(dxf(("RAMP", False, other), ("CREST", False, CREST), ("CREST", False, other)))
    (found,) = warned(tmp_path, "pit.dxf")
    assert "uses all 3 lines of its file, on 2 layers: RAMP (1), CREST (2); if some are no crests, write" in found
    command = f"{tmp_path / 'pit.dxf'} --kind line --layer LAYER --out {tmp_path / 'crests.geojson'}"
    assert f"rpf3d import layer {command}" in found
    (tmp_path / "pit.dxf").write_text(dxf(("CREST", False, other), ("CREST", False, CREST)))
    assert not warned(tmp_path, "pit.dxf")
    many = [(f"L{number}", False, CREST) for number in range(11)]
    (tmp_path / "pit.dxf").write_text(dxf(*many))
    assert "L7 (1) and 3 more" in warned(tmp_path, "pit.dxf")[0]


def test_the_command_on_layers_works_in_any_folder(tmp_path: Path, monkeypatch) -> None:
    """The drawing is in a folder next to the scene, and the new file belongs next to the scene, which names it."""
    (tmp_path / "mine" / "survey").mkdir(parents=True)
    text = dxf(("RAMP", False, CREST), ("CREST", False, CREST))
    (tmp_path / "mine" / "survey" / "pit.dxf").write_text(text)
    monkeypatch.chdir(tmp_path)
    (found,) = warned(tmp_path / "mine", "survey/pit.dxf")
    command = shlex.split(found[found.index("rpf3d import layer") :])
    assert command[3:] == ["mine/survey/pit.dxf", "--kind", "line", "--layer", "LAYER", "--out", "mine/crests.geojson"]
    assert import_layer(Path(command[3]), Path(command[-1]), "line", "CREST").number == 1


def test_the_command_of_the_warning_writes_the_lines_of_one_layer(tmp_path: Path) -> None:
    ramp = [[x, y + 50.0] for x, y in CREST]
    (tmp_path / "pit.dxf").write_text(dxf(("RAMP", False, ramp), ("CREST", False, CREST)))
    assert import_layer(tmp_path / "pit.dxf", tmp_path / "crests.geojson", "line", "CREST").number == 1
    (line,) = read_lines(tmp_path / "crests.geojson")
    assert line.tolist() == CREST
    with pytest.raises(InputError, match="has no line on layer 'ROAD'; there are lines on CREST, RAMP"):
        import_layer(tmp_path / "pit.dxf", tmp_path / "roads.geojson", "line", "ROAD")


def test_curves_on_another_layer_do_not_matter(tmp_path: Path) -> None:
    text = dxf(("CREST", False, CREST)).replace("ENTITIES\n", "ENTITIES\n0\nCIRCLE\n8\nPUMP\n10\n0\n20\n0\n40\n5\n")
    (tmp_path / "pit.dxf").write_text(text)
    with pytest.raises(InputError, match="1, the first a CIRCLE"):
        read_dxf_lines(tmp_path / "pit.dxf")
    assert len(read_dxf_lines(tmp_path / "pit.dxf", "CREST")) == 1
    with pytest.raises(InputError, match=r"has no line on layer 'CRST'; there are lines on CREST$"):
        import_layer(tmp_path / "pit.dxf", tmp_path / "crests.geojson", "line", "CRST")


def test_a_dxf_that_was_changed_is_read_again_and_one_that_was_not_is_not(tmp_path: Path, monkeypatch) -> None:
    read, path = [], tmp_path / "pit.dxf"
    monkeypatch.setattr(dxf_lines, "read_drawing", lambda path: read.append(path) or read_drawing(path))
    for lines in (("CREST", False, CREST),), (("CREST", False, CREST),) * 2:
        path.write_text(dxf(*lines))
        assert [len(read_dxf_lines(path)) for _ in range(3)] == [len(lines)] * 3
    assert read == [path, path]


ALL_KEYS = """\
terrain: {pit: {triangles: 6000}, berms: [{name: windrow, along: lines.dxf, height: 1, width: 4}]}
zones: [{zone: road, polygons: rings.dxf}]
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}
sources: [{name: blast, above_ground: 0.5, polygon: rings.dxf}]
areas_of_interest: [{name: haul road, polygons: rings.dxf}]
effects: {barriers: {panels: [{name: net, along: lines.dxf, height: 3, capacity_kj: 500}]}}
"""


def test_areas_zones_berms_and_barriers_with_several_layers_are_warned_of_too(tmp_path: Path) -> None:
    """An area of a road and of the pit limit gave 100 % instead of 75 %."""
    (tmp_path / "scene.yaml").write_text(ALL_KEYS)
    (tmp_path / "rings.dxf").write_text(dxf(("ROAD", True, RING), ("PIT_LIMIT", True, RING)))
    (tmp_path / "lines.dxf").write_text(dxf(("FENCE", False, CREST), ("CREST", False, CREST)))
    found = {each.split("`")[1]: each for each in warnings_of_layers(read_scene(tmp_path / "scene.yaml"))}
    assert list(found) == [
        "sources[0].polygon", "areas_of_interest[0].polygons", "zones[0].polygons", "terrain.berms[0].along",
        "effects.barriers.panels[0].along",
    ]  # fmt: skip
    area = found["areas_of_interest[0].polygons"]
    assert "uses all 2 polygons of its file, on 2 layers: ROAD (1), PIT_LIMIT (1); if some are no polygons of" in area
    command = f"{tmp_path / 'rings.dxf'} --kind polygon --layer LAYER --out {tmp_path / 'haul_road.geojson'}"
    assert f"rpf3d import layer {command}" in area
    assert import_layer(tmp_path / "rings.dxf", tmp_path / "haul_road.geojson", "polygon", "ROAD").number == 1
    for name in ("rings.dxf", "lines.dxf"):
        (tmp_path / name).write_text(dxf(("ONE", True, RING), ("ONE", True, RING)))
    assert not list(warnings_of_layers(read_scene(tmp_path / "scene.yaml")))
