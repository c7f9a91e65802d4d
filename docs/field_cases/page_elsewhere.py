"""Build the sections of docs/explanation/validation.md on unknown ground: ranges of the library, another slope."""

from field_cases import authume
from field_cases.models import AUTHUME, TSCHAMUT
from field_cases.page_tables import Results, interval_of, table
from field_cases.predictions import LOW, held_of_all
from field_cases.prose_elsewhere import BOOKS, ELSEWHERE, HEAD, IMPACTS, TOO_SURE, TOO_SURE_ELSEWHERE


def section(results: Results) -> str:
    """Return the sections on ranges of the library, and on values from another slope or from single impacts."""
    return "\n".join([
        HEAD, BOOKS, _predicted(results["library"]), TOO_SURE, ELSEWHERE, _predicted(results["elsewhere"]),
        TOO_SURE_ELSEWHERE, IMPACTS, _of_impacts(results["impacts"]),
    ])  # fmt: skip


def error_of(line: Results) -> float:
    """Return the error (m) of a prediction: of mean x at Authume, of the mean runout at Tschamut."""
    return float(line["mean"]) - authume.MEAN_X if line["site"] == AUTHUME else float(line["error_mean"])


def error_over_sets(line: Results) -> tuple[float, float]:
    """Return the 5th and the 95th percentile of the errors (m) of the parameter sets of a prediction."""
    name, base = ("mean", authume.MEAN_X) if line["site"] == AUTHUME else ("error_mean", 0.0)
    low, high = line["over_sets"][name]
    return low - base, high - base


def _predicted(lines: list[Results]) -> str:
    """Return the table of predictions: their errors, and the numbers of observed stops in their 90 % intervals."""
    head = ("site", "model", "ground", "error of the mean (m)", "contained along", "contained across",
            "did not stop (%)", "far end")  # fmt: skip
    return table(head, (
        (line["site"], line["model"], line["ground"],
         f"{error_of(line):+.0f} ({interval_of(error_over_sets(line), 0, '+')})", held_of_all(line, "along"),
         held_of_all(line, "across"), f"{100.0 * line['left']:.1f}", "open" if line["left"] >= LOW else "closed")
        for line in lines
    ))  # fmt: skip


def _of_impacts(lines: list[Results]) -> str:
    """Return the table of errors at both slopes with values that were calibrated on single impacts."""
    head = ("model", f"{AUTHUME}: error of mean x (m)", f"{TSCHAMUT}: error of mean runout (m)")
    return table(head, ((line["model"], f"{line[AUTHUME]:+.0f}", f"{line[TSCHAMUT]:+.0f}") for line in lines))
