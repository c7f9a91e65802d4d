"""Tests that a scene without obstacles does not import their modules."""

import subprocess
import sys
from pathlib import Path

import pytest
from scenes import small_pit

ROOT = Path(__file__).parents[2]
CODE = """
import sys
from rpf3d_core.runs.run import run_scene
run_scene(sys.argv[1], sys.argv[2], rocks=4, engine="reference", recording=False)
ROOMS = tuple(f"rpf3d_core.{room}" for room in ("effects", "hazard", "formats", "results", "materials"))
print(*sorted(name for name in sys.modules if name.startswith(ROOMS)
    and name.split(".")[-1] in {
    "barriers", "barrier_arrivals", "forest", "obstacle_cells", "barriers_report", "gamma", "tree_files"}))
"""
FENCE = "effects: {barriers: {panels: [{name: a, along: [[-20, 0], [20, 0]], height: 3, capacity_kj: 9}]}}"


@pytest.mark.parametrize(("more", "named"), [("", False), (FENCE, True)], ids=["none", "barriers"])
def test_what_a_scene_does_not_name_is_not_imported(tmp_path, more, named):
    scene = small_pit.scene_file(tmp_path, more=more)
    command = [sys.executable, "-c", CODE, str(scene), str(tmp_path / "out")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    found = done.stdout.split()
    assert ("rpf3d_core.effects.barriers" in found) == named
    assert "rpf3d_core.effects.forest" not in found and (named or found == [])
