"""Pictures of the simulations of Aguirre and Medeiros 1988."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from tables.seed_001 import A_ERRORS_KM, I_ERRORS_DEG, LIMIT_DEG, LossTrial

_COLOURS = ("#c8553d", "#e0a13a", "#8a6fb0", "#3d7ea6", "#0b6e4f", "#111111", "#7a8794")
_STYLES = ("-", "-", "-", "-", "-", "--", "--")
_FLOOR_DEG = 1e-3
_OVERHEAD_PASS_DEG = 84.0


def plot_losses(path: Path, trials: dict[str, list[LossTrial]]) -> None:
    """Figures 2.1 and 2.2: worst error against the time after the loss, and against the elevation at the loss."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(10.5, 5.6), dpi=100, layout="constrained")
    by_time, by_elevation = figure.subplots(1, 2, sharey=True)
    for (name, found), colour, style in zip(trials.items(), _COLOURS, _STYLES, strict=True):
        longest = max(one.error_deg.size for one in found)
        worst = np.zeros(longest)
        for one in found:
            worst[: one.error_deg.size] = np.maximum(worst[: one.error_deg.size], one.error_deg)
        by_time.plot(np.arange(longest) / 60.0, worst, color=colour, linestyle=style, linewidth=1.4, label=name)
        overhead = [one for one in found if one.culmination_deg > _OVERHEAD_PASS_DEG]
        edges = np.arange(5.0, 176.0, 5.0)
        turned = np.array([one.el_deg if one.is_rising else 180.0 - one.el_deg for one in overhead])
        errors = np.array([one.worst_deg for one in overhead])
        bins = [errors[(turned >= low) & (turned < low + 5.0)] for low in edges]
        top = [float(one.max()) if one.size else np.nan for one in bins]
        by_elevation.plot(edges + 2.5, top, color=colour, linestyle=style, linewidth=1.4)
    for axes in (by_time, by_elevation):
        axes.axhline(LIMIT_DEG, color="#888888", linewidth=0.8, linestyle=":")
        axes.set_yscale("log")
        axes.set_ylim(_FLOOR_DEG, 3.0)
        axes.grid(color="#eeeeee")
    by_time.set_title("figure 2.1: any loss, any pass", fontsize=9, loc="left")
    by_time.set_xlabel("minutes after the loss")
    by_time.set_ylabel("largest pointing error, degrees on the sky")
    by_elevation.set_title("figure 2.2: passes overhead, until the set", fontsize=9, loc="left")
    ticks = (5, 30, 60, 90, 120, 150, 175)
    by_elevation.set_xticks(ticks, [f"{min(tick, 180 - tick)}°" for tick in ticks])
    by_elevation.set_xlabel("elevation at the loss, rising then setting")
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=8)
    figure.savefig(path)


def plot_sensitivity(path: Path, worst_deg: dict[str, tuple[list[float], list[float]]]) -> None:
    """2.4.3: worst error over a pass against the error of a (km) and of i (degrees), for each method."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(9.0, 4.4), dpi=100, layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for k, (axes, errors, unit) in enumerate(
        zip(panels, (A_ERRORS_KM, I_ERRORS_DEG), ("semi-major axis, km", "inclination, degrees"), strict=True)
    ):
        for (name, both), colour in zip(worst_deg.items(), (_COLOURS[0], _COLOURS[2], _COLOURS[4]), strict=True):
            axes.plot(errors, both[k], "o-", color=colour, markersize=4, label=name if k == 0 else None)
        axes.set_xscale("symlog", linthresh=errors[1])
        axes.set_xticks(errors, [f"{error:g}" for error in errors])
        axes.set_xticks([], minor=True)
        axes.set_yscale("log")
        axes.axhline(LIMIT_DEG, color="#888888", linewidth=0.8, linestyle=":")
        axes.grid(color="#eeeeee")
        axes.set_xlabel(f"error of the {unit}")
    panels[0].set_ylabel("largest error over the rest of a pass, degrees")
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    figure.savefig(path)
