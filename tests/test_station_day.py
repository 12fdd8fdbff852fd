"""What a station does next, without a flight: when a pass is due, what keeps it, where it waits, what is told."""

import asyncio
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from config_files import STATION, write
from structlog.testing import capture_logs
from test_metrics import seen_of

from acu_daemon.cli import station_day
from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.cli.check_hooks import HOOKS
from acu_daemon.cli.options import longest_lead
from acu_daemon.cli.pass_checks import AGAIN_S
from acu_daemon.cli.station_day import SPARE_S, STOW_SEEN_S, StationDay
from acu_daemon.config.load import load_station
from acu_daemon.control.tick_input import StowBy, StowWish
from acu_daemon.control.tracking.approach import longest_lead_s
from acu_daemon.daemon.snapshot import StationFacts
from acu_daemon.daemon.tally import Tally
from acu_daemon.edge.hooks import Hook
from acu_daemon.edge.schedule_file import NO_PAUSE, ScheduleFile, Words
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.decisions import RESUMED
from acu_daemon.schedule.wind import Wind, WindSample, WindWatch

NOW = 8.5e8
STEP_S = 0.01
ENTRY = Entry(
    "scd", NOW + 1000.0, NOW + 1300.0, NOW + 1600.0, 40.126, 5, PassState.PLANNED, "", 600.0, NOW + 990.0, NOW + 1610.0
)
OTHER = replace(ENTRY, satellite="other", number=2)
PRE_S, PREPOSITION_S, HORN_S = 80.0, 120.0, 7.0
TABLES = f"""
[schedule]
pre_s = {PRE_S}
next_within_s = 1800
park_az_deg = 20.0
park_el_deg = 60.0
[tracking]
preposition_s = {PREPOSITION_S}
[hooks]
before_move_s = {HORN_S}
"""
LEAD_S = PREPOSITION_S + SPARE_S + HORN_S
STRONG = WindWatch(wind=Wind.STRONG, wants_stow=True, newest=WindSample(NOW, 20.0, 25.0))


class Desk:
    """A day with a clock that stands; what hooks are told is remembered."""

    def __init__(self, folder: Path, station: str = STATION + TABLES, **more: Any) -> None:
        self.now_tai_s = NOW
        self.no_gos: list[str] = []
        self.checked: list[str] = []
        self.told: list[tuple[Hook, dict[str, Any]]] = []
        self.config, state = write(folder / "config", station), folder / "state"
        state.mkdir()
        self.file = ScheduleFile(state)
        self.tally = Tally()
        given = {"beside": self._beside, "check": self._check, "has_phantom": False, "tally": self.tally} | more
        self.day = StationDay(self.config, self, self.file, load_station(self.config), **given)
        self.day.hooks.call = lambda hook, about: self.told.append((hook, dict(about)))  # type: ignore[method-assign]
        self.keeper = self.day.keeper
        self.keeper.anew_reason, self.keeper._planned_tai_s = "", 1e300  # nothing is planned
        self.keeper.book = (replace(ENTRY, number=1),)

    def tai_s(self) -> float:
        return self.now_tai_s

    def monotonic_s(self) -> float:
        return self.now_tai_s - NOW

    @staticmethod
    async def _beside(work: Callable[..., Any], *given: Any) -> Any:
        return work(*given)

    def _check(self, satellite: str, _tai_s: float) -> list[str]:
        self.checked.append(satellite)
        return self.no_gos

    @property
    def entry(self) -> Entry:
        return self.keeper.book[0]

    async def look(self, now_tai_s: float) -> str:
        """Look until what goes on beside the loop is taken."""
        self.now_tai_s = now_tai_s
        found = ""
        for _ in range(3):
            found = self.day.look()
            await asyncio.sleep(0.0)
            await asyncio.sleep(0.0)
        return found

    def due(self, now_tai_s: float) -> str:
        """Whether it is due, with all checks passed."""
        self.now_tai_s = now_tai_s
        self.day.checks._entry, self.day.checks._before_s = self.entry, -1e9
        return self.day._due(now_tai_s)


