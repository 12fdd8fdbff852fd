"""Commands stay outside of keep-out zones and the sun's disc, go around them, and one axis does not hold the other."""

from dataclasses import replace
from math import cos, radians
from random import Random

import numpy as np
import pytest
from envelope_property import DAY_TAI_S, STEP_S, Counts, a_state, try_all
from troubled_decision import TroubledDecision

from acu_daemon.acu.commands import PointAndPoll, PointAt
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tracking.keep_clear import Led, braking, is_far, led_clear
from acu_daemon.control.tracking.register_limiter import limit
from acu_daemon.model import AxisLimits, Pointing, Site, Station, sky_angle_deg
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut, Sun
from acu_daemon.pointing.way_round import LEAST_CLEAR_DEG, moved_out, next_aim, why_not_stow

AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
SUN = Sun(Site(Station("", 25.0, 10.0, 100.0)), 5.0)
MORNING = next(DAY_TAI_S + 600.0 * k for k in range(144) if 44.0 < SUN.direction_deg(DAY_TAI_S + 600.0 * k)[1] < 47.0)
SUN_AZ, SUN_EL = SUN.direction_deg(MORNING)
BY_SUN = Envelope(AZIMUTH, ELEVATION, (), SUN)


def flown(
    envelope: Envelope, start: tuple[float, float], wanted: list[Pointing], *, rounds: int = 1
) -> list[tuple[float, float, float, str]]:
    """Azimuth, elevation, clearance and what is told, write by write; an antenna that is where its registers are."""
    config, az, el, rows = ControlConfig(envelope), AxisState(start[0]), AxisState(start[1]), []
    for k, point in enumerate(wanted * rounds):
        state = a_state(az, el, (az.position_deg, el.position_deg), was_followed=True)
        tai_s = MORNING + STEP_S * k
        passed = limit(point, state, tai_s, is_followed=True, dt_s=STEP_S, config=config)
        az, el = passed.az, passed.el
        clear_deg = envelope.clearance_deg(az.position_deg, el.position_deg, tai_s)
        rows.append((az.position_deg, el.position_deg, clear_deg, passed.limited))
    return rows


def test_no_random_sequence_of_any_mover_is_commanded_outside() -> None:
    counts = try_all(400, 11)
    assert isinstance(counts, Counts)
    assert (counts.outside, counts.cannot_brake, counts.first) == (0, 0, "")
    assert counts.sequences > 300
    assert counts.held > 500


@pytest.mark.parametrize(
    ("boxes", "goal"),
    [
        (((80.0, 100.0, 10.0, 40.0),), (120.0, 20.0)),
        (((80.0, 100.0, -90.0, 40.0),), (120.0, 20.0)),
        (((80.0, 100.0, 10.0, 90.0),), (120.0, 70.0)),
        (((80.0, 100.0, 10.0, 40.0), (110.0, 130.0, 0.0, 60.0)), (150.0, 20.0)),
        (((80.0 - 360.0, 100.0 - 360.0, 10.0, 40.0),), (120.0, 20.0)),
    ],
)
def test_a_jump_past_a_keep_out_goes_around_it(
    boxes: tuple[tuple[float, float, float, float], ...], goal: tuple[float, float]
) -> None:
    envelope = Envelope(AZIMUTH, ELEVATION, tuple(KeepOut("box", *box) for box in boxes))
    rows = flown(envelope, (60.0, 20.0), [Pointing(*goal, 0.0, 0.0)], rounds=900)
    assert rows[-1][:2] == pytest.approx(goal, abs=0.02)
    assert min(clear_deg for _, _, clear_deg, _ in rows) >= LEAST_CLEAR_DEG - 0.01
    assert {told for *_, told in rows} == {"", "led around a keep-out"}


def test_where_nothing_leads_around_the_antenna_waits_and_it_is_told() -> None:
    envelope = Envelope(AZIMUTH, ELEVATION, (KeepOut("the house", 80.0, 100.0),))
    rows = flown(envelope, (60.0, 20.0), [Pointing(120.0, 20.0, 0.0, 0.0)], rounds=50)
    assert {row[:2] for row in rows} == {rows[0][:2]}
    assert rows[-1][3] == "a keep-out is in the way, and none leads around it"


