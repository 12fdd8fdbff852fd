"""Which causes of a transition are present now (control.tracking.state_table has the table they drive)."""

from dataclasses import replace
from math import cos, hypot, inf, radians

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.stow import keeps_stowed
from acu_daemon.control.state import ControlState, StartStage
from acu_daemon.control.tick_input import Sky, TickInput
from acu_daemon.control.tracking.approach import ACQUIRE_LEAD_S, lead_s
from acu_daemon.control.tracking.hills import came_out_tai_s, is_hidden
from acu_daemon.control.tracking.pass_plan import pass_end_tai_s
from acu_daemon.control.tracking.register_limiter import within_limits
from acu_daemon.control.tracking.state_table import HOLDING, LED, Cause, TrackState
from acu_daemon.control.tracking.track_frame import extents, is_within, offset_of, three_sigma_of
from acu_daemon.control.tracking.zone_watch import nears_zone
from acu_daemon.model import Model, Pointing, sky_angle_deg
from acu_daemon.pointing.keyhole import TAKEOVER_RATES
from acu_daemon.pointing.tilt import SET_DEG
from acu_daemon.pointing.wrap import nearest_turn

ON_POINT_BEAMS = 0.25
HEARD_BEAMS = 1.0  # a signal that is heard so near to the path is the satellite's
RESUME_DEG = 5.0  # an antenna this near to the path goes on from an interruption without a new approach
BEFORE = frozenset({TrackState.IDLE, TrackState.PREPOSITION})  # only there it matters where the antenna stands
TO_AUTOTRACK = frozenset({Cause.ON_POINT, Cause.ON_POINT_FITTED, Cause.STILL_FITTED, Cause.STILL_SELECTED})
TAKEOVER_S, GIVE_BACK_S = 2.0, 0.5  # before the departure, and after the return: a crossing of the zenith
# on the path, before a search: where the prediction is not sure to be within the beam; longer where a glimpse was had
GLANCE_S = {TrackState.ACQUIRE_TLE: 3.0, TrackState.HOLD_TLE: 10.0}
LEAVING_S = 15.0  # after a false lock; then autotrack is selected wherever the antenna is
CHANGED_S = 3.0  # by which a fit may put off a crossing that the antenna was taken over for
MODE_SETTLE_S = 3.0  # a selected mode takes a moment to show; only later is a left mode the ACU's own doing


def find_causes(state: ControlState, given: TickInput, config: ControlConfig) -> set[Cause]:
    """All causes that are present; the table decides which of them matters."""
    status = state.intake.status
    if given.seen.silence_s > config.acu.silence_s or status is None:
        return {Cause.LINK_SILENT}
    if state.latch.problem:
        return {Cause.LINK_BACK, Cause.LATCHED}
    causes = {Cause.LINK_BACK} | _of_status(status, is_stowed=keeps_stowed(state, given.now_tai_s, config))
    if not state.is_armed(config):
        return causes | _of_others(state, status, given, config)
    if state.startup.stage is StartStage.READY:
        causes |= _of_signal(state, status, given, config)
        causes |= _of_plan(state, status, given, config)
        causes |= _of_time(state, status, given, config)
        causes |= _of_zenith(state, given, config)
        causes |= _of_hand(state, given.sky, config)
        causes.add(Cause.SLAVED if state.slaved.wish is not None else Cause.SLAVE_OVER)
        causes |= _of_false_lock(state, status, given, config)
        causes = _of_zones(causes, state, given, config)
    return causes


def _of_zones(causes: set[Cause], state: ControlState, given: TickInput, config: ControlConfig) -> set[Cause]:
    """Before a keep-out no mode is gone back to that follows the signal."""
    if not config.envelope.has_zones:
        return causes
    if not nears_zone(state, given.sky, given.now_tai_s, config):
        return causes | {Cause.KEEP_OUT_PAST}
    return causes - TO_AUTOTRACK | {Cause.KEEP_OUT}


