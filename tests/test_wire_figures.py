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


def followed(*moves_deg: tuple[float, float], gap_s: float = 0.1, flags: tuple[int, ...] = ()) -> float:
    """The share of the rate that followed writes take, which move from one to the next by so much."""
    path = np.cumsum(np.array([(0.0, 0.0), *moves_deg]), axis=0)
    tai_s = START_TAI_S + np.concatenate(([0.0], 100.0 + gap_s * np.arange(len(path) + 1)))
    az, el = (
        np.concatenate(([0.0, 0.0], 359.95 + path[:, 0])) % 360.0,
        np.concatenate(([10.0, 10.0], 10.0 + path[:, 1])),
    )
    is_followed = np.array([0, 0, *(flags or [1] * len(path))])
    writes = Writes(tai_s, az, el, ["AUTOTRACK"] * tai_s.size, is_followed)
    sky = trace_of(np.zeros(3000), np.full(3000, 10.0))
    return measure_writes(writes, sky, AZIMUTH, ELEVATION, 0.01).rate_share


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_fastest_of_both_axes_counts_to_both_sides_and_over_north(sign: float) -> None:
    az, el = AZIMUTH.max_rate_deg_s, ELEVATION.max_rate_deg_s
    assert followed((sign * 0.5, 0.0)) == pytest.approx(0.49 / 0.1 / az)
    assert followed((0.0, sign * 0.5)) == pytest.approx(0.49 / 0.1 / el)
    assert followed((0.0, 0.0), (sign * 0.3, sign * 0.4), (0.0, 0.1)) == pytest.approx(max(0.29 / az, 0.39 / el) / 0.1)
    assert followed((0.0, sign * 0.5), gap_s=0.2) == pytest.approx(0.49 / 0.2 / el)
    assert followed((0.0, sign * 0.5), gap_s=0.05) == pytest.approx(0.49 / 0.1 / el)  # soon after a late one
    assert followed((0.0, 0.005)) == 0.0  # less than a step


@pytest.mark.parametrize(("flags", "counts"), [((1, 1), True), ((1, 0), False), ((0, 1), False), ((0, 0), False)])
def test_a_motion_is_between_two_writes_that_are_both_followed(flags: tuple[int, int], counts: bool) -> None:
    assert (followed((5.0, 0.0), flags=flags) > 0.0) == counts


def test_the_figures_of_two_writes_are_theirs() -> None:
    sky = steady()
    some = writes_of(sky)
    k = [150, 151]
    two = Writes(some.tai_s[k], some.az_deg[k], some.el_deg[k] + 0.5, ["REMOTE", "AUTOTRACK"], np.zeros(2))
    with pytest.raises(ValueError, match="too few"):
        measure_writes(two, sky, AZIMUTH, ELEVATION, LSB_DEG)
    k = [150, 151, 260]
    three = Writes(some.tai_s[k], some.az_deg[k], some.el_deg[k], ["AUTOTRACK"] * 3, np.zeros(3))
    three.el_deg[2] += 0.5
    figures = measure_writes(three, sky, AZIMUTH, ELEVATION, LSB_DEG)
    assert (figures.write_count, figures.share_of_short_gaps) == (3, 0.5)
    assert figures.longest_gap_s == pytest.approx(10.9, abs=1e-5)
    assert figures.autotrack_max_deg == figures.autotrack_p99_deg == pytest.approx(0.5, abs=1e-4)


def test_writes_while_the_sky_has_no_satellite_are_not_judged() -> None:
    sky = steady()
    sky.sat_az_deg[300:] = np.nan
    writes = writes_of(steady())
    writes.az_deg[305:] += 40.0
    assert measure_writes(writes, sky, AZIMUTH, ELEVATION, LSB_DEG).autotrack_max_deg < 1e-3


@pytest.mark.parametrize(("az_deg", "el_deg"), [(0.0, 10.0), (359.9, 10.0), (90.0, -5.0), (200.0, 60.0)])
def test_a_satellite_between_two_rows_is_between_them_also_over_north(az_deg: float, el_deg: float) -> None:
    sky = trace_of(np.array([az_deg - 0.1, az_deg + 0.1]), np.array([el_deg - 0.2, el_deg + 0.2]))
    az, el = satellite_at(sky, START_TAI_S + np.array([-0.001, 0.0, 0.05, 0.1, 0.101]))
    assert np.isnan(az[[0, -1]]).all()
    assert np.isnan(el[[0, -1]]).all()
    off = (az[1:4] - az_deg + 180.0) % 360.0 - 180.0
    assert off == pytest.approx([-0.1, 0.0, 0.1], abs=2e-3)
    assert el[1:4] == pytest.approx([el_deg - 0.2, el_deg, el_deg + 0.2], abs=1e-3)
    assert (az[1:4] >= 0.0).all()
    assert (az[1:4] < 360.0).all()


def test_losses_count_from_the_first_acquisition_on_and_the_longest_relock_is_told() -> None:
    is_on_air, acquired = np.ones(COUNT), np.ones(COUNT)
    acquired[:50] = 0.0
    for begin, end in ((20, 70), (100, 110), (200, 230), (390, COUNT)):
        is_on_air[begin:end] = 0.0
    mode = ["AUTOTRACK"] * COUNT
    for back, until in ((70, 73), (110, 119), (230, 232)):
        mode[back:until] = ["REMOTE_BACKUP"] * (until - back)
    error_deg = np.where(is_on_air == 0.0, 0.1, 5.0)
    error_deg[20:50] = 3.0
    sky = replace(steady(), is_on_air=is_on_air, is_acquired=acquired, mode=mode, error_deg=error_deg)
    figures = measure_losses(sky, AZIMUTH, ELEVATION)
    assert figures.loss_s == pytest.approx(2.0 + 1.0 + 3.0 + 1.0)
    assert (figures.beam_error_max_deg, figures.beam_error_median_deg) == (0.1, 0.1)
    assert figures.relock_s == pytest.approx(0.9, abs=1e-6)


def test_autotrack_without_the_signal_is_no_relock() -> None:
    is_on_air, acquired = np.ones(COUNT), np.ones(COUNT)
    is_on_air[100:150] = 0.0
    acquired[100:175] = 0.0
    sky = replace(steady(), is_on_air=is_on_air, is_acquired=acquired, error_deg=np.full(COUNT, 0.1))
    assert measure_losses(sky, AZIMUTH, ELEVATION).relock_s == pytest.approx(2.5, abs=1e-6)


def test_a_loss_that_lasts_until_the_satellite_sets_has_no_relock_to_wait_for() -> None:
    is_on_air, acquired = np.ones(COUNT), np.ones(COUNT)
    is_on_air[380:], acquired[380:] = 0.0, 0.0
    mode = ["AUTOTRACK"] * 380 + ["REMOTE_BACKUP"] * (COUNT - 380)
    sky = replace(steady(), is_on_air=is_on_air, is_acquired=acquired, mode=mode, error_deg=np.full(COUNT, 0.1))
    assert measure_losses(sky, AZIMUTH, ELEVATION).relock_s == 0.0
    sky.sat_az_deg[390:] = np.nan
    figures = measure_losses(sky, AZIMUTH, ELEVATION)
    assert figures.relock_s == 0.0
    assert figures.loss_s == pytest.approx(1.0)
