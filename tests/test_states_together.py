"""States of a source under several corrections at once: each as it is alone, and the same words where there is none."""

import numpy as np
import pytest
from made_oems import START, iss, kvn, source, states
from made_orbits import circular

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction
from acu_daemon.orbit.brouwer import BrouwerPropagator
from acu_daemon.orbit.propagator import Propagator, Together, states_together

CORRECTIONS = (
    Correction(),
    Correction(delta_raan_rad=0.02, delta_mean_anomaly_rad=-0.03),
    Correction(0.001, 0.002, 1e-7, 0.003, -0.002, 0.001),
)
OVAL = BrouwerPropagator(circular().elements, short_period=False).corrected(Correction(delta_e_cos_argp=0.05))
SOURCES: dict[str, Propagator] = {
    "brouwer": circular(),
    "without short periods, and corrected before": OVAL,
    "tle": iss(),
    "ephemeris": source(kvn(states())),
}


def times_of(of: Propagator) -> np.ndarray:
    first = START if of.kind == "oem" else of.epoch_tai_s
    return first + np.array([600.0, 1.0, 1500.25, 3000.0])


@pytest.mark.parametrize("name", SOURCES)
@pytest.mark.parametrize("count", [1, 2, 3])
def test_each_correction_gives_the_states_that_it_gives_alone(name: str, count: int) -> None:
    of = SOURCES[name]
    r_m, v_m_s = states_together(of, CORRECTIONS[-count:], times_of(of))
    assert r_m.shape == v_m_s.shape == (count, 4, 3)
    for k, correction in enumerate(CORRECTIONS[-count:]):
        alone_m, alone_m_s = of.corrected(correction).states_teme(times_of(of))
        assert np.abs(r_m[k] - alone_m).max() < 1e-6
        assert np.abs(v_m_s[k] - alone_m_s).max() < 1e-9


def test_the_sources_of_mean_elements_know_the_faster_way_and_an_ephemeris_does_not() -> None:
    assert {name for name, of in SOURCES.items() if not isinstance(of, Together)} == {"ephemeris"}


@pytest.mark.parametrize("name", ["brouwer", "tle"])
def test_a_time_that_is_not_finite_is_refused(name: str) -> None:
    with pytest.raises(OrbitError, match="no position at a time that is not finite"):
        states_together(SOURCES[name], CORRECTIONS, np.array([times_of(SOURCES[name])[0], np.nan]))


def test_a_correction_that_leaves_no_ellipse_is_refused() -> None:
    with pytest.raises(OrbitError, match="not an ellipse"):
        states_together(circular(), [Correction(), Correction(delta_e_sin_argp=1.2)], times_of(circular()))


def test_what_sgp4_has_no_answer_for_is_told_as_it_is_told_alone() -> None:
    of, lost = iss(), Correction(delta_e_cos_argp=-1.2)
    with pytest.raises(OrbitError) as alone:
        of.corrected(lost).states_teme(times_of(of))
    with pytest.raises(OrbitError) as told:
        states_together(of, [Correction(), lost], times_of(of))
    assert str(told.value) == str(alone.value)
    assert "so far do the readings correct the elements" in str(told.value)


def test_beyond_what_is_believed_of_the_elements_there_are_no_states() -> None:
    of = iss()
    with pytest.raises(OrbitError) as alone:
        of.states_teme(np.array([of.epoch_tai_s + 1e10]))
    with pytest.raises(OrbitError) as told:
        states_together(of, CORRECTIONS, np.array([of.epoch_tai_s + 1e10]))
    assert str(told.value) == str(alone.value)
