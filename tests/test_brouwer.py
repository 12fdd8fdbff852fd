"""Brouwer's theory against a numerical integration of the J2-J4 problem, and against published rates."""

import pickle

import numpy as np
import pytest
from sgp4.api import WGS72, Satrec

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction, Site, Station
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator, secular_rates
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, J2, J3, J4, MU_M3_S2

ONE_ORBIT_KM = 0.15  # first-order short-period terms, J2 and J4
ONE_DAY_ALONG_KM = 1.5  # second order of the mean motion: the mean axis is good to J2^2
ONE_DAY_ACROSS_KM = 0.03  # node and inclination
ONE_DAY_WITH_J3_KM = 2.5
SGP4_CONSTANTS = 2e-7  # of the mean motion: WGS72 against ours; the J2^2 and J4 terms are four to ten times that
STEP_S = 20.0
SYNODIC_S = 6500.0
SCD_1 = BrouwerElements(
    "SCD-1",
    tai_from_utc("1989-01-31T09:58:00Z"),
    7180e3,
    0.0436,
    *np.radians([23.82, 240.14, 15.47, 350.56]).tolist(),
)


ALCANTARA = Station("Alcantara", -2.18, -44.26, 39.0)
CUIABA = Station("Cuiaba", -15.53, -56.07, 277.0)


def elements(a_km: float, e: float, i_deg: float) -> BrouwerElements:
    return BrouwerElements("test", 0.0, a_km * 1e3, e, float(np.radians(i_deg)), 4.19, 0.27, 6.1)


ORBITS = [
    elements(7180, 0.0436, 23.82),
    elements(7000, 0.001, 98.0),
    elements(7714, 0.0008, 66.0),
    elements(9000, 0.2, 50.0),
    elements(7000, 0.0, 45.0),
]


def acceleration_m_s2(r_m: np.ndarray, j3: float) -> np.ndarray:
    """Gradient of mu/r [1 - sum Jn (R/r)^n Pn(sin latitude)], n = 2, 3, 4, for (N, 3)."""
    r = np.linalg.norm(r_m, axis=1)
    s = r_m[:, 2] / r
    radial, southing = -MU_M3_S2 / r**2, np.zeros_like(r)
    terms = [
        (2, J2, (3 * s**2 - 1) / 2, 3 * s),
        (3, j3, (5 * s**3 - 3 * s) / 2, (15 * s**2 - 3) / 2),
        (4, J4, (35 * s**4 - 30 * s**2 + 3) / 8, (140 * s**3 - 60 * s) / 8),
    ]
    for n, j, p, dp in terms:
        scale = MU_M3_S2 / r**2 * j * (EARTH_EQUATORIAL_RADIUS_M / r) ** n
        radial, southing = radial + (n + 1) * scale * p, southing - scale * dp
    unit = r_m / r[:, None]
    return radial[:, None] * unit + southing[:, None] * (np.array([0.0, 0.0, 1.0]) - s[:, None] * unit)


def integrated(orbits: list[BrouwerElements], duration_s: float, j3: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (N,) and true states (N, orbits, 6) from the propagators' own start, by Runge-Kutta of fourth order."""
    starts = [BrouwerPropagator(orbit).states_teme(np.zeros(1)) for orbit in orbits]
    y = np.array([np.concatenate([r[0], v[0]]) for r, v in starts])

    def rate(y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[:, 3:], acceleration_m_s2(y[:, :3], j3)], axis=1)

    states = [y]
    for _ in range(int(duration_s / STEP_S)):
        k1 = rate(y)
        k2 = rate(y + STEP_S / 2 * k1)
        k3 = rate(y + STEP_S / 2 * k2)
        k4 = rate(y + STEP_S * k3)
        y = y + STEP_S / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append(y)
    return np.arange(len(states)) * STEP_S, np.array(states)


@pytest.mark.long
def test_the_theory_follows_the_integrated_j2_j4_problem_for_an_orbit_and_for_a_day() -> None:
    times, truth = integrated(ORBITS, DAY_S, j3=0.0)
    for k, orbit in enumerate(ORBITS):
        r_m, v_m_s = BrouwerPropagator(orbit).states_teme(times)
        miss_km = (r_m - truth[:, k, :3]) / 1e3
        pole = np.cross(truth[:, k, :3], truth[:, k, 3:])
        across_km = np.sum(miss_km * pole, axis=1) / np.linalg.norm(pole, axis=1)
        first = times < 6000.0
        assert np.max(np.linalg.norm(miss_km[first], axis=1)) < ONE_ORBIT_KM
        assert np.max(np.linalg.norm(v_m_s[first] - truth[first, k, 3:], axis=1)) < 0.15
        assert np.max(np.linalg.norm(miss_km, axis=1)) < ONE_DAY_ALONG_KM
        assert np.max(np.abs(across_km)) < ONE_DAY_ACROSS_KM


