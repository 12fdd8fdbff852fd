"""control.safety.fresh_start: what each request of a person does to what is armed, latched, owed and remembered."""

from dataclasses import replace
from typing import Any

import pytest
from memories import remembering
from test_tick import AZ_DEG, CONFIG, EL_DEG, NOW, ready, status

from acu_daemon.acu.commands import AcuMode, ReadFaults
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.safety.axis_watch import AxesWatch, AxisWatch
from acu_daemon.control.safety.fresh_start import anew, disarm, obey
from acu_daemon.control.state import ControlState, ForeignStop, Held, Interlock, Latch, StartStage, Watchdog
from acu_daemon.control.tick_input import Asking, HoldWish, NudgeWish, Request, StowBy, StowWish
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.pointing.axis import AxisState

AXES = AxesWatch(az=AxisWatch(side=1))
SHADOW, RESTING = replace(CONFIG, is_shadow=True), replace(CONFIG, is_resting=True)
UNARMED = replace(CONFIG, is_armed=False)
ARMED = Event("armed")
DISARMED = Event("disarmed", {"by": "a person", "advice": "`acu-daemon arm` goes on"}, is_warning=True)
DUE = pytest.mark.parametrize("is_due", [False, True])


def memory(**changes: Any) -> ControlState:
    """A daemon at work, with something in each part that a fresh start forgets."""
    values: dict[str, Any] = {
        "latch": Latch("", AXES),
        "axis_az": AxisState(1.0),
        "axis_el": AxisState(2.0),
        "was_followed": True,
        "command": ReadFaults(),
        "again_tai_s": NOW + 1.0,
        "foreign_stop": ForeignStop(Held(True), is_doubted=True),
        "interlock": Interlock((True, False, False, False)),
        "watchdog": Watchdog.SET,
    }
    return remembering(ready(TrackState.HOLD_TLE, status(AcuMode.REMOTE_BACKUP)), **(values | changes))


def begun(state: ControlState, **changes: Any) -> ControlState:
    """What a fresh start leaves."""
    values: dict[str, Any] = {
        "stage": StartStage.REGISTERS_KNOWN,
        "latch": Latch(state.latch.problem),
        "axis_az": None,
        "axis_el": None,
        "was_followed": False,
        "command": None,
        "foreign_stop": ForeignStop(state.foreign_stop.held),
    }
    return remembering(state, **(values | changes))


def asked(state: ControlState, *requests: Asking, config: ControlConfig = CONFIG) -> tuple[ControlState, list[Event]]:
    events: list[Event] = []
    return obey(state, requests, config, events), events


@pytest.mark.parametrize("stage", StartStage)
@pytest.mark.parametrize("watchdog", Watchdog)
def test_a_fresh_start_writes_the_present_angles_first_and_sets_the_watchdog_again_unless_it_is_kept(
    stage: StartStage, watchdog: Watchdog
) -> None:
    state = memory(stage=stage, watchdog=watchdog, latch=Latch("stands", AXES))
    at = min(stage, StartStage.REGISTERS_KNOWN)
    set_again = Watchdog.UNKNOWN if watchdog is Watchdog.SET else watchdog
    assert anew(state) == begun(state, stage=at, watchdog=set_again)
    assert anew(state, keeps_watchdog=True) == begun(state, stage=at)


@DUE
def test_disarmed_it_starts_anew_keeps_its_watchdog_and_says_by_whom_and_what_to_do(is_due: bool) -> None:
    events: list[Event] = []
    state = memory(is_stop_due=is_due)
    after = disarm(state, "an open door", events)
    assert after == begun(state, by_people=False, disarmed_by="an open door")
    fields = {"by": "an open door", "advice": "`acu-daemon arm` goes on"}
    assert events == [Event("disarmed", fields, is_warning=True)]


# Clear


@DUE
@pytest.mark.parametrize("config", [CONFIG, RESTING, SHADOW, UNARMED])
def test_a_latch_is_cleared_and_a_stop_is_owed_on_by_who_commands_nothing(config: ControlConfig, is_due: bool) -> None:
    state = memory(latch=Latch("stands", AXES), is_stop_due=is_due)
    after, events = asked(state, Request.CLEAR, config=config)
    assert events == [Event("latch.cleared", {"latch": "stands"})]
    is_owed = is_due and config is not CONFIG
    assert after == begun(state, latch=Latch(), watchdog=Watchdog.UNKNOWN, is_stop_due=is_owed)


