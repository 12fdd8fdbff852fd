"""What a replay of a recording shows, gathered for the report of its pass.  Nothing is computed here that costs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf
from typing import Any

from acu_daemon.acu.commands import AcuMode, command_text
from acu_daemon.acu.replies import AcuStatus, Refused
from acu_daemon.assist.session.refit import RefitReply, RefitRequest
from acu_daemon.control.hear import Heard
from acu_daemon.control.orders import Event, Orders
from acu_daemon.control.tick_input import Arrival, PassPlan
from acu_daemon.daemon.area import CommonArea
from acu_daemon.edge.tape import Record
from acu_daemon.model import FitResult, Prediction, Readings, sky_angle_deg

LONGEST_GAP_S = 0.2  # between two readings that stands for time seen


@dataclass(frozen=True, slots=True)
class SeenReading:
    """A reading as the daemon had it, and how far from the path of that moment it was.

    has_signal: the receiver has one, in any mode; is_acquired: autotrack holds it.  off_path_deg None: no path.
    """

    tai_s: float
    az_deg: float
    el_deg: float
    has_signal: bool
    is_acquired: bool
    agc_db: float | None
    state: str
    off_path_deg: float | None
    sigma_deg: float | None


def seconds_where(readings: Sequence[SeenReading], is_so: Callable[[SeenReading], bool]) -> float:
    """How long something was so, of readings in their order; a gap counts as a tick or two."""
    return sum((min(b.tai_s - a.tai_s, LONGEST_GAP_S) for a, b in pairwise(readings) if is_so(a)), 0.0)


@dataclass(frozen=True, slots=True)
class SeenFit:
    """A fit, and what it is worth at its time: seconds along the track and degrees across it, 1 sigma."""

    tai_s: float
    fit: FitResult
    spread: tuple[float, float] | None


@dataclass
class PassWatch:
    """Looks on while a recording is replayed."""

    ticks_tai_s: list[float] = field(default_factory=list)
    states: list[tuple[float, str]] = field(default_factory=list)  # each change
    readings: list[SeenReading] = field(default_factory=list)
    fitted_readings: list[Readings] = field(default_factory=list)  # what the fit was given
    fits: list[SeenFit] = field(default_factory=list)
    events: list[tuple[float, Event]] = field(default_factory=list)
    refused: list[tuple[float, str, str]] = field(default_factory=list)  # when, command, why
    latencies_s: list[tuple[float, float]] = field(default_factory=list)
    unanswered_count: int = 0
    notes: list[tuple[float, Record]] = field(default_factory=list)
    plan: PassPlan | None = None
    prediction: Prediction | None = None
    area: CommonArea | None = None

    def since(self, tai_s: float) -> "PassWatch":
        """The same without what the line and the states showed before an instant."""
        return replace(
            self,
            states=[
                (max(at, tai_s), state) for (at, state), (end, _) in pairwise([*self.states, (inf, "")]) if end > tai_s
            ],
            readings=[one for one in self.readings if one.tai_s >= tai_s],
            latencies_s=[one for one in self.latencies_s if one[0] >= tai_s],
        )

    def ticked(self, area: CommonArea, now_tai_s: float, orders: Orders) -> None:
        """A tick was decided."""
        self.area = area
        self.ticks_tai_s.append(now_tai_s)
        state = str(area.state.tracking.track)
        if not self.states or self.states[-1][1] != state:
            self.states.append((now_tai_s, state))
        self.events += [(now_tai_s, event) for event in orders.events]
        self.plan = self.plan or area.sky.plan
        self.prediction = area.sky.prediction or self.prediction

    def heard(self, heard: Heard, arrival: Arrival, latency_s: float) -> None:
        """A reply was taken in."""
        reply = arrival.reply
        if reply is None:
            self.unanswered_count += 1
            return
        self.latencies_s.append((arrival.started_tai_s, latency_s))
        if isinstance(reply, Refused):
            self.refused.append((arrival.started_tai_s, command_text(arrival.command), reply.why))
        reading = heard.reading
        if reading is None or not isinstance(reply, AcuStatus):
            return
        point = self.prediction.at(reading.tai_s) if self.prediction is not None else None
        off_deg = None
        if point is not None:
            off_deg = sky_angle_deg(reading.az_deg, reading.el_deg, point.az_deg, point.el_deg)
        has_signal = reply.is_acquired and reply.mode is not AcuMode.STANDBY
        self.readings.append(
            SeenReading(
                reading.tai_s,
                reading.az_deg,
                reading.el_deg,
                has_signal,
                reading.is_locked,
                reading.agc_db,
                self.states[-1][1] if self.states else "",
                off_deg,
                self._sigma_deg(reading.tai_s),
            )
        )

    def _sigma_deg(self, tai_s: float) -> float | None:
        buffer = self.prediction
        if buffer is None or buffer.sigma_deg is None:
            return None
        k = round((tai_s - buffer.start_tai_s) / buffer.step_s)
        return float(buffer.sigma_deg[k]) if 0 <= k < buffer.sigma_deg.size else None

    def fitted(self, request: RefitRequest, reply: RefitReply) -> None:
        """A fit has answered."""
        if len(request.readings):
            self.fitted_readings.append(request.readings)
        if reply.fit is not None:
            self.fits.append(SeenFit(request.now_tai_s, reply.fit, reply.prediction.spread))

    def told(self, record: Record, now_tai_s: float) -> None:
        """A record of the line, the clock, the fit's troubles, or a fact for the report."""
        if record[0] in "LCIEZ":
            self.notes.append((now_tai_s, record))

    @property
    def facts(self) -> list[tuple[str, Any]]:
        """What was noted for the report alone, by name."""
        return [(record[1], record[2]) for _, record in self.notes if record[0] == "I"]
