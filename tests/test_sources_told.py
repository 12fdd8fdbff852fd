"""How the sources of elements stand, in words, and which texts of others are kept: each limit from both sides."""

from math import inf
from pathlib import Path
from typing import Any

import pytest

from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.edge.elements_choice import MOST_FILES
from acu_daemon.edge.elements_status import (
    OLD_DAYS,
    SourceStanding,
    fetch_problems,
    standings,
    url_standing,
)
from acu_daemon.edge.fetch_policy import FetchState
from acu_daemon.edge.fetch_state_file import write_fetch_state
from acu_daemon.edge.newest_text import LARGEST_BYTES, MOST_SENDERS, NewestText, _Newest
from acu_daemon.orbit.timescales import utc_text

NOW = 8.5e8
URL, OTHER = "https://example.org/a", "https://example.org/b"
DAY_S, HOUR_S = 86400.0, 3600.0
GOOD_TLE = """ISS
1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996
2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325546
"""


def section(**more: Any) -> ElementsSourcesSection:
    return ElementsSourcesSection(**({"source": [URL, OTHER], "every_h": 8.0} | more))


def standing(every_h: float = 8.0, **state: Any) -> SourceStanding:
    given = {"good_tai_s": NOW - HOUR_S, "next_tai_s": NOW + 60.0} | state
    return url_standing(FetchState(URL, **given), section(every_h=every_h), NOW)


@pytest.mark.parametrize(
    ("ago_s", "said"),
    [
        (-50.0, "0.0 h"),
        (0.0, "0.0 h"),
        (2.0 * DAY_S, "48.0 h"),
        (2.0 * DAY_S + 1.0, "2.0 days"),
        (2.5 * DAY_S, "2.5 days"),
        (5400.0, "1.5 h"),
    ],
)
def test_a_good_answer_has_its_age_in_hours_up_to_two_days(ago_s: float, said: str) -> None:
    expected = f"last good answer {said} ago; asked next at {utc_text(NOW + 60.0, 0)}"
    assert standing(good_tai_s=NOW - ago_s) == SourceStanding(URL, expected, False)


@pytest.mark.parametrize(("in_s", "is_due"), [(-1.0, True), (0.0, True), (1.0, False)])
def test_one_that_is_due_says_so_in_place_of_a_time(in_s: float, is_due: bool) -> None:
    then = "as soon as anybody fetches" if is_due else f"at {utc_text(NOW + in_s, 0)}"
    assert standing(next_tai_s=NOW + in_s).text.endswith(f"; asked next {then}")


@pytest.mark.parametrize(("in_h", "is_due"), [(199.0, False), (201.0, True)])
def test_how_often_it_is_asked_decides_which_time_is_too_far_off(in_h: float, is_due: bool) -> None:
    found = standing(every_h=100.0, next_tai_s=NOW + in_h * HOUR_S)
    assert found.text.endswith("as soon as anybody fetches") == is_due


@pytest.mark.parametrize(("every_h", "old_days"), [(8.0, OLD_DAYS), (24.0, OLD_DAYS), (48.0, 6.0)])
@pytest.mark.parametrize(("by_s", "is_problem"), [(0.0, False), (1.0, True)])
def test_three_days_or_three_times_without_a_good_answer_are_a_problem(
    every_h: float, old_days: float, by_s: float, is_problem: bool
) -> None:
    assert OLD_DAYS == 3.0
    assert standing(every_h, good_tai_s=NOW - old_days * DAY_S - by_s).is_problem == is_problem


def test_one_that_was_never_asked_is_no_problem_yet() -> None:
    found = standing(good_tai_s=-inf, next_tai_s=-inf)
    assert found == SourceStanding(URL, "never fetched yet; asked next as soon as anybody fetches", False)


def test_one_that_fails_says_how_often() -> None:
    found = standing(problem="time out", failed_count=4)
    assert found.is_problem
    assert found.text.startswith("time out (4 times in a row); last good answer 1.0 h ago; ")


@pytest.mark.parametrize(("good_tai_s", "said"), [(-inf, "never fetched yet"), (NOW, "last good answer 0.0 h ago")])
def test_one_that_stopped_says_what_to_do(good_tai_s: float, said: str) -> None:
    expected = f"STOPPED: 403; nobody asks until `acu-daemon elements resume`; {said}"
    assert standing(stopped="403", problem="x", good_tai_s=good_tai_s) == SourceStanding(URL, expected, True)


def test_all_sources_stand_in_order_and_the_problems_of_the_urls_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "elements").mkdir()
    write_fetch_state(tmp_path / "elements", FetchState(URL, problem="time out", failed_count=1))
    rules = section(source=[URL, "here", OTHER])
    found = standings(tmp_path, rules, NOW)
    assert [(one.source, one.is_problem) for one in found] == [
        (URL, True),
        (OTHER, False),
        (str(tmp_path / "here"), True),
    ]
    assert fetch_problems(tmp_path, rules, NOW) == f"{URL}: {found[0].text}"
    write_fetch_state(tmp_path / "elements", FetchState(OTHER, stopped="403"))
    told = fetch_problems(tmp_path, rules, NOW)
    assert told.startswith(f"{URL}: time out")
    assert f"; {OTHER}: STOPPED: 403" in told
    assert fetch_problems(tmp_path, section(source=["here"]), NOW) == ""


