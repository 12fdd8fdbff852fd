"""assist.estimators.averages: which elements an inversion is given, the running mean, and the mean of the last ones."""

from dataclasses import replace

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site, visible

from acu_daemon.assist.estimators import averages
from acu_daemon.assist.estimators.averages import CircularEstimator, DeterministicEstimator
from acu_daemon.assist.estimators.inversion import Inversion
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, EarthOrientation, Readings
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DEG, Array

SETTINGS = EstimatorSettings(0.03, 0.03)
WHERE = site()
SOURCE = circular(66.0, 0.02)
KINDS = pytest.mark.parametrize("kind", [DeterministicEstimator, CircularEstimator])
EXACT_RAD = 1e-7


class Scripted:
    """Inversions as they are told: so much beside the source's own, or none for a reason; notes its priors."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.raan = np.zeros(0)
        self.mean_anomaly = np.zeros(0)
        self.reasons: tuple[str | None, ...] = ()
        self.priors: list[Array] = []
        monkeypatch.setattr(averages, "_invert", self.invert)

    def tell(self, rows: list[tuple[float, float] | str]) -> None:
        self.raan, self.mean_anomaly = np.array([(0.0, 0.0) if isinstance(one, str) else one for one in rows]).T
        self.reasons = tuple(one if isinstance(one, str) else None for one in rows)

    def invert(self, readings, where, known, radius_m, prior_raan_rad) -> Inversion:
        r_m, v_m_s = SOURCE.states_teme(readings.tai_s)
        own = osculating_from_state(r_m, v_m_s)
        self.priors.append(prior_raan_rad - own.raan_rad)
        is_circular = bool(np.all(known.e == 0.0))
        along = averages._argument_of_latitude(r_m, own.i_rad, own.raan_rad) if is_circular else own.mean_anomaly_rad
        return Inversion(own.raan_rad + self.raan, along + self.mean_anomaly, radius_m, self.reasons)


def readings(count: int) -> Readings:
    tai_s = EPOCH_TAI_S + np.arange(float(count))
    seen = look_at(SOURCE, tai_s, WHERE)
    return Readings(tai_s, seen.az_deg, seen.el_deg)


ROWS: list[tuple[float, float] | str] = [(0.1 * k, -0.01 * k * k) for k in range(12)]


@KINDS
def test_what_is_averaged_is_the_difference_to_the_sources_own_over_a_turn(kind, monkeypatch) -> None:
    scripted = Scripted(monkeypatch)
    for turn in (0.0, 2.0 * np.pi, -2.0 * np.pi):
        estimator = kind(SOURCE, WHERE, SETTINGS)
        scripted.tell([(0.1 + turn, -0.2 + turn)] * 3)
        estimator.add(readings(3))
        assert estimator._correction() == Correction(pytest.approx(0.1), pytest.approx(-0.2))


def test_the_running_mean_is_that_of_all_inversions_there_were_and_the_prior_of_the_next(monkeypatch) -> None:
    scripted, estimator = Scripted(monkeypatch), DeterministicEstimator(SOURCE, WHERE, SETTINGS)
    assert estimator._correction() is None
    scripted.tell(["missed", "missed"])
    estimator.add(readings(2))
    assert (estimator._correction(), [one.reason for one in estimator.rejected]) == (None, ["missed"] * 2)
    scripted.tell([*ROWS[:2], "missed", *ROWS[2:6]])
    estimator.add(readings(7))
    scripted.tell(ROWS[6:])
    estimator.add(readings(6))
    mean = np.mean(ROWS, axis=0)
    found = estimator._correction()
    assert (found.delta_raan_rad, found.delta_mean_anomaly_rad) == pytest.approx(tuple(mean))
    assert (len(estimator.rejected), estimator.used_count) == (3, 12)
    priors = [float(one[0]) for one in scripted.priors]
    assert priors == pytest.approx([0.0, 0.0, float(np.mean(ROWS[:6], axis=0)[0])], abs=EXACT_RAD)


@pytest.mark.parametrize("inversion_count", [3, 5, 8])
def test_the_circular_ones_are_the_mean_of_the_last_few_and_their_prior_that_of_all(monkeypatch, inversion_count):
    settings = replace(SETTINGS, inversion_count=inversion_count)
    scripted, estimator = Scripted(monkeypatch), CircularEstimator(SOURCE, WHERE, settings)
    scripted.tell([*ROWS[:2], "missed"])
    estimator.add(readings(3))
    assert estimator._correction() is None
    scripted.tell(ROWS[2:3])
    estimator.add(readings(1))
    found = estimator._correction()
    assert (found.delta_raan_rad, found.delta_mean_anomaly_rad) == pytest.approx(tuple(np.mean(ROWS[:3], axis=0)))
    scripted.tell(ROWS[3:])
    estimator.add(readings(9))
    found = estimator._correction()
    last = np.mean(ROWS[-inversion_count:], axis=0)
    assert (found.delta_raan_rad, found.delta_mean_anomaly_rad) == pytest.approx(tuple(last))
    priors = [float(one[0]) for one in scripted.priors]
    means = [float(np.mean(ROWS[:count], axis=0)[0]) for count in (2, 3)]
    assert priors == pytest.approx([0.0, *means], abs=EXACT_RAD)


@pytest.mark.parametrize("ut1_utc_s", [0.0, 20.0])
@KINDS
def test_an_inversion_is_given_the_sources_elements_its_radius_and_the_turn_of_the_earth(kind, ut1_utc_s) -> None:
    """A correct reading inverts to the elements it was made with, whatever UT1 is."""
    source = SOURCE if kind is DeterministicEstimator else circular(66.0, 0.0)
    where = replace(WHERE, orientation=EarthOrientation(ut1_utc_s=ut1_utc_s))
    truth = source.corrected(Correction(0.05 * DEG, -0.3 * DEG))
    tai_s = visible(truth, where, 20.0)
    seen = look_at(truth, tai_s, where)
    estimator = kind(source, where, SETTINGS)
    d_raan, d_mean_anomaly, reasons = estimator._differences(Readings(tai_s, seen.az_deg, seen.el_deg))
    assert set(reasons) == {None}
    within_rad = (1e-5 if kind is DeterministicEstimator else 5e-4) * DEG
    assert d_raan == pytest.approx(0.05 * DEG, abs=within_rad)
    assert d_mean_anomaly == pytest.approx(-0.3 * DEG, abs=within_rad)


@pytest.mark.parametrize("i_deg", [30.0, 98.6, 144.0])
def test_the_argument_of_latitude_counts_from_the_ascending_node_in_the_motion(i_deg: float) -> None:
    i_rad = np.radians(i_deg)
    u = np.radians([-170.0, -90.0, -1.0, 0.0, 40.0, 90.0, 179.0])
    raan = np.full(u.size, 0.7)
    r_m = 7e6 * np.array(
        [
            np.cos(raan) * np.cos(u) - np.sin(raan) * np.sin(u) * np.cos(i_rad),
            np.sin(raan) * np.cos(u) + np.cos(raan) * np.sin(u) * np.cos(i_rad),
            np.sin(u) * np.sin(i_rad),
        ]
    )
    assert averages._argument_of_latitude(r_m.T, np.full(u.size, i_rad), raan) == pytest.approx(u)
    aside = r_m + 1e5 * np.array([0.0, 0.0, 1.0])[:, None]  # beside the orbit's plane: its foot counts
    foot = np.arctan2(7e6 * np.sin(u) + 1e5 * np.sin(i_rad), 7e6 * np.cos(u))
    assert averages._argument_of_latitude(aside.T, np.full(u.size, i_rad), raan) == pytest.approx(foot)
