"""The thread that owns the ground: it takes over new ground, applies patches, answers triggers and refines answers.

One thread does all of these, so that a patch never changes the ground under a rock in flight.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.answers import Answer, EnsembleSize, answers
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_core.scene.model import Scene
from rpf3d_ros.engine.answered import AnsweredSources
from rpf3d_ros.engine.intake import WaitingSources
from rpf3d_ros.messages.refusals import report_error

Change = Callable[[PreparedTerrain], PreparedTerrain]
"""Change the ground of a prepared terrain and return the new one; the old one must not be flown over any more."""


class FlightListener(Protocol):
    """Receives the results of flights, on the flyer's thread."""

    def answered(self, answer: Answer) -> None:
        """Publish an answer before returning."""

    def unanswerable(self, trigger: Trigger, why: str) -> None:
        """Report that a trigger has no answer, and why."""

    def groundless(self, trigger: Trigger) -> None:
        """Report that there is no ground to fly a trigger over."""

    def failed(self, error: BaseException) -> None:
        """Report an unforeseen error."""


@dataclass(eq=False)
class Handover:
    """A change of ground for the flyer; `done` is set when the change has been made or refused.

    ready : a prepared terrain; None if the present one is changed by `change`
    error : why the change was refused, None if it was made; standing : the prepared terrain after the change
    """

    ready: PreparedTerrain | None
    change: Change | None
    done: threading.Event
    error: BaseException | None = None
    standing: PreparedTerrain | None = None


class AnsweredTrigger(NamedTuple):
    """What has been published for a trigger over the present ground: for which areas, and of how many rocks."""

    trigger: Trigger
    areas: Mapping[str, Outlines]
    rocks: int


