"""What gives way at a limit: a step below it, at it, and a step above it, each said by value."""

import os
from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from memories import remembering
from test_live_line import SEEN
from test_schedule import DAY, RULES, track

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.assist.reading_gate import Dwell, below_highest
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.lease import Claim, Lease, holder, is_held_by, taken, used, why_not
from acu_daemon.control.receiver_signal import ReceiverSignal, SignalRules, SignalSample, judge_signal
from acu_daemon.control.safety.stow import obey_stow
from acu_daemon.control.tick_input import PassPlan, Sky, StowBy, StowWish
from acu_daemon.control.tracking.causes import is_tilt_set
from acu_daemon.control.tracking.hills import came_out_tai_s, hidden_until_tai_s, is_hidden
from acu_daemon.control.tracking.register_limiter import is_within
from acu_daemon.control.tracking.track_frame import is_within as is_offset_within
from acu_daemon.daemon.tally import RunFigures, Tally, phase_of
from acu_daemon.edge.fetch_policy import Came, FetchOutcome, FetchState, after, is_due, resumed
from acu_daemon.edge.kept_tapes import KeepRules, remove_old, tape_name
from acu_daemon.model import AxisLimits, Correction, FitResult, Prediction, Reading, Readings
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import Disc, KeepOut
from acu_daemon.pointing.skyline import Skyline, skyline_of
from acu_daemon.schedule.book import PassState, merged, paused
from acu_daemon.schedule.decisions import decide
from acu_daemon.schedule.rules import PassRequest, StationRules, Window, Wish
from acu_daemon.schedule.wind import Wind, WindRules, WindSample, WindWatch, watch
from acu_daemon.units import DAY_S

STEP = 1e-6
WIND, SIGNAL = WindRules(), SignalRules()
STRONG = WindWatch(Wind.STRONG, wants_stow=True, calm_since_tai_s=0.0)
LEASE = Lease(Claim("k", "ann", "page", lasts_s=7.0), 0.0, 100.0)
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
BOX = KeepOut("the mast", 350.0, 10.0, 5.0, 20.0)
HOUR_S = 3600.0
LEANING = ControlConfig(Envelope(AZIMUTH, ELEVATION), tilt_deg=-3.0)


def buffer(**more: Any) -> Prediction:
    """A path that stands, from 0 to 100 s."""
    t = np.zeros(101)
    return Prediction(0.0, 1.0, *(40.0 + t, 30.0 + t, t, t, 40.0 + t, t), kind="TLE", made_at_tai_s=0.0, **more)


def behind(el_deg: float) -> bool:
    """Whether a path so high is hidden by a hill of 30 deg, with a beam of 0.5 deg."""
    config = ControlConfig(Envelope(AZIMUTH, ELEVATION, skyline=Skyline((0.0,), (30.0,))), beamwidth_deg=0.5)
    path = buffer()
    return is_hidden(Sky(replace(path, el_deg=path.el_deg - 30.0 + el_deg)), 5.0, config)


def granted(**rules: float) -> bool:
    return decide([track("A", 1000.0, **rules)], RULES)[0].slot is not None  # 600 s, up to 40 deg


def granted_beside(window: tuple[float, float]) -> bool:
    rules = replace(RULES, windows=(Window(DAY + window[0], DAY + window[1], "paint"),))
    return decide([track("A", 1000.0)], rules)[0].slot is not None


def is_meant(off_s: float) -> bool:
    """Whether a word about a time is one about the pass whose middle is at 1300 s."""
    request = PassRequest("A", DAY + 1300.0 + off_s, Wish.EXCLUDE)
    short = track("A", 1290.0, 20.0, min_useful_s=1.0)
    return decide([short], replace(RULES, requests=(request,)))[0].slot is None


def is_meant_of_long(at_s: float) -> bool:
    """Whether a word about a time is one about a pass from 1000 to 5000 s."""
    request = PassRequest("A", DAY + at_s, Wish.EXCLUDE)
    return decide([track("A", 1000.0, 4000.0)], replace(RULES, requests=(request,)))[0].slot is None


