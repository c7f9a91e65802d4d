"""Define the units of length that a scene may state for a file, and find the units in the headers of tables."""

import re
import unicodedata
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
    "mass": {"kg": 1.0, "g": 0.001, "t": 1000.0, "kt": 1e6, "lb": 0.45359237},
    "volume": {"m3": 1.0, "dm3": 0.001, "cm3": 1e-6, "mm3": 1e-9, "ft3": 0.3048**3, "l": 0.001},
}
"""Units that headers of tables state, as multiples of the unit in `SI`, by quantity (NIST SP 811)."""
_SPELT_OUT = {
    "metre": "m", "meter": "m", "millimetre": "mm", "millimeter": "mm", "centimetre": "cm", "centimeter": "cm",
    "inch": "in", "inche": "in", "foot": "ft", "feet": "ft", "kilogram": "kg", "kg": "kg", "gram": "g", "tonne": "t",
    "ton": "t", "kilotonne": "kt", "pound": "lb", "lb": "lb", "litre": "l", "liter": "l", "cubic metre": "m3",
    "cubic meter": "m3", "cubic feet": "ft3", "cubic foot": "ft3", "kilometre": "km", "kilometer": "km", "yard": "yd",
    "metric ton": "t", "us ft": "us_ft", "usft": "us_ft", "ftus": "us_ft", "us survey feet": "us_ft",
    "us survey foot": "us_ft",
}  # fmt: skip
"""Key of each unit that is written as a word, in the singular; most may also end with s."""
_IN_BRACKETS = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*$")
_SUFFIX = re.compile(r"(^|_|,\s*|\s)([a-z]+3?)$")
_MEGAGRAM = re.compile(r"(?<![A-Za-z])Mg(?![A-Za-z])")
"""The symbol of a megagram (a tonne); in small letters, it would be the symbol of a milligram."""
_NO_WORD = ("l", "g", "t", "m", "in")
"""Units that are not recognised after a blank, because they may be other words, such as "in"."""
_TONS = ("ton", "tons")
"""Words that are always uncertain: a ton is read as 1,000 kg, but may also be 907 or 1,016 kg."""
_SYMBOLS = (("length", "l"), ("mass", "m"), ("thickness", "t"))
"""Names of columns with a letter in brackets that is the symbol of the quantity, not a unit: (L) is not litres."""
_WORDS = {
    "length": ("diameter", "dia", "length", "width", "height", "thickness"),
    "mass": ("mass", "weight", "tonnage", "ton", "tons", "tonne", "tonnes", "tonnen"),
    "volume": ("volume", "vol"),
}
"""Words in the names of columns that state the quantity of the numbers, by quantity."""
_GERMAN_WORDS = {
    "length": ("durchmesser", "länge", "laenge", "breite", "höhe", "hoehe", "dicke"),
    "mass": ("masse", "massen", "gewicht", "gewichte"),
    "volume": ("volumen",),
}
"""German words like those of `_WORDS`; a longer word may end with one, such as `Blockmasse`."""
_RADIUS = ("radius", "radii", "radien", "halbmesser", "rayon", "rayons", "radio", "radios", "raio", "raios")
"""Words in the names of columns that state a radius: English, German, French, Spanish and Portuguese."""
_CIRCUMFERENCE = ("circumference", "perimeter", "girth", "umfang")
"""Words in the names of columns that state a circumference."""
_NO_DIAMETER = {
    ("kante", "kanten", "kantenlänge", "kantenlaenge", "edge", "edges"): "an edge length, but its "
    "numbers are read as diameters; a cube of 1 m has the volume of a sphere 1.24 m in diameter: give the cubes of the "
    "numbers to the key `volume`",
    ("querschnitt", "querschnitte", "section", "querschnittsfläche"): "a cross section, "
    "which may be an area, but its numbers are read as diameters; if they are, name the column a diameter",
}
"""End of a warning, by words in the name of a column: what the words state instead of a diameter, and what to do."""
_PERHAPS_TONNES = re.compile(r"\btonnage\b|\st$")
"""Names of columns without a unit whose numbers may be in tonnes, in small letters."""
_UNIT_OF_A_COORDINATE = re.compile(
    r"(.*?)(?:\s*[(\[]\s*(?P<bracket>[^()\[\]]*?)\s*[)\]]|(?:_|,\s*|\s)(?P<suffix>mm|cm|dm|m|km|ft|us_ft))"
)
"""Name of a coordinate's column, and its unit in brackets or as a suffix such as `_m`; `in` is not a suffix."""


