"""`rpf3d check`: report the errors of a scene and the cost of its run, before it is run."""

from typing import TYPE_CHECKING

from rich.table import Table

from rpf3d_core.commands.options import EngineOption, RocksOption, SceneFile, number_of_rocks
from rpf3d_core.commands.screen import print_warnings, rocks_in_words, screen
from rpf3d_core.errors import InputError

if TYPE_CHECKING:
    from rpf3d_core.runs.check import Check
    from rpf3d_core.runs.pilot_run import Cost
    from rpf3d_core.scene.model import Scene
    from rpf3d_core.setup.warnings.extents import Extent

SLOWEST = 2.25
"""Factor (-) from the usual time to compile, `runs.pilot_run.COMPILE_S` (20 s), to the time on a slow machine.

On two shared cores of a server, 38 to 42 s were measured.
"""


def check(scene: SceneFile, rocks: RocksOption = None, engine: EngineOption = None) -> None:
    """Report faults of a scene's terrain, start heights of its rocks, and the time and memory that a run will take.

    The exit code is 0 if `rpf3d run` accepts the scene, even if `rpf3d calibrate` would refuse it; otherwise 2.
    """
    from rpf3d_core.runs.check import check_scene
    from rpf3d_core.setup.choices import chosen_scene

    chosen = chosen_scene(scene, number_of_rocks(rocks), engine, None)
    report = check_scene(chosen, lambda extents, hints: _print_extents(chosen, extents, hints))
    _print_check(report)
    print_warnings(report.warnings)
    if not report.fit:
        raise InputError(
            f"{scene}: some rocks do not start above the ground; see the sources above: raise sources under the "
            "ground, or give `above_ground`; move sources that are off the terrain"
        )


def _print_extents(scene: "Scene", extents: "list[Extent]", hints: list[str]) -> None:
    """Print the extent of each input of a scene, and notes on inputs that look misplaced; both may be empty."""
    width = max((len(extent.name) for extent in extents), default=0)
    for extent in extents:  # not as a table, which would break numbers in a narrow terminal
        screen.print(f"{extent.name.ljust(width)}  {extent.describe(scene.terrain.crs)}", soft_wrap=True)
    print_warnings(hints)


def _print_check(report: "Check") -> None:
    """Print the report on a scene, one line for each item, such as a fault, a source or the cost."""
    from rpf3d_core.scene.zone_materials import words_on_friction

    named = report.scene
    lines = [line.split("  ", 1) for line in report.faults.describe()]
    lines += [[f"source {source.name}", source.describe()] for source in report.sources]
    lines += [["rocks", report.rocks.describe()]]
    lines += [["measured", sentence] for sentence in report.measured]
    lines += [["shape", sentence] for sentence in report.shapes]
    lines += [["effects", ", ".join(named.effects.named) or "none named"]]
    models = f"rebound {named.impact_model.name}, ground {named.ground_model.name}"
    if named.rock.is_body:
        models = f"contact {named.impact_model.name}"
    models += f", stop_speed {named.stop_speed:g} m/s"
    lines += [["models", f"{models}, method {named.method.describe()}"]]
    if named.unknowns is not None and named.has_unknowns:
        lines += [["unknowns of a run", named.unknowns.describe(report.idle)]]
    if report.calibrated:
        lines += [["unknowns of calibrate", report.calibrated]]
    lines += [["calibration", sentence] for sentence in report.observed]
    if report.assumed_friction:
        lines += [["friction", words_on_friction(report.assumed_friction)]]
    lines += [["hazard maps", report.maps.describe()]]
    if report.cost:
        lines += [["cost", _describe_cost(report.cost)]]
    table = Table.grid(padding=(0, 2))
    for name, text in lines:
        table.add_row(name, text.strip())
    screen.print(table)


def _describe_cost(cost: "Cost") -> str:
    """Return the estimated time that a run of a scene takes, as one line of text."""
    seconds = "less than 0.1 s" if cost.fly_s < 0.1 else f"about {float(f'{cost.fly_s:.2g}'):,.12g} s"
    rocks = f"{'at most ' if cost.auto else ''}{rocks_in_words(cost.rocks)}"
    fly = f"{seconds} to fly {rocks} with the {cost.engine} engine"
    return (f"{fly}{_compiling(cost)} (from a pilot of {rocks_in_words(cost.pilot)}: {cost.impacts:.1f} impacts "
            "each)")  # fmt: skip


def _compiling(cost: "Cost") -> str:
    """Return a clause on the time to compile, to be added to the cost; "" for the reference engine.

    There is a clause even if compiled code for these models is in the disk cache, because a run with other effects or
    materials may have to compile.
    """
    from rpf3d_core.runs.pilot_run import COMPILE_S
    from rpf3d_core.simulation.engines import Compiled

    if cost.engine != Compiled.name:
        return ""
    some = f"some {COMPILE_S:.0f} to {SLOWEST * COMPILE_S:.0f} s"
    if cost.compile_s:
        return f", and {some} to compile, the first time"
    return f"; a run with effects or materials that have not been compiled yet also compiles, for {some}"
