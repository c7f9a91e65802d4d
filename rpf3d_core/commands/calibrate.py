"""`rpf3d calibrate`: fit the unknowns of a scene to field observations, with intervals and a verdict."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rpf3d_core.commands.options import EngineOption, SceneFile
from rpf3d_core.commands.progress import interruptible
from rpf3d_core.commands.screen import complaints, end_interrupted, print_table, print_warnings, screen

if TYPE_CHECKING:
    from rpf3d_core.calibration.findings import Findings
    from rpf3d_core.calibration.rounds import Status

BudgetOption = Annotated[
    float | None,
    typer.Option(help="Seconds for this call; 900 if not given. A call that continues has its own budget."),
]


def calibrate(
    scene: SceneFile,
    out: Annotated[Path, typer.Option(help="Folder to write the result to, or to continue in.", show_default=False)],
    budget: BudgetOption = None,
    engine: EngineOption = None,
) -> None:
    """Fit the unknowns of a scene to field observations, and report how well the data determines the unknowns.

    Ctrl-C keeps all flown parameter sets; the same command then continues the calibration.

    If the result is too uncertain, the exit code is 1 and no calibrated scene is written.
    """
    from rpf3d_core.calibration.calibrate import calibrate as fit
    from rpf3d_core.calibration.calibrate import deadline_after
    from rpf3d_core.calibration.rounds import Control
    from rpf3d_core.calibration.verdict import is_refused, warnings_of

    deadline = deadline_after(budget)
    sets = 0
    with interruptible() as (stop, flying), screen.status("preparing: terrain, index, compiled code") as status:

        def show(progress: "Status") -> None:
            nonlocal sets
            sets = progress.sets
            status.update(_in_words(progress))

        flying(True)
        done = fit(scene, out, Control(deadline=deadline, progress=show, stop=stop), engine)
    if done.found is None:
        end_interrupted(f"{done.sets:,} parameter sets are kept in {out}; the same command continues")
    if is_refused(done.found):
        _print_refusal(done.found)
        raise typer.Exit(1)
    _print(done.found)
    print_warnings(warnings_of(done.found))
    screen.print(f"results in {out.resolve()}; fly the posterior with: "
                 f"rpf3d run {out / 'calibrated.yaml'} --out RESULT", soft_wrap=True)  # fmt: skip


def _in_words(progress: "Status") -> str:
    """Return the progress of a calibration as one line of text: round, parameter sets, effective samples, time left."""
    known = "" if progress.effective is None else f", {progress.effective:.0f} effective samples"
    minutes, seconds = divmod(int(progress.left_s), 60)
    return f"round {progress.round + 1}, {progress.sets:,} parameter sets{known}, at most {minutes}:{seconds:02d} left"


def _print(found: "Findings") -> None:
    """Print the parameters, the scores and the coverage of a calibration."""
    from rpf3d_core.ensemble.outward import interval_as, three_figures

    rows = [(one.name, f"{one.mean:.3g}", interval_as((one.low, one.high), three_figures, between=" to "),
             f"{100 * one.shrinkage:.0f} %") for one in found.estimates]  # fmt: skip
    print_table(("parameter", "mean", "90 % interval", "shrinkage"), rows)
    scores = {"kept-out": found.held_out, "prior": found.prior, "book": found.book, "curve": found.curve}
    if found.held_out is not None:
        words = ", ".join(f"{name} {score.mean:.2f}" for name, score in scores.items() if score is not None)
        screen.print(f"score of an observation (higher is better): {words}", soft_wrap=True)
    if (coverage := found.coverage()) is not None:
        whole = coverage["with_misfit"]
        screen.print(f"90 % predictive intervals hold {100 * coverage['90']['along']:.0f} % of kept-out blocks along "
                     f"the slope, {100 * coverage['90']['across']:.0f} % across; with the misfit of the model "
                     f"({whole['misfit']:.1f} m) {100 * whole['90']['along']:.0f} % and "
                     f"{100 * whole['90']['across']:.0f} %", soft_wrap=True)  # fmt: skip
    _print_flown(found)


def _print_refusal(found: "Findings") -> None:
    """Print the number of rocks flown, the limits of the data, and in the last line why the calibration is refused."""
    from rpf3d_core.calibration.verdict import verdict_of

    _print_flown(found)
    print_warnings(found.of_data)
    complaints.print(f"rpf3d: {verdict_of(found)}", markup=False)


def _print_flown(found: "Findings") -> None:
    screen.print(f"{found.sets:,} parameter sets of {found.rocks:,} rocks, {found.effective:.0f} effective samples, "
                 f"noise {found.noise:.2f}", soft_wrap=True)  # fmt: skip
