"""Takes the snapshot: what the daemon's parts know at one instant, in the words and units of daemon.snapshot."""

from dataclasses import replace
from math import isfinite
from typing import Any

from acu_daemon.acu.commands import STOW_MODES
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.stow import why_not_sent
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import STOWED_BY_US, Sky, StowBy
from acu_daemon.control.tracking.causes import is_tilt_set
from acu_daemon.control.tracking.hills import hidden_until_tai_s, is_hidden
from acu_daemon.control.tracking.off_path import off_path
from acu_daemon.control.tracking.path_offset import is_heard_beside
from acu_daemon.control.tracking.scan import covered_text
from acu_daemon.control.tracking.state_table import ACTIVE, AUTOTRACKING, TRACKING, TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.envelope_watch import look_around
from acu_daemon.daemon.foreground import Foreground
from acu_daemon.daemon.port import AcuPort
from acu_daemon.daemon.snapshot import Snapshot, Subject
from acu_daemon.daemon.verdict import verdict
from acu_daemon.model import Prediction, Reading, sky_angle_deg
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.reach import zenith_text

WANTS_STOW = {
    StowBy.SCHEDULE: "the schedule says so",
    StowBy.WIND: "the wind is strong",
    StowBy.OPERATOR: "a person said so",
}
LATENESS_TICKS = 100  # the newest ten seconds


def take_snapshot(
    area: CommonArea,
    foreground: Foreground,
    port: AcuPort,
    control: ControlConfig,
    now_tai_s: float,
    subject: Subject,
    *,
    is_rehearsal: bool,
    files_alarm: str,
) -> Snapshot:
    """What there is to see now."""
    state, sky, coming = area.state, area.sky, subject.coming
    status, reading, prediction = state.intake.status, state.intake.reading, sky.prediction
    track = state.tracking.track
    lag_az_s, lag_el_s = state.lag_s(control)
    identity, lateness = foreground.identity, foreground.lateness.figures(LATENESS_TICKS)
    off, half_beam_deg = off_path(state, sky), control.beamwidth_deg / 2
    late_s = sky.fit.along_s if sky.fit else 0.0
    around = look_around(state, now_tai_s, control)
    is_acquired = track is not TrackState.LINK_LOST and _is_acquired(state, now_tai_s, control)
    is_behind = not is_acquired and is_hidden(sky, now_tai_s, control)
    until_tai_s = hidden_until_tai_s(sky, now_tai_s) if is_behind else None
    seen = Snapshot(
        tai_s=now_tai_s,
        state=str(track),
        az_deg=status.az_deg if status else None,
        el_deg=status.el_deg if status else None,
        reading_age_s=now_tai_s - reading.tai_s if reading else None,
        command_az_deg=state.registers.axis_az.position_deg if state.registers.axis_az else None,
        command_el_deg=state.registers.axis_el.position_deg if state.registers.axis_el else None,
        agc_db=status.agc_db if status else None,
        search=covered_text(state.search.scan, prediction, control) if state.search.scan.rows else "",
        false_lock_count=state.false_lock.count,
        is_acquired=is_acquired,
        miss_deg=None if track is TrackState.LINK_LOST else _miss_deg(reading, prediction),
        along_s=sky.fit.along_s if sky.fit else None,
        across_deg=sky.fit.across_deg if sky.fit else None,
        fit_age_s=now_tai_s - sky.fit.at_tai_s if sky.fit else None,
        sigma_deg=_sigma_deg(prediction, now_tai_s),
        inside_s=prediction.seconds_inside(now_tai_s, half_beam_deg) if prediction else None,
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
        refusal_count=state.refusals.refusal_count,
        clamped_count=state.refusals.clamped_count,
        limit_alarm=state.refusals.limited,
        limited_count=state.refusals.limited_count,
        turn_alarm=state.turn.alarm,
        arming=_arming(state, control),
        disarmed_by=state.arming.disarmed_by,
        latch=state.latch.problem,
        stow_by=str(state.stow.stow_by),
        stow_alarm=_stow_alarm(state, now_tai_s, control),
        is_held_by_person=state.by_hand.is_held,
        nudge_along_s=state.by_hand.nudge.along_s if state.by_hand.nudge else 0.0,
        nudge_across_deg=state.by_hand.nudge.across_deg if state.by_hand.nudge else 0.0,
        clock_alarm=foreground.clock_watch.alarm,
        line_alarm=foreground.line_watch.alarm,
        files_alarm=files_alarm,
        encoder_problem=state.encoders.problem,
        is_link_up=port.is_up,
        link_problem=port.problem,
        is_rehearsal=is_rehearsal,
        is_simulation=identity is not None and identity.is_simulated,
        model=str(area.model or ""),
        rejecting=area.gate.rejecting if track in AUTOTRACKING else "",
        rejected_counts=area.rejected_counts,
        sun_deg=around.sun_deg,
        sun_reach_s=around.sun_reach_s,
        way_out_az_deg=around.way_out[0] if around.way_out else None,
        way_out_el_deg=around.way_out[1] if around.way_out else None,
        envelope_alarm=around.alarm,
        is_hidden=is_behind,
        hidden_s=None if until_tai_s is None else until_tai_s - now_tai_s,
        slaved_by=state.slaved.wish.by if state.slaved.wish else "",
        slaved_s=state.slaved.until_tai_s - now_tai_s if state.slaved.wish else None,
        **_receiver(state, now_tai_s, control),
        utc=utc_text(now_tai_s, 1),
        satellite=subject.satellite,
        station=subject.station,
        acu=subject.acu,
        elements=subject.elements,
        elements_problem=subject.elements_problem,
        next_passes=subject.next_passes,
        wind=subject.facts.wind,
        phantom=subject.facts.phantom,
        paused_until_utc=subject.facts.paused_until_utc,
        state_s=now_tai_s - state.tracking.entered_tai_s if isfinite(state.tracking.entered_tai_s) else None,
        half_beam_deg=half_beam_deg,
        off_path_deg=off.off_deg if off else None,
        is_on_path=off.off_deg <= half_beam_deg if off else None,
        path=off.made_from if off else "",
        speed_deg_s=foreground.motion.speed_deg_s(now_tai_s),
        acu_mode=status.mode.name if status else "",
        acu_faults=foreground.acu_faults if track is TrackState.FAULT else "",
        is_stopping=state.arming.is_stop_due,
        stop_sent_utc=_utc(foreground.stop_times.sent_tai_s),
        stop_confirmed_utc=_utc(foreground.stop_times.confirmed_tai_s),
        rise_utc=utc_text(coming.rise_tai_s, 0) if coming else "",
        set_utc=utc_text(coming.set_tai_s + late_s, 0) if coming else "",
        rise_in_s=coming.rise_tai_s - now_tai_s if coming else None,
        set_in_s=coming.set_tai_s + late_s - now_tai_s if coming else None,
        culmination_deg=coming.culmination_el_deg if coming else None,
        zenith=_zenith(sky, now_tai_s),
        tilt=_tilt(state, control),
        tilt_alarm=_tilt_alarm(state, sky, now_tai_s, control),
    )
    return replace(seen, verdict=verdict(seen).word)


