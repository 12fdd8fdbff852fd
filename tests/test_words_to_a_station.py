"""What each of a person's words does to the station, and how it is answered: word by word, without a flight."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from config_files import BROUWER
from structlog.testing import capture_logs
from test_station_day import ENTRY, NOW, STRONG, Desk

from acu_daemon.cli.station_hand import StationHand
from acu_daemon.control.tick_input import StowBy
from acu_daemon.daemon.operator_verbs import VERBS
from acu_daemon.edge.schedule_file import NO_PAUSE, Words
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.rules import PassRequest, Wish

WHO = "ann@desk"
AT = NOW + 1300.0
OF_THE_RUN = sorted({"arm", "disarm", "stop", "clear", "stow", "hold", "track", "grant", "revoke"})


class Run:
    """The run that is on: remembers what it was asked."""

    def __init__(self, answer: str = "ok done") -> None:
        self.said, self.asked, self.stopped = answer, list[tuple[str, str]](), list[str]()

    def answer(self, line: str, who: str) -> str:
        self.asked.append((line, who))
        return self.said

    def stop(self, reason: str) -> None:
        self.stopped.append(reason)


class Said:
    """A hand on a station whose run is on."""

    def __init__(self, folder: Path) -> None:
        self.desk, self.run = Desk(folder), Run()
        self.day = self.desk.day
        self.hand = StationHand(self.day, self.desk.tai_s)

    def __call__(self, line: str, who: str = WHO) -> str:
        run: Any = self.run
        with capture_logs() as logs:
            answer = self.hand.answer(line, who, run)
        self.told = [one for one in logs if one["event"] == "operator.asked"]
        return answer

    @property
    def words(self) -> Words:
        return self.desk.file.words()

    @property
    def by_whom(self) -> list[str]:
        return [row[0] for row in self.desk.file._db.execute("select by_whom from requests").fetchall()]


@pytest.fixture
def said(tmp_path: Path) -> Iterator[Said]:
    made = Said(tmp_path)
    yield made
    made.desk.file.close()


def test_before_a_run_is_on_nothing_is_answered(said: Said) -> None:
    for line in ("status", "reload", "nonsense"):
        assert said.hand.answer(line, WHO, None) == "error the station starts"
    assert said.desk.keeper.anew_reason == ""


@pytest.mark.parametrize("verb", OF_THE_RUN)
def test_what_is_no_word_of_the_station_the_run_answers(said: Said, verb: str) -> None:
    assert said(verb) == "ok done"
    assert said.run.asked == [(verb, WHO)]
    assert said.told == []  # the run tells it
    assert verb in VERBS


def test_status_is_the_runs_and_an_unknown_word_nobodys(said: Said) -> None:
    assert said("status") == "ok done"
    assert said.run.asked == [("status", WHO)]
    assert said("jump").startswith("error 'jump' is unknown, expected status, arm,")
    assert said("skip until=now").startswith("error 'skip until=now': 'until=now' is unknown")
    assert len(said.run.asked) == 1


def test_a_reload_is_told_with_who_said_it(said: Said) -> None:
    assert said("reload") == "ok reload: now"
    assert (said.desk.keeper.anew_reason, said.run.asked) == ("a person asked", [])
    assert [(one["line"], one["who"], one["answer"]) for one in said.told] == [("reload", WHO, "ok reload: now")]


def test_a_stow_in_strong_wind_stays_and_any_other_one_is_the_runs_to_end(said: Said) -> None:
    said.day.stow_by, said.day.wind.seen = StowBy.WIND, STRONG
    assert said("unstow") == f"error {said.day.wind.why_not_unstow(StowBy.WIND)}"
    assert said.run.asked == []
    said.day.stow_by = StowBy.OPERATOR
    assert said("unstow") == "ok done"
    assert said.run.asked == [("unstow", WHO)]


# Pauses


@pytest.mark.parametrize(("in_s", "is_taken"), [(-1, False), (0, False), (1, True)])
def test_a_pause_is_until_a_time_to_come(said: Said, in_s: int, is_taken: bool) -> None:
    until = utc_text(NOW + in_s, 3)
    answer = said(f"pause until={until}")
    if is_taken:
        assert answer == f"ok no pass is begun until {utc_text(NOW + in_s, 0)}"
        assert said.words.pause_until_tai_s == NOW + in_s
    else:
        assert answer == f"error until={until}: expected a time to come; it is {utc_text(NOW, 0)}"
        assert said.words.pause_until_tai_s == NO_PAUSE
    assert said.told[0]["answer"] == answer


@pytest.mark.parametrize("line", ["pause", "pause until=soon"])
def test_a_pause_without_a_time_is_none(said: Said, line: str) -> None:
    assert said(line).startswith("error until")
    assert said.words == Words()


def test_a_pause_ends_by_a_word(said: Said) -> None:
    said(f"pause until={utc_text(NOW + 50.0)}")
    assert said("unpause") == "ok the pause is over"
    assert said.words.pause_until_tai_s == NO_PAUSE
    rows = said.desk.file._db.execute("select by_whom from pauses").fetchall()
    assert rows == [(WHO,), (WHO,)]


# Skipped


def test_a_pass_that_is_to_come_is_skipped_and_not(said: Said) -> None:
    at = utc_text(AT)
    assert said(f"skip satellite=scd at={at}") == f"ok not tracked: scd at {utc_text(AT, 0)}; `unskip` withdraws it"
    assert said(f"unskip satellite=scd at={at}") == "ok the pass of scd is as planned"
    assert said.words.requests == (PassRequest("scd", AT, Wish.EXCLUDE), PassRequest("scd", AT, Wish.NONE))
    assert (said.by_whom, said.run.stopped) == ([WHO, WHO], [])


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (f"skip satellite=sdc at={utc_text(AT)}", "error satellite=sdc: no such satellite, there are other, scd"),
        (f"unskip satellite=sdc at={utc_text(AT)}", "error satellite=sdc: no such satellite, there are other, scd"),
        (f"skip at={utc_text(AT)}", "error satellite=: no such satellite, there are other, scd"),
        ("skip satellite=scd at=noon", "error at "),
        ("skip satellite=scd", "error at "),
        ("unskip", "error satellite=: no such satellite, there are other, scd"),
    ],
)
def test_a_pass_is_named_by_a_satellite_that_is_there_and_a_time(said: Said, line: str, expected: str) -> None:
    (said.desk.config / "satellites" / "other.toml").write_text(BROUWER)
    assert said(line).startswith(expected)
    assert said.words == Words()


def test_without_a_name_it_is_the_next_one_that_is_granted(said: Said) -> None:
    at = utc_text(ENTRY.culmination_tai_s, 0)
    assert said("skip") == f"ok not tracked: scd at {at}; `unskip` withdraws it"
    assert said.words.requests == (PassRequest("scd", ENTRY.culmination_tai_s, Wish.EXCLUDE),)
    said.desk.keeper.book = ()
    assert said("skip") == "error skip: no pass is granted"


@pytest.mark.parametrize(("who", "by"), [(WHO, WHO), ("", "a person")])
@pytest.mark.parametrize("named", ["", f" satellite=scd at={utc_text(ENTRY.rise_tai_s + 1.0)}"])
def test_the_pass_that_is_on_is_given_up_at_once(said: Said, named: str, who: str, by: str) -> None:
    said.day.begun(said.desk.entry)
    assert said(f"skip{named}", who) == f"ok given up: {ENTRY.name}"
    assert said.run.stopped == [f"skipped by {by}"]
    assert said.day.course._tracked.cancelled_by == by
    assert said.words == Words()


@pytest.mark.parametrize(
    ("satellite", "at_tai_s"),
    [("scd", ENTRY.set_tai_s + 3000.0), ("scd", ENTRY.rise_tai_s - 3000.0), ("other", ENTRY.culmination_tai_s)],
)
def test_a_word_about_another_pass_leaves_the_one_that_is_on(said: Said, satellite: str, at_tai_s: float) -> None:
    (said.desk.config / "satellites" / "other.toml").write_text(BROUWER)
    said.day.begun(said.desk.entry)
    assert said(f"skip satellite={satellite} at={utc_text(at_tai_s)}").startswith(f"ok not tracked: {satellite} at ")
    assert said.run.stopped == []
    assert said.day.course._tracked.cancelled_by == ""
    assert [one.satellite for one in said.words.requests] == [satellite]


# Nudges


def test_a_nudge_that_is_kept_is_the_runs_without_that_word_and_kept_if_it_is_taken(said: Said) -> None:
    said.day.begun(said.desk.entry)
    assert said("nudge along_s=0.5 keep=yes across_deg=-1") == "ok done"
    assert said.run.asked == [("nudge along_s=0.5 across_deg=-1", WHO)]
    assert said.day.course._tracked.is_nudge_kept
    assert len(said.told) == 1


def test_one_that_is_not_taken_is_not_kept(said: Said) -> None:
    said.day.begun(said.desk.entry)
    said.run.said = "error no path"
    assert said("nudge along_s=0.5 keep=yes") == "error no path"
    assert not said.day.course._tracked.is_nudge_kept


def test_one_that_is_not_to_be_kept_is_the_runs_alone(said: Said) -> None:
    said.day.begun(said.desk.entry)
    assert said("nudge along_s=0.5") == "ok done"
    assert said.run.asked == [("nudge along_s=0.5", WHO)]
    assert not said.day.course._tracked.is_nudge_kept


@pytest.mark.parametrize("is_on", [True, False])
@pytest.mark.parametrize("keep", ["no", "yes"])
def test_one_is_kept_by_yes_and_in_a_pass(said: Said, keep: str, is_on: bool) -> None:
    if is_on:
        said.day.begun(replace(said.desk.entry))
    answer = said(f"nudge along_s=0.5 keep={keep}")
    if keep == "no":
        assert answer == "error keep=no: expected yes, or nothing"
    elif not is_on:
        assert answer == "error no pass is on"
    assert (said.run.asked != []) == (keep == "yes" and is_on)
