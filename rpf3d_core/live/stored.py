"""Write and read one survey in one file; the file is always complete, and a damaged file is refused.

The file consists of a line that names the kind of file, the length of a header, the header (JSON), the arrays, and the
SHA-256 of all these. The file is written under another name, flushed to the disk, and renamed in one step.
"""

import hashlib
import json
import os
import struct
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.digests import digest_of
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey, Survey

MAGIC = b"rpf3d survey 1\n"
CHECK = 32
"""Length of the checksum (SHA-256) at the end of the file (bytes)."""
LONGEST_HEADER = 65_536
"""Largest length of a header that is accepted (bytes); a header has a few hundred bytes."""
SUFFIX = ".survey"
KINDS: dict[str, Any] = {kind.__name__: kind for kind in (GridSurvey, MeshSurvey, CloudSurvey)}
LENGTH = struct.Struct("<Q")


class StoredSurvey(NamedTuple):
    """A survey as it is stored on disk, with the digests that show which terrain it belongs to.

    digest : of the terrain with this survey; upon : for a patch, digest of the terrain before the patch, else ""
    stamp_ns, received_ns, whole_ns, whole_digest : as in `ground.LiveTerrain`; whole_ns is 0, and whole_digest "", if
        an older version did not store them
    patches : for a terrain that was stored whole after patches, the number of these patches, or a lower bound; 1 for a
        patch that has replaced the whole terrain; else 0
    map_origin : (m) origin of the map frame of the survey, from the node's parameter `map_origin`; None if it is not
        known
    longest_edge : (m) limit for the sides of triangles when the survey was built, from the node's parameter; 0 if the
        limit followed from the points, None if it is not known
    """

    survey: Survey
    digest: str
    upon: str
    stamp_ns: int
    received_ns: int
    whole_ns: int = 0
    patches: int = 0
    whole_digest: str = ""
    map_origin: tuple[float, ...] | None = None
    longest_edge: float | None = None


def write_piece(path: Path, piece: StoredSurvey) -> None:
    """Write a survey to a file in one step: after a crash, the file is either the old file or complete.

    piece : the survey. Raises OSError if the file cannot be written.
    """
    beside = path.with_suffix(".part")
    arrays = _arrays(piece.survey)
    parts = [{"type": array.dtype.str, "shape": array.shape} for array in arrays]
    header = json.dumps({"kind": type(piece.survey).__name__, "arrays": parts, **_header_of(piece)}).encode()
    digest = hashlib.sha256()
    with beside.open("wb") as file:
        for part in (MAGIC, LENGTH.pack(len(header)), header, *(_bytes_of(array) for array in arrays)):
            digest.update(part)
            file.write(part)
        file.write(digest.digest())
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
    sync_folder(path.parent)


def read_piece(path: Path) -> StoredSurvey:
    """Read a survey from a file.

    Raises TerrainError if a part of the file is missing, changed or unknown, and OSError if it cannot be read.
    """
    content = path.read_bytes()
    body = memoryview(content)[: max(len(content) - CHECK, 0)]
    if bytes(body[: len(MAGIC)]) != MAGIC:
        raise TerrainError(f"{path}: the file is not a stored survey, or its beginning is damaged")
    if hashlib.sha256(body).digest() != content[len(body) :]:
        raise TerrainError(f"{path}: the survey is damaged or cut short: its checksum is wrong")
    try:
        return _piece(body)
    except (KeyError, ValueError, TypeError) as error:  # the file is whole, so another version of rpf3d wrote it
        raise TerrainError(f"{path}: the survey is of an unknown kind, as another version may write it") from error


def sync_folder(folder: Path) -> None:
    """Wait until new, renamed and removed files of a folder are on disk, so that a power failure cannot undo them."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _header_of(piece: StoredSurvey) -> dict[str, Any]:
    return {name: getattr(piece, name) for name in StoredSurvey._fields if name != "survey"}


def _arrays(survey: Survey) -> list[NDArray[Any]]:
    if isinstance(survey, MeshSurvey):
        return [np.ascontiguousarray(survey.vertices, "<f8"), np.ascontiguousarray(survey.triangles, "<i4")]
    return [np.ascontiguousarray(survey.points, "<f8")]


def _bytes_of(array: Any) -> Any:
    return memoryview(array).cast("B")


def _piece(body: memoryview) -> StoredSurvey:
    """Return the survey from the content of a file whose checksum is correct.

    body : the content of the file without the checksum
    """
    begin = len(MAGIC) + LENGTH.size
    (length,) = LENGTH.unpack(body[len(MAGIC) : begin])
    header = json.loads(bytes(body[begin : begin + min(length, LONGEST_HEADER)]))
    arrays, at = [], begin + length
    for part in header["arrays"]:
        count = int(np.prod(part["shape"]))
        arrays.append(np.frombuffer(body, part["type"], count, at).reshape(part["shape"]))
        at += arrays[-1].nbytes
    survey = KINDS[header["kind"]](*arrays)
    piece = StoredSurvey(
        survey=survey,
        digest=header["digest"],
        upon=header["upon"],
        stamp_ns=header["stamp_ns"],
        received_ns=header["received_ns"],
        map_origin=tuple(header["map_origin"]) if header.get("map_origin") is not None else None,
        longest_edge=header.get("longest_edge"),
    )
    if "whole_ns" in header:
        piece = piece._replace(whole_ns=header["whole_ns"], patches=header["patches"])
    else:
        piece = _with_whole_ns(piece)
    without_patches = not piece.upon and not piece.patches
    return piece._replace(whole_digest=header.get("whole_digest", piece.digest if without_patches else ""))


def _with_whole_ns(piece: StoredSurvey) -> StoredSurvey:
    """Return a survey from a file of an older version, which has no `whole_ns`, with `whole_ns` and `patches` set.

    A whole survey without patches gets its own stamp as `whole_ns`. A terrain that was stored whole after patches is
    recognised because its digest differs from the digest of its mesh: `whole_ns` stays 0 (unknown), and `patches`
    becomes 1, a lower bound. A patch is returned unchanged.
    """
    if digest_of(piece.survey) == piece.digest:
        return piece._replace(whole_ns=piece.stamp_ns)
    return piece if piece.upon else piece._replace(patches=1)
