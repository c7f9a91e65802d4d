"""Replace links from pages to targets outside the site: folders of the repository, and pages that are not included.

A link to a single file becomes a download (MyST does that). A link to a folder, or to a page that the site leaves out,
becomes its text and its path in the repository. A link to nothing stays a link, and fails the build.
"""

from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms import SphinxTransform


class RepositoryLinks(SphinxTransform):
    """Sphinx transform: replace links to targets outside the site, which would break, by their text and path."""

    default_priority = 5

    def apply(self, **arguments: Any) -> None:
        """Replace the links of one page to targets outside the site."""
        for link in list(self.document.findall(addnodes.pending_xref)):
            path = self.path_of(link) if link.get("reftype") == "myst" else None
            if path:
                link.replace_self([*link.children, *place(link.astext(), path)])

    def path_of(self, link: addnodes.pending_xref) -> str | None:
        """Return the path in the repository that a link leads to; None if the target is in the site or is missing."""
        target = link["reftarget"].partition("#")[0]
        if link.get("refdomain") == "doc":
            return None if target in self.env.found_docs else f"{target}.md"
        path = Path(self.env.relfn2path(target, self.env.docname)[1])
        return path.relative_to(self.env.srcdir).as_posix() if target and path.is_dir() else None


def place(text: str, path: str) -> list[nodes.Node]:
    """Return the path as code between brackets; nothing if the text of the link has the path."""
    return [] if path in text else [nodes.Text(" ("), nodes.literal(text=path), nodes.Text(")")]


def setup(app: Any) -> dict[str, bool]:
    """Add this module's transform to Sphinx, which calls this function at the start of a build."""
    app.add_transform(RepositoryLinks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
