"""Describe the result of a sensitivity analysis in words, as a table, and as the content of sensitivity.json."""

from typing import Any

import numpy as np

from rpf3d_core.ensemble.outward import fixed, interval_as, three_figures
from rpf3d_core.sensitivity.analysis import Sensitivity
from rpf3d_core.sensitivity.sobol import Indices


def decisive(found: Sensitivity, result: int) -> int | None:
    """Return the index of the unknown that affects a result most; None if no unknown affects this result.

    The total Sobol indices are compared. If there are none, or one of them is unknown (NaN), the effects by Morris are
    compared instead.

    result : index of the result
    """
    sizes = found.effects.size[:, result]
    if found.indices is not None and np.isfinite(found.indices.total[:, result]).all():
        sizes = found.indices.total[:, result]
    return int(np.argmax(sizes)) if sizes.max() > 0.0 else None


def is_moved(found: Sensitivity, result: int) -> bool:
    """Return True if at least one unknown affects a result, by Morris; result : index of the result."""
    return bool(found.effects.size[:, result].any())


def sentence_of(found: Sensitivity, result: int) -> str:
    """Return a sentence on the unknown that affects a result most, and by how much; result : index of the result."""
    unknown, name = decisive(found, result), found.results[result]
    if unknown is None:
        middle = three_figures(found.middle[result])
        return f"no unknown moves the {name}: it is {middle} {found.units[result]} in all sets"
    effect = f"{three_figures(found.effects.size[unknown, result])} {_unit_of_changes(found.units[result])}"
    subject = f"{found.names[unknown]} decides the {name}"
    if not is_clear(found, result):
        subject = f"{found.names[unknown]} moves the {name} most, but not clearly"
    if found.indices is None or not np.isfinite(found.indices.total[unknown, result]):
        return f"{subject}: moved by two thirds of its range, it changes the result by {effect} on average"
    share, ends = _total_in_words(found.indices, unknown, result)
    return f"{subject}: {share} of the variance ({ends}), interactions included"


def is_clear(found: Sensitivity, result: int) -> bool:
    """Return True if it is clear which unknown affects a result most.

    "Clear" means: the interval of the largest effect lies above the intervals of the effects of all other unknowns, no
    unknown affects the result, or there is only one unknown. Effects are compared as in `decisive`.

    result : index of the result
    """
    unknown = decisive(found, result)
    if unknown is None or len(found.names) == 1:
        return True
    low, high = found.effects.low[:, result], found.effects.high[:, result]
    if found.indices is not None and np.isfinite(found.indices.total[:, result]).all():
        low, high = found.indices.total_ends[:, :, result]
    return bool(low[unknown] > np.delete(high, unknown).max())


def rows_of(found: Sensitivity) -> list[tuple[str, ...]]:
    """Return the rows of the table: one row for each unknown of each result, the largest effect first.

    Results that no unknown affects are left out. Columns: result (only in the first row of each result, else ""),
    unknown, change with unit, its 95 % interval, share of the variance ("" without Sobol indices).
    """
    rows, effects = list[tuple[str, ...]](), found.effects
    for y, name in enumerate(found.results):
        order: list[int] = np.argsort(-effects.size[:, y]).tolist() if is_moved(found, y) else []
        for place, u in enumerate(order):
            interval = interval_as(
                (float(effects.low[u, y]), float(effects.high[u, y])), three_figures, between=" to "
            )  # fmt: skip
            change = f"{three_figures(effects.size[u, y])} {_unit_of_changes(found.units[y])}"
            rows.append((name if place == 0 else "", found.names[u], change, interval, _share_in_words(found, u, y)))
    return rows


def _unit_of_changes(unit: str) -> str:
    """Return the unit in which a change of a result is stated: "percentage points" for "%", else `unit` itself."""
    return "percentage points" if unit == "%" else unit


def _share_in_words(found: Sensitivity, u: int, y: int) -> str:
    """Return the total Sobol index with its interval, in per cent as text; "" if there is none.

    u : index of the unknown; y : index of the result
    """
    if found.indices is None or not np.isfinite(found.indices.total[u, y]):
        return ""
    share, ends = _total_in_words(found.indices, u, y)
    return f"{share} ({ends})"


def _total_in_words(indices: Indices, u: int, y: int) -> tuple[str, str]:
    """Return the total Sobol index in per cent as text, and its interval, rounded outward, as text.

    u : index of the unknown; y : index of the result
    """
    ends: list[float] = (100.0 * indices.total_ends[:, u, y]).tolist()
    return (f"{100.0 * indices.total[u, y]:.0f} %",
            interval_as(ends, lambda end, side: fixed(end, 0, side), between=" to "))  # fmt: skip


def content_of(found: Sensitivity) -> dict[str, Any]:
    """Return the content of sensitivity.json: the effect of each unknown on each result, by result and unknown."""
    return {
        "sets": found.sets,
        "rocks": found.rocks,
        "results": {
            name: {
                "unit": found.units[y], "mean": float(found.middle[y]), "sentence": sentence_of(found, y),
                "clear": is_clear(found, y),
                "unknowns": {path: _numbers(found, u, y) for u, path in enumerate(found.names)},
            }
            for y, name in enumerate(found.results)
        },
    }  # fmt: skip


def _numbers(found: Sensitivity, u: int, y: int) -> dict[str, Any]:
    """Return the effect of an unknown on a result, and the Sobol indices if they were asked for, for sensitivity.json.

    A Sobol index of a result that does not vary is None.

    u : index of the unknown; y : index of the result
    """
    effects, indices = found.effects, found.indices
    numbers: dict[str, Any] = {
        "effect": float(effects.size[u, y]), "low": float(effects.low[u, y]), "high": float(effects.high[u, y]),
        "spread": float(effects.spread[u, y]),
    }  # fmt: skip
    if indices is not None:
        for name, each, ends in (("first", indices.first, indices.first_ends),
                                 ("total", indices.total, indices.total_ends)):  # fmt: skip
            low, high = ends[:, u, y].tolist()
            numbers[name] = {"share": _or_none(each[u, y]), "low": _or_none(low), "high": _or_none(high)}
    return numbers


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
