"""A start in mid-pass on the wrong turn of the cable, and what may go wrong at any time of a takeover at the zenith."""

from pathlib import Path

import numpy as np
import pytest
from flights import flight_of, worst_error_deg
from overhead_flights import HALF_BEAM_DEG, TOP_TAI_S, lost_s, over_the_zenith, overhead_target
from promise_rig import Rig, Scene
from test_plunge import plunging

from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.orbit.look import look_at
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.scenario import AcuChoice, Scenario, SkyErrors

pytestmark = pytest.mark.long


def started_before_a_stop(meets_s: float, before_s: float, after_s: float) -> tuple[Flight, float, float]:
    """Begin in mid-pass before_s before the azimuth meets the end of its range, meets_s after culmination.

    Returns: the flight, that time, and that azimuth.
    """
    target = overhead_target(800, 82.0)
    source, site = target.elements.propagator, target.station.site
    meets = coming_pass(target, TOP_TAI_S - 900.0).culmination_tai_s + meets_s
    look = look_at(source, np.array([meets - before_s, meets]), site)
    begin_deg, end_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    sign = 1.0 if end_deg > begin_deg else -1.0
    ends = (end_deg, end_deg - sign * 500.0)
    target = overhead_target(800, 82.0, azimuth={"min_deg": min(ends), "max_deg": max(ends)})
    antenna = AcuChoice(azimuth_deg=float(begin_deg), elevation_deg=float(look.el_deg[0]))
    errors = SkyErrors(along_track_s=0.1)
    flight = flight_of(target, meets - before_s, before_s + after_s, antenna=antenna, errors=errors, noise_deg=0.005)
    return flight, meets, float(end_deg)


def test_a_start_in_mid_pass_on_a_turn_that_ends_just_before_the_set_is_not_unwound_for_that() -> None:
    flight, meets, _ = started_before_a_stop(366.0, 35.0, 8.0)
    places = [row.encoder_az_deg for row in flight.rows]
    assert max(places) - min(places) < 20.0
    assert worst_error_deg(flight, meets - 15.0, meets) < 0.1


def test_a_start_in_mid_pass_on_a_turn_that_ends_long_before_the_set_is_unwound_once() -> None:
    flight, meets, end_deg = started_before_a_stop(10.0, 12.0, 45.0)
    places = np.array([row.encoder_az_deg for row in flight.rows])
    assert np.ptp(places) > 320.0
    assert np.abs(np.diff(places)).sum() < 440.0
    assert abs(abs(places[-1] - end_deg) - 360.0) < 60.0
    assert worst_error_deg(flight, meets + 35.0, meets + 45.0) < 0.1
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


@pytest.mark.parametrize("from_s", [-5.0, -3.0, -1.0, 0.5, 3.0, 4.5])
def test_a_signal_that_goes_at_any_instant_of_a_takeover_is_held(from_s: float) -> None:
    """The takeover of 800 km and 89.3 deg lasts from 5 s before culmination to 4 s after it."""
    flight = over_the_zenith(
        overhead_target(800, 89.3), before_s=20.0, after_s=13.0, losses=[(20.0 + from_s, 31.0)], noise_deg=0.01
    )
    assert lost_s(flight) == 0.0
    assert "SEARCH" not in flight.states()
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


def crashing(
    tmp_path: Path, target: Target, crash_s: float, until_s: float
) -> tuple[list[str], list[float], list[float]]:
    """Kill the daemon so long after culmination, and start it again at once: its states, times and beam errors."""
    begin = TOP_TAI_S - 30.0
    look = look_at(target.elements.propagator, np.array([begin]), target.station.site)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    sky = make_sky(target.elements.propagator, target.station.site, Scenario(sky=SkyErrors(along_track_s=0.3)))
    rig = Rig(tmp_path, Scene(target, sky, begin, antenna, coming_pass(target, begin)))
    rows, states = [], []
    rig.acu.observer = rows.append

    def until(since_top_s: float) -> None:
        while rig.clock.tai_s() < TOP_TAI_S + since_top_s:
            rig.wait(0.1)
            states.append(str(rig.state.tracking.track))

    until(crash_s)
    assert states[-1] == "ZENITH"
    rig.crash(0.0)
    until(until_s)
    times = [row.tai_s - TOP_TAI_S for row in rows]
    return states, times, [row.beam_error_deg for row in rows]


@pytest.mark.parametrize("crash_s", [-3.4, 0.0, 2.5])
def test_a_daemon_that_crashes_at_any_time_of_a_takeover_is_back_in_autotrack(tmp_path: Path, crash_s: float) -> None:
    states, times, errors = crashing(tmp_path, overhead_target(705, 89.0), crash_s, 21.0)
    assert states[-1] == "AUTOTRACK/FITTED"
    assert max(error for at_s, error in zip(times, errors, strict=True) if at_s > 19.0) < 0.1
    lost = [error for at_s, error in zip(times, errors, strict=True) if at_s > -10.0 and error > HALF_BEAM_DEG]
    assert 0.1 * len(lost) < 16.0


@pytest.mark.parametrize("crash_s", [-2.0, 2.5])
def test_a_daemon_that_crashes_on_the_way_over_the_top_is_back_within_seconds(tmp_path: Path, crash_s: float) -> None:
    target = plunging(500, 89.7)
    states, times, errors = crashing(tmp_path, target, crash_s, 30.0)
    assert states[-1] == "AUTOTRACK/FITTED"
    assert max(error for at_s, error in zip(times, errors, strict=True) if at_s > 28.0) < 0.1
    lost = [error for at_s, error in zip(times, errors, strict=True) if at_s > -10.0 and error > HALF_BEAM_DEG]
    assert 0.1 * len(lost) < 9.0
