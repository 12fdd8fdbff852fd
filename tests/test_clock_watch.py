"""P7: a clock that is not synchronised, stepped, or off by a share of the beam is an alarm; a step is never obeyed."""

from dataclasses import replace

import pytest
from flights import RISING_TAI_S, climb, demo_target, events_named
from test_tick import NOW, path

from acu_daemon.config.to_settings import control_config, driver_of
from acu_daemon.daemon.clock_watch import ClockWatch
from acu_daemon.daemon.live import live_text
from acu_daemon.edge.clock import LoopClock

T = RISING_TAI_S
RATE_DEG_S = 0.487  # of test_tick's path: 0.5 deg/s of azimuth at 40 deg of elevation, and 0.3 deg/s of elevation


class Told:
    """A clock that says what the test tells it."""

    difference_s = 0.0
    is_synchronised: bool | None = True

    def follow(self) -> float:
        return self.difference_s

    def tai_s(self) -> float:
        return NOW

    def monotonic_s(self) -> float:
        return 0.0

    async def sleep_until(self, tai_s: float) -> None: ...

    def close(self) -> None: ...


def alarm(difference_s: float, is_synchronised: bool | None = True, alarm_deg: float = 0.01) -> str:
    clock = Told()
    clock.difference_s, clock.is_synchronised = difference_s, is_synchronised
    watch = ClockWatch(clock, alarm_deg)
    watch.look(path())
    return watch.alarm


def test_p7_a_good_clock_and_one_that_nobody_can_judge_are_no_alarm() -> None:
    assert alarm(0.001) == ""
    assert alarm(0.001, None) == ""


def test_p7_a_clock_without_synchronisation_is_an_alarm_that_says_what_to_do() -> None:
    assert "chrony" in alarm(0.0, is_synchronised=False)


@pytest.mark.parametrize("sign", [1, -1])
def test_p7_a_clock_that_is_off_by_the_set_share_of_the_beam_at_the_present_rate_is_an_alarm(sign: int) -> None:
    limit_s = 0.01 / RATE_DEG_S
    assert alarm(sign * limit_s * 0.98) == ""
    assert "at the present rate" in alarm(sign * limit_s * 1.02)


def test_p7_the_share_and_the_beam_come_from_the_configuration() -> None:
    target = demo_target(safety={"clock_alarm_beam_fraction": 0.2}, receiver={"beamwidth_deg": 0.5})
    assert control_config(
        target.station, target.satellite, driver_of(target.station), 0.0
    ).clock_alarm_deg == pytest.approx(0.1)


class Stepped(LoopClock):
    """The system clock jumps in mid-pass, and back later."""

    step_s = -3600.0

    def follow(self) -> float:
        return self.step_s if T + 12.0 < self.tai_s() < T + 20.0 else 0.0001


@pytest.mark.long
@pytest.mark.parametrize("step_s", [-3600.0, 1.0])
def test_p7_a_step_in_mid_pass_is_an_alarm_in_the_snapshot_and_changes_no_command(step_s: float) -> None:
    class OneStep(Stepped):
        pass

    OneStep.step_s = step_s
    stepped, plain = (climb(25.0, losses=[(10.0, 24.0)], make_clock=clock) for clock in (OneStep, LoopClock))
    assert stepped.commands == plain.commands
    seen = [one.clock_alarm for one in stepped.snapshots if T + 13.1 < one.tai_s < T + 20.0]
    assert all(f"stepped by {step_s:+.3f} s: not obeyed" in text for text in seen)
    assert stepped.snapshots[-1].clock_alarm == ""
    assert len(events_named(stepped, "clock.stepped")) == len(events_named(stepped, "clock.back")) == 1
    assert f"stepped by {step_s:+.3f} s" in live_text(next(one for one in stepped.snapshots if one.clock_alarm))


class Late(LoopClock):
    """Every wake-up in a stretch of two seconds comes late, some by several ticks."""

    async def sleep_until(self, tai_s: float) -> None:
        await super().sleep_until(tai_s + (0.27 if T + 15.0 < tai_s < T + 17.0 else 0.0))


@pytest.mark.long
def test_p8_late_ticks_are_counted_and_the_writes_never_catch_up_in_a_burst() -> None:
    flight = climb(25.0, make_clock=Late)
    assert flight.outcome is not None
    assert flight.outcome.skipped_tick_count >= 10
    ticks = [seen.tick_count + seen.skipped_tick_count for seen in flight.snapshots]
    assert all(after >= before for before, after in zip(ticks, ticks[1:], strict=False))
    assert ticks[-1] == pytest.approx(250, abs=3)
    times = [write.tai_s for write in flight.writes if write.tai_s > T + 10.0]
    for first, tenth in zip(times, times[10:], strict=False):
        assert tenth - first > 0.7  # never more than ten writes in the time of seven


def test_the_snapshot_of_a_good_clock_has_no_alarm() -> None:
    seen = climb(8.0).snapshots[-1]
    assert (seen.clock_alarm, seen.encoder_problem, seen.latch, seen.arming) == ("", "", "", "armed")
    assert "DISARMED" in live_text(replace(seen, arming="disarmed"))
    assert "latched: azimuth" in live_text(replace(seen, latch="azimuth moves away from its command"))
