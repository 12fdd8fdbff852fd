"""What the daemon says and does while another signal draws the antenna away."""

from dataclasses import replace

import pytest
from flights import RISING_TAI_S, climb, demo_target, events_named, register_errors_deg, sky_of
from test_live_line import SEEN

from acu_daemon.assist.gate import DWELL, WRONG_TARGET
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.daemon.live import live_text
from acu_daemon.sim.sky import Direction, Sky

DRAWN_S, LOST_S, BACK_S, END_S = 25.0, 45.0, 50.0, 60.0
DRIFT_DEG_S = 0.2
CHASE_S = 2.5  # 4 degrees back to the satellite
T = RISING_TAI_S


class Drawn:
    """The satellite, but for a while another signal that leaves its path downwards, and then none."""

    def __init__(self, truth: Sky) -> None:
        self._truth = truth

    def direction(self, tai_s: float) -> Direction | None:
        seen = self._truth.direction(tai_s)
        at_s = tai_s - T
        if seen is None or LOST_S <= at_s < BACK_S:
            return None
        drift_deg = DRIFT_DEG_S * (at_s - DRAWN_S) if DRAWN_S <= at_s < LOST_S else 0.0
        return seen[0], seen[1] - drift_deg, seen[2]


@pytest.fixture(scope="module")
def drawn() -> Flight:
    return climb(END_S, sky=Drawn(sky_of(demo_target())))


def test_the_registers_stay_on_the_satellite_while_another_signal_draws_the_antenna_away(drawn: Flight) -> None:
    truth = sky_of(demo_target())
    assert max(register_errors_deg(drawn, truth, T + DRAWN_S + 6.0, T + LOST_S)) < 0.1
    assert max(register_errors_deg(drawn, truth, T + LOST_S + CHASE_S, T + BACK_S)) < 0.1


def test_the_change_is_logged_once_each_way_and_seen_in_every_snapshot(drawn: Flight) -> None:
    rejecting = [event for event in events_named(drawn, "fit.rejecting") if event["reason"] == WRONG_TARGET]
    assert len(rejecting) == 1
    assert len(events_named(drawn, "fit.accepting")) == 1
    seen = [one for one in drawn.snapshots if T + DRAWN_S + 6.0 < one.tai_s < T + LOST_S]
    assert {one.rejecting for one in seen} == {WRONG_TARGET}
    assert {one.model for one in seen} == {"new fit"}
    last = drawn.snapshots[-1]
    assert last.rejecting == ""
    assert last.rejected_counts[WRONG_TARGET] > 150
    assert 15 <= last.rejected_counts[DWELL] <= 25  # two locks, a second each


def test_the_live_line_says_why_readings_are_not_fitted() -> None:
    assert "rejecting: side lobe" in live_text(replace(SEEN, rejecting="side lobe"))
    assert "rejecting" not in live_text(SEEN)
