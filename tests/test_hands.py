"""What a line on the control socket is answered, and what the next tick is asked for by it."""

import json
from dataclasses import asdict, replace

import pytest
from memories import remembering
from structlog.testing import capture_logs
from test_live_line import SEEN
from test_tick import CONFIG, NOW, ready, status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Asking, Request, StowBy, StowWish
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.operator_requests import Hands
from acu_daemon.daemon.operator_verbs import VERBS

LATCHED, FAULT = remembering(problem="azimuth stands still"), remembering(track=TrackState.FAULT)
BOTH = remembering(LATCHED, track=TrackState.FAULT)
LOOK = "ok armed, but latched: azimuth stands still; look at the antenna, then `acu-daemon clear`"
AGAIN = "ok armed, but the ACU reports a fault: an emergency stop or an open door disarms again"
STOPPED = "ok STOP goes out at once; the daemon is disarmed"
DISARMED = "ok disarmed: STOP is sent if the daemon moves the antenna, then nothing"


def told(line: str, state: ControlState, *, is_shadow: bool = False) -> tuple[str, list[Asking]]:
    asked: list[Asking] = []
    config = replace(CONFIG, is_shadow=is_shadow)
    hands = Hands(CommonArea(state=state), config, asked.append, lambda: SEEN, lambda: NOW)
    return hands.answer(line), asked


@pytest.mark.parametrize(
    ("line", "state", "answer", "is_asked"),
    [
        ("arm", ControlState(), "ok armed", True),
        ("arm", LATCHED, LOOK, True),
        ("arm", FAULT, AGAIN, True),
        ("arm", BOTH, LOOK, True),
        ("disarm", ControlState(), DISARMED, True),
        ("disarm", BOTH, DISARMED, True),
        ("stop", ControlState(), STOPPED, True),
        ("stop", BOTH, STOPPED, True),
        ("clear", BOTH, "ok cleared: azimuth stands still", True),
        ("clear", FAULT, "ok nothing is latched", False),
    ],
)
def test_each_request_is_answered_by_what_is_and_asked_of_the_next_tick(
    line: str, state: ControlState, answer: str, is_asked: bool
) -> None:
    assert told(line, state) == (answer, [Request(line)] if is_asked else [])


@pytest.mark.parametrize("line", [*Request, "stow", "unstow"])
@pytest.mark.parametrize("state", [ControlState(), BOTH])
def test_a_shadow_is_asked_for_nothing(line: str, state: ControlState) -> None:
    refused = f"error this daemon runs with --shadow: it commands nothing, so there is nothing to {line}"
    assert told(line, state, is_shadow=True) == (refused, [])


@pytest.mark.parametrize("line", ["", "ARM", "stop!", "status now", "stow,"])
def test_another_line_is_refused_with_what_is_expected(line: str) -> None:
    answer, asked = told(line, BOTH)
    assert answer == f"error {line!r} is unknown, expected status, {', '.join(VERBS)}"
    assert asked == []


@pytest.mark.parametrize("is_shadow", [False, True])
def test_the_status_is_the_snapshot_and_asks_nothing(is_shadow: bool) -> None:
    answer, asked = told("status", BOTH, is_shadow=is_shadow)
    assert answer.startswith("ok ")
    assert json.loads(answer[3:]) == json.loads(json.dumps(asdict(SEEN)))
    assert asked == []


@pytest.mark.parametrize("line", ["arm ", "stow now", "arm by=", "stow by=me"])
def test_a_verb_with_what_it_does_not_know_is_refused(line: str) -> None:
    answer, asked = told(line, BOTH)
    assert answer.startswith(f"error {line!r}: ")
    assert answer.endswith("expected nothing behind it")
    assert asked == []


STANDS = ready(TrackState.IDLE, status(AcuMode.STANDBY, is_autotrack_selected=False))


def test_a_stow_is_asked_of_the_next_tick_and_refused_with_its_reason_where_stow_may_not_be_sent() -> None:
    answer, asked = told("stow", STANDS)
    assert (answer.split(":")[0], asked) == ("ok stowed", [StowWish(StowBy.OPERATOR)])
    assert told("stow", remembering(STANDS, by_people=False)) == ("error not stowed: disarmed", [])
    assert told("stow", remembering(STANDS, problem="it stands")) == ("error not stowed: latched: it stands", [])


def test_an_unstow_says_whose_the_stow_was() -> None:
    assert told("unstow", remembering(STANDS, stow_by=StowBy.WIND)) == (
        "ok the stow is over, it was the wind's",
        [StowWish(StowBy.OPERATOR, is_wanted=False)],
    )
    assert told("unstow", STANDS)[0] == "ok nothing is stowed"


def test_only_a_station_has_its_verbs() -> None:
    answer, asked = told("reload", STANDS)
    assert (answer, asked) == ("error reload: only a station has it, `acu-daemon run` without --satellite", [])


def test_who_said_what_stands_in_the_log() -> None:
    with capture_logs() as log:
        Hands(CommonArea(state=STANDS), CONFIG, lambda _: None, lambda: SEEN, lambda: NOW).answer("stow", "ada by page")
    [event] = [one for one in log if one["event"] == "operator.asked"]
    assert (event["who"], event["line"]) == ("ada by page", "stow")
