"""SEARCH looks along the track first, then across, and never into the horizon mask."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.control.search import search_offset, search_pointing
from acu_daemon.model import AxisLimits, Prediction

ELEVATION = AxisLimits(0.0, 90.0, 5.0, 5.0)


def straight_path(el_deg: float) -> Prediction:
    t = np.arange(900) * 0.1
    az, el = 100.0 + 0.3 * t, np.full(900, el_deg)
    rate = np.full(900, 0.3)
    return Prediction(0.0, 0.1, az, el, rate, np.zeros(900), az, rate, "TLE", 0.0)


def test_the_scan_goes_early_and_late_before_it_goes_across():
    along = [search_offset(t, 120.0, 10.0, 2.0) for t in np.arange(0.0, 60.0, 0.1)]
    across = [search_offset(t, 120.0, 10.0, 2.0) for t in np.arange(60.0, 120.0, 0.1)]
    assert min(a for a, _ in along) <= -2.5
    assert max(a for a, _ in along) >= 2.5
    assert all(c == 0.0 for _, c in along)
    assert all(a == 0.0 for a, _ in across)
    assert max(c for _, c in across) > 1.0


@given(st.floats(0, 1000), st.floats(1, 60), st.floats(0.1, 5))
def test_the_scan_stays_within_its_widths(elapsed_s, along_s, across_deg):
    a, c = search_offset(elapsed_s, 120.0, along_s, across_deg)
    assert abs(a) <= along_s + 1e-9
    assert abs(c) <= across_deg + 1e-9


@given(st.floats(0, 60), st.floats(-10, 10), st.floats(-5, 5), st.floats(0, 89))
def test_the_scan_never_looks_below_the_mask(t, along_s, across_deg, el_deg):
    point = search_pointing(straight_path(el_deg), 15.0 + t, (along_s, across_deg), ELEVATION, 5.0)
    assert point is not None
    assert 5.0 <= point.el_deg <= 90.0