class TableUnit(NamedTuple):
    """A unit that the header of a column states, such as `mm`.

    quantity : key of `SI`; factor : size of the unit in the unit of `SI`
    is_certain : False if the word may also mean something else than this unit, such as the `t` of `mass_t`, or `ton`
    """

    name: str
    quantity: str
    factor: float
    is_certain: bool


def unit_of_column(header: str, quantity: str) -> TableUnit | None:
    """Return the unit that the name of a column states, such as `length (mm)` or `mass_t`; None if it states none.

    A unit of another quantity is returned, too, even if it is uncertain: the caller can then refuse the column. A
    symbol of the quantity is not a unit, and gives None: the `L` of `Length (L)` does not mean litres.

    quantity : key of `SI`, the quantity of the numbers in the column
    """
    name, bracket, suffix = _parts_of(header)
    word = bracket or suffix
    unit = _key_of(word)
    found = next((each for each, units in _TABLE_UNITS.items() if unit in units), None)
    if found is None or (found != quantity and (name, bracket) in _SYMBOLS):
        return None
    is_certain = word not in _TONS and (bool(bracket) or (len(word) > 1 and word != "in"))
    return TableUnit(unit, found, _TABLE_UNITS[found][unit], is_certain)


def unit_of_coordinate(header: str) -> tuple[str, str, float | None]:
    """Split the name of a coordinate's column, such as `E (mm)`: return its name, its unit, and the unit's length (m).

    The name is in small letters. The unit is the text in brackets, or a suffix such as `_m`. If the header states no
    unit, the unit is "" and the length is 1. If the text in brackets is not a known unit of length, the length is None.
    """
    lower = header.strip().lower()
    found = _UNIT_OF_A_COORDINATE.fullmatch(lower)
    if found is None:
        return lower, "", 1.0
    unit: str = found["suffix"] or found["bracket"]
    return found[1].strip(), unit, LENGTHS.get(_key_of(unit), ("", None))[1]


def other_quantity_named(header: str, quantity: str) -> str | None:
    """Return the quantity (key of `SI`) that a column's name states in place of the wanted quantity; else None.

    The result is None if the name states the wanted quantity, or no known quantity. `tonnage` states a mass. A name
    with a word of the wanted quantity states the wanted quantity, such as `diameter of equal volume`.

    header : name of the column; quantity : key of `SI`, the wanted quantity
    """
    words = _words_of(header)
    named = [each for each, known in _WORDS.items() if words & {*known} or _ends_with(words, _GERMAN_WORDS[each])]
    return None if not named or quantity in named else named[0]


def other_length_named(header: str) -> str:
    """Return why a column cannot give rock sizes, with advice, if its name states a radius or circumference; else "".

    The text completes a sentence such as "the name of the column 'radius' states ...".

    header : name of the column, such as `radius`; the name `r (m)` states a radius, too
    """
    words = _words_of(header) - {""}
    if _states_diameter(words):
        return ""
    if _ends_with(words, _RADIUS) or words - {*LENGTHS} == {"r"}:
        return "a radius; double its numbers, name the column a diameter, and give it to the key `diameter`"
    if _ends_with(words, _CIRCUMFERENCE):
        return (
            "a circumference; divide its numbers by pi, name the column a diameter, and give it to the key `diameter`"
        )
    return ""


def _states_diameter(words: set[str]) -> bool:
    """Return True if words of the name of a column state a diameter."""
    return bool(words & {"diameter", "dia"}) or _ends_with(words, ("durchmesser",))


