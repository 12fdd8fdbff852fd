"""The gate that knows the orbit: bad minutes, wrong elements, recovery, and nothing good left out."""

from functools import cache

import numpy as np
import pytest
import real_passes
from conftest import needs_data
from made_orbits import circular, site, visible
from real_passes import noisy, sky_angles_deg

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.reading_gate import (
    ABOVE_MAX_ELEVATION,
    ACCELERATION,
    BELIED,
    CORRELATED,
    OFF_PATH,
    OUTLIER,
    SIDE_LOBE,
    WRONG_TARGET,
)
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AxisLimits, Correction, Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle

pytestmark = pytest.mark.long

SIGMA_DEG = 0.03
AZIMUTH = AxisLimits(-270.0, 270.0, 20.0, 10.0)
ELEVATION = AxisLimits(0.0, 90.0, 5.0, 5.0)
SETTINGS = EstimatorSettings(SIGMA_DEG, SIGMA_DEG, azimuth=AZIMUTH, elevation=ELEVATION)
WHERE = site(6.0, 3.0)
SOURCE = circular()
TRUTH = SOURCE.corrected(Correction(0.01 * np.pi / 180, -0.2 * np.pi / 180))
LOCK_S, BAD_S, AFTER_S = 60.0, 60.0, 20.0
UNCHANGED_DEG = 0.05
MAIN_DB, LOBE_DB = 12.0, -2.0


def _setup(source=SOURCE, where=WHERE, estimator="full") -> RefitSetup:
    return RefitSetup(source, where, estimator, SETTINGS, AZIMUTH)


def _feed(setup: RefitSetup, readings: Readings, batch_s: float = 1.0) -> list[RefitReply]:
    """Refit as the background does; the last reply has seen all readings."""
    refitter, replies = Refitter(setup), []
    first = np.floor((readings.tai_s - readings.tai_s[0]) / batch_s + 1e-6)
    for k in np.unique(first):
        part = readings.part(first == k)
        replies.append(refitter.refit(RefitRequest(part, part.tai_s[-1], 2.0, part.tai_s[-1], 180.0)))
    return replies


def _directions(setup: RefitSetup, reply: RefitReply, tai_s):
    source = setup.propagator if reply.fit is None else setup.propagator.corrected(reply.fit.correction)
    seen = encoder_look(source, tai_s, setup.site, reply.fit)
    return seen.az_deg, seen.el_deg


def _apart_deg(setup: RefitSetup, one: RefitReply, other: RefitReply, tai_s) -> float:
    return float(sky_angles_deg(*_directions(setup, one, tai_s), *_directions(setup, other, tai_s)).max())


@cache
def _good(hz: float) -> Readings:
    """A pass with the signal from its second minute on."""
    rise = float(visible(TRUTH, WHERE, 1.0)[0])
    tai_s = rise + 60.0 + np.arange(0.0, LOCK_S + BAD_S + AFTER_S, 1.0 / hz)
    seen = look_at(TRUTH, tai_s, WHERE)
    return noisy(seen.az_deg, seen.el_deg, tai_s, SIGMA_DEG, np.random.default_rng(1))


def _is_bad(readings: Readings):
    t = readings.tai_s - readings.tai_s[0]
    return (t >= LOCK_S) & (t < LOCK_S + BAD_S)


def _moved(readings: Readings, right_deg, up_deg, agc_db=None) -> Readings:
    az_deg = readings.az_deg + right_deg / np.cos(np.radians(readings.el_deg))
    return Readings(readings.tai_s, az_deg % 360.0, readings.el_deg + up_deg, agc_db)


def _since_bad(readings: Readings):
    return np.where(_is_bad(readings), readings.tai_s - readings.tai_s[0] - LOCK_S, 0.0)


def _side_lobe(readings: Readings, right_deg: float, up_deg: float) -> Readings:
    return _moved(readings, right_deg * _is_bad(readings), up_deg * _is_bad(readings))


def _side_lobe_with_agc(readings: Readings) -> Readings:
    agc_db = np.where(_is_bad(readings), LOBE_DB, MAIN_DB)
    return _moved(readings, 1.2 * _is_bad(readings), 0.9 * _is_bad(readings), agc_db)


def _stranger(readings: Readings, right_deg_s: float, up_deg_s: float, from_deg: float = 0.0) -> Readings:
    t = _since_bad(readings)
    start = from_deg * _is_bad(readings)
    return _moved(readings, start + right_deg_s * t, up_deg_s * t)


