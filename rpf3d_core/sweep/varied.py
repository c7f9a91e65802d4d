"""The keys that a sweep varies, and their values, as a user writes them: `terrain.benches.berm=6,8,10`."""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError, SceneError
from rpf3d_core.formats.yaml import yaml_values

RANGE = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?):([-+]?[\d.]+(?:[eE][-+]?\d+)?):(\d+)\s*")
"""Pattern of a range A:B:N: first value, last value and number of values."""
NUMBERS = re.compile(r"\s*[-+]?[\d.]+(\s*[:;]\s*[-+]?[\d.]+)+\s*")
"""Pattern of numbers with a separator that is not a comma, such as 5:11 or 5;11, which a user means as values."""
MOST_VALUES = 1000
"""Largest number of values of one key."""
AS_WRITTEN = "write --vary KEY=V1,V2,... or --vary KEY=FIRST:LAST:NUMBER"


class Varied(NamedTuple):
    """A key that a sweep varies: its key path in the scene, and its values in the scene's unit."""

    key: str
    values: tuple[Any, ...]


def varied_of(text: str) -> Varied:
    """Return the key and the values of one `--vary` option.

    `KEY=FIRST:LAST:NUMBER` means evenly spaced values, both ends included. All other values are read like the
    items of a list in a scene file: numbers, words, lists in brackets.

    Raises
    ------
    InputError
        The text has no key or no values, is not YAML, has a range that `_evenly_spaced` refuses, or has numbers with a
        wrong separator, such as 5;11. The message shows the text.
    """
    key, _, written = text.partition("=")
    if not key.strip() or not written.strip():
        raise InputError(f"--vary is {text!r}; {AS_WRITTEN}")
    match = RANGE.fullmatch(written)
    try:
        values = _evenly_spaced(text, *match.groups()) if match else tuple(yaml_values(f"[{written}]", "--vary"))
    except (SceneError, TypeError, ValueError) as fault:
        raise InputError(f"--vary is {text!r}, but its values cannot be read ({fault}); {AS_WRITTEN}") from None
    if wrong := next((value for value in values if isinstance(value, str) and NUMBERS.fullmatch(value)), None):
        raise InputError(f"--vary is {text!r}, but {wrong!r} is not a number; {AS_WRITTEN}")
    return Varied(key=key.strip(), values=values)


def check_varied(varied: Sequence[Varied]) -> None:
    """Refuse a sweep without keys, a key that is given twice, and a key with no value or more than 1,000 values.

    Raises
    ------
    InputError
        The message names the key.
    """
    if not varied:
        raise InputError(f"a sweep varies at least one key of the scene; {AS_WRITTEN}")
    keys = [one.key for one in varied]
    for one in varied:
        if keys.count(one.key) > 1:
            raise InputError(f"the key {one.key} is varied twice; give all its values at once")
        if not 1 <= len(one.values) <= MOST_VALUES:
            raise InputError(f"the key {one.key} has {len(one.values):,} values; give 1 to {MOST_VALUES:,}")


def _evenly_spaced(text: str, first: str, last: str, number: str) -> tuple[float | int, ...]:
    """Return the N evenly spaced values of a range A:B:N, both ends included.

    A value without decimals becomes an int if both ends are written as whole numbers.
    text : the whole `--vary` option, for the message; first, last, number : A, B and N as written

    Raises
    ------
    InputError
        Both ends are equal, or N is below 2 or above MOST_VALUES (1,000).
    """
    low, high, count = float(first), float(last), int(number)
    if not 2 <= count <= MOST_VALUES or low == high:
        raise InputError(f"--vary is {text!r}; a range has two different ends and 2 to {MOST_VALUES:,} values")
    values = [float(f"{low + (high - low) * i / (count - 1):.12g}") for i in range(count)]
    whole = re.fullmatch(r"[-+]?\d+", first) and re.fullmatch(r"[-+]?\d+", last)
    return tuple(int(value) if whole and value.is_integer() else value for value in values)
