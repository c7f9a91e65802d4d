"""Tests that the times that `rpf3d run` prints are consecutive and add up to the time of the whole run."""

import re
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from input_files.terrain_files import SLOPE, grid, write_binary_stl
from programs.command_line import rpf3d

from rpf3d_core.commands import stopwatch as module
from rpf3d_core.commands.stopwatch import Part, RunTimes, words_of

ROUNDING = 1e-9
ENDS = 1.0
"""Longest time to start Python and to end, over the printed time or over 1 s if this is longer."""


def a_run() -> Any:
    """Return the times of a run that was prepared from 10 s to 15 s and flew until 20 s."""
    prepared = SimpleNamespace(began=10.0, read_s=3.0, index_s=2.0)
    return SimpleNamespace(prepared=prepared, flights=SimpleNamespace(compile_s=1.0, fly_s=3.5), wall_s=10.0)


def test_the_parts_follow_each_other_without_gap_and_count_no_second_twice() -> None:
    times = RunTimes()
    times.began, times.measured_s = 1.0, 5.0
    parts = times.parts(a_run(), pictures_s=0.5, now=24.0)
    assert [(part.name, part.seconds) for part in parts] == [
        ("start", 4.0), ("measure", 5.0), ("read", 3.0), ("index", 2.0), ("compile", 1.0), ("fly", 3.5), ("count", 0.5),
        ("write", 3.5), ("pictures", 0.5),
    ]  # fmt: skip
    assert sum(part.seconds for part in parts) == pytest.approx(23.0, abs=ROUNDING)


def test_what_did_not_happen_is_not_named() -> None:
    times = RunTimes()
    names = [part.name for part in times.parts(a_run(), pictures_s=0.0, now=24.0)]
    assert "measure" not in names and "pictures" not in names and names[-1] == "write"


def test_rounded_parts_add_up_to_the_rounded_sum() -> None:
    parts = [Part(name, 0.0149) for name in "abcdefgh"]
    shown = [float(number) for number in re.findall(r"[\d.]+(?= s)", words_of(parts))]
    assert shown[-1] == 0.12 and sum(shown[:-1]) == pytest.approx(shown[-1], abs=ROUNDING)
    assert min(shown) >= 0.01


def test_only_the_first_command_of_a_process_counts_from_the_start_of_the_process() -> None:
    RunTimes()
    before = time.perf_counter()
    assert RunTimes().began >= before
    assert module._process_start() < module.IMPORTED


def test_the_system_need_not_say_when_the_process_began(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(module, "STAT", tmp_path / "none")
    assert module._process_start() == module.IMPORTED


def test_the_printed_times_add_up_to_the_time_that_the_user_waited(tmp_path: Path) -> None:
    vertices, triangles = grid(16, 18)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    (tmp_path / "scene.yaml").write_text(f"{SLOPE}  - {{name: top, points: [[8.3, 7.2, 9]], rocks: 3}}\n")
    began = time.perf_counter()
    done = rpf3d("run", "scene.yaml", "--out", "out", cwd=tmp_path)
    waited = time.perf_counter() - began
    (line,) = (line for line in done.stdout.splitlines() if " impacts, " in line)
    *parts, total = (float(number) for number in re.findall(r"[\d.]+(?= s)", line))
    assert sum(parts) == pytest.approx(total, abs=ROUNDING)
    assert total <= waited < total + ENDS * max(1.0, total)
