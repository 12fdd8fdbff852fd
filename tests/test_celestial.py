"""Celestial frames against Skyfield, which has the full IAU 2000A nutation and IAU 2006 precession."""

import numpy as np
import pytest
from skyfield.api import load
from skyfield.sgp4lib import TEME

from acu_daemon.orbit.celestial import teme_from_eme2000, teme_from_gcrf, teme_from_tod
from acu_daemon.units import ARCSEC, DAY_S, Array

YEAR_S = 365.25 * DAY_S
RIGHT_ARCSEC = 0.01  # 0.3 m at 7000 km
TAI_S = np.random.default_rng(1).uniform(-25 * YEAR_S, 35 * YEAR_S, 500)


@pytest.fixture(scope="module")
def skyfield_times():
    timescale = load.timescale(builtin=True)
    return timescale.tt_jd(2451545.0, (TAI_S + 32.184) / DAY_S)


def apart_arcsec(first: Array, second: Array) -> float:
    """Largest angle between pairs of rotations (N, 3, 3)."""
    between = first @ np.swapaxes(second, 1, 2)
    sines = np.linalg.norm(between - np.swapaxes(between, 1, 2), axis=(1, 2)) / np.sqrt(8.0)
    return float(np.arcsin(sines).max() / ARCSEC)


def test_gcrf_to_teme_is_skyfields(skyfield_times) -> None:
    theirs = np.moveaxis(np.asarray(TEME.rotation_at(skyfield_times)), -1, 0)
    assert apart_arcsec(teme_from_gcrf(TAI_S), theirs) < RIGHT_ARCSEC


def test_true_of_date_to_teme_is_skyfields(skyfield_times) -> None:
    true_of_date = np.moveaxis(skyfield_times.M, -1, 0)
    theirs = np.moveaxis(np.asarray(TEME.rotation_at(skyfield_times)), -1, 0) @ np.swapaxes(true_of_date, 1, 2)
    assert apart_arcsec(teme_from_tod(TAI_S), theirs) < 2 * RIGHT_ARCSEC


def test_eme2000_differs_from_gcrf_by_the_frame_bias() -> None:
    bias = np.swapaxes(teme_from_eme2000(TAI_S), 1, 2) @ teme_from_gcrf(TAI_S)
    x_arcsec, y_arcsec, z_arcsec = np.array([bias[0, 1, 2], bias[0, 2, 0], bias[0, 0, 1]]) / ARCSEC
    # IERS Conventions 2010, section 5.4.4: R1(-eta0) R2(xi0) R3(d alpha0)
    assert (x_arcsec, y_arcsec, z_arcsec) == pytest.approx((0.0068192, -0.0166170, -0.0146), abs=2e-5)


def test_the_rotations_are_rotations() -> None:
    for rotation in (teme_from_gcrf, teme_from_eme2000, teme_from_tod):
        turned = rotation(TAI_S)
        assert np.abs(turned @ np.swapaxes(turned, 1, 2) - np.eye(3)).max() < 1e-14
        assert np.linalg.det(turned) == pytest.approx(1.0)
