"""schedule.book and schedule.sqlite3: states of passes, what a plan changes, what outlives a kill and a full disk."""

import sqlite3
from dataclasses import replace

import pytest
from test_schedule import DAY, RULES, track

from acu_daemon.edge.schedule_file import NAME, ScheduleFile
from acu_daemon.errors import UsageError
from acu_daemon.schedule.book import Entry, PassState, merged
from acu_daemon.schedule.decisions import RESUMED, decide
from acu_daemon.schedule.rules import PassRequest, Wish

UNTIL = DAY + 86400.0


def first_book() -> tuple[Entry, ...]:
    return merged((), decide([track("A", 1000.0), track("B", 1300.0, priority=7)], RULES), DAY, UNTIL).book


def test_a_first_plan_is_not_told_pass_by_pass_a_change_is():
    first = merged((), decide([track("A", 1000.0), track("B", 1300.0, priority=7)], RULES), DAY, UNTIL)
    assert first.said == ()
    assert [(one.satellite, one.state) for one in first.book] == [("A", PassState.REFUSED), ("B", PassState.PLANNED)]
    assert [one.number for one in first.book] == [1, 2]
    second = merged(
        first.book, decide([track("A", 1000.0, priority=9), track("B", 1300.0, priority=7)], RULES), DAY, UNTIL
    )
    assert len(second.said) == 2
    assert "planned, was refused" in second.said[0]
    assert "refused (lost to A" in second.said[1]
    assert [one.number for one in second.book] == [1, 2]


def test_a_pass_moved_by_new_elements_keeps_its_number_and_is_told_beyond_five_seconds():
    book = first_book()
    near = merged(book, decide([track("A", 1003.0), track("B", 1303.0, priority=7)], RULES), DAY, UNTIL)
    assert near.said == ()
    assert len(near.changed) == 2
    moved = merged(book, decide([track("A", 1000.0), track("B", 1320.0, priority=7)], RULES), DAY, UNTIL)
    assert moved.said == (f"{moved.book[1].name}: moved by up to 20 s",)
    assert moved.book[1].number == 2


def test_what_is_under_way_or_over_is_not_touched_by_a_plan():
    book = tuple(replace(one, state=PassState.DONE, reason="all well") for one in first_book())
    after = merged(book, decide([track("A", 1000.0, priority=9)], RULES), DAY, UNTIL)
    assert after.book == book
    assert after.changed == ()


@pytest.mark.parametrize(
    ("state", "now_s", "becomes"),
    [
        (PassState.PLANNED, 1000.0, PassState.CANCELLED),
        (PassState.PLANNED, 3000.0, PassState.MISSED),
        (PassState.PASS, 3000.0, PassState.FAILED),
        (PassState.REFUSED, 3000.0, PassState.REFUSED),
        (PassState.DONE, 3000.0, PassState.DONE),
    ],
)
def test_an_entry_that_a_plan_does_not_have_is_never_lost(state, now_s, becomes):
    [_, entry] = first_book()
    after = merged([replace(entry, state=state)], [], DAY + now_s, UNTIL)
    assert [one.state for one in after.book] == [becomes]
    assert bool(after.said) == (state is not becomes)


def test_a_pass_that_was_to_be_gone_on_with_after_a_kill_and_was_over_by_then_failed_with_that_reason():
    [_, entry] = first_book()
    after = merged([replace(entry, state=PassState.PLANNED, reason=RESUMED)], [], DAY + 3000.0, UNTIL)
    assert [(one.state, one.reason) for one in after.book] == [
        (PassState.FAILED, "the daemon ended in mid-pass, and came back too late")
    ]


def test_the_file_gives_back_what_it_was_given_to_another_process(tmp_path):
    book = first_book()
    with ScheduleFile(tmp_path) as file:
        file.save(book, DAY)
        file.save([replace(book[0], state=PassState.DONE, reason="")], DAY + 5.0)
        request = PassRequest("A", DAY + 1300.0, Wish.FORCE)
        file.say(request, DAY, "operator")
        file.pause(DAY + 100.0, DAY, "operator")
        with ScheduleFile(tmp_path, is_read_only=True) as other:
            assert other.book(DAY) == (replace(book[0], state=PassState.DONE, reason=""), book[1])
            assert other.words().requests == (request,)
            assert other.words().pause_until_tai_s == DAY + 100.0
            assert [state for _, state, _ in other.history(1)] == ["refused", "done"]
            assert other.next_number() == 3


def test_what_a_full_disk_refused_is_saved_with_the_next_change(tmp_path):
    book = first_book()
    with ScheduleFile(tmp_path) as file:
        file.save(book[:1], DAY)
        pages = file._written.execute("pragma page_count").fetchone()[0]
        file._written.execute(f"pragma max_page_count = {pages}")
        many = [replace(book[1], number=2 + at, reason="x" * 4000) for at in range(20)]
        file.save(many, DAY)
        assert "full" in file.problem
        assert len(file.book(DAY)) == 1
        file._written.execute("pragma max_page_count = 10000")
        file.save([], DAY)
        assert file.problem == ""
        assert len(file.book(DAY)) == 21


def test_a_damaged_file_and_a_newer_one_say_what_to_do(tmp_path):
    (tmp_path / NAME).write_bytes(b"no database at all, but long enough to be looked at" * 100)
    with pytest.raises(UsageError, match="move it away"):
        ScheduleFile(tmp_path)
    (tmp_path / NAME).unlink()
    with sqlite3.connect(tmp_path / NAME) as newer:
        newer.execute("pragma user_version = 99")
    newer.close()
    with pytest.raises(UsageError, match="newer version"):
        ScheduleFile(tmp_path)


def test_pruning_takes_old_passes_with_their_history_and_no_others(tmp_path):
    book = first_book()
    with ScheduleFile(tmp_path) as file:
        file.save(book, DAY)
        assert file.prune(book[0].set_tai_s + 1.0) == 1
        assert file.book(DAY) == book[1:]
        assert file.history(1) == []
