"""The way past keep-out zones: out of one, around one, and whether a straight way is free.  Pure.

Angles are the encoders', the azimuth continuous; a straight way is one in azimuth and elevation.  The sun's disc is
passed on the side that is nearer in angle about it, a box by its corners, whichever way is shorter.  Near the zenith,
and for an antenna that plunges or leans, there may be no way: None, and whoever asks waits.

A way is looked at only where it crosses the box about a zone, there in steps as long as the clearance.
"""

from collections.abc import Iterator
from itertools import combinations
from math import acos, cos, degrees, hypot, inf, radians

from acu_daemon.model import sky_angle_deg
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import STEEPEST_DEG, Disc, Zone
from acu_daemon.units import wrap_180

Place = tuple[float, float]  # azimuth and elevation, deg

LEAST_CLEAR_DEG = 0.15  # what the antenna is kept clear of a zone: the sun moves so far in 36 s
RIM_DEG = 0.3  # and where it waits or goes around
LEAST_STEP_DEG = 0.25  # of a look along a way: what lies between two is a sagitta of 0.02 deg in the smallest disc
TURN_DEG = 10.0  # half of what a way around a disc turns about its middle from one aim to the next
SIDES_DEG = (0, *(sign * angle for angle in range(10, 181, 10) for sign in (1, -1)))  # about a disc, the nearest first


def why_not_stow(envelope: Envelope, here: Place, tai_s: float) -> str:
    """Why the ACU must not be sent to its stow position, which it goes to straight; empty: it may."""
    if not envelope.has_zones:
        return ""
    if envelope.stow_deg is None:
        return "where the stow position is, is not known: give [envelope] stow_az_deg and stow_el_deg"
    blocked = blocked_at(envelope, here, envelope.stow_deg, tai_s)
    return f"the straight way to the stow position leads through the keep-out of {blocked[1].name}" if blocked else ""


def blocked_at(
    envelope: Envelope, here: Place, there: Place, tai_s: float, only: Zone | None = None
) -> tuple[Place, Zone] | None:
    """Where a straight way comes too near to a zone first, and to which; None: it is free.  only: of one zone."""
    if envelope.is_bent(here[1], there[1]):
        return next(_inside(envelope, here, there, 0.0, 1.0, tai_s), None)
    beam = envelope.beam_deg(*here)
    first_share, first = 2.0, None
    for zone in envelope.zones_at(tai_s) if only is None else (only,):
        for enters, leaves in _crossings(zone.box_deg(LEAST_CLEAR_DEG), beam, there[0] - here[0], there[1] - here[1]):
            if enters < first_share and (found := next(_inside(envelope, here, there, enters, leaves, tai_s), None)):
                first_share, first = enters, found
    return first