def book_state(now_s: float, until_s: float) -> PassState:
    """Of a pass from 1000 to 1600 s that a new plan does not have."""
    book = merged((), decide([track("A", 1000.0)], RULES), DAY, DAY + 9e4).book
    return merged(book, (), DAY + now_s, DAY + until_s).book[0].state


def is_told(moved_s: float) -> bool:
    book = merged((), decide([track("A", 1000.0)], RULES), DAY, DAY + 9e4).book
    return merged(book, decide([track("A", 1000.0 + moved_s)], RULES), DAY, DAY + 9e4).said != ()


def is_paused(until_s: float) -> bool:
    entry = merged((), decide([track("A", 1000.0)], RULES), DAY, DAY + 9e4).book[0]
    return paused(entry, DAY + until_s).state is PassState.CANCELLED


def passes_counted(step_s: float) -> bool:
    tally, seen = Tally(), replace(SEEN, tai_s=0.0, rise_in_s=-1.0, set_in_s=9.0)
    tally.see(seen, RunFigures())
    tally.see(replace(seen, tai_s=step_s), RunFigures())
    return tally.seconds["visible"] > 0.0


def gap_counted(gap_s: float) -> bool:
    tally = Tally()
    tally.wrote(0.0)
    tally.wrote(gap_s)
    return tally.write_gap.cumulated()[-1] == 1


def way_counted(way_deg: float) -> bool:
    tally = Tally()
    tally.see(replace(SEEN, el_deg=0.0), RunFigures())
    tally.see(replace(SEEN, el_deg=way_deg), RunFigures())
    return tally.travel_deg["elevation"] > 0.0


def leans(off_deg: float, *, is_moving: bool = False) -> bool:
    status = AcuStatus(0.0, 0.0, AcuMode.REMOTE, tilt_deg=-3.0 + off_deg, is_tilt_moving=is_moving)
    return is_tilt_set(status, LEANING)


def is_fitted(el_deg: float) -> bool:
    readings = Readings(np.array([0.0]), np.array([10.0]), np.array([el_deg]))
    return len(below_highest(readings, EstimatorSettings(max_fit_elevation_deg=80.0))[0]) == 1


def is_locked_after(seconds: float) -> bool:
    dwell = Dwell(0.7)
    dwell.is_locked(Reading(0.0, 0.0, 0.0, True))
    return dwell.is_locked(Reading(seconds, 0.0, 0.0, True))


def due(in_s: float, every_s: float) -> bool:
    return is_due(FetchState("u", next_tai_s=1000.0 + in_s), 1000.0, every_s)


