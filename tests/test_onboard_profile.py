"""Profiles end to end: every stage on the example pass, the file, the commands, and what is refused."""

import json
import re
from dataclasses import replace
from pathlib import Path

import made_oems
import numpy as np
import pytest
from command_line import Done, acu_daemon
from made_aems import kvn, quaternions
from made_element_sets import omm_text
from onboard_tasks import made_scenario, made_task

from acu_daemon.edge.onboard_files import load_pass
from acu_daemon.errors import ProfileError, UsageError
from acu_daemon.model import AxisLimits, Station
from acu_daemon.onboard import relief
from acu_daemon.onboard.bound import least_rate
from acu_daemon.onboard.branches import AZIMUTH_GUARD
from acu_daemon.onboard.checks import Backlash, check_profile
from acu_daemon.onboard.cone import Cone, Tube, azimuth_tube, windings
from acu_daemon.onboard.corrections import after_backlash, aimed, best_turn_deg, with_backlash
from acu_daemon.onboard.free import free_profile
from acu_daemon.onboard.gimbal_frames import angles_between_deg, beam_direction, lvlh_from_inertial
from acu_daemon.onboard.ground import footprint_east_north_m, track_east_north_m
from acu_daemon.onboard.parameter_file import read, write
from acu_daemon.onboard.pipeline import make
from acu_daemon.onboard.profile import RATE_GUARD, off_pointing, peak_rate_deg_s
from acu_daemon.onboard.quintic import Knots
from acu_daemon.onboard.recheck import check_certificate, check_peaks
from acu_daemon.onboard.relief import bound_at, least_interruption, least_margin_deg
from acu_daemon.onboard.scenarios import DAEJEON
from acu_daemon.orbit.frames import station_itrs_m, teme_from_itrs
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.report.onboard_text import header
from acu_daemon.units import DAY_S

EXAMPLE = Path(__file__).resolve().parents[1] / "config" / "onboard"
FILE_DEG = 1e-6


def onboard(*arguments: str | Path) -> Done:
    return acu_daemon("onboard", *arguments)