@pytest.mark.long
def test_the_odd_harmonic_left_out_costs_little_in_a_day() -> None:
    times, truth = integrated(ORBITS, DAY_S, j3=J3)
    for k, orbit in enumerate(ORBITS):
        r_m, _ = BrouwerPropagator(orbit).states_teme(times)
        assert np.max(np.linalg.norm(r_m - truth[:, k, :3], axis=1)) < ONE_DAY_WITH_J3_KM * 1e3


def test_without_short_period_terms_the_mean_orbit_is_followed() -> None:
    times = np.linspace(0.0, 6000.0, 100)
    full, _ = BrouwerPropagator(ORBITS[1]).states_teme(times)
    mean, _ = BrouwerPropagator(ORBITS[1], short_period=False).states_teme(times)
    assert np.linalg.norm(mean, axis=1) == pytest.approx(7000e3, rel=1.01e-3)
    assert 3e3 < np.max(np.linalg.norm(full - mean, axis=1)) < 20e3


@pytest.mark.parametrize("i_deg", [3.0, 51.6, 66.0, 98.6, 120.0, 180.0])
def test_the_secular_rates_of_nearly_circular_orbits_are_those_of_sgp4(i_deg: float) -> None:
    e, inclination = 0.0005, float(np.radians(i_deg))
    satrec = Satrec()
    satrec.sgp4init(WGS72, "i", 0, 20000.0, 0.0, 0.0, 0.0, e, 0.0, inclination, 0.0, 0.06, 0.0)
    a_m = satrec.a * 6378.135e3
    ours, n_rad_s = secular_rates(a_m, e, inclination), (MU_M3_S2 / a_m**3) ** 0.5
    n_rad_min = satrec.xke / satrec.a**1.5
    assert ours.raan_rad_s / n_rad_s == pytest.approx(satrec.nodedot / n_rad_min, abs=SGP4_CONSTANTS)
    assert ours.argp_rad_s / n_rad_s == pytest.approx(satrec.argpdot / n_rad_min, abs=SGP4_CONSTANTS)
    assert ours.mean_anomaly_rad_s / n_rad_s == pytest.approx(satrec.mdot / n_rad_min, abs=SGP4_CONSTANTS)


def test_a_sun_synchronous_node_follows_the_sun() -> None:
    # Vallado, section 11.4: 0.9856 deg a day at 98.6 deg and 800 km height, by J2 alone; J2^2 and J4 take 0.3 %
    rates = secular_rates(7178.137e3, 0.0, float(np.radians(98.6)))
    assert np.degrees(rates.raan_rad_s) * DAY_S == pytest.approx(0.9856, rel=0.004)


def test_the_perigee_stands_still_at_the_critical_inclination() -> None:
    rates = secular_rates(26562e3, 0.74, float(np.arccos(np.sqrt(0.2))))
    assert abs(np.degrees(rates.argp_rad_s) * DAY_S) < 2e-4


def test_a_correction_acts_on_the_mean_node_and_anomaly_and_replaces_the_one_before() -> None:
    propagator = BrouwerPropagator(SCD_1)
    at = propagator.epoch_tai_s + np.arange(10) * 60.0
    moved = propagator.corrected(Correction(0.3, 0.1)).corrected(Correction(0.01, -0.02))
    before, after = propagator.mean_elements(at), moved.mean_elements(at)
    assert after.raan_rad - before.raan_rad == pytest.approx(0.01)
    assert after.mean_anomaly_rad - before.mean_anomaly_rad == pytest.approx(-0.02)
    assert np.array_equal(moved.corrected(Correction()).states_teme(at), propagator.states_teme(at))
    assert np.array_equal(pickle.loads(pickle.dumps(moved)).states_teme(at), moved.states_teme(at))


def test_what_is_no_ellipse_or_no_time_is_an_orbit_error() -> None:
    with pytest.raises(OrbitError, match="test: not an ellipse"):
        BrouwerPropagator(elements(7000, 1.2, 10.0))
    with pytest.raises(OrbitError, match="not finite"):
        BrouwerPropagator(SCD_1).states_teme(np.array([np.nan]))


@pytest.mark.parametrize(
    ("station", "number", "duration_s", "elevation_deg"),
    [
        (ALCANTARA, 2, 450, 15.9),
        (ALCANTARA, 6, 587, 12.3),
        (ALCANTARA, 7, 925, 36.8),
        (CUIABA, 9, 1018, 60.4),
    ],
)
def test_the_passes_of_the_papers_come_out_as_printed(
    station: Station, number: int, duration_s: float, elevation_deg: float
) -> None:
    # Kuga and Carrara 1990, table 1: numerical, from these elements; the number counts revolutions over the ground
    passes = find_passes(BrouwerPropagator(SCD_1), Site(station), SCD_1.epoch_tai_s, SCD_1.epoch_tai_s + DAY_S, 5.0)
    [found] = [one for one in passes if 1 + round((one.rise_tai_s - SCD_1.epoch_tai_s) / SYNODIC_S) == number]
    assert found.duration_s == pytest.approx(duration_s, abs=5.0)
    assert found.culmination_el_deg == pytest.approx(elevation_deg, rel=0.04)