LIMITS: dict[str, tuple[Callable[[float], Any], float, tuple[Any, Any, Any]]] = {
    # what, its limit; below, at and above it
    "mean wind": (
        lambda x: watch(WindWatch(), WindSample(x, 1.0, 0.0), WIND, 0.0).wants_stow,
        WIND.mean_limit_m_s,
        (False, False, True),
    ),
    "gusts": (
        lambda x: watch(WindWatch(), WindSample(1.0, x, 0.0), WIND, 0.0).wants_stow,
        WIND.gust_limit_m_s,
        (False, False, True),
    ),
    "mean wind that is calm again": (
        lambda x: watch(STRONG, WindSample(x, 1.0, 900.0), WIND, 900.0).wants_stow,
        WIND.resume_share * WIND.mean_limit_m_s,
        (False, False, True),
    ),
    "gusts that are calm again": (
        lambda x: watch(STRONG, WindSample(1.0, x, 900.0), WIND, 900.0).wants_stow,
        WIND.resume_share * WIND.gust_limit_m_s,
        (False, False, True),
    ),
    "a calm": (
        lambda x: watch(STRONG, WindSample(1.0, 1.0, x), WIND, x).wants_stow,
        WIND.resume_after_s,
        (True, False, False),
    ),
    "the age of a wind": (
        lambda x: watch(WindWatch(newest=WindSample(1.0, 1.0, 0.0)), None, WIND, x).wind,
        WIND.max_age_s,
        (Wind.CALM, Wind.CALM, Wind.STALE),
    ),
    "no wind is less": (lambda x: WindSample(x, x, 0.0).is_possible, 0.0, (False, True, True)),
    "no mean is more": (lambda x: WindSample(x, 1.0, 0.0).is_possible, 150.0, (True, True, False)),
    "no gust is more": (lambda x: WindSample(1.0, x, 0.0).is_possible, 150.0, (True, True, False)),
    "a level that locks": (
        lambda x: judge_signal(ReceiverSignal(), SignalSample(0.0, x), SIGNAL).is_locked,
        SIGNAL.lock_db,
        (False, True, True),
    ),
    "a level that unlocks": (
        lambda x: judge_signal(ReceiverSignal(is_locked=True), SignalSample(0.0, x), SIGNAL).is_locked,
        SIGNAL.unlock_db,
        (False, True, True),
    ),
    "the age of a receiver's word": (
        lambda x: ReceiverSignal(0.0).is_known(x, SIGNAL),
        SIGNAL.max_age_s,
        (True, True, False),
    ),
    "an older word": (
        lambda x: judge_signal(ReceiverSignal(5.0, 1.0), SignalSample(x, 2.0), SIGNAL).level_db,
        5.0,
        (1.0, 2.0, 2.0),
    ),
    "no level is more": (lambda x: SignalSample(0.0, x).is_possible, 1000.0, (True, True, False)),
    "no level is less": (lambda x: SignalSample(0.0, x).is_possible, -1000.0, (False, True, True)),
    "a lease": (lambda x: holder(LEASE, x) is LEASE, 100.0, (True, False, False)),
    "a lease of its holder": (lambda x: is_held_by(LEASE, "k", x), 100.0, (True, False, False)),
    "a lease against another": (lambda x: why_not(LEASE, Claim("b", "", ""), x) == "", 100.0, (False, True, True)),
    "a lease that is taken again": (lambda x: taken(LEASE, LEASE.claim, x).since_s == x, 100.0, (False, True, True)),
    "a lease that is used": (lambda x: used(LEASE, "k", x) is None, 100.0, (False, True, True)),
    "a time to ask": (lambda x: due(x, HOUR_S), 0.0, (True, True, False)),
    "a time to ask by a wrong clock": (lambda x: due(x, HOUR_S), 48.0 * HOUR_S, (False, False, True)),
    "the same of a slow pace": (lambda x: due(x, 72.0 * HOUR_S), 144.0 * HOUR_S, (False, False, True)),
    "a culmination": (lambda x: granted(min_culmination_deg=x), 40.0, (True, True, False)),
    "useful seconds": (lambda x: granted(min_useful_s=x), 600.0, (True, True, False)),
    "a window before": (lambda x: granted_beside((0.0, x)), 1000.0 - RULES.pre_s, (True, True, False)),
    "a window after": (lambda x: granted_beside((x, 9e3)), 1600.0 + RULES.post_s, (False, True, True)),
    "a word about a pass that is later": (is_meant, -600.0, (False, False, True)),
    "a word about a pass that was earlier": (is_meant, 600.0, (True, False, False)),
    "a word about a long pass at its rise": (is_meant_of_long, 1000.0, (False, True, True)),
    "a word about a long pass at its set": (is_meant_of_long, 5000.0, (True, True, False)),
    "a pass that went by": (
        lambda x: book_state(x, 9e4),
        1600.0,
        (PassState.CANCELLED, PassState.CANCELLED, PassState.MISSED),
    ),
    "a pass at the end of the plan": (
        lambda x: book_state(0.0, x),
        1000.0,
        (PassState.PLANNED, PassState.PLANNED, PassState.CANCELLED),
    ),
    "a pass that moves later": (is_told, 5.0, (False, True, True)),
    "a pass that moves earlier": (is_told, -5.0, (True, True, False)),
    "a pause": (is_paused, 1000.0, (False, False, True)),
    "the time before a pass": (
        lambda x: phase_of(replace(SEEN, rise_in_s=x, set_in_s=900.0)),
        120.0,
        ("prepass", "prepass", "idle"),
    ),
    "a rise": (
        lambda x: phase_of(replace(SEEN, rise_in_s=x, set_in_s=900.0)),
        0.0,
        ("pass", "pass", "prepass"),
    ),
    "a set": (lambda x: phase_of(replace(SEEN, rise_in_s=-9.0, set_in_s=x)), 0.0, ("idle", "idle", "pass")),
    "a step from snapshot to snapshot": (passes_counted, 2.0, (True, True, False)),
    "a gap between writes": (gap_counted, 60.0, (True, False, False)),
    "a way up that is none": (way_counted, 0.1, (False, True, True)),
    "a way down that is none": (way_counted, -0.1, (True, True, False)),
    "a tilt on one side": (leans, 0.05, (True, True, False)),
    "a tilt on the other": (leans, -0.05, (False, True, True)),
    "a tilt that moves": (lambda x: leans(x, is_moving=True), 0.0, (False, False, False)),
    "a reading's elevation": (is_fitted, 80.0, (True, True, False)),
    "a plunged reading's elevation": (is_fitted, 100.0, (False, True, True)),
    "the dwell": (is_locked_after, 0.7, (True, True, True)),  # rounding of TAI is forgiven
    "the dwell less that": (is_locked_after, 0.7 - 1.5e-6, (False, False, True)),
    "the left of a box": (lambda x: BOX.clearance_deg(x, 10.0) > 0.0, 350.0, (True, False, False)),
    "the right of a box": (lambda x: BOX.clearance_deg(x, 10.0) > 0.0, 370.0, (False, False, True)),
    "the lower edge of a box": (lambda x: BOX.clearance_deg(0.0, x) > 0.0, 5.0, (True, False, False)),
    "the upper edge of a box": (lambda x: BOX.clearance_deg(0.0, x) > 0.0, 20.0, (False, False, True)),
    "a hill": (behind, 30.3, (True, False, False)),  # and 0.6 of the beam
    "the end of a buffer": (lambda x: buffer().at(x) is None, 100.0, (False, False, False)),
    "the end of a buffer and its rounding": (lambda x: buffer().at(x) is None, 100.0 + 2e-6, (False, True, True)),
    "the start of a buffer and its rounding": (lambda x: buffer().at(x) is None, -2e-6, (True, True, False)),
    "an offset late": (lambda x: is_offset_within((x, 0.0), (5.0, 1.0)), 5.0, (True, True, False)),
    "an offset early": (lambda x: is_offset_within((x, 0.0), (5.0, 1.0)), -5.0, (False, True, True)),
    "an offset right": (lambda x: is_offset_within((0.0, x), (5.0, 1.0)), 1.0, (True, True, False)),
    "an offset left": (lambda x: is_offset_within((0.0, x), (5.0, 1.0)), -1.0, (False, True, True)),
    "an axis' upper end and its noise": (lambda x: is_within(x, ELEVATION), 90.1, (True, True, False)),
    "an axis' lower end and its noise": (lambda x: is_within(x, ELEVATION), -0.1, (False, True, True)),
}


