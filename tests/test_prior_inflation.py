"""Elements far worse than their sigmas: the fit finds the satellite all the same, says so, and is honest about it."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_orbits import circular, site, visible
from real_passes import noisy, sky_angles_deg

from acu_daemon.assist.estimators.estimator import make_estimator
from acu_daemon.assist.estimators.full.elements_discrepancy import describe_discrepancy
from acu_daemon.assist.estimators.full.estimated_states import make_prior
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.full.prior_inflation import WIDTHS
from acu_daemon.assist.mount_model import encoder_look, sigma_deg
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import BROUWER_SIGMAS, EPHEMERIS_SIGMAS, ElementSigmas, EstimatorSettings, StateSigmas
from acu_daemon.model import AngleBias, AxisLimits, Correction, FitResult, Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DAY_S, DEG

DOCS = Path(__file__).resolve().parents[1] / "docs" / "estimation.md"
SIGMA_DEG = 0.03
GIVEN = EstimatorSettings(SIGMA_DEG, SIGMA_DEG, orbit_sigmas=StateSigmas(3e3, 3.0))
SOURCE, WHERE = circular(66.0, 0.001), site(4.0)
TRUTH = {km: SOURCE.corrected(Correction(delta_mean_anomaly_rad=-km / 7180.0)) for km in (0.0, 3.0, 49.0, -49.0, 200.0)}


def readings_of(km: float, seed: int = 1, bias: AngleBias | None = None) -> Readings:
    bias = bias or AngleBias()
    tai_s = visible(TRUTH[km], WHERE, 1.0)
    seen = look_at(TRUTH[km], tai_s, WHERE)
    return noisy(seen.az_deg + bias.az_deg, seen.el_deg + bias.el_deg, tai_s, SIGMA_DEG, np.random.default_rng(seed))


def first(readings: Readings, count: int) -> Readings:
    return readings.part(slice(0, count))


def off_and_sigma_deg(fit: FitResult | None, km: float, tai_s: Any) -> tuple[Any, Any]:
    assert fit is not None
    corrected = SOURCE.corrected(fit.correction)
    seen, real = encoder_look(corrected, tai_s, WHERE, fit), look_at(TRUTH[km], tai_s, WHERE)
    sigma = sigma_deg(corrected, tai_s, WHERE, fit)
    assert sigma is not None
    return sky_angles_deg(seen.az_deg, seen.el_deg, real.az_deg, real.el_deg), sigma


@pytest.mark.long
@pytest.mark.parametrize("km", [49.0, -49.0, 200.0])
@pytest.mark.parametrize("count", [60, 300])
def test_elements_sixteen_sigmas_off_are_recovered_with_a_note(km: float, count: int) -> None:
    readings = readings_of(km)
    estimator = make_estimator("full", SOURCE, WHERE, GIVEN)
    for k in range(0, count, 20):
        estimator.add(readings.part(slice(k, k + 20)))
        fit = estimator.fit()
    off, sigma = off_and_sigma_deg(fit, km, readings.tai_s)
    assert (off < 4.0 * sigma + 0.01).all()
    assert off.max() < (1.0 if count == 60 else 0.1)
    assert estimator.notes[0].startswith("the satellite is farther from its elements than their sigmas allow")
    assert len(estimator.notes) < len(WIDTHS)
    narrow = FullEstimator(SOURCE, WHERE, GIVEN)
    narrow.add(first(readings, count))
    off, sigma = off_and_sigma_deg(narrow.fit(), km, readings.tai_s)
    assert (off > 4.0 * sigma).any()


def test_the_widths_that_are_tried_are_those_of_the_documentation() -> None:
    lines = DOCS.read_text().split("### Prior inflation")[1].split("```")[0].splitlines()
    rows = [
        [float("".join(re.findall(r"[\d.]", cell)) or 0.0) for cell in line.split("|")[2:4]]
        for line in lines
        if "x" in line and line.startswith("|")
    ]
    assert len(rows) == len(WIDTHS)
    given = make_prior(SOURCE, GIVEN, SOURCE.epoch_tai_s).covariance
    sigma = np.sqrt(np.diag(given))
    for width, (along_deg, factor) in zip(WIDTHS, rows, strict=True):
        expected = sigma * np.where(np.arange(sigma.size) < 6, factor, 1.0)
        expected[1] = np.hypot(expected[1], along_deg * DEG)
        assert np.sqrt(np.diag(width.covariance(given))) == pytest.approx(expected)


@pytest.mark.parametrize("bias", [AngleBias(), AngleBias(az_deg=0.15, el_deg=-0.12)])
@pytest.mark.parametrize("km", [0.0, 3.0])
def test_elements_within_their_sigmas_are_left_as_narrow_as_they_are(km: float, bias: AngleBias) -> None:
    for seed in range(4):
        readings = readings_of(km, seed, bias)
        estimators = [make_estimator("full", SOURCE, WHERE, GIVEN), FullEstimator(SOURCE, WHERE, GIVEN)]
        for one in estimators:
            one.add(first(readings, 200))
        wide, narrow = (one.fit() for one in estimators)
        assert wide is not None
        assert narrow is not None
        assert wide.correction == narrow.correction
        assert estimators[0].notes == []


def test_readings_noisier_than_configured_widen_nothing() -> None:
    noise = np.random.default_rng(5).normal(size=(2, 200)) * 5.0 * SIGMA_DEG
    few = first(readings_of(0.0), 200)
    estimator = make_estimator("full", SOURCE, WHERE, GIVEN)
    estimator.add(Readings(few.tai_s, few.az_deg + noise[0], few.el_deg + noise[1]))
    estimator.fit()
    assert estimator.notes == []


def test_the_daemons_refit_finds_such_a_satellite_through_its_gate() -> None:
    readings = readings_of(49.0)
    setup = RefitSetup(SOURCE, WHERE, "full", GIVEN, AxisLimits(-270.0, 270.0, 20.0, 10.0))
    refitter = Refitter(setup)
    notes: list[str] = []
    for k in range(0, 120, 5):
        now_tai_s = float(readings.tai_s[k + 4])
        part = readings.part(slice(k, k + 5))
        reply = refitter.refit(RefitRequest(part, now_tai_s, 90.0, now_tai_s, 0.0))
        notes += reply.notes
    off, sigma = off_and_sigma_deg(reply.fit, 49.0, readings.tai_s[120:])
    assert (off < 4.0 * sigma).all()
    assert off.max() < 0.5
    assert any("farther from its elements" in note for note in notes)


# What is known before the first reading


def test_each_kind_of_elements_has_sigmas_of_its_own_unless_the_satellites_file_says_them() -> None:
    plain = EstimatorSettings()
    assert [plain.sigmas_of(kind) for kind in ("tle", "omm", "oem", "brouwer")] == [
        ElementSigmas(),
        ElementSigmas(),
        EPHEMERIS_SIGMAS,
        BROUWER_SIGMAS,
    ]
    assert GIVEN.sigmas_of("brouwer") == GIVEN.sigmas_of("oem") == StateSigmas(3e3, 3.0)


def test_mean_motion_and_e_vector_of_brouwer_elements_are_worth_less_by_the_day() -> None:
    """Against an integrated orbit without drag: 0.4 km a day, radially, are 6e-5 in the e-vector."""
    sigmas = [
        np.sqrt(np.diag(make_prior(SOURCE, EstimatorSettings(), SOURCE.epoch_tai_s + days * DAY_S).covariance))
        for days in (0.0, 5.0, 10.0)
    ]
    assert sigmas[0][3] == pytest.approx(2e-4)
    assert sigmas[1][3] == pytest.approx(np.hypot(2e-4, 3e-4))
    assert sigmas[2][4] == pytest.approx(np.hypot(2e-4, 6e-4))
    assert sigmas[2][2] == pytest.approx(4e-5 / 60.0, rel=0.02)
    assert sigmas[2][0] == sigmas[0][0]


# What it says of the cause


def note_of(truth: Any, *, clock_s: float = 0.0, bias: AngleBias | None = None, count: int = 60) -> str:
    """The last note of a fit to a pass; clock_s: how fast the station's clock is."""
    bias = bias or AngleBias()
    tai_s = visible(truth, WHERE, 1.0)
    seen = look_at(truth, tai_s - clock_s, WHERE)
    az_deg, el_deg = seen.az_deg + bias.az_deg, seen.el_deg + bias.el_deg
    readings = noisy(az_deg, el_deg, tai_s, SIGMA_DEG, np.random.default_rng(1))
    estimator = make_estimator("full", SOURCE, WHERE, GIVEN)
    for k in range(0, count, 20):
        estimator.add(readings.part(slice(k, k + 20)))
        estimator.fit()
    return estimator.notes[-1]


