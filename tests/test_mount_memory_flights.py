"""The daemon with a memory of its antenna, flown: a short lock is enough, a wrong memory is found out."""

from dataclasses import replace

import numpy as np
import pytest
from flights import RISING_TAI_S, climb, demo_target, worst_error_deg

from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, Remembered, first_memory
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.units import DEG

pytestmark = pytest.mark.long

BIASES_DEG = (0.15, -0.15)  # of the encoders, as the simulator has them
TARGET = demo_target()
SETTINGS = estimator_settings(TARGET.station, TARGET.satellite)


def memory_of(ia_deg: float, ie_deg: float) -> PedestalMemory:
    """After ten passes that showed these zero points, to 0.005 deg."""
    first = first_memory(SETTINGS, RISING_TAI_S - 6000.0)
    mean = np.zeros_like(first.const.mean)
    mean[[0, 2]] = ia_deg * DEG, ie_deg * DEG
    known = []
    for one in (first.const, first.mount):
        covariance = one.covariance.copy()
        covariance[8:, 8:] *= 0.1  # day and night
        covariance[0, 0] = covariance[2, 2] = (0.005 * DEG) ** 2
        known.append(Remembered(mean, covariance))
    return replace(first, pass_count=10, const=known[0], mount=known[1], still=known[1].still)


def test_after_ten_seconds_of_lock_the_satellite_is_followed_as_if_the_encoders_were_known() -> None:
    worst = []
    for memory in (memory_of(*BIASES_DEG), None):
        flight = climb(60.0, TARGET, losses=[(14.0, 60.0)], biases_deg=BIASES_DEG, memory=memory)
        worst.append(worst_error_deg(flight, RISING_TAI_S + 15.0, RISING_TAI_S + 60.0))
    assert worst[0] < 0.5 * worst[1]
    assert worst[0] < 0.08


def test_a_memory_of_encoders_that_were_re_zeroed_since_is_found_out_and_told() -> None:
    flight = climb(95.0, TARGET, losses=[(80.0, 95.0)], biases_deg=BIASES_DEG, memory=memory_of(0.15, 0.1))
    assert flight.estimates[-1].doubt.is_rezeroed
    notes = [event["note"] for event in flight.events if event["event"] == "fit.note"]
    assert [note for note in notes if "re-zeroed since the last passes" in note]
    assert worst_error_deg(flight, RISING_TAI_S + 81.0, RISING_TAI_S + 95.0) < 0.1
