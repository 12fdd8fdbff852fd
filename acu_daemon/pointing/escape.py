"""An antenna that stands before the sun: how long until the sun's disc is there, and the way out.  Pure."""

from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.way_round import LEAST_CLEAR_DEG, Place, places_about

SUN_RATE_DEG_S = 360.0 / 86164.0905  # the most that its direction moves: the turn of the Earth
LONGEST_S = 3600.0
LEAST_STEP_S = 1.0
CLEAR_FOR_S = (0.0, 300.0, 600.0, 900.0, 1200.0)  # a way out leads where the antenna may stand for so long


def sun_reaches_s(envelope: Envelope, place: Place, tai_s: float) -> float | None:
    """Seconds until the sun's disc reaches an antenna that stands at a place; 0: it is inside, None: not in an hour."""
    sun = envelope.sun
    if sun is None:
        return None
    beam, after_s = envelope.beam_deg(*place), 0.0
    while after_s <= LONGEST_S:
        clear_deg = sun.angle_deg(*beam, tai_s + after_s) - sun.radius_deg
        if clear_deg <= 0.0:
            return after_s
        after_s += max(clear_deg / SUN_RATE_DEG_S, LEAST_STEP_S)
    return None


def way_out(envelope: Envelope, place: Place, tai_s: float) -> Place | None:
    """The nearest place where the antenna may stand for a quarter of an hour and more; None: there is none."""
    if envelope.sun is None:
        return None
    for after_s in reversed(CLEAR_FOR_S):  # about where the disc will be
        disc = envelope.sun.at(tai_s + after_s)
        for one in places_about(envelope, place, disc):
            is_in_limits = envelope.room_deg(*one, tai_s) >= 0.0
            if is_in_limits and all(envelope.clearance_deg(*one, tai_s + s) >= LEAST_CLEAR_DEG for s in CLEAR_FOR_S):
                return one
    return None
