"""Stations, frames and look angles with rates, against Skyfield and against finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import DATA, needs_data
from hypothesis import given
from hypothesis import strategies as st
from made_oems import iss
from made_orbits import circular
from skyfield.api import EarthSatellite, load, wgs84
from skyfield.constants import AU_KM
from skyfield.relativity import add_aberration

from acu_daemon.model import EarthOrientation, Site, Station, sky_angle_deg
from acu_daemon.orbit.frames import itrs_from_teme, station_itrs_m, teme_from_itrs
from acu_daemon.orbit.look import look, look_along, look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import EARTH_RATE_RAD_S, wrap_180_array

SKYFIELD_DEG = 1e-4
SKYFIELD_DEG_S = 1e-5
LIGHT_TIME_DEG = 1e-7  # what light time and aberration add, ours less theirs
LIGHT_KM_S = 299792.458
DIFFERENCE_DEG_S = 2e-5  # SGP4's velocity is the derivative of its position to about 1e-6
LIST = DATA / "tle_sets" / "celestrak_resource_2018-11-07.txt"
STATION = Station("Cuiaba", -15.53, -56.07, 277.0)


def test_a_station_lies_where_skyfield_puts_it() -> None:
    expected_m = wgs84.latlon(STATION.latitude_deg, STATION.longitude_deg, STATION.height_m).itrs_xyz.m
    assert station_itrs_m(STATION) == pytest.approx(expected_m, abs=1e-3)


def test_teme_becomes_itrs_as_in_vallados_example() -> None:
    # AIAA 2006-6753 appendix C: 2004-04-06T07:51:28.386 UTC, UT1-UTC -0.4399619 s, polar motion -0.140682", 0.333309"
    r_teme_m = np.array([[5094.18016210, 6127.64465950, 6380.34453270]]) * 1e3
    v_teme_m_s = np.array([[-4.746131487, 0.785818041, 5.531931288]]) * 1e3
    orientation = EarthOrientation(-0.4399619, -0.140682, 0.333309)
    tai_s = np.array([tai_from_utc("2004-04-06T07:51:28.386009Z")])
    r_itrs_m, v_itrs_m_s = itrs_from_teme(r_teme_m, v_teme_m_s, tai_s, orientation)
    assert r_itrs_m[0] == pytest.approx(np.array([-1033.47938300, 7901.29527540, 6380.35659580]) * 1e3, abs=0.05)
    assert v_itrs_m_s[0] == pytest.approx(np.array([-3.225636520, -2.872451450, 5.531924446]) * 1e3, abs=1e-3)
    assert teme_from_itrs(r_itrs_m, tai_s, orientation) == pytest.approx(r_teme_m, abs=1e-6)


def test_a_point_fixed_to_the_earth_has_no_velocity_in_itrs() -> None:
    tai_s = np.linspace(0.0, 86400.0, 7)
    orientation = EarthOrientation(0.3, 0.1, 0.4)
    r_teme_m = teme_from_itrs(station_itrs_m(STATION), tai_s, orientation)
    v_teme_m_s = np.cross([0.0, 0.0, EARTH_RATE_RAD_S], r_teme_m)
    r_itrs_m, v_itrs_m_s = itrs_from_teme(r_teme_m, v_teme_m_s, tai_s, orientation)
    assert np.max(np.abs(v_itrs_m_s)) < 1e-9
    assert np.max(np.abs(r_itrs_m - station_itrs_m(STATION))) < 1e-6


@needs_data
def test_look_angles_and_rates_of_100_real_satellites_are_those_of_skyfield() -> None:
    sets, _ = parse_tle(LIST.read_text(), LIST.name)
    lines = [line for line in LIST.read_text().splitlines() if line.startswith(("1 ", "2 "))]
    timescale = load.timescale(builtin=True)
    rng = np.random.default_rng(20181107)
    worst_deg, worst_deg_s, worst_range_m = 0.0, 0.0, 0.0
    for k, elements in enumerate(sets[:100]):
        station = Station("any", float(rng.uniform(-89, 89)), float(rng.uniform(-180, 180)), float(rng.uniform(0, 3e3)))
        tai_s = elements.epoch_tai_s + float(rng.uniform(0.0, 2 * 86400.0))
        at = timescale.tai_jd(2451545.0, tai_s / 86400.0)
        topos = wgs84.latlon(station.latitude_deg, station.longitude_deg, station.height_m)
        satellite = EarthSatellite(lines[2 * k], lines[2 * k + 1], None, timescale)
        el, az, distance, el_rate, az_rate, _ = (satellite - topos).at(at).frame_latlon_and_rates(topos)
        ours = look_at(
            Sgp4Propagator(elements), np.array([tai_s]), Site(station, EarthOrientation(ut1_utc_s=float(at.dut1)))
        )
        angle_deg = sky_angle_deg(az.degrees, el.degrees, float(ours.az_deg[0]), float(ours.el_deg[0]))
        rate_deg_s = max(
            abs(float(ours.el_rate_deg_s[0]) - el_rate.degrees.per_second),
            abs(float(ours.az_rate_deg_s[0]) - az_rate.degrees.per_second) * np.cos(el.radians),
        )
        worst_deg, worst_deg_s = max(worst_deg, angle_deg), max(worst_deg_s, rate_deg_s)
        worst_range_m = max(worst_range_m, abs(float(ours.range_m[0]) - distance.m))
    assert len(sets) >= 100
    assert worst_deg < SKYFIELD_DEG
    assert worst_deg_s < SKYFIELD_DEG_S
    assert worst_range_m < 1.0


@needs_data
def test_rates_are_the_derivatives_of_the_angles() -> None:
    sets, _ = parse_tle(LIST.read_text(), LIST.name)
    site = Site(STATION, EarthOrientation(0.03))
    for elements in sets[::10]:
        tai_s = elements.epoch_tai_s + np.linspace(0.0, 20000.0, 400)
        before, seen, after = (look_at(Sgp4Propagator(elements), tai_s + shift, site) for shift in (-0.05, 0.0, 0.05))
        az_rate = ((after.az_deg - before.az_deg + 180.0) % 360.0 - 180.0) / 0.1
        el_rate = (after.el_deg - before.el_deg) / 0.1
        assert np.max(np.abs(el_rate - seen.el_rate_deg_s)) < DIFFERENCE_DEG_S
        across = np.cos(np.radians(seen.el_deg))
        assert np.max(np.abs(az_rate - seen.az_rate_deg_s) * across) < DIFFERENCE_DEG_S


@given(az_deg=st.floats(0.0, 359.999), el_deg=st.floats(-89.9, 89.9), lat_deg=st.floats(-90, 90))
def test_a_direction_put_up_in_the_sky_is_seen_there(az_deg: float, el_deg: float, lat_deg: float) -> None:
    station = Station("any", lat_deg, 12.0, 0.0)
    az, el, lat, lon = np.radians([az_deg, el_deg, lat_deg, 12.0])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    direction = np.cos(el) * (np.sin(az) * east + np.cos(az) * np.cross(up, east)) + np.sin(el) * up
    seen = look((station_itrs_m(station) + 1e6 * direction)[None, :], np.zeros((1, 3)), station)
    assert sky_angle_deg(az_deg, el_deg, float(seen.az_deg[0]), float(seen.el_deg[0])) < 1e-9
    assert 0.0 <= seen.az_deg[0] < 360.0
    assert seen.range_m[0] == pytest.approx(1e6)


def test_exactly_overhead_everything_stays_finite() -> None:
    station = Station("pole", 90.0, 0.0, 0.0)
    r_itrs_m = station_itrs_m(station) * 1.1
    r_itrs_m[:2] = station_itrs_m(station)[:2]
    seen = look(r_itrs_m[None, :], np.array([[7e3, 0.0, 0.0]]), station)
    assert seen.el_deg[0] == pytest.approx(90.0)
    assert np.isfinite([seen.az_deg[0], seen.az_rate_deg_s[0], seen.el_rate_deg_s[0]]).all()


@pytest.mark.parametrize("source", [iss(), circular(), circular(e=0.04)])
@pytest.mark.parametrize("span_s", [1.5, 90.0, 600.0])
def test_a_stretch_of_path_is_interpolated_to_a_centimetre(source: Propagator, span_s: float) -> None:
    tai_s = source.epoch_tai_s + np.linspace(0.0, span_s, 900)
    seen, along = look_at(source, tai_s, Site(STATION)), look_along(source, tai_s, Site(STATION))
    east_deg = wrap_180_array(along.az_deg - seen.az_deg) * np.cos(np.radians(seen.el_deg))
    off_m = np.radians(np.hypot(east_deg, along.el_deg - seen.el_deg)) * seen.range_m
    assert off_m.max() < 0.01
    assert np.abs(along.el_rate_deg_s - seen.el_rate_deg_s).max() < 1e-7


@given(st.floats(0.0, 360.0), st.floats(0.0, 90.0))
def test_one_direction_before_and_beyond_the_zenith_is_no_angle_apart(az_deg: float, el_deg: float) -> None:
    assert sky_angle_deg(az_deg, el_deg, az_deg + 180.0, 180.0 - el_deg) < 1e-5


def skyfields_signal(satellite: EarthSatellite, station: Station, tai_s: float) -> tuple[float, float]:
    """Azimuth and elevation where the signal comes from: light time by steps in GCRS, then Skyfield's aberration."""
    timescale = load.timescale(builtin=True)
    topos = wgs84.latlon(station.latitude_deg, station.longitude_deg, station.height_m)
    here = topos.at(timescale.tai_jd(2451545.0, tai_s / 86400.0))
    light_s = 0.0
    for _ in range(4):
        left = satellite.at(timescale.tai_jd(2451545.0, (tai_s - light_s) / 86400.0))
        way_km = left.position.km - here.position.km
        light_s = float(np.linalg.norm(way_km)) / LIGHT_KM_S
    position_au = way_km / AU_KM
    add_aberration(position_au, here.velocity.au_per_d, light_s / 86400.0)
    east_north = topos.rotation_at(here.t) @ position_au  # north, east, up
    north, east, up = (float(one) for one in east_north)
    return np.degrees(np.arctan2(east, north)) % 360.0, np.degrees(np.arctan2(up, np.hypot(north, east)))