def _jumps(readings: Readings) -> Readings:
    rng, bad = np.random.default_rng(2), _is_bad(readings)
    away_deg = rng.choice([-1.0, 1.0], (2, len(readings))) * rng.uniform(8.0, 20.0, (2, len(readings)))
    return _moved(readings, 4.0 * away_deg[0] * bad, away_deg[1] * bad)


def _hunting(readings: Readings) -> Readings:
    t, bad = _since_bad(readings), _is_bad(readings)
    return _moved(readings, 0.17 * np.sin(6.0 * t) * bad, 0.17 * np.cos(6.0 * t) * bad)


BAD_MINUTES = {
    "side lobe along": (SIDE_LOBE, lambda r: _side_lobe(r, 0.3, 1.4)),
    "side lobe across": (SIDE_LOBE, lambda r: _side_lobe(r, -1.9, 0.4)),
    "side lobe with AGC": (SIDE_LOBE, _side_lobe_with_agc),
    "drawn away slowly": (WRONG_TARGET, lambda r: _stranger(r, 0.04, -0.03)),
    "drawn away": (WRONG_TARGET, lambda r: _stranger(r, -0.2, 0.1)),
    "another satellite": (WRONG_TARGET, lambda r: _stranger(r, -0.25, 0.1, from_deg=4.0)),
    "jumps": (OFF_PATH, _jumps),
    "encoder jump": (OFF_PATH, lambda r: _moved(r, 40.0 * _is_bad(r), 0.0)),
    "hunting": (CORRELATED, _hunting),
}


@cache
def _without_bad_minute(after_s: float, hz: float) -> RefitReply:
    readings = _good(hz)
    t = readings.tai_s - readings.tai_s[0]
    return _feed(_setup(), readings.part(~_is_bad(readings) & (t < LOCK_S + BAD_S + after_s)))[-1]


@pytest.mark.parametrize("kind", BAD_MINUTES)
def test_a_bad_minute_leaves_the_prediction_where_it_was_and_says_why(kind: str) -> None:
    reason, spoil = BAD_MINUTES[kind]
    hz = 10.0 if reason == CORRELATED else 2.0
    readings = spoil(_good(hz))
    replies = _feed(_setup(), readings)
    ahead_tai_s = readings.tai_s[-1] + np.arange(0.0, 120.0, 5.0)
    in_bad = replies[int(LOCK_S + BAD_S) - 1]
    assert _apart_deg(_setup(), in_bad, _without_bad_minute(0.0, hz), ahead_tai_s) < UNCHANGED_DEG
    assert _apart_deg(_setup(), replies[-1], _without_bad_minute(AFTER_S, hz), ahead_tai_s) < UNCHANGED_DEG
    said = [reply.gate.rejecting for reply in replies[int(LOCK_S) + 5 : int(LOCK_S + BAD_S)]]
    assert said.count(reason) > 0.8 * len(said)
    bad_count = np.count_nonzero(_is_bad(readings))
    assert in_bad.gate.counts[reason] > 0.8 * bad_count
    assert sum(in_bad.gate.counts.values()) > 0.95 * bad_count
    assert sum(replies[-1].gate.counts.values()) < 1.1 * bad_count
    assert replies[-1].gate.rejecting == ""
    assert replies[-1].fit is not None
    assert replies[-1].fit.rejected_count == sum(replies[-1].gate.counts.values())


@pytest.mark.parametrize("estimator", ["kalman", "deterministic"])
def test_the_gate_serves_every_estimator(estimator: str) -> None:
    readings = _stranger(_good(1.0), -0.2, 0.1)
    setup = _setup(estimator=estimator)
    ahead_tai_s = readings.tai_s[-1] + np.arange(0.0, 60.0, 5.0)
    spoilt = _feed(setup, readings)[-1]
    assert _apart_deg(setup, spoilt, _feed(setup, readings.part(~_is_bad(readings)))[-1], ahead_tai_s) < UNCHANGED_DEG
    assert spoilt.gate.counts[WRONG_TARGET] > 0.9 * np.count_nonzero(_is_bad(readings))


def test_the_gate_judges_alike_whatever_the_estimator() -> None:
    """By a fit of its own to all readings believed, also where the estimator has no covariance."""
    readings = _stranger(_good(1.0), -0.04, 0.02)
    counts = {}
    for estimator in ("full", "kalman"):
        reply = _feed(_setup(estimator=estimator), readings)[-1]
        counts[estimator] = {reason: count for reason, count in reply.gate.counts.items() if reason != OUTLIER}
    assert counts["kalman"] == counts["full"]


