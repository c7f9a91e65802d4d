"""Mark parameters of a test so that `make test` runs some of them, and `make test-long` the others."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def long_except(quick: Collection[str], names: Iterable[str]) -> list[Any]:
    """Return the names as parameters of a test; names that are not in `quick` get the mark `long`."""
    return [pytest.param(name, marks=[] if name in quick else pytest.mark.long) for name in names]
