"""One picture of a latency test: how late the ticks came, and how long the link took."""

from pathlib import Path

from matplotlib.figure import Figure

from acu_daemon.units import Array

BIN_COUNT = 60


def plot_latency(path: Path, lateness_ms: Array, round_trip_ms: Array, scheduling: str) -> None:
    """Draw both histograms, counts on a logarithmic scale; writes a PNG.  An empty one is left out."""
    shown = [(f"ticks late, ms ({scheduling})", lateness_ms), ("link round trip, ms", round_trip_ms)]
    shown = [(label, values) for label, values in shown if values.size]
    figure = Figure(figsize=(6.0 * len(shown), 3.6), dpi=120, layout="constrained")
    for axes, (label, values) in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        axes.hist(values, bins=BIN_COUNT, color="#0b6e4f", log=True)
        axes.set_xlabel(label)
        axes.set_ylabel("count")
        axes.grid(alpha=0.3)
    figure.savefig(path)