def test_while_an_axis_accelerates_near_its_limit_readings_are_left_out() -> None:
    """A slow drive: the path over the zenith asks more of the azimuth than three tenths of its acceleration."""
    settings = EstimatorSettings(
        SIGMA_DEG, SIGMA_DEG, azimuth=AxisLimits(-270.0, 270.0, 20.0, 0.05), elevation=ELEVATION
    )
    setup = RefitSetup(SOURCE, site(1.0, 3.0), "full", settings, AZIMUTH)
    tai_s = visible(TRUTH, setup.site, 4.0, 30.0)
    seen = look_at(TRUTH, tai_s, setup.site)
    is_hard = np.abs(np.gradient(seen.az_rate_deg_s, tai_s)) > 0.02
    assert 5 < np.count_nonzero(is_hard) < tai_s.size / 2
    lagging = noisy((seen.az_deg + 0.6 * is_hard) % 360.0, seen.el_deg, tai_s, SIGMA_DEG, np.random.default_rng(3))
    last = _feed(setup, lagging)[-1]
    assert last.gate.counts[ACCELERATION] >= np.count_nonzero(is_hard)
    clean = _feed(setup, lagging.part(~is_hard))[-1]
    assert _apart_deg(setup, last, clean, tai_s[-1] + np.arange(0.0, 60.0, 5.0)) < UNCHANGED_DEG


# What is believed first


@pytest.mark.parametrize("mean_anomaly_deg", [-2.0, -0.5, 0.5, 1.0])
def test_elements_wrong_by_degrees_along_the_track_are_corrected_from_the_first_reading_on(mean_anomaly_deg) -> None:
    source = TRUTH.corrected(Correction(delta_mean_anomaly_rad=np.radians(mean_anomaly_deg)))
    readings = _good(5.0).part(slice(0, 150))
    replies = _feed(_setup(source), readings)
    assert all(reply.fit is not None for reply in replies)
    assert replies[-1].gate.counts == {}
    ahead_tai_s = readings.tai_s[-1] + np.arange(0.0, 30.0, 5.0)
    truth = look_at(TRUTH, ahead_tai_s, WHERE)
    elements = look_at(source, ahead_tai_s, WHERE)
    assert sky_angles_deg(truth.az_deg, truth.el_deg, elements.az_deg, elements.el_deg).max() > abs(mean_anomaly_deg)
    off_deg = sky_angles_deg(*_directions(_setup(source), replies[-1], ahead_tai_s), truth.az_deg, truth.el_deg)
    assert off_deg.max() < UNCHANGED_DEG


def test_another_satellite_from_the_first_reading_on_is_not_believed_and_ours_is_once_it_comes() -> None:
    good = _good(2.0)
    bad = _stranger(good, -0.25, 0.1, from_deg=0.5)
    replies = _feed(_setup(), bad.part(_is_bad(bad) | (bad.tai_s > bad.tai_s[0] + LOCK_S)))
    assert all(reply.fit is None for reply in replies[5 : int(BAD_S)])
    assert replies[-1].gate.counts[WRONG_TARGET] == np.count_nonzero(_is_bad(bad))
    assert replies[-1].fit is not None
    after = good.part(good.tai_s >= good.tai_s[0] + LOCK_S + BAD_S)
    ahead_tai_s = good.tai_s[-1] + np.arange(0.0, 30.0, 5.0)
    assert _apart_deg(_setup(), replies[-1], _feed(_setup(), after)[-1], ahead_tai_s) < UNCHANGED_DEG


@pytest.mark.parametrize(("right_deg", "up_deg", "has_agc"), [(0.9, 1.2, True), (-1.5, 0.0, False)])
def test_a_first_lock_on_a_side_lobe_gives_way_to_the_main_lobe(right_deg, up_deg, has_agc) -> None:
    """By the level, or because the orbit through the side lobe is far less likely."""
    good = _good(2.0)
    agc_db = np.where(_is_bad(good), LOBE_DB, MAIN_DB) if has_agc else None
    bad = _moved(good, right_deg * _is_bad(good), up_deg * _is_bad(good), agc_db)
    bad = bad.part(bad.tai_s >= bad.tai_s[0] + LOCK_S)
    last = _feed(_setup(), bad)[-1]
    assert last.gate.reset_count >= 1
    assert last.gate.counts[BELIED] > 100
    after = good.part(good.tai_s >= good.tai_s[0] + LOCK_S + BAD_S)
    ahead_tai_s = good.tai_s[-1] + np.arange(0.0, 30.0, 5.0)
    assert _apart_deg(_setup(), last, _feed(_setup(), after)[-1], ahead_tai_s) < 2 * UNCHANGED_DEG


