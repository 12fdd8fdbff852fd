"""Every figure that people and programs are told, each with a value of its own: none stands in another's place."""

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from memories import remembering
from test_live_line import SEEN
from test_metrics import values

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuIdentity, AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.receiver_signal import ReceiverSignal, SignalRules
from acu_daemon.control.state import Lag, Nudge
from acu_daemon.control.tick_input import PassPlan, Sky, SlaveWish, StowBy
from acu_daemon.control.tracking.lag import LagEstimate
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.snapshot import Snapshot, StationFacts, Subject
from acu_daemon.daemon.taking import take_snapshot
from acu_daemon.daemon.tally import REJECTIONS, TRAVEL_STEP_DEG, RunFigures, Tally
from acu_daemon.model import AxisLimits, Correction, FitResult, Model, Pass, Prediction, Reading
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.outlets.metric_families import LINK_ERRORS, Surroundings
from acu_daemon.outlets.metrics_server import render
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope

NOW, UNIX_S = 8.4e8, 1.8e9
COUNTED = ("readings", "commands", "writes")  # without a label


def numbered() -> Snapshot:
    """The snapshot with another number in each field that has one."""
    given: dict[str, Any] = {
        one.name: 1000 + k if one.type is int else 0.25 + k
        for k, one in enumerate(fields(Snapshot))
        if one.type in (int, float, float | None)
    }
    given |= {"acu_mode": "REMOTE", "signal_db": None, "is_acquired": False}
    return replace(SEEN, **given)


