"""One picture of a simulated pass: sky track, beam error over time, and who steered."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from acu_daemon.report.pass_trace import Trace
from acu_daemon.units import Array

ASSISTED, MEMORY, SKY = "#0b6e4f", "#c8553d", "#9aa5b1"
FLOOR_DEG = 1e-3  # of the logarithmic scale
MODE_COLOURS = {
    "AUTOTRACK": "#0b6e4f",
    "REMOTE_BACKUP": "#3d7ea6",
    "ACQUIRE": "#e0b13a",
    "REMOTE": "#b7b7d7",
    "RATE_MEMORY": "#c8553d",
    "POSITION_MEMORY": "#8c2f39",
    "STANDBY": "#dddddd",
}


def plot_passes(path: Path, traces: dict[str, Trace], beamwidth_deg: float, title: str) -> None:
    """Draw traces over the same sky, the assisted one first; writes a PNG.

    traces: label to trace, two at the most; all start near the same instant.
    """
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(12.5, 6.4), dpi=120, layout="constrained")
    figure.suptitle(title, fontsize=13, fontweight="bold")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.6), height_ratios=(2.6, 1.0))
    colours = dict(zip(traces, (ASSISTED, MEMORY), strict=False))
    start_tai_s = min(float(trace.tai_s[0]) for trace in traces.values())
    _draw_sky(figure.add_subplot(grid[:, 0], projection="polar"), traces, colours)
    error_axes = figure.add_subplot(grid[0, 1])
    _draw_error(error_axes, traces, colours, beamwidth_deg, start_tai_s)
    _draw_modes(figure.add_subplot(grid[1, 1], sharex=error_axes), traces, start_tai_s)
    figure.savefig(path)


def _draw_sky(axes: Axes, traces: dict[str, Trace], colours: dict[str, str]) -> None:
    if not isinstance(axes, PolarAxes):
        raise TypeError("the sky needs polar axes")
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    first = next(iter(traces.values()))
    axes.plot(np.radians(first.sat_az_deg), 90 - first.sat_el_deg, color=SKY, linewidth=6, alpha=0.6, label="satellite")
    for label, trace in traces.items():
        axes.plot(np.radians(trace.az_deg), 90 - trace.el_deg, color=colours[label], linewidth=1.4, label=label)
    lowest_deg = float(np.nanmin(first.sat_el_deg))
    reach = max(10.0, 10.0 * np.ceil((90.0 - lowest_deg) / 10.0))
    axes.set_rlim(0, reach)
    ticks = np.arange(10.0, reach + 1, 10.0)
    axes.set_rticks(ticks)
    axes.set_yticklabels([f"{90 - tick:.0f}°" for tick in ticks], fontsize=7, color="#666666")
    axes.set_xticks(np.radians([0, 90, 180, 270]))
    axes.set_xticklabels(["N", "E", "S", "W"])
    axes.grid(alpha=0.3)
    axes.set_title("Sky track (centre = zenith)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.24), frameon=False)


def _draw_error(
    axes: Axes, traces: dict[str, Trace], colours: dict[str, str], beamwidth_deg: float, start_tai_s: float
) -> None:
    first = next(iter(traces.values()))
    for k, (begin, end) in enumerate(_spans(first.tai_s - start_tai_s, first.is_on_air == 0)):
        axes.axvspan(begin, end, color="#f3e3c3", label="no signal (scenario)" if k == 0 else None, zorder=0)
    for label, trace in traces.items():
        error = np.maximum(np.nan_to_num(trace.error_deg, nan=np.nan), FLOOR_DEG)
        axes.semilogy(trace.tai_s - start_tai_s, error, color=colours[label], linewidth=1.2, label=label)
    axes.axhline(beamwidth_deg / 2, color="#444444", linestyle="--", linewidth=0.9, label="half-power beam")
    axes.set_ylim(FLOOR_DEG, 200.0)
    axes.set_ylabel("beam error, deg on the sky")
    axes.grid(alpha=0.3, which="major")
    axes.tick_params(labelbottom=False)
    axes.legend(loc="upper left", frameon=False, ncols=2)


def _draw_modes(axes: Axes, traces: dict[str, Trace], start_tai_s: float) -> None:
    shown: set[str] = set()
    for row, (label, trace) in enumerate(traces.items()):
        modes = np.array(trace.mode)
        for mode in dict.fromkeys(trace.mode):
            for begin, end in _spans(trace.tai_s - start_tai_s, modes == mode):
                axes.barh(
                    -row,
                    end - begin,
                    left=begin,
                    height=0.7,
                    color=MODE_COLOURS.get(mode, "#555555"),
                    label=None if mode in shown else mode.replace("_", " ").lower(),
                )
                shown.add(mode)
        axes.text(-0.01, -row, label, ha="right", va="center", transform=axes.get_yaxis_transform())
    axes.set_yticks([])
    axes.set_ylim(-len(traces) + 0.4, 0.6)
    axes.set_xlabel("seconds")
    axes.spines["left"].set_visible(False)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.35), ncols=4, frameon=False)


def _spans(time_s: Array, is_on: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_on, [False])).astype(int)))
    last = time_s.size - 1
    return [(float(time_s[i]), float(time_s[min(j, last)])) for i, j in zip(edges[::2], edges[1::2], strict=True)]