def _of_false_lock(state: ControlState, status: AcuStatus, given: TickInput, config: ControlConfig) -> set[Cause]:
    """Whether what autotrack holds is to be left, or has been."""
    causes = {Cause.LOCK_FALSE} if state.false_lock.is_false else set()
    if state.tracking.track is TrackState.FALSE_LOCK:
        path = path_point(given.sky, given.now_tai_s)
        is_on = path is not None and _distance_deg(state, status, path) < ON_POINT_BEAMS * config.beamwidth_deg
        if is_on or given.now_tai_s - state.tracking.entered_tai_s > LEAVING_S:
            causes.add(Cause.BACK_ON_PATH)
    return causes


def _of_hand(state: ControlState, sky: Sky, config: ControlConfig) -> set[Cause]:
    """Whether a person wants the prediction followed; without a signal it is followed as ever."""
    if not config.has_signal:
        return set()
    if state.by_hand.is_held:
        return {Cause.HELD}
    return {Cause.RELEASED_FITTED if sky.is_fitted else Cause.RELEASED}


def _of_zenith(state: ControlState, given: TickInput, config: ControlConfig) -> set[Cause]:
    """Whether the antenna is to be led past the zenith, because its azimuth drive cannot follow there, or is past it.

    Autotrack would follow until after culmination, too late for any way; and a signal that is heard on the way would
    catch an antenna that is only backed up.
    """
    sky, now_tai_s = given.sky, given.now_tai_s
    crossing = sky.prediction.crossing if sky.prediction is not None else None
    begin_tai_s, end_tai_s = inf, -inf
    if crossing is not None:
        begin_tai_s, end_tai_s = crossing.departure_tai_s - TAKEOVER_S, crossing.return_tai_s + GIVE_BACK_S
    if state.tracking.track is TrackState.ZENITH:
        past = Cause.ZENITH_PAST_FITTED if sky.is_fitted else Cause.ZENITH_PAST
        return set() if begin_tai_s - CHANGED_S <= now_tai_s < end_tai_s else {past}
    if crossing is None or not begin_tai_s <= now_tai_s < end_tai_s - 2.0 * GIVE_BACK_S:
        return set()
    is_too_fast = crossing.peak_rate_deg_s > TAKEOVER_RATES * config.azimuth.max_rate_deg_s
    return {Cause.ZENITH_NEAR} if may_lead_past_zenith(sky, config) and is_too_fast else set()


def may_lead_past_zenith(sky: Sky, config: ControlConfig) -> bool:
    """Whether autotrack may be left for the way past the zenith."""
    return config.zenith_takeover == "always" or (config.zenith_takeover == "fitted" and sky.is_fitted)


def _of_others(state: ControlState, status: AcuStatus, given: TickInput, config: ControlConfig) -> set[Cause]:
    """What the ACU does under somebody else's hand, while the daemon is disarmed or in shadow."""
    if not status.is_autotrack_selected:
        return {Cause.HANDS_OFF}
    causes = _of_signal(state, status, given, config)
    still = {Cause.PASS_OVER, Cause.STILL_SELECTED, Cause.STILL_FITTED}
    return causes | (_of_plan(state, status, given, config) & still)


def _of_status(status: AcuStatus, *, is_stowed: bool) -> set[Cause]:
    is_local = not status.is_remote_enabled or status.mode is AcuMode.MANUAL
    causes = {Cause.LOCAL_PANEL if is_local else Cause.REMOTE_AGAIN}
    causes.add(Cause.ACU_FAULT if status.mode is AcuMode.FAULT else Cause.FAULT_GONE)
    causes.add(Cause.STOWING if is_stowed else Cause.STOW_LEFT)
    return causes


def is_acquired(status: AcuStatus) -> bool:
    """Whether autotrack holds a signal: AUTOTRACK with ACQ set."""
    return status.mode is AcuMode.AUTOTRACK and status.is_acquired


def _of_signal(state: ControlState, status: AcuStatus, given: TickInput, config: ControlConfig) -> set[Cause]:
    sky = given.sky
    causes: set[Cause] = set()
    if sky.prediction is not None:
        causes.add(Cause.FIT if sky.is_fitted else Cause.FIT_LEFT)
    if not config.has_signal:
        return causes
    if is_acquired(status):
        if is_tilt_set(status, config) and _is_ours(state, status, given, config):
            causes.add(Cause.ACQUIRED_FITTED if sky.is_fitted else Cause.ACQUIRED)
        if sky.is_fitted and state.tracking.track is TrackState.HOLD_FITTED:
            causes.add(Cause.ACQUIRED)
    else:
        causes.add(Cause.LOST)
        if is_hidden(sky, given.now_tai_s, config):
            causes |= {Cause.HIDDEN, Cause.HIDDEN_FITTED} if sky.is_fitted else {Cause.HIDDEN}
    return causes


