"""The picture of the states is that of the table, and every row is in it."""

import re
from itertools import pairwise

from script_modules import load

from acu_daemon.control.tracking.state_table import TABLE, TrackState

states = load("draw_states")


def test_the_picture_of_the_states_is_that_of_the_table() -> None:
    assert states.PICTURE.read_text(encoding="utf-8") == states.draw(), "draw it anew: scripts/draw_states.py"


def test_every_way_from_state_to_state_is_an_arrow_or_a_line_of_its_target() -> None:
    drawn = {(arrow.source, arrow.target, number) for arrow in states.arrows() for number in arrow.numbers}
    told = {
        (row.target, number)
        for number, row in enumerate(TABLE, 1)
        if any(re.search(rf"\b{number}\b", line.partition(" from ")[0]) for line in states.into(row.target))
    }
    for number, row in enumerate(TABLE, 1):
        for source in row.sources:
            assert ((source, row.target, number) in drawn) != ((row.target, number) in told)


def test_every_state_has_a_place_of_its_own() -> None:
    at = states.places()
    assert set(at) == set(TrackState)
    for one, other in pairwise(sorted(at.values())):
        assert abs(one[0] - other[0]) >= states.BOX[0] or abs(one[1] - other[1]) >= states.BOX[1]


def test_sets_of_states_are_named_in_the_order_of_the_states() -> None:
    assert states.named(frozenset(TrackState) - {TrackState.LINK_LOST}) == "all but LINK-LOST"
    assert states.named(frozenset({TrackState.HOLD_TLE, TrackState.ACQUIRE_TLE})) == "ACQUIRE/TLE, HOLD/TLE"


def test_the_glossary_has_every_state() -> None:
    text = (states.PICTURE.parents[1] / "glossary.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `([A-Z/-]+)` \|.*\|.*\|$", text, re.MULTILINE)) == set(TrackState)
