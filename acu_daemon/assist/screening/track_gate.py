"""The gate of readings that knows the orbit: side lobe, wrong target, an axis that accelerates.  Pure.

Theory: docs/estimation.md, Screening.

A reading near the path of the fit is kept.  Readings off it wait: they are kept after all if an orbit near the elements
goes through them and the readings kept before (the path was extrapolated badly), and they take the place of those kept
before once they alone have obeyed such an orbit for long enough (what was believed first was wrong).  Before anything
is kept, readings are the satellite's if an orbit near the elements goes through them.  A track that leaves the path
without a jump takes with it what was kept since it left.
Readings near the path whose offsets are correlated, as those of an axis that hunts, are left out.
"""

from collections import Counter
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from acu_daemon.assist.reading_gate import ACCELERATION, BELIED, OFF_PATH, WRONG_TARGET, ReadingGate
from acu_daemon.assist.screening.correlated_offsets import CorrelatedOffsets
from acu_daemon.assist.screening.off_path_reason import LOW_DB, is_weak_beside, left_path_tai_s, reason_of, rise_db
from acu_daemon.assist.screening.offsets import Offsets, offsets
from acu_daemon.assist.screening.orbit_test import OrbitTest
from acu_daemon.assist.screening.path_acceleration import is_low_acceleration
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator

JUMP_BEAMS = 0.5  # a track that left the path by such a step was never on it
BREAK_S = 3.0  # between readings: nobody saw what happened
SUSTAINED_S = 0.9
TAIL_S = 10.0  # the newest of the waiting readings, which must lie on one orbit with those kept
TAKEN_BACK_S = 10.0
CLEAR_S = 4.0  # off the path for so long, a track shows when it left
JUDGED_S = 120.0  # so much of the kept readings is enough to judge others
YOUNG_S = 20.0  # a fit to less may have been another satellite's from the first reading on
FIRST_TRIAL_S, LAST_TRIAL_S = 8.0, 64.0  # once readings were no orbit's: how long the next ones must be one's
NARROW, WIDE = 3.0, 30.0  # how much room the elements are given, by the sigmas
WIDE_AFTER_S = 20.0
RESET_S = (10.0, 75.0)  # at least, at most; between them RESET_SHARE times what was kept
RESET_SHARE = 3.0
RESET_EVERY_S = 4.0
HIGH_DB = 6.0  # over the level kept before: what was kept was the side lobe
STRAIN, STRAIN_S = 20.0, 30.0  # sigmas squared by which an orbit is much less likely than another; seen over
WAITING_S = 200.0
_NONE = Readings.of([])


@dataclass(frozen=True, slots=True)
class Taken:
    """What a batch brought: readings to add to the fit, or, with is_rebuilt, that `TrackGate.kept` is another now."""

    new: Readings = _NONE
    is_rebuilt: bool = False


