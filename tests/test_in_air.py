"""The daemon in air, with a surveyed mount: readings, fits, predictions, plans, passes through one antenna model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from config_files import BROUWER, write
from config_files import STATION as STATION_FILE
from flights import RISING_TAI_S, climb, demo_target, worst_error_deg
from made_orbits import circular

from acu_daemon.assist.estimators.full.carry_over import CarryOver, carry_over_of, why_other_frame
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.cli.simulated import station_air
from acu_daemon.config.antenna_tables import SCALE_SIGMA, AtmosphereSection
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.edge.carry_over_file import from_json, to_json
from acu_daemon.model import AngleBias, AxisLimits, Correction, FitResult, Readings, Site, Station
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.refraction import traced
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.scenario import AirChoice, Scenario, SkyErrors
from acu_daemon.units import DAY_S, Array, wrap_180_array

STATION = Station("Cuiaba", -15.53, -56.07, 277.0)
ANTENNA = AntennaModel(Mount(0.5, -0.3, 0.02, 0.015, -0.02, 0.01, 0.03), traced(350.0, STATION))
IN_AIR, IN_VACUUM = Site(STATION, antenna=ANTENNA), Site(STATION)
SOURCE = circular()
ATMOSPHERE = STATION_FILE + "\n[atmosphere]\n"
LOOKED_DEG = 1e-9
RATES_DEG_S = 3e-5


def a_pass(site: Site, lowest_deg: float = 5.0):  # type: ignore[no-untyped-def]
    start = SOURCE.epoch_tai_s
    found = find_passes(SOURCE, site, start + 100.0, start + DAY_S, lowest_deg)
    return next(one for one in found if 20.0 < one.culmination_el_deg < 75.0)


def rates_off(site: Site, tai_s: Array, fit: FitResult | None) -> tuple[Array, Array]:
    """Rates less the differences of the angles; the source's own velocity is off its path by 5e-4 deg/s."""
    before, shown, after = (encoder_look(SOURCE, tai_s + shift, site, fit) for shift in (-0.05, 0.0, 0.05))
    return (
        shown.az_rate_deg_s - wrap_180_array(after.az_deg - before.az_deg) / 0.1,
        shown.el_rate_deg_s - (after.el_deg - before.el_deg) / 0.1,
    )


def fitted(site: Site, readings: Readings, cot_sigma_deg: float) -> FitResult:
    estimator = FullEstimator(SOURCE, site, EstimatorSettings(0.03, 0.03, bias_sigma_elevation_cot_deg=cot_sigma_deg))
    estimator.add(readings)
    fit = estimator.fit()
    assert fit is not None
    return fit


def test_what_the_encoders_show_is_the_antenna_model_of_the_look_with_its_rates() -> None:
    one = a_pass(IN_VACUUM)
    tai_s = np.linspace(one.rise_tai_s, one.set_tai_s, 50)
    plain = look_at(SOURCE, tai_s, IN_VACUUM)
    shown = encoder_look(SOURCE, tai_s, IN_AIR, None)
    az_deg, el_deg = ANTENNA.encoders_deg(plain.az_deg, plain.el_deg, plain.range_m)
    assert np.abs(wrap_180_array(shown.az_deg - az_deg)).max() < LOOKED_DEG
    assert np.abs(shown.el_deg - el_deg).max() < LOOKED_DEG
    for off, without in zip(rates_off(IN_AIR, tai_s, None), rates_off(IN_VACUUM, tai_s, None), strict=True):
        assert np.abs(off - without).max() < RATES_DEG_S


