"""assist.session.prediction: the buffer, continuous through north and zenith, smooth and exact between its samples."""

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site
from real_passes import sky_angles_deg

from acu_daemon.assist.session.prediction import _continuous, predict
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, predict_from
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.control.tracking.track_frame import beside
from acu_daemon.model import AxisLimits, Correction, Model, Readings, sky_angle_deg
from acu_daemon.orbit.look import look_at
from acu_daemon.pointing.keyhole import KeyholeRules, longest_window_s

BETWEEN_SAMPLES_DEG = 0.001
DRIVE = AxisLimits(-270.0, 270.0, 20.0, 10.0)
OVERHEAD = site(longitude_deg=0.0209)  # the made orbit culminates at 89.8 deg there


def _predict(propagator, where, start_s, near_az_deg=0.0, **more):
    at = EPOCH_TAI_S + start_s
    return predict(propagator, where, at, made_at_tai_s=at, kind="TLE", near_az_deg=near_az_deg, **more)


@pytest.mark.parametrize("where", [OVERHEAD, site(2.0), site(8.0), site(-15.0, 10.0)])
def test_between_samples_the_path_is_the_satellites(where):
    propagator = circular()
    buffer = _predict(propagator, where, -45.0)
    tai_s = EPOCH_TAI_S - 45.0 + np.arange(0.0, 90.0, 0.017)
    points = [buffer.at(t) for t in tai_s.tolist()]
    seen = look_at(propagator, tai_s, where)
    az, el = (np.array([getattr(p, name) for p in points]) for name in ("az_deg", "el_deg"))
    assert sky_angles_deg(az, el, seen.az_deg, seen.el_deg).max() < BETWEEN_SAMPLES_DEG


def test_the_overhead_pass_of_these_tests_culminates_at_89_8_degrees():
    assert _predict(circular(), OVERHEAD, -45.0).el_deg.max() == pytest.approx(89.8, abs=0.03)


def test_the_rate_is_smooth_across_the_samples_and_is_the_slope_of_the_path():
    buffer = _predict(circular(), site(2.0), -45.0)
    for t in buffer.start_tai_s + buffer.step_s * np.arange(1, 900):
        before, here, after = (buffer.at(t + dt) for dt in (-1e-4, 0.0, 1e-4))
        assert before.az_rate_deg_s == pytest.approx(after.az_rate_deg_s, abs=1e-3)
        assert before.el_rate_deg_s == pytest.approx(after.el_rate_deg_s, abs=1e-3)
        assert (after.az_deg - before.az_deg) / 2e-4 == pytest.approx(here.az_rate_deg_s, abs=1e-3)


def test_azimuth_is_continuous_through_north_and_starts_on_the_turn_asked_for():
    propagator, where = circular(51.6), site(6.0, -3.0)
    for near_az_deg in (-90.0, 270.0, 620.0):
        buffer = _predict(propagator, where, 100.0, near_az_deg, horizon_s=150.0)
        assert abs(buffer.az_deg[0] - near_az_deg) <= 180.0
        assert np.abs(np.diff(buffer.az_deg)).max() < 1.0
        assert np.floor(buffer.az_deg.min() / 360.0) < np.floor(buffer.az_deg.max() / 360.0)


@pytest.mark.parametrize("offset_deg", [1e-3, -1e-3, 2e-3, -2e-3, 5e-3, -5e-3, 0.0209, -0.0209])
@pytest.mark.parametrize("i_deg", [98.6, 81.4, 60.0])
def test_past_the_zenith_azimuth_turns_by_half_a_turn_the_way_its_rate_says(offset_deg, i_deg):
    """From 0.01 deg beside the zenith on, most of the half turn falls into one step."""
    propagator = circular(i_deg)
    buffer = _predict(propagator, site(longitude_deg=offset_deg), -45.0)
    turned = buffer.az_deg[-1] - buffer.az_deg[0]
    assert 150.0 < abs(turned) < 210.0
    assert np.sign(turned) == np.sign(buffer.az_rate_deg_s[np.argmax(np.abs(buffer.az_rate_deg_s))])


def test_the_buffer_has_a_pair_every_step_up_to_its_horizon():
    buffer = _predict(circular(), site(), 0.0)
    assert buffer.az_deg.size == 901
    assert buffer.end_tai_s == pytest.approx(EPOCH_TAI_S + 90.0)
    assert buffer.follow_az_deg.size == 901
    assert buffer.at(EPOCH_TAI_S - 0.1) is None