class TrackGate:
    """Mutable; one owner.  `rejecting` is the reason why the newest readings are left out, "" when they are kept."""

    def __init__(self, source: Propagator, site: Site, settings: EstimatorSettings) -> None:
        self._source, self._site, self._settings = source, site, settings
        self._plain = ReadingGate(settings)
        self._orbit_test = OrbitTest(source, site, settings)
        self._correlated = CorrelatedOffsets(self._orbit_test, settings)
        self._kept: list[Readings] = []
        self._waiting = _NONE
        self._waiting_reason = ""
        self._taken_back: Readings | None = None  # kept before, until it is clear when the track left the path
        self._reset_tai_s = -np.inf  # when a reset was considered last
        self._trial_s = 0.0
        self._left_out: Counter[str] = Counter()
        self.rejecting = ""
        self.reset_count = 0

    @property
    def kept(self) -> Readings:
        """All readings that are believed."""
        if not self._kept:
            return _NONE
        self._kept = [Readings.joined(self._kept)]
        return self._kept[0]

    @property
    def counts(self) -> dict[str, int]:
        """Readings left out, by reason."""
        waiting_count = len(self._waiting) + len(self._taken_back or _NONE)
        return dict(self._left_out + Counter({self._waiting_reason: waiting_count}))

    def restart(self, newest_s: float) -> None:
        """Believe only the newest readings."""
        is_new = self.kept.tai_s >= self.kept.tai_s[-1] - newest_s
        self._leave_out(self.kept.part(~is_new), BELIED)
        self._kept = [self.kept.part(is_new)]

    def take(self, readings: Readings, fit: FitResult | None) -> Taken:
        """Take the next readings, oldest first.  fit: to the kept ones, with a covariance; None while there are none.

        Raises:  OrbitError: the source has no answer for one of the times.
        """
        good, rejected = self._plain.split(readings)
        reasons = Counter(one.reason for one in rejected)
        self._left_out += reasons
        taken = Taken()
        if len(good):
            seen = self._offsets(good, fit)
            is_low = is_low_acceleration(self._source, self._site, fit, good.tai_s, self._settings)
            reasons[ACCELERATION] = self._leave_out(good.part(~is_low), ACCELERATION)
            if fit is None:
                taken = self._first(good.part(is_low))
            else:
                is_strong = is_low & ~is_weak_beside(seen, good, self.kept, self._settings.beamwidth_deg)
                is_asked = is_strong & self._correlated.is_within(seen)
                if self._is_correlated(good.part(is_asked), fit):
                    reasons[self._correlated.reason] += self._leave_out(good.part(is_asked), self._correlated.reason)
                    taken = self._leave_correlated(good.part(is_low & ~is_asked), fit)
                else:
                    is_near = is_strong & seen.is_near
                    taken = self._follow(good.part(is_near), good.part(is_low & ~is_near), fit)
        reasons[self._waiting_reason] += int(np.count_nonzero(self._waiting.tai_s >= readings.tai_s[0]))
        self.rejecting = max(reasons, key=lambda one: reasons[one]) if 2 * reasons.total() > len(readings) else ""
        return taken

    def _offsets(self, readings: Readings, fit: FitResult | None) -> Offsets:
        return offsets(self._source, self._site, fit, readings, self._settings)

    def _leave_out(self, readings: Readings, reason: str) -> int:
        self._left_out[reason] += len(readings)
        return len(readings)

    def _wait(self, readings: Readings) -> None:
        waiting = Readings.joined([self._waiting, readings])
        is_old = waiting.tai_s < readings.tai_s[-1] - WAITING_S
        self._leave_out(waiting.part(is_old), self._waiting_reason)
        self._waiting = waiting.part(~is_old)

    def _end_waiting(self) -> None:
        self._leave_out(self._waiting, self._waiting_reason)
        self._waiting, self._waiting_reason, self._taken_back = _NONE, "", None

    def _believe(self, questioned: Readings, seen: Offsets) -> Taken:
        """Keep those of the questioned readings, the newest that wait, that are near; all others are left out."""
        self._kept.append(questioned.part(seen.is_near))
        older = self._waiting.part(slice(0, len(self._waiting) - len(questioned)))
        self._waiting = Readings.joined([older, questioned.part(~seen.is_near)])
        self._end_waiting()
        return Taken(is_rebuilt=True)

    def _first(self, readings: Readings) -> Taken:
        """While nothing is kept: do the waiting readings lie on an orbit near the elements?"""
        if len(readings):
            self._wait(readings)
        if len(self._waiting) == 0:
            return Taken()
        trials = [(self._trial_s, NARROW)]
        if self._trial_s:
            trials.append((max(WIDE_AFTER_S, self._trial_s), WIDE))
        for trial_s, factor in trials:
            tail = self._waiting.tail(trial_s or WAITING_S)
            if self._waiting.span_s >= trial_s and (seen := self._orbit_test.verdict(None, tail, factor)) is not None:
                self._waiting_reason = WRONG_TARGET
                return self._believe(tail, seen)
        self._trial_s = max(self._trial_s, FIRST_TRIAL_S)
        self._waiting_reason = WRONG_TARGET
        return Taken()

    def _follow(self, near: Readings, off: Readings, fit: FitResult) -> Taken:
        if len(near):
            self._kept.append(near)
        if len(off) <= len(near):
            is_rebuilt = len(near) > 0 and self._give_back(fit)
            if len(near):  # back on the path, or single wild readings
                self._end_waiting()
            self._leave_out(off, OFF_PATH)
            return Taken(near, is_rebuilt)
        self._wait(off)
        seen = self._offsets(self._waiting, fit)
        self._waiting_reason = reason_of(seen, rise_db(self.kept, off), self._settings.beamwidth_deg)
        is_rebuilt = False
        off_s = self._waiting.span_s
        if self._taken_back is None and off_s >= SUSTAINED_S:
            self._taken_back = _NONE
            is_rebuilt = self._take_back(seen, fit)
            if not self._kept:
                self._first(_NONE)
                return Taken(is_rebuilt=True)
        elif off_s >= CLEAR_S:
            is_rebuilt = self._give_back(fit)
        tail = self._waiting.tail(TAIL_S)
        if (judged := self._orbit_test.verdict(self.kept.tail(JUDGED_S), tail, NARROW)) is not None:
            return self._believe(tail, judged)
        return Taken(near, is_rebuilt or self._resets())

    def _is_correlated(self, asked: Readings, fit: FitResult) -> bool:
        """Whether the readings, with those before them, are correlated about the path; a fit to few cannot tell."""
        if len(asked) == 0:
            return False
        self._correlated.take(asked)
        path = replace(fit, covariance=None)  # its sigma is of no use here, and slow
        return self.kept.second_count >= YOUNG_S and self._correlated.are_correlated(
            self.kept, partial(self._offsets, fit=path)
        )

    def _leave_correlated(self, off: Readings, fit: FitResult) -> Taken:
        """Leave out what was kept of the window that is correlated; go on with the readings farther off."""
        is_theirs = self.kept.tai_s >= self._correlated.begin_tai_s
        has_some = self._leave_out(self.kept.part(is_theirs), self._correlated.reason) > 0
        self._kept = [self.kept.part(~is_theirs)]
        taken = self._follow(_NONE, off, fit)
        return replace(taken, is_rebuilt=taken.is_rebuilt or has_some)

    def _take_back(self, seen: Offsets, fit: FitResult) -> bool:
        """Take what was kept last from a track that left the path without a jump: it was on its way already."""
        kept = self.kept
        last = self._offsets(kept.part(slice(-1, None)), fit)
        step_deg = np.array([seen.right_deg[0] - last.right_deg[0], seen.up_deg[0] - last.up_deg[0]])
        is_jump = float(np.hypot(*step_deg)) > JUMP_BEAMS * self._settings.beamwidth_deg
        if is_jump or seen.tai_s[0] - last.tai_s[0] > BREAK_S:
            return False
        if kept.second_count < YOUNG_S:
            self._trial_s = min(max(FIRST_TRIAL_S, 2.0 * self._trial_s), LAST_TRIAL_S)
            self._waiting = Readings.joined([kept, self._waiting])
            self._kept = []
            return True
        is_back = kept.tai_s > kept.tai_s[-1] - TAKEN_BACK_S
        self._taken_back = kept.part(is_back)
        self._kept = [kept.part(~is_back)]
        return True

    def _give_back(self, fit: FitResult) -> bool:
        """Keep again what was taken back from before the track left the path."""
        if self._taken_back is None or len(self._taken_back) == 0:
            return False
        is_good = self._taken_back.tai_s < left_path_tai_s(self._offsets(self._waiting, fit), TAKEN_BACK_S)
        self._waiting = Readings.joined([self._taken_back.part(~is_good), self._waiting])
        self._kept = [
            self.kept.part(self.kept.tai_s < self._taken_back.tai_s[0]),
            self._taken_back.part(is_good),
            self.kept.part(self.kept.tai_s > self._taken_back.tai_s[-1]),
        ]
        self._taken_back = _NONE
        return True

    def _resets(self) -> bool:
        """Whether the waiting readings alone obeyed an orbit for so long that the kept ones are what is wrong."""
        least_s, most_s = RESET_S
        if self._waiting.tai_s[-1] < self._reset_tai_s + RESET_EVERY_S:
            return False
        self._reset_tai_s = float(self._waiting.tai_s[-1])
        needed_s = min(max(RESET_SHARE * self.kept.second_count, least_s), most_s)
        if self._waiting.span_s < least_s:
            return False
        rise = rise_db(self.kept, self._waiting)
        if (rise is None and self._are_kept_strained()) or (rise is not None and rise > HIGH_DB):
            needed_s = least_s
        elif rise is not None and rise < -LOW_DB:
            needed_s *= 2.0
        if self._waiting.span_s < needed_s:
            return False
        tail = self._waiting.tail(needed_s)
        judged = self._orbit_test.verdict(None, tail, NARROW)
        if judged is None:
            return False
        self._leave_out(self.kept, BELIED)
        self._kept = []
        self.reset_count += 1
        self._believe(tail, judged)
        return True

    def _are_kept_strained(self) -> bool:
        """Whether the orbit through the kept readings is much less likely than the one through those that wait."""
        of_kept, of_waiting = (self._orbit_test.strain(one.tail(STRAIN_S)) for one in (self.kept, self._waiting))
        return of_kept - STRAIN > of_waiting
