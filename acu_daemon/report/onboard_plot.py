"""One picture of a tracking profile: angles in their bounds, rates of the methods, off-pointing, ground, margins."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acu_daemon.model import Station
from acu_daemon.onboard.cone import azimuth_tube, elevation_interval
from acu_daemon.onboard.ground import footprint_east_north_m, track_east_north_m
from acu_daemon.onboard.profile import Profile, Task, off_pointing, peak_rate_deg_s
from acu_daemon.onboard.relief import WIDEST_DEG, rate_against_margin
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

COLOURS = {"single": "#9aa5b1", "three": "#e0b13a", "search": "#3d7ea6", "free": "#0b6e4f"}
LABELS = {"single": "station", "three": "three stations", "search": "searching", "free": "free path"}
TUBE, PAIR, CAMERA = "#dce9e4", "#c8553d", "#f3e3c3"
MARGINS_DEG = np.linspace(0.25, 4.0, 16)
_LEAST_RATE = 1e-3  # of the logarithmic scale
_FAR = 2.0


def plot_profile(
    path: Path, label: str, station: Station, task: Task, chosen: Profile, profiles: Mapping[str, Profile]
) -> None:
    """Draw the chosen profile, and the rates of all; writes a PNG."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(13.5, 10.0), dpi=110, layout="constrained")
    start = utc_text(float(task.view.tai_s[0]), 0)
    figure.suptitle(
        f"{label} over {station.name}, {start}: {LABELS[chosen.method]}, margin {task.margin_deg:g}°",
        fontsize=13,
        fontweight="bold",
    )
    grid = figure.add_gridspec(1, 2, width_ratios=(1.7, 1.0))
    left, right = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    rows = left.subplots(4, 1, sharex=True)
    ground, margins = right.subplots(2, 1)
    _draw_azimuth(rows[0], task, chosen)
    _draw_elevation(rows[1], task, chosen)
    _draw_rates(rows[2], task, profiles)
    _draw_off_pointing(rows[3], task, profiles)
    for axes in rows:
        _draw_camera(axes, task)
        axes.grid(alpha=0.25)
        axes.label_outer()
    rows[0].legend(frameon=False, fontsize=8, loc="best")
    rows[3].set_xlabel(f"seconds since {start}")
    rows[3].set_xlim(0.0, float(task.view.time_s[-1]))
    _draw_ground(ground, task, chosen, station)
    _draw_margins(margins, task, profiles)
    figure.savefig(path)


def _draw_camera(axes: Axes, task: Task) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], task.imaging, [False]]).astype(int)))
    times = np.append(task.view.time_s, task.view.time_s[-1])
    for k, (start, end) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        label = "camera works" if k == 0 else None
        axes.axvspan(float(times[start]), float(times[end]), color=CAMERA, zorder=0, label=label)


def _draw_azimuth(axes: Axes, task: Task, profile: Profile) -> None:
    view = task.view.plan
    station = task.station_gimbal(view)
    azimuth = profile.azimuth.value(view.time_s)
    turns = 360.0 * np.round((azimuth - station.az_deg) / 360.0)
    tube = azimuth_tube(task.cone, view.time_s, station.az_deg + turns, station.el_deg)
    low, high = float(azimuth.min()) - 30.0, float(azimuth.max()) + 30.0
    axes.fill_between(
        view.time_s,
        np.maximum(tube.lower_deg, low),
        np.minimum(tube.upper_deg, high),
        color=TUBE,
        label="within margin",
    )
    is_jump = np.append(np.abs(np.diff(turns)) > 0.0, False)
    axes.plot(view.time_s, np.where(is_jump, np.nan, station.az_deg + turns), color=COLOURS["single"], label="station")
    axes.plot(view.time_s, azimuth, color=COLOURS[profile.method], linewidth=1.6, label=LABELS[profile.method])
    if profile.bound is not None and profile.bound.rate_deg_s > 0.0:
        bound = profile.bound
        times, angles = (bound.low_time_s, bound.high_time_s), (bound.low_deg, bound.high_deg)
        axes.plot(times, angles, "o--", color=PAIR, markersize=4, label=f"at least {bound.rate_deg_s:.3g}°/s")
    axes.set_ylim(low, high)
    axes.set_ylabel("azimuth, deg")


def _draw_elevation(axes: Axes, task: Task, profile: Profile) -> None:
    view = task.view.plan
    lower, upper = elevation_interval(task.cone, view.unit(task.station_itrs_m), profile.azimuth.value(view.time_s))
    axes.fill_between(view.time_s, lower, np.maximum(upper, lower), color=TUBE)
    axes.plot(view.time_s, task.station_gimbal(view).el_deg, color=COLOURS["single"])
    axes.plot(view.time_s, profile.elevation.value(view.time_s), color=COLOURS[profile.method], linewidth=1.6)
    axes.set_ylabel("elevation from axis, deg")