@pytest.mark.parametrize("angle_deg", range(0, 360, 45))
def test_a_jump_past_the_sun_goes_around_it(angle_deg: int) -> None:
    disc = SUN.at(MORNING)
    start, goal = disc.at(float(angle_deg), 8.0), disc.at(angle_deg + 180.0, 8.0)
    rows = flown(BY_SUN, start, [Pointing(*goal, 0.0, 0.0)], rounds=400)
    assert sky_angle_deg(*rows[-1][:2], *goal) < 0.05
    assert min(clear_deg for _, _, clear_deg, _ in rows) >= LEAST_CLEAR_DEG - 0.03


@pytest.mark.parametrize("beside_deg", [0.0, 0.5, -3.0])
def test_a_path_through_the_sun_is_on_its_rim_meanwhile_and_followed_before_and_after(beside_deg: float) -> None:
    rate_deg_s = 0.6 / cos(radians(SUN_EL))
    path = [
        Pointing(SUN_AZ + rate_deg_s * (STEP_S * k - 30.0), SUN_EL + beside_deg, rate_deg_s, 0.0) for k in range(600)
    ]
    rows = flown(BY_SUN, (path[0].az_deg, path[0].el_deg), path)
    off_deg = [sky_angle_deg(*row[:2], one.az_deg, one.el_deg) for row, one in zip(rows, path, strict=True)]
    inside = [BY_SUN.clearance_deg(one.az_deg, one.el_deg, MORNING) < 0.3 for one in path]
    first, last = inside.index(True), len(inside) - 1 - inside[::-1].index(True)
    assert min(clear_deg for _, _, clear_deg, _ in rows) > 0.0
    assert max(off_deg[: first - 10]) < 0.05
    assert max(off_deg[last + 50 :]) < 0.05
    assert max(off_deg) < 6.5
    assert {told for *_, told in rows[first + 10 : last - 10]} == {"kept out of the sun"}


def test_an_axis_that_is_held_before_a_zone_does_not_hold_the_other() -> None:
    envelope = Envelope(AZIMUTH, ELEVATION, (KeepOut("the house", 80.0, 100.0),))
    path = [Pointing(75.0 + 0.1 * k, 20.0 + 0.02 * k, 1.0, 0.2) for k in range(150)]
    rows = flown(envelope, (75.0, 20.0), path)
    assert rows[-1][0] == pytest.approx(79.6, abs=0.3)
    assert rows[-1][1] == pytest.approx(path[-1].el_deg, abs=0.1)


def test_an_antenna_that_stands_before_the_sun_steps_aside_and_one_inside_goes_out() -> None:
    disc = SUN.at(MORNING)
    beside = disc.at(270.0 if SUN.direction_deg(MORNING + 60.0)[0] < SUN_AZ else 90.0, 0.4)
    rows = flown(BY_SUN, beside, [Pointing(*beside, 0.0, 0.0)], rounds=1800)
    assert min(clear_deg for _, _, clear_deg, _ in rows) > 0.1
    inside = disc.at(30.0, -2.0)
    rows = flown(BY_SUN, inside, [Pointing(*inside, 0.0, 0.0)], rounds=100)
    clearances = [clear_deg for _, _, clear_deg, _ in rows]
    out = next(k for k, clear_deg in enumerate(clearances) if clear_deg > LEAST_CLEAR_DEG)
    assert clearances[:out] == sorted(clearances[:out])
    assert out < 40
    assert min(clearances[out:]) > LEAST_CLEAR_DEG - 0.01


def test_registers_that_are_not_followed_lie_outside_too() -> None:
    state = a_state(AxisState(SUN_AZ), AxisState(20.0), (SUN_AZ, 20.0), was_followed=False)
    inside = Pointing(SUN_AZ + 0.5, SUN_EL, 0.5, 0.1)
    passed = limit(inside, state, MORNING, is_followed=False, dt_s=STEP_S, config=ControlConfig(BY_SUN))
    assert BY_SUN.clearance_deg(passed.az.position_deg, passed.el.position_deg, MORNING) == pytest.approx(0.3, abs=0.02)
    assert passed.limited == "kept out of the sun"


