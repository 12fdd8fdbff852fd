"""Angles as the wire carries them: 16-bit binary angles, LSB 360/65536 deg (docs/protocol.md, Encodings).

A signed code is a plain count of LSBs and may lie in any turn; a wire code is the same count modulo 65536.
Multiples of the LSB are exact in a float, so code -> degrees -> code loses nothing.
"""

from math import ceil, floor, isfinite

TURN = 0x10000
LSB_DEG = 360.0 / TURN
_LIMIT_SLACK_LSB = 1e-6  # a limit that is a multiple of the LSB must not move by a float's last bit


def nearest_code(angle_deg: float) -> int:
    """Signed code nearest to an angle; not reduced to one turn.  ValueError: the angle is not finite."""
    if not isfinite(angle_deg):
        raise ValueError(f"an angle must be finite, got {angle_deg}")
    return round(angle_deg / LSB_DEG)


def azimuth_code(az_deg: float) -> int:
    """Wire code 0..65535 of an azimuth in any turn."""
    return nearest_code(az_deg) % TURN


def elevation_code(el_deg: float) -> int:
    """Wire code 0..65535, two's complement, of an elevation or tilt in [-180, 180)."""
    return nearest_code(el_deg) % TURN


def azimuth_deg(code: int) -> float:
    """Azimuth in [0, 360) of a wire code."""
    return (code % TURN) * LSB_DEG


def elevation_deg(code: int) -> float:
    """Elevation or tilt in [-180, 180) of a wire code."""
    return ((code + TURN // 2) % TURN - TURN // 2) * LSB_DEG


def clamp_code(angle_deg: float, min_deg: float, max_deg: float) -> int:
    """Signed code nearest to an angle whose rounded value still lies within the limits (docs/protocol.md,
    Encodings).

    The azimuth is the continuous one, in the frame of its limits.  ValueError: no code lies between the limits.
    """
    lowest = ceil(min_deg / LSB_DEG - _LIMIT_SLACK_LSB)
    highest = floor(max_deg / LSB_DEG + _LIMIT_SLACK_LSB)
    if lowest > highest:
        raise ValueError(f"no 16-bit angle lies between {min_deg} and {max_deg} deg")
    return min(max(nearest_code(angle_deg), lowest), highest)


def clamp_deg(angle_deg: float, min_deg: float, max_deg: float) -> float:
    """Angle nearest to the one given that the wire can carry exactly and that lies within the limits."""
    return clamp_code(angle_deg, min_deg, max_deg) * LSB_DEG
