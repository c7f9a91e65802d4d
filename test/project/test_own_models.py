"""Tests of own models and effects, with the files of docs/howto/own-models.md."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rpf3d_core
from rpf3d_core.errors import InputError

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "own-models.md"
ROCKS = 12
SCENE = """
terrain: {pit: {triangles: 2000}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
sources:
  - {name: west, line: [[-570, -10, 0], [-570, 40, 0]], above_ground: 1.0, velocity: [3, 0, 0]}
ground: sliding
outputs: {pictures: false, recording: false}
"""

BREAKER = """
from typing import NamedTuple
from rpf3d_core.effects.hooks import breaks
from rpf3d_core.jit.dispatch import kernel

class Breaker(NamedTuple):
    share: float = 1.0

@breaks.rule(Breaker)
def breaks_always(effect, before, after, n, rock):
    return True
"""
"""An effect of the user's own that breaks rocks, in `breaker.py`."""


def blocks(kind: str) -> list[str]:
    """Return the code blocks of a language on the page."""
    return re.findall(rf"```{kind}\n(.*?)```", PAGE.read_text(), flags=re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with the Python files of the page and `breaker.py`."""
    (tmp_path / "breaker.py").write_text(BREAKER)
    for name, text in zip(("sand.py", "stones.py"), blocks("python"), strict=True):
        (tmp_path / name).write_text(text)
    return tmp_path


def scene_with(folder: Path, *lines: str) -> Path:
    """Write SCENE with further lines into the folder; return its path."""
    path = folder / "scene.yaml"
    path.write_text(SCENE + "\n".join(lines) + "\n")
    return path


def ends(scene: Path, engine: str) -> np.ndarray:
    """Return (N, 5) the end (m), time (s) and number of impacts of the rocks of a scene."""
    deposits = rpf3d_core.simulate(scene, rocks=ROCKS, engine=engine).flights.deposits
    return np.column_stack([deposits.x, deposits.t, deposits.impacts])


@pytest.mark.long
def test_the_models_of_the_page_fly_alike_on_both_engines_and_change_the_answer(folder: Path) -> None:
    plain = ends(scene_with(folder), "reference")
    scene = scene_with(folder, *blocks("yaml"))
    both = ends(scene, "reference")
    np.testing.assert_array_equal(both, ends(scene, "compiled"))
    for line in blocks("yaml"):
        alone = ends(scene_with(folder, line), "reference")
        assert not np.array_equal(alone, plain) and not np.array_equal(alone, both), line


def test_an_effect_of_no_strength_leaves_every_bit_as_it_was(folder: Path) -> None:
    calm = scene_with(folder, "effects: {stones.Stones: {tilt_deg: 0}}")
    np.testing.assert_array_equal(ends(calm, "reference"), ends(scene_with(folder), "reference"))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("rebound: mud.Mud", "the module 'mud'"),
        ("rebound: sand.Sound", "sand.py has no 'Sound'"),
        ("rebound: sand.softened", "no NamedTuple"),
        ("rebound: {sand.Sand: {sped: 4}}", "a 'sped'; it has no such parameter, but speed"),
        ("rebound: {sand.Sand: {speed: fast}}", "'fast' as speed, which must be a number"),
        ("rebound: {sand.Sand: {}, constant: {}}", "exactly one"),
        ("rebound: {sand.Sand: {}, stones.Stones: {tilt_deg: 1}}", "exactly one"),
        ("rebound: {stones.Stones: {tilt_deg: 1}}", "@rebound.rule(Stones)"),
        ("effects: {breaker.Breaker: {}}", "a rule for breaks; only the effect `fragmentation`"),
        ("effects: {stones.Stones: }", "without tilt_deg"),
        ("effects: {sand.Sand: }", "felt_normal"),
        ("effects: {broken.Broken: }", "broken.py, which cannot be run: ZeroDivisionError"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_key_and_the_reason(folder: Path, line: str, said: str) -> None:
    (folder / "broken.py").write_text("1 / 0\n")
    with pytest.raises(InputError) as refusal:
        ends(scene_with(folder, line), "reference")
    assert said in str(refusal.value) and line.split(":")[0] in str(refusal.value)


LOOP = """
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Motion


@loop
def bounce(model, out):
    motion = Motion(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, -3.0), (0.0, 0.0, 0.0))
    out[0] = rebound(model, Surface(0.5, 0.8, 0.5, 0.5), motion, (0.0, 0.0, 1.0), RockContext(None, None, 0)).v[2]
"""
RUN = """
import sys
import numpy as np
from rpf3d_core.scene.reading import read_scene
from little_loop import bounce
out = np.zeros(1)
bounce(read_scene(sys.argv[1]).rebound.model_spec.made(), out)
print(out[0], len(bounce.stats.cache_hits))
"""
"""Program with a loop over one model; the whole engine would take ten times as long to compile."""


def bounced_apart(scene: Path, cache: Path) -> tuple[float, int]:
    """Return the speed (m/s) after a bounce in a separate process, and how many loops it loaded from the cache."""
    where = {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": os.pathsep.join([str(PAGE.parents[2]), str(scene.parent)])}
    out = subprocess.run(
        [sys.executable, "-c", RUN, str(scene)], env=os.environ | where, capture_output=True, text=True, check=True
    )
    speed, hits = out.stdout.split()
    return float(speed), int(hits)


@pytest.mark.long
def test_an_edit_of_the_file_is_noticed_and_the_disk_cache_serves_other_processes(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("numba", reason="numba is not installed: nothing is compiled")
    (folder / "little_loop.py").write_text(LOOP)
    scene, cache = scene_with(folder, "rebound: sand.Sand"), tmp_path / "cache"
    first = bounced_apart(scene, cache)
    assert first == (pytest.approx(0.5 / 1.6 * 3.0), 0)
    assert bounced_apart(scene, cache) == (first[0], 1)
    file = folder / "sand.py"
    file.write_text(file.read_text().replace("into / speed", "2.0 * into / speed"))
    assert bounced_apart(scene, cache) == (pytest.approx(0.5 / 2.2 * 3.0), 0)
    assert bounced_apart(scene_with(folder), cache) == (1.5, 0), "a scene without it has a cache of its own"
