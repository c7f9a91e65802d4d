"""Settings of all tests: no deadlines, default signals, no byte code from child processes, less repeated work."""

import gc
import os
import signal
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from suite.compiled_once import compile_once
from suite.longest_first import is_long, longest_first, shuffled

# The time of an example on a busy machine does not depend on what is tested. The examples are the same in each run;
# for those of test/properties, `make campaign` tries others.
settings.register_profile("rpf3d", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("rpf3d")

# A child process whose disk is full would leave truncated byte code, which later processes would import.
os.environ["PYTHONDONTWRITEBYTECODE"] = "1"

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets background processes ignore Ctrl-C, and children inherit this, so that an interrupted child would run
    # without end. Children do not inherit a handler set by Python; they get the default.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# With 15,000 collected tests and a compiler that makes millions of objects, Python's default thresholds would spend a
# quarter of the time of a worker on garbage collection.
gc.set_threshold(50_000, 20, 10)


def pytest_configure(config: pytest.Config) -> None:
    """Let the worker processes of a run compile each loop only once in total."""
    if hasattr(config, "workerinput"):
        compile_once(Path(config.option.basetemp).parent)


@pytest.hookimpl(tryfirst=True)  # before pytest selects tests by their marks
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests in long_tests.txt and lone_loops.txt, and sort the files if several workers share them.

    The longest files come first; with the environment variable RPF3D_TURN (a whole number), the files come in a random
    order that depends on this number.
    """
    for item in items:
        if is_long(item.nodeid.removeprefix("test/")):
            item.add_marker(pytest.mark.long)
    if hasattr(config, "workerinput"):
        files, turn = [item.path for item in items], os.environ.get("RPF3D_TURN")
        items[:] = [items[i] for i in (shuffled(files, int(turn)) if turn else longest_first(files))]


def pytest_runtest_setup() -> None:
    """Skip a test that would begin after the time RPF3D_LAST_START (s since 1970), so that a run ends in time."""
    if time.time() > float(os.environ.get("RPF3D_LAST_START", "inf")):
        pytest.skip("no time is left for this test (RPF3D_LAST_START)")


def pytest_collection_finish() -> None:
    """Exclude the collected tests from further garbage collection, because they exist until the end."""
    gc.collect()
    gc.freeze()
