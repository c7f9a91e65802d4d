"""Read the pairs of a DXF file: a group code on one line, its value on the next (Autodesk, DXF Reference).

Only the codes that rpf3d uses are kept. The lines are split and converted in blocks by pyarrow, because a million faces
have 34 million lines.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.frame import FloatArray

BLOCK = 2**25
"""Size (bytes) of the parts in which a DXF file is converted."""
LONGEST_LINE = 2**16
"""Largest allowed length of a line (bytes); a longer line means that the file is not a DXF."""
BINARY = b"AutoCAD Binary DXF"

TYPE, NAME, LAYER, VARIABLE = 0, 2, 8, 9
"""Group codes of texts: type of an entity, name of a section, layer, and variable of the header."""
ELEVATION, BULGE = 38, 42
TEXTS = (TYPE, NAME, LAYER, VARIABLE)
PLACES = (*range(10, 14), *range(20, 24), *range(30, 34))
NUMBERS = (*PLACES, ELEVATION, BULGE, *range(70, 75), *range(90, 96), 210, 220, 230)
"""Group codes of the numbers that are kept: coordinates, elevation, bulge, flags, counts, indices, extrusion."""
LARGEST_CODE = 2**15 - 1

Codes = NDArray[np.int16]


class Pairs(NamedTuple):
    """The pairs of group code and value in a DXF file, in the order of the file; only codes that rpf3d uses.

    code : (P,) group codes; value : (P,) the number or, if the value is a text, the index of the text in `texts`
    """

    code: Codes
    value: FloatArray
    texts: tuple[str, ...]


def read_pairs(path: Path) -> Pairs:
    """Return the pairs of group code and value in a DXF file; codes that rpf3d does not use are left out.

    Raises
    ------
    TerrainError
        The file is a binary DXF or not a DXF, or a line is damaged; the message names the line.
    """
    texts: dict[bytes, int] = {}
    codes, values, line = [np.empty(0, np.int16)], [np.empty(0)], 1
    for lines in _blocks(path):
        code, value = _block_pairs(path, lines, line, texts)
        codes.append(code)
        values.append(value)
        line += len(lines)
    names = tuple(_decoded(text) for text in texts)
    pairs = Pairs(code=np.concatenate(codes), value=np.concatenate(values), texts=names)
    if "SECTION" not in names:
        raise TerrainError(f"{path}: is not a DXF file; one has the sections HEADER and ENTITIES")
    if "EOF" not in names:
        raise TerrainError(f"{path}: ends after line {line - 1:,} without `EOF`; it is truncated")
    return pairs


def _blocks(path: Path) -> Iterator[Any]:
    """Yield the lines of a DXF file in blocks: arrow arrays with an even number of lines, so no pair is divided.

    The last line of the file may have no line end.
    """
    with path.open("rb") as file:
        rest = b""
        while data := file.read(BLOCK):
            if not rest and data.startswith(BINARY):
                raise TerrainError(f"{path}: is a binary DXF; save it as DXF in text (ASCII)")
            data = rest + data
            lines, used = _even_lines(data)
            rest = data[used:]
            if len(rest) > 2 * LONGEST_LINE:
                raise TerrainError(f"{path}: is not a DXF file; it has a line of more than {LONGEST_LINE:,} bytes")
            yield lines
        yield _even_lines(rest + b"\n")[0]


def _even_lines(data: bytes) -> tuple[Any, int]:
    """Return the complete lines at the start of `data`, as an arrow array, and their total size (bytes).

    The number of lines is even: if it would be odd, the last complete line is left out.
    """
    ends = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n"))
    ends = ends[: len(ends) // 2 * 2] + 1
    offsets = np.concatenate([[0], ends]).astype(np.int32)
    lines = pa.Array.from_buffers(pa.string(), len(ends), [None, pa.py_buffer(offsets), pa.py_buffer(data)])
    return lines, int(offsets[-1])


def _block_pairs(path: Path, lines: Any, first: int, texts: dict[bytes, int]) -> tuple[Codes, FloatArray]:
    """Return the group codes (P,) and values (P,) in a block of lines, without codes that rpf3d does not use.

    A value that is a text is returned as its number in `texts`; new texts are added there.

    first : number of the first line, from 1, for messages
    """
    every = pc.ascii_trim_whitespace(lines.take(pa.array(np.arange(0, len(lines), 2, dtype=np.int32))))
    code = _converted(path, every, first, 0, pa.int16(), "a group code (a whole number)")
    kept = np.flatnonzero(_KEPT[np.clip(code, -1, LARGEST_CODE - 1)]).astype(np.int32)
    code = code[kept]
    value = np.empty(len(code))
    is_text = np.isin(code, TEXTS)
    numbers = pc.ascii_trim_whitespace(lines.take(pa.array(2 * kept[~is_text] + 1)))
    value[~is_text] = _converted(path, numbers, first, kept[~is_text], pa.float64(), "a number")
    value[is_text] = _numbered(lines.take(pa.array(2 * kept[is_text] + 1)), texts)
    return code, value


def _converted(path: Path, words: Any, first: int, pair: Any, kind: Any, must: str) -> NDArray[Any]:
    """Return words of a block of lines as numbers (N,); raise a TerrainError for the first wrong word.

    words : (N,) arrow array of texts; kind : arrow type of the numbers
    first : number of the block's first line, from 1; must : what a word must be, for the message
    pair : for words that are values, (N,) number of the pair of each word in the block; 0 if the words are the group
        codes of all pairs of the block
    """
    try:
        return np.asarray(pc.cast(words, kind))
    except pa.ArrowInvalid as fault:
        wrong = _first_wrong(words, kind)
        line = first + (2 * wrong if isinstance(pair, int) else 2 * int(pair[wrong]) + 1)
        shown = words[wrong].as_buffer().to_pybytes()[:40].decode("ascii", "replace")
        raise TerrainError(f"{path}, line {line:,}: must be {must}, but is {shown!r}") from fault


def _first_wrong(words: Any, kind: Any) -> int:
    """Return the index of the first word that cannot be converted to an arrow type; at least one word must be wrong."""
    begin, end = 0, len(words)
    while end - begin > 1:
        middle = (begin + end) // 2
        try:
            pc.cast(words.slice(begin, middle - begin), kind)
            begin = middle
        except pa.ArrowInvalid:
            end = middle
    return begin


def _numbered(words: Any, texts: dict[bytes, int]) -> FloatArray:
    """Return the numbers (N,) of N words in `texts`, as floats; add new words to `texts` with the next numbers."""
    coded = pc.dictionary_encode(words.cast(pa.binary()))
    numbers = np.array(
        [texts.setdefault(text.as_buffer().to_pybytes().strip(), len(texts)) for text in coded.dictionary], float
    )
    return numbers[np.asarray(coded.indices)] if len(words) else np.empty(0)


def _decoded(text: bytes) -> str:
    """Return a text of a DXF file decoded as UTF-8 (versions from 2007) or, if that fails, as code page 1252."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("cp1252", "replace")


def _kept_codes() -> NDArray[np.bool_]:
    """Return a table (LARGEST_CODE + 1,) that is True for each group code that rpf3d uses; the last entry is False."""
    table = np.zeros(LARGEST_CODE + 1, bool)
    table[[*TEXTS, *NUMBERS]] = True
    return table


_KEPT = _kept_codes()
