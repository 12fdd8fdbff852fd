"""control.tick as what it is: a pure function from what the ACU said to what it is told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import (
    AcuMode,
    Backup,
    Command,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadCommanded,
    ReadFaults,
    SelectBackup,
    SelectMode,
)
from acu_daemon.acu.replies import AcuStatus, Commanded, Refused
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.extra_exchange import EXTRA_REPEAT_S, REFUSED_EXTRA_S
from acu_daemon.control.orders import Orders
from acu_daemon.control.registers import CALM_SHARE, REFUSED_PAUSE_S
from acu_daemon.control.safety.command_permit import permit
from acu_daemon.control.state import ControlState, Lag, StartStage
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, PassPlan, Sky, StowBy, TickInput
from acu_daemon.control.tracking.lag import LagEstimate
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.drivers.sa3842.angles import LSB_DEG
from acu_daemon.drivers.sa3842.messages import Faults
from acu_daemon.drivers.sa3842.sa3842_driver import field_reply
from acu_daemon.model import AxisLimits, Prediction, Reading
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope

CONFIG = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
NOW = 8.4e8
AZ_DEG, EL_DEG, AZ_RATE, EL_RATE = 100.0, 40.0, 0.5, 0.3
LEAD_S = CONFIG.effect_delay_s + CONFIG.period_s / 2


def path(kind: str = "TLE", az_rate_deg_s: float = AZ_RATE, el_rate_deg_s: float = EL_RATE) -> Prediction:
    """A straight path through AZ_DEG, EL_DEG at NOW."""
    t = np.arange(-10, 900) * 0.1
    az, el = AZ_DEG + az_rate_deg_s * t, EL_DEG + el_rate_deg_s * t
    az_rate, el_rate = np.full(t.size, az_rate_deg_s), np.full(t.size, el_rate_deg_s)
    return Prediction(NOW - 1.0, 0.1, az, el, az_rate, el_rate, az, az_rate, kind, NOW)  # type: ignore[arg-type]


PLAN = PassPlan(NOW - 100.0, NOW + 500.0, NOW - 100.0, 50.0, 5.0)
SKY = Sky(path(), None, PLAN)
FITTED = Sky(path("FITTED"), None, PLAN)


def status(mode: AcuMode = AcuMode.AUTOTRACK, **changes: object) -> AcuStatus:
    values: dict[str, object] = {
        "backup_selected": Backup.REMOTE,
        "is_autotrack_selected": mode in (AcuMode.ACQUIRE, AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP),
        "is_acquired": mode is AcuMode.AUTOTRACK,
        "is_sector_high": True,
    }
    return AcuStatus(AZ_DEG, EL_DEG, mode, **values | changes)  # type: ignore[arg-type]


def ready(track: TrackState, seen: AcuStatus) -> ControlState:
    """A daemon that started long ago."""
    return remembering(
        track=track,
        entered_tai_s=NOW - 50.0,
        stage=StartStage.READY,
        status=seen,
        az_deg=AZ_DEG,
        in_force=(NOW - 0.1, AZ_DEG, EL_DEG),
    )


def saw(seen: AcuStatus, **changes: object) -> Observation:
    reading = Reading(NOW - 0.09, seen.az_deg, seen.el_deg, seen.is_acquired)
    return Observation(reading=reading, status=seen, **changes)  # type: ignore[arg-type]


def step(
    track: TrackState, seen: AcuStatus, sky: Sky = SKY, config: ControlConfig = CONFIG, **changes: object
) -> tuple[ControlState, Orders]:
    return tick(ready(track, seen), TickInput(saw(seen, **changes), sky, NOW), config)


# What is sent


def test_in_autotrack_the_registers_hold_the_path_at_the_middle_of_their_time_in_force() -> None:
    _, orders = step(TrackState.AUTOTRACK_FITTED, status(), FITTED)
    assert isinstance(orders.first, PointAndPoll)
    assert orders.first.az_deg == pytest.approx(AZ_DEG + AZ_RATE * LEAD_S, abs=LSB_DEG)
    assert orders.first.el_deg == pytest.approx(EL_DEG + EL_RATE * LEAD_S, abs=LSB_DEG)


def test_before_a_fit_the_registers_hold_the_reading_plus_the_motion_over_the_lead() -> None:
    seen = replace(status(), az_deg=AZ_DEG + 0.4, el_deg=EL_DEG - 0.2)
    _, orders = step(TrackState.AUTOTRACK_TLE, seen)
    assert isinstance(orders.first, PointAndPoll)
    lead_s = LEAD_S + 0.09  # the reading is that much older than now
    assert orders.first.az_deg == pytest.approx(AZ_DEG + 0.4 + AZ_RATE * lead_s, abs=LSB_DEG)
    assert orders.first.el_deg == pytest.approx(EL_DEG - 0.2 + EL_RATE * lead_s, abs=LSB_DEG)


def test_a_late_tick_aims_for_the_moment_it_really_writes() -> None:
    seen = status()
    _, orders = tick(ready(TrackState.AUTOTRACK_FITTED, seen), TickInput(saw(seen), FITTED, NOW + 0.35), CONFIG)
    assert isinstance(orders.first, PointAndPoll)
    assert orders.first.az_deg == pytest.approx(AZ_DEG + AZ_RATE * (0.35 + LEAD_S), abs=LSB_DEG)


@pytest.mark.parametrize(("gap_s", "is_learned"), [(0.1, True), (0.13, False), (0.2, False)])
def test_a_lag_is_learned_only_from_writes_that_come_a_period_apart(gap_s: float, is_learned: bool) -> None:
    """The stairs of a daemon without a processor, or of a line in trouble, are not those that the lag is read from."""
    state = remembering(ready(TrackState.HOLD_FITTED, status(AcuMode.REMOTE_BACKUP)), hold_from_tai_s=NOW)
    for k in range(30):
        now_tai_s = NOW + k * gap_s
        az_deg, el_deg = AZ_DEG + AZ_RATE * (k * gap_s - 0.05), EL_DEG + EL_RATE * (k * gap_s - 0.05)
        seen = replace(status(AcuMode.REMOTE_BACKUP), az_deg=az_deg, el_deg=el_deg)
        reading = Reading(now_tai_s - gap_s, az_deg, el_deg, is_locked=False)
        state, _ = tick(state, TickInput(Observation(reading=reading, status=seen), FITTED, now_tai_s), CONFIG)
    assert (state.lag.az.count > 0) is is_learned
    assert (state.lag.el.count > 0) is is_learned


@pytest.mark.parametrize("axis", ["azimuth", "elevation"])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("share", "is_learned"), [(0.9, True), (1.1, False)])
def test_a_lag_is_learned_only_where_the_drive_can_follow_whichever_way_it_turns(
    axis: str, side: int, share: float, is_learned: bool
) -> None:
    rate_deg_s = side * share * CALM_SHARE * getattr(CONFIG, axis).max_rate_deg_s
    az_rate, el_rate = (rate_deg_s, 0.0) if axis == "azimuth" else (0.0, rate_deg_s)
    sky = Sky(path("FITTED", az_rate, el_rate), None, PLAN)
    state = remembering(ready(TrackState.HOLD_FITTED, status(AcuMode.REMOTE_BACKUP)), hold_from_tai_s=NOW)
    for k in range(25):
        seen = replace(
            status(AcuMode.REMOTE_BACKUP), az_deg=AZ_DEG + az_rate * 0.1 * k, el_deg=EL_DEG + el_rate * 0.1 * k
        )
        reading = Reading(NOW + 0.1 * (k - 1), seen.az_deg, seen.el_deg, is_locked=False)
        state, _ = tick(state, TickInput(Observation(reading=reading, status=seen), sky, NOW + 0.1 * k), CONFIG)
    assert state.registers.commands[-1].is_free is is_learned


def test_a_latch_forgets_the_lag_that_was_learned_of_an_axis_that_failed() -> None:
    seen = status(AcuMode.REMOTE_BACKUP)
    state = remembering(
        ready(TrackState.HOLD_FITTED, seen), hold_from_tai_s=NOW, lag=Lag(LagEstimate(500, 5.0, 2.0, 0.9))
    )
    learned_s, _ = state.lag_s(CONFIG)
    for k in range(100):
        reading = Reading(NOW + 0.1 * k + 0.01, AZ_DEG, EL_DEG, False)  # it stands while the path goes on
        state, _ = tick(
            state, TickInput(Observation(reading=reading, status=seen), FITTED, NOW + 0.1 * (k + 1)), CONFIG
        )
        if state.latch.problem:
            break
        assert state.lag.az.count >= 500
    assert state.latch.problem
    assert state.lag_s(CONFIG)[0] != pytest.approx(learned_s)
    assert state.lag.az == LagEstimate()


def test_after_a_failed_exchange_nothing_but_a_poll_is_sent() -> None:
    _, orders = step(TrackState.HOLD_FITTED, status(AcuMode.STANDBY), FITTED, must_poll=True)
    assert (orders.first, orders.extra) == (Poll(), None)


def test_without_room_in_the_cycle_an_extra_takes_the_place_of_one_write() -> None:
    seen = status(backup_selected=Backup.RATE)
    _, orders = step(TrackState.AUTOTRACK_FITTED, seen, FITTED, has_room=False)
    assert (orders.first, orders.extra) == (SelectBackup(Backup.REMOTE), None)


def test_without_room_no_two_writes_in_a_row_give_way() -> None:
    seen = status(AcuMode.STANDBY, backup_selected=Backup.RATE)
    state = remembering(ready(TrackState.HOLD_FITTED, seen), entered_tai_s=NOW - 1.0, hold_from_tai_s=NOW)
    state, orders = tick(state, TickInput(saw(seen, has_room=False), FITTED, NOW), CONFIG)
    assert orders.first == SelectBackup(Backup.REMOTE)
    selected = replace(seen, backup_selected=Backup.REMOTE)
    state, orders = tick(state, TickInput(saw(selected, has_room=False), FITTED, NOW + 0.1), CONFIG)
    assert isinstance(orders.first, PointAndPoll)
    _, orders = tick(state, TickInput(saw(selected, has_room=False), FITTED, NOW + 0.2), CONFIG)
    assert orders.first == SelectMode(AcuMode.AUTOTRACK)


def test_with_room_an_extra_goes_beside_the_write() -> None:
    _, orders = step(TrackState.AUTOTRACK_FITTED, status(backup_selected=Backup.RATE), FITTED)
    assert isinstance(orders.first, PointAndPoll)
    assert orders.extra == SelectBackup(Backup.REMOTE)


@pytest.mark.parametrize("track", list(TrackState))
def test_under_the_local_panel_it_polls_and_nothing_else(track: TrackState) -> None:
    _, orders = step(track, status(AcuMode.MANUAL, is_remote_enabled=False))
    assert (orders.first, orders.extra) == (Poll(), None)


@pytest.mark.parametrize("track", list(TrackState))
@pytest.mark.parametrize("mode", list(AcuMode))
def test_disarmed_it_only_reads(track: TrackState, mode: AcuMode) -> None:
    state = remembering(ready(track, status(mode)), stage=StartStage.REGISTERS_KNOWN)
    _, orders = tick(state, TickInput(saw(status(mode)), SKY, NOW), replace(CONFIG, is_armed=False))
    assert orders.first == Poll()
    assert orders.extra is None or isinstance(orders.extra, ReadFaults)


@pytest.mark.parametrize("stage", [stage for stage in StartStage if stage is not StartStage.READY])
def test_before_the_start_is_done_no_path_is_written_and_no_mode_selected(stage: StartStage) -> None:
    state = remembering(ready(TrackState.IDLE, status(AcuMode.STANDBY)), stage=stage)
    _, orders = tick(state, TickInput(saw(status(AcuMode.STANDBY)), FITTED, NOW), CONFIG)
    for order in (orders.first, orders.extra):
        assert not isinstance(order, PointAndPoll | SelectMode | SelectBackup)


@pytest.mark.parametrize(
    ("is_confirmed", "later_s", "first"),
    [(True, 0.0, Identify()), (True, 0.2, Poll()), (False, 0.0, Poll())],
)
def test_a_start_goes_on_without_a_poll_while_it_is_sure_where_the_antenna_is(
    is_confirmed: bool, later_s: float, first: Command
) -> None:
    """On a slow line each poll beside the start's exchanges would cost half a tick."""
    seen = status(AcuMode.STANDBY)
    state = remembering(ready(TrackState.IDLE, seen), stage=StartStage.NEW)
    _, orders = tick(state, TickInput(saw(seen, is_confirmed=is_confirmed), FITTED, NOW + later_s), CONFIG)
    assert orders.first == first


