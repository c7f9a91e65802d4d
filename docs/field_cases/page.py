"""Build the text of docs/explanation/validation.md from the file of results."""

from field_cases import page_authume, page_blocks, page_chant_sura, page_elsewhere, page_short, page_tschamut
from field_cases.models import AUTHUME, CHANT_SURA, PUBLISHED, SOURCES, TSCHAMUT, Values
from field_cases.page_tables import Results, listed, table, wrapped
from field_cases.prose import DEFAULT, HEAD, METHOD, NOT_VALIDATED, SOURCES_OF_DATA


def document(results: Results) -> str:
    """Return the whole page as Markdown; results : content of the file of results."""
    return "\n".join([
        HEAD, page_short.section(results), METHOD, page_authume.section(results[AUTHUME]),
        page_tschamut.section(results[TSCHAMUT]), page_chant_sura.section(results[CHANT_SURA]),
        page_elsewhere.section(results), DEFAULT, page_blocks.section(results), NOT_VALIDATED, _values_of_books(),
        SOURCES_OF_DATA,
    ])  # fmt: skip


def _values_of_books() -> str:
    """Return the section on published values; in its table, sites and zones with the same values share a line."""
    places: dict[tuple[str, Values], dict[str, list[str]]] = {}
    for site, sources in PUBLISHED.items():
        for source, zones in sources.items():
            for zone, values in zones.items():
                places.setdefault((source, values), {}).setdefault(site, []).append(zone)
    lines = [
        (listed(list(sites)), source, listed(next(iter(sites.values()))), f"{v.R_n:g}", f"{v.R_t:g}",
         f"{v.friction_angle_deg:g}", f"{v.rolling_friction:g}") for (source, v), sites in places.items()
    ]  # fmt: skip
    books = wrapped("\n".join(f"- *{name}*: {source}." for name, source in SOURCES.items()))
    head = ("site", "values", "zone", "R_n", "R_t", "friction angle", "rolling friction (sphere only)")
    return f"## Which published values are used?\n{books}\n{table(head, lines)}"
