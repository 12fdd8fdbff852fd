"""What is said of an antenna before a keep-out: seconds, the way out, an alarm where nobody moves it clear.  Pure.

The daemon moves it only where it is armed and neither latched nor owing a STOP, and the ACU follows its registers:
there the register limiter keeps it clear.  Everywhere else nothing is moved, and a person is told in time.
"""

from dataclasses import dataclass

from acu_daemon.acu.commands import AcuMode
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tracking.state_table import ACTIVE
from acu_daemon.control.tracking.zone_watch import antenna_nears
from acu_daemon.pointing.escape import sun_reaches_s, way_out
from acu_daemon.pointing.way_round import Place, why_not_stow

SHOWN_S = 600.0  # a way out is shown from so long before


@dataclass(frozen=True, slots=True)
class EnvelopeSeen:
    """The sun and the zones as the antenna stands to them."""

    sun_deg: float | None = None
    sun_reach_s: float | None = None
    way_out: Place | None = None
    alarm: str = ""


def look_around(state: ControlState, now_tai_s: float, config: ControlConfig) -> EnvelopeSeen:
    """What there is to say of where the antenna is now."""
    envelope, status = config.envelope, state.intake.status
    if status is None or (envelope.sun is None and not envelope.has_zones):
        return EnvelopeSeen()
    place = state.intake.az_deg, status.el_deg
    sun_deg = envelope.sun.angle_deg(*envelope.beam_deg(*place), now_tai_s) if envelope.sun is not None else None
    if not envelope.has_zones:
        return EnvelopeSeen(sun_deg)
    stands = state.tracking.track not in ACTIVE
    is_avoided = envelope.sun is not None and envelope.sun.policy == "avoid"
    reach_s = sun_reaches_s(envelope, place, now_tai_s) if is_avoided and stands else None
    is_soon = reach_s is not None and reach_s <= max(config.response_time_s, SHOWN_S)
    out = way_out(envelope, place, now_tai_s) if is_soon else None
    why = why_not_moved(state, config)
    if not why or (state.is_armed(config) and not stands):
        return EnvelopeSeen(sun_deg, reach_s, out)
    return EnvelopeSeen(sun_deg, reach_s, out, _alarm(state, reach_s, out, why, now_tai_s, config))


def _alarm(
    state: ControlState, reach_s: float | None, out: Place | None, why: str, now_tai_s: float, config: ControlConfig
) -> str:
    """Of an antenna that the daemon does not move."""
    status, envelope = state.intake.status, config.envelope
    if reach_s is not None and reach_s <= config.response_time_s:
        when = (
            f"the sun reaches its keep-out in {reach_s:.0f} s" if reach_s > 0.0 else "the antenna is within the sun's"
        )
        way = f"the way out is az {out[0]:.1f} el {out[1]:.1f}" if out is not None else "there is no way out"
        return f"{when}, and the daemon does not move it: {why}; {way}"
    if status is None:
        return ""
    if (zone := envelope.zone_at(state.intake.az_deg, status.el_deg, now_tai_s)) is not None:
        return f"the antenna is within the keep-out of {zone.name}, and the daemon does not move it: {why}"
    if status.mode is AcuMode.STOWING and envelope.stow_deg is not None:
        return why_not_stow(envelope, (state.intake.az_deg, status.el_deg), now_tai_s)
    if antenna_nears(state, now_tai_s, envelope):
        return f"the antenna moves towards a keep-out, and not by the daemon: the ACU is in {status.mode.name}"
    return ""


def why_not_moved(state: ControlState, config: ControlConfig) -> str:
    """What keeps the daemon from moving it; empty: nothing."""
    status = state.intake.status
    if state.latch.problem:
        return "an axis is latched"
    if not state.is_armed(config):
        return "it is not armed"
    if state.arming.is_stop_due:
        return "a STOP is due"
    if status is None or not status.follows_registers:
        return f"the ACU is in {status.mode.name}" if status is not None else "nothing is known of it"
    return ""
