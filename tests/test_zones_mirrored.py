"""Keep-outs, the sun and the ways past them: the same to the left and right, up and down, and wherever north is."""

from dataclasses import replace
from functools import cache
from random import Random

import numpy as np
import pytest
from fake_sky import Star
from memories import remembering
from mirrors import Mirror
from test_mirrors_of_options import StillSun

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.keep_clear import braking, is_far, led_clear
from acu_daemon.control.tracking.zone_watch import LEAD_S, antenna_nears, nears_zone
from acu_daemon.model import AxisLimits, Pointing, Prediction, sky_angle_deg
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.escape import SUN_RATE_DEG_S, sun_reaches_s, way_out
from acu_daemon.pointing.keep_out import Disc, KeepOut
from acu_daemon.pointing.way_round import RIM_DEG, blocked_at, moved_out, next_aim, why_not_stow

TAI_S = 8.4e8
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(2.0, 80.0, 5.0, 5.0)
MIRRORS = {
    "left and right": Mirror(az=-1),
    "up and down": Mirror(el=-1),
    "both, turned": Mirror(az=-1, el=-1, turned_deg=112.5),
    "over north": Mirror(turned_deg=-200.0),
}
Place = tuple[float, float]


@cache
def worlds() -> list[tuple[Envelope, Place, Place]]:
    """Zones, and a way from here to there past or through them."""
    draw, found = Random(7), []
    for k in range(60):
        middle = draw.uniform(-60.0, 60.0), draw.uniform(25.0, 55.0)
        half_deg, low_deg, high_deg = (
            draw.uniform(3.0, 25.0),
            middle[1] - draw.uniform(3.0, 15.0),
            middle[1] + draw.uniform(3.0, 15.0),
        )
        box = KeepOut("box", middle[0] - half_deg, middle[0] + half_deg, low_deg, high_deg)
        sun = StillSun(Disc("the sun", *middle, draw.uniform(1.0, 6.0)))
        envelope = Envelope(
            AZIMUTH, ELEVATION, (box,) if k % 2 else (), None if k % 2 else sun, stow_deg=(middle[0] + 50.0, 41.0)
        )
        here = middle[0] + draw.uniform(-40.0, -5.0), middle[1] + draw.uniform(-20.0, 20.0)
        there = middle[0] + draw.uniform(-5.0, 40.0), middle[1] + draw.uniform(-20.0, 20.0)
        found.append((envelope, here, there))
    return found


def moved(mirror: Mirror, place: Place | None) -> Place | None:
    return None if place is None else (mirror.az_deg(place[0]), mirror.el * place[1])


def is_same(one: Place | None, other: Place | None) -> bool:
    return one == pytest.approx(other, abs=1e-7) if one is not None and other is not None else one is other


@pytest.mark.parametrize("name", MIRRORS)
def test_ways_past_zones_and_out_of_them_are_mirrored(name: str) -> None:
    mirror, blocked_count, led_count, out_count = MIRRORS[name], 0, 0, 0
    for envelope, here, there in worlds():
        other, its_here, its_there = mirror.envelope(envelope), moved(mirror, here), moved(mirror, there)
        assert its_here is not None
        assert its_there is not None
        for place, its in ((here, its_here), (there, its_there)):
            assert other.room_deg(*its, TAI_S) == pytest.approx(envelope.room_deg(*place, TAI_S))
            assert other.clearance_deg(*its, TAI_S) == pytest.approx(envelope.clearance_deg(*place, TAI_S))
            assert bool(other.why_not(*its, TAI_S)) == bool(envelope.why_not(*place, TAI_S))
            out = moved_out(envelope, place, TAI_S)
            assert is_same(moved(mirror, out), moved_out(other, its, TAI_S))
            out_count += out not in (None, place)
        blocked, its_blocked = blocked_at(envelope, here, there, TAI_S), blocked_at(other, its_here, its_there, TAI_S)
        assert (blocked is None) == (its_blocked is None)
        if blocked is not None and its_blocked is not None:
            assert is_same(moved(mirror, blocked[0]), its_blocked[0])
            blocked_count += 1
        aim = next_aim(envelope, here, there, TAI_S)
        assert is_same(moved(mirror, aim), next_aim(other, its_here, its_there, TAI_S))
        led_count += aim not in (None, there)
        assert why_not_stow(other, its_here, TAI_S) == why_not_stow(envelope, here, TAI_S)
    assert min(blocked_count, led_count, out_count) >= 10


