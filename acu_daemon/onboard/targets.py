"""The preliminary profile by a target on the ground: the station, one of three, or the best of a search around it.

Song et al. 2016: operations choose of three stations, the centre and two virtual ones east-north-east and
west-south-west; the ground station searching method looks for the virtual station with the least largest
azimuth rate.  Distances, bearings and the grid are ours, the copy breaks off before them: docs/onboard.md.
"""

import numpy as np

from acu_daemon.model import Station
from acu_daemon.onboard.view import PassView, ground_points_itrs_m, off_pointing_deg
from acu_daemon.orbit.frames import station_itrs_m
from acu_daemon.units import DEG, Array

THREE_BEARINGS_DEG = np.array([67.5, 247.5])
THREE_RANGE_M = 670e3  # times the tangent of the margin: its footprint from overhead
_RANGE_SHARE = 0.977  # 670 km over KOMPSAT-3's least range
SEARCH_BEARINGS = 24
SEARCH_RINGS = 5
GUARD_DEG = 0.05  # of the margin, for the fit of polynomials and for what moves between the samples
_HALVINGS = 14
_COARSE = 4  # plan samples: 1 s; off-pointing is smooth
_FINE_SPAN_S = 3.0


def three_stations(view: PassView, station: Station, margin_deg: float) -> Array:
    """The centre and the two virtual stations, (3, 3), ITRS; nearer where the satellite comes nearer than KOMPSAT-3."""
    nearest_m = float(np.linalg.norm(station_itrs_m(station) - view.plan.satellite_itrs_m, axis=1).min())
    distance = np.full(2, min(THREE_RANGE_M, _RANGE_SHARE * nearest_m) * np.tan(margin_deg * DEG))
    return np.vstack([station_itrs_m(station), ground_points_itrs_m(station, THREE_BEARINGS_DEG, distance)])


def search_grid(view: PassView, station: Station, margin_deg: float) -> Array:
    """The searched stations (K, 3), ITRS: the three, then rings within the margin less its guard all the pass."""
    coarse = view.plan
    coarse = PassView(coarse.tai_s[::_COARSE], coarse.satellite_itrs_m[::_COARSE], coarse.gimbal_from_itrs[::_COARSE])
    bearings = np.arange(SEARCH_BEARINGS) * 360.0 / SEARCH_BEARINGS
    here = station_itrs_m(station)
    low, high = np.zeros(SEARCH_BEARINGS), np.full(SEARCH_BEARINGS, 4.0 * THREE_RANGE_M * np.tan(margin_deg * DEG))
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        off = off_pointing_deg(coarse, here, ground_points_itrs_m(station, bearings, middle)).max(axis=0)
        is_in = off <= margin_deg - GUARD_DEG
        low, high = np.where(is_in, middle, low), np.where(is_in, high, middle)
    rings = [ground_points_itrs_m(station, bearings, low * ring / SEARCH_RINGS) for ring in range(1, SEARCH_RINGS + 1)]
    return np.vstack([three_stations(view, station, margin_deg), *rings])


def peak_rates_deg_s(view: PassView, points_itrs_m: Array) -> Array:
    """The largest azimuth rate (K,) of pointing at each point (K, 3), to the view's samples.

    Every fourth of a second first, then all samples where that is near its largest.
    """
    rough = np.abs(view.plan.az_rates_deg_s(points_itrs_m))
    is_near = (rough > 0.5 * rough.max(axis=0)).any(axis=1)
    at_s = view.plan.time_s[is_near]
    wanted = np.searchsorted(at_s, view.time_s - _FINE_SPAN_S) < np.searchsorted(at_s, view.time_s + _FINE_SPAN_S)
    peaks = np.zeros(points_itrs_m.shape[0])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wanted, [False]]).astype(int)))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        part = PassView(view.tai_s[start:end], view.satellite_itrs_m[start:end], view.gimbal_from_itrs[start:end])
        peaks = np.maximum(peaks, np.abs(part.az_rates_deg_s(points_itrs_m)).max(axis=0))
    return peaks
