"""Moves between passes and their ends; which list of leap seconds of the system is used, and what is said of it."""

import math
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from acu_daemon.cli.station_move import GONE_ON_S, IN_PLACE, IN_PLACE_DEG, Horn, move_job, why_move_ends
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.approach import BEGIN_S, way_s
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.verdict import STILL_DEG_S
from acu_daemon.edge.hooks import Hook
from acu_daemon.edge.leap_seconds_file import (
    MOST_EXPIRED_S,
    adopt_system_leap_seconds,
    find_leap_seconds,
    leap_seconds_told,
)
from acu_daemon.model import AxisLimits
from acu_daemon.orbit.timescales import LEAP_DATES, adopt_leap_dates, leap_dates, tai_from_unix
from acu_daemon.units import DAY_S

NOW = 8.0e8


class Heard:
    """A clock that stands, and hooks that only count."""

    def __init__(self) -> None:
        self.now_tai_s = NOW
        self.calls: list[tuple[Any, Any]] = []

    def tai_s(self) -> float:
        return self.now_tai_s

    def call(self, hook: Any, about: Any) -> None:
        self.calls.append((hook, about))


def horn_of(heard: Any) -> Horn:
    return Horn(heard, heard)


def test_without_a_horn_a_move_may_begin_at_once_and_nothing_is_called() -> None:
    heard = Heard()
    assert horn_of(heard).is_heard({"a": 1}, 30.0, is_wanted=False)
    assert heard.calls == []


@pytest.mark.parametrize(("for_s", "is_enough"), [(5.0, True), (5.001, False), (0.0, True)])
def test_the_horn_is_heard_as_long_as_it_is_said(for_s: float, is_enough: bool) -> None:
    heard = Heard()
    horn = horn_of(heard)
    assert horn.is_heard({"a": 1}, for_s, is_wanted=True) == (for_s == 0.0)
    heard.now_tai_s += 5.0
    assert horn.is_heard({"a": 2}, for_s, is_wanted=True) == is_enough
    assert heard.calls == [(Hook.BEFORE_MOVE, {"a": 1})]


@pytest.mark.parametrize(("after_s", "count"), [(9.9, 1), (10.0, 2), (0.0, 1), (-0.1, 2)])
def test_a_move_that_nobody_wanted_for_ten_seconds_is_warned_of_anew(after_s: float, count: int) -> None:
    heard = Heard()
    horn = horn_of(heard)
    horn.is_heard({}, 100.0, is_wanted=True)
    heard.now_tai_s += after_s
    horn.is_heard({}, 100.0, is_wanted=True)
    assert GONE_ON_S == 10.0
    assert len(heard.calls) == count


@dataclass(frozen=True)
class Control:
    azimuth: AxisLimits
    elevation: AxisLimits
    preposition_s: float = 60.0


@dataclass(frozen=True)
class Job:
    control: Control
    move: PassPlan | None = None
    satellite: str = "ISS"
    other: int = 7


@pytest.mark.parametrize("is_azimuth_slow", [True, False])
def test_a_move_leads_to_its_place_and_may_take_the_longest_way_and_a_minute(is_azimuth_slow: bool) -> None:
    slow, quick = AxisLimits(-200.0, 100.0, 0.5, 0.5), AxisLimits(5.0, 85.0, 50.0, 50.0)
    control = Control(slow, quick) if is_azimuth_slow else Control(quick, slow)
    given: Any = Job(control)
    job, until_tai_s = move_job(given, 123.0, 45.0, NOW)
    assert until_tai_s - NOW == pytest.approx(BEGIN_S + way_s(300.0, slow) + 60.0)
    made: Any = job
    assert (made.satellite, made.other, made.control.preposition_s) == ("", 7, math.inf)
    assert (made.control.azimuth, made.control.elevation) == (control.azimuth, control.elevation)
    plan = made.move
    assert (plan.start_az_deg, plan.start_el_deg) == (123.0, 45.0)
    assert plan == PassPlan(NOW + 3600.0, NOW + 7200.0, NOW + 3600.0, 123.0, 45.0)


@pytest.mark.parametrize(
    ("speed", "off", "state", "late_s", "why"),
    [
        (0.0, 0.0, TrackState.PREPOSITION, 0.0, IN_PLACE),
        (STILL_DEG_S - 1e-6, IN_PLACE_DEG - 1e-6, TrackState.PREPOSITION, 0.0, IN_PLACE),
        (STILL_DEG_S, 0.0, TrackState.PREPOSITION, 0.0, ""),
        (0.0, IN_PLACE_DEG, TrackState.PREPOSITION, 0.0, ""),
        (None, 0.0, TrackState.PREPOSITION, 0.0, ""),
        (0.0, None, TrackState.PREPOSITION, 0.0, ""),
        (0.0, None, TrackState.PREPOSITION, 0.1, "not in place"),
        (None, None, TrackState.STOW, -5.0, "stowed"),
        (5.0, 5.0, TrackState.STOW, 5.0, "stowed"),
        (0.0, 0.0, TrackState.STOW, 5.0, IN_PLACE),
        (5.0, 5.0, TrackState.PREPOSITION, 1.0, "not in place"),
    ],
)
def test_a_move_ends_in_place_stowed_or_too_late(
    speed: float | None, off: float | None, state: TrackState, late_s: float, why: str
) -> None:
    seen: Any = SimpleNamespace(speed_deg_s=speed, off_path_deg=off, state=state, tai_s=NOW + late_s)
    assert why_move_ends(seen, NOW) == why


