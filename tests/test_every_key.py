"""Every key of the files with a value of its own: in what is made of them each is in its place, not a neighbour's."""

from dataclasses import replace
from math import hypot
from pathlib import Path
from typing import Any

import pytest
from config_files import BROUWER, STATION, write

from acu_daemon.acu.driver import Timing
from acu_daemon.assist.settings import EstimatorSettings, StateSigmas
from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import (
    control_config,
    driver_of,
    estimator_settings,
    keyhole_rules,
    may_plunge,
    pedestal_text,
)
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.receiver_signal import SignalRules
from acu_daemon.control.safety.axis_watch import Bounds
from acu_daemon.edge.hooks import Hook
from acu_daemon.model import AxisLimits, EarthOrientation, Station
from acu_daemon.orbit.elements import ElementLimits
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.air import Air
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.keyhole import KeyholeRules
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.skyline import Skyline
from acu_daemon.pointing.tilt import Tilt, TiltAxis
from acu_daemon.schedule.rules import SatelliteRules, StationRules, Window
from acu_daemon.schedule.wind import WindRules

AZIMUTH, ELEVATION, TILT = (
    AxisLimits(-251.0, 262.0, 18.5, 9.5),
    AxisLimits(3.5, 173.5, 4.5, 3.25),
    AxisLimits(-7.5, 12.5, 1.5, 0.75),
)
ALL = """
[station]
latitude_deg = -15.5
longitude_deg = -56.25
height_m = 277.5
name = "here"
min_elevation_deg = 6.5
uncertainty_m = 14.0
[acu]
url = "tcp://127.0.0.1:3842"
address = "7"
period_s = 0.125
device_delay_s = 0.015
[acu.azimuth]
min_deg = -251.0
max_deg = 262.0
max_rate_deg_s = 18.5
max_acceleration_deg_s2 = 9.5
[acu.elevation]
min_deg = 3.5
max_deg = 173.5
max_rate_deg_s = 4.5
max_acceleration_deg_s2 = 3.25
[acu.tilt]
min_deg = -7.5
max_deg = 12.5
max_rate_deg_s = 1.5
max_acceleration_deg_s2 = 0.75
towards_deg = 77.0
[receiver]
beamwidth_deg = 1.2
lock_dwell_s = 1.75
signal = "udp://127.0.0.1:4901"
program_track = true
signal_lock_db = 7.25
signal_unlock_db = 5.25
[time]
ut1_utc_s = 0.21
polar_motion_x_arcsec = 0.31
polar_motion_y_arcsec = 0.41
[readings]
sigma_azimuth_deg = 0.051
sigma_elevation_deg = 0.052
bias_sigma_azimuth_deg = 0.053
bias_sigma_elevation_deg = 0.054
bias_sigma_azimuth_sec_deg = 0.055
bias_sigma_elevation_cot_deg = 0.056
[tracking]
horizon_s = 91.0
low_water_s = 31.0
max_fit_elevation_deg = 81.0
estimator = "kalman"
preposition_s = 121.0
zenith_takeover = "always"
leave_false_lock = true
false_lock_s = 3.5
zenith_objective = "seconds"
search_along_s = 11.0
search_across_deg = 2.2
[safety]
arm = "manual"
register_watchdog_s = 5.5
following_error_deg = 1.1
following_error_s = 2.3
clock_alarm_beam_fraction = 0.25
[envelope]
mask = [[10, 1.5], [200, 2.5]]
sun_policy = "avoid"
sun_keep_out_deg = 2.75
response_time_s = 61.0
stow_az_deg = 33.0
stow_el_deg = 88.0
[[envelope.keep_out]]
name = "the mast"
az_from_deg = 120.0
az_to_deg = 130.0
el_from_deg = 4.0
el_to_deg = 14.0
[[envelope.keep_out]]
az_from_deg = 140.0
az_to_deg = 150.0
[atmosphere]
pressure_hpa = 981.0
temperature_c = 17.0
humidity_percent = 63.0
weather_max_age_s = 3601.0
[mount]
ia_deg = 0.11
ie_deg = 0.12
ca_deg = 0.013
npae_deg = 0.014
an_deg = 0.015
aw_deg = 0.016
tf_deg = 0.017
ia_sigma_deg = 0.021
ie_sigma_deg = 0.022
ca_sigma_deg = 0.023
npae_sigma_deg = 0.024
an_sigma_deg = 0.025
aw_sigma_deg = 0.026
tf_sigma_deg = 0.027
[schedule]
horizon_days = 2.5
freeze_s = 601.0
pre_s = 62.0
post_s = 12.0
after = "park"
next_within_s = 1801.0
park_az_deg = 44.0
park_el_deg = 66.0
[[schedule.maintenance]]
from_utc = 2026-01-02T03:04:05Z
to_utc = 2026-01-02T04:05:06Z
reason = "paint"
[hooks]
before_pass = ["a"]
during_pass = ["b"]
at_lock = ["c"]
at_loss = ["d"]
after_pass = ["e"]
on_no_go = ["f"]
on_alarm = ["g"]
before_move = ["h"]
time_limit_s = 33.0
before_move_s = 13.0
[mqtt]
url = "mqtt://broker:1888"
[rotctld]
listen = "127.0.0.1:4533"
[metrics]
listen = "127.0.0.1:9842"
[wind]
udp = "127.0.0.1:4841"
mean_limit_m_s = 11.25
gust_limit_m_s = 17.25
resume_share = 0.7
resume_after_s = 605.0
max_age_s = 65.0
when_stale = "stow"
"""
SATELLITE = (
    BROUWER
    + """
[elements.limits]
min_semi_major_axis_km = 6501.0
max_semi_major_axis_km = 8501.0
min_eccentricity = 0.001
max_eccentricity = 0.11
min_inclination_deg = 1.5
max_inclination_deg = 171.5
warn_age_days = 11.0
max_age_days = 31.0
[uncertainty]
position_km = 2.5
velocity_m_s = 3.5
[fallback]
acquire_s = 71.0
hold_s = 1201.0
search_s = 131.0
[schedule]
priority = 3
min_culmination_deg = 9.25
min_useful_s = 67.0
margin_s = 4.75
may_be_cut = true
may_interrupt = true
"""
)
MOUNT = Mount(0.11, 0.12, 0.013, 0.014, 0.015, 0.016, 0.017)
KEEP_OUTS = (KeepOut("the mast", 120.0, 130.0, 4.0, 14.0), KeepOut("the keep-out", 140.0, 150.0, -90.0, 90.0))
SKYLINE = Skyline((10.0, 200.0), (1.5, 2.5))


