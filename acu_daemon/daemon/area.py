"""The common area: the one object that foreground and background share (Aguirre and Medeiros 1988, 2.5)."""

from collections import deque
from dataclasses import dataclass, field

from acu_daemon.assist.reading_gate import DWELL, OUT_OF_STEP
from acu_daemon.assist.session.refit import GateVerdict
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.model import Model, Reading, Readings


@dataclass(slots=True)
class CommonArea:
    """Last reading, readings to fit, prediction, flags.  The foreground writes all but `sky`, the background that."""

    state: ControlState = field(default_factory=ControlState)
    sky: Sky = field(default_factory=Sky)
    to_fit: deque[Reading] = field(default_factory=deque)  # locked readings the background has not taken yet
    refit_count: int = 0
    refit_failed_count: int = 0
    gate: GateVerdict = GateVerdict()

    @property
    def model(self) -> Model | None:
        """What the prediction in force is made from."""
        return self.sky.prediction.model if self.sky.prediction is not None else None

    @property
    def rejected_counts(self) -> dict[str, int]:
        """Readings that no fit has seen, by reason."""
        fitting = self.state.fitting
        here = {DWELL: fitting.dwell_count, OUT_OF_STEP: fitting.out_of_step_count}
        return {**self.gate.counts, **{reason: count for reason, count in here.items() if count}}

    def take_readings(self) -> Readings:
        """Hand over the locked readings that wait to be fitted, oldest first."""
        taken = [self.to_fit.popleft() for _ in range(len(self.to_fit))]
        return Readings.of(taken)
