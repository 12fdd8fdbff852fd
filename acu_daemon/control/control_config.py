"""Everything of the TOML files that the decision of a tick depends on."""

from dataclasses import dataclass, field
from typing import Literal

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.control.receiver_signal import SignalRules
from acu_daemon.control.safety.axis_watch import Bounds
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.envelope import Envelope

ZenithTakeover = Literal["fitted", "always", "never"]


@dataclass(frozen=True, slots=True)
class ControlConfig:
    """Everything of the TOML files that the decision of a tick depends on."""

    envelope: Envelope
    period_s: float = 0.1
    sample_delay_s: float = 0.010  # from the start of a write that brings the status to the sample of its angles
    poll_sample_delay_s: float = 0.010  # the same for a poll
    effect_delay_s: float = 0.020  # start of a write to its effect
    beamwidth_deg: float = 1.0
    lock_dwell_s: float = 1.0
    min_elevation_deg: float = 5.0
    preposition_s: float = 120.0
    acquire_s: float = 60.0
    hold_s: float = 1200.0
    search_s: float = 120.0
    search_along_s: float = 10.0
    search_across_deg: float = 2.0
    zenith_takeover: ZenithTakeover = "fitted"
    leave_false_lock: bool = False
    false_lock_s: float = 3.0
    is_armed: bool = True  # at the start; later as people arm and disarm
    is_shadow: bool = False  # commands nothing, whatever happens
    is_resting: bool = False  # between passes: polls, and commands nothing
    is_rehearsal: bool = False  # commands nothing but an ACU that says it is simulated
    register_watchdog_s: float = 0.0  # what the ACU's is set to; 0: it is not touched
    following: Bounds = Bounds()
    acu: Capabilities = Capabilities()
    response_time_s: float = 60.0  # an antenna that may not be moved, and that the sun reaches within it, is an alarm
    has_signal: bool = True  # autotrack gives one; else a pass is flown by program track
    receiver: SignalRules | None = None  # of a receiver beside the ACU; None: there is none that tells
    tilt_deg: float | None = None  # of the pedestal in this pass; None: it has no tilt that is moved
    tilt: AxisLimits | None = None
    clock_alarm_deg: float = 0.1  # an error of UTC counts from here on, at the sky's present rate
    azimuth: AxisLimits = field(init=False)  # the envelope's
    elevation: AxisLimits = field(init=False)

    @property
    def is_told_of_signal(self) -> bool:
        """Whether anybody tells of the signal, the ACU or a receiver beside it."""
        return self.has_signal or self.receiver is not None

    def __post_init__(self) -> None:
        object.__setattr__(self, "azimuth", self.envelope.azimuth)
        object.__setattr__(self, "elevation", self.envelope.elevation)