def _is_ours(state: ControlState, status: AcuStatus, given: TickInput, config: ControlConfig) -> bool:
    """Whether what autotrack holds can be this pass: late enough, and where it was found so, near the path."""
    sky, now_tai_s = given.sky, given.now_tai_s
    if sky.plan is None or now_tai_s < sky.plan.rise_tai_s - ACQUIRE_LEAD_S:
        return False
    if state.tracking.track not in BEFORE:
        return True
    target = path_point(sky, now_tai_s)
    if target is None or not target.is_finite:
        return True
    if sky.prediction is None or _distance_deg(state, status, target) < RESUME_DEG:
        return True
    return is_within(
        offset_of(sky.prediction, now_tai_s, state.intake.az_deg, status.el_deg), extents(sky.prediction, config)
    )


def _of_plan(state: ControlState, status: AcuStatus, given: TickInput, config: ControlConfig) -> set[Cause]:
    sky, plan, now_tai_s = given.sky, given.sky.plan, given.now_tai_s
    if plan is None:
        return set()
    if now_tai_s > pass_end_tai_s(plan, sky):
        return {Cause.PASS_OVER}
    causes: set[Cause] = set()
    if sky.prediction is not None and now_tai_s >= plan.rise_tai_s - lead_s(plan, state, config):
        causes.add(Cause.PASS_NEAR)
    is_set = is_tilt_set(status, config)
    if is_set and state.tracking.track in BEFORE and now_tai_s >= plan.rise_tai_s - ACQUIRE_LEAD_S:
        target = path_point(sky, now_tai_s)
        if target is not None and target.is_finite:
            is_in_pass = now_tai_s >= plan.rise_tai_s
            causes |= _of_place(state, status, sky, _reached(target, state, config), config, is_in_pass=is_in_pass)
    return causes


def _reached(target: Pointing, state: ControlState, config: ControlConfig) -> Pointing:
    """As near to the path as the limits of the axes allow."""
    az_deg = nearest_turn(target.az_deg, target.az_deg, config.azimuth)
    target = target if az_deg is None else replace(target, az_deg=az_deg)
    return within_limits(target, state.intake.az_deg, config)[0]


def _of_place(
    state: ControlState, status: AcuStatus, sky: Sky, target: Pointing, config: ControlConfig, *, is_in_pass: bool
) -> set[Cause]:
    """How near the antenna is to the path, once a signal may come.

    Not the same bearing on another turn of the wrap; but in the pass a signal from there is taken on any turn, without
    a move first: which turn is the true one may be in doubt.
    """
    distance_deg = _distance_deg(state, status, target)
    is_on_turn = abs(state.intake.az_deg - target.az_deg) < 90.0
    is_there = status.mode is AcuMode.REMOTE and is_on_turn and distance_deg < ON_POINT_BEAMS * config.beamwidth_deg
    is_heard = is_in_pass and not is_on_turn and status.is_acquired and status.mode in (AcuMode.REMOTE, AcuMode.STANDBY)
    causes: set[Cause] = set()
    if not config.has_signal or state.by_hand.is_held:
        is_on_path = is_on_turn and distance_deg <= config.beamwidth_deg / 2 + config.acu.dead_band_deg
        return {Cause.ON_PROGRAM} if is_on_path and status.mode is AcuMode.REMOTE else set()
    if is_there or (is_heard and distance_deg < HEARD_BEAMS * config.beamwidth_deg):
        causes.add(Cause.ON_POINT_FITTED if sky.is_fitted else Cause.ON_POINT)
    if distance_deg < RESUME_DEG:
        if sky.is_fitted:
            causes.add(Cause.STILL_FITTED)
        if status.is_autotrack_selected and status.follows_registers:
            causes.add(Cause.STILL_SELECTED)
    return causes


