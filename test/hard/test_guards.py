"""Tests of the list of guards: each text occurs once in its file, each test exists, README.md has the list."""

import importlib.util
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).parent


def guards() -> ModuleType:
    """Return the script guards.py, loaded as a module."""
    spec = importlib.util.spec_from_file_location("guards", HERE / "guards.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_guard_stands_once_in_its_file():
    script = guards()
    for guard in script.GUARDS:
        assert (script.ROOT / guard.file).read_text().count(guard.text) == 1, guard.test


def test_every_guard_names_a_test_that_there_is():
    for guard in guards().GUARDS:
        file, test = guard.test.split("::")
        assert f"def {test.split('[')[0]}(" in (HERE / file).read_text(), guard.test


def test_the_list_of_the_readme_is_that_of_the_script():
    assert f"\n\n{guards().listed()}\n" in (HERE / "README.md").read_text()
