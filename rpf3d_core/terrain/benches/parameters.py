"""The parameters of a slope of benches, and their valid ranges."""

import math
from dataclasses import dataclass

from rpf3d_core.errors import TerrainError

WHOLE = ("number", "seed")
"""Names of the parameters that are counts and must be whole numbers."""
RANGES: dict[str, tuple[float, float]] = {
    "height": (1.0, 200.0),
    "face_angle_deg": (20.0, 90.0),
    "berm": (0.0, 200.0),
    "number": (1, 60),
    "width": (5.0, 5000.0),
    "crest": (1.0, 1000.0),
    "floor": (1.0, 2000.0),
    "roughness": (0.0, 1.0),
    "seed": (0, 2**63),
    "spacing": (0.0, 50.0),
}
"""Least and greatest valid value of each parameter, in its own unit."""
MEANINGS = {
    "height": "height of each face",
    "face_angle_deg": "angle of the faces from the horizontal; 90: vertical",
    "berm": "width of each berm between two faces; 0: none",
    "number": "number of faces; there is one berm less",
    "width": "width of the slope, along the faces",
    "crest": "width of the level ground behind the upper edge",
    "floor": "width of the level floor in front of the lowest toe",
    "roughness": "standard deviation of small-scale relief, normal to the surface; on the floor a third of this value",
    "seed": "seed of the roughness",
    "spacing": "side of the mesh's cells; 0: 1 m on rough ground, else one rectangle for each face and berm",
}
"""Meaning of each parameter, for the reference of scene keys and the JSON Schema; lengths in m, angles in degrees."""
ROUGH_SPACING = 1.0
"""Side (m) of the cells of a rough slope whose scene gives no spacing; the shortest waves of the relief are 3 m long.
"""
MOST_TRIANGLES = 5_000_000
"""Largest number of triangles of a slope."""


@dataclass(frozen=True)
class Benches:
    """The parameters of a slope of benches; lengths in m, angles in degrees, as in the scene file.

    height, face_angle_deg : height of each face, and its angle from the horizontal; number : number of faces
    berm : width of the level berms between faces; 0 for no berms
    width : width of the slope, along the faces; crest, floor : widths of the level ground above and below the faces
    roughness : standard deviation of the small-scale relief, normal to the surface
    seed : random seed of this relief, >= 0
    spacing : side of the mesh's cells; if 0, the side is ROUGH_SPACING on rough ground, and on smooth ground each face
        and berm is one rectangle

    Raises `TerrainError` for a value out of range, a count that is not a whole number, or too many triangles. The
    defaults of height, face_angle_deg, berm and width are the dimensions of `config/scenes/bench_15m.yaml`.
    """

    height: float = 15.0
    face_angle_deg: float = 70.0
    berm: float = 8.0
    number: int = 3
    width: float = 100.0
    crest: float = 10.0
    floor: float = 60.0
    roughness: float = 0.0
    seed: int = 1
    spacing: float = 0.0

    def __post_init__(self) -> None:
        """Check all parameters.

        Raise `TerrainError`, which names the parameter, for a value out of range, for a count that is not a whole
        number, or for a spacing that gives more than MOST_TRIANGLES triangles.
        """
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise TerrainError(f"benches: {name} is {value}; it must lie between {low:g} and {high:g}")
            if name in WHOLE and value != int(value):
                raise TerrainError(f"benches: {name} is {value}; it must be a whole number")
        if self.triangles > MOST_TRIANGLES:
            raise TerrainError(f"benches: spacing is {self.spacing}; it gives {self.triangles:,} triangles, and "
                               f"{MOST_TRIANGLES:,} is the most")  # fmt: skip

    @property
    def run(self) -> float:
        """Length (m) of a face in plan; exactly 0 for a vertical face."""
        return 0.0 if self.face_angle_deg == 90.0 else self.height / math.tan(math.radians(self.face_angle_deg))

    @property
    def lengths(self) -> list[float]:
        """Lengths (m) of the parts of the profile down the slope: crest, then faces and berms in turn, floor."""
        face = math.hypot(self.height, self.run)
        berms = [self.berm] if self.berm > 0.0 else []
        return [self.crest, *[face, *berms] * (self.number - 1), face, self.floor]

    @property
    def triangles(self) -> int:
        """Number of triangles of the mesh."""
        return 2 * self.cells(self.width) * sum(map(self.cells, self.lengths))

    def cells(self, length: float) -> int:
        """Return the number of cells into which a length (m) of the slope is divided."""
        side = self.spacing or (ROUGH_SPACING if self.roughness else math.inf)
        return max(1, round(length / side))