# The states


def test_the_backup_is_selected_before_the_mode_and_the_mode_only_once_the_backup_shows() -> None:
    for backup, wanted in ((Backup.RATE, SelectBackup(Backup.REMOTE)), (Backup.REMOTE, SelectMode(AcuMode.AUTOTRACK))):
        seen = status(AcuMode.STANDBY, backup_selected=backup)
        state = remembering(ready(TrackState.ACQUIRE_TLE, seen), entered_tai_s=NOW - 1.0)
        _, orders = tick(state, TickInput(saw(seen), SKY, NOW), CONFIG)
        assert orders.extra == wanted


def test_a_loss_with_a_fit_is_held_on_the_fit_and_without_one_on_the_elements() -> None:
    lost = status(AcuMode.REMOTE_BACKUP, is_acquired=False)
    assert step(TrackState.AUTOTRACK_FITTED, lost, FITTED)[0].tracking.track is TrackState.HOLD_FITTED
    assert step(TrackState.AUTOTRACK_TLE, lost)[0].tracking.track is TrackState.HOLD_TLE


@pytest.mark.parametrize(
    ("track", "mode", "after"),
    [
        (TrackState.AUTOTRACK_FITTED, AcuMode.AUTOTRACK, TrackState.AUTOTRACK_TLE),
        (TrackState.HOLD_FITTED, AcuMode.REMOTE_BACKUP, TrackState.HOLD_TLE),
    ],
)
def test_the_state_says_what_steers_also_when_the_elements_steer_again(
    track: TrackState, mode: AcuMode, after: TrackState
) -> None:
    before = remembering(ready(track, status(mode)), hold_from_tai_s=NOW - 40.0)
    state, orders = tick(before, TickInput(saw(status(mode)), SKY, NOW), CONFIG)
    assert state.tracking.track is after
    assert "newer readings deny the fit" in str(orders.events[0].fields["cause"])
    assert state.tracking.hold_from_tai_s == NOW - 40.0  # the loss is no younger for it
    assert tick(before, TickInput(saw(status(mode)), FITTED, NOW), CONFIG)[0].tracking.track is track


