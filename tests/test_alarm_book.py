"""The book of alarms: which alarm is which, who saw it, in which order they are shown and which are forgotten."""

from itertools import permutations

import pytest

from acu_daemon.web.alarm_book import KEPT, AlarmBook, SeenAlarm, acknowledged, in_order, seen


def over(number: int, by: str = "") -> SeenAlarm:
    return SeenAlarm(number, f"alarm {'x' * number}", "began", "ended", by)


def numbers(book: AlarmBook) -> list[int]:
    return [one.number for one in book]


def test_forty_are_kept_that_are_over() -> None:
    assert KEPT == 40


@pytest.mark.parametrize(("count", "left"), [(39, 39), (40, 40), (41, 40), (45, 40)])
@pytest.mark.parametrize("by", ["", "Ann"])
def test_of_those_that_are_over_the_oldest_are_forgotten_first(count: int, left: int, by: str) -> None:
    book = tuple(over(number, by) for number in range(1, count + 1))
    assert numbers(seen(book, [], "now")) == list(range(count - left + 1, count + 1))


def test_those_that_somebody_saw_are_forgotten_before_those_that_nobody_saw() -> None:
    book = tuple(over(number, "Ann" if number in (20, 41, 42) else "") for number in range(1, 43))
    assert numbers(seen(book, [], "now")) == [*range(1, 20), *range(21, 41), 42]
    assert numbers(seen((*book, over(43)), [], "now")) == [*range(1, 20), *range(21, 41), 43]


def test_those_that_last_are_not_counted_and_not_forgotten() -> None:
    lasting = [f"it lasts{'!' * number}" for number in range(60)]
    book = seen(tuple(over(number) for number in range(1, KEPT + 1)), lasting, "now")
    assert len(book) == KEPT + 60
    assert seen(acknowledged(book, 41, "Ann"), lasting, "later")[KEPT].acknowledged_by == "Ann"


def test_one_that_ends_makes_the_oldest_go_in_the_same_look() -> None:
    book = seen(tuple(over(number) for number in range(1, KEPT + 1)), ["new"], "now")
    book = seen(book, [], "later")
    assert numbers(book) == list(range(2, KEPT + 2))
    assert (book[-1].began_utc, book[-1].ended_utc) == ("now", "later")


def test_a_new_alarm_has_a_number_that_no_other_has_had() -> None:
    book = seen((over(7), over(3, "Ann")), ["a", "b"], "now")
    assert numbers(book) == [7, 3, 8, 9]
    assert [one.text for one in book[2:]] == ["a", "b"]
    assert numbers(seen((), ["a"], "now")) == [1]


@pytest.mark.parametrize(
    ("first", "then", "is_same"),
    [
        ("az 5 deg", "az 123 deg", True),
        ("az 5.25 deg", "az 5 deg", True),
        ("az -5.25 deg", "az 5.25 deg", True),
        ("az +5 deg", "az -7.5 deg", True),
        ("axis 1 at 5, axis 2 at 6", "axis 3 at 4, axis 4 at 3", True),
        ("az 5 deg", "el 5 deg", False),
        ("az 5 deg", "az 5 deg/s", False),
        ("az 5 deg", "az deg", False),
        ("no link", "no links", False),
    ],
)
def test_the_same_words_with_other_numbers_are_the_same_alarm(first: str, then: str, is_same: bool) -> None:
    book = seen(acknowledged(seen((), [first], "0"), 1, "Ann"), [then], "1")
    same = (SeenAlarm(1, then, "0", "", "Ann"),)
    assert book == (same if is_same else (SeenAlarm(1, first, "0", "1", "Ann"), SeenAlarm(2, then, "1")))


def test_an_alarm_that_comes_again_is_not_acknowledged_by_who_saw_it_before() -> None:
    book = seen(acknowledged(seen((), ["no link"], "0"), 1, "Ann"), [], "1")
    book = seen(book, [], "2")
    assert seen(book, ["no link"], "3") == (
        SeenAlarm(1, "no link", "0", "1", "Ann"),
        SeenAlarm(2, "no link", "3", "", ""),
    )


def test_one_that_is_over_can_still_be_acknowledged_and_only_that_one() -> None:
    book = (over(1), over(2), over(3))
    assert acknowledged(book, 2, "Ann") == (over(1), over(2, "Ann"), over(3))
    assert acknowledged(book, 9, "Ann") == book


@pytest.mark.parametrize("turn", list(permutations(range(4)))[::5])
def test_they_are_shown_unseen_first_then_lasting_first_then_newest_first(turn: tuple[int, ...]) -> None:
    for later in (0, 10):
        pairs = (
            [SeenAlarm(10 + later, "a", ""), SeenAlarm(9 + later, "b", "")],
            [SeenAlarm(30 - later, "c", "", "e"), SeenAlarm(19 - later, "d", "", "e")],
            [SeenAlarm(5 + 3 * later, "f", "", "", "Ann"), SeenAlarm(4, "g", "", "", "Ann")],
            [SeenAlarm(50 + later, "h", "", "e", "Ann"), SeenAlarm(3, "i", "", "e", "Ben")],
        )
        book = tuple(one for k in turn for one in pairs[k])
        assert [one.text for one in in_order(book)] == list("abcdfghi")
        assert [one.text for one in in_order(book[::-1])] == list("abcdfghi")
