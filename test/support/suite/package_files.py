"""The source files of the packages, for tests of the code itself."""

from pathlib import Path

ROOT = Path(__file__).parents[3]
"""The folder of the project."""

PACKAGES = ("rpf3d_core", "rpf3d_ros")


def files_of(*packages: str) -> list[Path]:
    """Return the paths of all Python files of packages (folders in ROOT), sorted."""
    return sorted(path for package in packages for path in (ROOT / package).rglob("*.py"))
