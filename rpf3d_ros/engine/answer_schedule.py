"""Choose the trigger that is answered next: new ones first, then valid ones again, then interrupted ones."""

from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.waiting_sources import WaitingSources


class AnswerSchedule:
    """The order in which triggers are answered.

    A new trigger ends the refinement of the last one. So does a change of ground or of areas, after which the last
    trigger of each region is answered again, the newest last. A refinement that another wall's trigger has interrupted
    is completed afterwards.

    The flyer calls every method with its lock, except `progress` and `finish`, which only its own thread calls.

    current : the trigger that is being answered or was answered last, None if there is none
    repeats : whether the latest trigger must be answered again
    """

    def __init__(self, sources: WaitingSources, answered: AnsweredSources) -> None:
        self._sources, self._answered = sources, answered
        self.current: Trigger | None = None
        self.repeats = self._outdated = self._finishing = False
        self._latest: Trigger | None = None
        self._unfinished: Trigger | None = None
        self._again: list[Trigger] = []
        self._interrupted: list[Trigger] = []

    def submit(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in line; return the trigger of another wall that is pushed out for lack of room, or None.

        A trigger that is pushed out is answered after all waiting triggers.
        """
        pushed_out = self._sources.put(trigger)
        if pushed_out is not None:
            self._answered.note(self._sources.region_of(pushed_out), pushed_out)
            self._interrupted.append(pushed_out)
        return pushed_out

    @property
    def has_trigger(self) -> bool:
        """True if any sources have been received, including a message without sources."""
        return self._latest is not None or self.has_new

    @property
    def has_new(self) -> bool:
        """True if a new trigger waits."""
        return len(self._sources) > 0

    @property
    def has_next(self) -> bool:
        """True if a trigger waits to be answered for the first time, again or completely."""
        return bool(self.has_new or self._again or self._wants_latest() or self._to_be_completed())

    def answer_again(self) -> None:
        """Schedule the last trigger of each region again, because the ground or the areas have changed."""
        self.repeats = self._outdated = True

    def forget(self) -> None:
        """Forget all triggers."""
        self._sources.clear()
        self._answered.clear()
        self._again, self._interrupted, self._outdated = [], [], False
        self.current = self._unfinished = self._latest = None

    def next_trigger(self) -> Trigger | None:
        """Return the trigger to begin with, None if there is none.

        The latest trigger comes again if the ground or the areas have changed, or another trigger was answered since.
        """
        if self._outdated and self._latest is not None:
            self._again, self._outdated = self._answered.others(self._latest), False
        finishing, trigger = False, self._sources.take()
        if trigger is not None:
            self._answered.note(self._sources.region_of(trigger), trigger)
            if self._latest is None or trigger.stamp_ns >= self._latest.stamp_ns:
                self._latest = trigger
        else:
            trigger = self._next_again() or (self._latest if self._wants_latest() else None)
            if trigger is None:
                trigger = self._to_be_completed()
                finishing = trigger is not None
        if trigger is not None:
            self._set_aside(trigger)
            self.current, self._finishing = trigger, finishing
        return trigger

    def begin(self, trigger: Trigger, can_answer: bool) -> None:
        """Note that the work on a trigger begins; can_answer : whether there is ground to answer on."""
        self.repeats = False
        self._unfinished = trigger if can_answer else None

    def progress(self, trigger: Trigger, complete: bool) -> None:
        """Note that a stage of a trigger's answer has been flown, the last one if it is complete."""
        self._unfinished = None if complete else trigger

    def finish(self) -> None:
        """Note that the current trigger gets no further answer."""
        self._unfinished = None

    def _wants_latest(self) -> bool:
        """True if the newest trigger must be answered, again or finally, because it is the one shown in the end."""
        ends_another = self._finishing and (self._unfinished is not None or self._to_be_completed() is not None)
        return self._latest is not None and (self.repeats or (self.current is not self._latest and not ends_another))

    def _set_aside(self, trigger: Trigger) -> None:
        """Keep the trigger that another trigger interrupts, so that its answer can be completed."""
        kept = self._interrupted if self._unfinished is None else [*self._interrupted, self._unfinished]
        self._interrupted = [each for each in kept if each is not trigger and self._answered.holds(each)]

    def _to_be_completed(self) -> Trigger | None:
        """Return an interrupted trigger of another wall that is not too old, None if there is none."""
        if self._unfinished is not None or self._latest is None:
            return None
        others = self._answered.others(self._latest)
        return next((each for each in self._interrupted if any(each is one for one in others)), None)

    def _next_again(self) -> Trigger | None:
        """Return the next trigger to answer again in addition to the latest; replaced triggers are skipped."""
        self._again = [trigger for trigger in self._again if self._answered.holds(trigger)]
        return self._again.pop(0) if self._again else None
