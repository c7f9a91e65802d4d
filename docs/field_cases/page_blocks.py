"""Build the section of docs/explanation/validation.md on rocks with a shape from the file of results."""

from collections.abc import Sequence

from field_cases.blocks import meadow, quarry
from field_cases.blocks import race as races
from field_cases.measuring import CALIBRATED
from field_cases.page_tables import NAMES, Results, interval_of, table, wrapped
from field_cases.prose_blocks import AT_IMPACTS, AT_MEADOW, AT_QUARRY, BARS, BLOCKS, BLOCKS_FAIL, PER_BLOCK, PER_SHAPE

POINT, SPHERE = "Coulomb-limited", "rigid sphere"
BODIES = "rocks with a shape"
MODELS = ("constant", POINT, SPHERE)


def section(results: Results) -> str:
    """Return the section on rocks with a shape as Markdown, next to point and sphere."""
    blocks = results["blocks"]
    return "\n".join([
        BLOCKS, _grids(),
        AT_QUARRY, _found(blocks["authume"]), "![Rocks with a shape](../pictures/validation_blocks.png)\n",
        _stops(results), BARS, _bars(results), _halves(results),
        PER_SHAPE, _shapes(blocks["authume"]), PER_BLOCK, _per_block(blocks["authume"]["variants"]),
        AT_MEADOW, _found(blocks["tschamut"]), _runouts(results), _by_block(blocks["tschamut"]["by_block"]),
        AT_IMPACTS, _found(blocks["chant_sura"]), _impacts(results),
        BLOCKS_FAIL,
    ])  # fmt: skip


def _grids() -> str:
    """Return the table of the searched values and rounds."""
    lines = [
        (site, *(f"{one.low:g} to {one.high:g}, {one.values}" for one in free), _rounds(rounds), unit)
        for site, free, rounds, unit in (
            ("Authume", quarry.FREE, quarry.ROUNDS, "rocks"),
            ("Tschamut", meadow.FREE, meadow.ROUNDS, "rocks of each run"),
        )
    ]
    head = ("site", *(NAMES[one.name] for one in quarry.FREE), "rocks of a set in each round (sets)", "unit")
    return table(head, lines)


def _rounds(rounds: Sequence[races.Round]) -> str:
    """Return the numbers of rocks of each round, and the sets that it keeps."""
    return ", ".join(f"{one.rocks:,} (best {one.kept} kept)" for one in rounds)


def values_of(parameters: Results) -> str:
    """Return parameters in words."""
    return ", ".join(f"{NAMES[name]} {value:g}" for name, value in parameters.items())


def _found(site: Results) -> str:
    """Return a line with the result of a search on all data and on its halves."""
    words = f"- calibrated: {values_of(site['parameters'])} ({site['error']:.2f}; {site['tried']})."
    for which, half in zip(("First", "Second"), site.get("halves", ()), strict=False):
        words += f" {which} half: {', '.join(f'{value:g}' for value in half['parameters'].values())}."
    edge = ", ".join(NAMES[name] for name in site["at_edge"])
    return wrapped(words + (f" **At the edge of the search: {edge}.**" if edge else ""))


def _calibrated(results: Results) -> dict[str, Results]:
    """Return the calibrated line at Authume of each model, the rocks with a shape last."""
    lines = {line["model"]: line for line in results["authume"]["lines"] if line["values"] == CALIBRATED}
    return {**{model: lines[model] for model in MODELS}, BODIES: results["blocks"]["authume"]["all"]}


def _stops(results: Results) -> str:
    """Return the table of positions at Authume: field, point, sphere and rocks with a shape."""
    field, quarry_lines = results["authume"]["field"], _calibrated(results)
    percentiles = list(field["percentiles"])
    head = ("calibrated on x (m)", "mean", "sd", *percentiles, "lateral mean", "lateral sd", "beyond 55 m (%)",
            "distance of x", "lateral distance")  # fmt: skip
    rows = [
        (f"**{name}**" if name == BODIES else name, f"{of['mean']:.1f}", f"{of['sd']:.1f}",
         *(f"{of['percentiles'][p]:.1f}" for p in percentiles), f"{of['side_mean']:+.1f}", f"{of['side_sd']:.1f}",
         f"{100 * of['beyond']:.0f}", *(f"{of[key][0]:.1f}" if key in of else "" for key in ("errors", "side_errors")))
        for name, of in {"**field, 41 blocks**": field, **quarry_lines}.items()
    ]  # fmt: skip
    return table(head, rows)


