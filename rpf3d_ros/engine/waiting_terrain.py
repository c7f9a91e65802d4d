"""The queue of surveys to be built: the latest whole survey, then its patches in order; lost patches are counted.

Any thread may put surveys in the queue quickly. The thread that builds the terrain takes them.
"""

import threading
import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Generic, NamedTuple, TypeVar

from rpf3d_ros.messages.refusals import MessageRefused

M = TypeVar("M")

UNTRIED = 3
"""Largest number of waiting whole surveys, to limit memory; above 1, so that a bad survey removes no good survey."""

LATE = 10.0
"""Longest time (s) for which patches are kept for a whole survey that was published earlier but arrives later."""

NO_REASON = "no reason is given"
"""Text in place of an empty reason of a refusal, because an empty sentence would not be a fault."""

REMEMBERED = 10_000
"""Largest number of patches, and of replaced whole surveys, whose times of publication are remembered."""


class QueueFull(MessageRefused):
    """Raised if a patch is refused because too many patches wait; the patch is already counted as missing."""


class Moment(NamedTuple):
    """When a terrain message was published, and its stamp, to put surveys and patches in order.

    published_ns : time of the publisher's clock (ns); 0 if the middleware gives no time
    stamp_ns : stamp of the message (ns); None if the message has no stamp
    """

    published_ns: int
    stamp_ns: int | None = None

    def follows(self, whole: "Moment") -> bool:
        """True if a patch of this moment changes the terrain of a whole survey of the moment `whole`.

        The stamps decide, because a survey may be published long after it was made, or published again. If the
        stamps are equal, or one of the messages has no stamp, the times of publication decide. The method is also used
        for a refused whole survey in place of the patch.
        """
        if self.stamp_ns is None or whole.stamp_ns is None or self.stamp_ns == whole.stamp_ns:
            return self.published_ns > whole.published_ns
        return self.stamp_ns > whole.stamp_ns


class MomentBefore(NamedTuple):
    """When a patch from before a restart was received, and its stamp.

    received_ns : time of arrival (ns) or, if this is not known exactly, a later time
    stamp_ns : stamp (ns) of the patch or, if this is not known exactly, a later time; None if nothing is known
    """

    received_ns: int
    stamp_ns: int | None = None

    def follows(self, whole: Moment) -> bool:
        """True if a whole survey may lack the patch: the survey was published, or measured, before the patch."""
        known = self.stamp_ns is not None and whole.stamp_ns is not None
        return self.received_ns > whole.published_ns or (known and self.stamp_ns > whole.stamp_ns)  # type: ignore[operator]


AnyMoment = TypeVar("AnyMoment", bound=Moment | MomentBefore)


class RefusedSurvey(NamedTuple):
    """A whole survey that was refused; moment : when it was published; why : reason of the refusal."""

    moment: Moment
    why: str


@dataclass
class ReceivedPatch(Generic[M]):
    """A received patch that may have to be applied again, to a whole survey that arrives late.

    patch : the patch, None once it is too old to be kept
    moment : when the patch was published; at : time of arrival (s, steady clock)
    """

    patch: M | None
    moment: Moment
    at: float


@dataclass
class Chapter(Generic[M]):
    """A whole survey, waiting or in use, with the patches that belong on top of it.

    whole : the waiting survey, None for the survey in use; moment : when the survey was published
    early : patches that were published after the survey, but received before the survey
    missing : number of early patches that are no longer kept; they count as `lost` if the survey is used
    patches : waiting patches that were received after the survey
    lost : number of patches on this survey that will not be in the terrain: dropped, refused, or received too early
    refused : later whole surveys that were refused
    """

    whole: M | None
    moment: Moment | None = None
    early: tuple[M, ...] = ()
    missing: int = 0
    patches: list[M] = field(default_factory=list)
    lost: int = 0
    refused: list[RefusedSurvey] = field(default_factory=list)

    def take_over(self, later: "Chapter[M]") -> None:
        """Add the patches and counts of the next chapter to this one, because the next survey is not used."""
        self.patches += later.patches
        self.lost += later.lost
        self.refused += later.refused