@pytest.mark.parametrize(("sky", "after"), [(SKY, TrackState.HOLD_TLE), (FITTED, TrackState.HOLD_FITTED)])
def test_after_a_search_the_state_names_what_it_goes_back_to(sky: Sky, after: TrackState) -> None:
    before = remembering(ready(TrackState.SEARCH, status(AcuMode.ACQUIRE)), entered_tai_s=NOW - 121.0)
    assert tick(before, TickInput(saw(status(AcuMode.ACQUIRE)), sky, NOW), CONFIG)[0].tracking.track is after


@pytest.mark.parametrize("config", [CONFIG, replace(CONFIG, is_armed=False)])
@pytest.mark.parametrize("track", [TrackState.IDLE, TrackState.ACQUIRE_TLE])
def test_where_a_fit_steers_no_state_says_that_the_elements_do(config: ControlConfig, track: TrackState) -> None:
    state, _ = tick(ready(track, status(AcuMode.ACQUIRE)), TickInput(saw(status(AcuMode.ACQUIRE)), FITTED, NOW), config)
    assert state.tracking.track is TrackState.HOLD_FITTED


@pytest.mark.parametrize(("has_locked", "track"), [(False, TrackState.SEARCH), (True, TrackState.HOLD_TLE)])
def test_a_signal_that_was_never_locked_is_searched_for_after_acquire_s(has_locked: bool, track: TrackState) -> None:
    lost = status(AcuMode.REMOTE_BACKUP, is_acquired=False)
    since_tai_s = NOW - CONFIG.acquire_s - 1.0
    state = remembering(ready(TrackState.HOLD_TLE, lost), has_locked=has_locked, hold_from_tai_s=since_tai_s)
    assert tick(state, TickInput(saw(lost), SKY, NOW), CONFIG)[0].tracking.track is track


