"""pointing.turn_plan: on which turns a pass is flown, and where it is left for another."""

from functools import partial

import numpy as np
import pytest

from acu_daemon.control.tracking.approach import way_s
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.turn_plan import TurnAsk, TurnPlan, plan_turns

STEP_S = 0.5


def asked(
    az_deg: np.ndarray,
    limits: tuple[float, float],
    present_deg: float,
    *,
    early_s: float = 600.0,
    hidden: slice = slice(0, 0),
    rate_deg_s: float = 10.0,
) -> TurnPlan:
    axis = AxisLimits(*limits, rate_deg_s, rate_deg_s)
    is_seen = np.ones(az_deg.size, dtype=bool)
    is_seen[hidden] = False
    return plan_turns(
        TurnAsk(
            *(STEP_S * np.arange(az_deg.size), az_deg, is_seen, axis, present_deg, -early_s),
            way_s=partial(way_s, axis=axis),
            is_either_way=lambda _: True,
        )
    )


THROUGH_NORTH = np.linspace(300.0, 420.0, 1200)  # 600 s; north at half of it


@pytest.mark.parametrize("limits", [(-270.0, 270.0), (0.0, 450.0), (-180.0, 360.0)])
@pytest.mark.parametrize("present_deg", [-100.0, 10.0, 250.0])
def test_where_a_turn_holds_the_whole_pass_no_stop_is_met(limits, present_deg):
    plan = asked(THROUGH_NORTH, limits, present_deg)
    assert plan.unwindings == ()
    path = THROUGH_NORTH + plan.offset_deg
    assert limits[0] <= path.min()
    assert path.max() <= limits[1]


def test_of_two_turns_that_hold_it_the_nearer_one_is_taken():
    path = np.linspace(10.0, 80.0, 1200)
    assert asked(path, (-360.0, 360.0), 200.0).offset_deg == 0.0
    assert asked(path, (-360.0, 360.0), -200.0).offset_deg == -360.0


def test_where_none_holds_it_the_antenna_unwinds_at_the_stop():
    plan = asked(THROUGH_NORTH, (0.0, 360.0), 100.0)
    [change] = plan.unwindings
    assert plan.offset_deg == 0.0
    assert change.by_deg == -360.0
    assert change.tai_s == pytest.approx(300.0, abs=2.0)
    assert change.for_s == pytest.approx(way_s(360.0, AxisLimits(0.0, 360.0, 10.0, 10.0)), abs=2.0)


def test_it_unwinds_while_a_hill_hides_the_satellite():
    wide = (-30.0, 380.0)  # both turns reach from 330 to 380 deg
    hidden = slice(300, 500)  # 330 to 350 deg
    [change] = asked(np.linspace(300.0, 420.0, 1200), wide, 300.0, hidden=hidden).unwindings
    assert 150.0 <= change.tai_s <= change.tai_s + change.for_s <= 252.0


@pytest.mark.parametrize(("left_s", "begins_on_deg"), [(200.0, 0.0), (20.0, -360.0)])
def test_in_mid_pass_unwinding_is_weighed_against_what_is_left(left_s, begins_on_deg):
    """The antenna stands on the path, on the turn that the upper stop ends; the way to the other one takes 37 s.

    Where left_s are lost otherwise, it unwinds at once: later it would take as long; where 20 s are, it stays.
    """
    path = np.linspace(0.0, -90.0, 1200)
    stop_deg = -90.0 * (1.0 - left_s / 600.0)
    plan = asked(path, (stop_deg, stop_deg + 415.0), 0.0, early_s=0.0)
    others = [change.by_deg for change in plan.unwindings]
    assert plan.offset_deg == 0.0
    assert others == ([360.0] if begins_on_deg == 0.0 else [])
