"""Offsets that are correlated: left out, but for no longer than readings that hunt are worse than none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from acu_daemon.assist.screening.correlated_offsets import CorrelatedOffsets, correlated_deg2
from acu_daemon.assist.screening.offsets import Offsets
from acu_daemon.assist.screening.orbit_test import OrbitTest
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings
from acu_daemon.units import Array

NOISE_DEG, HUNT_DEG = 0.01, 0.08
LEFT_OUT_S = 75.0  # docs/estimation.md: then such readings are better than none
KEPT_S = 60


class PathAtZero(OrbitTest):
    """The orbit that fits leads through zero at all times, so a reading's angles are its offsets."""

    def __init__(self) -> None:
        pass

    def best_offsets(self, readings: Readings, _factor: float) -> Offsets | None:
        return offsets_of(readings)


def offsets_of(readings: Readings) -> Offsets:
    return Offsets(readings.tai_s, readings.az_deg, readings.el_deg, np.full(len(readings), 0.5))


def readings(tai_s: Array, hunt_deg: float) -> Readings:
    """White noise, and on it an axis that hunts with a period of 3 s."""
    rng = np.random.default_rng(int(tai_s[0]))
    az_deg, el_deg = rng.normal(0.0, NOISE_DEG, (2, tai_s.size))
    return Readings(tai_s, az_deg + hunt_deg * np.sin(2.0 * np.pi * tai_s / 3.0), el_deg)


def left_out(hunt_deg: Array, hz: float) -> list[bool]:
    """Second by second: whether readings that hunt by so much are left out."""
    correlated = CorrelatedOffsets(PathAtZero(), EstimatorSettings(NOISE_DEG, NOISE_DEG))
    grid = np.arange(0.0, 1.0, 1.0 / hz)
    kept = readings(np.concatenate([k + grid for k in range(KEPT_S)]), 0.0)
    result = []
    for k, one_deg in enumerate(hunt_deg, start=KEPT_S):
        seen = readings(k + grid, float(one_deg))
        correlated.take(seen)
        result.append(correlated.are_correlated(kept, offsets_of))
        kept = kept if one_deg else Readings.joined([kept, seen])
    return result


@given(arrays(np.float64, (2, 12), elements=st.floats(-1.0, 1.0)))
def test_the_measure_is_the_largest_mean_product_whichever_way_the_offsets_lie(off_deg: Array) -> None:
    """Of both components alike: a turn or a mirror of the sky changes nothing."""
    right, up = off_deg
    turned = (right + up) / np.sqrt(2.0), (right - up) / np.sqrt(2.0)
    by_hand = [np.mean([right[i] * right[i + k] + up[i] * up[i + k] for i in range(12 - k)]) for k in (1, 2, 3, 4)]
    for one in ((right, up), (up, right), (-right, up), (right, -up), turned):
        assert correlated_deg2(Offsets(np.arange(12.0), *one, np.ones(12))) == pytest.approx(max(by_hand), abs=1e-9)


@pytest.mark.parametrize("hz", [5.0, 10.0])
@pytest.mark.parametrize("quiet_s", [10, 40])
def test_readings_that_hunt_are_left_out_for_75_s_and_after_quiet_ones_for_75_s_anew(quiet_s: int, hz: float) -> None:
    hunting, quiet = np.full(85, HUNT_DEG), np.zeros(quiet_s)
    result = left_out(np.concatenate([hunting, quiet, hunting]), hz)
    for first in (0, hunting.size + quiet_s):
        found_s = first + result[first:].index(True)
        assert found_s - first <= 4
        over_s = found_s + result[found_s:].index(False)
        assert over_s - first == pytest.approx(LEFT_OUT_S, abs=4.0)
        assert not any(result[over_s : first + hunting.size])
    assert not any(result[hunting.size + 5 : hunting.size + quiet_s])
