"""Tests that a program continues if its output is a closed descriptor, or a pipe that is full or has no reader."""

import os
import subprocess
import sys
from functools import partial

import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.nodes.free_output import flush_output

wait = partial(wait_for, seconds=20.0, pause=0.01)

BEGIN = """
import os, sys, time
from rpf3d_ros.nodes.free_output import free_output

def write(text):
    try:
        os.write(1, text)
    except BlockingIOError:
        return False
    return True

went = open(sys.argv[1], "w", buffering=1)
"""
CLOSED = """
import sys
from rpf3d_ros.nodes.free_output import free_output
with free_output():
    print("not read", flush=True)
    open(sys.argv[1], "w").write("it went on")
"""
GONE = f"""{BEGIN}
with free_output():
    for _ in range(100):
        while not write(4096 * b"x"):
            time.sleep(0.001)
    went.write("it went on")
"""
NO_ROOM = f"""{BEGIN}
with free_output():
    for _ in range(100):
        write(4096 * b"x")
    went.write("filled\\n")
    while True:
        write(b"again")
        time.sleep(0.02)
"""


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_output_that_is_closed_stops_no_program(tmp_path, closed):
    went = tmp_path / "went"
    command = f'exec "$0" -c "$1" "$2" {closed}'
    done = subprocess.run(["sh", "-c", command, sys.executable, CLOSED, str(went)], capture_output=True, check=False)
    assert (done.returncode, went.read_text()) == (0, "it went on")


def test_a_reader_that_has_gone_leaves_no_full_pipe_behind(tmp_path):
    went = tmp_path / "went"
    reading, writing = os.pipe()
    os.close(reading)
    process = subprocess.Popen([sys.executable, "-c", GONE, str(went)], stdout=writing)
    try:
        wait(lambda: went.exists() and went.read_text())
        assert process.wait(20.0) == 0
    finally:
        process.kill()
        process.wait()
        os.close(writing)


def test_a_reader_that_had_no_room_for_a_while_reads_what_comes_later(tmp_path):
    """Another program may have made the terminal or pipe non-blocking; a full pipe must not end all output."""
    went = tmp_path / "went"
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    process = subprocess.Popen([sys.executable, "-c", NO_ROOM, str(went)], stdout=writing)
    try:
        wait(lambda: went.exists() and went.read_text())
        os.set_blocking(reading, False)

        def later():
            try:
                return b"again" in os.read(reading, 1 << 20)
            except BlockingIOError:
                return False

        wait(later)
    finally:
        process.kill()
        process.wait()
        os.close(reading)
        os.close(writing)


def test_a_stream_that_is_closed_from_the_start_keeps_no_program_from_its_end(monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    flush_output()