def pass_file(folder: Path, *changes: tuple[str, str]) -> Path:
    """The example with changes, each of which must be there to be made."""
    (folder / "kompsat-3-alike.tle").write_text((EXAMPLE / "kompsat-3-alike.tle").read_text())
    text = (EXAMPLE / "pass.toml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "pass.toml"
    path.write_text(text)
    return path


def test_the_example_pass_becomes_a_file_that_reads_back_the_same_and_holds_the_margin(tmp_path: Path) -> None:
    planned = load_pass(EXAMPLE / "pass.toml")
    task = planned.task()
    made = make(task, planned.station, "free", "peak", planned.file.antenna.play)
    assert made.is_met
    start = float(task.view.tai_s[0])
    text = write(start, made.profile, {"MARGIN_DEG": "2"}, made.second)
    found = read(text, "pass.tpf")
    assert found.start_tai_s == start
    assert found.end_s == pytest.approx(float(task.view.time_s[-1]))
    for ours, theirs in (
        (made.profile.azimuth, found.profile.azimuth),
        (made.profile.elevation, found.profile.elevation),
    ):
        times = np.linspace(0.0, found.end_s - 1e-3, 5001)
        assert theirs.value(times) == pytest.approx(ours.value(times), abs=FILE_DEG)
    assert found.profile.bound is not None
    assert found.profile.bound.rate_deg_s == pytest.approx(made.profile.bound.rate_deg_s)
    assert all(check.is_met for check in check_profile(task, found.profile, planned.file.antenna.play))


def test_the_command_writes_draws_and_checks(tmp_path: Path) -> None:
    path, out, picture = pass_file(tmp_path), tmp_path / "pass.tpf", tmp_path / "pass.png"
    made = onboard("profile", path, "--out", out, "--plot", picture)
    assert made.code == 0, made.err
    assert picture.stat().st_size > 50_000
    checked = onboard("check", out)
    assert checked.code == 0, checked.err + checked.out
    assert "certificate's bounds" in checked.out
    lines = out.read_text().splitlines()
    k = next(k for k, line in enumerate(lines) if line.startswith("AZ "))
    fields = lines[k].split()
    fields[4] = f"{float(fields[4]) + 0.01:+.9e}"
    out.write_text("\n".join([*lines[:k], " ".join(fields), *lines[k + 1 :]]))
    wrong = onboard("check", out)
    assert wrong.code == 1
    assert "azimuth joints" in wrong.err


def test_a_file_is_checked_against_the_margin_that_it_was_made_with(tmp_path: Path) -> None:
    path, out = pass_file(tmp_path), tmp_path / "pass.tpf"  # whose margin is 2 deg
    made = acu_daemon("onboard", "profile", path, "--margin-deg", "3", "--out", out)
    assert made.code == 0, made.err
    text = out.read_text()
    for margin, code in (("3", 0), ("2.5", 1)):
        out.write_text(re.sub(r"(MARGIN_DEG\s*=?\s*)3\S*", rf"\g<1>{margin}", text))
        assert f"{margin}" in next(line for line in out.read_text().splitlines() if "MARGIN_DEG" in line)
        assert acu_daemon("onboard", "check", out).code == code


def test_a_rate_limit_that_cannot_be_met_says_what_it_needs_and_that_suffices(tmp_path: Path) -> None:
    path = pass_file(tmp_path, ("max_deg = 270.0\nmax_rate_deg_s = 5.0", "max_deg = 270.0\nmax_rate_deg_s = 1.5"))
    with pytest.raises(ProfileError) as told:
        planned = load_pass(path)
        make(planned.task(), planned.station, "free", "peak", planned.file.antenna.play)
    found = re.match(
        r"limit 1.5 deg/s needs a margin of ([\d.]+) deg, or (\d+) s of interruption from", str(told.value)
    )
    assert found, str(told.value)
    planned = load_pass(path)
    made = make(planned.task(float(found[1])), planned.station, "free", "peak", planned.file.antenna.play)
    assert made.is_met
    assert onboard("profile", path).code == 1


def test_in_the_middle_of_a_target_the_body_points_at_it() -> None:
    planned = load_pass(EXAMPLE / "pass.toml")
    (row,) = planned.file.attitude.target
    at = np.array([row.start_utc + row.duration_s / 2.0])
    r_m, v_m_s = planned.propagator.states_teme(at)
    body = planned.attitude.body_from_lvlh(at, lvlh_from_inertial(r_m, v_m_s)) @ lvlh_from_inertial(r_m, v_m_s)
    place = station_itrs_m(Station("target", row.latitude_deg, row.longitude_deg, row.height_m))
    to_place = teme_from_itrs(place, at, planned.file.site.orientation) - r_m
    seen = (body @ to_place[..., None])[0, :, 0]
    assert seen / np.linalg.norm(seen) == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_a_strip_on_another_day_is_warned_of(tmp_path: Path) -> None:
    planned = load_pass(pass_file(tmp_path, ("2026-11-30T04:27:20Z", "2026-11-29T04:27:20Z")))
    assert ["the strip of 2026-11-29T04:27:20Z lies outside the pass" in one for one in planned.warnings] == [True]


@pytest.mark.parametrize(("from_s", "to_s", "warned"), [(-600.0, 600.0, 0), (60.0, 600.0, 1), (-600.0, -120.0, 1)])
def test_a_pass_that_the_ephemeris_cuts_is_warned_of(tmp_path: Path, from_s: float, to_s: float, warned: int) -> None:
    whole = load_pass(EXAMPLE / "pass.toml")
    tai_s = np.arange(whole.seen.rise_tai_s + from_s, whole.seen.set_tai_s + to_s, 30.0)
    (tmp_path / "a.oem").write_text(made_oems.kvn((tai_s, *whole.propagator.states_teme(tai_s))))
    planned = load_pass(pass_file(tmp_path, ('kind = "tle"', 'kind = "oem"'), ("kompsat-3-alike.tle", "a.oem")))
    told = [one for one in planned.warnings if "the pass is cut where the ephemeris ends" in one]
    assert len(told) == warned
    assert (planned.seen.duration_s < whole.seen.duration_s - 30.0) == bool(warned)


def test_a_pass_of_many_hours_is_refused(tmp_path: Path) -> None:
    ((low,), _) = parse_tle((EXAMPLE / "kompsat-3-alike.tle").read_text(), "made")
    (tmp_path / "high.json").write_text(omm_text([replace(low, mean_motion_rad_s=4.0 * np.pi / DAY_S)]))
    path = pass_file(tmp_path, ("kompsat-3-alike.tle", "high.json"), ('kind = "tle"', 'kind = "omm"'))
    path.write_text(path.read_text() + "[elements.limits]\nmax_semi_major_axis_km = 30000.0\n")
    with pytest.raises(UsageError, match="a profile is made for 2 h at the most"):
        load_pass(path)


@pytest.mark.parametrize("method", ["single", "three", "search", "free"])
def test_every_method_makes_a_file_that_its_check_accepts(tmp_path: Path, method: str) -> None:
    path, out = pass_file(tmp_path), tmp_path / "pass.tpf"
    planned = load_pass(path)
    task = planned.task()
    made = make(task, planned.station, method, "peak", planned.file.antenna.play)
    assert made.is_met
    out.write_text(write(float(task.view.tai_s[0]), made.profile, header(planned, task, made, "peak"), made.second))
    found = read(out.read_text(), str(out))
    assert all(one.is_met for one in [*check_peaks(found), *check_certificate(found, task)])


def test_a_beam_on_the_station_meets_the_ground_there_and_the_margin_around_it() -> None:
    task = made_task(12, 2.0)
    level = replace(DAEJEON, height_m=0.0)
    task = replace(task, station_itrs_m=station_itrs_m(level))
    track = track_east_north_m(task, task.station_gimbal(task.view), level)
    assert np.abs(track).max() < 1.0
    ranges_m = np.linalg.norm(task.view.vectors_m(task.station_itrs_m), axis=1)
    nearest = int(np.argmin(ranges_m))
    ring = np.linalg.norm(footprint_east_north_m(task, nearest, level), axis=1)
    assert ring.min() == pytest.approx(float(ranges_m[nearest]) * np.tan(np.radians(2.0)), rel=0.02)


def test_the_least_interruption_suffices_and_a_shorter_one_does_not() -> None:
    task = made_task(8, 1.0)
    view = task.view.plan
    station = task.station_gimbal(view)
    narrow = azimuth_tube(Cone(AZIMUTH_GUARD), view.time_s, station.az_deg, station.el_deg)
    limit = 0.7 * least_rate(narrow).rate_deg_s
    gap = least_interruption(task, limit)
    assert gap is not None

    def rate(trim_s: float) -> float:
        inside = (view.time_s > gap.start_s + trim_s + 1e-6) & (view.time_s < gap.end_s - trim_s - 1e-6)
        lower, upper = (
            np.where(inside, sign * np.inf, one) for sign, one in ((-1, narrow.lower_deg), (1, narrow.upper_deg))
        )
        return min(least_rate(one).rate_deg_s for one in windings(Tube(view.time_s, lower, upper), station.az_deg))

    assert rate(0.0) <= limit
    assert rate(1.0) > 0.99 * limit


def test_the_least_margin_lets_a_free_path_keep_to_the_rate() -> None:
    task = made_task(3, 1.0)
    margin_deg = least_margin_deg(task, 0.45)
    assert margin_deg is not None
    wanted = 0.45 * RATE_GUARD / relief._SPARE
    assert bound_at(task, AZIMUTH_GUARD * margin_deg) <= wanted < bound_at(task, AZIMUTH_GUARD * (margin_deg - 0.01))
    wider = replace(task, cone=Cone(margin_deg), azimuth=AxisLimits(-270.0, 270.0, 0.45, np.inf))
    assert free_profile(wider) is not None
    assert free_profile(replace(wider, cone=Cone(0.97 * margin_deg))) is None


def test_planned_imaging_first_the_azimuth_is_quiet_while_the_camera_works() -> None:
    task = made_task(2, 2.0)
    usual, quiet = free_profile(task), free_profile(task, "imaging", cap_deg_s=1.0)
    assert usual is not None
    assert quiet is not None
    at_s = task.view.time_s[task.imaging]
    assert np.abs(quiet.azimuth.value(at_s, 1)).max() < 0.02
    assert np.abs(usual.azimuth.value(at_s, 1)).max() > 0.1
    assert peak_rate_deg_s(quiet.azimuth, task.view) <= 1.0
    assert off_pointing(task, quiet.gimbal(task.view.time_s), task.view).max() <= 2.0


def test_a_drive_too_slow_for_its_target_is_smoothed_and_the_loss_is_told() -> None:
    task = made_task(8, 1.0, azimuth=AxisLimits(-270.0, 270.0, 1.0, 0.5))
    made = make(task, DAEJEON, "single")
    named = {check.name: check for check in made.second}
    assert named["azimuth rate"].is_met
    assert named["azimuth acceleration"].is_met
    assert not named["off-pointing"].is_met
    assert "contact lost for" in named["off-pointing"].detail


def test_the_beam_of_an_offset_boresight_is_put_on_the_target() -> None:
    task = made_task(8, 1.0)
    cone = Cone(1.0, boresight_elevation_deg=0.5, boresight_cross_deg=0.4)
    p = task.view.unit(task.station_itrs_m)
    assert angles_between_deg(beam_direction(aimed(p, cone), cone.boresight), p).max() < 1e-6


def test_a_free_profile_that_backlash_spoils_is_not_sent_to_the_free_method(tmp_path: Path) -> None:
    change = ("azimuth_deg = 0.01\nelevation_deg = 0.01", "azimuth_deg = 1.0\nelevation_deg = 1.0")
    failed = onboard("profile", pass_file(tmp_path, change), "--out", tmp_path / "a.tpf")
    assert failed.code == 1
    assert "FAIL elevation acceleration" in failed.out
    assert failed.err.endswith("no file is written: change [antenna] in the pass' file\n")
    assert not (tmp_path / "a.tpf").exists()


def test_backlash_is_led_in_the_direction_of_the_motion() -> None:
    knots = Knots(np.array([0.0, 20.0, 40.0]))
    path = knots.path(np.array([0.0, 20.0, 0.0, 10.0, 0.0, -20.0, 0.0, -20.0, 0.0]))
    time_s = np.arange(801) * 0.05
    true = path.value(time_s)
    behind = after_backlash(true, 0.2) - true
    led = after_backlash(with_backlash(path, time_s, 0.2), 0.2) - true
    moving = np.abs(path.value(time_s, 1)) > 0.3
    assert np.abs(behind).max() == pytest.approx(0.1, abs=1e-3)
    assert np.abs(led[moving]).max() < 0.01


def test_the_turn_of_the_cable_that_fits_is_taken() -> None:
    limits = AxisLimits(0.0, 400.0, 1.0, 1.0)
    assert best_turn_deg(np.array([-170.0, -20.0]), limits) == 360.0
    assert best_turn_deg(np.array([20.0, 300.0]), limits) == 0.0


def test_an_attitude_file_gives_the_profile_of_the_plan_it_was_made_from(tmp_path: Path) -> None:
    planned = load_pass(EXAMPLE / "pass.toml")
    seen = planned.seen
    tai_s = np.arange(np.floor(seen.rise_tai_s) - 2.0, seen.set_tai_s + 3.0)
    lvlh = lvlh_from_inertial(*planned.propagator.states_teme(tai_s))
    (tmp_path / "a.aem").write_text(kvn(quaternions(planned.attitude.body_from_lvlh(tai_s, lvlh)), tai_s))
    path = pass_file(tmp_path)
    head, _, _ = path.read_text().partition("[attitude]")
    path.write_text(head + '[attitude]\nfile = "a.aem"\n')
    task, other = planned.task(), load_pass(path).task()
    a, b = (one.view.unit(one.station_itrs_m) for one in (task, other))
    assert angles_between_deg(a, b).max() < 1e-3
    holes = (tmp_path / "a.aem").read_text().splitlines()
    at = next(k for k, line in enumerate(holes) if "T04:29:20" in line)
    (tmp_path / "a.aem").write_text("\n".join(holes[:at] + holes[at + 8 :]))
    refused = onboard("profile", path)
    assert refused.code == 2
    assert "a gap of 9.0 s in the attitude" in refused.err


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("margin_deg = 2.0", "margin_deg = 0.0"), "antenna.margin_deg = 0.0: expected at least 0.001"),
        (("margin_deg = 2.0", "margins_deg = 2.0"), "did you mean margin_deg?"),
        (("min_elevation_deg = 5.0", "min_elevation_deg = 89.0"), "change from_utc, lower min_elevation_deg"),
        (("roll_deg = -18.0", "roll_deg = -45.0"), "the body turns 30 deg at the most"),
        (("duration_s = 25.0", "duration_s = 120.0"), "move the holds apart"),
        (("min_deg = -270.0", "min_deg = 280.0"), "expected less than max_deg"),
        (('file = "kompsat-3-alike.tle"', 'file = "no.tle"'), "No such file"),
    ],
)
def test_what_is_wrong_with_a_pass_is_told_with_what_to_change(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    with pytest.raises(UsageError) as told:
        load_pass(pass_file(tmp_path, change))
    assert said in str(told.value)


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("max_deg = 110.0", "max_deg = 60.0"), "beyond the elevation range from 0 to 60 deg"),
        (("min_deg = 0.0", "min_deg = 20.0"), "the station is only 7.0 deg from the gimbal's axis"),
        (("max_deg = 270.0", "max_deg = -150.0"), "widen the range or the margin"),
        (("max_acceleration_deg_s2 = 2.0", "max_acceleration_deg_s2 = 0.01"), "raise max_acceleration_deg_s2"),
    ],
)
def test_impossible_limits_are_told_with_what_to_change(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    planned = load_pass(pass_file(tmp_path, change))
    with pytest.raises(ProfileError) as told:
        make(planned.task(), planned.station, "free", "peak", planned.file.antenna.play)
    assert said in str(told.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("TRACKING_PARAMETER_FILE = 1", "TRACKING_PARAMETER_FILE = 7"), "of this version"),
        (("PIECES = ", "PIECES = 1"), "the file is not whole"),
        (("AZ 2", "AZ x2"), "line "),
        (("METHOD = free", "METHOD = best"), "expected one of single"),
    ],
)
def test_a_file_that_is_cut_or_changed_is_refused_with_its_line(change: tuple[str, str], said: str) -> None:
    task = made_task(0, 2.0)
    profile = free_profile(task)
    text = write(float(task.view.tai_s[0]), profile, {}, [])
    assert change[0] in text
    with pytest.raises(UsageError, match=r"^pass\.tpf"):
        read(text.replace(*change, 1), "pass.tpf")
    with pytest.raises(UsageError) as told:
        read(text.replace(*change, 1), "pass.tpf")
    assert said in str(told.value)


