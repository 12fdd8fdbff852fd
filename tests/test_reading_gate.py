"""assist.reading_gate: the dwell, and the plain reasons to leave a reading out."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION, Dwell, below_highest, locked_readings
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Reading, Readings


def _flags(flags: list[bool], step_s: float = 0.1) -> list[Reading]:
    return [Reading(step_s * k, 10.0, 20.0, flag) for k, flag in enumerate(flags)]


def _readings(rows: list[tuple[float, float, float]]) -> Readings:
    return Readings(*np.array(rows).T)


def test_readings_count_as_locked_after_the_dwell_and_a_break_starts_it_afresh():
    readings = _flags([True] * 15 + [False] + [True] * 15)
    kept = locked_readings(readings, Dwell(1.0))
    assert np.allclose(kept.tai_s, [1.0, 1.1, 1.2, 1.3, 1.4, 2.6, 2.7, 2.8, 2.9, 3.0])


def test_a_stream_of_one_reading_in_five_seconds_is_locked_from_its_second_reading_on():
    assert locked_readings(_flags([True] * 4, step_s=5.0), Dwell(1.0)).tai_s.tolist() == [5.0, 10.0, 15.0]


def test_a_gap_in_the_readings_starts_the_dwell_afresh():
    readings = [*_flags([True] * 12), Reading(60.0, 10.0, 20.0, True), Reading(60.5, 10.0, 20.0, True)]
    assert locked_readings(readings, Dwell(1.0)).tai_s.tolist() == [1.0, 1.1]


@given(flags=st.lists(st.booleans(), max_size=60), cut=st.integers(0, 60))
def test_the_dwell_does_not_depend_on_how_the_stream_is_cut(flags, cut):
    readings = _flags(flags)
    dwell = Dwell(1.0)
    parts = [locked_readings(part, dwell).tai_s for part in (readings[:cut], readings[cut:])]
    assert np.array_equal(np.concatenate(parts), locked_readings(readings, Dwell(1.0)).tai_s)


def test_readings_above_the_highest_elevation_are_left_out_with_their_reason():
    rows = [(0.0, 10.0, 79.9), (0.1, 10.0, 80.1), (0.2, 10.0, 79.9)]
    kept, rejected = below_highest(_readings(rows), EstimatorSettings(0.03, 0.03, 80.0))
    assert kept.tai_s.tolist() == [0.0, 0.2]
    assert [(r.tai_s, r.reason) for r in rejected] == [(0.1, ABOVE_MAX_ELEVATION)]