@pytest.mark.parametrize("name", LIMITS)
def test_a_limit_gives_way_just_where_it_is(name: str) -> None:
    judge, limit, expected = LIMITS[name]
    assert (judge(limit - STEP), judge(limit), judge(limit + STEP)) == expected


# Pauses that grow


@pytest.mark.parametrize(
    ("came", "every_h", "pauses_h"),
    [
        (Came.FAILED, 8.0, [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 24.0, 24.0]),
        (Came.UNUSABLE, 8.0, [8.0, 16.0, 24.0, 24.0]),
        (Came.UNUSABLE, 72.0, [72.0, 72.0]),
    ],
)
def test_a_server_is_asked_ever_later_up_to_a_day_or_its_pace(came: Came, every_h: float, pauses_h: list[float]):
    state, now_s = FetchState("u"), 1000.0
    for k, pause_h in enumerate(pauses_h):
        state = after(state, FetchOutcome(came, "no"), now_s, every_h * HOUR_S)
        assert (state.next_tai_s - now_s) / HOUR_S == pytest.approx(pause_h)
        assert (state.failed_count, state.asked_tai_s, state.good_tai_s) == (k + 1, now_s, -inf)
        now_s = state.next_tai_s
    after_40 = after(replace(state, failed_count=4000), FetchOutcome(came, "no"), now_s, every_h * HOUR_S)
    assert after_40.next_tai_s == state.next_tai_s + pauses_h[-1] * HOUR_S  # and no overflow


