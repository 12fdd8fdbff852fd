"""The sun on a pass: told before it, avoided or followed as the policy says, and an antenna that may not be moved."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from flights import changed, count, demo_target, events_named, flight_of, worst_error_deg
from memories import remembering

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.config.to_settings import control_config, driver_of
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.daemon.envelope_watch import look_around
from acu_daemon.drivers.sa3842.messages import SelectMode, WriteAndPoll, WriteRegisters
from acu_daemon.model import AxisLimits, sky_angle_deg
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.sun import sun_direction_deg
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.escape import sun_reaches_s, way_out
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.outage import kept_out, sun_outages
from acu_daemon.sim.scenario import AcuChoice

RADIUS_DEG = 4.0
BEGIN_TAI_S = tai_from_utc("2026-08-24T12:09:28Z")  # 18 s before a pass comes to 0.3 deg from the sun's middle
STANDS_TAI_S = tai_from_utc("2026-08-24T12:00:00Z")


def target(policy: str) -> Target:
    return demo_target(envelope={"sun_policy": policy, "sun_keep_out_deg": RADIUS_DEG, "response_time_s": 120.0})


def flown(policy: str, duration_s: float) -> Flight:
    chosen = target(policy)
    look = apparent_at(chosen.elements.propagator, np.array([BEGIN_TAI_S]), chosen.station.site)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    return flight_of(chosen, BEGIN_TAI_S, duration_s, antenna=antenna)


def from_the_sun_deg(flight: Flight) -> list[float]:
    tai_s = np.array([row.tai_s for row in flight.rows])
    directions = zip(*sun_direction_deg(tai_s, target("off").station.site), strict=True)
    return [
        sky_angle_deg(float(az), float(el), row.boresight_az_deg, row.boresight_el_deg)
        for row, (az, el) in zip(flight.rows, directions, strict=True)
    ]


def test_an_outage_by_the_sun_is_told_before_the_pass_with_its_angle_and_times() -> None:
    chosen = target("warn")
    propagator, site, sun = chosen.elements.propagator, chosen.station.site, chosen.station.bounds.sun
    coming = coming_pass(chosen, BEGIN_TAI_S)
    [found] = sun_outages(propagator, site, sun, coming)
    tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, 0.1)
    seen = apparent_at(propagator, tai_s, site)
    pairs = zip(seen.az_deg, seen.el_deg, *sun_direction_deg(tai_s, site), strict=True)
    angles = np.array([sky_angle_deg(*map(float, pair)) for pair in pairs])
    inside = tai_s[angles < RADIUS_DEG]
    assert (found.from_tai_s, found.to_tai_s) == pytest.approx((inside[0], inside[-1]), abs=0.6)
    assert found.least_deg == pytest.approx(angles.min(), abs=0.2)
    assert found.least_tai_s == pytest.approx(tai_s[angles.argmin()], abs=0.5)
    assert sun_outages(propagator, site, None, coming) == ()


def test_a_keep_out_on_a_pass_is_told_with_its_times() -> None:
    chosen, mast = target("off"), KeepOut("the mast", 60.0, 80.0, 0.0, 89.0)
    propagator, site = chosen.elements.propagator, chosen.station.site
    [found] = kept_out(propagator, site, (mast,), coming_pass(chosen, BEGIN_TAI_S))
    seen = apparent_at(propagator, np.array([found.from_tai_s, found.to_tai_s]), site)
    assert found.name == "the mast"
    assert sorted(seen.az_deg.tolist()) == pytest.approx([60.0, 80.0], abs=0.5)


@pytest.mark.long
def test_with_avoid_the_beam_is_never_inside_and_the_satellite_is_tracked_before_and_after() -> None:
    flight = flown("avoid", 40.0)
    assert min(from_the_sun_deg(flight)) > RADIUS_DEG
    states = flight.states()
    assert states[states.index("AVOID") - 1].startswith("AUTOTRACK")
    assert states[-1] == "AUTOTRACK/FITTED"
    assert worst_error_deg(flight, BEGIN_TAI_S + 36.0, BEGIN_TAI_S + 40.0) < 0.1
    assert worst_error_deg(flight, BEGIN_TAI_S, BEGIN_TAI_S + 40.0) < RADIUS_DEG + 1.0
    [told] = events_named(flight, "pass.sun")
    assert told["policy"] == "avoid"
    assert told["least_deg"] == pytest.approx(0.3, abs=0.1)
    assert {seen.verdict for seen in flight.snapshots if seen.state == "AVOID"} == {"AVOIDING"}
    assert not events_named(flight, "fence.refused")


@pytest.mark.long
def test_with_warn_it_is_told_and_followed() -> None:
    flight = flown("warn", 30.0)
    assert min(from_the_sun_deg(flight)) < 0.5
    assert "AVOID" not in flight.states()
    assert count(flight, SelectMode) == 2
    assert [told["policy"] for told in events_named(flight, "pass.sun")] == ["warn"]


def standing(**memory: object) -> tuple[ControlState, ControlConfig]:
    """An antenna that stands where the sun will be in 20 minutes."""
    chosen = target("avoid")
    config = control_config(chosen.station, chosen.satellite, driver_of(chosen.station), 0.0)
    assert config.envelope.sun is not None
    az_deg, el_deg = config.envelope.sun.direction_deg(STANDS_TAI_S + 1200.0)
    state = remembering(status=AcuStatus(az_deg % 360.0, el_deg, AcuMode.REMOTE), az_deg=az_deg, **memory)
    return state, config


@pytest.mark.parametrize(
    ("memory", "why"),
    [
        ({"problem": "azimuth stands still"}, "an axis is latched"),
        ({"by_people": False}, "it is not armed"),
        ({"is_stop_due": True}, "a STOP is due"),
    ],
)
def test_an_antenna_that_may_not_be_moved_is_an_alarm_with_seconds_and_the_way_out(memory: object, why: str) -> None:
    state, config = standing(**memory)
    reach_s = sun_reaches_s(config.envelope, (state.intake.az_deg, state.intake.status.el_deg), STANDS_TAI_S)
    assert reach_s is not None
    assert config.envelope.sun.angle_deg(
        *config.envelope.beam_deg(state.intake.az_deg, state.intake.status.el_deg), STANDS_TAI_S + reach_s
    ) == pytest.approx(RADIUS_DEG, abs=0.005)
    early = look_around(state, STANDS_TAI_S + reach_s - 130.0, config)
    assert (early.alarm, early.sun_reach_s) == ("", pytest.approx(130.0, abs=1.5))
    late = look_around(state, STANDS_TAI_S + reach_s - 100.0, config)
    assert late.alarm.startswith("the sun reaches its keep-out in ")
    assert f"the daemon does not move it: {why}; the way out is az " in late.alarm
    assert late.way_out is not None
    inside = look_around(state, STANDS_TAI_S + reach_s + 5.0, config)
    assert inside.alarm.startswith("the antenna is within the sun's")


def test_an_antenna_in_the_hands_of_the_daemon_is_no_alarm_and_one_under_the_panel_is() -> None:
    state, config = standing()
    reach_s = sun_reaches_s(config.envelope, (state.intake.az_deg, state.intake.status.el_deg), STANDS_TAI_S)
    assert look_around(state, STANDS_TAI_S + reach_s - 100.0, config).alarm == ""
    by_hand = remembering(state, status=replace(state.intake.status, mode=AcuMode.MANUAL))
    assert "the ACU is in MANUAL" in look_around(by_hand, STANDS_TAI_S + reach_s - 100.0, config).alarm


def test_the_way_out_is_clear_of_the_sun_for_long_and_within_the_limits() -> None:
    state, config = standing()
    place = state.intake.az_deg, state.intake.status.el_deg
    out = way_out(config.envelope, place, STANDS_TAI_S)
    assert out is not None
    assert all(config.envelope.room_deg(*out, STANDS_TAI_S + s) > 0.1 for s in range(0, 1201, 300))
    assert sky_angle_deg(*out, *place) < 10.0
    shut = replace(config.envelope, elevation=AxisLimits(place[1] - 1.0, place[1] + 1.0, 5.0, 5.0))
    shut = replace(shut, azimuth=AxisLimits(place[0] - 1.0, place[0] + 1.0, 5.0, 5.0))
    assert way_out(shut, place, STANDS_TAI_S) is None


def test_an_antenna_that_is_found_inside_the_sun_is_led_out_and_to_the_path() -> None:
    chosen, begin_tai_s = target("avoid"), BEGIN_TAI_S - 60.0
    assert chosen.station.bounds.sun is not None
    az_deg, el_deg = chosen.station.bounds.sun.direction_deg(begin_tai_s)
    flight = flight_of(chosen, begin_tai_s, 25.0, antenna=AcuChoice(azimuth_deg=az_deg + 1.0, elevation_deg=el_deg))
    angles = from_the_sun_deg(flight)
    out = next(k for k, angle_deg in enumerate(angles) if angle_deg > RADIUS_DEG)
    assert angles[0] < 1.0
    assert all(b > a - 0.05 for a, b in pairwise(angles[: out + 1]))
    assert min(angles[out:]) > RADIUS_DEG
    assert not events_named(flight, "fence.refused")
    assert flight.states()[-1].startswith("AUTOTRACK")


def test_a_stow_whose_way_leads_through_the_sun_is_an_alarm() -> None:
    state, config = standing()
    az_deg, el_deg = state.intake.az_deg, state.intake.status.el_deg
    envelope = replace(config.envelope, stow_deg=(az_deg + 30.0, el_deg + 1.0))
    stowing = remembering(
        state, status=replace(state.intake.status, mode=AcuMode.STOWING, az_deg=az_deg - 15.0), az_deg=az_deg - 15.0
    )
    seen = look_around(stowing, STANDS_TAI_S + 1200.0, replace(config, envelope=envelope))
    assert seen.alarm == "the straight way to the stow position leads through the keep-out of the sun"
    clear = replace(envelope, stow_deg=(az_deg - 30.0, 80.0))
    assert look_around(stowing, STANDS_TAI_S + 1200.0, replace(config, envelope=clear)).alarm == ""


def moved_deg(flight: Flight, from_tai_s: float) -> float:
    rows = [row for row in flight.rows if row.tai_s >= from_tai_s]
    return max(
        max(abs(row.encoder_az_deg - rows[0].encoder_az_deg), abs(row.encoder_el_deg - rows[0].encoder_el_deg))
        for row in rows
    )


@pytest.mark.parametrize("held", [{"is_shadow": True}, {"is_resting": True}, {"arm": "manual"}])
def test_an_antenna_in_the_suns_keep_out_that_may_not_be_commanded_does_not_move_and_it_is_shown(held: dict) -> None:
    chosen = target("avoid")
    if "arm" in held:
        chosen = changed(chosen, safety=dict(held))
    az_deg, el_deg = (float(one[0]) for one in sun_direction_deg(np.array([STANDS_TAI_S]), chosen.station.site))
    antenna = AcuChoice(azimuth_deg=az_deg, elevation_deg=el_deg)
    flight = flight_of(chosen, STANDS_TAI_S, 15.0, antenna=antenna, **({} if "arm" in held else held))
    assert moved_deg(flight, STANDS_TAI_S) < 0.001
    assert count(flight, (SelectMode, WriteAndPoll, WriteRegisters)) == 0
    last = flight.snapshots[-1]
    assert last.sun_deg == pytest.approx(0.0, abs=0.3)
    assert last.sun_reach_s == 0.0
    assert last.way_out_az_deg is not None


def test_an_antenna_that_latches_on_its_way_to_the_sun_stands_and_it_is_shown_how_long_until_the_keep_out() -> None:
    chosen = target("avoid")
    look = apparent_at(chosen.elements.propagator, np.array([BEGIN_TAI_S]), chosen.station.site)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    flight = flight_of(
        chosen,
        BEGIN_TAI_S,
        25.0,
        antenna=antenna,
        losses=[(2.0, 25.0)],
        faults=["stuck axis=elevation start_s=5 duration_s=3600"],
    )
    latched = next(seen.tai_s for seen in flight.snapshots if seen.latch)
    assert moved_deg(flight, latched + 3.0) < 0.01
    after = [one for tai_s, one in flight.commands if tai_s > latched + 1.0]
    assert not [one for one in after if isinstance(one, SelectMode | WriteAndPoll | WriteRegisters)]
    assert flight.snapshots[-1].sun_deg == pytest.approx(from_the_sun_deg(flight)[-1], abs=0.3)
