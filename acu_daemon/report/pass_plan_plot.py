"""The picture of a planned pass: the sky with what stands around, both axes with their limits, the expected error."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from acu_daemon.model import AxisLimits
from acu_daemon.units import Array

PATH, ANTENNA, LIMIT, HILL, SUN = "#9aa5b1", "#0b6e4f", "#c8553d", "#d9d2c5", "#e0b13a"
FLOOR_DEG = 1e-3  # of the logarithmic scale
ZENITH = "zenith"  # the name of the span in which it is crossed
NOTABLE_DEG, LEAST_REACH_DEG, JUMP_DEG, WIDE = 0.02, 2.0, 90.0, 1.4


@dataclass(frozen=True, slots=True)
class PlannedPicture:
    """What is drawn: path and antenna over seconds from the plan's start, degrees, (N,); azimuths continuous.

    sky_path_deg, sky_antenna_deg: where both point on the sky, azimuth and elevation of at most 90 deg, each (N,).
    hills: azimuth and elevation of the skyline, both (M,), in the order of the azimuth.  keyhole: the rim, as the
    skyline, within which the azimuth drive cannot follow; None: it can everywhere.  spans: name, begin and end, s, of
    what is shaded.
    """

    seconds: Array
    path_az_deg: Array
    path_el_deg: Array
    antenna_az_deg: Array
    antenna_el_deg: Array
    off_deg: Array
    sky_path_deg: tuple[Array, Array]
    sky_antenna_deg: tuple[Array, Array]
    azimuth: AxisLimits
    elevation: AxisLimits
    half_beam_deg: float
    min_elevation_deg: float
    hills: tuple[Array, Array] | None
    sun_deg: tuple[float, float, float] | None  # azimuth, elevation, radius kept clear
    keyhole: tuple[Array, Array] | None
    spans: Sequence[tuple[str, float, float]]
    begins: str  # UTC of the plan's start


def plot_plan(path: Path, planned: PlannedPicture, title: str) -> None:
    """Draw into a PNG, SVG or PDF."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    near = _near_zenith(planned)
    figure = Figure(figsize=(13.0, 6.8 if near is None else 8.6), dpi=120, layout="constrained")
    figure.suptitle(title, fontsize=12, fontweight="bold")
    left, right = np.asarray(figure.subfigures(1, 2, width_ratios=(1.0, 1.5))).tolist()
    skies = left.add_gridspec(1 if near is None else 2, 1, height_ratios=(1.0,) if near is None else (1.35, 1.0))
    _draw_sky(left.add_subplot(skies[0], projection="polar"), planned)
    if near is not None:
        _draw_zenith(left.add_subplot(skies[1]), planned, near)
    grid = right.add_gridspec(3, 1)
    first = right.add_subplot(grid[0])
    others = [right.add_subplot(grid[k], sharex=first) for k in (1, 2)]
    _draw_axis(first, planned, planned.path_az_deg, planned.antenna_az_deg, planned.azimuth, "azimuth, deg")
    _draw_axis(others[0], planned, planned.path_el_deg, planned.antenna_el_deg, planned.elevation, "elevation, deg")
    _draw_error(others[1], planned)
    first.legend(loc="best", frameon=False, fontsize=8)
    figure.savefig(path)


def _draw_sky(axes: Axes, planned: PlannedPicture) -> None:
    if not isinstance(axes, PolarAxes):
        raise TypeError("the sky needs polar axes")
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    circle = np.radians(np.linspace(0.0, 360.0, 361))
    if planned.hills is not None:
        az_deg, el_deg = planned.hills
        axes.fill_between(np.radians(az_deg), 90.0 - el_deg, 90.0, color=HILL, label="mask")
    axes.plot(circle, np.full(361, 90.0 - planned.min_elevation_deg), color=LIMIT, linewidth=0.8, linestyle=":")
    if planned.keyhole is not None:
        axes.fill(np.radians(planned.keyhole[0]), 90.0 - planned.keyhole[1], color=LIMIT, alpha=0.35, label="keyhole")
    if planned.sun_deg is not None and planned.sun_deg[1] > -planned.sun_deg[2]:
        _draw_sun(axes, planned.sun_deg)
    (path_az, path_el), (az, el) = planned.sky_path_deg, planned.sky_antenna_deg
    axes.plot(np.radians(path_az), 90 - path_el, color=PATH, linewidth=6, alpha=0.6)
    axes.plot(np.radians(az), 90 - el, color=ANTENNA, linewidth=1.4)
    minutes = np.searchsorted(planned.seconds, np.arange(60.0, float(planned.seconds[-1]), 60.0))
    axes.plot(
        np.radians(path_az[minutes]), 90 - path_el[minutes], ".", color=ANTENNA, markersize=5, label="each minute"
    )
    axes.plot(np.radians(path_az[:1]), 90 - path_el[:1], "o", color=ANTENNA, label="begins")
    axes.set_rlim(0, 90)
    axes.set_rticks([30.0, 60.0, 90.0])
    axes.set_yticklabels(["60°", "30°", ""], fontsize=7, color="#666666")
    axes.set_xticks(np.radians([0, 90, 180, 270]))
    axes.set_xticklabels(["N", "E", "S", "W"])
    axes.grid(alpha=0.3)
    axes.set_title("Sky (centre = zenith; dotted: lowest elevation)", fontsize=9)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.22), frameon=False, ncols=4, fontsize=8)