@pytest.mark.parametrize(("asked_h", "pause_h"), [(0.0, 0.25), (0.5, 0.5), (24.0, 24.0), (99.0, 24.0)])
def test_a_server_that_says_when_is_obeyed_for_a_day_at_most_and_never_asked_earlier(asked_h: float, pause_h: float):
    said = FetchOutcome(Came.FAILED, "busy", retry_after_s=asked_h * HOUR_S)
    assert after(FetchState("u"), said, 0.0, 8.0 * HOUR_S).next_tai_s == pause_h * HOUR_S


@pytest.mark.parametrize(
    ("asked_s", "good_s", "next_s"),
    [(900.0, 100.0, 900.0 + HOUR_S), (5000.0, 100.0, 1000.0 + HOUR_S), (-9e9, 100.0, 1000.0), (900.0, -inf, 1000.0)],
    ids=["lately", "by a clock that was ahead", "long ago", "never well"],
)
def test_a_person_lets_a_server_be_asked_again_within_its_pace(asked_s: float, good_s: float, next_s: float):
    stopped = FetchState("u", asked_s, 9e9, good_s, failed_count=3, problem="404", stopped="404")
    state = resumed(stopped, 1000.0, HOUR_S)
    assert (state.next_tai_s, state.failed_count, state.problem, state.stopped) == (next_s, 0, "", "")


@pytest.mark.parametrize(("came", "etag", "modified"), [(Came.GOOD, "new", "today"), (Came.UNCHANGED, "old", "then")])
def test_a_good_answer_clears_what_failed_and_only_a_new_one_has_another_tag(came: Came, etag: str, modified: str):
    before = FetchState("u", 1.0, 2.0, 3.0, "then", "old", 5, "broken")
    state = after(before, FetchOutcome(came, "", "today", "new"), 100.0, HOUR_S)
    assert state == FetchState("u", 100.0, 100.0 + HOUR_S, 100.0, modified, etag, 0, "")


# Tables that can be counted


@pytest.mark.parametrize("wish_by", [by for by in StowBy if by])
@pytest.mark.parametrize("stands_by", StowBy)
def test_a_stow_is_taken_over_by_whoever_ranks_higher_and_ended_by_its_own_or_a_person(stands_by, wish_by):
    order = ["", "schedule", "wind", "panel", "operator"]
    config = ControlConfig(Envelope(AZIMUTH, ELEVATION))
    state = remembering(stow_by=stands_by)
    events: list[Any] = []
    is_higher = order.index(wish_by) > order.index(stands_by)
    begun = obey_stow(state, StowWish(wish_by), config, events)
    assert begun.stow.stow_by == (wish_by if is_higher else stands_by)
    assert [(one.name, one.fields) for one in events] == ([("stow.begins", {"by": wish_by})] if is_higher else [])
    events.clear()
    may_end = stands_by != "" and wish_by in (stands_by, "operator")
    ended = obey_stow(state, StowWish(wish_by, is_wanted=False), config, events)
    assert ended.stow.stow_by == ("" if may_end else stands_by)
    fields = {"by": wish_by, "was_by": stands_by}
    assert [(one.name, one.fields) for one in events] == ([("stow.ends", fields)] if may_end else [])
    for wanted in (True, False):
        shadow = replace(config, is_shadow=True)
        assert obey_stow(state, StowWish(wish_by, is_wanted=wanted), shadow, events) is state


