"""P1, P5, P6: arming, the latch, a STOP by another hand, and the fence, in the pure decision of a tick."""

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering
from test_tick import CONFIG, FITTED, NOW, SKY, ready, saw, status

from acu_daemon.acu.commands import (
    READS,
    AcuMode,
    Backup,
    Command,
    FreeTurnChoice,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadFaults,
    ReadTurnChoice,
    ReadWatchdog,
    SelectBackup,
    SelectMode,
    SetWatchdog,
    Stop,
)
from acu_daemon.acu.replies import AcuStatus, Done, FaultReport, Refused, Reply, WatchdogTime
from acu_daemon.control.orders import Orders
from acu_daemon.control.safety.command_permit import refusal
from acu_daemon.control.state import ControlState, Held, StartStage, Watchdog
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, Request, Sky, TickInput
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.drivers.sa3842.messages import Faults, Identity
from acu_daemon.drivers.sa3842.sa3842_driver import field_reply

GUARDED = replace(CONFIG, register_watchdog_s=5.0)
SHADOW = replace(GUARDED, is_shadow=True)
LATCH = "elevation stands still away from its command"


def moving(track: TrackState = TrackState.HOLD_FITTED, mode: AcuMode = AcuMode.REMOTE_BACKUP) -> ControlState:
    """A daemon whose writes the antenna follows."""
    before = status(mode)
    state = ready(track, before)
    return remembering(
        state, reading=saw(before).reading, in_force=(NOW - 0.1, 100.0, 40.0), watchdog=Watchdog.SET, held=Held()
    )


def run(
    state: ControlState, seen: AcuStatus, count: int = 1, config=GUARDED, **first
) -> tuple[ControlState, list[Command]]:
    """Ticks against an ACU that acknowledges STOP, says who it is and knows no fault; returns all that was sent."""
    replies = {Identify(): field_reply(Identity("3842", "S1")), ReadFaults(): FaultReport()}
    sent: list[Command] = []
    extra = first.pop("extra", None)
    for k in range(count):
        observed = saw(seen, extra=extra, **(first if k == 0 else {}))
        observed = replace(observed, reading=replace(observed.reading, tai_s=NOW + 0.1 * k))
        state, orders = tick(state, TickInput(observed, FITTED, NOW + 0.1 * (k + 1)), config)
        sent += [command for command in (orders.first, orders.extra) if command is not None]
        asked = asked_by(orders)
        extra = Exchange(asked, replies.get(asked, Done())) if asked is not None else None
    return state, sent


def asked_by(orders: Orders) -> Command | None:
    """The exchange beside the poll or the write, or in its place."""
    return orders.first if not isinstance(orders.first, Poll | PointAndPoll) else orders.extra


def orders_of(sent: list[Command]) -> list[Command]:
    return [command for command in sent if not isinstance(command, READS)]


# Arming


@pytest.mark.parametrize("track", sorted(ACTIVE))
def test_p1_disarmed_in_mid_pass_it_stops_then_clears_the_watchdog_then_keeps_its_hands_off(track: TrackState) -> None:
    state, sent = run(moving(track), status(AcuMode.REMOTE_BACKUP), 30, requests=(Request.DISARM,))
    assert orders_of(sent) == [Stop(), SetWatchdog(0.0)]
    assert not state.is_armed(GUARDED)
    assert state.arming.disarmed_by == "a person"


def test_p1_a_stop_that_is_not_acknowledged_is_repeated_and_nothing_else_is_sent() -> None:
    state, sent = moving(), []
    for k in range(20):
        observed = saw(status(AcuMode.REMOTE_BACKUP), requests=(Request.DISARM,) if k == 0 else ())
        state, orders = tick(state, TickInput(observed, FITTED, NOW + 0.1 * k), GUARDED)
        sent += orders_of([orders.first, *([orders.extra] if orders.extra else [])])
    assert set(sent) == {Stop()}
    assert len(sent) >= 5


