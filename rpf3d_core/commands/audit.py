"""`rpf3d audit`: recompute the decisions of a decision log, and compare them with the logged decisions."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rpf3d_core.commands.screen import complaints, print_table, screen

if TYPE_CHECKING:
    from rpf3d_core.alerts.audit import Audit, LevelChange
    from rpf3d_core.alerts.levels import Alert

HEADER = ("line", "time", "shown", "held", "alarm", "why")


def audit(
    log: Annotated[Path, typer.Argument(help="The folder of a decision log, or a file of it.", show_default=False)],
    head: Annotated[
        str | None, typer.Option(help="The hash of a line that was noted elsewhere and must be in the log.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Recompute every decision of a decision log, and compare the result bit for bit with the logged decision.

    The exit code is 0 if all decisions agree and no line is damaged or missing, otherwise 1; 2 for an unreadable log.
    """
    from rpf3d_core.alerts.audit import audit_log

    found = audit_log(log, head)
    if as_json:
        print(json.dumps(_section(found), indent=2, allow_nan=False))
    else:
        _print(found)
    if not found.sound:
        raise typer.Exit(1)


def _print(found: "Audit") -> None:
    """Print an audit: a table of decisions, then the notes, the findings (to stderr) and the verdict.

    The table has the first decision, each decision that changed a level, the alarm, the faults or the waiting
    acknowledgements, and each decision with an acknowledgement (`Audit.changes`).
    """
    if found.changes:
        print_table(HEADER, [_row(change) for change in found.changes])
    for note in found.notes:
        screen.print(f"note: {note}", soft_wrap=True)
    for finding in found.findings:
        complaints.print(f"rpf3d: {finding}", style="bold red", markup=False)
    if found.hidden:
        complaints.print(f"rpf3d: and {found.hidden:,} findings more", style="bold red", markup=False)
    for line in _verdict(found):
        screen.print(line, soft_wrap=True, highlight=False)


def _row(change: "LevelChange") -> tuple[str, ...]:
    from rpf3d_core.alerts.audit import areas_changed
    from rpf3d_core.alerts.time_units import when

    alert, given = change.alert, change.alert.acknowledgement
    steps = []
    if given is not None:
        steps = [f"{_acknowledged_phrase(alert)} {given.by}: {given.why}"]
        if not alert.void and change.before is not None:
            steps += [f"after {one.by}: {one.why}" for one in change.before.waiting]
    steps += [f"{name}: {was.word} > {now.word}" for name, was, now in areas_changed(change.before, alert)]
    first, *more = [*steps, *alert.reasons]
    why = first + (f" (and {len(more)} more)" if more else "")
    shown = _shown(alert)
    if change.before is not None and _shown(change.before) != shown:
        shown = f"{_shown(change.before)} > {shown}"
    return (str(change.line), when(alert.at_ns), shown, alert.held.word, "on" if alert.alarm else "off", why)


def _acknowledged_phrase(alert: "Alert") -> str:
    """Return a phrase that states the effect of an acknowledgement; the caller adds the name of the person.

    alert : a decision with an acknowledgement
    """
    if not alert.void:
        return "acknowledged by"
    waits = alert.acknowledgement in alert.waiting
    return "acknowledgement waiting for another person, by" if waits else "invalid acknowledgement by"


def _shown(alert: "Alert") -> str:
    """Return the alert level that a decision shows, as text for the table.

    "(fault)" is added to `evacuate` if the decision has faults, because `evacuate` is then shown in place of `fault`.
    """
    return f"{alert.level.word} (fault)" if alert.faults and alert.level == alert.held else alert.level.word


def _verdict(found: "Audit") -> list[str]:
    versions = ", ".join(found.versions) or "none"
    sentence = f"{found.reproduced:,} of {found.decisions:,} decisions reproduced bit for bit"
    state = "the chain of lines is whole" if found.sound else "the log is NOT sound"
    files = f"{found.files:,} {'file' if found.files == 1 else 'files'}"
    refused = f", {found.refused:,} refused acknowledgements" if found.refused else ""
    return [
        f"{found.lines:,} lines in {files}, written by version {versions}; last line {found.head}",
        f"{sentence}{refused}; {state}",
    ]


def _section(found: "Audit") -> dict[str, Any]:
    """Return the audit as plain values for JSON."""
    from rpf3d_core.alerts.lines import alert_content

    changes = [
        {"line": change.line, "version": change.version, "alert": alert_content(change.alert)}
        for change in found.changes
    ]
    counts = {name: getattr(found, name) for name in ("files", "lines", "decisions", "reproduced", "refused")}
    return {
        "sound": found.sound, **counts, "versions": found.versions, "head": found.head, "notes": found.notes,
        "findings": found.findings, "findings_not_told": found.hidden, "changes": changes,
    }  # fmt: skip
