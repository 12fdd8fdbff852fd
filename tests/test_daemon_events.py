"""What happens to the ACU, the link, the clock and the fit in mid-pass, and what the daemon makes of it."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import pytest
from flights import (
    DEMO_ANTENNA,
    DEMO_TAI_S,
    ORDERS,
    RISING_TAI_S,
    WRONG_ORBIT,
    Script,
    climb,
    commands_between,
    count,
    demo_target,
    events_named,
    fastest_followed_deg_s,
    flight_of,
    register_errors_deg,
    seconds_to_state,
    sky_of,
    state_at,
    the_pass,
    worst_error_deg,
)

from acu_daemon.acu.commands import AcuMode, Identify, Poll, ReadFaults, SelectMode, Stop, Stow
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, predict_from
from acu_daemon.cli.virtual_pass import Flight, ScriptAccess
from acu_daemon.config.tracking_tables import LEAST_LOW_WATER_S
from acu_daemon.daemon.background import RETRY_S, fit_deadline_s
from acu_daemon.daemon.live import live_text
from acu_daemon.drivers.sa3842.messages import (
    Command,
    Identity,
    Nak,
    ReadRegisters,
    Reply,
    ResetFault,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.fit import START_S, FitDiedError, FitFailedError, InlineFitRunner
from acu_daemon.errors import NoAcuError, UsageError
from acu_daemon.model import Model
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.scenario import AcuChoice, SkyErrors

HOLD_DEG = 0.1
RELOCK_S = 1.0
TICK_S = 0.1
FIRST_FIT_S = 1.5  # of autotrack: dwell, and the readings of a first fit
T = RISING_TAI_S


def acu_does(what: Callable[[FakeAcu, float], object]) -> Callable[[ScriptAccess], None]:
    return lambda stage: (what(stage.acu, stage.clock.tai_s()), None)[1]


def cut(is_cut: bool) -> Callable[[ScriptAccess], None]:
    def action(stage: ScriptAccess) -> None:
        stage.link.is_cut = is_cut

    return action


# Loss of signal


def test_a_loss_is_held_within_two_ticks_and_the_signal_relocked_within_a_second() -> None:
    flight = climb(21.5, losses=[(10.0, 20.0)])
    assert seconds_to_state(flight, "HOLD/FITTED", T + 10.0) <= 2 * TICK_S + 0.02
    assert worst_error_deg(flight, T + 10.0, T + 20.0) < HOLD_DEG
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", T + 20.0) <= RELOCK_S


@cache
def acquired_after_s() -> float:
    """When the signal is first acquired in the climb."""
    return next(seen.tai_s for seen in climb(4.0).snapshots if seen.state.startswith("AUTOTRACK")) - T


@pytest.mark.long
@pytest.mark.parametrize("after_s", [0.8, 1.2, 2.0])
def test_an_early_loss_makes_no_jump(after_s: float) -> None:
    lost_s = acquired_after_s() + after_s
    flight = climb(lost_s + 5.5, losses=[(lost_s, lost_s + 6.0)])
    before = next(row.beam_error_deg for row in flight.rows if row.tai_s > T + lost_s - 0.1)
    assert worst_error_deg(flight, T + lost_s, T + lost_s + 5.0) < (before or 0.0) + HOLD_DEG
    assert seconds_to_state(flight, "HOLD/TLE" if after_s < FIRST_FIT_S else "HOLD/FITTED", T + lost_s) <= 0.25


class Slow(InlineFitRunner):
    """Answers after five seconds."""

    async def refit(self, request: RefitRequest) -> RefitReply:
        reply = await super().refit(request)
        await asyncio.sleep(5.0)
        return reply


def test_a_loss_before_the_first_fit_is_held_on_the_elements_until_the_fit_comes() -> None:
    flight = climb(20.0, losses=[(8.0, 18.5)], make_runner=Slow)
    states = flight.states()
    at = states.index("HOLD/TLE")
    assert states[at - 1 : at + 3] == ["AUTOTRACK/TLE", "HOLD/TLE", "HOLD/FITTED", "AUTOTRACK/FITTED"]
    assert worst_error_deg(flight, T + 8.0, T + 18.5) < 2 * HOLD_DEG


def test_several_losses_in_a_row_are_each_held_and_relocked() -> None:
    losses = [(8.0 + 2.0 * k, 9.0 + 2.0 * k) for k in range(5)]
    flight = climb(18.5, losses=losses)
    assert worst_error_deg(flight, T + 8.0, T + 18.5) < HOLD_DEG
    assert all(seconds_to_state(flight, "AUTOTRACK/FITTED", T + end) <= RELOCK_S for _, end in losses)


@pytest.mark.long
def test_a_long_hold_never_empties_the_buffer() -> None:
    flight = climb(62.0, losses=[(15.0, 60.0)])
    filled = [seen for seen in flight.snapshots if seen.buffer_kind]
    assert min(seen.buffer_s for seen in filled) >= 29.0
    assert worst_error_deg(flight, T + 15.0, T + 60.0) < HOLD_DEG
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


@pytest.mark.long
def test_registers_are_within_a_tenth_of_a_degree_in_autotrack_after_ten_seconds() -> None:
    flight = climb(28.0)
    assert max(register_errors_deg(flight, sky_of(demo_target()), T + 15.0, T + 28.0)) < 0.1


# Search


def test_a_search_starts_only_after_hold_s() -> None:
    target = demo_target(fallback={"hold_s": 20.0, "search_s": 30.0}, tracking={"estimator": "kalman"})
    flight = climb(33.0, target, losses=[(12.0, 60.0)])
    assert seconds_to_state(flight, "SEARCH", T + 12.0) == pytest.approx(20.2, abs=0.2)


@pytest.mark.long
def test_no_search_leaves_a_prediction_whose_three_sigma_are_within_the_beam() -> None:
    target = demo_target(fallback={"hold_s": 5.0, "search_s": 30.0}, tracking={"estimator": "full"})
    flight = climb(50.0, target, losses=[(25.0, 60.0)])
    sure = [seen for seen in flight.snapshots if seen.state == "HOLD/FITTED" and seen.inside_s]
    assert len(sure) > 200
    assert seconds_to_state(flight, "SEARCH", T + 25.0) == float("inf")


def test_a_search_finds_a_satellite_that_is_three_seconds_late() -> None:
    target = demo_target(fallback={"acquire_s": 3.0})
    flight = flight_of(target, DEMO_TAI_S, 20.0, antenna=DEMO_ANTENNA, errors=SkyErrors(along_track_s=3.0))
    states = flight.states()
    found = states.index("SEARCH")
    assert states[found : found + 3] == ["SEARCH", "AUTOTRACK/TLE", "AUTOTRACK/FITTED"]
    assert worst_error_deg(flight, DEMO_TAI_S + 17.0, DEMO_TAI_S + 20.0) < HOLD_DEG


def test_a_search_without_success_goes_back_to_the_path_and_searches_again() -> None:
    target = demo_target(fallback={"acquire_s": 5.0, "hold_s": 5.0, "search_s": 10.0})
    flight = climb(40.0, target, losses=[(0.0, 60.0)])
    states = flight.states()
    assert states[states.index("SEARCH") :][:4] == ["SEARCH", "HOLD/TLE", "SEARCH", "HOLD/TLE"]
    az_deg_s, el_deg_s = fastest_followed_deg_s(flight)
    assert az_deg_s <= 20.0
    assert el_deg_s <= 5.0
    assert flight.outcome is not None
    assert not flight.outcome.has_acquired


# The link


def test_p2_p3_a_silent_link_is_lost_after_half_a_second_and_asked_anew_before_anything_is_commanded() -> None:
    flight = climb(24.5, losses=[(8.0, 23.0)], script=[(10.0, cut(True)), (15.0, cut(False))])
    assert seconds_to_state(flight, "LINK-LOST", T + 10.0) == pytest.approx(0.55, abs=0.16)
    back_s = seconds_to_state(flight, "IDLE", T + 15.0)
    assert back_s < 1.5
    after = [command for command in commands_between(flight, T + 11.0, T + 24.5) if not isinstance(command, Poll)]
    first_order = next(i for i, command in enumerate(after) if isinstance(command, ORDERS))
    assert [type(command) for command in after[:2]] == [Identify, ReadRegisters]
    assert first_order >= 2
    assert isinstance(after[first_order], WriteRegisters)
    assert worst_error_deg(flight, T + 15.0 + back_s + 5.0, T + 23.0) < HOLD_DEG
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    assert flight.outcome is not None
    assert flight.outcome.connect_count == 2


def test_a_link_that_is_hung_up_comes_back_at_once_and_autotrack_is_left_alone() -> None:
    flight = climb(14.0, script=[(8.0, lambda stage: stage.link.hang_up())])
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", T + 8.2) < 2.0
    assert not any(isinstance(command, SelectMode) for command in commands_between(flight, T + 8.0, T + 13.9))
    assert worst_error_deg(flight, T + 7.0, T + 13.9) < HOLD_DEG


@pytest.mark.long
@pytest.mark.parametrize("losses", [[], [(7.0, 30.0)]], ids=["autotrack", "hold"])
def test_p2_on_another_connection_however_soon_it_came_all_is_read_again_before_anything_is_commanded(
    losses: list[tuple[float, float]],
) -> None:
    """Who answers on it may be another ACU, or the same one after a loss of power."""
    hung_up_s = [8.0, 11.02, 14.04, 17.06, 20.08]  # everywhere in a tick
    flight = climb(22.5, losses=losses, script=[(at_s, lambda stage: stage.link.hang_up()) for at_s in hung_up_s])
    for at_s in hung_up_s:
        assert seconds_to_state(flight, "LINK-LOST", T + at_s) < 3 * TICK_S
        told = commands_between(flight, T + at_s + 0.005, T + at_s + 2.4)
        after = [command for command in told if not isinstance(command, Poll)]
        if isinstance(after[0], WriteAndPoll):  # in mid-air
            after = after[1:]
        assert [type(command) for command in after[:2]] == [Identify, ReadRegisters]
        assert isinstance(next(command for command in after if isinstance(command, ORDERS)), WriteRegisters)
        assert state_at(flight, T + at_s) == ("HOLD/FITTED" if losses else "AUTOTRACK/FITTED")


def test_p3_a_long_silence_ends_within_two_seconds_of_its_cause() -> None:
    flight = climb(34.0, script=[(7.0, cut(True)), (30.0, cut(False))])
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", T + 30.0) < 3.0


@pytest.mark.long
@pytest.mark.parametrize(
    "blow",
    [
        [(10.0, cut(True)), (11.0, cut(False))],
        [(10.05, acu_does(lambda acu, now: acu.power_cycle(now)))],
    ],
    ids=["link", "power"],
)
def test_a_blow_in_a_long_loss_brings_back_the_hold_on_the_fit_and_no_early_search(blow: Script) -> None:
    target = demo_target(fallback={"acquire_s": 5.0})
    flight = climb(27.0, target, losses=[(8.0, 27.0)], script=blow)
    assert "SEARCH" not in flight.states()
    assert state_at(flight, T + 26.0) == "HOLD/FITTED"
    assert worst_error_deg(flight, T + 17.0, T + 27.0) < HOLD_DEG


def test_one_lost_reply_costs_one_write_and_no_state() -> None:
    flight = climb(10.0, script=[(8.005, cut(True)), (8.045, cut(False))])
    assert "LINK-LOST" not in flight.states()[1:]
    times = [tai_s for tai_s, command in flight.commands if isinstance(command, WriteAndPoll) and tai_s > T + 6.0]
    assert max(b - a for a, b in zip(times, times[1:], strict=False)) < 0.35


def test_a_line_that_loses_one_reply_in_ten_never_loses_the_path() -> None:
    blinks = [(5.0 + 0.97 * k + d, cut(is_cut)) for k in range(20) for d, is_cut in ((0.0, True), (0.05, False))]
    flight = climb(26.0, losses=[(10.0, 23.0)], script=blinks)
    assert worst_error_deg(flight, T + 10.0, T + 23.0) < HOLD_DEG
    assert "LINK-LOST" not in flight.states()
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


def test_no_acu_at_the_start_ends_the_run_after_ten_seconds() -> None:
    with pytest.raises(NoAcuError, match="10 s"):
        climb(30.0, script=[(0.0, cut(True))])


# The ACU's own affairs


def test_under_the_local_panel_it_only_polls_and_comes_back_when_it_may() -> None:
    flight = climb(
        26.0,
        losses=[(8.0, 25.0)],
        script=[
            (10.05, acu_does(lambda acu, now: acu.set_local(True, now))),
            (15.05, acu_does(lambda acu, now: acu.set_local(False, now))),
        ],
    )
    assert seconds_to_state(flight, "MANUAL", T + 10.0) < 0.35
    assert {type(command) for command in commands_between(flight, T + 10.25, T + 15.0)} == {Poll}
    assert seconds_to_state(flight, "MANUAL", T + 15.3) == float("inf")
    assert worst_error_deg(flight, T + 20.0, T + 25.0) < HOLD_DEG


@pytest.mark.long
@pytest.mark.parametrize("losses", [[], [(8.0, 22.0)]], ids=["tracking", "lost"])
def test_p3_after_a_power_cycle_of_the_acu_it_is_on_the_satellite_again_within_seconds(
    losses: list[tuple[float, float]],
) -> None:
    flight = climb(22.0, losses=losses, script=[(10.05, acu_does(lambda acu, now: acu.power_cycle(now)))])
    assert worst_error_deg(flight, T + 14.0, T + 21.5) < HOLD_DEG
    az_deg_s, el_deg_s = fastest_followed_deg_s(flight)
    assert az_deg_s <= 20.0
    assert el_deg_s <= 5.0


def test_a_stow_from_elsewhere_is_respected_until_it_is_left() -> None:
    flight = climb(
        30.0,
        script=[
            (6.05, acu_does(lambda acu, _now: acu.answer(Stow()))),
            (14.05, acu_does(lambda acu, _now: acu.answer(SelectMode(AcuMode.STANDBY)))),
        ],
    )
    assert state_at(flight, T + 14.0) == "STOW"
    sent = commands_between(flight, T + 6.3, T + 14.0)
    assert not any(isinstance(command, SelectMode) for command in sent)
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


def test_a_stow_from_elsewhere_is_respected_through_a_loss_of_the_link() -> None:
    flight = climb(
        26.0,
        script=[
            (6.05, acu_does(lambda acu, _now: acu.answer(Stow()))),
            (22.0, cut(True)),
            (23.0, cut(False)),
        ],
    )
    assert flight.rows[-1].mode is AcuMode.STOWED
    assert state_at(flight, T + 25.9) == "STOW"


def test_a_stow_by_the_local_panel_is_respected_when_remote_control_comes_back() -> None:
    def stow_by_hand(stage: ScriptAccess) -> None:
        stage.acu.set_local(False, stage.clock.tai_s())
        stage.acu.answer(Stow())

    flight = climb(
        22.0,
        script=[(6.0, acu_does(lambda acu, now: acu.set_local(True, now))), (9.0, stow_by_hand)],
    )
    assert flight.rows[-1].mode in (AcuMode.STOWING, AcuMode.STOWED)


def test_an_antenna_found_stowed_is_taken_out_for_the_pass() -> None:
    flight = climb(14.0, antenna=AcuChoice(azimuth_deg=160.0, elevation_deg=60.0, mode="stowed"))
    assert SelectMode(AcuMode.STANDBY) in [command for _, command in flight.commands]
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


@pytest.mark.parametrize("mode", ["standby", "remote"])
def test_p1_however_the_acu_was_left_nothing_moves_before_its_registers_are_known(mode: str) -> None:
    antenna = AcuChoice(azimuth_deg=100.0, elevation_deg=60.0, mode=mode)  # type: ignore[arg-type]
    flight = climb(2.0, antenna=antenna, noise_deg=0.0)
    planned = next(i for i, (_, command) in enumerate(flight.commands) if isinstance(command, WriteAndPoll))
    still = [row.encoder_az_deg for row in flight.rows if row.tai_s < flight.commands[planned][0]]
    assert max(still) - min(still) < 0.02


def test_a_fault_is_read_once_never_reset_and_the_satellite_tracked_after_it() -> None:
    def mend(stage: ScriptAccess) -> None:
        stage.acu.end_fault("azimuth", 0, stage.clock.tai_s())
        stage.acu.answer(ResetFault())

    flight = climb(
        22.5,
        script=[(8.05, acu_does(lambda acu, now: acu.begin_fault("azimuth", 0, now))), (16.05, mend)],
    )
    assert state_at(flight, T + 16.0) == "FAULT"
    assert count(flight, ReadFaults) == 1
    assert events_named(flight, "acu.faults")[0]["faults"] == ("azimuth over-current",)
    assert count(flight, ResetFault) == 0
    assert not any(isinstance(command, SelectMode) for command in commands_between(flight, T + 8.3, T + 16.0))
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", T + 16.1) < 6.0


class Unwilling(FakeAcu):
    """Refuses every MODE SELECT."""

    def answer(self, command: Command) -> Reply:
        return Nak() if isinstance(command, SelectMode) else super().answer(command)


def test_a_refused_mode_select_is_followed_by_a_poll_and_not_repeated_blindly() -> None:
    flight = climb(20.0, make_acu=Unwilling)
    refused = [i for i, (_, command) in enumerate(flight.commands) if isinstance(command, SelectMode)]
    assert refused
    assert all(isinstance(flight.commands[i + 1][1], Poll) for i in refused)
    times = [flight.commands[i][0] for i in refused]
    assert all(b - a > 1.95 for a, b in zip(times, times[1:], strict=False))


class Moody(FakeAcu):
    """Refuses one register write."""

    refusal_tai_s = T + 10.0

    def answer(self, command: Command) -> Reply:
        if isinstance(command, WriteAndPoll) and self._tai_s >= self.refusal_tai_s:
            self.refusal_tai_s = float("inf")
            return Nak()
        return super().answer(command)


def test_a_single_refused_write_is_followed_by_a_poll_and_costs_the_beam_nothing() -> None:
    flight = climb(16.0, losses=[(8.0, 30.0)], make_acu=Moody)
    at = next(i for i, (tai_s, _) in enumerate(flight.commands) if tai_s > T + 10.0 - 0.05)
    kinds = [type(command) for _, command in flight.commands[at : at + 4]]
    assert Poll in kinds
    assert worst_error_deg(flight, T + 8.0, T + 16.0) < HOLD_DEG


# Safety


def test_the_tilt_register_is_sent_back_unchanged() -> None:
    def tilt(stage: ScriptAccess) -> None:
        stage.acu.answer(WriteRegisters(167.0, 20.0, 364))

    antenna = AcuChoice(azimuth_deg=168.0, elevation_deg=20.0, has_tilt=True)
    flight = climb(6.0, antenna=antenna, script=[(0.0, tilt)])
    sent = [command for _, command in flight.commands if isinstance(command, WriteAndPoll)]
    assert {command.tilt_code for command in sent} == {364}


def test_p1_disarmed_nothing_is_ever_commanded() -> None:
    flight = climb(20.0, demo_target(safety={"arm": "manual"}))
    assert count(flight, (*ORDERS, Stop)) == 0
    assert count(flight, Poll) > 150
    assert {row.encoder_az_deg for row in flight.rows} == {168.0}


class Real(FakeAcu):
    """Says it is no simulation, and notes what it is told."""

    heard: list[Command]

    def answer(self, command: Command) -> Reply:
        self.heard.append(command)
        return Identity("3842", "10") if isinstance(command, Identify) else super().answer(command)


def test_a_rehearsal_refuses_a_real_acu_before_anything_is_written() -> None:
    Real.heard = []
    with pytest.raises(UsageError, match="real one"):
        climb(20.0, make_acu=Real)
    assert not any(isinstance(command, ORDERS) for command in Real.heard)
    assert not any(isinstance(command, Stop) for command in Real.heard)


class Mumbling(FakeAcu):
    """Its first identities arrive garbled."""

    said: list[Identity]

    def answer(self, command: Command) -> Reply:
        return self.said.pop(0) if self.said and isinstance(command, Identify) else super().answer(command)


@pytest.mark.long
@pytest.mark.parametrize("garbled", [("3842", "Q1"), ("1842", "S1"), ("3842", "1S"), ("3802", "10")])
def test_a_rehearsal_asks_again_when_the_identity_is_garbled(garbled: tuple[str, str]) -> None:
    Mumbling.said = [Identity(*garbled)]
    flight = climb(10.0, make_acu=Mumbling)
    assert len(events_named(flight, "acu.identity_doubted")) == 1
    assert state_at(flight, T + 10.0) == "AUTOTRACK/FITTED"


def test_a_rehearsal_refuses_what_twice_says_it_is_another_acu() -> None:
    Mumbling.said = [Identity("3862", "30"), Identity("3862", "30")]
    with pytest.raises(UsageError, match="3862"):
        climb(10.0, make_acu=Mumbling)


@pytest.mark.long
@pytest.mark.parametrize("at_s", [8.03, 8.005], ids=["between two exchanges", "within one"])
@pytest.mark.parametrize("losses", [[], [(6.0, 30.0)]], ids=["tracking", "lost"])
def test_a_stop_in_mid_pass_leaves_the_acu_in_standby(losses: list[tuple[float, float]], at_s: float) -> None:
    """The exchange that is going on ends first: one command is outstanding at most (docs/protocol.md, Link)."""
    flight = climb(30.0, losses=losses, script=[(at_s, lambda stage: stage.service.stop("SIGTERM"))])
    assert flight.outcome is not None
    assert flight.outcome.reason == "SIGTERM"
    assert flight.outcome.is_stopped
    assert [command for _, command in flight.commands[-2:]] == [Stop(), WriteParameter("W", 0)]
    assert flight.commands[-3][1] == Poll()
    assert flight.rows[-1].mode is AcuMode.STANDBY or flight.commands[-1][0] < T + 8.2


def test_a_stop_while_the_local_panel_has_control_sends_nothing() -> None:
    flight = climb(
        30.0,
        script=[
            (6.05, acu_does(lambda acu, now: acu.set_local(True, now))),
            (8.0, lambda stage: stage.service.stop("SIGTERM")),
        ],
    )
    assert count(flight, Stop) == 0
    assert events_named(flight, "stop.left_alone")


def test_a_stop_while_the_link_is_lost_waits_a_moment_for_it() -> None:
    script = [(7.0, cut(True)), (8.0, lambda stage: stage.service.stop("SIGTERM")), (8.3, cut(False))]
    flight = climb(30.0, script=script)
    assert flight.outcome is not None
    assert flight.outcome.is_stopped
    assert [command for _, command in flight.commands[-2:]] == [Stop(), WriteParameter("W", 0)]


def test_a_safe_stop_polls_first_and_sends_nothing_to_an_antenna_that_was_stowed_while_the_link_was_cut() -> None:
    script = [
        (7.0, cut(True)),
        (7.5, acu_does(lambda acu, _now: acu.answer(Stow()))),
        (8.0, lambda stage: stage.service.stop("SIGTERM")),
        (9.0, cut(False)),
    ]
    flight = climb(30.0, script=script)
    assert flight.outcome is not None
    assert flight.outcome.is_stopped
    assert count(flight, Stop) == 0
    assert [event["mode"] for event in events_named(flight, "stop.left_alone")] == ["STOWING"]
    assert flight.rows[-1].mode is AcuMode.STOWING


@pytest.mark.parametrize("verb", ["cut", "no-reply", "deaf"])
@pytest.mark.parametrize("silent_s", [0.4, 1.5, 4.0])
def test_a_safe_stop_is_tried_for_five_seconds_of_a_silent_line(verb: str, silent_s: float) -> None:
    flight = climb(
        30.0,
        faults=[f"{verb} start_s=6.03 duration_s={silent_s}"],
        script=[(6.05, lambda stage: stage.service.stop("SIGTERM"))],
    )
    assert flight.outcome is not None
    assert flight.outcome.is_stopped
    assert flight.commands[-2:][0][1] == Stop()
    assert T + 6.03 + silent_s < flight.commands[-2][0] < T + 6.03 + silent_s + 1.0
    assert not events_named(flight, "stop.timeout")


def test_a_stop_on_a_dead_link_is_reported_and_does_not_hang() -> None:
    flight = climb(30.0, script=[(7.0, cut(True)), (8.0, lambda stage: stage.service.stop("SIGTERM"))])
    assert flight.outcome is not None
    assert not flight.outcome.is_stopped
    assert events_named(flight, "stop.timeout")
    assert flight.snapshots[-1].tai_s < T + 8.2


def test_a_stop_while_the_acu_stows_sends_nothing() -> None:
    flight = climb(
        30.0,
        script=[
            (7.05, acu_does(lambda acu, _now: acu.answer(Stow()))),
            (8.0, lambda stage: stage.service.stop("SIGTERM")),
        ],
    )
    assert count(flight, Stop) == 0
    assert flight.rows[-1].mode is AcuMode.STOWING


# The fit


class Failing(InlineFitRunner):
    """Fails every time, after having predicted once."""

    done_count = 0

    async def refit(self, request: RefitRequest) -> RefitReply:
        self.done_count += 1
        if self.done_count > self.good_count:
            raise FitFailedError("the fit process died: test")
        return await super().refit(request)

    good_count = 1


class NeverFitting(Failing):
    good_count = 0


def write_gaps_s(flight: Flight, from_tai_s: float) -> list[float]:
    times = [t for t, command in flight.commands if isinstance(command, WriteAndPoll) and t >= from_tai_s]
    return [b - a for a, b in zip(times, times[1:], strict=False)]


def test_p9_a_fit_that_fails_disturbs_no_tick_and_is_logged() -> None:
    flight = climb(15.0, losses=[(8.0, 14.0)], make_runner=Failing)
    assert write_gaps_s(flight, T + 2.0) == pytest.approx([TICK_S] * len(write_gaps_s(flight, T + 2.0)), abs=1e-3)
    assert events_named(flight, "fit.failed")
    assert flight.outcome is not None
    assert flight.outcome.refit_failed_count == len(events_named(flight, "fit.failed"))
    assert "HOLD/TLE" in flight.states()


def test_a_fit_that_always_fails_is_not_asked_more_than_twice_a_second() -> None:
    flight = climb(20.0, make_runner=NeverFitting)
    assert flight.outcome is not None
    assert 10 <= flight.outcome.refit_failed_count <= 42


def test_p9_a_fit_that_answers_late_disturbs_no_tick() -> None:
    flight = climb(27.0, losses=[(16.0, 26.0)], make_runner=Slow)
    gaps_s = write_gaps_s(flight, T + 8.0)
    assert gaps_s == pytest.approx([TICK_S] * len(gaps_s), abs=1e-3)
    assert worst_error_deg(flight, T + 16.0, T + 26.0) < HOLD_DEG


class Denied(InlineFitRunner):
    """From its tenth answer on it goes back to the elements."""

    def __init__(self, setup: RefitSetup) -> None:
        super().__init__(setup)
        self._setup, self._count = setup, 0

    async def refit(self, request: RefitRequest) -> RefitReply:
        self._count += 1
        reply = await super().refit(request)
        if self._count < 10:
            return reply
        elements = predict_from(self._setup, None, request, Model.ELEMENTS)
        return replace(reply, fit=None, prediction=elements, model=Model.ELEMENTS)


@pytest.mark.long
def test_when_the_elements_steer_again_state_snapshot_and_live_line_say_so() -> None:
    flight = climb(27.0, losses=[(16.0, 25.5)], make_runner=Denied)
    states = flight.states()
    at = states.index("AUTOTRACK/FITTED")
    assert states[at:] == ["AUTOTRACK/FITTED", "AUTOTRACK/TLE", "HOLD/TLE", "AUTOTRACK/TLE"]
    for seen in flight.snapshots:
        is_fitted = seen.buffer_kind == "FITTED"
        assert (seen.model == "new fit") == is_fitted
        assert seen.state.endswith("FITTED") <= is_fitted
        assert ("no fit in force" in live_text(seen)) == (not is_fitted)
        assert (seen.fit_age_s is not None) == is_fitted
    assert worst_error_deg(flight, T + 16.0, T + 25.5) < HOLD_DEG  # on what autotrack showed of the path


class Leisurely(InlineFitRunner):
    """Answers after most of a second, and notes when it was asked and had answered, TAI."""

    ANSWER_S = 0.75

    def __init__(self, setup: RefitSetup) -> None:
        super().__init__(setup, self.ANSWER_S)
        self.asked_tai_s: list[float] = []

    async def refit(self, request: RefitRequest) -> RefitReply:
        self.asked_tai_s.append(request.now_tai_s)
        return await super().refit(request)


@pytest.mark.long
@pytest.mark.parametrize("lost_s", [8.0, 8.2, 8.4, 8.6, 8.8])
def test_a_loss_is_answered_by_a_fresh_buffer_at_once_or_as_soon_as_the_fit_in_hand_is_done(lost_s: float) -> None:
    made: list[Leisurely] = []

    def make(setup: RefitSetup) -> Leisurely:
        made.append(Leisurely(setup))
        return made[-1]

    flight = climb(11.0, losses=[(lost_s, 11.0)], make_runner=make)
    held_tai_s = T + lost_s + seconds_to_state(flight, "HOLD/FITTED", T + lost_s)
    (runner,) = made
    in_hand_until_tai_s = max(at for at in runner.asked_tai_s if at < held_tai_s - TICK_S / 2) + Leisurely.ANSWER_S
    next_tai_s = min(at for at in runner.asked_tai_s if at >= held_tai_s - TICK_S / 2)
    assert next_tai_s <= max(held_tai_s, in_hand_until_tai_s) + TICK_S / 2


class Hanging(InlineFitRunner):
    """Hangs from its tenth question on, for ever, or until a deadline ends it, as its successors are ended."""

    asked_count = 0
    deadline_s = float("inf")
    start_s = 0.0  # that a new one has more

    async def refit(self, request: RefitRequest) -> RefitReply:
        self.asked_count += 1
        if self.asked_count < 10:
            return await super().refit(request)
        await asyncio.sleep(min(self.deadline_s + (self.start_s if self.asked_count > 10 else 0.0), 1e6))
        raise FitDiedError("the fit process gave no answer")


class EndedHanging(Hanging):
    deadline_s, start_s = fit_deadline_s(10.0), START_S


@pytest.mark.parametrize("runner", [Hanging, EndedHanging])
@pytest.mark.parametrize(("horizon_s", "low_water_s", "back_s"), [(30.0, 10.0, 70.0), (10.0, LEAST_LOW_WATER_S, 45.0)])
def test_p9_a_fit_that_hangs_never_leaves_a_dry_buffer(
    runner: type[Hanging], horizon_s: float, low_water_s: float, back_s: float
) -> None:
    target = demo_target(tracking={"horizon_s": horizon_s, "low_water_s": low_water_s})
    flight = climb(back_s + 2.0, target, losses=[(15.0, back_s)], make_runner=runner)
    assert min(seen.buffer_s for seen in flight.snapshots if seen.buffer_kind) >= low_water_s / 2 - RETRY_S
    assert worst_error_deg(flight, T + 15.0, T + back_s) < HOLD_DEG
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


# Time


class Stalling(LoopClock):
    """Wakes 0.35 s late, once."""

    stalls_at_tai_s = T + 10.0
    stall_s = 0.35

    async def sleep_until(self, tai_s: float) -> None:
        await super().sleep_until(tai_s)
        if tai_s >= self.stalls_at_tai_s:
            self.stalls_at_tai_s = float("inf")
            await asyncio.sleep(self.stall_s)


def test_p8_late_ticks_are_counted_and_skipped_never_sent_in_a_burst() -> None:
    flight = climb(15.0, losses=[(8.0, 14.0)], make_clock=Stalling)
    assert flight.outcome is not None
    assert flight.outcome.skipped_tick_count == 3
    gaps_s = write_gaps_s(flight, T + 7.0)
    assert max(gaps_s) < 0.47
    assert min(gaps_s) > 0.04
    assert sum(gap < 0.09 for gap in gaps_s) <= 1
    assert worst_error_deg(flight, T + 8.0, T + 14.0) < HOLD_DEG


class NearlyMissing(Stalling):
    """Wakes 80 ms late, once."""

    stall_s = 0.08


def test_p8_after_a_tick_that_came_near_the_next_one_that_one_is_skipped_and_counted() -> None:
    """P8."""
    flight = climb(13.0, losses=[(8.0, 12.0)], make_clock=NearlyMissing)
    assert flight.outcome is not None
    assert flight.outcome.skipped_tick_count == 1
    assert min(write_gaps_s(flight, T + 7.0)) > 0.09


class Stepped(LoopClock):
    """The system clock jumps by three seconds in mid-pass, and back later."""

    def follow(self) -> float:
        return 3.0 if T + 9.0 < self.tai_s() < T + 13.0 else 0.0001


def test_p7_a_step_of_the_system_clock_is_reported_once_and_not_obeyed() -> None:
    flight = climb(18.0, losses=[(8.0, 17.0)], make_clock=Stepped)
    [event] = events_named(flight, "clock.stepped")
    assert event["difference_s"] == 3.0
    assert len(events_named(flight, "clock.back")) == 1
    assert worst_error_deg(flight, T + 8.0, T + 17.0) < HOLD_DEG


# A slow line


def test_p4_at_9600_baud_a_start_comes_to_its_first_write_of_the_path_in_half_a_second() -> None:
    flight = climb(3.0, antenna=AcuChoice(azimuth_deg=168.0, elevation_deg=20.0), byte_time_s=10 / 9600)
    first_write_tai_s = next(tai_s for tai_s, command in flight.commands if isinstance(command, WriteAndPoll))
    assert first_write_tai_s - flight.commands[0][0] < 0.5


@pytest.mark.long
@pytest.mark.parametrize(("baud", "latency_s"), [(9600, 0.013), (9600, 0.002), (19200, 0.010), (0, 0.020)])
def test_p8_a_start_with_several_exchanges_in_a_tick_makes_the_next_tick_no_later(baud: int, latency_s: float) -> None:
    def ask(stage: ScriptAccess, line: str) -> None:
        assert stage.service.answer(line).startswith("ok ")

    script = [(3.0 + k * 0.973, partial(ask, line=("disarm", "arm")[k % 2])) for k in range(8)]
    antenna = AcuChoice(azimuth_deg=168.0, elevation_deg=20.0, reply_latency_s=latency_s)
    flight = climb(11.0, antenna=antenna, byte_time_s=10 / baud if baud else 0.0, script=script)
    assert flight.outcome is not None
    assert flight.outcome.skipped_tick_count == 0
    assert flight.outcome.is_stopped


@pytest.mark.long
@pytest.mark.parametrize("latency_s", [0.002, 0.010, 0.020])
def test_at_9600_baud_the_registers_keep_their_rhythm_and_housekeeping_gets_through(latency_s: float) -> None:
    antenna = AcuChoice(azimuth_deg=168.0, elevation_deg=20.0, reply_latency_s=latency_s)
    flight = climb(17.5, losses=[(8.0, 16.0)], antenna=antenna, byte_time_s=10 / 9600)
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    gaps_s = write_gaps_s(flight, T + 5.0)
    assert gaps_s == pytest.approx([TICK_S] * len(gaps_s), abs=2e-3)
    assert worst_error_deg(flight, T + 8.0, T + 16.0) < HOLD_DEG
    assert flight.outcome is not None
    assert flight.outcome.skipped_tick_count == 0


# Ends


def test_the_end_of_the_pass_ends_the_run() -> None:
    target = demo_target()
    coming = the_pass(target, RISING_TAI_S)
    begin = coming.set_tai_s - 20.0
    antenna = AcuChoice(azimuth_deg=-12.0, elevation_deg=5.5)
    flight = flight_of(target, begin, 60.0, antenna=antenna)
    assert flight.outcome is not None
    assert flight.outcome.reason == "pass over"
    assert flight.outcome.is_stopped
    late_s = [seen.along_s for seen in flight.snapshots if seen.along_s is not None][-1]
    assert late_s == pytest.approx(WRONG_ORBIT.along_track_s, abs=1.5)  # all that 20 s at 5 deg elevation tell
    assert flight.commands[-1][0] == pytest.approx(coming.set_tai_s + 1.0 + late_s, abs=0.2)
    for seen in flight.snapshots:
        assert seen.set_in_s == pytest.approx(coming.set_tai_s + (seen.along_s or 0.0) - seen.tai_s, abs=1e-3)
        assert tai_from_utc(seen.set_utc) == pytest.approx(seen.tai_s + seen.set_in_s, abs=0.51)  # whole seconds


def test_an_antenna_that_autotracks_long_before_the_pass_is_left_to_whoever_uses_it() -> None:
    target = demo_target()
    begin = the_pass(target, RISING_TAI_S).rise_tai_s - 600.0

    def use(stage: ScriptAccess) -> None:
        stage.acu.answer(SelectMode(AcuMode.AUTOTRACK))

    class Other:
        """Another satellite, that stands still."""

        def direction(self, _tai_s: float) -> tuple[float, float, float]:
            return 30.0, 40.0, 1e6

    antenna = AcuChoice(azimuth_deg=30.0, elevation_deg=40.0)
    flight = flight_of(target, begin, 15.0, antenna=antenna, script=[(0.0, use)], sky=Other())
    assert flight.states() == ["IDLE"]
    assert flight.outcome is not None
    assert flight.outcome.refit_count == 0
    assert not flight.outcome.has_begun
