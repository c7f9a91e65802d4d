"""Units of length of terrain files, by the key that a scene uses for a file's unit; units in the headers of tables."""

import re
from typing import NamedTuple

METRE = "m"

LENGTHS = {
    "mm": ("millimetres", 0.001), "cm": ("centimetres", 0.01), "dm": ("decimetres", 0.1), METRE: ("metres", 1.0),
    "km": ("kilometres", 1000.0), "in": ("inches", 0.0254), "ft": ("feet", 0.3048), "yd": ("yards", 0.9144),
    "us_ft": ("US survey feet", 1200.0 / 3937.0), "mi": ("miles", 1609.344),
}  # fmt: skip
"""Name and length (m) of each unit, by key (BIPM, The International System of Units, 2019; NIST SP 811 for feet)."""

SI = {"length": "m", "mass": "kg", "volume": "m3"}
"""Unit in which a scene gives each quantity."""
_TABLE_UNITS = {
    "length": {key: length for key, (_, length) in LENGTHS.items() if key not in ("us_ft", "mi")},
    "mass": {"kg": 1.0, "g": 0.001, "t": 1000.0, "lb": 0.45359237},
    "volume": {"m3": 1.0, "dm3": 0.001, "cm3": 1e-6, "mm3": 1e-9, "ft3": 0.3048**3, "l": 0.001},
}
"""Units that headers of tables state, as multiples of the unit in `SI`, by quantity (NIST SP 811)."""
_SPELT_OUT = {
    "metres": "m", "meters": "m", "millimetres": "mm", "millimeters": "mm", "centimetres": "cm", "centimeters": "cm",
    "inch": "in", "inches": "in", "foot": "ft", "feet": "ft", "kilograms": "kg", "grams": "g", "tonnes": "t",
    "pounds": "lb", "lbs": "lb", "litres": "l", "liters": "l",
}  # fmt: skip
_IN_BRACKETS, _SUFFIX = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*$"), re.compile(r"(_|,\s*|\s)([a-z]+3?)$")
_NO_WORD = ("l", "g", "t", "m", "in")
"""Units that are not read after a blank, because they may be other words."""
_SYMBOLS = (("length", "l"), ("mass", "m"), ("thickness", "t"))
"""Names of columns with the letter in brackets that is their symbol, and no unit of another quantity."""


class TableUnit(NamedTuple):
    """A unit that the header of a column states, such as `mm`.

    quantity : key of `SI`; factor : size of the unit in the unit of `SI`
    is_certain : False for an end of a name that may also be something else than a unit, such as the `t` of `mass_t`
    """

    name: str
    quantity: str
    factor: float
    is_certain: bool


def unit_of_column(header: str, quantity: str) -> TableUnit | None:
    """Return the unit that the name of a column states, such as `length (mm)` or `mass_t`; None if it states none.

    A unit of another quantity is returned, too, even if it is uncertain, so that the caller can refuse it. Only the
    symbols of `Length (L)` and the like are no units then.

    quantity : key of `SI`, the quantity of the numbers in the column
    """
    lower = header.strip().lower()
    lower = lower.replace("³", "3").replace("^3", "3")
    bracket, suffix = _IN_BRACKETS.search(lower), _SUFFIX.search(lower)
    word = bracket[1] if bracket else suffix[2] if suffix else ""
    name = _SPELT_OUT.get(word, word)
    if suffix and not bracket and suffix[1].isspace() and word in _NO_WORD:
        return None
    found = next((each for each, units in _TABLE_UNITS.items() if name in units), None)
    is_symbol = bracket is not None and (lower[: bracket.start()].strip(), word) in _SYMBOLS
    if found is None or (found != quantity and is_symbol):
        return None
    return TableUnit(name, found, _TABLE_UNITS[found][name], bool(bracket) or (len(word) > 1 and word != "in"))


def other_quantity(header: str, unit: TableUnit, quantity: str) -> str:
    """Return the end of a sentence that refuses a column with a unit of another quantity, such as kg for a diameter."""
    wanted = SI[quantity]
    advice = "" if unit.is_certain else f"; if {unit.name!r} is no unit there, name the column '{header} ({wanted})'"
    return (f"in {unit.name}, by the name of the column {header!r}, but must be in {wanted} or another unit of "
            f"{quantity}{advice}")  # fmt: skip
