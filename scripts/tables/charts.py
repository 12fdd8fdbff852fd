"""Pictures of the reproduced tables and figures."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acu_daemon.units import Array
from tables.rows import Row
from tables.true_pass import TruePass

COLOURS = {"full": "#0b6e4f", "deterministic": "#c8553d", "kalman": "#3d7ea6", "circular": "#8a6fb0"}
_OTHER = "#7a8794"
_SEED_MARKS = {"deterministic": ("deterministic_deg", "D"), "kalman": ("kalman_deg", "s")}
Curves = dict[str, list[tuple[Array, Array]]]


def plot_rows(path: Path, rows: list[Row], methods: tuple[str, ...], run_count: int) -> None:
    """Median and 5-95 % of every method and row, the papers' figures and the bound; writes a PNG."""
    figure = _figure((10.5, 0.62 * len(rows) + 1.6))
    axes = figure.add_subplot()
    lanes = np.linspace(-0.27, 0.27, len(methods))
    for k, row in enumerate(rows):
        if k % 2:
            axes.axhspan(k - 0.5, k + 0.5, color="#f1f3f5", zorder=0)
        for lane, name in zip(lanes, methods, strict=True):
            one, y = row.methods[name], k + lane
            label = f"{name}: median, 5-95 % of {run_count} runs" if k == 0 else None
            axes.plot([one.p05_deg, one.p95_deg], [y, y], color=COLOURS.get(name, _OTHER), linewidth=3.5, alpha=0.45)
            axes.plot(one.median_deg, y, "o", color=COLOURS.get(name, _OTHER), markersize=5, label=label)
            if name in _SEED_MARKS:
                figure_name, marker = _SEED_MARKS[name]
                label = f"{name}, as the paper prints" if k == 0 else None
                value = getattr(row.seed, figure_name)
                axes.plot(value, y, marker, color="none", markeredgecolor="black", markersize=6, label=label, zorder=5)
        label = "Cramér-Rao bound" if k == 0 else None
        axes.plot([row.bound_deg] * 2, [k - 0.42, k + 0.42], color="#666666", linewidth=1.3, label=label)
    axes.set_xscale("log")
    ticks = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.grid(axis="x", color="#dddddd")
    axes.set_yticks(
        range(len(rows)), [f"{row.seed_pass.station} {row.seed_pass.label}, {row.seed.used_s} s" for row in rows]
    )
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("largest error over the predicted rest of the pass, degrees")
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=3, frameon=False, fontsize=8)
    figure.savefig(path)


def plot_figures_5(path: Path, true_pass: TruePass, curves: Curves, used_s: int) -> None:
    """Figures 5.2-5.7 of Kuga and Carrara 1988: eps, azimuth, elevation errors over time, by method; writes a PNG."""
    figure = _figure((10.5, 8.4))
    grid = figure.subplots(3, len(curves), sharex=True, sharey="row", squeeze=False)
    minutes = (true_pass.tai_s - true_pass.tai_s[0]) / 60.0
    number = 2
    for column, (name, runs) in enumerate(curves.items()):
        az, el = (np.array([run[k] for run in runs]) for k in (0, 1))
        panels = (("eps", np.hypot(az, el)), ("azimuth", az), ("elevation", el))
        for line, (what, values) in enumerate(panels):
            axes = grid[line, column]
            _draw_spread(axes, minutes, values, COLOURS[name])
            axes.axvline(used_s / 60.0, color="#888888", linewidth=0.8, linestyle="--")
            axes.set_title(f"figure 5.{number}: {name}, {what}", fontsize=9, loc="left")
            number += 1
    for axes, what in zip(grid[:, 0], ("eps", "error in azimuth", "error in elevation"), strict=True):
        axes.set_ylabel(f"{what}, degrees")
    grid[0, 0].set_ylim(0.0, 1.2)
    for axes in grid[-1]:
        axes.set_xlabel("minutes since 5° of elevation")
    grid[0, -1].legend(loc="upper right", frameon=False, fontsize=8)
    figure.suptitle(
        f"{true_pass.seed.station}, pass {true_pass.seed.label}: readings until the dashed line, then prediction",
        fontsize=11,
    )
    figure.savefig(path)


def _draw_spread(axes: Axes, x: Array, values: Array, colour: str) -> None:
    low, middle, high = np.percentile(values, (5.0, 50.0, 95.0), axis=0)
    axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0.0, label="5-95 % of the runs")
    axes.plot(x, middle, color=colour, linewidth=0.8, linestyle=":", label="median")
    axes.plot(x, values[0], color=colour, linewidth=1.3, label="one run")
    axes.axhline(0.0, color="#aaaaaa", linewidth=0.6)
    axes.grid(color="#eeeeee")


def _figure(size: tuple[float, float]) -> Figure:
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    return Figure(figsize=size, dpi=100, layout="constrained")