def _doubt_on_diameter(header: str) -> str:
    """Return a warning if the name of a column states a length that is not quite a diameter; "" without doubt."""
    words = _words_of(header)
    found = next((text for ends, text in _NO_DIAMETER.items() if _ends_with(words, ends)), None)
    if found is None or _states_diameter(words):
        return ""
    return f"the name of the column {header!r} states {found}"


def _words_of(header: str) -> set[str]:
    """Return the words in the name of a column, in small letters; an umlaut is one character (Unicode form NFC)."""
    return set(re.split(r"[^a-zäöüß]+", unicodedata.normalize("NFC", header).lower()))


def _ends_with(words: set[str], ends: tuple[str, ...]) -> bool:
    """Return True if any of the words ends with any of the given ends."""
    return any(word.endswith(ends) for word in words)


def _parts_of(header: str) -> tuple[str, str, str]:
    """Split a header: return the name of the column, the text in brackets at its end, and its last word.

    All parts are in small letters; a superscript 3 and ^3 become 3, and Mg (a tonne) becomes t. With brackets, the last
    word is "". It is also "" if no word follows a blank, a comma or "_" at the end, or if the word follows only a blank
    and may be an ordinary word, such as "in". Without brackets, the name is the whole header, and the text in brackets
    is "".
    """
    lower = _MEGAGRAM.sub("t", header.strip()).lower().replace("³", "3").replace("^3", "3")
    if bracket := _IN_BRACKETS.search(lower):
        return lower[: bracket.start()].strip(), bracket[1], ""
    suffix = _SUFFIX.search(lower)
    is_word = suffix is None or (suffix[1].isspace() and suffix[2] in _NO_WORD)
    return lower, "", "" if suffix is None or is_word else suffix[2]


def _key_of(word: str) -> str:
    """Return the key of a unit, such as "m" for "metres"; a word that is not a unit's name is returned unchanged."""
    return _SPELT_OUT.get(word) or _SPELT_OUT.get(word.removesuffix("s"), word)


def doubt_on_unit(header: str, quantity: str) -> str:
    """Return a warning if the name of a column leaves its unit in doubt, as in `mass_t`; "" without doubt.

    For lengths, also warn if the name states a length that is not quite a diameter.

    header : name of the column; quantity : key of `SI`, the quantity of the numbers in the column
    """
    unit, wanted, bracket = unit_of_column(header, quantity), SI[quantity], _parts_of(header)[1]
    if quantity == "length" and (doubt := _doubt_on_diameter(header)):
        return doubt
    if unit is None and len(bracket) > 1:
        return (f"the name of the column {header!r} has no known unit in brackets: its numbers are read in {wanted}; "
                f"give them in {wanted} or another unit of {quantity}")  # fmt: skip
    if unit is None and quantity == "mass" and _PERHAPS_TONNES.search(header.strip().lower()):
        return (f"the name of the column {header!r} may mean tonnes, but its numbers are read in kg; write their unit "
                "in brackets: 'mass (t)' or 'mass (kg)'")  # fmt: skip
    if unit is None or unit.is_certain or unit.factor == 1.0:
        return ""
    return (f"the name of the column {header!r} is read as a unit: its numbers are converted from {unit.name} to "
            f"{wanted}; if they are in {wanted}, write this unit in brackets: '{quantity} ({wanted})'")  # fmt: skip


def other_quantity(header: str, unit: TableUnit, quantity: str) -> str:
    """Return the end of a sentence that refuses a column with a unit of another quantity, such as kg for a diameter.

    header : name of the column; unit : the unit that it states; quantity : key of `SI`, the wanted quantity
    """
    wanted = SI[quantity]
    advice = "" if unit.is_certain else f"; if {unit.name!r} is no unit there, name the column '{header} ({wanted})'"
    return (f"in {unit.name}, by the name of the column {header!r}, but must be in {wanted} or another unit of "
            f"{quantity}; sizes in {unit.name} belong to the key `{key_of_sizes(unit.quantity)}`{advice}")  # fmt: skip


def key_of_sizes(quantity: str) -> str:
    """Return the key of a rock's size in a scene for a quantity, a key of `SI`: `diameter`, `mass` or `volume`."""
    return "diameter" if quantity == "length" else quantity
