"""Over the zenith: the daemon leads the antenna past it and gives it back, whatever happens meanwhile."""

from pathlib import Path

import numpy as np
import pytest
from overhead_flights import (
    HALF_BEAM_DEG,
    TOP_TAI_S,
    errors_deg,
    lost_s,
    over_the_zenith,
    overhead_target,
)
from promise_rig import Rig, Scene
from test_keyhole import BOUNDS

from acu_daemon.cli.options import coming_pass
from acu_daemon.orbit.look import look_at
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.scenario import AcuChoice, Scenario, SkyErrors

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


def test_a_daemon_that_crashes_while_autotrack_is_deselected_goes_on_past_the_zenith(tmp_path: Path) -> None:
    """The antenna stands until there is another daemon: it is back on the plan, or past it on the path, in seconds."""
    target = overhead_target(705, 89.0)
    begin = TOP_TAI_S - 30.0
    look = look_at(target.elements.propagator, np.array([begin]), target.station.site)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    errors = SkyErrors(along_track_s=0.3)
    sky = make_sky(target.elements.propagator, target.station.site, Scenario(sky=errors))
    rig = Rig(tmp_path, Scene(target, sky, begin, antenna, coming_pass(target, begin)))
    rows = []
    rig.acu.observer = rows.append
    states = [str(rig.state.tracking.track)]

    def until(since_top_s: float) -> None:
        while rig.clock.tai_s() < TOP_TAI_S + since_top_s:
            rig.wait(0.1)
            states.append(str(rig.state.tracking.track))

    until(-3.5)
    assert states[-1] == "ZENITH"
    rig.crash(0.0)
    until(21.0)
    assert states[-1] == "AUTOTRACK/FITTED"
    assert max(row.beam_error_deg for row in rows if row.tai_s > TOP_TAI_S + 19.0) < 0.1
    lost = [row for row in rows if row.tai_s > TOP_TAI_S - 10.0 and row.beam_error_deg > HALF_BEAM_DEG]
    assert 0.1 * len(lost) < 16.0