def test_a_buffer_that_starts_inside_the_keyhole_continues_what_the_one_before_planned():
    propagator = circular()
    more = {"lead_in_s": longest_window_s(DRIVE), "keyhole": KeyholeRules(DRIVE)}
    early = _predict(propagator, OVERHEAD, -45.0, 180.0, **more)
    assert np.abs(early.follow_az_deg - early.az_deg).max() > 45.0
    for later_s in (-4.0, -0.3, 0.2, 4.0):
        skip = round((later_s + 45.0) / early.step_s)
        late = _predict(propagator, OVERHEAD, later_s, early.az_deg[skip], **more)
        same = early.az_deg.size - skip
        assert np.allclose(late.follow_az_deg[:same], early.follow_az_deg[skip:], atol=0.05)


@pytest.mark.parametrize("lead_in_s", [0.0, 25.0])
@pytest.mark.parametrize("made_after_s", [-5.0, 0.0, 30.0, 45.0, 60.0, 120.0])
def test_the_turn_asked_for_is_that_of_the_instant_at_which_the_buffer_is_made(lead_in_s, made_after_s):
    """However long the lead-in and the past of the buffer; before its start, that of the start."""
    start_tai_s = EPOCH_TAI_S - 45.0
    for near_az_deg in np.arange(-400.0, 400.0, 17.0).tolist():
        made_tai_s = start_tai_s + made_after_s
        buffer = predict(
            circular(), OVERHEAD, start_tai_s, made_tai_s, "TLE", near_az_deg, horizon_s=90.0, lead_in_s=lead_in_s
        )
        at = buffer.at(min(max(made_tai_s, buffer.start_tai_s), buffer.end_tai_s))
        assert abs(at.az_deg - near_az_deg) <= 180.0 + 1e-6


@pytest.mark.parametrize("where", [site(3.0), site(-9.0), site(-4.0, 48.0), site(2.0, -70.0)])
@pytest.mark.parametrize("i_deg", [28.0, 98.6, 140.0])
def test_a_satellite_that_is_late_is_where_the_frame_of_the_track_has_it(where, i_deg):
    """Late on the same orbit, while the Earth has turned on: a mean anomaly that is less by the time it is late."""
    source = circular(i_deg, e=0.0)
    tai_s = EPOCH_TAI_S + np.arange(-400.0, 400.0, 50.0)
    buffer = predict(source, where, EPOCH_TAI_S - 600.0, EPOCH_TAI_S, "TLE", 0.0, horizon_s=1200.0)
    rate_rad_s = source.mean_elements(np.array([EPOCH_TAI_S, EPOCH_TAI_S + 1.0]))
    latitude_rad = rate_rad_s.argp_rad + rate_rad_s.mean_anomaly_rad
    for late_s in (-60.0, -10.0, 10.0, 60.0):
        behind = Correction(delta_mean_anomaly_rad=-late_s * float(latitude_rad[1] - latitude_rad[0]))
        seen = look_at(source.corrected(behind), tai_s, where)
        for k, at in enumerate(tai_s.tolist()):
            if abs(seen.el_deg[k]) > 89.0:
                continue
            point = beside(buffer, at, (late_s, 0.0))
            apart_deg = sky_angle_deg(point.az_deg, point.el_deg, float(seen.az_deg[k]), float(seen.el_deg[k]))
            assert apart_deg < 0.001 * abs(late_s)


@pytest.mark.long
@pytest.mark.parametrize("now_s", [-30.0, 0.0, 30.0])
def test_however_far_back_a_buffer_begins_its_turn_is_the_one_asked_for_at_the_instant_of_asking(now_s):
    setup = RefitSetup(circular(), OVERHEAD, "full", EstimatorSettings(), DRIVE)
    now_tai_s = EPOCH_TAI_S + now_s
    for near_az_deg in np.arange(-400.0, 400.0, 17.0).tolist():
        request = RefitRequest(Readings.of([]), EPOCH_TAI_S - 60.0, 120.0, now_tai_s, near_az_deg)
        buffer = predict_from(setup, None, request, Model.ELEMENTS)
        assert abs(buffer.at(now_tai_s).az_deg - near_az_deg) <= 180.0 + 1e-6
        assert buffer.made_at_tai_s == now_tai_s


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_step_of_a_little_more_than_half_a_turn_goes_the_way_of_the_rates_to_both_sides(side):
    az_deg, rates_deg_s = side * np.array([10.0, 190.2, 191.0]), side * np.array([900.0, 900.0, 1.0])
    assert np.diff(_continuous(az_deg % 360.0, rates_deg_s, 0.1)) == pytest.approx(side * np.array([180.2, 0.8]))