def test_p1_armed_again_it_begins_with_the_present_angles() -> None:
    state, _ = run(moving(), status(AcuMode.REMOTE_BACKUP), 10, requests=(Request.DISARM,))
    armed = saw(status(AcuMode.STANDBY), requests=(Request.ARM,))
    armed = replace(armed, reading=replace(armed.reading, tai_s=NOW + 4.9))
    state, orders = tick(state, TickInput(armed, FITTED, NOW + 5.0), GUARDED)
    assert state.is_armed(GUARDED)
    assert state.startup.stage is StartStage.REGISTERS_KNOWN
    assert asked_by(orders) == ReadTurnChoice()


def test_p1_a_shadow_is_never_armed() -> None:
    shadow = replace(GUARDED, is_shadow=True)
    state = remembering(moving(), stage=StartStage.REGISTERS_KNOWN)
    state, sent = run(state, status(), 20, shadow, requests=(Request.ARM,))
    assert not state.is_armed(shadow)
    assert orders_of(sent) == []


def test_a_daemon_that_never_moved_anything_sends_no_stop_when_it_is_disarmed() -> None:
    before = ready(TrackState.IDLE, status(AcuMode.STANDBY))
    state = remembering(before, stage=StartStage.REGISTERS_KNOWN, in_force=None)
    _, sent = run(state, status(AcuMode.STANDBY), 10, requests=(Request.DISARM,))
    assert orders_of(sent) == []


def test_disarmed_while_the_local_panel_has_control_no_stop_is_owed_later() -> None:
    panel = status(AcuMode.MANUAL, is_remote_enabled=False)
    state, sent = run(moving(), panel, 10, requests=(Request.DISARM,))
    assert orders_of(sent) == []
    _, sent = run(state, status(AcuMode.AUTOTRACK), 10)
    assert orders_of(sent) == [SetWatchdog(0.0)]


# The latch


