"""The thread that flies rocks: it answers sources, refines answers, and changes the terrain between flights.

One thread does all these tasks, so that a patch never changes the terrain below a rock in flight.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.answers import Answer, EnsembleSize, answers
from rpf3d_core.live.outlines import outline_digest
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.answer_schedule import AnswerSchedule
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.published_answers import PublishedAnswers
from rpf3d_ros.engine.waiting_sources import WaitingSources
from rpf3d_ros.messages.refusals import report_error

Change = Callable[[PreparedTerrain], PreparedTerrain]
"""A function that changes the terrain: it receives the prepared terrain, and returns the changed prepared terrain.

The old prepared terrain must not be used again.
"""


class FlightListener(Protocol):
    """Receives answers and reports from the thread that flies rocks."""

    def answered(self, answer: Answer) -> None:
        """Publish an answer; return only when the next rocks may fly."""

    def unanswerable(self, trigger: Trigger, why: str) -> None:
        """Report why the sources of a message get no answer."""

    def groundless(self, trigger: Trigger) -> None:
        """Report that sources get no answer, because there is no terrain yet."""

    def failed(self, error: BaseException, trigger: Trigger | None = None) -> None:
        """Report an unforeseen error, and the trigger that has no answer because of it; None if no trigger is known."""


@dataclass(eq=False)
class Handover:
    """A request to the flying thread to change the terrain; `done` is set when the change is made or refused.

    ready : the new prepared terrain; None if `change` changes the current terrain
    change : changes the current terrain; None if `ready` replaces the current terrain
    error : the exception that refused the change, None if the change was made
    standing : the prepared terrain after the change
    """

    ready: PreparedTerrain | None
    change: Change | None
    done: threading.Event
    error: BaseException | None = None
    standing: PreparedTerrain | None = None


class Flyer:
    """Simulates rocks on a separate thread to answer triggers (the sources of one message each).

    `AnswerSchedule` gives the order of the answers.

    standing : (attribute) the prepared terrain in use; None if there is none
    """

    def __init__(
        self, spread: ReleaseSpread, size: EnsembleSize, sources: WaitingSources, results: Iterator[int],
        listener: FlightListener, answered: AnsweredSources | None = None,
    ) -> None:  # fmt: skip
        """Start the thread; nothing is answered before `activate`.

        spread : distribution of the rocks around each source; size : number of rocks of an answer, and size of clusters
        sources : the queue of triggers; results : yields a number for each result, that is for each stage of an answer
        answered : keeps the triggers that are answered again after a change; None for the latest trigger only
        """
        self._spread, self._size, self._results, self._listener = spread, size, results, listener
        answered = answered or AnsweredSources()
        self._schedule, self._published = AnswerSchedule(sources, answered), PublishedAnswers(answered)
        self._handovers: list[Handover] = []
        self._changed = threading.Condition()
        self._closed = self._active = False
        self._areas: Mapping[str, Outlines] = {}
        self._areas_flown = self._areas
        self._stages: Iterator[Answer] | None = None
        self.standing: PreparedTerrain | None = None
        self._thread = threading.Thread(target=self._run, name="rpf3d flyer", daemon=True)
        self._thread.start()

    def submit(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in the queue; return the trigger of another wall that a full queue drops, else None.

        A dropped trigger is answered after all waiting triggers.
        """
        with self._changed:
            self._changed.notify()
            return self._schedule.submit(trigger)

    def end_unreported(self, topic: str) -> None:
        """Forget the places that a topic no longer reports: they are not answered again."""
        with self._changed:
            self._schedule.end_unreported(topic)

    def hand_over(self, ready: PreparedTerrain | None = None, change: Change | None = None) -> Handover:
        """Ask for a change of the terrain, wait until the new terrain is in use, and return the completed request.

        ready, change : as in `Handover`; give one of the two

        Raises the exceptions of the change. Raises InputError if the flyer is closed, or if there is no terrain to
        change.
        """
        handover = Handover(ready=ready, change=change, done=threading.Event())
        with self._changed:
            self._handovers.append(handover)
            self._changed.notify()
        while not handover.done.wait(0.1):
            if self._closed:
                raise InputError("the node is being shut down")
        if handover.error is not None:
            raise handover.error
        return handover

    def set_areas(self, topic: str, outlines: Outlines) -> None:
        """Replace the areas of interest of a topic (outlines in the map frame), and answer the last sources again."""
        with self._changed:
            self._areas = {**self._areas, topic: outlines}
            self._schedule.answer_again()
            self._changed.notify()

    @property
    def outlines(self) -> dict[str, str]:
        """The digest of the current outline of each area of interest, by name: areas of the scene, then live areas.

        Without terrain, only the live areas.
        """
        with self._changed:
            standing, areas = self.standing, self._live_areas()
        if standing is not None:
            return standing.digests_with(areas)
        return {name: outline_digest(rings) for name, rings in areas.items()}

    @property
    def terrain_digest(self) -> str:
        """The digest of the terrain in use; "" without terrain."""
        standing = self.standing
        return "" if standing is None else standing.ground.digest

    def _live_areas(self) -> Outlines:
        return {name: rings for outlines in self._areas.values() for name, rings in outlines.items()}

    @property
    def has_trigger(self) -> bool:
        """True if a message of sources was received and is not forgotten; the message may contain no source."""
        return self._schedule.has_trigger

    def activate(self) -> None:
        """Begin to answer sources."""
        with self._changed:
            self._active = True
            self._changed.notify()

    def deactivate(self) -> None:
        """Stop answering, and forget all triggers and the current answer."""
        with self._changed:
            self._active = self._schedule.repeats = False
            self._forget()
            self._changed.notify()

    def forget(self) -> None:
        """Forget all triggers and the current answer, because the stamps of the triggers are no longer valid."""
        with self._changed:
            self._forget()

    def while_known(self, trigger: Trigger, do: Callable[[], None]) -> bool:
        """Call `do` if a trigger that was flown is not forgotten, and return True if so.

        `forget` and `deactivate` wait until `do` has returned. So `do` can pass on what is only valid before them.
        """
        with self._changed:
            is_known = self._active and self._schedule.current is trigger
            if is_known:
                do()
        return is_known

    def _forget(self) -> None:
        self._schedule.forget()
        self._published.clear()
        self._stages = None

    def close(self, timeout: float) -> bool:
        """Stop; wait at most `timeout` (s) for the thread. Return True if the thread has ended."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while not self._closed:
            try:
                self._step()
            except Exception as error:
                self._stages = None
                self._schedule.finish()
                report_error(partial(self._listener.failed, trigger=self._schedule.current), error)

    def _step(self) -> None:
        """Wait for work and do one task: a change of terrain first, then new sources, then a refinement."""
        with self._changed:
            self._changed.wait_for(self._has_work)
            if self._closed:
                return
            handover = self._handovers.pop(0) if self._handovers else None
            begin = None if handover or not self._active else self._schedule.next_trigger()
        if handover is not None:
            self._take_over(handover)
        elif begin is not None:
            self._begin(begin)
        elif self._stages is not None:
            self._refine()

    def _has_work(self) -> bool:
        is_busy = self._active and (self._stages is not None or self._schedule.has_next)
        return bool(self._closed or self._handovers or is_busy)

    def _take_over(self, handover: Handover) -> None:
        try:
            standing = handover.ready
            if handover.change is not None:
                standing = self._changed_by(handover.change)
            self.standing = handover.standing = standing
            self._published.clear()
            self._schedule.answer_again()
        except Exception as error:
            handover.error = error
        finally:
            handover.done.set()

    def _changed_by(self, change: Change) -> PreparedTerrain:
        """Return the prepared terrain after a change.

        If the change raises a TerrainError, the terrain in use is unchanged. After any other error the node has no
        terrain, because the arrays of the terrain may be changed in part.
        """
        if self.standing is None:
            raise InputError("there is no terrain yet for this patch")
        try:
            return change(self.standing)
        except TerrainError:
            raise  # refused before any change
        except Exception:
            self.standing = self._stages = None  # the arrays may have changed, so no rock may fly over them
            self._schedule.answer_again()
            raise

    def _begin(self, trigger: Trigger) -> None:
        """Begin to answer a trigger, unless the trigger was forgotten after it was taken from the queue."""
        with self._changed:
            if self._schedule.current is not trigger:
                return
            standing, self._stages = self.standing, None
            self._schedule.begin(trigger, can_answer=standing is not None)
            self._areas_flown = self._areas
            if standing is not None:
                self._stages = answers(
                    standing, trigger, self._spread, self._live_areas(), self._size, self._is_overtaken, self._results
                )
        if standing is None:
            self._listener.groundless(trigger)
        self._refine()

    def _refine(self) -> None:
        """Fly the next stage of the current answer, and publish it unless an answer with more rocks was published.

        Refused sources are reported as unanswerable.
        """
        stages, trigger = self._stages, self._schedule.current
        if stages is None or trigger is None:
            return
        try:
            answer = next(stages, None)
        except InputError as refusal:
            self._schedule.finish()
            if self._goes_on(stages, ended=True):
                self._listener.unanswerable(trigger, str(refusal))
            return
        if answer is None:
            if self._goes_on(stages, ended=True):
                self._schedule.repeats = True
        elif self._goes_on(stages, answer.complete):
            self._schedule.progress(trigger, answer.complete)
            if self._published.note(trigger, self._areas_flown, answer.rocks):
                self._listener.answered(answer)

    def _goes_on(self, stages: Iterator[Answer], ended: bool) -> bool:
        """True if the stage that was just flown may be published: the flyer is active, and the answer is not forgotten.

        If the answer has ended, its iterator is dropped.

        stages : the iterator that flew the stage; ended : True if the answer has no further stage
        """
        with self._changed:
            if self._stages is not stages:
                return False
            if ended:
                self._stages = None
            return self._active and not self._closed

    def _is_overtaken(self, stage: int) -> bool:
        """True if the flight of a stage must stop, because other work waits or the flyer is no longer active.

        The first stage is flown even if other work waits. Otherwise a flood of triggers would never be answered.

        stage : number of the stage, from 0
        """
        if self._closed or not self._active:
            return True
        return stage > 0 and bool(self._handovers or self._schedule.has_new or self._schedule.repeats)
