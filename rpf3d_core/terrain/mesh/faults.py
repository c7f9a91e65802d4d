"""The fault report of a mesh, which the user reads before a run: contents, faults and repairs of the mesh."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.mesh.edges import Edges, Flags, Index, collapsed
from rpf3d_core.terrain.mesh.winding import Winding
from rpf3d_core.terrain.mesh.zero_area import without_area
from rpf3d_core.values import Vec


@dataclass(frozen=True)
class FaultReport:
    """The contents and faults of a terrain's mesh, as reported to the user; lengths in m, areas in m^2.

    files : names of the mesh files
    triangles, vertices, edges : counts, after welding
    area, area_by_zone : area of all facets, and of the facets of each zone
    pieces : number of components; facets of different components have no edge in common
    boundary_edges : number of edges that belong to only one facet
    holes : number of closed rings of boundary edges; one ring for each open component does not count, because it is the
        outer edge of the component. Rings that touch at a vertex count as one ring
    non_manifold_edges : number of edges that belong to three facets or more
    zero_area_facets, duplicate_facets : counts; these facets are kept, so facet numbers are those of the files
    flipped_facets : number of facets that were turned over to face the free side
    one_sided_pieces : number of components with only one side, such as a Moebius strip, whose windings cannot agree
    low, high : corners of the bounding box in the input's own coordinates
    steepest_deg : the largest angle of a facet from the horizontal; a facet above 90 overhangs
    median_edge : median length of the edges
    remarks : sentences on data that were left out or assumed when the files were read
    seen : sums of the facets' areas as seen along x, along y, and from above (along z, which points up)
    closed_seams : number of vertices at which seams were closed (`closed_seams`); all other counts are those afterwards
    added_facets : number of parts of facets that closing seams added after all facets
    widest_closed_seam : largest distance between such a vertex and the side that now runs through the vertex
    """

    files: tuple[str, ...]
    triangles: int
    vertices: int
    edges: int
    area: float
    area_by_zone: dict[str, float]
    pieces: int
    boundary_edges: int
    holes: int
    non_manifold_edges: int
    zero_area_facets: int
    duplicate_facets: int
    flipped_facets: int
    one_sided_pieces: int
    low: Vec
    high: Vec
    steepest_deg: float
    median_edge: float
    remarks: tuple[str, ...] = ()
    seen: Vec = (0.0, 0.0, 0.0)
    closed_seams: int = 0
    added_facets: int = 0
    widest_closed_seam: float = 0.0

    def describe(self) -> list[str]:
        """Return the report as lines of text."""
        span = "  ".join(f"{n} {a:.1f} .. {b:.1f}" for n, a, b in zip("xyz", self.low, self.high, strict=True))
        zones = ", ".join(f"{zone} {area:,.0f}" for zone, area in _folded(self.area_by_zone).items())
        return [
            f"files               {', '.join(self.files)}",
            f"triangles           {self.triangles:,} ({self.vertices:,} vertices, {self.edges:,} edges)",
            f"area                {self.area:,.0f} m2 ({zones})",
            f"extent              {span} m",
            f"median edge         {self.median_edge:.2f} m, steepest facet {self.steepest_deg:.0f} degrees",
            f"pieces              {self.pieces:,} (one-sided {self.one_sided_pieces:,})",
            f"boundary edges      {self.boundary_edges:,} (holes {self.holes:,})",
            f"non-manifold edges  {self.non_manifold_edges:,}",
            f"zero-area facets    {self.zero_area_facets:,}",
            f"duplicate facets    {self.duplicate_facets:,}",
            f"flipped facets      {self.flipped_facets:,}",
            *([f"closed seams        {self.seams_in_words()}"] if self.closed_seams else []),
        ]

    def seams_in_words(self) -> str:
        """Return the number of closed seams, the widest, and the number of added facets as text."""
        added = f"{self.added_facets:,} {'facet' if self.added_facets == 1 else 'facets'} added"
        return f"{self.closed_seams:,} (up to {1000.0 * self.widest_closed_seam:.3g} mm wide; {added})"


def _folded(area_by_zone: dict[str, float]) -> dict[str, float]:
    """Return the areas (m^2) by zone, with one sum for all zones whose names differ only in a final number.

    The result is short enough to print. A sum has the position of its first zone.
    """
    families: dict[str, list[str]] = {}
    for zone in area_by_zone:
        families.setdefault(re.sub(r"\d+$", "*", zone), []).append(zone)
    return {
        f"{family} ({len(zones)} zones)" if len(zones) > 1 else zones[0]: sum(area_by_zone[zone] for zone in zones)
        for family, zones in families.items()
    }


def fault_report(terrain: Terrain, winding: Winding, edges: Edges, files: tuple[str, ...]) -> FaultReport:
    """Return the fault report of a terrain after the repair of its winding.

    edges : edges of the mesh before or after the repair; the repair changes only `down`, which is not used here
    winding : the mesh after the repair, and what the repair changed; files : paths of the terrain files
    """
    area = np.sqrt(np.einsum("ij,ij->i", winding.areas, winding.areas))
    flat = without_area(terrain.vertices, terrain.triangles, winding.areas)
    by_zone = np.bincount(terrain.zone, area, len(terrain.zones))
    low, high = _extent(terrain)
    boundary = edges.uses == 1
    whole = _pieces(winding.piece, edges)
    return FaultReport(
        files=files,
        triangles=len(terrain.triangles),
        vertices=len(terrain.vertices),
        edges=len(edges.low),
        area=float(area.sum()),
        area_by_zone={zone: float(a) for zone, a in zip(terrain.zones, by_zone, strict=True)},
        pieces=len(np.unique(whole[~collapsed(terrain.triangles)])),
        boundary_edges=int(boundary.sum()),
        holes=_holes(len(terrain.vertices), edges, boundary, whole),
        non_manifold_edges=int((edges.uses > 2).sum()),
        zero_area_facets=int(flat.sum()),
        duplicate_facets=_duplicates(terrain.triangles, len(terrain.vertices)),
        flipped_facets=int(winding.flipped.sum()),
        one_sided_pieces=winding.one_sided,
        low=low,
        high=high,
        steepest_deg=_steepest(winding.areas, area, flat),
        median_edge=_median_edge(terrain.vertices, edges),
        seen=_seen(winding.areas),
    )


def _seen(areas: FloatArray) -> Vec:
    """Return the sums of the facets' areas (m^2) as seen along x, y and z.

    areas : (F, 3) m^2, the area of each facet times its unit normal
    """
    x, y, z = (float(np.abs(column).sum()) for column in areas.T)
    return x, y, z


def _extent(terrain: Terrain) -> tuple[Vec, Vec]:
    """Return two opposite corners of the terrain's bounding box, lowest and highest (m, in the input's coordinates)."""
    local = [[column.min() for column in terrain.vertices.T], [column.max() for column in terrain.vertices.T]]
    corners = terrain.frame.points_to_input(local)
    (x, y, z), (u, v, w) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return (x, y, z), (u, v, w)


def _pieces(piece: Index, edges: Edges) -> Index:
    """Return the component (F,) of each facet, connected across all edges, also edges of more than two facets.

    piece : (F,) component of each facet, connected only across edges of exactly two facets (`Winding`)
    """
    crowded = np.repeat(edges.uses > 2, edges.uses)
    if not crowded.any():
        return piece
    hub = piece[edges.facet[np.repeat(edges.start, edges.uses)[crowded]]]
    return components(len(piece), piece[edges.facet[crowded]], hub)[piece]


def _holes(vertices: int, edges: Edges, boundary: Flags, piece: Index) -> int:
    """Return the number of holes: the rings of boundary edges, minus one ring for each component with a boundary.

    vertices : number of vertices; boundary : (E,) true for edges of only one facet
    piece : (F,) component of each facet
    """
    ring = components(vertices, edges.low[boundary], edges.high[boundary])[edges.low[boundary]]
    owner = piece[edges.facet[edges.start[boundary]]]
    rings = np.unique(np.stack([owner, ring], axis=1), axis=0)
    return len(rings) - len(np.unique(owner))


def _duplicates(triangles: Index, vertices: int) -> int:
    """Return the number of facets on the same three vertices as an earlier facet; collapsed facets do not count.

    triangles : (F, 3); vertices : number of vertices
    """
    corners = triangles[~collapsed(triangles)]
    mark = _marks(vertices)
    marks = mark[corners[:, 0]] + mark[corners[:, 1]] + mark[corners[:, 2]]
    values = np.sort(marks)
    repeated = values[1:][values[1:] == values[:-1]]
    suspects = np.sort(corners[np.isin(marks, repeated)] if len(repeated) else corners[:0], axis=1)
    return len(suspects) - len(np.unique(suspects, axis=0))


def _marks(vertices: int) -> NDArray[np.uint64]:
    """Return a pseudo-random 64-bit number (V,) for each vertex, by which facets with the same corners are found.

    Sums of the numbers of different triples of vertices are almost never equal. The function is the finaliser of
    SplitMix64 (Steele, Lea & Flood 2014, OOPSLA).
    """
    z = np.arange(1, vertices + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(z ^ (z >> np.uint64(31)))


def _steepest(areas: FloatArray, area: FloatArray, flat: Flags) -> float:
    """Return the largest angle (degrees) of a facet from the horizontal; above 90 for an overhang.

    areas : (F, 3) m^2, the area of each facet times its unit normal; area : (F,) m^2
    flat : (F,) true for facets without area, which do not count
    """
    cosine = np.divide(areas[:, 2], area, out=np.ones_like(area), where=~flat)
    return float(np.degrees(np.arccos(np.clip(cosine.min(), -1.0, 1.0))))


def _median_edge(vertices: FloatArray, edges: Edges) -> float:
    """Return the median length of the edges (m), which shows the resolution of a mesh; 0 if there are no edges.

    vertices : (V, 3) m
    """
    if len(edges.low) == 0:
        return 0.0
    squared = np.empty(len(edges.low))
    _squared_lengths(np.ascontiguousarray(vertices), edges.low, edges.high, squared)
    return float(np.sqrt(np.median(squared, overwrite_input=True)))


@loop
def _squared_lengths(vertices: Any, low: Any, high: Any, squared: Any) -> None:
    """Write the squared length (m^2) of each edge into `squared` (E,), for the median length.

    vertices : (V, 3) m; low, high : (E,) the two vertices of each edge
    """
    for e in range(len(low)):
        x, y, z = (vertices[high[e], 0] - vertices[low[e], 0], vertices[high[e], 1] - vertices[low[e], 1],
                   vertices[high[e], 2] - vertices[low[e], 2])  # fmt: skip
        squared[e] = x * x + y * y + z * z
