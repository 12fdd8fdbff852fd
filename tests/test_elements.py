"""Which set of a list is used, and which sets are refused or warned of: limits, age, decay."""

from dataclasses import replace

import numpy as np
import pytest

from acu_daemon.errors import ElementsError
from acu_daemon.orbit.aging import ExpectedError, expected_error
from acu_daemon.orbit.brouwer import BrouwerElements
from acu_daemon.orbit.element_set import ElementSet, rad_s_from_rev_day
from acu_daemon.orbit.elements import ElementLimits, check_brouwer, check_elements
from acu_daemon.orbit.selection import select_elements
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S

TEXT = """ISS (ZARYA)
1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996
2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325546
"""
SUBORBITAL = """1 28872U 05037B   05333.02012661  .25992681  00000-0  24476-3 0  1534
2 28872  96.4736 157.9986 0303955 244.0492 110.6523 16.46015938 10708
"""
LAST_DAYS = """1 29141U 85108AA  06170.26783845  .99999999  00000-0  13519-0 0   718
2 29141  82.4288 273.4882 0015848 277.2124  83.9133 15.93343074  6828
"""
ISS: ElementSet = parse_tle(TEXT, "iss.tle")[0][0]
NOW = ISS.epoch_tai_s
LIMITS = ElementLimits()


def aged(days: float) -> float:
    return NOW + days * DAY_S


def test_a_fresh_low_orbit_is_neither_refused_nor_warned_of() -> None:
    assert check_elements(ISS, LIMITS, aged(3.0)) == ([], [])


def test_an_epoch_60_days_old_is_refused_with_file_line_and_reason() -> None:
    [error], [] = check_elements(ISS, LIMITS, aged(60.0))
    assert error == (
        "iss.tle, line 2: ISS (ZARYA) (25544): the epoch 2022-02-10T13:19:06Z is 60.0 days old, the limit is 30 days; "
        "fetch newer elements: expected error about 730 s along the track, 86 deg overhead (max_age_days = 30, the "
        "default; set it in [elements.limits] of the satellite's file)"
    )


def test_an_epoch_of_the_future_is_refused_too() -> None:
    [error], [] = check_elements(ISS, LIMITS, aged(-60.0))
    assert "is 60.0 days ahead of the clock, the limit is 30 days" in error


def test_an_epoch_12_days_old_is_warned_of() -> None:
    [], [warning] = check_elements(ISS, LIMITS, aged(12.0))
    assert warning.startswith("iss.tle, line 2: ISS (ZARYA) (25544): the epoch 2022-02-10T13:19:06Z is 12.0 days old")


def test_the_age_limits_are_those_of_the_satellite() -> None:
    limits = replace(LIMITS, warn_age_days=70.0, max_age_days=90.0)
    assert check_elements(ISS, limits, aged(60.0)) == ([], [])


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"mean_motion_rad_s": rad_s_from_rev_day(1.0027)}, "semi-major axis 42165.24 km is outside 6500..8500 km"),
        ({"mean_motion_rad_s": rad_s_from_rev_day(13.0), "eccentricity": 0.12}, "eccentricity 0.12 is outside 0..0.1"),
    ],
)
def test_an_element_outside_the_limits_is_refused_with_what_was_expected(
    changes: dict[str, float], reason: str
) -> None:
    errors, _ = check_elements(replace(ISS, **changes), LIMITS, NOW)
    assert errors[0].startswith(f"iss.tle, line 2: ISS (ZARYA) (25544): {reason}")
    assert "widen [elements.limits]" in errors[0]


def test_limits_may_be_narrower_or_wider() -> None:
    [error], [] = check_elements(ISS, replace(LIMITS, max_inclination_deg=51.0), NOW)
    assert "inclination 51.6412 deg is outside 0..51 deg" in error
    assert check_elements(ISS, replace(LIMITS, max_inclination_deg=51.6412), NOW) == ([], [])


def test_a_perigee_inside_the_atmosphere_is_a_decayed_satellite() -> None:
    [one], [] = parse_tle(SUBORBITAL, "deb.tle")
    errors, _ = check_elements(one, LIMITS, one.epoch_tai_s)
    assert "deb.tle, line 1: NORAD 28872: mean perigee at " in errors[0]
    assert "the satellite has decayed, or the elements are wrong" in errors[0]