def test_silence_of_the_link_makes_everything_start_anew() -> None:
    seen = status()
    state = remembering(ready(TrackState.AUTOTRACK_FITTED, seen), is_place_sure=True)
    state, orders = tick(state, TickInput(Observation(silence_s=Capabilities().silence_s + 0.01), FITTED, NOW), CONFIG)
    assert state.tracking.track is TrackState.LINK_LOST
    assert state.startup.stage is StartStage.NEW
    assert not state.intake.is_place_sure  # on a fresh connection the place of the old one is not written
    assert orders.first == Poll()
    assert orders.extra in (None, Identify())


def test_a_signal_long_before_the_rise_is_another_satellite() -> None:
    sky = Sky(None, None, replace(PLAN, rise_tai_s=NOW + 600.0, start_tai_s=NOW + 600.0))
    assert step(TrackState.IDLE, status(), sky)[0].tracking.track is TrackState.IDLE


@pytest.mark.parametrize("track", sorted(ACTIVE))
def test_a_fault_ends_every_active_state_and_asks_once_what_it_is(track: TrackState) -> None:
    seen = status(AcuMode.FAULT, is_autotrack_selected=False)
    state, orders = step(track, seen)
    assert state.tracking.track is TrackState.FAULT
    assert orders.extra == ReadFaults()
    answered = saw(seen, extra=Exchange(ReadFaults(), field_reply(Faults(azimuth=1))))
    state, later = tick(state, TickInput(answered, SKY, NOW), CONFIG)
    assert later.extra is None
    assert tick(state, TickInput(saw(seen), SKY, NOW + 0.4), CONFIG)[1].extra is None


