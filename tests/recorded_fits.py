"""What the estimation of a pass made of some troubled readings, in lines of text: to be compared with what it does now.

Each run is one pass over a made orbit: what the encoders show of the truth, with what is wrong with it.  A line for
each refit in which the words change, and each sixth: how many readings were left out, where the prediction points, what
the fit says to people, its states in thousandths of their units, and their sigmas.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from made_orbits import circular, site, visible
from real_passes import noisy

from acu_daemon.assist.estimators.full.carry_over import CarryOver, carry_over_of
from acu_daemon.assist.estimators.full.estimated_states import states_of
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings
from acu_daemon.model import AngleBias, AxisLimits, Correction, Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DEG, Array

RECORDED = Path(__file__).parent / "recorded_fits.txt"
NOTE = "# What scripts/record.py has recorded.  A change that is meant: run it again, and read the difference.\n"
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
SETTINGS = EstimatorSettings(0.03, 0.04, azimuth=AZIMUTH, elevation=ELEVATION)
OPEN = replace(
    SETTINGS,
    sigma_elevation_cot_deg=0.01,
    bias_sigma_azimuth_sec_deg=0.05,
    bias_sigma_elevation_cot_deg=0.05,
    station_sigma_m=500.0,
    max_fit_elevation_deg=60.0,
    mount_sigmas_deg=(0.02, 0.03, 0.02, 0.03),
)
SOURCE, WHERE = circular(66.0, 0.01), site(4.0, 5.0)
LATE = Correction(0.01 * DEG, -0.2 * DEG, 1e-8, 1e-5, -2e-5, 0.003 * DEG)
EARLY = Correction(delta_mean_anomaly_rad=0.7 * DEG)
BIAS = AngleBias(az_deg=0.04, el_deg=-0.03)
EVERY_S, FIGURES_EVERY = 3.0, 6
TAI_S = visible(SOURCE, WHERE, 0.5)


@dataclass(frozen=True)
class Run:
    """wrong: degrees to the right and up, and dB, that readings (N,) at seconds are off the truth."""

    until_s: float = 90.0
    from_s: float = 40.0
    estimator: str = "full"
    settings: EstimatorSettings = SETTINGS
    truth: Correction = LATE
    other: tuple[float, Correction] = (0.0, LATE)  # so long it is another one
    wrong: Callable[[Array], tuple[Array, Array, Array]] = field(default=lambda t: (0.0 * t, 0.0 * t, 12.0 + 0.0 * t))
    carried: Callable[[], CarryOver] | None = None
    seed: int = 1


def _shown(truth: Correction, tai_s: Array, run: Run) -> Readings:
    t = tai_s - tai_s[0]
    right_deg, up_deg, agc_db = run.wrong(t)
    right = look_at(SOURCE.corrected(truth), tai_s, WHERE)
    wrong = look_at(SOURCE.corrected(run.other[1]), tai_s, WHERE)
    az, el = (np.where(t < run.other[0], b, a) for a, b in ((right.az_deg, wrong.az_deg), (right.el_deg, wrong.el_deg)))
    el = el + up_deg + BIAS.el_deg
    az = az + BIAS.az_deg + right_deg / np.cos(el * DEG)
    return replace(noisy(az, el, tai_s, 0.03, np.random.default_rng(run.seed)), agc_db=agc_db)


@cache
def _left(truth: Correction, to_s: float, *, is_of_this_pass: bool) -> CarryOver:
    """What was fitted to so much of the pass."""
    tai_s = TAI_S[TAI_S[0] + to_s > TAI_S]
    run = Run(truth=truth)
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH))
    end = float(tai_s[-1])
    fit = refitter.refit(RefitRequest(_shown(truth, tai_s, run), end, 2.0, end, 180.0)).fit
    assert fit is not None
    carried = carry_over_of(fit, SOURCE, WHERE)
    assert carried is not None
    at_tai_s = carried.at_tai_s if is_of_this_pass else carried.at_tai_s - 3 * 5800.0
    return replace(carried, is_of_this_pass=is_of_this_pass, at_tai_s=at_tai_s)


def _between(t: Array, begin_s: float, end_s: float) -> Array:
    return ((t >= begin_s) & (t < end_s)).astype(float)


def _hunting(t: Array) -> Array:
    return 0.12 * np.sin(t) * (t > 25.0)


RUNS = {
    "good readings": Run(100.0),
    "kalman": Run(50.0, estimator="kalman"),
    "circular": Run(50.0, estimator="circular"),
    "deterministic": Run(50.0, estimator="deterministic"),
    "a side lobe after 20 s": Run(
        70.0, wrong=lambda t: (1.4 * _between(t, 20, 50), 0.3 * _between(t, 20, 50), 12.0 - 15.0 * _between(t, 20, 50))
    ),
    "a side lobe at first": Run(
        50.0, wrong=lambda t: (-1.4 * _between(t, 0, 12), 0.0 * t, 12.0 - 15.0 * _between(t, 0, 12))
    ),
    "another one at first": Run(75.0, other=(12.0, EARLY)),
    "an elevation that hunts": Run(75.0, wrong=lambda t: (0.0 * t, _hunting(t) * (t < 60.0), 12.0 + 0.0 * t)),
    "an azimuth that hunts": Run(60.0, wrong=lambda t: (_hunting(t), 0.0 * t, 12.0 + 0.0 * t), seed=3),
    "a track that drifts away": Run(
        wrong=lambda t: (0.04 * np.clip(t - 30, 0, 40), -0.02 * np.clip(t - 30, 0, 40), 12.0 + 0.0 * t)
    ),
    "wild readings": Run(30.0, wrong=lambda t: (9.0 * np.sin(7.0 * t), 5.0 * np.cos(3.0 * t), 12.0 + 0.0 * t)),
    "wild ones among good": Run(
        50.0,
        wrong=lambda t: (0.0 * t, 0.35 * ((t % 9.0) < 0.6), 12.0 + 0.0 * t),
    ),
    "all states open, and high": Run(90.0, 200.0, settings=OPEN, seed=2),
    "after a pass that was good": Run(30.0, carried=lambda: _left(LATE, 200.0, is_of_this_pass=False)),
    "after a pass of another orbit": Run(40.0, carried=lambda: _left(EARLY, 200.0, is_of_this_pass=False)),
    "gone on with": Run(30.0, 120.0, carried=lambda: _left(LATE, 100.0, is_of_this_pass=True)),
    "gone on with, by kalman": Run(20.0, 120.0, "kalman", carried=lambda: _left(LATE, 100.0, is_of_this_pass=True)),
    "gone on with what was another one": Run(50.0, 120.0, carried=lambda: _left(EARLY, 100.0, is_of_this_pass=True)),
    "gone on with another one, and shown it again": Run(
        75.0, 120.0, other=(12.0, EARLY), carried=lambda: _left(EARLY, 100.0, is_of_this_pass=True)
    ),
    "narrow elements that are wrong": Run(
        40.0, settings=replace(SETTINGS, orbit_sigmas=ElementSigmas(mean_anomaly_deg=0.01)), truth=EARLY
    ),
}


@cache
def lines(name: str) -> tuple[str, ...]:
    """One run."""
    return tuple(_lines(RUNS[name]))


def _lines(run: Run) -> Iterator[str]:
    begin = TAI_S[0] + run.from_s
    tai_s = TAI_S[(begin <= TAI_S) & (begin + run.until_s > TAI_S)]
    readings, before = _shown(run.truth, tai_s, run), ""
    carried = run.carried() if run.carried else None
    refitter = Refitter(RefitSetup(SOURCE, WHERE, run.estimator, run.settings, AZIMUTH, carried=carried))
    batch = np.floor((readings.tai_s - readings.tai_s[0]) / EVERY_S + 1e-6)
    for k in range(int(batch[-1]) + 1):
        part = readings.part(batch == k)
        now = float(part.tai_s[-1])
        reply = refitter.refit(RefitRequest(part, now, 10.0, now, 180.0))
        text = _words(reply)
        if text != before or k % FIGURES_EVERY == FIGURES_EVERY - 1:
            yield f"{k} {text} | {' '.join(f'{one:.4g}' for one in _figures(reply))}"
        before = text


def _words(reply: RefitReply) -> str:
    said = (str(reply.model), reply.gate.rejecting, f"{reply.gate.reset_count} resets", *reply.notes)
    return "; ".join(one for one in said if one)


def _figures(reply: RefitReply) -> Iterator[float]:
    yield from (float(reply.gate.counts[reason]) for reason in sorted(reply.gate.counts))
    point, fit = reply.prediction.at(reply.prediction.start_tai_s + 8.0), reply.fit
    assert point is not None
    yield from (point.az_deg, point.el_deg, point.az_rate_deg_s, point.el_rate_deg_s)
    if reply.prediction.sigma_deg is not None:
        yield float(reply.prediction.sigma_deg[80])
    yield from reply.prediction.spread or ()
    if fit is None:
        return
    yield from (fit.along_s, fit.across_deg, fit.residual_rms_deg, fit.reading_count, fit.rejected_count)
    yield from states_of(fit.correction, fit.bias, fit.station_shift_enu_m) * 1e3
    if fit.covariance is not None:
        yield from np.sqrt(np.diag(fit.covariance)) * 1e3
