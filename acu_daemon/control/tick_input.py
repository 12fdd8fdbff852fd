"""What a tick is given: what the ACU said, what people ask, what the background knows.  All frozen."""

from dataclasses import dataclass
from enum import StrEnum

from acu_daemon.acu.commands import Command
from acu_daemon.acu.replies import AcuStatus, Refused, Reply
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.model import FitResult, Prediction, Reading, ZenithCrossing
from acu_daemon.pointing.reach import OutOfReach
from acu_daemon.pointing.turn_plan import Unwinding


class Request(StrEnum):
    """What a person asks of a running daemon."""

    ARM = "arm"
    DISARM = "disarm"
    CLEAR = "clear"
    STOP = "stop"


class StowBy(StrEnum):
    """Whose a stow is.  Who comes later in this list takes one over from those before, who then may not end it."""

    NOBODY = ""
    SCHEDULE = "schedule"  # between passes; the next pass ends it
    WIND = "wind"  # the wind ends it, once it is calm
    PANEL = "panel"  # or another hand at the ACU: whoever stowed it, or a person's word
    OPERATOR = "operator"  # a person's word alone


STOWED_BY_US = frozenset({StowBy.SCHEDULE, StowBy.WIND, StowBy.OPERATOR})  # STOW is this daemon's to send


@dataclass(frozen=True, slots=True)
class StowWish:
    """Stow the antenna, or stow it no more.  by OPERATOR, a stow of anybody is ended."""

    by: StowBy
    is_wanted: bool = True


@dataclass(frozen=True, slots=True)
class HoldWish:
    """Leave autotrack and follow the prediction, or give the antenna back to autotrack."""

    is_wanted: bool = True


@dataclass(frozen=True, slots=True)
class NudgeWish:
    """Move the path: so many seconds late and degrees right of the motion in all; both 0: not at all."""

    along_s: float
    across_deg: float


@dataclass(frozen=True, slots=True)
class SlaveWish:
    """Point the antenna as another program says: encoder angles, azimuth as a bearing; both None: let it stand.

    lasts_s: how long that counts unless it says more; 0: it leads no more.  by: who, for people.
    """

    az_deg: float | None
    el_deg: float | None
    lasts_s: float
    by: str = ""


Asking = Request | StowWish | HoldWish | NudgeWish | SlaveWish


@dataclass(frozen=True, slots=True)
class Exchange:
    """An extra exchange that was tried, and its reply; None when none came in time."""

    command: Command
    reply: Reply | None


@dataclass(frozen=True, slots=True)
class Arrival:
    """A reply, or None at the deadline, and its times: start of the command's write, first byte of the reply.

    is_sure: the reply is to this command, and to none before it that had no answer in time.
    """

    command: Command
    reply: Reply | None
    started_tai_s: float
    first_byte_tai_s: float | None = None
    is_sure: bool = True


@dataclass(frozen=True, slots=True)
class Observation:
    """What the last tick brought."""

    reading: Reading | None = None  # with the status it came from; None: no good reply to the last write or poll
    status: AcuStatus | None = None
    is_confirmed: bool = True  # the place in the status, by those before it
    is_in_step: bool = True  # the reply is sure to be to this exchange: the reading's time is right
    extra: Exchange | None = None
    refused: Refused | None = None  # the ACU refused the register write
    silence_s: float = 0.0
    must_poll: bool = (
        False  # the last exchange failed: the next command is a poll (docs/adding-an-acu.md, Late replies)
    )
    requests: tuple[Asking, ...] = ()
    has_room: bool = True  # the cycle leaves room for an exchange beside the write (docs/adding-an-acu.md, Timing)


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
    learned_count: int = 0  # turns of the azimuth that were learned before it was made
    unwindings: tuple[Unwinding, ...] = ()  # where no turn holds the whole pass: changes of the turn within it
    crossing: ZenithCrossing | None = None  # of the zenith, by the elements
    zenith_turn: int = 0  # 1 or -1: the azimuth rises or falls past the zenith, whichever way the path does; 0: as it
    hidden_tai_s: tuple[tuple[float, float], ...] = ()  # when it is behind the skyline, by its elements
    is_plunged: bool = False  # it begins beyond the zenith, where the antenna was found


@dataclass(frozen=True, slots=True)
class Sky:
    """What the background knows: the buffer, the last fit, the plan."""

    prediction: Prediction | None = None
    fit: FitResult | None = None
    plan: PassPlan | None = None

    @property
    def is_fitted(self) -> bool:
        """Whether the buffer is made from a fit of this pass."""
        return self.prediction is not None and self.prediction.kind == "FITTED"


@dataclass(frozen=True, slots=True)
class TickInput:
    """All that a tick decides from beside its memory and the configuration.

    now_tai_s: the moment the write starts, so that lateness is no pointing error, by the clock that the times of the
    readings and of the sky are of.
    """

    seen: Observation
    sky: Sky
    now_tai_s: float
    signal: SignalSample | None = None  # what a receiver beside the ACU has said since the last tick
