"""The gate of readings that knows the orbit: side lobe, wrong target, an axis that accelerates.  Pure.

A reading near the path of the fit is kept.  Readings off it wait: they are kept after all if an orbit near the elements
goes through them and the readings kept before (the path was extrapolated badly), and they take the place of those kept
before once they alone have obeyed such an orbit for long enough (what was believed first was wrong).  Before anything
is kept, readings are the satellite's if an orbit near the elements goes through them.  A track that leaves the path
without a jump takes its last seconds with it.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.gate import (
    ACCELERATION,
    BELIED,
    OFF_PATH,
    SIDE_LOBE,
    WRONG_TARGET,
    ReadingGate,
)
from acu_daemon.assist.judge import Judge
from acu_daemon.assist.offsets import Offsets, excess_acceleration, offsets
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AxisLimits, FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array

Flags = npt.NDArray[np.bool_]

SIDE_LOBE_BEAMS = (1.05, 2.2)  # beside the 1.2 to 2 of a side lobe, noise and the path's own error
LOW_DB = 3.0  # under the level kept before: low; so much and more over it: what was kept was the side lobe
HIGH_DB = 6.0
LEVEL_S = 30.0
ACCELERATION_SHARE = 0.3  # of the drive's limit: beyond it autotrack lags
DRIFT_BEAMS_S = 0.03  # a side lobe keeps its offset
DRIFT_OVER_S = 10.0
JUMP_BEAMS = 0.5
BREAK_S = 3.0  # between readings: nobody saw what happened
SUSTAINED_S = 0.9
TAIL_S = 10.0
TAKEN_BACK_S = 5.0
YOUNG_S = 20.0
FIRST_TRIAL_S, LAST_TRIAL_S = 8.0, 64.0
NARROW, WIDE = 3.0, 30.0  # how much room the elements are given, by the sigmas
WIDE_AFTER_S = 20.0
RESET_S = (10.0, 90.0)  # at least, at most; between them RESET_SHARE times what was kept
RESET_SHARE = 3.0
WAITING_S = 200.0


@dataclass(frozen=True, slots=True)
class Taken:
    """What a batch brought: readings to add to the fit, or, with is_rebuilt, that `TrackGate.kept` is another now."""

    new: Readings
    is_rebuilt: bool = False


class TrackGate:
    """Mutable; one owner.  `rejecting` is the reason why the newest readings are left out, "" when they are kept."""

    def __init__(self, source: Propagator, site: Site, settings: EstimatorSettings) -> None:
        self._source, self._site, self._settings = source, site, settings
        self._plain = ReadingGate(
            settings.max_fit_elevation_deg,
            settings.sigma_azimuth_deg,
            settings.sigma_elevation_deg,
            settings.azimuth,
            settings.elevation,
        )
        self._judge = Judge(source, site, settings)
        self._kept: list[Readings] = []
        self._waiting: Readings = _NONE
        self._waiting_reason = ""
        self._is_taken_back = False
        self._trial_s = 0.0
        self._final: Counter[str] = Counter()
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
        waiting = Counter({self._waiting_reason: len(self._waiting)} if len(self._waiting) else {})
        return dict(self._final + waiting)

    def restart(self, newest_s: float) -> None:
        """Believe only the newest readings; the others are left out from now on."""
        kept = self.kept
        is_new = kept.tai_s >= kept.tai_s[-1] - newest_s
        self._drop(kept.part(~is_new), BELIED)
        self._kept = [kept.part(is_new)]

    def take(self, readings: Readings, fit: FitResult | None) -> Taken:
        """Take the next readings, oldest first.  fit: to the kept ones, with a covariance; None while there are none.

        Raises:  OrbitError: the source has no answer for one of the times.
        """
        good, rejected = self._plain.split(readings)
        self._final.update(one.reason for one in rejected)
        self.rejecting = _main([one.reason for one in rejected], len(readings))
        if len(good) == 0:
            return Taken(_NONE)
        seen = offsets(self._source, self._site, fit, good, self._settings)
        is_calm = self._is_calm(good, seen, has_path=fit is not None)
        self._drop(good.part(~is_calm), ACCELERATION)
        if fit is None:
            self._wait(good.part(is_calm))
            taken = self._first()
        else:
            is_near = self._is_near(good, seen)
            taken = self._follow(good.part(is_calm & is_near), good.part(is_calm & ~is_near), fit)
        if not self.rejecting:
            share = len(readings) - len(good) + np.count_nonzero(~is_calm)
            waits = len(self._waiting) > 0 and self._waiting.tai_s[-1] >= readings.tai_s[-1] - SUSTAINED_S
            self.rejecting = self._waiting_reason if waits else (ACCELERATION if 2 * share > len(readings) else "")
        return taken

    # One reading at a time

    def _is_calm(self, readings: Readings, seen: Offsets, *, has_path: bool) -> Flags:
        settings = self._settings
        calm = np.ones(len(readings), dtype=np.bool_)
        if settings.azimuth is None or settings.elevation is None:
            return calm
        own = [np.zeros(len(readings)), np.zeros(len(readings))]
        is_near = seen.angle_deg <= seen.near_deg
        if has_path:
            noise_deg = settings.sigma_azimuth_deg / float(np.min(seen.cos_el))
            own[0][is_near] = excess_acceleration(
                seen.tai_s[is_near], (seen.right_deg / seen.cos_el)[is_near], noise_deg
            )
            own[1][is_near] = excess_acceleration(
                seen.tai_s[is_near], seen.up_deg[is_near], settings.sigma_elevation_deg
            )
        axes: list[tuple[AxisLimits, Array, Array]] = [
            (settings.azimuth, seen.az_deg_s2, own[0]),
            (settings.elevation, seen.el_deg_s2, own[1]),
        ]
        for axis, of_path, of_readings in axes:
            calm &= np.abs(of_path + of_readings) <= ACCELERATION_SHARE * axis.max_acceleration_deg_s2
        return calm

    def _is_near(self, readings: Readings, seen: Offsets) -> Flags:
        """Near the path, and, where the path is so unsure that a side lobe would be near, not weak like one."""
        is_near: Flags = seen.angle_deg <= seen.near_deg
        level_db = self._level_db()
        if readings.agc_db is None or level_db is None:
            return is_near
        return is_near & ~(self._is_beside(seen) & (readings.agc_db < level_db - LOW_DB))

    def _is_beside(self, seen: Offsets) -> Flags:
        beams = seen.angle_deg / self._settings.beamwidth_deg
        beside: Flags = (beams >= SIDE_LOBE_BEAMS[0]) & (beams <= SIDE_LOBE_BEAMS[1])
        return beside

    def _level_db(self) -> float | None:
        if not self._kept or self._kept[-1].agc_db is None:
            return None
        kept = self.kept
        if kept.agc_db is None:
            return None
        newest = kept.agc_db[kept.tai_s >= kept.tai_s[-1] - LEVEL_S]
        return None if bool(np.all(np.isnan(newest))) else float(np.nanmedian(newest))

    # Readings that wait

    def _wait(self, readings: Readings) -> None:
        if len(readings) == 0:
            return
        waiting = Readings.joined([self._waiting, readings]) if len(self._waiting) else readings
        is_old = waiting.tai_s < waiting.tai_s[-1] - WAITING_S
        self._drop(waiting.part(is_old), self._waiting_reason)
        self._waiting = waiting.part(~is_old)

    def _drop(self, readings: Readings, reason: str) -> None:
        if len(readings):
            self._final[reason] += len(readings)

    def _give_up_waiting(self) -> None:
        self._drop(self._waiting, self._waiting_reason)
        self._waiting, self._is_taken_back = _NONE, False

    def _believe(self, questioned: Readings, seen: Offsets, reason: str) -> Taken:
        """Keep those of the questioned readings, the newest that wait, that are near; the other ones are left out."""
        is_near = seen.angle_deg <= seen.near_deg
        self._kept.append(questioned.part(is_near))
        self._waiting_reason = reason
        self._waiting = Readings.joined(
            [self._waiting.part(slice(0, len(self._waiting) - len(questioned))), questioned.part(~is_near)]
        )
        self._give_up_waiting()
        return Taken(_NONE, is_rebuilt=True)

    def _first(self) -> Taken:
        """Nothing is kept yet: do the waiting readings lie on an orbit near the elements?"""
        waiting = self._waiting
        if len(waiting) == 0:
            return Taken(_NONE)
        span_s = _span_s(waiting)
        trials = [(self._trial_s, NARROW)] if span_s >= self._trial_s else []
        if self._trial_s > 0.0 and span_s >= max(WIDE_AFTER_S, self._trial_s):
            trials.append((max(WIDE_AFTER_S, self._trial_s), WIDE))
        for trial_s, factor in trials:
            tail = _tail(waiting, trial_s or WAITING_S)
            seen = self._judge.verdict(None, tail, factor)
            if seen is not None:
                return self._believe(tail, seen, WRONG_TARGET)
        self._trial_s = max(self._trial_s, FIRST_TRIAL_S)
        self._waiting_reason = WRONG_TARGET
        return Taken(_NONE)

    def _follow(self, near: Readings, off: Readings, fit: FitResult) -> Taken:
        if len(near):
            self._kept.append(near)
        if 2 * len(off) <= len(near) + len(off):
            if len(near):  # back on the path, or single wild readings
                self._give_up_waiting()
            self._drop(off, OFF_PATH)
            return Taken(near)
        self._wait(off)
        seen = offsets(self._source, self._site, fit, self._waiting, self._settings)
        self._waiting_reason = self._reason(seen)
        is_changed = False
        if _span_s(self._waiting) >= SUSTAINED_S and not self._is_taken_back:
            self._is_taken_back = True
            is_changed = self._take_back(seen, fit)
            if not self._kept:
                self._first()
                return Taken(_NONE, is_rebuilt=True)
        tail = _tail(self._waiting, TAIL_S)
        judged = self._judge.verdict(self.kept, tail, NARROW)
        if judged is not None:
            return self._believe(tail, judged, self._waiting_reason)
        return self._reset() or Taken(_NONE if is_changed else near, is_changed)

    def _reason(self, seen: Offsets) -> str:
        drifts = seen.drift_deg_s(DRIFT_OVER_S) > DRIFT_BEAMS_S * self._settings.beamwidth_deg
        if drifts:
            return WRONG_TARGET
        newest = seen.tai_s >= seen.tai_s[-1] - DRIFT_OVER_S
        is_beside = bool(np.mean(self._is_beside(seen)[newest]) > 0.5)
        rise_db = self._rise_db()
        return SIDE_LOBE if is_beside and (rise_db is None or rise_db < -LOW_DB) else OFF_PATH

    def _rise_db(self) -> float | None:
        """How much stronger than the kept readings the newest of the waiting ones are; None where nobody knows."""
        level_db, agc_db = self._level_db(), _tail(self._waiting, TAIL_S).agc_db
        if level_db is None or agc_db is None or bool(np.all(np.isnan(agc_db))):
            return None
        return float(np.nanmedian(agc_db)) - level_db

    def _take_back(self, seen: Offsets, fit: FitResult) -> bool:
        """A track that left the path without a jump: what was kept last was on its way already."""
        kept = self.kept
        last = kept.part(slice(len(kept) - 1, None))
        if self._waiting.tai_s[0] - last.tai_s[0] > BREAK_S:
            return False
        before = offsets(self._source, self._site, fit, last, self._settings)
        step_deg = np.hypot(seen.right_deg[0] - before.right_deg[0], seen.up_deg[0] - before.up_deg[0])
        if float(step_deg) > JUMP_BEAMS * self._settings.beamwidth_deg:
            return False
        is_young = _seconds(kept) < YOUNG_S
        is_back = kept.tai_s > (-np.inf if is_young else kept.tai_s[-1] - TAKEN_BACK_S)
        self._waiting = Readings.joined([kept.part(is_back), self._waiting])
        self._kept = [kept.part(~is_back)] if not is_young else []
        if is_young:
            self._trial_s = min(max(FIRST_TRIAL_S, 2.0 * self._trial_s), LAST_TRIAL_S)
        return True

    def _reset(self) -> Taken | None:
        """The waiting readings alone, for long enough: then the kept ones are what is wrong."""
        least_s, most_s = RESET_S
        needed_s = min(max(RESET_SHARE * _seconds(self.kept), least_s), most_s)
        rise_db = self._rise_db() or 0.0
        if rise_db > HIGH_DB:
            needed_s = least_s
        elif rise_db < -LOW_DB:
            needed_s *= 2.0
        if _span_s(self._waiting) < needed_s:
            return None
        tail = _tail(self._waiting, needed_s)
        judged = self._judge.verdict(None, tail, NARROW)
        if judged is None:
            return None
        self._drop(self.kept, BELIED)
        self._kept = []
        self.reset_count += 1
        return self._believe(tail, judged, self._waiting_reason)


_NONE = Readings.of([])


def _main(reasons: list[str], count: int) -> str:
    """The commonest reason, where more than half of the readings have one."""
    return Counter(reasons).most_common(1)[0][0] if 2 * len(reasons) > count else ""


def _tail(readings: Readings, newest_s: float) -> Readings:
    return readings.part(readings.tai_s >= readings.tai_s[-1] - newest_s - 1e-6)


def _span_s(readings: Readings) -> float:
    return float(readings.tai_s[-1] - readings.tai_s[0]) if len(readings) else 0.0


def _seconds(readings: Readings) -> int:
    """Seconds in which there is a reading."""
    return int(np.unique(np.floor(readings.tai_s)).size)
