"""daemon.verdict: the whole table of words, levels and reasons, at each limit; and the alarms, the gravest first."""

from dataclasses import replace
from typing import Any

import pytest
from test_live_line import SEEN

from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.verdict import BRAKING_S, STILL_DEG_S, Level, Verdict, alarms, not_fitted, verdict

BAD, WATCH, CALM, GOOD = Level.BAD, Level.WATCH, Level.CALM, Level.GOOD
S = TrackState
STEP = 0.01
LATCHED = {"latch": "azimuth stands", "speed_deg_s": 0.0}
POINTS = "the antenna points along the path of the fit"
BY_PATH = "the antenna is led along the path of the fit"

CASES: list[tuple[TrackState, dict[str, Any], str, Level, str]] = [
    (S.LINK_LOST, {}, "NO LINK", BAD, "nothing is known of the antenna, and nothing can be told it"),
    (S.MANUAL, {}, "LOCAL PANEL", WATCH, "the local panel has control; nothing is commanded"),
    (
        *(S.FALSE_LOCK, {}, "FALSE LOCK", WATCH),
        "autotrack held something else than the satellite: the antenna goes back to the path",
    ),
    (
        *(S.ZENITH, {"is_on_path": False}, "OVER ZENITH", CALM),
        "the azimuth drive cannot follow here: the antenna is led past it",
    ),
    (
        *(S.AVOID, {}, "AVOIDING", WATCH),
        "a keep-out is on the path, the antenna is led clear of it: the path is clear again at once",
    ),
    (
        *(S.AVOID, {"limit_alarm": "the sun"}, "AVOIDING", WATCH),
        "a keep-out is on the path, the antenna is led clear of it: the sun",
    ),
    (S.SLAVED, {}, "SLAVED", WATCH, "another program leads the antenna, by the lease"),
    (S.SLAVED, {"slaved_by": "gpredict"}, "SLAVED", WATCH, "gpredict leads the antenna, by the lease"),
    # a fault and a latch
    (S.FAULT, {}, "FAULT", BAD, "the ACU reports a fault"),
    (S.FAULT, {"acu_faults": "door", "is_stopping": True}, "FAULT", BAD, "the ACU reports a fault: door"),
    (
        *(S.FAULT, LATCHED | {"is_stopping": True, "acu_faults": "door"}, "STOPPING", BAD),
        "an axis is latched; STOP is sent and not acknowledged yet",
    ),
    (
        *(S.FAULT, LATCHED | {"speed_deg_s": None}, "STOP SENT", BAD),
        "an axis is latched, STOP is acknowledged; whether it moves is not known",
    ),
    (
        *(S.FAULT, LATCHED | {"speed_deg_s": STILL_DEG_S + STEP, "state_s": BRAKING_S - STEP}, "STOPPING", BAD),
        "an axis is latched, STOP is acknowledged, the antenna brakes",
    ),
    *(
        (
            *(S.FAULT, LATCHED | {"speed_deg_s": STILL_DEG_S + STEP, "state_s": state_s}, "STILL MOVING", BAD),
            "an axis is latched and STOP acknowledged, but the antenna moves",
        )
        for state_s in (BRAKING_S, BRAKING_S + STEP, None)
    ),
    *(
        (
            *(S.FAULT, LATCHED | {"speed_deg_s": speed_deg_s, "state_s": 0.0}, "STOPPED", BAD),
            "an axis is latched: look at the antenna, then `acu-daemon clear`",
        )
        for speed_deg_s in (STILL_DEG_S, STILL_DEG_S - STEP, 0.0)
    ),
    # a stow
    (S.STOW, {"acu_mode": "STOWED"}, "STOWED", WATCH, "the stow is over"),
    (
        *(S.STOW, {"acu_mode": "STOWING", "stow_by": "schedule"}, "STOWING", CALM),
        "between passes; the next pass ends it",
    ),
    (
        *(S.STOW, {"acu_mode": "STANDBY", "stow_by": "wind"}, "STOW", WATCH),
        "the wind is strong; once it is calm the stow ends by itself",
    ),
    (
        *(S.STOW, {"stow_by": "panel"}, "STOW", WATCH),
        "somebody stowed the antenna; it is left alone until the ACU leaves the stow, or `acu-daemon unstow`",
    ),
    (
        *(S.STOW, {"stow_by": "operator"}, "STOW", WATCH),
        "a person stowed the antenna; `acu-daemon unstow` ends it",
    ),
    # idle
    (
        *(S.IDLE, {"arming": "disarmed", "set_in_s": -1.0}, "DISARMED", WATCH),
        "nothing is written to the ACU until `acu-daemon arm`",
    ),
    *(
        (S.IDLE, {"set_in_s": -STEP, "arming": arming}, "PASS OVER", CALM, "the satellite has set by its elements")
        for arming in ("armed", "shadow")
    ),
    *(
        (
            *(S.IDLE, {"set_in_s": set_in_s, "arming": "shadow", "rise_in_s": 9.0}, "LOOKING ON", CALM),
            "--shadow: nothing is commanded, whatever happens",
        )
        for set_in_s in (0.0, None)
    ),
    (S.IDLE, {"rise_in_s": STEP}, "WAITING", CALM, "for the next pass"),
    *(
        (S.IDLE, {"rise_in_s": rise_in_s}, "IDLE", WATCH, "the satellite is up and nothing is steered yet")
        for rise_in_s in (0.0, -STEP, None)
    ),
    # before a pass
    *(
        (S.PREPOSITION, {"rise_in_s": rise_in_s}, "NO SIGNAL YET", WATCH, "the antenna has come to the path")
        for rise_in_s in (0.0, -STEP)
    ),
    *(
        (S.PREPOSITION, {"rise_in_s": rise_in_s}, "AT RISE", CALM, "the antenna stands where the pass begins")
        for rise_in_s in (STEP, None)
    ),
    *(
        (
            *(S.PREPOSITION, {"is_on_path": is_on_path, "rise_in_s": 0.0}, "MOVING TO PATH", WATCH),
            "the satellite is up; the antenna is on its way to the path",
        )
        for is_on_path in (False, None)
    ),
    *(
        (
            *(S.PREPOSITION, {"is_on_path": False, "rise_in_s": rise_in_s}, "MOVING TO RISE", CALM),
            "the antenna is on its way to where the pass begins",
        )
        for rise_in_s in (STEP, None)
    ),
    # autotrack
    *(
        case
        for state in (S.AUTOTRACK_TLE, S.AUTOTRACK_FITTED)
        for case in (
            (state, {}, "TRACKING", GOOD, "the ACU tracks the signal"),
            (state, {"is_on_path": None}, "TRACKING", GOOD, "the ACU tracks the signal"),
            (state, {"is_on_path": False, "path": "elements"}, "TRACKING", GOOD, "the ACU tracks the signal"),
            (state, {"rejecting": ABOVE_MAX_ELEVATION}, "TRACKING", GOOD, "the ACU tracks the signal"),
            (
                *(state, {"is_on_path": False}, "TRACKING", WATCH),
                "the ACU tracks a signal that is not on the fitted path",
            ),
            (
                *(state, {"rejecting": "jump", "is_on_path": False}, "TRACKING", WATCH),
                "the ACU tracks a signal that may not be the satellite's main lobe",
            ),
        )
    ),
    # program track
    *(
        (
            *(S.PROGRAM, {"is_on_path": is_on_path, "is_held_by_person": True}, "OFF PATH", BAD),
            "program track, and the antenna is half a beam or more off the path of the fit",
        )
        for is_on_path in (False, None)
    ),
    (
        *(S.PROGRAM, {"is_held_by_person": True, "signal_age_s": 0.1, "path": ""}, "HELD", WATCH),
        "a person has the antenna led along the path; `acu-daemon track` gives it back to autotrack",
    ),
    (S.PROGRAM, {}, "PROGRAM TRACK", GOOD, f"{BY_PATH}; no signal is waited for"),
    (
        *(S.PROGRAM, {"signal_age_s": 9.0, "signal_alarm": "silent"}, "PROGRAM TRACK", GOOD),
        f"{BY_PATH}; no signal is waited for",
    ),
    (
        *(S.PROGRAM, {"signal_age_s": 0.0, "signal_lost_s": 3.0}, "TRACKING", GOOD),
        f"a receiver has the signal; {BY_PATH}",
    ),
    (
        *(S.PROGRAM, {"signal_age_s": 0.0, "signal_lost_s": 3.4, "is_acquired": False}, "HOLDING", WATCH),
        f"the signal is lost for 3 s; {BY_PATH}",
    ),
    *(
        (
            *(S.PROGRAM, {"signal_age_s": 0.0, "is_acquired": False, "rise_in_s": rise_in_s}, "NO SIGNAL YET"),
            *(level, BY_PATH),
        )
        for rise_in_s, level in ((0.0, WATCH), (-STEP, WATCH), (None, WATCH), (STEP, CALM))
    ),
    # without a signal
    (
        *(S.SEARCH, {"is_on_path": False, "search": "all"}, "SEARCHING", WATCH),
        "no signal; the antenna looks for it beside the path",
    ),
    *(
        (state, {"search": "all", "is_on_path": False}, "NOT FOUND", BAD, f"a search has not found it; {BY_PATH}")
        for state in (S.HOLD_TLE, S.HOLD_FITTED)
    ),
    *(
        (
            *(state, {"is_on_path": is_on_path, "rise_in_s": rise_in_s, "is_hidden": True}, "OFF PATH", BAD),
            "no signal, and the antenna is half a beam or more off the path of the fit",
        )
        for is_on_path in (False, None)
        for state, rise_in_s in ((S.HOLD_TLE, 5.0), (S.HOLD_FITTED, -5.0), (S.ACQUIRE_TLE, 0.0), (S.ACQUIRE_TLE, None))
    ),
    *((S.ACQUIRE_TLE, {"is_on_path": on, "rise_in_s": STEP}, "NO SIGNAL YET", CALM, POINTS) for on in (False, True)),
    *(
        (S.ACQUIRE_TLE, {"rise_in_s": rise_in_s, "search": "all"}, "NO SIGNAL YET", WATCH, POINTS)
        for rise_in_s in (0.0, None)
    ),
    *(
        (state, {"is_hidden": True}, "HIDDEN", CALM, f"behind the mask; {BY_PATH}")
        for state in (S.HOLD_TLE, S.HOLD_FITTED, S.ACQUIRE_TLE)
    ),
    (
        *(S.HOLD_TLE, {"is_hidden": True, "hidden_s": 12.3, "rise_in_s": 0.0}, "HIDDEN", CALM),
        f"behind the mask, back in 12 s; {BY_PATH}",
    ),
    (
        *(S.HOLD_TLE, {"is_hidden": True, "rise_in_s": STEP}, "HOLDING", WATCH),
        "the signal is lost; the antenna is on the path of the fit",
    ),
    *(
        (
            *(S.HOLD_FITTED, {"inside_s": inside_s, "path": ""}, "HOLDING", level),
            "the signal is lost; the antenna is on the path",
        )
        for inside_s, level in ((None, CALM), (0.0, WATCH), (0.1, CALM))
    ),
]


