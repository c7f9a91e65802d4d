"""The section of docs/explanation/validation.md on Authume."""

from collections.abc import Sequence

from field_cases import authume
from field_cases.page_tables import (
    Results,
    halves_table,
    interval_of,
    label,
    listed,
    mean_and_sd_of,
    searched,
    table,
    wrapped,
)
from field_cases.prose import AUTHUME, AUTHUME_FAILS, CURVES, SENSITIVITY
from field_cases.rows import CONSTANT

HALVES = ("all 41", "first half, 21", "second half, 20")


def section(results: Results) -> str:
    """Return the section of what was measured at Authume."""
    field, lines = results["field"], results["lines"]
    return "\n".join([
        AUTHUME,
        searched(results["calibrations"], "m from the field's x"),
        "![Authume](../pictures/validation_authume.png)\n",
        _stops(field, lines),
        _shares(field, lines),
        _distances(field),
        "Distance of x (m):\n",
        halves_table(results, HALVES),
        "Distance of the lateral positions (m), which no search looks at:\n",
        halves_table(results, HALVES, "side_errors"),
        _checks(lines),
        AUTHUME_FAILS,
        SENSITIVITY,
        _sensitivity(results["sensitivity"]),
        _curves(results["sensitivity"]["curves"], results["calibrations"]),
    ])  # fmt: skip


def _distances(field: Results) -> str:
    """Return what the distances mean, and which of them the field's few blocks cannot reject."""
    x, side = field["x"], field["side"]
    return wrapped(
        "The tables below give Wasserstein's distance (m): how far the mean rock must be moved along an axis to make "
        "the simulated distribution the field's. 95 % of bootstrap samples of the 41 blocks stay below "
        f"{x['resampled']:.1f} m of the blocks in x and {side['resampled']:.1f} m across: the field cannot reject a "
        f"model that is nearer. Two random halves of the blocks are {x['random_halves']:.1f} m from each other in x "
        f"and {side['random_halves']:.1f} m across; the two halves of the tables {x['these_halves']:.1f} and "
        f"{side['these_halves']:.1f} m."
    )


def _stops(field: Results, lines: Sequence[Results]) -> str:
    percentiles = list(field["percentiles"])
    head = ("x of ends (m)", "mean", "sd", *percentiles)
    rows = [
        ("**field, 41 blocks**", f"{field['mean']:.1f} ({interval_of(field['mean_interval'])})",
         f"{field['sd']:.1f} ({interval_of(field['sd_interval'])})",
         *(f"{field['percentiles'][p]:.1f} ({interval_of(field['percentile_intervals'][p])})" for p in percentiles)),
        *((label(line), f"{line['mean']:.1f}", f"{line['sd']:.1f}",
           *(f"{line['percentiles'][p]:.1f}" for p in percentiles)) for line in lines),
    ]  # fmt: skip
    return table(head, rows)


def _shares(field: Results, lines: Sequence[Results]) -> str:
    head = ("share (%)", "upper slope, x < 30", "ledge, 30 to 45", "floor, > 45", "lateral mean (m)", "lateral sd (m)",
            "reach angle (degrees)", "not at rest there (%)")  # fmt: skip
    intervals = field["section_intervals"]
    rows = [
        ("**field**", *(f"{100 * share:.0f} ({interval_of([100 * v for v in intervals[name]], 0)})"
                        for name, share in field["sections"].items()),
         f"{field['side_mean']:+.1f}", f"{field['side_sd']:.1f} ({interval_of(field['side_sd_interval'])})",
         mean_and_sd_of(field, "angle"), ""),
        *((label(line), *(f"{100 * share:.0f}" for share in line["sections"].values()), f"{line['side_mean']:+.1f}",
           f"{line['side_sd']:.1f}", mean_and_sd_of(line, "angle"), f"{100 * line['left']:.0f}")
          for line in lines),
    ]  # fmt: skip
    return table(head, rows)


def _checks(lines: Sequence[Results]) -> str:
    head = ("check against all 41", "mean x 44.1 ± 5 m", "ledge 51 ± 15 points", "floor 44 ± 15 points")
    rows = [(label(line), *("met" if line["checks"][name] else "**failed**" for name in ("mean", "ledge", "floor")))
            for line in lines]  # fmt: skip
    return table(head, rows)


def _sensitivity(sensitivity: Results) -> str:
    rows = [
        (model, name, *(f"{mean:.1f} ({value:g})" for value, mean in zip(one["values"], one["mean"], strict=True)))
        for model, parameters in sensitivity.items() if model != "curves"
        for name, one in parameters.items()
    ]  # fmt: skip
    return table(("model", "parameter", "two steps down", "one", "calibrated", "one", "two steps up"), rows)


def _curves(curves: Results, calibrations: Results) -> str:
    rows = [
        (model, f"R_n {R_n}", *(f"{mean:.1f}" for mean in means))
        for model, of_model in curves.items() for R_n, means in of_model.items()
    ]  # fmt: skip
    angles = listed([f"{calibrations[model]['parameters']['friction_angle_deg']:g} ({model})" for model in curves])
    said = f"Mean x (m) over R_n and R_t, at the calibrated friction angles (degrees) of {angles}:\n\n"
    return (
        said
        + table(("", "", *(f"R_t {R_t:g}" for R_t in authume.STEPS_OF_R_T)), rows)
        + "\n"
        + _reading(curves[CONSTANT.name])
    )


def _reading(curves: Results) -> str:
    """Return what the constant model's curves mean."""
    here, there = (authume.STEPS_OF_R_T.index(R_t) for R_t in (0.86, 0.90))
    by_R_t = listed([f"{means[there] - means[here]:.1f} m (R_n {R_n})" for R_n, means in curves.items()])
    low, middle, high = (means[here] for means in curves.values())
    return wrapped(
        f"In the constant model R_t from 0.86 to 0.90 moves the mean by {by_R_t}. R_n from 0.25 to 0.40, at R_t 0.86, "
        f"moves the mean by {middle - low:.1f} m, and from 0.40 to 0.55 by {high - middle:.1f} m. {CURVES}"
    )
