"""What the 10 Hz decision remembers from tick to tick, what it is given, and what it orders.  All frozen."""

from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from math import inf
from typing import Any

from acu_daemon.control.axis_watch import AxesWatch, Bounds
from acu_daemon.control.encoder_watch import EncoderWatch
from acu_daemon.control.lag import LagEstimate
from acu_daemon.control.states import TrackState
from acu_daemon.control.turn import TurnWatch
from acu_daemon.model import AxisLimits, FitResult, Model, Prediction, Reading
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.reach import OutOfReach
from acu_daemon.protocol.messages import Command, Identity, Nak, Reply, Status


@dataclass(frozen=True, slots=True)
class ControlConfig:
    """Everything of the TOML files that the decision of a tick depends on."""

    azimuth: AxisLimits
    elevation: AxisLimits
    period_s: float = 0.1
    sample_delay_s: float = 0.010  # start of WRITE AND STATUS to the sample of the angles, ICD section 6
    poll_sample_delay_s: float = 0.010  # the same for STATUS POLL
    effect_delay_s: float = 0.020  # start of a write to the moment the command takes effect, ICD section 6
    beamwidth_deg: float = 1.0
    lock_dwell_s: float = 1.0
    min_elevation_deg: float = 5.0
    preposition_s: float = 120.0
    acquire_s: float = 60.0
    hold_s: float = 1200.0
    search_s: float = 120.0
    search_along_s: float = 10.0
    search_across_deg: float = 2.0
    is_armed: bool = True  # at the start; later as people arm and disarm
    is_shadow: bool = False  # commands nothing, whatever happens
    is_rehearsal: bool = False  # commands nothing but an ACU that says it is simulated
    register_watchdog_s: float = 0.0  # the ACU's parameter W; 0: it is not touched
    following: Bounds = Bounds()
    clock_alarm_deg: float = 0.1  # an error of UTC counts from here on, at the sky's present rate


class Request(StrEnum):
    """What a person asks of a running daemon."""

    ARM = "arm"
    DISARM = "disarm"
    CLEAR = "clear"


class Watchdog(IntEnum):
    """How far the ACU's register watchdog is set."""

    UNKNOWN = 0
    SET = 1
    REFUSED = 2  # this ACU has none: asked once, told once


class Stage(IntEnum):
    """How far the start has come: poll, identity, registers read, the present angles written and read back."""

    NEW = 0
    IDENTIFIED = 1
    REGISTERS_KNOWN = 2
    SECTOR_FREE = 3
    PRESENT_WRITTEN = 4
    READY = 5


@dataclass(frozen=True, slots=True)
class Sent:
    """A register write: the angles sent (continuous azimuth), and whether the lag may be learned from it."""

    az_deg: float
    el_deg: float
    is_free: bool  # followed, well within what the drive can do, and not held back by the gate


@dataclass(frozen=True, slots=True)
class Held:
    """The antenna as the daemon had it last, in a mode that follows it or autotracks."""

    has_interlock_fault: bool = False  # n5.b3: the bit with which the ACU's register watchdog shows


@dataclass(frozen=True, slots=True)
class PathOffset:
    """The satellite beside the prediction from a model, smoothed: seconds late, degrees right (control.track_frame)."""

    along_s: float
    across_deg: float
    model: Model


@dataclass(frozen=True, slots=True)
class Scan:
    """How far SEARCH has come (control.search): what each row covers, early to late, s; where it looks now."""

    model: Model | None = None
    rows: tuple[tuple[int, tuple[float, float]], ...] = ()
    row: int = 0
    side: int = 0  # -1 early, 1 late, 0: none can be looked at now
    along_s: float = 0.0
    is_aimed: bool = False
    is_moving: bool = False  # the antenna is there, and the place moves on
    waited_s: float = 0.0  # for the antenna to come to the row
    round_count: int = 0  # how often all was covered

    @property
    def covered(self) -> dict[int, tuple[float, float]]:
        return dict(self.rows)


