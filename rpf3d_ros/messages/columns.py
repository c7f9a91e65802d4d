"""The form of results between computation and messages: columns of numbers in the map frame."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

Columns = Mapping[str, NDArray[Any]]
"""Channel name -> (N,) values: x, y, z in m, t in s, speed in m/s, energy in J, rock counted from 0."""
