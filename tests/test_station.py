"""The station: passes of several satellites one after the other, by the schedule, in virtual time."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest
from config_files import BROUWER, STATION, replaced, write

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.virtual_station import Days, KilledError, StationAccess, run_days
from acu_daemon.edge.hooks import Hook
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.rules import PassRequest, Wish

# passes above 60 deg are short: two satellites on one orbit, the second right behind the first
HIGH = (
    replaced(STATION, "height_m = 277.0", "height_m = 277.0\nmin_elevation_deg = 60.0")
    + "[atmosphere]\nrefraction = false\n"
)
BEHIND = replaced(BROUWER, "SCD-1", "SCD-9").replace("mean_anomaly_deg = 350.56", "mean_anomaly_deg = 346.0")
START = tai_from_utc("1989-02-01T02:03:00Z")
STANDBY = AcuMode.STANDBY
FIRST = "[schedule]\npriority = 7\nmin_useful_s = 30\n"
SHORT = "[schedule]\nmin_useful_s = 30\n"


@dataclass(frozen=True)
class Night:
    days: Days
    book: tuple[Entry, ...]

    def of(self, name: str) -> Entry:
        [entry] = [one for one in self.book if one.satellite == name and one.rise_tai_s < START + 2400.0]
        return entry


def configured(directory: Path, station: str = "") -> Path:
    return write(directory, HIGH + station, scd=BROUWER + FIRST, behind=BEHIND + SHORT)


def night(tmp_path: Path, station: str = "", minutes: float = 13.0, **more: object) -> Night:
    config, state = configured(tmp_path / "config", station), tmp_path / "state"
    state.mkdir(exist_ok=True)
    days = run_days(config, state, START, START + 60.0 * minutes, **more)
    with ScheduleFile(state, is_read_only=True) as file:
        return Night(days, file.book(START))


HORN_S = 7.0
HORN = f'[hooks]\nbefore_move = ["horn"]\nbefore_move_s = {HORN_S}\n'
PARK = '[schedule]\nafter = "park"\npark_az_deg = 20.0\npark_el_deg = 60.0\nnext_within_s = 60\n'


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Night:
    HEARD_TAI_S.clear()
    return night(tmp_path_factory.mktemp("plain"), PARK + HORN, minutes=7.0, script=[(START, hear_the_horn)])


HEARD_TAI_S: list[float] = []


def hear_the_horn(access: StationAccess) -> None:
    """No program is started in virtual time: when it would be is noted."""

    def called(hook: Hook, _about: object) -> None:
        if hook is Hook.BEFORE_MOVE:
            HEARD_TAI_S.append(access.runs._setup.clock.tai_s())

    access.runs.day.hooks.call = called  # type: ignore[method-assign]


@pytest.mark.long
def test_the_horn_is_heard_before_each_unasked_move_and_the_antenna_is_watched_meanwhile(plain: Night) -> None:
    rows = plain.days.rows
    moves = [now.tai_s for before, now in pairwise(rows) if (before.mode, now.mode) == (STANDBY, AcuMode.REMOTE)]
    assert len(moves) == len(HEARD_TAI_S) == 2
    assert all(begun - heard >= HORN_S for heard, begun in zip(HEARD_TAI_S, moves, strict=True))
    assert all(begun - heard < HORN_S + 60.0 for heard, begun in zip(HEARD_TAI_S, moves, strict=True))


def test_every_granted_pass_is_tracked_and_every_other_one_has_its_reason(plain: Night) -> None:
    assert plain.of("scd").state is PassState.DONE, plain.of("scd")
    assert plain.of("behind").state is PassState.REFUSED
    assert plain.of("behind").reason.startswith("lost to scd of")


def test_before_the_pass_and_after_it_the_acu_stands_in_standby(plain: Night) -> None:
    entry, rows = plain.of("scd"), plain.days.rows
    at_rest = [row for row in rows if row.tai_s < entry.rise_tai_s - 140.0 or row.tai_s > entry.set_tai_s + 90.0]
    assert {row.mode for row in at_rest} == {AcuMode.STANDBY}


def test_after_a_pass_it_parks_where_the_next_one_is_far(plain: Night) -> None:
    last = plain.days.rows[-1]
    assert (last.encoder_az_deg, last.encoder_el_deg) == (pytest.approx(20.0, abs=0.1), pytest.approx(60.0, abs=0.1))


@pytest.mark.long
def test_a_pass_that_is_a_no_go_is_tried_again_and_tracked_once_it_is_none(tmp_path: Path) -> None:
    fixed_at = START + 170.0

    def check(name: str, tai_s: float) -> list[str]:
        return ["door: open"] if name == "scd" and tai_s < fixed_at else []

    found = night(tmp_path, minutes=6.0, check=check)
    assert {one["reason"] for one in found.days.named("check.no_go")} == {"door: open"}
    assert found.of("scd").state in (PassState.DONE, PassState.DEGRADED)


@pytest.mark.long
def test_one_that_stays_a_no_go_fails_with_its_reason_and_the_antenna_does_not_move(tmp_path: Path) -> None:
    found = night(tmp_path, minutes=6.0, check=lambda name, _tai_s: ["door: open"] if name == "scd" else [])
    assert (found.of("scd").state, found.of("scd").reason) == (PassState.FAILED, "not begun: door: open")
    assert {row.mode for row in found.days.rows if row.tai_s < found.of("scd").set_tai_s} == {AcuMode.STANDBY}


@pytest.mark.long
def test_a_kill_in_mid_pass_is_gone_on_from_and_nothing_is_lost(tmp_path: Path) -> None:
    def kill(_access: StationAccess) -> None:
        raise KilledError

    config, state = configured(tmp_path / "config"), tmp_path / "state"
    state.mkdir()
    killed_at = START + 240.0
    before = run_days(config, state, START, START + 420.0, script=[(killed_at, kill)])
    assert before.outcome is None
    assert before.rows[-1].mode is AcuMode.AUTOTRACK
    after = run_days(config, state, killed_at + 1.0, START + 420.0, before=before)
    assert {row.mode for row in after.rows if row.tai_s < killed_at + 30.0} == {AcuMode.AUTOTRACK}
    with ScheduleFile(state, is_read_only=True) as file:
        [scd] = [one for one in file.book(START) if one.satellite == "scd" and one.rise_tai_s < START + 2400.0]
    assert scd.state is PassState.DONE, scd
    assert "gone on with after a restart" in scd.reason


def test_a_persons_words_hold_at_once_and_a_bad_file_is_refused_while_the_old_one_stays(tmp_path: Path) -> None:
    def force(access: StationAccess) -> None:
        request = PassRequest("behind", access.runs.day.keeper.book[1].culmination_tai_s, Wish.FORCE)
        with ScheduleFile(tmp_path / "state") as file:
            file.say(request, START, "a person")

    def spoil(access: StationAccess) -> None:
        path = access.config / "station.toml"
        path.write_text(path.read_text().replace("max_deg = 90.0", "max_deg = ninety"))

    found = night(tmp_path, minutes=8.0, script=[(START + 2.0, force), (START + 4.0, spoil)])
    assert found.of("behind").state is not PassState.REFUSED
    assert "in_force" in found.days.named("config.kept")[0]


@pytest.mark.long
def test_strong_wind_begins_no_pass_and_says_so(tmp_path: Path) -> None:
    (tmp_path / "wind.json").write_text('{"mean_m_s": 20.0, "gust_m_s": 25.0, "utc": "1989-02-01T02:03:00Z"}')
    wind = f'[wind]\nfile = "{tmp_path}/wind.json"\nmax_age_s = 3600\n'
    found = night(tmp_path, wind, minutes=6.0)
    assert found.of("scd").state is PassState.FAILED
    assert found.of("scd").reason.startswith("not begun: wind strong")