def test_every_metric_is_its_own_figure() -> None:
    seen, tally = replace(numbered(), stow_by="wind", arming="disarmed", satellite="SAT"), Tally()
    figures = RunFigures(
        connect_count=21,
        fit_count=22,
        fit_failed_count=23,
        permit_refusal_count=24,
        link_errors={reason: 31 + k for k, reason in enumerate(LINK_ERRORS)},
        elements_epoch_tai_s=seen.tai_s - 41.0,
        next_rise_tai_s=seen.tai_s + 42.0,
        beamwidth_deg=1.43,
        clock_error_s=0.44,
        sky_rate_deg_s=0.45,
        is_clock_synchronised=True,
    )
    seen = replace(seen, rejected_counts={reason: 51 + k for k, reason in enumerate(REJECTIONS)})
    for k, name in enumerate(COUNTED):
        tally.count(name, by=61 + k)
    tally.see(seen, figures)
    for k, bucket in enumerate((tally.lateness, tally.round_trip, tally.relock)):
        bucket.add(0.001 * (1 + k))
    tally.wrote(seen.tai_s - 71.0)
    tally.seconds.update(visible=72, on_target=73)
    tally.travel_deg.update(azimuth=74, elevation=75)
    found = values(render(tally, Surroundings("page", (8.1, 12.1), (11.3, 16.3), 81), UNIX_S))
    one: Any = seen
    expected = {
        "acu_readings_total": 61.0,
        "acu_commands_total": 62.0,
        "acu_writes_total": 64.0,
        "acu_ticks_total": one.tick_count,
        "acu_ticks_skipped_total": one.skipped_tick_count,
        "acu_fits_total": 22.0,
        "acu_fits_failed_total": 23.0,
        "acu_link_reconnects_total": 20.0,
        **{f'acu_link_errors_total{{reason="{reason}"}}': 31.0 + k for k, reason in enumerate(LINK_ERRORS)},
        **{f'acu_readings_rejected_total{{reason="{r}"}}': 51.0 + k for k, r in enumerate(REJECTIONS.values())},
        'acu_commands_refused_total{reason="not_finite"}': one.refusal_count - 24.0,
        "acu_pass_visible_seconds_total": 72.0,
        "acu_pass_on_target_seconds_total": 73.0,
        'acu_axis_travel_degrees_total{axis="azimuth"}': 74.0,
        'acu_axis_travel_degrees_total{axis="elevation"}': 75.0,
        'acu_lease_held{via="page"}': 1.0,
        'acu_lease_held{via="rotctl"}': 0.0,
        'acu_wind_speed_meters_per_second{window="mean"}': 8.1,
        'acu_wind_speed_meters_per_second{window="gust"}': 12.1,
        'acu_wind_limit_meters_per_second{window="mean"}': 11.3,
        'acu_wind_limit_meters_per_second{window="gust"}': 16.3,
        "acu_disk_free_bytes": 81.0,
        'acu_run_mode{acu_run_mode="disarmed"}': 1.0,
        'acu_run_mode{acu_run_mode="armed"}': 0.0,
        "acu_reading_timestamp_seconds": UNIX_S - one.reading_age_s,
        "acu_write_timestamp_seconds": UNIX_S - 71.0,
        "acu_sky_rate_degrees_per_second": 0.45,
        "acu_clock_error_seconds": 0.44,
        "acu_clock_synchronized": 1.0,
        'acu_elements_epoch_timestamp_seconds{satellite="SAT"}': UNIX_S - 41.0,
        "acu_sun_separation_degrees": one.sun_deg,
        **{f'acu_stow_wanted{{by="{by}"}}': float(by == "wind") for by in ("wind", "operator", "panel", "schedule")},
        'acu_axis_angle_degrees{axis="azimuth"}': one.az_deg,
        'acu_axis_angle_degrees{axis="elevation"}': one.el_deg,
        'acu_axis_command_degrees{axis="azimuth"}': one.command_az_deg,
        'acu_axis_command_degrees{axis="elevation"}': one.command_el_deg,
        'acu_axis_following_error_degrees{axis="azimuth"}': one.command_az_deg - one.az_deg,
        'acu_axis_following_error_degrees{axis="elevation"}': one.command_el_deg - one.el_deg,
        "acu_beam_error_degrees": one.off_path_deg,
        "acu_beamwidth_degrees": 1.43,
        "acu_signal_level_decibels": one.agc_db,
        "acu_signal_locked": 0.0,
        "acu_prediction_buffer_seconds": one.buffer_s,
        "acu_prediction_trust_seconds": one.inside_s,
        "acu_prediction_sigma_degrees": one.sigma_deg,
        "acu_fit_timestamp_seconds": UNIX_S - one.fit_age_s,
        "acu_correction_along_track_seconds": one.along_s,
        "acu_correction_cross_track_degrees": one.across_deg,
        "acu_pass_next_start_timestamp_seconds": UNIX_S + 42.0,
        "acu_tick_lateness_seconds_sum": 0.001,
        "acu_link_round_trip_seconds_sum": 0.002,
        "acu_relock_seconds_sum": 0.003,
    }
    assert {name: found.get(name) for name in expected} == pytest.approx(expected)


@pytest.mark.parametrize(
    ("latch", "azimuth", "elevation"),
    [("", 0, 0), ("azimuth stands", 1, 0), ("elevation runs away", 0, 1), ("the ACU does not stop", 1, 1)],
)
def test_a_latch_is_told_of_its_own_axis_or_of_both(latch: str, azimuth: int, elevation: int) -> None:
    tally = Tally()
    tally.see(replace(SEEN, latch=latch), RunFigures())
    found = values(render(tally, Surroundings(), UNIX_S))
    assert found['acu_axis_latched{axis="azimuth"}'] == azimuth
    assert found['acu_axis_latched{axis="elevation"}'] == elevation


@pytest.mark.parametrize(
    ("command_deg", "measured_deg", "error_deg"), [(725.0, 6.0, -1.0), (-2.0, 357.0, 1.0), (1.0, 359.0, 2.0)]
)
def test_a_following_error_is_the_same_on_every_turn(command_deg: float, measured_deg: float, error_deg: float) -> None:
    tally = Tally()
    seen = replace(numbered(), command_az_deg=command_deg, az_deg=measured_deg, acu_mode="REMOTE")
    tally.see(seen, RunFigures())
    found = values(render(tally, Surroundings(), NOW))
    assert found['acu_axis_following_error_degrees{axis="azimuth"}'] == pytest.approx(error_deg)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("from_deg", "to_deg"), [(10.0, 350.0), (350.0, 10.0), (100.0, 80.0), (80.0, 100.0)])
