"""The stow: sent where it may be, never elsewhere; whose it is, and who ends it."""

from collections.abc import Iterable
from dataclasses import replace

import pytest
from flights import RISING_TAI_S, climb, commands_between, events_named, state_at
from memories import remembering
from test_axis_latch import says
from test_daemon_events import cut
from test_tick import CONFIG, EL_DEG, NOW, SKY, ready, saw, status

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import AcuMode, Backup, Command, Poll, ReadFaults, SelectMode, Stow
from acu_daemon.acu.replies import AcuStatus, FaultReport
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Orders
from acu_daemon.control.safety.command_permit import permit
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Asking, Exchange, Request, StowBy, StowWish, TickInput
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut

STANDS = status(AcuMode.STANDBY, is_autotrack_selected=False)
STOWING, STOWED = (replace(STANDS, mode=mode) for mode in (AcuMode.STOWING, AcuMode.STOWED))
WISHES = [StowWish(by) for by in (StowBy.OPERATOR, StowBy.WIND, StowBy.SCHEDULE)]
RESTING = replace(CONFIG, is_resting=True)


def ticks(
    state: ControlState, seen: Iterable[AcuStatus], *requests: Asking, config: ControlConfig = CONFIG
) -> tuple[ControlState, list[Command]]:
    """Tick through statuses, a tenth of a second apart; requests come with the first.  Returns what was commanded."""
    sent: list[Command] = []
    for k, one in enumerate(seen):
        given = TickInput(saw(one, requests=requests if k == 0 else ()), SKY, NOW + 0.1 * k)
        state, orders = tick(state, given, config)
        sent += [command for command in (orders.extra, orders.first) if isinstance(command, Stow | SelectMode)]
    return state, sent


# When it is sent


@pytest.mark.parametrize("track", sorted(ACTIVE))
@pytest.mark.parametrize("wish", WISHES, ids=lambda one: str(one.by))
def test_a_wish_ends_what_is_tracked_and_sends_stow_until_the_status_shows_it(
    track: TrackState, wish: StowWish
) -> None:
    seen = status(AcuMode.REMOTE, is_autotrack_selected=False)
    state, sent = ticks(ready(track, seen), [seen] * 4, wish)
    assert (state.tracking.track, sent) == (TrackState.STOW, [Stow(), Stow()])  # again after 0.3 s
    state, sent = ticks(state, [STOWING, STOWED] + [STOWED] * 20)
    assert (state.tracking.track, state.stow.stow_by, sent) == (TrackState.STOW, wish.by, [])


def test_at_rest_stow_is_sent_and_nothing_else() -> None:
    state = ready(TrackState.IDLE, STANDS)
    given = TickInput(saw(STANDS, requests=(StowWish(StowBy.OPERATOR),)), SKY, NOW)
    state, orders = tick(state, given, RESTING)
    assert (orders.first, orders.extra) == (Poll(), Stow())


FORBIDDEN: dict[str, tuple[AcuStatus, dict[str, object], ControlConfig]] = {
    "disarmed": (STANDS, {"by_people": False}, CONFIG),
    "local panel": (replace(STANDS, is_remote_enabled=False), {}, CONFIG),
    "manual": (replace(STANDS, mode=AcuMode.MANUAL), {}, CONFIG),
    "fault": (replace(STANDS, mode=AcuMode.FAULT), {}, CONFIG),
    "interlock": (replace(STANDS, has_interlock_fault=True), {}, CONFIG),
    "latched": (STANDS, {"problem": "azimuth stands still"}, CONFIG),
    "shadow": (STANDS, {}, replace(CONFIG, is_shadow=True)),
    "no stow": (STANDS, {}, replace(CONFIG, acu=Capabilities(has_stow=False))),
}


