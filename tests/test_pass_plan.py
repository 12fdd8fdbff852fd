"""The plan of a pass: where the antenna waits, and on which turn of the cable wrap."""

import made_orbits
import numpy as np
import pytest

from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.model import AxisLimits, Pass, Site, Station
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.timescales import gmst_rad

EPOCH = made_orbits.EPOCH_TAI_S
WRAP = AxisLimits(-270.0, 270.0, 20.0, 10.0)
NARROW = AxisLimits(0.0, 360.0, 20.0, 10.0)


def pass_of(source: Propagator, site: Site) -> Pass:
    [found] = find_passes(source, site, EPOCH - 1500.0, EPOCH + 1500.0, 5.0)
    return found


def through_north() -> tuple[Propagator, Site, Pass]:
    """A pass north of the station, from north-west through north to north-east."""
    raan = float(gmst_rad(np.array([EPOCH]), 0.0)[0])
    elements = BrouwerElements("MADE", EPOCH, 7180e3, 1e-4, np.radians(51.6), raan, 0.0, np.radians(90.0))
    source, site = BrouwerPropagator(elements, False), Site(Station("MADE", 45.0, 90.0, 100.0))
    return source, site, pass_of(source, site)


SOUTH_TO_NORTH = (made_orbits.circular(), made_orbits.site(3.0))


@pytest.mark.parametrize("early_s", [0.0, 60.0, 7200.0])
def test_before_the_rise_the_antenna_waits_at_the_rise(early_s: float) -> None:
    source, site = SOUTH_TO_NORTH
    coming = pass_of(source, site)
    plan = plan_pass(source, site, coming, 0.0, WRAP, coming.rise_tai_s - early_s)
    assert (plan.rise_tai_s, plan.set_tai_s) == (coming.rise_tai_s, coming.set_tai_s)
    assert plan.start_tai_s == coming.rise_tai_s
    assert plan.start_el_deg == pytest.approx(5.0, abs=0.001)
    assert plan.start_az_deg % 360.0 == pytest.approx(coming.rise_az_deg, abs=0.001)
    assert plan.note == ""


def test_in_the_middle_of_a_pass_the_antenna_goes_to_where_the_satellite_is() -> None:
    source, site = SOUTH_TO_NORTH
    coming = pass_of(source, site)
    now = coming.rise_tai_s + 200.0
    plan = plan_pass(source, site, coming, 0.0, WRAP, now)
    seen = look_at(source, np.array([now]), site)
    assert plan.start_tai_s == now
    assert plan.start_az_deg % 360.0 == pytest.approx(float(seen.az_deg[0]), abs=1e-9)
    assert plan.start_el_deg == pytest.approx(float(seen.el_deg[0]), abs=1e-9)


@pytest.mark.parametrize("late_s", [-0.5, 0.0, 100.0])
def test_at_its_end_and_after_it_the_plan_is_the_end_of_the_pass(late_s: float) -> None:
    source, site = SOUTH_TO_NORTH
    coming = pass_of(source, site)
    plan = plan_pass(source, site, coming, 0.0, WRAP, coming.set_tai_s + late_s)
    assert plan.start_tai_s == coming.set_tai_s - 1.0
    assert plan.start_el_deg == pytest.approx(5.0, abs=0.2)


@pytest.mark.parametrize("present_deg", [-250.0, -80.0, 100.0, 260.0])
def test_a_pass_through_north_is_held_without_unwinding_in_its_middle(present_deg: float) -> None:
    source, site, coming = through_north()
    tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, 1.0)
    path = np.degrees(np.unwrap(np.radians(look_at(source, tai_s, site).az_deg)))
    plan = plan_pass(source, site, coming, present_deg, WRAP, coming.rise_tai_s)
    whole = path - path[0] + plan.start_az_deg
    assert whole.min() >= WRAP.min_deg
    assert whole.max() <= WRAP.max_deg
    assert plan.note == ""


def test_a_wrap_that_cannot_hold_the_pass_is_said_in_the_plan() -> None:
    source, site, coming = through_north()
    plan = plan_pass(source, site, coming, 180.0, NARROW, coming.rise_tai_s)
    assert plan.note.startswith("no turn holds the whole pass: this one holds the first ")
    assert NARROW.min_deg <= plan.start_az_deg <= NARROW.max_deg


def test_what_is_left_of_a_pass_may_fit_where_the_whole_does_not() -> None:
    source, site, coming = through_north()
    tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, 1.0)
    az_deg = look_at(source, tai_s, site).az_deg
    after_north = float(tai_s[int(np.flatnonzero(np.abs(np.diff(az_deg)) > 300.0)[0]) + 2])
    plan = plan_pass(source, site, coming, 180.0, NARROW, after_north)
    assert plan.note == ""
    assert 0.0 <= plan.start_az_deg < 10.0


class Counted(BrouwerPropagator):
    """Counts the times it was asked for."""

    count = 0

    def states_teme(self, tai_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        Counted.count += tai_s.size
        return super().states_teme(tai_s)


def test_the_plan_of_a_satellite_that_does_not_set_for_days_takes_no_longer_than_that_of_a_pass() -> None:
    still = Counted(BrouwerElements("GEO", 0.0, 42164e3, 1e-4, 1e-3, 0.0, 0.0, 0.0))
    site = Site(Station("below", 0.0, float(np.degrees(-gmst_rad(np.zeros(1), 0.0)[0])) % 360.0, 0.0))
    days_s = 3 * 86400.0
    [coming] = find_passes(still, site, 0.0, days_s, 5.0)
    assert coming.duration_s == days_s
    Counted.count = 0
    plan = plan_pass(still, site, coming, 180.0, AxisLimits(-270.0, 270.0, 20.0, 10.0), 100.0)
    assert plan.set_tai_s == days_s
    assert 15000 < Counted.count < 25000
