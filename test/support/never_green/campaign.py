"""The campaign of the safety argument: random combinations of harmed inputs, none of which may look too safe.

    PYTHONPATH=test/support:. python -m never_green.campaign --count 2000      all seeds from 0 on
    PYTHONPATH=test/support:. python -m never_green.campaign --first 17 --count 1 --words    one, in words

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
"""In place of kinds of defects: only combinations without a defect, which are every tenth seed from 0 on."""


def failures_of(verdict: Verdict) -> list[str]:
    """Return what is wrong with a verdict, as sentences; empty if the node was never too green, nor wrong."""
    greens = [
        f"{each.at:g} s: {'evidence' if each.is_masked else 'level'} {each.shown}, true is {each.true}"
        for each in verdict.greens
    ]
    closed = ["the bridge closed its contact"] if verdict.contact_closed else []
    return [*greens, *closed, *verdict.wrong]


def words_of(verdict: Verdict) -> str:
    """Return a line on a verdict: its seed, its defects and its failures."""
    failures = failures_of(verdict)
    defects = ", ".join(verdict.plan.defects) or "no defect"
    more = f" and {len(failures) - 1} more" if len(failures) > 1 else ""
    return f"seed {verdict.seed} ({defects}; true up to {verdict.worst}): {failures[0] if failures else 'well'}{more}"


def verdicts(seeds: Sequence[int], workers: int, kinds: Sequence[str]) -> Iterable[Verdict]:
    """Yield the verdict of each seed, in any order; kinds : of defects."""
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
    """Return a verdict without messages, which other processes cannot receive."""
    return verdict._replace(plan=verdict.plan._replace(sends=()))


class Totals:
    """The counts of a campaign."""

    def __init__(self) -> None:
        """Begin without combinations."""
        self.seeds: list[int] = []
        self.failed: list[Verdict] = []
        self.of_defect, self.found = Counter[str](), Counter[str]()
        self.several = self.clean = self.cautious = 0
        self.clean_s = self.clean_fault_s = 0.0

    def add(self, verdict: Verdict) -> None:
        """Count a verdict."""
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
        """Return the counts as text."""
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
        seeds = range(asked.first, asked.first + 10 * asked.count, 10)
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