@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("why", FORBIDDEN)
def test_it_is_never_sent_where_something_speaks_against_it_and_not_let_out_either(why: str, resting: bool) -> None:
    seen, memory, config = FORBIDDEN[why]
    config = replace(config, is_resting=resting)
    before = remembering(ready(TrackState.IDLE, seen), **memory)
    state, sent = ticks(before, [seen] * 10, *WISHES, config=config)
    assert Stow() not in sent
    wished = remembering(state, stow_by=StowBy.WIND)
    _, orders = permit(wished, Orders(Poll(), Stow()), NOW, config)
    assert orders.extra is None


def test_nor_without_a_wish() -> None:
    _, orders = permit(ready(TrackState.IDLE, STANDS), Orders(Poll(), Stow()), NOW, CONFIG)
    assert orders.extra is None


@pytest.mark.parametrize(
    ("report", "is_sent"),
    [
        (FaultReport(("watchdog",), has_watchdog_tripped=True), True),
        (FaultReport(("watchdog", "brake"), has_watchdog_tripped=True), False),
        (FaultReport(("brake",)), False),
    ],
)
def test_an_interlock_bit_is_asked_about_first_a_watchdog_that_had_tripped_is_none(
    report: FaultReport, is_sent: bool
) -> None:
    seen = replace(STANDS, has_interlock_fault=True)
    state = remembering(ready(TrackState.IDLE, seen), stow_by=StowBy.WIND)
    state, orders = tick(state, TickInput(saw(seen), SKY, NOW), CONFIG)
    assert orders.extra == ReadFaults()
    given = TickInput(saw(seen, extra=Exchange(ReadFaults(), report)), SKY, NOW + 0.1)
    state, orders = tick(state, given, CONFIG)
    assert (orders.extra == Stow()) is is_sent


def zoned(**changes: float) -> ControlConfig:
    """A keep-out between the antenna, at azimuth 100, and the stow position, at azimuth 0."""
    box = KeepOut(
        **{"az_from_deg": 40.0, "az_to_deg": 60.0, "el_from_deg": 0.0, "el_to_deg": 80.0} | changes, name="mast"
    )
    envelope = Envelope(CONFIG.azimuth, CONFIG.elevation, keep_outs=(box,), stow_deg=(0.0, EL_DEG))
    return replace(CONFIG, envelope=envelope)


def test_a_way_through_a_keep_out_is_not_gone_and_what_is_tracked_goes_on() -> None:
    seen = status()
    state, sent = ticks(ready(TrackState.AUTOTRACK_TLE, seen), [seen] * 5, StowWish(StowBy.WIND), config=zoned())
    assert (state.tracking.track, state.stow.stow_by, sent) == (TrackState.AUTOTRACK_TLE, StowBy.WIND, [])
    state, sent = ticks(state, [seen], config=zoned(el_from_deg=85.0, el_to_deg=89.0))
    assert (state.tracking.track, sent) == (TrackState.STOW, [Stow()])


# Whose it is


def stowed(by: StowBy, seen: AcuStatus = STOWED) -> ControlState:
    return remembering(ready(TrackState.STOW, seen), stow_by=by)


@pytest.mark.parametrize("by", [one for one in StowBy if one])
@pytest.mark.parametrize("who", [StowBy.SCHEDULE, StowBy.WIND, StowBy.OPERATOR])
def test_it_is_ended_by_whose_it_is_or_by_a_person_and_the_antenna_stands_until_a_pass_is_near(
    by: StowBy, who: StowBy
) -> None:
    far = replace(SKY, plan=None)
    given = TickInput(saw(STOWED, requests=(StowWish(who, is_wanted=False),)), far, NOW)
    state, orders = tick(stowed(by), given, CONFIG)
    is_ended = who in (by, StowBy.OPERATOR)
    assert (state.stow.stow_by is StowBy.NOBODY) is is_ended
    assert state.tracking.track is (TrackState.IDLE if is_ended else TrackState.STOW)
    assert orders.extra is None


