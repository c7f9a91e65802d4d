"""Read binary STL files, and check ASCII STL files so that messages can name the wrong line.

A binary STL has 84 + 50 F bytes: 80 bytes of free text, the number F of facets, and for each facet the normal and three
corners in float32 (Burns 1993, Automated Fabrication, section 6.5). The number F is compared with the size of the file
before memory is allocated. The stored normals are not read, because the order of the corners always defines the
normals.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.terrain.frame import FloatArray

HEADER = 84
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

LONGEST_HEAD = 4096
"""Number of bytes at the beginning of a file that are searched for signs of its format."""
DXF_BEGIN = re.compile(rb"(?:999\s*\n[^\n]*\n\s*)*0\s*\n\s*SECTION", re.IGNORECASE)
"""Beginning of a DXF file without leading spaces: comments, then the first section."""
BEGINS = (
    (b"AutoCAD Binary DXF", "a DXF file in binary", "save it as DXF in text, with the ending .dxf"),
    (b"AC10", "a DWG drawing", "save the drawing as DXF"),
    (b"ply", "a PLY file", ".ply"),
    (b"<?xml", "an XML file", "give it the ending .xml if it is LandXML"),
    (b"<LandXML", "a LandXML file", ".xml"),
    (b"\x84\x83\x82\x81", "an OMF 1 file", ".omf"),
    (b"# vtk DataFile", "a VTK file", ".vtk"),
    (b"LASF", "a LAS or LAZ file", "give it the ending .las or .laz"),
    (b"PK\x03\x04", "a ZIP archive", "unpack it, and name the terrain file in it"),
    (b"glTF", "a glTF file", "export a PLY, OBJ or DXF file"),
)
"""For each other format: the first bytes of its files, its name, and the right ending or other advice."""
RECORDS_AT_A_TIME = 2**14
"""Number of facets of a binary STL that are read in one step: 0.8 MB, which fits into the processor's cache."""
LINES_AT_A_TIME = 2**24
"""Size (bytes) of the parts in which an ASCII STL is read, to limit memory."""

_VERTEX = ("vertex", 3)
_FACET_LINES = (("facet normal", 3), ("outer loop", 0), _VERTEX, _VERTEX, _VERTEX, ("endloop", 0), ("endfacet", 0))


def is_ascii_stl(path: Path) -> bool:
    """Return True if a file starts like an ASCII STL: `solid`, then text. A binary STL may also begin with `solid`."""
    with path.open("rb") as file:
        head = file.read(HEADER)
    return head.lstrip().startswith(b"solid") and b"\0" not in head


