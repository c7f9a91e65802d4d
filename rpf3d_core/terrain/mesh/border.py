"""Find the border of a mesh, where the terrain ends: the sides of facets without a neighbour at the same edge.

Seen from the free side, the terrain lies to the left of each border side. The border sides of a whole mesh form closed
rings: counter-clockwise around a component, clockwise around a hole.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.jit.memory import Memory, fresh
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray

Corners = NDArray[np.integer[Any]]


def border_of(vertices: FloatArray, triangles: IntArray, memory: Memory = fresh) -> FloatArray:
    """Return the border sides (B, 3, 3) m of a mesh: begin and end of each side, and the third corner of its facet.

    Sides of opposite directions along one edge cancel out in pairs; the remaining sides are the border. So an edge
    between two facets is not on the border, even if each facet has a duplicate. Facets with two corners on one vertex
    have no sides.

    Parameters
    ----------
    vertices : (V, 3) m
    triangles : (F, 3), with consistent winding
    memory : allocates an array that is needed only during the call (`jit.memory`)
    """
    triangles = np.ascontiguousarray(triangles, dtype=np.int32)
    balance = memory("border_balance", len(vertices), np.int64)
    balance[:] = 0
    _weigh_sides(triangles, _marks(len(vertices)), balance)
    count = _sides_between(triangles, balance, np.empty((0, 3), np.int32))
    sides = np.empty((count, 3), np.int32)
    _sides_between(triangles, balance, sides)
    return np.asarray(vertices[sides[left_over(sides[:, :2])]])


def net_sides(gone: Corners, came: Corners) -> Corners:
    """Return the change of a border when a patch removes and adds triangles: sides (N, 3) that `border_after` adds.

    Each side is given by three vertices: begin, end and third corner of its triangle.

    A side that leaves the border is included in the opposite direction; `border_after` then cancels both sides. If the
    removal of a triangle puts a side of its neighbour on the border, the side is included, but with the third corner of
    the removed triangle.

    gone : (G, 3) corners of the removed triangles; came : (C, 3) corners of the added triangles
    """
    triangles = np.concatenate([gone[:, [0, 2, 1]], came]).astype(np.int64)
    sides = np.concatenate([triangles[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)])
    return np.asarray(sides[left_over(sides[:, :2])])


def border_after(border: FloatArray, gained: FloatArray) -> FloatArray:
    """Return the border (B, 3, 3) m of a terrain after a patch: the old sides and the change, opposite sides cancelled.

    border : (B0, 3, 3) m, before the patch; gained : (N, 3, 3) m, corners of the sides from `net_sides`

    Vertices are identified by their coordinates, so unchanged vertices must have exactly the same coordinates.
    """
    sides = np.concatenate([border, gained])
    ends = np.ascontiguousarray(sides[:, :2]).reshape(-1, 3) + 0.0  # -0.0 and 0.0 are one coordinate
    number = np.unique(ends, axis=0, return_inverse=True)[1].reshape(-1, 2)
    kept = np.flatnonzero(left_over(number))
    return np.asarray(sides[kept])


def left_over(number: Corners) -> NDArray[np.bool_]:
    """Return flags (N,): true for the facet sides that remain after opposite sides cancel out in pairs: the border.

    number : (N, 2) vertex numbers of the ends of each side
    """
    number, table = _counted(number)
    kept = np.zeros(len(number), dtype=bool)
    _flag_uncancelled(number, table, kept)
    return kept


def without_opposite(number: Corners) -> NDArray[np.bool_]:
    """Return flags (N,): true for each facet side if no side runs along the same edge in the opposite direction.

    In contrast to `left_over`, one side may be the opposite of several sides. The flag of a side with equal ends is
    false.

    number : (N, 2), as in `left_over`
    """
    number, table = _counted(number)
    up = number[:, 0] < number[:, 1]
    opposite = np.where(up, table.down[table.place], table.up[table.place])
    return np.asarray((opposite == 0) & (number[:, 0] != number[:, 1]))


FREE = -1
"""Key of a slot of `EdgeTable` that holds no edge."""


class EdgeTable(NamedTuple):
    """A hash table of the edges of N sides. If the slot of an edge holds another edge, the next free slot is taken.

    keys : (K,) edge in each slot, FREE if there is none; K is a power of 2, and more than twice the number of sides
    up, down : (K,) number of sides along the edge from the lower to the higher vertex, and in the opposite direction
    place : (N,) slot of the edge of each side
    """

    keys: Any
    up: Any
    down: Any
    place: Any


def _counted(number: Corners) -> tuple[NDArray[np.int64], EdgeTable]:
    """Return the sides (N, 2) as a contiguous int64 array, as compiled loops need it, and a table of their edges."""
    sides = np.ascontiguousarray(number, dtype=np.int64)
    slots = 1 << int(2 * len(sides)).bit_length()
    up, down, place = (np.zeros(n, np.int64) for n in (slots, slots, len(sides)))
    table = EdgeTable(keys=np.full(slots, FREE, np.int64), up=up, down=down, place=place)
    _count_sides(sides, int(sides.max(initial=0)) + 1, table)
    return sides, table


@loop
def _count_sides(number: Any, vertices: int, table: EdgeTable) -> None:
    """Enter the edge of each side in an empty table; number : (N, 2) vertex numbers of the ends, below `vertices`."""
    last = len(table.keys) - 1
    for i in range(len(number)):
        low, high = min(number[i, 0], number[i, 1]), max(number[i, 0], number[i, 1])
        edge = int(low) * vertices + int(high)
        mixed = int(low) * 73_856_093 ^ int(high) * 19_349_663
        slot = (mixed ^ mixed >> 17 ^ mixed >> 34) & last  # the low digits alone repeat for rows of 1024 vertices
        while table.keys[slot] != FREE and table.keys[slot] != edge:
            slot = (slot + 1) & last
        table.keys[slot], table.place[i] = edge, slot
        if number[i, 0] < number[i, 1]:
            table.up[slot] += 1
        if number[i, 0] > number[i, 1]:
            table.down[slot] += 1


@loop
def _flag_uncancelled(number: Any, table: EdgeTable, kept: Any) -> None:
    """Set a flag in `kept` (N,) for each side that no opposite side cancels.

    If only some of several equal sides are cancelled, the earlier of these sides are flagged.

    number : (N, 2) vertex numbers of the ends of each side; table : of these sides; its counts change
    """
    for i in range(len(number)):
        slot, up = table.place[i], number[i, 0] < number[i, 1]
        if up and table.up[slot] > table.down[slot]:
            kept[i] = True
            table.up[slot] -= 1
        if number[i, 0] > number[i, 1] and table.down[slot] > table.up[slot]:
            kept[i] = True
            table.down[slot] -= 1


def _marks(vertices: int) -> NDArray[np.int64]:
    """Return a pseudo-random number (V,) of 43 bits for each vertex: sums over different sets are almost never equal.

    The function is the finaliser of SplitMix64 (Steele, Lea & Flood 2014, OOPSLA). A million of these numbers add up to
    less than 2^63.
    """
    z = np.arange(1, vertices + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray((z ^ (z >> np.uint64(31))) >> np.uint64(21)).astype(np.int64)


@loop
def _weigh_sides(triangles: Any, marks: Any, balance: Any) -> None:
    """Write a balance (V,) for each vertex: 0 if the vertex is not on the border, almost certainly not 0 if it is.

    The balance adds the mark of the other vertex for each side that starts at the vertex, and subtracts this mark for
    each side that ends at the vertex. Two opposite sides therefore cancel out.

    triangles : (F, 3); marks : (V,) a pseudo-random number for each vertex (`_marks`); balance : all 0 before the call
    """
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if a != b and b != c and c != a:
            balance[a] += marks[b] - marks[c]
            balance[b] += marks[c] - marks[a]
            balance[c] += marks[a] - marks[b]


@loop
def _sides_between(triangles: Any, balance: Any, sides: Any) -> int:
    """Write the facet sides that may be on the border into `sides`; return the number of these sides.

    A side may be on the border if both of its vertices have a balance other than 0.

    triangles : (F, 3); balance : (V,) from `_weigh_sides`, 0 for a vertex that is not on the border
    sides : (N, 3), receives begin, end and third corner of the first N such sides; with N = 0, sides are only counted
    """
    count = 0
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if a != b and b != c and c != a:
            for v, w, u in ((a, b, c), (b, c, a), (c, a, b)):
                if balance[v] != 0 and balance[w] != 0:
                    if count < len(sides):
                        sides[count, 0], sides[count, 1], sides[count, 2] = v, w, u
                    count += 1
    return count
