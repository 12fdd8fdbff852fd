"""assist.screening.track_gate step by step: what waits, what is taken back, left out and believed, at each limit.

The readings here are offsets from the path themselves, right for azimuth and up for elevation, and what an orbit would
say is told by a small judge; what orbits say of real readings is in test_track_gate.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_orbits import circular, site

from acu_daemon.assist import screening_limits as limits
from acu_daemon.assist.reading_gate import (
    ABOVE_MAX_ELEVATION,
    ACCELERATION,
    BELIED,
    CORRELATED,
    OFF_PATH,
    SIDE_LOBE,
    WRONG_TARGET,
)
from acu_daemon.assist.screening import track_gate
from acu_daemon.assist.screening.offsets import Offsets
from acu_daemon.assist.screening.track_gate import TrackGate
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, FitResult, Readings
from acu_daemon.units import Array

FIT = FitResult("full", Correction(), 0.0, 9, 0, 0.0, 0.0, 0.0)
SOURCE, WHERE, SETTINGS = circular(), site(), EstimatorSettings(0.03, 0.03)
NEAR_DEG, LOBE_DEG, FAR_DEG = 0.1, 1.5, 5.0
BEAM_DEG = SETTINGS.beamwidth_deg
STEP = 0.01


def row(
    from_s: float, count: int, right_deg: float = 0.0, agc_db: float | None = None, step_s: float = 1.0
) -> Readings:
    """Readings at even steps, so far to the right of the path."""
    tai_s = from_s + step_s * np.arange(count)
    levels = None if agc_db is None else np.full(count, agc_db)
    return Readings(tai_s, np.full(count, right_deg), np.zeros(count), levels)


def beside(readings: Readings) -> Offsets:
    near_deg = np.full(len(readings), 0.2)
    return Offsets(readings.tai_s, readings.az_deg, readings.el_deg, near_deg)


class Orbits:
    """The judge: which readings lie on an orbit, with others or alone, and how strained it is."""

    def __init__(self) -> None:
        self.asked: list[tuple[int | None, int]] = []
        self.alone: Callable[[Readings], Offsets | None] = lambda _: None
        self.together: Callable[[Readings], Offsets | None] = lambda _: None
        self.strains = [0.0, 0.0]
        self.strained: list[int] = []

    def verdict(self, before: Readings | None, questioned: Readings) -> Offsets | None:
        self.asked.append((None if before is None else len(before), len(questioned)))
        return (self.alone if before is None else self.together)(questioned)

    def strain(self, readings: Readings) -> float:
        self.strained.append(len(readings))
        return self.strains[(len(self.strained) - 1) % 2]


class Uncorrelated:
    """Nothing is asked about."""

    begin_tai_s = np.inf

    def is_within(self, seen: Offsets) -> Array:
        return np.zeros(seen.tai_s.size, dtype=np.bool_)


class Gate(TrackGate):
    def __init__(self, kept: Readings | None = None, waiting: Readings | None = None, **fields: Any) -> None:
        super().__init__(SOURCE, WHERE, SETTINGS)
        self.orbits, self.covariances = Orbits(), []
        self._orbit_test = self.orbits  # type: ignore[assignment]
        self._correlated = Uncorrelated()  # type: ignore[assignment]
        self.kept = kept or self.kept
        self._waiting = waiting or self._waiting
        for name, value in fields.items():
            setattr(self, name, value)

    def _offsets(self, readings: Readings, fit: FitResult | None) -> Offsets:
        self.covariances.append(fit.covariance if fit else None)
        return beside(readings)

    @property
    def waiting(self) -> Readings:
        return self._waiting


def times(readings: Readings | None) -> list[float]:
    assert readings is not None
    return readings.tai_s.tolist()


# Near and off


@pytest.mark.parametrize(("off_count", "waits"), [(2, False), (3, False), (4, True)])
def test_readings_off_the_path_that_are_no_more_than_those_on_it_are_wild_ones(off_count: int, waits: bool) -> None:
    gate = Gate(row(0.0, 3), row(3.0, 1, LOBE_DEG), _waiting_reason=SIDE_LOBE)
    new = Readings.joined([row(10.0, 3), row(13.0, off_count, FAR_DEG, step_s=0.1)])
    taken = gate.take(new, FIT)
    assert times(gate.kept) == [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]
    assert times(taken) == [10.0, 11.0, 12.0]
    assert len(gate.waiting) == (off_count + 1 if waits else 0)
    assert gate.counts == ({OFF_PATH: 5} if waits else {SIDE_LOBE: 1, OFF_PATH: off_count})
    assert gate.rejecting == (OFF_PATH if waits else "")


def test_where_nothing_can_be_judged_those_that_wait_go_on_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(track_gate, "is_low_acceleration", lambda *one: np.zeros(one[3].size, dtype=np.bool_))
    gate = Gate(row(0.0, 3), row(3.0, 2, LOBE_DEG), _waiting_reason=SIDE_LOBE)
    assert times(gate.take(row(10.0, 2), FIT)) == []
    assert (times(gate.waiting), gate.counts) == ([3.0, 4.0], {ACCELERATION: 2, SIDE_LOBE: 2})
    assert gate.rejecting == ACCELERATION


@pytest.mark.parametrize(("low_count", "told"), [(1, ACCELERATION), (2, ""), (3, "")])
def test_more_than_half_of_the_newest_must_be_left_out_to_be_told(
    low_count: int, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(track_gate, "is_low_acceleration", lambda *one: np.arange(one[3].size) < low_count)
    gate = Gate(row(0.0, 3))
    assert times(gate.take(row(10.0, 4), FIT)) == [10.0, 11.0, 12.0][:low_count]
    assert (gate.rejecting, gate.counts.get(ACCELERATION)) == (told, 4 - low_count)


def test_readings_too_high_are_counted_and_told_and_nothing_else_is_asked() -> None:
    gate = Gate(row(0.0, 3))
    high = Readings(np.array([10.0, 11.0]), np.zeros(2), np.full(2, 89.9))
    assert times(gate.take(high, FIT)) == []
    assert (gate.rejecting, gate.counts, gate.orbits.asked) == (ABOVE_MAX_ELEVATION, {ABOVE_MAX_ELEVATION: 2}, [])


def test_only_those_of_the_newest_that_wait_count_towards_what_is_told() -> None:
    gate = Gate(row(0.0, 3), row(3.0, 9, LOBE_DEG), _waiting_reason=SIDE_LOBE, _is_clear=True)
    gate.take(Readings.joined([row(20.0, 2), row(22.0, 2, LOBE_DEG)]), FIT)
    assert gate.rejecting == ""
    gate.take(row(30.0, 1, LOBE_DEG), FIT)
    assert gate.rejecting == SIDE_LOBE


@pytest.mark.parametrize(("age_s", "is_kept"), [(limits.WAITING_S, True), (limits.WAITING_S + STEP, False)])
def test_what_has_waited_for_too_long_is_left_out_with_its_reason(age_s: float, is_kept: bool) -> None:
    gate = Gate(row(-300.0, 3), row(0.0, 1, LOBE_DEG), _waiting_reason=SIDE_LOBE, _is_clear=True)
    gate.take(row(age_s, 1, LOBE_DEG), FIT)
    assert times(gate.waiting) == [0.0, age_s][0 if is_kept else 1 :]
    assert gate.counts == {SIDE_LOBE: 2}


def test_what_has_waited_is_as_old_as_the_newest_reading_says() -> None:
    gate = Gate(row(-300.0, 3), row(0.0, 1, LOBE_DEG), _waiting_reason=SIDE_LOBE, _is_clear=True)
    gate.take(row(limits.WAITING_S - 0.5, 2, LOBE_DEG), FIT)
    assert times(gate.waiting) == [limits.WAITING_S - 0.5, limits.WAITING_S + 0.5]


def test_a_restart_believes_only_the_newest() -> None:
    gate = Gate(row(0.0, 10))
    gate.restart(4.0)
    assert times(gate.kept) == [5.0, 6.0, 7.0, 8.0, 9.0]
    assert gate.counts == {BELIED: 5}


# Before anything is kept


def test_the_first_readings_are_kept_where_an_orbit_goes_through_them_but_those_off_it() -> None:
    gate = Gate()
    assert times(gate.take(row(0.0, 2, FAR_DEG), None)) == []
    assert (gate.counts, gate.rejecting, gate.orbits.asked) == ({WRONG_TARGET: 2}, WRONG_TARGET, [(None, 2)])
    gate.orbits.alone = beside
    for more in (row(2.0, 1), row(3.0, 5)):
        gate.take(more, None)
        assert len(gate.kept) == 0
    assert gate.take(row(9.0, 3), None) is None  # TRIAL_S after the first
    assert times(gate.kept) == [3.0, 4.0, 5.0, 6.0, 7.0, 9.0, 10.0, 11.0]
    assert (gate.counts, len(gate.waiting)) == ({WRONG_TARGET: 3}, 0)


@pytest.mark.parametrize(("span_s", "is_believed"), [(8.0, True), (8.0 - STEP, False)])
def test_once_readings_were_no_orbits_the_next_must_be_ones_for_a_while(span_s: float, is_believed: bool) -> None:
    gate = Gate(None, row(0.0, 1, FAR_DEG))
    gate.take(row(0.5, 1), None)
    assert gate._trial_s == limits.TRIAL_S[0]
    gate.orbits.alone = beside
    gate.take(row(span_s, 1), None)
    assert (len(gate.kept) > 0) is is_believed
    longer = Gate(None, row(0.0, 1), _trial_s=20.0)
    longer.take(row(1.0, 1), None)
    assert longer._trial_s == 20.0


def test_with_nothing_at_all_nothing_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(track_gate, "is_low_acceleration", lambda *one: np.zeros(one[3].size, dtype=np.bool_))
    gate = Gate()
    assert times(gate.take(row(0.0, 2), None)) == []
    assert (gate.orbits.asked, gate._waiting_reason) == ([], "")


# A track that leaves the path


def left(
    kept_count: int,
    *,
    jump_deg: float = 0.35,
    gap_s: float = 1.0,
    span_s: float = limits.SUSTAINED_S + STEP,
    drift_deg_s: float = 0.1,
    **fields: Any,
) -> tuple[Gate, Readings | None]:
    """A track that leaves the path to the right after so many seconds on it."""
    gate = Gate(row(0.0, kept_count), **fields)
    from_s = kept_count - 1.0 + gap_s
    tai_s = np.array([from_s, from_s + span_s / 2, from_s + span_s])
    off = Readings(tai_s, jump_deg + drift_deg_s * (tai_s - from_s), np.zeros(3))
    return gate, gate.take(off, FIT)


@pytest.mark.parametrize(
    ("changes", "is_back"),
    [
        ({}, True),
        ({"span_s": limits.SUSTAINED_S - STEP}, False),
        ({"jump_deg": limits.JUMP_BEAMS * BEAM_DEG}, True),
        ({"jump_deg": limits.JUMP_BEAMS * BEAM_DEG + STEP}, False),
        ({"jump_deg": -limits.JUMP_BEAMS * BEAM_DEG - STEP}, False),
        ({"gap_s": limits.MAX_GAP_S, "drift_deg_s": 0.03}, True),
        ({"gap_s": limits.MAX_GAP_S + STEP, "drift_deg_s": 0.03}, False),
        ({"_is_clear": True}, False),
    ],
)
def test_a_track_that_leaves_without_a_jump_takes_what_was_kept_since_with_it(
    changes: dict[str, Any], is_back: bool
) -> None:
    gate, taken = left(40, **changes)
    count = len(gate.kept)
    assert (count < 40) is is_back
    assert (taken is None) is is_back
    assert len(gate.waiting) == 3 + 40 - count
    assert times(gate.waiting) == sorted(times(gate.waiting))
    if changes == {}:
        assert count == 37  # 0.35 deg at 0.1 deg/s: on the path 3.5 s before its first reading off it, at 40 s
        assert gate.waiting.tai_s[0] == 37.0
        assert gate._trial_s == 0.0
    if "span_s" not in changes:
        assert gate._is_clear


@pytest.mark.parametrize(
    ("kept_count", "before_s", "trial_s"),
    [(19, 0.0, 8.0), (19, 8.0, 16.0), (19, 3.0, 8.0), (19, 40.0, 64.0), (19, 64.0, 64.0), (20, 0.0, 0.0)],
)
def test_a_young_track_is_taken_back_whole_and_the_next_must_be_an_orbits_for_longer(
    kept_count: int, before_s: float, trial_s: float
) -> None:
    gate, taken = left(kept_count, _trial_s=before_s)
    assert taken is None
    is_young = kept_count < 20
    assert len(gate.kept) == (0 if is_young else 17)
    assert gate._trial_s == trial_s
    assert not is_young or gate._waiting_reason == WRONG_TARGET
    assert [one for one, _ in gate.orbits.asked][:1] == ([17] if not is_young else [None] if trial_s < 20.0 else [])


@pytest.mark.parametrize("beamwidth_deg", [1.0, 2.0])
@pytest.mark.parametrize(("share", "is_jump"), [(0.98, False), (1.02, True)])
def test_a_jump_is_half_a_beam_in_any_direction_from_the_last_reading_on_the_path(
    beamwidth_deg: float, share: float, is_jump: bool
) -> None:
    right_deg, up_deg = share * 0.3 * beamwidth_deg, share * 0.4 * beamwidth_deg
    kept = row(0.0, 40)
    gate = Gate(
        Readings(kept.tai_s, np.full(40, 0.1), np.full(40, -0.1)),
        _settings=replace(SETTINGS, beamwidth_deg=beamwidth_deg),
    )
    tai_s = 40.0 + np.array([0.0, 0.5, 1.0])
    off = Readings(tai_s, np.full(3, 0.1 + right_deg), -0.1 + up_deg * np.array([1.0, 1.2, 1.4]))
    gate.take(off, FIT)
    assert (len(gate.kept) == 40) is is_jump


def test_off_readings_that_an_orbit_near_the_elements_takes_in_are_kept_after_all() -> None:
    gate = Gate(row(0.0, 200), row(200.0, 20, LOBE_DEG), _is_clear=True, _waiting_reason=SIDE_LOBE)
    gate.orbits.together = lambda one: beside(Readings(one.tai_s, np.where(one.tai_s == 218.0, 9.0, 0.0), one.el_deg))
    assert gate.take(row(220.0, 1, LOBE_DEG), FIT) is None
    assert gate.orbits.asked == [(121, 11)]
    assert times(gate.kept)[-11:] == [199.0, *(210.0 + k for k in range(8)), 219.0, 220.0]
    assert (gate.counts, len(gate.waiting), gate.reset_count) == ({SIDE_LOBE: 11}, 0, 0)
    assert (gate._waiting_reason, gate._is_clear) == ("", False)


# What was believed first is wrong


def reset(
    kept_count: int,
    waited_s: float,
    *,
    rise: float | None = None,
    strains: tuple[float, float] = (0.0, 0.0),
    **fields: Any,
) -> Gate:
    """Readings that obey an orbit of their own, for so long; rise: of their level over those kept."""
    kept = row(0.0, kept_count, agc_db=None if rise is None else 6.0)
    from_s = kept_count + 10.0
    tai_s = from_s + np.array([0.0, waited_s / 3, waited_s / 2])
    waiting = Readings(tai_s, np.full(3, LOBE_DEG), np.zeros(3), None if rise is None else np.full(3, 6.0 + rise))
    gate = Gate(kept, waiting, _is_clear=True, **fields)
    gate.orbits.alone = lambda one: beside(Readings(one.tai_s, np.zeros(len(one)), one.el_deg))
    gate.orbits.strains = list(strains)
    taken = gate.take(row(from_s + waited_s, 1, LOBE_DEG, None if rise is None else 6.0 + rise), FIT)
    assert (taken is None) is (gate.reset_count == 1)
    return gate


@pytest.mark.parametrize(
    ("kept_count", "needed_s", "how"),
    [
        (2, 10.0, {}),
        (5, 15.0, {}),
        (24, 72.0, {}),
        (100, 75.0, {}),
        (100, 10.0, {"strains": (20.0 + STEP, 0.0)}),
        (100, 75.0, {"strains": (20.0, 0.0)}),
        (100, 75.0, {"strains": (0.0, 99.0)}),
        (100, 10.0, {"rise": 6.0 + STEP}),
        (100, 75.0, {"rise": 6.0}),
        (100, 75.0, {"rise": 0.0, "strains": (99.0, 0.0)}),
        (100, 75.0, {"rise": -3.0}),
        (100, 150.0, {"rise": -3.0 - STEP}),
        (5, 30.0, {"rise": -9.0}),
    ],
)
def test_readings_that_obeyed_an_orbit_for_long_enough_take_the_place_of_those_kept(
    kept_count: int, needed_s: float, how: dict[str, Any]
) -> None:
    early = reset(kept_count, needed_s - STEP, **how)
    assert (len(early.kept), early.reset_count) == (kept_count, 0)
    gate = reset(kept_count, needed_s, **how)
    assert gate.reset_count == 1
    assert gate.kept.tai_s[0] >= kept_count
    assert gate.counts[BELIED] == kept_count
    assert (len(gate.waiting), gate._waiting_reason, gate._is_clear) == (0, "", False)


def test_what_is_no_orbits_replaces_nothing() -> None:
    gate = Gate(row(0.0, 2), row(10.0, 5, LOBE_DEG), _is_clear=True)
    assert times(gate.take(row(90.0, 1, LOBE_DEG), FIT)) == []
    assert (len(gate.kept), gate.reset_count, gate.orbits.asked) == (2, 0, [(2, 1), (None, 1)])


@pytest.mark.parametrize(("ago_s", "is_considered"), [(limits.CLEAR_S, True), (limits.CLEAR_S - STEP, False)])
def test_a_reset_is_considered_so_often(ago_s: float, is_considered: bool) -> None:
    newest_s = 2 + 10.0 + 50.0
    gate = reset(2, 50.0, _reset_tai_s=newest_s - ago_s)
    assert (gate.reset_count == 1) is is_considered
    assert gate._reset_tai_s == (newest_s if is_considered else newest_s - ago_s)


def test_strain_is_judged_by_the_newest_of_both() -> None:
    gate = reset(100, 50.0)
    assert gate.orbits.strained == [31, 2]  # 30 s of those kept; of those that wait, the ones at 25 and 50 s


# Correlated


class Correlated(Uncorrelated):
    """All that is near is asked about, and is correlated since then."""

    def __init__(self, begin_tai_s: float, *, are_they: bool = True) -> None:
        self.begin_tai_s, self.are_they = begin_tai_s, are_they
        self.taken = 0

    def is_within(self, seen: Offsets) -> Array:
        return seen.is_near

    def take(self, readings: Readings) -> None:
        self.taken += len(readings)

    def are_correlated(self, kept: Readings, offsets_of: Callable[[Readings], Offsets]) -> bool:
        return self.are_they and len(offsets_of(kept).tai_s) == len(kept)


@pytest.mark.parametrize(("begin_s", "kept_count"), [(25.0, 25), (24.5, 25), (29.0, 29), (29.5, 30)])
def test_what_is_correlated_is_left_out_with_what_was_kept_of_it(begin_s: float, kept_count: int) -> None:
    gate = Gate(row(0.0, 30), _correlated=Correlated(begin_s))
    taken = gate.take(row(30.0, 2, NEAR_DEG), FIT)
    assert (taken is None) is (kept_count < 30)
    assert times(gate.kept) == times(row(0.0, kept_count))
    assert (gate.counts, gate.rejecting) == ({CORRELATED: 32 - kept_count}, CORRELATED)


@pytest.mark.parametrize(("kept_count", "is_asked"), [(20, True), (19, False)])
def test_a_fit_to_few_readings_cannot_tell_what_is_correlated(kept_count: int, is_asked: bool) -> None:
    correlated = Correlated(15.0)
    gate = Gate(row(0.0, kept_count), _correlated=correlated)
    gate.take(row(30.0, 2, NEAR_DEG), FIT)
    assert (gate.rejecting, correlated.taken) == (CORRELATED if is_asked else "", 2)
    assert len(gate.kept) == (15 if is_asked else kept_count + 2)


def test_with_what_is_correlated_those_farther_off_wait() -> None:
    gate = Gate(row(0.0, 30), _correlated=Correlated(99.0))
    taken = gate.take(Readings.joined([row(30.0, 1, NEAR_DEG), row(31.0, 2, LOBE_DEG)]), FIT)
    assert (times(taken), times(gate.waiting), len(gate.kept)) == ([], [31.0, 32.0], 30)
    assert gate.counts == {CORRELATED: 1, SIDE_LOBE: 2}


def test_what_is_asked_about_and_is_not_correlated_is_kept_and_the_question_needs_no_sigma() -> None:
    gate = Gate(row(0.0, 30), _correlated=Correlated(25.0, are_they=False))
    assert times(gate.take(row(30.0, 2, NEAR_DEG), FIT)) == [30.0, 31.0]
    assert (len(gate.kept), gate.counts) == (32, {})
    asked = Gate(row(0.0, 30), _correlated=Correlated(99.0))
    covariance = np.eye(2)
    asked.take(row(30.0, 2, NEAR_DEG), replace(FIT, covariance=covariance))
    assert [one is covariance for one in asked.covariances] == [True, False]
