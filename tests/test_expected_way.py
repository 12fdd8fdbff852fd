"""control.tracking.expected_way: where path and antenna are over a planned pass, and how far apart on the sky."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.session.prediction import predict
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.expected_way import MOST_STEPS, ExpectedWay, expected_way
from acu_daemon.model import AxisLimits, sky_angle_deg
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keyhole import KeyholeRules
from acu_daemon.pointing.turn_plan import Unwinding

T = EPOCH_TAI_S
ORBIT, ASIDE, OVERHEAD = circular(), site(3.0), site(0.02)
AZIMUTH, ELEVATION = AxisLimits(-900.0, 900.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
FROM_S, TO_S = -100.0, 60.0
STEP_S = 0.1
TINY_DEG = 1e-6


@cache
def seen_at(at_s: float, station: Any = ASIDE) -> tuple[float, float]:
    """Where the satellite is so long after the epoch, azimuth as a bearing."""
    seen = encoder_look(ORBIT, np.array([T + at_s]), station, None)
    return float(seen.az_deg[0]), float(seen.el_deg[0])


def way(
    turn_deg: float = 0.0,
    *,
    azimuth: tuple[float, float] = (-900.0, 900.0),
    elevation: tuple[float, float] = (0.0, 90.0),
    station: Any = ASIDE,
    rules: KeyholeRules | None = None,
    **changes: Any,
) -> ExpectedWay:
    """The way of a plan that begins and ends about the epoch, on a turn of the cable."""
    az_deg, el_deg = seen_at(FROM_S, station)
    plan = PassPlan(T - 300.0, T + TO_S, T + FROM_S, az_deg + turn_deg, el_deg)
    envelope = Envelope(
        replace(AZIMUTH, min_deg=azimuth[0], max_deg=azimuth[1]),
        replace(ELEVATION, min_deg=elevation[0], max_deg=elevation[1]),
    )
    return expected_way(ORBIT, station, replace(plan, **changes), envelope, rules or KeyholeRules(envelope.azimuth))


def sky_deg(found: ExpectedWay, k: int) -> float:
    """The angle between antenna and satellite by the formula of another module."""
    az_deg, el_deg = seen_at(float(found.tai_s[k]) - T)
    return sky_angle_deg(float(found.antenna_az_deg[k]), float(found.antenna_el_deg[k]), az_deg, el_deg)


@pytest.mark.parametrize("turn_deg", [0.0, 360.0, -360.0])
def test_where_the_axes_reach_the_path_the_antenna_is_on_it_on_the_turn_of_the_plan(turn_deg: float) -> None:
    found = way(turn_deg)
    assert found.tai_s == pytest.approx(T + np.arange(FROM_S, TO_S + STEP_S / 2, STEP_S))
    for k in (0, 400, 1600):
        az_deg, el_deg = seen_at(float(found.tai_s[k]) - T)
        assert found.path_az_deg[k] == pytest.approx(az_deg + turn_deg, abs=1e-3)
        assert found.path_el_deg[k] == pytest.approx(el_deg, abs=1e-3)
    assert np.array_equal(found.antenna_az_deg, found.path_az_deg)
    assert np.array_equal(found.antenna_el_deg, found.path_el_deg)
    assert found.off_deg.max() < 1e-3
    assert found.out_s(0.5) == 0.0


def test_a_pass_of_more_steps_than_are_worth_it_has_longer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    assert STEP_S * MOST_STEPS == 4000.0  # longer than any pass in a low orbit
    monkeypatch.setattr("acu_daemon.control.tracking.expected_way.MOST_STEPS", 400)
    found = way(unwindings=(Unwinding(T + FROM_S + 20.0, 360.0, 0.0),))
    assert found.tai_s == pytest.approx(T + np.arange(FROM_S, TO_S + 0.2, 0.4))
    turned = found.antenna_az_deg - found.path_az_deg
    assert turned[49:53] == pytest.approx([0.0, 0.0, 360.0, 360.0])


@pytest.mark.parametrize("at_end", ["min_az", "max_az", "min_el", "max_el"])
def test_beyond_a_limit_the_antenna_stays_there_and_is_off_by_the_angle_on_the_sky(at_end: str) -> None:
    free = way()
    az, el = free.path_az_deg, free.path_el_deg
    middle_az, middle_el = float(az.min() + az.max()) / 2.0, float(el.min() + el.max()) / 2.0
    limits: dict[str, dict[str, Any]] = {
        "min_az": {"azimuth": (middle_az, 900.0)},
        "max_az": {"azimuth": (-900.0, middle_az)},
        "min_el": {"elevation": (middle_el, 90.0)},
        "max_el": {"elevation": (0.0, middle_el)},
    }
    found = way(**limits[at_end])
    bound = {"min_az": np.maximum(az, middle_az), "max_az": np.minimum(az, middle_az)}.get(at_end, az)
    assert found.antenna_az_deg == pytest.approx(bound)
    bound = {"min_el": np.maximum(el, middle_el), "max_el": np.minimum(el, middle_el)}.get(at_end, el)
    assert found.antenna_el_deg == pytest.approx(bound)
    assert np.array_equal(found.path_az_deg, az)
    assert np.array_equal(found.path_el_deg, el)
    assert found.off_deg.max() > 5.0
    assert found.off_deg[::100] == pytest.approx([sky_deg(found, k) for k in range(0, 1601, 100)], abs=1e-3)


def test_the_time_out_of_the_beam_is_that_of_the_samples_that_are_off_by_more() -> None:
    none = np.zeros(5)
    found = ExpectedWay(10.0 + 0.2 * np.arange(5), none, none, none, none, np.array([0.0, 0.5, 0.5 + 1e-9, 3.0, 0.49]))
    assert found.out_s(0.5) == pytest.approx(0.4)
    assert found.out_s(0.4) == pytest.approx(0.8)
    assert found.out_s(5.0) == 0.0


@pytest.mark.parametrize("by_deg", [360.0, -360.0])
def test_on_the_way_to_another_turn_the_azimuth_goes_evenly_and_is_off_the_path_until_it_is_there(
    by_deg: float,
) -> None:
    begin_s, for_s = FROM_S + 20.0, 40.0
    found = way(unwindings=(Unwinding(T + begin_s, by_deg, for_s),))
    turned = found.antenna_az_deg - found.path_az_deg
    for at_s, share in [(0.0, 0.0), (20.0, 0.0), (30.0, 0.25), (40.0, 0.5), (60.0, 1.0), (90.0, 1.0)]:
        k = round(at_s / STEP_S)
        assert turned[k] == pytest.approx(share * by_deg, abs=1e-3)
        assert found.off_deg[k] == pytest.approx(sky_deg(found, k), abs=1e-3)
    assert found.off_deg[400] > 30.0
    assert found.out_s(0.5) == pytest.approx(40.0, abs=0.5)


def test_changes_of_the_turn_add_up_and_one_without_a_time_takes_a_step() -> None:
    changes = (Unwinding(T + FROM_S + 20.05, 360.0, 0.0), Unwinding(T + FROM_S + 60.0, -720.0, 20.0))
    found = way(unwindings=changes)
    turned = found.antenna_az_deg - found.path_az_deg
    at = {round(at_s / STEP_S): deg for at_s, deg in [(20.0, 0.0), (20.1, 180.0), (20.2, 360.0), (70.0, 0.0)]}
    assert {k: float(turned[k]) for k in at} == pytest.approx(at, abs=1e-2)
    assert turned[-1] == pytest.approx(-360.0)


@pytest.mark.parametrize("by_deg", [360.0, -360.0])
def test_a_change_of_the_turn_is_held_by_the_limits_too(by_deg: float) -> None:
    free = way()
    end_deg = float(free.path_az_deg.max() if by_deg > 0.0 else free.path_az_deg.min()) + by_deg / 4.0
    azimuth = (-900.0, end_deg) if by_deg > 0.0 else (end_deg, 900.0)
    found = way(unwindings=(Unwinding(T + FROM_S + 20.0, by_deg, 10.0),), azimuth=azimuth)
    assert found.antenna_az_deg[-1] == pytest.approx(end_deg)


def test_over_the_zenith_the_antenna_goes_as_its_drive_can_and_the_path_as_the_satellite_does() -> None:
    found = way(station=OVERHEAD)
    drive = np.abs(np.diff(found.antenna_az_deg)) / STEP_S
    assert drive.max() <= AZIMUTH.max_rate_deg_s + TINY_DEG
    assert np.abs(np.diff(found.path_az_deg)).max() / STEP_S > 2.0 * AZIMUTH.max_rate_deg_s
    assert 0.0 < found.out_s(0.5) < 30.0
    assert found.off_deg[0] < 1e-3


@pytest.mark.parametrize("zenith_turn", [1, -1])
def test_past_the_zenith_the_azimuth_turns_the_way_of_the_plan(zenith_turn: int) -> None:
    found = way(station=OVERHEAD, zenith_turn=zenith_turn)
    turned_deg = float(found.antenna_az_deg[-1] - found.antenna_az_deg[0])
    assert zenith_turn * turned_deg > 90.0
    assert found.off_deg[-1] < 1e-3


def test_over_the_top_the_elevation_that_is_followed_goes_beyond_the_zenith() -> None:
    rules = KeyholeRules(AZIMUTH, max_el_deg=180.0, may_plunge=True)
    found = way(station=OVERHEAD, rules=rules, elevation=(0.0, 180.0))
    buffer = predict(
        *(ORBIT, OVERHEAD, T + FROM_S, T + FROM_S, "TLE", seen_at(FROM_S, OVERHEAD)[0]),
        horizon_s=TO_S - FROM_S,
        keyhole=rules,
    )
    assert np.array_equal(found.antenna_el_deg, buffer.follow_el_deg)
    assert np.abs(found.antenna_el_deg - found.path_el_deg).max() > 1e-3
    assert found.antenna_el_deg[-1] > 90.0
    assert found.off_deg[-1] < 1e-3
    assert way(station=OVERHEAD, rules=rules).antenna_el_deg.max() == 90.0
