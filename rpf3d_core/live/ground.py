"""The ground that a live simulator flies over: made whole from a survey, or patched where a cloud replaces a part."""

import hashlib
import math
import time
import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np

from rpf3d_core.compiling import HAS_NUMBA
from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.errors import TerrainError
from rpf3d_core.live.survey import MOST_POINTS, CloudSurvey, GridSurvey, MeshSurvey, Survey, check_points, points_of
from rpf3d_core.memory import Kept, Share, Threads, halves
from rpf3d_core.simulation.engines import Compiled, Engine, Reference
from rpf3d_core.terrain.facets import RELATIVE_TOLERANCE, Facets, Terrain, facets_from, lay_out
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.grid_rows import Mesh, grid_mesh
from rpf3d_core.terrain.mesh_ready import ready_mesh

ZONE = "terrain"
"""The zone of every facet: surveys carry no zones."""
WELD = 1e-4
"""m; vertices of a mesh that are nearer than this are one, unless a user says otherwise."""
THREADS = 2
"""Threads that lay out a ground; the loops are cut into two halves."""


@dataclass(frozen=True, eq=False)
class Ground:
    """What a simulator flies over.

    terrain, facets, engine : the engine is compiled where numba is there; they share memory
    digest : SHA-256 (hex) of what was surveyed; that of a patch follows on the digest of what it was laid on
    stamp_ns, received_ns : of the survey, and when the ground was made, by the clock of the machine
    """

    terrain: Terrain
    facets: Facets
    engine: Engine
    digest: str
    stamp_ns: int
    received_ns: int
