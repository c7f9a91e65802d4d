"""Compare the two point models, so that a test can check the statements of `prose.DEFAULT`."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from field_cases import authume
from field_cases.measuring import CALIBRATED
from field_cases.page_tables import Results
from field_cases.rows import CONSTANT, COULOMB_LIMITED, SOURCES

SITES = ("authume", "tschamut")
Pair = tuple[float, float]


class Quantity(NamedTuple):
    """A quantity of both point models: constant first, Coulomb-limited second.

    field : value of the field, which both should have
    form : format of the cells
    """

    group: str
    name: str
    field: float
    found: Pair
    form: str = ".1f"

    def cells(self) -> list[str]:
        """Return the two figures in the format of the page."""
        return [f"{value:{self.form}}" for value in self.found]

    def target(self) -> str:
        """Return the value of the field in the format of the page."""
        return f"{self.field:{self.form}}" if self.field else "0"

    def better(self) -> str:
        """Return the model that is nearer to the field; a dash if the printed figures are equally near."""
        off = [abs(float(cell) - float(self.target())) for cell in self.cells()]
        if off[0] == off[1]:
            return "-"
        return (CONSTANT.name, COULOMB_LIMITED.name)[off[1] < off[0]]


def quantities(results: Results) -> Iterator[Quantity]:
    """Yield all quantities of the comparison; each figure is also in a table of the page."""
    yield from _kept_out(results)
    yield from _transferred(results)
    yield from _fitted_authume(results)
    yield from _fitted_tschamut(results)
    yield from _of_books(results)
    yield from _impacts(results["chant_sura"]["calibrations"])


def _kept_out(results: Results) -> Iterator[Quantity]:
    quarry, meadow = (results[site]["calibrations"] for site in SITES)
    for name, of, key in (
        ("Authume, distance of x (m)", quarry, "errors"),
        ("Authume, distance of lateral positions (m)", quarry, "side_errors"),
        ("Tschamut, mean absolute error of runout (m)", meadow, "errors"),
    ):
        for which, half in enumerate(("second", "first")):
            kept = _both(lambda model, of=of, key=key, which=which: of[model]["halves"][which][key][2 - which])
            yield Quantity("kept-out halves", f"{name}, {half} half", 0.0, kept)


def _transferred(results: Results) -> Iterator[Quantity]:
    lines = {(line["model"], line["from"]): line for line in results["transfer"]}
    field = results["authume"]["field"]
    for source, key, name, seen, form in (
        ("authume", "tschamut", "Authume's values at Tschamut: mean runout error (m)", 0.0, "+.1f"),
        ("authume", "tschamut_absolute", "Authume's values at Tschamut: mean absolute error (m)", 0.0, ".1f"),
        ("tschamut", "authume", "Tschamut's values at Authume: error of mean x (m)", 0.0, "+.1f"),
        ("tschamut", "authume_distance", "Tschamut's values at Authume: distance of x (m)", 0.0, ".1f"),
        ("tschamut", "authume_side_sd", "Tschamut's values at Authume: lateral sd (m)", field["side_sd"], ".1f"),
        ("chant_sura", "authume_distance", "Chant Sura's values at Authume: distance of x (m)", 0.0, ".1f"),
        ("chant_sura", "tschamut_absolute", "Chant Sura's values at Tschamut: mean absolute error (m)", 0.0, ".1f"),
    ):
        found = _both(lambda model, source=source, key=key: lines[model, source][key])
        yield Quantity("from site to site", name, seen, found, form)


def _fitted_authume(results: Results) -> Iterator[Quantity]:
    field, lines = results["authume"]["field"], _lines(results, "authume")
    fitted = "Authume, calibrated on all"
    for key, name in (("mean", "mean x (m)"), ("sd", "sd of x (m)"), ("side_sd", "lateral sd (m)"),
                      ("angle_sd", "sd of the reach angle (degrees)")):  # fmt: skip
        yield Quantity(fitted, name, field[key], _both(lambda model, key=key: lines[model, CALIBRATED][key]))
    yield Quantity(fitted, "95 % of x are below (m)", field["percentiles"]["p95"],
                   _both(lambda model: lines[model, CALIBRATED]["percentiles"]["p95"]))  # fmt: skip
    for key, name in (("errors", "distance of x (m)"), ("side_errors", "distance of lateral positions (m)")):
        yield Quantity(fitted, name, 0.0, _both(lambda model, key=key: lines[model, CALIBRATED][key][0]))


def _fitted_tschamut(results: Results) -> Iterator[Quantity]:
    field, lines = results["tschamut"]["field"], _lines(results, "tschamut")
    fitted = "Tschamut, calibrated on all"
    for key, name, seen, form in (
        ("error_mean", "mean runout error (m)", 0.0, "+.1f"),
        ("error_absolute", "mean absolute error (m)", 0.0, ".1f"),
        ("correlation", "correlation over runs", 1.0, "+.2f"),
        ("end_off", "mean end point off by (m)", 0.0, ".1f"),
        ("runout_sd", "sd of runout (m)", field["runout_sd"], ".1f"),
        ("side_sd", "lateral sd (m)", field["side_sd"], ".1f"),
    ):
        yield Quantity(fitted, name, seen, _both(lambda model, key=key: lines[model, CALIBRATED][key]), form)


def _of_books(results: Results) -> Iterator[Quantity]:
    quarry, meadow = (_lines(results, site) for site in SITES)
    for book in SOURCES:
        off = _both(lambda model, book=book: quarry[model, book]["mean"] - authume.MEAN_X)
        yield Quantity("books", f"Authume, {book}: error of mean x (m)", 0.0, off, "+.1f")
        error = _both(lambda model, book=book: meadow[model, book]["error_mean"])
        yield Quantity("books", f"Tschamut, {book}: mean runout error (m)", 0.0, error, "+.1f")


def _impacts(calibrations: Results) -> Iterator[Quantity]:
    kept = _both(lambda model: calibrations[model]["kept_out"]["speed_rms"])
    yield Quantity("Chant Sura", "speed after the eleven, each run kept out: rms error (m/s)", 0.0, kept, ".2f")
    six = _both(lambda model: calibrations[model]["published"]["ratio_absolute"])
    yield Quantity("Chant Sura", "energy ratio of the six: mean absolute error", 0.0, six, ".2f")


def _lines(results: Results, site: str) -> dict[tuple[str, str], Results]:
    """Return the lines of a site by model and values."""
    return {(line["model"], line["values"]): line for line in results[site]["lines"]}


def _both(figure: Callable[[str], float]) -> Pair:
    """Return a figure for the constant and for the Coulomb-limited model."""
    return figure(CONSTANT.name), figure(COULOMB_LIMITED.name)
