"""From the tables of a station and a satellite to what control and the estimators need.  Pure."""

from dataclasses import replace
from math import hypot

import numpy as np

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.assist.estimators.estimator import EstimatorSettings
from acu_daemon.assist.settings import StateSigmas
from acu_daemon.config.satellite_tables import SatelliteFile, UncertaintySection
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.axis_watch import Bounds
from acu_daemon.model import Pass, Site
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.keyhole import KeyholeRules
from acu_daemon.pointing.tilt import Tilt, choose_tilt

TILT_STEP_S, MOST_TILT_STEPS = 0.5, 4000


def driver_of(station: StationFile) -> AcuDriver:
    """The driver of the station's ACU, at the beginning of its dialogue."""
    return station.acu.driver()


def control_config(
    station: StationFile, satellite: SatelliteFile, driver: AcuDriver, byte_time_s: float, tilt: Tilt | None = None
) -> ControlConfig:
    """What the decision of a tick needs; byte_time_s is the wire time of one character (0 on TCP).

    tilt: of the pedestal in this pass; None: it has none that is moved.
    """
    acu, timing = station.acu, driver.timing(byte_time_s)
    return ControlConfig(
        envelope=replace(station.bounds, tilt=tilt),
        period_s=acu.period_s,
        sample_delay_s=timing.sample_delay_s,
        poll_sample_delay_s=timing.poll_sample_delay_s,
        effect_delay_s=timing.effect_delay_s,
        beamwidth_deg=station.receiver.beamwidth_deg,
        lock_dwell_s=station.receiver.lock_dwell_s,
        min_elevation_deg=station.station.min_elevation_deg - (0.0 if tilt is None else abs(tilt.angle_deg)),
        preposition_s=station.tracking.preposition_s,
        acquire_s=satellite.fallback.acquire_s,
        hold_s=satellite.fallback.hold_s,
        search_s=satellite.fallback.search_s,
        search_along_s=station.tracking.search_along_s,
        search_across_deg=station.tracking.search_across_deg,
        zenith_takeover=station.tracking.zenith_takeover,
        leave_false_lock=station.tracking.leave_false_lock,
        false_lock_s=station.tracking.false_lock_s,
        is_armed=station.safety.arm == "auto",
        register_watchdog_s=station.safety.register_watchdog_s if driver.capabilities.has_register_watchdog else 0.0,
        acu=driver.capabilities,
        response_time_s=station.envelope.response_time_s,
        has_signal=station.has_signal,
        receiver=station.receiver.signal_rules(),
        tilt_deg=None if tilt is None else tilt.angle_deg,
        tilt=None if acu.tilt is None else acu.tilt.limits(),
        clock_alarm_deg=station.safety.clock_alarm_beam_fraction * station.receiver.beamwidth_deg,
        following=Bounds(station.safety.following_error_deg, station.safety.following_error_s),
    )


def planned_tilt(station: StationFile, propagator: Propagator, coming: Pass | None) -> Tilt | None:
    """How the pedestal leans for a pass, always the same for the same pass; None: it has no tilt that is moved.

    Raises:  OrbitError: the propagator has no answer for a time of the pass.
    """
    section = station.acu.tilt
    if section is None or coming is None:
        return None
    count = 2 + int(min(coming.duration_s / TILT_STEP_S, MOST_TILT_STEPS))
    tai_s = np.linspace(coming.rise_tai_s, coming.set_tai_s, count)
    seen = apparent_at(propagator, tai_s, station.site)
    drives = station.acu.azimuth.limits(), station.acu.elevation.limits()
    step_s = float(tai_s[1] - tai_s[0])
    return Tilt(choose_tilt(section.axis(), seen.az_deg, seen.el_deg, step_s, *drives), section.towards_deg)


def leaning(site: Site, tilt: Tilt | None) -> Site:
    """The site with an antenna that leans."""
    if tilt is None:
        return site
    antenna = site.antenna if isinstance(site.antenna, AntennaModel) else AntennaModel()
    return replace(site, antenna=replace(antenna, tilt=tilt))


