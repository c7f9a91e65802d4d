"""Build the tables of docs/explanation/validation.md on what `rpf3d calibrate` found at a site."""

from field_cases.page_tables import NAMES, Results, table
from field_cases.predictions import held_of_all
from field_cases.prose import COEFFICIENTS, SCORES

LITTLE = 0.15
"""Shrinkage of the prior (-) below which the page says that the stops hardly determine a coefficient."""


def section(site: str, calibrations: Results) -> str:
    """Return the tables of coefficients and of kept-out stops; calibrations : name of a model -> its results."""
    return "\n".join([COEFFICIENTS, _coefficients(calibrations), SCORES, _scores(site, calibrations)])


def _coefficients(calibrations: Results) -> str:
    """Return the table of the calibrated coefficients of each model."""
    head = ("model", "coefficient", "prior", "mean", "90 % interval", "narrower by (%)")
    return table(head, (
        (model, NAMES[name], f"{of['prior']['min']:g} to {of['prior']['max']:g}", _shown(of["mean"]),
         f"{_shown(of['low'])} to {_shown(of['high'])}", _narrower(of["shrinkage"]))
        for model, found in calibrations.items() for name, of in found["parameters"].items()
    ))  # fmt: skip


def _shown(value: float) -> str:
    """Return a coefficient as text with two decimals, or an angle (degrees) with one."""
    return f"{value:.1f}" if abs(value) >= 2.0 else f"{value:.2f}"


def _narrower(shrinkage: float) -> str:
    """Return the shrinkage (-) of a coefficient against its prior as a cell in %; in bold below LITTLE."""
    cell = f"{100.0 * shrinkage:.0f}"
    return f"**{cell}**" if shrinkage < LITTLE else cell


def _scores(site: str, calibrations: Results) -> str:
    """Return the table of scores and coverage of kept-out stops."""
    head = ("model", "score", "prior", "books", "curve", "better than curve by", "contained along", "across",
            "misfit (m)", "with the misfit: along", "across", "effective samples")  # fmt: skip
    rows = []
    for model, found in calibrations.items():
        score, kept = found["score"], {"site": site, **found["kept_out"]}
        rows.append((
            model, *("" if score[key] is None else f"{score[key]:.2f}" for key in
                     ("held_out", "prior", "book", "curve")),
            f"{found['gain']['over_curve']:+.2f} ± {found['gain']['standard_error']:.2f}",
            held_of_all(kept, "along"), held_of_all(kept, "across"), f"{kept['misfit']:.1f}",
            *(held_of_all({"site": site, **kept["with_misfit"]}, way) for way in ("along", "across")),
            f"{found['effective_samples']:.0f}",
        ))  # fmt: skip
    return table(head, rows)