def _utc(tai_s: float | None) -> str:
    return utc_text(tai_s) if tai_s is not None else ""


def _zenith(sky: Sky, now_tai_s: float) -> str:
    """The crossing that is ahead, by the fit or, before it is in the buffer, by the plan."""
    crossing = sky.prediction.crossing if sky.prediction is not None else None
    crossing = crossing or (sky.plan.crossing if sky.plan is not None else None)
    return zenith_text(crossing) if crossing is not None and now_tai_s < crossing.return_tai_s else ""


def _stow_alarm(state: ControlState, now_tai_s: float, control: ControlConfig) -> str:
    """Of a stow of ours that the status does not show."""
    by, status = state.stow.stow_by, state.intake.status
    if by not in STOWED_BY_US or (status is not None and status.mode in STOW_MODES):
        return ""
    why = why_not_sent(state, now_tai_s, control)
    return f"not stowed, though {WANTS_STOW[by]}: {why}" if why else ""


def _tilt(state: ControlState, control: ControlConfig) -> str:
    """How the pedestal leans, and how it should."""
    status = state.intake.status
    if control.tilt_deg is None or status is None or status.tilt_deg is None:
        return ""
    if is_tilt_set(status, control):
        return f"{control.tilt_deg:+.1f} deg, set"
    return f"{status.tilt_deg:+.1f} deg, {control.tilt_deg:+.1f} asked: the pass waits for it"


def _tilt_alarm(state: ControlState, sky: Sky, now_tai_s: float, control: ControlConfig) -> str:
    """Of a tilt that is not set in time, or does not stay: before the rise there is time, and it is waited for."""
    status, track = state.intake.status, state.tracking.track
    is_up = sky.plan is not None and now_tai_s >= sky.plan.rise_tai_s
    if not is_up or status is None or track not in ACTIVE - {TrackState.SLAVED} or is_tilt_set(status, control):
        return ""
    stands = "the ACU does not read it" if status.tilt_deg is None else f"it is at {status.tilt_deg:+.1f} deg"
    return f"tilt not set for this pass: {control.tilt_deg:+.1f} deg asked, {stands}"


def _arming(state: ControlState, control: ControlConfig) -> str:
    if control.is_shadow:
        return "shadow"
    return "armed" if state.is_armed_by_people(control) else "disarmed"


def _is_acquired(state: ControlState, now_tai_s: float, control: ControlConfig) -> bool:
    """Whether autotrack holds the signal or, in program track, a receiver beside the ACU has it."""
    reading = state.intake.reading
    is_led = state.tracking.track is TrackState.PROGRAM
    return (reading is not None and reading.is_locked) or (is_led and is_heard_beside(state, now_tai_s, control))


def _receiver(state: ControlState, now_tai_s: float, control: ControlConfig) -> dict[str, Any]:
    """What is told by a receiver beside the ACU."""
    receiver, rules = state.receiver, control.receiver
    told: dict[str, Any] = {"is_told_of_signal": control.is_told_of_signal}
    if rules is None:
        return told
    if receiver.known_tai_s is not None:
        told |= {"signal_db": receiver.level_db, "signal_age_s": now_tai_s - receiver.known_tai_s}
    is_of_pass = state.tracking.track in TRACKING and state.signal.has_acquired
    if is_of_pass and receiver.lost_tai_s is not None:
        told["signal_lost_s"] = now_tai_s - receiver.lost_tai_s
    if state.tracking.track in TRACKING and not receiver.is_known(now_tai_s, rules):
        for_s = "" if receiver.known_tai_s is None else f" for {now_tai_s - receiver.known_tai_s:.0f} s"
        told["signal_alarm"] = f"the receiver says nothing of the signal{for_s}"
    return told


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
