"""Tests of combined effects: for any combination, both engines give the same bits, and each effect acts.

A combination compiles for about ten seconds and then takes 0.2 GB of memory until its process ends. So `make test`
flies a few of them, and `make combinations` all, in eight successive processes (RPF3D_COMBINATIONS=0/8 to 7/8).
"""

import os
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scenes.small_pit import scene_file

from rpf3d_core.ensemble.flights import Flights, given_columns
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare, releases_in_ranges

pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine to compare with")


def ring(name: str, half: float) -> str:
    """Return the YAML of a square barrier around the centre of the pit, with sides of 2 * half (m)."""
    corners = [[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]]
    return f"{{name: {name}, along: {corners}, height: 2, capacity_kj: 50}}"


NAMED = {
    "roughness": "{angle_sd_deg: 6}",
    "scarring": "{}",
    "drag": "{coefficient: 0.5, accuracy: 0.05}",
    "drag_layer": "{coefficient: 100, height: 3}",
    "forest": "{stems_per_ha: 300}",
    "barriers": f"{{panels: [{', '.join(ring(f'r{half}', half) for half in (120, 140, 160, 180, 200))}]}}",
    "fragmentation": "{least_ratio: 0.4}",
}
"""Effect -> parameters with which it acts in these tests."""
EVERY = [some for n in range(len(NAMED) + 1) for some in combinations(NAMED, n)]
FEW = [(), ("drag", "forest"), tuple(NAMED)]
PART, _, PARTS = os.environ.get("RPF3D_COMBINATIONS", "").partition("/")
CHOSEN = EVERY[int(PART) :: int(PARTS)] if PARTS else FEW
ROCKS = 12


def flown(folder: Path, engine: str, names: tuple[str, ...]) -> Flights:
    """Return the flights of a few rocks in the small pit, with the named effects."""
    more = f"ground: sliding\nengine: {engine}\nmax_time: 120\n"
    more += "effects: {" + ", ".join(f"{name}: {NAMED[name]}" for name in names) + "}"
    prepared = prepare(read_scene(scene_file(folder, more=more)))
    few = releases_in_ranges(prepared, [range(ROCKS) for _ in prepared.sources])
    return fly_ensemble(prepared.engine, prepared.flight, few)


@pytest.mark.long
@pytest.mark.parametrize("names", CHOSEN, ids=lambda names: "-".join(names) or "none")
def test_both_engines_fly_the_same_bits_whatever_is_named(tmp_path: Path, names: tuple[str, ...]) -> None:
    one, other = (flown(tmp_path, engine, names) for engine in ("reference", "compiled"))
    assert len(one.impacts.t) > ROCKS
    for part in ("deposits", "impacts", "paths"):
        for name, values in given_columns(getattr(one, part)).items():
            np.testing.assert_array_equal(values, getattr(getattr(other, part), name), err_msg=f"{part}.{name}")


@pytest.mark.parametrize("name", NAMED)
def test_each_of_them_acts(tmp_path: Path, name: str) -> None:
    plain, one = (flown(tmp_path, "reference", names) for names in ((), (name,)))
    assert not np.array_equal(plain.deposits.x, one.deposits.x)
