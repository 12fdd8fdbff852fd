"""What a line on the control socket is answered, and what the next tick is asked for by it."""

import json
from dataclasses import asdict, replace

import pytest
from memories import remembering
from test_live_line import SEEN
from test_tick import CONFIG

from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Request
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.operator_requests import Hands

LATCHED, FAULT = remembering(problem="azimuth stands still"), remembering(track=TrackState.FAULT)
BOTH = remembering(LATCHED, track=TrackState.FAULT)
LOOK = "ok armed, but latched: azimuth stands still; look at the antenna, then `acu-daemon clear`"
AGAIN = "ok armed, but the ACU reports a fault: an emergency stop or an open door disarms again"
DISARMED = "ok disarmed: STOP is sent if the daemon moves the antenna, then nothing"


def told(line: str, state: ControlState, *, is_shadow: bool = False) -> tuple[str, list[Request]]:
    asked: list[Request] = []
    config = replace(CONFIG, is_shadow=is_shadow)
    hands = Hands(CommonArea(state=state), config, asked.append, lambda: SEEN)
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
        ("clear", BOTH, "ok cleared: azimuth stands still", True),
        ("clear", FAULT, "ok nothing is latched", False),
    ],
)
def test_each_request_is_answered_by_what_is_and_asked_of_the_next_tick(
    line: str, state: ControlState, answer: str, is_asked: bool
) -> None:
    assert told(line, state) == (answer, [Request(line)] if is_asked else [])


@pytest.mark.parametrize("line", list(Request))
@pytest.mark.parametrize("state", [ControlState(), BOTH])
def test_a_shadow_is_asked_for_nothing(line: str, state: ControlState) -> None:
    refused = f"error this daemon runs with --shadow: it commands nothing, so there is nothing to {line}"
    assert told(line, state, is_shadow=True) == (refused, [])


@pytest.mark.parametrize("line", ["", "ARM", "arm ", "stop", "status now"])
def test_another_line_is_refused_with_what_is_expected(line: str) -> None:
    answer, asked = told(line, BOTH)
    assert answer == f"error {line!r} is unknown, expected status, arm, disarm, clear"
    assert asked == []


@pytest.mark.parametrize("is_shadow", [False, True])
def test_the_status_is_the_snapshot_and_asks_nothing(is_shadow: bool) -> None:
    answer, asked = told("status", BOTH, is_shadow=is_shadow)
    assert answer.startswith("ok ")
    assert json.loads(answer[3:]) == json.loads(json.dumps(asdict(SEEN)))
    assert asked == []
