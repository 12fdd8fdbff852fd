"""The sky over the station: skyline, keep-out zones, where the sun goes meanwhile, and passes through all of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from acu_daemon.pointing.envelope import Envelope
from acu_daemon.units import Array

HILL, ZONE, SUN = "#b8a98c", "#c8553d", "#e0b13a"
AROUND_DEG = np.arange(0.0, 361.0, 1.0)
LOWEST_EL_DEG = -5.0
ZONE_STEP_DEG = 0.5
SUN_STEP_S = 300.0


@dataclass(frozen=True, slots=True)
class SkyTrack:
    """A pass as it is seen: times, azimuths and apparent elevations (N,), degrees; what the legend calls it."""

    label: str
    tai_s: Array
    az_deg: Array
    el_deg: Array


def plot_sky(path: Path, envelope: Envelope, tracks: Sequence[SkyTrack], lowest_deg: float, title: str) -> None:
    """Draw them on one polar plot, north up, the zenith in the middle; the file's ending says what kind of picture."""
    mpl.rcParams.update({"font.size": 9})
    figure = Figure(figsize=(8.0, 8.4), dpi=120, layout="constrained")
    figure.suptitle(title, fontsize=12, fontweight="bold")
    axes = figure.add_subplot(projection="polar")
    if not isinstance(axes, PolarAxes):
        raise TypeError("the sky needs polar axes")
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_rlim(0.0, 90.0 - LOWEST_EL_DEG)
    axes.set_rticks([30.0, 60.0, 90.0])
    axes.set_yticklabels(["60°", "30°", "0°"], fontsize=7, color="#666666")
    axes.set_xticks(np.radians([0, 90, 180, 270]))
    axes.set_xticklabels(["N", "E", "S", "W"])
    axes.grid(alpha=0.3)
    _draw_ground(axes, envelope, lowest_deg)
    _draw_zones(axes, envelope)
    _draw_sun(axes, envelope, tracks)
    for track in tracks:
        [line] = axes.plot(np.radians(track.az_deg), 90.0 - track.el_deg, linewidth=1.4, label=track.label)
        axes.plot(np.radians(track.az_deg[:1]), 90.0 - track.el_deg[:1], "o", color=line.get_color(), markersize=4)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.05), ncols=2, frameon=False, fontsize=8)
    figure.savefig(path)


def _draw_ground(axes: Axes, envelope: Envelope, lowest_deg: float) -> None:
    heights = np.full_like(AROUND_DEG, lowest_deg)
    label = f"below {lowest_deg:g}°"
    if envelope.skyline is not None:
        heights = np.maximum(heights, envelope.skyline.heights_deg(AROUND_DEG))
        label = f"behind the mask, or below {lowest_deg:g}°"
    axes.fill_between(
        np.radians(AROUND_DEG), 90.0 - heights, 90.0 - LOWEST_EL_DEG, color=HILL, alpha=0.6, linewidth=0, label=label
    )


def _draw_zones(axes: Axes, envelope: Envelope) -> None:
    for zone in envelope.keep_outs:
        middle_deg, half_deg, low_deg, high_deg = zone.box_deg(0.0)
        half_deg = min(half_deg, 180.0)
        around = np.radians(np.arange(middle_deg - half_deg, middle_deg + half_deg + ZONE_STEP_DEG, ZONE_STEP_DEG))
        outer = 90.0 - max(low_deg, LOWEST_EL_DEG)
        axes.fill_between(around, 90.0 - high_deg, outer, color=ZONE, alpha=0.35, linewidth=0, label=zone.name)


def _draw_sun(axes: Axes, envelope: Envelope, tracks: Sequence[SkyTrack]) -> None:
    """Its disc at the middle of each pass, and its way over all of them."""
    sun = envelope.sun
    if sun is None or not tracks:
        return
    first, last = min(float(one.tai_s[0]) for one in tracks), max(float(one.tai_s[-1]) for one in tracks)
    way = [sun.direction_deg(tai_s) for tai_s in np.arange(first, last + SUN_STEP_S, SUN_STEP_S).tolist()]
    up = [(az_deg, el_deg) for az_deg, el_deg in way if el_deg > LOWEST_EL_DEG]
    axes.plot(np.radians([az for az, _ in up]), [90.0 - el for _, el in up], ".", color=SUN, markersize=2)
    label = f"the sun in each pass, {sun.radius_deg:g}° ({sun.policy})"
    for track in tracks:
        disc = sun.at(float(track.tai_s[track.tai_s.size // 2]))
        if disc.el_deg > LOWEST_EL_DEG:
            rim = [disc.at(float(angle_deg), 0.0) for angle_deg in range(0, 361, 5)]
            axes.fill(
                [np.radians(az) for az, _ in rim], [90.0 - el for _, el in rim], color=SUN, alpha=0.5, label=label
            )
            label = "_nolegend_"
