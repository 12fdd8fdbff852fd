"""A motorised tilt under the pedestal: the model against rotations, the choice, and passes that are flown with it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flights import count, flight_of, rows_between, seconds_to_state
from overhead_flights import SMALL_ERRORS, TOP_TAI_S, errors_deg, lost_s, over_the_zenith, overhead_target

from acu_daemon.acu.commands import PointAndPoll
from acu_daemon.cli.options import Target, coming_pass, longest_lead
from acu_daemon.config.acu_tables import TiltSection
from acu_daemon.config.to_settings import keyhole_rules, leaning, planned_tilt
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.daemon.verdict import alarms
from acu_daemon.drivers.sa3842.messages import WriteAndPoll
from acu_daemon.drivers.sa3842.sa3842_driver import wire_command
from acu_daemon.model import sky_angle_deg
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.tilt import Tilt
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.pedestal import AxisTrouble
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.sim.tilt_axis import leant

SECTION = TiltSection(min_deg=-5.0, max_deg=5.0, max_rate_deg_s=0.5)


def tilting(height_km: float, top_deg: float, i_deg: float = 97.5, **sections: dict[str, Any]) -> Target:
    target = overhead_target(height_km, top_deg, i_deg, **sections)
    acu = target.station.acu.model_copy(update={"tilt": SECTION})
    return replace(target, station=target.station.model_copy(update={"acu": acu}))


def tilt_of(target: Target) -> Tilt:
    found = planned_tilt(target.station, target.elements.propagator, coming_pass(target, TOP_TAI_S - 900.0))
    assert found is not None
    return found


DIRECTIONS = ((10.0, 30.0), (200.0, 70.0), (100.0, 86.0), (45.0, 5.0), (300.0, 89.5))


@pytest.mark.parametrize(("tilt_deg", "towards_deg"), [(5.0, 90.0), (-7.0, 30.0), (0.0, 0.0)])
def test_the_model_leans_as_rotations_do_and_back(tilt_deg: float, towards_deg: float) -> None:
    tilt = Tilt(tilt_deg, towards_deg)
    for az_deg, el_deg in DIRECTIONS:
        there = leant(az_deg, el_deg, tilt_deg, towards_deg)
        for model in (tilt.from_pedestal(az_deg, el_deg), tilt.beam_deg(az_deg, el_deg)):
            assert sky_angle_deg(*there, *map(float, model)) < 1e-5
        back = tilt.to_pedestal(*there)
        assert sky_angle_deg(az_deg, el_deg, float(back[0]), float(back[1])) < 1e-5


def test_the_top_of_a_positive_tilt_leans_towards_its_azimuth() -> None:
    for towards_deg in (90.0, 200.0):
        az_deg, el_deg = Tilt(5.0, towards_deg).beam_deg(123.0, 90.0)
        assert az_deg % 360.0 == pytest.approx(towards_deg)
        assert el_deg == pytest.approx(85.0)


def test_rates_partials_and_the_inverse_of_a_leaning_antenna_are_those_of_differences() -> None:
    model = AntennaModel(Mount(ca_deg=0.05, an_deg=0.04, ie_deg=-0.1), None, 1.0, Tilt(-4.0, 75.0))
    az, el = np.array([20.0, 150.0, 260.0]), np.array([15.0, 60.0, 80.0])
    d_az, d_el, step = np.array([0.3, -0.5, 1.0]), np.array([0.2, 0.4, -0.1]), 1e-4
    there, beyond = model.encoders_deg(az, el), model.encoders_deg(az + step * d_az, el + step * d_el)
    assert np.allclose(model.geometric_deg(*there), (az, el), atol=1e-8)
    *_, az_rate, el_rate = model.with_rates(az, el, np.full(3, 1e6), d_az, d_el)
    assert np.allclose((az_rate, el_rate), (np.array(beyond) - np.array(there)) / step, atol=1e-3)
    by_direction = model.with_partials(az, el)[2].by_direction
    assert np.allclose(np.einsum("nij,jn->in", by_direction, np.array([d_az, d_el])), (az_rate, el_rate), atol=1e-9)
    plunged = model.with_rates_plunged(az, el, np.full(3, 1e6), d_az, d_el)
    back_az, back_el = model.geometric_deg(plunged[0], plunged[1])
    assert np.allclose((back_az % 360.0, back_el), (az, el), atol=1e-8)


def test_a_zone_is_where_it_is_for_a_leaning_antenna() -> None:
    limits = tilting(500, 89.0).station.bounds
    mast = KeepOut("mast", 80.0, 100.0, 80.0, 87.0)
    upright = Envelope(limits.azimuth, limits.elevation, (mast,))
    lean = replace(upright, tilt=Tilt(5.0, 90.0))
    assert not upright.why_not(90.0, 89.0, TOP_TAI_S)
    assert "mast" in lean.why_not(90.0, 89.0, TOP_TAI_S)


def test_no_pass_is_leant_for_that_the_drive_follows_and_the_least_that_helps_is_taken() -> None:
    assert tilt_of(tilting(800, 80.0)).angle_deg == 0.0
    low, high = (abs(tilt_of(tilting(500, top_deg)).angle_deg) for top_deg in (88.6, 89.9))
    assert 0.0 < low < high < 5.0
    assert planned_tilt(overhead_target(500, 89.9).station, tilting(500, 89.9).elements.propagator, None) is None


@pytest.mark.parametrize(("height_km", "i_deg"), [(500, 86.0), (500, 97.5), (800, 99.0)])
def test_with_5_deg_east_and_west_every_polar_pass_is_on_the_path(height_km: float, i_deg: float) -> None:
    for top_deg in (88.5, 89.99):
        target = tilting(height_km, top_deg, i_deg)
        coming, station = coming_pass(target, TOP_TAI_S - 900.0), target.station
        plan = plan_pass(
            *(target.elements.propagator, leaning(station.site, tilt_of(target)), coming, 0.0, station.bounds.azimuth),
            coming.rise_tai_s,
            elevation=station.bounds.elevation,
            keyhole=keyhole_rules(station),
        )
        assert plan.crossing is None
        assert not [one for one in plan.beyond if one.axis == "elevation"]


@pytest.mark.long
def test_a_pass_over_the_zenith_is_autotracked_all_the_way_on_a_leaning_pedestal() -> None:
    flight = over_the_zenith(tilting(500, 89.9), before_s=35.0, after_s=20.0)
    assert lost_s(flight) == 0.0
    assert errors_deg(flight).max() < 0.1
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    assert "ZENITH" not in flight.states()


@pytest.mark.long
def test_a_loss_is_held_on_a_leaning_pedestal_whose_encoders_are_biased() -> None:
    target = tilting(705, 89.5)
    flight = over_the_zenith(target, before_s=50.0, after_s=30.0, biases_deg=(0.1, 0.1), losses=[(55.0, 78.0)])
    assert errors_deg(flight, 0.0, 28.0).max() < 0.2


@pytest.mark.long
def test_the_antenna_sets_out_so_early_that_the_tilt_is_set_and_acquires_only_then() -> None:
    target = tilting(500, 89.9)
    coming, wanted = coming_pass(target, TOP_TAI_S - 900.0), tilt_of(target).angle_deg
    begin = coming.rise_tai_s - 60.0
    antenna = AcuChoice(azimuth_deg=100.0, elevation_deg=30.0)
    slow = SECTION.model_copy(update={"max_rate_deg_s": 0.1})
    acu = target.station.acu.model_copy(update={"tilt": slow})
    target = replace(target, station=target.station.model_copy(update={"acu": acu}))
    seen: dict[str, FakeAcu] = {}

    def make(parts: Any) -> FakeAcu:
        seen["acu"] = FakeAcu(parts)
        return seen["acu"]

    flight = flight_of(target, begin, 80.0, antenna=antenna, errors=SMALL_ERRORS, make_acu=make)
    assert seen["acu"].antenna.tilt.angle_deg == pytest.approx(wanted, abs=0.02)
    assert flight.snapshots[-1].tilt == f"{wanted:+.1f} deg, set"
    assert not any(one.tilt_alarm for one in flight.snapshots)
    waits = [one for one in flight.snapshots if "asked" in one.tilt]
    assert waits
    assert seconds_to_state(flight, "ACQUIRE/TLE", begin) > waits[-1].tai_s - begin
    rows = rows_between(flight, coming.rise_tai_s + 5.0, coming.rise_tai_s + 18.0)
    assert max(row.beam_error_deg or 0.0 for row in rows) < 0.5


def test_a_pass_of_a_slow_tilt_is_begun_in_time_from_its_far_end() -> None:
    slow = SECTION.model_copy(update={"max_rate_deg_s": 0.05})
    target = tilting(500, 89.9)
    acu = target.station.acu.model_copy(update={"tilt": slow})
    assert longest_lead(replace(target, station=target.station.model_copy(update={"acu": acu}))) > 10.0 / 0.05
    assert longest_lead(target) == longest_lead(overhead_target(500, 89.9))


def test_a_tilt_that_never_comes_is_an_alarm_and_nothing_is_acquired_on_a_wrong_path() -> None:
    def make(parts: Any) -> FakeAcu:
        acu = FakeAcu(parts)
        acu.antenna.tilt.trouble = AxisTrouble(is_stuck=True)
        return acu

    target = tilting(500, 89.9)
    flight = over_the_zenith(target, before_s=40.0, after_s=-25.0, make_acu=make)
    seen = flight.snapshots[-1]
    assert alarms(seen) == [
        f"tilt not set for this pass: {tilt_of(target).angle_deg:+.1f} deg asked, it is at +0.0 deg"
    ]
    assert not any(one.state.startswith("AUTOTRACK") for one in flight.snapshots)


def test_an_acu_without_a_tilt_is_refused_and_a_tilt_beyond_its_limits_goes_nowhere() -> None:
    assert wire_command(PointAndPoll(1.0, 2.0), 7) == WriteAndPoll(1.0, 2.0, 7)
    assert wire_command(PointAndPoll(1.0, 2.0, -5.0), 7) == WriteAndPoll(1.0, 2.0, 65536 - 910)
    flight = over_the_zenith(overhead_target(800, 88.0), before_s=20.0, after_s=0.0)
    assert {one.tilt_code for _, one in flight.commands if isinstance(one, WriteAndPoll)} == {0}
    assert count(flight, WriteAndPoll) > 100
