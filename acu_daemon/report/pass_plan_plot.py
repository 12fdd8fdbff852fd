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


@dataclass(frozen=True, slots=True)
class PlannedPicture:
    """What is drawn: path and antenna over seconds from the plan's start, degrees, (N,); azimuths continuous.

    hills: azimuth and elevation of the skyline, both (M,), in the order of the azimuth.  keyhole_deg: elevation above
    which the azimuth drive cannot follow, None: it can everywhere.  spans: name, begin and end, s, of what is shaded.
    """

    seconds: Array
    path_az_deg: Array
    path_el_deg: Array
    antenna_az_deg: Array
    antenna_el_deg: Array
    off_deg: Array
    azimuth: AxisLimits
    elevation: AxisLimits
    half_beam_deg: float
    min_elevation_deg: float
    hills: tuple[Array, Array] | None
    sun_deg: tuple[float, float, float] | None  # azimuth, elevation, radius kept clear
    keyhole_deg: float | None
    spans: Sequence[tuple[str, float, float]]
    begins: str  # UTC of the plan's start


def plot_plan(path: Path, planned: PlannedPicture, title: str) -> None:
    """Draw into a PNG, SVG or PDF."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(13.0, 6.8), dpi=120, layout="constrained")
    figure.suptitle(title, fontsize=12, fontweight="bold")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.0, 1.5))
    _draw_sky(figure.add_subplot(grid[:, 0], projection="polar"), planned)
    first = figure.add_subplot(grid[0, 1])
    others = [figure.add_subplot(grid[k, 1], sharex=first) for k in (1, 2)]
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
    if planned.keyhole_deg is not None:
        axes.fill(circle, np.full(361, 90.0 - planned.keyhole_deg), color=LIMIT, alpha=0.35, label="keyhole")
    if planned.sun_deg is not None and planned.sun_deg[1] > -planned.sun_deg[2]:
        _draw_sun(axes, planned.sun_deg)
    axes.plot(np.radians(planned.path_az_deg), 90 - planned.path_el_deg, color=PATH, linewidth=6, alpha=0.6)
    axes.plot(np.radians(planned.antenna_az_deg), 90 - planned.antenna_el_deg, color=ANTENNA, linewidth=1.4)
    axes.plot(np.radians(planned.path_az_deg[:1]), 90 - planned.path_el_deg[:1], "o", color=ANTENNA, label="begins")
    axes.set_rlim(0, 90)
    axes.set_rticks([30.0, 60.0, 90.0])
    axes.set_yticklabels(["60°", "30°", ""], fontsize=7, color="#666666")
    axes.set_xticks(np.radians([0, 90, 180, 270]))
    axes.set_xticklabels(["N", "E", "S", "W"])
    axes.grid(alpha=0.3)
    axes.set_title("Sky (centre = zenith; dotted: lowest elevation)", fontsize=9)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.16), frameon=False, ncols=4)


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
    axes.plot(planned.seconds, path_deg, color=PATH, linewidth=4, alpha=0.6, label="path")
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