# Directories


def directory(folder: Path, good_count: int, bad_count: int) -> SourceStanding:
    (folder / "here").mkdir()
    for k in range(good_count):
        (folder / "here" / f"{k:03}.tle").write_text(GOOD_TLE)
    for k in range(bad_count):
        (folder / "here" / f"x{k}.tle").write_text("nonsense")
    [found] = standings(folder, section(source=["here"]), NOW)
    assert found.source == str(folder / "here")
    return found


def test_a_directory_that_is_missing_or_empty_is_a_problem(tmp_path: Path) -> None:
    [found] = standings(tmp_path, section(source=["here"]), NOW)
    assert (found.text, found.is_problem) == ("no such directory: whoever fills it has not made it", True)
    empty = directory(tmp_path, 0, 0)
    assert (empty.text, empty.is_problem) == ("no file in it", True)


@pytest.mark.parametrize(
    ("bad_count", "told_count", "more"), [(0, 0, ""), (1, 1, ""), (3, 3, ""), (5, 3, " and 2 more")]
)
def test_files_that_cannot_be_read_are_told_the_first_three_by_name(
    tmp_path: Path, bad_count: int, told_count: int, more: str
) -> None:
    found = directory(tmp_path, 2, bad_count)
    assert found.is_problem == (bad_count > 0)
    assert found.text.startswith(f"{2 + bad_count} files" + ("; left out: " if bad_count else ""))
    assert [f"x{k}.tle" in found.text for k in range(5)] == [k < told_count for k in range(5)]
    assert found.text.endswith(more)
    assert ("more" in found.text) == bool(more)


@pytest.mark.parametrize(("by", "said"), [(-1, f"{MOST_FILES - 1} files"), (0, f"the first {MOST_FILES} files")])
def test_of_many_files_the_first_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by: int, said: str
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.setattr("acu_daemon.edge.elements_status.files_of", lambda path: [path] * (MOST_FILES + by))
    monkeypatch.setattr("acu_daemon.edge.elements_status.read_orbit_file", lambda _path: None)
    [found] = standings(tmp_path, section(source=["here"]), NOW)
    assert (found.text, found.is_problem) == (said, False)


# What others keep or send


def test_of_each_sender_the_newest_datagram_is_kept_until_it_is_asked_for() -> None:
    reader = NewestText(None, None)
    for sender, text in (("a", b"1"), ("b", b"2"), ("a", b"3"), ("", b"4")):
        reader.take(text, sender)
    assert reader.newest() == ([("udp", b"3"), ("udp", b"2"), ("udp", b"4")], "")
    assert reader.newest() == ([], "")


def test_there_are_no_more_than_sixteen_senders_and_those_known_go_on() -> None:
    reader = NewestText(None, None)
    for k in range(MOST_SENDERS + 2):
        reader.take(b"old", str(k))
    reader.take(b"new", "0")
    found, _ = reader.newest()
    assert MOST_SENDERS == len(found) == 16
    assert found[0] == ("udp", b"new")
    reader.take(b"late", "17")
    assert reader.newest() == ([("udp", b"late")], "")


def test_a_long_datagram_is_cut_and_its_sender_is_its_address_without_the_port() -> None:
    reader = NewestText(None, None)
    protocol = _Newest(reader)
    protocol.datagram_received(b"x" * (LARGEST_BYTES + 5), ("127.0.0.1", 4000))
    protocol.datagram_received(b"y" * (LARGEST_BYTES + 5), ("127.0.0.1", 4001))
    assert reader.newest() == ([("udp", b"y" * LARGEST_BYTES)], "")
    assert LARGEST_BYTES == 10_000


def test_a_file_comes_after_the_datagrams_and_is_cut_too(tmp_path: Path) -> None:
    path = tmp_path / "wind.json"
    path.write_bytes(b"z" * (LARGEST_BYTES + 5))
    reader = NewestText(None, path)
    reader.take(b"1")
    assert reader.newest() == ([("udp", b"1"), ("file", b"z" * LARGEST_BYTES)], "")
    assert reader.newest() == ([("file", b"z" * LARGEST_BYTES)], "")


def test_a_file_that_is_missing_or_none_is_a_problem_and_costs_no_datagram(tmp_path: Path) -> None:
    for path, problem in ((tmp_path / "none", "No such file or directory"), (tmp_path, "expected a file")):
        reader = NewestText(None, path)
        reader.take(b"1")
        assert reader.newest() == ([("udp", b"1")], f"{path}: {problem}")


async def test_without_an_address_nothing_is_listened_to() -> None:
    reader = NewestText(None, None)
    assert await reader.open() == ""
    reader.close()


async def test_an_address_of_another_machine_is_told() -> None:
    reader = NewestText("192.0.2.1:4000", None)
    assert await reader.open() == "Cannot assign requested address"
    reader.close()