class WaitingTerrain(Generic[M]):
    """The surveys that wait to be built into the terrain: the latest whole survey first, then its patches in order.

    Older whole surveys are kept until a newer survey has become the terrain. Their number is limited. A chapter is a
    whole survey with its patches. The first chapter belongs to the survey in use.

    A large mesh may be received after a patch that was published later. Therefore each received patch is kept for a
    while, even after `take` has returned the patch. If a whole survey then arrives that was published before the patch,
    the patch is applied to this survey, too. A patch that is too old to be kept counts as missing in the survey.

    most_patches : largest number of patches that may wait, and of patches that are kept for a late whole survey
    """

    def __init__(self, most_patches: int) -> None:
        self._most = most_patches
        self._chapters: list[Chapter[M]] = [Chapter(whole=None)]
        self._tried: Chapter[M] | None = None
        self._patched = self._chapters[0]
        self._received: deque[ReceivedPatch[M]] = deque(maxlen=REMEMBERED)
        self._kept: deque[ReceivedPatch[M]] = deque()
        # patches from before a restart or a forgotten clock; an earlier whole survey lacks them
        self._before: deque[Moment | MomentBefore] = deque(maxlen=REMEMBERED)
        self._replaced: deque[Moment] = deque(maxlen=REMEMBERED)  # surveys that a later survey in use has replaced
        self._changed = threading.Condition()
        self._closed = False
        self.overtaken = 0

    @property
    def lost_patches(self) -> int:
        """Number of missing patches: received, but neither in the terrain nor in a later whole survey."""
        with self._changed:
            return sum(chapter.lost for chapter in self._chapters)

    @property
    def refused_surveys(self) -> int:
        """Number of whole surveys that were refused although they are later than the survey in use."""
        with self._changed:
            return sum(len(chapter.refused) for chapter in self._chapters)

    @property
    def why_refused(self) -> str:
        """Why the last of the refused surveys was refused; "" if there is none."""
        with self._changed:
            whys = (each.refused[-1].why or NO_REASON for each in reversed(self._chapters) if each.refused)
            return next(whys, "")

    def refuse(
        self, kind: str, published_ns: int = 0, why: str = "", count: int = 1, stamp_ns: int | None = None
    ) -> None:
        """Record that messages were refused, or lost, before they were queued.

        kind : "whole" or "patch"; published_ns : time of publication of the message (ns), 0 if it is not known; for
            lost patches, a time after their publication
        why : the reason, for a whole survey; count : number of patches
        stamp_ns : stamp of the message (ns) or, if this is not known exactly, a later time; None without a stamp
        """
        moment = Moment(published_ns, stamp_ns)
        with self._changed:
            if kind == "whole":
                self._chapters[-1].refused.append(RefusedSurvey(moment=moment, why=why))
                return
            self._chapters[-1].lost += count
            # an earlier survey that arrives later lacks the patch, too
            missing = ReceivedPatch[M](patch=None, moment=moment, at=time.monotonic())
            self._received.extend([missing] * min(count, REMEMBERED))

    def lacks(self, patches: int, why_refused: str, known_ns: int = 0, stamp_ns: int | None = None) -> None:
        """Note the faults of the restored terrain from before a restart: missing patches, and why a survey was refused.

        patches : number of missing patches
        why_refused : "" if no survey was refused
        known_ns : latest time (ns) at which these faults can have begun; a whole survey published earlier has them too
        stamp_ns : latest stamp (ns) of the patches, None if it is not known; an older whole survey lacks them too
        """
        with self._changed:
            self._chapters[0].lost += patches
            self._before.extend([MomentBefore(known_ns, stamp_ns)] * min(patches, REMEMBERED))
            if why_refused:
                self._chapters[0].refused.append(RefusedSurvey(moment=Moment(known_ns), why=why_refused))

    def holds(self, patches_ns: Sequence[int], stamps_ns: Iterable[int] = ()) -> None:
        """Note the patches from before a restart that the terrain in use contains.

        patches_ns : when each patch was received (ns); a whole survey published earlier lacks the patch
        stamps_ns : stamp (ns) of each patch, empty if they are not known; an older whole survey lacks the patch
        """
        stamps = tuple(stamps_ns) or (None,) * len(patches_ns)
        with self._changed:
            self._before.extend(map(MomentBefore, patches_ns, stamps))

    def put_whole(self, survey: M, moment: Moment | None = None) -> None:
        """Queue a whole survey; if more than UNTRIED wait, drop the oldest survey that has not been built.

        A latched survey may be received again. The survey is then ignored if it is in the queue, in use, or replaced by
        a later survey: patches that were applied to the survey must not be lost.
        """
        with self._changed:
            known = (*(each.moment for each in self._chapters), *self._replaced)
            if moment is not None and moment.published_ns and moment in known:
                return
            self._drop_old_patches()
            following = [each.patch for each in self._received if moment is not None and each.moment.follows(moment)]
            early = tuple(patch for patch in following if patch is not None)
            before = sum(moment is not None and each.follows(moment) for each in self._before)
            missing = len(following) - len(early) + before
            self._chapters.append(Chapter(whole=survey, moment=moment, early=early, missing=missing))
            untried = [each for each in self._chapters if each.whole is not None and each is not self._tried]
            self.overtaken += len(untried) > 1
            if len(untried) > UNTRIED:
                self._remove(untried[0])
            self._changed.notify()

    def put_patch(self, patch: M, moment: Moment | None = None) -> None:
        """Queue a patch. Raises QueueFull if too many wait: the terrain then lacks the patch."""
        with self._changed:
            if moment is not None:
                self._received.append(received := ReceivedPatch(patch=patch, moment=moment, at=time.monotonic()))
                self._kept.append(received)
            self._drop_old_patches()
            if sum(len(chapter.patches) for chapter in self._chapters) >= self._most:
                self._chapters[-1].lost += 1
                raise QueueFull(f"{self._most} patches are waiting already (waiting_patches); this patch is not used")
            self._chapters[-1].patches.append(patch)
            self._changed.notify()

    def take(self) -> tuple[str, M] | None:
        """Wait for a survey and return ("whole", survey) or ("patch", patch); None once the queue is closed.

        After a whole survey, call `accepted`, `repeated` or `refused`. After a patch that is not used, call `lost`.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._length() > 0)
            if self._closed:
                return None
            newest = self._chapters[-1]
            if newest.whole is not None:
                self._tried = newest
                return "whole", newest.whole
            self._patched = newest
            return "patch", newest.patches.pop(0)

    def accepted(self) -> None:
        """Record that the last taken whole survey is now the terrain; drop the surveys that were queued before it.

        Earlier surveys with the same stamp stay in the queue and are built next, because they may contradict the survey
        that is now in use.
        """
        with self._changed:
            tried = self._tried
            assert tried is not None
            tried.refused[:0] = self._refused_after(tried)
            place = self._chapters.index(tried)
            self._replaced.extend(each.moment for each in self._chapters[:place] if each.moment is not None)
            equal = [each for each in self._chapters[:place] if each.whole is not None and _same_stamp(each, tried)]
            again = [Chapter(each.whole, each.moment) for each in equal]
            self._chapters = [tried, *again, *self._chapters[place + 1 :]]
            tried.patches[:0] = tried.early
            tried.lost += tried.missing
            tried.whole, tried.early, tried.missing, self._tried = None, (), 0, None

    def repeated(self, lost: int = 0, is_rebuilt: bool = False) -> None:
        """Record that the last taken whole survey is the survey of the terrain in use, which was published again.

        The patches since this survey stay in the terrain, and patches and surveys that the terrain lacks are still
        missing. As in `accepted`, other surveys that waited are dropped.

        lost : number of patches that were in the terrain, but are no longer in it
        is_rebuilt : True if the terrain was built from the survey again; patches that the survey lacks are then put in
            again
        """
        with self._changed:
            tried = self._tried
            assert tried is not None
            place, first = self._chapters.index(tried), self._chapters[0]
            for chapter in self._chapters[1 : place + 1]:
                first.take_over(chapter)
            if first.moment is not None:
                self._replaced.append(first.moment)
            first.moment, self._tried = tried.moment, None
            first.lost += lost
            if is_rebuilt:  # the early patches that are still kept are applied again
                first.lost = max(first.lost - len(tried.early), tried.missing)
                first.patches[:0] = [one for one in tried.early if not any(one is each for each in first.patches)]
            del self._chapters[1 : place + 1]

    def refused(self, why: str = "") -> None:
        """Record that the last taken whole survey cannot be used; its patches are added to the previous survey.

        why : the reason
        """
        with self._changed:
            tried = self._tried
            assert tried is not None
            tried.refused.append(RefusedSurvey(moment=tried.moment or Moment(0), why=why))
            self._remove(tried)
            self._tried = None

    def lost(self) -> None:
        """Record that the patch that was taken last cannot be used, so the terrain lacks the patch."""
        with self._changed:
            self._patched.lost += 1

    def close(self) -> None:
        """Close the queue; a call of `take` that waits, and every later call, then returns None."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def __len__(self) -> int:
        with self._changed:
            return self._length()

    def forget_received(self) -> None:
        """Forget the received patches, so that none is applied again: the clock went back, or the node unsubscribes.

        The moments of these patches are kept, because an earlier whole survey that lacks the patches may still arrive.
        """
        with self._changed:
            self._before.extend(each.moment for each in self._received)
            self._received.clear()
            self._kept.clear()

    def clock_went_back(self, now_ns: int) -> None:
        """Lower all stamps of patches and refused surveys to the current time (ns), because the clock went back.

        So a whole survey that was measured after the step has these patches, and an older survey still lacks them.
        """
        with self._changed:
            for received in self._received:
                received.moment = _at_most(received.moment, now_ns)
            self._before = deque((_at_most(each, now_ns) for each in self._before), maxlen=REMEMBERED)
            for chapter in self._chapters:
                chapter.refused = [each._replace(moment=_at_most(each.moment, now_ns)) for each in chapter.refused]

    @property
    def has_patches(self) -> bool:
        """True if patches are known: received, or from before a restart."""
        with self._changed:
            return bool(self._received or self._before)

    def drop_old_patches(self) -> None:
        """Free the memory of patches that are too old for a late whole survey; call this regularly."""
        with self._changed:
            self._drop_old_patches()

    def _drop_old_patches(self) -> None:
        while self._kept and (len(self._kept) > self._most or time.monotonic() - self._kept[0].at > LATE):
            self._kept.popleft().patch = None

    def _refused_after(self, tried: Chapter[M]) -> list[RefusedSurvey]:
        """Return the refused surveys that are newer than the survey of `tried`, but were received earlier."""
        before = [survey for chapter in self._chapters[: self._chapters.index(tried)] for survey in chapter.refused]
        return [survey for survey in before if tried.moment is not None and survey.moment.follows(tried.moment)]

    def _remove(self, chapter: Chapter[M]) -> None:
        place = self._chapters.index(chapter)
        self._chapters[place - 1].take_over(chapter)
        del self._chapters[place]

    def _length(self) -> int:
        return sum((chapter.whole is not None) + len(chapter.patches) for chapter in self._chapters)


def _same_stamp(one: Chapter[M], other: Chapter[M]) -> bool:
    """Return True if two whole surveys have the same stamp; False if a survey has none."""
    stamps = [None if each.moment is None else each.moment.stamp_ns for each in (one, other)]
    return bool(stamps[0]) and stamps[0] == stamps[1]


def _at_most(moment: AnyMoment, now_ns: int) -> AnyMoment:
    """Return a moment with its stamp lowered to at most `now_ns` (ns), or unchanged if it has no stamp."""
    return moment if moment.stamp_ns is None else moment._replace(stamp_ns=min(moment.stamp_ns, now_ns))  # type: ignore[return-value]