def test_the_way_of_an_azimuth_is_counted_over_north_and_to_both_sides(
    sign: float, from_deg: float, to_deg: float
) -> None:
    tally = Tally()
    for az_deg in (from_deg, to_deg):
        tally.see(replace(SEEN, az_deg=(sign * az_deg) % 360.0, el_deg=40.0 + 0.01 * az_deg), RunFigures())
    assert tally.travel_deg["azimuth"] == pytest.approx(20.0)
    assert tally.travel_deg["elevation"] == pytest.approx(0.01 * abs(to_deg - from_deg))


@pytest.mark.parametrize("step_deg", [0.03, -0.03, 0.2, -0.2])
def test_a_way_is_counted_however_slow_the_axis_is(step_deg: float) -> None:
    tally = Tally()
    for k in range(101):
        tally.see(replace(SEEN, az_deg=(1.0 + step_deg * k) % 360.0, el_deg=40.0 + step_deg * k), RunFigures())
    for axis in ("azimuth", "elevation"):
        assert tally.travel_deg[axis] == pytest.approx(100.0 * abs(step_deg), abs=TRAVEL_STEP_DEG)


# What a snapshot is made of

CONFIG = ControlConfig(
    Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)),
    beamwidth_deg=1.5,
    receiver=SignalRules(6.0, 4.0, 5.0),
)


