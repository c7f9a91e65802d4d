"""Tests that docs/reference/scene-file.md agrees with the model that checks scenes."""

import importlib.util
from pathlib import Path

from rpf3d_core.scene.reading import read_scene

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_of_scene_keys_is_what_the_model_says():
    spec = importlib.util.spec_from_file_location("scene_keys", DOCS / "scene_keys.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = (DOCS / "reference" / "scene-file.md").read_text()
    assert page == module.document(), "run: python docs/scene_keys.py"


def examples() -> list[str]:
    """Return the YAML blocks of the page."""
    page = (DOCS / "reference" / "scene-file.md").read_text()
    return [block.split("```")[0] for block in page.split("```yaml\n")[1:]]


def test_the_least_scene_in_the_document_is_one(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(examples()[0])
    assert [source.rocks for source in read_scene(tmp_path / "scene.yaml").sources] == [1]


def test_the_scene_in_the_document_is_one(tmp_path: Path) -> None:
    text = examples()[1]
    (tmp_path / "unstable.geojson").write_text('{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}')
    (tmp_path / "holes.csv").write_text("x,y,z\n1,2,3\n")
    (tmp_path / "scene.yaml").write_text("terrain: {pit: {}}\n" + text)
    assert [source.name for source in read_scene(tmp_path / "scene.yaml").sources][-1] == "blast"
