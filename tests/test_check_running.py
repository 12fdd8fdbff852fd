"""What a check says of a daemon that runs here, or ran: how old what it wrote may be, its alarms, what it left."""

import json
import os
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from config_files import write
from test_live_line import SEEN

from acu_daemon.cli import check_running
from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.cli.check_running import ALARM_KEYS, HEALTHY_AGE_S, held_finding, left_behind, running_finding
from acu_daemon.cli.options import antenna_of
from acu_daemon.cli.own_daemon import OwnDaemon
from acu_daemon.config.load import load_station
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.health import status_line
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import Level, alarms, verdict
from acu_daemon.edge.state_directory import SNAPSHOT

NOW_S = 1_000_000.0
STEP_S = 0.01
OLDER_BY_ACU, OLDER_BY_STATION = "old@{acu}", "{station}@old"
OTHERS = "Natal@serial"


class Places:
    """A configuration, its state directory, and the folders of antennas in it."""

    def __init__(self, folder: Path) -> None:
        self.config, self.state = write(folder / "config"), folder / "state"
        self.state.mkdir()
        self.station = load_station(self.config)
        self.own = antenna_of(self.station).folder(self.state)

    def named(self, name: str) -> Path:
        station, _, acu = self.own.name.partition("@")
        return self.state / name.format(station=station, acu=acu)

    def wrote(self, folder: Path, age_s: float, **seen: Any) -> Path:
        """Write a snapshot that is so old."""
        folder.mkdir(exist_ok=True)
        path = folder / SNAPSHOT
        path.write_text(json.dumps(seen))
        os.utime(path, (NOW_S - age_s, NOW_S - age_s))
        return path

    def found(self, *, is_rehearsal: bool = False) -> Finding:
        return running_finding(self.config, self.state, is_rehearsal=is_rehearsal)


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Places:
    monkeypatch.setattr(check_running, "time", type("Standing", (), {"time": staticmethod(lambda: NOW_S)}))
    return Places(tmp_path)


# That runs


@pytest.mark.parametrize(("age_s", "grade"), [(0.0, GO), (HEALTHY_AGE_S - STEP_S, GO), (HEALTHY_AGE_S, NO_GO)])
def test_a_daemon_ticks_whose_snapshot_is_younger_than_5_s(places: Places, age_s: float, grade: str) -> None:
    assert HEALTHY_AGE_S == 5.0
    path = places.wrote(places.own, age_s)
    assert places.found() == Finding(grade, "running daemon", f"{path}: written {age_s:.1f} s ago")


@pytest.mark.parametrize(("age_s", "grade"), [(0.0, WARN), (HEALTHY_AGE_S + 1.0, NO_GO)])
@pytest.mark.parametrize("key", ALARM_KEYS)
def test_an_alarm_of_one_that_ticks_is_a_warning(places: Places, key: str, age_s: float, grade: str) -> None:
    path = places.wrote(places.own, age_s, **{key: "look at it"})
    assert places.found() == Finding(grade, "running daemon", f"{path}: written {age_s:.1f} s ago; look at it")


def test_a_latch_comes_first_then_a_disarm_then_the_rest_in_order(places: Places) -> None:
    given = {key: key for key in reversed(ALARM_KEYS)} | {"latch": "azimuth", "disarmed_by": "ann"}
    places.wrote(places.own, 1.0, **given)
    said = places.found().detail.split("; ")
    assert said[1:] == ["latched: azimuth", "disarmed by ann", *ALARM_KEYS]
    assert [text.partition("_")[0] for text in ALARM_KEYS] == [
        *("acu", "clock", "encoder", "envelope", "files", "turn", "limit", "line", "signal", "stow", "tilt")
    ]


def test_whatever_text_of_a_snapshot_is_an_alarm_elsewhere_is_one_here() -> None:
    texts = [one.name for one in fields(Snapshot) if isinstance(getattr(SEEN, one.name), str)]
    raised = {
        name for name in texts if any("look at it" in said for said in alarms(replace(SEEN, **{name: "look at it"})))
    }
    own_words, momentary = {"latch"}, {"rejecting"}
    assert raised == {*ALARM_KEYS} | own_words | momentary


@pytest.mark.parametrize("text", ["[]", "{", "", '"text"', "7"])
def test_a_snapshot_that_is_none_tells_its_age_alone(places: Places, text: str) -> None:
    path = places.wrote(places.own, 1.0)
    path.write_text(text)
    os.utime(path, (NOW_S - 1.0, NOW_S - 1.0))
    assert places.found() == Finding(GO, "running daemon", f"{path}: written 1.0 s ago")


