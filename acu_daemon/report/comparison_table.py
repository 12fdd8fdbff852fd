"""Estimators side by side on one recording, as a table for people and a picture."""

from datetime import datetime
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.dates import DateFormatter, date2num
from matplotlib.figure import Figure

from acu_daemon.assist.session.estimator_comparison import Comparison, Errors, what_is_left_out
from acu_daemon.model import FitResult
from acu_daemon.orbit.timescales import utc_text
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
    strays = (
        f"  Not compared: {seen.stray_count} without lock while the antenna stood, or moved unlike the path."
        if seen.stray_count
        else ""
    )
    if seen.line_count == 0:
        return f"Nothing to compare: no reading with angles after the first fit.{strays}"
    if seen.is_held_back:
        return (
            f"Prediction against {seen.line_count} readings without lock, held back from the fits "
            f"(right only where their angles are the satellite's).{strays}"
        )
    return f"Prediction up to a second ahead against {seen.line_count} locked readings, their noise included.{strays}"


def _shift(fit: FitResult | None) -> str:
    if fit is None:
        return "none"
    return f"{abs(fit.along_s):.3f} s {'late' if fit.along_s >= 0 else 'early'}, {fit.across_deg:+.4f} deg across"


def plot(path: Path, seen: Comparison, title: str) -> None:
    """Draw the error over time of each estimator; writes a PNG."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure = Figure(figsize=(10.0, 5.0), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    for spans, shade, label in (
        (seen.losses_tai_s, "#f3e3c3", "no signal"),
        (seen.strays_tai_s, "#e7c9a9", "the antenna does not follow the path: not compared"),
        (seen.gaps_tai_s, "#dddddd", "no readings: the daemon was stopped"),
    ):
        for k, span in enumerate(spans):
            begin, end = map(_date, span)
            axes.axvspan(begin, end, color=shade, label=label if k == 0 else None, zorder=0)
    has_any = False
    for colour, (name, errors) in zip(_COLOURS, seen.errors.items(), strict=False):
        parts: list[tuple[Errors, str | None]] = [(errors, name)]
        if seen.is_held_back:
            parts.append((seen.tracked[name], None))
        for part, shown in parts:
            if not part.tai_s.size:
                continue
            has_any = True
            error_deg = np.maximum(part.error_deg, FLOOR_DEG)
            dates = [_date(tai_s) for tai_s in part.tai_s.tolist()]
            axes.semilogy(dates, error_deg, ".", markersize=2.5, alpha=0.25, color=colour, markeredgewidth=0.0)
            times, medians = _medians(part.tai_s, error_deg)
            axes.semilogy([_date(one) for one in times], medians, linewidth=1.6, color=colour, label=shown)
    figure.suptitle(title, fontsize=12, fontweight="bold")
    axes.set_title(what_is_compared(seen).replace(".  ", ".\n"), fontsize=9)
    axes.xaxis_date()  # round times at the ticks
    axes.xaxis.set_major_formatter(DateFormatter("%H:%M:%S"))  # type: ignore[no-untyped-call]
    axes.set_xlabel("UTC")
    axes.set_ylabel("prediction against reading, deg on the sky")
    axes.grid(alpha=0.3, which="major")
    if has_any:
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", frameon=False, ncols=4)
    figure.savefig(path, format="png")


def _date(tai_s: float) -> float:
    """Days, as the axis counts them; a leap second has no place there."""
    return float(date2num(datetime.fromisoformat(utc_text(tai_s, 6).replace(":60", ":59"))))  # type: ignore[no-untyped-call]


def _medians(time_s: Array, error_deg: Array) -> tuple[list[float], list[float]]:
    """Medians of some forty equal parts, at their medium times."""
    count = min(_PARTS, time_s.size)
    times, errors = ([float(np.median(part)) for part in np.array_split(one, count)] for one in (time_s, error_deg))
    return times, errors