@pytest.mark.parametrize("seconds", [14.0, -14.0, 7.0])
def test_a_clock_and_elements_that_are_late_alike_are_both_named_and_none_is_blamed(seconds: float) -> None:
    """A rehearsal's clock 14 s off was told as elements to be fetched anew."""
    late = SOURCE.corrected(Correction(delta_mean_anomaly_rad=-seconds * 7.4 / 7180.0))
    for note in (note_of(SOURCE, clock_s=seconds), note_of(late)):
        side, clock = ("late", "fast") if seconds > 0 else ("early", "slow")
        said = float(note.split("allow: ")[1].split(" s ")[0])
        assert said == pytest.approx(abs(seconds), abs=1.5)
        assert f" s {side}, " in note
        assert f"like a clock that is {said:.1f} s {clock}" in note
        assert "elements (0.0 days" in note
        assert "look at both" in note
        assert "fetch" not in note


def test_what_lies_beside_the_track_is_no_matter_of_the_clock() -> None:
    for note in (
        note_of(SOURCE.corrected(Correction(delta_raan_rad=0.01))),
        note_of(SOURCE, bias=AngleBias(az_deg=1.0)),
    ):
        assert "km of it lie beside the track" in note
        assert "another object" in note
        assert "a station whose place is wrong" in note
        assert "encoders that read beside" in note
        assert "clock" not in note


def test_an_encoder_that_reads_farther_beside_than_expected_is_named() -> None:
    text = describe_discrepancy(SOURCE, GIVEN, Correction(), AngleBias(az_deg=0.31), (0.0, 0.0), SOURCE.epoch_tai_s)
    assert "the azimuth encoder seems to read +0.31 deg beside (bias_sigma_azimuth_deg = 0.1)" in text
    assert "elevation encoder" not in text
