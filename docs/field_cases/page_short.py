"""Build the first section of docs/explanation/validation.md: the conclusion, with ranges of figures of all models."""

from collections.abc import Iterable
from typing import Any

from field_cases import authume, predictions, tschamut
from field_cases.models import AUTHUME, CALIBRATED, POINTS_AND_SPHERES, SHAPES, TSCHAMUT
from field_cases.page_elsewhere import error_of
from field_cases.page_tables import Results, listed, wrapped
from field_cases.prose import VERDICT

PLAIN = [model.name for model in POINTS_AND_SPHERES]


def section(results: Results) -> str:
    """Return the section on the trust in a predicted runout as Markdown."""
    words = VERDICT.format(
        **_of_books(results),
        **_spreads(results),
        **_kept_out(results),
        **_elsewhere(results["elsewhere"]),
        **_of_library(results["library"]),
        impacts_quarry=_errors(line[AUTHUME] for line in results["impacts"]),
        impacts_meadow=_errors(line[TSCHAMUT] for line in results["impacts"]),
        bar=tschamut.OTHER_CODE["point mass"],
        bar_sphere=tschamut.OTHER_CODE["sphere"],
    )
    return f"## Can I trust a predicted runout?\n{wrapped(words)}"


def _of_books(results: Results) -> dict[str, float]:
    """Return the range of the errors (m) with published values at each site, by their names in VERDICT."""
    quarry = [line["mean"] - authume.MEAN_X for line in results[AUTHUME]["lines"] if line["values"] != CALIBRATED]
    meadow = [line["error_mean"] for line in results[TSCHAMUT]["lines"] if line["values"] != CALIBRATED]
    return {"book_low": min(quarry), "book_high": max(quarry), "meadow_low": min(meadow), "meadow_high": max(meadow)}


def _spreads(results: Results) -> dict[str, float]:
    """Return the spreads (m) of calibrated rocks and of the field, by their names in VERDICT."""
    fitted = {line["model"]: line for line in results[AUTHUME]["lines"] if line["values"] == CALIBRATED}
    sides = [fitted[name]["side_sd"] for name in PLAIN]
    shaped = next(line for line in results[TSCHAMUT]["lines"] if line["model"] == SHAPES.name)
    return {
        "meadow_along": shaped["runout_sd"], "field_along": results[TSCHAMUT]["field"]["runout_sd"],
        "side_low": min(sides), "side_high": max(sides), "shaped_side": fitted[SHAPES.name]["side_sd"],
        "field_side": results[AUTHUME]["field"]["side_sd"],
    }  # fmt: skip


def _kept_out(results: Results) -> dict[str, Any]:
    """Return the numbers of kept-out stops in the intervals of calibrations, by their names in VERDICT."""
    gain = results[AUTHUME]["calibrations"][SHAPES.name]["gain"]
    found: dict[str, Any] = {"gain": gain["over_curve"], "doubt": gain["standard_error"]}
    for site, short in ((AUTHUME, "quarry"), (TSCHAMUT, "meadow")):
        kept = {name: {"site": site, **of["kept_out"]} for name, of in results[site]["calibrations"].items()}
        across = [predictions.held(kept[name], "across") for name in PLAIN]
        found |= {f"across_{short}_low": min(across), f"across_{short}_high": max(across)}
        found |= {f"shaped_{way}_{short}": predictions.held_of_all(kept[SHAPES.name], way)
                  for way in ("along", "across")}  # fmt: skip
    return found


def _elsewhere(lines: Iterable[Results]) -> dict[str, str]:
    """Return errors (m) and numbers of stops in intervals, with the ground of the other slope, by names in VERDICT."""
    found = {}
    for site, short in ((AUTHUME, "quarry"), (TSCHAMUT, "meadow")):
        there = [line for line in lines if line["site"] == site]
        found[f"at_{short}"] = _errors(error_of(line) for line in there)
        found[f"held_at_{short}"] = listed([str(predictions.held(line, "along")) for line in there])
    return found


def _errors(errors: Iterable[float]) -> str:
    return listed([f"{error:+.0f}" for error in errors])


def _of_library(lines: Iterable[Results]) -> dict[str, str]:
    """Return the numbers of stops in intervals with library ranges at each site, by their names in VERDICT."""
    of = [line for line in lines if line["ground"] == predictions.LIBRARY]
    across = min(of, key=lambda line: float(line["across"]))
    along = {site: sorted({predictions.held(line, "along") for line in of if line["site"] == site})
             for site in (AUTHUME, TSCHAMUT)}  # fmt: skip
    return {
        "library_quarry": listed(list(map(str, along[AUTHUME]))),
        "library_meadow": listed(list(map(str, along[TSCHAMUT]))),
        "library_across": predictions.held_of_all(across, "across"),
    }
