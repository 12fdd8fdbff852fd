"""Replay: predictions of recorded instants on made and real passes, and that nothing later ever reaches back."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import real_passes
from conftest import needs_data
from hypothesis import given, settings
from hypothesis import strategies as st
from real_passes import noisy, sky_angles_deg

from acu_daemon.assist.estimators.estimator import ESTIMATORS, EstimatorSettings
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.session.replay_readings import Replayed, replay
from acu_daemon.cli.replay_recording import state_of
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import AxisLimits, Correction, Reading, Site, Station
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import gmst_rad, tai_from_utc, utc_text
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import Array

pytestmark = pytest.mark.long

AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
SETTINGS = EstimatorSettings(azimuth=AZIMUTH, elevation=ELEVATION)
NOISE_DEG = 0.03
ALLOWED_DEG = 0.1
DWELL_S = 1.0
LATE = Correction(delta_mean_anomaly_rad=-0.004)  # about 4 s late, 0.5 deg and more overhead


def setup(source: Propagator, site: Site, estimator: str = "kalman") -> RefitSetup:
    return RefitSetup(source, site, estimator, SETTINGS, AZIMUTH)


def run(made: RefitSetup, lines: Sequence[tuple[float, Reading | None]]) -> list[Replayed]:
    return list(replay(made, list(lines), DWELL_S))


def lines_of(tai_s: Array, az_deg: Array, el_deg: Array, locked: Array) -> list[tuple[float, Reading | None]]:
    rows = zip(tai_s.tolist(), az_deg.tolist(), el_deg.tolist(), locked.tolist(), strict=True)
    return [(t, Reading(t, az % 360.0, el, is_locked)) for t, az, el, is_locked in rows]


def errors_deg(results: list[Replayed], az_deg: Array, el_deg: Array) -> Array:
    az, el = (np.array([getattr(one, name) for one in results]) for name in ("az_deg", "el_deg"))
    return sky_angles_deg(az, el, az_deg, el_deg)


def polar_pass(middle_utc: str, step_s: float = 2.0) -> tuple[Propagator, Site, Array]:
    """A pass that culminates near that instant: source, site, and times above 5 deg."""
    middle = tai_from_utc(middle_utc)
    raan = float(gmst_rad(np.array([middle]), 0.0)[0])
    source = BrouwerPropagator(BrouwerElements("MADE", middle, 7180e3, 1e-4, np.radians(98.6), raan, 0.0, 0.0), False)
    site = Site(Station("MADE", 0.0, 3.0, 100.0))
    tai_s = middle + np.arange(-500.0, 500.0, step_s)
    return source, site, tai_s[look_at(source, tai_s, site).el_deg > 5.0]


def late_pass(
    source: Propagator, site: Site, tai_s: Array, locked_part: float = 0.6
) -> tuple[list[tuple[float, Reading | None]], tuple[Array, Array]]:
    """Lines of a pass whose satellite is late, locked at first and then lost; and the true sky."""
    truth = look_at(source.corrected(LATE), tai_s, site)
    seen = noisy(truth.az_deg, truth.el_deg, tai_s, NOISE_DEG, np.random.default_rng(7))
    locked = np.arange(tai_s.size) < locked_part * tai_s.size
    return lines_of(tai_s, seen.az_deg, seen.el_deg, locked), (truth.az_deg, truth.el_deg)


MADE = polar_pass("2018-12-25T01:40:00Z")
MADE_LINES, MADE_SKY = late_pass(*MADE)


@needs_data
@pytest.mark.parametrize("name", real_passes.names())
def test_a_real_pass_locked_for_its_first_part_is_predicted_for_the_rest(name: str) -> None:
    real = real_passes.load(name)
    (elements,), _ = parse_tle(real.tle_path.read_text(), real.tle_path.name)
    tai_s = np.arange(real.tai_s[0], real.tai_s[-1], 5.0)
    sky = real.sky(tai_s)
    seen = noisy(*sky, tai_s, NOISE_DEG, np.random.default_rng(1))
    locked = np.arange(tai_s.size) < 0.6 * tai_s.size
    results = run(setup(Sgp4Propagator(elements), real.site), lines_of(tai_s, seen.az_deg, seen.el_deg, locked))
    assert errors_deg(results, *sky)[~locked].max() < ALLOWED_DEG
    assert {state_of(one) for one, was_locked in zip(results, locked, strict=True) if not was_locked} == {
        TrackState.HOLD_FITTED
    }


@needs_data
@pytest.mark.parametrize(
    ("estimator", "step_s"),
    [*((name, step_s) for name in sorted(ESTIMATORS) for step_s in (5.0, 1.1)), ("kalman", 0.1)],
)
def test_every_estimator_holds_the_beam_at_every_rate_from_0_2_to_10_hz(estimator: str, step_s: float) -> None:
    real = real_passes.load("sentinel-3a-Tsukuba-20181228T1047")
    (elements,), _ = parse_tle(real.tle_path.read_text(), real.tle_path.name)
    tai_s = np.arange(real.tai_s[0], real.tai_s[-1], step_s)
    sky = real.sky(tai_s)
    seen = noisy(*sky, tai_s, NOISE_DEG, np.random.default_rng(2))
    locked = np.arange(tai_s.size) < 0.6 * tai_s.size
    made = setup(Sgp4Propagator(elements), real.site, estimator)
    results = run(made, lines_of(tai_s, seen.az_deg, seen.el_deg, locked))
    assert errors_deg(results, *sky)[~locked].max() < ALLOWED_DEG


def test_the_fit_brings_a_late_satellite_back_into_the_beam() -> None:
    source, site, tai_s = MADE
    results = run(setup(source, site), MADE_LINES)
    bare = look_at(source, tai_s, site)
    assert sky_angles_deg(bare.az_deg, bare.el_deg, *MADE_SKY).max() > 1.0
    assert errors_deg(results, *MADE_SKY)[tai_s.size // 3 :].max() < ALLOWED_DEG


def test_before_the_first_fit_the_prediction_is_the_elements_own() -> None:
    source, site, tai_s = MADE
    lines = [(time, None) for time in tai_s.tolist()]
    results = run(setup(source, site), lines)
    bare = look_at(source, tai_s, site)
    assert errors_deg(results, bare.az_deg, bare.el_deg).max() < 1e-4
    assert {state_of(one) for one in results} == {TrackState.ACQUIRE_TLE}
    assert all(one.sigma_deg is None for one in results)


def test_the_source_is_the_state_the_daemon_would_have_been_in() -> None:
    source, site, _ = MADE
    flags = [0, 0, 1, 1, 1, 0, 0, 1, 0]
    lines = [
        (time, replace(reading, is_locked=bool(flag)) if reading else None)
        for (time, reading), flag in zip(MADE_LINES, flags, strict=False)
    ]
    assert [str(state_of(one)) for one in run(setup(source, site), lines)] == [
        *("ACQUIRE/TLE", "ACQUIRE/TLE"),
        *("AUTOTRACK/TLE", "AUTOTRACK/TLE", "AUTOTRACK/FITTED"),
        *("HOLD/FITTED", "HOLD/FITTED", "AUTOTRACK/FITTED", "HOLD/FITTED"),
    ]


def test_a_loss_before_any_fit_is_held_on_the_elements() -> None:
    source, site, _ = MADE
    (first, reading), (second, _), *_ = MADE_LINES
    assert [str(state_of(one)) for one in run(setup(source, site), [(first, reading), (second, None)])] == [
        "AUTOTRACK/TLE",
        "HOLD/TLE",
    ]


def test_readings_count_only_once_locked_for_the_dwell_time() -> None:
    source, site, tai_s = MADE
    jittering = [
        (time, replace(reading, is_locked=count % 2 == 0) if reading else None)
        for count, (time, reading) in enumerate(MADE_LINES)
    ]
    results = run(setup(source, site), jittering)
    bare = look_at(source, tai_s, site)
    assert errors_deg(results, bare.az_deg, bare.el_deg).max() < 1e-4


@cache
def undisturbed(estimator: str) -> list[Replayed]:
    return run(setup(*MADE[:2], estimator), MADE_LINES[:60])


@settings(max_examples=10)
@given(st.data())
def test_what_comes_later_never_changes_an_earlier_line(data: st.DataObject) -> None:
    estimator = data.draw(st.sampled_from(sorted(ESTIMATORS)))
    made, lines = setup(*MADE[:2], estimator), MADE_LINES[:60]
    cut = data.draw(st.integers(0, len(lines) - 1))
    others = st.tuples(st.floats(0, 360), st.floats(0, 90), st.booleans())
    changed = [(time, Reading(time, *data.draw(others))) for time, _ in lines[cut:]]
    flag = lines[cut][1]
    assert flag is not None
    changed[0] = (changed[0][0], replace(changed[0][1], is_locked=flag.is_locked))  # a line's own flag names its state
    whole = undisturbed(estimator)[: cut + 1]
    assert run(made, lines[:cut] + changed)[: cut + 1] == whole
    assert run(made, lines[: cut + 1]) == whole


@pytest.mark.parametrize("estimator", sorted(ESTIMATORS))
def test_a_replay_repeats_bit_for_bit(estimator: str) -> None:
    made = setup(MADE[0], MADE[1], estimator)
    assert run(made, MADE_LINES[:100]) == run(made, MADE_LINES[:100])


@pytest.mark.parametrize("step_s", [0.1, 0.3, 0.6, 0.7, 0.9, 1.0, 3.0, 5.0])
def test_new_readings_are_fitted_at_least_once_a_second_of_data_or_on_every_line(
    step_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, site, tai_s = polar_pass("2018-12-25T01:40:00Z", step_s)
    lines, _ = late_pass(source, site, tai_s[: int(30 / step_s)], locked_part=1.0)
    asked: list[float] = []
    refit = Refitter.refit

    def watched(self: Refitter, request: RefitRequest) -> object:
        asked.append(request.start_tai_s)
        return refit(self, request)

    monkeypatch.setattr(Refitter, "refit", watched)
    run(setup(source, site), lines)
    assert np.diff(asked[1:]).max() <= max(1.0, step_s) + 1e-3


@pytest.mark.parametrize(
    "middle",
    [
        "2018-03-10T00:00:00Z",
        "2017-12-31T23:59:59Z",
        "2016-12-31T23:59:60Z",
        "2015-06-30T23:59:60Z",
    ],
)
def test_midnight_the_years_end_and_a_leap_second_do_not_disturb(middle: str) -> None:
    source, site, tai_s = polar_pass(middle)
    lines, sky = late_pass(source, site, tai_s)
    through_text = [tai_from_utc(utc_text(time, 6)) for time, _ in lines]
    shown = [
        (time, replace(reading, tai_s=time) if reading else None)
        for time, (_, reading) in zip(through_text, lines, strict=True)
    ]
    results = run(setup(source, site), shown)
    assert errors_deg(results, *sky)[tai_s.size // 3 :].max() < ALLOWED_DEG


@pytest.mark.parametrize("backwards", [False, True])
def test_an_azimuth_through_north_does_not_disturb(backwards: bool) -> None:
    """A pass of an inclined orbit at its highest latitude, north of the station: from north-west to north-east."""
    middle = tai_from_utc("2018-12-25T01:40:00Z")
    raan = float(gmst_rad(np.array([middle]), 0.0)[0])
    inclination = np.radians(180.0 - 51.6 if backwards else 51.6)
    elements = BrouwerElements("MADE", middle, 7180e3, 1e-4, inclination, raan, 0.0, np.radians(90.0))
    source = BrouwerPropagator(elements, False)
    site = Site(Station("MADE", 45.0, -90.0 if backwards else 90.0, 100.0))
    tai_s = middle + np.arange(-500.0, 500.0)
    tai_s = tai_s[look_at(source, tai_s, site).el_deg > 5.0]
    lines, sky = late_pass(source, site, tai_s)
    crossing = np.flatnonzero(np.abs(np.diff(sky[0])) > 300.0)
    assert crossing.size == 1
    assert 0.2 < crossing[0] / tai_s.size < 0.8
    results = run(setup(source, site), lines)
    assert all(0.0 <= one.az_deg < 360.0 for one in results)
    assert errors_deg(results, *sky)[tai_s.size // 3 :].max() < ALLOWED_DEG


def test_gaps_of_any_length_are_bridged() -> None:
    source, site, _ = MADE
    kept = [line for count, line in enumerate(MADE_LINES) if not 60 <= count < 150]
    results = run(setup(source, site), kept)
    sky = tuple(np.delete(values, slice(60, 150)) for values in MADE_SKY)
    assert len(results) == len(kept)
    assert errors_deg(results, *sky)[40:].max() < 2 * ALLOWED_DEG


def test_no_lines_give_no_results_and_one_gives_one() -> None:
    made = setup(MADE[0], MADE[1])
    assert run(made, []) == []
    assert len(run(made, MADE_LINES[:1])) == 1


def test_progress_is_told_every_hundred_lines() -> None:
    told: list[int] = []
    list(replay(setup(MADE[0], MADE[1]), MADE_LINES[:250], DWELL_S, told.append))
    assert told == [0, 100, 200]