def test_where_none_was_written_its_place_is_named(places: Places) -> None:
    path = places.own / SNAPSHOT
    assert places.found() == Finding(NO_GO, "running daemon", f"{path}: no daemon has written it")
    assert f"{places.state}-rehearsal/" in places.found(is_rehearsal=True).detail


@pytest.mark.parametrize("name", [OLDER_BY_ACU, OLDER_BY_STATION, "."])
@pytest.mark.parametrize(("age_s", "is_own"), [(3.0, False), (5.0, True)])
def test_of_a_folder_and_its_older_names_the_newest_snapshot_counts(
    places: Places, name: str, age_s: float, is_own: bool
) -> None:
    own, older = places.wrote(places.own, 4.0), places.wrote(places.named(name), age_s)
    assert str(own if is_own else older) in places.found().detail
    assert "written 4.0 s ago" in places.found().detail or not is_own


def test_another_antennas_snapshot_is_none_of_ours_unless_no_configuration_says_which_ours_is(
    places: Places,
) -> None:
    other = places.wrote(places.named(OTHERS), 1.0)
    assert places.found().verdict == NO_GO
    (places.config / "station.toml").write_text("[station]\n")
    assert places.found() == Finding(GO, "running daemon", f"{other}: written 1.0 s ago")
    other.unlink()
    assert places.found().detail == f"{places.state / SNAPSHOT}: no daemon has written it"


# That holds the ACU


def held(**more: Any) -> Finding:
    return held_finding(OwnDaemon(Path("/there"), replace(SEEN, **more)))


def test_a_daemon_that_may_not_be_asked_is_a_warning() -> None:
    found = held_finding(OwnDaemon(Path("/there"), None, "permission denied"))
    assert found == Finding(WARN, "running daemon", "one runs with /there: permission denied")


@pytest.mark.parametrize(
    ("seen", "level", "grade"),
    [
        ({}, Level.GOOD, GO),
        ({"state": "IDLE", "rise_in_s": 50.0, "set_in_s": 90.0}, Level.CALM, GO),
        ({"state": "SEARCH"}, Level.WATCH, WARN),
        ({"state": TrackState.LINK_LOST}, Level.BAD, WARN),
        ({"files_alarm": "disk full"}, Level.GOOD, WARN),
    ],
)
def test_a_daemon_that_holds_the_acu_is_well_below_a_watch_and_without_alarms(
    seen: dict[str, Any], level: Level, grade: str
) -> None:
    judged = verdict(replace(SEEN, **seen))
    assert judged.level is level
    said = f"a daemon runs and holds the ACU, which is not asked: {status_line(replace(SEEN, **seen))}; {judged.why}"
    assert held(**seen) == Finding(grade, "running daemon", f"{said} (/there)")


# That ran


@pytest.mark.parametrize("name", [OLDER_BY_ACU, OLDER_BY_STATION, ".", None, OTHERS])
@pytest.mark.parametrize(
    ("file", "grade", "verb"), [("latch", NO_GO, "clear"), ("disarmed", WARN, "arm"), ("stowed", WARN, "unstow")]
)
def test_what_was_left_forbids_in_each_folder_of_the_antenna(
    places: Places, name: str | None, file: str, grade: str, verb: str
) -> None:
    folder = places.own if name is None else places.named(name)
    folder.mkdir(exist_ok=True)
    (folder / file).touch()
    found = list(left_behind(places.config, places.station, places.state))
    if name == OTHERS:
        assert found == []
        return
    [one] = found
    assert (one.verdict, one.what) == (grade, file)
    assert one.detail.startswith(f"{folder / file} is there: ")
    assert f"`acu-daemon {verb}" in one.detail
    if verb != "unstow":
        assert f"`acu-daemon {verb} --config {places.config} --state {places.state}`" in one.detail


def test_all_that_was_left_is_told_the_gravest_first(places: Places) -> None:
    older = places.named(OLDER_BY_ACU)
    for folder in (places.own, older):
        folder.mkdir()
        for file in ("stowed", "disarmed", "latch"):
            (folder / file).touch()
    found = list(left_behind(places.config, places.station, places.state))
    assert [one.what for one in found] == ["latch", "latch", "disarmed", "disarmed", "stowed", "stowed"]
    assert [str(folder) in one.detail for one, folder in zip(found, [places.own, older] * 3, strict=True)] == [True] * 6
