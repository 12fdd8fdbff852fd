"""What a tally counts, how fast an antenna moves and when a line is bad: each limit, each cause, what is forgotten."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from memories import remembering
from structlog.testing import capture_logs
from test_live_line import SEEN
from test_tick import NOW, path

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import PassPlan, Sky
from acu_daemon.control.tracking.state_table import Cause, TrackState
from acu_daemon.daemon.drawing import TRACK_COUNT, take_ahead, take_aim, take_backdrop
from acu_daemon.daemon.envelope_watch import EnvelopeSeen, look_around, why_not_moved
from acu_daemon.daemon.line_watch import LineWatch
from acu_daemon.daemon.motion import Motion
from acu_daemon.daemon.tally import LOSSES, REJECTIONS, Buckets, RunFigures, Tally
from acu_daemon.model import AxisLimits, Reading, ZenithCrossing
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut

STEP = 1e-6

# Tally


def changed(before: TrackState, state: TrackState, cause: Cause = Cause.LOST) -> Event:
    return Event("state.changed", {"before": str(before), "state": str(state), "cause": cause})


def through(*states: TrackState) -> tuple[Event, ...]:
    return tuple(changed(before, state) for before, state in pairwise(states))


S = TrackState
LOST, LOCKED = Event("signal.lost"), Event("signal.locked")


def told(*events: Event, step_s: float = 1.0) -> Tally:
    tally = Tally()
    for k, event in enumerate(events):
        tally.told(event, 100.0 + k * step_s)
    return tally


def test_a_value_at_a_bound_is_within_it() -> None:
    buckets = Buckets((1.0, 2.0))
    for value in (-5.0, 1.0, 1.0 + STEP, 2.0, 2.0 + STEP, 99.0):
        buckets.add(value)
    assert buckets.cumulated() == [2, 4, 6]
    assert buckets.total == pytest.approx(100.0 + 2.0 * STEP)


def test_the_bounds_of_each_distribution_are_those_that_dashboards_are_drawn_for() -> None:
    tally = Tally()
    tenths_ms = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
    assert tally.lateness.bounds == pytest.approx([1e-4 * one for one in tenths_ms])
    assert tally.round_trip.bounds == (0.005, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.2, 0.5)
    assert tally.write_gap.bounds == (0.1, 0.11, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
    assert tally.relock.bounds == (0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0)


@pytest.mark.parametrize("cause", [*LOSSES, Cause.PASS_NEAR])
def test_a_loss_is_counted_under_its_cause(cause: Cause) -> None:
    tally = told(changed(S.AUTOTRACK_FITTED, S.HOLD_FITTED, cause))
    assert tally.counts == {("losses", LOSSES.get(cause, "other")): 1}


def test_causes_of_losses_have_their_names() -> None:
    assert {str(cause.name): name for cause, name in LOSSES.items()} == {
        "LOST": "lost", "HIDDEN": "hidden", "KEEP_OUT": "keep_out", "ZENITH_NEAR": "zenith",
        "LOCK_FALSE": "false_lock", "MODE_LEFT": "mode_left", "LINK_SILENT": "link",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("events", "relocks", "losses"),
    [
        (through(S.AUTOTRACK_TLE, S.HOLD_TLE, S.AUTOTRACK_TLE), [1.0], 1),
        (through(S.AUTOTRACK_TLE, S.HOLD_TLE, S.SEARCH, S.AUTOTRACK_TLE), [2.0], 1),
        (through(S.AUTOTRACK_TLE, S.HOLD_TLE, S.HOLD_FITTED, S.AUTOTRACK_FITTED), [2.0], 1),
        (through(S.AUTOTRACK_TLE, S.HOLD_TLE, S.FAULT, S.AUTOTRACK_TLE), [], 1),
        (through(S.AUTOTRACK_TLE, S.AUTOTRACK_FITTED, S.AUTOTRACK_TLE), [], 0),
        (through(S.AUTOTRACK_TLE, S.IDLE, S.AUTOTRACK_TLE), [], 0),
        ((changed(S.HOLD_TLE, S.AUTOTRACK_TLE),), [], 0),
        ((LOST, LOCKED, LOCKED), [1.0], 1),
        ((LOST, LOST, LOCKED), [1.0], 2),
        ((LOCKED,), [], 0),
        ((Event("something.else"), Event("tick")), [], 0),
    ],
)
def test_a_relock_is_from_the_newest_loss_until_the_signal_is_back(
    events: tuple[Event, ...], relocks: list[float], losses: int
) -> None:
    tally = told(*events)
    assert (tally.relock.cumulated()[-1], tally.relock.total) == (len(relocks), sum(relocks))
    assert sum(count for (name, _), count in tally.counts.items() if name == "losses") == losses


def test_a_refused_permit_is_counted_as_such_and_as_no_figure_that_is_not_finite() -> None:
    tally = told(Event("fence.refused"), Event("fence.refused"))
    tally.see(replace(SEEN, refusal_count=5), RunFigures(permit_refusal_count=2))
    assert {label: count for (name, label), count in tally.counts.items() if name == "refused"} == {
        "permit": 2,
        "not_finite": 3,
    }


def test_counts_follow_their_own_figures_and_never_fall() -> None:
    tally = Tally()
    reasons = dict.fromkeys(REJECTIONS, 2) | {"of the future": 3}
    figures = RunFigures(connect_count=4, fit_count=5, fit_failed_count=6, link_errors={"garbled": 7})
    tally.see(replace(SEEN, tick_count=8, skipped_tick_count=9, rejected_counts=reasons), figures)
    tally.see(replace(SEEN, tick_count=7, skipped_tick_count=9), RunFigures(link_errors={"garbled": 8}))
    assert tally.counts == {
        **{("rejected", label): 2 for label in REJECTIONS.values()},
        ("rejected", "other"): 3,
        ("ticks", ""): 8,
        ("skipped", ""): 9,
        ("connects", ""): 4,
        ("fits", ""): 5,
        ("fits_failed", ""): 6,
        ("link_errors", "garbled"): 8,
    }
    tally.begin_run()
    tally.see(replace(SEEN, tick_count=1), RunFigures())
    assert tally.counts["ticks", ""] == 9


def test_time_on_target_is_of_the_time_up_and_not_behind_the_mask() -> None:
    tally = Tally()
    for tenth, changes in enumerate(
        (
            {"is_on_path": True},
            {"is_on_path": True},
            {"is_on_path": False},
            {"is_on_path": None},
            {"is_on_path": True, "is_hidden": True},
            {"is_on_path": True, "rise_in_s": 50.0},
            {"is_on_path": True, "set_in_s": 0.0},
        )
    ):
        tally.see(replace(SEEN, tai_s=100.0 + 0.5 * tenth, **changes), RunFigures())  # type: ignore[arg-type]
    assert dict(tally.seconds) == {"visible": 1.5, "on_target": 0.5}


def test_round_trips_and_gaps_are_of_what_was_answered() -> None:
    tally = Tally()
    for took_s in (None, 0.012, 0.3):
        tally.exchanged(took_s)
    assert (tally.round_trip.cumulated()[-1], tally.round_trip.total) == (2, pytest.approx(0.312))
    for at in (10.0, 10.1, 10.1, 9.0, 9.2):  # also where a clock is set back
        tally.wrote(at)
    assert tally.counts["writes", ""] == 5
    assert (tally.write_gap.cumulated()[-1], tally.write_gap.total) == (2, pytest.approx(0.3))
    assert tally.write_tai_s == 9.2


def test_a_way_of_an_angle_that_is_unknown_goes_on_from_the_last_that_was_known() -> None:
    tally = Tally()
    for el_deg in (10.0, None, 12.0):
        tally.see(replace(SEEN, el_deg=el_deg), RunFigures())
    assert tally.travel_deg["elevation"] == 2.0


# Motion


def moving(
    az_rate: float = 0.0, el_rate: float = 0.0, el_deg: float = 60.0, az_deg: float = 359.5, **of: Any
) -> Motion:
    motion = Motion()
    for k in range(of.get("count", 30)):
        t_s = 0.1 * k
        motion.add(Reading(NOW + t_s, (az_deg + az_rate * t_s) % 360.0, el_deg + el_rate * t_s, True))
    return motion


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("az_deg", [359.5, 0.5, 87.0, 93.0, 180.0])
def test_a_speed_is_on_the_sky_over_north_and_to_both_sides(sign: float, az_deg: float) -> None:
    now = NOW + 2.9
    assert moving(2.0 * sign, az_deg=az_deg).speed_deg_s(now) == pytest.approx(1.0)
    assert moving(0.0, 0.5 * sign).speed_deg_s(now) == pytest.approx(0.5)
    assert moving(6.0 * sign, 4.0, 56.05, az_deg).speed_deg_s(now) == pytest.approx(
        np.hypot(6.0 * np.cos(np.radians(56.05 + 4.0 * 2.45)), 4.0), rel=1e-6
    )


@pytest.mark.parametrize(
    ("new", "old", "is_known"), [(3, 3, True), (2, 3, False), (3, 2, False), (0, 9, False), (9, 0, False), (9, 3, True)]
)
def test_a_speed_needs_three_readings_in_each_second(new: int, old: int, is_known: bool) -> None:
    motion = Motion()
    for t_s in (*(0.1 * k for k in range(old)), *(1.0 + 0.1 * k for k in range(new))):
        motion.add(Reading(NOW + t_s, 10.0, 20.0 + t_s, True))
    assert (motion.speed_deg_s(NOW + 1.95) is not None) == is_known


def test_seconds_end_with_their_beginning() -> None:
    motion = Motion()
    for t_s in (0.0, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0):
        motion.add(Reading(NOW + t_s, 10.0, 20.0 if t_s <= 1.0 else 30.0, True))
    # at 2.0: 1.0 is a second old and of the older half, 0.0 is two seconds old and of none
    middle_old, middle_new = np.mean([0.5, 0.75, 1.0]), np.mean([1.25, 1.5, 1.75, 2.0])
    assert motion.speed_deg_s(NOW + 2.0) == pytest.approx(10.0 / (middle_new - middle_old))
    assert motion.speed_deg_s(NOW + 3.0) is None
    assert Motion().speed_deg_s(NOW) is None


def test_a_reading_that_is_two_seconds_old_is_of_no_half() -> None:
    speeds = []
    for el_deg in (20.0, 80.0):
        motion = Motion()
        for k in range(1, 9):
            motion.add(Reading(NOW + 0.25 * k, 10.0, el_deg if k == 1 else 20.0 + 0.25 * k, True))
        speeds.append(motion.speed_deg_s(NOW + 2.25))
    assert speeds == [pytest.approx(1.0), pytest.approx(1.0)]


def test_two_seconds_of_readings_are_held_and_no_more() -> None:
    motion = Motion()
    for k in range(100):
        motion.add(Reading(NOW + 0.25 * k, 10.0, 20.0, True))
    assert [NOW + 0.25 * 99 - one.tai_s for one in motion._readings] == [0.25 * k for k in range(7, -1, -1)]


# The line


class Line:
    """A port with its counts, looked at once a second."""

    def __init__(self) -> None:
        self.port: Any = SimpleNamespace(
            is_up=True, failed_exchange_count=0, garbled_count=0, discarded_count=0, late_count=0, lateness="by 0.2 s"
        )
        self.area: Any = SimpleNamespace(state=SimpleNamespace(plausibility=SimpleNamespace(doubted_count=0)))
        self.watch = LineWatch(self.port, self.area)

    def look(self, times: int = 1, **counts: int) -> str:
        for name, count in counts.items():
            setattr(self.port, name, count)
        for _ in range(times):
            self.watch.look()
        return self.watch.alarm


@pytest.mark.parametrize("name", ["failed_exchange_count", "garbled_count", "discarded_count", "doubted"])
def test_three_bad_replies_of_any_kind_are_an_alarm_and_two_are_none(name: str) -> None:
    line = Line()

    def bad(count: int) -> str:
        if name == "doubted":
            line.area.state.plausibility.doubted_count = count
            return line.look()
        return line.look(**{name: count})

    assert [bad(count) for count in (9, 11)] == ["", ""]
    with capture_logs() as logs:
        assert bad(12) == "3 bad replies in 5 s: look at the line"
    key = {"failed_exchange_count": "failed", "garbled_count": "garbled", "discarded_count": "late"}.get(name, name)
    [log] = logs
    assert (log["event"], log["bad"], log["in_s"], log[key]) == ("link.poor", 3, 5, 12)
    assert sum(log[kind] for kind in ("failed", "garbled", "late", "doubted")) == 12


def test_bad_replies_of_several_kinds_are_added() -> None:
    line = Line()
    line.look()
    assert line.look(failed_exchange_count=1, garbled_count=1, discarded_count=1).startswith("3 bad")


def test_what_was_bad_more_than_five_seconds_ago_is_forgotten() -> None:
    line = Line()
    line.look(garbled_count=0)
    line.look(garbled_count=2)
    line.look(4)
    assert line.look(garbled_count=3) == ""  # the two are six seconds old
    line = Line()
    line.look(garbled_count=0)
    line.look(garbled_count=2)
    line.look(3)
    assert line.look(garbled_count=3) == "3 bad replies in 5 s: look at the line"


def test_an_alarm_tells_of_late_replies_where_there_were_new_ones_since_the_line_was_good() -> None:
    line = Line()
    line.look(late_count=4)
    assert line.look(garbled_count=3) == "3 bad replies in 5 s: look at the line"
    line.look(6)
    line.look(late_count=5)
    assert line.look(garbled_count=6, late_count=5) == "3 bad replies in 5 s: look at the line"
    assert line.look(late_count=6) == "3 bad replies in 5 s, late ones by 0.2 s: look at the line"


def test_the_end_of_a_bad_line_is_told_and_a_lost_link_is_not_that_end() -> None:
    line = Line()
    with capture_logs() as logs:
        line.look()
        line.look(2, garbled_count=3)
        line.look(6)
        line.look(garbled_count=9)
        line.look(is_up=False)
    assert [one["event"] for one in logs] == ["link.poor", "link.good", "link.poor"]
    assert line.watch.alarm == ""


# Before a keep-out

ENVELOPE = Envelope(
    AxisLimits(-270.0, 270.0, 20.0, 10.0),
    AxisLimits(0.0, 90.0, 5.0, 5.0),
    keep_outs=(KeepOut("the mast", 100.0, 140.0, 0.0, 50.0),),
)


def standing(mode: AcuMode, az_deg: float = 120.0, **memory: Any) -> ControlState:
    return remembering(status=AcuStatus(az_deg % 360.0, 30.0, mode), az_deg=az_deg, **memory)


@pytest.mark.parametrize(
    ("mode", "memory", "why"),
    [
        (AcuMode.REMOTE, {"problem": "azimuth stands", "by_people": False, "is_stop_due": True}, "an axis is latched"),
        (AcuMode.MANUAL, {"by_people": False, "is_stop_due": True}, "it is not armed"),
        (AcuMode.MANUAL, {"is_stop_due": True}, "a STOP is due"),
        (AcuMode.MANUAL, {}, "the ACU is in MANUAL"),
        (AcuMode.REMOTE, {}, ""),
    ],
)
def test_what_keeps_the_daemon_from_moving_it_is_told_the_hardest_first(
    mode: AcuMode, memory: dict[str, Any], why: str
) -> None:
    config = ControlConfig(ENVELOPE)
    assert why_not_moved(standing(mode, **memory), config) == why
    alarm = look_around(standing(mode, **memory), NOW, config).alarm
    said = f"the antenna is within the keep-out of the mast, and the daemon does not move it: {why}"
    assert alarm == (said if why else "")
    assert look_around(standing(mode, 160.0, **memory), NOW, config).alarm == ""
    assert look_around(standing(mode, 160.0 - 360.0, **memory), NOW, config).alarm == ""
    assert look_around(standing(mode, 120.0 - 360.0, **memory), NOW, config).alarm == (said if why else "")


def test_without_a_status_or_a_zone_there_is_nothing_to_say() -> None:
    assert look_around(ControlState(), NOW, ControlConfig(ENVELOPE)) == EnvelopeSeen()
    bare = ControlConfig(replace(ENVELOPE, keep_outs=()))
    assert look_around(standing(AcuMode.MANUAL), NOW, bare) == EnvelopeSeen()
    assert why_not_moved(ControlState(), bare) == "nothing is known of it"


# Drawn


@pytest.mark.parametrize(("rate", "heading_deg"), [((0.5, 0.0), 90.0), ((-0.5, 0.0), -90.0), ((0.0, -0.5), 180.0)])
def test_a_heading_is_up_at_zero_and_right_at_ninety(rate: tuple[float, float], heading_deg: float) -> None:
    t = np.zeros(910)
    moved = replace(path(), az_rate_deg_s=t + rate[0], el_rate_deg_s=t + rate[1])
    found = take_aim(ControlState(), Sky(prediction=moved), NOW, ControlConfig(ENVELOPE)).heading_deg
    assert abs(found or 0.0) == pytest.approx(abs(heading_deg))
    assert (found or 0.0) * heading_deg > 0.0


@pytest.mark.parametrize(("after_s", "k"), [(0.0, 0), (0.04, 0), (0.06, 1), (1.0, 10), (2.04, 20), (90.0, 900)])
def test_a_sigma_is_of_the_nearest_point_of_the_path(after_s: float, k: int) -> None:
    buffer = path()
    buffer = replace(buffer, sigma_deg=0.1 + 0.001 * np.arange(buffer.az_deg.size), spread=None)
    aim = take_aim(ControlState(), Sky(prediction=buffer), buffer.start_tai_s + after_s, ControlConfig(ENVELOPE))
    assert aim.spread_deg == pytest.approx((3.0 * (0.1 + 0.001 * k),) * 2)


def crossing(at: float) -> ZenithCrossing:
    return ZenithCrossing(at, at + 9.0, 0.0, 0.0, 9.0, 0.6, 4.5, None)


def test_the_way_past_the_zenith_is_the_predictions_before_the_plans() -> None:
    plan = PassPlan(NOW, NOW + 9.0, 0.0, 3.0, 4.0, crossing=crossing(100.0))
    config = ControlConfig(ENVELOPE)
    ahead = take_ahead(
        ControlState(), Sky(prediction=replace(path(), crossing=crossing(200.0)), plan=plan), NOW, config
    )
    assert ahead.crossing_tai_s == (crossing(200.0).departure_tai_s, crossing(200.0).return_tai_s)
    ahead = take_ahead(ControlState(), Sky(prediction=path(), plan=plan), NOW, config)
    assert ahead.crossing_tai_s == (crossing(100.0).departure_tai_s, crossing(100.0).return_tai_s)
    assert take_ahead(ControlState(), Sky(prediction=path()), NOW, config).crossing_tai_s is None


def test_before_its_beginning_the_whole_path_is_ahead_and_after_its_end_nothing() -> None:
    buffer, config = path(), ControlConfig(ENVELOPE)
    whole = take_ahead(ControlState(), Sky(prediction=buffer), buffer.start_tai_s - 60.0, config).ahead
    assert whole[0] == pytest.approx((buffer.az_deg[0], buffer.el_deg[0]), abs=0.006)
    assert take_ahead(ControlState(), Sky(prediction=buffer), buffer.start_tai_s + 1e5, config).ahead == ()
    assert TRACK_COUNT == 90


def test_a_keyhole_is_below_the_zenith_by_the_greatest_speed_of_the_pass() -> None:
    config = ControlConfig(ENVELOPE)
    for step_deg in (0.5, -0.5):
        track = tuple((t_s, (359.9 + step_deg * k) % 360.0, 0.0) for k, t_s in enumerate((0.0, 1.0, 3.0)))
        assert take_backdrop(config, None, track).keyhole_el_deg == pytest.approx(
            np.degrees(np.arccos(0.5 / 20.0)), abs=0.06
        )
    fast = ((0.0, 10.0, 0.0), (1.0, 60.0, 0.0))
    assert take_backdrop(config, None, fast).keyhole_el_deg == 0.0
    up = ((0.0, 10.0, 0.0), (2.0, 10.0, 4.0))
    assert take_backdrop(config, None, up).keyhole_el_deg == pytest.approx(np.degrees(np.arccos(2.0 / 20.0)), abs=0.06)
    assert take_backdrop(config, None, fast[:1]).keyhole_el_deg is None
