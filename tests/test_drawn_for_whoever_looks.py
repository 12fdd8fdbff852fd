"""What is drawn and counted for whoever looks: commands beside the path, a whole pass, metrics that have no value."""

from dataclasses import replace
from math import inf, nan
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from matplotlib.figure import Figure
from memories import remembering
from test_every_figure import UNIX_S, numbered
from test_every_figure_of_a_report import COMING, TARGET
from test_keep_clear import BY_SUN, MORNING, SUN, SUN_AZ, SUN_EL
from test_live_line import SEEN
from test_metrics import values
from test_tick import AZ_DEG, AZ_RATE, CONFIG, EL_DEG, EL_RATE, NOW, SKY, path

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.cli.run_setup import make_job
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState, Scan, Search
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.with_parts import with_parts
from acu_daemon.daemon.drawing import OWN_DEG, ROW_COUNT, ROW_POINTS, TRACK_COUNT, take_ahead, take_aim, take_track
from acu_daemon.daemon.envelope_watch import look_around
from acu_daemon.daemon.tally import RunFigures, Tally
from acu_daemon.model import AxisLimits, Model, Reading
from acu_daemon.outlets.metric_families import Surroundings
from acu_daemon.outlets.metrics_server import render
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.report import sky_plot
from acu_daemon.report.sky_plot import SkyTrack, plot_sky

COS = np.cos(np.radians(EL_DEG))

# Aim


@pytest.mark.parametrize(("right_deg", "up_deg"), [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.25), (0.0, -0.25)])
@pytest.mark.parametrize("turn_deg", [0.0, 360.0, -360.0])
def test_a_command_is_beside_the_path_of_the_time_at_which_it_takes_effect(
    right_deg: float, up_deg: float, turn_deg: float
) -> None:
    config = replace(CONFIG, effect_delay_s=0.5)
    at_s = 2.0 + 0.5
    there = EL_DEG + EL_RATE * at_s
    written = NOW + 2.0, AZ_DEG + AZ_RATE * at_s + right_deg + turn_deg, there + up_deg
    aim = take_aim(remembering(in_force=written), SKY, NOW + 3.0, config)
    assert aim.command_beside_deg == pytest.approx((right_deg * np.cos(np.radians(there)), up_deg), abs=1e-6)
    assert aim.written_age_s == pytest.approx(1.0)
    assert take_aim(remembering(in_force=written), Sky(), NOW + 3.0, config).command_beside_deg is None


def test_what_is_drawn_is_beside_the_path_itself_and_not_beside_a_way_that_follows() -> None:
    followed = replace(path(), follow_az_deg=path().az_deg + 30.0, follow_el_deg=path().el_deg + 20.0)
    followed = replace(followed, follow_el_rate_deg_s=path().el_rate_deg_s)
    written, reading = (NOW - CONFIG.effect_delay_s, AZ_DEG + 1.0, EL_DEG), Reading(NOW, AZ_DEG, EL_DEG, True)
    state = remembering(in_force=written, reading=reading)
    aim = take_aim(state, Sky(prediction=followed), NOW, CONFIG)
    assert aim.path_deg == pytest.approx((AZ_DEG, EL_DEG))
    assert aim.beside_deg == pytest.approx((0.0, 0.0), abs=1e-9)
    assert aim.command_beside_deg == pytest.approx((COS, 0.0))
    without = take_aim(state, Sky(), NOW, CONFIG)
    assert (without.path_deg, without.beside_deg, without.command_beside_deg) == (None, None, None)
    unread = take_aim(remembering(in_force=written), Sky(prediction=followed), NOW, CONFIG)
    assert (unread.beside_deg, unread.command_beside_deg) == (None, pytest.approx((COS, 0.0)))


