"""What a snapshot amounts to: one plain word, how much it asks of a person, and why.  Pure.

The word claims no more than is measured: TRACKING that the ACU says so, HOLDING that the antenna points where the
prediction says, STOPPED that the readings stand still.  That the satellite is there nobody knows without its signal.
"""

from dataclasses import dataclass
from enum import IntEnum

from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION
from acu_daemon.control.tracking.state_table import AUTOTRACKING, HOLDING, TrackState
from acu_daemon.daemon.snapshot import Snapshot

STILL_DEG_S = 0.2  # slower is noise of the readings, or wind
BRAKING_S = 3.0  # from the latch until an antenna that obeys stands


class Level(IntEnum):
    """How much it asks of a person; a colour where there is one."""

    GOOD = 0
    CALM = 1
    WATCH = 2
    BAD = 3


@dataclass(frozen=True, slots=True)
class Verdict:
    """The word, and the sentence that goes with it."""

    word: str
    level: Level
    why: str


S = TrackState
_WHOSE_STOW = {
    "": "the stow is over",
    "schedule": "between passes; the next pass ends it",
    "wind": "the wind is strong; once it is calm the stow ends by itself",
    "panel": "somebody stowed the antenna; it is left alone until the ACU leaves the stow, or `acu-daemon unstow`",
    "operator": "a person stowed the antenna; `acu-daemon unstow` ends it",
}


def verdict(seen: Snapshot) -> Verdict:
    """Say what the antenna does."""
    state = TrackState(seen.state)
    if state is S.LINK_LOST:
        return Verdict("NO LINK", Level.BAD, "nothing is known of the antenna, and nothing can be told it")
    if state is S.FAULT:
        return _faulty(seen)
    if state is S.MANUAL:
        return Verdict("LOCAL PANEL", Level.WATCH, "the local panel has control; nothing is commanded")
    if state is S.STOW:
        word = seen.acu_mode if seen.acu_mode in ("STOWED", "STOWING") else "STOW"
        return Verdict(word, Level.CALM if seen.stow_by == "schedule" else Level.WATCH, _WHOSE_STOW[seen.stow_by])
    if state is S.IDLE:
        return _idle(seen)
    if state is S.PREPOSITION:
        return _before(seen)
    if state in AUTOTRACKING:
        return _tracking(seen)
    if state is S.FALSE_LOCK:
        why = "autotrack held something else than the satellite: the antenna goes back to the path"
        return Verdict("FALSE LOCK", Level.WATCH, why)
    if state is S.ZENITH:
        return Verdict("OVER ZENITH", Level.CALM, "the azimuth drive cannot follow here: the antenna is led past it")
    if state is S.AVOID:
        why = seen.limit_alarm or "the path is clear again at once"
        return Verdict("AVOIDING", Level.WATCH, f"a keep-out is on the path, the antenna is led clear of it: {why}")
    if state is S.SLAVED:
        return Verdict("SLAVED", Level.WATCH, f"{seen.slaved_by or 'another program'} leads the antenna, by the lease")
    if state is S.PROGRAM:
        return _by_program(seen)
    return _blind(seen, state)


def _faulty(seen: Snapshot) -> Verdict:
    if not seen.latch:
        return Verdict(
            "FAULT", Level.BAD, f"the ACU reports a fault{f': {seen.acu_faults}' if seen.acu_faults else ''}"
        )
    if seen.is_stopping:
        return Verdict("STOPPING", Level.BAD, "an axis is latched; STOP is sent and not acknowledged yet")
    if seen.speed_deg_s is None:
        return Verdict(
            "STOP SENT", Level.BAD, "an axis is latched, STOP is acknowledged; whether it moves is not known"
        )
    if seen.speed_deg_s > STILL_DEG_S:
        if seen.state_s is not None and seen.state_s < BRAKING_S:
            return Verdict("STOPPING", Level.BAD, "an axis is latched, STOP is acknowledged, the antenna brakes")
        return Verdict("STILL MOVING", Level.BAD, "an axis is latched and STOP acknowledged, but the antenna moves")
    return Verdict("STOPPED", Level.BAD, "an axis is latched: look at the antenna, then `acu-daemon clear`")


def _idle(seen: Snapshot) -> Verdict:
    if seen.arming == "disarmed":
        return Verdict("DISARMED", Level.WATCH, "nothing is written to the ACU until `acu-daemon arm`")
    if seen.set_in_s is not None and seen.set_in_s < 0.0:
        return Verdict("PASS OVER", Level.CALM, "the satellite has set by its elements")
    if seen.arming == "shadow":
        return Verdict("LOOKING ON", Level.CALM, "--shadow: nothing is commanded, whatever happens")
    if seen.rise_in_s is not None and seen.rise_in_s > 0.0:
        return Verdict("WAITING", Level.CALM, "for the next pass")
    return Verdict("IDLE", Level.WATCH, "the satellite is up and nothing is steered yet")


