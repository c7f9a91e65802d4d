"""Make small terrain files for tests, and scenes that read them."""

from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.scene.model import Scene

SHARED_DATA = Path(__file__).parents[4] / "shared" / "data"

SLOPE = """\
terrain:
  files:
    - {path: slope.stl, zone: rock}
materials:
  rock: {normal_restitution: 0.5, tangential_restitution: 0.8}
sources:
"""
"""Text of a scene file over slope.stl; its last line is the key `sources`, to which a test adds sources."""


def with_models(text: str, rebound: str = "constant", ground: str = "none") -> str:
    """Return the text of a scene file, with `rebound` and `ground` added if the text does not have these keys.

    Spheres need no rebound model, so none is added for them. rebound, ground : names of the models to add
    """
    models = {"ground": ground} if "shape: sphere" in text else {"rebound": rebound, "ground": ground}
    named = "".join(f"{key}: {name}\n" for key, name in models.items() if f"\n{key}:" not in f"\n{text}")
    return text.rstrip("\n") + "\n" + named


STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def scene_of(*files: Path, zones: list[dict[str, Any]] | None = None, **terrain: Any) -> Scene:
    """Return a scene over terrain files; each file is a zone with the name of the file, without the extension.

    zones : value of the scene's key `zones`; terrain : further keys of `terrain`
    """
    return Scene.model_validate(
        {
            "path": Path("scene.yaml"),
            "terrain": {"files": [{"path": str(file), "zone": file.stem} for file in files], **terrain},
            "zones": zones or [],
            "materials": {"default": {"normal_restitution": 0.5, "tangential_restitution": 0.8}},
            "sources": [{"name": "top", "points": [[0.0, 0.0, 0.0]]}],
        }
    )


def grid(rows: int, columns: int, step: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (V, 3) m and triangles (F, 3), upper side up, of a wavy grid; step : cell size (m)."""
    y, x = np.meshgrid(np.arange(rows) * step, np.arange(columns) * step, indexing="ij")
    vertices = np.stack([x, y, np.sin(x) + np.cos(0.7 * y)], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return vertices, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)


def write_binary_stl(path: Path, corners: np.ndarray, announced: int | None = None, header: bytes = b"") -> Path:
    """Write the facets with corners (F, 3, 3) m as a binary STL file.

    announced : number of facets in the header, None for the true number; header : first bytes, at most 80
    """
    records = np.zeros(len(corners), STL_RECORD)
    records["corners"] = corners
    count = np.uint32(len(corners) if announced is None else announced)
    path.write_bytes(header.ljust(80) + count.tobytes() + records.tobytes())
    return path


def ascii_stl(corners: np.ndarray) -> str:
    """Return the text of an ASCII STL file with facets that have the corners (F, 3, 3) m."""
    facets = []
    for facet in corners:
        lines = "\n".join("vertex " + " ".join(repr(float(c)) for c in corner) for corner in facet)
        facets.append(f"facet normal 0 0 1\nouter loop\n{lines}\nendloop\nendfacet\n")
    return "solid test\n" + "".join(facets) + "endsolid test\n"