def test_where_no_zone_is_in_the_way_the_goal_is_aimed_at_and_a_place_outside_stays() -> None:
    assert next_aim(BY_SUN, (0.0, 10.0), (200.0, 12.0), MORNING) == (200.0, 12.0)
    assert moved_out(BY_SUN, (0.0, 10.0), MORNING) == (0.0, 10.0)
    all_over = Envelope(AZIMUTH, ELEVATION, (KeepOut("everything", 0.0, 0.0, 0.0, 90.0),))
    assert moved_out(all_over, (0.0, 45.0), MORNING) is None


def test_stow_is_sent_only_where_its_straight_way_keeps_clear() -> None:
    envelope = Envelope(AZIMUTH, ELEVATION, (KeepOut("the mast", 80.0, 100.0, 10.0, 90.0),), stow_deg=(0.0, 88.0))
    assert why_not_stow(envelope, (20.0, 30.0), MORNING) == ""
    said = why_not_stow(envelope, (150.0, 20.0), MORNING)
    assert said == "the straight way to the stow position leads through the keep-out of the mast"
    assert "is not known" in why_not_stow(BY_SUN, (20.0, 30.0), MORNING)
    assert why_not_stow(Envelope(AZIMUTH, ELEVATION), (20.0, 30.0), MORNING) == ""


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 3, 12, 14, 15, 27])
def test_a_whole_decision_in_troubles_writes_nothing_inside_and_leads_an_antenna_out(seed: int) -> None:
    """Signal, modes, faults, axes and people as they come: a box stands on the satellite's path."""
    decision, draw = TroubledDecision(seed), Random(seed)
    az_deg, el_deg, _, _ = (float(one[0]) for one in decision.star.place(np.array([draw.uniform(5.0, 25.0)])))
    width_deg, height_deg = draw.uniform(0.5, 6.0), draw.uniform(0.5, 6.0)
    top_deg = min(90.0, el_deg + height_deg)
    box = KeepOut("the mast", az_deg - width_deg, az_deg + width_deg, el_deg - height_deg, top_deg)
    envelope = replace(decision.config.envelope, keep_outs=(box,))
    decision.config = replace(decision.config, envelope=envelope)
    for state, orders in decision.run(300):
        now_tai_s, status = decision.given[-1].now_tai_s, state.intake.status
        assert not [event for event in orders.events if event.name == "fence.refused"]
        for command in (orders.first, orders.extra):
            if isinstance(command, PointAndPoll | PointAt) and status is not None:
                antenna_deg = envelope.clearance_deg(state.intake.az_deg, status.el_deg, now_tai_s)
                clear_deg = envelope.clearance_deg(command.az_deg, command.el_deg, now_tai_s)
                assert clear_deg >= 0.0 or antenna_deg < 0.1


@pytest.mark.parametrize("most_deg", [90.0, 180.0])
def test_where_zones_are_far_the_whole_of_the_way_and_the_brake_are_clear_of_them(most_deg: float) -> None:
    """What is skipped there would have changed nothing: neither what is wanted nor the step."""
    elevation = AxisLimits(0.0, most_deg, 5.0, 5.0)
    box = KeepOut("mast", 100.0, 130.0, 10.0, 60.0)
    envelope, random, far_count = Envelope(AZIMUTH, elevation, (box,), SUN), Random(7), 0
    for _ in range(4000):
        az = AxisState(random.uniform(-270.0, 270.0), random.uniform(-20.0, 20.0))
        el = AxisState(random.uniform(0.0, most_deg), random.uniform(-5.0, 5.0))
        wanted = Pointing(az.position_deg + random.gauss(0.0, 5.0), el.position_deg + random.gauss(0.0, 3.0), 1.0, 1.0)
        if not is_far(wanted, az, el, STEP_S, MORNING, envelope):
            continue
        far_count += 1
        led = led_clear(wanted, az, el, MORNING, envelope, is_followed=True)
        assert led == Led(wanted)
        step = tuple(
            AxisState(axis.position_deg + (axis.rate_deg_s + rate) * STEP_S / 2.0, rate)
            for axis, rate in (
                (az, az.rate_deg_s + random.uniform(-10.0, 10.0) * STEP_S),
                (el, el.rate_deg_s + random.uniform(-5.0, 5.0) * STEP_S),
            )
        )
        assert braking((az, el), step, STEP_S, MORNING, envelope) == step
    assert far_count > 500