def test_a_satellite_that_decays_before_now_is_refused() -> None:
    [one], [] = parse_tle(LAST_DAYS, "deb.tle")
    assert check_elements(one, LIMITS, one.epoch_tai_s) == ([], [])
    [error], [] = check_elements(one, LIMITS, one.epoch_tai_s + DAY_S / 2)
    assert error.startswith("deb.tle, line 1: NORAD 29141: no position at 2006-06-19T")
    assert "the satellite has decayed (SGP4 error 6)" in error


def test_elements_written_in_a_file_are_checked_alike() -> None:
    scd_1 = BrouwerElements("SCD-1", NOW, 7180e3, 0.0436, float(np.radians(23.82)), 4.19, 0.27, 6.1)
    assert check_brouwer(scd_1, LIMITS, NOW, "scd-1.toml") == ([], [])
    errors, _ = check_brouwer(replace(scd_1, e=0.2), LIMITS, aged(40.0), "scd-1.toml")
    assert [error.split(";")[0] for error in errors] == [
        "scd-1.toml: SCD-1: eccentricity 0.2 is outside 0..0.1",
        "scd-1.toml: SCD-1: mean perigee at -634 km height, under 120 km: the satellite has decayed, "
        "or the elements are wrong",
        "scd-1.toml: SCD-1: the epoch 2022-02-10T13:19:06Z is 40.0 days old, the limit is 30 days",
    ]


HISTORY = [replace(ISS, epoch_tai_s=aged(days), line=line) for line, days in enumerate((-2.0, 0.0, -1.0, 2.0))]
OTHER = replace(ISS, name="SENTINEL-3A", norad_id=41335)


@pytest.mark.parametrize(
    ("now_days", "line"),
    [(1.0, 1), (1.1, 3), (0.6, 1), (-0.5, 2), (-1.4, 2), (-1.6, 0), (-5.0, 0), (9.0, 3), (-1.5, 0)],
)
def test_the_set_nearest_in_time_is_chosen_before_or_after_now_and_the_older_of_two_as_near(
    now_days: float, line: int
) -> None:
    selected = select_elements(HISTORY, 25544, None, aged(now_days))
    assert selected.elements.line == line
    assert selected.warnings == []


def test_which_of_several_sets_is_used_and_why_is_said() -> None:
    selected = select_elements([HISTORY[0], HISTORY[1]], 25544, None, aged(-0.1))
    assert selected.why == (
        "iss.tle, line 1: ISS (ZARYA) (25544): of 2 sets the one of 2022-02-10T13:19:06Z is used, 2.4 h after "
        "2022-02-10T10:55:06Z: nearest in time, so its expected error is the least; the next is 45.6 h before "
        "2022-02-10T10:55:06Z"
    )
    assert select_elements([ISS, ISS], 25544, None, NOW).why == ""


def test_a_file_with_one_satellite_needs_neither_number_nor_name() -> None:
    assert select_elements([ISS], None, None, NOW).elements is ISS
    assert select_elements([ISS], None, "my own name", NOW).elements is ISS


@pytest.mark.parametrize("name", ["SENTINEL-3A", "sentinel 3a", "Sentinel3A"])
def test_a_list_is_searched_by_number_else_by_name(name: str) -> None:
    assert select_elements([ISS, OTHER], None, name, NOW).elements is OTHER
    assert select_elements([ISS, OTHER], 25544, name, NOW).elements is ISS


@pytest.mark.parametrize(
    ("norad_id", "name", "message"),
    [
        (7, None, r"iss.tle: no element set with norad_id 7; the file holds ISS \(ZARYA\) \(25544\), SENTINEL-3A"),
        (None, "SCD-1", r"iss.tle: no element set with name 'SCD-1'; the file holds"),
        (None, None, r"iss.tle: the file holds .*; say which by norad_id"),
    ],
)
def test_a_satellite_that_is_not_in_the_list_is_an_error_that_says_what_is(
    norad_id: int | None, name: str | None, message: str
) -> None:
    with pytest.raises(ElementsError, match=message):
        select_elements([ISS, OTHER], norad_id, name, NOW)


