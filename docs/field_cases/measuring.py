"""Measure everything for the validation page: figures for page and tests, and end points of rocks for the pictures."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from field_cases import authume, calibrations, chant_sura, predictions, tschamut
from field_cases.flying import Ends
from field_cases.models import (
    AUTHUME,
    CALIBRATED,
    CHANT_SURA,
    HOEK,
    POINTS_AND_SPHERES,
    PUBLISHED,
    SOURCES,
    TSCHAMUT,
    Model,
    material,
)
from field_cases.search import Found, Free
from rpf3d_core.errors import InputError

DECIMALS = 5
SITES = {AUTHUME: authume, TSCHAMUT: tschamut}
Say = Callable[[str], None]


class Measured(NamedTuple):
    """The result of a measurement.

    results : figures, as in the file of results; ends : end points by site and label of a line (`label`)
    """

    results: dict[str, Any]
    ends: dict[str, dict[str, Ends]]


def label(line: Mapping[str, Any]) -> str:
    """Return the label of a line in a site's table: its model, and where its values come from."""
    return f"{line['model']}, {line['values']}"


def measured(folder: Path, say: Say) -> Measured:
    """Calibrate every model at every site, and fly the rocks for all tables of the page.

    folder : receives the results of `rpf3d calibrate`; calibrations with a result in it are not repeated
    say : called with a line of text on the progress

    Raises
    ------
    InputError
        The field data is not there.
    """
    for site in (authume, tschamut, chant_sura):
        if not site.DATA.is_dir():
            raise InputError(
                f"the field data is not there ({site.DATA}); docs/explanation/validation.md names its sources"
            )
    of_sites: dict[str, Any] = rounded(calibrations.calibrate(folder, say))
    ends: dict[str, dict[str, Ends]] = {AUTHUME: {}, TSCHAMUT: {}}
    lines = {site: [*_of_books(site, ends[site], say)] for site in SITES}
    for case in predictions.cases_of_calibrations(of_sites, same_site=True):
        line, rocks = _line(case, say)
        lines[case.site].append({**line, "values": CALIBRATED})
        ends[case.site][label(lines[case.site][-1])] = rocks
    fields = {AUTHUME: authume.field(), TSCHAMUT: tschamut.field_figures()}
    results = {site: {"field": fields[site], "lines": lines[site], "calibrations": of_sites[site]} for site in SITES}
    results["elsewhere"] = [_line(case, say)[0] for case in predictions.cases_of_calibrations(of_sites, False)]
    results["library"] = [_line(case, say)[0] for case in predictions.cases_of_books()]
    results[CHANT_SURA] = _impacts(say)
    results["impacts"] = [_carried_impacts(model, results[CHANT_SURA]) for model in POINTS_AND_SPHERES]
    return Measured(rounded(results), ends)


def _of_books(site: str, ends: dict[str, Ends], say: Say) -> Iterator[dict[str, Any]]:
    """Yield a line of a site's table for each model and source of published values, and store its end points in `ends`.
    """
    for model in POINTS_AND_SPHERES:
        for source in SOURCES:
            say(f"{site}, {model.name}, {source}")
            figures, flown = SITES[site].simulated(model.published(site, source))
            line = {"model": model.name, "values": source, **figures}
            ends[label(line)] = flown
            yield line


def _line(case: predictions.Case, say: Say) -> tuple[dict[str, Any], Ends]:
    """Fly the rocks of a prediction; return the line of the table with its figures, and the end points."""
    say(f"{case.site}, {case.model.name}, {case.ground}")
    rocks = predictions.predicted(case)
    named = {"site": case.site, "model": case.model.name, "ground": case.ground}
    return {**named, **predictions.figures_of(case.site, rocks)}, rocks.ends


def calibration(free: tuple[Free, ...], found: Found) -> dict[str, Any]:
    """Return the result of a search by name, with the names of the parameters at the edge of the searched range."""
    at_edge = [one.name for one in free if found.parameters[one.name] in (one.low, one.high)]
    return {"parameters": found.parameters, "error": found.error, "tried": found.tried, "at_edge": at_edge}


def _impacts(say: Say) -> dict[str, Any]:
    """Return the results at Chant Sura: of every rebound model with published values, and of the calibrated models."""
    grounds = {source: chant_sura.surface(PUBLISHED[CHANT_SURA][source]["default"]) for source in SOURCES}
    lines, left_out = [], []
    for name, model in chant_sura.all_models().items():
        if model is None:
            left_out.append(name)
            continue
        for source, ground in grounds.items():
            contacts = {f"{slope:g}": chant_sura.of_contacts(model, ground, slope) for slope in chant_sura.SLOPES}
            published = chant_sura.of_published(model, ground)
            spinning = chant_sura.of_published(model, ground, chant_sura.SPIN)
            lines.append({"model": name, "values": source, "contacts": contacts, "published": published,
                          "spinning": spinning})  # fmt: skip
        say(f"{CHANT_SURA}, {name}")
    return {
        "field": {
            "contacts": chant_sura.measured_ratios(chant_sura.contacts()).tolist(),
            "published": chant_sura.measured_ratios(chant_sura.published()).tolist(),
        },
        "lines": lines,
        "left_out": left_out,
        "calibrations": {model.name: _calibrated_impacts(model, say) for model in POINTS_AND_SPHERES},
    }


def _calibrated_impacts(model: Model, say: Say) -> dict[str, Any]:
    """Calibrate a model on the eleven contacts; return the result, and its errors on contacts and published impacts.

    `kept_out` has the error if each run is kept out of the calibration in turn.
    """
    found = chant_sura.calibrate(model)
    rebound, ground = chant_sura.model_of(model.impact), _surface_of(found.parameters)
    slope = found.parameters[chant_sura.SLOPE.name]
    say(f"{CHANT_SURA}, {model.name}: calibrated")
    return {
        **calibration((*model.at_impacts, chant_sura.SLOPE), found),
        "contacts": chant_sura.of_contacts(rebound, ground, slope),
        "kept_out": chant_sura.kept_out(model),
        "published": chant_sura.of_published(rebound, ground),
        "spinning": chant_sura.of_published(rebound, ground, chant_sura.SPIN),
    }


def _surface_of(parameters: Mapping[str, float]) -> Any:
    return chant_sura.calibrated_surface(PUBLISHED[CHANT_SURA][HOEK]["default"], parameters)


def _carried_impacts(model: Model, impacts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the errors (m) of a model at both slopes with coefficients that were calibrated on the eleven contacts.

    Contacts calibrate two coefficients; the others have the published values of the site's first zone.
    """
    found = {one.name: impacts["calibrations"][model.name]["parameters"][one.name] for one in model.at_impacts}
    line: dict[str, Any] = {"model": model.name}
    for site, of in SITES.items():
        values = material(next(iter(PUBLISHED[site][HOEK].values()))) | found
        figures, _ = of.simulated({**model.keys(), "materials": {"default": values}})
        line[site] = figures["mean"] - authume.MEAN_X if site == AUTHUME else figures["error_mean"]
    return line


def rounded(value: Any) -> Any:
    """Return a nested result with all floats rounded to DECIMALS, for the file of results."""
    if isinstance(value, float):
        return round(value, DECIMALS)
    if isinstance(value, Mapping):
        return {key: rounded(item) for key, item in value.items()}
    return [rounded(item) for item in value] if isinstance(value, list | tuple) else value
