"""Fly the rounds of a calibration until enough is known, the time is over, or the user interrupts."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.flying import Flown, Slope, fly_sets, observed_of, workers_of
from rpf3d_core.calibration.normal_space import values_of
from rpf3d_core.calibration.reserve import Pace, Reserve, first_reserve
from rpf3d_core.calibration.sampling import (
    ENOUGH,
    MOST_ROUNDS,
    FlownRound,
    Posterior,
    Proposed,
    drawn_sets,
    first_proposal,
    is_enough,
    posterior_of,
    sets_of_round,
    with_next,
)
from rpf3d_core.calibration.state import KeptSets, drop_parts, read_round, save_part
from rpf3d_core.materials.distributions import Distribution

FloatArray = NDArray[np.float64]

SAVED_EVERY = 5.0
"""Time (s) after which the sets flown since the last file are written to disk."""


class Status(NamedTuple):
    """The progress of a calibration.

    sets : number of flown sets; round : number of the round, from 0; effective : effective samples, None if unknown
    left_s : s, estimated remaining time of flights
    """

    sets: int
    round: int
    effective: float | None
    left_s: float


class Control(NamedTuple):
    """Time limit of a calibration, number of threads, and functions that report progress and stop the calibration.

    deadline : `time.monotonic()` at which everything must be written
    began : `time.monotonic()` at the start of the budget; None if the budget starts with the first round
    progress : called with a `Status` after each flown set
    stop : returns True after Ctrl-C; threads : number of threads, None for one per core
    """

    deadline: float
    progress: Callable[[Status], None] = lambda _: None
    stop: Callable[[], bool] = lambda: False
    threads: int | None = None
    began: float | None = None


class Result(NamedTuple):
    """All flown sets of a calibration, with the posterior and the proposals of all rounds.

    flown : the sets in the order in which they were drawn; numbers : number of the round of each set
    power : power of the likelihood with which the last proposal was made; 1 for the full likelihood
    """

    posterior: Posterior
    proposed: Proposed
    flown: list[Flown]
    numbers: list[int]
    power: float

    @property
    def rounds(self) -> int:
        """Number of rounds; the last round may be incomplete."""
        return max(self.numbers) + 1

    @property
    def is_complete(self) -> bool:
        """True if all rounds are flown, including the whole last round, so that more time adds nothing."""
        last = self.rounds - 1
        return last == MOST_ROUNDS - 1 and self.numbers.count(last) == sets_of_round(last, self.posterior.z.shape[1])


def fly_rounds(
    slope: Slope, priors: list[Distribution], seed: int, state: Path, control: Control,
    ending: Callable[[Result], float] | None = None,
) -> Result | None:  # fmt: skip
    """Fly round after round, and return all sets; None if no set flew before the deadline or an interruption.

    Sets that are on disk in the folder `state` are part of the result, and are not flown again. New sets are written
    into this folder. Raise InputError if a file in this folder is damaged.

    priors : of the unknowns; seed : of the proposals; state : folder of the flown sets
    control : deadline, progress reports, interruption and threads
    ending : function that does the work after the flights (scores, pictures, files) and returns the time (s) for the
        files; called at most once, between two rounds, to measure this work. None to reserve a fixed part of the budget
    """
    observed, proposed = observed_of(slope), first_proposal(len(priors))
    rounds, flown, numbers, posterior = list[FlownRound](), list[Flown](), list[int](), None
    reserve = first_reserve(control.began or time.monotonic(), control.deadline)
    pace = Pace(workers_of(slope, control.threads))

    def whole() -> Result:
        so_far = posterior_of(proposed, rounds, observed, seed)
        return Result(posterior=so_far, proposed=proposed, flown=flown, numbers=numbers, power=proposed.power)

    for number in range(MOST_ROUNDS):
        z = drawn_sets(proposed, number, seed)
        until = control.deadline - reserve.seconds(len(flown) + len(z))
        tell = _teller(control, len(flown), number, posterior, until)
        stop = _either(control.stop, pace, until)
        one = _fly_round(slope, priors, z, number, state, control._replace(stop=stop), _counting(pace, tell))
        if not one:
            break
        rounds.append(FlownRound(z=z[: len(one)], densities=np.stack([each.densities for each in one])))
        flown, numbers = [*flown, *one], [*numbers, *[number] * len(one)]
        proposed = with_next(proposed, rounds, observed, seed)
        if len(one) < len(z):
            break
        posterior = posterior_of(proposed, rounds, observed, seed) if proposed.power == 1.0 else None
        if posterior is not None and is_enough(posterior, proposed.power):
            break
        if ending is not None and reserve.should_measure(time.monotonic()):
            reserve = _measured(reserve, len(flown), lambda: ending(whole()))
    return whole() if rounds else None


def _either(stop: Callable[[], bool], pace: Pace, until: float) -> Callable[[], bool]:
    """Return a function that returns True if no further parameter set may start.

    The reason is an interruption, or that a set that starts now would end too late.

    stop : returns True after an interruption; pace : the time that a set takes
    until : `time.monotonic()` by which a set must end
    """
    return lambda: stop() or pace.is_too_late(until)


def _counting(pace: Pace, tell: Callable[[int], None]) -> Callable[[int], None]:
    """Start to measure the time of a round, and return a function that the caller must call after each flown set.

    The argument of this function is the number of sets of the round flown so far. The function counts the set in `pace`
    and reports the number.

    pace : measures the time of a set; tell : reports the number
    """
    pace.begin()

    def count(sets: int) -> None:
        pace.count()
        tell(sets)

    return count


def _measured(reserve: Reserve, sets: int, end: Callable[[], float]) -> Reserve:
    """Do the work that follows the flights (scores, pictures, files), and return the reserve with its times (s).

    reserve : the time that is kept back for this work at the end of the budget
    sets : number of flown sets; end : does the work, and returns the time (s) for the files of the result
    """
    began = time.monotonic()
    files_s = end()
    return reserve._replace(scores_s=time.monotonic() - began - files_s, files_s=files_s, sets=sets)


def _teller(
    control: Control, before: int, number: int, posterior: Posterior | None, until: float
) -> Callable[[int], None]:
    """Return a function that reports the progress of a round; its argument is the number of flown sets of this round.

    before : number of sets of earlier rounds; number : number of the round, from 0
    posterior : from the earlier rounds, None if it is not known yet
    until : `time.monotonic()` at which the flights must end
    """
    began = time.monotonic()
    effective = None if posterior is None else posterior.effective

    def tell(sets: int) -> None:
        now = time.monotonic()
        left = until - now
        if posterior is not None and sets:
            missing = max(len(posterior.z) * (ENOUGH / posterior.effective - 1.0), 100.0) - sets
            left = min(left, max(missing, 0.0) * (now - began) / sets)
        control.progress(Status(sets=before + sets, round=number, effective=effective, left_s=max(left, 0.0)))

    return tell


def _fly_round(
    slope: Slope, priors: list[Distribution], z: FloatArray, number: int, state: Path, control: Control,
    tell: Callable[[int], None],
) -> list[Flown]:  # fmt: skip
    """Fly the parameter sets of a round that are not on disk yet, and return all flown sets of the round, in order.

    The result has fewer than S sets if the time was too short or the user interrupted. New sets are written to disk.
    Raise InputError if a file of the round is damaged.

    priors : of the U unknowns; z : (S, U) unknowns of each set as standard normal numbers (`normal_space`)
    number : number of the round, from 0; state : folder of the flown sets
    tell : called with the number of flown sets of this round, including sets from disk
    """
    kept, part = read_round(state, number, z.shape[1])
    done, unsaved, saved = list(kept.flown), list[Flown](), time.monotonic()
    rest = z[len(done) :]
    if len(rest):
        drop_parts(state, number, part)
    for one in fly_sets(slope, values_of(priors, rest), number, control.stop, control.threads) if len(rest) else ():
        unsaved.append(one)
        done.append(one)
        tell(len(done))
        if time.monotonic() - saved > SAVED_EVERY:
            save_part(state, number, part, KeptSets(z[len(done) - len(unsaved) : len(done)], unsaved))
            part, unsaved, saved = part + 1, [], time.monotonic()
    if unsaved:
        save_part(state, number, part, KeptSets(z[len(done) - len(unsaved) : len(done)], unsaved))
    return done