def _draw_rates(axes: Axes, task: Task, profiles: Mapping[str, Profile]) -> None:
    time_s = task.view.time_s
    for name, profile in profiles.items():
        rate = np.abs(profile.azimuth.value(time_s, 1))
        peak = peak_rate_deg_s(profile.azimuth, task.view)
        axes.semilogy(
            time_s,
            np.maximum(rate, _LEAST_RATE),
            color=COLOURS[name],
            label=f"{LABELS[name]} {peak:.3g}",
            linewidth=1.3,
        )
    if np.isfinite(task.azimuth.max_rate_deg_s):
        axes.axhline(task.azimuth.max_rate_deg_s, color=PAIR, linestyle=":", label="limit")
    axes.set_ylabel("azimuth rate, deg/s")
    axes.legend(frameon=False, fontsize=8, loc="best")


def _draw_off_pointing(axes: Axes, task: Task, profiles: Mapping[str, Profile]) -> None:
    time_s = task.view.time_s
    for name, profile in profiles.items():
        axes.plot(time_s, off_pointing(task, profile.gimbal(time_s), task.view), color=COLOURS[name], linewidth=1.2)
    axes.axhline(task.margin_deg, color=PAIR, linestyle="--", linewidth=1.0)
    axes.text(0.01, task.margin_deg, "margin", color=PAIR, va="bottom", transform=axes.get_yaxis_transform())
    axes.set_ylim(0.0, 1.15 * task.margin_deg)
    axes.set_ylabel("off-pointing, deg")


def _draw_ground(axes: Axes, task: Task, profile: Profile, station: Station) -> None:
    track = track_east_north_m(task, profile.gimbal(task.view.time_s), station) / 1e3
    nearest = int(np.argmin(np.linalg.norm(task.view.vectors_m(task.station_itrs_m), axis=1)))
    size = task.view.time_s.size
    rings: list[Array] = []
    for sample, alpha in ((nearest // 2, 0.35), (nearest, 1.0), ((nearest + size) // 2, 0.35)):
        ring = footprint_east_north_m(task, sample, station) / 1e3
        rings.append(ring)
        name = f"margin at {float(task.view.time_s[sample]):.0f} s"
        axes.plot(*ring.T, color=PAIR, alpha=alpha, linewidth=1.2, label=name)
        axes.plot(*track[sample], "o", color=PAIR, alpha=alpha, markersize=5)
    east, north = track.T
    label = f"beam, {LABELS[profile.method]}"
    drawn = axes.scatter(east, north, c=task.view.time_s, s=4, cmap="viridis", label=label)
    axes.figure.colorbar(drawn, ax=axes, label="seconds", shrink=0.8)
    axes.plot(0.0, 0.0, "k+", markersize=10)
    reach = 1.1 * float(np.nanmax(np.abs(np.concatenate(rings))))
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    axes.set_xlabel("km east of the station")
    axes.set_ylabel("km north")
    axes.set_title("Where the beam meets the ground", fontsize=10)
    axes.legend(frameon=False, fontsize=7, loc="upper left")


def _draw_margins(axes: Axes, task: Task, profiles: Mapping[str, Profile]) -> None:
    margins_deg = MARGINS_DEG * min(max(1.0, 1.2 * task.margin_deg / MARGINS_DEG[-1]), WIDEST_DEG / MARGINS_DEG[-1])
    axes.plot(margins_deg, rate_against_margin(task, margins_deg), color=COLOURS["free"], label="least possible")
    for name, profile in profiles.items():
        axes.plot(
            task.margin_deg, peak_rate_deg_s(profile.azimuth, task.view), "o", color=COLOURS[name], label=LABELS[name]
        )
    top = axes.get_ylim()[1]
    if np.isfinite(limit := task.azimuth.max_rate_deg_s):
        is_shown = limit < _FAR * top  # farther up it would press the rest to the axis
        label = "limit" if is_shown else f"limit {limit:g}, above"
        axes.axhline(limit, color=PAIR, linestyle=":", label=label)
        top = max(top, 1.05 * limit) if is_shown else top
    axes.set_ylim(0.0, top)
    axes.set_xlabel("margin, deg")
    axes.set_ylabel("largest azimuth rate, deg/s")
    axes.set_title("Rate against margin", fontsize=10)
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)
