"""Tests that the examples of the README work as shown, and that every shipped scene can be simulated."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from programs.command_line import ROOT, python

import rpf3d_core as rpf3d
from rpf3d_core.values import DEPOSITED, Outcome

SCENES = sorted((ROOT / "config" / "scenes").glob("*.yaml"))
README = ROOT / "README.md"
AUTHUME = ROOT.parent / "shared" / "data" / "authume"
FEW = 12


def needs_its_data(scene: Path) -> None:
    if scene.stem.startswith("authume_p1") and not AUTHUME.is_dir():
        pytest.skip(f"the Authume data is not there ({AUTHUME})")


def python_blocks(text: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_scenes_that_the_program_comes_with_are_there() -> None:
    labs = {"lab_22", "lab_40", "lab_40_cube", "lab_40_plate", "lab_50", "lab_59"}
    assert {"demo", "authume_p1", *labs} <= {scene.stem for scene in SCENES}


@pytest.mark.long
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.stem)
def test_every_scene_flies_and_every_rock_ends_with_an_outcome(scene: Path) -> None:
    needs_its_data(scene)
    run = rpf3d.simulate(scene, rocks=FEW, engine="reference")
    deposits = run.flights.deposits
    assert len(deposits.t) == FEW and set(deposits.outcome.tolist()) <= set(Outcome)
    assert np.isfinite(deposits.x).all() and (deposits.impacts >= 1).all()
    assert np.isin(deposits.outcome, DEPOSITED).all(), "the scenes are chosen so that rocks come to rest"


def test_the_demo_has_200_rocks_on_about_150_000_triangles() -> None:
    scene = rpf3d.read_scene(ROOT / "config" / "scenes" / "demo.yaml")
    assert sum(source.rocks for source in scene.sources) == 200
    terrain, faults = rpf3d.read_terrain(scene)
    assert faults.triangles == pytest.approx(150_000, rel=0.03)
    assert {"ramp", "floor", "face", "spill", "bench_1"} <= set(terrain.zones)
    assert {source.velocity for source in scene.sources} == {(2.0, 0.0, 0.0)}


@pytest.mark.parametrize(("angle", "distance"), [(22, 4.794261), (40, 8.226474), (50, 9.803930), (59, 10.970131)])
def test_a_lab_scene_ends_where_the_closed_form_says(angle: int, distance: float) -> None:
    # Reference/validation.md 2.2: distance (m) down the slope from the first impact, printed to seven figures.
    run = rpf3d.simulate(ROOT / "config" / "scenes" / f"lab_{angle}.yaml")
    deposits, impacts = run.flights.deposits, run.flights.impacts
    assert deposits.outcome.tolist() == [Outcome.STOPPED]
    assert np.linalg.norm(deposits.x[0] - impacts.x[0]) == pytest.approx(distance, rel=1e-6)
    assert deposits.t[0] - impacts.t[0] == pytest.approx(2.596752, rel=1e-6)


@pytest.mark.skipif(not README.is_file(), reason="there is no README.md")
def test_the_python_example_of_the_readme_runs_as_it_is_printed(tmp_path: Path) -> None:
    blocks = python_blocks(README.read_text(encoding="utf-8"))
    assert blocks, "the README shows no Python"
    shutil.copytree(ROOT / "config", tmp_path / "config")
    done = python(blocks[0], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip(), "it prints what came out"
    made = list(tmp_path.rglob("summary.json"))
    assert ("write_run" in blocks[0]) == bool(made)


@pytest.mark.skipif(not README.is_file(), reason="there is no README.md")
def test_the_readme_names_only_files_that_exist() -> None:
    text = README.read_text(encoding="utf-8")
    named = re.findall(r"\]\(([^)#]+)\)", text) + re.findall(r"\bconfig/[\w./]+\.yaml\b", text)
    local = [name for name in named if "://" not in name]
    assert local and [name for name in local if not (ROOT / name).exists()] == []


@pytest.mark.skipif(not README.is_file(), reason="there is no README.md")
def test_the_readme_names_only_targets_that_the_makefile_has() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:^|`)make ([a-z-]+)", README.read_text(encoding="utf-8"), re.MULTILINE))
    assert {"demo", "test"} <= named <= targets
