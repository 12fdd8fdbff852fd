"""Pictures of ground-track keeping."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acu_daemon.groundtrack.environment import EPOCH_TAI_S, STEP_S, Flux, even_steps
from acu_daemon.groundtrack.history import History
from acu_daemon.groundtrack.kinks import FoundManoeuvre
from acu_daemon.groundtrack.outlook import Outlook
from acu_daemon.groundtrack.simulate import CaseOutcome
from acu_daemon.orbit.timescales import unix_from_tai
from acu_daemon.units import DAY_S, Array

TRUE, SEEN, LIMIT, SIZE = "#0b6e4f", "#9aa5b1", "#c8553d", "#3d7ea6"
_SHOWN_STEPS = 20  # one in an hour


def plot_run(path: Path, outcome: CaseOutcome) -> None:
    """D over the year, and the manoeuvres below; writes a PNG."""
    figure = _figure((10.0, 6.0))
    case = outcome.case
    figure.suptitle(
        f"SIMULATION: {Path(case.profile).stem} profile, ±{case.band_m:g} m, controller {case.controller}, "
        f"{len(outcome.flown.manoeuvres)} manoeuvres (bound {outcome.bound_count:.1f})",
        fontweight="bold",
    )
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    draw_drift(above, outcome)
    draw_sizes(below, outcome)
    below.set_xlabel("days")
    _legend_below(figure, above)
    figure.savefig(path)


def plot_paper_run(path: Path, runs: dict[str, CaseOutcome], title: str) -> None:
    """D and sizes of several controllers over the same year, a column each; writes a PNG."""
    figure = _figure((5.2 * max(2, len(runs)), 5.6))
    figure.suptitle(f"SIMULATION, {title}", fontweight="bold")
    grid = figure.subplots(2, len(runs), sharex=True, squeeze=False, height_ratios=(2.0, 1.0))
    for column, (label, outcome) in enumerate(runs.items()):
        above, below = grid[:, column]
        above.set_title(f"{label}\n{len(outcome.flown.manoeuvres)} manoeuvres", fontsize=8)
        draw_drift(above, outcome)
        draw_sizes(below, outcome)
        below.set_xlabel("days")
    _legend_below(figure, grid[0, 0])
    figure.savefig(path)


def draw_drift(axes: Axes, outcome: CaseOutcome) -> None:
    """True D, D as seen behind it, and the band."""
    flown, thin = outcome.flown, slice(0, None, _SHOWN_STEPS)
    days = flown.times_s[thin] / DAY_S
    axes.plot(days, flown.seen_m[thin], color=SEEN, linewidth=0.6, label="as the navigator sees it")
    axes.plot(days, flown.d_m[thin], color=TRUE, linewidth=1.0, label="true")
    for limit_m in (-outcome.case.band_m, outcome.case.band_m):
        axes.axhline(limit_m, color=LIMIT, linewidth=0.8, linestyle="--")
    axes.set_ylabel("D, m (east positive)")


def draw_sizes(axes: Axes, outcome: CaseOutcome) -> None:
    """Sizes of the manoeuvres over time."""
    made = outcome.flown.manoeuvres
    axes.vlines([one.time_s / DAY_S for one in made], 0.0, [one.delta_a_m for one in made], color=SIZE, linewidth=1.4)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("Δa, m")


def plot_profiles(path: Path, profiles: dict[str, Flux], days: float) -> None:
    """Flux over the year (figure 3 of the paper); writes a PNG."""
    figure = _figure((9.0, 4.0))
    axes = figure.subplots()
    at_days = np.arange(0.0, days, 0.5)
    for (name, flux), colour in zip(profiles.items(), (TRUE, LIMIT, SIZE), strict=False):
        activity = flux.at(even_steps(EPOCH_TAI_S, DAY_S / 2.0, at_days.size))
        axes.plot(at_days, activity.f107, color=colour, linewidth=1.2, label=name)
        axes.plot(at_days, activity.f107_mean, color=colour, linewidth=0.8, linestyle=":")
    axes.axhspan(-100.0, 65.0, color="#eeeeee", zorder=0)
    axes.set_ylim(-80.0, 320.0)
    axes.set_xlabel("days")
    axes.set_ylabel("F10.7, sfu")
    axes.legend(fontsize=8, title="dotted: mean over 81 days\ngrey: no real sun", title_fontsize=7)
    figure.savefig(path)


def plot_windows(path: Path, raw_m: Sequence[float], smoothed: dict[str, Sequence[float]]) -> None:
    """Raw D and its smoothed values with a small and a big window (figure 2 of the paper); writes a PNG."""
    figure = _figure((9.0, 4.0))
    axes = figure.subplots()
    days = even_steps(0.0, STEP_S / DAY_S, len(raw_m))
    axes.plot(days, raw_m, ".", color=SEEN, markersize=1.5, label="raw")
    for (label, values), colour in zip(smoothed.items(), (SIZE, LIMIT, TRUE), strict=False):
        axes.plot(days, values, color=colour, linewidth=1.2, label=label)
    axes.set_xlabel("days")
    axes.set_ylabel("D, m")
    axes.legend(fontsize=8)
    figure.savefig(path)


def plot_history(path: Path, history: History, found: Sequence[FoundManoeuvre], title: str) -> None:
    """D of a real satellite over time, and the manoeuvres found in it; writes a PNG."""
    figure = _figure((10.0, 6.0))
    cycle = history.reference.cycle
    figure.suptitle(f"{title}: {cycle.revolutions} revolutions in {cycle.days} days", fontweight="bold")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    above.plot(dates(history.tai_s), history.d_m, ".-", color=TRUE, linewidth=0.8, markersize=3)
    above.set_ylabel("D, m (east positive, median 0)")
    when = dates(np.array([one.tai_s for one in found]))
    below.vlines(when, 0.0, [one.delta_a_m for one in found], color=SIZE, linewidth=1.4)
    below.axhline(0.0, color=SEEN, linewidth=0.6)
    below.set_ylabel("Δa found, m")
    below.xaxis_date()
    figure.savefig(path)


def plot_outlook(
    path: Path, history: History, sigma_m: Array, found: Sequence[FoundManoeuvre], ahead: Outlook, title: str
) -> None:
    """D from passes with its sigmas, the manoeuvres found, and what D will do; writes a PNG."""
    figure = _figure((10.0, 5.0))
    cycle = history.reference.cycle
    figure.suptitle(f"{title}: {cycle.revolutions} revolutions in {cycle.days} days", fontweight="bold")
    axes = figure.subplots()
    axes.errorbar(
        dates(history.tai_s),
        history.d_m,
        sigma_m,
        fmt=".",
        color=TRUE,
        ecolor=SEEN,
        elinewidth=0.8,
        label="passes, 1 σ",
    )
    until = int(np.searchsorted(ahead.ahead_tai_s, (ahead.next_tai_s or ahead.tai_s) + 10.0 * DAY_S))
    axes.plot(
        dates(ahead.ahead_tai_s[:until]), ahead.ahead_m[:until], color=SIZE, linewidth=1.2, label="if nobody steers"
    )
    for one in found:
        axes.axvline(dates(np.array([one.tai_s]))[0], color=LIMIT, linewidth=0.8)
    if ahead.limit_m is not None:
        axes.axhline(ahead.limit_m, color=LIMIT, linewidth=0.8, linestyle="--", label="next manoeuvre")
    axes.set_ylabel("D, m (east positive, median 0)")
    axes.legend(fontsize=8)
    axes.xaxis_date()
    figure.autofmt_xdate()
    figure.savefig(path)


def dates(tai_s: Array) -> Array:
    """Matplotlib's days, for an axis of dates (`xaxis_date`)."""
    return np.array([unix_from_tai(one) / DAY_S for one in tai_s.tolist()])


def _legend_below(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, frameon=False)


def _figure(size_in: tuple[float, float]) -> Figure:
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    return Figure(figsize=size_in, dpi=120, layout="constrained")
