"""Tests that docs/reference/effects.md agrees with the models and effects that scenes may name."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import pytest

from rpf3d_core.scene.listings.catalogue import COSTS, entries

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def page() -> ModuleType:
    """Return the module docs/effects.py, which writes the page."""
    spec = importlib.util.spec_from_file_location("effects_page", ROOT / "docs" / "effects.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_what_the_models_say(page: ModuleType) -> None:
    written = (ROOT / "docs" / "reference" / "effects.md").read_text()
    assert written == page.document(entries()), "run: python docs/effects.py --as-is"


def test_the_page_has_everything_that_can_be_named(page: ModuleType) -> None:
    written = page.document(entries())
    assert [entry.name for entry in entries() if f"### `{entry.name}`" not in written] == []


def test_everything_that_can_be_named_has_been_measured() -> None:
    costs = json.loads((ROOT / "rpf3d_core" / COSTS).read_text())
    offered = {f"{entry.kind}.{entry.name}" for entry in entries()}
    assert set(costs) == offered - {"contact.rigid"}, "run: make effects"


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: f"{entry.kind}.{entry.name}")
def test_each_says_what_it_does_where_it_is_from_and_how_far_that_is_confirmed(entry) -> None:
    assert entry.summary.endswith(".") and entry.source
    for parameter in entry.parameters:
        assert parameter.meaning and parameter.source
        if "UNCONFIRMED" in (parameter.confirmed, entry.confirmed):
            assert "unconfirmed" in (parameter.meaning + entry.summary).lower(), parameter.name