def other_format(path: Path) -> str | None:
    """Return the name of the format that a .stl file really has, with advice for the user; None if it may be an STL.

    The format is found from the first bytes. A file of the size that its STL header states is an STL file, whatever its
    free text begins with.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(LONGEST_HEAD)
    if size >= HEADER and size == HEADER + RECORD.itemsize * int.from_bytes(head[HEADER - 4 : HEADER], "little"):
        return None
    first = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if DXF_BEGIN.match(first):
        return "a DXF file: give it the ending .dxf"
    found = next(((name, ending) for begin, name, ending in BEGINS if first.startswith(begin)), None)
    if found is None:
        return None
    name, ending = found
    return f"{name}: " + (f"give it the ending {ending}" if ending.startswith(".") else ending)


def read_binary_stl(path: Path) -> FileMesh:
    """Return the facets of a binary STL: three points for each facet, in the file's order.

    Raises
    ------
    TerrainError
        The file begins like another format, is shorter than a header, or its size does not match the number of facets
        in its header.
    """
    size = path.stat().st_size
    if kind := other_format(path):
        raise TerrainError(f"{path}: is not an STL file but {kind}")
    if size < HEADER:
        raise TerrainError(
            f"{path}: is neither an ASCII STL (which starts with `solid`) nor a binary one: {size} bytes are fewer "
            f"than the {HEADER} of its header"
        )
    announced = int(np.fromfile(path, "<u4", count=1, offset=HEADER - 4)[0])
    if size != HEADER + RECORD.itemsize * announced:
        room = (size - HEADER) // RECORD.itemsize
        raise TerrainError(
            f"{path}: the header of a binary STL announces {announced:,} triangles, which takes "
            f"{HEADER + RECORD.itemsize * announced:,} bytes, but the file has {size:,} (room for {room:,} triangles); "
            "it is truncated, or no STL"
        )
    # Coordinates are stored in columns, because all later steps use one coordinate of all points at a time.
    columns, block = np.empty((3, announced, 3), np.float32), np.empty(RECORDS_AT_A_TIME, RECORD)
    with path.open("rb") as file:
        file.seek(HEADER)
        for begin in range(0, announced, RECORDS_AT_A_TIME):
            some = block[: announced - begin]
            if file.readinto(some.view(np.uint8).data) < some.nbytes:
                raise TerrainError(f"{path}: was cut short while it was read")
            for axis in range(3):
                columns[axis, begin : begin + len(some)] = some["corners"][:, :, axis]
    return FileMesh(columns.reshape(3, -1).T)


def ascii_stl_corners(path: Path, count: int) -> FloatArray:
    """Return the corners (count, 3) of an ASCII STL that was already checked, in the unit of the file, with all digits.

    count : number of corners, three for each facet

    Raises
    ------
    TerrainError
        A coordinate is not a number, or the `vertex` lines do not have `count` corners.
    """
    try:
        corners = _numbers_of_vertices(path)
    except ValueError as fault:
        raise TerrainError(f"{path}: {ascii_stl_fault(path)}") from fault
    if len(corners) != 3 * count:
        raise TerrainError(f"{path}: each `vertex x y z` of an ASCII STL must be on a line of its own")
    return corners.reshape(-1, 3)


def _numbers_of_vertices(path: Path) -> FloatArray:
    """Return the numbers (N,) on all `vertex` lines of an ASCII STL."""
    parts = [np.empty(0)]
    with path.open("rb") as file:
        while lines := file.readlines(LINES_AT_A_TIME):
            text = b" ".join(line for line in lines if line.lstrip().startswith(b"vertex"))
            if text:
                parts.append(np.fromstring(text.replace(b"vertex", b" ").decode("ascii"), sep=" "))
    return np.concatenate(parts)


def ascii_stl_fault(path: Path) -> str:
    """Return a sentence on the first error in an ASCII STL, with its line number, for the message to the user."""
    with path.open(encoding="ascii", errors="replace") as file:
        lines = ((n, line.split()) for n, line in enumerate(file, start=1) if line.strip())
        return _fault_in(lines) or "the facets look right, yet the file could not be read as an ASCII STL"


def _fault_in(lines: Iterator[tuple[int, list[str]]]) -> str | None:
    """Return a sentence on the first error in the lines of an ASCII STL; None without an error.

    lines : pairs of line number and words
    """
    n, inside, place = 0, False, 0
    for n, words in lines:
        if inside and place == 0 and words[0] == "endsolid":
            inside = False
        elif not inside:
            if words[0] != "solid":
                return f"line {n} must start with `solid`, but is {_quoted(words)}"
            inside = True
        elif not _fits(words, *_FACET_LINES[place]):
            keyword, numbers = _FACET_LINES[place]
            return f"line {n} must be `{keyword}{' x y z' * (numbers > 0)}`, but is {_quoted(words)}"
        else:
            place = (place + 1) % len(_FACET_LINES)
    return f"the file ends after line {n} without `endsolid`; it is truncated" if inside else None


def _fits(words: list[str], keyword: str, numbers: int) -> bool:
    """Return True if a line of an ASCII STL consists of a keyword and the given number of numbers."""
    keys = keyword.split()
    values = words[len(keys) :]
    return words[: len(keys)] == keys and len(values) == numbers and all(_is_number(word) for word in values)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _quoted(words: list[str]) -> str:
    return repr(" ".join(words)[:60])