def is_tilt_set(status: AcuStatus, config: ControlConfig) -> bool:
    """Whether the pedestal leans as this pass asks, by what the ACU reads, and stands still: else no path is true."""
    if config.tilt_deg is None:
        return True
    return (
        status.tilt_deg is not None and not status.is_tilt_moving and abs(status.tilt_deg - config.tilt_deg) <= SET_DEG
    )


def path_point(sky: Sky, tai_s: float, *, follow: bool = True) -> Pointing | None:
    """The path at an instant; before the rise it stands still at the rise point."""
    if sky.prediction is not None and (sky.plan is None or tai_s >= sky.plan.start_tai_s):
        return sky.prediction.at(tai_s, follow=follow)
    if sky.plan is not None:
        return Pointing(sky.plan.start_az_deg, sky.plan.start_el_deg, 0.0, 0.0)
    return None


def _distance_deg(state: ControlState, status: AcuStatus, target: Pointing) -> float:
    """Angle on the sky between antenna and path, less what the path moved since the reading."""
    lag_deg = 0.15 * hypot(target.az_rate_deg_s * cos(radians(target.el_deg)), target.el_rate_deg_s)
    return sky_angle_deg(state.intake.az_deg, status.el_deg, target.az_deg, target.el_deg) - lag_deg


def _unsure_s(sky: Sky, now_tai_s: float, config: ControlConfig) -> float | None:
    """3 sigma along the track, s, where the prediction is not sure to lie within half a beam; None where it is."""
    three_sigma, path = three_sigma_of(sky.prediction), path_point(sky, now_tai_s)
    if three_sigma is None or path is None or not path.is_finite or sky.prediction is None:
        return None
    at_rise = sky.prediction.at(max(now_tai_s, sky.prediction.start_tai_s)) or path
    speed_deg_s = hypot(at_rise.az_rate_deg_s * cos(radians(at_rise.el_deg)), at_rise.el_rate_deg_s)
    off_deg = max(three_sigma[0] * speed_deg_s, three_sigma[1])
    return three_sigma[0] if off_deg > config.beamwidth_deg / 2.0 else None


def _of_time(state: ControlState, status: AcuStatus, given: TickInput, config: ControlConfig) -> set[Cause]:
    sky, now_tai_s, track = given.sky, given.now_tai_s, state.tracking.track
    in_state_s = now_tai_s - state.tracking.entered_tai_s
    causes: set[Cause] = set()
    is_led = track in LED and status.mode is AcuMode.REMOTE
    is_left = not status.is_autotrack_selected and status.mode in (AcuMode.STANDBY, AcuMode.REMOTE) and not is_led
    if is_left and in_state_s > MODE_SETTLE_S:
        causes.add(Cause.MODE_LEFT)
    early_s = _unsure_s(sky, now_tai_s, config) if track in GLANCE_S else None
    patience_s = config.acquire_s if early_s is None else min(config.acquire_s, GLANCE_S[track])
    if track is TrackState.ACQUIRE_TLE and sky.plan is not None:
        is_carried = sky.prediction is not None and sky.prediction.model is Model.LAST_PASS
        begins_tai_s = came_out_tai_s(sky, now_tai_s) - (min(early_s or 0.0, ACQUIRE_LEAD_S) if is_carried else 0.0)
        waiting_s = now_tai_s - max(state.tracking.entered_tai_s, begins_tai_s)
        if waiting_s > patience_s and not is_hidden(sky, now_tai_s, config):
            causes.add(Cause.ACQUIRE_OVER)
    is_glimpse = track is TrackState.HOLD_TLE and not state.signal.has_locked  # nothing worth a long hold
    hold_s = min(config.hold_s, patience_s) if is_glimpse else config.hold_s
    if track in HOLDING and now_tai_s - state.tracking.hold_from_tai_s > hold_s:
        causes.add(Cause.HOLD_OVER)
    if track is TrackState.SEARCH and in_state_s > config.search_s:
        causes.add(Cause.SEARCH_OVER_FITTED if sky.is_fitted else Cause.SEARCH_OVER)
    return causes
