"""How far from its prediction a satellite may be: against orbits drawn from the covariance itself."""

import numpy as np
import pytest
from flights import RISING_TAI_S, demo_target
from made_orbits import circular, site, visible

from acu_daemon.assist.estimators.full.estimated_states import ORBIT, correction_of, make_prior
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.session.prediction import predict
from acu_daemon.assist.session.prediction_spread import spread_of
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings, StateSigmas
from acu_daemon.control.tracking.track_frame import offset_of
from acu_daemon.model import Correction, FitResult, Prediction, Site

T = RISING_TAI_S
DRAW_COUNT = 300
NO_BIAS = {f"bias_sigma_{name}_deg": 0.0 for name in ("azimuth", "elevation", "azimuth_sec", "elevation_cot")}


@pytest.mark.parametrize("at_s", [0.0, 90.0])
def test_the_spread_of_the_elements_is_that_of_orbits_drawn_from_what_they_are_worth(at_s: float) -> None:
    target = demo_target()
    source, here = target.elements.propagator, target.station.site
    settings = EstimatorSettings(orbit_sigmas=StateSigmas(300.0, 0.3), **NO_BIAS)
    buffer = predict(source, here, T - 30.0, T, "TLE", 168.0, horizon_s=180.0)
    spread = spread_of(source, here, settings, None, buffer, T + at_s)
    assert spread is not None
    rng = np.random.default_rng(1)
    covariance = make_prior(source, settings, T).covariance[ORBIT, ORBIT]
    offsets = []
    for x in rng.multivariate_normal(np.zeros(len(covariance)), covariance, DRAW_COUNT):
        seen = encoder_look(source.corrected(correction_of(x)), np.array([T + at_s]), here, None)
        offset = offset_of(buffer, T + at_s, float(seen.az_deg[0]), float(seen.el_deg[0]))
        assert offset is not None
        offsets.append(offset)
    along_s, across_deg = np.sqrt(np.mean(np.square(offsets), axis=0))
    assert spread[0] == pytest.approx(along_s, rel=0.15)
    assert spread[1] == pytest.approx(across_deg, rel=0.25)  # of a path that the Earth turns under, 15 % more


def test_old_elements_spread_further_and_a_fit_without_a_covariance_says_nothing() -> None:
    target = demo_target()
    source, here = target.elements.propagator, target.station.site
    buffer = predict(source, here, T - 30.0, T, "TLE", 168.0, horizon_s=90.0)
    worn = EstimatorSettings(orbit_sigmas=StateSigmas(3000.0, 3.0))
    fresh = EstimatorSettings(orbit_sigmas=StateSigmas(300.0, 0.3))
    wide, narrow = (spread_of(source, here, one, None, buffer, T) for one in (worn, fresh))
    assert wide is not None
    assert narrow is not None
    assert wide[0] > 2.0 * narrow[0]  # both hold the encoders' bias
    fit = FitResult("kalman", Correction(), T, 10, 0, 0.0, 0.0, 0.0)
    assert spread_of(source, here, fresh, fit, buffer, T) is None
    assert spread_of(source, here, fresh, None, buffer, T + 100.0) is None


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])  # of the pass: climbing, over the top, descending
@pytest.mark.parametrize("where", [site(6.0, 6.0), site(6.0, -6.0)])  # it passes on either side
def test_a_satellite_of_which_only_the_time_is_in_doubt_is_spread_along_its_track_wherever_that_leads(
    where: Site, share: float
) -> None:
    source = circular()
    tai_s = visible(source, where, 1.0)
    at_tai_s = float(tai_s[int(share * tai_s.size)])
    one_deg = ElementSigmas(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    settings = EstimatorSettings(orbit_sigmas=one_deg, **NO_BIAS)
    buffer = predict(source, where, at_tai_s - 30.0, at_tai_s, "TLE", 168.0, horizon_s=60.0)
    spread = spread_of(source, where, settings, None, buffer, at_tai_s)
    late = encoder_look(source.corrected(Correction(delta_mean_anomaly_rad=-1e-4)), np.array([at_tai_s]), where, None)
    off = offset_of(buffer, at_tai_s, float(late.az_deg[0]), float(late.el_deg[0]))
    assert spread is not None
    assert off is not None
    a_degree = np.radians(1.0) / 1e-4
    assert spread[0] == pytest.approx(abs(off[0]) * a_degree, rel=0.1)
    assert spread[1] < 0.15 * spread[0] * float(np.hypot(*_rates(buffer, at_tai_s)))


def _rates(buffer: Prediction, tai_s: float) -> tuple[float, float]:
    """Degrees a second on the sky, right and up."""
    at = buffer.at(tai_s)
    assert at is not None
    return at.az_rate_deg_s * float(np.cos(np.radians(at.el_deg))), at.el_rate_deg_s
