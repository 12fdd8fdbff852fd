"""UTC, TAI, POSIX time, Julian days and sidereal time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skyfield.api import load

from acu_daemon.orbit.timescales import gmst_rad, tai_from_unix, tai_from_utc, unix_from_tai, utc_days, utc_text

FLOAT_STEP_S = 2e-7  # of a time of today
SKYFIELD = load.timescale(builtin=True)


@pytest.mark.parametrize(
    ("utc", "tai_s"),
    [
        ("2000-01-01T11:59:28Z", 0.0),  # TAI-UTC was 32 s
        ("2000-01-01T12:00:00.25Z", 32.25),
        ("2016-12-31T23:59:59Z", 536500835.0),
        ("2016-12-31T23:59:60Z", 536500836.0),
        ("2017-01-01T00:00:00Z", 536500837.0),
        ("1972-06-30T23:59:60Z", -867931190.0),
    ],
)
def test_utc_becomes_tai_through_leap_seconds_and_back(utc: str, tai_s: float) -> None:
    assert tai_from_utc(utc) == tai_s
    assert tai_from_utc(utc_text(tai_s)) == tai_s


def test_skyfield_has_the_same_leap_seconds() -> None:
    for year in range(1973, 2026):
        for month in (1, 7):
            tai_s = tai_from_utc(f"{year}-{month:02d}-01T00:00:00Z")
            assert SKYFIELD.utc(year, month, 1).tai == pytest.approx(2451545.0 + tai_s / 86400.0, abs=1e-9)


def test_a_leap_second_is_printed_as_second_60() -> None:
    assert utc_text(536500836.5) == "2016-12-31T23:59:60.500Z"
    assert utc_text(536500836.9999) == "2017-01-01T00:00:00.000Z"
    assert utc_text(536500835.9999) == "2016-12-31T23:59:60.000Z"
    assert utc_text(32.0, 0) == "2000-01-01T12:00:00Z"


@pytest.mark.parametrize(
    "text",
    [
        *("", "2018-12-25", "2018-12-25T01:40:00", "2018-12-25 01:40:00Z", "2018-12-25T01:40:00+00:00"),
        *("2018-13-25T01:40:00Z", "2018-02-29T01:40:00Z", "2018-12-25T24:00:00Z", "2018-12-25T01:60:00Z"),
        *("2018-12-31T23:59:60Z", "2016-12-31T22:59:60Z", "2016-12-31T23:59:61Z", "２018-12-25T01:40:00Z"),
        *("0000-01-01T00:00:00Z", "2018-12-25T01:40:00.Z"),
    ],
)
def test_a_time_that_is_no_utc_is_refused_with_what_was_expected(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected UTC as YYYY-MM-DDThh:mm:ss|no leap second"):
        tai_from_utc(text)


@given(st.floats(-8e8, 2e9))
def test_printing_and_reading_a_time_gives_it_back(tai_s: float) -> None:
    assert tai_from_utc(utc_text(tai_s, 6)) == pytest.approx(tai_s, abs=0.6e-6 + FLOAT_STEP_S, rel=0)


@given(st.integers(-5 * 10**8, 3 * 10**9))
def test_posix_time_there_and_back_is_the_same(unix_s: int) -> None:
    assert unix_from_tai(tai_from_unix(unix_s)) == unix_s


def test_posix_time_agrees_with_the_printed_utc() -> None:
    assert utc_text(tai_from_unix(1545702000.0)) == "2018-12-25T01:40:00.000Z"


def test_julian_days_are_those_of_utc() -> None:
    tai_s = np.array([tai_from_utc("2018-12-25T06:00:00Z"), tai_from_utc("2000-01-01T12:00:00Z")])
    day, fraction = utc_days(tai_s)
    assert day.tolist() == [2458477.5, 2451544.5]
    assert fraction.tolist() == [0.25, 0.5]


def test_sidereal_time_is_that_of_vallados_example() -> None:
    # Vallado, Fundamentals of Astrodynamics, example 3-5: 1992-08-20T12:14 UT1, 152.578787886 deg
    tai_s = np.array([tai_from_utc("1992-08-20T12:14:00Z")])
    assert np.degrees(gmst_rad(tai_s, 0.0)) == pytest.approx(152.578787886, abs=1e-7)


def test_sidereal_time_takes_ut1_from_its_difference_to_utc() -> None:
    tai_s = np.array([tai_from_utc("1992-08-20T12:14:00Z")])
    assert gmst_rad(tai_s + 0.5, -0.5) == pytest.approx(gmst_rad(tai_s, 0.0), abs=1e-10)
