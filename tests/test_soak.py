"""A short soak: two passes in a row, with what the first leaves to the second (scripts/soak.py flies a whole day)."""

import json

import pytest
from script_modules import load

pytestmark = pytest.mark.long

soak = load("soak")
LEAK_SHARE = 0.25  # allocations that a pass may leave, for each tick; half of the ticks are its own


def test_two_passes_in_a_row_are_held_through_their_faults_and_leave_nothing_open() -> None:
    """P4, P10: the second begins with what the first carried over; no descriptor is left open, no memory kept."""
    report = soak.soak(2, 24.0, 1, is_quick=True)
    assert report["is_good"], json.dumps(report["passes"], indent=1)
    assert report["held_count"] == 2
    assert report["tick_count"] > 5000
    first, second = (seen["block_count"] for seen in report["passes"])
    assert second - first < LEAK_SHARE * report["tick_count"]


@pytest.mark.parametrize("seed", range(20))
def test_what_is_drawn_for_a_pass_lies_in_it(seed: int) -> None:
    plan = soak.draw_plan(600.0, soak.Random(seed))
    assert all(0.0 < begin_s < end_s < 600.0 for begin_s, end_s in (*plan.losses, *plan.disturbed()))
