"""docs/validation.md from what was measured."""

from collections.abc import Sequence

from field_cases import authume, page_authume, page_chant_sura, page_tschamut, tschamut
from field_cases.measuring import CALIBRATED
from field_cases.page_tables import Results, listed, table
from field_cases.prose import HEAD, NO_SPHERE, NOT_VALIDATED, SOURCES_OF_DATA, TRANSFER, VERDICT, VERDICT_SPHERE
from field_cases.rows import ALL_ROWS, HOEK, PUBLISHED, SOURCES, STONE

SPHERE = "rigid sphere"
CHECKED = {"mean": "mean x", "ledge": "the ledge's share", "floor": "the floor's share"}


def document(results: Results) -> str:
    """The whole page."""
    flown = results["authume"]["calibrations"]
    missing = [] if len(flown) == len(ALL_ROWS) else [NO_SPHERE]
    parts = [
        HEAD, *missing, _in_short(results), _values_of_books(), page_authume.section(results["authume"]),
        page_tschamut.section(results["tschamut"]), page_chant_sura.section(results["chant_sura"]),
        _transfer(results["transfer"]), NOT_VALIDATED, SOURCES_OF_DATA,
    ]  # fmt: skip
    return "\n".join(parts)


def _in_short(results: Results) -> str:
    """One line for each model and site: what it reaches, what it misses."""
    lines = []
    for model in results["authume"]["calibrations"]:
        for site, says in (("authume", _short_authume), ("tschamut", _short_tschamut)):
            lines += [
                f"- **{model}, {line['values']}**, {site.capitalize()}: {says(line, results[site]['field'])}"
                for line in results[site]["lines"]
                if line["model"] == model
            ]
        lines.append(f"- **{model}**, Chant Sura: {_short_impacts(results['chant_sura'], model)}")
    said = "Line by line, with the rules of the sections below:\n\n"
    return f"## In short\n{_verdict(results)}\n{_verdict_of_sphere(results)}{said}" + "\n".join(lines) + "\n"


def _verdict(results: Results) -> str:
    """What the constant model's figures say; `test_validation_report` holds that they still say so."""
    quarry, meadow = results["authume"], results["tschamut"]
    here, there = ({line["values"]: line for line in site["lines"] if line["model"] == "constant"}
                   for site in (quarry, meadow))  # fmt: skip
    fitted = here[CALIBRATED]
    halves = [half["parameters"] for half in quarry["calibrations"]["constant"]["halves"]]
    elsewhere = {line["from"]: line for line in results["transfer"] if line["model"] == "constant"}
    edge = meadow["calibrations"]["constant"]["parameters"]["friction_angle_deg"]
    return VERDICT.format(
        hoek=here[HOEK]["mean"] - authume.MEAN_X, stone=here[STONE]["mean"] - authume.MEAN_X,
        hoek_meadow=there[HOEK]["error_mean"], stone_meadow=there[STONE]["error_mean"],
        off=fitted["mean"] - authume.MEAN_X, ledge=100 * fitted["sections"]["ledge"],
        floor=100 * fitted["sections"]["floor"],
        side=fitted["side_sd"], field_side=quarry["field"]["side_sd"], p95=fitted["percentiles"]["p95"],
        field_p95=quarry["field"]["percentiles"]["p95"], first=_triple(halves[0]), second=_triple(halves[1]),
        fitted_meadow=there[CALIBRATED]["error_mean"], edge=edge, correlation=there[CALIBRATED]["correlation"],
        at_meadow=elsewhere["authume"]["tschamut"],
        at_quarry=elsewhere["tschamut"]["authume"], impacts_quarry=elsewhere["chant_sura"]["authume"],
        impacts_meadow=elsewhere["chant_sura"]["tschamut"],
    )  # fmt: skip


