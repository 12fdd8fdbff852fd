"""What the page keeps: alarms, events, the story of the pass, orders in words."""

import re
from dataclasses import replace
from typing import Any

import pytest
from test_live_line import SEEN

from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.web import alarm_book
from acu_daemon.web.alarm_book import AlarmBook
from acu_daemon.web.feed import alarms_shown, to_json
from acu_daemon.web.order_desk import line_of
from acu_daemon.web.page_server import page_files
from acu_daemon.web.pass_story import STRIP_COUNT, PassStory
from acu_daemon.web.recent_events import KEPT, LONGEST, RecentEvents


def book_of(*looks: list[str]) -> AlarmBook:
    book: AlarmBook = ()
    for second, texts in enumerate(looks):
        book = alarm_book.seen(book, texts, f"12:00:0{second}")
    return book


def test_an_alarm_lasts_through_its_numbers_and_begins_anew_after_its_end() -> None:
    book = book_of(["the sun in 42 s"], ["the sun in 41 s"], [], ["the sun in 9 s"])
    assert [(one.text, one.began_utc, one.ended_utc) for one in book] == [
        ("the sun in 41 s", "12:00:00", "12:00:02"),
        ("the sun in 9 s", "12:00:03", ""),
    ]


def test_a_look_that_shows_nothing_new_is_the_same_book() -> None:
    book = book_of(["latched"])
    assert alarm_book.seen(book, ["latched"], "later") is book


def test_acknowledging_says_who_and_clears_nothing() -> None:
    book = alarm_book.acknowledged(book_of(["latched", "no link"]), 1, "Ann")
    assert [(one.acknowledged_by, one.ended_utc) for one in book] == [("Ann", ""), ("", "")]
    assert alarm_book.acknowledged(book, 1, "Ben") == book
    assert [one.text for one in alarm_book.in_order(book)] == ["no link", "latched"]
    assert alarm_book.seen(book, ["latched", "no link"], "later") == book


def test_old_alarms_go_and_those_that_last_stay() -> None:
    book = book_of(["it lasts"])
    for number in range(100):
        book = alarm_book.seen(book, ["it lasts", f"alarm {'x' * number}"], str(number))
    assert len(book) == alarm_book.KEPT + 2
    assert book[0].text == "it lasts"


def test_events_are_kept_newest_first_bounded_and_short() -> None:
    events = RecentEvents()
    for number in range(1000):
        events.add({"utc": "t", "level": "info", "event": "e", "n": number, "REHEARSAL": True})
    events.add({"utc": "t", "level": "debug", "event": "tick"})
    events.add({"utc": "t", "level": "warning", "event": "w", "share": 0.123456, "text": "x" * 1000})
    lines = events.lines()
    assert (len(lines), events.count) == (KEPT, 1001)
    assert lines[0]["text"].startswith("share=0.1235  text=xxx")
    assert len(lines[0]["text"]) == LONGEST
    assert lines[1]["text"] == "n=999"


def test_the_story_has_each_change_of_state_and_a_row_a_second() -> None:
    story = PassStory()
    seen = replace(SEEN, rise_utc="2026-01-01T00:00:00Z")
    for tenth in range(100):
        state = "HOLD/FITTED" if tenth >= 50 else "AUTOTRACK/FITTED"
        story.see(replace(seen, tai_s=tenth / 10.0, state=state, is_acquired=tenth < 50))
    assert [(one.from_tai_s, one.state, one.is_acquired) for one in story.stretches] == [
        (0.0, "AUTOTRACK/FITTED", True),
        (5.0, "HOLD/FITTED", False),
    ]
    assert len(story.strip) == 10
    story.see(replace(seen, tai_s=11.0, satellite="another"))
    assert len(story.stretches) == 1
    for second in range(2 * STRIP_COUNT):
        story.see(replace(seen, tai_s=20.0 + second))
    assert len(story.strip) == STRIP_COUNT


NUDGE = {"verb": "nudge", "values": {"along_s": 0.5, "across_deg": -0.1, "keep": True}}


@pytest.mark.parametrize(
    ("said", "line"),
    [
        ({"verb": "arm"}, "arm"),
        (
            {"verb": "nudge", "values": {"along_s": 0.5, "across_deg": -0.1, "keep": True}},
            "nudge along_s=0.5 across_deg=-0.1 keep=yes",
        ),
        ({"verb": "pause", "values": {"until": "2026-11-30T21:00:00Z"}}, "pause until=2026-11-30T21:00:00Z"),
        ({"verb": "arm\nclear"}, None),
        ({"verb": "skip", "values": {"satellite": "a b"}}, None),
        ({"verb": "skip", "values": {"satellite": "x keep=yes"}}, None),
        ({"verb": "skip", "values": {"sat ellite": "x"}}, None),
        ({"verb": "nudge", "values": {"along_s": 10**400}}, None),
        ({"verb": "grant", "values": {"lasts_s": 3600}}, "grant lasts_s=3600"),
        ({"verb": 1}, None),
        ({"verb": "arm", "values": []}, None),
        ({"verb": "arm", "values": {f"k{n}": 1 for n in range(9)}}, None),
        ({}, None),
    ],
)
def test_an_order_is_one_line_that_can_be_read_in_one_way(said: dict[str, Any], line: str | None) -> None:
    assert line_of(said) == line


def test_what_is_not_finite_is_null_in_json() -> None:
    assert (
        to_json({"a": [float("nan"), float("inf"), 1.23456789], "b": (None, True)})
        == '{"a":[null,null,1.23457],"b":[null,true]}'
    )


def test_every_state_has_a_colour_in_the_timeline() -> None:
    script = page_files()["page.js"][0].decode()
    kinds = script[script.index("const KINDS") :].split("\n")[0]
    assert [state for state in TrackState if not re.search(rf'[ {{"]{re.escape(state)}"?: "', kinds)] == []


@pytest.mark.parametrize(
    ("seen", "said"),
    [
        (replace(SEEN, state="IDLE", arming="disarmed", disarmed_by="a person"), ["DISARMED by a person"]),
        (replace(SEEN, arming="disarmed", disarmed_by="a person"), ["DISARMED by a person"]),
        (replace(SEEN, encoder_problem="frozen"), ["frozen"]),
        (replace(SEEN, is_link_up=False, link_problem="refused"), ["refused"]),
        (replace(SEEN, is_link_up=False, link_problem="refused", az_deg=None, tick_count=3), []),
    ],
)
def test_alarms_are_whole_sentences_and_none_before_the_first_poll(seen: Snapshot, said: list[str]) -> None:
    assert alarms_shown(seen) == said
