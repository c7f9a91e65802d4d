"""Measure everything for the validation page: figures for page and test, end points of rocks for the pictures."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from field_cases import authume, chant_sura, tschamut
from field_cases.flying import Ends
from field_cases.rows import CONSTANT, COULOMB_LIMITED, HOEK, PUBLISHED, SOURCES, Row, material, rows
from field_cases.search import Found, Free
from rpf3d_core.errors import InputError

CALIBRATED = "calibrated"
DECIMALS = 4
SENSITIVITY_STEPS = {
    "normal_restitution": 0.04,
    "tangential_restitution": 0.04,
    "friction_angle_deg": 2.0,
    "rolling_friction": 0.04,
}
"""Step of each parameter around its calibrated value: small enough that two experts may differ by it."""
LARGEST = {"friction_angle_deg": 89.0}
"""Upper bounds of parameters; 1 for all other parameters."""
SIDE_STEPS = (-2, -1, 0, 1, 2)
R_N_CURVES = (0.25, 0.40, 0.55)
Say = Callable[[str], None]


class Measured(NamedTuple):
    """The result of a measurement.

    results : figures by site, in the form of the JSON file
    ends : end points of each line of a site's table, by the label of the line
    """

    results: dict[str, Any]
    ends: dict[str, dict[str, Ends]]


def measured(say: Say) -> Measured:
    """Calibrate every model at every site, and fly the rocks for all tables of the page.

    Raises
    ------
    InputError
        The field data is not there.
    """
    for folder in (authume.DATA, tschamut.DATA, chant_sura.DATA):
        if not folder.is_dir():
            raise InputError(
                f"the field data is not there ({folder}); docs/explanation/validation.md names its sources"
            )
    ends: dict[str, dict[str, Ends]] = {"authume": {}, "tschamut": {}}
    results = {
        "authume": _flown("authume", authume, authume.field(), ends["authume"], say),
        "tschamut": _flown("tschamut", tschamut, tschamut.field_figures(), ends["tschamut"], say),
        "chant_sura": _impacts(say),
    }
    results["authume"]["sensitivity"] = _sensitivities(results["authume"]["calibrations"])
    say("sensitivity")
    results["transfer"] = _transfers(results)
    say("transfer")
    return Measured(rounded(results), ends)


def _flown(name: str, site: Any, field: dict[str, Any], ends: dict[str, Ends], say: Say) -> dict[str, Any]:
    """Calibrate and fly all models at Authume or Tschamut; return calibrations, and a line for each set of values."""
    calibrations: dict[str, Any] = {}
    lines = []
    for row in rows():
        first, second = site.halves()
        found = site.calibrate(row, sorted([*first, *second]))
        say(f"{name}, {row.name}: calibrated, {found.tried} sets of parameters")
        halves = [_half(row, site, site.calibrate(row, half)) for half in (first, second)]
        calibrations[row.name] = {**_calibration(row.free, found), "halves": halves}
        published = {source: row.published(name, source) for source in SOURCES}
        for values, keys in {**published, CALIBRATED: row.keys(found.parameters)}.items():
            figures, flown = site.simulated(keys)
            lines.append({"model": row.name, "values": values, **figures})
            ends[f"{row.name}, {values}"] = flown
            say(f"{name}, {row.name}, {values}")
    return {"field": field, "calibrations": calibrations, "lines": lines}


def _half(row: Row, site: Any, found: Found) -> dict[str, Any]:
    """Return a calibration on half of the data, with its errors on all data and on both halves."""
    figures, _ = site.simulated(row.keys(found.parameters))
    errors = {name: figures[name] for name in ("errors", "side_errors", "side_sd") if name in figures}
    return {**_calibration(row.free, found), **errors}


def _calibration(free: tuple[Free, ...], found: Found) -> dict[str, Any]:
    """Return the result of a search, and the parameters at the edge of the searched range."""
    at_edge = [one.name for one in free if found.parameters[one.name] in (one.low, one.high)]
    return {"parameters": found.parameters, "error": found.error, "tried": found.tried, "at_edge": at_edge}


def _impacts(say: Say) -> dict[str, Any]:
    """Return the results at Chant Sura: every rebound model with published values, and the calibrated models."""
    grounds = {source: chant_sura.surface(PUBLISHED["chant_sura"][source]["default"]) for source in SOURCES}
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
        say(f"chant_sura, {name}")
    return {
        "field": {
            "contacts": chant_sura.measured_ratios(chant_sura.contacts()).tolist(),
            "published": chant_sura.measured_ratios(chant_sura.published()).tolist(),
        },
        "lines": lines,
        "left_out": left_out,
        "calibrations": {row.name: _calibrated_impacts(row, say) for row in rows()},
    }


def _calibrated_impacts(row: Row, say: Say) -> dict[str, Any]:
    """Return a calibration on the eleven contacts, its check with each run kept out, and its errors on the six."""
    found = chant_sura.calibrate(row)
    model, ground = chant_sura.model_for(row, found.parameters), _surface_of(found.parameters)
    slope = found.parameters[chant_sura.SLOPE.name]
    say(f"chant_sura, {row.name}: calibrated")
    return {
        **_calibration((*row.at_impacts, chant_sura.SLOPE), found),
        "contacts": chant_sura.of_contacts(model, ground, slope),
        "kept_out": chant_sura.kept_out(row),
        "published": chant_sura.of_published(model, ground),
        "spinning": chant_sura.of_published(model, ground, chant_sura.SPIN),
    }


def _surface_of(parameters: Mapping[str, float]) -> Any:
    return chant_sura.calibrated_surface(PUBLISHED["chant_sura"][HOEK]["default"], parameters)


def _sensitivities(calibrations: Mapping[str, Any]) -> dict[str, Any]:
    """Return mean x at Authume for values around the calibrated ones; for point models also over R_t."""
    found: dict[str, Any] = {"curves": {}}
    for row in rows():
        about, of_row = calibrations[row.name]["parameters"], {}
        for one in row.free:
            step = SENSITIVITY_STEPS[one.name]
            most = LARGEST.get(one.name, 1.0)
            values = tuple(min(max(round(about[one.name] + k * step, 3), 0.0), most) for k in SIDE_STEPS)
            of_row[one.name] = {"values": values, "mean": authume.sensitivity(row, about, one.name, values)}
        found[row.name] = of_row
    for row in (CONSTANT, COULOMB_LIMITED):
        about = calibrations[row.name]["parameters"]
        found["curves"][row.name] = {
            f"{R_n:.2f}": authume.sensitivity(
                row, {**about, "normal_restitution": R_n}, "tangential_restitution", authume.STEPS_OF_R_T
            )
            for R_n in R_N_CURVES
        }
    return found


def _transfers(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the errors at all three sites of values that were calibrated at one site."""
    lines = []
    for row in rows():
        for site in ("authume", "tschamut", "chant_sura"):
            parameters = results[site]["calibrations"][row.name]["parameters"]
            quarry, _ = authume.simulated(row.keys(_completed(row, parameters, "authume")))
            meadow, _ = tschamut.simulated(row.keys(_completed(row, parameters, "tschamut")))
            impacts = chant_sura.of_published(chant_sura.model_for(row, parameters), _surface_of(parameters))
            lines.append({
                "model": row.name, "from": site, "authume": quarry["mean"] - authume.MEAN_X,
                "authume_distance": quarry["errors"][0], "authume_side_sd": quarry["side_sd"],
                "tschamut": meadow["error_mean"], "tschamut_absolute": meadow["error_absolute"],
                "chant_sura": impacts["ratio_mean"], "chant_sura_absolute": impacts["ratio_absolute"],
            })  # fmt: skip
    return lines


def _completed(row: Row, parameters: Mapping[str, float], site: str) -> dict[str, float]:
    """Return the parameters of a row, completed by published values of the site's first zone.

    Single impacts calibrate only some of the parameters.
    """
    values = material(next(iter(PUBLISHED[site][HOEK].values())))
    return {one.name: parameters[one.name] if one.name in parameters else values[one.name] for one in row.free}


def rounded(value: Any) -> Any:
    """Round all figures in a nested result, for the file of results."""
    if isinstance(value, float):
        return round(value, DECIMALS)
    if isinstance(value, Mapping):
        return {key: rounded(item) for key, item in value.items()}
    return [rounded(item) for item in value] if isinstance(value, list | tuple) else value