def test_a_fault_detail_is_asked_for_until_it_is_answered_and_again_when_the_bits_change() -> None:
    seen = status(AcuMode.FAULT, is_autotrack_selected=False, has_azimuth_fault=True)
    state, _ = step(TrackState.AUTOTRACK_FITTED, seen)
    state, orders = tick(
        state, TickInput(saw(seen, extra=Exchange(ReadFaults(), None)), SKY, NOW + EXTRA_REPEAT_S), CONFIG
    )
    assert orders.extra == ReadFaults()
    state = remembering(state, again_tai_s=NOW)
    state, orders = tick(
        state, TickInput(saw(seen, extra=Exchange(ReadFaults(), field_reply(Faults(azimuth=1)))), SKY, NOW), CONFIG
    )
    assert orders.extra is None
    assert (
        tick(state, TickInput(saw(replace(seen, has_interlock_fault=True)), SKY, NOW), CONFIG)[1].extra == ReadFaults()
    )


@pytest.mark.parametrize("track", sorted(ACTIVE))
def test_a_stow_from_elsewhere_ends_every_active_state_and_nothing_leaves_it(track: TrackState) -> None:
    stowing = status(AcuMode.STOWING, is_autotrack_selected=False)
    before = ready(track, status(AcuMode.REMOTE, is_autotrack_selected=False))
    state, orders = tick(before, TickInput(saw(stowing), SKY, NOW), CONFIG)
    assert (state.tracking.track, state.stow.stow_by) == (TrackState.STOW, StowBy.PANEL)
    assert orders.extra is None
    stowed = replace(stowing, mode=AcuMode.STOWED)
    for k in range(20):
        state, orders = tick(state, TickInput(saw(stowed), SKY, NOW + 1.0 + k), CONFIG)
        assert orders.extra is None
    assert state.tracking.track is TrackState.STOW


# Refusals


def test_p5_what_the_gate_refuses_is_counted_every_time_and_logged_once() -> None:
    held = status(AcuMode.REMOTE_BACKUP)
    wrong = replace(FITTED, prediction=replace(path("FITTED"), el_deg=path().el_deg + np.nan))
    state, events = remembering(ready(TrackState.HOLD_FITTED, held), hold_from_tai_s=NOW), []
    for k, sky in enumerate([wrong, wrong, FITTED, wrong]):
        state, orders = tick(state, TickInput(saw(held), sky, NOW + 0.1 * k), CONFIG)
        events.append([event.fields["reason"] for event in orders.events if event.name == "gate.refused"])
    assert state.refusals.refusal_count == 3
    assert events == [["not a finite angle"], [], [], ["not a finite angle"]]


def test_p5_in_search_too_an_elevation_beyond_its_limits_is_held_there_told_and_counted() -> None:
    held = status(AcuMode.REMOTE_BACKUP)
    flat = replace(CONFIG, envelope=replace(CONFIG.envelope, elevation=replace(CONFIG.elevation, max_deg=38.0)))
    state, told = remembering(ready(TrackState.SEARCH, held), axis_el=AxisState(38.0)), []
    for k in range(10):
        state, orders = tick(state, TickInput(saw(held), FITTED, NOW + 0.1 * k), flat)
        assert state.tracking.track is TrackState.SEARCH
        told += [event.fields["axis"] for event in orders.events if event.name == "gate.limited"]
        assert isinstance(orders.first, PointAndPoll)
        assert orders.first.el_deg <= 38.0
    [axis] = told
    assert axis.startswith("elevation outside")
    assert state.refusals.limited == axis
    assert state.refusals.limited_count == 10


