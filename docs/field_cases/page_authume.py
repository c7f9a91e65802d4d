"""Build the section of docs/explanation/validation.md on Authume from the file of results."""

from field_cases import page_calibrations
from field_cases.models import AUTHUME
from field_cases.page_tables import Results, among_sets, interval_of, label, table, wrapped
from field_cases.prose import AUTHUME as WORDS
from field_cases.prose import AUTHUME_FAILS, OF_ONE_SLOPE


def section(results: Results) -> str:
    """Return the section on Authume as Markdown."""
    field = results["field"]
    by_chance = wrapped(
        "*Distance* is Wasserstein's: how far rocks must be moved on average to make the two distributions equal. The "
        f"41 blocks cannot reject a model below {field['by_chance']:.1f} m in x and {field['side_by_chance']:.1f} m "
        "across: 95 % of their own bootstrap samples are as near.\n"
    )
    return "\n".join([
        WORDS, "![Authume](../pictures/validation_authume.png)\n", _ends(results), by_chance,
        page_calibrations.section(AUTHUME, results["calibrations"]), AUTHUME_FAILS,
    ])  # fmt: skip


def _ends(results: Results) -> str:
    """Return the table of end points: field, published values, calibrated values."""
    head = ("x of ends (m)", "mean", "sd", "p5", "p50", "p95", "beyond 55 m (%)", "lateral mean (m)",
            "lateral sd (m)", "distance of x (m)", "lateral distance (m)", "not at rest (%)")  # fmt: skip
    return OF_ONE_SLOPE + "\n" + table(head, [_field(results["field"]), *map(_line, results["lines"])])


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
