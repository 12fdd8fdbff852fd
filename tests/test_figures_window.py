"""The measuring of flights: when the azimuth drive cannot be on the true path."""

import math

import numpy as np
import pytest
from figures import keyhole_window
from zenith_bound import overhead_pass


class LateSky:
    """A pass over the zenith whose first seconds nobody has seen: the signal is still on its way."""

    def __init__(self, top_deg: float, begins_s: float) -> None:
        self.rows, self.begins_s = overhead_pass(705.0, top_deg, span_s=40.0), begins_s

    def direction(self, tai_s: float) -> tuple[float, float, float] | None:
        if tai_s < self.begins_s:
            return None
        az_deg, el_deg = (float(np.interp(tai_s, self.rows[0], self.rows[k])) for k in (1, 2))
        return az_deg % 360.0, el_deg, 1e6


@pytest.mark.parametrize("begins_s", [-40.0, -39.95])
def test_the_window_of_the_drive_is_found_in_a_sky_that_begins_late(begins_s) -> None:
    window, _ = keyhole_window(LateSky(89.5, begins_s), (-40.0, 40.0), (-30.0, 30.0))
    assert -15.0 < window[0] < -3.0
    assert 3.0 < window[1] < 15.0


def test_a_pass_that_the_drive_can_follow_has_no_window() -> None:
    assert keyhole_window(LateSky(80.0, -39.95), (-40.0, 40.0), (-30.0, 30.0)) == ((math.inf, math.inf), 0.0)