def _near_zenith(planned: PlannedPicture) -> tuple[float, slice] | None:
    """Degrees about the zenith that are worth a picture of their own, and the samples within; None: none are."""
    is_off = planned.off_deg > NOTABLE_DEG
    if not any(name == ZENITH for name, _, _ in planned.spans) or not bool(is_off.any()):
        return None
    reach_deg = max(LEAST_REACH_DEG, 1.2 * float((90.0 - planned.sky_path_deg[1][is_off]).max()))
    inside = np.flatnonzero(90.0 - planned.sky_path_deg[1] < 1.5 * reach_deg)
    return reach_deg, slice(int(inside[0]), int(inside[-1]) + 1)


def _draw_zenith(axes: Axes, planned: PlannedPicture, near: tuple[float, slice]) -> None:
    """The sky about the zenith, north up: the path, the antenna's way, and the beam where it is farthest off."""
    reach_deg, part = near
    (path_x, path_y), (x, y) = (
        _from_zenith(az[part], el[part]) for az, el in (planned.sky_path_deg, planned.sky_antenna_deg)
    )
    axes.plot(path_x, path_y, color=PATH, linewidth=4, alpha=0.6)
    axes.plot(x, y, color=ANTENNA, linewidth=1.3)
    seconds = np.searchsorted(planned.seconds[part], np.arange(*np.ceil(planned.seconds[part][[0, -1]])))
    for k in seconds[seconds < x.size].tolist():
        axes.plot([x[k], path_x[k]], [y[k], path_y[k]], color=LIMIT, linewidth=0.6)
    worst = int(np.argmax(planned.off_deg[part]))
    around = np.radians(np.linspace(0.0, 360.0, 73))
    beam = planned.half_beam_deg
    axes.fill(x[worst] + beam * np.sin(around), y[worst] + beam * np.cos(around), color=ANTENNA, alpha=0.15)
    axes.plot([0.0], [0.0], "+", color="#666666")
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(-WIDE * reach_deg, WIDE * reach_deg)
    axes.set_ylim(-reach_deg, reach_deg)
    axes.set_xlabel("east, deg")
    axes.set_ylabel("north, deg")
    axes.grid(alpha=0.3)
    axes.set_title("About the zenith: the error each second, the beam where it is largest", fontsize=9)


def _from_zenith(az_deg: Array, el_deg: Array) -> tuple[Array, Array]:
    """East and north of the zenith, degrees."""
    return (90.0 - el_deg) * np.sin(np.radians(az_deg)), (90.0 - el_deg) * np.cos(np.radians(az_deg))


def _unbroken(az_deg: Array) -> Array:
    """The same, with nothing drawn where it jumps: over the top the path's azimuth is half a turn further at once."""
    broken = az_deg.copy()
    broken[1:][np.abs(np.diff(az_deg)) > JUMP_DEG] = np.nan
    return broken


def _draw_sun(axes: Axes, sun_deg: tuple[float, float, float]) -> None:
    """The sun, and the disc that is kept clear of it, as its edge is seen in this projection."""
    az, el, radius = np.radians(sun_deg)
    around = np.linspace(0.0, 2.0 * np.pi, 73)
    up = np.sin(el) * np.cos(radius) + np.cos(el) * np.sin(radius) * np.cos(around)
    side = np.sin(radius) * np.sin(around)
    forward = np.cos(el) * np.cos(radius) - np.sin(el) * np.sin(radius) * np.cos(around)
    edge_el = np.degrees(np.arcsin(np.clip(up, -1.0, 1.0)))
    axes.fill(az + np.arctan2(side, forward), 90.0 - edge_el, color=SUN, alpha=0.4)
    if el > 0.0:
        axes.plot([az], [90.0 - sun_deg[1]], "*", color=SUN, markersize=12, label="sun")


def _draw_axis(
    axes: Axes, planned: PlannedPicture, path_deg: Array, antenna_deg: Array, limits: AxisLimits, label: str
) -> None:
    axes.plot(planned.seconds, _unbroken(path_deg), color=PATH, linewidth=4, alpha=0.6, label="path")
    axes.plot(planned.seconds, antenna_deg, color=ANTENNA, linewidth=1.3, label="antenna")
    low_deg, high_deg = axes.get_ylim()
    for end_deg in (limits.min_deg, limits.max_deg):
        if low_deg - 60.0 <= end_deg <= high_deg + 60.0:
            axes.axhline(end_deg, color=LIMIT, linewidth=1.0, linestyle="--", label="limit")
    handles, labels = axes.get_legend_handles_labels()
    for again in handles[labels.index("limit") + 1 :] if "limit" in labels else []:
        again.set_label("_limit")
    axes.set_ylabel(label)
    axes.tick_params(labelbottom=False)
    axes.grid(alpha=0.3)
    _shade(axes, planned)


def _draw_error(axes: Axes, planned: PlannedPicture) -> None:
    axes.semilogy(planned.seconds, np.maximum(planned.off_deg, FLOOR_DEG), color=ANTENNA, linewidth=1.3)
    axes.axhline(planned.half_beam_deg, color=LIMIT, linewidth=1.0, linestyle="--")
    axes.text(0.0, planned.half_beam_deg * 1.15, "half a beam", color=LIMIT, fontsize=8)
    axes.set_ylim(FLOOR_DEG, max(10.0, 2.0 * float(planned.off_deg.max())))
    axes.set_ylabel("expected beam error, deg")
    axes.set_xlabel(f"seconds from {planned.begins}")
    axes.grid(alpha=0.3)
    _shade(axes, planned)


def _shade(axes: Axes, planned: PlannedPicture) -> None:
    for _, begin_s, end_s in planned.spans:
        axes.axvspan(begin_s, end_s, color=SUN, alpha=0.25, linewidth=0.0)
