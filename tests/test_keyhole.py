"""pointing.keyhole: the azimuth path through the zenith that a drive can follow."""

import numpy as np
import pytest
import real_passes
from conftest import needs_data
from real_passes import sky_angles_deg

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.pointing.keyhole import follow_path, longest_window_s

DRIVE = AxisLimits(-270.0, 270.0, 20.0, 10.0)
STEP_S = 0.1
HALF_BEAM_DEG = 0.5


def _zenith(
    top_deg: float, speed_deg_s: float = 0.5, shift_s: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A straight line past the zenith: azimuth, rate, elevation, 900 samples, fastest at 45 s + shift."""
    t = STEP_S * np.arange(900) - 45.0 - shift_s
    miss, w = np.radians(90.0 - top_deg), np.radians(speed_deg_s)
    az = 90.0 + np.degrees(np.arctan2(w * t, miss))
    return az, np.degrees(w * miss / (miss**2 + (w * t) ** 2)), 90.0 - np.degrees(np.hypot(miss, w * t))


def _within_the_drive(az: np.ndarray, rate: np.ndarray) -> bool:
    return bool(
        np.all(np.abs(rate) <= DRIVE.max_rate_deg_s)
        and np.all(np.abs(np.diff(az)) <= DRIVE.max_rate_deg_s * STEP_S)
        and np.all(np.abs(np.diff(rate)) <= DRIVE.max_acceleration_deg_s2 * STEP_S)
    )


@pytest.mark.parametrize("top_deg", [60.0, 85.0, 88.0])
def test_a_path_within_the_drive_is_left_as_it_is(top_deg):
    az, rate, _ = _zenith(top_deg)
    followed, followed_rate = follow_path(az, rate, STEP_S, DRIVE)
    assert followed is az
    assert followed_rate is rate


@pytest.mark.parametrize("top_deg", [88.6, 89.0, 89.5, 89.9, 89.99])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_through_the_zenith_the_path_stays_within_the_drive_and_joins_the_true_one(top_deg, sign):
    az, rate, _ = _zenith(top_deg)
    followed, followed_rate = follow_path(sign * az, sign * rate, STEP_S, DRIVE)
    assert _within_the_drive(followed, followed_rate)
    is_window = followed != sign * az
    assert 0 < is_window.sum() * STEP_S <= longest_window_s(DRIVE)
    assert np.all(followed_rate[~is_window] == sign * rate[~is_window])
    # position is the integral of the rate: trapezoids, exact but at the three corners of the profile
    assert np.allclose(np.diff(followed), STEP_S * (followed_rate[1:] + followed_rate[:-1]) / 2, atol=0.03)


def test_the_window_lies_half_before_and_half_after_culmination():
    az, rate, el = _zenith(89.84)
    window = np.flatnonzero(follow_path(az, rate, STEP_S, DRIVE)[0] != az)
    assert abs((window[0] + window[-1]) / 2 - np.argmax(el)) <= 1


@pytest.mark.parametrize("shift_s", [-46.0, -45.0, -42.0, 42.0, 44.9])
def test_a_window_cut_by_the_paths_end_still_stays_within_the_drive(shift_s):
    az, rate, _ = _zenith(89.8, shift_s=shift_s)
    followed, followed_rate = follow_path(az, rate, STEP_S, DRIVE)
    assert _within_the_drive(followed, followed_rate)
    assert followed[0] == az[0]


def test_a_drive_too_slow_for_the_whole_path_chases_it():
    slow = AxisLimits(-270.0, 270.0, 1.0, 1.0)
    az, rate, _ = _zenith(89.8)
    followed, followed_rate = follow_path(az, rate, STEP_S, slow)
    assert np.all(np.abs(followed_rate) <= slow.max_rate_deg_s)
    assert np.all(np.abs(np.diff(followed)) <= slow.max_rate_deg_s * STEP_S + 1e-9)


@needs_data
def test_on_jason_1_over_cuiaba_the_beam_stays_on_the_satellite_where_a_chasing_drive_loses_it():
    real = real_passes.load("jason-1-Cuiaba-20030108T1414")
    t = real.tai_s[0] + np.arange(0.0, real.tai_s.size - 1.0, STEP_S)
    (az, el), (after, _), (before, _) = real.sky(t), real.sky(t + 1e-3), real.sky(t - 1e-3)
    az, rate = np.degrees(np.unwrap(np.radians(az))), ((after - before + 180.0) % 360.0 - 180.0) / 2e-3
    followed, followed_rate = follow_path(az, rate, STEP_S, DRIVE)
    chase = [AxisState(float(az[0]), float(rate[0]))]
    for target, target_rate in zip(az[1:], rate[1:], strict=True):
        chase.append(step(chase[-1], float(target), float(target_rate), STEP_S, DRIVE))
    off_deg = sky_angles_deg(followed, el, az, el)
    chase_off_deg = sky_angles_deg(np.array([s.position_deg for s in chase]), el, az, el)
    assert _within_the_drive(followed, followed_rate)
    assert off_deg.max() < 0.45
    assert chase_off_deg.max() > 0.9
    assert (off_deg > HALF_BEAM_DEG).sum() == 0
    assert (chase_off_deg > HALF_BEAM_DEG).sum() * STEP_S > 4.0
