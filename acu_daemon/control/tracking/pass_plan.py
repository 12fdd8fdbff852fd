"""The plan of a pass: where to stand, on which turn of the wrap, when it is due, and when the pass ends.  Pure."""

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
from acu_daemon.pointing.keyhole import KeyholeRules, longest_window_s, turned_past_zenith
from acu_daemon.pointing.reach import OutOfReach, out_of_reach
from acu_daemon.pointing.turn_plan import TurnAsk, TurnPlan, plan_turns
from acu_daemon.pointing.wrap import choose_turn, judged, middle_deg
from acu_daemon.units import Array

PASS_OVER = "pass over"
STEERED = AUTOTRACKING | {TrackState.PROGRAM}
COARSE_STEP_S, MOST_STEPS = 0.5, 20000  # of these a tenth of a second's work, in the loop
ANY_ELEVATION = AxisLimits(-90.0, 180.0, 1.0, 1.0)
LEAST_KEYHOLE_EL_DEG, MOST_AROUND_S = 60.0, 400.0  # lower, and slower, no drive crosses the zenith in a window
STEP_S = 0.25  # fine enough to unwrap the azimuth of a pass 0.1 deg from the zenith


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
) -> PassPlan:
    """Choose the turns that cost least of what is left of the pass, and the point where the antenna waits for it.

    present_az_deg: where the antenna stands, continuous azimuth in the encoder frame.
    learned_count: turns of the azimuth that were learned so far.  keyhole: what the antenna can do near the zenith;
    then the plan says what that costs.
    """
    start_tai_s = min(max(coming.rise_tai_s, now_tai_s), coming.set_tai_s - 1.0)
    step_s = max(STEP_S, (coming.set_tai_s - start_tai_s) / MOST_STEPS)  # one that does not set lasts for days
    tai_s = np.arange(start_tai_s, coming.set_tai_s + step_s, step_s)
    look = encoder_look(propagator, tai_s, site, None)
    az_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    is_seen = np.ones(tai_s.size, dtype=np.bool_)
    for from_tai_s, to_tai_s in coming.hidden_tai_s:
        is_seen &= (tai_s < from_tai_s) | (tai_s > to_tai_s)

    def on_turns(az_deg: Array) -> TurnPlan:
        ask = (tai_s, az_deg, is_seen, azimuth, present_az_deg, now_tai_s)
        return plan_turns(
            TurnAsk(
                *ask,
                way_s=partial(way_s, axis=azimuth),
                is_either_way=lambda offset_deg: judged(offset_deg, az_deg, look.el_deg, azimuth).holds_either_way,
            )
        )

    def crossing_of(az_deg: Array, zenith_turn: int) -> ZenithCrossing | None:
        return _crossing(propagator, site, coming, (tai_s, az_deg), keyhole, zenith_turn)

    turns, zenith_turn = on_turns(az_deg), 0
    crossing = crossing_of(az_deg + turns.offset_deg, 0)
    if turns.unwindings and crossing is not None:
        rising = 1 if az_deg[-1] > az_deg[0] else -1
        other_az_deg = turned_past_zenith(az_deg, np.gradient(az_deg, step_s), -rising)
        is_crossing = (tai_s > crossing.departure_tai_s) & (tai_s < crossing.return_tai_s)
        other_az_deg[is_crossing] = np.interp(tai_s[is_crossing], tai_s[~is_crossing], other_az_deg[~is_crossing])
        others = on_turns(other_az_deg)
        other = crossing_of(other_az_deg + others.offset_deg, -rising)
        if not others.unwindings and other is not None and other.lost_s < crossing.lost_s + turns.unwinding_s:
            turns, zenith_turn, crossing, az_deg = others, -rising, other, other_az_deg
    turn = judged(turns.offset_deg, az_deg, look.el_deg, azimuth)
    return PassPlan(
        rise_tai_s=coming.rise_tai_s,
        set_tai_s=coming.set_tai_s,
        start_tai_s=start_tai_s,
        start_az_deg=float(az_deg[0]) + turn.offset_deg,
        start_el_deg=float(look.el_deg[0]),
        note="" if turn.holds_path else turn.reason,
        beyond=out_of_reach(tai_s, az_deg + turn.offset_deg, look.el_deg, azimuth, elevation),
        learned_count=learned_count,
        hidden_tai_s=coming.hidden_tai_s,
        unwindings=turns.unwindings,
        crossing=crossing,
        zenith_turn=zenith_turn,
    )


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
