"""What a simulated pass looked like, as arrays: read from the trace that the fake ACU writes."""

import csv
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import Array


@dataclass(frozen=True, slots=True)
class Trace:
    """A simulated pass: arrays are (N,); the satellite's direction is NaN where the sky has none."""

    tai_s: Array
    az_deg: Array  # of the boresight, true
    el_deg: Array
    sat_az_deg: Array
    sat_el_deg: Array
    error_deg: Array  # beam error: angle on the sky between boresight and satellite
    mode: list[str]
    is_acquired: Array  # 1 where the receiver has the signal
    is_on_air: Array  # 1 where the satellite's signal arrives at all: no loss is being simulated


def read_trace(path: Path) -> Trace:
    """Read the trace CSV that `fake-acu --trace` writes."""
    with path.open(encoding="ascii", newline="") as file:
        rows = list(csv.DictReader(file))

    def column(name: str) -> Array:
        return np.array([float(row[name]) if row[name] else np.nan for row in rows])

    return Trace(
        tai_s=np.array([tai_from_utc(row["utc"]) for row in rows]),
        az_deg=column("boresight_az_deg"),
        el_deg=column("boresight_el_deg"),
        sat_az_deg=column("satellite_az_deg"),
        sat_el_deg=column("satellite_el_deg"),
        error_deg=column("beam_error_deg"),
        mode=[row["mode"] for row in rows],
        is_acquired=column("acquired"),
        is_on_air=column("signal"),
    )


def until(trace: Trace, end_tai_s: float) -> Trace:
    """The part of a trace up to an instant."""
    count = int(np.searchsorted(trace.tai_s, end_tai_s, side="right"))
    arrays = {one.name: getattr(trace, one.name)[:count] for one in fields(trace)}
    return Trace(**arrays)


@dataclass(frozen=True, slots=True)
class Figures:
    """What counts of a pass, from the first acquisition to the end."""

    seconds: float
    seconds_on_satellite: float  # beam error below half the beam
    seconds_acquired: float
    seconds_without_signal: float  # by the scenario: nothing to receive
    longest_off_s: float  # longest time beyond half the beam
    worst_deg: float
    median_deg: float
    is_on_satellite_at_end: bool


def measure(trace: Trace, beamwidth_deg: float) -> Figures:
    """Sum up a trace.  ValueError: the signal was never acquired."""
    acquired = np.flatnonzero(trace.is_acquired > 0)
    if acquired.size == 0:
        raise ValueError("the signal was never acquired")
    part = slice(int(acquired[0]), None)
    error, step_s = trace.error_deg[part], float(np.median(np.diff(trace.tai_s)))
    is_off = ~(error < beamwidth_deg / 2)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_off, [False])).astype(int)))
    runs = edges[1::2] - edges[::2]
    return Figures(
        seconds=error.size * step_s,
        seconds_on_satellite=float((~is_off).sum()) * step_s,
        seconds_acquired=float(trace.is_acquired[part].sum()) * step_s,
        seconds_without_signal=float((trace.is_on_air[part] == 0).sum()) * step_s,
        longest_off_s=float(runs.max()) * step_s if runs.size else 0.0,
        worst_deg=float(np.nanmax(error)),
        median_deg=float(np.nanmedian(error)),
        is_on_satellite_at_end=not bool(is_off[-1]),
    )


def figures_table(figures: dict[str, Figures]) -> list[str]:
    """Lines of a table for people, a column for each label."""
    rows: list[tuple[str, Callable[[Figures], str]]] = [
        ("beam on the satellite, s", lambda f: f"{f.seconds_on_satellite:.1f} of {f.seconds:.1f}"),
        ("signal received, s", lambda f: f"{f.seconds_acquired:.1f}"),
        ("no signal by the scenario, s", lambda f: f"{f.seconds_without_signal:.1f}"),
        ("longest time off the satellite, s", lambda f: f"{f.longest_off_s:.1f}"),
        ("median beam error, deg", lambda f: f"{f.median_deg:.3f}"),
        ("largest beam error, deg", lambda f: f"{f.worst_deg:.2f}"),
        ("on the satellite at the end", lambda f: "yes" if f.is_on_satellite_at_end else "no"),
    ]
    lines = [f"{'SIMULATION':36}" + "".join(f"{label:>16}" for label in figures)]
    return lines + [f"{name:36}" + "".join(f"{show(one):>16}" for one in figures.values()) for name, show in rows]
