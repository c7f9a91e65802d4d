"""Print the report on a soak test in Markdown, and write its figures as JSON."""

import argparse
import json
import os

import numpy as np
from soak_ledger import Ledger, percentiles

from rpf3d_core.alerts.levels import Level

SETTLING = 60.0
"""Time (s) after a node's start that does not count for the growth of its memory."""


def print_report(
    ledger: Ledger, began: str, options: argparse.Namespace, demands: dict[str, Level], sound: bool, audit: str
) -> int:
    """Print the report, write its figures to `options.json`, and return 1 if the test failed.

    began : machine and load at the start, as text; demands : release place -> demanded level
    sound, audit : result and last lines of the audit of the decision log
    """
    one, _, fifteen = os.getloadavg()
    print(f"\n# Soak of {options.minutes:g} minutes, seed {options.seed}")
    print(f"{began}; {one:.1f} (1 min), {fifteen:.1f} (15 min) at the end.\n")
    slopes = ledger.slopes(SETTLING)
    for part in (_demanded(ledger), _delays(ledger), _memory(slopes), _happened(ledger)):
        print("\n".join(part) + "\n")
    print(f"Log of decisions: {'sound' if sound else 'NOT SOUND'}; {audit}\n")
    print("Places and what the core says that they demand: "
          + ", ".join(f"{place}: {level.word}" for place, level in demands.items()) + "\n")  # fmt: skip
    for failure in ledger.failures:
        print(f"- FAILURE {failure}")
    lost, failed = len(ledger.lost), not sound or bool(ledger.failures) or bool(ledger.lost)
    print(f"**{'FAILED' if failed else 'Passed'}: {lost} lost alerts of {len(ledger.demands)}, "
          f"{len(ledger.failures)} failures.**")  # fmt: skip
    if options.json:
        options.json.write_text(json.dumps(_figures(ledger, slopes, sound, lost, began), indent=2) + "\n")
    return int(failed)


def _demanded(ledger: Ledger) -> list[str]:
    met = len(ledger.demands) - len(ledger.lost)
    raised = sum(demand.level > Level.NORMAL for demand in ledger.demands)
    return [
        f"{len(ledger.demands)} bursts of sources, {raised} of them demand a level; {met} told in time, "
        f"**{len(ledger.lost)} lost**. {sum(d.disturbed > 0 for d in ledger.demands)} were disturbed while open, by a "
        f"kill of the simulator or a jump of the clock.",
    ]


def _delays(ledger: Ledger) -> list[str]:
    rows = {
        "burst to its level, undisturbed": ledger.took(False),
        "burst to its level, disturbed": ledger.took(True),
        **ledger.delays,
    }
    head = ["| delay, ms | number | median | 95 % | 99 % | longest |", "|---|---|---|---|---|---|"]
    return head + [f"| {name} | {percentiles(seconds)} |" for name, seconds in rows.items()]


def _memory(slopes: dict[str, tuple[float, float, float, float]]) -> list[str]:
    head = ["| node | MB at the end of its longest life | most, MB | slope, MB an hour | that life, s |",
            "|---|---|---|---|---|"]  # fmt: skip
    return head + [
        f"| {node} | {last:.0f} | {most:.0f} | {slope:+.1f} | {life:.0f} |"
        for node, (last, most, slope, life) in slopes.items()
    ]


def _happened(ledger: Ledger) -> list[str]:
    return ["| what happened | times |", "|---|---|"] + [f"| {k} | {n} |" for k, n in sorted(ledger.counts.items())]


def _figures(
    ledger: Ledger, slopes: dict[str, tuple[float, float, float, float]], sound: bool, lost: int, began: str
) -> dict[str, object]:
    kinds = {"undisturbed": ledger.took(False), "disturbed": ledger.took(True), **ledger.delays}
    return {
        "machine": began,
        "bursts": len(ledger.demands),
        "lost": lost,
        "audit": sound,
        "failures": ledger.failures,
        "delays_s": {
            name: {str(share): float(np.percentile(seconds, share)) for share in (50, 95, 99, 100)}
            for name, seconds in kinds.items()
            if seconds
        },
        "memory": {
            node: {"last_mb": last, "most_mb": most, "slope_mb_per_hour": slope if np.isfinite(slope) else None,
                   "life_s": life}
            for node, (last, most, slope, life) in slopes.items()
        },
        "counts": dict(ledger.counts),
    }  # fmt: skip
