"""`rpf3d study`: repeat a study of the thesis on which rpf3d is based."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.progress import progress
from rpf3d_core.commands.screen import end_interrupted, print_table, rocks_in_words, screen


def study(
    name: Annotated[str, typer.Argument(help="resolution or localised.", show_default=False)],
    out: Annotated[Path, typer.Option(help="Folder to write the runs and the comparison to.", show_default=False)],
    rocks: Annotated[int | None, typer.Option(help="Rocks of each run, instead of the scenes' 100,000.")] = None,
) -> None:
    """Repeat a study of B. Peik's thesis (2020): resolution of the terrain, or coefficients of restitution by zone."""
    from rpf3d_core.runs.fly_scene import RunControl
    from rpf3d_core.runs.run import run_scene
    from rpf3d_core.runs.thesis import runs_of, study_named
    from rpf3d_core.runs.thesis_report import finding_header, finding_rows, report_of, verdict_of, write_report

    chosen = study_named(name)
    runs = runs_of(chosen, out)
    for done, (scene, folder) in enumerate(runs):
        try:
            with progress() as (begin, writing):
                control = RunControl(progress=begin, writing=writing)
                result = run_scene(scene, folder, rocks, control=control)
        except KeyboardInterrupt:
            end_interrupted(f"{done} of {len(runs)} runs are whole, and there is no comparison")
        screen.print(f"{scene.stem}: {rocks_in_words(result.totals.rocks)} in {folder.resolve()}", soft_wrap=True)
    report = report_of(chosen, [folder for _, folder in runs])
    write_report(report, out)
    screen.print(chosen.title, soft_wrap=True)
    print_table(finding_header(report), finding_rows(report))
    screen.print(verdict_of(report), soft_wrap=True)
    screen.print(f"comparison in {(out / 'comparison.md').resolve()}", soft_wrap=True)
