"""When a state has lasted long enough: each time limit, a moment before and a moment after; and what a hill hides."""

from dataclasses import replace

import numpy as np
import pytest
from memories import remembering
from test_tick import CONFIG, NOW, PLAN, SKY, path, ready, saw, status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import PassPlan, Sky, TickInput
from acu_daemon.control.tracking.causes import MODE_SETTLE_S, find_causes
from acu_daemon.control.tracking.hills import came_out_tai_s, hidden_until_tai_s, is_hidden
from acu_daemon.control.tracking.state_table import HOLDING, Cause, TrackState
from acu_daemon.model import Correction, FitResult, Prediction
from acu_daemon.pointing.skyline import skyline_of

LIMITS = replace(CONFIG, acquire_s=40.0, hold_s=200.0, search_s=70.0)
OVER = {Cause.ACQUIRE_OVER, Cause.HOLD_OVER, Cause.SEARCH_OVER, Cause.SEARCH_OVER_FITTED, Cause.MODE_LEFT}
RISING = replace(PLAN, rise_tai_s=NOW - 100.0)
MOMENT_S = 0.01


def over(
    track: TrackState,
    in_state_s: float,
    *,
    hold_s: float = 0.0,
    has_locked: bool = True,
    plan: PassPlan = RISING,
    seen: AcuStatus | None = None,
    kind: str = "TLE",
    config: ControlConfig = LIMITS,
) -> set[Cause]:
    """What is over of a state that has lasted so long, and of a hold that counts from so long ago."""
    seen = seen or status(AcuMode.ACQUIRE)
    state = remembering(
        ready(track, seen), entered_tai_s=NOW - in_state_s, hold_from_tai_s=NOW - hold_s, has_locked=has_locked
    )
    return find_causes(state, TickInput(saw(seen), Sky(path(kind), None, plan), NOW), config) & OVER


@pytest.mark.parametrize("side", [-1, 1])
def test_autotrack_has_its_time_for_a_signal_from_the_rise_or_from_its_selection_whichever_is_later(side: int) -> None:
    is_over = {Cause.ACQUIRE_OVER} if side > 0 else set()
    waited_s = LIMITS.acquire_s + side * MOMENT_S
    assert over(TrackState.ACQUIRE_TLE, waited_s) == is_over
    late = replace(PLAN, rise_tai_s=NOW - waited_s)
    assert over(TrackState.ACQUIRE_TLE, 90.0, plan=late) == is_over
    hill = replace(RISING, hidden_tai_s=((NOW - 90.0, NOW - waited_s),))
    assert over(TrackState.ACQUIRE_TLE, 95.0, plan=hill) == is_over
    for track in set(TrackState) - {TrackState.ACQUIRE_TLE, TrackState.HOLD_TLE, TrackState.SEARCH}:
        assert Cause.ACQUIRE_OVER not in over(track, 1e4)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("along_s", [0.0, 7.0, -7.0])
def test_a_pass_ends_early_and_late_as_the_fit_says(along_s: float, side: int) -> None:
    fit = FitResult("full", Correction(), 0.0, 9, 0, 0.0, along_s, 0.0)
    seen = status(AcuMode.ACQUIRE)
    after_s = 1.0 + along_s + side * MOMENT_S
    given = TickInput(saw(seen), Sky(path("full"), fit, replace(RISING, set_tai_s=NOW - after_s)), NOW)
    causes = find_causes(ready(TrackState.HOLD_FITTED, seen), given, LIMITS)
    assert (Cause.PASS_OVER in causes) == (side > 0)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("track", sorted(HOLDING))
