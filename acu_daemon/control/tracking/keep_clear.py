"""Register writes that the antenna follows, kept clear of keep-out zones and of the sun.  Pure.

What is wanted inside a zone goes to its rim, and the way there, or past it, leads around (pointing.way_round).  Then
no step is taken from which the axes could not brake to a standstill outside: a step goes through whole, or with one
axis that brakes while the other one goes on, or both brake.  From a state that can brake outside each of these leads to
another one, so by induction the registers are never inside.  Where the antenna is inside already, only a step further
out is taken.  Without zones nothing here is computed.
"""

from dataclasses import dataclass
from math import copysign, hypot

from acu_daemon.model import AxisLimits, Pointing
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.way_round import LEAST_CLEAR_DEG, moved_out, next_aim

BRAKE_SHARE = 0.9  # of the drive's acceleration
AROUND_SHARE = 0.3  # of the drive's rate, on a way around a zone: the antenna shall not cut its corners
FAR_DEG = 1.0  # beyond the way, for LEAST_CLEAR_DEG and a mount that is not square
LEAST_STEP_DEG, MOST_LOOKS = 0.05, 200  # of the looks along a brake
LED_AROUND = "led around a keep-out"
IN_THE_WAY = "a keep-out is in the way, and none leads around it"


@dataclass(frozen=True, slots=True)
class Led:
    """Where the registers shall go in the place of what is wanted; told: why elsewhere, empty where it is wanted."""

    wanted: Pointing
    told: str = ""
    is_around: bool = False  # on a way around a zone


def is_far(wanted: Pointing, az: AxisState, el: AxisState, dt_s: float, now_tai_s: float, envelope: Envelope) -> bool:
    """Whether zones are so far that neither what is wanted, nor the way, nor a brake after a step comes near one.

    On the sky nothing is farther than the sum of both axes' ways: then the rest of this module has nothing to say.
    """
    way_deg = abs(wanted.az_deg - az.position_deg) + abs(wanted.el_deg - el.position_deg)
    for axis, limits in ((az, envelope.azimuth), (el, envelope.elevation)):
        speed = abs(axis.rate_deg_s) + limits.max_acceleration_deg_s2 * dt_s
        way_deg += speed * (dt_s + speed / (2.0 * BRAKE_SHARE * limits.max_acceleration_deg_s2))
    return envelope.clearance_deg(az.position_deg, el.position_deg, now_tai_s) > way_deg + FAR_DEG


def led_clear(
    wanted: Pointing, az: AxisState, el: AxisState, now_tai_s: float, envelope: Envelope, *, is_followed: bool
) -> Led:
    """What is wanted taken outside all zones, and where to go first on the way there.

    az, el: where the registers are.  Those that are not followed jump: there is no way.
    """
    here, goal = (az.position_deg, el.position_deg), (wanted.az_deg, wanted.el_deg)
    zone = envelope.zone_at(*goal, now_tai_s, LEAST_CLEAR_DEG)
    out, told = goal, ""
    if zone is not None:
        out, told = moved_out(envelope, goal, now_tai_s) or here, f"kept out of {zone.name}"
    aim = next_aim(envelope, here, out, now_tai_s) if is_followed else out
    if aim is None:
        return Led(Pointing(*here, 0.0, 0.0), told or IN_THE_WAY)
    if aim == goal:
        return Led(wanted)
    return Led(Pointing(*aim, 0.0, 0.0), told or LED_AROUND, is_around=aim != out)


def braking(
    start: tuple[AxisState, AxisState],
    step: tuple[AxisState, AxisState],
    dt_s: float,
    now_tai_s: float,
    envelope: Envelope,
) -> tuple[AxisState, AxisState]:
    """A step of both axes, or as much of it as leaves room to brake outside of all zones."""
    still = braked(start[0], dt_s, envelope.azimuth), braked(start[1], dt_s, envelope.elevation)
    for one in (step, (step[0], still[1]), (still[0], step[1]), still):
        if _can_stop_outside(one, now_tai_s, envelope):
            return one
    before_deg = envelope.clearance_deg(start[0].position_deg, start[1].position_deg, now_tai_s)
    after_deg = envelope.clearance_deg(step[0].position_deg, step[1].position_deg, now_tai_s)
    return step if before_deg < LEAST_CLEAR_DEG and after_deg >= before_deg else still


def braked(axis: AxisState, dt_s: float, limits: AxisLimits) -> AxisState:
    """An axis after dt_s of braking."""
    acceleration = BRAKE_SHARE * limits.max_acceleration_deg_s2
    speed = abs(axis.rate_deg_s)
    if speed <= acceleration * dt_s:
        return AxisState(axis.position_deg + copysign(speed * speed / acceleration / 2.0, axis.rate_deg_s))
    rate = axis.rate_deg_s - copysign(acceleration * dt_s, axis.rate_deg_s)
    return AxisState(axis.position_deg + (axis.rate_deg_s + rate) * dt_s / 2.0, rate)


def _can_stop_outside(axes: tuple[AxisState, AxisState], tai_s: float, envelope: Envelope) -> bool:
    """Whether both axes brake to a standstill without coming near a zone; looked at as far apart as there is room."""
    az, el = axes
    for _ in range(MOST_LOOKS):
        spare_deg = envelope.clearance_deg(az.position_deg, el.position_deg, tai_s) - LEAST_CLEAR_DEG
        if spare_deg < 0.0:
            return False
        speed = hypot(az.rate_deg_s, el.rate_deg_s)
        if speed == 0.0:
            return True
        after_s = max(spare_deg, LEAST_STEP_DEG) / speed
        az, el = braked(az, after_s, envelope.azimuth), braked(el, after_s, envelope.elevation)
    return False
