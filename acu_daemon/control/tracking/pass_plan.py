"""The plan of a pass: where to stand, on which turn of the wrap, when it is due, and when the pass ends.  Pure."""

from dataclasses import dataclass, replace
from functools import partial
from math import isfinite

import numpy as np

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.session.prediction import predict
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import PassPlan, Sky
from acu_daemon.control.tracking.approach import ACQUIRE_LEAD_S, way_s
from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.model import AxisLimits, Pass, Site, ZenithCrossing
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keyhole import KeyholeRules, longest_window_s, turned_past_zenith
from acu_daemon.pointing.outage import KeptOut, SunOutage, kept_out, sun_outages
from acu_daemon.pointing.plunge import PLUNGED_DEG
from acu_daemon.pointing.reach import OutOfReach, out_of_reach
from acu_daemon.pointing.turn_plan import TurnAsk, TurnPlan, plan_turns
from acu_daemon.pointing.wrap import choose_turn, judged, middle_deg
from acu_daemon.units import Array

PASS_OVER = "pass over"
STEERED = AUTOTRACKING | {TrackState.PROGRAM}
COARSE_STEP_S, MOST_STEPS = 0.5, 20000  # of these a tenth of a second's work, in the loop
ANY_ELEVATION = AxisLimits(-90.0, 180.0, 1.0, 1.0)
LEAST_KEYHOLE_EL_DEG, MOST_AROUND_S = 60.0, 400.0  # lower, and slower, no drive crosses the zenith in a window
OVER_S = 15.0  # about the zenith a plunging antenna's azimuth does not follow the path's
STEP_S = 0.25  # fine enough to unwrap the azimuth of a pass 0.1 deg from the zenith


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """What a pass is planned from, beside its orbit and site; fields as the arguments of `plan_pass`."""

    coming: Pass
    present_az_deg: float
    present_el_deg: float
    envelope: Envelope
    now_tai_s: float
    learned_count: int
    keyhole: KeyholeRules


@dataclass(frozen=True, slots=True)
class PlanAnswer:
    """A plan, and what people should know of the pass beside it."""

    plan: PassPlan
    sun: tuple[SunOutage, ...] = ()
    keep_outs: tuple[KeptOut, ...] = ()


def planned_pass(propagator: Propagator, site: Site, asked: PlanRequest) -> PlanAnswer:
    """Plan a pass and look at what is in its way: all that the fit process is asked for before a pass.

    Raises: OrbitError: the propagator has no answer for a time of the pass.
    """
    envelope, coming = asked.envelope, asked.coming
    plan = plan_pass(
        *(propagator, site, coming, asked.present_az_deg, envelope.azimuth, asked.now_tai_s),
        elevation=envelope.elevation,
        learned_count=asked.learned_count,
        keyhole=asked.keyhole,
        present_el_deg=asked.present_el_deg,
    )
    sun = sun_outages(propagator, site, envelope.sun, coming)
    return PlanAnswer(plan, sun, kept_out(propagator, site, envelope.keep_outs, coming))


def plan_pass(
    propagator: Propagator,
    site: Site,
    coming: Pass,
    present_az_deg: float,
    azimuth: AxisLimits,
    now_tai_s: float,
    *,
    elevation: AxisLimits = ANY_ELEVATION,
    learned_count: int = 0,
    keyhole: KeyholeRules | None = None,
    present_el_deg: float = 0.0,
) -> PassPlan:
    """Choose the turns that cost least of what is left of the pass, and the point where the antenna waits for it.

    present_az_deg: where the antenna stands, continuous azimuth in the encoder frame.
    learned_count: turns of the azimuth that were learned so far.  keyhole: what the antenna can do near the zenith;
    then the plan says what that costs.
    """
    start_tai_s = min(max(coming.rise_tai_s, now_tai_s), coming.set_tai_s - 1.0)
    step_s = max(STEP_S, (coming.set_tai_s - start_tai_s) / MOST_STEPS)  # one that does not set lasts for days
    tai_s = np.arange(start_tai_s, coming.set_tai_s + step_s, step_s)
    is_past_top = start_tai_s >= coming.culmination_tai_s
    is_plunged = keyhole is not None and keyhole.may_plunge and is_past_top and present_el_deg > PLUNGED_DEG
    look = encoder_look(propagator, tai_s, site, None, is_plunged=is_plunged)
    az_deg, el_deg = np.degrees(np.unwrap(np.radians(look.az_deg))), look.el_deg
    is_seen = np.ones(tai_s.size, dtype=np.bool_)
    for from_tai_s, to_tai_s in coming.hidden_tai_s:
        is_seen &= (tai_s < from_tai_s) | (tai_s > to_tai_s)

    def on_turns(az_deg: Array) -> TurnPlan:
        ask = (tai_s, az_deg, is_seen, azimuth, present_az_deg, now_tai_s)
        return plan_turns(
            TurnAsk(
                *ask,
                way_s=partial(way_s, axis=azimuth),
                is_either_way=lambda offset_deg: judged(offset_deg, az_deg, el_deg, azimuth).holds_either_way,
            )
        )

    def crossing_of(az_deg: Array, zenith_turn: int) -> ZenithCrossing | None:
        return _crossing(propagator, site, coming, (tai_s, az_deg), keyhole, zenith_turn)

    turns, zenith_turn = on_turns(az_deg), 0
    crossing = crossing_of(az_deg + turns.offset_deg, 0)
    if crossing is not None and crossing.is_plunge:
        az_deg, el_deg = _beyond_top(propagator, tai_s, site, az_deg, el_deg)
        before_deg, turns = turns.offset_deg, on_turns(az_deg)
        departure_az_deg = crossing.departure_az_deg + turns.offset_deg - before_deg
        crossing = replace(crossing, departure_az_deg=departure_az_deg)
    elif turns.unwindings and crossing is not None:
        rising = 1 if az_deg[-1] > az_deg[0] else -1
        other_az_deg = turned_past_zenith(az_deg, np.gradient(az_deg, step_s), -rising)
        is_crossing = (tai_s > crossing.departure_tai_s) & (tai_s < crossing.return_tai_s)
        other_az_deg[is_crossing] = np.interp(tai_s[is_crossing], tai_s[~is_crossing], other_az_deg[~is_crossing])
        others = on_turns(other_az_deg)
        other = crossing_of(other_az_deg + others.offset_deg, -rising)
        if not others.unwindings and other is not None and other.lost_s < crossing.lost_s + turns.unwinding_s:
            turns, zenith_turn, crossing, az_deg = others, -rising, other, other_az_deg
    turn = judged(turns.offset_deg, az_deg, el_deg, azimuth)
    return PassPlan(
        rise_tai_s=coming.rise_tai_s,
        set_tai_s=coming.set_tai_s,
        start_tai_s=start_tai_s,
        start_az_deg=float(az_deg[0]) + turn.offset_deg,
        start_el_deg=float(el_deg[0]),
        note="" if turn.holds_path else turn.reason,
        beyond=out_of_reach(tai_s, az_deg + turn.offset_deg, el_deg, azimuth, elevation),
        learned_count=learned_count,
        hidden_tai_s=coming.hidden_tai_s,
        unwindings=turns.unwindings,
        crossing=crossing,
        zenith_turn=zenith_turn,
        is_plunged=is_plunged,
    )