def test_of_many_searched_rows_those_nearest_to_the_path_are_drawn() -> None:
    rows = tuple((row, (-2.0, 2.0)) for row in range(-8, 9))
    state = with_parts(remembering(track=TrackState.SEARCH), search=Search(Scan(model=Model.ELEMENTS, rows=rows)))
    found = take_ahead(state, SKY, NOW + 10.0, CONFIG).searched
    assert (len(found), {len(line) for line in found}) == (ROW_COUNT, {ROW_POINTS})
    assert ROW_COUNT == ROW_POINTS == 9
    middles = sorted(round(float(np.hypot(*line[4])) / (0.7 * CONFIG.beamwidth_deg), 1) for line in found)
    assert middles == [0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    assert take_ahead(state, Sky(), NOW + 10.0, CONFIG).searched == ()
    assert take_ahead(state, SKY, NOW + 1e6, CONFIG).searched == ()
    assert take_ahead(ControlState(), SKY, NOW + 10.0, CONFIG).searched == ()


# The whole pass

NO_LINE: Any = type("Line", (), {"byte_time_s": 0.0})()
SETUP = make_job(TARGET, COMING, NO_LINE, is_rehearsal=True).refit


def test_a_track_is_the_pass_from_rise_to_set_by_its_elements() -> None:
    track = take_track(SETUP, COMING)
    assert len(track) == TRACK_COUNT
    assert (track[0][0], track[-1][0]) == (COMING.rise_tai_s, COMING.set_tai_s)
    highest = max(track, key=lambda one: one[2])
    assert highest[2] == pytest.approx(COMING.culmination_el_deg, abs=OWN_DEG)
    assert abs(highest[0] - COMING.culmination_tai_s) <= (COMING.set_tai_s - COMING.rise_tai_s) / (TRACK_COUNT - 1)
    assert all(round(one, 2) == one for point in track for one in point[1:])
    assert take_track(SETUP, None) == ()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("off_deg", "is_own"), [(1.49, True), (1.51, False)])
def test_a_track_of_another_satellite_is_not_drawn(sign: float, off_deg: float, is_own: bool) -> None:
    highest_deg = max(one[2] for one in take_track(SETUP, COMING))
    other = replace(COMING, culmination_el_deg=highest_deg + sign * off_deg)
    assert bool(take_track(SETUP, other)) == is_own


# Metrics

NOTHING = RunFigures()


def found(figures: RunFigures = NOTHING, **changes: Any) -> dict[str, float]:
    tally = Tally()
    tally.see(replace(numbered(), satellite="SAT", **changes), figures)
    return values(render(tally, Surroundings(), UNIX_S))


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("reading_age_s", "acu_reading_timestamp_seconds"),
        ("sun_deg", "acu_sun_separation_degrees"),
        ("az_deg", 'acu_axis_angle_degrees{axis="azimuth"}'),
        ("el_deg", 'acu_axis_angle_degrees{axis="elevation"}'),
        ("az_deg", 'acu_axis_following_error_degrees{axis="azimuth"}'),
        ("command_el_deg", 'acu_axis_following_error_degrees{axis="elevation"}'),
        ("command_az_deg", 'acu_axis_command_degrees{axis="azimuth"}'),
        ("off_path_deg", "acu_beam_error_degrees"),
        ("agc_db", "acu_signal_level_decibels"),
        ("inside_s", "acu_prediction_trust_seconds"),
        ("sigma_deg", "acu_prediction_sigma_degrees"),
        ("fit_age_s", "acu_fit_timestamp_seconds"),
        ("along_s", "acu_correction_along_track_seconds"),
        ("across_deg", "acu_correction_cross_track_degrees"),
    ],
)
def test_what_is_not_known_has_no_sample_and_leaves_all_others(key: str, name: str) -> None:
    known = found()
    assert name in known
    assert name not in found(**{key: None})


@pytest.mark.parametrize("value", [inf, -inf, nan])
def test_what_is_not_finite_has_no_sample(value: float) -> None:
    assert "acu_beam_error_degrees" not in found(off_path_deg=value)