def _bars(results: Results) -> str:
    """Return the table of the goals, and whether each is met by rocks with a shape and, as control, by the sphere."""
    lines = _calibrated(results)
    words = {"mean": ("mean x (m)", 1.0, ".1f"), "sd": ("sd of x (m)", 1.0, ".1f"),
             "side_sd": ("lateral sd (m), in no fit", 1.0, ".1f"),
             "beyond": ("beyond 55 m (%), in no fit", 100.0, ".0f")}  # fmt: skip
    near, chance = results["blocks"]["authume"]["near"], results["blocks"]["authume"]["chance"]
    rows = []
    for key, (name, unit, form) in words.items():
        low, high = (unit * edge for edge in quarry.BARS[key])
        cells = [f"{unit * lines[model][key]:{form}}" for model in MODELS]
        own = lines[BODIES]
        among = [unit * one[key] for one in near]
        met = "yes" if own["bars"][key] else f"**no, by {_missed(unit * own[key], low, high):.3f}**"
        rows.append((name, f"{low:g} to {high:g}", f"{unit * own[key]:{form}} ± {unit * chance[key]:.1f}", met,
                     interval_of((min(among), max(among))), *cells))  # fmt: skip
    head = ("figure", "goal", f"{BODIES} (± standard error)", "met", f"range over the {len(near)} best sets", *MODELS)
    return table(head, rows)


def _missed(value: float, low: float, high: float) -> float:
    """Return how far a value is outside an interval."""
    return max(low - value, value - high, 0.0)


def _halves(results: Results) -> str:
    """Return the table of errors with sets from halves of the blocks; errors on a kept-out half are in bold."""
    own = results["blocks"]["authume"]
    lines = [(f"{BODIES}, all", own["all"], -1)]
    lines += [(f"{BODIES}, {('first', 'second')[k]} half", half["all"], k) for k, half in enumerate(own["halves"])]
    for model in MODELS:
        halves = results["authume"]["calibrations"][model]["halves"]
        lines += [(f"{model}, {('first', 'second')[k]} half", half, k) for k, half in enumerate(halves)]
    rows = [
        (name, *(f"**{error:.1f}**" if k == 2 - which and which >= 0 else f"{error:.1f}"
                 for key in ("errors", "side_errors") for k, error in enumerate(of[key])), f"{of['side_sd']:.1f}")
        for name, of, which in lines
    ]  # fmt: skip
    head = ("half of the blocks that they fit; kept-out half in bold", "x: all 41", "first half, 21",
            "second half, 20", "lateral: all 41", "first half", "second half", "lateral sd (m)")  # fmt: skip
    return table(head, rows)


def _shapes(site: Results) -> str:
    """Return the table of the four scanned blocks, and of other shapes, masses and drop points."""
    variants = site["variants"]
    lines = [(f"{one['shape']}, {one['mass']:.0f} kg", one) for one in site["by_shape"]]
    lines += [
        ("the four hulls in the masses of the 41 blocks", variants["masses"]),
        ("the same, stretched to the proportions of each block", variants["proportions"]),
        ("the four blocks, all from the mean drop point", variants["one_point"]),
    ]
    rows = [
        (name, f"{of['mean']:.1f}", f"{of['sd']:.1f}", f"{of['side_mean']:+.1f}", f"{of['side_sd']:.1f}",
         f"{100 * of['beyond']:.0f}") for name, of in lines
    ]  # fmt: skip
    return table(("rocks", "mean x (m)", "sd", "lateral mean (m)", "lateral sd", "beyond 55 m (%)"), rows)


def _per_block(variants: Results) -> str:
    """Return the table of correlations over the 41 blocks."""
    rows = []
    for name, key in (("mass of each block", "by_mass"), ("mass and proportions", "by_block")):
        of = variants[key]
        rows.append((f"simulated, {name}", f"{of['correlation']:+.2f}", f"{of['sd_of_means']:.1f}",
                     f"{of['sd_within']:.1f}", *(f"{value:+.2f}" for value in of["simulated"].values())))  # fmt: skip
    field = variants["by_block"]["field"]
    rows.append(("**field**", "", "", "", *(f"{value:+.2f}" for value in field.values())))
    head = ("41 blocks", "correlation of simulated mean x and observed x", "sd of the blocks' means (m)",
            "sd of the rocks of one block (m)", *(f"correlation of x with {name}" for name in field))  # fmt: skip
    chance = variants["by_block"]["by_chance"]
    return f"{table(head, rows)}\nBy chance, 95 % of such correlations are below {chance:+.2f}.\n"


