"""Tests that a program that a signal ends has the exit code of this signal, whenever the signal arrives."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
BEGIN = """
import os, signal, sys
from rpf3d_ros.nodes.leaving import unless_signalled

class Struck:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)

def work():
    {work}
    return 7

code = unless_signalled(work)
print(code, signal.getsignal(signal.SIGTERM) == signal.SIG_DFL)
"""


@pytest.mark.parametrize(
    ("work", "code"),
    [
        ("pass", 7),
        ("os.kill(os.getpid(), signal.SIGTERM)", 143),
        ("os.kill(os.getpid(), signal.SIGINT)", 130),
        ("Struck()", 143),  # Python ignores an exception there
        ("try:\n        os.kill(os.getpid(), signal.SIGINT)\n    except BaseException:\n        raise OSError", 130),
    ],
)
def test_the_exit_code_tells_of_a_signal_and_the_handlers_are_put_back(work, code):
    command = [sys.executable, "-c", BEGIN.format(work=work)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.split() == [str(code), "True"], done.stderr


STRUCK_IN_A_FINALIZER = """Struck()
    try:
        for _ in range(300):
            time.sleep(0.1)
        print("worked to its end")
    finally:
        print("cleaned up")"""


def test_a_signal_that_strikes_in_a_finalizer_ends_the_work_without_a_traceback():
    command = [sys.executable, "-c", "import time" + BEGIN.format(work=STRUCK_IN_A_FINALIZER)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.splitlines() == ["cleaned up", "143 True"], done.stderr
    assert done.stderr == ""


def test_other_exceptions_of_finalizers_are_reported_as_always():
    failing = BEGIN.replace("os.kill(os.getpid(), signal.SIGTERM)", "1 / 0").format(work="Struck()")
    done = subprocess.run(
        [sys.executable, "-c", failing], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout.split() == ["7", "True"]
    assert "ZeroDivisionError" in done.stderr
