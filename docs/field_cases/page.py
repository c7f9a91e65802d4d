"""docs/validation.md from what was measured."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from field_cases import authume, tschamut
from field_cases.measuring import CALIBRATED
from field_cases.prose import (
    AUTHUME,
    CHANT_SURA,
    CHANT_SURA_FAILS,
    HEAD,
    NO_SPHERE,
    NOT_VALIDATED,
    SOURCES_OF_DATA,
    TRANSFER,
    TSCHAMUT,
)
from field_cases.rows import ALL_ROWS, PUBLISHED, SOURCES

Results = Mapping[str, Any]


def document(results: Results) -> str:
    """The whole page."""
    flown = results["authume"]["calibrations"]
    missing = [] if len(flown) == len(ALL_ROWS) else [NO_SPHERE]
    parts = [
        HEAD, *missing, _in_short(results), _values_of_books(), _authume(results["authume"]),
        _tschamut(results["tschamut"]), _chant_sura(results["chant_sura"]), _transfer(results["transfer"]),
        NOT_VALIDATED, SOURCES_OF_DATA,
    ]  # fmt: skip
    return "\n".join(parts)


def table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    rule = ["---"] * len(head)
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, rule, *lines)) + "\n"


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
    return "## In short\n" + "\n".join(lines) + "\n"


def _short_authume(line: Results, field: Results) -> str:
    failed = [name for name, is_met in line["checks"].items() if not is_met]
    off = f"mean x {line['mean'] - authume.MEAN_X:+.1f} m"
    said = f"fails {_listed(failed)} ({off})." if failed else f"meets mean x, ledge and floor ({off})."
    return f"{said} Lateral spread {line['side_sd']:.1f} m where the field has {field['side_sd']:.1f} m."


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


def _listed(names: Sequence[str]) -> str:
    full = {"mean": "mean x", "ledge": "the ledge's share", "floor": "the floor's share"}
    return ", ".join(full[name] for name in names)


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


def _authume(results: Results) -> str:
    field, lines = results["field"], results["lines"]
    return "\n".join([
        AUTHUME,
        _searched(results["calibrations"], "m from the field's x"),
        "![Authume](pictures/validation_authume.png)\n",
        _stops(field, lines),
        _shares(field, lines),
        "How far x of ends lies from the field's (Wasserstein's distance, m: how far the mean rock is to be moved); "
        f"two random halves of the blocks are {field['distance_of_halves']:.1f} m from each other.\n",
        _halves(results, ("all 41", "first half, 21", "second half, 20")),
        _checks(lines),
        "### What a few hundredths of a coefficient do\n"
        "Mean x of ends (m) as one parameter takes five values about its calibrated one:\n",
        _sensitivity(results["sensitivity"]),
        _curves(results["sensitivity"]["curves"]),
    ])  # fmt: skip


def _searched(calibrations: Results, unit: str) -> str:
    """What each search found."""
    names = {
        "normal_restitution": "R_n", "tangential_restitution": "R_t", "friction_angle_deg": "friction angle",
        "rolling_friction": "rolling friction", "damping": "damping", "slope_deg": "slope (degrees)",
    }  # fmt: skip
    said = []
    for model, found in calibrations.items():
        values = ", ".join(f"{names[name]} {value:g}" for name, value in found["parameters"].items())
        edge = ", ".join(names[name] for name in found["at_edge"])
        said.append(f"- calibrated, {model}: {values} ({found['error']:.2f} {unit}; {found['tried']} sets tried).")
        for which, half in zip(("first", "second"), found.get("halves", ()), strict=False):
            said[-1] += f" On the {which} half: {', '.join(f'{value:g}' for value in half['parameters'].values())}."
        said[-1] += f" **At the edge of what was searched: {edge}.**" if edge else ""
    return "\n".join(said) + "\n"


def _stops(field: Results, lines: Sequence[Results]) -> str:
    percentiles = list(field["percentiles"])
    head = ("x of ends (m)", "mean", "sd", *percentiles)
    rows = [
        ("**field, 41 blocks**", f"{field['mean']:.1f} ({_range(field['mean_interval'])})",
         f"{field['sd']:.1f} ({_range(field['sd_interval'])})",
         *(f"{field['percentiles'][p]:.1f} ({_range(field['percentile_intervals'][p])})" for p in percentiles)),
        *((_label(line), f"{line['mean']:.1f}", f"{line['sd']:.1f}",
           *(f"{line['percentiles'][p]:.1f}" for p in percentiles)) for line in lines),
    ]  # fmt: skip
    return table(head, rows)


def _shares(field: Results, lines: Sequence[Results]) -> str:
    head = ("share (%)", "upper slope, x < 30", "ledge, 30 to 45", "floor, > 45", "lateral mean (m)", "lateral sd (m)",
            "reach angle (degrees)", "not at rest there (%)")  # fmt: skip
    intervals = field["section_intervals"]
    rows = [
        ("**field**", *(f"{100 * share:.0f} ({_range([100 * v for v in intervals[name]], 0)})"
                        for name, share in field["sections"].items()),
         f"{field['side_mean']:+.1f}", f"{field['side_sd']:.1f} ({_range(field['side_sd_interval'])})",
         f"{field['angle_mean']:.1f} ± {field['angle_sd']:.1f}", ""),
        *((_label(line), *(f"{100 * share:.0f}" for share in line["sections"].values()), f"{line['side_mean']:+.1f}",
           f"{line['side_sd']:.1f}", f"{line['angle_mean']:.1f} ± {line['angle_sd']:.1f}", f"{100 * line['left']:.0f}")
          for line in lines),
    ]  # fmt: skip
    return table(head, rows)


def _halves(results: Results, columns: Sequence[str]) -> str:
    """Errors on all data and on its halves, with what is calibrated on a half; what was kept out is set in bold."""
    rows = [[_label(line), *(f"{error:.1f}" for error in line["errors"])] for line in results["lines"]]
    for model, found in results["calibrations"].items():
        for which, half in enumerate(found["halves"]):
            cells = [f"{error:.1f}" for error in half["errors"]]
            cells[2 - which] = f"**{cells[2 - which]}**"
            rows.append([f"{model}, calibrated on the {('first', 'second')[which]} half", *cells])
    return table(("kept out in bold", *columns), rows)


def _checks(lines: Sequence[Results]) -> str:
    head = ("check against all 41", "mean x 44.1 ± 5 m", "ledge 51 ± 15 points", "floor 44 ± 15 points")
    rows = [(_label(line), *("met" if line["checks"][name] else "**failed**" for name in ("mean", "ledge", "floor")))
            for line in lines]  # fmt: skip
    return table(head, rows)


def _sensitivity(sensitivity: Results) -> str:
    rows = [
        (model, name, *(f"{mean:.1f} ({value:g})" for value, mean in zip(one["values"], one["mean"], strict=True)))
        for model, parameters in sensitivity.items() if model != "curves"
        for name, one in parameters.items()
    ]  # fmt: skip
    return table(("model", "parameter", "two steps down", "one", "calibrated", "one", "two steps up"), rows)


def _curves(curves: Results) -> str:
    rows = [(f"R_n {R_n}", *(f"{mean:.1f}" for mean in means)) for R_n, means in curves.items()]
    said = "The constant model at its calibrated friction angle, mean x (m):\n\n"
    return said + table(("", *(f"R_t {R_t:g}" for R_t in authume.STEPS_OF_R_T)), rows)


def _tschamut(results: Results) -> str:
    field, bar = results["field"], tschamut.OTHER_CODE
    head = ("runout, simulated less seen (m)", "mean", "mean absolute", "correlation over runs",
            "mean end off by (m)", "not at rest there (%)")  # fmt: skip
    rows = [
        *((f"another code, {name}, untuned, survey of 2 m", f"{value:+.1f}", *[""] * 4) for name, value in bar.items()),
        *((_label(line), f"{line['error_mean']:+.1f} ({_range(line['error_interval'], 0, '+')})",
           f"{line['error_absolute']:.1f}",
           f"{line['correlation']:+.2f}", f"{line['end_off']:.1f}", f"{100 * line['left']:.0f}")
          for line in results["lines"]),
    ]  # fmt: skip
    said = (
        f"{field['runs']} runs, {field['distinct']} distinct; runout {field['runout_mean']:.1f} ± "
        f"{field['runout_sd']:.1f} m, reach angle {field['angle_mean']:.1f} ± {field['angle_sd']:.1f} degrees.\n"
    )
    found = _searched(results["calibrations"], "m mean absolute error")
    halves = "Mean absolute error of runout (m):\n\n"
    halves += _halves(results, ("all 17 distinct runs", "first half, 9", "second half, 8"))
    picture = "![Tschamut](pictures/validation_tschamut.png)\n"
    return "\n".join([TSCHAMUT, said, found, picture, table(head, rows), halves])


def _chant_sura(results: Results) -> str:
    parts = [
        CHANT_SURA,
        CHANT_SURA_FAILS,
        "![Chant Sura](pictures/validation_chant_sura.png)\n",
        _six(results),
        _eleven(results["lines"]),
        _calibrated_impacts(results["calibrations"]),
    ]
    if results["left_out"]:
        names = ", ".join(f"`{name}`" for name in results["left_out"])
        parts.append(f"No row: {names}, whose figures are its user's own.\n")
    return "\n".join(parts)


def _six(results: Results) -> str:
    head = ("energy ratio of the six", *("2.1", "2.2", "2.3", "4.1", "4.2", "4.3"), "mean error", "mean absolute error",
            "speed after, mean error (m/s)", "rms (m/s)", "mean absolute error of the ratio at 27 rad/s")  # fmt: skip
    rows = [("**field**", *(f"{ratio:.2f}" for ratio in results["field"]["published"]), *[""] * 5)]
    calibrated = [
        {"model": model, "values": "calibrated on the eleven", **found}
        for model, found in results["calibrations"].items()
    ]
    for line in [*results["lines"], *calibrated]:
        six = line["published"]
        rows.append((_label(line), *(f"{ratio:.2f}" for ratio in six["ratios"]), f"{six['ratio_mean']:+.2f}",
                     f"{six['ratio_absolute']:.2f}", f"{six['speed_mean']:+.1f}", f"{six['speed_rms']:.1f}",
                     f"{line['spinning']['ratio_absolute']:.2f}"))  # fmt: skip
    return table(head, rows)


def _eleven(lines: Sequence[Results]) -> str:
    slopes = list(lines[0]["contacts"])
    head = ("eleven contacts", *(f"velocity off (m/s), slope {slope}" for slope in slopes),
            *(f"speed after, mean error (m/s), slope {slope}" for slope in slopes),
            *(f"energy ratio, mean error, slope {slope}" for slope in slopes))  # fmt: skip
    rows = [
        (_label(line), *(f"{line['contacts'][slope]['velocity']:.1f}" for slope in slopes),
         *(f"{line['contacts'][slope]['speed_mean']:+.1f}" for slope in slopes),
         *(f"{line['contacts'][slope]['ratio_mean']:+.2f}" for slope in slopes))
        for line in lines
    ]  # fmt: skip
    return table(head, rows)


def _calibrated_impacts(calibrations: Results) -> str:
    head = ("calibrated on the eleven", "speed after, rms (m/s)", "the same, each run kept out",
            "speed after, mean error (m/s)", "velocity off (m/s)", "energy ratio, mean absolute error")  # fmt: skip
    rows = [
        (model, f"{found['contacts']['speed_rms']:.2f}", f"{found['kept_out']['speed_rms']:.2f}",
         f"{found['contacts']['speed_mean']:+.2f}", f"{found['contacts']['velocity']:.2f}",
         f"{found['contacts']['ratio_absolute']:.2f}")
        for model, found in calibrations.items()
    ]  # fmt: skip
    return _searched(calibrations, "m/s off the eleven speeds") + "\n" + table(head, rows)


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


def _label(line: Results) -> str:
    values = line["values"]
    return f"{line['model']}, **{values}**" if values == CALIBRATED else f"{line['model']}, {values}"


def _range(interval: Sequence[float], decimals: int = 1, sign: str = "") -> str:
    low, high = (f"{value:{sign}.{decimals}f}" for value in interval)
    return f"{low} to {high}"