@pytest.fixture
def made(tmp_path: Path) -> Iterator[Callable[..., Desk]]:
    desks: list[Desk] = []

    def make(*given: Any, **more: Any) -> Desk:
        desks.append(Desk(tmp_path / f"day{len(desks)}", *given, **more))
        return desks[-1]

    yield make
    for one in desks:
        one.file.close()


@pytest.fixture
def desk(made: Callable[..., Desk]) -> Desk:
    return made()


# People


@pytest.mark.parametrize(
    ("stow_by", "seen", "is_let_go"),
    [
        (StowBy.WIND, STRONG, False),
        (StowBy.WIND, replace(STRONG, wind=Wind.STALE), True),
        (StowBy.OPERATOR, STRONG, True),
    ],
)
def test_a_stow_in_strong_wind_is_not_ended_and_any_other_one_lets_the_wind_go(
    desk: Desk, stow_by: StowBy, seen: WindWatch, is_let_go: bool
) -> None:
    desk.day.stow_by, desk.day.wind.seen = stow_by, seen
    assert (desk.day.why_not_unstow() == "") == is_let_go
    assert desk.day.wind.seen.is_let_go == is_let_go
    assert desk.day.wind.seen.wants_stow == (not is_let_go)


def test_a_reload_is_for_now_or_for_after_the_pass(desk: Desk) -> None:
    assert (desk.day.ask_reload(), desk.keeper.anew_reason) == ("ok reload: now", "a person asked")
    desk.keeper.anew_reason, desk.day.course.entry = "", ENTRY
    assert (desk.day.ask_reload(), desk.keeper.anew_reason) == ("ok reload: after this pass", "a person asked")


# Rest


@pytest.mark.parametrize("reason", ["", "a person asked"])
async def test_a_file_that_has_changed_is_a_reason_to_plan_where_there_is_none_yet(desk: Desk, reason: str) -> None:
    heard: list[str] = []
    desk.keeper.look = lambda _now: heard.append(desk.keeper.anew_reason)  # type: ignore[method-assign]
    desk.keeper.anew_reason = reason
    await desk.look(NOW)
    os.utime(desk.config / "station.toml", (1.0, 1.0))
    await desk.look(NOW + 100.0)
    assert set(heard[:3]) == {reason}
    assert heard[3] == (reason or "changed: station.toml")


async def test_what_was_read_again_holds_for_wind_and_hooks(desk: Desk, tmp_path: Path) -> None:
    before = desk.day.hooks._commands
    await desk.look(NOW)
    assert desk.day.hooks._commands is before
    text = STATION + TABLES + 'at_lock = ["true"]\ntime_limit_s = 44\n[wind]\nfile = "wind.json"\ngust_limit_m_s = 33\n'
    desk.keeper.station = load_station(write(tmp_path / "other", text))
    await desk.look(NOW + 1.0)
    assert desk.day.wind.section.gust_limit_m_s == 33.0
    assert (desk.day.hooks._commands[Hook.AT_LOCK], desk.day.hooks._time_limit_s) == (("true",), 44.0)


async def test_hooks_as_a_user_who_is_not_there_are_told_of_once_and_those_before_stay(
    desk: Desk, tmp_path: Path
) -> None:
    text = STATION + TABLES + 'at_lock = ["true"]\nuser = "nobody-of-this-name"\n'
    desk.keeper.station = load_station(write(tmp_path / "other", text))
    with capture_logs() as logs:
        await desk.look(NOW)
        await desk.look(NOW + 1.0)
    [told] = [one for one in logs if one["event"] == "hooks.kept"]
    assert "nobody-of-this-name" in told["reason"]
    assert Hook.AT_LOCK not in desk.day.hooks._commands


def test_elements_are_looked_after_at_each_look(desk: Desk) -> None:
    looked: list[int] = []
    desk.day.fetching.look = lambda: looked.append(1)  # type: ignore[method-assign]
    desk.keeper.look = lambda _now: None  # type: ignore[method-assign]
    desk.day.look()
    assert looked == [1]


# When a pass is due


