"""Tests that `rpf3d recover` saves the readable part of a truncated recording and changes no other file."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("rerun", reason="rerun-sdk is not installed")

import rerun

from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.recordings.content import content_of, repair, verify

ROWS = 8
FIRST = np.datetime64("2026-11-21T06:00:00", "ns")


@pytest.fixture
def broken(tmp_path):
    """Return the path of a recording of ROWS rows, one per minute, that is truncated within the last row."""
    path = tmp_path / "shift.rrd"
    stream = rerun.RecordingStream("rpf3d_live")
    stream.save(str(path))
    sizes = []
    for number in range(ROWS):
        stream.set_time("ros_time", timestamp=FIRST + np.timedelta64(number, "m"))
        stream.log("rocks", rerun.Points3D(np.random.default_rng(number).random((500, 3))))
        stream.flush()
        sizes.append(path.stat().st_size)
    stream.disconnect()
    path.write_bytes(path.read_bytes()[: sizes[-1] - 1000])
    return path


def test_the_rows_before_the_cut_are_saved_and_told(broken):
    before = broken.read_bytes()
    said = CliRunner().invoke(app, ["recover", str(broken)])
    assert said.exit_code == 0, said.output
    saved = broken.with_name("shift.recovered.rrd")
    verify(saved)
    assert content_of(saved).rows["/rocks"] == ROWS - 1
    words = " ".join(said.output.split())
    assert re.search(rf"verifies: {ROWS - 1} rows of \d+ entities saved, until ros_time 2026-11-21T06:06:00", words)
    assert broken.read_bytes() == before


def test_rocks_that_are_shown_where_they_will_be_are_no_sign_of_how_long_it_recorded(tmp_path):
    path = tmp_path / "shift.rrd"
    stream = rerun.RecordingStream("rpf3d_live")
    stream.save(str(path))
    for entity, minutes in (("sources", 0), ("trajectories/rocks", 9)):
        stream.set_time("ros_time", timestamp=FIRST + np.timedelta64(minutes, "m"))
        stream.log(entity, rerun.Points3D([[0.0, 0.0, 0.0]]))
    stream.disconnect()
    assert content_of(path).until == f"ros_time {np.datetime64(FIRST, 'ns')}"


def test_a_whole_recording_comes_out_whole(broken, tmp_path):
    once = repair(broken, tmp_path / "once.rrd")
    assert repair(tmp_path / "once.rrd", tmp_path / "twice.rrd").rows == once.rows


@pytest.mark.parametrize("content", [b"", b"RRF2 and then nothing", b"no recording at all, but text"])
def test_what_holds_no_rows_is_refused_and_leaves_no_file(tmp_path, content):
    bad, out = tmp_path / "bad.rrd", tmp_path / "out.rrd"
    bad.write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.rrd"):
        repair(bad, out)
    assert not out.exists()


def test_a_recording_is_never_written_over_and_must_exist(broken, tmp_path):
    with pytest.raises(InputError, match="already exists"):
        repair(broken, broken)
    with pytest.raises(InputError, match="no such file"):
        repair(tmp_path / "nowhere.rrd", tmp_path / "out.rrd")