def keyhole_rules(station: StationFile) -> KeyholeRules:
    """What the antenna can do near the zenith, and what counts as better there."""
    bounds = station.bounds
    half_beam_deg = station.receiver.beamwidth_deg / 2.0
    max_el_deg = min(bounds.elevation.max_deg, 90.0)
    objective = station.tracking.zenith_objective
    return KeyholeRules(bounds.azimuth, max_el_deg, may_plunge(station), half_beam_deg, objective)


def may_plunge(station: StationFile) -> bool:
    """Whether a pass may be flown over the top: beyond the zenith down to the lowest elevation, and led there."""
    lowest_deg = 180.0 - station.acu.elevation.max_deg
    return lowest_deg <= station.station.min_elevation_deg and station.tracking.zenith_takeover != "never"


def estimator_settings(station: StationFile, satellite: SatelliteFile | None) -> EstimatorSettings:
    """What the estimators need of the configuration; without a satellite what they need of the station's."""
    return EstimatorSettings(
        sigma_azimuth_deg=station.readings.sigma_azimuth_deg,
        sigma_elevation_deg=station.readings.sigma_elevation_deg,
        max_fit_elevation_deg=station.tracking.max_fit_elevation_deg,
        beamwidth_deg=station.receiver.beamwidth_deg,
        azimuth=station.acu.azimuth.limits(),
        elevation=station.acu.elevation.limits(),
        bias_sigma_azimuth_deg=_surveyed(station.mount.ia_sigma_deg, station.readings.bias_sigma_azimuth_deg),
        bias_sigma_elevation_deg=_surveyed(station.mount.ie_sigma_deg, station.readings.bias_sigma_elevation_deg),
        bias_sigma_azimuth_sec_deg=_surveyed(station.mount.ca_sigma_deg, station.readings.bias_sigma_azimuth_sec_deg),
        bias_sigma_elevation_cot_deg=hypot(
            station.readings.bias_sigma_elevation_cot_deg, station.atmosphere.cot_sigma_deg(station.site.station)
        ),
        is_collimation_surveyed=station.mount.ca_sigma_deg is not None,
        mount_sigmas_deg=station.mount.axis_sigmas_deg,
        orbit_sigmas=None if satellite is None else _orbit_sigmas(satellite.uncertainty),
        station_sigma_m=station.station.uncertainty_m / 2**0.5,  # of east and of north each
    )


def pedestal_text(station: StationFile) -> str:
    """What a memory of the mount is of: of another pedestal it says nothing."""
    place, azimuth, elevation = station.site.station, station.acu.azimuth, station.acu.elevation
    surveyed = " ".join(f"{name} {value:g}" for name, value in station.mount.model_dump().items() if value is not None)
    return (
        f"{place.name} {place.latitude_deg:.4f} {place.longitude_deg:.4f} {place.height_m:.0f} m; azimuth "
        f"{azimuth.min_deg:g} to {azimuth.max_deg:g}, elevation {elevation.min_deg:g} to {elevation.max_deg:g} deg; "
        f"{'air' if station.atmosphere.refraction else 'vacuum'}; {surveyed}"
    )


def _surveyed(sigma_deg: float | None, otherwise_deg: float) -> float:
    return otherwise_deg if sigma_deg is None else sigma_deg


def _orbit_sigmas(given: UncertaintySection) -> StateSigmas | None:
    """The satellite's own a-priori; None where the file says nothing: then the kind and age of the elements say it."""
    if given.position_km is None and given.velocity_m_s is None:
        return None
    position_m = given.position_km * 1e3 if given.position_km is not None else (given.velocity_m_s or 0.0) * 1e3
    velocity_m_s = given.velocity_m_s if given.velocity_m_s is not None else position_m * 1e-3  # a low orbit's motion
    return StateSigmas(position_m, velocity_m_s)
