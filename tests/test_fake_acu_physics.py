"""The simulated pedestal, receiver and autotrack: limits, following error, real loss at the zenith, relock."""

from itertools import pairwise
from math import atan, degrees, radians, sqrt, tan
from statistics import mean, stdev

import pytest
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Bench, Star
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.acu.commands import AcuMode, Backup, Poll, SelectBackup, SelectMode
from acu_daemon.drivers.sa3842.messages import Ack, Status, WriteParameter, WriteRegisters
from acu_daemon.model import AxisLimits, sky_angle_deg
from acu_daemon.sim.command_registers import choose_turn, turns_within
from acu_daemon.sim.pedestal import STEP_S, Axis, Follower
from acu_daemon.sim.receiver import offset_in_beam
from acu_daemon.sim.scenario import AcuChoice, Encoder, ReceiverChoice, Scenario
from acu_daemon.sim.sky import Direction
from acu_daemon.sim.trace import TraceRow

OVERSHOOT_DEG = 0.002
ORDINARY_TRACKING_DEG = 0.02
FOLLOWING_S = 0.025  # docs/protocol.md, Servo
EPS = 1e-9


class Overhead:
    """A satellite on a straight line at constant speed past the zenith, azimuth 0 to 180 on the east side."""

    def __init__(self, culmination_el_deg: float, rate_deg_s: float, culmination_s: float) -> None:
        self.miss = 1.0 / tan(radians(culmination_el_deg))
        self.rate, self.culmination_s = radians(rate_deg_s), culmination_s

    def direction(self, tai_s: float) -> Direction | None:
        along = -self.rate * (tai_s - START_TAI_S - self.culmination_s)
        az_deg = 90.0 - degrees(atan(along / self.miss))
        return az_deg, degrees(atan(1.0 / sqrt(along**2 + self.miss**2))), 1e6


def track(sky: object, culmination_s: float, receiver: ReceiverChoice | None = None) -> list[TraceRow]:
    az_deg, el_deg, _ = sky.direction(START_TAI_S)  # type: ignore[attr-defined]
    scenario = Scenario(acu=AcuChoice(azimuth_deg=az_deg, elevation_deg=el_deg), receiver=receiver or ReceiverChoice())
    bench = Bench(sky, scenario)  # type: ignore[arg-type]
    rows: list[TraceRow] = []
    bench.acu.observer = rows.append
    bench.acu.answer(SelectBackup(Backup.RATE))
    assert bench.acu.answer(SelectMode(AcuMode.AUTOTRACK)) == Ack()
    bench.wait(2 * culmination_s)
    return rows


@pytest.mark.parametrize("limits", [AZIMUTH, ELEVATION])
@given(way_deg=st.floats(0.0, 80.0))
def test_an_axis_reaches_a_target_within_its_limits_and_without_overshoot(limits: AxisLimits, way_deg: float) -> None:
    axis = Axis(limits, 0.0)
    last_deg_s, farthest_deg = 0.0, 0.0
    for _ in range(1200):
        axis.move()
        axis.drive_to(way_deg, 0.0)
        assert abs(axis.rate_deg_s) <= limits.max_rate_deg_s + EPS
        assert abs(axis.rate_deg_s - last_deg_s) <= limits.max_acceleration_deg_s2 * STEP_S + EPS
        last_deg_s, farthest_deg = axis.rate_deg_s, max(farthest_deg, axis.angle_deg)
    assert axis.angle_deg == pytest.approx(way_deg, abs=OVERSHOOT_DEG)
    assert farthest_deg <= way_deg + OVERSHOOT_DEG


def test_a_half_turn_takes_what_rate_and_acceleration_allow() -> None:
    """Outside number: 180 deg at 20 deg/s and 10 deg/s^2 take 180/20 + 20/10 = 11 s."""
    axis = Axis(AZIMUTH, 0.0)
    step_count = 0
    while abs(axis.angle_deg - 180.0) > 0.05:
        axis.move()
        axis.drive_to(180.0, 0.0)
        step_count += 1
    assert 11.0 <= step_count * STEP_S <= 11.3


@pytest.mark.parametrize("rate_deg_s", [0.1, 1.0, 5.0, 15.0])
def test_the_steady_following_error_is_within_the_icd(rate_deg_s: float) -> None:
    limits = AxisLimits(-1e4, 1e4, 20.0, 10.0)
    axis, follower = Axis(limits, 0.0), Follower(limits)
    follower.start(0.0)
    for k in range(1, 1000):
        axis.move()
        follower.aim(rate_deg_s * k * STEP_S)
        axis.drive_to(follower.target_deg, follower.rate_deg_s)
    assert abs(rate_deg_s * 999 * STEP_S - axis.angle_after_deg(0.0)) <= FOLLOWING_S * rate_deg_s