def latched(**changes: object) -> ControlState:
    return remembering(moving(), problem=LATCH, is_stop_due=True, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", [AcuMode.REMOTE, AcuMode.REMOTE_BACKUP, AcuMode.AUTOTRACK, AcuMode.STANDBY])
def test_p6_latched_it_sends_stop_until_it_is_acknowledged_and_no_more(mode: AcuMode) -> None:
    state, sent = run(latched(), status(mode), 30)
    assert orders_of(sent) == [Stop()]
    assert state.tracking.track is TrackState.FAULT


def test_p6_the_latch_outlives_a_lost_link_and_whatever_the_acu_does() -> None:
    state, _ = run(latched(), status(AcuMode.STANDBY), 5)
    state, _ = tick(state, TickInput(Observation(silence_s=3.0), FITTED, NOW + 9.0), GUARDED)
    assert state.tracking.track is TrackState.LINK_LOST
    for mode in AcuMode:
        state, sent = run(state, status(mode), 12)
        assert orders_of(sent) == []
        assert state.latch.problem == LATCH
    assert state.tracking.track is TrackState.FAULT


def test_p6_a_restart_with_a_latch_knows_the_acu_stops_the_antenna_once_and_moves_nothing() -> None:
    state, sent, extra = remembering(problem=LATCH, is_stop_due=True), [], None
    for k in range(30):
        state, orders = tick(state, TickInput(saw(status(AcuMode.REMOTE), extra=extra), FITTED, NOW + 0.1 * k), GUARDED)
        asked = asked_by(orders)
        reply = field_reply(Identity("3842", "S1")) if isinstance(asked, Identify) else Done()
        extra = Exchange(asked, reply) if asked is not None else None
        sent += [asked] if asked is not None else []
    assert sent[:2] == [Identify(), Stop()]
    assert orders_of(sent) == [Stop()]
    assert (state.tracking.track, state.latch.problem) == (TrackState.FAULT, LATCH)


def test_p6_only_a_person_clears_it_and_the_start_order_begins_anew() -> None:
    state, _ = run(latched(), status(AcuMode.STANDBY), 5)
    state, _ = run(state, status(AcuMode.STANDBY), 3, requests=(Request.ARM, Request.DISARM, Request.ARM))
    assert state.latch.problem == LATCH
    state, orders = tick(
        state, TickInput(saw(status(AcuMode.STANDBY), requests=(Request.CLEAR,)), FITTED, NOW + 9.0), GUARDED
    )
    assert state.latch.problem == ""
    assert state.startup.stage < StartStage.READY
    assert not isinstance(orders.first, PointAndPoll)


# Another hand


@pytest.mark.parametrize("mode", [AcuMode.REMOTE, AcuMode.ACQUIRE, AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP])
def test_a_stop_by_another_hand_is_respected_until_a_person_arms(mode: AcuMode) -> None:
    state, sent = run(moving(mode=mode), status(AcuMode.STANDBY), 50)
    assert orders_of(sent) == [SetWatchdog(0.0)]
    assert state.arming.disarmed_by == "another hand that stopped the antenna"
    assert state.tracking.track is TrackState.IDLE
    state, sent = run(state, status(AcuMode.STANDBY), 2, requests=(Request.ARM,))
    assert state.is_armed(GUARDED)


@pytest.mark.parametrize(
    "seen",
    [
        status(AcuMode.STANDBY, backup_selected=Backup.RATE),
        status(AcuMode.STANDBY, has_interlock_fault=True),
        status(AcuMode.STANDBY, is_remote_enabled=False),
    ],
    ids=["power cycle", "fault or register watchdog", "local panel"],
)
def test_standby_by_the_acus_own_doing_is_no_stop(seen: AcuStatus) -> None:
    state, _ = run(moving(), seen)
    assert state.is_armed(GUARDED)


@pytest.mark.parametrize(
    ("unwritten_s", "had_fault", "has_fault", "is_armed"),
    [
        (6.0, False, True, True),
        (6.0, True, True, True),  # the bit stood before: a second watchdog trip, or a STOP; nothing tells
        (6.0, False, False, False),
        (2.0, True, True, False),  # too soon for the watchdog
        (0.1, True, True, False),
        (2.0, False, False, False),
    ],
)
@pytest.mark.parametrize("track", [TrackState.LINK_LOST, TrackState.HOLD_FITTED], ids=["no link", "hang"])
def test_p1_standby_after_an_outage_is_a_stop_unless_the_register_watchdog_shows(
    unwritten_s: float, had_fault: bool, has_fault: bool, is_armed: bool, track: TrackState
) -> None:
    state = remembering(moving(), held=Held(had_fault), in_force=(NOW - unwritten_s, 100.0, 40.0), track=track)
    state = remembering(state, stage=StartStage.NEW if track is TrackState.LINK_LOST else StartStage.READY)
    state, sent = run(state, status(AcuMode.STANDBY, has_interlock_fault=has_fault), 5)
    assert state.is_armed(GUARDED) is is_armed
    assert is_armed or orders_of(sent) in ([], [SetWatchdog(0.0)])


HELD = Held()


def started_again(seen: AcuStatus, held: Held | None = HELD, **first) -> tuple[ControlState, list[Command]]:
    """A new daemon on what a crash left; it comes as far as the registers."""
    return run(remembering(held=held), seen, 12, **first)


def test_p1_a_stop_while_the_daemon_was_dead_disarms_it() -> None:
    state, sent = started_again(status(AcuMode.STANDBY))
    assert (state.is_armed(GUARDED), state.arming.disarmed_by) == (False, "another hand that stopped the antenna")
    assert orders_of(sent) == []


@pytest.mark.parametrize(
    ("seen", "held"),
    [
        (status(AcuMode.STANDBY, has_interlock_fault=True), Held()),
        (status(AcuMode.STANDBY, has_interlock_fault=True), Held(has_interlock_fault=True)),
        (status(AcuMode.STANDBY, backup_selected=Backup.RATE), Held()),
        (status(AcuMode.REMOTE_BACKUP), Held()),
        (status(AcuMode.STANDBY, is_remote_enabled=False), Held()),
        (status(AcuMode.STANDBY), None),
    ],
    ids=["register watchdog", "again", "power cycle", "still ours", "local panel", "clean stop before"],
)
def test_p4_after_a_crash_it_goes_on_where_the_acu_shows_its_own_doing(seen: AcuStatus, held: Held | None) -> None:
    assert started_again(seen, held)[0].is_armed(GUARDED)


@pytest.mark.parametrize(
    ("reply", "is_armed", "is_settled"),
    [
        (field_reply(Faults(system=2)), True, True),
        (field_reply(Faults(system=1)), False, True),
        (Refused(), False, True),
        (Done(), True, False),
        (None, True, False),
    ],
)
def test_p1_p4_where_the_status_shows_no_watchdog_nothing_is_sent_until_the_fault_detail_tells(
    reply: Reply | None, is_armed: bool, is_settled: bool
) -> None:
    state = remembering(moving(), in_force=(NOW - 6.0, 100.0, 40.0))
    state, sent = run(state, status(AcuMode.STANDBY))
    assert (state.foreign_stop.is_doubted, sent) == (True, [Poll(), ReadFaults()])
    state, sent = run(state, status(AcuMode.STANDBY), extra=Exchange(ReadFaults(), reply))
    assert (state.is_armed(GUARDED), state.foreign_stop.is_doubted) == (is_armed, not is_settled)
    assert is_settled or sent == [Poll()]


def test_p1_a_stow_while_the_daemon_was_dead_is_kept() -> None:
    seen = status(AcuMode.STOWED, is_autotrack_selected=False)
    assert started_again(seen)[0].tracking.track is TrackState.STOW
    assert started_again(seen, None)[0].tracking.track is TrackState.IDLE


def test_a_person_who_arms_before_the_acu_answers_is_believed() -> None:
    state, _ = started_again(status(AcuMode.STANDBY), requests=(Request.ARM,))
    assert state.is_armed(GUARDED)
    lost = remembering(moving(), track=TrackState.LINK_LOST, stage=StartStage.NEW, in_force=(NOW - 2.0, 100.0, 40.0))
    lost, _ = tick(lost, TickInput(Observation(silence_s=2.0, requests=(Request.ARM,)), FITTED, NOW), GUARDED)
    assert run(lost, status(AcuMode.STANDBY))[0].is_armed(GUARDED)


def test_an_acu_found_autotracking_far_from_the_path_is_not_believed() -> None:
    other = replace(status(), az_deg=200.0, el_deg=15.0)
    state = remembering(ready(TrackState.IDLE, other), az_deg=-160.0)
    assert tick(state, TickInput(saw(other), FITTED, NOW), CONFIG)[0].tracking.track is TrackState.PREPOSITION
    assert tick(ready(TrackState.IDLE, status()), TickInput(saw(status()), FITTED, NOW), CONFIG)[0].tracking.track is (
        TrackState.AUTOTRACK_FITTED
    )


# The interlock

PRESSED = status(AcuMode.FAULT, is_autotrack_selected=False, has_interlock_fault=True)


def after_fault(faults: FaultReport) -> tuple[ControlState, list[Command]]:
    """A fault in mid-pass, its detail read, and reset by hand; what was sent since the detail was known."""
    state, sent = run(moving(), PRESSED)
    assert ReadFaults() in sent
    state, sent = run(state, PRESSED, 10, extra=Exchange(ReadFaults(), faults))
    assert ReadFaults() not in sent
    state, more = run(state, status(AcuMode.STANDBY), 20)
    return state, sent + more


@pytest.mark.parametrize(
    ("faults", "by"),
    [
        (field_reply(Faults(interlock=1)), "the emergency stop"),
        (field_reply(Faults(interlock=2)), "an open door"),
        (field_reply(Faults(interlock=3, azimuth=1)), "the emergency stop"),
    ],
)
def test_p1_an_emergency_stop_or_an_open_door_disarms_until_a_person_arms(faults: FaultReport, by: str) -> None:
    state, sent = after_fault(faults)
    assert orders_of(sent) == [SetWatchdog(0.0)]
    assert (state.is_armed(GUARDED), state.arming.disarmed_by) == (False, by)
    assert state.tracking.track is TrackState.IDLE
    state, _ = run(state, status(AcuMode.STANDBY), 2, requests=(Request.ARM,))
    assert (state.is_armed(GUARDED), state.arming.disarmed_by) == (True, "")


@pytest.mark.parametrize(
    "faults",
    [
        field_reply(Faults(azimuth=1)),
        field_reply(Faults(interlock=4)),
        field_reply(Faults(interlock=8)),
        field_reply(Faults(system=2)),
    ],
)
def test_after_any_other_fault_the_daemon_goes_on_by_itself(faults: FaultReport) -> None:
    state, sent = after_fault(faults)
    assert state.is_armed(GUARDED)
    assert any(isinstance(command, PointAndPoll) for command in sent)


@pytest.mark.parametrize("by", ["the emergency stop", "a person"])
def test_p1_armed_while_the_button_is_still_pressed_it_is_disarmed_again_and_does_not_move_at_the_release(
    by: str,
) -> None:
    state, _ = run(moving(), PRESSED, requests=(Request.DISARM,) if by == "a person" else ())
    state, _ = run(state, PRESSED, 5, extra=Exchange(ReadFaults(), field_reply(Faults(interlock=1))))
    assert state.arming.disarmed_by == by
    state, sent = run(state, PRESSED, requests=(Request.ARM,))
    state, more = run(state, PRESSED)
    assert ReadFaults() in sent + more
    state, _ = run(state, PRESSED, 5, extra=Exchange(ReadFaults(), field_reply(Faults(interlock=1))))
    assert (state.is_armed(GUARDED), state.arming.disarmed_by) == (False, "the emergency stop")


def test_p1_armed_in_any_other_fault_the_daemon_goes_on_when_it_is_over() -> None:
    state, _ = run(moving(), PRESSED, requests=(Request.DISARM,))
    state, _ = run(state, PRESSED, 5, requests=(Request.ARM,))  # FAULT DETAIL names neither the button nor a door
    assert state.is_armed(GUARDED)


def test_a_shadow_leaves_it_as_it_was_who_holds_the_antenna() -> None:
    state, _ = run(moving(), status(AcuMode.AUTOTRACK), 3, config=replace(GUARDED, is_shadow=True))
    assert state.foreign_stop.held == Held()


# The fence


DANGEROUS: tuple[Command, ...] = (
    PointAndPoll(100.0, 40.0),
    PointAt(100.0, 40.0),
    SelectMode(AcuMode.AUTOTRACK),
    SelectMode(AcuMode.STANDBY),
    SelectBackup(Backup.REMOTE),
    SetWatchdog(5.0),
    FreeTurnChoice(),
    SelectMode(AcuMode.STOWED),
    SelectMode(AcuMode.FAULT),
    SelectBackup(Backup.POSITION),
)


@pytest.mark.parametrize("command", DANGEROUS, ids=str)
@pytest.mark.parametrize(
    ("change", "config"),
    [
        ({"by_people": False}, CONFIG),
        ({"problem": LATCH}, CONFIG),
        ({"stage": StartStage.NEW}, CONFIG),
        ({"status": status(AcuMode.MANUAL, is_remote_enabled=False)}, CONFIG),
        ({"status": None}, CONFIG),
        ({}, replace(CONFIG, is_shadow=True)),
    ],
    ids=["disarmed", "latched", "not started", "local panel", "no status", "shadow"],
)
def test_p5_no_order_passes_the_fence_where_it_has_no_business(command, change, config) -> None:
    assert refusal(command, remembering(moving(), **change), NOW, config)


@pytest.mark.parametrize(
    "command",
    [SelectMode(AcuMode.STOWED), SelectMode(AcuMode.FAULT), SelectBackup(Backup.POSITION), SelectBackup(Backup.RATE)],
    ids=str,
)
def test_p5_what_the_daemon_never_orders_never_passes(command: Command) -> None:
    assert refusal(command, moving(), NOW, CONFIG) == "not in its place"


@given(st.floats(), st.floats(), st.sampled_from([PointAndPoll, PointAt]))
def test_p5_no_register_write_outside_the_limits_passes(az_deg, el_deg, kind) -> None:
    is_inside = -270.01 <= az_deg <= 270.01 and -0.01 <= el_deg <= 90.01
    assert is_inside or refusal(kind(az_deg, el_deg), moving(), NOW, CONFIG)


@given(
    st.sampled_from(sorted(TrackState)),
    st.sampled_from(list(AcuMode)),
    st.sampled_from(sorted(StartStage)),
    st.booleans(),
    st.booleans(),
    st.sampled_from([None, True, False]),
    st.sampled_from(["", LATCH]),
    st.booleans(),
    st.lists(st.sampled_from(sorted(Request)), max_size=3),
    st.booleans(),
)
def test_p5_whatever_the_memory_holds_every_order_has_passed_the_fence(
    track, mode, stage, is_remote, is_shadow, arming, latch, is_stop_due, requests, is_fitted
) -> None:
    memory = {"stage": stage, "by_people": arming, "problem": latch, "is_stop_due": is_stop_due}
    seen = saw(status(mode, is_remote_enabled=is_remote), requests=tuple(requests))
    check_fence(remembering(moving(track, mode), **memory), seen, FITTED if is_fitted else SKY, is_shadow=is_shadow)


@pytest.mark.long
@pytest.mark.parametrize("is_shadow", [False, True])
def test_p5_from_every_state_mode_and_stage_every_order_has_passed_the_fence(is_shadow: bool) -> None:
    """All there are, where chance would find the one that matters once in thousands."""
    flags = (False, True)
    for track, mode in itertools.product(TrackState, AcuMode):
        begun = moving(track, mode)
        for is_remote in flags:
            seen = saw(status(mode, is_remote_enabled=is_remote))
            for stage, arming, latch, is_due in itertools.product(StartStage, (None, *flags), ("", LATCH), flags):
                state = remembering(begun, stage=stage, by_people=arming, problem=latch, is_stop_due=is_due)
                check_fence(state, seen, FITTED if is_due else SKY, is_shadow=is_shadow)


def check_fence(state: ControlState, seen: Observation, sky: Sky, *, is_shadow: bool) -> None:
    config = SHADOW if is_shadow else GUARDED
    after, orders = tick(state, TickInput(seen, sky, NOW), config)
    assert after.refusals.refusal_count == state.refusals.refusal_count  # the fence had nothing to keep back
    for command in (orders.first, orders.extra):
        assert command is None or refusal(command, after, NOW, config) == ""
    check_hands(after, orders, config)


def check_hands(after: ControlState, orders: Orders, config) -> None:
    sent = orders_of([command for command in (orders.first, orders.extra) if command is not None])
    if config.is_shadow:
        assert sent == []
    elif after.latch.problem or not after.is_armed(config):
        assert set(sent) <= {Stop(), SetWatchdog(0.0)}


# The register watchdog


def test_the_watchdog_is_read_written_and_read_back_once_the_start_is_done() -> None:
    state = remembering(ready(TrackState.IDLE, status(AcuMode.STANDBY)), in_force=None)
    after_s, asked = 0.0, []
    extra = None
    for k in range(12):
        state, orders = tick(state, TickInput(saw(status(AcuMode.STANDBY), extra=extra), SKY, NOW + 0.1 * k), GUARDED)
        extra = None
        if isinstance(orders.extra, ReadWatchdog):
            extra = Exchange(orders.extra, WatchdogTime(after_s))
        elif isinstance(orders.extra, SetWatchdog):
            after_s, extra = orders.extra.after_s, Exchange(orders.extra, Done())
        if extra is not None:
            asked.append(orders.extra)
    assert asked == [ReadWatchdog(), SetWatchdog(5.0), ReadWatchdog()]
    assert state.startup.watchdog is Watchdog.SET


@pytest.mark.parametrize("reply", [Refused(), None], ids=["refused", "never answered"])
def test_an_acu_without_watchdog_is_told_once_and_tracked_all_the_same(reply) -> None:
    seen = status(backup_selected=Backup.RATE)
    state, events, sent, last = ready(TrackState.AUTOTRACK_FITTED, seen), [], [], None
    for k in range(200):
        extra = Exchange(last, reply if getattr(last, "name", "") == "W" else Done()) if last is not None else None
        observed = saw(seen, extra=extra)
        observed = replace(observed, reading=replace(observed.reading, tai_s=NOW + 0.1 * k - 0.09))
        state, orders = tick(state, TickInput(observed, FITTED, NOW + 0.1 * k), GUARDED)
        last = orders.extra
        events += [event.name for event in orders.events]
        sent.append(orders.extra)
    assert events.count("acu.watchdog_refused") == 1
    assert SelectBackup(Backup.REMOTE) in sent[:40]
