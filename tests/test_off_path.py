"""What is shown of the pointing, against the sky that only the simulator knows: losses, zenith, a stuck axis."""

from collections.abc import Callable

import numpy as np
import pytest
from flights import DEMO_TAI_S, climb, demo_target, flight_of

from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.control.tracking.state_table import ACTIVE
from acu_daemon.daemon.live import live_text
from acu_daemon.daemon.verdict import Level, verdict
from acu_daemon.sim.scenario import AcuChoice

HALF_BEAM_DEG = 0.5
KNOWN_DEG = 0.15  # what noise and an old fit near the zenith may make of it
ZENITH_S = 61.0
SLOW_DEG_S = 8.0
ANTENNA = AcuChoice(azimuth_deg=120.0, elevation_deg=50.0)  # on its way to the path it shows its turn
SETTLED_S = 12.0  # acquired and fitted


def zenith() -> Flight:
    """A loss from 5 s before the zenith on, with a drive that cannot follow there."""
    target = demo_target(azimuth={"max_rate_deg_s": SLOW_DEG_S}, tracking={"zenith_takeover": "never"})
    return flight_of(
        target,
        DEMO_TAI_S,
        ZENITH_S + 3.0,
        antenna=AcuChoice(azimuth_deg=120.0, elevation_deg=50.0),
        losses=[(ZENITH_S - 5.0, 1e3)],
    )


def stuck() -> Flight:
    """An elevation that stands still in a loss: off the path before it is latched."""
    faults = ["stuck axis=elevation start_s=20 duration_s=30"]
    return climb(40.0, losses=[(18.0, 1e3)], faults=faults)


@pytest.mark.long
@pytest.mark.parametrize("fly", [zenith, stuck])
def test_on_and_off_are_true_of_the_antenna_in_every_state_that_steers(fly: Callable[[], Flight]) -> None:
    flight = fly()
    times, errors = np.array([(row.tai_s, row.beam_error_deg) for row in flight.rows]).T
    begin_tai_s = flight.snapshots[0].tai_s
    words = set()
    for seen in flight.snapshots:
        if seen.state not in ACTIVE:
            assert seen.off_path_deg is None
            continue
        if seen.reading_age_s is None or seen.tai_s < begin_tai_s + SETTLED_S:
            continue
        error_deg = float(np.interp(seen.tai_s - seen.reading_age_s, times, errors))
        assert seen.off_path_deg == pytest.approx(error_deg, abs=KNOWN_DEG)
        assert seen.is_on_path == (seen.off_path_deg <= HALF_BEAM_DEG)
        assert ("ON path" in live_text(seen)) == seen.is_on_path
        words.add(verdict(seen).word)
        if error_deg > HALF_BEAM_DEG + KNOWN_DEG:
            assert verdict(seen).word == "OFF PATH"
            assert verdict(seen).level is Level.BAD
    assert {"TRACKING", "HOLDING", "OFF PATH"} <= words


def test_stopped_is_said_when_the_readings_stand_still_and_not_before() -> None:
    flight = stuck()
    latched = [seen for seen in flight.snapshots if seen.latch]
    speeds = {round(row.tai_s, 1): row for row in flight.rows}
    stopped = [seen for seen in latched if seen.verdict == "STOPPED"]
    assert latched[0].verdict == "STOPPING"
    assert stopped
    for seen in stopped:
        now, before = speeds.get(round(seen.tai_s, 1)), speeds.get(round(seen.tai_s - 0.5, 1))
        if now is not None and before is not None:
            assert abs(now.encoder_az_deg - before.encoder_az_deg) < 0.2
            assert abs(now.encoder_el_deg - before.encoder_el_deg) < 0.2