@pytest.mark.parametrize("rate_deg_s", [0.3, 1.0, 3.0, 10.0])
def test_stairs_aimed_at_their_middle_are_followed_on_average_without_lag(rate_deg_s: float) -> None:
    limits = AxisLimits(-1e4, 1e4, 20.0, 10.0)
    axis, follower = Axis(limits, 0.0), Follower(limits)
    follower.start(0.0)
    errors_deg = []
    for k in range(1, 1500):
        axis.move()
        if k % 5 == 0:
            follower.aim(rate_deg_s * (k * STEP_S + 0.05))
        else:
            follower.wait()
        axis.drive_to(follower.target_deg, follower.rate_deg_s)
        errors_deg.append(rate_deg_s * k * STEP_S - axis.angle_deg)
    settled_deg = errors_deg[750:]
    assert abs(mean(settled_deg)) <= FOLLOWING_S * rate_deg_s
    assert max(map(abs, settled_deg)) <= 0.05 * rate_deg_s


def test_a_target_that_stops_coming_is_reached_and_held() -> None:
    bench = Bench(Star(is_on=False))
    bench.acu.answer(SelectMode(AcuMode.REMOTE))
    for k in range(50):
        bench.acu.answer(WriteRegisters(30.0 + 0.1 * k, 40.0))
        bench.wait(0.1)
    bench.wait(2.0)
    assert bench.acu.trace_row().encoder_az_deg == pytest.approx(34.9, abs=0.004)


@given(st.floats(-5, 5), st.floats(0, 85), st.floats(-5, 5))
def test_the_offset_in_the_beam_is_as_long_as_the_angle_on_the_sky(d_az: float, el: float, d_el: float) -> None:
    offset = offset_in_beam(100.0 + d_az, el + d_el, 100.0, el)
    assert offset.angle_deg == pytest.approx(sky_angle_deg(100.0 + d_az, el + d_el, 100.0, el), abs=1e-9)
    if d_az > 1e-6:
        assert offset.right_deg > 0


@given(st.floats(0, 360, exclude_max=True), st.floats(-270, 270), st.sampled_from([0, 1, 2]))
def test_the_chosen_turn_is_the_bearing_and_inside_the_limits(bearing: float, present: float, preference: int) -> None:
    turn_deg = choose_turn(bearing, present, AZIMUTH, preference)
    assert -270.0 - 1e-6 <= turn_deg <= 270.0 + 1e-6
    assert (turn_deg - bearing) % 360.0 == pytest.approx(0.0, abs=1e-6) or (turn_deg - bearing) % 360.0 > 359.999
    assert turn_deg in turns_within(bearing, AZIMUTH)


def test_the_signal_ends_where_the_beam_has_lost_half_its_power() -> None:
    for offset_deg, is_acquired in ((0.45, True), (0.55, False)):
        bench = Bench(Star(el_deg=40.0 + offset_deg))
        bench.wait(0.5)
        status = bench.acu.answer(Poll())
        assert isinstance(status, Status)
        assert status.is_acquired is is_acquired


def test_ordinary_rates_are_tracked_closely() -> None:
    """A 60 deg pass of a low orbit: 1 deg/s at culmination."""
    rows = track(Overhead(60.0, 1.0, 100.0), 100.0)
    assert max(row.beam_error_deg or 0.0 for row in rows[20:]) < ORDINARY_TRACKING_DEG
    assert {row.mode for row in rows} == {AcuMode.AUTOTRACK}


def test_near_the_zenith_the_azimuth_cannot_follow_and_the_signal_is_really_lost() -> None:
    rows = track(Overhead(89.8, 0.35, 150.0), 150.0)
    modes = [mode for mode, after in pairwise([row.mode for row in rows]) if mode is not after]
    assert modes[0] is AcuMode.AUTOTRACK
    lost = next(row for row in rows if row.mode is not AcuMode.AUTOTRACK)
    assert lost.satellite_el_deg is not None
    assert lost.satellite_el_deg > 88.0
    assert lost.has_signal
    assert max(abs(b.encoder_az_deg - a.encoder_az_deg) for a, b in pairwise(rows)) <= 20.0 * 0.1 + EPS


def test_a_pass_the_azimuth_can_follow_is_not_lost() -> None:
    """At 87.5 deg and 0.5 deg/s the azimuth needs 11.5 deg/s."""
    rows = track(Overhead(87.5, 0.5, 100.0), 100.0)
    assert {row.mode for row in rows} == {AcuMode.AUTOTRACK}


