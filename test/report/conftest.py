"""Fixtures with the results of two small runs, with and without unknowns, and a report of the first."""

from pathlib import Path

import pytest

from rpf3d_core.report.report import write_report
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene

SCENES = Path(__file__).parents[2] / "config" / "scenes"


def flown(scene: str, out: Path, rocks: int) -> Path:
    run_scene(read_scene(SCENES / scene), out, rocks, "reference")
    return out


@pytest.fixture(scope="session")
def unknown_ground(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the result folder of 128 rocks over 64 parameter sets."""
    return flown("bench_15m.yaml", tmp_path_factory.mktemp("unknown") / "run", 128)


@pytest.fixture(scope="session")
def known_ground(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the result folder of 40 rocks in the synthetic pit."""
    return flown("demo.yaml", tmp_path_factory.mktemp("known") / "run", 40)


@pytest.fixture(scope="session")
def report(unknown_ground: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the report of the run with unknowns, as HTML file and as PDF file."""
    folder = tmp_path_factory.mktemp("report")
    write_report(unknown_ground, folder / "r.html", folder / "r.pdf", "North wall <stage 3> & #[ramp]_*")
    return folder / "r.html", folder / "r.pdf"
