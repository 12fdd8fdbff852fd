"""Angles across the elevation count by cos(el), at every elevation and not only low down where the two are alike."""

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site
from real_passes import sky_angles_deg

from acu_daemon.assist.estimators.full.estimated_states import STATE_COUNT
from acu_daemon.assist.estimators.full.normal_points import residuals, sights
from acu_daemon.assist.estimators.full.path_partials import Curve
from acu_daemon.assist.estimators.inversion import KnownElements, direction_cosines, invert
from acu_daemon.assist.estimators.kalman import Estimate, FilterState, linearise, sweep
from acu_daemon.assist.reading_gate import OUTLIER
from acu_daemon.assist.screening.offsets import angles_deg, offsets
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings, Site, Station, sky_angle_deg
from acu_daemon.orbit.frames import itrs_from_teme, station_itrs_m
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.timescales import gmst_rad
from acu_daemon.units import DEG

SOURCE = circular(66.0, 0.01)
AT = np.array([EPOCH_TAI_S])
ASIDE_DEG = np.geomspace(0.02, 24.0, 14)  # of the station from the satellite's ground point: 89.8 to 2 deg high
BEARINGS_DEG = (0.0, 77.0, 190.0, 301.0)
TURNS_DEG = tuple(range(0, 360, 30))  # directions on the sky: 0 is up, 90 is right
SETTINGS = EstimatorSettings(0.03, 0.03, max_fit_elevation_deg=90.0)


def seen_from(where: Site) -> tuple[float, float]:
    """Azimuth and elevation of the satellite."""
    look = look_at(SOURCE, AT, where)
    return float(look.az_deg[0]), float(look.el_deg[0])


ALL = [site(a * np.sin(b * DEG), a * np.cos(b * DEG)) for a in ASIDE_DEG for b in BEARINGS_DEG]
places = pytest.mark.parametrize("where", ALL)
places_not_overhead = pytest.mark.parametrize("where", [one for one in ALL if seen_from(one)[1] < 85.0])


def beside(az_deg: float, el_deg: float, off_deg: float, turn_deg: float) -> tuple[float, float]:
    """The direction that is off_deg from another one, by rotation of vectors."""
    az, el, off, turn = np.radians([az_deg, el_deg, off_deg, turn_deg])
    ahead = np.array([np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)])
    right = np.array([np.cos(az), -np.sin(az), 0.0])
    up = np.cross(right, ahead)
    east, north, height = np.cos(off) * ahead + np.sin(off) * (np.sin(turn) * right + np.cos(turn) * up)
    return float(np.degrees(np.arctan2(east, north))) % 360.0, float(np.degrees(np.arcsin(height)))


def test_the_places_are_from_the_horizon_to_the_zenith() -> None:
    elevations = [seen_from(site(0.0, aside))[1] for aside in ASIDE_DEG]
    assert min(elevations) < 5.0
    assert max(elevations) > 89.0
    assert np.abs(np.diff(sorted(elevations))).max() < 20.0


@places
def test_the_angle_between_two_directions_is_that_of_their_vectors(where: Site) -> None:
    az_deg, el_deg = seen_from(where)
    for turn_deg in TURNS_DEG:
        for off_deg in (1e-3, 0.3, 20.0):
            assert sky_angle_deg(az_deg, el_deg, *beside(az_deg, el_deg, off_deg, turn_deg)) == pytest.approx(
                off_deg, rel=1e-6
            )


@places
def test_how_far_a_reading_is_off_the_path_does_not_depend_on_its_elevation(where: Site) -> None:
    """So what is ours and what is not has the same room everywhere."""
    az_deg, el_deg = seen_from(where)
    off_deg = min(0.15, 0.05 * (90.0 - el_deg))  # small beside the way to the zenith, where right and up turn
    for turn_deg in TURNS_DEG:
        az, el = beside(az_deg, el_deg, off_deg, turn_deg)
        readings = Readings(AT, np.array([az]), np.array([el]))
        seen = offsets(SOURCE, where, None, readings, SETTINGS)
        assert seen.angle_deg[0] == pytest.approx(off_deg, rel=0.05)
        assert angles_deg(SOURCE, where, None, readings)[0] == pytest.approx(off_deg, rel=0.05)
        assert seen.right_deg[0] == pytest.approx(off_deg * np.sin(turn_deg * DEG), abs=0.06 * off_deg)
        assert seen.up_deg[0] == pytest.approx(off_deg * np.cos(turn_deg * DEG), abs=0.06 * off_deg)


@pytest.mark.parametrize("aside_deg", ASIDE_DEG[3:])
def test_what_is_near_the_path_is_near_at_every_elevation(aside_deg: float) -> None:
    where = site(0.0, aside_deg)
    az_deg, el_deg = seen_from(where)
    for turn_deg in TURNS_DEG:
        near = []
        for off_deg in (0.17, 0.22):  # a fifth of the beam is near
            az, el = beside(az_deg, el_deg, off_deg, turn_deg)
            seen = offsets(SOURCE, where, None, Readings(AT, np.array([az]), np.array([el])), SETTINGS)
            near.append(bool(seen.is_near[0]))
        assert near == [True, False]