@pytest.mark.parametrize("name", MIRRORS)
def test_registers_are_led_and_braked_alike_in_a_mirror(name: str) -> None:
    mirror, braked_count = MIRRORS[name], 0
    for envelope, begins, there in worlds():
        other, blocked = mirror.envelope(envelope), blocked_at(envelope, begins, there, TAI_S)
        near = begins if blocked is None else blocked[0]
        here = 0.95 * near[0] + 0.05 * begins[0], 0.95 * near[1] + 0.05 * begins[1]
        rates = 0.15 * (there[0] - here[0]), 0.1 * (there[1] - here[1])
        az, el = AxisState(here[0], rates[0]), AxisState(here[1], rates[1])
        its_az = AxisState(mirror.az_deg(az.position_deg), mirror.az * az.rate_deg_s)
        its_el = AxisState(mirror.el * el.position_deg, mirror.el * el.rate_deg_s)
        wanted = Pointing(*there, 0.1, -0.1)
        its = Pointing(mirror.az_deg(there[0]), mirror.el * there[1], mirror.az * 0.1, mirror.el * -0.1)
        for is_followed in (True, False):
            led = led_clear(wanted, az, el, TAI_S, envelope, is_followed=is_followed)
            its_led = led_clear(its, its_az, its_el, TAI_S, other, is_followed=is_followed)
            assert (led.told, led.is_around) == (its_led.told, its_led.is_around)
            place = mirror.az_deg(led.wanted.az_deg), mirror.el * led.wanted.el_deg
            assert (its_led.wanted.az_deg, its_led.wanted.el_deg) == pytest.approx(place, abs=1e-7)
        assert is_far(its, its_az, its_el, 0.1, TAI_S, other) == is_far(wanted, az, el, 0.1, TAI_S, envelope)
        new = AxisState(here[0] + 0.1 * rates[0], rates[0]), AxisState(here[1] + 0.1 * rates[1], rates[1])
        its_new = (
            AxisState(mirror.az_deg(new[0].position_deg), mirror.az * rates[0]),
            AxisState(mirror.el * new[1].position_deg, mirror.el * rates[1]),
        )
        done = braking((az, el), new, 0.1, TAI_S, envelope)
        its_done = braking((its_az, its_el), its_new, 0.1, TAI_S, other)
        assert its_done[0].position_deg == pytest.approx(mirror.az_deg(done[0].position_deg), abs=1e-7)
        assert its_done[1].position_deg == pytest.approx(mirror.el * done[1].position_deg, abs=1e-7)
        assert its_done[0].rate_deg_s == pytest.approx(mirror.az * done[0].rate_deg_s, abs=1e-7)
        assert its_done[1].rate_deg_s == pytest.approx(mirror.el * done[1].rate_deg_s, abs=1e-7)
        braked_count += done != new
    assert braked_count >= 5


SIDES = {"from the left": (-1, 0), "from the right": (1, 0), "from below": (0, -1), "from above": (0, 1)}