@pytest.mark.parametrize(
    ("mode", "is_told"),
    [("REMOTE", True), ("REMOTE_BACKUP", True), ("AUTOTRACK", False), ("STANDBY", False), ("", False)],
)
def test_a_following_error_is_of_an_antenna_that_follows(mode: str, is_told: bool) -> None:
    made = found(acu_mode=mode)
    for axis in ("azimuth", "elevation"):
        assert (f'acu_axis_following_error_degrees{{axis="{axis}"}}' in made) == is_told


def test_a_level_is_the_receivers_before_the_acus_also_at_zero() -> None:
    assert found(signal_db=0.0, agc_db=5.0)["acu_signal_level_decibels"] == 0.0
    assert found(signal_db=None, agc_db=5.0)["acu_signal_level_decibels"] == 5.0


def test_elements_have_an_age_where_there_is_a_satellite_and_a_run_what_it_knows() -> None:
    epoch = 'acu_elements_epoch_timestamp_seconds{satellite="SAT"}'
    known = RunFigures(elements_epoch_tai_s=numbered().tai_s + 5.0, is_clock_synchronised=False)
    assert found(known)[epoch] == UNIX_S + 5.0
    assert found(known)["acu_clock_synchronized"] == 0.0
    assert epoch not in found()
    assert "acu_clock_synchronized" not in found()
    assert "acu_pass_next_start_timestamp_seconds" not in found()
    assert "acu_write_timestamp_seconds" not in found()
    assert not [name for name in found() if "wind" in name and "stow" not in name]


@pytest.mark.parametrize(("connects", "reconnects"), [(0, 0.0), (1, 0.0), (2, 1.0), (5, 4.0)])
def test_the_first_connection_is_no_reconnect(connects: int, reconnects: float) -> None:
    assert found(RunFigures(connect_count=connects))["acu_link_reconnects_total"] == reconnects


def test_a_rehearsal_and_a_simulation_are_told_beside_the_arming() -> None:
    for key, name in (("is_rehearsal", "rehearsal"), ("is_simulation", "simulation")):
        for is_so in (False, True):
            made = found(**{key: is_so, "arming": "shadow"})
            assert made[f'acu_run_mode{{acu_run_mode="{name}"}}'] == float(is_so)
            assert made['acu_run_mode{acu_run_mode="shadow"}'] == 1.0
            assert made['acu_run_mode{acu_run_mode="armed"}'] == 0.0


def test_before_the_first_snapshot_only_the_process_is_told() -> None:
    made = values(render(Tally(), Surroundings(), UNIX_S))
    assert "acu_ticks_total" in made
    assert "acu_link_up" not in made
    assert SEEN.is_link_up


# The sun


class Kept(Figure):
    """A figure that is looked at and written nowhere."""

    newest: ClassVar["Kept"]

    def savefig(self, fname: Any, **kwargs: Any) -> None:
        Kept.newest = self


def test_the_angle_to_the_sun_is_shown_where_anybody_cares_and_its_coming_where_it_is_avoided() -> None:
    state = remembering(status=AcuStatus(SUN_AZ % 360.0, SUN_EL - 10.0, AcuMode.REMOTE), az_deg=SUN_AZ)
    for policy, is_foreseen in (("avoid", True), ("warn", False)):
        sun = replace(SUN, policy=policy)
        for zones in ((), (KeepOut("mast", 10.0, 20.0, -90.0, -80.0),)):
            config = ControlConfig(replace(BY_SUN, keep_outs=zones, sun=sun))
            seen = look_around(state, MORNING, config)
            assert seen.sun_deg == pytest.approx(10.0, abs=0.05)
            assert is_foreseen or seen.sun_reach_s is None
    inside = remembering(state, status=AcuStatus(SUN_AZ % 360.0, SUN_EL - 1.0, AcuMode.REMOTE))
    avoiding = look_around(inside, MORNING, ControlConfig(BY_SUN))
    assert avoiding.sun_reach_s == 0.0
    assert avoiding.way_out is not None
    warned = look_around(inside, MORNING, ControlConfig(replace(BY_SUN, sun=replace(SUN, policy="warn"))))
    assert (warned.sun_reach_s, warned.way_out, warned.alarm) == (None, None, "")
    bare = ControlConfig(replace(BY_SUN, sun=None, keep_outs=(KeepOut("mast", 10.0, 20.0),)))
    assert look_around(inside, MORNING, bare).sun_deg is None