def _crossings(
    box: tuple[float, float, float, float], beam: Place, d_az: float, d_el: float
) -> Iterator[tuple[float, float]]:
    """Shares of a way from a direction of the beam at which it enters and leaves a box, on each turn of the azimuth."""
    middle_deg, half_deg, low_deg, high_deg = box
    el_in, el_out = _between(low_deg - beam[1], high_deg - beam[1], d_el)
    if half_deg >= 180.0:
        if el_in < el_out:
            yield el_in, el_out
        return
    nearest_deg = (middle_deg - beam[0] + 180.0) % 360.0 - 180.0
    turns = range(-1 - int(abs(d_az) // 360.0), 2 + int(abs(d_az) // 360.0))
    for off_deg in (nearest_deg + 360.0 * turn for turn in turns):
        az_in, az_out = _between(off_deg - half_deg, off_deg + half_deg, d_az)
        if max(az_in, el_in) < min(az_out, el_out):
            yield max(az_in, el_in), min(az_out, el_out)


def _between(low_deg: float, high_deg: float, d_deg: float) -> tuple[float, float]:
    """Shares of a way of d_deg on one axis, of 0 to 1, at which it is between two angles; (1, 0): never."""
    if abs(d_deg) < 1e-9:
        return (0.0, 1.0) if low_deg < 0.0 < high_deg else (1.0, 0.0)
    first, last = sorted((low_deg / d_deg, high_deg / d_deg))
    return max(first, 0.0), min(last, 1.0)


def _inside(
    envelope: Envelope, here: Place, there: Place, enters: float, leaves: float, tai_s: float
) -> Iterator[tuple[Place, Zone]]:
    """Where a part of a way is too near to a zone."""
    d_az, d_el = there[0] - here[0], there[1] - here[1]
    way_deg, share = hypot(d_az, d_el), enters
    while True:
        place = here[0] + share * d_az, here[1] + share * d_el
        spare_deg = envelope.clearance_deg(*place, tai_s) - LEAST_CLEAR_DEG
        if spare_deg < 0.0 and (zone := envelope.zone_at(*place, tai_s, LEAST_CLEAR_DEG)) is not None:
            yield place, zone
        if share >= leaves:
            return
        share = min(share + max(spare_deg, LEAST_STEP_DEG) / max(way_deg, 1e-9), leaves)


def moved_out(envelope: Envelope, place: Place, tai_s: float) -> Place | None:
    """The nearest place outside all zones and within the limits, for one that is inside a zone; None: there is none."""
    zone = envelope.zone_at(*place, tai_s, RIM_DEG)
    if zone is None:
        return place
    if envelope.is_bent(place[1]):
        return None
    allowed = (
        one
        for one in places_about(envelope, place, zone)
        if envelope.room_deg(*one, tai_s) >= 0.0 and envelope.clearance_deg(*one, tai_s) >= LEAST_CLEAR_DEG
    )
    if isinstance(zone, Disc):  # they come the nearest first
        return next(allowed, None)
    return min(allowed, key=lambda one: sky_angle_deg(*place, *one), default=None)


def places_about(envelope: Envelope, place: Place, zone: Zone) -> Iterator[Place]:
    """Places on the rim of a zone, about a disc the nearest first."""
    beam = envelope.beam_deg(*place)
    return (_encoders(place, beam, at) for at in _around(zone, beam))


def _around(zone: Zone, beam: Place) -> Iterator[Place]:
    """Places on the rim of a zone: those next to a direction, then others."""
    if isinstance(zone, Disc):
        angle_deg = zone.angle_deg(*beam)
        yield from (zone.at(angle_deg + side_deg, RIM_DEG) for side_deg in SIDES_DEG)
        return
    middle_deg, half_deg, low_deg, high_deg = zone.box_deg(RIM_DEG)
    az_deg = middle_deg + wrap_180(beam[0] - middle_deg)
    yield az_deg, high_deg
    yield az_deg, low_deg
    if half_deg < 180.0:
        beside_deg = zone.box_deg(0.0)[1] + RIM_DEG / cos(radians(min(abs(beam[1]), STEEPEST_DEG)))
        for sign in (-1.0, 1.0):
            yield middle_deg + sign * beside_deg, beam[1]
            yield from ((middle_deg + sign * half_deg, el_deg) for el_deg in (low_deg, high_deg))


def _encoders(place: Place, beam: Place, at: Place) -> Place:
    """What the encoders show at a direction of the beam, on the turn of a place whose direction is known."""
    return place[0] + wrap_180(at[0] - beam[0]), place[1] + at[1] - beam[1]


def next_aim(envelope: Envelope, here: Place, goal: Place, tai_s: float) -> Place | None:
    """Where to go from here on the way to a goal outside all zones: the goal itself where the way is free.

    None: a zone is in the way and none leads around it.
    """
    blocked = blocked_at(envelope, here, goal, tai_s)
    if blocked is None:
        return goal
    place, zone = blocked
    if envelope.is_bent(here[1], goal[1]):
        return None
    if isinstance(zone, Disc):
        return _around_disc(envelope, zone, here, goal, tai_s)
    return _around_box(envelope, zone, here, goal, place, tai_s)


def _around_disc(envelope: Envelope, disc: Disc, here: Place, goal: Place, tai_s: float) -> Place | None:
    """Along a tangent to a circle somewhat wider than the disc, then about it in steps, the shorter way round first."""
    beam = envelope.beam_deg(*here)
    radius_deg = disc.radius_deg + RIM_DEG
    far_deg = disc.clearance_deg(*beam) + disc.radius_deg
    from_deg = disc.angle_deg(*beam)
    turn_deg = wrap_180(disc.angle_deg(*envelope.beam_deg(*goal)) - from_deg)
    step_deg = degrees(acos(min(1.0, radius_deg / max(far_deg, 1e-9)))) + TURN_DEG
    beyond_deg = radius_deg / cos(radians(TURN_DEG)) - disc.radius_deg
    side = 1.0 if turn_deg >= 0.0 else -1.0
    for sign, most_deg in ((side, abs(turn_deg)), (-side, 360.0 - abs(turn_deg))):
        aim = _encoders(here, beam, disc.at(from_deg + sign * min(step_deg, most_deg), beyond_deg))
        if envelope.room_deg(*aim, tai_s) >= 0.0 and envelope.clearance_deg(*aim, tai_s) >= LEAST_CLEAR_DEG:
            return aim
    return None


def _around_box(envelope: Envelope, zone: Zone, here: Place, goal: Place, blocked: Place, tai_s: float) -> Place | None:
    """By its corners: the first place of the shortest way over those that may be reached; other zones come later."""
    beam = envelope.beam_deg(*blocked)
    middle_deg, half_deg, low_deg, high_deg = zone.box_deg(RIM_DEG)
    if half_deg >= 180.0:
        return None
    middle_deg = beam[0] + wrap_180(middle_deg - beam[0])
    places = [
        _encoders(blocked, beam, (az_deg, el_deg))
        for az_deg in (middle_deg - half_deg, middle_deg + half_deg)
        for el_deg in (low_deg, high_deg)
    ]
    corners = [
        one
        for one in places
        if envelope.room_deg(*one, tai_s) >= 0.0 and envelope.clearance_deg(*one, tai_s) >= LEAST_CLEAR_DEG
    ]
    free = {
        (one, at): hypot(one[0] - at[0], one[1] - at[1])
        for one, at in combinations((here, *corners, goal), 2)
        if (one, at) != (here, goal) and blocked_at(envelope, one, at, tai_s, zone) is None
    }
    ways_deg = {goal: 0.0}
    for _ in corners:  # the shortest ways are found from the goal backwards, over one corner more each time
        for (one, at), way_deg in [*free.items(), *(((at, one), way) for (one, at), way in free.items())]:
            if at in ways_deg and at != here:
                ways_deg[one] = min(ways_deg.get(one, inf), way_deg + ways_deg[at])
    steps = [(way_deg + ways_deg[at], at) for (one, at), way_deg in free.items() if one == here and at in ways_deg]
    return min(steps)[1] if steps else None
