"""Estimators side by side on one recording, as a table for people and a picture."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from acu_daemon.control.comparison import Comparison, what_is_left_out
from acu_daemon.model import FitResult
from acu_daemon.units import Array

FLOOR_DEG = 1e-4  # of the logarithmic scale
_COLOURS = ("#c8553d", "#e0b13a", "#3d7ea6", "#0b6e4f", "#8c2f39", "#555555", "#b7b7d7")  # one for each estimator
_PARTS = 40


def table(seen: Comparison, seconds: dict[str, float]) -> list[str]:
    """Lines of text; seconds: what each estimator's replay took."""
    lines = [
        what_is_compared(seen),
        "",
        f"{'estimator':14}{'median deg':>12}{'95 % deg':>12}{'worst deg':>12}   {'last fit':32}{'replay s':>9}",
    ]
    for name, errors in seen.errors.items():
        figures = (
            [f"{value:12.4f}" for value in (*np.percentile(errors.error_deg, (50, 95)), errors.error_deg.max())]
            if errors.error_deg.size
            else [f"{'-':>12}"] * 3
        )
        lines.append(f"{name:14}{''.join(figures)}   {_shift(seen.last_fit[name]):32}{seconds[name]:9.2f}")
    lines += ["", "readings left out of the fits"]
    lines += [f"{name:14}  {what_is_left_out(counts)}" for name, counts in seen.left_out.items()]
    return lines


def what_is_compared(seen: Comparison) -> str:
    """One sentence on the readings behind the figures."""
    if seen.line_count == 0:
        return "Nothing to compare: no reading with angles after the first fit."
    if seen.is_held_back:
        return (
            f"Prediction against {seen.line_count} readings without lock, held back from the fits "
            "(right only where their angles are the satellite's)."
        )
    return f"Prediction up to a second ahead against {seen.line_count} locked readings, their noise included."


def _shift(fit: FitResult | None) -> str:
    if fit is None:
        return "none"
    return f"{abs(fit.along_s):.3f} s {'late' if fit.along_s >= 0 else 'early'}, {fit.across_deg:+.4f} deg across"


def plot(path: Path, seen: Comparison, title: str) -> None:
    """Draw the error over time of each estimator; writes a PNG."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(10.0, 5.0), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    starts = [float(errors.tai_s[0]) for errors in seen.errors.values() if errors.tai_s.size]
    for colour, (name, errors) in zip(_COLOURS, seen.errors.items(), strict=False):
        if errors.tai_s.size:
            time_s, error_deg = errors.tai_s - min(starts), np.maximum(errors.error_deg, FLOOR_DEG)
            axes.semilogy(time_s, error_deg, ".", markersize=2.5, alpha=0.25, color=colour, markeredgewidth=0.0)
            axes.semilogy(*_medians(time_s, error_deg), linewidth=1.6, color=colour, label=name)
    figure.suptitle(title, fontsize=12, fontweight="bold")
    axes.set_title(what_is_compared(seen), fontsize=9)
    axes.set_xlabel("seconds")
    axes.set_ylabel("prediction against reading, deg on the sky")
    axes.grid(alpha=0.3, which="major")
    if starts:
        axes.legend(frameon=False, ncols=3, title="medians of short spans")
    figure.savefig(path, format="png")


def _medians(time_s: Array, error_deg: Array) -> tuple[list[float], list[float]]:
    """Medians of some forty equal parts, at their medium times."""
    count = min(_PARTS, time_s.size)
    times, errors = ([float(np.median(part)) for part in np.array_split(one, count)] for one in (time_s, error_deg))
    return times, errors
