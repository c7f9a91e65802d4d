"""The section "In short" of docs/explanation/validation.md: what the figures say of each model."""

from field_cases import authume, tschamut
from field_cases.measuring import CALIBRATED
from field_cases.page_tables import Results, listed, wrapped
from field_cases.prose import VERDICT, VERDICT_LIMITED, VERDICT_SPHERE
from field_cases.rows import CONSTANT, COULOMB_LIMITED, HOEK, STONE

SPHERE = "rigid sphere"
CHECKED = {"mean": "mean x", "ledge": "the ledge's share", "floor": "the floor's share"}


def section(results: Results) -> str:
    """Return the words on each model, and one line for each model, values and site."""
    words = [
        wrapped(VERDICT.format(**_of(results, CONSTANT.name))),
        wrapped(VERDICT_LIMITED.format(**_of(results, COULOMB_LIMITED.name))),
        wrapped(VERDICT_SPHERE.format(**_of(results, SPHERE))),
    ]
    head = "Row by row, with the rules of the sections below:\n"
    return "\n".join(["## In short", "\n".join(words), head, *_lines(results)]) + "\n"


def _of(results: Results, model: str) -> dict[str, object]:
    """Return the figures that the words on a model quote, by name."""
    quarry, meadow = results["authume"], results["tschamut"]
    here, there = ({line["values"]: line for line in site["lines"] if line["model"] == model}
                   for site in (quarry, meadow))  # fmt: skip
    found, there_found = (site["calibrations"][model] for site in (quarry, meadow))
    elsewhere = {line["from"]: line for line in results["transfer"] if line["model"] == model}
    fitted, field = here[CALIBRATED], quarry["field"]
    return {
        **found["parameters"],
        "hoek": here[HOEK]["mean"] - authume.MEAN_X, "stone": here[STONE]["mean"] - authume.MEAN_X,
        "hoek_meadow": there[HOEK]["error_mean"], "stone_meadow": there[STONE]["error_mean"],
        "off": fitted["mean"] - authume.MEAN_X, "sd": fitted["sd"], "field_sd": field["sd"],
        "ledge": 100.0 * fitted["sections"]["ledge"], "floor": 100.0 * fitted["sections"]["floor"],
        "side": fitted["side_sd"], "field_side": field["side_sd"], "low_side": field["side_sd_interval"][0],
        "high_side": field["side_sd_interval"][1],
        "p95": fitted["percentiles"]["p95"], "field_p95": field["percentiles"]["p95"],
        "first": _parameters(found["halves"][0]), "second": _parameters(found["halves"][1]),
        "first_kept": found["halves"][0]["errors"][2], "second_kept": found["halves"][1]["errors"][1],
        "meadow": there[CALIBRATED]["error_mean"], "absolute": there[CALIBRATED]["error_absolute"],
        "correlation": there[CALIBRATED]["correlation"],
        "at_meadow": elsewhere["authume"]["tschamut"], "at_quarry": elsewhere["tschamut"]["authume"],
        "impacts_quarry": elsewhere["chant_sura"]["authume"], "impacts_meadow": elsewhere["chant_sura"]["tschamut"],
        "distance": fitted["errors"][0], "carried": elsewhere["authume"]["tschamut_absolute"],
        **_named(found["halves"][0], "first"), **_named(found["halves"][1], "second"),
        **_named(there_found, "meadow"), "second_R_n": there_found["halves"][1]["parameters"]["normal_restitution"],
        **_named(results["chant_sura"]["calibrations"][model], "impacts"),
    }  # fmt: skip


def _named(found: Results, prefix: str) -> dict[str, float]:
    """Return what was calibrated, by short names behind a prefix."""
    short = {"normal_restitution": "R_n", "friction_angle_deg": "friction", "rolling_friction": "rolling"}
    return {f"{prefix}_{short[name]}": value for name, value in found["parameters"].items() if name in short}


def _parameters(half: Results) -> str:
    return listed([f"{value:g}" for value in half["parameters"].values()])


def _lines(results: Results) -> list[str]:
    """Return a bullet for each model, values and site: what is reached and what is missed."""
    lines = []
    for model in results["authume"]["calibrations"]:
        for site, says in (("authume", _short_authume), ("tschamut", _short_tschamut)):
            lines += [
                f"- **{model}, {line['values']}**, {site.capitalize()}: {says(line, results[site]['field'])}"
                for line in results[site]["lines"]
                if line["model"] == model
            ]
        lines.append(f"- **{model}**, Chant Sura: {_short_impacts(results['chant_sura'], model)}")
    return lines


def _short_authume(line: Results, field: Results) -> str:
    failed = [name for name, is_met in line["checks"].items() if not is_met]
    off = f"mean x {line['mean'] - authume.MEAN_X:+.1f} m"
    said = f"fails {listed([CHECKED[name] for name in failed])}" if failed else "meets mean x, ledge and floor"
    return f"{said} ({off}). Lateral spread {line['side_sd']:.1f} m; field {field['side_sd']:.1f} m."


def _short_tschamut(line: Results, _: Results) -> str:
    bar = abs(tschamut.OTHER_CODE["translational"])
    verb = "within" if abs(line["error_mean"]) < bar else "beyond"
    return f"mean runout error {line['error_mean']:+.1f} m, {verb} the {bar:g} m of another code, untuned."


def _short_impacts(results: Results, model: str) -> str:
    found, ratios = results["calibrations"][model], results["field"]["published"]
    off, kept_out = found["contacts"]["speed_rms"], found["kept_out"]["speed_rms"]
    return (
        f"calibrated on eleven contacts, {off:.1f} m/s off their speeds, {kept_out:.1f} m/s where the run is kept out; "
        f"energy ratios of the six others off by {found['published']['ratio_absolute']:.2f} of "
        f"{sum(ratios) / len(ratios):.2f} measured."
    )
