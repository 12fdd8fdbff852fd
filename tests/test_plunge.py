"""Over the top: an elevation axis that reaches to 180 deg takes a pass past the zenith without turning its azimuth."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flights import worst_error_deg
from overhead_flights import TOP_TAI_S, errors_deg, lost_s, over_the_zenith, overhead_target

from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.screening.offsets import offsets
from acu_daemon.assist.session.prediction import predict
from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.config.to_settings import estimator_settings, keyhole_rules
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.control.tracking.track_frame import beside, offset_of
from acu_daemon.model import AngleBias, Correction, FitResult, Prediction, Readings, plunged_bias, sky_angle_deg
from acu_daemon.orbit.look import look_along
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.mount import Mount
from acu_daemon.sim.mount_axes import MountAxes

MOST_EL_DEG = 179.9


def plunging(height_km: float, top_deg: float, **sections: dict[str, Any]) -> Target:
    target = overhead_target(height_km, top_deg, **sections)
    acu = target.station.acu
    acu = acu.model_copy(update={"elevation": acu.elevation.model_copy(update={"max_deg": MOST_EL_DEG})})
    return replace(target, station=target.station.model_copy(update={"acu": acu}))


def buffer_of(target: Target, begin_s: float = -40.0, span_s: float = 90.0, **more: Any) -> Prediction:
    """A buffer about the culmination."""
    source, site, begin = target.elements.propagator, target.station.site, TOP_TAI_S + begin_s
    near_az_deg = float(encoder_look(source, np.array([begin]), site, None).az_deg[0])
    return predict(
        *(source, site, begin, begin, "TLE", near_az_deg),
        horizon_s=span_s,
        keyhole=keyhole_rules(target.station),
        **more,
    )


@pytest.mark.parametrize("top_deg", [89.2, 89.55, 89.8, 89.99])
def test_the_way_over_the_top_is_never_farther_off_than_the_pass_is_from_the_zenith(top_deg: float) -> None:
    target = plunging(500, top_deg)
    buffer, azimuth = buffer_of(target), target.station.acu.azimuth
    assert buffer.crossing is not None
    assert buffer.crossing.is_plunge
    assert top_deg < 89.5 or buffer.crossing.lost_s == 0.0
    tai_s = buffer.start_tai_s + buffer.step_s * np.arange(buffer.az_deg.size)
    seen = encoder_look(target.elements.propagator, tai_s, target.station.site, None)
    assert buffer.crossing.largest_error_deg < 90.0 - seen.el_deg.max() + 0.01
    off = [
        sky_angle_deg(*row)
        for row in zip(buffer.follow_az_deg, buffer.follow_el_deg, seen.az_deg, seen.el_deg, strict=True)
    ]
    assert max(off) == pytest.approx(buffer.crossing.largest_error_deg, abs=0.02)
    rates = buffer.follow_az_rate_deg_s
    assert np.abs(rates).max() < azimuth.max_rate_deg_s / 2.0
    assert np.abs(np.diff(rates)).max() / buffer.step_s < azimuth.max_acceleration_deg_s2 / 2.0
    assert np.ptp(buffer.follow_az_deg) < 60.0
    assert buffer.follow_el_deg[-1] == buffer.el_deg[-1] > 100.0
    points = [buffer.at(float(t)) for t in tai_s[0] + np.arange(0.0, 85.0, 0.013)]
    path = encoder_look(target.elements.propagator, tai_s[0] + np.arange(0.0, 85.0, 0.013), target.station.site, None)
    for point, az_deg, el_deg in zip(points, path.az_deg, path.el_deg, strict=True):
        assert point is not None
        assert sky_angle_deg(point.az_deg, point.el_deg, az_deg, el_deg) < 0.05


def test_a_fit_that_moves_the_path_makes_no_jump_of_a_way_in_hand() -> None:
    """0.1 s and 0.03 deg: before the departure, and in the middle of the way; it returns onto the moved path."""
    target = plunging(500, 89.7)
    first = buffer_of(target)
    assert first.crossing is not None
    moved = Correction(delta_mean_anomaly_rad=-1e-4, delta_raan_rad=5e-5)
    source, site = target.elements.propagator.corrected(moved), target.station.site
    for now_tai_s in (first.crossing.departure_tai_s - 1.0, (TOP_TAI_S + first.crossing.departure_tai_s) / 2.0):
        was = first.at(now_tai_s)
        assert was is not None
        rules = keyhole_rules(target.station)
        begin = (source, site, now_tai_s - 1.0, now_tai_s, "TLE", was.az_deg)
        then = predict(*begin, keyhole=rules, lead_in_s=13.0, in_hand=first.crossing)  # type: ignore[arg-type]
        assert then.crossing is not None
        assert (then.crossing.departure_tai_s, then.crossing.is_plunge) == (first.crossing.departure_tai_s, True)
        for after_s in (0.0, 0.5):
            old, new = (one.at(now_tai_s + after_s, follow=True) for one in (first, then))
            assert old is not None
            assert new is not None
            assert sky_angle_deg(old.az_deg, old.el_deg, new.az_deg, new.el_deg) < 0.12
            assert abs(old.az_deg - new.az_deg) < 2.0
        end = then.crossing.return_tai_s + 5.0
        path = encoder_look(source, np.array([end]), site, None)
        point = then.at(end, follow=True)
        assert point is not None
        assert sky_angle_deg(point.az_deg, point.el_deg, float(path.az_deg[0]), float(path.el_deg[0])) < 1e-3


def test_what_the_drive_can_follow_and_what_cannot_be_plunged_goes_round() -> None:
    assert buffer_of(plunging(800, 87.0)).crossing is None
    for one in (plunging(500, 89.8, tracking={"zenith_takeover": "never"}), overhead_target(500, 89.8)):
        crossing = buffer_of(one).crossing
        assert crossing is not None
        assert not crossing.is_plunge


def test_a_plan_over_the_top_needs_no_turn_beyond_a_stop() -> None:
    target = plunging(500, 89.9, azimuth={"min_deg": 150.0, "max_deg": 200.0})
    coming, station = coming_pass(target, TOP_TAI_S - 900.0), target.station
    plan = plan_pass(
        *(target.elements.propagator, station.site, coming, 170.0, station.acu.azimuth.limits(), TOP_TAI_S - 900.0),
        elevation=station.acu.elevation.limits(),
        keyhole=keyhole_rules(station),
    )
    assert plan.crossing is not None
    assert plan.crossing.is_plunge
    assert plan.unwindings == plan.beyond == ()


@pytest.mark.long
def test_a_pass_within_half_a_beam_of_the_zenith_is_not_lost_and_is_fitted_on_beyond_it() -> None:
    flight = over_the_zenith(plunging(500, 89.6), before_s=30.0, after_s=25.0)
    assert lost_s(flight) == 0.0
    assert errors_deg(flight).max() < 0.45
    assert flight.states()[-3:] == ["ZENITH", "HOLD/FITTED", "AUTOTRACK/FITTED"]
    rows = [row for row in flight.rows if row.tai_s > TOP_TAI_S + 12.0]
    assert min(row.encoder_el_deg for row in rows) > 95.0
    assert flight.snapshots[-1].rejecting == ""


@pytest.mark.long
def test_a_loss_beyond_the_zenith_is_held_there_though_the_encoders_are_biased() -> None:
    """A zero point of the elevation shows the other way beyond the zenith: twice 0.15 deg were a third of the beam."""
    target = plunging(705, 89.7)
    flight = over_the_zenith(target, before_s=50.0, after_s=45.0, biases_deg=(0.1, 0.15), losses=[(75.0, 93.0)])
    assert worst_error_deg(flight, TOP_TAI_S + 8.0, TOP_TAI_S + 42.0) < 0.15
    assert min(row.encoder_el_deg for row in flight.rows if row.tai_s > TOP_TAI_S + 12.0) > 95.0


def test_the_search_frame_holds_beyond_the_zenith() -> None:
    buffer = buffer_of(plunging(500, 89.8))
    for offset in ((2.0, 0.5), (-1.5, -1.0), (0.0, 2.0)):
        point = beside(buffer, TOP_TAI_S + 25.0, offset)
        assert point is not None
        assert point.el_deg > 90.0
        assert offset_of(buffer, TOP_TAI_S + 25.0, point.az_deg, point.el_deg) == pytest.approx(offset, abs=0.01)


BIAS = AngleBias(az_deg=0.06, el_deg=0.1)


def readings_of(target: Target, first_s: float, last_s: float, *, is_plunged: bool) -> Readings:
    """What an antenna with biased encoders reads on a satellite that is 0.3 s late."""
    truth = target.elements.propagator.corrected(Correction(delta_mean_anomaly_rad=-0.0003))
    tai_s = TOP_TAI_S + np.arange(first_s, last_s, 0.1)
    fit = FitResult("", Correction(), 0.0, 0, 0, 0.0, 0.0, 0.0, BIAS)
    look = encoder_look(truth, tai_s, target.station.site, fit, look_along, is_plunged=is_plunged)
    noise = np.random.default_rng(1).normal(0.0, 0.02, (2, tai_s.size))
    return Readings(tai_s, look.az_deg + noise[0] / np.abs(np.cos(np.radians(look.el_deg))), look.el_deg + noise[1])


def test_readings_from_both_sides_of_the_zenith_are_of_one_orbit_and_one_zero_point() -> None:
    target = plunging(500, 89.8)
    site, settings = target.station.site, estimator_settings(target.station, target.satellite)
    source = target.elements.propagator
    estimator = FullEstimator(source, site, settings)
    parts = [readings_of(target, -150.0, -20.0, is_plunged=False), readings_of(target, 20.0, 100.0, is_plunged=True)]
    for part in parts:
        estimator.add(part)
    fit = estimator.fit()
    assert fit is not None
    assert fit.rejected_count == 0
    assert fit.bias.el_deg == pytest.approx(BIAS.el_deg, abs=0.02)
    for part in parts:
        seen = offsets(source, site, fit, part, settings)
        assert np.hypot(seen.right_deg.mean(), seen.up_deg.mean()) < 0.01


def test_a_plunged_antenna_of_the_simulator_is_where_the_model_has_it() -> None:
    """The chain of rotations against the first-order model, mount terms of all kinds."""
    terms = {"ia_deg": 0.3, "ie_deg": -0.2, "ca_deg": 0.05, "npae_deg": 0.04, "an_deg": 0.05, "aw_deg": -0.03}
    model, axes = AntennaModel(Mount(**terms)), MountAxes(**terms)
    for az_deg, el_deg in ((10.0, 110.0), (170.0, 130.0), (250.0, 165.0)):
        az, el = model.geometric_deg(az_deg, el_deg)
        assert sky_angle_deg(float(az), float(el), *axes.beam_deg(az_deg, el_deg)) < 2e-3
        rates = model.with_rates_plunged(az, el, np.array(np.inf), np.zeros(()), np.zeros(()))
        assert float(rates[0] - az_deg + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-6)
        assert float(rates[1]) == pytest.approx(el_deg, abs=1e-6)
    assert plunged_bias(plunged_bias(BIAS)) == BIAS