@pytest.mark.parametrize(("side", "is_due"), [(-1, False), (0, True), (1, True)])
async def test_a_pass_is_due_a_lead_before_its_reservation(desk: Desk, side: int, is_due: bool) -> None:
    desk.keeper.book = (replace(ENTRY, number=1, start_tai_s=NOW + 1030.0, rise_tai_s=NOW + 1000.0),)
    expected = f"{desk.entry.name} begins" if is_due else ""
    assert await desk.look(NOW + 1030.0 - LEAD_S + side * STEP_S) == expected
    assert desk.checked == ["scd"]


@pytest.mark.parametrize("changes", [{"state": PassState.REFUSED}, {"start_tai_s": None}, {"end_tai_s": None}])
def test_what_is_not_granted_is_never_due(desk: Desk, changes: dict[str, Any]) -> None:
    desk.keeper.book = (replace(ENTRY, **changes),)
    assert desk.due(NOW + 995.0) == ""


@pytest.mark.parametrize(
    ("tables", "lead_s"),
    [
        (TABLES, LEAD_S),
        (TABLES.replace(f"pre_s = {PRE_S}", "pre_s = 150.0"), 150.0 + SPARE_S + HORN_S),
        (TABLES.replace("before_move_s = 7.0", "before_move_s = 0.0"), PREPOSITION_S + SPARE_S),
    ],
)
def test_the_lead_is_that_of_the_way_or_of_the_hooks_with_the_horn_and_a_spare(
    made: Callable[..., Desk], tables: str, lead_s: float
) -> None:
    assert made(STATION + tables).day._lead_s(ENTRY) == lead_s


def test_of_a_satellite_that_was_used_before_the_lead_is_that_of_its_own_station(desk: Desk, tmp_path: Path) -> None:
    slow = STATION.replace("max_rate_deg_s = 5.0", "max_rate_deg_s = 0.25") + TABLES
    target: Any = SimpleNamespace(station=load_station(write(tmp_path / "slow", slow)))
    desk.day._good["scd"] = target
    assert longest_lead(target) > 300.0
    assert desk.day._lead_s(ENTRY) == longest_lead(target) + SPARE_S + HORN_S
    assert desk.day._lead_s(OTHER) == LEAD_S


@pytest.mark.parametrize("is_resumed", [False, True])
@pytest.mark.parametrize("no_go", ["", "the door is open"])
async def test_a_pass_that_is_gone_on_with_is_checked_only_after_a_no_go(
    desk: Desk, no_go: str, is_resumed: bool
) -> None:
    desk.keeper.book = (replace(ENTRY, number=1, reason=RESUMED if is_resumed else ""),)
    desk.day.checks._entry, desk.day.checks.no_go = desk.entry, no_go
    await desk.look(NOW + 900.0)
    assert bool(desk.checked) == (bool(no_go) or not is_resumed)


class Flown:
    """A phantom check that says what it is told to."""

    words = "flown: all well"

    def __init__(self, no_go: str = "") -> None:
        self.seen: list[tuple[Entry, float, Any]] = []
        self.said, self.is_closed = no_go, False

    def look(self, entry: Entry, now_tai_s: float, place: Any) -> None:
        self.seen.append((entry, now_tai_s, place))

    def no_go(self, _entry: Entry) -> str:
        return self.said

    def of(self, _entry: Entry) -> str:
        return "what was flown"

    def close(self) -> None:
        self.is_closed = True


@pytest.mark.parametrize(
    ("seen", "place"),
    [
        (seen_of(az_deg=12.0, el_deg=34.0), (12.0, 34.0)),
        (seen_of(az_deg=None), None),
        (seen_of(el_deg=None), None),
    ],
)
def test_it_is_flown_before_from_where_the_antenna_stands(desk: Desk, seen: Any, place: Any) -> None:
    desk.day.phantom = flown = Flown()  # type: ignore[assignment]
    desk.due(NOW + 10.0)
    assert flown.seen == [(desk.entry, NOW + 10.0, None)]
    desk.day.see(seen)
    desk.due(NOW + 11.0)
    assert flown.seen[1] == (desk.entry, NOW + 11.0, place)
    desk.day.see(seen_of(az_deg=None))
    desk.due(NOW + 12.0)
    assert flown.seen[2][2] == place  # what was known stays
    desk.keeper.book = (replace(ENTRY, reason=RESUMED),)
    desk.due(NOW + 13.0)
    assert len(flown.seen) == 3


