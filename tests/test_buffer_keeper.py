"""What the background asks of a fit: the crossing of the zenith that is in hand, and the turn of the azimuth."""

from dataclasses import replace

import pytest
from memories import remembering
from test_background import SETUP
from test_tick import CONFIG, NOW, PLAN, path, ready, status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.buffer_keeper import FROZEN_S, BufferKeeper
from acu_daemon.model import ZenithCrossing

MOMENT_S = 0.01
CROSSING = ZenithCrossing(NOW, NOW + 20.0, 50.0, 3.0, 40.0, 4.0, 3.0, NOW + 8.0)


def keeper(state: ControlState, sky: Sky) -> BufferKeeper:
    area = CommonArea(state, sky)
    return BufferKeeper(area, SETUP, CONFIG, horizon_s=90.0, low_water_s=30.0)


def in_hand(at_s: float, track: TrackState, crossing: ZenithCrossing | None) -> ZenithCrossing | None:
    """What of a crossing is gone on with, so many seconds after its departure."""
    sky = Sky(replace(path(), crossing=crossing), None, PLAN)
    return keeper(ready(track, status(AcuMode.REMOTE)), sky)._in_hand(NOW + at_s)


@pytest.mark.parametrize("track", sorted(TrackState))
def test_a_way_past_the_zenith_is_gone_on_with_from_five_seconds_before_it_begins(track: TrackState) -> None:
    assert FROZEN_S == 5.0
    assert in_hand(-5.0 - MOMENT_S, track, CROSSING) is None
    for at_s in (-5.0, 0.0, 5.0 - MOMENT_S, 20.0, 100.0):
        assert in_hand(at_s, track, CROSSING) == CROSSING
    assert in_hand(0.0, track, None) is None


@pytest.mark.parametrize("track", sorted(TrackState))
def test_one_over_the_top_that_autotrack_went_round_is_over_at_its_return(track: TrackState) -> None:
    over = replace(CROSSING, is_plunge=True)
    assert in_hand(20.0, track, over) == over
    assert in_hand(20.0 + MOMENT_S, track, over) == (None if track in AUTOTRACKING else over)


@pytest.mark.parametrize("has_prediction", [False, True])
def test_the_path_goes_on_from_the_plan_before_it_begins_and_without_a_buffer_else_from_the_buffer(
    has_prediction: bool,
) -> None:
    state = remembering(ready(TrackState.AUTOTRACK_TLE, status(AcuMode.AUTOTRACK)), az_deg=49.0)
    sky = Sky(path() if has_prediction else None, None, PLAN)
    made = keeper(state, sky)
    assert made._in_hand(NOW) is None
    before_start = replace(PLAN, start_tai_s=NOW + MOMENT_S, start_az_deg=410.0)
    assert keeper(state, replace(sky, plan=before_start))._near_az_deg(NOW) == pytest.approx(410.0)
    expected_deg = sky.prediction.at(NOW, follow=False).az_deg if sky.prediction else PLAN.start_az_deg
    assert made._near_az_deg(NOW) == pytest.approx(expected_deg)
