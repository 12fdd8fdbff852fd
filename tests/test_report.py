"""The report of a simulated pass: its figures, and the picture of two traces."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from acu_daemon.acu.commands import AcuMode
from acu_daemon.report.pass_trace import Trace, measure, read_trace
from acu_daemon.report.plot import plot_passes
from acu_daemon.sim.trace import TraceRow, TraceWriter

STEP_S = 0.1
COUNT = 600


def trace(off: slice = slice(0, 0), off_deg: float = 1.0, silent: slice = slice(0, 0)) -> Trace:
    """A minute on the satellite, off it in one slice, without signal in another."""
    tai_s = 8.0e8 + STEP_S * np.arange(COUNT)
    error, acquired, on_air = np.full(COUNT, 0.02), np.ones(COUNT), np.ones(COUNT)
    acquired[:50] = 0.0
    error[:50] = 3.0
    error[off] = off_deg
    on_air[silent] = 0.0
    acquired[silent] = 0.0
    az, el = np.linspace(100.0, 170.0, COUNT), np.linspace(20.0, 70.0, COUNT)
    mode = ["ACQUIRE"] * 50 + ["AUTOTRACK"] * (COUNT - 50)
    return Trace(tai_s, az + error, el, az, el, error, mode, acquired, on_air)


def test_a_pass_is_measured_from_its_first_acquisition() -> None:
    figures = measure(trace(), 1.0)
    assert figures.seconds == pytest.approx(55.0)
    assert figures.seconds_on_satellite == pytest.approx(55.0)
    assert figures.worst_deg == pytest.approx(0.02)
    assert figures.longest_off_s == 0.0
    assert figures.is_on_satellite_at_end


def test_time_off_the_satellite_and_time_without_signal_are_counted_apart() -> None:
    figures = measure(trace(off=slice(100, 130), silent=slice(90, 190)), 1.0)
    assert figures.longest_off_s == pytest.approx(3.0)
    assert figures.seconds_on_satellite == pytest.approx(52.0)
    assert figures.seconds_without_signal == pytest.approx(10.0)
    assert figures.seconds_acquired == pytest.approx(45.0)
    assert figures.worst_deg == 1.0
    assert figures.median_deg == pytest.approx(0.02)


def test_off_the_satellite_at_the_end_is_said() -> None:
    assert not measure(trace(off=slice(590, 600)), 1.0).is_on_satellite_at_end


def test_half_the_beam_is_the_edge() -> None:
    assert measure(trace(off=slice(100, 130), off_deg=0.4), 1.0).longest_off_s == 0.0
    assert measure(trace(off=slice(100, 130), off_deg=0.4), 0.5).longest_off_s == pytest.approx(3.0)


def test_an_unknown_satellite_counts_as_off() -> None:
    assert measure(trace(off=slice(100, 130), off_deg=float("nan")), 1.0).longest_off_s == pytest.approx(3.0)


def test_a_pass_that_was_never_acquired_has_no_figures() -> None:
    with pytest.raises(ValueError, match="never acquired"):
        measure(trace(silent=slice(0, COUNT)), 1.0)


def test_a_trace_written_by_the_simulator_is_read_as_it_was(tmp_path: Path) -> None:
    row = TraceRow(
        8.0e8, 359.9, 20.0, -0.1, 20.0, None, None, None, AcuMode.AUTOTRACK, True, 6.0, 1.0, 2.0, False, True
    )
    with TraceWriter(tmp_path / "trace.csv") as writer:
        writer.add(row)
    read = read_trace(tmp_path / "trace.csv")
    assert read.tai_s[0] == pytest.approx(8.0e8, abs=1e-3)
    assert read.az_deg[0] == 359.9
    assert np.isnan(read.error_deg[0])
    assert read.mode == ["AUTOTRACK"]


def test_two_traces_make_one_picture(tmp_path: Path) -> None:
    path = tmp_path / "pass.png"
    traces = {"assisted": trace(silent=slice(200, 300)), "rate memory": trace(off=slice(200, 600), off_deg=20.0)}
    plot_passes(path, traces, 1.0, "SIMULATION: a pass")
    picture = imread(path)
    assert picture.shape[0] > 600
    assert picture.shape[1] > 1000
    assert float(picture[..., :3].std()) > 0.05


def test_one_trace_alone_can_be_drawn(tmp_path: Path) -> None:
    plot_passes(tmp_path / "pass.png", {"assisted": trace()}, 1.0, "SIMULATION: a pass")
    assert (tmp_path / "pass.png").stat().st_size > 10_000