def _runouts(results: Results) -> str:
    """Return the table of runouts at Tschamut."""
    own, site = results["blocks"]["tschamut"], results["tschamut"]
    lines = [(f"**{BODIES}, Authume's set as it is**", own["from_authume"], None)]
    lines += [(f"{BODIES}, {name}", of, which) for name, of, which in (
        ("calibrated on all", own["all"], -1), ("first half", own["halves"][0]["all"], 0),
        ("second half", own["halves"][1]["all"], 1))]  # fmt: skip
    lines += [(f"{line['model']}, calibrated on all", line, -1) for line in site["lines"]
              if line["values"] == CALIBRATED]  # fmt: skip
    rows = [
        (name, f"{of['error_mean']:+.1f} ({interval_of(of['error_interval'], 0, '+')})", f"{of['correlation']:+.2f}",
         *(f"**{error:.1f}**" if which is not None and which >= 0 and k == 2 - which else f"{error:.1f}"
           for k, error in enumerate(of["errors"])), f"{of['runout_sd']:.1f}", f"{of['side_sd']:.1f}")
        for name, of, which in lines
    ]  # fmt: skip
    carried = [x for x in results["transfer"] if x["from"] == "authume"]
    rows += [(f"{x['model']}, Authume's set as it is", f"{x['tschamut']:+.1f}", "", f"{x['tschamut_absolute']:.1f}",
              *[""] * 4) for x in carried]  # fmt: skip
    field = site["field"]
    rows.append(("**field**", *[""] * 5, f"{field['runout_sd']:.1f}", f"{field['side_sd']:.1f}"))
    head = ("runout, simulated minus observed (m)", "mean", "correlation over runs", "mean absolute: all 17 runs",
            "first half, 9", "second half, 8", "sd of runout", "lateral sd")  # fmt: skip
    return table(head, rows)


def _by_block(tables: Results) -> str:
    """Return the table of the mean runout of each of Tschamut's blocks."""
    rows = [
        (f"{one['block']}, {one['mass']:.0f} kg", f"{one['runs']}", f"{one['field']:.0f}", f"{one['simulated']:.0f}",
         f"{fitted['simulated']:.0f}")
        for one, fitted in zip(tables["from_authume"], tables["all"], strict=True)
    ]  # fmt: skip
    return table(("block", "runs", "field: mean runout (m)", "Authume's set", "calibrated on all"), rows)


def _impacts(results: Results) -> str:
    """Return the tables of single impacts at Chant Sura: the six, and the eleven contacts."""
    own, field = results["blocks"]["chant_sura"], results["chant_sura"]["field"]
    head = ("energy ratio of the six: mean (5 to 95 % of orientations)", "2.1", "2.2", "2.3", "4.1", "4.2", "4.3",
            "inside", "mean absolute error", "largest of all")  # fmt: skip
    rows = [("**field**", *(f"{ratio:.2f}" for ratio in field["published"]), "", "", f"{max(field['published']):.2f}")]
    for name, key in (("Authume's set as it is", "from_authume"), ("calibrated on the eleven", "all")):
        for spin, label in (("published", "no spin"), ("spinning", "27 rad/s")):
            six = own[key][spin]
            cells = [f"{mean:.2f} ({interval_of(within, 2)})" for mean, within in
                     zip(six["ratios"], six["intervals"], strict=True)]  # fmt: skip
            rows.append((f"{name}, {label}", *cells, f"{six['inside']} of 6", f"{six['ratio_absolute']:.2f}",
                         f"{max(six['largest']):.2f}"))  # fmt: skip
    return f"{table(head, rows)}\n{_eleven(results)}"


def _eleven(results: Results) -> str:
    """Return the table of speeds after the eleven contacts, next to point and sphere."""
    own, others = results["blocks"]["chant_sura"], results["chant_sura"]["calibrations"]
    rows = [
        (f"{BODIES}, Authume's set, slope of {slope} degrees", f"{of['speed_mean']:+.2f}", f"{of['speed_rms']:.2f}", "",
         f"{of['inside']} of 11") for slope, of in own["from_authume"]["contacts"].items()
    ]  # fmt: skip
    fitted = own["all"]["contacts"]
    rows.append((f"{BODIES}, calibrated", f"{fitted['speed_mean']:+.2f}", f"{fitted['speed_rms']:.2f}",
                 f"{own['kept_out']:.2f}", f"{fitted['inside']} of 11"))  # fmt: skip
    rows += [(f"{model}, calibrated", f"{of['contacts']['speed_mean']:+.2f}", f"{of['contacts']['speed_rms']:.2f}",
              f"{of['kept_out']['speed_rms']:.2f}", "") for model, of in others.items()]  # fmt: skip
    head = ("speed after the eleven contacts (m/s)", "mean error", "rms", "rms, each run kept out",
            "energy ratio within 5 to 95 % of orientations")  # fmt: skip
    return table(head, rows)
