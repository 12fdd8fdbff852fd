"""The snapshot: everything people look at, at one instant.  Live line, status and the watchdog's food come from it."""

from dataclasses import dataclass, field

from acu_daemon.control.search import covered_text
from acu_daemon.control.state import ControlConfig, ControlState
from acu_daemon.control.states import AUTOTRACKING, TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.foreground import Foreground
from acu_daemon.daemon.port import AcuPort
from acu_daemon.model import Prediction, Reading, sky_angle_deg

LATENESS_TICKS = 100  # the newest ten seconds


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
    turn_alarm: str = ""  # an azimuth that comes no nearer to its goal, a sector bit that is wrong
    files_alarm: str = ""  # what cannot be written: recording, state
    limit_alarm: str = ""  # which axis is held at its limit: the satellite is beyond it
    limited_count: int = 0  # writes that were held at a limit
    clamped_count: int = 0  # followed writes that the gate held back to what the axes can do
    search: str = ""  # what SEARCH has covered so far
    rejecting: str = ""  # why the newest readings are not fitted
    rejected_counts: dict[str, int] = field(default_factory=dict)  # readings so far, by reason


def take_snapshot(
    area: CommonArea,
    foreground: Foreground,
    port: AcuPort,
    control: ControlConfig,
    now_tai_s: float,
    *,
    is_rehearsal: bool,
    files_alarm: str,
) -> Snapshot:
    """What there is to see now."""
    state, sky = area.state, area.sky
    status, reading, prediction = state.status, state.reading, sky.prediction
    lag_az_s, lag_el_s = state.lag_s(control)
    identity, lateness = foreground.identity, foreground.lateness.figures(LATENESS_TICKS)
    return Snapshot(
        tai_s=now_tai_s,
        state=str(state.track),
        az_deg=status.az_deg if status else None,
        el_deg=status.el_deg if status else None,
        reading_age_s=now_tai_s - reading.tai_s if reading else None,
        command_az_deg=state.axis_az.position_deg if state.axis_az else None,
        command_el_deg=state.axis_el.position_deg if state.axis_el else None,
        agc_db=status.agc_db if status else None,
        search=covered_text(state.scan, prediction, control) if state.scan.rows else "",
        is_acquired=state.track is not TrackState.LINK_LOST and reading is not None and reading.is_locked,
        miss_deg=None if state.track is TrackState.LINK_LOST else _miss_deg(reading, prediction),
        along_s=sky.fit.along_s if sky.fit else None,
        across_deg=sky.fit.across_deg if sky.fit else None,
        fit_age_s=now_tai_s - sky.fit.at_tai_s if sky.fit else None,
        sigma_deg=_sigma_deg(prediction, now_tai_s),
        inside_s=prediction.seconds_inside(now_tai_s, control.beamwidth_deg / 2) if prediction else None,
        buffer_s=max(0.0, prediction.end_tai_s - now_tai_s) if prediction else 0.0,
        buffer_kind=prediction.kind if prediction else "",
        lag_az_s=lag_az_s,
        lag_el_s=lag_el_s,
        tick_count=foreground.tick_count,
        skipped_tick_count=foreground.skipped_tick_count,
        lateness_p50_ms=lateness.p50_ms,
        lateness_p99_ms=lateness.p99_ms,
        lateness_max_ms=lateness.max_ms,
        write_count=foreground.write_count,
        answered_count=foreground.answered_count,
        attempt_count=port.attempt_count,
        refusal_count=state.gate_refusal_count,
        clamped_count=state.gate_clamped_count,
        limit_alarm=state.limited,
        limited_count=state.gate_limited_count,
        turn_alarm=state.turn.alarm,
        arming=_arming(state, control),
        disarmed_by=state.disarmed_by,
        latch=state.latch,
        clock_alarm=foreground.clock_watch.alarm,
        line_alarm=foreground.line_watch.alarm,
        files_alarm=files_alarm,
        encoder_problem=state.encoders.problem,
        is_link_up=port.is_up,
        link_problem=port.problem,
        is_rehearsal=is_rehearsal,
        is_simulation=identity is not None and identity.is_simulated,
        model=str(area.model or ""),
        rejecting=area.gate.rejecting if state.track in AUTOTRACKING else "",
        rejected_counts=area.rejected_counts,
    )


def _arming(state: ControlState, control: ControlConfig) -> str:
    if control.is_shadow:
        return "shadow"
    return "armed" if state.is_armed(control) else "disarmed"


def _miss_deg(reading: Reading | None, prediction: Prediction | None) -> float | None:
    if reading is None or not reading.is_locked or prediction is None:
        return None
    point = prediction.at(reading.tai_s)
    if point is None:
        return None
    return sky_angle_deg(reading.az_deg, reading.el_deg, point.az_deg, point.el_deg)


def _sigma_deg(prediction: Prediction | None, tai_s: float) -> float | None:
    if prediction is None or prediction.sigma_deg is None:
        return None
    i = round((tai_s - prediction.start_tai_s) / prediction.step_s)
    return float(prediction.sigma_deg[min(max(i, 0), prediction.sigma_deg.size - 1)])
