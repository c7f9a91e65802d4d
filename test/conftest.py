"""What all tests need: no deadlines, signals as from a terminal, children that leave nothing, and no wasted work."""

import gc
import os
import signal
from pathlib import Path

import pytest
from compiled_once import compile_once
from hypothesis import HealthCheck, settings
from longest_first import longest_first

# How long an example takes on a machine with other work to do says nothing of what is tested. The examples are the same
# in each run, as those of test/properties are, for which `make campaign` tries others.
settings.register_profile("rpf3d", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("rpf3d")

# A child whose disk is full would leave half of the byte code of what it imports then, to be imported next.
os.environ["PYTHONDONTWRITEBYTECODE"] = "1"

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it runs in the background ignore Ctrl-C, and children inherit that; one that is to be
    # interrupted would go on for ever. A handler of Python's own is none any more in a child.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# 15,000 collected tests and a compiler that makes millions of objects: with Python's own numbers, the search for
# garbage takes a quarter of the time of a worker.
gc.set_threshold(50_000, 20, 10)


def pytest_configure(config: pytest.Config) -> None:
    """Make the workers of a run compile each loop once, all together."""
    if hasattr(config, "workerinput"):
        compile_once(Path(config.option.basetemp).parent)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the files that take longest first, if workers share the tests."""
    if hasattr(config, "workerinput"):
        items[:] = [items[i] for i in longest_first([item.path for item in items])]


def pytest_collection_finish() -> None:
    """Leave the collected tests out of every further search for garbage: they stay until the end."""
    gc.collect()
    gc.freeze()
