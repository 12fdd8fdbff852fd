"""daemon.words: the phrases of live line, status and service line, at each limit and with each thing unknown."""

from dataclasses import replace
from typing import Any

import pytest
from test_live_line import SEEN

from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.words import antenna, buffer, clock_text, coming, correction, marks, nudge, pointing, rise, trust
from acu_daemon.model import Model

DAY_S = 86400.0
STEP = 0.01


def seen(**changes: Any) -> Snapshot:
    return replace(SEEN, **changes)


@pytest.mark.parametrize(
    ("is_simulation", "is_rehearsal", "text"),
    [(False, False, ""), (True, False, "SIMULATION"), (False, True, "REHEARSAL"), (True, True, "SIMULATION REHEARSAL")],
)
def test_a_simulation_and_a_rehearsal_are_marked(is_simulation: bool, is_rehearsal: bool, text: str) -> None:
    assert marks(seen(is_simulation=is_simulation, is_rehearsal=is_rehearsal)) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        *((-5.0, "0:00"), (0.0, "0:00"), (0.4, "0:00"), (0.6, "0:01"), (59.4, "0:59"), (59.6, "1:00"), (65.0, "1:05")),
        *((3599.4, "59:59"), (3599.6, "1:00:00"), (3661.0, "1:01:01"), (90000.0, "25:00:00")),
    ],
)
def test_a_time_is_in_minutes_and_seconds_with_hours_where_there_are_any(seconds: float, text: str) -> None:
    assert clock_text(seconds) == text


@pytest.mark.parametrize(
    ("rise_in_s", "set_in_s", "when"),
    [
        (61.0, 600.0, " rises in 1:01"),
        (STEP, 600.0, " rises in 0:00"),
        (0.0, 600.0, " sets in 10:00"),
        (61.0, 2.0 * DAY_S, " rises in 1:01"),
        (-1.0, DAY_S, " sets in 24:00:00"),
        (-1.0, DAY_S + STEP, " up for more than a day"),
        (-1.0, STEP, " sets in 0:00"),
        (-1.0, 0.0, " has set"),
        (-1.0, -9.0, " has set"),
        (None, 600.0, ""),
        (61.0, None, ""),
    ],
)
@pytest.mark.parametrize("name", ["NOAA-20", ""])
def test_a_satellite_comes_or_goes(rise_in_s: float | None, set_in_s: float | None, when: str, name: str) -> None:
    assert coming(seen(satellite=name, rise_in_s=rise_in_s, set_in_s=set_in_s)) == f"{name}{when}".strip()


@pytest.mark.parametrize(
    ("name", "short"),
    [("A" * 13, "A" * 13), ("B" * 14, "B" * 14), ("ABCDEFGHIJKLMNO", "ABCDEFGHIJKLM~"), ("C" * 40, "C" * 13 + "~")],
)
def test_a_long_name_is_cut_where_it_has_to_be_short(name: str, short: str) -> None:
    one = seen(satellite=name, rise_in_s=None)
    assert (coming(one), coming(one, is_short=True)) == (name, short)
    assert coming(replace(one, rise_in_s=-1.0, set_in_s=5.0), is_short=True) == f"{short} sets in 0:05"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "at 12:40:00Z up to 63 deg for 10 min"),
        ({"rise_in_s": STEP}, "at 12:40:00Z up to 63 deg for 20 min"),
        ({"rise_in_s": 0.0}, ""),
        ({"rise_in_s": -1.0}, ""),
        ({"set_in_s": 600.0 + DAY_S - 60.0}, "at 12:40:00Z up to 63 deg for 1439 min"),
        ({"set_in_s": 600.0 + DAY_S}, "at 12:40:00Z up to 63 deg for more than a day"),
        ({"culmination_deg": 4.6}, "at 12:40:00Z up to 5 deg for 10 min"),
        *(({name: None}, "") for name in ("rise_in_s", "set_in_s", "culmination_deg")),
    ],
)
def test_a_pass_that_is_waited_for_has_its_rise_its_height_and_its_length(changes: dict[str, Any], text: str) -> None:
    assert rise(seen(**({"rise_in_s": 600.0, "set_in_s": 1200.0} | changes))) == text