def test_an_alarm_of_the_sun_comes_in_the_time_that_people_need_and_tells_the_way_out() -> None:
    envelope = replace(BY_SUN, elevation=AxisLimits(0.0, 90.0, 5.0, 5.0))
    az_deg, el_deg = SUN.direction_deg(MORNING + 3000.0)
    state = remembering(status=AcuStatus(az_deg % 360.0, el_deg, AcuMode.REMOTE), az_deg=az_deg, by_people=False)
    reach_s = look_around(state, MORNING, ControlConfig(envelope)).sun_reach_s
    assert reach_s is not None
    assert 700.0 < reach_s < 3000.0
    for response_time_s, is_told in ((reach_s - 1.0, False), (reach_s, True), (reach_s + 1.0, True)):
        seen = look_around(state, MORNING, ControlConfig(envelope, response_time_s=response_time_s))
        assert (seen.way_out is not None) == is_told
        said = f"the sun reaches its keep-out in {reach_s:.0f} s, and the daemon does not move it: it is not armed; "
        way = f"the way out is az {seen.way_out[0]:.1f} el {seen.way_out[1]:.1f}" if seen.way_out else ""
        assert seen.alarm == (f"{said}{way}" if is_told else "")
    near = look_around(state, MORNING + reach_s - 599.0, ControlConfig(envelope, response_time_s=1.0))
    assert (near.way_out is not None, near.alarm) == (True, "")
    early = look_around(state, MORNING + reach_s - 603.0, ControlConfig(envelope, response_time_s=1.0))
    assert early.way_out is None
    inside = look_around(state, MORNING + 3000.0, ControlConfig(envelope))
    assert inside.alarm.startswith(
        "the antenna is within the sun's, and the daemon does not move it: it is not armed; "
    )
    shut = replace(
        envelope,
        azimuth=AxisLimits(az_deg - 1.0, az_deg + 1.0, 20.0, 10.0),
        elevation=AxisLimits(el_deg - 1.0, el_deg + 1.0, 5.0, 5.0),
    )
    assert look_around(state, MORNING + 3000.0, ControlConfig(shut)).alarm.endswith("; there is no way out")


def test_the_sun_is_drawn_where_it_is_in_the_middle_of_each_pass(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sky_plot, "Figure", Kept)
    tracks = []
    for k in range(2):
        times = MORNING + 3000.0 * k + np.array([-600.0, 0.0, 600.0])
        tracks.append(SkyTrack("AB"[k], times, np.array([0.0, 10.0, 20.0]), np.array([5.0, 50.0, 5.0])))
    plot_sky(tmp_path, BY_SUN, tracks, 5.0, "title")
    [axes] = Kept.newest.get_axes()
    assert len(axes.patches) == 2
    for k, disc in enumerate(axes.patches):
        edge = disc.get_xy()
        _, el_deg = SUN.direction_deg(MORNING + 3000.0 * k)
        assert 90.0 - (edge[:, 1].min() + edge[:, 1].max()) / 2.0 == pytest.approx(el_deg, abs=0.1)
        assert np.ptp(edge[:, 1]) == pytest.approx(10.0, abs=0.1)
    way = np.asarray(axes.get_lines()[0].get_ydata())
    assert 90.0 - way[0] == pytest.approx(SUN.direction_deg(MORNING - 600.0)[1])
    assert way.size == 4200 / 300 + 1
    assert axes.get_legend_handles_labels()[1].count(f"the sun in each pass, {SUN.radius_deg:g}° (avoid)") == 1
    plot_sky(tmp_path, BY_SUN, [], 5.0, "title")
    assert Kept.newest.get_axes()[0].patches[:] == []
