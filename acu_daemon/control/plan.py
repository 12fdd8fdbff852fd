"""The plan of a pass, made before it starts: where to stand, and on which turn of the cable wrap."""

import numpy as np

from acu_daemon.control.tick_input import PassPlan
from acu_daemon.model import AxisLimits, Pass, Site
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.reach import OutOfReach, out_of_reach
from acu_daemon.pointing.wrap import choose_turn, middle_deg

COARSE_STEP_S, MOST_STEPS = 0.5, 20000  # of these a tenth of a second's work, in the loop
ANY_ELEVATION = AxisLimits(-90.0, 180.0, 1.0, 1.0)
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
) -> PassPlan:
    """Choose the turn that holds what is left of the pass, and the point where the antenna waits for it.

    present_az_deg: where the antenna stands, continuous azimuth in the encoder frame.
    """
    start_tai_s = min(max(coming.rise_tai_s, now_tai_s), coming.set_tai_s - 1.0)
    step_s = max(STEP_S, (coming.set_tai_s - start_tai_s) / MOST_STEPS)  # one that does not set lasts for days
    tai_s = np.arange(start_tai_s, coming.set_tai_s + step_s, step_s)
    look = look_at(propagator, tai_s, site)
    az_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    turn = choose_turn(az_deg, look.el_deg, azimuth, present_az_deg)
    return PassPlan(
        rise_tai_s=coming.rise_tai_s,
        set_tai_s=coming.set_tai_s,
        start_tai_s=start_tai_s,
        start_az_deg=float(az_deg[0]) + turn.offset_deg,
        start_el_deg=float(look.el_deg[0]),
        note="" if turn.holds_path else turn.reason,
        beyond=out_of_reach(tai_s, az_deg + turn.offset_deg, look.el_deg, azimuth, elevation),
    )


def beyond_limits(
    propagator: Propagator, site: Site, coming: Pass, azimuth: AxisLimits, elevation: AxisLimits
) -> tuple[OutOfReach, ...]:
    """When which axis cannot follow a pass, for an antenna that waits for it in the middle of its range."""
    step_s = max(COARSE_STEP_S, coming.duration_s / MOST_STEPS)
    tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, step_s)
    look = look_at(propagator, tai_s, site)
    az_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    turn = choose_turn(az_deg, look.el_deg, azimuth, middle_deg(azimuth))
    return out_of_reach(tai_s, az_deg + turn.offset_deg, look.el_deg, azimuth, elevation)
