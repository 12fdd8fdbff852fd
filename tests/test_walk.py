"""control.tracking.walk: what a change of state tells and remembers, what a lost link forgets, when a hold begins."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from memories import remembering
from test_tick import CONFIG, FITTED, NOW, PLAN, SKY, path, ready, saw, status

from acu_daemon.acu.commands import AcuMode, ReadFaults
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.safety.axis_watch import AxesWatch, AxisWatch
from acu_daemon.control.state import ControlState, Latch, Sent, StartStage, Watchdog
from acu_daemon.control.tick_input import Observation, Sky, StowBy, TickInput
from acu_daemon.control.tracking.state_table import HOLDING, Cause, TrackState
from acu_daemon.control.tracking.walk import walk
from acu_daemon.model import Correction, FitResult, Prediction
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.skyline import skyline_of

S = TrackState
BACKED_UP = status(AcuMode.REMOTE_BACKUP)
RISING = replace(PLAN, rise_tai_s=NOW - 100.0)
HILLY = replace(CONFIG, envelope=replace(CONFIG.envelope, skyline=skyline_of(((100.0, 60.0),))))
BEFORE_S = 30.0  # since when the state has lasted, and the hold


def going(track: TrackState, seen: AcuStatus, **changes: Any) -> ControlState:
    since = {"entered_tai_s": NOW - BEFORE_S, "hold_from_tai_s": NOW - BEFORE_S}
    return remembering(ready(track, seen), **(since | changes))


def step(
    state: ControlState, sky: Sky = SKY, config: ControlConfig = CONFIG, seen: Observation | None = None
) -> tuple[ControlState, list[Event]]:
    events: list[Event] = []
    status_seen = state.intake.status
    observation = seen or (saw(status_seen) if status_seen else Observation())
    return walk(state, TickInput(observation, sky, NOW), config, events), events


def with_sigma(sigma_deg: float, kind: str = "TLE", later_deg: float | None = None) -> Prediction:
    """A prediction of one sigma until the sample now, and of another from the next one on."""
    one = path(kind)
    sigmas = np.full(one.az_deg.size, sigma_deg)
    sigmas[11:] = sigma_deg if later_deg is None else later_deg
    return replace(one, sigma_deg=sigmas)


# A hold


@pytest.mark.parametrize("track", sorted(HOLDING))
@pytest.mark.parametrize(
    ("sigma_deg", "later_deg", "lasts"),
    [
        (1.0 / 6.0 - 1e-6, None, True),
        (1.0 / 6.0 + 1e-6, None, False),
        (1.0 / 6.0 - 1e-6, 9.0, True),
        (1.0 / 6.0 + 1e-6, 0.0, False),
    ],
)
def test_a_hold_counts_from_now_while_three_sigma_lie_within_half_the_beam(
    track: TrackState, sigma_deg: float, later_deg: float | None, lasts: bool
) -> None:
    kind = "FITTED" if track is S.HOLD_FITTED else "TLE"
    state = going(track, BACKED_UP)
    after, events = step(state, Sky(with_sigma(sigma_deg, kind, later_deg), None, RISING))
    assert events == []
    assert after == remembering(state, hold_from_tai_s=NOW if lasts else NOW - BEFORE_S)
    assert (after is state) is not lasts
    wide = replace(CONFIG, beamwidth_deg=1.1)
    assert step(state, Sky(with_sigma(1.0 / 6.0 + 1e-3, kind), None, RISING), wide)[0].tracking.hold_from_tai_s == NOW


def test_a_hold_without_a_sigma_or_a_prediction_counts_from_its_begin() -> None:
    state = going(S.HOLD_TLE, BACKED_UP)
    for sky in (Sky(path(), None, RISING), Sky(None, None, RISING)):
        assert step(state, sky)[0] is state


@pytest.mark.parametrize("track", sorted(HOLDING))
def test_behind_a_hill_a_hold_counts_from_now(track: TrackState) -> None:
    sky = Sky(path("FITTED" if track is S.HOLD_FITTED else "TLE"), None, RISING)
    state = going(track, BACKED_UP)
    assert step(state, sky, HILLY)[0].tracking.hold_from_tai_s == NOW
    assert step(state, sky)[0].tracking.hold_from_tai_s == NOW - BEFORE_S


@pytest.mark.parametrize("track", [S.AUTOTRACK_TLE, S.SEARCH, S.PROGRAM])
def test_no_other_state_has_a_hold_that_lasts(track: TrackState) -> None:
    seen = status(AcuMode.AUTOTRACK if track is S.AUTOTRACK_TLE else AcuMode.ACQUIRE)
    config = replace(CONFIG, has_signal=track is not S.PROGRAM)
    state = going(track, seen)
    assert step(state, Sky(with_sigma(0.01), None, RISING), config)[0] is state


# A change


CHANGES: dict[str, tuple[ControlState, Sky, TrackState, Cause]] = {
    "lost": (going(S.AUTOTRACK_TLE, BACKED_UP), SKY, S.HOLD_TLE, Cause.LOST),
    "lost fitted": (going(S.AUTOTRACK_FITTED, BACKED_UP), FITTED, S.HOLD_FITTED, Cause.LOST),
    "fitted": (going(S.HOLD_TLE, BACKED_UP), FITTED, S.HOLD_FITTED, Cause.FIT),
    "fit left": (going(S.HOLD_FITTED, BACKED_UP), SKY, S.HOLD_TLE, Cause.FIT_LEFT),
    "acquired": (going(S.HOLD_TLE, status()), SKY, S.AUTOTRACK_TLE, Cause.ACQUIRED),
    "over": (going(S.HOLD_TLE, BACKED_UP, hold_from_tai_s=NOW - 9e3), SKY, S.SEARCH, Cause.HOLD_OVER),
    "never heard": (going(S.ACQUIRE_TLE, BACKED_UP, entered_tai_s=NOW - 90.0), SKY, S.SEARCH, Cause.ACQUIRE_OVER),
    "searched": (going(S.SEARCH, BACKED_UP, entered_tai_s=NOW - 9e3), SKY, S.HOLD_TLE, Cause.SEARCH_OVER),
    "fault": (going(S.HOLD_TLE, status(AcuMode.FAULT)), SKY, S.FAULT, Cause.ACU_FAULT),
    "panel": (going(S.HOLD_TLE, status(AcuMode.MANUAL)), SKY, S.MANUAL, Cause.LOCAL_PANEL),
    "stowed": (going(S.HOLD_TLE, status(AcuMode.STOWED), stow_by=StowBy.OPERATOR), SKY, S.STOW, Cause.STOWING),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_told_with_its_cause_and_remembered_with_its_time(name: str) -> None:
    state, sky, track, cause = CHANGES[name]
    after, events = step(state, replace(sky, plan=RISING))
    before = state.tracking
    fields = {"state": str(track), "before": str(before.track), "cause": str(cause)}
    assert events == [Event("state.changed", fields, is_warning=track in (S.FAULT, S.SEARCH))]
    begins = track in HOLDING and before.track not in HOLDING
    hold_from_tai_s = NOW if begins else before.hold_from_tai_s
    assert after == remembering(state, track=track, entered_tai_s=NOW, hold_from_tai_s=hold_from_tai_s)


@pytest.mark.parametrize("along_s", [0.0, 3.0, -3.0])
@pytest.mark.parametrize(
    ("track", "is_fitted", "target", "cause"),
    [
        (S.AUTOTRACK_TLE, False, S.HOLD_TLE, Cause.HIDDEN),
        (S.AUTOTRACK_FITTED, True, S.HOLD_FITTED, Cause.HIDDEN),
        (S.SEARCH, False, S.HOLD_TLE, Cause.HIDDEN),
        (S.SEARCH, True, S.HOLD_FITTED, Cause.HIDDEN_FITTED),
    ],
)
def test_behind_a_hill_it_is_told_when_the_satellite_comes_out(
    track: TrackState, is_fitted: bool, target: TrackState, cause: Cause, along_s: float
) -> None:
    fit = FitResult("full", Correction(), NOW, 9, 0, 0.0, along_s, 0.0)
    plan = replace(RISING, hidden_tai_s=((NOW - 5.0, NOW + 20.26),))
    sky = Sky(path("FITTED" if is_fitted else "TLE"), fit, plan)
    seen = status(AcuMode.ACQUIRE)
    after, events = step(going(track, seen), sky, HILLY)
    fields = {"state": str(target), "before": str(track), "cause": str(cause)}
    assert events == [Event("state.changed", fields | {"back_in_s": round(20.3 + along_s, 1)})]
    assert (after.tracking.track, after.tracking.hold_from_tai_s) == (target, NOW)
    for plan_without in (RISING, replace(RISING, hidden_tai_s=((NOW - 9.0, NOW - 8.0),))):
        assert step(going(track, seen), replace(sky, plan=plan_without), HILLY)[1][0].fields == fields


def test_a_plain_loss_tells_nothing_of_hills() -> None:
    plan = replace(RISING, hidden_tai_s=((NOW + 5.0, NOW + 20.0),))
    assert "back_in_s" not in step(going(S.AUTOTRACK_TLE, BACKED_UP), replace(SKY, plan=plan))[1][0].fields


@pytest.mark.parametrize(
    ("rise_s", "told"), [(100.0, []), (5.0, ["pass.late"]), (-50.0, ["pass.joined"])], ids=["early", "late", "in it"]
)
def test_an_antenna_that_sets_out_late_says_so_and_no_other_change_does(rise_s: float, told: list[str]) -> None:
    plan = replace(PLAN, rise_tai_s=NOW + rise_s, start_tai_s=NOW + rise_s, start_az_deg=-60.0)
    seen = status(AcuMode.STANDBY)
    after, events = step(going(S.IDLE, seen), replace(SKY, plan=plan))
    assert after.tracking.track is S.PREPOSITION
    assert [one.name for one in events] == ["state.changed", *told]
    _, events = step(going(S.MANUAL, seen), replace(SKY, plan=plan))
    assert [one.name for one in events] == ["state.changed"]


# A lost link


@pytest.mark.parametrize("stage", StartStage)
def test_a_lost_link_is_a_warning_and_forgets_writes_motion_place_and_start_but_not_the_latch(
    stage: StartStage,
) -> None:
    state = going(
        S.HOLD_TLE,
        BACKED_UP,
        stage=stage,
        watchdog=Watchdog.SET,
        watchdog_from_tai_s=NOW - 1.0,
        is_place_sure=True,
        latch=Latch("stands", AxesWatch(az=AxisWatch(side=1))),
        axis_az=AxisState(1.0),
        axis_el=AxisState(2.0),
        last_write_tai_s=NOW,
        commands=(Sent(1.0, 2.0, True),),
        command=ReadFaults(),
        again_tai_s=NOW + 1.0,
    )
    after, events = step(state, SKY, seen=Observation(silence_s=CONFIG.acu.silence_s + 0.01))
    fields = {"state": "LINK-LOST", "before": "HOLD/TLE", "cause": str(Cause.LINK_SILENT)}
    assert events == [Event("state.changed", fields, is_warning=True)]
    assert after == remembering(
        state,
        track=S.LINK_LOST,
        entered_tai_s=NOW,
        stage=StartStage.NEW,
        watchdog=Watchdog.UNKNOWN,
        watchdog_from_tai_s=None,
        is_place_sure=False,
        latch=Latch("stands"),
        axis_az=None,
        axis_el=None,
        last_write_tai_s=None,
        commands=(),
        command=None,
    )
