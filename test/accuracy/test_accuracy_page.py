"""Tests that docs/explanation/accuracy.md is what its command writes, apart from the measured figures."""

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_on_accuracy_has_the_text_and_the_pictures_of_the_command_that_writes_it() -> None:
    spec = importlib.util.spec_from_file_location("accuracy", DOCS / "accuracy.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = (DOCS / "explanation" / "accuracy.md").read_text()
    assert page.startswith(module.HEAD) and page.endswith(module.READING), "run: make accuracy"
    assert page == "\n".join([module.HEAD, *module.kept_sections(), module.READING])
    for name, measured in module.MEASURED.items():
        assert f"## {measured.title}\n" in page
        assert f"../pictures/cost_{name}.png" not in page or (DOCS / "pictures" / f"cost_{name}.png").is_file()