def test_scenarios_are_the_same_whatever_the_count_and_written_as_rows(tmp_path: Path) -> None:
    rows = tmp_path / "rows.json"
    done = onboard("scenarios", "--count", "2", "--seed", "6", "--margin-deg", "2", "--jobs", "1", "--json", rows)
    assert done.code == 0, done.err
    assert "samples beyond the margin (20 Hz, all methods): 0" in done.out
    written = json.loads(rows.read_text())
    assert written["margin_deg"] == 2.0
    keys = [
        "seed",
        "kind",
        "culmination_deg",
        "single_deg_s",
        "three_deg_s",
        "search_deg_s",
        "free_deg_s",
        "bound_deg_s",
    ]
    assert list(written["rows"][0])[:9] == [*keys, "violations"]
    assert written["rows"][1]["culmination_deg"] == pytest.approx(made_scenario(7).seen.culmination_el_deg)


def test_a_boresight_turned_away_from_the_axis_reaches_further_out() -> None:
    task = made_task(0, 1.0)
    top = float(task.station_gimbal(task.view).el_deg.max())
    short = AxisLimits(0.0, top - 1.5, np.inf, np.inf)
    for offset_deg, is_in_reach in ((0.0, False), (1.0, True), (-1.0, False)):
        cone = Cone(1.0, boresight_elevation_deg=offset_deg, el_max_deg=short.max_deg)
        turned = replace(task, cone=cone, elevation=short)
        if is_in_reach:
            assert make(turned, DAEJEON, "free").is_met
        else:
            with pytest.raises(ProfileError, match="beyond the elevation range"):
                make(turned, DAEJEON, "free")


