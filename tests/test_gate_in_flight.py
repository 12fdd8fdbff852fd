"""What the daemon says and does while another signal draws the antenna away."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from flights import RISING_TAI_S, climb, demo_target, events_named, register_errors_deg, rows_between, sky_of
from test_live_line import SEEN

from acu_daemon.assist.reading_gate import DWELL, SIDE_LOBE, WRONG_TARGET
from acu_daemon.cli.virtual_pass import Flight, ScriptAccess
from acu_daemon.daemon.live import live_text
from acu_daemon.sim.receiver import HALF_POWER_DB, SIDE_LOBE_BEAMS, SIDE_LOBE_DB, pattern_db
from acu_daemon.sim.scenario import ReceiverChoice
from acu_daemon.sim.sky import Direction, SimulatedSky

DRAWN_S, LOST_S, BACK_S, END_S = 25.0, 45.0, 50.0, 60.0
DRIFT_DEG_S = 0.2
CHASE_S = 2.5  # 4 degrees back to the satellite
T = RISING_TAI_S


class Drawn:
    """The satellite, but for a while another signal that leaves its path downwards, and then none."""

    def __init__(self, truth: SimulatedSky) -> None:
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


@pytest.mark.long
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


GUST_S, CALM_S, LOBE_END_S = 25.0, 85.0, 95.0  # a gust as the signal comes back, the next loss, the end
LOUD = ReceiverChoice(peak_agc_db=26.0)  # its side lobe is 3 dB over the threshold


def push(by_deg: float) -> Callable[[ScriptAccess], None]:
    """A gust that turns the antenna in an instant."""

    def act(stage: ScriptAccess) -> None:
        stage.acu._antenna.el.angle_deg += by_deg

    return act


@pytest.fixture(scope="module")
def on_side_lobe() -> Flight:
    target = demo_target()
    beam_deg = SIDE_LOBE_BEAMS * target.station.receiver.beamwidth_deg
    losses = [(GUST_S - 1.0, GUST_S), (CALM_S, CALM_S + 1.0)]
    return climb(LOBE_END_S, losses=losses, script=[(GUST_S, push(beam_deg))], receiver=LOUD)


@pytest.mark.long
def test_a_minute_on_the_side_lobe_is_named_and_leaves_the_registers_on_the_satellite(on_side_lobe: Flight) -> None:
    beam_deg = demo_target().station.receiver.beamwidth_deg
    on_lobe = rows_between(on_side_lobe, T + GUST_S + 2.0, T + CALM_S)
    off_beams = [row.beam_error_deg / beam_deg for row in on_lobe if row.beam_error_deg is not None]
    assert len(off_beams) == len(on_lobe)
    assert all(abs(one - SIDE_LOBE_BEAMS) < 0.2 for one in off_beams)
    truth = sky_of(demo_target())
    unlocked = climb(LOBE_END_S, losses=[(GUST_S - 1.0, LOBE_END_S)], receiver=LOUD)
    for begin_s, end_s in ((GUST_S + 2.0, CALM_S), (CALM_S + CHASE_S, LOBE_END_S)):
        on_lobe_deg, without_deg = (
            max(register_errors_deg(flight, truth, T + begin_s, T + end_s)) for flight in (on_side_lobe, unlocked)
        )
        assert on_lobe_deg < without_deg + 0.05
    seen = [one for one in on_side_lobe.snapshots if T + GUST_S + 5.0 < one.tai_s < T + CALM_S]
    assert sum(one.rejecting == SIDE_LOBE for one in seen) > 0.9 * len(seen)
    assert on_side_lobe.snapshots[-1].rejecting == ""


def test_the_side_lobe_is_that_of_a_tapered_aperture() -> None:
    """Outside number: the Hankel transform of an aperture lit by 1 - r^2 / 2."""
    r, u = np.linspace(0.0, 1.0, 1001), np.linspace(0.0, 9.0, 901)
    angle = np.linspace(0.0, np.pi, 361)
    bessel = np.trapezoid(np.cos(np.outer(u, np.sin(angle))), angle, axis=1) / np.pi
    field = np.array([np.trapezoid((1.0 - r**2 / 2.0) * np.interp(x * r, u, bessel) * r, r) for x in u])
    down_db = -20.0 * np.log10(np.abs(field / field[0]))
    beams = u / (2.0 * u[np.argmax(down_db > HALF_POWER_DB / 4.0)])
    null = np.argmax(field < 0.0)
    crest = null + int(np.argmin(down_db[null:]))
    assert beams[crest] == pytest.approx(SIDE_LOBE_BEAMS, abs=0.03)
    assert down_db[crest] == pytest.approx(SIDE_LOBE_DB, abs=1.0)
    for share in (-0.2, 0.0, 0.2):
        there = int(np.argmin(np.abs(beams - SIDE_LOBE_BEAMS - share)))
        assert pattern_db(SIDE_LOBE_BEAMS + share) == pytest.approx(down_db[there], abs=1.5)
