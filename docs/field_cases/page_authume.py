"""Build the section of docs/explanation/validation.md on Authume from the file of results."""

from field_cases import page_calibrations
from field_cases.models import AUTHUME, CONSTANT, COULOMB_LIMITED, POINTS_AND_SPHERES, SPHERE
from field_cases.page_tables import NAMES, Results, among_sets, interval_of, label, listed, table, wrapped
from field_cases.prose import AUTHUME as WORDS
from field_cases.prose import AUTHUME_FAILS


def section(results: Results) -> str:
    """Return the section on Authume as Markdown."""
    field = results["field"]
    by_chance = wrapped(
        "*Distance*: the Wasserstein distance, which is how far rocks must be moved on average to make the two "
        "distributions equal, in x and across the slope. The "
        f"41 blocks cannot reject a model whose distance is below {field['by_chance']:.1f} m in x and "
        f"{field['side_by_chance']:.1f} m across, because chance alone makes such distances. The limits come from "
        "samples of 41 blocks, drawn from the 41 blocks with replacement: for 95 % of the samples, the distance "
        "between the sample and all blocks is below the limit.\n"
    )
    return "\n".join([
        WORDS, "![Authume](../pictures/validation_authume.png)\n", _ends(results), by_chance,
        page_calibrations.section(AUTHUME, results["calibrations"]), _fails(results["calibrations"]),
    ])  # fmt: skip


def _fails(calibrations: Results) -> str:
    """Return the text on failures of the models, with the strongest correlation of each model of points and spheres."""
    strongest = {model.name: calibrations[model.name]["strongest"] for model in POINTS_AND_SPHERES}
    values = {name: strongest[model.name]["correlation"] for name, model in
              (("constant", CONSTANT), ("limited", COULOMB_LIMITED), ("sphere", SPHERE))}  # fmt: skip
    pair = listed([NAMES[name] for name in strongest[SPHERE.name]["names"]])
    return wrapped(AUTHUME_FAILS.format(**values, pair=pair))


def _ends(results: Results) -> str:
    """Return the table of end points, for the field, published values and calibrated values."""
    head = ("x of ends (m)", "mean", "sd", "p5", "p50", "p95", "beyond 55 m (%)", "lateral mean (m)",
            "lateral sd (m)", "distance in x (m)", "across (m)", "not at rest (%)")  # fmt: skip
    return table(head, [_field(results["field"]), *map(_line, results["lines"])])


def _field(field: Results) -> tuple[str, ...]:
    return (
        "**field, 41 blocks**",
        *(f"{field[name]:.1f} ({interval_of(field[f'{name}_interval'])})" for name in ("mean", "sd")),
        *(f"{field['percentiles'][p]:.1f}" for p in ("p5", "p50", "p95")),
        f"{100 * field['beyond']:.0f}", f"{field['side_mean']:+.1f}",
        f"{field['side_sd']:.1f} ({interval_of(field['side_sd_interval'])})", "", "", "",
    )  # fmt: skip


def _line(line: Results) -> tuple[str, ...]:
    return (
        label(line), among_sets(line, "mean"), among_sets(line, "sd"),
        *(f"{line['percentiles'][p]:.1f}" for p in ("p5", "p50", "p95")),
        among_sets(line, "beyond", 0, unit=100.0), f"{line['side_mean']:+.1f}", among_sets(line, "side_sd"),
        f"{line['distance']:.1f}", f"{line['side_distance']:.1f}", f"{100 * line['left']:.0f}",
    )  # fmt: skip