def near(value: float) -> Any:
    """Equal to it but for rounding."""
    return pytest.approx(value)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[StationFile, SatelliteFile]:
    directory = write(tmp_path_factory.mktemp("all"), ALL, scd=SATELLITE)
    satellite, station = load_satellite(directory, "scd", load_station(directory))
    return station, satellite


def test_the_decision_has_every_value_in_its_place(files: tuple[StationFile, SatelliteFile]) -> None:
    station, satellite = files
    driver, leans = driver_of(station), Tilt(-2.5, 77.0)
    envelope = station.bounds
    assert replace(envelope, sun=None) == Envelope(
        AZIMUTH, ELEVATION, KEEP_OUTS, None, SKYLINE, MOUNT, stow_deg=(33.0, 88.0)
    )
    assert envelope.sun is not None
    assert (envelope.sun.radius_deg, envelope.sun.policy, envelope.sun.site) == (2.75, "avoid", station.site)
    byte_s = 0.001
    made = control_config(station, satellite, driver, byte_s, leans)
    assert replace(made, envelope=replace(made.envelope, sun=None)) == ControlConfig(
        envelope=replace(envelope, sun=None, tilt=leans),
        period_s=0.125,
        sample_delay_s=near(17 * byte_s + 0.015),
        poll_sample_delay_s=near(5 * byte_s + 0.015),
        effect_delay_s=near(17 * byte_s + 0.025),
        beamwidth_deg=1.2,
        lock_dwell_s=1.75,
        min_elevation_deg=6.5 - 2.5,
        preposition_s=121.0,
        acquire_s=71.0,
        hold_s=1201.0,
        search_s=131.0,
        search_along_s=11.0,
        search_across_deg=2.2,
        zenith_takeover="always",
        leave_false_lock=True,
        false_lock_s=3.5,
        is_armed=False,
        register_watchdog_s=5.5,
        following=Bounds(1.1, 2.3),
        acu=driver.capabilities,
        response_time_s=61.0,
        has_signal=False,
        receiver=SignalRules(7.25, 5.25),
        tilt_deg=-2.5,
        tilt=TILT,
        clock_alarm_deg=near(0.25 * 1.2),
    )
    assert station.acu.tilt is not None
    assert station.acu.tilt.axis() == TiltAxis(TILT, 77.0)
    assert driver.timing(byte_s) == Timing(
        near(17 * byte_s + 0.015), near(5 * byte_s + 0.015), near(17 * byte_s + 0.025)
    )