def _beyond_top(propagator: Propagator, tai_s: Array, site: Site, az_deg: Array, el_deg: Array) -> tuple[Array, Array]:
    """A path that is flown over the top: plunged from there on, its azimuth as it was before."""
    seen = encoder_look(propagator, tai_s, site, None, is_plunged=True)
    top = int(np.argmax(el_deg))
    plunged_deg = seen.az_deg[top:] + 360.0 * np.round((az_deg[0] - seen.az_deg[top:]) / 360.0)
    azimuth = np.concatenate((az_deg[:top], plunged_deg))
    middle = (tai_s > tai_s[top] - OVER_S) & (tai_s < tai_s[top] + OVER_S) & (tai_s > tai_s[0]) & (tai_s < tai_s[-1])
    azimuth[middle] = np.interp(tai_s[middle], tai_s[~middle], azimuth[~middle])
    return azimuth, np.concatenate((el_deg[:top], seen.el_deg[top:]))


def _crossing(
    propagator: Propagator,
    site: Site,
    coming: Pass,
    path: tuple[Array, Array],
    keyhole: KeyholeRules | None,
    zenith_turn: int,
) -> ZenithCrossing | None:
    """How the zenith will be crossed, by the elements; None where the drive can follow, or it is past.

    path: times and azimuths of what is planned, on its turn.
    """
    if keyhole is None or coming.culmination_el_deg < LEAST_KEYHOLE_EL_DEG:
        return None
    around_s = 2.0 * longest_window_s(keyhole.azimuth)
    first_tai_s = coming.culmination_tai_s - around_s
    if coming.culmination_tai_s < path[0][0] or around_s > MOST_AROUND_S:
        return None
    buffer = predict(
        *(propagator, site, first_tai_s, first_tai_s, "TLE", float(np.interp(first_tai_s, *path))),
        horizon_s=2.0 * around_s,
        keyhole=keyhole,
        zenith_turn=zenith_turn,
    )
    return buffer.crossing


def beyond_limits(
    propagator: Propagator, site: Site, coming: Pass, azimuth: AxisLimits, elevation: AxisLimits
) -> tuple[OutOfReach, ...]:
    """When which axis cannot follow a pass, for an antenna that waits for it in the middle of its range."""
    step_s = max(COARSE_STEP_S, coming.duration_s / MOST_STEPS)
    tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, step_s)
    look = encoder_look(propagator, tai_s, site, None)
    az_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    turn = choose_turn(az_deg, look.el_deg, azimuth, middle_deg(azimuth))
    return out_of_reach(tai_s, az_deg + turn.offset_deg, look.el_deg, azimuth, elevation)


def is_due(plan: PassPlan | None, state: ControlState) -> bool:
    """Whether a plan is to be made: as soon as the antenna is seen, and anew for a turn that was learned."""
    if state.intake.status is None:
        return False
    return plan is None or plan.learned_count != state.turn.learned_count


def pass_end_tai_s(plan: PassPlan, sky: Sky) -> float:
    """The end of the pass: its set by the elements, shifted by what the fit found, early or late."""
    along_s = sky.fit.along_s if sky.fit and isfinite(sky.fit.along_s) else 0.0
    return plan.set_tai_s + along_s + 1.0


def is_tracked(state: ControlState, sky: Sky, now_tai_s: float) -> bool:
    """Whether this pass is held, or has been: then what was seen of it counts for more than another clock."""
    plan = sky.plan
    is_in_pass = plan is not None and plan.rise_tai_s - ACQUIRE_LEAD_S <= now_tai_s <= pass_end_tai_s(plan, sky)
    return state.tracking.track in STEERED or sky.fit is not None or (is_in_pass and state.signal.has_acquired)


def why_over(sky: Sky, now_tai_s: float, end_tai_s: float) -> str:
    """Why the run ends by itself; empty: it does not.  end_tai_s: the time that it may last."""
    if now_tai_s >= end_tai_s:
        return "duration over"
    is_over = sky.plan is not None and now_tai_s > pass_end_tai_s(sky.plan, sky)
    return PASS_OVER if is_over else ""
