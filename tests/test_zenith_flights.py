"""Over the zenith: the daemon leads the antenna past it and gives it back, whatever happens meanwhile."""

import pytest
from overhead_flights import (
    errors_deg,
    lost_s,
    over_the_zenith,
    overhead_target,
)
from test_keyhole import BOUNDS

pytestmark = pytest.mark.long

SHORT = {"before_s": 30.0, "after_s": 16.0}


@pytest.mark.parametrize(("height_km", "top_deg", "before_s"), [(705, 89.0, 30.0), (500, 88.5, 60.0)])
def test_a_pass_that_autotrack_loses_for_seconds_is_not_lost_at_all(
    height_km: float, top_deg: float, before_s: float
) -> None:
    flight = over_the_zenith(overhead_target(height_km, top_deg), before_s=before_s, after_s=16.0)
    assert lost_s(flight) == 0.0
    assert flight.states()[-3:] == ["ZENITH", "HOLD/FITTED", "AUTOTRACK/FITTED"]


def test_through_the_zenith_itself_the_error_is_near_the_least_that_a_drive_can_do() -> None:
    flight = over_the_zenith(overhead_target(705, 89.995), **SHORT)
    assert errors_deg(flight, -15.0, 15.0).max() <= 1.08 * BOUNDS[705, 89.99][0]
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


def test_a_signal_that_goes_while_the_antenna_is_led_past_the_zenith_is_held() -> None:
    target = overhead_target(800, 89.3)
    flight = over_the_zenith(target, losses=[(25.0, 42.0)], **SHORT)  # from 5 s before culmination on
    assert lost_s(flight) == 0.0
    assert flight.states()[-3:] == ["ZENITH", "HOLD/FITTED", "AUTOTRACK/FITTED"]