@pytest.mark.parametrize("has_phantom", [True, False])
def test_a_day_flies_before_its_passes_where_it_is_to(made: Callable[..., Desk], has_phantom: bool) -> None:
    assert (made(has_phantom=has_phantom).day.phantom is not None) == has_phantom


# What keeps a pass


@pytest.mark.parametrize("stow_by", list(StowBy))
def test_a_stow_of_the_schedule_keeps_no_pass_and_any_other_one_does(desk: Desk, stow_by: StowBy) -> None:
    desk.day.stow_by = stow_by
    is_free = stow_by in (StowBy.NOBODY, StowBy.SCHEDULE)
    assert desk.due(NOW + 990.0) == (f"{desk.entry.name} begins" if is_free else "")
    said = PassState.PLANNED if is_free else PassState.FAILED
    desk.day.checks.forget()
    desk.due(NOW + 1301.0)
    assert (desk.entry.state, desk.entry.reason) == (said, "" if is_free else f"not begun: stowed by the {stow_by}")


def test_first_the_wind_keeps_it_then_the_stow_then_the_checks_then_what_was_flown(desk: Desk) -> None:
    day = desk.day
    day.phantom = Flown("the sun is in the way")  # type: ignore[assignment]
    assert day._why_not_now(ENTRY) == "the sun is in the way"
    day.checks.no_go = "the door is open"
    assert day._why_not_now(ENTRY) == "the door is open"
    day.stow_by = StowBy.PANEL
    assert day._why_not_now(ENTRY) == "stowed by the panel"
    day.wind.seen = STRONG
    assert day._why_not_now(ENTRY) == STRONG.words


def test_without_anything_against_it_nothing_keeps_it(desk: Desk) -> None:
    assert desk.day._why_not_now(ENTRY) == ""
    desk.day.phantom = Flown()  # type: ignore[assignment]
    assert desk.day._why_not_now(ENTRY) == ""


@pytest.mark.parametrize(("at_s", "is_over"), [(1000.0, False), (1300.0, False), (1300.0 + STEP_S, True)])
def test_what_is_kept_is_tried_again_after_15_s_and_has_failed_when_half_of_it_is_gone(
    desk: Desk, at_s: float, is_over: bool
) -> None:
    desk.day.wind.seen = STRONG
    assert desk.due(NOW + at_s) == ""
    desk.day.wind.seen = WindWatch()
    about = desk.day.about(ENTRY) | {"number": 1, "state": "failed", "reason": STRONG.words}
    if is_over:
        assert (desk.entry.state, desk.entry.reason) == (PassState.FAILED, f"not begun: {STRONG.words}")
        assert desk.told == [(Hook.AFTER_PASS, about)]
        return
    assert (desk.entry.state, desk.told) == (PassState.PLANNED, [])
    assert desk.due(NOW + at_s + AGAIN_S - STEP_S) == ""
    assert desk.due(NOW + at_s + AGAIN_S) == f"{desk.entry.name} begins"


@pytest.mark.parametrize(
    ("after_s", "is_on_its_way"),
    [(-STEP_S, False), (0.0, True), (STOW_SEEN_S - STEP_S, True), (STOW_SEEN_S, False), (60.0, False)],
)
def test_for_three_seconds_after_it_is_sent_to_the_stow_no_pass_begins_and_none_is_refused(
    desk: Desk, after_s: float, is_on_its_way: bool
) -> None:
    desk.now_tai_s = NOW + 1400.0
    assert not desk.day.is_going_to_stow
    desk.day.stow_is_asked()
    desk.now_tai_s += after_s
    assert desk.day.is_going_to_stow == is_on_its_way
    assert desk.due(desk.now_tai_s) == ("" if is_on_its_way else f"{desk.entry.name} begins")
    assert desk.entry.state is PassState.PLANNED
    assert desk.day.checks.may_begin(desk.now_tai_s)