def test_after_a_loss_it_relocks_within_a_second_of_the_beam_coming_back() -> None:
    star = Star()
    bench = Bench(star)
    bench.acu.answer(SelectBackup(Backup.REMOTE))
    bench.acu.answer(SelectMode(AcuMode.AUTOTRACK))
    bench.wait(2.0)
    star.is_on = False
    bench.wait(5.0)
    star.az_deg, star.is_on = 30.3, True
    bench.wait(1.0)
    row = bench.acu.trace_row()
    assert row.mode is AcuMode.AUTOTRACK
    assert row.beam_error_deg is not None
    assert row.beam_error_deg < 0.05


def test_rate_memory_goes_on_at_the_rates_of_the_loss_and_brakes_at_a_soft_limit() -> None:
    star = Star(az_rate_deg_s=0.5, el_rate_deg_s=0.3)
    bench = Bench(star)
    bench.acu.answer(WriteParameter("A", 0))
    bench.acu.answer(WriteParameter("R", 0xFFFF))
    bench.acu.answer(SelectMode(AcuMode.AUTOTRACK))
    bench.wait(10.0)
    star.is_on = False
    bench.wait(10.0)
    row = bench.acu.trace_row()
    assert row.mode is AcuMode.RATE_MEMORY
    assert row.encoder_az_deg == pytest.approx(40.0, abs=0.1)
    assert row.encoder_el_deg == pytest.approx(46.0, abs=0.1)
    bench.wait(200.0)
    assert bench.acu.trace_row().encoder_el_deg == pytest.approx(90.0, abs=0.001)


def test_encoder_noise_is_as_large_as_asked_across_and_in_elevation() -> None:
    scenario = Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=60.0), encoder=Encoder(noise_deg=0.03))
    bench = Bench(Star(is_on=False), scenario)
    readings = [bench.acu.answer(Poll()) for _ in range(2000)]
    az = [reading.az_deg for reading in readings if isinstance(reading, Status)]
    el = [reading.el_deg for reading in readings if isinstance(reading, Status)]
    assert stdev(el) == pytest.approx(0.03, rel=0.1)
    assert stdev(az) * 0.5 == pytest.approx(0.03, rel=0.1)
    assert bench.acu.trace_row().boresight_el_deg == 60.0


def test_tracking_noise_moves_the_beam_by_what_was_asked() -> None:
    rows = track(Star(), 100.0, ReceiverChoice(tracking_noise_deg=0.02))
    assert stdev(row.boresight_el_deg for row in rows[50:]) == pytest.approx(0.02, rel=0.35)


def test_the_same_seed_gives_the_same_pass_bit_for_bit_and_another_seed_another() -> None:
    def pass_of(seed: int) -> list[TraceRow]:
        scenario = Scenario(
            acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0), receiver=ReceiverChoice(tracking_noise_deg=0.02)
        )
        bench = Bench(Star(az_rate_deg_s=0.5), scenario, seed=seed)
        rows: list[TraceRow] = []
        bench.acu.observer = rows.append
        bench.acu.answer(SelectMode(AcuMode.AUTOTRACK))
        bench.wait(10.0)
        return rows

    assert pass_of(1) == pass_of(1)
    assert pass_of(1) != pass_of(2)


def test_how_often_it_is_asked_to_advance_does_not_matter() -> None:
    star = Star(az_rate_deg_s=0.5)
    seldom, often = Bench(star), Bench(star)
    for bench in (seldom, often):
        bench.acu.answer(SelectMode(AcuMode.AUTOTRACK))
    seldom.wait(5.0)
    for _ in range(5000):
        often.wait(0.001)
    assert seldom.acu.trace_row() == often.acu.trace_row()


def test_a_reading_between_two_ticks_is_where_the_axis_is_then() -> None:
    bench = Bench(Star(is_on=False))
    bench.acu.answer(WriteRegisters(200.0, 40.0))
    bench.acu.answer(SelectMode(AcuMode.REMOTE))
    bench.wait(4.0)
    seen = []
    for _ in range(5):
        status = bench.acu.answer(Poll())
        assert isinstance(status, Status)
        seen.append(status.az_deg)
        bench.wait(0.005)
    assert [b - a for a, b in pairwise(seen)] == [pytest.approx(0.1, abs=1e-3)] * 4


def test_the_trace_comes_ten_times_a_second() -> None:
    bench = Bench()
    rows: list[TraceRow] = []
    bench.acu.observer = rows.append
    bench.wait(2.0)
    assert [round(row.tai_s - START_TAI_S, 6) for row in rows] == [round(0.1 * k, 6) for k in range(1, 21)]
