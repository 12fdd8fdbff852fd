"""What a receiver beside the ACU says of the signal: judged with hysteresis, and forgotten when it is old.  Pure.

                       locked = true, or a level of lock_db or more
NOT LOCKED ---------------------------------------------------------> LOCKED
           <---------------------------------------------------------
                    locked = false, or a level below unlock_db
and from both NOT KNOWN, once nothing was said for max_age_s.

With an ACU that autotracks, the receiver can only deny what the ACU calls acquired: what the ACU has no signal of it
does not follow.  Where it says nothing, the ACU's own word counts.  An antenna that is led by program track is told
nothing of where the satellite is: its angles are those that were commanded, so they are never fitted.
"""

from dataclasses import dataclass
from math import isfinite

MOST_DB = 1000.0  # more is no level


@dataclass(frozen=True, slots=True)
class SignalRules:
    """Levels in dB, of whatever the receiver counts from; its word is good for max_age_s."""

    lock_db: float = 6.0
    unlock_db: float = 4.0
    max_age_s: float = 2.0


@dataclass(frozen=True, slots=True)
class SignalSample:
    """What a receiver said, of a time.  is_locked None: it said a level alone, and the levels of the rules decide."""

    tai_s: float
    level_db: float | None
    is_locked: bool | None = None

    @property
    def is_possible(self) -> bool:
        """Whether it says anything, and that can be."""
        is_level = self.level_db is None or abs(self.level_db) <= MOST_DB
        return isfinite(self.tai_s) and is_level and (self.level_db is not None or self.is_locked is not None)


@dataclass(frozen=True, slots=True)
class ReceiverSignal:
    """The memory of it.  lost_tai_s: since when a signal that was locked is not; known_tai_s: of the newest word."""

    known_tai_s: float | None = None
    level_db: float | None = None
    is_locked: bool = False
    lost_tai_s: float | None = None

    def is_known(self, now_tai_s: float, rules: SignalRules) -> bool:
        """Whether its newest word still counts."""
        return self.known_tai_s is not None and now_tai_s - self.known_tai_s <= rules.max_age_s


def judge_signal(before: ReceiverSignal, sample: SignalSample | None, rules: SignalRules) -> ReceiverSignal:
    """Take what was said since the last look; an older word than the newest is left out."""
    if sample is None or not sample.is_possible:
        return before
    if before.known_tai_s is not None and sample.tai_s < before.known_tai_s:
        return before
    is_locked = _is_locked(before, sample, rules)
    lost_tai_s = None if is_locked else before.lost_tai_s
    if before.is_locked and not is_locked:
        lost_tai_s = sample.tai_s
    return ReceiverSignal(sample.tai_s, sample.level_db, is_locked, lost_tai_s)


def _is_locked(before: ReceiverSignal, sample: SignalSample, rules: SignalRules) -> bool:
    if sample.is_locked is not None:
        return sample.is_locked
    level_db = sample.level_db if sample.level_db is not None else -MOST_DB
    return level_db >= (rules.unlock_db if before.is_locked else rules.lock_db)
