"""Make the table of outcomes of a run as text, for the terminal and for the page of `rpf3d desk`."""

from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.hazard.benches import SHORT, in_percent, share_text, with_predictive
from rpf3d_core.results.findings import Run, sentence_of
from rpf3d_core.values import UNSTOPPED, Outcome

HEADER = ("outcome", "rocks", "share", "meaning")


def outcome_rows(run: Run) -> list[tuple[str, ...]]:
    """Return a row of text for each outcome that occurred: name, number of rocks, share and meaning (HEADER).

    A share is shown with its sampling interval, such as `88.2 % (87-89)`. In a run over parameter sets, the predictive
    interval comes first: `88.2 % (81-94; 87-89)`.
    """
    found = [(outcome, rocks) for outcome in Outcome if (rocks := run.totals.outcomes[outcome])]
    return [
        (outcome.name.lower(), f"{rocks:,}", _share(run, outcome, rocks), sentence_of(outcome, run.scene))
        for outcome, rocks in found
    ]


def _share(run: Run, outcome: Outcome, rocks: int) -> str:
    """Return the share of rocks with an outcome, and its intervals, as text; rocks : number of these rocks."""
    share, sets = share_of(rocks, run.totals.rocks), run.maps.sets
    return share_text(share if sets is None else with_predictive(share, *sets.outcome(outcome)))


def words_on_unstopped(run: Run) -> str:
    """Return a warning with the number of rocks that did not stop on the terrain; "" if all stopped.

    Broken rocks do not count, because their fragments are counted.
    """
    totals = run.totals
    rocks = sum(totals.outcomes[each] for each in UNSTOPPED)
    if not rocks:
        return ""
    return (f"{rocks:,} of {totals.rocks:,} rocks ({in_percent(rocks / totals.rocks, SHORT)} %) did not stop on the "
            "terrain: they count in no share of stopped rocks")  # fmt: skip