def test_where_nothing_is_latched_there_is_nothing_to_clear() -> None:
    state = memory(is_stop_due=True)
    assert asked(state, Request.CLEAR) == (state, [])


# Arm


@DUE
@pytest.mark.parametrize("problem", ["", "stands"])
@pytest.mark.parametrize("config", [CONFIG, RESTING])
def test_armed_it_starts_anew_and_owes_the_stop_of_a_latch_alone(
    config: ControlConfig, problem: str, is_due: bool
) -> None:
    state = memory(by_people=False, disarmed_by="a person", is_stop_due=is_due, latch=Latch(problem, AXES))
    after, events = asked(state, Request.ARM, config=config)
    assert events == [ARMED]
    assert after == begun(
        state,
        by_people=True,
        disarmed_by="",
        is_stop_due=is_due and bool(problem),
        watchdog=Watchdog.UNKNOWN,
        foreign_stop=ForeignStop(),
        interlock=Interlock(),
    )


@pytest.mark.parametrize("config", [CONFIG, RESTING])
def test_who_arms_again_has_seen_how_the_antenna_stands_and_changes_nothing_else(config: ControlConfig) -> None:
    state = memory(is_stop_due=True)
    after, events = asked(state, Request.ARM, config=config)
    assert (after, events) == (remembering(state, foreign_stop=ForeignStop()), [])


def test_as_configured_it_is_armed_by_a_word_or_not() -> None:
    assert asked(memory(), Request.ARM, config=UNARMED)[1] == [ARMED]
    assert asked(memory(by_people=True), Request.ARM, config=UNARMED)[1] == []


# Disarm and stop


@DUE
@pytest.mark.parametrize("in_force", [None, (NOW, AZ_DEG, EL_DEG)])
@pytest.mark.parametrize("held", [None, Held()])
def test_disarmed_a_stop_is_owed_where_the_antenna_was_commanded_or_held_or_one_was_owed(
    held: Held | None, in_force: tuple[float, float, float] | None, is_due: bool
) -> None:
    state = memory(foreign_stop=ForeignStop(held), in_force=in_force, is_stop_due=is_due)
    after, events = asked(state, Request.DISARM)
    is_owed = is_due or held is not None or in_force is not None
    assert after == begun(state, by_people=False, disarmed_by="a person", is_stop_due=is_owed)
    assert events == [DISARMED]
    assert asked(after, Request.DISARM) == (after, [])


@DUE
@pytest.mark.parametrize("config", [CONFIG, RESTING, UNARMED])
def test_a_stop_disarms_who_is_armed_and_is_owed_by_everybody(config: ControlConfig, is_due: bool) -> None:
    state = memory(foreign_stop=ForeignStop(), in_force=None, is_stop_due=is_due)
    after, events = asked(state, Request.STOP, config=config)
    if config is UNARMED:
        assert (after, events) == (remembering(state, is_stop_due=True), [])
    else:
        assert after == begun(state, by_people=False, disarmed_by="a person", is_stop_due=True)
        assert events == [DISARMED]


# Anything else


@pytest.mark.parametrize("request_", [Request.ARM, Request.DISARM, Request.STOP, StowWish(StowBy.OPERATOR)])
def test_a_shadow_obeys_nobody(request_: Asking) -> None:
    state = memory(by_people=True)
    assert asked(state, request_, config=SHADOW) == (state, [])


@pytest.mark.parametrize("request_", [HoldWish(), NudgeWish(1.0, 1.0)])
def test_what_is_of_the_path_is_no_matter_of_arming(request_: Asking) -> None:
    state = memory(latch=Latch("stands"))
    assert asked(state, request_) == (state, [])


def test_requests_are_obeyed_one_after_the_other() -> None:
    state = memory(latch=Latch("stands", AXES))
    after, events = asked(state, StowWish(StowBy.OPERATOR), Request.DISARM, Request.CLEAR, Request.ARM, Request.STOP)
    assert [one.name for one in events] == ["stow.begins", "disarmed", "latch.cleared", "armed", "disarmed"]
    assert after.stow.stow_by is StowBy.OPERATOR
    assert (after.arming.is_stop_due, after.arming.by_people, after.latch.problem) == (True, False, "")