def test_backlash_that_takes_all_of_the_margin_is_refused() -> None:
    with pytest.raises(ProfileError, match="widen margin_deg"):
        make(made_task(0, 0.1), DAEJEON, "free", "peak", Backlash(0.2, 0.2))


@pytest.mark.parametrize("beside_deg", [-1.9, -0.5, 0.5, 1.9])
@pytest.mark.parametrize("course_deg", [0.0, 77.0, 190.0, 300.0])
def test_past_the_axis_one_winding_goes_the_short_way_and_the_other_one_round_the_other_side(
    beside_deg: float, course_deg: float
) -> None:
    """A straight line that passes the axis within the margin, on either side."""
    time_s = np.linspace(-60.0, 60.0, 1201)
    far_deg = np.hypot(time_s, beside_deg)
    az_deg = course_deg + np.degrees(np.unwrap(np.arctan2(beside_deg * np.ones_like(time_s), time_s)))
    tube = azimuth_tube(Cone(2.5), time_s, az_deg, far_deg)
    direct, other = windings(tube, az_deg)
    ends = [(one.lower_deg[[0, -1]] + one.upper_deg[[0, -1]]) / 2.0 for one in (direct, other)]
    short_deg, long_deg = (float(last - first) for first, last in ends)
    assert short_deg == pytest.approx(az_deg[-1] - az_deg[0], abs=0.1)
    assert abs(short_deg) < 180.0 < abs(long_deg)
    assert short_deg * long_deg < 0.0
    assert abs(short_deg) + abs(long_deg) == pytest.approx(360.0)