LIST = [
    replace(ISS, name=name, norad_id=number)
    for name, number in [*((f"STARLINK-{k}", 44000 + k) for k in range(2000, 4000, 7)), ("NOAA 19 [+]", 33591), ("", 5)]
]


@pytest.mark.parametrize(
    ("norad_id", "name", "meant"),
    [
        (33951, "NOAA 19", "NOAA 19 [+] (33591)"),
        (1, "noaa-19 [+]", "NOAA 19 [+] (33591)"),
        (None, "NOAA 18 [+]", "NOAA 19 [+] (33591)"),
        (33591 + 10000, "my own", "NOAA 19 [+] (33591)"),
    ],
)
def test_a_satellite_that_is_not_in_a_long_list_is_told_with_what_may_be_meant(
    norad_id: int | None, name: str, meant: str
) -> None:
    with pytest.raises(ElementsError) as error:
        select_elements(LIST, norad_id, name, NOW)
    assert f"did you mean {meant}" in str(error.value)
    assert str(error.value).endswith(
        "the file holds 288 satellites, such as STARLINK-2000 (46000), STARLINK-2007 (46007)"
    )


@pytest.mark.parametrize("name", ["NOAA 19", "noaa-19", "NOAA 19 [+]", "NOAA 19 [-]"])
def test_the_status_that_a_list_puts_after_a_name_does_not_count(name: str) -> None:
    assert select_elements(LIST, None, name, NOW).elements.norad_id == 33591


def test_nothing_is_suggested_where_nothing_is_near() -> None:
    with pytest.raises(ElementsError, match=r"^iss.tle: no element set with norad_id 99; the file holds 288"):
        select_elements(LIST, 99, "my own", NOW)


def test_a_name_that_two_satellites_bear_is_an_error() -> None:
    with pytest.raises(ElementsError, match=r"'DEB' fits the satellites \[1, 2\]; say which by norad_id"):
        select_elements([replace(ISS, name="DEB", norad_id=number) for number in (1, 2)], None, "DEB", NOW)


def test_an_empty_list_is_an_error() -> None:
    with pytest.raises(ElementsError, match="no usable element set"):
        select_elements([], 1, None, NOW)


@pytest.mark.parametrize("days", [0.0, 0.5, 3.0, 10.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_elements_are_worth_as_little_before_their_epoch_as_after_it(days: float, side: float) -> None:
    """A fresh set is off by a kilometre, and half of one more each day; Brouwer means by their drag besides."""
    fresh_m = 1e3 + 500.0 * days
    without_drag = expected_error(replace(ISS, bstar_per_radius=0.0), aged(side * days))
    assert without_drag == ExpectedError(pytest.approx(fresh_m), ISS.semi_major_axis_m)  # type: ignore[arg-type]
    for height_km, drag_m_d2 in ((420.0, 22e3), (505.0, 22e3 / np.e), (335.0, 22e3 * np.e)):
        a_m = 6378137.0 + 1e3 * height_km
        means = BrouwerElements("A", NOW, a_m, 0.001, 1.0, 0.0, 0.0, 0.0)
        assert expected_error(means, aged(side * days)).along_m == pytest.approx(
            fresh_m + drag_m_d2 * days**2, rel=1e-4
        )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_expected_error_of_a_set_with_drag_is_half_of_what_the_drag_moves_it(side: float) -> None:
    at = np.array([aged(side * 5.0)])
    halved = replace(ISS, bstar_per_radius=0.5 * ISS.bstar_per_radius)
    (one,), (other,) = (Sgp4Propagator(elements).states_teme(at)[0] for elements in (ISS, halved))
    moved_m = float(np.linalg.norm(one - other))
    assert moved_m > 5e3
    assert expected_error(ISS, float(at[0])).along_m == pytest.approx(moved_m + 3.5e3, rel=0.1)


def test_an_expected_error_is_told_in_seconds_and_in_degrees_overhead() -> None:
    """Along a circle at 7.612 km/s, 500 km high."""
    assert str(ExpectedError(7612.0, 6878137.0)) == "expected error about 1 s along the track, 0.87 deg overhead"
    assert str(ExpectedError(76120.0, 6878137.0)) == "expected error about 10 s along the track, 8.7 deg overhead"
    assert "anywhere" in str(ExpectedError(np.inf, 6878137.0))
