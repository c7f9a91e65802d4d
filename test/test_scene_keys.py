"""docs/scene-file.md says what the model that checks scenes says."""

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_of_scene_keys_is_what_the_model_says():
    spec = importlib.util.spec_from_file_location("scene_keys", DOCS / "scene_keys.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = (DOCS / "scene-file.md").read_text()
    assert page == module.document(), "run: python docs/scene_keys.py"
