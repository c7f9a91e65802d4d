"""The fault report of a terrain of which seams were closed: it also states how many, and the widest."""

from dataclasses import dataclass, fields

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.terrain.mesh.faults import FaultReport


@dataclass(frozen=True)
class ClosedSeamsReport(FaultReport):
    """The fault report of a terrain of which seams were closed (`open_seams`); its facets include the added parts.

    closed_seams : number of vertices at which seams were closed
    added_facets : number of parts of facets that were added after all facets
    widest_closed_seam : m, largest distance between such a vertex and the side that now runs through it
    """

    closed_seams: int = 0
    added_facets: int = 0
    widest_closed_seam: float = 0.0

    def describe(self) -> list[str]:
        """Return the report as lines of text, the last on the closed seams."""
        return [*super().describe(), f"closed seams        {self.in_words()}"]

    def in_words(self) -> str:
        """Return the number of closed seams, the widest, and the number of added facets as text."""
        widest, added = three_figures(1000.0 * self.widest_closed_seam), self.added_facets
        return f"{self.closed_seams:,} (up to {widest} mm wide; {added:,} {'facet' if added == 1 else 'facets'} added)"


def with_seams(report: FaultReport, closed: int, added: int, widest: float) -> FaultReport:
    """Return a fault report that also states the closed seams; the same report if no seam was closed.

    closed, added, widest : as in `ClosedSeamsReport`
    """
    if not closed:
        return report
    known = {field.name: getattr(report, field.name) for field in fields(report)}
    return ClosedSeamsReport(**known, closed_seams=closed, added_facets=added, widest_closed_seam=widest)
