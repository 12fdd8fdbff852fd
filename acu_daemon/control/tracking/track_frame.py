"""Directions beside a predicted path, in seconds along it and degrees across it.  Pure.

Late is positive: where a satellite is that comes so many seconds later on the same orbit, while the Earth has turned on
under it.  Right of the motion is positive.  Unlike an offset in azimuth and elevation, which means another error of the
orbit at every instant, one in this frame stays the same through the pass.
"""

from math import asin, atan2, cos, degrees, hypot, isfinite, radians, sin

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.model import Pointing, Prediction
from acu_daemon.units import wrap_180

SIGMAS = 3.0
MOST_ALONG_S, MOST_ACROSS_DEG = 120.0, 10.0  # what a buffer holds on both sides of now, and half a sky of rows
ROUNDS = 4  # of Newton's iteration: 0.001 deg after two, where the path is not straight
SLOWEST_DEG_S = 0.005  # below it, a satellite that stands in the sky has no along
RATE_SPAN_S = 0.05


def extents(prediction: Prediction | None, config: ControlConfig) -> tuple[float, float]:
    """How far the satellite may be along, s, and across, deg: the search's keys, or 3 sigma where those are more."""
    three_sigma = three_sigma_of(prediction) or (0.0, 0.0)
    return max(config.search_along_s, three_sigma[0]), max(config.search_across_deg, three_sigma[1])


def three_sigma_of(prediction: Prediction | None) -> tuple[float, float] | None:
    """3 sigma along and across, as far as can be searched; None where there is no sigma."""
    if prediction is None or prediction.spread is None or not all(map(isfinite, prediction.spread)):
        return None
    return min(SIGMAS * prediction.spread[0], MOST_ALONG_S), min(SIGMAS * prediction.spread[1], MOST_ACROSS_DEG)


def is_within(offset: tuple[float, float] | None, most: tuple[float, float]) -> bool:
    """Whether an offset is no more than extents allow."""
    return offset is not None and abs(offset[0]) <= most[0] and abs(offset[1]) <= most[1]


def beside(
    prediction: Prediction, tai_s: float, offset: tuple[float, float], *, pace: float = 0.0, follow: bool = False
) -> Pointing | None:
    """The direction so many (seconds late, degrees right) beside the path; None where the buffer has none.

    pace: seconds by which the first of them grows in a second; its motion is in the rates.
    """
    along_s, across_deg = offset
    before = _place(prediction, tai_s - RATE_SPAN_S, along_s - pace * RATE_SPAN_S, across_deg, follow=follow)
    here = _place(prediction, tai_s, along_s, across_deg, follow=follow)
    after = _place(prediction, tai_s + RATE_SPAN_S, along_s + pace * RATE_SPAN_S, across_deg, follow=follow)
    if here is None:
        return None
    first, last = before or here, after or here
    span_s = RATE_SPAN_S * ((before is not None) + (after is not None)) or 1.0
    return Pointing(here[0], here[1], wrap_180(last[0] - first[0]) / span_s, (last[1] - first[1]) / span_s)


def _place(
    prediction: Prediction, tai_s: float, along_s: float, across_deg: float, *, follow: bool
) -> tuple[float, float] | None:
    point = prediction.at(tai_s - along_s, follow=follow)
    if point is None or not point.is_finite:
        return None
    east, up, speed = _motion(point)
    right, upward = across_deg * up / speed, -across_deg * east / speed
    if prediction.late_drift_deg_s is not None:
        index = round((tai_s - along_s - prediction.start_tai_s) / prediction.step_s)
        index = min(max(index, 0), prediction.el_deg.size - 1)
        right += along_s * float(prediction.late_drift_deg_s[0, index])
        upward += along_s * float(prediction.late_drift_deg_s[1, index])
    return _moved(point.az_deg, point.el_deg, right, upward) if isfinite(right + upward) else None


def _motion(point: Pointing) -> tuple[float, float, float]:
    """Degrees a second on the sky to the right (azimuth rising), upward, and both together."""
    east, up = point.az_rate_deg_s * cos(radians(point.el_deg)), point.el_rate_deg_s
    return east, up, hypot(east, up) or 1.0


def _moved(az_deg: float, el_deg: float, right_deg: float, up_deg: float) -> tuple[float, float]:
    """Go along a great circle; the azimuth stays continuous, and a plunged antenna plunged."""
    angle_deg = hypot(right_deg, up_deg)
    if angle_deg == 0.0:
        return az_deg, el_deg
    far, el = radians(angle_deg), radians(el_deg)
    right, up = sin(far) * right_deg / angle_deg, sin(far) * up_deg / angle_deg
    forward = cos(el) * cos(far) - sin(el) * up
    high = sin(el) * cos(far) + cos(el) * up
    high_deg = degrees(asin(min(1.0, max(-1.0, high))))
    if el_deg > 90.0:
        return az_deg + degrees(atan2(-right, -forward)), 180.0 - high_deg
    return az_deg + degrees(atan2(right, forward)), high_deg


def offset_of(prediction: Prediction, tai_s: float, az_deg: float, el_deg: float) -> tuple[float, float] | None:
    """The offset at which a direction lies, or as near as the buffer reaches; None outside the buffer."""
    along_s, across_deg = 0.0, 0.0
    for _ in range(ROUNDS):
        place = _place(prediction, tai_s, along_s, across_deg, follow=False)
        point = prediction.at(tai_s - along_s)
        if place is None or point is None:
            break
        right_deg, up_deg = _between(place, az_deg, el_deg)
        east, up, speed = _motion(point)
        across_deg += (right_deg * up - up_deg * east) / speed
        if speed >= SLOWEST_DEG_S:
            along_s -= (right_deg * east + up_deg * up) / speed**2
    is_known = prediction.at(tai_s) is not None and isfinite(along_s) and isfinite(across_deg)
    return (along_s, across_deg) if is_known else None


def _between(place: tuple[float, float], az_deg: float, el_deg: float) -> tuple[float, float]:
    """From a place to a direction: degrees to the right and up, in the plane that touches the sky at the place."""
    d_az, el0, el = radians(az_deg - place[0]), radians(place[1]), radians(el_deg)
    right = cos(el) * sin(d_az)
    up = sin(el) * cos(el0) - cos(el) * sin(el0) * cos(d_az)
    forward = sin(el) * sin(el0) + cos(el) * cos(el0) * cos(d_az)
    far = hypot(right, up)
    scale = degrees(atan2(far, forward)) / far if far > 0.0 else 0.0
    return right * scale, up * scale