def test_the_low_bias_of_a_fit_is_a_scale_of_the_refraction_with_the_rate_of_it() -> None:
    one = a_pass(IN_VACUUM)
    tai_s = np.linspace(one.rise_tai_s, one.set_tai_s, 50)
    denser = replace(ANTENNA, refraction_scale=1.1)
    at_45_deg = float(traced(350.0, STATION).raised_deg(np.array(45.0), np.inf)[0])
    fit = FitResult("full", Correction(), 0.0, 1, 0, 0.0, 0.0, 0.0, AngleBias(el_cot_deg=0.1 * at_45_deg))
    by_fit = encoder_look(SOURCE, tai_s, IN_AIR, fit)
    by_model = encoder_look(SOURCE, tai_s, Site(STATION, antenna=denser), None)
    plain = encoder_look(SOURCE, tai_s, IN_AIR, None)
    assert np.abs(by_fit.el_deg - by_model.el_deg).max() < 0.03 * np.abs(by_model.el_deg - plain.el_deg).max()
    assert np.abs(rates_off(IN_AIR, tai_s, fit)[1] - rates_off(IN_VACUUM, tai_s, None)[1]).max() < RATES_DEG_S


def test_how_well_the_air_is_known_is_a_share_of_what_it_raises_at_45_deg() -> None:
    section = AtmosphereSection()
    air = section.traced(STATION)
    assert air is not None
    raised_deg = float(air.raised_deg(np.array(45.0), np.inf)[0])
    assert section.cot_sigma_deg(STATION) == pytest.approx(SCALE_SIGMA * raised_deg, rel=0.02)
    assert AtmosphereSection(refraction=False).cot_sigma_deg(STATION) == 0.0


@pytest.mark.parametrize("sigma_deg", [0.0, 0.002])
def test_readings_through_air_and_mount_fit_the_orbit_that_made_them(sigma_deg: float) -> None:
    one = a_pass(IN_VACUUM)
    tai_s = np.arange(one.rise_tai_s, one.culmination_tai_s, 1.0)
    shown, plain = encoder_look(SOURCE, tai_s, IN_AIR, None), look_at(SOURCE, tai_s, IN_VACUUM)
    readings = Readings(tai_s, shown.az_deg, shown.el_deg)
    fit = fitted(IN_AIR, readings, sigma_deg)
    geometric = fitted(IN_VACUUM, Readings(tai_s, plain.az_deg, plain.el_deg), 0.0)
    assert fit.residual_rms_deg == pytest.approx(geometric.residual_rms_deg, abs=2e-6)
    assert abs(fit.along_s - geometric.along_s) < 1e-3
    assert max(abs(fit.bias.az_deg), abs(fit.bias.el_deg), abs(fit.bias.el_cot_deg)) < 1e-3
    assert fitted(IN_VACUUM, readings, sigma_deg).residual_rms_deg > 3.0 * fit.residual_rms_deg


def test_a_signal_that_comes_late_is_no_satellite_that_is_late() -> None:
    """Readings and predictions have light time and aberration, or neither; else a fit moves the satellite by 2 ms."""
    site = replace(IN_AIR, has_light_time=True)
    tai_s = np.arange(a_pass(site).rise_tai_s, a_pass(site).set_tai_s, 2.0)
    seen = encoder_look(SOURCE, tai_s, site, None)
    readings = Readings(tai_s, seen.az_deg, seen.el_deg)
    told, untold = (fitted(one, readings, 0.0).along_s for one in (site, IN_AIR))
    assert abs(told) < 1e-4
    assert abs(untold) > 1e-3


def test_rise_and_set_are_apparent_and_the_plan_is_of_the_encoders() -> None:
    in_air, in_vacuum = a_pass(Site(STATION, antenna=AntennaModel(refraction=ANTENNA.refraction))), a_pass(IN_VACUUM)
    rises = look_at(SOURCE, np.array([in_air.rise_tai_s]), IN_VACUUM)
    assert 0.1 < 5.0 - float(rises.el_deg[0]) < 0.25
    assert 1.0 < in_vacuum.rise_tai_s - in_air.rise_tai_s < 10.0
    assert 1.0 < in_air.set_tai_s - in_vacuum.set_tai_s < 10.0
    axis = AxisLimits(-270.0, 270.0, 20.0, 10.0)
    plans = [plan_pass(SOURCE, site, in_vacuum, 0.0, axis, in_vacuum.rise_tai_s) for site in (IN_AIR, IN_VACUUM)]
    assert plans[0].start_az_deg - plans[1].start_az_deg == pytest.approx(0.5, abs=0.05)
    assert plans[0].start_el_deg - plans[1].start_el_deg == pytest.approx(-0.3 + 0.2 + 0.03, abs=0.05)


