"""The entries of the library of ground materials, as their sources publish them.

Every figure is a range, except known values, which are plain numbers. If a source gives a mean and a standard
deviation, the range ends at the source's bounds. If the source gives no bounds, the range ends two standard deviations
from the mean and, for restitution, stays within [0, 1]. Values for point models are wrong for rocks with a shape,
which turn part of their speed into spin, so rocks with a shape have separate entries.
"""

from collections.abc import Mapping
from typing import NamedTuple

from rpf3d_core.scene.models.spec import Confirmed

POINTS, BODIES = "points and spheres", "rocks with a shape"
"""The two kinds of rocks for which an entry may be valid."""


class Range(NamedTuple):
    """The range of one coefficient: from low to high, with a mean and a standard deviation if the source has them."""

    low: float
    high: float
    mean: float | None = None
    sd: float | None = None


class LibraryMaterial(NamedTuple):
    """An entry of the library of ground materials.

    ground : the kind of ground in words; kind : the rocks for which the figures are valid, POINTS or BODIES
    ranges : range of each coefficient, by key of a material; a plain number is a known value, not an unknown
    source : where the figures are published; confirmed : how well the figures are confirmed; note : a remark, or ""
    """

    ground: str
    kind: str
    ranges: Mapping[str, Range | float]
    source: str
    confirmed: Confirmed
    note: str = ""

    @property
    def assumed(self) -> "dict[str, Range]":
        """The assumed ranges of coefficients that this entry lacks, by key; used if the scene's models need them."""
        of_bodies = self.kind == BODIES
        return {key: span for key, span in UNSTATED.items()
                if key not in self.ranges and of_bodies == (key == "rolling_resistance")}  # fmt: skip


HOEK = "Hoek 1987, and the default library of RocFall; sd 0.04 each"
PFEIFFER = "Pfeiffer & Bowen 1989, Bull. AEG 26:135"
ROBOTHAM = "Robotham et al. 1995"
NEWCASTLE = "pyrockfall 0.1.2, library of pits at Newcastle (coal, sandstone)"
STONE = "r.stone manual; Alvioli et al. 2021, Eng. Geol. 293:106301; 10 % to both sides, the default of r.stone"
ROCKYFOR = "Rockyfor3D, soil classes; R_t follows from the roughness there, so give tangential_restitution"
RAMMS = "RAMMS::ROCKFALL 1.6, default terrain table; restitution 0 as in Leine et al. 2014"
SLIP = "friction grows along the slip from the lower to the upper end; here it is one number between them"
BOOKS = "typical values of the library's sources for this ground together; single sources go beyond them"
TWO = 2.0
STONE_SPREAD = 0.10


def _share(mean: float, sd: float, low: float | None = None, high: float | None = None) -> Range:
    """Return the range of a coefficient of restitution (-), from its mean and its standard deviation `sd`.

    low, high : ends of the range; None for two standard deviations from the mean, within [0, 1]
    """
    first, last = max(mean - TWO * sd, 0.0), min(mean + TWO * sd, 1.0)
    ends = (first if low is None else low, last if high is None else high)
    return Range(low=round(ends[0], 6), high=round(ends[1], 6), mean=mean, sd=sd)


def _around(value: float) -> Range:
    """Return the range from 10 % below to 10 % above a value: the default range of draws in the program r.stone."""
    return Range(low=round(value * (1.0 - STONE_SPREAD), 6), high=round(value * (1.0 + STONE_SPREAD), 6))


def _points(
    normal: Range, tangential: Range | None, angle: Range | None = None, rolling: Range | None = None
) -> dict[str, Range | float]:
    """Return the ranges of an entry for points and spheres, by key of a material, such as `normal_restitution`.

    normal, tangential : coefficients of restitution (-); angle : friction angle (degrees)
    rolling : rolling friction (-)
    A range that the source does not publish is None, and is left out.
    """
    keys = ("normal_restitution", "tangential_restitution", "friction_angle_deg", "rolling_friction")
    given = zip(keys, (normal, tangential, angle, rolling), strict=True)
    return {key: span for key, span in given if span is not None}


def _hoek(ground: str, normal: float, tangential: float) -> LibraryMaterial:
    return LibraryMaterial(ground, POINTS, _points(_share(normal, 0.04), _share(tangential, 0.04)), HOEK, "UNCONFIRMED")


def _pfeiffer(ground: str, normal: tuple[float, float], tangential: tuple[float, float]) -> LibraryMaterial:
    return LibraryMaterial(ground, POINTS, _points(Range(*normal), Range(*tangential)), PFEIFFER, "UNCONFIRMED")


def _robotham(ground: str, normal: tuple[float, float], tangential: tuple[float, float]) -> LibraryMaterial:
    return LibraryMaterial(ground, POINTS, _points(_share(*normal), _share(*tangential)), ROBOTHAM, "UNCONFIRMED")


