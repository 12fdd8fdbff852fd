"""assist.estimators.inversion: azimuth and elevation to node and mean anomaly, Kuga and Carrara 1990 eqs 1-16."""

import numpy as np
import pytest

from acu_daemon.assist.estimators.inversion import (
    BEYOND_LATITUDE,
    NO_INTERSECTION,
    KnownElements,
    direction_cosines,
    invert,
)
from acu_daemon.model import Station
from acu_daemon.orbit.frames import station_itrs_m
from acu_daemon.orbit.kepler import OsculatingElements, state_from_elements
from acu_daemon.orbit.look import look

A_M = 7180e3
TOLERANCE_RAD = 1e-8  # 0.1 m at the satellite
ORBITS = [(23.82, 0.0436), (51.6, 0.0), (63.4, 0.05), (90.0, 0.01), (98.2, 0.0001), (144.0, 0.05)]


def _known(e: float, i_deg: float, argp_deg: float = 15.47) -> KnownElements:
    return KnownElements(*(np.array([x]) for x in (A_M, e, np.radians(i_deg), np.radians(argp_deg))))


def _apart(a_rad: float, b_rad: float) -> float:
    return abs((a_rad - b_rad + np.pi) % (2 * np.pi) - np.pi)


@pytest.mark.parametrize(("i_deg", "e"), ORBITS)
@pytest.mark.parametrize("mean_anomaly_deg", [0.0, 30.0, 45.0, 110.0, 170.0, 215.0, 300.0])
def test_a_direction_made_from_known_elements_gives_them_back(i_deg, e, mean_anomaly_deg):
    raan, mean_anomaly, sidereal = np.radians([240.14, mean_anomaly_deg, 77.0])
    elements = OsculatingElements(
        *(np.array([x]) for x in (A_M, e, np.radians(i_deg), raan, np.radians(15.47), mean_anomaly))
    )
    r_m, v_m_s = state_from_elements(elements)
    c, s = np.cos(sidereal), np.sin(sidereal)
    fixed_m = r_m @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]).T
    x, y, z = fixed_m[0]
    for d_lat, d_lon in ((0.5, 0.5), (-8.0, 3.0), (6.0, -9.0)):
        station = Station(
            "", np.degrees(np.arctan2(z, np.hypot(x, y))) + d_lat, np.degrees(np.arctan2(y, x)) + d_lon, 300.0
        )
        seen = look(fixed_m, v_m_s, station)
        found = invert(
            direction_cosines(seen.az_deg, seen.el_deg, station),
            station_itrs_m(station),
            np.array([sidereal]),
            _known(e, i_deg),
            np.array([A_M]),  # wrong by up to e a: the iteration of eq 16 finds the radius
            np.array([raan + 0.01]),
        )
        assert found.reasons == (None,)
        assert _apart(found.raan_rad[0], raan) < TOLERANCE_RAD
        assert _apart(found.mean_anomaly_rad[0], mean_anomaly) < TOLERANCE_RAD
        assert found.radius_m[0] == pytest.approx(np.linalg.norm(r_m), abs=0.1)


def test_the_prior_node_chooses_the_ascending_or_the_descending_branch():
    """The same direction fits two orbits; their arguments of latitude are supplements (circular orbit)."""
    station = Station("", 0.0, 0.0, 0.0)
    direction = direction_cosines(np.array([30.0]), np.array([40.0]), station)
    known = _known(0.0, 50.0, 0.0)

    def branch(prior_rad: float) -> tuple[float, float]:
        found = invert(direction, station_itrs_m(station), np.zeros(1), known, np.array([A_M]), np.array([prior_rad]))
        return float(found.raan_rad[0]), float(found.mean_anomaly_rad[0])

    (raan_up, u_up), (raan_down, u_down) = branch(0.0), branch(np.pi)
    assert abs(u_up) < np.pi / 2 < abs(u_down)
    assert _apart(u_up + u_down, np.pi) < 1e-12
    assert _apart(raan_up, raan_down) > 1.0


def test_a_direction_beyond_the_highest_latitude_is_refused_with_a_reason():
    station = Station("", 70.0, 0.0, 0.0)
    found = invert(
        direction_cosines(np.array([0.0, 180.0]), np.array([60.0, 30.0]), station),
        station_itrs_m(station),
        np.zeros(2),
        _known(0.0, 66.0),
        np.full(2, A_M),
        np.zeros(2),
    )
    assert found.reasons == (BEYOND_LATITUDE, None)
    assert np.isnan(found.raan_rad[0])
    assert np.isfinite(found.raan_rad[1])


def test_a_line_of_sight_that_misses_the_orbits_sphere_is_refused_with_a_reason():
    station = Station("", 10.0, 0.0, 0.0)
    found = invert(
        direction_cosines(np.array([90.0]), np.array([10.0]), station),
        station_itrs_m(station),
        np.zeros(1),
        KnownElements(*(np.array([x]) for x in (6300e3, 0.0, 1.0, 0.0))),
        np.array([6300e3]),
        np.zeros(1),
    )
    assert found.reasons == (NO_INTERSECTION,)


def test_an_equatorial_orbit_is_refused_and_not_divided_by_zero():
    station = Station("", 0.0, 0.0, 0.0)
    found = invert(
        direction_cosines(np.array([10.0]), np.array([60.0]), station),
        station_itrs_m(station),
        np.zeros(1),
        _known(0.0, 0.0),
        np.array([A_M]),
        np.zeros(1),
    )
    assert found.reasons[0] is not None