@pytest.mark.long
def test_a_flight_in_air_that_was_told_holds_the_satellite_through_a_loss() -> None:
    target = demo_target(readings={"bias_sigma_elevation_deg": 0.02})
    scenario = Scenario(sky=SkyErrors(0.9, 0.015), air=AirChoice(refractivity_factor=1.08))
    sky = make_sky(target.elements.propagator, target.station.site, scenario, station_air=station_air(target.station))
    flight = climb(70.0, target, sky=sky, losses=[(40.0, 70.0)])
    assert worst_error_deg(flight, RISING_TAI_S + 41.0, RISING_TAI_S + 70.0) < 0.06
    row = next(row for row in flight.rows if row.tai_s > RISING_TAI_S + 20.0)
    geometric = make_sky(target.elements.propagator, target.station.site, scenario).direction(row.tai_s)
    assert geometric is not None
    assert row.satellite_el_deg is not None
    assert 0.02 < row.satellite_el_deg - geometric[1] < 0.1


def test_a_fit_in_a_vacuum_is_not_carried_into_air_nor_biases_to_another_mount() -> None:
    def carried(site: Site) -> CarryOver:
        fit = FitResult("full", Correction(), SOURCE.epoch_tai_s, 100, 0, 0.0, 0.0, 0.0, covariance=np.eye(17))
        kept = carry_over_of(fit, SOURCE, site)
        assert kept is not None
        return from_json(to_json("SAT", kept), "SAT")

    air = Site(STATION, antenna=AntennaModel(refraction=traced(350.0, STATION)))
    other_day = Site(STATION, antenna=AntennaModel(refraction=traced(330.0, STATION)))
    elsewhere = replace(IN_AIR, station=replace(STATION, name="elsewhere"))
    assert why_other_frame(carried(IN_VACUUM), IN_VACUUM) == ""
    assert why_other_frame(carried(air), other_day) == ""
    assert why_other_frame(carried(air), elsewhere) == ""
    assert "[atmosphere] refraction or [mount] has changed" in why_other_frame(carried(IN_VACUUM), air)
    assert "[atmosphere] refraction or [mount] has changed" in why_other_frame(carried(air), IN_AIR)
    assert "fitted with air" in why_other_frame(carried(IN_VACUUM), elsewhere)
    old = to_json("SAT", carried(IN_VACUUM))
    del old["frame"]
    assert from_json(old, "SAT").frame == ""


def test_check_tells_the_air_that_is_reckoned_with(tmp_path: Path) -> None:
    told = ATMOSPHERE + "pressure_hpa = 990.0\n"
    lines = acu_daemon("check", "--config", write(tmp_path, told, scd=BROUWER)).out.splitlines()
    (line,) = [line for line in lines if line[7:].startswith("air ")]
    assert line.startswith("GO")
    assert "990 hPa" in line
    assert "part of it the standard air's: N 3" in line
    assert "appears 0.2" in line
    without = acu_daemon(
        "check", "--config", write(tmp_path, ATMOSPHERE + "refraction = false\n", scd=BROUWER)
    ).out.splitlines()
    assert not [line for line in without if line[7:].startswith("air ")]


def test_a_surveys_sigma_says_how_far_a_fit_may_move_the_encoders() -> None:
    def sigmas(**mount: float) -> tuple[float, float, float]:
        target = demo_target(mount=mount)
        found = estimator_settings(target.station, target.satellite)
        return found.bias_sigma_azimuth_deg, found.bias_sigma_elevation_deg, found.bias_sigma_azimuth_sec_deg

    assert sigmas() == (0.1, 0.1, 0.003)
    assert sigmas(ia_sigma_deg=0.01, ie_sigma_deg=0.0, ca_sigma_deg=0.005) == (0.01, 0.0, 0.005)
    target = demo_target(mount={"npae_sigma_deg": 0.02, "aw_sigma_deg": 0.01, "tf_deg": 0.03})
    assert estimator_settings(target.station, target.satellite).mount_sigmas_deg == (0.02, 0.0, 0.01, 0.0)
