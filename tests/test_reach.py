"""Which axis cannot follow a path, from when to when."""

import made_orbits
import numpy as np
import pytest

from acu_daemon.control.tracking.pass_plan import beyond_limits, plan_pass
from acu_daemon.model import AxisLimits, Pass, Site
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.reach import out_of_reach

WRAP = AxisLimits(-270.0, 270.0, 20.0, 10.0)
EVERY = AxisLimits(0.0, 90.0, 5.0, 5.0)
TAI_S = np.arange(0.0, 100.5, 0.5)
EPOCH = made_orbits.EPOCH_TAI_S


def with_range(min_deg: float, max_deg: float, like: AxisLimits = WRAP) -> AxisLimits:
    return AxisLimits(min_deg, max_deg, like.max_rate_deg_s, like.max_acceleration_deg_s2)


def test_a_path_within_the_limits_is_followed_by_both_axes() -> None:
    assert out_of_reach(TAI_S, 100.0 + TAI_S, 10.0 + 0.5 * TAI_S, WRAP, EVERY) == ()


def test_an_elevation_below_and_above_its_limits_is_told_with_its_times() -> None:
    el_deg = 80.0 - 0.03 * (TAI_S - 50.0) ** 2  # 5 deg at the ends, 80 in the middle
    limits = with_range(17.0, 66.0, EVERY)
    low, high, again = out_of_reach(TAI_S, 100.0 + TAI_S, el_deg, WRAP, limits)
    assert [one.axis for one in (low, high, again)] == ["elevation"] * 3
    assert (low.from_tai_s, low.to_tai_s) == pytest.approx((0.0, 50.0 - np.sqrt(63.0 / 0.03)), abs=0.5)
    assert high.duration_s == pytest.approx(2.0 * np.sqrt(14.0 / 0.03), abs=1.0)
    assert (low.why, high.why) == ("elevation below 17 deg", "elevation above 66 deg")
    assert again.to_tai_s == 100.0


def test_an_azimuth_that_no_turn_reaches_is_told_and_one_that_another_turn_reaches_is_on_its_way_there() -> None:
    el_deg = np.full(TAI_S.size, 40.0)
    [lost] = out_of_reach(TAI_S, 100.0 + TAI_S, el_deg, with_range(-150.0, 150.0), EVERY)
    assert (lost.axis, lost.from_tai_s, lost.to_tai_s) == ("azimuth", 50.5, 100.0)
    assert "on every turn" in lost.why
    [way] = out_of_reach(TAI_S, 300.0 + TAI_S, el_deg, with_range(0.0, 360.0), EVERY)
    assert (way.axis, way.from_tai_s, way.duration_s) == ("azimuth", 60.5, pytest.approx(18.0))
    assert "another turn" in way.why


def climbing() -> tuple[Propagator, Site, Pass]:
    source, site = made_orbits.circular(), made_orbits.site(3.0)
    [coming] = find_passes(source, site, EPOCH - 1500.0, EPOCH + 1500.0, 5.0)
    return source, site, coming


@pytest.mark.parametrize("max_deg", [30.0, 60.0])
def test_plan_and_list_of_passes_say_how_long_the_elevation_cannot_follow(max_deg: float) -> None:
    source, site, coming = climbing()
    limits = with_range(7.0, max_deg, EVERY)
    tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, 0.1)
    el_deg = look_at(source, tai_s, site).el_deg
    plan = plan_pass(source, site, coming, 0.0, WRAP, coming.rise_tai_s, elevation=limits)
    for beyond in (plan.beyond, beyond_limits(source, site, coming, WRAP, limits)):
        seconds = {why: sum(one.duration_s for one in beyond if one.why == why) for why in {b.why for b in beyond}}
        assert seconds[f"elevation above {max_deg:g} deg"] == pytest.approx(0.1 * np.sum(el_deg > max_deg), abs=1.1)
        assert seconds["elevation below 7 deg"] == pytest.approx(0.1 * np.sum(el_deg < 7.0), abs=2.1)


def test_a_path_that_begins_out_of_reach_and_comes_into_it_is_told_for_its_beginning_alone() -> None:
    el_deg = np.full(TAI_S.size, 40.0)
    [lost] = out_of_reach(TAI_S, 250.0 - TAI_S, el_deg, with_range(0.0, 200.0), EVERY)
    assert (lost.from_tai_s, lost.to_tai_s) == (0.0, 50.0)