def _newcastle(
    ground: str, normal: tuple[float, ...], tangential: tuple[float, ...], angle: tuple[float, float]
) -> LibraryMaterial:
    degrees = Range(angle[0] - TWO * angle[1], angle[0] + TWO * angle[1], *angle)
    return LibraryMaterial(ground, POINTS, _points(_share(*normal), _share(*tangential), degrees), NEWCASTLE, "CC")


def _stone(ground: str, rolling: float, normal: float, tangential: float) -> LibraryMaterial:
    ranges = _points(_around(normal), _around(tangential), rolling=_around(rolling))
    return LibraryMaterial(ground, POINTS, ranges, STONE, "C")


def _rockyfor(ground: str, low: float, high: float) -> LibraryMaterial:
    return LibraryMaterial(ground, POINTS, _points(Range(low, high), None), ROCKYFOR, "UNCONFIRMED")


def _ramms(ground: str, low: float, high: float, confirmed: Confirmed = "UNCONFIRMED") -> LibraryMaterial:
    ranges: dict[str, Range | float] = {"restitution": 0.0, "friction": Range(low, high)}
    return LibraryMaterial(ground, BODIES, ranges, RAMMS, confirmed, SLIP)


def _books(ground: str, normal: tuple[float, float], tangential: tuple[float, float]) -> LibraryMaterial:
    ranges = _points(Range(*normal), Range(*tangential))
    return LibraryMaterial(ground, POINTS, ranges, BOOKS, "UNCONFIRMED", "the sources disagree: this is by how much")


UNSTATED: Mapping[str, Range] = {
    # The range of the angles of all pit_ entries except weathered mudstone and coal.
    "friction_angle_deg": Range(10.0, 45.0),
    # For spheres; the range of the values of STONE for all grounds.
    "rolling_friction": Range(0.27, 0.88),
    # For rocks with a shape. 0 is the value of RAMMS, whose ground takes the energy of rolling in other ways. The
    # upper end is that of the prior of the calibrations at Authume, where the posterior is 0.14 to 0.27. At Tschamut,
    # the posterior is 0.10 to 0.54.
    "rolling_resistance": Range(0.0, 0.4),
}
"""The range of a coefficient, by key of a material, that a scene assumes if its library entry has none.

The ranges are assumptions of rpf3d, not published values. A coefficient that the sources leave out is still unknown,
and a single number would make intervals too narrow (docs/explanation/validation.md).
"""