@needs_data
def test_where_the_signal_comes_from_is_where_skyfield_says_with_light_time_and_aberration() -> None:
    sets, _ = parse_tle(LIST.read_text(), LIST.name)
    lines = [line for line in LIST.read_text().splitlines() if line.startswith(("1 ", "2 "))]
    timescale = load.timescale(builtin=True)
    rng = np.random.default_rng(7)
    worst_deg, farthest_deg = 0.0, 0.0
    for k, elements in enumerate(sets[:60]):
        station = Station("any", float(rng.uniform(-80, 80)), float(rng.uniform(-180, 180)), float(rng.uniform(0, 3e3)))
        tai_s = elements.epoch_tai_s + float(rng.uniform(0.0, 86400.0))
        at = timescale.tai_jd(2451545.0, tai_s / 86400.0)
        topos = wgs84.latlon(station.latitude_deg, station.longitude_deg, station.height_m)
        satellite = EarthSatellite(lines[2 * k], lines[2 * k + 1], None, timescale)
        el, az, _ = (satellite - topos).at(at).altaz()
        theirs = skyfields_signal(satellite, station, tai_s)
        site = Site(station, EarthOrientation(ut1_utc_s=float(at.dut1)))
        geometric, late = (
            look_at(Sgp4Propagator(elements), np.array([tai_s]), replace(site, has_light_time=is_late))
            for is_late in (False, True)
        )
        shift = np.array([theirs[0] - az.degrees, theirs[1] - el.degrees])
        ours = np.array([late.az_deg[0] - geometric.az_deg[0], late.el_deg[0] - geometric.el_deg[0]])
        off = (ours - shift) * (np.cos(el.radians), 1.0)
        off[0] = wrap_180_array(off[:1])[0]
        worst_deg = max(worst_deg, float(np.hypot(*off)))
        farthest_deg = max(farthest_deg, sky_angle_deg(az.degrees, el.degrees, *theirs))
    assert 1e-3 < farthest_deg < 2e-3
    assert worst_deg < LIGHT_TIME_DEG


@pytest.mark.parametrize("source", [iss(), circular()])
def test_a_stretch_of_path_has_the_same_light_time_as_single_points(source: Propagator) -> None:
    site = Site(STATION, has_light_time=True)
    tai_s = source.epoch_tai_s + np.linspace(0.0, 90.0, 900)
    single, along = look_at(source, tai_s, site), look_along(source, tai_s, site)
    plain = look_at(source, tai_s, Site(STATION))
    assert np.abs(along.el_deg - single.el_deg).max() < 1e-6
    assert np.abs(plain.el_deg - single.el_deg).max() > 1e-4
