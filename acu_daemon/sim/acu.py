"""SIMULATION of the whole ACU with pedestal, receiver and sky, without IO (docs/protocol.md).

Time is TAI seconds; the servo ticks at 50 Hz from start_tai_s on and is stepped lazily up to the time of each call.
Angles are in the encoder frame, azimuth continuous.
"""

from collections.abc import Callable

from acu_daemon.acu.commands import AcuMode, Identify, Poll, ReadFaults, SelectBackup, SelectMode, Stop, Stow
from acu_daemon.drivers.sa3842.angles import elevation_deg
from acu_daemon.drivers.sa3842.codec import CommandEvent, encode_reply
from acu_daemon.drivers.sa3842.messages import (
    Ack,
    ClearChange,
    Command,
    Identity,
    Nak,
    Parameter,
    ReadParameter,
    ReadRegisters,
    RegisterContents,
    Reply,
    ResetFault,
    Status,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.sim.acu_modes import Modes
from acu_daemon.sim.acu_status import flags_of, status_of
from acu_daemon.sim.antenna import SimulatedAntenna
from acu_daemon.sim.command_registers import CommandRegisters, turns_within
from acu_daemon.sim.faults import WATCHDOG_BIT, FaultMemory, FaultNibble
from acu_daemon.sim.parameters import Parameters
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.pedestal import STEP_S
from acu_daemon.sim.trace import TraceRow
from acu_daemon.sim.wire_log import RegisterWrite

MODEL = "3842"
ALLOWED_UNDER_LOCAL = (Identify, Poll, ReadRegisters, Stop, ReadFaults, ReadParameter)
TRACE_STEPS = 5
_SLACK_DEG = 1e-6
_LEFT_BEHIND = {"remote": AcuMode.REMOTE, "stowed": AcuMode.STOWED}  # modes a daemon may find, beside those of power-up


class FakeAcu:
    """One simulated ACU: execute() a command that arrived, advance() to let time pass; time never goes back."""

    def __init__(self, parts: AcuParts) -> None:
        self.parts = parts
        self.address = parts.address
        self.reply_latency_s = parts.scenario.acu.reply_latency_s
        self.observer: Callable[[TraceRow], None] | None = None
        self.on_write: Callable[[RegisterWrite], None] | None = None
        self._has_tilt = parts.scenario.acu.has_tilt or parts.tilt is not None
        self.is_powered = True
        self._antenna = SimulatedAntenna(parts)
        self._tick = 0
        self._part_s = 0.0
        mode = parts.scenario.acu.mode
        self._power_up(is_local=mode == "manual")
        if mode in _LEFT_BEHIND:
            self._modes.enter(_LEFT_BEHIND[mode], 0.0)
        self._antenna.move_and_sense(parts.start_tai_s, self._parameters.threshold_db)
        self._seen = self._flags()

    def _power_up(self, *, is_local: bool) -> None:
        antenna = self._antenna
        self._parameters = Parameters(self.parts.elevation)
        self._modes = Modes(self._parameters, is_local=is_local)
        self._modes.entered_s = self._served_s = self._now_s
        self._registers = CommandRegisters(antenna.az.angle_deg, antenna.el.angle_deg, antenna.tilt_code)
        self._faults = FaultMemory()
        self._has_changed = True
        self._seen = self._flags()

    def power_cycle(self, now_tai_s: float) -> None:
        """Switch off and on: everything but the antenna's position is forgotten."""
        self.power_off(now_tai_s)
        self.power_on(now_tai_s)

    def power_off(self, now_tai_s: float) -> None:
        """The antenna stands, and nobody answers."""
        self.advance(now_tai_s)
        self._antenna.lose_power()
        self.is_powered = False

    def power_on(self, now_tai_s: float) -> None:
        """Start anew."""
        self.advance(now_tai_s)
        self.is_powered = True
        self._power_up(is_local=not self._modes.is_remote_enabled)

    def set_local(self, is_local: bool, now_tai_s: float) -> None:
        """Give control to the local panel, or take it back."""
        self.advance(now_tai_s)
        self._modes.set_local(is_local, self._now_s)
        self._note_changes()

    def begin_fault(self, nibble: FaultNibble, bit: int, now_tai_s: float) -> None:
        """Break something: nibble and bit of the fault detail."""
        self.advance(now_tai_s)
        self._faults.begin(nibble, bit)

    def end_fault(self, nibble: FaultNibble, bit: int, now_tai_s: float) -> None:
        """Mend it."""
        self.advance(now_tai_s)
        self._faults.end(nibble, bit)

    @property
    def antenna(self) -> SimulatedAntenna:
        """What moves and hears, to break it."""
        return self._antenna

    @property
    def _now_s(self) -> float:
        return self._tick * STEP_S

    @property
    def _tai_s(self) -> float:
        return self.parts.start_tai_s + self._tick * STEP_S

    def execute(self, event: CommandEvent, now_tai_s: float) -> bytes:
        """Execute a command at an instant; return the frame of the reply."""
        self.advance(now_tai_s)
        reply = Nak() if event.command is None else self.answer(event.command)
        return encode_reply(event.cmd, reply, self.address)

    def answer(self, command: Command) -> Reply:
        """Execute a command now."""
        if not self._modes.is_remote_enabled and not isinstance(command, ALLOWED_UNDER_LOCAL):
            return Nak()
        reply = self._answer(command)
        self._note_changes()
        return self.status() if isinstance(command, WriteAndPoll) and isinstance(reply, Ack) else reply

    def _answer(self, command: Command) -> Reply:
        modes, now_s = self._modes, self._now_s
        match command:
            case Identify():
                return Identity(MODEL, "S2" if self._has_tilt else "S1")
            case Poll():
                return self.status()
            case WriteRegisters(az_deg, el_deg, tilt_code):
                if tilt_code is not None and not self._has_tilt:
                    return Nak()
                return self._write(az_deg, el_deg, tilt_code)
            case WriteAndPoll(az_deg, el_deg, tilt_code):
                return self._write(az_deg, el_deg, tilt_code if self._has_tilt else None)
            case ReadRegisters():
                registers = self._registers
                return RegisterContents(registers.az_deg, registers.el_deg, registers.tilt_code, registers.count)
            case SelectMode(mode):
                return _done(modes.select(mode, self._antenna.receiver.is_acquired, now_s))
            case SelectBackup(backup):
                modes.select_backup(backup, now_s)
            case Stow():
                return _done(modes.stow(now_s))
            case Stop():
                modes.stop(now_s)
            case ClearChange():
                modes.is_loss_latched = False
                self._seen = self._flags()
                self._has_changed = False
            case ResetFault():
                return self._reset_fault()
            case ReadFaults():
                return self._faults.detail(is_receiver_valid=self._antenna.receiver.is_valid)
            case ReadParameter(name):
                return Parameter(name, self._parameters.code(name))
            case WriteParameter(name, code):
                if not self._parameters.is_in_range(name, code):
                    return Nak()
                self._has_changed |= self._parameters.write(name, code)
                self._served_s = now_s
        return Ack()

    def _write(self, az_deg: float, el_deg: float, tilt_code: int | None) -> Reply:
        limits, tilt = self.parts.elevation, self.antenna.tilt.limits
        if not limits.min_deg - _SLACK_DEG <= el_deg <= limits.max_deg + _SLACK_DEG:
            return Nak()
        if not turns_within(az_deg, self.parts.azimuth):
            return Nak()
        if tilt_code is not None and not tilt.min_deg <= elevation_deg(tilt_code) <= tilt.max_deg:
            return Nak()
        self._registers.write(az_deg, el_deg, tilt_code)
        self._modes.are_registers_written = True
        self._served_s = self._now_s
        if self.on_write is not None:
            modes, tai_s = self._modes, self._tai_s + self._part_s
            self.on_write(RegisterWrite(tai_s, az_deg, el_deg, modes.mode, modes.follows_registers))
        return Ack()

    def _reset_fault(self) -> Reply:
        had_any = self._faults.has_any
        if not self._faults.reset():
            return Nak()
        if had_any:
            self._modes.recover(self._now_s)
        return Ack()

    def status(self) -> Status:
        """The status block, sampled at the time of the last advance()."""
        return status_of(
            self._antenna,
            self._modes,
            self._faults.remembered,
            part_s=self._part_s,
            has_changed=self._has_changed,
            has_tilt=self._has_tilt,
        )

    def _flags(self) -> tuple[object, ...]:
        return flags_of(self._antenna, self._modes, self._faults.remembered)

    def _note_changes(self) -> None:
        flags = self._flags()
        if flags != self._seen:
            self._seen = flags
            self._has_changed = True

    def advance(self, now_tai_s: float) -> None:
        """Let the servo tick up to an instant; an earlier one changes nothing."""
        since_start_s = now_tai_s - self.parts.start_tai_s
        last_tick = int(since_start_s / STEP_S + 1e-6)
        while self._tick < last_tick:
            self._tick += 1
            self._step()
        self._part_s = min(max(since_start_s - self._now_s, 0.0), STEP_S)

    def _step(self) -> None:
        antenna, now_s = self._antenna, self._now_s
        antenna.move_and_sense(self._tai_s, self._parameters.threshold_db)
        if self.is_powered:
            self._serve(now_s)
        if self.observer is not None and self._tick % TRACE_STEPS == 0:
            self.observer(self.trace_row())

    def _serve(self, now_s: float) -> None:
        modes, antenna = self._modes, self._antenna
        modes.step(antenna.receiver.is_acquired, now_s)
        if self._faults.stops_the_drives:
            modes.leave_autotrack(AcuMode.FAULT, now_s)
        self._watch_registers(now_s)
        self._drive(self._registers.step())
        self._note_changes()

    def _watch_registers(self, now_s: float) -> None:
        limit_s = self._parameters.watchdog_s
        if limit_s == 0.0 or not self._modes.follows_registers:
            return
        if now_s - max(self._served_s, self._modes.entered_s) >= limit_s:
            self._modes.leave_autotrack(AcuMode.STANDBY, now_s)
            self._faults.note("system", WATCHDOG_BIT)

    def _drive(self, is_handed_over: bool) -> None:
        antenna, mode = self._antenna, self._modes.mode
        if self._modes.follows_registers:
            antenna.follow(self._registers.held, is_handed_over, self._parameters.sector_preference)
        elif mode is AcuMode.AUTOTRACK:
            antenna.track(self._parameters.lowest_el_deg)
        elif mode is AcuMode.RATE_MEMORY:
            antenna.coast()
        elif mode is not AcuMode.STOWING:
            antenna.halt()
        elif antenna.stow():
            self._modes.enter(AcuMode.STOWED, self._now_s)

    def trace_row(self) -> TraceRow:
        """What really is at the last tick."""
        antenna = self._antenna
        az_deg, el_deg = antenna.boresight_deg
        direction, offset = antenna.direction, antenna.offset
        return TraceRow(
            tai_s=self._tai_s,
            boresight_az_deg=az_deg % 360.0,
            boresight_el_deg=el_deg,
            encoder_az_deg=antenna.az.angle_deg,
            encoder_el_deg=antenna.el.angle_deg,
            satellite_az_deg=None if direction is None else direction[0],
            satellite_el_deg=None if direction is None else direction[1],
            beam_error_deg=None if offset is None else offset.angle_deg,
            mode=self._modes.mode,
            is_acquired=antenna.receiver.is_acquired,
            agc_db=antenna.receiver.agc_db,
            register_az_deg=self._registers.az_deg,
            register_el_deg=self._registers.el_deg,
            is_followed=self._modes.follows_registers,
            has_signal=antenna.has_signal,
        )


def _done(is_done: bool) -> Reply:
    return Ack() if is_done else Nak()
