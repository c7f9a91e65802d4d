"""Write the slope of the golden scenes as the text of terrain files.

Every number is a multiple of 1/8, so it is exact on any machine.
"""

from collections.abc import Iterable, Sequence

ROWS, COLUMNS, STEP = 24, 12, 4.0
"""Number of squares down the slope and across the slope, and the side of a square (m)."""

Point = tuple[float, float, float]
Corners = tuple[int, int, int]


def height(i: int, j: int) -> float:
    """Return the height (m) at corner i, j of the squares: an uneven slope, level from row 18 on.

    i : row, down the slope; j : column, across the slope
    """
    return max(60.0 - 3.0 * i, 6.0) + 0.25 * ((7 * i + 5 * j) % 4)


def strip(first: int, last: int) -> tuple[list[Point], list[Corners]]:
    """Return vertices (x, y, z) m, y up, and triangles of the slope from row `first` of corners to row `last`."""
    places = [(i, j) for i in range(first, last + 1) for j in range(COLUMNS + 1)]
    vertices = [(STEP * i, height(i, j), -STEP * j) for i, j in places]
    triangles, row = [], COLUMNS + 1
    for i in range(last - first):
        for a in range(i * row, i * row + COLUMNS):
            triangles += [(a, a + row, a + row + 1), (a, a + row + 1, a + 1)]
    return vertices, triangles


def obj(vertices: Sequence[Point], triangles: Sequence[Corners]) -> str:
    """Return the text of a Wavefront OBJ file."""
    return _lines(vertices, "v ") + _lines(([corner + 1 for corner in triangle] for triangle in triangles), "f ")


def ascii_stl(vertices: Sequence[Point], triangles: Sequence[Corners]) -> str:
    """Return the text of an ASCII STL file."""
    corners = (_lines((vertices[corner] for corner in triangle), "vertex ") for triangle in triangles)
    facets = (f"facet normal 0 0 0\nouter loop\n{three}endloop\nendfacet\n" for three in corners)
    return f"solid slope\n{''.join(facets)}endsolid slope\n"


def ply(vertices: Sequence[Point], triangles: Sequence[Corners]) -> str:
    """Return the text of an ASCII PLY file."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    head += [f"property double {axis}" for axis in "xyz"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(head) + "\n" + _lines(vertices) + _lines(triangles, "3 ")


def legacy_vtk(vertices: Sequence[Point], triangles: Sequence[Corners]) -> str:
    """Return the text of a legacy VTK file."""
    points = f"# vtk DataFile Version 3.0\nslope\nASCII\nDATASET POLYDATA\nPOINTS {len(vertices)} double\n"
    polygons = f"POLYGONS {len(triangles)} {4 * len(triangles)}\n"
    return points + _lines(vertices) + polygons + _lines(triangles, "3 ")


def esri_grid(with_hole: bool = False) -> str:
    """Return the text of an ESRI grid of the heights.

    with_hole : True to leave out 5 by 5 heights in the middle, a square of 20 m
    """
    head = f"ncols {ROWS + 1}\nnrows {COLUMNS + 1}\nxllcorner 400000\nyllcorner 300000\ncellsize {STEP}\n"
    hole = {(i, j) for i in range(9, 14) for j in range(4, 9)} if with_hole else set()
    rows = ([-9999 if (i, j) in hole else height(i, j) for i in range(ROWS + 1)] for j in range(COLUMNS + 1))
    return f"{head}NODATA_value -9999\n{_lines(rows)}"


def _lines(rows: Iterable[Iterable[float]], before: str = "") -> str:
    """Return rows of numbers as lines of text; before : text at the start of each line."""
    return "".join(before + " ".join(map(str, row)) + "\n" for row in rows)
