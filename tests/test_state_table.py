"""The one table of states, and the causes that drive it."""

import pytest

from acu_daemon.control.tracking.state_table import TABLE, Cause, TrackState, transition

S, C = TrackState, Cause


def test_every_state_can_be_reached_and_left():
    for state in TrackState:
        assert any(row.target is state for row in TABLE), f"{state} is never reached"
        assert any(state in row.sources for row in TABLE), f"{state} is never left"


def test_every_cause_moves_something():
    assert {row.cause for row in TABLE} == set(Cause)


def test_no_row_is_hidden_by_an_earlier_one():
    seen: set[tuple[TrackState, Cause]] = set()
    for row in TABLE:
        fresh = {(source, row.cause) for source in row.sources} - seen
        assert fresh, f"{row} can never fire"
        seen |= fresh


@pytest.mark.parametrize(
    ("state", "causes", "target"),
    [
        (S.AUTOTRACK_FITTED, {C.LOST, C.FIT}, S.HOLD_FITTED),
        (S.AUTOTRACK_TLE, {C.LOST}, S.HOLD_TLE),
        (S.HOLD_FITTED, {C.ACQUIRED, C.FIT}, S.AUTOTRACK_FITTED),
        (S.HOLD_TLE, {C.FIT, C.LOST}, S.HOLD_FITTED),
        (S.HOLD_FITTED, {C.HOLD_OVER, C.LOST}, S.SEARCH),
        (S.SEARCH, {C.SEARCH_OVER, C.LOST}, S.HOLD_TLE),
        (S.ACQUIRE_TLE, {C.ACQUIRE_OVER}, S.SEARCH),
        (S.HOLD_FITTED, {C.LINK_SILENT, C.ACQUIRED}, S.LINK_LOST),
        (S.AUTOTRACK_FITTED, {C.LOCAL_PANEL, C.LOST}, S.MANUAL),
        (S.SEARCH, {C.ACU_FAULT, C.LOST}, S.FAULT),
        (S.AUTOTRACK_FITTED, {C.PASS_OVER, C.ACQUIRED}, S.IDLE),
    ],
)
def test_the_transition_an_operator_expects(state, causes, target):
    step = transition(state, causes)
    assert step is not None
    assert step[0] is target


def test_nothing_changes_without_a_cause():
    assert all(transition(state, set()) is None for state in TrackState)