class Flyer:
    """Answers triggers over the present ground, on one thread.

    A new trigger ends the refinement of the last one. So does a change of ground or of areas, after which the last
    trigger of each region is answered again, the newest last. A refinement that another wall's trigger has interrupted
    is completed afterwards.
    """

    def __init__(
        self, scene: Scene, around: ReleaseSpread, first_rocks: int, sources: WaitingSources, results: Iterator[int],
        listener: FlightListener, answered: AnsweredSources | None = None, least_rocks: int = 0,
    ) -> None:  # fmt: skip
        """Start the thread; nothing is answered before `activate`.

        first_rocks : rocks of the first stage; least_rocks : rocks to fly in all, even if the target is met earlier
        """
        self._scene, self._around, self._first, self._least = scene, around, first_rocks, least_rocks
        self._sources, self._results, self._listener = sources, results, listener
        self._handovers: list[Handover] = []
        self._changed = threading.Condition()
        self._answered = answered or AnsweredSources()
        self._again: list[Trigger] = []
        self._closed = self._active = self._anew = self._outdated = False
        self._areas: Mapping[str, Outlines] = {}
        self._areas_flown = self._areas
        self._told: list[AnsweredTrigger] = []
        self._stages: Iterator[Answer] | None = None
        self._trigger: Trigger | None = None
        self._unfinished: Trigger | None = None
        self._left: list[Trigger] = []
        self._finishing = False
        self._latest: Trigger | None = None
        self.standing: PreparedTerrain | None = None
        self._thread = threading.Thread(target=self._run, name="rpf3d flyer", daemon=True)
        self._thread.start()

    def submit(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in line; return the trigger of another wall that is pushed out for lack of room, or None.

        A trigger that is pushed out is answered after all waiting triggers.
        """
        with self._changed:
            self._changed.notify()
            pushed_out = self._sources.put(trigger)
            if pushed_out is not None:
                self._answered.note(self._sources.region_of(pushed_out), pushed_out)
                self._left.append(pushed_out)
            return pushed_out

    def hand_over(self, ready: PreparedTerrain | None = None, change: Change | None = None) -> Handover:
        """Give the flyer new ground, or a change of its present ground, and wait until the flyer has taken it over.

        Raises whatever the change raises; the ground is then unchanged. Raises InputError if the flyer is closed, or if
        there is no ground to change.
        """
        handover = Handover(ready, change, threading.Event())
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
        """Replace the live areas of a topic, map frame, and answer the last triggers again."""
        with self._changed:
            self._areas = {**self._areas, topic: outlines}
            self._anew = self._outdated = True
            self._changed.notify()

    @property
    def has_trigger(self) -> bool:
        """True if any sources have been received, including a message without sources."""
        return self._latest is not None or len(self._sources) > 0

    def activate(self) -> None:
        """Start to answer."""
        with self._changed:
            self._active = True
            self._changed.notify()

    def deactivate(self) -> None:
        """Stop answering, and forget all waiting triggers."""
        with self._changed:
            self._active, self._anew = False, False
            self._forget()
            self._changed.notify()

    def forget(self) -> None:
        """Forget the last triggers, because their stamps are no longer valid."""
        with self._changed:
            self._forget()

    def _forget(self) -> None:
        self._sources.clear()
        self._answered.clear()
        self._again, self._left, self._told, self._outdated = [], [], [], False
        self._stages = self._trigger = self._unfinished = self._latest = None

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
                self._stages = self._unfinished = None
                report_error(self._listener.failed, error)

    def _step(self) -> None:
        """Wait for work and do one piece of it: changes of ground first, then triggers, then refinements."""
        with self._changed:
            self._changed.wait_for(self._has_work)
            if self._closed:
                return
            handover = self._handovers.pop(0) if self._handovers else None
            begin = None if handover else self._next_trigger()
        if handover is not None:
            self._take_over(handover)
        elif begin is not None:
            self._begin(begin)
        elif self._stages is not None:
            self._refine()

    def _has_work(self) -> bool:
        waits = self._again or self._wants_anew() or self._to_be_finished()
        busy = self._stages is not None or len(self._sources) or waits
        return bool(self._closed or self._handovers or (self._active and busy))

    def _wants_anew(self) -> bool:
        """True if the newest trigger must be answered, again or finally, because it is the one shown in the end."""
        ends_another = self._finishing and (self._unfinished is not None or self._to_be_finished() is not None)
        return self._latest is not None and (self._anew or (self._trigger is not self._latest and not ends_another))

    def _next_trigger(self) -> Trigger | None:
        """Return the trigger to begin with, None if there is none.

        The latest trigger comes again if the ground or the areas have changed, or another trigger was answered since.
        """
        if not self._active:
            return None
        if self._outdated and self._latest is not None:
            self._again, self._outdated = self._answered.beside(self._latest), False
        finishing, trigger = False, self._sources.take()
        if trigger is not None:
            self._answered.note(self._sources.region_of(trigger), trigger)
            if self._latest is None or trigger.stamp_ns >= self._latest.stamp_ns:
                self._latest = trigger
        else:
            trigger = self._answered_before() or (self._latest if self._wants_anew() else None)
            if trigger is None:
                trigger = self._to_be_finished()
                finishing = trigger is not None
        if trigger is not None:
            self._set_aside(trigger)
            self._trigger, self._finishing = trigger, finishing
        return trigger

    def _set_aside(self, trigger: Trigger) -> None:
        """Keep the trigger that another trigger interrupts, so that its answer can be completed."""
        left = self._left if self._unfinished is None else [*self._left, self._unfinished]
        self._left = [each for each in left if each is not trigger and self._answered.holds(each)]

    def _to_be_finished(self) -> Trigger | None:
        """Return an interrupted trigger of another wall that is not too old, None if there is none."""
        if self._unfinished is not None or self._latest is None:
            return None
        beside = self._answered.beside(self._latest)
        return next((each for each in self._left if any(each is one for one in beside)), None)

    def _answered_before(self) -> Trigger | None:
        """Return the next trigger to answer again in addition to the latest; replaced triggers are skipped."""
        self._again = [trigger for trigger in self._again if self._answered.holds(trigger)]
        return self._again.pop(0) if self._again else None

    def _take_over(self, handover: Handover) -> None:
        try:
            standing = handover.ready
            if handover.change is not None:
                standing = self._changed_by(handover.change)
            self.standing = handover.standing = standing
            self._told = []
            self._anew = self._outdated = True
        except Exception as error:
            handover.error = error
        finally:
            handover.done.set()

    def _changed_by(self, change: Change) -> PreparedTerrain:
        """Return the prepared terrain after a change of the ground; none remains if the change fails halfway."""
        if self.standing is None:
            raise InputError("there is no terrain yet that it could change")
        try:
            return change(self.standing)
        except TerrainError:
            raise  # refused before any change
        except Exception:
            self.standing = self._stages = None  # the arrays may have changed, so no rock may fly over them
            self._anew = self._outdated = True
            raise

    def _begin(self, trigger: Trigger) -> None:
        """Answer a trigger, unless the trigger has been forgotten since it was taken."""
        with self._changed:
            if self._trigger is not trigger:
                return
            self._anew, self._stages, standing = False, None, self.standing
            self._unfinished = None if standing is None else trigger
            self._areas_flown = self._areas
            areas = {name: rings for outlines in self._areas.values() for name, rings in outlines.items()}
            if standing is not None:
                size = EnsembleSize(self._first, self._least)
                self._stages = answers(standing, trigger, self._around, areas, size, self._is_overtaken, self._results)
        if standing is None:
            self._listener.groundless(trigger)
        self._refine()

    def _refine(self) -> None:
        """Fly the next stage of the current trigger."""
        stages, trigger = self._stages, self._trigger
        if stages is None or trigger is None:
            return
        try:
            answer = next(stages, None)
        except InputError as refusal:
            self._unfinished = None
            if self._goes_on(stages, ended=True):
                self._listener.unanswerable(trigger, str(refusal))
            return
        if answer is None:
            self._anew = self._goes_on(stages, ended=True) or self._anew
        elif self._goes_on(stages, answer.complete):
            self._unfinished = None if answer.complete else trigger
            if self._is_news(trigger, answer):
                self._listener.answered(answer)

    def _is_news(self, trigger: Trigger, answer: Answer) -> bool:
        """True unless an answer with more rocks was published for the same trigger, ground and areas.

        An answer that begins again begins with few rocks.
        """
        areas = self._areas_flown
        if any(each.trigger is trigger and each.areas is areas and each.rocks > answer.rocks for each in self._told):
            return False
        others = (each for each in self._told if each.trigger is not trigger and self._answered.holds(each.trigger))
        self._told = [*others, AnsweredTrigger(trigger, areas, answer.rocks)]
        return True

    def _goes_on(self, stages: Iterator[Answer], ended: bool) -> bool:
        """True if the stage just flown still counts, because its trigger has not been forgotten meanwhile."""
        with self._changed:
            if self._stages is not stages:
                return False
            if ended:
                self._stages = None
            return self._active and not self._closed

    def _is_overtaken(self, stage: int) -> bool:
        """True if a stage must be given up.

        The first stage is flown whatever else waits, or a flood of triggers would never be answered.
        """
        if self._closed or not self._active:
            return True
        return stage > 0 and bool(self._handovers or len(self._sources) or self._anew)
