"""The parameters of a synthetic open pit, and their valid ranges."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.frame import FloatArray

WHOLE = ("triangles", "seed", "waste_benches", "ore_benches", "spills")
"""Names of the parameters that are counts and must be whole numbers."""
RANGES: dict[str, tuple[float, float]] = {
    "triangles": (2_000, 5_000_000),
    "seed": (0, 2**63),
    "floor_radius": (100.0, 2000.0),
    "elongation": (1.0, 2.0),
    "long_axis_deg": (-360.0, 360.0),
    "waste_benches": (0, 60),
    "ore_benches": (0, 60),
    "waste_bench_height": (3.0, 60.0),
    "ore_bench_height": (3.0, 60.0),
    "face_angle_deg": (30.0, 80.0),
    "ramp_width": (0.0, 60.0),
    "ramp_grade": (0.05, 0.2),
    "ramp_foot_deg": (-360.0, 360.0),
    "spills": (0, 2000),
    "repose_deg": (10.0, 45.0),
    "roughness": (0.0, 1.0),
    "rim_width": (20.0, 2000.0),
    "crest_altitude": (-500.0, 9000.0),
}
"""Least and greatest valid value of each parameter, in its own unit."""
MEANINGS = {
    "triangles": "number of triangles; the mesh has this number within 3 %, below 5,000 within 5 %",
    "seed": "seed of roughness, spills and natural relief",
    "floor_radius": "mean radius of the floor",
    "elongation": "length over width of the floor",
    "long_axis_deg": "direction of the floor's long axis, counter-clockwise from east",
    "waste_benches": "number of upper benches",
    "ore_benches": "number of lower benches",
    "waste_bench_height": "height of the upper benches",
    "ore_bench_height": "height of the lower benches",
    "bench_widths": "least and greatest width of catch benches; `[0, 0]`: none",
    "face_angle_deg": "angle of bench faces from the horizontal",
    "ramp_width": "width of the haul ramp; 0: none",
    "ramp_grade": "slope of the ramp: rise over run",
    "ramp_foot_deg": "where the ramp leaves the floor: direction from the pit's middle, counter-clockwise from east",
    "spills": "number of cones of loose rock on benches",
    "repose_deg": "steepest slope of these cones",
    "roughness": "standard deviation of small-scale relief; on floor and ramp a third of this value",
    "rim_width": "least width of natural ground outside the crest",
    "crest_altitude": "altitude of the crest above sea level",
}
"""Meaning of each parameter, for the reference of scene keys and the JSON Schema; lengths in m, angles in degrees."""


@dataclass(frozen=True)
class Pit:
    """The parameters of a synthetic pit; lengths in m, angles in degrees, as in the scene file.

    The plan is the same for every seed and every number of triangles, so that the sources of a scene stay in place. The
    seed changes roughness, spills and the relief of the natural ground.

    triangles : wanted number, 2,000 to 5,000,000; the mesh has this number within 3 %, within 5 % if below 5,000
    seed : random seed of roughness, spills and relief, >= 0
    floor_radius : mean radius of the pit floor
    elongation : length over width of the floor, 1 to 2
    long_axis_deg : direction of the floor's long axis, counter-clockwise from east
    waste_benches, waste_bench_height : number and height of the upper benches
    ore_benches, ore_bench_height : number and height of the lower benches
    bench_widths : least and greatest width of the catch benches; (0, 0) makes a pit without catch benches
    face_angle_deg : angle of the bench faces from the horizontal, 30 to 80
    ramp_width : width of the haul ramp; 0 makes a pit without a ramp; ramp_grade : rise over run (-)
    ramp_foot_deg : where the ramp leaves the floor: direction from the pit's middle, counter-clockwise from east; the
        ramp climbs counter-clockwise
    spills : number of cones of loose rock on the benches; repose_deg : their steepest slope
    roughness : standard deviation of the small-scale relief of faces and benches, normal to the surface; the floor and
        the ramp have a third of this value
    rim_width : least width of the natural ground outside the crest
    crest_altitude : altitude of the crest above sea level

    Raises `TerrainError` for a value out of range, a count that is not a whole number, or values that do not fit
    together. Source of the defaults: the thesis, section 5.1 (Miranda et al. 2018): berms of 7.0 to 9.1 m, benches of
    12 m in waste and 18 m in ore, a ramp of 32 m; sources at 1687 m.
    """

    triangles: int = 150_000
    seed: int = 1
    floor_radius: float = 310.0
    elongation: float = 1.5
    long_axis_deg: float = 68.0
    waste_benches: int = 12
    ore_benches: int = 10
    waste_bench_height: float = 12.0
    ore_bench_height: float = 18.0
    bench_widths: tuple[float, float] = (7.0, 9.1)
    face_angle_deg: float = 70.0
    ramp_width: float = 32.0
    ramp_grade: float = 0.10
    ramp_foot_deg: float = 212.0
    spills: int = 150
    repose_deg: float = 37.0
    roughness: float = 0.15
    rim_width: float = 110.0
    crest_altitude: float = 1688.0

    def __post_init__(self) -> None:
        """Check all parameters; raise `TerrainError`, which names the parameter, for a value that is not possible."""
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise TerrainError(f"pit: {name} is {value}; it must lie between {low:g} and {high:g}")
            if name in WHOLE and value != int(value):
                raise TerrainError(f"pit: {name} is {value}; it must be a whole number")
        self._refuse_impossible_shapes()

    def _refuse_impossible_shapes(self) -> None:
        least, greatest = self.bench_widths
        if not 0.0 <= least <= greatest <= 50.0 or (least == 0.0) != (greatest == 0.0):
            raise TerrainError(f"pit: bench_widths is {self.bench_widths}; give least <= greatest <= 50, or both 0")
        if self.waste_benches + self.ore_benches < 1:
            raise TerrainError("pit: waste_benches and ore_benches are both 0; at least one bench is needed")
        if 0.0 < least < 1.0:
            raise TerrainError(f"pit: bench_widths is {self.bench_widths}; a bench is at least 1 m wide, or 0")
        if 0.0 < self.ramp_width < max(3.0, 1.5 * greatest):
            raise TerrainError(f"pit: ramp_width is {self.ramp_width}; it must be 0 or over 1.5 bench widths and 3 m")

    @cached_property
    def levels(self) -> FloatArray:
        """Heights (n + 1,) m above the floor for n bench faces: of the floor (0), of each bench, and of the crest."""
        heights = [self.ore_bench_height] * self.ore_benches + [self.waste_bench_height] * self.waste_benches
        return np.concatenate([[0.0], np.cumsum(heights)])
