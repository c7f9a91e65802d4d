"""The first section of docs/explanation/validation.md: the conclusion, with the range of the figures of all models."""

from collections.abc import Iterable

from field_cases import authume, ranges, tschamut
from field_cases.measuring import CALIBRATED
from field_cases.page_tables import Results, listed, wrapped
from field_cases.prose import VERDICT
from field_cases.rows import COULOMB_LIMITED, HOEK


def section(results: Results) -> str:
    """Return the section on how far a predicted runout can be trusted."""
    quarry, meadow = results["authume"]["lines"], results["tschamut"]["lines"]
    fitted = [line for line in quarry if line["values"] == CALIBRATED]
    words = wrapped(
        VERDICT.format(
            **_range("book", (_off(line) for line in quarry if line["values"] != CALIBRATED)),
            **_range("meadow", (line["error_mean"] for line in meadow if line["values"] != CALIBRATED)),
            **_range("sd", (line["sd"] for line in fitted)),
            **_range("side", (line["side_sd"] for line in fitted)),
            **_carried(results),
            **_shaped(results["blocks"]),
            **_held(results["ranges"]["books"]),
            field_beyond=100.0 * results["authume"]["field"]["beyond"],
            lucky=next(_off(x) for x in quarry if (x["model"], x["values"]) == (COULOMB_LIMITED.name, HOEK)),
            off=max(abs(_off(line)) for line in fitted),
            bar=tschamut.OTHER_CODE["translational"],
            field_sd=results["authume"]["field"]["sd"],
            field_side=results["authume"]["field"]["side_sd"],
        )
    )
    return f"## Can I trust a predicted runout?\n{words}"


def _off(line: Results) -> float:
    """Return mean x of a line at Authume minus mean x of the field (m)."""
    return float(line["mean"]) - authume.MEAN_X


def _range(name: str, values: Iterable[float]) -> dict[str, float]:
    """Return the lowest and the highest value, under the names that the text uses."""
    found = list(values)
    return {f"{name}_low": min(found), f"{name}_high": max(found)}


def _carried(results: Results) -> dict[str, str]:
    """Return the mean error (m) of values from another site, for each model, under the names that the text uses."""
    asked = {"at_meadow": ("authume", "tschamut"), "at_quarry": ("tschamut", "authume"),
             "impacts_quarry": ("chant_sura", "authume"), "impacts_meadow": ("chant_sura", "tschamut")}  # fmt: skip
    return {
        name: listed([f"{line[there]:+.0f}" for line in results["transfer"] if line["from"] == source])
        for name, (source, there) in asked.items()
    }


def _held(books: Iterable[Results]) -> dict[str, str]:
    """Return how many stops the intervals of library ranges hold at each site, under the names that the text uses."""
    lines = [line for line in books if line["ground"] == ranges.LIBRARY]
    across = min(lines, key=lambda line: float(line["across"]))
    along = {site: sorted({ranges.held(line, "along") for line in lines if line["site"] == site})
             for site in (ranges.AUTHUME, ranges.TSCHAMUT)}  # fmt: skip
    return {
        "held_quarry": listed(list(map(str, along[ranges.AUTHUME]))),
        "held_meadow": listed(list(map(str, along[ranges.TSCHAMUT]))),
        "held_across": ranges.held_of_all(across, "across"),
    }


def _shaped(blocks: Results) -> dict[str, float]:
    """Return the figures of rocks with a shape, under the names that the text uses."""
    quarry = blocks["authume"]["all"]
    return {
        "shaped_sd": quarry["sd"],
        "shaped_side": quarry["side_sd"],
        "shaped_beyond": 100.0 * quarry["beyond"],
        "shaped_meadow": blocks["tschamut"]["from_authume"]["error_mean"],
        "shaped_quarry": _off(blocks["authume"]["from_tschamut"]),
    }