@pytest.mark.parametrize(
    ("changes", "text", "short"),
    [
        ({}, "ON path 0.02 deg", "ON path 0.02 deg"),
        ({"is_on_path": False, "off_path_deg": 12.345}, "OFF path 12.35 deg", "OFF path 12.35 deg"),
        ({"is_on_path": None}, "OFF path 0.02 deg", "OFF path 0.02 deg"),
        ({"path": "elements"}, "ON path of elements 0.02 deg", "ON path 0.02 deg"),
        ({"path": "elements, moved to the signal"}, "ON path of elements, moved 0.02 deg", "ON path 0.02 deg"),
        ({"off_path_deg": None}, "", ""),
        ({"off_path_deg": None, "state": "PREPOSITION"}, "", ""),
        ({"state": "PREPOSITION", "off_path_deg": 12.34, "path": "elements"}, "12.3 deg to go", "12.3 deg to go"),
    ],
)
def test_where_it_points_is_beside_the_path_or_on_its_way(changes: dict[str, Any], text: str, short: str) -> None:
    assert (pointing(seen(**changes)), pointing(seen(**changes), is_short=True)) == (text, short)


@pytest.mark.parametrize(
    ("inside_s", "text"),
    [
        (None, "prediction without a sigma"),
        (-1.0, "prediction not sure"),
        (0.0, "prediction not sure"),
        (STEP, "prediction good for 0 s"),
        (61.4, "prediction good for 61 s"),
        (89.8 - STEP, "prediction good for 90 s"),
        (90.0 - 0.2, "prediction good for >90 s"),
        (89.8 + STEP, "prediction good for >90 s"),
        (90.0, "prediction good for >90 s"),
    ],
)
def test_a_prediction_is_good_for_so_long_or_longer_than_its_buffer(inside_s: float | None, text: str) -> None:
    assert trust(seen(inside_s=inside_s, buffer_s=90.0)) == text
    assert trust(seen(inside_s=inside_s, buffer_s=90.0, buffer_kind="")) == ""


@pytest.mark.parametrize("changes", [{"is_link_up": False}, {"az_deg": None}, {"el_deg": None}])
def test_angles_are_shown_while_they_are_measured_in_as_many_columns_as_without(changes: dict[str, Any]) -> None:
    one = seen(az_deg=7.456, el_deg=5.0)
    assert antenna(one) == "az   7.46 el  5.00"
    assert antenna(one, digits=1) == "az   7.5 el  5.0"
    for digits in (1, 2):
        unknown = antenna(replace(one, **changes), digits=digits)
        assert unknown.split() == ["az", "-", "el", "-"]
        assert [unknown.index(word) for word in ("az", "el")] == [0, antenna(one, digits).index("el")]
        assert len(unknown) == len(antenna(one, digits))


@pytest.mark.parametrize(
    ("along_s", "across_deg", "text"),
    [
        (0.874, 0.0312, " 0.87 s late  +0.031 deg across"),
        (-0.874, -0.0312, " 0.87 s early -0.031 deg across"),
        (0.0, 12.0, " 0.00 s late  +12.000 deg across"),
        (None, 0.1, "no fit in force"),
        (0.1, None, "no fit in force"),
    ],
)
def test_a_fit_makes_the_satellite_late_or_early(along_s: float | None, across_deg: float | None, text: str) -> None:
    assert correction(seen(along_s=along_s, across_deg=across_deg)) == text


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "buffer  89 s FITTED"),
        ({"buffer_s": 5.4, "buffer_kind": "TLE", "model": str(Model.LAST_PASS)}, "buffer   5 s TLE (last pass)"),
        ({"model": str(Model.ELEMENTS), "buffer_kind": "TLE"}, "buffer  89 s TLE"),
        ({"buffer_s": 0.0, "buffer_kind": ""}, "buffer   0 s"),
    ],
)
def test_a_buffer_has_its_length_and_its_origin(changes: dict[str, Any], text: str) -> None:
    assert buffer(seen(**changes)) == text


@pytest.mark.parametrize(
    ("along_s", "across_deg", "text"),
    [
        (0.0, 0.0, ""),
        (1.5, 0.0, "1.50 s late, +0.000 deg across, by a person"),
        (-1.5, 0.25, "1.50 s early, +0.250 deg across, by a person"),
        (0.0, -0.25, "0.00 s late, -0.250 deg across, by a person"),
    ],
)
def test_a_nudge_is_a_persons(along_s: float, across_deg: float, text: str) -> None:
    assert nudge(seen(nudge_along_s=along_s, nudge_across_deg=across_deg)) == text