def test_a_hold_has_its_time_and_a_glimpse_that_never_locked_that_of_autotrack(track: TrackState, side: int) -> None:
    is_over = {Cause.HOLD_OVER} if side > 0 else set()
    assert over(track, 0.0, hold_s=LIMITS.hold_s + side * MOMENT_S) == is_over
    is_glimpse = track is TrackState.HOLD_TLE
    limit_s = LIMITS.acquire_s if is_glimpse else LIMITS.hold_s
    assert over(track, 0.0, hold_s=limit_s + side * MOMENT_S, has_locked=False) == is_over
    short = replace(LIMITS, hold_s=10.0)  # shorter than a glimpse's
    assert over(track, 0.0, hold_s=10.0 + side * MOMENT_S, has_locked=False, config=short) == is_over
    assert over(TrackState.SEARCH, 0.0, hold_s=1e4) == set()


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("kind", "cause"), [("TLE", Cause.SEARCH_OVER), ("FITTED", Cause.SEARCH_OVER_FITTED)])
def test_a_search_has_its_time(kind: str, cause: Cause, side: int) -> None:
    is_over = {cause} if side > 0 else set()
    assert over(TrackState.SEARCH, LIMITS.search_s + side * MOMENT_S, kind=kind) == is_over


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("mode", list(AcuMode))
@pytest.mark.parametrize("is_selected", [False, True])
def test_a_mode_is_left_once_it_had_time_to_show_and_autotrack_is_not_selected(
    mode: AcuMode, is_selected: bool, side: int
) -> None:
    seen = replace(status(mode), is_autotrack_selected=is_selected)
    found = over(TrackState.AUTOTRACK_TLE, MODE_SETTLE_S + side * MOMENT_S, seen=seen)
    is_left = side > 0 and not is_selected and mode in (AcuMode.STANDBY, AcuMode.REMOTE)
    assert (Cause.MODE_LEFT in found) is is_left


# Behind a hill

HILL = skyline_of(((0.0, 10.0), (90.0, 10.0), (100.0, 39.0), (110.0, 10.0)))  # highest at 100 deg


def hidden(el_deg: float, beamwidth_deg: float = 1.0) -> bool:
    t = np.zeros(20)
    still = Prediction(NOW - 1.0, 0.1, 100.0 + t, el_deg + t, t, t, 100.0 + t, t, "TLE", NOW)
    config = replace(CONFIG, envelope=replace(CONFIG.envelope, skyline=HILL), beamwidth_deg=beamwidth_deg)
    return is_hidden(Sky(still, None, PLAN), NOW, config)


@pytest.mark.parametrize("beamwidth_deg", [0.5, 1.0, 4.0])
def test_a_path_is_hidden_up_to_the_lower_part_of_a_beam_over_the_skyline(beamwidth_deg: float) -> None:
    assert hidden(39.0 + 0.59 * beamwidth_deg, beamwidth_deg)
    assert not hidden(39.0 + 0.61 * beamwidth_deg, beamwidth_deg)
    assert not is_hidden(SKY, NOW, CONFIG)  # there is no skyline


@pytest.mark.parametrize("late_s", [None, 0.0, 7.0, -7.0])
def test_a_hill_ends_later_by_as_much_as_the_satellite_is_late(late_s: float | None) -> None:
    fit = None if late_s is None else FitResult("full", Correction(), NOW, 9, 0, 0.0, late_s, 0.0)
    late = late_s or 0.0
    plan = replace(PLAN, hidden_tai_s=((NOW - 50.0, NOW - 20.0), (NOW + 30.0, NOW + 60.0)))
    sky = Sky(path(), fit, plan)
    first, second = NOW - 20.0 + late, NOW + 60.0 + late
    for tai_s, until, out in (
        (NOW - 45.0, first, PLAN.rise_tai_s),
        (first - 0.1, first, PLAN.rise_tai_s),
        (first + 0.1, second, first),
        (second - 0.1, second, first),
        (second + 0.1, None, second),
    ):
        assert (hidden_until_tai_s(sky, tai_s), came_out_tai_s(sky, tai_s)) == (until, out)
    nowhere = Sky(path(), fit, None)
    assert (hidden_until_tai_s(nowhere, NOW), came_out_tai_s(nowhere, NOW)) == (None, NOW)


@pytest.mark.parametrize("height_deg", [39.0, 41.0])
def test_behind_a_hill_no_time_for_a_signal_goes_by(height_deg: float) -> None:
    hill = skyline_of(((0.0, 10.0), (90.0, 10.0), (100.0, height_deg), (110.0, 10.0)))
    config = replace(LIMITS, envelope=replace(LIMITS.envelope, skyline=hill))
    expected = {Cause.ACQUIRE_OVER} if height_deg < 40.0 else set()
    assert over(TrackState.ACQUIRE_TLE, 90.0, config=config) == expected
