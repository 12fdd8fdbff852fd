"""What the 10 Hz decision remembers from tick to tick, in parts.  All frozen.

Each part has one owner: the module that its docstring names, and no other, makes a new one of it.  Whoever else wants
it changed calls a function of the owner; to read, everybody may.  The classes stand together here, and not with their
owners, because each owner reads the parts of the others (tests/test_one_owner.py holds all to it).
"""

from dataclasses import dataclass
from enum import IntEnum
from math import inf

from acu_daemon.acu.commands import Command
from acu_daemon.acu.replies import AcuIdentity, AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.receiver_signal import ReceiverSignal
from acu_daemon.control.safety.axis_watch import AxesWatch
from acu_daemon.control.safety.encoder_watch import EncoderWatch
from acu_daemon.control.safety.status_plausibility import Plausibility
from acu_daemon.control.safety.turn import TurnWatch
from acu_daemon.control.tick_input import SlaveWish, StowBy
from acu_daemon.control.tracking.lag import LagEstimate
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import Model, Reading
from acu_daemon.pointing.axis import AxisState


class Watchdog(IntEnum):
    """How far the ACU's register watchdog is set."""

    UNKNOWN = 0
    SET = 1
    REFUSED = 2  # this ACU has none: asked once, told once


class StartStage(IntEnum):
    """How far the start has come: poll, identity, registers read, the present angles written and read back."""

    NEW = 0
    IDENTIFIED = 1
    REGISTERS_KNOWN = 2
    SECTOR_FREE = 3
    PRESENT_WRITTEN = 4
    READY = 5


@dataclass(frozen=True, slots=True)
class Intake:
    """The newest status and where it shows the antenna.  Owner: control.intake."""

    status: AcuStatus | None = None
    reading: Reading | None = None
    is_place_sure: bool = False  # the newest statuses agree where the antenna is
    az_deg: float = 0.0  # encoder azimuth of the newest status, in the frame of the wrap (continuous)
    track_of_readings: tuple[tuple[float, float, float], ...] = ()  # the newest: time, continuous azimuth, elevation

    @property
    def el_deg(self) -> float:
        """Elevation of the newest status; 0 before the first."""
        return self.status.el_deg if self.status is not None else 0.0


@dataclass(frozen=True, slots=True)
class Fitting:
    """Which readings are given to the fit.  Owner: control.hear."""

    acquired_since_tai_s: float | None = None
    last_acquired_tai_s: float | None = None
    dwell_count: int = 0  # readings acquired, but not yet for the dwell time
    out_of_step_count: int = 0  # locked readings that may answer an earlier command, one that had no answer in time


@dataclass(frozen=True, slots=True)
class Startup:
    """How far the start has come, and what it learned of the ACU.  Owner: control.startup."""

    stage: StartStage = StartStage.NEW
    identity: AcuIdentity | None = None  # as the ACU said it last
    is_identity_sure: bool = False  # a known one, or said twice
    present_deg: tuple[float, float] | None = None  # the first register write of this start, to be read back
    watchdog: Watchdog = Watchdog.UNKNOWN
    watchdog_from_tai_s: float | None = None  # since when it is tried to set it


@dataclass(frozen=True, slots=True)
class Arming:
    """Whether anything may be commanded, and the STOP that is owed.  Owner: control.safety.arming."""

    by_people: bool | None = None  # as people or another hand at the ACU left it; None: as configured
    disarmed_by: str = ""
    is_stop_due: bool = False  # STOP is sent until it is acknowledged


@dataclass(frozen=True, slots=True)
class Held:
    """The antenna as the daemon had it last, in a mode that follows it or autotracks."""

    has_interlock_fault: bool = False  # the bit with which the ACU's register watchdog shows


@dataclass(frozen=True, slots=True)
class ForeignStop:
    """The antenna that the daemon holds until another hand's STOP.  Owner: control.safety.foreign_stop."""

    held: Held | None = None  # None: it does not hold the antenna; kept through lost links and restarts
    is_doubted: bool = False  # found in STANDBY, by a hand or by the register watchdog: the ACU is asked


