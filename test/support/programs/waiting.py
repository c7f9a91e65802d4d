"""Wait for a result of other threads or processes."""

import time
from collections.abc import Callable
from typing import Any


def wait_for(condition: Callable[[], Any], seconds: float, pause: float = 0.005) -> Any:
    """Call a condition until its value is true, and return the value; the test fails if that takes too long.

    seconds : longest wait (s); pause : time between two calls (s)
    """
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline
        time.sleep(pause)
    return found