def test_the_estimators_have_every_value_in_their_place(files: tuple[StationFile, SatelliteFile]) -> None:
    station, satellite = files
    cot_deg = hypot(0.056, station.atmosphere.cot_sigma_deg(station.site.station))
    surveyed = EstimatorSettings(
        sigma_azimuth_deg=0.051,
        sigma_elevation_deg=0.052,
        max_fit_elevation_deg=81.0,
        beamwidth_deg=1.2,
        azimuth=AZIMUTH,
        elevation=ELEVATION,
        bias_sigma_azimuth_deg=0.021,
        bias_sigma_elevation_deg=0.022,
        bias_sigma_azimuth_sec_deg=0.023,
        bias_sigma_elevation_cot_deg=cot_deg,
        mount_sigmas_deg=(0.024, 0.025, 0.026, 0.027),
        is_collimation_surveyed=True,
        orbit_sigmas=StateSigmas(2500.0, 3.5),
        station_sigma_m=near(14.0 / 2**0.5),
    )
    assert estimator_settings(station, satellite) == surveyed
    bare = station.model_copy(update={"mount": type(station.mount)()})
    assert estimator_settings(bare, None) == replace(
        surveyed,
        bias_sigma_azimuth_deg=0.053,
        bias_sigma_elevation_deg=0.054,
        bias_sigma_azimuth_sec_deg=0.055,
        mount_sigmas_deg=(0.0, 0.0, 0.0, 0.0),
        is_collimation_surveyed=False,
        orbit_sigmas=None,
    )


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("position_km = 2.5", StateSigmas(2500.0, 2.5)),
        ("velocity_m_s = 3.5", StateSigmas(3500.0, 3.5)),
        ("", None),
    ],
)
def test_of_two_sigmas_of_the_orbit_the_one_that_is_left_out_follows_from_the_other(
    tmp_path: Path, given: str, expected: StateSigmas | None
) -> None:
    directory = write(tmp_path, scd=f"{BROUWER}[uncertainty]\n{given}\n")
    satellite, station = load_satellite(directory, "scd", load_station(directory))
    assert estimator_settings(station, satellite).orbit_sigmas == expected