@pytest.mark.parametrize("seen", [STOWING, STOWED])
def test_a_pass_that_is_near_leaves_a_stow_that_is_over(seen: AcuStatus) -> None:
    state, sent = ticks(stowed(StowBy.OPERATOR, seen), [seen] * 2, StowWish(StowBy.OPERATOR, is_wanted=False))
    assert (state.tracking.track, sent) == (TrackState.PREPOSITION, [SelectMode(AcuMode.STANDBY)])


def test_who_comes_later_in_rank_takes_it_over_and_never_the_reverse() -> None:
    state, _ = ticks(ready(TrackState.IDLE, STANDS), [STANDS], *WISHES[::-1])
    assert state.stow.stow_by is StowBy.OPERATOR
    state, _ = ticks(state, [STOWED], StowWish(StowBy.WIND), StowWish(StowBy.WIND, is_wanted=False))
    assert state.stow.stow_by is StowBy.OPERATOR


def test_a_stow_of_the_panel_does_not_become_the_winds() -> None:
    state, _ = ticks(stowed(StowBy.PANEL), [STOWED], StowWish(StowBy.WIND), StowWish(StowBy.WIND, is_wanted=False))
    assert state.stow.stow_by is StowBy.PANEL


@pytest.mark.parametrize("last", [STOWING, STOWED])
@pytest.mark.parametrize("config", [CONFIG, RESTING])
def test_another_hand_that_ends_a_stow_of_ours_disarms(last: AcuStatus, config: ControlConfig) -> None:
    state, sent = ticks(stowed(StowBy.WIND, last), [STANDS] * 3, config=config)
    assert (state.stow.stow_by, state.arming.by_people, sent) == (StowBy.NOBODY, False, [])


def test_after_a_power_cycle_stow_is_sent_again() -> None:
    state, sent = ticks(stowed(StowBy.WIND), [replace(STANDS, backup_selected=Backup.RATE)] * 2)
    assert (state.stow.stow_by, sent[0], state.arming.by_people) == (StowBy.WIND, Stow(), None)


def test_under_the_local_panel_the_wish_waits_and_holds_when_remote_control_is_back() -> None:
    panel = replace(STANDS, mode=AcuMode.MANUAL, is_remote_enabled=False)
    state, sent = ticks(stowed(StowBy.OPERATOR), [panel] * 10)
    assert (state.tracking.track, state.stow.stow_by, sent) == (TrackState.MANUAL, StowBy.OPERATOR, [])
    state, sent = ticks(state, [STANDS] * 3)
    assert (state.tracking.track, sent) == (TrackState.STOW, [Stow()])


def test_a_person_who_disarms_does_not_interrupt_it() -> None:
    state, sent = ticks(stowed(StowBy.OPERATOR, STOWING), [STOWING] * 10, Request.DISARM)
    assert (sent, state.arming.is_stop_due) == ([], False)


# In flight


@pytest.mark.long
def test_a_stow_and_its_end_in_mid_pass_on_the_simulated_acu() -> None:
    flight = climb(60.0, script=[(15.0, says("stow")), (30.0, says("unstow"))])
    begin = RISING_TAI_S
    assert [one for one in commands_between(flight, begin, begin + 60.0) if isinstance(one, Stow)] == [Stow()]
    assert state_at(flight, begin + 15.5) == state_at(flight, begin + 29.9) == "STOW"
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    assert [one["was_by"] for one in events_named(flight, "stow.ends")] == ["operator"]


@pytest.mark.long
def test_a_stow_of_ours_holds_through_a_lost_link_and_the_end_of_the_run_leaves_it_alone() -> None:
    flight = climb(40.0, script=[(15.0, says("stow")), (20.0, cut(True)), (22.0, cut(False))])
    assert flight.rows[-1].mode in (AcuMode.STOWING, AcuMode.STOWED)
    assert state_at(flight, RISING_TAI_S + 39.0) == "STOW"
    assert len(events_named(flight, "stop.left_alone")) == 1
