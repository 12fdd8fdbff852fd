"""The calendar of granted passes, by value: what each entry says, escapes, and lines no longer than the standard's."""

from typing import Any

import pytest

from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.report.calendar import calendar_text
from acu_daemon.schedule.book import Entry, PassState

START = tai_from_utc("2026-12-31T23:50:00Z")


def entry(**changes: Any) -> Entry:
    values: dict[str, Any] = {
        "satellite": "NOAA-20",
        "rise_tai_s": START,
        "culmination_tai_s": START + 500.0,
        "set_tai_s": START + 900.0,
        "culmination_el_deg": 63.4,
        "priority": 3,
        "state": PassState.PLANNED,
        "reason": "",
        "useful_s": 610.4,
        "start_tai_s": START + 60.0,
        "end_tai_s": START + 840.0,
    }
    return Entry(**values | changes)


def lines(*entries: Entry, station: str = "Home", now_tai_s: float = START - 3600.0) -> list[str]:
    text = calendar_text(entries, station, now_tai_s)
    assert text.endswith("\r\n")
    assert text.count("\n") == text.count("\r") == text.count("\r\n")
    return text.split("\r\n")[:-1]


def field(name: str, *entries: Entry, **more: Any) -> list[str]:
    whole = "\r\n".join(lines(*entries, **more)).replace("\r\n ", "").split("\r\n")
    return [line.partition(":")[2] for line in whole if line.startswith(f"{name}:")]


def test_a_pass_over_midnight_of_the_year_is_told_by_its_reservation() -> None:
    assert lines(entry()) == [
        "BEGIN:VCALENDAR",
        "VERSION:2.0",
        "PRODID:-//acu-daemon//schedule//EN",
        "BEGIN:VEVENT",
        "UID:NOAA-20-20261231T2358-0@acu-daemon",
        "DTSTAMP:20261231T225000Z",
        "DTSTART:20261231T235100Z",
        "DTEND:20270101T000400Z",
        "SUMMARY:NOAA-20\\, 63 deg",
        "LOCATION:Home",
        "DESCRIPTION:priority 3\\, 610 useful seconds",
        "END:VEVENT",
        "END:VCALENDAR",
    ]


def test_without_a_pass_it_is_empty() -> None:
    assert lines() == ["BEGIN:VCALENDAR", "VERSION:2.0", "PRODID:-//acu-daemon//schedule//EN", "END:VCALENDAR"]


@pytest.mark.parametrize(
    ("changes", "begin", "end"),
    [
        ({"start_tai_s": None}, "20261231T235000Z", "20270101T000400Z"),
        ({"end_tai_s": None}, "20261231T235100Z", "20270101T000500Z"),
        ({"start_tai_s": None, "end_tai_s": None}, "20261231T235000Z", "20270101T000500Z"),
    ],
)
def test_what_was_not_reserved_is_from_rise_to_set(changes: dict[str, Any], begin: str, end: str) -> None:
    assert field("DTSTART", entry(**changes)) == [begin]
    assert field("DTEND", entry(**changes)) == [end]


def test_passes_stand_in_the_order_that_they_are_given() -> None:
    late, early = entry(satellite="B"), entry(satellite="A", start_tai_s=START - 9000.0)
    assert field("SUMMARY", late, early) == ["B\\, 63 deg", "A\\, 63 deg"]


def test_a_pass_keeps_its_name_when_its_times_move_a_little_and_each_part_has_its_own() -> None:
    one = field("UID", entry())
    assert field("UID", entry(start_tai_s=START, end_tai_s=START + 70.0, set_tai_s=START + 100.0)) == one
    assert field("UID", entry(culmination_tai_s=START + 500.0 + 19.0)) == one
    assert field("UID", entry(part=1)) == ["NOAA-20-20261231T2358-1@acu-daemon"]
    assert field("UID", entry(culmination_tai_s=START + 4100.0)) == ["NOAA-20-20270101T0058-0@acu-daemon"]


def test_a_reason_follows_the_useful_seconds() -> None:
    assert field("DESCRIPTION", entry(reason="cut by the rise of A")) == [
        "priority 3\\, 610 useful seconds cut by the rise of A"
    ]


def test_signs_of_the_standard_are_escaped_once() -> None:
    odd = "a,b;c\\d\ne:f"
    said = "a\\,b\\;c\\\\d\\ne:f"
    assert field("LOCATION", entry(), station=odd) == [said]
    assert field("SUMMARY", entry(satellite=odd)) == [f"{said}\\, 63 deg"]
    assert field("UID", entry(satellite=odd)) == [f"{said}-20261231T2358-0@acu-daemon"]
    assert field("DESCRIPTION", entry(reason=odd)) == [f"priority 3\\, 610 useful seconds {said}"]


@pytest.mark.parametrize("letter", ["x", "é", "山", "🛰"])
def test_a_line_has_at_most_75_bytes_and_no_letter_is_cut(letter: str) -> None:
    wide = len(letter.encode())
    for count in range(1, 160):
        folded = [line for line in lines(entry(), station=letter * count) if letter in line]
        assert field("LOCATION", entry(), station=letter * count) == [letter * count]
        assert max(len(line.encode()) for line in folded) <= 75
        assert all(len(line.encode()) > 75 - wide for line in folded[:-1])  # and none is folded before it has to be
        assert [line.startswith(" ") for line in folded] == [False] + [True] * (len(folded) - 1)


def test_a_line_of_75_bytes_is_whole_and_one_of_76_is_not() -> None:
    name = len("LOCATION:")
    assert "LOCATION:" + "x" * (75 - name) in lines(entry(), station="x" * (75 - name))
    longer = lines(entry(), station="x" * (75 - name) + "y" * 75)
    at = longer.index("LOCATION:" + "x" * (75 - name))
    assert longer[at + 1 : at + 3] == [" " + "y" * 74, " y"]