@dataclass(frozen=True, slots=True)
class Stowing:
    """Whose stow keeps the antenna from moving, also after a lost link.  Owner: control.safety.stow."""

    stow_by: StowBy = StowBy.NOBODY


@dataclass(frozen=True, slots=True)
class Interlock:
    """What the ACU was asked of its faults.  Owner: control.safety.interlock."""

    faults_read: tuple[bool, ...] | None = None  # the fault bits of the status whose detail was read
    is_watchdog_alone: bool = False  # the detail names no fault but a register watchdog that had tripped


@dataclass(frozen=True, slots=True)
class Latch:
    """How the axes obey, and what latched them.  Owner: control.safety.axis_latch."""

    problem: str = ""  # what an axis did wrong; nothing moves until a person clears it
    axes: AxesWatch = AxesWatch()


@dataclass(frozen=True, slots=True)
class Sent:
    """A register write: the angles sent (continuous azimuth), and whether the lag may be learned from it."""

    az_deg: float
    el_deg: float
    is_free: bool  # followed, well within what the drive can do, and not held back by the limiter


@dataclass(frozen=True, slots=True)
class Registers:
    """What was sent to the registers, and what they hold.  Owner: control.registers."""

    axis_az: AxisState | None = None  # the last command as position and rate, continuous azimuth
    axis_el: AxisState | None = None
    was_followed: bool = False
    last_write_tai_s: float | None = None
    commands: tuple[Sent | None, ...] = ()  # the newest three, oldest first; None: a tick without a write
    in_force: tuple[float, float, float] | None = None  # the last accepted write: time, continuous azimuth, elevation
    goal_az_deg: float | None = None  # where the registers that are followed lead the azimuth, continuous
    refused_tai_s: float = -inf  # the newest refusal of a register write
    refused_until_tai_s: float = -inf


@dataclass(frozen=True, slots=True)
class Refusals:
    """What the daemon itself kept back, counted and told once.  Owner: control.registers."""

    refusal: str = ""  # of the limiter, so that only its change is logged
    refused_input: str = ""  # what the tick was given and is not finite, so that only its change is logged
    limited: str = ""  # which axis is held at its limit; for some seconds after it is not, so that noise tells nothing
    limited_tai_s: float = -inf
    refusal_count: int = 0
    clamped_count: int = 0  # followed writes that the limiter held back to what the axes can do
    limited_count: int = 0  # writes that the limiter held at a limit of an axis


@dataclass(frozen=True, slots=True)
class Asked:
    """The exchange beside the writes that was ordered last.  Owner: control.extra_exchange."""

    command: Command | None = None
    again_tai_s: float = -inf  # until then it is not sent again


@dataclass(frozen=True, slots=True)
class Tracking:
    """The state of the table.  Owner: control.tracking.walk."""

    track: TrackState = TrackState.LINK_LOST
    entered_tai_s: float = -inf
    hold_from_tai_s: float = -inf


@dataclass(frozen=True, slots=True)
class PathOffset:
    """The satellite beside the prediction, smoothed: seconds late, degrees right (control.tracking.track_frame)."""

    along_s: float
    across_deg: float
    model: Model


@dataclass(frozen=True, slots=True)
class Signal:
    """What autotrack has shown of this pass's satellite.  Owner: control.tracking.path_offset."""

    pass_rise_tai_s: float | None = None  # of the pass for which the rest is known
    acquired_since_tai_s: float | None = None
    has_acquired: bool = False
    has_locked: bool = False  # acquired for the dwell time, once at least
    offset: PathOffset | None = None  # carries the path before the first fit
    is_offset_refused: bool = False


@dataclass(frozen=True, slots=True)
class Nudge:
    """What a person moves the path by, late and right positive, and of which model it is; None: of the first one."""

    along_s: float
    across_deg: float
    model: Model | None = None