@pytest.mark.parametrize("mode", [AcuMode.REMOTE_BACKUP, AcuMode.AUTOTRACK])
def test_p5_an_axis_outside_its_limits_is_held_there_and_the_other_one_follows(mode: AcuMode) -> None:
    """Counted with every write, told once for each edge, and not at once again when it comes and goes."""
    held = status(mode)
    flat = replace(CONFIG, envelope=replace(CONFIG.envelope, elevation=replace(CONFIG.elevation, max_deg=38.0)))
    track = TrackState.HOLD_FITTED if mode is AcuMode.REMOTE_BACKUP else TrackState.AUTOTRACK_FITTED
    state, told = remembering(ready(track, held), hold_from_tai_s=NOW, axis_el=AxisState(38.0)), []
    within = replace(FITTED, prediction=replace(path("FITTED"), el_deg=path().el_deg - 5.0))
    for k in range(60):
        sky = within if 20 <= k < 25 or k >= 30 else FITTED
        state, orders = tick(state, TickInput(saw(held), sky, NOW + 0.1 * k), flat)
        told += [(k, event.name) for event in orders.events if event.name.startswith("gate.")]
        assert isinstance(orders.first, PointAndPoll)
        assert orders.first.el_deg <= 38.0
        assert orders.first.az_deg == pytest.approx(AZ_DEG + AZ_RATE * (0.1 * k + LEAD_S), abs=0.1)
    assert [name for _, name in told] == ["gate.limited", "gate.within_limits"]
    assert (state.refusals.limited_count, state.refusals.refusal_count) == (25, 0)
    assert state.refusals.limited == ""


def test_p5_what_the_gate_holds_back_is_counted() -> None:
    held = status(AcuMode.REMOTE_BACKUP)
    far = replace(FITTED, prediction=replace(path("FITTED"), follow_az_deg=path().az_deg + 3.0))
    state, _ = tick(ready(TrackState.HOLD_FITTED, held), TickInput(saw(held), far, NOW), CONFIG)
    assert (state.refusals.clamped_count, state.refusals.refusal_count) == (1, 0)


def test_p5_what_the_fence_keeps_back_is_counted_and_logged_and_a_poll_goes_in_its_place() -> None:
    state = ready(TrackState.HOLD_FITTED, status(AcuMode.REMOTE_BACKUP))
    after, orders = permit(state, Orders(PointAndPoll(100.0, 91.0), SelectMode(AcuMode.STOWED)), NOW, CONFIG)
    assert (orders.first, orders.extra) == (Poll(), None)
    assert after.refusals.refusal_count == 2
    assert [event.name for event in orders.events] == ["fence.refused", "fence.refused"]


def test_one_refused_write_is_not_held_against_the_next_two_are() -> None:
    seen = status()
    state, orders = step(TrackState.AUTOTRACK_FITTED, seen, FITTED, refused=Refused())
    assert isinstance(orders.first, PointAndPoll)
    state, orders = tick(state, TickInput(saw(seen, refused=Refused()), FITTED, NOW + 0.1), CONFIG)
    assert orders.first == Poll()
    _, orders = tick(state, TickInput(saw(seen), FITTED, NOW + 0.1 + REFUSED_PAUSE_S + 0.01), CONFIG)
    assert isinstance(orders.first, PointAndPoll)


def test_a_refused_write_is_not_in_force_and_an_answered_one_is() -> None:
    seen = status()
    state, orders = step(TrackState.AUTOTRACK_FITTED, seen, FITTED)
    assert isinstance(orders.first, PointAndPoll)
    assert (
        tick(state, TickInput(saw(seen, refused=Refused()), FITTED, NOW + 0.1), CONFIG)[0].registers.in_force
        == state.registers.in_force
    )
    answered, _ = tick(state, TickInput(saw(seen), FITTED, NOW + 0.1), CONFIG)
    assert answered.registers.in_force is not None
    assert answered.registers.in_force[1:] == (orders.first.az_deg, orders.first.el_deg)


def extras_over(refusal: Refused | None, span_s: float) -> int:
    """How often a backup that never shows is selected in a time."""
    seen = status(backup_selected=Backup.RATE)
    state, sent, last = ready(TrackState.AUTOTRACK_FITTED, seen), 0, None
    for k in range(round(span_s * 10)):
        extra = Exchange(last, refusal) if last is not None else None
        observed = saw(seen, extra=extra)
        observed = replace(observed, reading=replace(observed.reading, tai_s=NOW + 0.1 * k - 0.09))
        state, orders = tick(state, TickInput(observed, FITTED, NOW + 0.1 * k), CONFIG)
        last, sent = orders.extra, sent + (orders.extra is not None)
    return sent


