"""Every bit of the status alone through the tick: what it decides, and that the others decide nothing."""

from dataclasses import fields, replace

import numpy as np
import pytest
from memories import remembering
from test_tick import AZ_DEG, CONFIG, EL_DEG, NOW, PLAN, SKY, path, ready, saw, status

from acu_daemon.acu.commands import AcuMode, Backup, ReadFaults
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Orders
from acu_daemon.control.safety.axis_watch import Bounds
from acu_daemon.control.state import ControlState, Held, Sent
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, Sky, StowBy, TickInput
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.drivers.sa3842.field_status import contradictions
from acu_daemon.drivers.sa3842.messages import Faults, Status
from acu_daemon.drivers.sa3842.sa3842_driver import field_reply
from acu_daemon.model import AxisLimits, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope

FLAGS, BITS = (
    [field.name for field in fields(kind) if field.name.startswith(("is_", "are_", "has_"))]
    for kind in (AcuStatus, Status)
)
FAULT_FLAGS = ("has_azimuth_fault", "has_elevation_fault", "has_tilt_fault", "has_interlock_fault")
ENDS = {"is_at_cw_limit": (1, 0), "is_at_ccw_limit": (-1, 0), "is_at_up_limit": (0, 1), "is_at_down_limit": (0, -1)}
SIDES = {"clockwise": (1, 0), "counter-clockwise": (-1, 0), "up": (0, 1), "down": (0, -1)}


def standing(right_deg: float, up_deg: float) -> Sky:
    """A fit's path that stands so far from the antenna."""
    t = np.zeros(400)
    az, el = AZ_DEG + right_deg + t, EL_DEG + up_deg + t
    return Sky(Prediction(NOW - 5.0, 0.1, az, el, t, t, az, t, "FITTED", NOW), None, PLAN)


def ticks(
    state: ControlState, statuses: list[AcuStatus], sky: Sky, config: ControlConfig = CONFIG
) -> tuple[ControlState, list[Orders]]:
    """One tick for each status, at the period."""
    ordered = []
    for k, seen in enumerate(statuses):
        now = NOW + 0.1 * k
        reading = Reading(now - 0.09, seen.az_deg, seen.el_deg, seen.is_acquired)
        state, orders = tick(state, TickInput(Observation(reading, seen), sky, now), config)
        ordered.append(orders)
    return state, ordered


# Limit switches


@pytest.mark.parametrize("switch", [*ENDS, None])
@pytest.mark.parametrize("side", SIDES)
def test_an_axis_that_stands_is_excused_by_the_switch_on_its_commands_side_and_by_no_other(
    switch: str | None, side: str
) -> None:
    seen = status(AcuMode.REMOTE_BACKUP, **({switch: True} if switch else {}))
    before = remembering(ready(TrackState.HOLD_FITTED, seen), hold_from_tai_s=NOW)
    right, up = SIDES[side]
    state, _ = ticks(before, [seen] * 60, standing(6.0 * right, 6.0 * up))
    name = "azimuth" if right else "elevation"
    excused = switch is not None and ENDS[switch] == SIDES[side]
    assert state.latch.problem == ("" if excused else f"{name} stands still away from its command")


