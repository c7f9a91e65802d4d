"""The one-page report of a calibration, as Markdown."""

from collections.abc import Iterator

import numpy as np

from rpf3d_core.calibration.findings import Estimate, Findings
from rpf3d_core.calibration.folds import Score
from rpf3d_core.calibration.verdict import MORE, VALID, advice_of, is_refused, warnings_of
from rpf3d_core.ensemble.outward import interval_as, three_figures
from rpf3d_core.formats.words import scene_name
from rpf3d_core.scene.model import Scene

POSTERIOR = "posterior.png"
OF_STOPS = {
    "predicted.png": "predicted against observed stops",
    "coverage.png": "coverage of the predictive intervals on kept-out blocks",
}
"""Pictures that exist only if an observed stop has a prediction, with their titles."""


def report_text(scene: Scene, found: Findings) -> str:
    """Return the report of a calibration as Markdown, the content of report.md."""
    return "\n".join(_lines(scene, found)) + "\n"


def _lines(scene: Scene, found: Findings) -> Iterator[str]:
    yield f"# Calibration of {scene_name(scene.path)}"
    yield from _refusal(found) if is_refused(found) else _result(found)


def _refusal(found: Findings) -> Iterator[str]:
    """Yield the lines of a refused calibration, without numbers that a reader could mistake for a result."""
    yield f"**Refused**: only {found.effective:.0f} effective samples. What would help:"
    yield from (f"- {sentence}" for sentence in advice_of(found))
    yield "\n## Priors"
    yield "| parameter | prior |\n|---|---|"
    yield from (f"| {one.name} | {_prior(one)} |" for one in found.estimates)
    yield _flown(found)
    if found.of_data:
        yield "## What limits the data"
        yield from (f"- {sentence}" for sentence in found.of_data)


def _result(found: Findings) -> Iterator[str]:
    yield f"The result is **{VALID}**, and for nothing else.\n"
    yield from _parameters(found)
    yield from _scores(found)
    yield from _warnings(found)
    yield "## What would be needed to say more"
    yield from (f"- {sentence}" for sentence in MORE)
    yield "\n## Pictures"
    yield f"![prior and posterior of the parameters]({POSTERIOR})"
    if found.predicts_stops:
        yield from (f"![{text}]({name})" for name, text in OF_STOPS.items())


def _parameters(found: Findings) -> Iterator[str]:
    yield "## Parameters"
    yield "| parameter | prior | mean | 90 % interval | shrinkage |\n|---|---|---|---|---|"
    for one in found.estimates:
        interval = interval_as((one.low, one.high), three_figures, between=" to ")
        yield f"| {one.name} | {_prior(one)} | {one.mean:.3g} | {interval} | {100 * one.shrinkage:.0f} % |"
    if (worst := _worst_pair(found)) is not None:
        i, j = worst
        names = [one.name for one in found.estimates]
        yield f"\nStrongest correlation: {names[i]} with {names[j]}, {found.correlation[i, j]:.2f}."
    yield _flown(found)


def _prior(one: Estimate) -> str:
    return ", ".join(f"{key} {value:g}" for key, value in one.prior.items())


def _flown(found: Findings) -> str:
    return (f"\n{found.sets:,} parameter sets of {found.rocks:,} rocks; {found.effective:.0f} effective samples; "
            f"noise of the log-likelihood {found.noise:.2f}.\n")  # fmt: skip


def _worst_pair(found: Findings) -> tuple[int, int] | None:
    """Return the indices of the two parameters with the strongest correlation; None for a single parameter."""
    if len(found.estimates) < 2:
        return None
    i, j = np.unravel_index(np.argmax(np.abs(np.tril(found.correlation, -1))), found.correlation.shape)
    return int(i), int(j)


def _scores(found: Findings) -> Iterator[str]:
    if found.held_out is None:
        yield "Too few single observations to keep any out: there is no score.\n"
        return
    yield "## Score on kept-out observations"
    yield "Mean logarithm of the predicted density at each observation; higher is better."
    yield "| prediction | score |\n|---|---|"
    named = {"calibration, the observation's fold kept out": found.held_out, "prior": found.prior,
             "book values": found.book, "normal curve without physics": found.curve}  # fmt: skip
    yield from (f"| {name} | {_number(score)} |" for name, score in named.items())
    if (coverage := found.coverage()) is not None:
        whole = coverage["with_misfit"]
        along, across = (" and ".join(f"{100 * coverage[p][axis]:.0f} %" for p in ("50", "90"))
                         for axis in ("along", "across"))  # fmt: skip
        yield (f"\n50 and 90 % predictive intervals hold {along} of the kept-out blocks along the slope, "
               f"{across} across. With the misfit of the model included ({whole['misfit']:.1f} m), 90 % intervals hold "
               f"{_shares(whole['90'])}.")  # fmt: skip
    yield f"\n{100 * found.left:.1f} % of the simulated rocks left the terrain or did not stop; they count as wrong.\n"


def _shares(inside: dict[str, float]) -> str:
    return " and ".join(f"{100 * share:.0f} % {axis}" for axis, share in inside.items())


def _number(score: Score | None) -> str:
    return "-" if score is None else f"{score.mean:.2f}"


def _warnings(found: Findings) -> Iterator[str]:
    sentences = warnings_of(found)
    if sentences:
        yield "## Warnings"
        yield from (f"- {sentence}" for sentence in sentences)
        yield ""