@pytest.mark.parametrize("along_s", [0.0, 7.0, -7.0])
def test_hills_are_timed_early_and_late_as_the_fit_says(along_s: float) -> None:
    fit = FitResult("full", Correction(), 0.0, 9, 0, 0.0, along_s, 0.0)
    sky = Sky(None, fit, PassPlan(100.0, 900.0, 100.0, 0.0, 5.0, hidden_tai_s=((200.0, 300.0), (400.0, 500.0))))
    first_s, second_s = 300.0 + along_s, 500.0 + along_s
    for tai_s, until_s, since_s in [
        (first_s - STEP, first_s, 100.0),
        (first_s, first_s, first_s),
        (first_s + STEP, second_s, first_s),
        (second_s, second_s, second_s),
        (second_s + STEP, None, second_s),
    ]:
        assert (hidden_until_tai_s(sky, tai_s), came_out_tai_s(sky, tai_s)) == (until_s, since_s)


@pytest.mark.parametrize(("sigma_deg", "inside_s"), [(0.1, 90.0), (0.1 + STEP, 20.0), (np.nan, 20.0), (inf, 20.0)])
def test_a_prediction_is_good_until_three_sigmas_are_more_than_the_limit(sigma_deg: float, inside_s: float) -> None:
    sigmas = np.full(101, 0.01)
    sigmas[30:] = sigma_deg
    assert buffer(sigma_deg=sigmas).seconds_inside(10.0, 3.0 * 0.1) == inside_s
    assert buffer(sigma_deg=sigmas).seconds_inside(-5.0, 0.0) == 0.0
    assert buffer().seconds_inside(10.0, 1.0) is None


@pytest.mark.parametrize("az_deg", [0.0, 10.0, 200.0, 349.5, 360.0, 370.0, -0.5])
def test_a_skyline_of_one_point_is_level_and_one_of_many_is_met_at_its_points_over_north(az_deg: float) -> None:
    assert Skyline((123.0,), (7.0,)).height_deg(az_deg) == 7.0
    many = skyline_of(((350.0, 3.0), (10.0, 7.0), (200.0, 1.0)))
    assert many.height_deg(az_deg) == pytest.approx(float(many.heights_deg(np.array([az_deg]))[0]))
    assert [many.height_deg(one) for one in (350.0, 370.0, -160.0, 360.0)] == pytest.approx([3.0, 7.0, 1.0, 5.0])


@pytest.mark.parametrize("radius_deg", [0.0, 2.0])
@pytest.mark.parametrize("el_deg", [-20.0, 0.0, 40.0, 85.0])
def test_a_disc_is_its_radius_about_its_middle_at_every_position_angle(radius_deg: float, el_deg: float) -> None:
    disc = Disc("the sun", 350.0, el_deg, radius_deg)
    for angle_deg in range(-170, 181, 35):
        az_deg, at_el_deg = disc.at(angle_deg, 0.5)
        assert disc.clearance_deg(az_deg, at_el_deg) == pytest.approx(0.5, abs=1e-9)
        assert (disc.angle_deg(az_deg, at_el_deg) - angle_deg + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-6)
        middle_deg, half_deg, low_deg, high_deg = disc.box_deg(0.5)
        assert low_deg - 1e-9 <= at_el_deg <= high_deg + 1e-9
        assert abs((az_deg - middle_deg + 180.0) % 360.0 - 180.0) <= half_deg + 1e-9
    assert disc.at(0.0, 0.5)[1] == pytest.approx(el_deg + radius_deg + 0.5)
    right_az_deg = disc.at(90.0, 0.5)[0]
    assert 0.0 < right_az_deg - 350.0 < 180.0