@pytest.mark.parametrize("switch", [*ENDS, None])
@pytest.mark.parametrize("side", [1, -1])
def test_beside_the_zenith_an_azimuth_that_stands_is_excused_by_the_switch_on_its_goals_side_and_by_no_other(
    switch: str | None, side: int
) -> None:
    """There a whole turn is little on the sky; the time that goes by without a motion tells."""
    config = replace(CONFIG, envelope=Envelope(AxisLimits(-80.0, 280.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
    seen = replace(status(AcuMode.REMOTE_BACKUP, **({switch: True} if switch else {})), el_deg=89.9)
    before = remembering(ready(TrackState.HOLD_FITTED, seen), hold_from_tai_s=NOW)
    state, _ = ticks(before, [seen] * 120, standing(40.0 * side, 89.9 - EL_DEG), config)
    excused = switch is not None and ENDS[switch] == (side, 0)
    assert state.latch.problem == ("" if excused else "azimuth stands still away from its command")


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("mode", [AcuMode.REMOTE_BACKUP, AcuMode.STANDBY])
def test_where_following_is_not_watched_no_axis_is_latched_whatever_it_does(mode: AcuMode, side: str) -> None:
    """following_error_s = 0."""
    right, up = SIDES[side]
    before = remembering(ready(TrackState.HOLD_FITTED, status(AcuMode.REMOTE_BACKUP)), hold_from_tai_s=NOW)
    strays = [replace(status(mode), az_deg=AZ_DEG - 0.5 * k * right, el_deg=EL_DEG - 0.3 * k * up) for k in range(60)]
    for seen in ([status(mode)] * 60, strays):
        for error_s, is_latched in ((0.0, False), (0.5, True)):
            config = replace(CONFIG, following=Bounds(1.0, error_s))
            state, _ = ticks(before, seen, standing(6.0 * right, 6.0 * up), config)
            assert bool(state.latch.problem) is (is_latched and (mode is AcuMode.REMOTE_BACKUP or seen is strays))


@pytest.mark.parametrize("switch", [*ENDS, None])
@pytest.mark.parametrize("rates_deg_s", [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.3), (0.0, -0.3)])
def test_an_encoder_that_shows_one_code_is_excused_by_a_switch_of_its_own_axis_alone(
    switch: str | None, rates_deg_s: tuple[float, float]
) -> None:
    t = 0.1 * np.arange(-50, 400)
    az_rate, el_rate = (np.full(t.size, rate) for rate in rates_deg_s)
    az, el = AZ_DEG + az_rate * t, EL_DEG + el_rate * t
    sky = Sky(Prediction(NOW - 5.0, 0.1, az, el, az_rate, el_rate, az, az_rate, "FITTED", NOW), None, PLAN)
    seen = status(**({switch: True} if switch else {}))
    state, _ = ticks(ready(TrackState.AUTOTRACK_FITTED, seen), [seen] * 15, sky)
    is_azimuth = rates_deg_s[0] != 0.0
    excused = switch is not None and bool(ENDS[switch][0]) == is_azimuth
    assert state.encoders.problem == ("" if excused else f"{'azimuth' if is_azimuth else 'elevation'} encoder frozen")


@pytest.mark.parametrize("is_high", [False, True])
@pytest.mark.parametrize(
    ("switch", "limits", "place_deg"),
    [
        ("is_at_cw_limit", (-270.0, 270.0), 269.5),
        ("is_at_ccw_limit", (-270.0, 270.0), -269.5),
        ("is_at_cw_limit", (-180.0, 180.0), 180.0),
        ("is_at_ccw_limit", (-180.0, 180.0), -180.0),
        ("is_at_cw_limit", (-100.0, 420.0), 419.8),
        ("is_at_ccw_limit", (-100.0, 420.0), -99.8),
    ],
)
def test_a_switch_shows_the_end_at_which_the_antenna_is_whatever_the_sector_bit_says(
    is_high: bool, switch: str, limits: tuple[float, float], place_deg: float
) -> None:
    config = replace(CONFIG, envelope=replace(CONFIG.envelope, azimuth=AxisLimits(*limits, 20.0, 10.0)))
    at_end = replace(status(AcuMode.STANDBY, is_sector_high=is_high, **{switch: True}), az_deg=place_deg % 360.0)
    assert tick(ControlState(), TickInput(saw(at_end), Sky(), NOW), config)[0].intake.az_deg == pytest.approx(place_deg)
    for other in set(ENDS) - {switch}:  # no switch at the other end, and none of the elevation, says so
        wrong = replace(at_end, **{switch: False, other: True})
        by_bit, _ = tick(ControlState(), TickInput(saw(replace(wrong, **{other: False})), Sky(), NOW), config)
        shown, _ = tick(ControlState(), TickInput(saw(wrong), Sky(), NOW), config)
        if limits == (-180.0, 180.0) and not other.startswith(("is_at_up", "is_at_down")):
            assert shown.intake.az_deg == -place_deg  # both ends have the bearing
        else:
            assert shown.intake.az_deg == by_bit.intake.az_deg


# What a bit decides, and where

SITUATIONS: dict[str, tuple[TrackState, AcuMode]] = {
    "idle": (TrackState.IDLE, AcuMode.STANDBY),
    "on the way": (TrackState.PREPOSITION, AcuMode.REMOTE),
    "acquiring": (TrackState.ACQUIRE_TLE, AcuMode.ACQUIRE),
    "tracking": (TrackState.AUTOTRACK_TLE, AcuMode.AUTOTRACK),
    "holding": (TrackState.HOLD_TLE, AcuMode.REMOTE_BACKUP),
    "searching": (TrackState.SEARCH, AcuMode.ACQUIRE),
    "manual": (TrackState.MANUAL, AcuMode.MANUAL),
    "stowed": (TrackState.STOW, AcuMode.STOWED),
    "fault": (TrackState.FAULT, AcuMode.FAULT),
}
ALL = set(SITUATIONS)
DECIDES = {  # where one turn alone has the bearing, and no axis stands away from its command: those are above
    "is_autotrack_selected": ALL - {"manual", "stowed", "fault"},
    "is_acquired": {"tracking"},
    "is_remote_enabled": ALL,
    **{flag: {"fault"} for flag in FAULT_FLAGS},
    **{flag: {"tracking"} for flag in ("is_at_cw_limit", "is_at_ccw_limit")},  # an encoder there may stand
}


def outcome(situation: str, flag: str | None) -> tuple[object, ...]:
    track, mode = SITUATIONS[situation]
    seen = status(mode, is_remote_enabled=mode is not AcuMode.MANUAL)
    seen = replace(seen, az_deg=50.0, el_deg=EL_DEG, is_sector_high=True)
    before = remembering(
        ready(track, seen),
        az_deg=50.0,
        hold_from_tai_s=NOW,
        in_force=(NOW - 0.1, 50.0, EL_DEG),
        has_locked=True,
        stow_by=StowBy.PANEL if track is TrackState.STOW else StowBy.NOBODY,
        faults_read=(False,) * 4,
        again_tai_s=NOW - 2.0,
    )
    if flag is not None:
        seen = replace(seen, **{flag: not getattr(seen, flag)})
    near = replace(path(), az_deg=path().az_deg - AZ_DEG + 50.0, follow_az_deg=path().az_deg - AZ_DEG + 50.0)
    after, ordered = ticks(before, [seen] * 5, replace(SKY, prediction=near))
    sent = tuple((orders.first, orders.extra, tuple(e.name for e in orders.events)) for orders in ordered)
    return sent, after.tracking.track, after.latch.problem, after.arming.disarmed_by, after.intake.az_deg


@pytest.mark.parametrize("flag", FLAGS)
def test_a_bit_alone_changes_the_orders_where_the_table_says_so_and_nowhere_else(flag: str) -> None:
    changed = {situation for situation in SITUATIONS if outcome(situation, flag) != outcome(situation, None)}
    assert changed == DECIDES.get(flag, set())


@pytest.mark.parametrize("flag", FAULT_FLAGS)
@pytest.mark.parametrize("others", [False, True])
def test_a_fault_bit_that_comes_or_goes_is_asked_about_again(flag: str, others: bool) -> None:
    seen = status(AcuMode.FAULT, is_autotrack_selected=False, **dict.fromkeys(FAULT_FLAGS, others))
    answered = saw(seen, extra=Exchange(ReadFaults(), field_reply(Faults(azimuth=1))))
    state, orders = tick(ready(TrackState.FAULT, seen), TickInput(answered, SKY, NOW), CONFIG)
    assert orders.extra is None
    _, orders = tick(state, TickInput(saw(replace(seen, **{flag: not others})), SKY, NOW + 0.2), CONFIG)
    assert orders.extra == ReadFaults()


@pytest.mark.parametrize("flag", [*FAULT_FLAGS, None])
@pytest.mark.parametrize("had_interlock_fault", [False, True])
def test_a_standby_is_the_acus_own_where_an_interlock_fault_is_new_and_else_another_hands(
    flag: str | None, had_interlock_fault: bool
) -> None:
    held = Held(had_interlock_fault)
    before = remembering(ready(TrackState.HOLD_TLE, status(AcuMode.REMOTE_BACKUP)), held=held, hold_from_tai_s=NOW)
    seen = status(AcuMode.STANDBY, **({flag: True} if flag else {}))
    state, _ = tick(before, TickInput(saw(seen), SKY, NOW), CONFIG)
    is_own = flag == "has_interlock_fault" and not had_interlock_fault
    assert (state.arming.disarmed_by == "") == is_own


@pytest.mark.parametrize("bit", range(4))
@pytest.mark.parametrize("nibble", [field.name for field in fields(Faults)])
def test_of_the_fault_detail_the_emergency_stop_and_the_door_disarm_and_the_watchdogs_trip_excuses_a_standby(
    nibble: str, bit: int
) -> None:
    faults = field_reply(Faults(**{nibble: 1 << bit}))
    seen = status(AcuMode.FAULT, is_autotrack_selected=False, has_interlock_fault=True)
    state, _ = tick(
        ready(TrackState.FAULT, seen), TickInput(saw(seen, extra=Exchange(ReadFaults(), faults)), SKY, NOW), CONFIG
    )
    by = {("interlock", 0): "the emergency stop", ("interlock", 1): "an open door"}
    assert state.arming.disarmed_by == by.get((nibble, bit), "")
    standby = status(AcuMode.STANDBY)
    doubted = remembering(ready(TrackState.IDLE, standby), is_doubted=True, held=Held())
    state, _ = tick(doubted, TickInput(Observation(extra=Exchange(ReadFaults(), faults)), SKY, NOW), CONFIG)
    assert (state.arming.disarmed_by == "") == ((nibble, bit) == ("system", 1))
    assert not state.foreign_stop.is_doubted


# What cannot be true at once

CONSISTENT = {
    AcuMode.STANDBY: (),
    AcuMode.MANUAL: (),
    AcuMode.REMOTE: ("are_registers_written",),
    AcuMode.ACQUIRE: ("is_autotrack_selected", "are_registers_written"),
    AcuMode.AUTOTRACK: ("is_autotrack_selected", "is_acquired"),
    AcuMode.RATE_MEMORY: ("is_autotrack_selected", "is_backup_active"),
    AcuMode.POSITION_MEMORY: ("is_autotrack_selected", "is_backup_active"),
    AcuMode.REMOTE_BACKUP: ("is_autotrack_selected", "is_backup_active", "are_registers_written"),
    AcuMode.STOWING: (),
    AcuMode.STOWED: ("is_stow_pin_in",),
    AcuMode.FAULT: ("has_azimuth_fault",),
}
OF_MODE = {
    "is_remote_enabled": "mode and control",
    "is_backup_active": "mode and backup",
    "is_autotrack_selected": "mode and autotrack",
    "is_stow_pin_in": "mode and stow pin",
}


def consistent(mode: AcuMode) -> Status:
    backup = {AcuMode.RATE_MEMORY: Backup.RATE, AcuMode.POSITION_MEMORY: Backup.POSITION}.get(mode, Backup.REMOTE)
    seen = Status(100.0, 40.0, mode, backup_selected=backup, is_remote_enabled=mode is not AcuMode.MANUAL)
    return replace(seen, **dict.fromkeys(CONSISTENT[mode], True))


@pytest.mark.parametrize("mode", CONSISTENT)
@pytest.mark.parametrize("flag", BITS)
def test_a_bit_that_belies_the_mode_is_named_and_every_other_bit_is_believed(mode: AcuMode, flag: str) -> None:
    seen = consistent(mode)
    assert contradictions(seen) == ()
    turned = replace(seen, **{flag: not getattr(seen, flag)})
    expected = {OF_MODE[flag]} if flag in OF_MODE else set()
    if mode is AcuMode.FAULT:
        expected -= {"mode and control"}  # a fault shows under either panel
        expected |= {"mode and fault"} if flag == "has_azimuth_fault" else set()
    if flag == "are_registers_idle":
        expected.add("mode and registers")  # idle are those that were written and are not followed
    assert set(contradictions(turned)) == expected


@pytest.mark.parametrize("flag", FAULT_FLAGS)
def test_each_fault_bit_alone_explains_the_mode_fault(flag: str) -> None:
    seen = replace(consistent(AcuMode.FAULT), **dict.fromkeys(FAULT_FLAGS, False))
    assert contradictions(seen) == ("mode and fault",)
    assert contradictions(replace(seen, **{flag: True})) == ()


@pytest.mark.parametrize("unwritten_s", [1.0, 5.0])
def test_a_standby_after_a_pause_of_the_writes_may_be_the_register_watchdogs_though_it_answers_a_write(
    unwritten_s: float,
) -> None:
    config = replace(CONFIG, register_watchdog_s=2.0)
    before = remembering(
        ready(TrackState.HOLD_TLE, status(AcuMode.REMOTE_BACKUP)),
        held=Held(),
        hold_from_tai_s=NOW,
        in_force=(NOW - unwritten_s, AZ_DEG, EL_DEG),
        commands=(Sent(AZ_DEG, EL_DEG, False),),
    )
    state, _ = tick(before, TickInput(saw(status(AcuMode.STANDBY)), SKY, NOW), config)
    assert (state.arming.disarmed_by == "") == (unwritten_s > 2.0)
