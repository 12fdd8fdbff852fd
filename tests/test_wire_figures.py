"""The wire log of the fake ACU, and the figures that a bench draws from it, on writes and skies made by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Bench

from acu_daemon.acu.commands import AcuMode, SelectMode
from acu_daemon.drivers.sa3842.angles import LSB_DEG
from acu_daemon.drivers.sa3842.messages import Ack, Nak, WriteAndPoll, WriteRegisters
from acu_daemon.errors import UsageError
from acu_daemon.report.pass_trace import Trace
from acu_daemon.report.wire import (
    HALF_SERVO_TICK_S,
    Writes,
    can_follow,
    measure_losses,
    measure_writes,
    read_writes,
    satellite_at,
)
from acu_daemon.sim.wire_log import WireLogWriter
from acu_daemon.units import Array

RATE_DEG_S = 2.0
COUNT = 400


def trace_of(az_deg: Array, el_deg: Array, **changes: object) -> Trace:
    """A satellite at ten rows a second that the antenna is on."""
    ones, zeros = np.ones(az_deg.size), np.zeros(az_deg.size)
    tai_s = START_TAI_S + 0.1 * np.arange(az_deg.size)
    mode = ["AUTOTRACK"] * az_deg.size
    return replace(Trace(tai_s, az_deg, el_deg, az_deg % 360.0, el_deg, zeros, mode, ones, ones), **changes)  # type: ignore[arg-type]


def steady() -> Trace:
    """Through north at a constant rate, 10 deg high."""
    return trace_of(350.0 + RATE_DEG_S * 0.1 * np.arange(COUNT), np.full(COUNT, 10.0))


def writes_of(trace: Trace, late_s: float = 0.0, *, is_followed: bool = False) -> Writes:
    """Writes at every row, that hold where the satellite was late_s before they take effect."""
    az_deg, el_deg = satellite_at(trace, trace.tai_s + HALF_SERVO_TICK_S - late_s)
    good = np.isfinite(az_deg)
    mode = ["REMOTE_BACKUP" if is_followed else "AUTOTRACK"] * int(good.sum())
    return Writes(trace.tai_s[good], az_deg[good], el_deg[good], mode, np.full(len(mode), float(is_followed)))


def test_the_wire_log_holds_every_accepted_write_and_no_refused_one(tmp_path: Path) -> None:
    bench = Bench()
    with WireLogWriter(tmp_path / "wire.csv") as log:
        bench.acu.on_write = log.add
        bench.wait(0.1234)
        assert bench.acu.answer(WriteRegisters(359.5, 41.0)) == Ack()
        bench.acu.answer(SelectMode(AcuMode.REMOTE))
        bench.wait(0.1)
        bench.acu.answer(WriteAndPoll(0.5, 42.0))
        assert bench.acu.answer(WriteAndPoll(0.5, 120.0)) == Nak()
    writes = read_writes(tmp_path / "wire.csv")
    assert writes.tai_s - START_TAI_S == pytest.approx([0.1234, 0.2234], abs=1e-6)
    assert writes.az_deg.tolist() == [359.5, 0.5]
    assert writes.el_deg.tolist() == [41.0, 42.0]
    assert writes.mode == ["STANDBY", "REMOTE"]
    assert writes.is_followed.tolist() == [0.0, 1.0]


def test_a_wire_log_that_cannot_be_written_is_wrong_use(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"--wire-log .*: No such file or directory"):
        WireLogWriter(tmp_path / "nowhere" / "wire.csv")


def test_registers_are_judged_at_the_moment_they_take_effect() -> None:
    trace = steady()
    on_time = measure_writes(writes_of(trace), trace, AZIMUTH, ELEVATION, LSB_DEG)
    assert on_time.autotrack_max_deg == pytest.approx(0.0, abs=1e-4)
    late = measure_writes(writes_of(trace, late_s=0.05), trace, AZIMUTH, ELEVATION, LSB_DEG)
    assert late.autotrack_p99_deg == pytest.approx(0.05 * RATE_DEG_S * np.cos(np.radians(10.0)), abs=1e-3)


def test_the_first_ten_seconds_of_autotrack_are_not_judged() -> None:
    trace = steady()
    writes = writes_of(trace)
    writes.az_deg[:100] += 5.0
    assert measure_writes(writes, trace, AZIMUTH, ELEVATION, LSB_DEG).autotrack_max_deg < 1e-3


def test_rhythm_of_the_writes() -> None:
    trace = steady()
    writes = writes_of(trace)
    kept = np.arange(writes.tai_s.size) != 200  # one write is missing
    columns = (writes.tai_s, writes.az_deg, writes.el_deg)
    gappy = Writes(*(column[kept] for column in columns), writes.mode[1:], np.zeros(kept.size - 1))
    figures = measure_writes(gappy, trace, AZIMUTH, ELEVATION, LSB_DEG)
    assert figures.longest_gap_s == pytest.approx(0.2, abs=1e-6)
    assert figures.share_of_short_gaps == pytest.approx(1 - 1 / (COUNT - 3), abs=1e-4)
    assert figures.writes_per_s == pytest.approx(10.0 * (COUNT - 3) / (COUNT - 2), abs=1e-3)


def test_only_followed_registers_must_keep_to_the_rate_of_the_axis() -> None:
    trace = steady()
    writes = writes_of(trace)
    assert measure_writes(writes, trace, AZIMUTH, ELEVATION, LSB_DEG).rate_share == 0.0
    followed = replace(writes, is_followed=np.ones(writes.tai_s.size))
    share = measure_writes(followed, trace, AZIMUTH, ELEVATION, LSB_DEG).rate_share
    assert share == pytest.approx(RATE_DEG_S / AZIMUTH.max_rate_deg_s, abs=0.01)
    followed.el_deg[300:] += 0.6
    assert measure_writes(followed, trace, AZIMUTH, ELEVATION, LSB_DEG).rate_share > 1.0


def test_without_writes_in_autotrack_there_is_nothing_to_judge() -> None:
    trace = steady()
    with pytest.raises(ValueError, match="too few register writes"):
        measure_writes(writes_of(trace, is_followed=True), trace, AZIMUTH, ELEVATION, LSB_DEG)


def test_a_loss_is_judged_from_its_first_to_its_last_moment_and_the_relock_after_it() -> None:
    is_on_air = np.ones(COUNT)
    is_on_air[100:200] = 0.0
    mode = ["AUTOTRACK"] * 100 + ["REMOTE_BACKUP"] * 105 + ["AUTOTRACK"] * (COUNT - 205)
    error_deg = np.full(COUNT, 9.0)
    error_deg[100:200] = 0.02
    error_deg[150] = 0.07
    trace = replace(steady(), is_on_air=is_on_air, mode=mode, error_deg=error_deg)
    figures = measure_losses(trace, AZIMUTH, ELEVATION)
    assert figures.loss_s == pytest.approx(10.0)
    assert (figures.beam_error_max_deg, figures.beam_error_median_deg) == (0.07, 0.02)
    assert figures.relock_s == pytest.approx(0.5, abs=1e-6)
    assert figures.cannot_follow_s == 0.0
    never = replace(trace, mode=["REMOTE_BACKUP"] * COUNT)
    assert measure_losses(never, AZIMUTH, ELEVATION).relock_s == np.inf


def test_where_no_drive_can_follow_the_beam_error_does_not_count() -> None:
    az_deg = np.concatenate((np.zeros(150), np.linspace(0.0, 180.0, 50), np.full(200, 180.0)))  # 36 deg/s
    trace = trace_of(az_deg, np.full(COUNT, 60.0), is_on_air=np.repeat([1.0, 0.0], COUNT // 2))
    is_followable = can_follow(trace, AZIMUTH, ELEVATION)
    assert is_followable[:149].all()
    assert not is_followable[155:220].any()
    assert is_followable[300:].all()
    assert 1.0 < measure_losses(trace, AZIMUTH, ELEVATION).cannot_follow_s < 10.0


def test_a_pass_without_a_signal_or_without_a_loss_is_said_so() -> None:
    with pytest.raises(ValueError, match="never acquired"):
        measure_losses(replace(steady(), is_acquired=np.zeros(COUNT)), AZIMUTH, ELEVATION)
    with pytest.raises(ValueError, match="no loss"):
        measure_losses(steady(), AZIMUTH, ELEVATION)
