"""Run the campaign of the safety argument: in no combination of defects of inputs may the node show too low a level.

    PYTHONPATH=test/support:. python -m never_green.campaign --count 2000      all seeds from 0 on
    PYTHONPATH=test/support:. python -m never_green.campaign --first 17 --count 1 --words    seed 17, with its defects

A combination is drawn from its seed: the true state of a small pit, messages about it, and defects of the messages.
docs/explanation/never-green.md has the report.
"""

import argparse
import logging
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial

from never_green.combination import CLEAN, Verdict, run
from never_green.defects import DEFECTS

NO_DEFECT = "none"
"""Value of --kinds for combinations without a defect: the seeds are the multiples of 10 that are at least --first."""


def failures_of(verdict: Verdict) -> list[str]:
    """Return the failures of a combination as sentences; empty if there is none.

    A failure is a level that is too low; a contact that the alarm bridge closed although the alarm had to sound; or, in
    a combination without defects, any wrong level.
    """
    greens = [
        f"{each.at:g} s: {'evidence' if each.is_masked else 'level'} {each.shown}, true is {each.true}"
        for each in verdict.greens
    ]
    closed = ["the bridge closed its contact"] if verdict.contact_closed else []
    return [*greens, *closed, *verdict.wrong]


def words_of(verdict: Verdict) -> str:
    """Return a line of text about a verdict: its seed, its defects and its first failure."""
    failures = failures_of(verdict)
    defects = ", ".join(verdict.plan.defects) or "no defect"
    more = f" and {len(failures) - 1} more" if len(failures) > 1 else ""
    return f"seed {verdict.seed} ({defects}; true up to {verdict.worst}): {failures[0] if failures else 'well'}{more}"


def verdicts(seeds: Sequence[int], workers: int, kinds: Sequence[str]) -> Iterable[Verdict]:
    """Run the combination of each seed, and yield the verdicts in any order.

    workers : number of processes; kinds : names of the kinds of defects to draw from
    """
    one = partial(_run, kinds=kinds)
    if workers <= 1:
        yield from map(one, seeds)
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap_unordered(one, seeds, chunksize=4)


def _run(seed: int, kinds: Sequence[str]) -> Verdict:
    logging.disable()
    return bare(run(seed, kinds))


def bare(verdict: Verdict) -> Verdict:
    """Return a verdict without the messages of its plan, which cannot be sent to another process."""
    return verdict._replace(plan=verdict.plan._replace(sends=()))


class Totals:
    """The counts of a campaign.

    A fault, and a time, count only after the first SETTLED seconds of a combination (`Verdict`).

    seeds : all seeds; failed : verdicts with failures
    of_defect : kind of defect -> number of combinations with this defect; found : the same, with a fault
    several : number of combinations with two or more defects and a true level of restrict or evacuate
    clean, cautious : number of combinations without a defect, and number of these with a fault
    clean_s, clean_fault_s : total time (s) of the combinations without a defect, and their time in fault
    """

    def __init__(self) -> None:
        """Begin with all counts at 0."""
        self.seeds: list[int] = []
        self.failed: list[Verdict] = []
        self.of_defect, self.found = Counter[str](), Counter[str]()
        self.several = self.clean = self.cautious = 0
        self.clean_s = self.clean_fault_s = 0.0

    def add(self, verdict: Verdict) -> None:
        """Add the verdict of a combination to the counts."""
        self.seeds.append(verdict.seed)
        if failures_of(verdict):
            self.failed.append(verdict)
        kinds = {name.partition(":")[0] for name in verdict.plan.defects}
        self.of_defect.update(kinds)
        self.several += len(verdict.plan.defects) > 1 and verdict.worst in ("restrict", "evacuate")
        if not verdict.plan.defects:
            self.clean, self.cautious = self.clean + 1, self.cautious + (verdict.fault_s > 0.0)
            self.clean_s, self.clean_fault_s = self.clean_s + verdict.shown_s, self.clean_fault_s + verdict.fault_s
        self.found.update(kinds if verdict.fault_s else ())

    def report(self) -> str:
        """Return the counts as text of several lines."""
        lines = [
            f"{len(self.seeds):,} combinations, seeds {min(self.seeds)} to {max(self.seeds)}: "
            f"{len(self.failed)} failed",
            f"{self.several:,} with two or more defects over a true level of restrict or worse",
            f"{self.clean:,} without a defect: {self.cautious} were a fault at any time ({self.clean_fault_s:g} of "
            f"{self.clean_s:g} s)",
            "kind of defect: combinations with it, of these with a fault",
            *(f"  {kind}: {count:,}, {self.found[kind]:,}" for kind, count in sorted(self.of_defect.items())),
        ]
        return "\n".join(lines)


def main() -> int:
    """Run the campaign; return 1 if a combination failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--until-failed", action="store_true", help="end with the first failure")
    parser.add_argument("--words", action="store_true", help="print every combination")
    parser.add_argument("--kinds", default="", help="kinds of defects, separated by commas; then all have a defect")
    asked = parser.parse_args()
    totals, began = Totals(), time.monotonic()
    seeds, kinds = range(asked.first, asked.first + asked.count), tuple(DEFECTS)
    if asked.kinds == NO_DEFECT:
        first = asked.first + -asked.first % 10
        seeds = range(first, first + 10 * asked.count, 10)
    elif asked.kinds:
        seeds, kinds = [seed for seed in seeds if seed % 10 >= CLEAN], tuple(asked.kinds.split(","))
    for verdict in verdicts(seeds, asked.workers, kinds):
        totals.add(verdict)
        if asked.words or failures_of(verdict):
            print(words_of(verdict), flush=True)
        if asked.until_failed and totals.failed:
            break
    print(f"{totals.report()}\n{time.monotonic() - began:.0f} s", flush=True)
    return 1 if totals.failed else 0


if __name__ == "__main__":
    sys.exit(main())