@pytest.mark.parametrize(
    ("days", "megabytes", "left"),
    [(10.0, 1.0, 2), (10.0 - 1e-3, 1.0, 1), (10.0, 0.2, 2), (10.0, 0.2 - 1e-6, 1), (1.0, 1.0, 1), (0.5, 1.0, 0)],
)
def test_recordings_are_kept_up_to_their_age_and_their_size(
    tmp_path: Path, days: float, megabytes: float, left: int
) -> None:
    now_s = 2e9
    for age_days in (10.0, 1.0):
        path = tmp_path / tape_name(8e8 - age_days * DAY_S, "SAT")
        path.write_bytes(b"\0" * 100_000)
        os.utime(path, (now_s - age_days * DAY_S,) * 2)
    gone = remove_old(tmp_path, KeepRules(days, megabytes, 99.0), now_s)
    assert len(list(tmp_path.iterdir())) == left == 2 - len(gone)


@pytest.mark.parametrize(("az_deg", "el_deg"), [(30.0, 5.0), (5.0, 30.0), (-30.0, -5.0), (0.0, 0.0)])
def test_a_way_takes_as_long_as_its_slower_axis_and_the_longest_gap_as_the_longest_way(az_deg, el_deg) -> None:
    rules = StationRules(AZIMUTH, ELEVATION, 62.0, 12.0)
    alone = rules.slew_s(az_deg, 0.0), rules.slew_s(0.0, el_deg)
    assert rules.slew_s(az_deg, el_deg) == max(alone)
    assert rules.slew_s(-az_deg, -el_deg) == max(alone)
    assert rules.longest_gap_s == 62.0 + 12.0 + rules.slew_s(540.0, 90.0)


@pytest.mark.parametrize("was_locked", [False, True])
@pytest.mark.parametrize("lost_s", [None, 3.0])
@pytest.mark.parametrize(("level_db", "said"), [(9.0, None), (5.0, None), (1.0, None), (1.0, True), (9.0, False)])
def test_a_loss_is_timed_by_the_word_that_tells_it_and_forgotten_with_the_next_lock(
    was_locked: bool, lost_s: float | None, level_db: float, said: bool | None
) -> None:
    before = ReceiverSignal(4.0, 2.0, was_locked, lost_s)
    is_locked = said if said is not None else level_db == 9.0 or (level_db == 5.0 and was_locked)
    seen = judge_signal(before, SignalSample(5.0, level_db, said), SIGNAL)
    expected_lost_s = None if is_locked else 5.0 if was_locked else lost_s
    assert seen == ReceiverSignal(5.0, level_db, is_locked, expected_lost_s)
    assert judge_signal(before, None, SIGNAL) is before
    assert judge_signal(before, SignalSample(5.0, None), SIGNAL) is before


@pytest.mark.parametrize(
    ("wish", "is_granted"), [(Wish.FORCE, True), (Wish.GO_ON, True), (Wish.NONE, False), (None, False)]
)
def test_a_pass_that_stays_too_low_is_tracked_by_a_persons_word_alone(wish: Wish | None, is_granted: bool) -> None:
    requests = () if wish is None else (PassRequest("A", DAY + 1300.0, wish),)
    (found,) = decide([track("A", 1000.0, min_culmination_deg=41.0)], replace(RULES, requests=requests))
    assert (found.slot is not None) is is_granted
    assert is_granted or found.reason == "culminates at 40.0 deg, min_culmination_deg is 41"
    others = (PassRequest("B", DAY + 1300.0, Wish.EXCLUDE),)
    assert decide([track("A", 1000.0)], replace(RULES, requests=others))[0].slot is not None