def test_what_was_believed_first_gives_way_in_any_case_in_the_end() -> None:
    tai_s = visible(TRUTH, WHERE, 1.0)[60:220]
    seen = look_at(TRUTH, tai_s, WHERE)
    readings = noisy(seen.az_deg, seen.el_deg, tai_s, SIGMA_DEG, np.random.default_rng(4))
    late = look_at(TRUTH.corrected(Correction(delta_mean_anomaly_rad=0.01)), tai_s, WHERE)
    is_late = np.arange(tai_s.size) < 60
    both = Readings(
        tai_s, np.where(is_late, late.az_deg, readings.az_deg), np.where(is_late, late.el_deg, readings.el_deg)
    )
    last = _feed(_setup(), both)[-1]
    assert last.gate.reset_count == 1
    assert last.gate.rejecting == ""
    off_deg = sky_angles_deg(*_directions(_setup(), last, tai_s[-30:]), seen.az_deg[-30:], seen.el_deg[-30:])
    assert off_deg.max() < UNCHANGED_DEG


def test_a_whole_pass_handed_over_at_once_is_judged_like_one_that_came_bit_by_bit() -> None:
    readings = _side_lobe(_good(5.0), -1.9, 0.4)
    refitter = Refitter(_setup())
    end = float(readings.tai_s[-1])
    at_once = refitter.refit(RefitRequest(readings, end, 2.0, end, 180.0))
    assert at_once.gate.counts[SIDE_LOBE] > 0.9 * np.count_nonzero(_is_bad(readings))
    ahead_tai_s = end + np.arange(0.0, 120.0, 5.0)
    assert _apart_deg(_setup(), at_once, _without_bad_minute(AFTER_S, 5.0), ahead_tai_s) < UNCHANGED_DEG


# Real passes


def _real_setup(a_pass) -> RefitSetup:
    (elements,), _ = parse_tle(a_pass.tle_path.read_text(), "test")
    return _setup(Sgp4Propagator(elements), a_pass.site)


def _real(a_pass, tai_s, bias_deg=(0.0, 0.0)) -> Readings:
    az_deg, el_deg = a_pass.sky(tai_s)
    return noisy(az_deg + bias_deg[0], el_deg + bias_deg[1], tai_s, SIGMA_DEG, np.random.default_rng(5))


@needs_data
@pytest.mark.parametrize("bias_deg", [(0.0, 0.0), (0.05, -0.04)])
@pytest.mark.parametrize("name", real_passes.names())
def test_nothing_good_is_left_out_on_clean_real_passes(name: str, bias_deg) -> None:
    """The whole pass, one reading in 15 s, and 10 s of it at 10 Hz."""
    a_pass = real_passes.load(name)
    first, last = a_pass.tai_s[0], a_pass.tai_s[-1]
    for tai_s in (np.arange(first, last, 15.0), (first + last) / 2 + np.arange(-150.0, -140.0, 0.1)):
        reply = _feed(
            _real_setup(a_pass), _real(a_pass, tai_s, bias_deg), batch_s=15.0 if tai_s[1] - tai_s[0] > 1 else 1.0
        )[-1]
        bad_count = sum(n for reason, n in reply.gate.counts.items() if reason != ABOVE_MAX_ELEVATION)
        assert bad_count < 0.01 * tai_s.size


@needs_data
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("iss-2022-Huntsville-20220211T2156", "drawn away slowly"),
        ("iss-2022-Huntsville-20220211T2156", "side lobe along"),
        ("sentinel-3a-CachoeiraPaulista-20181225T0140", "drawn away"),
        ("sentinel-3a-CachoeiraPaulista-20181225T0140", "jumps"),
    ],
)
def test_on_a_real_pass_a_bad_minute_leaves_the_prediction_where_it_was(name: str, kind: str) -> None:
    a_pass = real_passes.load(name)
    setup, (reason, spoil) = _real_setup(a_pass), BAD_MINUTES[kind]
    tai_s = a_pass.tai_s[0] + 80.0 + np.arange(0.0, LOCK_S + BAD_S, 0.25)
    good = _real(a_pass, tai_s)
    spoilt = _feed(setup, spoil(good))[-1]
    clean = _feed(setup, good.part(~_is_bad(good)))[-1]
    ahead_tai_s = tai_s[-1] + np.arange(0.0, 120.0, 5.0)
    assert _apart_deg(setup, spoilt, clean, ahead_tai_s) < UNCHANGED_DEG
    assert spoilt.gate.counts[reason] > 0.8 * np.count_nonzero(_is_bad(good))