@dataclass(frozen=True)
class ControlState:
    """The memory of the 10 Hz decision.  Without slots, which `changed` (control.changed) cannot copy at once."""

    track: TrackState = TrackState.LINK_LOST
    entered_tai_s: float = -inf
    stage: Stage = Stage.NEW
    identity: Identity | None = None  # as the ACU said it last
    is_identity_sure: bool = False  # a known one, or said twice
    tilt_code: int = 0
    present_deg: tuple[float, float] | None = None  # the first register write of this start, to be read back
    status: Status | None = None
    reading: Reading | None = None
    is_place_sure: bool = False  # the newest statuses agree where the antenna is
    az_deg: float = 0.0  # encoder azimuth of the newest status, in the frame of the wrap (continuous)
    track_of_readings: tuple[tuple[float, float, float], ...] = ()  # the newest: time, continuous azimuth, elevation
    acquired_since_tai_s: float | None = None
    has_locked: bool = False  # acquired for the dwell time, once at least
    has_acquired: bool = False
    is_stow_kept: bool = False  # somebody stowed the antenna while we looked on: it stays, also after a lost link
    hold_from_tai_s: float = -inf
    offset: PathOffset | None = None  # carries the path before the first fit
    is_offset_refused: bool = False
    scan: Scan = Scan()
    scanned_tai_s: float = -inf  # the newest reading that the scan has taken
    pass_rise_tai_s: float | None = None  # of the pass for which it, and that a signal was acquired, is known
    axis_az: AxisState | None = None  # the last command as position and rate, continuous azimuth
    axis_el: AxisState | None = None
    was_followed: bool = False
    last_write_tai_s: float | None = None
    commands: tuple[Sent | None, ...] = ()  # the newest three, oldest first; None: a tick without a write
    lag_az: LagEstimate = LagEstimate()
    lag_el: LagEstimate = LagEstimate()
    last_extra: Command | None = None
    extra_after_tai_s: float = -inf
    refused_tai_s: float = -inf  # the newest refusal of a register write
    refused_until_tai_s: float = -inf
    gate_refusal_count: int = 0
    gate_clamped_count: int = 0  # followed writes that the gate held back to what the axes can do
    refusal: str = ""  # of the gate, so that only its change is logged
    refused_input: str = ""  # what the tick was given and is not finite, so that only its change is logged
    limited: str = ""  # which axis is held at its limit; for some seconds after it is not, so that noise tells nothing
    limited_tai_s: float = -inf
    gate_limited_count: int = 0  # writes that the gate held at a limit of an axis
    arming: bool | None = None  # as people or another hand at the ACU left it; None: as configured
    disarmed_by: str = ""
    latch: str = ""  # what an axis did wrong; nothing moves until a person clears it
    faults_read: tuple[bool, ...] | None = None  # the fault bits of the status whose detail was read, while in FAULT
    is_stop_due: bool = False  # STOP is sent until it is acknowledged
    in_force: tuple[float, float, float] | None = None  # the last accepted write: time, continuous azimuth, elevation
    held: Held | None = None  # None: it does not hold the antenna; kept through lost links and restarts
    is_stop_doubted: bool = False  # found in STANDBY, by a hand or by the register watchdog: FAULT DETAIL tells
    watchdog: Watchdog = Watchdog.UNKNOWN
    watchdog_from_tai_s: float | None = None  # since when it is tried to set it
    axes: AxesWatch = AxesWatch()
    encoders: EncoderWatch = EncoderWatch()
    turn: TurnWatch = TurnWatch()
    goal_az_deg: float | None = None  # where the registers that are followed lead the azimuth, continuous

    def is_armed(self, config: ControlConfig) -> bool:
        """Whether anything may be written to the ACU."""
        armed = config.is_armed if self.arming is None else self.arming
        return armed and not config.is_shadow

    def lag_s(self, config: ControlConfig) -> tuple[float, float]:
        """Learned lag of azimuth and elevation, seconds."""
        phase_s = config.period_s - config.effect_delay_s + config.sample_delay_s
        return self.lag_az.lag_s(phase_s, config.period_s), self.lag_el.lag_s(phase_s, config.period_s)


@dataclass(frozen=True, slots=True)
class Exchange:
    """An extra exchange that was tried, and its reply; None when none came in time."""

    command: Command
    reply: Reply | None


@dataclass(frozen=True)
class Observation:
    """What the last tick brought.  Copied by `changed`."""

    reading: Reading | None = None  # with the status it came from; None: no good reply to the last write or poll
    status: Status | None = None
    is_confirmed: bool = True  # the place in the status, by those before it
    is_in_step: bool = True  # the reply is sure to be to this exchange: the reading's time is right
    extra: Exchange | None = None
    refused: Nak | None = None  # the ACU refused the register write
    silence_s: float = 0.0
    must_poll: bool = False  # the last exchange failed: the next command is a poll (ICD section 1)
    requests: tuple[Request, ...] = ()
    has_room: bool = True  # the computed cycle leaves room for a second exchange beside the write (ICD section 6)


@dataclass(frozen=True, slots=True)
class PassPlan:
    """The pass ahead, with the turn of the cable wrap chosen for the whole of it."""

    rise_tai_s: float
    set_tai_s: float
    start_tai_s: float
    start_az_deg: float  # continuous, encoder frame: where PREPOSITION goes
    start_el_deg: float
    note: str = ""  # why the turn is not a good one, when no turn holds the whole pass
    beyond: tuple[OutOfReach, ...] = ()  # when which axis cannot follow


@dataclass(frozen=True, slots=True)
class Sky:
    """What the background knows: the buffer, the last fit, the plan."""

    prediction: Prediction | None = None
    fit: FitResult | None = None
    plan: PassPlan | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """A fact for the log."""

    name: str
    fields: dict[str, Any] = field(default_factory=dict)
    is_warning: bool = False


@dataclass(frozen=True, slots=True)
class Orders:
    """What this tick sends: an exchange that brings a status, and at most one beside it; or that one in its place."""

    first: Command
    extra: Command | None = None
    events: tuple[Event, ...] = ()
