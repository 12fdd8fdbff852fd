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
from dataclasses import replace
from functools import partial

import numpy as np

from acu_daemon.assist import screening_limits as limits
from acu_daemon.assist.reading_gate import ACCELERATION, BELIED, CORRELATED, OFF_PATH, WRONG_TARGET, below_highest
from acu_daemon.assist.screening.correlated_offsets import CorrelatedOffsets
from acu_daemon.assist.screening.off_path_reason import left_path_tai_s, reason_of, rise_db
from acu_daemon.assist.screening.offsets import Flags, Offsets, offsets
from acu_daemon.assist.screening.orbit_test import OrbitTest
from acu_daemon.assist.screening.path_acceleration import is_low_acceleration
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator

_NONE = Readings.of([])


class TrackGate:
    """Mutable; one owner.  `rejecting` is the reason why the newest readings are left out, "" when they are kept."""

    def __init__(self, source: Propagator, site: Site, settings: EstimatorSettings) -> None:
        self._source, self._site, self._settings = source, site, settings
        self._orbit_test = OrbitTest(source, site, settings)
        self._correlated = CorrelatedOffsets(self._orbit_test, settings)
        self.kept = _NONE  # all readings that are believed
        self._waiting = _NONE
        self._waiting_reason = ""
        self._is_clear = False  # when the track left the path
        self._reset_tai_s = -np.inf  # when a reset was considered last
        self._trial_s = 0.0
        self._left_out: Counter[str] = Counter()
        self.rejecting = ""
        self.reset_count = 0

    @property
    def counts(self) -> dict[str, int]:
        """Readings left out, by reason."""
        return dict(self._left_out + Counter({self._waiting_reason: len(self._waiting)}))

    def restart(self, newest_s: float) -> None:
        """Believe only the newest readings."""
        self._keep_but(self.kept.tai_s < self.kept.tai_s[-1] - newest_s, BELIED)

    def take(self, readings: Readings, fit: FitResult | None) -> Readings | None:
        """Take the next readings, oldest first.  fit: to the kept ones, with a covariance; None while there are none.

        Returns:  what to add to the fit; None: `kept` is another now.
        Raises:  OrbitError: the source has no answer for one of the times.
        """
        good, rejected = below_highest(readings, self._settings)
        reasons = Counter(one.reason for one in rejected)
        self._left_out += reasons
        taken: Readings | None = _NONE
        if len(good):
            is_low = is_low_acceleration(self._source, self._site, fit, good.tai_s, self._settings)
            reasons[ACCELERATION] = self._leave_out(good.part(~is_low), ACCELERATION)
            if fit is None:
                taken = self._first(good.part(is_low))
            else:
                seen = self._offsets(good, fit)
                is_asked = is_low & self._correlated.is_within(seen)
                if self._is_correlated(good.part(is_asked), fit):
                    reasons[CORRELATED] += self._leave_out(good.part(is_asked), CORRELATED)
                    taken = self._leave_correlated(good.part(is_low & ~is_asked), fit)
                else:
                    taken = self._follow(good.part(is_low & seen.is_near), good.part(is_low & ~seen.is_near), fit)
        reasons[self._waiting_reason] += int(np.count_nonzero(self._waiting.tai_s >= readings.tai_s[0]))
        self.rejecting = max(reasons, key=lambda one: reasons[one]) if 2 * reasons.total() > len(readings) else ""
        return taken

    def _offsets(self, readings: Readings, fit: FitResult | None) -> Offsets:
        return offsets(self._source, self._site, fit, readings, self._settings)

    def _leave_out(self, readings: Readings, reason: str) -> int:
        self._left_out[reason] += len(readings)
        return len(readings)

    def _keep_but(self, is_theirs: Flags, reason: str) -> int:
        """Leave out some of those kept; how many."""
        left_out = self._leave_out(self.kept.part(is_theirs), reason)
        self.kept = self.kept.part(~is_theirs)
        return left_out

    def _wait(self, readings: Readings) -> None:
        waiting = Readings.joined([self._waiting, readings])
        is_old = waiting.tai_s < readings.tai_s[-1] - limits.WAITING_S
        self._leave_out(waiting.part(is_old), self._waiting_reason)
        self._waiting = waiting.part(~is_old)

    def _end_waiting(self) -> None:
        self._leave_out(self._waiting, self._waiting_reason)
        self._waiting, self._waiting_reason, self._is_clear = _NONE, "", False

    def _believe(self, questioned: Readings, seen: Offsets) -> None:
        """Keep those of the questioned readings, the newest that wait, that are near; all others are left out."""
        self.kept = Readings.joined([self.kept, questioned.part(seen.is_near)])
        older = self._waiting.part(slice(0, len(self._waiting) - len(questioned)))
        self._waiting = Readings.joined([older, questioned.part(~seen.is_near)])
        self._end_waiting()

    def _first(self, readings: Readings) -> Readings | None:
        """While nothing is kept: do the waiting readings lie on an orbit near the elements?"""
        if len(readings):
            self._wait(readings)
        if len(self._waiting) == 0:
            return _NONE
        tail = self._waiting.tail(self._trial_s or limits.WAITING_S)
        self._waiting_reason = WRONG_TARGET
        if self._waiting.span_s >= self._trial_s and (seen := self._orbit_test.verdict(None, tail)) is not None:
            self._believe(tail, seen)
            return None
        self._trial_s = max(self._trial_s, limits.TRIAL_S[0])
        return _NONE

    def _follow(self, near: Readings, off: Readings, fit: FitResult) -> Readings | None:
        self.kept = Readings.joined([self.kept, near])
        if len(off) <= len(near):
            if len(near):  # back on the path, or single wild readings
                self._end_waiting()
            self._leave_out(off, OFF_PATH)
            return near
        self._wait(off)
        seen = self._offsets(self._waiting, fit)
        self._waiting_reason = reason_of(seen, rise_db(self.kept, off), self._settings.beamwidth_deg)
        is_rebuilt = False
        if not self._is_clear and self._waiting.span_s >= limits.SUSTAINED_S:
            self._is_clear = True
            is_rebuilt = self._take_back(seen, fit)
            if len(self.kept) == 0:
                self._first(_NONE)
                return None
        tail = self._waiting.tail(limits.RECENT_S)
        if (judged := self._orbit_test.verdict(self.kept.tail(limits.JUDGED_S), tail)) is not None:
            self._believe(tail, judged)
            return None
        return None if is_rebuilt or self._resets() else near

    def _is_correlated(self, asked: Readings, fit: FitResult) -> bool:
        """Whether the readings, with those before them, are correlated about the path; a fit to few cannot tell."""
        if len(asked) == 0:
            return False
        self._correlated.take(asked)
        path = replace(fit, covariance=None)  # its sigma is of no use here, and slow
        return self.kept.second_count >= limits.YOUNG_S and self._correlated.are_correlated(
            self.kept, partial(self._offsets, fit=path)
        )

    def _leave_correlated(self, off: Readings, fit: FitResult) -> Readings | None:
        """Leave out what was kept of the window that is correlated; go on with the readings farther off."""
        has_some = self._keep_but(self.kept.tai_s >= self._correlated.begin_tai_s, CORRELATED) > 0
        taken = self._follow(_NONE, off, fit)
        return None if has_some else taken

    def _take_back(self, seen: Offsets, fit: FitResult) -> bool:
        """Take back what was kept since a track left the path without a jump: it was on its way already."""
        kept = self.kept
        last = self._offsets(kept.part(slice(-1, None)), fit)
        step_deg = np.array([seen.right_deg[0] - last.right_deg[0], seen.up_deg[0] - last.up_deg[0]])
        is_jump = float(np.hypot(*step_deg)) > limits.JUMP_BEAMS * self._settings.beamwidth_deg
        if is_jump or seen.tai_s[0] - last.tai_s[0] > limits.MAX_GAP_S:
            return False
        since_tai_s = left_path_tai_s(seen)
        if kept.second_count < limits.YOUNG_S:
            self._trial_s = min(max(limits.TRIAL_S[0], 2.0 * self._trial_s), limits.TRIAL_S[1])
            since_tai_s = -np.inf
        is_theirs = kept.tai_s >= since_tai_s
        self._waiting = Readings.joined([kept.part(is_theirs), self._waiting])
        self.kept = kept.part(~is_theirs)
        return bool(is_theirs.any())

    def _resets(self) -> bool:
        """Whether the waiting readings alone obeyed an orbit for so long that the kept ones are what is wrong."""
        if self._waiting.tai_s[-1] < self._reset_tai_s + limits.CLEAR_S:
            return False
        self._reset_tai_s = float(self._waiting.tai_s[-1])
        needed_s = min(max(limits.RESET_SHARE * self.kept.second_count, limits.RECENT_S), limits.RESET_S)
        if self._waiting.span_s < limits.RECENT_S:
            return False
        rise = rise_db(self.kept, self._waiting)
        if (rise is None and self._are_kept_strained()) or (rise is not None and rise > limits.HIGH_DB):
            needed_s = limits.RECENT_S
        elif rise is not None and rise < -limits.LOW_DB:
            needed_s *= 2.0
        if self._waiting.span_s < needed_s:
            return False
        tail = self._waiting.tail(needed_s)
        judged = self._orbit_test.verdict(None, tail)
        if judged is None:
            return False
        self._keep_but(np.ones(len(self.kept), dtype=np.bool_), BELIED)
        self.reset_count += 1
        self._believe(tail, judged)
        return True

    def _are_kept_strained(self) -> bool:
        """Whether the orbit through the kept readings is much less likely than the one through those that wait."""
        of_kept, of_waiting = (self._orbit_test.strain(one.tail(limits.BEFORE_S)) for one in (self.kept, self._waiting))
        return of_kept - limits.STRAIN > of_waiting
