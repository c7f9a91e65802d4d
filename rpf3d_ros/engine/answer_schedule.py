"""Choose which sources are answered next: new sources, then sources to answer again, then interrupted answers."""

from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.waiting_sources import WaitingSources, unreported_region


class AnswerSchedule:
    """The order in which triggers (the sources of one message each) are answered.

    The refinement of an answer, that is its later stages, ends when a new trigger arrives, or when the terrain or the
    areas change. After such a change, the last trigger of each region is answered again, the newest trigger last. If
    changes come faster than the answers, the triggers take turns, so that none waits for ever. If a trigger of another
    wall has interrupted a refinement, this refinement is completed afterwards.

    The flyer (`Flyer`, the thread that flies rocks) holds its lock while it calls a method, except for `progress` and
    `finish`, which only its own thread calls. Properties and attributes may be read without the lock.

    current : the trigger that is being answered or was answered last, None if there is none
    repeats : True if the latest trigger must be answered again
    """

    def __init__(self, sources: WaitingSources, answered: AnsweredSources) -> None:
        self._sources, self._answered = sources, answered
        self.current: Trigger | None = None
        self.repeats = self._outdated = self._finishing = False
        self._latest: Trigger | None = None
        self._shown: Trigger | None = None  # the last trigger whose answer is published
        self._unfinished: Trigger | None = None
        self._again: list[Trigger] = []
        self._interrupted: list[Trigger] = []

    def submit(self, trigger: Trigger) -> Trigger | None:
        """Put a trigger in the queue; return the trigger of another wall that a full queue drops, else None.

        A dropped trigger is answered after all waiting triggers.
        """
        pushed_out = self._sources.put(trigger)
        if pushed_out is not None:
            self._answered.note(self._sources.region_of(pushed_out), pushed_out)
            kept = [*self._interrupted, pushed_out]
            self._interrupted = [each for each in kept if self._answered.holds(each)]
        return pushed_out

    def end_unreported(self, topic: str) -> None:
        """Forget the places that a topic no longer reports, because they are reported again or have been acknowledged.
        """
        self._sources.remove(unreported_region(topic))
        self._answered.end(unreported_region(topic))

    @property
    def has_trigger(self) -> bool:
        """True if a message of sources was received and is not forgotten; the message may contain no source."""
        return self._latest is not None or self.has_new

    @property
    def has_new(self) -> bool:
        """True if a new trigger waits."""
        return len(self._sources) > 0

    @property
    def has_next(self) -> bool:
        """True if a trigger waits: to be answered for the first time, to be answered again, or to be completed."""
        return bool(self.has_new or self._again or self._wants_latest() or self._to_be_completed())

    def answer_again(self) -> None:
        """Schedule the last trigger of each region again, because the terrain or the areas have changed."""
        self.repeats = self._outdated = True

    def forget(self) -> None:
        """Forget all triggers."""
        self._sources.clear()
        self._answered.clear()
        self._again, self._interrupted, self._outdated = [], [], False
        self.current = self._unfinished = self._latest = self._shown = None

    def next_trigger(self) -> Trigger | None:
        """Choose and return the next trigger to answer, and make it `current`; None if there is none.

        The latest trigger is returned again if the terrain or the areas have changed, or if another trigger was
        answered after it.
        """
        if self._outdated:
            self._again, self._outdated = self._in_turn(), False
        finishing, trigger = False, self._sources.take()
        if trigger is not None:
            self._answered.note(self._sources.region_of(trigger), trigger)
            is_newest = self._latest is None or trigger.stamp_ns >= self._latest.stamp_ns
            if is_newest and not trigger.is_unreported:
                self._latest = trigger
        else:
            trigger = self._next_again() or (self._latest if self._wants_latest() else None)
            if trigger is None:
                trigger = self._to_be_completed()
                finishing = trigger is not None
        if trigger is not None:
            self._set_aside(trigger)
            self.current, self._finishing = trigger, finishing
            self._shown = self._shown if trigger.is_unreported else trigger
        return trigger

    def begin(self, trigger: Trigger, can_answer: bool) -> None:
        """Record that the work on a trigger begins; can_answer : True if there is terrain to fly over."""
        self.repeats = False
        self._unfinished = trigger if can_answer else None

    def progress(self, trigger: Trigger, complete: bool) -> None:
        """Record that one more stage of an answer has been flown; complete : True if it was the last stage."""
        self._unfinished = None if complete else trigger

    def finish(self) -> None:
        """Record that no further stage of the current answer will be flown."""
        self._unfinished = None

    def _wants_latest(self) -> bool:
        """True if the newest trigger must be answered again, so that its answer is published last.

        This is necessary after a change of the terrain or the areas, and after an answer to another trigger. While
        interrupted answers are being completed, only a change counts, until the last of these answers is complete.
        """
        ends_another = self._finishing and (self._unfinished is not None or self._to_be_completed() is not None)
        return self._latest is not None and (self.repeats or (self._shown is not self._latest and not ends_another))

    def _set_aside(self, trigger: Trigger) -> None:
        """Keep the unfinished trigger that `trigger` interrupts, so that its answer can be completed later."""
        kept = self._interrupted if self._unfinished is None else [*self._interrupted, self._unfinished]
        self._interrupted = [each for each in kept if each is not trigger and self._answered.holds(each)]

    def _to_be_completed(self) -> Trigger | None:
        """Return an interrupted trigger of another wall whose answer must still be completed; None if there is none.

        The result is also None while the answer to the current trigger is not complete.
        """
        if self._unfinished is not None or self._latest is None:
            return None
        others = self._answered.others(self._latest)
        return next((each for each in self._interrupted if any(each is one for one in others)), None)

    def _in_turn(self) -> list[Trigger]:
        """Return all triggers to answer again, in the order in which they are answered.

        First come the triggers that still wait since an earlier change of the terrain or the areas, then the other
        triggers, the newest last.
        """
        every = self._kept()
        return [*self._again, *(trigger for trigger in every if not any(trigger is each for each in self._again))]

    def _next_again(self) -> Trigger | None:
        """Return the next trigger to answer again; None if there is none.

        A trigger is skipped if a newer trigger of its region has replaced it, or if it is too old.
        """
        kept = self._kept()
        self._again = [trigger for trigger in self._again if any(trigger is each for each in kept)]
        return self._again.pop(0) if self._again else None

    def _kept(self) -> list[Trigger]:
        """Return the triggers that are answered again after a change, the newest last.

        Before the first message is taken from the queue, the places that are no longer reported may be among them.
        """
        return [*self._answered.others(self._latest), *([] if self._latest is None else [self._latest])]
