"""Build the section of docs/explanation/validation.md on rocks with a shape from the file of results."""

from field_cases.blocks import quarry
from field_cases.models import AUTHUME, CALIBRATED, CHANT_SURA, COULOMB_LIMITED, SHAPES, SPHERE
from field_cases.page_tables import Results, interval_of, searched, table, wrapped
from field_cases.prose_blocks import AT_IMPACTS, BARS, BLOCKS, BLOCKS_FAIL, IN_COLUMNS, PER_BLOCK, PER_SHAPE

CONTROLS = (COULOMB_LIMITED.name, SPHERE.name)


def section(results: Results) -> str:
    """Return the section on rocks with a shape as Markdown."""
    at_quarry = results["blocks"]["quarry"]
    return "\n".join([
        BLOCKS, "![Rocks with a shape](../pictures/validation_blocks.png)\n", BARS, searched(at_quarry), _bars(results),
        PER_SHAPE, _shapes(at_quarry), PER_BLOCK, _per_block(at_quarry["variants"]),
        AT_IMPACTS, searched(results["blocks"]["impacts"]), _impacts(results), BLOCKS_FAIL,
    ])  # fmt: skip


def _bars(results: Results) -> str:
    """Return the table of goals, with figures of the shipped scene, the best sets in x, and calibrated controls."""
    lines = {line["model"]: line for line in results[AUTHUME]["lines"] if line["values"] == CALIBRATED}
    words = {"mean": ("mean x (m)", 1.0, ".1f"), "sd": ("sd of x (m)", 1.0, ".1f"),
             "side_sd": ("lateral sd (m)", 1.0, ".1f"), "beyond": ("beyond 55 m (%)", 100.0, ".0f")}  # fmt: skip
    at_quarry, rows = results["blocks"]["quarry"], []
    for key, (name, unit, form) in words.items():
        low, high = (unit * edge for edge in quarry.BARS[key])
        own, chance = unit * at_quarry["all"][key], unit * at_quarry["chance"][key]
        among = [unit * one[key] for one in at_quarry["near"]]
        met = "yes" if at_quarry["all"]["bars"][key] else f"**no, by {_missed(own, low, high):.3f}**"
        rows.append((name, f"{low:g} to {high:g}", f"{own:{form}} ± {chance:.1f}", met,
                     interval_of((min(among), max(among))),
                     *(f"{unit * lines[m][key]:{form}}" for m in CONTROLS)))  # fmt: skip
    head = ("figure", "goal", f"{SHAPES.name} (± standard error)", "met",
            f"range over the {len(at_quarry['near'])} best sets",
            *(f"{name}, calibrated" for name in CONTROLS))  # fmt: skip
    return table(head, rows)


def _missed(value: float, low: float, high: float) -> float:
    """Return the distance of a value from an interval; 0 inside."""
    return max(low - value, value - high, 0.0)


def _shapes(site: Results) -> str:
    """Return the table of results with the four scanned blocks, and with other shapes, masses and drop points."""
    variants = site["variants"]
    lines = [(f"{one['shape']}, {one['mass']:.0f} kg", one) for one in site["by_shape"]]
    lines += [
        ("the four hulls with the masses of the 41 blocks", variants["masses"]),
        ("these hulls, stretched to the proportions of each block", variants["proportions"]),
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
    head = ("41 blocks", "correlation with observed x", "sd of means (m)", "sd of one block (m)",
            *(f"x with {name}" for name in field))  # fmt: skip
    chance = variants["by_block"]["by_chance"]
    words = (
        "*Correlation with observed x*: that of the simulated mean x of the blocks. *Sd of means*: that of the mean x "
        "of the blocks. *Sd of one block*: that of the rocks of one block. *x with* mass, L2/L1 and L3/L1: the "
        f"correlation of x with this figure. By chance, 95 % of such correlations are below {chance:+.2f}.\n"
    )
    return f"{table(head, rows)}\n{wrapped(words)}"


def _impacts(results: Results) -> str:
    """Return the tables of single impacts at Chant Sura: of the six impacts, and of the eleven contacts."""
    own, field = results["blocks"]["impacts"], results[CHANT_SURA]["field"]
    labels = ("energy ratio", "2.1", "2.2", "2.3", "4.1", "4.2", "4.3", "inside", "mean absolute error",
              "largest of all")  # fmt: skip
    published = field["published"]
    columns = [labels, ("**field**", *(f"{ratio:.2f}" for ratio in published), "", "", f"{max(published):.2f}")]
    for name, key in (("Authume", "from_authume"), ("calibrated", "all")):
        for spin, label in (("published", "no spin"), ("spinning", "27 rad/s")):
            six = own[key][spin]
            cells = [f"{mean:.2f} ({interval_of(within, 2)})" for mean, within in
                     zip(six["ratios"], six["intervals"], strict=True)]  # fmt: skip
            columns.append((f"{name}, {label}", *cells, f"{six['inside']} of 6", f"{six['ratio_absolute']:.2f}",
                            f"{max(six['largest']):.2f}"))  # fmt: skip
    head, *rows = zip(*columns, strict=True)
    return f"{IN_COLUMNS}\n{table(head, rows)}\n{_eleven(results)}"


def _eleven(results: Results) -> str:
    """Return the table of speeds after the eleven contacts, with points and spheres for comparison."""
    own, others = results["blocks"]["impacts"], results[CHANT_SURA]["calibrations"]
    rows = [
        (f"{SHAPES.name}, coefficients of Authume, slope of {slope} degrees", f"{of['speed_mean']:+.2f}",
         f"{of['speed_rms']:.2f}", "", f"{of['inside']} of 11") for slope, of in own["from_authume"]["contacts"].items()
    ]  # fmt: skip
    fitted = own["all"]["contacts"]
    rows.append((f"{SHAPES.name}, calibrated", f"{fitted['speed_mean']:+.2f}", f"{fitted['speed_rms']:.2f}",
                 f"{own['kept_out']:.2f}", f"{fitted['inside']} of 11"))  # fmt: skip
    rows += [(f"{model}, calibrated", f"{of['contacts']['speed_mean']:+.2f}", f"{of['contacts']['speed_rms']:.2f}",
              f"{of['kept_out']['speed_rms']:.2f}", "") for model, of in others.items()]  # fmt: skip
    head = ("speed after the eleven contacts (m/s)", "mean error", "rms", "rms, each run kept out",
            "energy ratio within 5 to 95 % of orientations")  # fmt: skip
    return table(head, rows)