@places
def test_a_direction_is_inverted_to_the_elements_it_was_made_from(where: Site) -> None:
    az_deg, el_deg = seen_from(where)
    r_m, v_m_s = SOURCE.states_teme(AT)
    own = osculating_from_state(r_m, v_m_s)
    found = invert(
        direction_cosines(np.array([az_deg]), np.array([el_deg]), where.station),
        station_itrs_m(where.station),
        gmst_rad(AT, 0.0),
        KnownElements(own.a_m, own.e, own.i_rad, own.argp_rad),
        np.array([7180e3]),
        own.raan_rad + 0.01,
    )
    assert found.raan_rad[0] == pytest.approx(own.raan_rad[0], abs=1e-7)
    assert (found.mean_anomaly_rad[0] - own.mean_anomaly_rad[0] + np.pi) % (2 * np.pi) - np.pi == pytest.approx(
        0.0, abs=1e-7
    )


@pytest.mark.parametrize("el_deg", [0.0, 15.0, 45.0, 70.0, 85.0, 89.0])
def test_a_direction_made_of_angles_is_the_vector_of_the_rotations(el_deg: float) -> None:
    for az_deg in (0.0, 100.0, 260.0):
        station = Station("", 40.0, -70.0, 0.0)
        lat, lon = np.radians([40.0, -70.0])
        up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
        north = (np.array([0.0, 0.0, 1.0]) - up * np.sin(lat)) / np.cos(lat)
        east = np.cross(north, up)
        az, el = np.radians([az_deg, el_deg])
        flat = np.cos(az) * north + np.sin(az) * east
        assert np.allclose(
            direction_cosines(np.array([az_deg]), np.array([el_deg]), station)[0], np.cos(el) * flat + np.sin(el) * up
        )


@places_not_overhead
def test_the_filter_weighs_both_angles_of_a_reading_as_on_the_sky(where: Site) -> None:
    """Against weighted least squares on the sky with the prior, solved as a matrix."""
    az_deg, el_deg = seen_from(where)
    az, el = beside(az_deg, el_deg, 0.05, 60.0)
    prior = Estimate(0.0, 0.0, (0.02 * DEG) ** 2, 0.0, (0.05 * DEG) ** 2)
    line = linearise(SOURCE, 0.0, 0.0, AT, where)
    after, reasons = sweep(FilterState(prior), Readings(AT, np.array([az]), np.array([el])), line, SETTINGS)
    assert reasons == [None]
    cos_el = np.cos(el * DEG)
    d_az = (az - az_deg + 180.0) % 360.0 - 180.0
    rows = np.array(
        [
            [line.az_by_raan[0] * cos_el, line.az_by_mean_anomaly[0] * cos_el],
            [line.el_by_raan[0], line.el_by_mean_anomaly[0]],
        ]
    ) / (0.03 * DEG)
    seen = np.array([d_az * cos_el, el - el_deg]) / 0.03
    information = rows.T @ rows + np.diag([1.0 / prior.p_rr, 1.0 / prior.p_mm])
    covariance = np.linalg.inv(information)
    assert np.allclose(after.estimate[:2], covariance @ rows.T @ seen, rtol=1e-6, atol=1e-12)
    assert np.allclose(after.estimate[2:], [covariance[0, 0], covariance[0, 1], covariance[1, 1]], rtol=1e-6)


@places_not_overhead
def test_the_filter_takes_a_reading_for_an_outlier_by_its_angle_on_the_sky(where: Site) -> None:
    sure = FilterState(Estimate(0.0, 0.0, 1e-14, 0.0, 1e-14))
    line = linearise(SOURCE, 0.0, 0.0, AT, where)
    az_deg, el_deg = line.az / DEG, line.el / DEG
    for across_deg, up_deg in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        verdicts = []
        for off_deg in (0.48, 0.52):  # half the beam is far
            right_deg = off_deg * across_deg / np.cos(el_deg * DEG)
            readings = Readings(AT, az_deg + right_deg, el_deg + off_deg * up_deg)
            verdicts += sweep(sure, readings, line, SETTINGS)[1]
        assert verdicts == [None, OUTLIER]


@places_not_overhead
def test_residuals_and_their_noise_are_angles_on_the_sky(where: Site) -> None:
    """With the part of the noise that grows towards the horizon, which is off by default."""
    az_deg, el_deg = seen_from(where)
    settings = EstimatorSettings(0.03, 0.05, sigma_elevation_cot_deg=0.02)
    node_tai_s = EPOCH_TAI_S + np.array([-20.0, 0.0, 20.0])
    r_m, v_m_s = SOURCE.states_teme(node_tai_s)
    fixed_m, fixed_m_s = itrs_from_teme(r_m, v_m_s, node_tai_s, where.orientation)
    path = Curve.through(node_tai_s, fixed_m.T, fixed_m_s.T)
    for turn_deg in TURNS_DEG:
        az, el = beside(az_deg, el_deg, 0.05, turn_deg)
        left = residuals(
            path, where, np.zeros(STATE_COUNT), settings, sights(Readings(AT, np.array([az]), np.array([el])))
        )
        right_deg, up_deg = left.off_rad[:, 0] / DEG
        assert right_deg == pytest.approx(0.05 * np.sin(turn_deg * DEG), abs=0.003)
        assert up_deg == pytest.approx(0.05 * np.cos(turn_deg * DEG), abs=0.003)
        sigma_deg = left.noise_rad[:, 0] / left.noise_scale / DEG
        assert np.allclose(sigma_deg, [0.03, 0.05 + 0.02 / np.tan(el_deg * DEG)], rtol=1e-3)


def test_the_angles_here_are_those_of_the_other_tests() -> None:
    assert sky_angles_deg(10.0, 60.0, *beside(10.0, 60.0, 0.7, 33.0)) == pytest.approx(0.7, rel=1e-6)