def _verdict_of_sphere(results: Results) -> str:
    """The same of the rigid sphere, where it was measured."""
    if SPHERE not in results["authume"]["calibrations"]:
        return ""
    here, there = ({line["values"]: line for line in results[site]["lines"] if line["model"] == SPHERE}
                   for site in ("authume", "tschamut"))  # fmt: skip
    elsewhere = {line["from"]: line for line in results["transfer"] if line["model"] == SPHERE}
    said = VERDICT_SPHERE.format(
        book=here[HOEK]["mean"] - authume.MEAN_X, off=here[CALIBRATED]["mean"] - authume.MEAN_X,
        lost=100.0 * (1.0 - results["authume"]["calibrations"][SPHERE]["parameters"]["damping"]),
        side=here[CALIBRATED]["side_sd"], meadow=there[CALIBRATED]["error_mean"],
        absolute=there[CALIBRATED]["error_absolute"], correlation=there[CALIBRATED]["correlation"],
        at_meadow=elsewhere["authume"]["tschamut"], at_quarry=elsewhere["tschamut"]["authume"],
    )  # fmt: skip
    return said + "\n"


def _triple(parameters: Results) -> str:
    return "{normal_restitution:g}, {tangential_restitution:g} and {friction_angle_deg:g} degrees".format(**parameters)


def _short_authume(line: Results, field: Results) -> str:
    failed = [name for name, is_met in line["checks"].items() if not is_met]
    off = f"mean x {line['mean'] - authume.MEAN_X:+.1f} m"
    said = f"fails {listed([CHECKED[name] for name in failed])}" if failed else "meets mean x, ledge and floor"
    return f"{said} ({off}). Lateral spread {line['side_sd']:.1f} m where the field has {field['side_sd']:.1f} m."


def _short_tschamut(line: Results, _: Results) -> str:
    bar = abs(tschamut.OTHER_CODE["translational"])
    verb = "within" if abs(line["error_mean"]) < bar else "beyond"
    return f"mean runout error {line['error_mean']:+.1f} m, {verb} the {bar:g} m of another code, untuned."


def _short_impacts(results: Results, model: str) -> str:
    found, ratios = results["calibrations"][model], results["field"]["published"]
    off, kept_out = found["contacts"]["speed_rms"], found["kept_out"]["speed_rms"]
    return (
        f"calibrated on eleven contacts it is {off:.1f} m/s off their speeds, {kept_out:.1f} m/s where the run is kept "
        f"out; energy ratios of the six others are off by {found['published']['ratio_absolute']:.2f} of "
        f"{sum(ratios) / len(ratios):.2f} measured."
    )


def _values_of_books() -> str:
    """The published values, site by site."""
    lines = [
        (site.replace("_", " ").title(), source, zone, f"{v.R_n:g}", f"{v.R_t:g}", f"{v.friction_angle_deg:g}",
         f"{v.rolling_friction:g}")
        for site, sources in PUBLISHED.items() for source, zones in sources.items() for zone, v in zones.items()
    ]  # fmt: skip
    said = "\n".join(f"- *{name}*: {source}." for name, source in SOURCES.items())
    head = ("site", "values", "zone", "R_n", "R_t", "friction angle", "rolling friction (sphere only)")
    return f"## Published values\n{said}\n\n{table(head, lines)}"


def _transfer(lines: Sequence[Results]) -> str:
    head = ("model", "calibrated on", "Authume: mean x less 44.1 (m)", "Authume: distance of x (m)",
            "Tschamut: mean runout error (m)", "Chant Sura: energy ratio of the six, mean error")  # fmt: skip
    rows = []
    for line in lines:
        own = {"authume": (2, 3), "tschamut": (4,), "chant_sura": ()}[line["from"]]
        cells = [line["model"], line["from"].replace("_", " ").title(), f"{line['authume']:+.1f}",
                 f"{line['authume_distance']:.1f}", f"{line['tschamut']:+.1f}",
                 f"{line['chant_sura']:+.2f}"]  # fmt: skip
        rows.append([f"*{cell}*" if k in own else cell for k, cell in enumerate(cells)])
    return TRANSFER + "\n" + table(head, rows)
