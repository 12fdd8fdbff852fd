"""Watches the wire and the daemon, and notes the first time that each promise is broken (P1 to P10 of the README)."""

from collections import deque
from math import floor
from typing import TYPE_CHECKING, Any

from flights import LSB_DEG

from acu_daemon.acu.commands import Poll, SelectBackup, SelectMode
from acu_daemon.daemon.service import FIRST_POLL_S, Outcome
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.drivers.sa3842.messages import (
    Command,
    ReadRegisters,
    Status,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.edge.carry_over_file import read_carry_over
from acu_daemon.edge.run_state import read_run_state
from acu_daemon.model import sky_angle_deg
from acu_daemon.sim.wire_log import RegisterWrite
from acu_daemon.units import wrap_180

if TYPE_CHECKING:
    from promise_rig import Rig

ORDERS = (WriteAndPoll, WriteRegisters, SelectMode, SelectBackup, WriteParameter)
SILENT_S = 0.7  # half a second, the tick that sees it, and its exchange
STALE_S = 0.7  # a link is closed after half a second of silence: nothing older may arrive
PRESENT_S, PRESENT_DEG = 2.5, 1.0  # the present angles are those of a status so old at most; on the sky
BURST_SHARE = 0.5  # of the period
START_SHARE = 0.1  # the first write ends a start within its tick, however late that is in the period
FOLLOW_S_S = 0.0021  # seconds of a second by which UTC may follow the system's clock
COUNT_SLACK = 4
PATH_DEG, KEYHOLE_EL_DEG = 0.5, 80.0
SPOILING = ("encoder", "frozen", "false-lock", "backlash", "xor-blind", "swapped-digits")  # readings that mislead a fit


class Judge:
    """`broken`: what was seen first against each promise.  Times are of the virtual loop."""

    def __init__(self, rig: "Rig") -> None:
        self._rig = rig
        self.broken: dict[str, str] = {}
        self.is_latched = self.is_disarmed = self.may_forget = self.is_spoiled = False
        self._reports: deque[tuple[float, Status]] = deque(maxlen=200)
        self._sent: deque[tuple[float, int, int]] = deque(maxlen=600)
        self._stalled_s = -1e18
        self.order_count = self.tick_count = 0

    def _break(self, promise: str, what: str) -> None:
        self.broken.setdefault(promise, f"{what}, at {self._now_s:.3f} s")

    @property
    def _now_s(self) -> float:
        return self._rig.loop.time()

    # The daemon's life

    def started(self) -> None:
        self._started_s = self._heard_s = self._now_s
        self._last_s, self._is_first, self._is_starting = -1e18, False, False
        self._followed: tuple[float, float, float] | None = None
        self._clamped_count = 0
        self._offset_s = self._rig.daemon_clock.offset_s
        self._stepped_ticks: int | None = None
        self._ticks = 0
        self.opened()

    def crashed(self) -> None:
        """What could not be saved may be forgotten, and what was asked for in the tick of the crash."""
        if read_run_state(self._rig.directory).arming is not False:
            self._will_disarm_s = None
        if self.may_forget:
            self.is_latched = self.is_disarmed = False

    def ended(self, outcome: Outcome | None) -> None:
        if outcome is None or outcome.reason != "SIGTERM":
            self._break("P4", f"a clean stop ended as {outcome}")
        self.crashed()

    def opened(self) -> None:
        """A new connection: everything is read before anything is ordered."""
        self._is_polled = self._is_read = self._is_present = self._is_read_back = False

    def asked(self, line: str) -> None:
        """What a person asks for; the next tick does it."""
        state = self._rig.state
        if line == "clear" and (state.latch.problem or self.is_latched):
            self.is_latched = self._is_present = self._is_read_back = False
            self._is_clearing = True
        if line == "arm" and not state.is_armed(self._rig.config):
            self._is_present = self._is_read_back = False
        if line in ("arm", "disarm"):
            self.is_disarmed = False
            self._will_disarm_s = self._now_s if line == "disarm" else None

    _will_disarm_s: float | None = None
    _is_clearing = False  # asked for in the middle of a tick, it is done by the next one

    def stalled(self, time_s: float) -> None:
        self._stalled_s = self._now_s + time_s

    def clock_stepped(self) -> None:
        self._stepped_ticks = self._ticks

    # The wire

    def heard(self) -> None:
        self._heard_s = self._now_s

    def reported(self, status: Status) -> None:
        self._reports.append((self._now_s, status))

    def sent(self, command: Command) -> None:
        """The daemon writes a command."""
        match command:
            case Poll():
                self._is_polled = True
            case ReadRegisters():
                self._is_read = True
                self._is_read_back = self._is_present
        if isinstance(command, ORDERS) and command != WriteParameter("W", 0):
            self._judge_order(command)
        if isinstance(command, WriteAndPoll | WriteRegisters):
            self._judge_write(command)

    def _judge_order(self, command: Any) -> None:
        state, name = self._rig.state, type(command).__name__
        self.order_count += 1
        self.is_latched |= bool(state.latch.problem)
        if self.is_latched:
            self._break("P6", f"{name} while latched")
        if self.is_disarmed or not state.is_armed(self._rig.config):
            self._break("P1", f"{name} while disarmed")
        if not (self._is_polled and self._is_read):
            self._break("P3", f"{name} before the registers and a status were read on this connection")
        if isinstance(command, WriteAndPoll | SelectMode | SelectBackup) and not self._is_read_back:
            self._break("P1", f"{name} before the present angles were written and read back")

    def _judge_write(self, command: WriteAndPoll | WriteRegisters) -> None:
        now_s, az_deg, el_deg = self._now_s, command.az_deg, command.el_deg
        self._sent.append((now_s, round(az_deg % 360.0 / LSB_DEG) % 65536, round(el_deg / LSB_DEG)))
        limits = self._rig.config.elevation
        if not limits.min_deg - LSB_DEG <= el_deg <= limits.max_deg + LSB_DEG:
            self._break("P5", f"elevation {el_deg}")
        if isinstance(command, WriteRegisters):
            self._is_present, self._is_starting, self._followed = True, True, None
            if not self._is_of_a_report(az_deg, el_deg):
                self._break("P2", f"first write {az_deg:.2f} {el_deg:.2f} is not where the antenna is")
            return
        period_s = self._rig.config.period_s
        gap_s = now_s - self._last_s
        if gap_s < (START_SHARE if self._is_first else BURST_SHARE) * period_s - 1e-6:
            self._break("P8", f"two writes {1e3 * gap_s:.1f} ms apart")
        self._is_first, self._is_starting = self._is_starting, False
        self._last_s = now_s
        self._judge_rate(az_deg, el_deg)
        self._judge_path(az_deg, el_deg)

    def _is_of_a_report(self, az_deg: float, el_deg: float) -> bool:
        return any(
            sky_angle_deg(az_deg, el_deg, status.az_deg, status.el_deg) < PRESENT_DEG
            for time_s, status in self._reports
            if time_s > self._now_s - PRESENT_S
        )

    def _judge_rate(self, az_deg: float, el_deg: float) -> None:
        """Between two writes that the antenna follows, as the daemon knows."""
        rig, before = self._rig, self._followed
        status = rig.state.intake.status
        is_followed = status is not None and status.follows_registers and rig.acu.follows_registers
        self._followed = (self._now_s, az_deg, el_deg) if is_followed else None
        if before is None or self._followed is None:
            return
        span_s = self._now_s - before[0]
        for name, moved_deg, limits in (
            ("azimuth", abs(wrap_180(az_deg - before[1])), rig.config.azimuth),
            ("elevation", abs(el_deg - before[2]), rig.config.elevation),
        ):
            if moved_deg - LSB_DEG > limits.max_rate_deg_s * span_s:
                self._break("P5", f"{name} moved {moved_deg:.3f} deg in {span_s:.3f} s")

    def _judge_path(self, az_deg: float, el_deg: float) -> None:
        """With a fit of good readings, what is not held back is on the satellite."""
        rig, state = self._rig, self._rig.state
        is_held_back = state.refusals.clamped_count != self._clamped_count or bool(state.refusals.refusal)
        self._clamped_count = state.refusals.clamped_count
        track, was_followed = state.tracking.track, state.registers.was_followed
        is_on_path = track == "AUTOTRACK/FITTED" or (track == "HOLD/FITTED" and was_followed)
        if self.is_spoiled or is_held_back or not is_on_path:
            return
        truth = rig.acu.parts.sky.direction(rig.clock.tai_s() + 0.02)
        if truth is None or truth[1] > KEYHOLE_EL_DEG:
            return
        error_deg = sky_angle_deg(az_deg, el_deg, truth[0], truth[1])
        if error_deg > PATH_DEG:
            self._break("P7", f"{error_deg:.2f} deg beside the satellite in {state.tracking.track}")

    def applied(self, write: RegisterWrite) -> None:
        """The ACU takes a register write: what was sent long ago must not arrive."""
        key = round(write.az_deg % 360.0 / LSB_DEG) % 65536, round(write.el_deg / LSB_DEG)
        newest = next((time_s for time_s, *sent in reversed(self._sent) if tuple(sent) == key), self._now_s)
        if self._now_s - newest > STALE_S and self._now_s - self._stalled_s > 2.0:
            self._break("P2", f"a write arrived {self._now_s - newest:.2f} s after it was sent")

    # The daemon

    def ticked(self, seen: Snapshot) -> None:
        self._ticks = seen.tick_count
        self.tick_count += 1
        now_s = self._now_s
        silent_s, is_fresh = now_s - self._heard_s, now_s - self._stalled_s < 1.0
        if silent_s > SILENT_S and not is_fresh and seen.state != "LINK-LOST":
            self._break("P2", f"{seen.state} after {silent_s:.2f} s of silence")
        self._is_clearing &= bool(seen.latch)
        self.is_latched |= bool(seen.latch) and not self._is_clearing
        if self._will_disarm_s is not None and now_s - self._will_disarm_s > 0.25:
            self._will_disarm_s, self.is_disarmed = None, True
        self._judge_clock(seen)

    def _judge_clock(self, seen: Snapshot) -> None:
        clock, elapsed_s = self._rig.daemon_clock, self._now_s - self._started_s
        moved_s = abs(clock.offset_s - self._offset_s)
        if moved_s > FOLLOW_S_S * (elapsed_s + 1.0):
            self._break("P7", f"UTC moved by {moved_s:.4f} s in {elapsed_s:.1f} s")
        off_s = abs(self._rig.system_offset_s - clock.offset_s)
        is_due = self._stepped_ticks is not None and seen.tick_count >= self._stepped_ticks + 11
        if off_s > 0.1 and is_due and not seen.clock_alarm:
            self._break("P7", f"no alarm, and the system's clock is off by {off_s:.3f} s")

    def begin(self) -> None:
        """A stretch of time begins."""
        foreground = self._rig.service._foreground
        self._begun = self._now_s, foreground.tick_count, foreground.skipped_tick_count

    def end(self) -> None:
        """It ends: the ticks are counted, and those with a dead fit too; what is saved can be read."""
        foreground = self._rig.service._foreground
        ticks, skipped = foreground.tick_count, foreground.skipped_tick_count
        ticked_s = self._now_s - self._started_s
        if self._rig.state.intake.status is None:
            ticked_s = min(ticked_s, FIRST_POLL_S)  # without an ACU it ends then; what it owes is a stop, no ticks
        due = ticked_s / self._rig.config.period_s
        is_calm = self._now_s - self._stalled_s > 0.5
        if is_calm and not self._rig.task.done() and abs(ticks + skipped - due) > COUNT_SLACK:
            self._break("P8", f"{ticks} ticks and {skipped} skipped of {due:.0f}")
        span_s = self._now_s - self._begun[0]
        is_plain = self._rig.fit_trouble and not self._rig.board.lines() and self._begun[0] > self._stalled_s + 0.5
        if is_plain and (skipped > self._begun[2] or ticks - self._begun[1] < floor(10.0 * span_s) - 2):
            self._break("P9", f"{ticks - self._begun[1]} ticks in {span_s:.1f} s without a fit")

    def read_files(self) -> None:
        """P10: whatever is in the state directory can be read."""
        read_run_state(self._rig.directory)
        for path in self._rig.directory.glob("carry-over-*"):
            read_carry_over(path, self._rig.satellite)
        for error in self._rig.errors:
            self._break("P5" if error["event"] == "fence.refused" else "P10", str(error))
