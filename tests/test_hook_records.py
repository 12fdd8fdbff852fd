"""What is kept of a hook for the report of its pass, and that one which is not configured costs nothing."""

import pytest

from acu_daemon.edge.hooks import SAID_CHARACTERS, Hook, HookResult, Hooks


@pytest.mark.parametrize(("problem", "is_good"), [("", True), ("exit status 3", False)])
def test_a_hook_without_a_problem_is_good_whatever_its_status(problem: str, is_good: bool) -> None:
    for status in (0, -15, None):
        assert HookResult(Hook.AT_LOCK, status, 1.0, "", problem).is_good == is_good


def test_the_record_has_all_but_the_pass_and_the_last_of_what_was_said() -> None:
    said = " a" + "b" * SAID_CHARACTERS + " \n"
    assert HookResult(Hook.AFTER_PASS, 3, 1.23456, said, "exit status 3", 7).record == {
        "hook": "after_pass",
        "status": 3,
        "lasted_s": 1.23,
        "problem": "exit status 3",
        "said": "b" * SAID_CHARACTERS,
    }
    assert HookResult(Hook.AT_LOSS, None, 0.0, " all\nwell ").record["said"] == "all\nwell"


def test_one_that_is_not_configured_is_not_called_nor_is_one_that_was_taken_away() -> None:
    hooks = Hooks({Hook.AT_LOCK: ["/bin/true"], Hook.AT_LOSS: []}, 5.0)
    hooks.call(Hook.AT_LOSS, {"number": 3})  # without a loop a call would raise
    hooks.call(Hook.BEFORE_MOVE, {})
    hooks.take({}, 5.0, None)
    hooks.call(Hook.AT_LOCK, {"number": 3})
    hooks.end_during()
    assert hooks.running(3) == []
    assert hooks.take_results() == []