ENTRIES: Mapping[str, LibraryMaterial] = {
    # 0.33 and 0.83 are Pfeiffer & Bowen's, 0.65 and 0.75 STONE's for lava and carbonate, 0.99 Hoek's for clean rock.
    "bedrock": _books("bedrock, any", (0.33, 0.65), (0.75, 0.99)),
    # R_n: 0.30 is Giani's and Pfeiffer & Bowen's, 0.42 the upper end of Rockyfor3D's class 4. STONE's value for loose
    # clastic rock, 0.45, lies above the range. R_t: 0.55 is STONE's for loose clastic rock, 0.70 Giani's, 0.85 Pfeiffer
    # & Bowen's. The lower end, 0.45, has no source: the lowest mean for debris is 0.489 (Robotham, vegetated pile).
    "talus": _books("talus and debris, any", (0.30, 0.42), (0.45, 0.85)),
    # 0.15 and 0.40 are STONE's for colluvium, 0.25 and 0.55 Giani's, 0.30 and 0.82 Pfeiffer & Bowen's.
    "soil": _books("soil, any", (0.15, 0.30), (0.40, 0.82)),
    "hoek_clean_bedrock": _hoek("clean hard bedrock", 0.53, 0.99),
    "hoek_asphalt": _hoek("asphalt roadway", 0.40, 0.90),
    "hoek_bedrock": _hoek("bedrock outcrop", 0.35, 0.85),
    "hoek_talus": _hoek("talus cover", 0.32, 0.82),
    "hoek_talus_vegetated": _hoek("talus with vegetation", 0.32, 0.80),
    "hoek_soil": _hoek("soft soil, some vegetation", 0.30, 0.80),
    "pfeiffer_smooth_hard": _pfeiffer("smooth hard surface, paving", (0.37, 0.42), (0.87, 0.92)),
    "pfeiffer_bedrock": _pfeiffer("bedrock and boulder fields", (0.33, 0.37), (0.83, 0.87)),
    "pfeiffer_talus": _pfeiffer("talus and firm soil", (0.30, 0.33), (0.82, 0.85)),
    "pfeiffer_soil": _pfeiffer("soft soil", (0.28, 0.30), (0.78, 0.82)),
    "robotham_limestone": _robotham("limestone face", (0.315, 0.064), (0.712, 0.116)),
    "robotham_scree": _robotham("limestone scree, partly vegetated", (0.303, 0.080), (0.615, 0.170)),
    "robotham_blast_pile": _robotham("blast pile, uncovered", (0.276, 0.079), (0.835, 0.085)),
    "robotham_pile_vegetated": _robotham("blast pile, vegetated", (0.251, 0.029), (0.489, 0.141)),
    "robotham_chalk": _robotham("chalk face", (0.271, 0.018), (0.596, 0.085)),
    "robotham_chalk_scree": _robotham("chalk scree, vegetated", (0.384, 0.133), (0.687, 0.130)),
    "pit_sandstone": _newcastle("sandstone", (1.0, 0.20, 0.82, 1.0), (0.40, 0.15, 0.25, 0.55), (25, 5)),
    "pit_sandstone_weathered": _newcastle(
        "weathered sandstone", (0.70, 0.20, 0.6, 0.95), (0.35, 0.15, 0.2, 0.5), (20, 5)
    ),
    "pit_mudstone": _newcastle("mudstone", (0.60, 0.15, 0.4, 0.8), (0.65, 0.10, 0.45, 0.85), (20, 5)),
    "pit_mudstone_weathered": _newcastle(
        "weathered mudstone", (0.47, 0.30, 0.1, 1.0), (0.55, 0.23, 0.1, 1.0), (15, 5)
    ),
    "pit_coal": _newcastle("coal", (0.41, 0.15, 0.21, 0.61), (0.64, 0.15, 0.44, 0.84), (10, 5)),
    "pit_talus": _newcastle("talus, debris", (0.30, 0.20, 0.1, 1.0), (0.82, 0.20, 0.1, 1.0), (35, 5)),
    "pit_weathered": _newcastle(
        "extremely weathered rock", (0.35, 0.20, 0.15, 0.55), (0.47, 0.20, 0.27, 0.67), (20, 5)
    ),
    "pit_floor": _newcastle("pit floor", (0.50, 0.20, 0.3, 0.8), (0.80, 0.20, 0.5, 1.0), (30, 2)),
    "thesis_pit": LibraryMaterial(
        "geology units of an open pit", POINTS, _points(Range(0.4, 0.6), Range(0.7, 0.8)),
        "Peik 2020, University of Nevada, table 5-3: units 0 to 5", "C", "assumed there, not measured",
    ),
    "stone_deposits": _stone("man-made, landslide and glacial deposits", 0.65, 0.35, 0.55),
    "stone_alluvial": _stone("alluvial and colluvial deposits", 0.80, 0.15, 0.40),
    "stone_clastic_loose": _stone("loose clastic rock", 0.35, 0.45, 0.55),
    "stone_clastic": _stone("consolidated clastic rock, marl, flysch", 0.40, 0.55, 0.65),
    "stone_carbonate": _stone("carbonate rock, lava, intrusive rock", 0.30, 0.65, 0.75),
    "stone_schist": _stone("schist", 0.35, 0.60, 0.70),
    "rockyfor3d_fine_soil": _rockyfor("class 1, fine soil deeper than 1 m", 0.21, 0.25),
    "rockyfor3d_soil": _rockyfor("class 2, fine soil, sand and gravel", 0.25, 0.31),
    "rockyfor3d_scree": _rockyfor("class 3, scree, forest road", 0.30, 0.36),
    "rockyfor3d_talus": _rockyfor("class 4, talus of large fragments", 0.34, 0.42),
    "rockyfor3d_bedrock_covered": _rockyfor("class 5, bedrock with a thin cover", 0.39, 0.47),
    "rockyfor3d_bedrock": _rockyfor("class 6, bedrock", 0.48, 0.58),
    "rockyfor3d_asphalt": _rockyfor("class 7, asphalt road", 0.32, 0.39),
    "leine_block": LibraryMaterial(
        "slope of a demonstration", BODIES, {"restitution": 0.0, "friction": Range(0.2, 1.3)},
        "Leine et al. 2014, Multibody Syst. Dyn. 32:241, section 5.1", "C", SLIP,
    ),
    "ramms_soft": _ramms("soft", 0.25, 2.0),
    "ramms_medium_soft": _ramms("medium soft", 0.30, 2.0),
    "ramms_medium": _ramms("medium", 0.35, 2.0),
    "ramms_medium_hard": _ramms("medium hard", 0.40, 2.0),
    "ramms_hard": _ramms("hard; its friction also in Lu et al. 2019", 0.55, 2.0, "C"),
    "ramms_extra_hard": _ramms("extra hard", 0.80, 2.0),
    "ramms_snow": _ramms("snow", 0.10, 0.35),
}  # fmt: skip
"""The entries of the library of ground materials, by name."""
