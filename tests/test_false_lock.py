"""A lock of autotrack on something else is left for the prediction; one on the satellite never is."""

import pytest
from flights import RISING_TAI_S, climb, demo_target, events_named, worst_error_deg
from test_gate_in_flight import GUST_S, LOUD, SIDE_LOBE_BEAMS, push

from acu_daemon.cli.virtual_pass import Flight

LEFT_S = 12.0  # from a false lock until the antenna is back on the satellite


def flown(duration_s: float, **changes: object) -> Flight:
    return climb(duration_s, demo_target(tracking={"leave_false_lock": True}), **changes)


def test_a_side_lobe_is_left_and_the_satellite_is_tracked_again() -> None:
    push_deg = SIDE_LOBE_BEAMS * demo_target().station.receiver.beamwidth_deg
    losses = [(GUST_S - 1.0, GUST_S)]
    flight = flown(GUST_S + 25.0, losses=losses, script=[(GUST_S, push(push_deg))], receiver=LOUD)
    [told] = events_named(flight, "lock.false")
    assert told["off_deg"] == pytest.approx(push_deg, abs=0.3)
    assert flight.states()[-3:] == ["FALSE-LOCK", "HOLD/FITTED", "AUTOTRACK/FITTED"]
    assert worst_error_deg(flight, RISING_TAI_S + GUST_S + LEFT_S, RISING_TAI_S + GUST_S + 25.0) < 0.1
    assert flight.snapshots[-1].false_lock_count == 1


def test_a_carrier_that_stands_still_like_the_sun_or_a_far_satellite_is_left() -> None:
    flight = flown(75.0, faults=["false-lock start_s=45 duration_s=15"])
    assert len(events_named(flight, "lock.false")) == 1
    assert "FALSE-LOCK" in flight.states()
    assert worst_error_deg(flight, RISING_TAI_S + 57.0, RISING_TAI_S + 75.0) < 0.15
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


def test_a_lock_on_the_satellite_is_not_left_and_without_the_key_none_is() -> None:
    clean = flown(70.0, losses=[(40.0, 50.0)])
    assert events_named(clean, "lock.false") == []
    flight = climb(65.0, faults=["false-lock start_s=45 duration_s=15"])
    assert events_named(flight, "lock.false") == []
