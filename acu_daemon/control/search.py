"""Where SEARCH looks: first along the track (seconds early and late), then across it (design section 4)."""

from math import cos, hypot, radians

from acu_daemon.model import AxisLimits, Pointing, Prediction

ALONG_SPEED_S_S = 0.5  # how fast the scan runs along the track: seconds of orbit per second
ACROSS_SPEED_DEG_S = 0.25


def search_offset(elapsed_s: float, search_s: float, along_s: float, across_deg: float) -> tuple[float, float]:
    """Offset of the scan (seconds along the track, late positive; degrees across, right positive).

    Along the track for the first half of search_s, swinging wider by a quarter of along_s each time; then across.
    """
    if elapsed_s < search_s / 2:
        return _widening(elapsed_s * ALONG_SPEED_S_S, along_s), 0.0
    return 0.0, _widening((elapsed_s - search_s / 2) * ACROSS_SPEED_DEG_S, across_deg)


def _widening(walked: float, limit: float) -> float:
    """Position after walking a path 0, +q, -q, +2q, -2q, ... +limit, -limit, 0 and again, q = limit / 4."""
    corners = [0.0] + [sign * limit * k / 4 for k in (1, 2, 3, 4) for sign in (1, -1)] + [0.0]
    total = sum(abs(b - a) for a, b in zip(corners, corners[1:], strict=False))
    if total <= 0.0:
        return 0.0
    rest = walked % total
    for a, b in zip(corners, corners[1:], strict=False):
        if rest <= abs(b - a):
            return a + rest * (1 if b > a else -1)
        rest -= abs(b - a)
    return 0.0


def search_pointing(
    prediction: Prediction,
    tai_s: float,
    offset: tuple[float, float],
    elevation: AxisLimits,
    mask_deg: float,
) -> Pointing | None:
    """The scan's direction at an instant: never below the horizon mask, never outside the elevation limits."""
    along_s, across_deg = offset
    point = prediction.at(tai_s - along_s, follow=True) or prediction.at(tai_s, follow=True)
    if point is None:
        return None
    cos_el = max(cos(radians(point.el_deg)), 0.02)
    east, up = point.az_rate_deg_s * cos_el, point.el_rate_deg_s
    speed = hypot(east, up) or 1.0
    az_deg = point.az_deg + across_deg * up / speed / cos_el
    el_deg = point.el_deg - across_deg * east / speed
    el_deg = min(max(el_deg, mask_deg, elevation.min_deg), elevation.max_deg)
    return Pointing(az_deg, el_deg, point.az_rate_deg_s, point.el_rate_deg_s)