@pytest.mark.parametrize("kind", ["box", "sun"])
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("middle_deg", [0.0, 100.0, 180.0, 275.0])
def test_whoever_comes_near_a_zone_from_any_side_is_noticed_four_seconds_before_and_whoever_leaves_is_not(
    kind: str, side: str, middle_deg: float
) -> None:
    right, up = SIDES[side]
    box = KeepOut("box", middle_deg - 5.0, middle_deg + 5.0, 35.0, 45.0)
    sun = StillSun(Disc("the sun", middle_deg, 40.0, 5.0))
    envelope = Envelope(AZIMUTH, ELEVATION, (box,) if kind == "box" else (), sun if kind == "sun" else None)
    config = ControlConfig(envelope)
    edge_deg = 5.0 / (1.0 if kind == "box" or not right else 0.766)  # of the disc, in degrees of azimuth
    for gap_s, is_near in ((3.5, True), (4.6, False)):
        for sign, nears in ((-1.0, is_near), (1.0, False)):  # towards it, away from it
            speed = 1.0
            az_deg = middle_deg + right * (edge_deg + gap_s * speed)
            el_deg = 40.0 + up * (5.0 + gap_s * speed)
            rates = sign * speed * right, sign * speed * up
            ago_s = [0.1 * k - 0.5 for k in range(6)]
            track = tuple((TAI_S + s, az_deg + rates[0] * s, el_deg + rates[1] * s) for s in ago_s)
            state = remembering(track_of_readings=track, status=AcuStatus(az_deg % 360.0, el_deg, AcuMode.AUTOTRACK))
            assert antenna_nears(state, TAI_S, envelope) is nears, (gap_s, sign)
            # The path: its rim counts
            star = Star(az_deg + right * RIM_DEG / 0.766, el_deg + up * RIM_DEG, *rates)
            sky = Sky(star_path(star))
            assert nears_zone(remembering(), sky, TAI_S, config) is nears, (gap_s, sign)


def star_path(star: Star) -> Prediction:
    """A buffer of a star's even motion, about now."""
    t = np.arange(-10.0, 11.0)
    az, el = star.az_deg + star.az_rate_deg_s * t, star.el_deg + star.el_rate_deg_s * t
    rates = np.full(t.size, star.az_rate_deg_s), np.full(t.size, star.el_rate_deg_s)
    return Prediction(TAI_S - 10.0, 1.0, az, el, *rates, az, rates[0], "FITTED", TAI_S)


class MovingSun(StillSun):
    """One that goes up or down, left or right, evenly."""

    def at(self, tai_s: float) -> Disc:
        t, rate = tai_s - TAI_S, SUN_RATE_DEG_S
        right, up = SIDES[self.policy.partition("|")[2]]
        return replace(self.disc, az_deg=self.disc.az_deg - right * rate * t, el_deg=self.disc.el_deg - up * rate * t)

    def angle_deg(self, az_deg: float, el_deg: float, tai_s: float) -> float:
        disc = self.at(tai_s)
        return sky_angle_deg(az_deg, el_deg, disc.az_deg, disc.el_deg)


@pytest.mark.parametrize("side", SIDES)
def test_the_sun_reaches_an_antenna_when_its_disc_does_whichever_way_it_goes(side: str) -> None:
    right, up = SIDES[side]
    far_deg = 2.0 + 900.0 * SUN_RATE_DEG_S
    sun = MovingSun(Disc("the sun", 100.0 + right * far_deg / 0.766, 40.0 + up * far_deg, 2.0), f"avoid|{side}")
    envelope = Envelope(AZIMUTH, ELEVATION, (), sun)
    reach_s = sun_reaches_s(envelope, (100.0, 40.0), TAI_S)
    assert reach_s == pytest.approx(900.0 if up else 900.0 / 0.766, rel=0.02)
    assert sun_reaches_s(envelope, (100.0 + right * far_deg / 0.766, 40.0 + up * far_deg), TAI_S) == 0.0
    assert sun_reaches_s(envelope, (100.0, 40.0), TAI_S - 3600.0) is None
    assert sun_reaches_s(Envelope(AZIMUTH, ELEVATION), (100.0, 40.0), TAI_S) is None
    still = Envelope(AZIMUTH, ELEVATION, (), StillSun(Disc("the sun", 100.0, 40.0, 2.0)))
    out = way_out(still, (100.0 + right, 40.0 + up), TAI_S)
    assert out is not None
    assert (out[0] - 100.0) * right >= 0.0
    assert (out[1] - 40.0) * up >= 0.0
    assert sky_angle_deg(*out, 100.0, 40.0) == pytest.approx(2.0 + RIM_DEG, abs=1e-6)


def test_the_lead_is_what_these_tests_say() -> None:
    assert LEAD_S == 4.0
