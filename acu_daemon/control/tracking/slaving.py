"""The antenna led by another program that has the write lease: where it says, as far as limits and drives allow.  Pure.

Owner of `Slaved`.  A program says a direction, and it counts for as long as its lease does after that; nothing else
ends with it later.  A person's word, a latch, a fault, the panel, a stow and a lost link end it at once, so that
nothing moves again by itself when they are over.  What is said goes the way of every command: through the register
limiter, which takes it within the limits, around keep-outs and at the drives' own rates, and through the permit.
"""

from dataclasses import replace
from math import isfinite

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, Slaved
from acu_daemon.control.tick_input import SlaveWish, TickInput
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import MOST_DEG, Pointing

ENDED_BY = frozenset({TrackState.STOW, TrackState.FAULT, TrackState.MANUAL, TrackState.LINK_LOST})


def take_slaving(state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]) -> ControlState:
    """Take what a program says, and end what it has said before where that is over."""
    before = state.slaved
    slaved = before
    for asking in given.seen.requests:
        if isinstance(asking, SlaveWish) and _is_angles(asking):
            until_tai_s = given.now_tai_s + asking.lasts_s
            slaved = Slaved(asking, until_tai_s, slaved.has_led) if asking.lasts_s > 0.0 else Slaved()
    if slaved.wish is not None and not slaved.has_led and state.tracking.track is TrackState.SLAVED:
        slaved = replace(slaved, has_led=True)
    if before.wish is not None and slaved.wish is None:
        events.append(Event("slaved.ends", {"by": before.wish.by, "reason": "the lease is over"}))
    if slaved.wish is not None and (why := _why_over(state, slaved, given.now_tai_s, config)):
        events.append(Event("slaved.ends", {"by": slaved.wish.by, "reason": why}))
        slaved = Slaved()
    return state if slaved is before else with_parts(state, slaved=slaved)


def _is_angles(wish: SlaveWish) -> bool:
    angles = [angle for angle in (wish.az_deg, wish.el_deg) if angle is not None]
    return len(angles) != 1 and all(isfinite(angle) and abs(angle) <= MOST_DEG for angle in angles)


def _why_over(state: ControlState, slaved: Slaved, now_tai_s: float, config: ControlConfig) -> str:
    if now_tai_s > slaved.until_tai_s:
        return "nothing was said for the time of the lease"
    if state.latch.problem:
        return "an axis is latched"
    if not state.is_armed(config):
        return "disarmed"
    is_start = state.tracking.track is TrackState.LINK_LOST and not slaved.has_led
    return f"the state is {state.tracking.track}" if state.tracking.track in ENDED_BY and not is_start else ""


def slaved_point(state: ControlState) -> Pointing | None:
    """Where the program wants the antenna; None: it stands."""
    wish = state.slaved.wish
    if wish is None or wish.az_deg is None or wish.el_deg is None:
        return None
    return Pointing(wish.az_deg, wish.el_deg, 0.0, 0.0)
