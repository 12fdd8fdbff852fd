"""Elements that are wrong by more than the beam: the satellite is looked for from its rise on."""

import numpy as np
import pytest
from flights import (
    DEMO_TAI_S,
    RISING_TAI_S,
    climb,
    demo_target,
    events_named,
    flight_of,
    seconds_to_state,
    sky_of,
    the_pass,
)

from acu_daemon.cli.options import Target
from acu_daemon.sim.scenario import AcuChoice, SkyErrors

pytestmark = pytest.mark.long

FOUND_S = 60.0


def unsure_target(beam_deg: float, position_km: float) -> Target:
    target = demo_target(receiver={"beamwidth_deg": beam_deg})
    worth = target.satellite.uncertainty.model_copy(update={"position_km": position_km, "velocity_m_s": position_km})
    return Target(target.station, target.satellite.model_copy(update={"uncertainty": worth}), target.elements)


@pytest.mark.parametrize(("beam_deg", "late_s", "raan_deg"), [(0.5, -10.0, 0.2), (1.0, 10.0, -0.2)])
def test_a_satellite_10_seconds_and_a_fifth_of_a_degree_off_is_found_at_its_rise(
    beam_deg: float, late_s: float, raan_deg: float
) -> None:
    target = unsure_target(beam_deg, 40.0)
    coming, errors = the_pass(target, DEMO_TAI_S), SkyErrors(along_track_s=late_s, delta_raan_deg=raan_deg)
    antenna = AcuChoice(azimuth_deg=168.3, elevation_deg=5.0)
    flight = flight_of(target, coming.rise_tai_s - 35.0, 85.0, antenna=antenna, errors=errors)
    sky = sky_of(target, errors)
    times = coming.rise_tai_s + np.arange(-30.0, 30.0, 0.5)
    risen = next(t for t in times.tolist() if (seen := sky.direction(t)) is not None and seen[1] >= 5.0)
    assert "SEARCH" in flight.states()
    assert seconds_to_state(flight, "AUTOTRACK/TLE", risen - 20.0) - 20.0 < FOUND_S
    assert events_named(flight, "search.ended")[-1]["is_found"]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_glimpse_of_a_satellite_whose_elements_may_be_off_by_the_beam_is_not_waited_for_as_a_lock_is(
    side: float,
) -> None:
    """A glimpse on the way, then silence: such a start in mid-pass waited for a minute beside the satellite."""
    errors = SkyErrors(along_track_s=2.0 * side)
    first_s = seconds_to_state(climb(30.0, errors=errors), "AUTOTRACK/TLE", RISING_TAI_S)
    flight = climb(90.0, errors=errors, losses=[(first_s + 0.1, first_s + 30.0)])
    assert 9.0 < seconds_to_state(flight, "SEARCH", RISING_TAI_S) - first_s < 12.0
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", RISING_TAI_S) < first_s + 75.0
