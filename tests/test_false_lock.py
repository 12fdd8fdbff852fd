"""A lock of autotrack on something else is left for the prediction; one on the satellite never is."""

from dataclasses import replace

import numpy as np
import pytest
from flights import RISING_TAI_S, climb, demo_target, events_named, worst_error_deg
from memories import remembering
from test_gate_in_flight import GUST_S, LOUD, SIDE_LOBE_BEAMS, push
from test_search import straight_path

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.tick_input import Observation, Sky, TickInput
from acu_daemon.control.tracking.false_lock import CALM_SHARE, MOST_LEFT, watch_lock
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import AxisLimits, Correction, FitResult, Reading
from acu_daemon.pointing.envelope import Envelope

LEFT_S = 12.0  # from a false lock until the antenna is back on the satellite
DRIVE_DEG_S = 2.0
CONFIG = ControlConfig(
    Envelope(AxisLimits(-720.0, 720.0, DRIVE_DEG_S, 5.0), AxisLimits(-90.0, 180.0, DRIVE_DEG_S, 5.0)),
    leave_false_lock=True,
    false_lock_s=2.0,
)
FIT = FitResult("full", Correction(), 0.0, 1000, 0, 0.0, 0.0, 0.0)


def flown(duration_s: float, **changes: object) -> Flight:
    return climb(duration_s, demo_target(tracking={"leave_false_lock": True}), **changes)


@pytest.mark.long
def test_a_side_lobe_is_left_and_the_satellite_is_tracked_again() -> None:
    push_deg = SIDE_LOBE_BEAMS * demo_target().station.receiver.beamwidth_deg
    losses = [(GUST_S - 1.0, GUST_S)]
    flight = flown(GUST_S + 25.0, losses=losses, script=[(GUST_S, push(push_deg))], receiver=LOUD)
    [told] = events_named(flight, "lock.false")
    assert told["off_deg"] == pytest.approx(push_deg, abs=0.3)
    assert flight.states()[-3:] == ["FALSE-LOCK", "HOLD/FITTED", "AUTOTRACK/FITTED"]
    assert worst_error_deg(flight, RISING_TAI_S + GUST_S + LEFT_S, RISING_TAI_S + GUST_S + 25.0) < 0.1
    assert flight.snapshots[-1].false_lock_count == 1


@pytest.mark.long
def test_a_carrier_that_stands_still_like_the_sun_or_a_far_satellite_is_left() -> None:
    flight = flown(75.0, faults=["false-lock start_s=45 duration_s=15"])
    assert len(events_named(flight, "lock.false")) == 1
    assert "FALSE-LOCK" in flight.states()
    assert worst_error_deg(flight, RISING_TAI_S + 57.0, RISING_TAI_S + 75.0) < 0.15
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


@pytest.mark.long
def test_a_lock_on_the_satellite_is_not_left_and_without_the_key_none_is() -> None:
    clean = flown(70.0, losses=[(40.0, 50.0)])
    assert events_named(clean, "lock.false") == []
    flight = climb(65.0, faults=["false-lock start_s=45 duration_s=15"])
    assert events_named(flight, "lock.false") == []


def told_locks(
    seconds_off: list[tuple[float, float]], az_rate_deg_s: float = 0.2, el_rate_deg_s: float = 0.0
) -> list[Event]:
    """The false locks told while autotrack is beside a mature fit's path: spells of (length s, beams off)."""
    path = straight_path(0.0, el_rate_deg_s, az_rate_deg_s)
    path = replace(path, kind="FITTED", sigma_deg=np.full(path.az_deg.size, 1e-3))
    state, events, tai_s = remembering(track=TrackState.AUTOTRACK_FITTED), [], 0.0
    status = AcuStatus(0.0, 0.0, AcuMode.AUTOTRACK, is_acquired=True)
    for length_s, beams in seconds_off:
        for _ in range(round(10.0 * length_s)):
            point = path.at(tai_s)
            reading = Reading(tai_s, point.az_deg, point.el_deg + beams * CONFIG.beamwidth_deg, True)
            seen = Observation(status=status, reading=reading)
            state = watch_lock(state, TickInput(seen, Sky(path, FIT), tai_s), CONFIG, events)
            tai_s += 0.1
    return events


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("way", [-1.0, 1.0])
@pytest.mark.parametrize("share", [0.9 * CALM_SHARE, 1.1 * CALM_SHARE])
def test_a_lock_is_judged_by_how_fast_the_path_moves_and_not_by_its_way(axis: int, way: float, share: float) -> None:
    rates = [0.0, 0.0]
    rates[axis] = way * share * DRIVE_DEG_S
    assert len(told_locks([(4.0, 2.0)], *rates)) == (share < CALM_SHARE)


def test_what_is_left_again_and_again_is_not_left_for_ever_however_good_it_is_between() -> None:
    told = told_locks([(4.0, 2.0), (3.0, 0.0)] * (MOST_LEFT + 3))
    assert [one.fields["count"] for one in told] == list(range(1, MOST_LEFT + 1))


def test_only_what_is_beside_the_path_without_a_break_is_left() -> None:
    assert told_locks([(1.5, 2.0), (0.2, 0.0)] * 6) == []