@dataclass(frozen=True, slots=True)
class ByHand:
    """What a person changes of how this pass is steered.  Owner: control.tracking.by_hand."""

    is_held: bool = False  # autotrack is left for the prediction
    nudge: Nudge | None = None


@dataclass(frozen=True, slots=True)
class Slaved:
    """Where another program leads the antenna.  Owner: control.tracking.slaving."""

    wish: SlaveWish | None = None
    until_tai_s: float = -inf
    has_led: bool = False  # it has come to it: a link that is lost from then on ends it


@dataclass(frozen=True, slots=True)
class Scan:
    """How far SEARCH has come (control.tracking.scan): what each row covers, early to late, s; where it looks now."""

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


@dataclass(frozen=True, slots=True)
class Search:
    """The search in progress, or the last one.  Owner: control.tracking.search."""

    scan: Scan = Scan()
    scanned_tai_s: float = -inf  # the newest reading that the scan has taken


@dataclass(frozen=True, slots=True)
class FalseLock:
    """What autotrack holds beside the satellite.  Owner: control.tracking.false_lock."""

    since_tai_s: float | None = None  # off the path without a break
    count: int = 0  # in this pass
    is_false: bool = False  # long enough: it is to be left


@dataclass(frozen=True, slots=True)
class Lag:
    """The lag from command to encoder, learned per axis.  Owner: control.tracking.learned_lag."""

    az: LagEstimate = LagEstimate()
    el: LagEstimate = LagEstimate()


@dataclass(frozen=True)
class ControlState:
    """The memory of the 10 Hz decision.  Without slots: `with_parts` copies it at once."""

    plausibility: Plausibility = Plausibility()  # owner: control.hear
    fitting: Fitting = Fitting()
    receiver: ReceiverSignal = ReceiverSignal()  # owner: control.hear
    intake: Intake = Intake()
    startup: Startup = Startup()
    arming: Arming = Arming()
    foreign_stop: ForeignStop = ForeignStop()
    stow: Stowing = Stowing()
    interlock: Interlock = Interlock()
    latch: Latch = Latch()
    turn: TurnWatch = TurnWatch()  # owner: control.safety.turn_doubt
    encoders: EncoderWatch = EncoderWatch()  # owner: control.intake
    registers: Registers = Registers()
    refusals: Refusals = Refusals()
    asked: Asked = Asked()
    tracking: Tracking = Tracking()
    signal: Signal = Signal()
    by_hand: ByHand = ByHand()
    slaved: Slaved = Slaved()
    search: Search = Search()
    false_lock: FalseLock = FalseLock()
    lag: Lag = Lag()

    def is_armed(self, config: ControlConfig) -> bool:
        """Whether anything may be written to the ACU."""
        return self.is_armed_by_people(config) and not config.is_resting

    def is_armed_by_people(self, config: ControlConfig) -> bool:
        """Whether people let the daemon command, now or, where it rests, in the next pass."""
        armed = config.is_armed if self.arming.by_people is None else self.arming.by_people
        return armed and not config.is_shadow

    def lag_s(self, config: ControlConfig) -> tuple[float, float]:
        """Learned lag of azimuth and elevation, seconds."""
        phase_s = config.period_s - config.effect_delay_s + config.sample_delay_s
        return self.lag.az.lag_s(phase_s, config.period_s), self.lag.el.lag_s(phase_s, config.period_s)


def remembered(
    *,
    by_people: bool | None,
    disarmed_by: str,
    is_stop_due: bool,
    latch: str,
    held: Held | None,
    stow_by: StowBy,
    by_hand: ByHand = ByHand(),
) -> ControlState:
    """The memory that a run begins with: what people and the antenna have told the one before it.

    by_hand: where the run goes on with a pass.
    """
    return ControlState(
        by_hand=by_hand,
        arming=Arming(by_people, disarmed_by, is_stop_due),
        foreign_stop=ForeignStop(held),
        stow=Stowing(stow_by),
        latch=Latch(latch),
    )