def test_site_air_schedule_wind_and_hooks_have_every_value_in_their_place(
    files: tuple[StationFile, SatelliteFile],
) -> None:
    station, satellite = files
    site = station.site
    assert site.station == Station("here", -15.5, -56.25, 277.5)
    assert site.orientation == EarthOrientation(0.21, 0.31, 0.41)
    assert site.skyline == SKYLINE
    assert site.antenna is not None
    assert site.antenna.mount == MOUNT
    assert station.atmosphere.air(site.station) == Air(981.0, 17.0, 63.0)
    window = Window(tai_from_utc("2026-01-02T03:04:05Z"), tai_from_utc("2026-01-02T04:05:06Z"), "paint")
    assert station.schedule.rules(AZIMUTH, ELEVATION) == StationRules(AZIMUTH, ELEVATION, 62.0, 12.0, (window,))
    assert satellite.schedule.rules() == SatelliteRules(3, 9.25, 67.0, 4.75, may_be_cut=True, may_interrupt=True)
    assert station.wind.rules() == WindRules(11.25, 17.25, 0.7, 605.0, 65.0, "stow")
    assert "".join(station.hooks.commands[hook][0] for hook in Hook) == "abcdefgh"
    assert satellite.elements.limits.limits() == ElementLimits(6501.0, 8501.0, 0.001, 0.11, 1.5, 171.5, 11.0, 31.0)
    rules = keyhole_rules(station)
    assert rules == KeyholeRules(AZIMUTH, 90.0, may_plunge=True, half_beam_deg=0.6, objective="seconds")
    assert station.mqtt.broker == ("broker", 1888, False)
    assert (station.rotctld.address, station.metrics.address) == (("127.0.0.1", 4533), ("127.0.0.1", 9842))


@pytest.mark.parametrize(
    ("max_deg", "min_elevation_deg", "takeover", "expected"),
    [
        (174.0, 6.0, "fitted", True),
        (173.99, 6.0, "fitted", False),
        (174.0, 5.99, "always", False),
        (174.0, 6.0, "never", False),
    ],
)
def test_a_pass_is_flown_over_the_top_where_the_elevation_reaches_the_horizon_on_the_other_side(
    files: tuple[StationFile, SatelliteFile], max_deg: float, min_elevation_deg: float, takeover: str, expected: bool
) -> None:
    station = files[0]
    elevation = station.acu.elevation.model_copy(update={"max_deg": max_deg})
    changes = {
        "acu": station.acu.model_copy(update={"elevation": elevation}),
        "station": station.station.model_copy(update={"min_elevation_deg": min_elevation_deg}),
        "tracking": station.tracking.model_copy(update={"zenith_takeover": takeover}),
    }
    assert may_plunge(station.model_copy(update=changes)) is expected


def test_a_memory_of_the_mount_is_of_another_pedestal_as_soon_as_anything_of_it_differs(
    files: tuple[StationFile, SatelliteFile],
) -> None:
    """Each number of the place, of the axes' ranges and of the survey, and the air."""
    station = files[0]
    others = {
        "station": ("name", "latitude_deg", "longitude_deg", "height_m"),
        "mount": tuple(type(station.mount).model_fields),
    }
    texts = {pedestal_text(station)}
    for table, keys in others.items():
        section = getattr(station, table)
        for key in keys:
            value = getattr(section, key)
            other = "there" if isinstance(value, str) else value + (2.0 if table == "station" else 0.001)
            texts.add(pedestal_text(station.model_copy(update={table: section.model_copy(update={key: other})})))
    for axis in ("azimuth", "elevation"):
        for key in ("min_deg", "max_deg"):
            section = getattr(station.acu, axis)
            moved = section.model_copy(update={key: getattr(section, key) + 1.0})
            texts.add(pedestal_text(station.model_copy(update={"acu": station.acu.model_copy(update={axis: moved})})))
    vacuum = station.atmosphere.model_copy(update={"refraction": False})
    texts.add(pedestal_text(station.model_copy(update={"atmosphere": vacuum})))
    assert len(texts) == 1 + 4 + 14 + 4 + 1


def test_a_rotators_dead_band_and_the_delays_of_every_dialect_are_the_files(tmp_path: Path) -> None:
    rotator = STATION.replace(
        'url = "tcp://127.0.0.1:3842"',
        'url = "tcp://127.0.0.1:4533"\ndialect = "rotctl"\ndead_band_deg = 0.35\ndevice_delay_s = 0.033',
    )
    station = load_station(write(tmp_path, rotator))
    driver = driver_of(station)
    assert driver.capabilities.dead_band_deg == 0.35
    assert driver.timing(0.0).poll_sample_delay_s == near(0.033)
    satellite = load_satellite(tmp_path, "scd", station)[0]
    assert control_config(station, satellite, driver, 0.0).register_watchdog_s == 0.0
