"""How a correction changes the shape and place of the ellipse, for every source of mean elements."""

from math import atan2, cos, hypot, sin
from typing import NamedTuple

from acu_daemon.model import Correction


class Ellipse(NamedTuple):
    """Eccentricity, argument of perigee and mean anomaly, radians; the mean anomaly may leave [0, 2 pi)."""

    e: float
    argp_rad: float
    mean_anomaly_rad: float


def corrected_ellipse(e: float, argp_rad: float, mean_anomaly_rad: float, correction: Correction) -> Ellipse:
    """Add a correction; the sum argp + mean anomaly gains delta_mean_anomaly_rad, however the perigee turns."""
    moved_rad = mean_anomaly_rad + correction.delta_mean_anomaly_rad
    if correction.delta_e_cos_argp == 0.0 and correction.delta_e_sin_argp == 0.0:
        return Ellipse(e, argp_rad, moved_rad)
    e_cos = e * cos(argp_rad) + correction.delta_e_cos_argp
    e_sin = e * sin(argp_rad) + correction.delta_e_sin_argp
    turned_rad = atan2(e_sin, e_cos)
    return Ellipse(hypot(e_cos, e_sin), turned_rad, moved_rad + argp_rad - turned_rad)