@pytest.mark.parametrize(("state", "changes", "word", "level", "why"), CASES)
def test_a_verdict_is_its_word_its_level_and_its_reason(
    state: TrackState, changes: dict[str, Any], word: str, level: Level, why: str
) -> None:
    seen = replace(SEEN, **({"state": str(state), "stow_by": ""} | changes))
    assert verdict(seen) == Verdict(word, level, why)


def test_levels_rise_with_what_they_ask_of_a_person() -> None:
    assert [*Level] == [GOOD, CALM, WATCH, BAD] == [0, 1, 2, 3]
    assert (STILL_DEG_S, BRAKING_S) == (0.2, 3.0)


@pytest.mark.parametrize(("rejecting", "told"), [("", ""), ("jump", "jump"), (ABOVE_MAX_ELEVATION, "")])
def test_what_is_not_fitted_high_up_is_a_matter_of_course(rejecting: str, told: str) -> None:
    seen = replace(SEEN, rejecting=rejecting)
    assert not_fitted(seen) == told
    assert alarms(seen) == ([f"not fitted, rejecting: {told}"] if told else [])


ALARMS: dict[str, tuple[dict[str, Any], str]] = {
    "latch": ({"latch": "azimuth stands"}, "latched: azimuth stands"),
    "faults": ({"acu_faults": "door"}, "door"),
    "link": ({"is_link_up": False, "link_problem": "no answer"}, "no answer"),
    "disarmed": ({"arming": "disarmed"}, "DISARMED"),
    "stow": ({"stow_alarm": "no stow"}, "no stow"),
    "envelope": ({"envelope_alarm": "sun"}, "sun"),
    "encoder": ({"encoder_problem": "frozen"}, "frozen"),
    "turn": ({"turn_alarm": "late"}, "late"),
    "tilt": ({"tilt_alarm": "leans"}, "leans"),
    "limit": ({"limit_alarm": "held"}, "held"),
    "clock": ({"clock_alarm": "clock"}, "clock"),
    "line": ({"line_alarm": "line"}, "line"),
    "signal": ({"signal_alarm": "silent"}, "silent"),
    "rejecting": ({"rejecting": "jump"}, "not fitted, rejecting: jump"),
    "files": ({"files_alarm": "disk  full\n now"}, "not written: disk full now"),
}


@pytest.mark.parametrize("name", ALARMS)
def test_an_alarm_stands_alone_and_all_in_the_order_of_their_gravity(name: str) -> None:
    changes, text = ALARMS[name]
    assert alarms(replace(SEEN, **changes)) == [text]
    together = {field: value for one, _ in ALARMS.values() for field, value in one.items()}
    assert alarms(replace(SEEN, **together)) == [one for _, one in ALARMS.values()]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, []),
        ({"link_problem": "no answer"}, []),
        ({"is_link_up": False}, ["no link"]),
        ({"arming": "disarmed", "disarmed_by": "a door"}, ["DISARMED by a door"]),
        ({"arming": "disarmed", "disarmed_by": "a door", "state": "IDLE"}, ["a door"]),
        ({"arming": "disarmed", "state": "IDLE"}, []),
        ({"disarmed_by": "a door"}, []),
        ({"arming": "shadow", "disarmed_by": "a door"}, ["SHADOW"]),
        ({"arming": "shadow", "state": "IDLE"}, []),
    ],
)
def test_who_does_not_command_is_told_where_the_verdict_does_not(changes: dict[str, Any], told: list[str]) -> None:
    assert alarms(replace(SEEN, **changes)) == told
