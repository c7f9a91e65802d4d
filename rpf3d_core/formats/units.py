"""Units of length of terrain files, by the key that a scene uses for a file's unit."""

METRE = "m"

LENGTHS = {
    "mm": ("millimetres", 0.001), "cm": ("centimetres", 0.01), "dm": ("decimetres", 0.1), METRE: ("metres", 1.0),
    "km": ("kilometres", 1000.0), "in": ("inches", 0.0254), "ft": ("feet", 0.3048), "yd": ("yards", 0.9144),
    "us_ft": ("US survey feet", 1200.0 / 3937.0), "mi": ("miles", 1609.344),
}  # fmt: skip
"""Name and length (m) of each unit, by key (BIPM, The International System of Units, 2019; NIST SP 811 for feet)."""