@pytest.mark.parametrize("mode", ["STOWING", "STOWED", "STANDBY"])
@pytest.mark.parametrize("stow_by", list(StowBy))
def test_it_is_on_its_way_to_the_schedules_stow_while_the_acu_says_so(desk: Desk, stow_by: StowBy, mode: str) -> None:
    desk.day.see(seen_of(stow_by=str(stow_by), acu_mode=mode))
    assert desk.day.stow_by is stow_by
    assert desk.day.is_going_to_stow == (mode == "STOWING" and stow_by is StowBy.SCHEDULE)


def test_no_gos_are_the_findings_that_are_but_for_those_of_hooks_and_all_are_counted(
    made: Callable[..., Desk], monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = made(check=None, acu="tcp://127.0.0.1:9")
    found = [
        Finding(GO, "clock", "well"),
        Finding(NO_GO, "ACU", "silent"),
        Finding(WARN, "disk", "full"),
        Finding(NO_GO, HOOKS, "no such program"),
        Finding(NO_GO, "door", "open"),
    ]
    asked: list[tuple[Any, ...]] = []
    monkeypatch.setattr(station_day, "findings", lambda *given: asked.append(given) or iter(found))
    assert desk.day._no_gos("scd", NOW + 3.0) == ["ACU: silent", "door: open"]
    assert desk.day.checks._check == desk.day._no_gos
    assert asked == [(desk.config, "scd", NOW + 3.0, desk.file.path.parent, "tcp://127.0.0.1:9")]
    assert desk.tally.checks == {"clock": True, "ACU": False, "disk": True, HOOKS: False, "door": False}


async def test_a_no_go_is_told_to_its_hook_with_the_pass(desk: Desk) -> None:
    desk.no_gos = ["ACU: silent", "door: open"]
    assert await desk.look(NOW + 940.0) == ""
    assert desk.told == [(Hook.ON_NO_GO, desk.day.about(desk.entry) | {"reason": "ACU: silent; door: open"})]


# A pass


class Files:
    """Stands for what is read of the files: remembers what was asked, and says what it is told to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.loaded: list[tuple[Any, dict[str, Any]]] = []
        self.coming: list[tuple[Any, float]] = []
        self.kept: list[tuple[Any, Any]] = []
        self.problem = ""
        monkeypatch.setattr(station_day, "load_target", self._load)
        monkeypatch.setattr(station_day, "coming_pass", lambda *given: self.coming.append(given) or "the pass")
        monkeypatch.setattr(station_day, "keep_confirmed", lambda *given: self.kept.append(given))

    def _load(self, *given: Any, **more: Any) -> str:
        self.loaded.append((given, more))
        if self.problem:
            raise UsageError(self.problem)
        return f"target {len(self.loaded)}"


@pytest.mark.parametrize(
    ("at_s", "from_s", "elements_s"), [(900.0, 940.0, 1000.0), (940.5, 940.5, 1000.0), (1100.0, 1100.0, 1100.0)]
)
def test_a_pass_begins_with_the_elements_of_its_rise_and_is_looked_for_from_a_minute_before_it(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, at_s: float, from_s: float, elements_s: float
) -> None:
    files = Files(monkeypatch)
    desk.now_tai_s = NOW + at_s
    assert desk.day.begin(ENTRY) == ("target 1", "the pass")
    more = {"at_tai_s": NOW + elements_s, "folders": (desk.file.path.parent,)}
    assert files.loaded == [((desk.config, "scd", NOW + at_s), more)]
    assert files.coming == [("target 1", NOW + from_s)]
    assert files.kept == [(desk.config, "target 1")]
    assert desk.day._good == {"scd": "target 1"}


def test_files_that_are_refused_leave_what_could_be_used_last_of_that_satellite(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = Files(monkeypatch)
    desk.day.begin(ENTRY)
    files.problem = "scd.toml: no such key"
    with capture_logs() as logs:
        assert desk.day.begin(ENTRY) == ("target 1", "the pass")
    assert [(one["event"], one["satellite"], one["reason"]) for one in logs] == [
        ("config.kept", "scd", "scd.toml: no such key")
    ]
    with pytest.raises(UsageError, match="no such key"):
        desk.day.begin(OTHER)


def test_where_its_files_are_refused_it_is_a_no_go_and_tried_again(desk: Desk) -> None:
    desk.now_tai_s = NOW + 1000.0
    desk.day.cannot_begin(desk.entry, "no such key")
    assert desk.told == [(Hook.ON_NO_GO, desk.day.about(desk.entry) | {"reason": "no such key"})]
    assert (desk.day.checks.no_go, desk.entry.state) == ("no such key", PassState.PLANNED)
    assert not desk.day.checks.may_begin(NOW + 1000.0 + AGAIN_S - STEP_S)
    desk.now_tai_s = NOW + 1301.0
    desk.day.cannot_begin(desk.entry, "no such key")
    assert (desk.entry.state, desk.entry.reason) == (PassState.FAILED, "not begun: no such key")


@pytest.mark.parametrize("is_flown", [True, False])
def test_a_pass_that_has_begun_is_put_off_no_more_and_has_what_was_flown(desk: Desk, is_flown: bool) -> None:
    desk.day.phantom = Flown() if is_flown else None  # type: ignore[assignment]
    desk.day.checks.refuse(desk.entry, NOW)
    desk.day.begun(desk.entry)
    assert desk.day.checks.may_begin(NOW)
    assert desk.day.course._tracked.phantom == ("what was flown" if is_flown else None)
    assert desk.day.course.entry == desk.entry
    assert desk.entry.state is PassState.PREPASS


def test_a_snapshot_is_seen_by_the_course_too(desk: Desk) -> None:
    desk.day.begun(desk.entry)
    desk.day.see(seen_of(rise_in_s=0.0))
    assert desk.entry.state is PassState.PASS


# Interrupted


INTERRUPTER = replace(ENTRY, satellite="other", number=2, priority=6, start_tai_s=NOW + 1200.0)
TILT = """
[acu.tilt]
min_deg = -8.0
max_deg = 8.0
max_rate_deg_s = 0.05
max_acceleration_deg_s2 = 0.5
"""


def interrupted(desk: Desk) -> float:
    """Put a pass on, and one that interrupts it; the way to that."""
    desk.day.begun(desk.entry)
    desk.keeper.book = (desk.entry, INTERRUPTER)
    desk.keeper._interrupters = frozenset({"other"})
    desk.keeper.look_in_pass = lambda _now: None  # type: ignore[method-assign]
    acu = desk.day.station.acu
    tilt = None if acu.tilt is None else acu.tilt.limits()
    return longest_lead_s(acu.azimuth.limits(), acu.elevation.limits(), 0.0, tilt)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("tilt", ["", TILT])
def test_a_pass_is_given_up_the_longest_way_before_the_other_and_says_so(
    made: Callable[..., Desk], tilt: str, side: int
) -> None:
    desk = made(STATION + tilt + TABLES)
    way_s = interrupted(desk)
    assert (way_s > 300.0) == bool(tilt)
    found = desk.day.interrupter(NOW + 1200.0 - way_s + side * STEP_S)
    assert found == (INTERRUPTER if side > 0 else None)
    assert desk.day.course._tracked.words == [f"given up for {INTERRUPTER.name}"] * (side > 0)


@pytest.mark.parametrize("stow_by", list(StowBy)[1:])
def test_under_a_stow_or_in_strong_wind_nothing_is_given_up(desk: Desk, stow_by: StowBy) -> None:
    interrupted(desk)
    desk.day.stow_by = stow_by
    assert desk.day.interrupter(NOW + 1200.0) is None
    desk.day.stow_by, desk.day.wind.seen = StowBy.NOBODY, STRONG
    assert desk.day.interrupter(NOW + 1200.0) is None
    assert desk.day.course._tracked.words == []
    desk.day.wind.seen = WindWatch()
    assert desk.day.interrupter(NOW + 1200.0) == INTERRUPTER


def test_without_a_pass_there_is_nothing_to_give_up_and_words_are_not_asked_for(desk: Desk) -> None:
    asked: list[float] = []
    desk.keeper.look_in_pass = asked.append  # type: ignore[method-assign,assignment]
    assert desk.day.interrupter(NOW + 1200.0) is None
    assert asked == []
    desk.day.begun(desk.entry)
    desk.day.interrupter(NOW + 1200.0)
    assert asked == [NOW + 1200.0]


# What is told


@pytest.mark.parametrize(("until_s", "is_paused"), [(-1.0, False), (0.0, False), (STEP_S, True), (NO_PAUSE, False)])
def test_a_pause_is_shown_until_it_is_over(desk: Desk, until_s: float, is_paused: bool) -> None:
    desk.keeper.words = Words((), NOW + until_s)
    until = utc_text(NOW + until_s, 0) if is_paused else ""
    assert desk.day.facts() == StationFacts(WindWatch().words, "", until)
    desk.day.phantom, desk.day.wind.seen = Flown(), STRONG  # type: ignore[assignment]
    assert desk.day.facts() == StationFacts(STRONG.words, "flown: all well", until)


@pytest.mark.parametrize("is_rehearsal", [False, True])
def test_a_hook_is_told_all_of_a_pass(made: Callable[..., Desk], is_rehearsal: bool) -> None:
    desk = made(STATION.replace("[station]", '[station]\nname = "Cuiaba"'), is_rehearsal=is_rehearsal)
    assert desk.day.about(replace(ENTRY, number=3)) == {
        "station": "Cuiaba",
        "number": 3,
        "satellite": "scd",
        "rise_utc": utc_text(NOW + 1000.0),
        "set_utc": utc_text(NOW + 1600.0),
        "culmination_el_deg": 40.13,
        "priority": 5,
        "is_rehearsal": is_rehearsal,
    }


# Between passes


def with_after(made: Callable[..., Desk], after: str) -> Desk:
    desk = made(STATION + TABLES.replace("[schedule]", f'[schedule]\nafter = "{after}"'))
    desk.day._next_rise.at = lambda entry, now: (entry.number, now - NOW)  # type: ignore[method-assign,assignment]
    return desk


PARK, STOW = (20.0, 60.0), StowWish(StowBy.SCHEDULE)


@pytest.mark.parametrize(
    ("after", "far", "near"),
    [("park", PARK, None), ("stow", STOW, None), ("stay", None, None), ("next", (1, 0), (1, 0))],
)
def test_it_waits_as_the_schedule_says_unless_the_next_pass_is_near(
    made: Callable[..., Desk], after: str, far: Any, near: Any
) -> None:
    desk = with_after(made, after)
    for start_s, expected in ((1800.0 - STEP_S, near), (1800.0, near), (1800.0 + STEP_S, far)):
        desk.keeper.book = (replace(ENTRY, number=1, start_tai_s=NOW + start_s, end_tai_s=NOW + 9000.0),)
        assert desk.day.after() == expected
    desk.keeper.book = (replace(ENTRY, number=1, start_tai_s=None),)
    assert desk.day.after() == far
    desk.keeper.book = ()
    assert desk.day.after() == (None if after == "next" else far)


@pytest.mark.parametrize("after", ["park", "stow", "next"])
def test_under_a_stow_or_in_strong_wind_it_stays_where_it_is(made: Callable[..., Desk], after: str) -> None:
    desk = with_after(made, after)
    desk.keeper.book = (replace(ENTRY, number=1, start_tai_s=NOW + 5000.0, end_tai_s=NOW + 9000.0),)
    assert desk.day.after() is not None
    for stow_by in list(StowBy)[1:]:
        desk.day.stow_by = stow_by
        assert desk.day.after() is None
    desk.day.stow_by, desk.day.wind.seen = StowBy.NOBODY, STRONG
    assert desk.day.after() is None


@pytest.mark.parametrize("has_phantom", [True, False])
async def test_all_that_goes_on_beside_the_loop_ends_with_the_day(desk: Desk, has_phantom: bool) -> None:
    ended: list[str] = []

    async def end(name: str) -> None:
        ended.append(name)

    day: Any = desk.day
    for name in ("wind", "checks", "_next_rise", "keeper"):
        getattr(day, name).close = lambda name=name: ended.append(name)
    day.hooks.end_during = lambda: ended.append("during")
    day.hooks.close, day.fetching.close = (lambda: end("hooks")), (lambda: end("fetching"))
    day.phantom = flown = Flown() if has_phantom else None
    await day.close()
    assert ended == ["during", "hooks", "fetching", "wind", "checks", "_next_rise", "keeper"]
    assert flown is None or flown.is_closed
