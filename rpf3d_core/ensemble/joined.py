"""Join the flights of several parts of an ensemble, such as parts that several processes flew."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from rpf3d_core.ensemble.flights import Deposits, Flights, Impacts, IntArray, Paths

Rows = TypeVar("Rows", Impacts, Paths)


def joined(parts: Sequence[Flights]) -> Flights:
    """Return the flights of several parts of an ensemble as one result; the order of the parts does not matter.

    The rocks are sorted by source, then rock, then fragment. `compile_s` (s) of the result is the largest `compile_s`
    of a part; `fly_s` (s) is the sum of the parts' `fly_s`.
    """
    deposits = [part.deposits for part in parts]
    keys = [np.concatenate([getattr(some, name) for some in deposits]) for name in ("piece", "rock", "source")]
    order = np.lexsort(keys)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return Flights(
        Deposits(*_in_order(_columns(deposits), order)),
        _in_place([part.impacts for part in parts], deposits, place),
        _in_place([part.paths for part in parts], deposits, place),
        parts[0].engine,
        max(part.compile_s for part in parts),
        sum(part.fly_s for part in parts),
    )


def one_after_another(parts: Sequence[tuple[Deposits, Impacts]]) -> tuple[Deposits, Impacts]:
    """Return the deposits and impacts of several groups of rocks as one, in the order of the groups.

    In the result, `Impacts.row` counts the rocks of all groups in sequence.
    """
    before = np.cumsum([0, *(len(deposits.rock) for deposits, _ in parts)])
    moved = [replace(impacts, row=impacts.row + n) for (_, impacts), n in zip(parts, before[:-1], strict=True)]
    return Deposits(*_columns([deposits for deposits, _ in parts])), Impacts(*_columns(moved))


def _in_place(tables: Sequence[Rows], deposits: Sequence[Deposits], place: IntArray) -> Rows:
    """Return the tables of impacts or paths of several parts joined into one table, with new row numbers of the rocks.

    deposits : of each part
    place : (R,) new row of each rock; index 0 is the first rock of the first part, and all parts follow in sequence
    """
    before = np.cumsum([0, *(len(some.rock) for some in deposits)])
    moved = [replace(table, row=place[table.row + n]) for table, n in zip(tables, before[:-1], strict=True)]
    order = np.argsort(np.concatenate([table.row for table in moved]), kind="stable")
    return type(tables[0])(*_in_order(_columns(moved), order))


def _in_order(columns: Sequence[np.ndarray | None], order: IntArray) -> list[Any]:
    """Return the columns of a table with their rows in a new order; None for columns that the table does not have."""
    return [None if column is None else column[order] for column in columns]


def _columns(tables: Sequence[Deposits] | Sequence[Impacts] | Sequence[Paths]) -> list[Any]:
    """Return the columns of several tables, each column joined over all tables; None for missing columns."""
    parts = ([getattr(table, field.name) for table in tables] for field in fields(tables[0]))
    return [None if columns[0] is None else np.concatenate(columns) for columns in parts]
