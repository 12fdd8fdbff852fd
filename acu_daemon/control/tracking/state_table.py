"""The states of tracking and the one table of their transitions (docs/status.md shows them to operators).

A state is named by what steers and what would take over.  `transition` walks TABLE from the top: the first row whose
sources hold the present state and whose cause is present wins.  Causes are found in control.tracking.causes.
"""

from collections.abc import Set
from dataclasses import dataclass
from enum import StrEnum


class TrackState(StrEnum):
    """What steers the antenna, and what would take over."""

    IDLE = "IDLE"
    PREPOSITION = "PREPOSITION"
    ACQUIRE_TLE = "ACQUIRE/TLE"
    AUTOTRACK_TLE = "AUTOTRACK/TLE"
    AUTOTRACK_FITTED = "AUTOTRACK/FITTED"
    PROGRAM = "PROGRAM"
    HOLD_FITTED = "HOLD/FITTED"
    HOLD_TLE = "HOLD/TLE"
    SEARCH = "SEARCH"
    ZENITH = "ZENITH"
    FALSE_LOCK = "FALSE-LOCK"
    AVOID = "AVOID"
    SLAVED = "SLAVED"
    MANUAL = "MANUAL"
    STOW = "STOW"
    FAULT = "FAULT"
    LINK_LOST = "LINK-LOST"


class Cause(StrEnum):
    """Why a state changes, in the words an operator reads."""

    LINK_SILENT = "no valid reply from the ACU"
    LINK_BACK = "the ACU answers"
    LATCHED = "an axis does not do what it is told: latched until a person clears it"
    HANDS_OFF = "not armed, and nobody has selected autotrack"
    LOCAL_PANEL = "the local panel took control"
    REMOTE_AGAIN = "remote control is back"
    ACU_FAULT = "the ACU reports a fault"
    FAULT_GONE = "the fault is cleared"
    STOWING = "the antenna is stowed"
    STOW_LEFT = "the stow is over"
    PASS_NEAR = "the pass is near"
    PASS_OVER = "the pass is over"
    ON_POINT = "the antenna stands on the predicted path"
    ON_POINT_FITTED = "the antenna stands on the path of this pass's fit"
    ON_PROGRAM = "the antenna stands on the predicted path, and no signal is waited for"
    STILL_SELECTED = "autotrack is still selected, near the predicted path"
    STILL_FITTED = "interrupted in mid-pass, and a fit of this pass exists"
    ACQUIRED = "the signal is acquired"
    ACQUIRED_FITTED = "the signal is acquired and a fit of this pass exists"
    FIT = "a fit was accepted"
    FIT_LEFT = "newer readings deny the fit: the prediction is made from the elements again"
    LOST = "the signal is lost"
    KEEP_OUT = "the path, or the antenna, comes near a keep-out"
    KEEP_OUT_PAST = "the keep-out is behind"
    HIDDEN = "the satellite is behind the mask"
    HIDDEN_FITTED = "the satellite is behind the mask, and a fit of this pass exists"
    MODE_LEFT = "the ACU left the mode by itself (power cycle, or another hand)"
    ACQUIRE_OVER = "no signal within acquire_s"
    HOLD_OVER = "no signal within hold_s"
    LOCK_FALSE = "autotrack holds something else than the satellite: it is left for the prediction"
    HELD = "a person has the prediction followed"
    RELEASED = "a person gives it back to autotrack"
    RELEASED_FITTED = "a person gives it back to autotrack, and a fit of this pass exists"
    BACK_ON_PATH = "the antenna is back on the path"
    ZENITH_NEAR = "the azimuth drive cannot follow over the zenith: the antenna is led past it"
    ZENITH_PAST = "the antenna is past the zenith"
    ZENITH_PAST_FITTED = "the antenna is past the zenith, on the path of this pass's fit"
    SLAVED = "a program that has the write lease leads the antenna"
    SLAVE_OVER = "the program leads the antenna no more"
    SEARCH_OVER = "no signal within search_s"
    SEARCH_OVER_FITTED = "no signal within search_s around this pass's fit"


