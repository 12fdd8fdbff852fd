"""The common area: the one object that foreground and background share (seed 001, 2.5), and people's view of it."""

from collections import deque
from dataclasses import dataclass, field

from acu_daemon.assist.gate import DWELL
from acu_daemon.assist.model_choice import Model
from acu_daemon.control.refit import GateVerdict
from acu_daemon.control.state import ControlState, Sky
from acu_daemon.model import Reading, Readings


@dataclass(slots=True)
class CommonArea:
    """Last reading, readings to fit, prediction, flags.  The foreground writes all but `sky`, the background that."""

    state: ControlState = field(default_factory=ControlState)
    sky: Sky = field(default_factory=Sky)
    to_fit: deque[Reading] = field(default_factory=deque)  # locked readings the background has not taken yet
    refit_count: int = 0
    refit_failed_count: int = 0
    gate: GateVerdict = GateVerdict()
    model: Model = Model.ELEMENTS
    dwell_count: int = 0  # readings acquired, but not yet for the dwell time

    @property
    def rejected_counts(self) -> dict[str, int]:
        """Readings that no fit has seen, by reason."""
        return {**self.gate.counts, **({DWELL: self.dwell_count} if self.dwell_count else {})}

    def take_readings(self) -> Readings:
        """Hand over the locked readings that wait to be fitted, oldest first."""
        taken = [self.to_fit.popleft() for _ in range(len(self.to_fit))]
        return Readings.of(taken)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything people look at, at one instant."""

    tai_s: float
    state: str
    az_deg: float | None
    el_deg: float | None
    reading_age_s: float | None
    command_az_deg: float | None
    command_el_deg: float | None
    agc_db: float | None
    is_acquired: bool
    miss_deg: float | None  # reading against the prediction, on the sky; only while acquired
    along_s: float | None
    across_deg: float | None
    fit_age_s: float | None
    sigma_deg: float | None  # of the predicted direction now
    inside_s: float | None  # until 3 sigma leave the half-power beam; the buffer's length where they do not
    buffer_s: float
    buffer_kind: str
    lag_az_s: float
    lag_el_s: float
    tick_count: int
    skipped_tick_count: int
    write_count: int
    refusal_count: int
    is_link_up: bool
    link_problem: str
    is_rehearsal: bool
    is_simulation: bool
    lateness_p50_ms: float = 0.0  # of the newest ticks
    lateness_p99_ms: float = 0.0
    lateness_max_ms: float = 0.0
    answered_count: int = 0  # ordered exchanges that the ACU answered
    attempt_count: int = 0  # to open the link
    model: str = ""  # what the prediction is made from
    arming: str = "armed"  # "disarmed", "shadow"
    disarmed_by: str = ""
    latch: str = ""  # what an axis did wrong; cleared by a person
    encoder_problem: str = ""
    clock_alarm: str = ""
    line_alarm: str = ""
    clamped_count: int = 0  # followed writes that the gate held back to what the axes can do
    rejecting: str = ""  # why the newest readings are not fitted
    rejected_counts: dict[str, int] = field(default_factory=dict)  # readings so far, by reason
