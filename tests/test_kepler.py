"""Kepler's equation, and elements to and from states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.orbit.kepler import OsculatingElements, osculating_from_state, solve_kepler, state_from_elements

VALLADO_MU_M3_S2 = 3.986004418e14


@given(m=st.floats(-100.0, 100.0), e=st.floats(0.0, 0.99))
def test_the_eccentric_anomaly_satisfies_keplers_equation(m: float, e: float) -> None:
    anomaly = solve_kepler(np.array([m]), np.array([e]))
    assert anomaly - e * np.sin(anomaly) == pytest.approx(m, abs=1e-12 + 1e-15 * abs(m))


def test_keplers_equation_is_solved_as_in_vallados_example() -> None:
    # Vallado, example 2-1: M 235.4 deg, e 0.4, E 220.512074767522 deg
    anomaly = solve_kepler(np.radians([235.4]), np.array([0.4]))
    assert np.degrees(anomaly) == pytest.approx(220.512074767522, abs=1e-10)


@pytest.mark.parametrize(("m", "e"), [(np.nan, 0.1), (1.0, 1.0), (1.0, -0.1), (1.0, np.nan), (np.inf, 0.1)])
def test_what_is_no_ellipse_is_refused(m: float, e: float) -> None:
    with pytest.raises(ValueError, match="finite anomalies and eccentricities"):
        solve_kepler(np.array([m]), np.array([e]))


def test_elements_come_out_of_a_state_as_in_vallados_example() -> None:
    # Vallado, example 2-5
    r_m, v_m_s = np.array([[6524.834, 6862.875, 6448.296]]) * 1e3, np.array([[4.901327, 5.533756, -1.976341]]) * 1e3
    orbit = osculating_from_state(r_m, v_m_s, VALLADO_MU_M3_S2)
    assert orbit.a_m == pytest.approx(36127.343e3, rel=1e-6)
    assert orbit.e == pytest.approx(0.832853, abs=1e-6)
    angles_deg = np.degrees([orbit.i_rad[0], orbit.raan_rad[0], orbit.argp_rad[0]])
    assert angles_deg == pytest.approx([87.870, 227.898, 53.38], abs=0.005)


def test_states_and_elements_are_inverse_for_every_ellipse() -> None:
    rng = np.random.default_rng(1)
    count = 20000
    orbit = OsculatingElements(
        rng.uniform(6.6e6, 4e7, count),
        rng.uniform(0.0, 0.95, count),
        rng.uniform(0.0, np.pi, count),
        *rng.uniform(0.0, 2 * np.pi, (3, count)),
    )
    r_m, v_m_s = state_from_elements(orbit)
    again = osculating_from_state(r_m, v_m_s)
    assert np.max(np.abs(again.e - orbit.e)) < 1e-13
    assert np.max(np.abs(again.a_m / orbit.a_m - 1.0)) < 1e-12
    r2_m, v2_m_s = state_from_elements(again)
    assert np.max(np.abs(r2_m - r_m)) < 1e-5
    assert np.max(np.abs(v2_m_s - v_m_s)) < 1e-7


def test_circular_and_equatorial_orbits_come_back_as_states() -> None:
    zero, pi = np.zeros(3), np.full(3, np.pi)
    orbit = OsculatingElements(np.full(3, 7e6), zero, np.array([0.0, 1.0, np.pi]), zero, zero + 0.5, pi / 3)
    r_m, v_m_s = state_from_elements(orbit)
    r2_m, v2_m_s = state_from_elements(osculating_from_state(r_m, v_m_s))
    assert np.max(np.abs(r2_m - r_m)) < 1e-5
    assert np.max(np.abs(v2_m_s - v_m_s)) < 1e-7


def test_a_state_that_escapes_has_no_elements() -> None:
    with pytest.raises(ValueError, match="not on an elliptic orbit"):
        osculating_from_state(np.array([[7e6, 0.0, 0.0]]), np.array([[0.0, 12e3, 0.0]]))