S = TrackState
ACTIVE = frozenset(
    {
        *(S.PREPOSITION, S.PROGRAM, S.FALSE_LOCK, S.SLAVED),
        *(S.ACQUIRE_TLE, S.AUTOTRACK_TLE, S.AUTOTRACK_FITTED, S.HOLD_FITTED, S.HOLD_TLE, S.SEARCH, S.ZENITH, S.AVOID),
    }
)
TRACKING = ACTIVE - {S.PREPOSITION, S.AVOID, S.SLAVED}
HOLDING = frozenset({S.HOLD_FITTED, S.HOLD_TLE})
AUTOTRACKING = frozenset({S.AUTOTRACK_TLE, S.AUTOTRACK_FITTED})
LED = frozenset({S.PREPOSITION, S.PROGRAM, S.ZENITH, S.FALSE_LOCK, S.AVOID, S.SLAVED})  # autotrack is not selected
ANY = frozenset(TrackState)
NO_LINK = frozenset({S.LINK_LOST})


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table; `limit` names the key of the satellite's TOML, or the rule, that sets its time."""

    sources: Set[TrackState]
    cause: Cause
    target: TrackState
    limit: str = "at once"


TABLE: tuple[Row, ...] = (
    Row(ANY - NO_LINK, Cause.LINK_SILENT, S.LINK_LOST, "0.5 s without a valid reply"),
    Row(NO_LINK, Cause.LINK_BACK, S.IDLE, "first good poll"),
    Row(ANY - NO_LINK - {S.FAULT}, Cause.LATCHED, S.FAULT),
    Row(ANY - NO_LINK - {S.MANUAL}, Cause.LOCAL_PANEL, S.MANUAL),
    Row(frozenset({S.MANUAL}), Cause.REMOTE_AGAIN, S.IDLE),
    Row(ANY - NO_LINK - {S.MANUAL, S.FAULT}, Cause.ACU_FAULT, S.FAULT),
    Row(frozenset({S.FAULT}), Cause.FAULT_GONE, S.IDLE),
    Row(ANY - NO_LINK - {S.MANUAL, S.FAULT, S.STOW}, Cause.STOWING, S.STOW),
    Row(frozenset({S.STOW}), Cause.STOW_LEFT, S.IDLE),
    Row(ACTIVE - {S.SLAVED}, Cause.PASS_OVER, S.IDLE, "set of the pass"),
    Row(ACTIVE, Cause.HANDS_OFF, S.IDLE),
    Row(ACTIVE - {S.SLAVED} | {S.IDLE}, Cause.SLAVED, S.SLAVED, "its first direction"),
    Row(frozenset({S.SLAVED}), Cause.SLAVE_OVER, S.IDLE, "the end of the lease"),
    Row(TRACKING, Cause.KEEP_OUT, S.AVOID, "4 s before the keep-out"),
    Row(frozenset({S.AVOID}), Cause.KEEP_OUT_PAST, S.IDLE),
    Row(TRACKING - {S.PROGRAM, S.ZENITH}, Cause.HELD, S.PROGRAM),
    Row(frozenset({S.PROGRAM}), Cause.RELEASED_FITTED, S.HOLD_FITTED),
    Row(frozenset({S.PROGRAM}), Cause.RELEASED, S.HOLD_TLE),
    Row(frozenset({S.IDLE, S.PREPOSITION}), Cause.ACQUIRED_FITTED, S.AUTOTRACK_FITTED),
    Row(frozenset({S.IDLE, S.PREPOSITION}), Cause.ACQUIRED, S.AUTOTRACK_TLE),
    Row(frozenset({S.IDLE}), Cause.STILL_FITTED, S.HOLD_FITTED),
    Row(frozenset({S.IDLE}), Cause.STILL_SELECTED, S.ACQUIRE_TLE),
    Row(
        frozenset({S.IDLE}),
        Cause.PASS_NEAR,
        S.PREPOSITION,
        "before the rise: preposition_s, or as the way takes",
    ),
    Row(frozenset({S.PREPOSITION}), Cause.ON_POINT_FITTED, S.HOLD_FITTED),
    Row(frozenset({S.PREPOSITION}), Cause.ON_PROGRAM, S.PROGRAM, "20 s before the rise or later"),
    Row(frozenset({S.PREPOSITION}), Cause.ON_POINT, S.ACQUIRE_TLE, "20 s before the rise or later"),
    Row(TRACKING, Cause.MODE_LEFT, S.IDLE),
    Row(AUTOTRACKING | HOLDING | {S.ACQUIRE_TLE}, Cause.ZENITH_NEAR, S.ZENITH, "2 s before the departure"),
    Row(frozenset({S.ZENITH}), Cause.ZENITH_PAST_FITTED, S.HOLD_FITTED, "0.5 s after the return"),
    Row(frozenset({S.ZENITH}), Cause.ZENITH_PAST, S.HOLD_TLE, "0.5 s after the return"),
    Row(frozenset({S.AUTOTRACK_FITTED}), Cause.FIT_LEFT, S.AUTOTRACK_TLE),
    Row(frozenset({S.HOLD_FITTED, S.FALSE_LOCK}), Cause.FIT_LEFT, S.HOLD_TLE),
    Row(frozenset({S.AUTOTRACK_FITTED}), Cause.LOCK_FALSE, S.FALSE_LOCK, "false_lock_s off the path"),
    Row(frozenset({S.FALSE_LOCK}), Cause.BACK_ON_PATH, S.HOLD_FITTED, "on the path, or 15 s"),
    Row(frozenset({S.ACQUIRE_TLE, S.SEARCH}), Cause.ACQUIRED_FITTED, S.AUTOTRACK_FITTED),
    Row(frozenset({S.ACQUIRE_TLE, S.SEARCH, S.HOLD_TLE}), Cause.ACQUIRED, S.AUTOTRACK_TLE),
    Row(frozenset({S.SEARCH}), Cause.HIDDEN_FITTED, S.HOLD_FITTED),
    Row(frozenset({S.SEARCH}), Cause.HIDDEN, S.HOLD_TLE),
    Row(frozenset({S.AUTOTRACK_FITTED}), Cause.HIDDEN, S.HOLD_FITTED),
    Row(frozenset({S.AUTOTRACK_TLE}), Cause.HIDDEN, S.HOLD_TLE),
    Row(frozenset({S.ACQUIRE_TLE}), Cause.ACQUIRE_OVER, S.SEARCH, "acquire_s after the rise"),
    Row(frozenset({S.AUTOTRACK_FITTED}), Cause.LOST, S.HOLD_FITTED),
    Row(frozenset({S.AUTOTRACK_TLE}), Cause.LOST, S.HOLD_TLE),
    Row(frozenset({S.AUTOTRACK_TLE}), Cause.FIT, S.AUTOTRACK_FITTED, "lock_dwell_s and the first fit"),
    Row(frozenset({S.HOLD_FITTED}), Cause.ACQUIRED, S.AUTOTRACK_FITTED),
    Row(frozenset({S.HOLD_TLE, S.ACQUIRE_TLE}), Cause.FIT, S.HOLD_FITTED, "a fit that ends just after the loss"),
    Row(HOLDING, Cause.HOLD_OVER, S.SEARCH, "hold_s after 3 sigma left the beam, or the loss; never locked: acquire_s"),
    Row(frozenset({S.SEARCH}), Cause.SEARCH_OVER_FITTED, S.HOLD_FITTED, "search_s"),
    Row(frozenset({S.SEARCH}), Cause.SEARCH_OVER, S.HOLD_TLE, "search_s"),
)


_ROWS = {state: tuple(row for row in TABLE if state in row.sources) for state in TrackState}


def transition(state: TrackState, causes: Set[Cause]) -> tuple[TrackState, Cause] | None:
    """The next state and its cause, or None when nothing changes."""
    for row in _ROWS[state]:
        if row.cause in causes:
            return row.target, row.cause
    return None
