"""Build the section of docs/explanation/validation.md on Authume from the file of results."""

from collections.abc import Sequence

from field_cases import authume
from field_cases.page_tables import (
    NAMES,
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
from field_cases.prose import AUTHUME, AUTHUME_FAILS, CHECKS, CURVES, SENSITIVITY
from field_cases.rows import CONSTANT

HALVES = ("x: all 41", "first half, 21", "second half, 20", "lateral: all 41", "first half", "second half")
FAILED = {"mean": "mean x", "ledge": "ledge", "floor": "floor"}


def section(results: Results) -> str:
    """Return the section on Authume as Markdown."""
    field, lines = results["field"], results["lines"]
    return "\n".join([
        AUTHUME,
        searched(results["calibrations"]),
        "![Authume](../pictures/validation_authume.png)\n",
        _stops(field, lines),
        CHECKS,
        _shares(field, lines),
        _distances(field),
        halves_table(results, HALVES, ("errors", "side_errors")),
        AUTHUME_FAILS,
        SENSITIVITY,
        _sensitivity(results["sensitivity"]),
        _curves(results["sensitivity"]["curves"], results["calibrations"]),
    ])  # fmt: skip


def _distances(field: Results) -> str:
    """Return the explanation of the distances, and the distance below which the few blocks cannot reject a model."""
    x, side = field["x"], field["side"]
    return wrapped(
        "The next table has the difference of simulated and observed end points as Wasserstein's distance (m): how "
        "far rocks must be moved on average to make the two distributions equal. The 41 blocks cannot reject a model "
        f"with a distance below {x['resampled']:.1f} m in x and {side['resampled']:.1f} m across, because 95 % of "
        "their bootstrap samples are as near. For comparison, two random halves of the blocks have a distance of "
        f"{x['random_halves']:.1f} m in x and {side['random_halves']:.1f} m across, the two halves of the table "
        f"{x['these_halves']:.1f} and {side['these_halves']:.1f} m."
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
            "reach angle (degrees)", "not at rest (%)", "fails")  # fmt: skip
    intervals = field["section_intervals"]
    rows = [
        ("**field**", *(f"{100 * share:.0f} ({interval_of([100 * v for v in intervals[name]], 0)})"
                        for name, share in field["sections"].items()),
         f"{field['side_mean']:+.1f}", f"{field['side_sd']:.1f} ({interval_of(field['side_sd_interval'])})",
         mean_and_sd_of(field, "angle"), "", ""),
        *((label(line), *(f"{100 * share:.0f}" for share in line["sections"].values()), f"{line['side_mean']:+.1f}",
           f"{line['side_sd']:.1f}", mean_and_sd_of(line, "angle"), f"{100 * line['left']:.0f}", _failed(line))
          for line in lines),
    ]  # fmt: skip
    return table(head, rows)


def _failed(line: Results) -> str:
    """Return the names of the checks that a line of the table fails."""
    return ", ".join(f"**{FAILED[name]}**" for name, is_met in line["checks"].items() if not is_met) or "none"


def _sensitivity(sensitivity: Results) -> str:
    rows = [
        (model, NAMES[name],
         *(f"{mean:.1f} ({value:g})" for value, mean in zip(one["values"], one["mean"], strict=True)))
        for model, parameters in sensitivity.items() if model != "curves"
        for name, one in parameters.items()
    ]  # fmt: skip
    return table(
        ("model", "parameter", "two steps down", "one step down", "calibrated", "one step up", "two steps up"), rows
    )


def _curves(curves: Results, calibrations: Results) -> str:
    rows = [
        (model, R_n, *(f"{mean:.1f}" for mean in means))
        for model, of_model in curves.items() for R_n, means in of_model.items()
    ]  # fmt: skip
    angles = listed([f"{calibrations[model]['parameters']['friction_angle_deg']:g} ({model})" for model in curves])
    head = ("model", "R_n", *(f"R_t {R_t:g}" for R_t in authume.STEPS_OF_R_T))
    words = f"Mean x (m) over R_n and R_t, at the calibrated friction angles (degrees) of {angles}:"
    return f"{words}\n\n{table(head, rows)}\n{_reading(curves[CONSTANT.name])}"


def _reading(curves: Results) -> str:
    """Return the conclusion from the curves of the constant model."""
    here, there = (authume.STEPS_OF_R_T.index(R_t) for R_t in (0.86, 0.90))
    R_n, means = next(iter(curves.items()))
    return wrapped(
        f"In the constant model at R_n {R_n}, R_t from 0.86 to 0.90 moves the mean by "
        f"{means[there] - means[here]:.1f} m. {CURVES}"
    )
