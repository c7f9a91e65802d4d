"""Build the text of docs/explanation/validation.md from the file of results."""

from collections.abc import Sequence

from field_cases import page_authume, page_blocks, page_chant_sura, page_ranges, page_short, page_tschamut
from field_cases.chant_sura import SLOPE
from field_cases.page_tables import NAMES, Results, listed, table, wrapped
from field_cases.prose import DEFAULT, GRIDS, HEAD, METHOD, NOT_VALIDATED, SOURCES_OF_DATA, TRANSFER
from field_cases.rows import PUBLISHED, SOURCES, Values, rows
from field_cases.search import ROUNDS, Free


def document(results: Results) -> str:
    """Return the whole page."""
    return "\n".join([
        HEAD, page_short.section(results), METHOD, DEFAULT, _grids(), _values_of_books(),
        page_authume.section(results["authume"]), page_tschamut.section(results["tschamut"]),
        page_chant_sura.section(results["chant_sura"]), _transfer(results["transfer"]), page_blocks.section(results),
        page_ranges.section(results["ranges"]), NOT_VALIDATED, SOURCES_OF_DATA,
    ])  # fmt: skip


def _grids() -> str:
    """Return the section on the searched values; models with the same grid share a line."""
    models: dict[tuple[str, Free], list[str]] = {}
    for row in rows():
        for where, searched in (("flights", row.free), ("impacts", row.at_impacts)):
            for one in searched:
                models.setdefault((where, one), []).append(row.name)
    models["impacts", SLOPE] = ["all"]
    lines = [
        (listed(names), where, NAMES[one.name], f"{one.low:g} to {one.high:g}", f"{one.values}",
         f"{_last_step(one):.3g}") for (where, one), names in models.items()
    ]  # fmt: skip
    head = ("model", "calibrated on", "parameter", "range", "values of the first grid", "last step")
    return f"{GRIDS}\n{table(head, lines)}"


def _last_step(one: Free) -> float:
    """Return the step of the finest grid of a parameter."""
    return (one.high - one.low) / (one.values - 1) / 2**ROUNDS


def _values_of_books() -> str:
    """Return the published values; sites and zones with the same values share a line."""
    places: dict[tuple[str, Values], dict[str, list[str]]] = {}
    for site, sources in PUBLISHED.items():
        for source, zones in sources.items():
            for zone, values in zones.items():
                places.setdefault((source, values), {}).setdefault(site.replace("_", " ").title(), []).append(zone)
    lines = [
        (listed(list(sites)), source, listed(next(iter(sites.values()))), f"{v.R_n:g}", f"{v.R_t:g}",
         f"{v.friction_angle_deg:g}", f"{v.rolling_friction:g}") for (source, v), sites in places.items()
    ]  # fmt: skip
    books = wrapped("\n".join(f"- *{name}*: {source}." for name, source in SOURCES.items()))
    head = ("site", "values", "zone", "R_n", "R_t", "friction angle", "rolling friction (sphere only)")
    return f"## Published values\n{books}\n{table(head, lines)}"


def _transfer(lines: Sequence[Results]) -> str:
    """Return the table of values that were calibrated at one site and used at all sites."""
    head = ("model", "calibrated on", "Authume: mean x less 44.1 (m)", "distance of x (m)", "lateral sd (m), field 6.9",
            "Tschamut: mean runout error (m)", "mean absolute error (m)",
            "Chant Sura: energy ratio of the six, mean error")  # fmt: skip
    rows = []
    for line in lines:
        own = {"authume": (2, 3, 4), "tschamut": (5, 6), "chant_sura": ()}[line["from"]]
        cells = [line["model"], line["from"].replace("_", " ").title(), f"{line['authume']:+.1f}",
                 f"{line['authume_distance']:.1f}", f"{line['authume_side_sd']:.1f}", f"{line['tschamut']:+.1f}",
                 f"{line['tschamut_absolute']:.1f}", f"{line['chant_sura']:+.2f}"]  # fmt: skip
        rows.append([f"*{cell}*" if k in own else cell for k, cell in enumerate(cells)])
    return TRANSFER + "\n" + table(head, rows)
