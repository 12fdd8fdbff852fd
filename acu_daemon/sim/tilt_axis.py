"""SIMULATION of a tilt under the pedestal: all that stands on it turns about a level axis, east, north, up.

Nothing here comes from acu_daemon.pointing.
"""

from math import atan2, cos, degrees, hypot, radians, sin

import numpy as np


def leant(az_deg: float, el_deg: float, tilt_deg: float, towards_deg: float) -> tuple[float, float]:
    """Where a direction of the pedestal points, azimuth in (-180, 180] and elevation, when its top leans by a tilt.

    A negative tilt takes a direction of the ground to the pedestal.
    """
    a, h, t, b = radians(az_deg), radians(el_deg), radians(tilt_deg), radians(towards_deg)
    beam = np.array([cos(h) * sin(a), cos(h) * cos(a), sin(h)])
    axis = np.array([-cos(b), sin(b), 0.0])  # level, 90 deg to the left of where it leans
    turned = beam * cos(t) + np.cross(axis, beam) * sin(t) + axis * (axis @ beam) * (1.0 - cos(t))
    east, north, up = turned.tolist()
    return degrees(atan2(east, north)), degrees(atan2(up, hypot(east, north)))
