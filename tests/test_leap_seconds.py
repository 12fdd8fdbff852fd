"""The system's leap-seconds.list: read, checked, compared with the built-in table, its expiry told."""

from collections.abc import Iterator
from datetime import date, timedelta
from hashlib import sha1
from pathlib import Path

import numpy as np
import pytest

from acu_daemon.errors import EarthOrientationError
from acu_daemon.orbit.leap_seconds import parse_leap_seconds
from acu_daemon.orbit.timescales import LEAP_DATES, adopt_leap_dates, tai_from_utc, unix_from_tai, utc_days, utc_text

SYSTEM = Path("/usr/share/zoneinfo/leap-seconds.list")
MADE, EXPIRES = 3960835200, 3991593600  # 2025-07-07, 2026-06-28, seconds since 1900


def ntp_s(day: date) -> int:
    return (day - date(1900, 1, 1)) // timedelta(seconds=1)


def a_list(dates=LEAP_DATES, expires: int = EXPIRES, word: str | None = None) -> str:
    data = [(ntp_s(day), 10 + i) for i, day in enumerate(dates)]
    digest = sha1((f"{MADE}{expires}" + "".join(f"{s}{offset}" for s, offset in data)).encode()).hexdigest()
    words = [digest[i : i + 8].lstrip("0") for i in range(0, 40, 8)]  # as the file has them
    lines = [f"{s}\t{offset}\t# of a day" for s, offset in data]
    return "\n".join([f"#$\t{MADE}", "# a remark", f"#@\t{expires}", *lines, f"#h\t{word or ' '.join(words)}", ""])


def test_a_list_like_the_built_in_table_brings_nothing_new_and_says_when_it_expires() -> None:
    found = parse_leap_seconds(a_list(), "leap-seconds.list")
    assert found.dates == LEAP_DATES
    assert not found.is_newer()
    assert found.expires_tai_s == tai_from_utc("2026-06-28T00:00:00Z")
    assert found.warning(tai_from_utc("2026-06-27T00:00:00Z")) is None
    assert found.warning(tai_from_utc("2026-07-08T00:00:00Z")) == (
        "the list of leap seconds expired on 2026-06-28, 10 days ago: a leap second announced since would put all "
        "times off by 1 s. Update tzdata"
    )


def test_a_list_with_one_more_leap_second_is_newer() -> None:
    found = parse_leap_seconds(a_list((*LEAP_DATES, date(2029, 7, 1))), "leap-seconds.list")
    assert found.is_newer()
    assert found.dates[-1] == date(2029, 7, 1)


def test_a_word_of_the_hash_that_begins_with_a_zero_may_lack_it() -> None:
    texts = (a_list(expires=EXPIRES + days * 86400) for days in range(100))
    text = next(text for text in texts if min(map(len, text.split("#h\t")[1].split())) < 8)
    assert parse_leap_seconds(text, "leap-seconds.list").dates == LEAP_DATES


@pytest.fixture
def _built_in_afterwards() -> Iterator[None]:
    yield
    adopt_leap_dates(LEAP_DATES)


@pytest.mark.usefixtures("_built_in_afterwards")
def test_a_newer_list_that_is_adopted_moves_utc_from_its_leap_second_on() -> None:
    before_s, after_s = tai_from_utc("2029-06-30T23:59:59Z"), tai_from_utc("2029-07-01T00:00:00Z")
    days, fraction = utc_days(np.array([after_s]))
    adopt_leap_dates(parse_leap_seconds(a_list((*LEAP_DATES, date(2029, 7, 1))), "leap-seconds.list").dates)
    assert tai_from_utc("2029-06-30T23:59:59Z") == before_s
    assert utc_text(before_s + 1.5, 1) == "2029-06-30T23:59:60.5Z"
    assert tai_from_utc("2029-07-01T00:00:00Z") == after_s + 1.0
    assert unix_from_tai(after_s + 1.0) == 1877558400.0  # 2029-07-01 as POSIX time
    there, within = utc_days(np.array([after_s + 1.0]))
    assert (float(there[0]), float(within[0])) == (float(days[0]), float(fraction[0]))
    assert tai_from_utc("2016-12-31T23:59:60Z") == 536500836.0


def test_the_numbers_are_those_of_the_published_file() -> None:
    assert f"{ntp_s(date(2017, 1, 1))}" == "3692217600"  # its line reads: 3692217600 37 # 1 Jan 2017
    assert "3692217600\t37" in a_list()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "contradicts"),
        ("<html>", "line 1: expected seconds since 1900"),
        (a_list().replace("3692217600\t37", "3692217600\t38"), "line 31: expected .* TAI-UTC one second above"),
        (a_list().replace("3692217600", "3692217601"), "line 31"),
        (a_list(expires=EXPIRES).replace(str(EXPIRES), str(EXPIRES + 1)), "damaged: its SHA-1"),
        (a_list(word="1 2 3 4 5"), "damaged"),
        (a_list((*LEAP_DATES[:-1], date(2018, 1, 1))), "contradicts those up to 2017-01-01"),
    ],
)
def test_a_list_that_cannot_be_trusted_is_refused(text: str, expected: str) -> None:
    with pytest.raises(EarthOrientationError, match=expected):
        parse_leap_seconds(text, "leap-seconds.list")


@pytest.mark.skipif(not SYSTEM.exists(), reason="this system has no leap-seconds.list")
def test_the_systems_own_list_is_read() -> None:
    found = parse_leap_seconds(SYSTEM.read_text(), SYSTEM.name)
    assert found.dates[: len(LEAP_DATES)] == LEAP_DATES
    assert found.expires_tai_s is not None