def _before(seen: Snapshot) -> Verdict:
    is_up = seen.rise_in_s is not None and seen.rise_in_s <= 0.0
    if seen.is_on_path:
        if is_up:
            return Verdict("NO SIGNAL YET", Level.WATCH, "the antenna has come to the path")
        return Verdict("AT RISE", Level.CALM, "the antenna stands where the pass begins")
    if is_up:
        return Verdict("MOVING TO PATH", Level.WATCH, "the satellite is up; the antenna is on its way to the path")
    return Verdict("MOVING TO RISE", Level.CALM, "the antenna is on its way to where the pass begins")


def _tracking(seen: Snapshot) -> Verdict:
    if not_fitted(seen):
        return Verdict("TRACKING", Level.WATCH, "the ACU tracks a signal that may not be the satellite's main lobe")
    if seen.is_on_path is False and seen.path == "fit":
        return Verdict("TRACKING", Level.WATCH, "the ACU tracks a signal that is not on the fitted path")
    return Verdict("TRACKING", Level.GOOD, "the ACU tracks the signal")


def _by_program(seen: Snapshot) -> Verdict:
    path = f"the path of the {seen.path}" if seen.path else "the path"
    if seen.is_on_path is not True:
        return Verdict("OFF PATH", Level.BAD, f"program track, and the antenna is half a beam or more off {path}")
    if seen.is_held_by_person:
        why = f"a person has the antenna led along {path}; `acu-daemon track` gives it back to autotrack"
        return Verdict("HELD", Level.WATCH, why)
    if seen.signal_age_s is not None and not seen.signal_alarm:
        return _heard_beside(seen, path)
    return Verdict("PROGRAM TRACK", Level.GOOD, f"the antenna is led along {path}; no signal is waited for")


def _heard_beside(seen: Snapshot, path: str) -> Verdict:
    """Program track with a receiver that tells of the signal."""
    if seen.is_acquired:
        return Verdict("TRACKING", Level.GOOD, f"a receiver has the signal; the antenna is led along {path}")
    if seen.signal_lost_s is not None:
        why = f"the signal is lost for {seen.signal_lost_s:.0f} s; the antenna is led along {path}"
        return Verdict("HOLDING", Level.WATCH, why)
    is_up = seen.rise_in_s is None or seen.rise_in_s <= 0.0
    level = Level.WATCH if is_up else Level.CALM
    return Verdict("NO SIGNAL YET", level, f"the antenna is led along {path}")


def _blind(seen: Snapshot, state: TrackState) -> Verdict:
    """Without a signal: on the prediction, or looking for it."""
    path = f"the path of the {seen.path}" if seen.path else "the path"
    if state is S.SEARCH:
        return Verdict("SEARCHING", Level.WATCH, "no signal; the antenna looks for it beside the path")
    if state in HOLDING and seen.search:
        return Verdict("NOT FOUND", Level.BAD, f"a search has not found it; the antenna is led along {path}")
    is_up = seen.rise_in_s is None or seen.rise_in_s <= 0.0
    if seen.is_on_path is not True and (is_up or state in HOLDING):
        return Verdict("OFF PATH", Level.BAD, f"no signal, and the antenna is half a beam or more off {path}")
    if seen.is_hidden and is_up:
        back = f", back in {seen.hidden_s:.0f} s" if seen.hidden_s is not None else ""
        return Verdict("HIDDEN", Level.CALM, f"behind the mask{back}; the antenna is led along {path}")
    if state is S.ACQUIRE_TLE:
        level = Level.WATCH if is_up else Level.CALM
        return Verdict("NO SIGNAL YET", level, f"the antenna points along {path}")
    is_sure = state is S.HOLD_FITTED and seen.inside_s != 0.0
    return Verdict("HOLDING", Level.CALM if is_sure else Level.WATCH, f"the signal is lost; the antenna is on {path}")


def not_fitted(seen: Snapshot) -> str:
    """Why what is tracked is not learned from, where that is no matter of course."""
    return seen.rejecting if seen.rejecting != ABOVE_MAX_ELEVATION else ""


def alarms(seen: Snapshot) -> list[str]:
    """What a person should see to, the gravest first."""
    is_idle = seen.state == S.IDLE
    if seen.arming == "disarmed":
        hands = f"DISARMED{f' by {seen.disarmed_by}' if seen.disarmed_by else ''}" if not is_idle else seen.disarmed_by
    else:
        hands = "SHADOW" if seen.arming == "shadow" and not is_idle else ""
    found = (
        f"latched: {seen.latch}" if seen.latch else "",
        seen.acu_faults,
        (seen.link_problem or "no link") if not seen.is_link_up else "",
        hands,
        seen.stow_alarm,
        seen.envelope_alarm,
        seen.encoder_problem,
        seen.turn_alarm,
        seen.tilt_alarm,
        seen.limit_alarm,
        seen.clock_alarm,
        seen.line_alarm,
        seen.signal_alarm,
        f"not fitted, rejecting: {seen.rejecting}" if not_fitted(seen) else "",
        f"not written: {seen.files_alarm}" if seen.files_alarm else "",
    )
    return [" ".join(text.split()) for text in found if text]
