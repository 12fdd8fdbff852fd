"""What is drawn around the figures: where everything stands, the path ahead, what a search has covered."""

from dataclasses import replace

import numpy as np
import pytest
from memories import remembering
from test_tick import AZ_DEG, AZ_RATE, CONFIG, EL_DEG, EL_RATE, NOW, SKY, path, ready, status

from acu_daemon.control.state import ControlState, Scan, Search
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.with_parts import with_parts
from acu_daemon.daemon.drawing import Aim, PathAhead, take_ahead, take_aim, take_backdrop
from acu_daemon.model import Model, Pass, Reading
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.skyline import skyline_of

COMING = Pass(NOW - 100.0, NOW, NOW + 100.0, 10.0, 80.0, 100.0, 190.0)


def seen_at(az_deg: float, el_deg: float, age_s: float = 0.0) -> ControlState:
    """A daemon whose newest reading is of that direction."""
    state = ready(TrackState.AUTOTRACK_FITTED, status())
    return with_parts(state, intake=replace(state.intake, reading=Reading(NOW - age_s, az_deg, el_deg, True)))


def test_before_the_first_status_nothing_stands_anywhere() -> None:
    assert take_aim(ControlState(), Sky(), NOW, CONFIG) == Aim()
    assert take_ahead(ControlState(), Sky(), NOW, CONFIG) == PathAhead()


def test_the_antenna_is_drawn_beside_the_path_of_its_own_time_on_the_sky() -> None:
    aim = take_aim(seen_at(AZ_DEG + 1.0 - 0.1 * AZ_RATE, EL_DEG - 0.2 - 0.1 * EL_RATE, 0.1), SKY, NOW, CONFIG)
    assert aim.beside_deg == pytest.approx((np.cos(np.radians(EL_DEG - 0.1 * EL_RATE)), -0.2), abs=1e-6)
    assert aim.path_deg == pytest.approx((AZ_DEG, EL_DEG))
    right = AZ_RATE * np.cos(np.radians(EL_DEG))
    assert aim.heading_deg == pytest.approx(np.degrees(np.arctan2(right, EL_RATE)))
    assert aim.written_age_s == pytest.approx(0.1)
    assert aim.az_turn_deg == AZ_DEG


@pytest.mark.parametrize(("spread", "along", "across"), [((0.2, 0.1), True, 0.3), (None, False, 0.6)])
def test_3_sigma_are_drawn_along_and_across_or_as_a_circle(
    spread: tuple[float, float] | None, along: bool, across: float
) -> None:
    prediction = replace(path(), spread=spread, sigma_deg=np.full(910, 0.2))
    found = take_aim(seen_at(AZ_DEG, EL_DEG), replace(SKY, prediction=prediction), NOW, CONFIG).spread_deg
    speed_deg_s = np.hypot(AZ_RATE * np.cos(np.radians(EL_DEG)), EL_RATE)
    assert found == pytest.approx((3 * 0.2 * speed_deg_s if along else 0.6, across))


def test_the_path_ahead_is_a_point_every_two_seconds_from_now_on() -> None:
    ahead = take_ahead(seen_at(AZ_DEG, EL_DEG), SKY, NOW + 10.0, CONFIG).ahead
    assert ahead[0] == pytest.approx((AZ_DEG + 5.0, EL_DEG + 3.0), abs=0.01)
    assert ahead[1] == pytest.approx((AZ_DEG + 6.0, EL_DEG + 3.6), abs=0.01)
    assert len(ahead) == 40


def test_rows_that_were_searched_are_lines_beside_the_satellite() -> None:
    scan = Scan(model=Model.ELEMENTS, rows=((0, (-4.0, 2.0)), (1, (-1.0, 1.0))))
    state = with_parts(remembering(track=TrackState.SEARCH), search=Search(scan))
    on_path, beside = take_ahead(state, SKY, NOW + 10.0, CONFIG).searched
    speed_deg_s = np.hypot(AZ_RATE * np.cos(np.radians(EL_DEG)), EL_RATE)
    assert np.hypot(*on_path[0]) == pytest.approx(4.0 * speed_deg_s, rel=0.05)  # early: ahead of it
    assert np.hypot(*on_path[-1]) == pytest.approx(2.0 * speed_deg_s, rel=0.05)
    assert np.hypot(*beside[4]) == pytest.approx(0.7 * CONFIG.beamwidth_deg, rel=0.02)


def test_what_stands_around_is_told_once_for_the_pass() -> None:
    envelope = replace(
        CONFIG.envelope,
        keep_outs=(KeepOut("mast", 200.0, 240.0, el_to_deg=50.0),),
        skyline=skyline_of(((0.0, 10.0), (180.0, 20.0))),
    )
    config = replace(CONFIG, envelope=envelope)
    tai_s = NOW + np.linspace(-100.0, 100.0, 50)
    track = tuple(zip(tai_s.tolist(), np.linspace(0.0, 180.0, 50).tolist(), [60.0] * 50, strict=True))
    drawn = take_backdrop(config, COMING, track)
    assert (drawn.azimuth_deg, drawn.rise_tai_s, drawn.track) == ((-270.0, 270.0), NOW - 100.0, track)
    assert drawn.keep_outs == (("mast", 200.0, 240.0, -90.0, 50.0),)
    assert dict(drawn.skyline)[90.0] == pytest.approx(15.0)
    speed_deg_s = 0.9 * np.cos(np.radians(60.0))
    assert drawn.keyhole_el_deg == pytest.approx(np.degrees(np.arccos(speed_deg_s / 20.0)), abs=0.1)
    without = take_backdrop(config, None, ())
    assert (without.rise_tai_s, without.keyhole_el_deg, without.track) == (None, None, ())
