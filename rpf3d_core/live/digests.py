"""Digests that identify surveys, so that logs can state which terrain was used: SHA-256 of the contents."""

import hashlib
from typing import Any

import numpy as np

from rpf3d_core.live.survey import MeshSurvey, Survey


def digest_of(survey: Survey, upon: str = "") -> str:
    """Return a digest (SHA-256, hex) that identifies a survey by its kind, sizes and bits.

    upon : for a patch, the digest of the terrain before the patch, which is included in the result; else ""
    """
    digest = hashlib.sha256(f"{upon} {type(survey).__name__}".encode())
    arrays = (survey.vertices, survey.triangles) if isinstance(survey, MeshSurvey) else (survey.points,)
    for array in arrays:
        kind = "<i4" if np.issubdtype(array.dtype, np.integer) else "<f8"
        _take(digest, np.ascontiguousarray(array, dtype=kind))
    return digest.hexdigest()


def _take(digest: Any, array: Any) -> None:
    digest.update(f"{array.shape}".encode())
    digest.update(memoryview(array).cast("B"))