def test_every_figure_of_a_snapshot_is_its_own() -> None:
    t = np.zeros(100)
    prediction = Prediction(
        NOW - 10.0, 1.0, *(300.5 + t, 41.5 + t, t, t, 300.5 + t, t), kind="FITTED", made_at_tai_s=NOW,
        sigma_deg=0.001 * np.arange(100.0), model=Model.NEW_FIT,
    )  # fmt: skip
    fit = FitResult("full", Correction(), NOW - 2.5, 9, 1, 0.1, 7.25, 0.375)
    coming = Pass(NOW - 60.0, NOW + 70.0, NOW + 200.0, 301.0, 71.5, 72.5, 73.5)
    state = remembering(
        track=TrackState.AUTOTRACK_FITTED,
        entered_tai_s=NOW - 33.0,
        status=AcuStatus(300.0, 41.0, AcuMode.AUTOTRACK, agc_db=12.5, is_acquired=True),
        reading=Reading(NOW - 0.5, 300.0, 41.0, True),
        az_deg=-60.0,
        axis_az=AxisState(-61.0, 0.1),
        axis_el=AxisState(42.0, 0.2),
        refusal_count=11,
        clamped_count=12,
        limited_count=13,
        limited="azimuth at its limit",
        problem="an axis",
        by_people=False,
        disarmed_by="ann",
        is_stop_due=True,
        stow_by=StowBy.WIND,
        is_held=True,
        nudge=Nudge(1.25, 0.5),
        wish=SlaveWish(10.0, 20.0, 5.0, "gpredict"),
        until_tai_s=NOW + 4.5,
        receiver=ReceiverSignal(NOW - 1.5, 8.75, False, NOW - 21.0),
        has_acquired=True,
        lag=Lag(LagEstimate(), LagEstimate()),
    )
    foreground = SimpleNamespace(
        identity=AcuIdentity("ACU", True, True),
        lateness=SimpleNamespace(figures=lambda _: SimpleNamespace(p50_ms=0.51, p99_ms=0.99, max_ms=1.01)),
        **{
            name: 101 + k
            for k, name in enumerate(("tick_count", "skipped_tick_count", "write_count", "answered_count"))
        },
        clock_watch=SimpleNamespace(alarm="the clock"),
        line_watch=SimpleNamespace(alarm="the line"),
        motion=SimpleNamespace(speed_deg_s=lambda tai_s: 0.75 if tai_s == NOW else None),
        acu_faults="door",
        stop_times=SimpleNamespace(sent_tai_s=NOW - 5.0, confirmed_tai_s=NOW - 4.0),
    )
    area = SimpleNamespace(
        state=state,
        sky=Sky(prediction, fit, PassPlan(NOW - 60.0, NOW + 200.0, NOW - 60.0, 300.0, 5.0)),
        model=Model.NEW_FIT,
        gate=SimpleNamespace(rejecting="outlier"),
        rejected_counts={"outlier": 3},
    )
    port = SimpleNamespace(attempt_count=111, is_up=True, problem="was down")
    subject = Subject("SAT", "here", "tcp", coming, "TLE of", "stale", ("next",), StationFacts("calm", "flown", "noon"))
    made: Any = take_snapshot(
        *(area, foreground, port, CONFIG, NOW, subject),
        is_rehearsal=True,
        files_alarm="disk",
    )
    expected = {
        "tai_s": NOW,
        "state": "AUTOTRACK/FITTED",
        "az_deg": 300.0,
        "el_deg": 41.0,
        "reading_age_s": 0.5,
        "command_az_deg": -61.0,
        "command_el_deg": 42.0,
        "agc_db": 12.5,
        "is_acquired": True,
        "along_s": 7.25,
        "across_deg": 0.375,
        "fit_age_s": 2.5,
        "sigma_deg": 0.01,
        "buffer_s": 89.0,
        "buffer_kind": "FITTED",
        "tick_count": 101,
        "skipped_tick_count": 102,
        "write_count": 103,
        "answered_count": 104,
        "attempt_count": 111,
        "refusal_count": 11,
        "clamped_count": 12,
        "limited_count": 13,
        "limit_alarm": "azimuth at its limit",
        "lateness_p50_ms": 0.51,
        "lateness_p99_ms": 0.99,
        "lateness_max_ms": 1.01,
        "arming": "disarmed",
        "disarmed_by": "ann",
        "stow_by": "wind",
        "is_held_by_person": True,
        "nudge_along_s": 1.25,
        "nudge_across_deg": 0.5,
        "clock_alarm": "the clock",
        "line_alarm": "the line",
        "files_alarm": "disk",
        "is_link_up": True,
        "link_problem": "was down",
        "is_rehearsal": True,
        "is_simulation": True,
        "model": str(Model.NEW_FIT),
        "rejecting": "outlier",
        "rejected_counts": {"outlier": 3},
        "slaved_by": "gpredict",
        "slaved_s": 4.5,
        "signal_db": 8.75,
        "signal_age_s": 1.5,
        "signal_lost_s": 21.0,
        "signal_alarm": "",
        "satellite": "SAT",
        "station": "here",
        "acu": "tcp",
        "elements": "TLE of",
        "elements_problem": "stale",
        "next_passes": ("next",),
        "wind": "calm",
        "phantom": "flown",
        "paused_until_utc": "noon",
        "state_s": 33.0,
        "half_beam_deg": 0.75,
        "speed_deg_s": 0.75,
        "acu_mode": "AUTOTRACK",
        "acu_faults": "",
        "is_stopping": True,
        "rise_in_s": -60.0,
        "set_in_s": 207.25,
        "culmination_deg": 71.5,
        "utc": utc_text(NOW, 1),
        "rise_utc": utc_text(NOW - 60.0, 0),
        "set_utc": utc_text(NOW + 207.25, 0),
        "stop_sent_utc": utc_text(NOW - 5.0),
        "stop_confirmed_utc": utc_text(NOW - 4.0),
        "miss_deg": pytest.approx(0.626, abs=2e-3),
        "off_path_deg": pytest.approx(0.626, abs=2e-3),
    }
    assert {name: getattr(made, name) for name in expected} == expected
    assert made.is_on_path