# Leap seconds

NTP_S = 2208988800
EPOCH = date(1900, 1, 1)


def listed(path: Path, dates: tuple[date, ...] = LEAP_DATES, expires_unix_s: int | None = None) -> Path:
    lines = [] if expires_unix_s is None else [f"#@ {expires_unix_s + NTP_S}"]
    lines += [f"{(one - EPOCH).days * 86400} {10 + k} # {one}" for k, one in enumerate(dates)]
    path.write_text("\n".join(lines) + "\n")
    return path


NEWER = (*LEAP_DATES, date(2029, 7, 1))
LATE, EARLY = 2_000_000_000, 1_900_000_000


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize(
    ("best", "other"),
    [
        ((LEAP_DATES, LATE), (LEAP_DATES, EARLY)),
        ((LEAP_DATES, EARLY), (LEAP_DATES, None)),
        ((NEWER, None), (LEAP_DATES, LATE)),
        ((NEWER, EARLY), (LEAP_DATES, LATE)),
        ((NEWER, LATE), (NEWER, EARLY)),
    ],
)
def test_the_list_with_the_most_leap_seconds_is_used_and_of_those_the_one_that_holds_longest(
    best: Any, other: Any, order: tuple[int, int], tmp_path: Path
) -> None:
    paths = [listed(tmp_path / "best", *best), listed(tmp_path / "other", *other)]
    found, wrong = find_leap_seconds([paths[k] for k in order])
    assert found is not None
    assert (found.path.name, wrong) == ("best", [])


def test_a_list_tells_to_when_it_holds(tmp_path: Path) -> None:
    found, _ = find_leap_seconds([listed(tmp_path / "list", LEAP_DATES, LATE)])
    assert found is not None
    assert found.about() == f"{tmp_path}/list: to 2017-01-01, holds until 2033-05-18"
    found, _ = find_leap_seconds([listed(tmp_path / "list")])
    assert found is not None
    assert found.about() == f"{tmp_path}/list: to 2017-01-01, no expiry said"


def test_lists_that_are_not_there_are_no_matter_and_those_that_cannot_be_read_are(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert find_leap_seconds([tmp_path / "gone", tmp_path / "file" / "below"]) == (None, [])
    found, [wrong] = find_leap_seconds([tmp_path])
    assert (found, wrong) == (None, f"{tmp_path}: Is a directory")
    told, is_wrong = leap_seconds_told(NOW, [tmp_path])
    assert told.endswith(f"this system has no leap-seconds.list; {tmp_path}: Is a directory")
    assert is_wrong
    told, is_wrong = leap_seconds_told(NOW, [tmp_path, listed(tmp_path / "list", LEAP_DATES, LATE)])
    assert told == f"{tmp_path}/list: to 2017-01-01, holds until 2033-05-18; {tmp_path}: Is a directory"
    assert is_wrong
    assert leap_seconds_told(NOW, [tmp_path / "list"]) == (told.split("; ")[0], False)
    assert leap_seconds_told(NOW, [listed(tmp_path / "list")])[1] is False


@pytest.mark.parametrize(
    ("after_s", "is_told", "is_late"),
    [(-1.0, False, False), (0.0, True, False), (MOST_EXPIRED_S - 1.0, True, False), (MOST_EXPIRED_S, True, True)],
)
def test_a_list_is_late_a_year_after_its_expiry(after_s: float, is_told: bool, is_late: bool, tmp_path: Path) -> None:
    path = listed(tmp_path / "list", LEAP_DATES, LATE)
    assert MOST_EXPIRED_S == 366 * DAY_S
    told, to_be_seen_to = leap_seconds_told(tai_from_unix(LATE) + after_s, [path])
    assert ("expired on 2033-05-18" in told) == is_told
    assert to_be_seen_to == is_late


@pytest.fixture
def built_in_after() -> Any:
    yield
    adopt_leap_dates(LEAP_DATES)


@pytest.mark.usefixtures("built_in_after")
def test_a_list_with_no_more_leap_seconds_than_are_known_is_not_adopted(tmp_path: Path) -> None:
    adopt_system_leap_seconds([listed(tmp_path / "short", LEAP_DATES[:-1], LATE), tmp_path / "gone"])
    assert leap_dates() == LEAP_DATES
    adopt_system_leap_seconds([])
    assert leap_dates() == LEAP_DATES
    adopt_system_leap_seconds([listed(tmp_path / "new", NEWER)])
    assert leap_dates() == NEWER
