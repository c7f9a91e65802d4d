"""Sort the pairs of a DXF file into entities: their types, layers and sections, and the unit of the drawing."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.mine.dxf_pairs import LAYER, NAME, TYPE, VARIABLE, Pairs, read_pairs
from rpf3d_core.formats.units import METRE
from rpf3d_core.terrain.frame import FloatArray

Ids = NDArray[np.int64]

UNITS = {1: "in", 2: "ft", 3: "mi", 4: "mm", 5: "cm", 6: METRE, 7: "km", 10: "yd", 14: "dm", 21: "us_ft"}
"""Key of each unit, by the value of $INSUNITS (Autodesk, DXF Reference)."""
CLOSED, CURVE_3D, MESH_2D, POLYFACE = 1, 8, 16, 64
"""Flags of a POLYLINE (group code 70)."""


class DxfDrawing(NamedTuple):
    """The E entities of a DXF file, and the P pairs of group code and value that the entities consist of.

    pairs : the pairs in the order of the file
    entity : (P,) number of the entity that each pair belongs to
    kind : (E,) index of the entity's type in `pairs.texts`; layer : (E,) index of its layer in `pairs.texts`, or -1
    drawn : (E,) True for entities of the section ENTITIES
    unit : value of $INSUNITS; 0 if the file states none
    """

    pairs: Pairs
    entity: Ids
    kind: Ids
    layer: Ids
    drawn: NDArray[np.bool_]
    unit: int

    def numbers_of(self, *names: str) -> Ids:
        """Return the numbers (N,) of all drawn entities of some types, in the order of the file."""
        known = [self.pairs.texts.index(name) for name in names if name in self.pairs.texts]
        return np.flatnonzero(self.drawn & np.isin(self.kind, known))

    def table(self, entities: Ids, codes: tuple[int, ...]) -> FloatArray:
        """Return the values (N, C) of N entities for C group codes; NaN where an entity does not have the code.

        If an entity has a code several times, the last value counts.

        entities : (N,) numbers of the entities
        """
        row = np.full(len(self.kind), -1)
        row[entities] = np.arange(len(entities))
        out = np.full((len(entities), len(codes)), np.nan)
        there = np.flatnonzero(np.isin(self.pairs.code, codes))
        there = there[row[self.entity[there]] >= 0]
        column = np.full(max(codes) + 1, -1)
        column[list(codes)] = np.arange(len(codes))
        out[row[self.entity[there]], column[self.pairs.code[there]]] = self.pairs.value[there]
        return out

    def pairs_of(self, entity: int) -> tuple[NDArray[np.int16], FloatArray]:
        """Return the group codes (Q,) and the values (Q,) of one entity, given by its number."""
        begin, end = np.searchsorted(self.entity, [entity, entity + 1])
        return self.pairs.code[begin:end], self.pairs.value[begin:end]

    def layer_names(self, entities: Ids) -> list[str]:
        """Return the layer names of N entities (N,); "0" for an entity without a layer, as in the DXF Reference."""
        return [self.pairs.texts[i] if i >= 0 else "0" for i in self.layer[entities].tolist()]


def read_drawing(path: Path) -> DxfDrawing:
    """Return the entities of a DXF file; errors are as in `read_pairs`."""
    pairs = read_pairs(path)
    starts = np.flatnonzero(pairs.code == TYPE)
    if not len(starts):
        raise TerrainError(f"{path}: is not a DXF file; it has no entity")
    pairs = pairs._replace(code=pairs.code[starts[0] :], value=pairs.value[starts[0] :])
    is_type = pairs.code == TYPE
    entity = np.cumsum(is_type) - 1
    kind = pairs.value[is_type].astype(np.int64)
    layer = np.full(len(kind), -1)
    of_layer = pairs.code == LAYER
    layer[entity[of_layer]] = pairs.value[of_layer].astype(np.int64)
    drawn = _inside_section(pairs, entity, kind, "ENTITIES")
    return DxfDrawing(pairs=pairs, entity=entity, kind=kind, layer=layer, drawn=drawn, unit=_unit(pairs))


def _inside_section(pairs: Pairs, entity: Ids, kind: Ids, name: str) -> NDArray[np.bool_]:
    """Return flags (E,): True for each entity between the entities SECTION and ENDSEC of the section `name`.

    entity : (P,) number of the entity of each pair; kind : (E,) type of each entity, as in `DxfDrawing`
    """
    marks = np.isin(kind, [i for i, text in enumerate(pairs.texts) if text in ("SECTION", "ENDSEC")])
    named = {int(entity[i]) for i in np.flatnonzero(pairs.code == NAME).tolist() if _text(pairs, i) == name}
    opens = np.isin(np.arange(len(kind)), [i for i in named if pairs.texts[kind[i]] == "SECTION"])
    last = np.maximum.accumulate(np.where(marks, np.arange(len(kind)), -1))
    return np.asarray((last >= 0) & opens[last] & ~marks)


def _text(pairs: Pairs, i: int) -> str:
    return pairs.texts[int(pairs.value[i])]


def _unit(pairs: Pairs) -> int:
    """Return the value of the header's variable $INSUNITS; 0 if it is missing or impossible."""
    for i in np.flatnonzero(pairs.code == VARIABLE).tolist():
        if _text(pairs, i) == "$INSUNITS" and i + 1 < len(pairs.code) and pairs.code[i + 1] == 70:
            value = pairs.value[i + 1]
            return int(value) if np.isfinite(value) and abs(value) < 100 else 0
    return 0