def test_on_a_status_from_before_an_outage_nothing_is_decided() -> None:
    seen = status(AcuMode.STANDBY)
    stale = remembering(ready(TrackState.HOLD_FITTED, seen), reading=saw(seen).reading)
    for stage in (StartStage.NEW, StartStage.REGISTERS_KNOWN, StartStage.SECTOR_FREE, StartStage.READY):
        _, orders = tick(
            remembering(stale, stage=stage),
            TickInput(Observation(), FITTED, NOW + Capabilities().silence_s + 0.1),
            CONFIG,
        )
        assert orders.extra is None
        assert isinstance(orders.first, Poll | PointAndPoll)


def test_no_mode_is_selected_while_the_registers_are_old() -> None:
    seen = status(AcuMode.STANDBY, is_autotrack_selected=False)
    state = remembering(
        ready(TrackState.HOLD_FITTED, seen), entered_tai_s=NOW - 1.0, in_force=(NOW - 5.0, AZ_DEG, EL_DEG)
    )
    assert tick(state, TickInput(saw(seen), FITTED, NOW), CONFIG)[1].extra is None
    assert tick(remembering(state, in_force=(NOW - 0.1, AZ_DEG, EL_DEG)), TickInput(saw(seen), FITTED, NOW), CONFIG)[
        1
    ].extra


def test_autotrack_that_is_selected_in_standby_is_deselected_first_once_it_is_no_transient() -> None:
    seen = status(AcuMode.STANDBY, is_autotrack_selected=True)
    state = ready(TrackState.HOLD_FITTED, seen)
    assert tick(state, TickInput(saw(seen), FITTED, NOW), CONFIG)[1].extra == SelectMode(AcuMode.STANDBY)
    assert tick(remembering(state, again_tai_s=NOW), TickInput(saw(seen), FITTED, NOW), CONFIG)[1].extra is None


def test_a_refused_extra_is_repeated_far_more_rarely_than_a_lost_one() -> None:
    span_s = 6.0
    assert extras_over(Refused(), span_s) <= span_s / REFUSED_EXTRA_S + 1
    assert extras_over(None, span_s) >= span_s / EXTRA_REPEAT_S * 0.6


# Always


@given(
    st.sampled_from(sorted(TrackState)),
    st.sampled_from(list(AcuMode)),
    st.floats(0, 360, exclude_max=True),
    st.floats(0, 90),
    st.booleans(),
    st.booleans(),
    st.sampled_from([SKY, FITTED, Sky(), Sky(None, None, PLAN)]),
    st.booleans(),
)
def test_whatever_the_acu_says_no_write_is_outside_the_limits_and_the_input_is_untouched(
    track, mode, az_deg, el_deg, is_remote, is_high, sky, has_room
):
    seen = replace(status(mode), az_deg=az_deg, el_deg=el_deg, is_remote_enabled=is_remote, is_sector_high=is_high)
    before = ready(track, seen)
    kept = replace(before)
    state, orders = tick(before, TickInput(saw(seen, has_room=has_room), sky, NOW), CONFIG)
    assert before == kept
    assert tick(before, TickInput(saw(seen, has_room=has_room), sky, NOW), CONFIG) == (state, orders)
    for command in (orders.first, orders.extra):
        check_allowed(command, seen)


def check_allowed(command: Command | None, seen: AcuStatus) -> None:
    if isinstance(command, PointAndPoll):
        assert seen.is_remote_enabled
        assert -270.0 <= command.az_deg <= 270.0
        assert 0.0 <= command.el_deg <= 90.0


def test_registers_read_back_wrong_are_written_again_before_any_mode() -> None:
    seen = status(AcuMode.STANDBY)
    state = remembering(ready(TrackState.IDLE, seen), stage=StartStage.PRESENT_WRITTEN, present_deg=(AZ_DEG, EL_DEG))
    wrong = Exchange(ReadCommanded(), Commanded(AZ_DEG + 5.0, EL_DEG))
    state, orders = tick(state, TickInput(saw(seen, extra=wrong), FITTED, NOW), CONFIG)
    assert state.startup.stage is StartStage.SECTOR_FREE
    assert isinstance(orders.first, PointAt)
