"""Read the TIN surfaces of a LandXML file (LandXML 1.2 schema); each surface becomes a zone.

Points are northing, easting, elevation. Document types and entities are refused: entities can expand without limit,
and no surface needs them.
"""

from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.formats.units import METRE

UNITS = {
    "meter": METRE, "millimeter": "mm", "centimeter": "cm", "kilometer": "km", "foot": "ft", "USSurveyFoot": "us_ft",
    "inch": "in", "mile": "mi",
}  # fmt: skip
"""Key of each unit of length, by the value of the attribute linearUnit."""
HEAD = 2**20
"""Size (bytes) of the first part of a file, which is searched for the coordinate reference system."""
BLOCK = 2**20
"""Size (bytes) of the parts in which a file is parsed."""


class _Content:
    """The content of a LandXML file, as far as it has been parsed; the methods are callbacks of the parser expat.

    surfaces : names; point_ids, points, faces : for each surface, the texts of its elements
    unit : stated unit of length, a key of `units.LENGTHS`, None if it is missing or unknown
    epsg : the stated EPSG code, None if none is stated
    hidden : number of invisible faces; others : names of elements that are not read
    text : parts of the text of the point or face that is open; None if none is open, or the face is invisible
    """

    def __init__(self) -> None:
        self.surfaces: list[str] = []
        self.point_ids: list[list[str]] = []
        self.points: list[list[str]] = []
        self.faces: list[list[str]] = []
        self.unit: str | None = None
        self.epsg: str | None = None
        self.hidden = 0
        self.others: set[str] = set()
        self.text: list[str] | None = None

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Handle the start of an XML element; called by the XML parser.

        Begin to read a point, face or surface; invisible faces are only counted. Store the unit and the EPSG code of
        the file. Note breaklines, contours and lists of points, because they are not read.

        name : name of the element, with or without a namespace; attributes : of the element
        """
        name = name.rpartition(":")[2]
        if name == "P" and self.surfaces:
            self.point_ids[-1].append(attributes.get("id", ""))
            self.text = []
        elif name == "F" and self.surfaces:
            self.hidden += (hidden := attributes.get("i") == "1")
            self.text = None if hidden else []
        elif name == "Surface":
            self.surfaces.append(attributes.get("name") or f"surface_{len(self.surfaces) + 1}")
            for lists in (self.point_ids, self.points, self.faces):
                lists.append([])
        elif name in ("Metric", "Imperial"):
            self.unit = UNITS.get(attributes.get("linearUnit", ""))
        elif name == "CoordinateSystem":
            self.epsg = attributes.get("epsgCode")
        elif name in ("Breakline", "Contour", "PntList3D"):
            self.others.add(name)

    def data(self, text: str) -> None:
        """Store a part of the text of a point or face; called by the XML parser."""
        if self.text is not None:
            self.text.append(text)

    def end(self, name: str) -> None:
        """Store the text of a finished point (`P`) or face (`F`) in the current surface; called by the XML parser.

        name : name of the element that ends; other elements are ignored
        """
        if self.text is None:
            return
        name = name.rpartition(":")[2]
        if name in ("P", "F"):
            (self.points if name == "P" else self.faces)[-1].append("".join(self.text))
            self.text = None


def read_landxml(path: Path) -> FileMesh:
    """Return the triangles of all TIN surfaces of a LandXML file; each surface is a zone, also one without triangles.

    Raises
    ------
    TerrainError
        The file is not LandXML, has a document type, has no triangles, or a point or face is damaged.
    """
    content = _parsed(path)
    meshes = [_surface(path, content, k) for k in range(len(content.surfaces))]
    if not any(len(triangles) for _, triangles in meshes):
        raise TerrainError(f"{path}: holds no TIN; a terrain needs a Surface with Pnts and Faces")
    begins = np.cumsum([0, *(len(points) for points, _ in meshes)])
    triangles = np.concatenate([triangles + begin for (_, triangles), begin in zip(meshes, begins[:-1], strict=True)])
    zone = np.repeat(np.arange(len(meshes)), [len(triangles) for _, triangles in meshes])
    return FileMesh(
        np.concatenate([points for points, _ in meshes]), triangles.astype(np.int32), zone=zone.astype(np.int32),
        zones=tuple(content.surfaces), remarks=tuple(_remarks(path, content)), crs=_crs(content), unit=content.unit,
    )  # fmt: skip


def landxml_crs(path: Path) -> str | None:
    """Return the coordinate reference system that a LandXML file states in its first HEAD (2^20) bytes.

    The result is None if no system is stated there, or if the file cannot be read.
    """
    content = _Content()
    try:
        with path.open("rb") as file:
            _parser(path, content).Parse(file.read(HEAD))
    except (expat.ExpatError, TerrainError, OSError):
        return None
    return _crs(content)


def _crs(content: _Content) -> str | None:
    return f"EPSG:{content.epsg}" if content.epsg and content.epsg.isdecimal() else None


def _parsed(path: Path) -> _Content:
    content = _Content()
    parser = _parser(path, content)
    try:
        with path.open("rb") as file:
            while block := file.read(BLOCK):
                parser.Parse(block)
        parser.Parse(b"", True)
    except (expat.ExpatError, ValueError) as fault:
        if isinstance(fault, TerrainError):
            raise
        raise TerrainError(f"{path}: is not complete XML ({fault})") from fault
    return content


def _parser(path: Path, content: _Content) -> Any:
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def refuse(*_: Any) -> None:
        raise TerrainError(f"{path}: has a document type (DOCTYPE), which is refused; LandXML needs none")

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = content.start, content.end
    parser.CharacterDataHandler = content.data
    return parser


def _surface(path: Path, content: _Content, k: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the points (V, 3) and the triangles (F, 3) of surface number k, from 0.

    The points have the easting first, in the unit of the file.
    """
    name, ids = content.surfaces[k], content.point_ids[k]
    places = _numbers(path, content.points[k], f"the points of surface {name!r}", "northing easting elevation", float)
    faces = _numbers(path, content.faces[k], f"the faces of surface {name!r}", "three point numbers", np.int64)
    number = {text: i for i, text in enumerate(ids)}
    if len(number) < len(ids):
        raise TerrainError(f"{path}: two points of surface {name!r} have the same id")
    try:
        known = np.array(list(number), dtype=np.int64)
    except (ValueError, OverflowError) as fault:
        raise TerrainError(f"{path}: the ids of the points of surface {name!r} must be whole numbers") from fault
    order = np.argsort(known)
    at = np.minimum(np.searchsorted(known, faces, sorter=order), len(known) - 1)
    if len(faces) and (not len(known) or (known[order][at] != faces).any()):
        raise TerrainError(f"{path}: a face of surface {name!r} names a point that does not exist")
    return places[:, [1, 0, 2]], order[at] if len(faces) else faces


def _numbers(path: Path, texts: list[str], what: str, must: str, kind: Any) -> NDArray[Any]:
    """Return the three numbers of each text as rows (N, 3), of the type `kind`; raise a TerrainError for a wrong text.

    what, must : what the texts are, and what each must be, for the message
    """
    wrong = next((text for text in texts if len(text.split()) != 3), None)  # 2 and 4 numbers are 6 numbers in total
    try:
        if wrong is None:
            return np.array(" ".join(texts).split(), dtype=kind).reshape(-1, 3)
    except (ValueError, OverflowError) as fault:
        raise TerrainError(f"{path}: {what} must be {must} each, but has {str(fault)[:60]!r}") from fault
    raise TerrainError(f"{path}: {what} must be {must} each, but has {wrong[:60]!r}")


def _remarks(path: Path, content: _Content) -> list[str]:
    remarks = []
    if content.hidden:
        remarks.append(f"{path.name}: {content.hidden:,} faces are marked as invisible and were left out")
    if content.others:
        remarks.append(f"{path.name}: not read: {', '.join(sorted(content.others))}; the faces are the ground")
    return remarks
