"""`acu-daemon schedule` and `pause`: the plan of a directory, people's words, and what outlives the command."""

import json
from pathlib import Path

import pytest
from command_line import Done, acu_daemon
from config_files import BROUWER, replaced, write

from acu_daemon.orbit.timescales import tai_from_utc, utc_text

START = "1989-02-01T00:00:00Z"
# half a minute behind the first, on the same orbit: the two are never to be tracked both
BEHIND = replaced(BROUWER, "SCD-1", "SCD-9").replace("mean_anomaly_deg = 350.56", "mean_anomaly_deg = 348.8")
FIRST = "[schedule]\npriority = 6\n"


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return write(tmp_path / "config", scd=BROUWER + FIRST, behind=BEHIND)


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "state"))
    return tmp_path / "state"


def schedule(config: Path, *more: object) -> Done:
    return acu_daemon("schedule", "--config", config, "--from", START, "--days", 1, *more)


def found(config: Path, *more: object) -> list[dict[str, object]]:
    done = schedule(config, *more, "--json")
    assert (done.code, done.err) == (0, "")
    return json.loads(done.out)


def to_the_second(utc: str) -> str:
    return utc_text(tai_from_utc(utc), 0)[:19].replace("-", "").replace(":", "") + "Z"


def test_each_pass_is_granted_or_has_a_reason_and_nothing_is_left_behind(config: Path, state: Path) -> None:
    passes = found(config)
    assert len(passes) >= 10
    assert {one["satellite"] for one in passes} == {"scd", "behind"}
    for one in passes:
        assert (one["state"], bool(one["reason"])) in {("planned", False), ("refused", True)}
        assert one["priority"] == (6 if one["satellite"] == "scd" else 5)
    assert all(one["state"] == "planned" for one in passes if one["satellite"] == "scd")
    assert any("lost to scd of" in str(one["reason"]) for one in passes)
    assert not state.exists()


def test_the_table_has_the_same_and_the_calendar_the_granted_ones(config: Path) -> None:
    passes = found(config)
    granted = [one for one in passes if one["state"] == "planned"]
    lines = schedule(config).out.splitlines()
    assert [line.split()[:2] for line in lines[1:-1]] == [[one["state"], one["satellite"]] for one in passes]
    assert lines[-1].startswith(f"{len(granted)} of {len(passes)} passes granted")
    calendar = schedule(config, "--ics").out
    assert calendar.count("BEGIN:VEVENT") == calendar.count("END:VEVENT") == len(granted)
    starts = [line[8:] for line in calendar.splitlines() if line.startswith("DTSTART:")]
    assert starts == [to_the_second(str(one["start_utc"])) for one in granted]


@pytest.mark.long
def test_a_person_forces_a_pass_and_takes_the_word_back(config: Path) -> None:
    lost = next(one for one in found(config) if one["state"] == "refused")
    word = ("behind", lost["culmination_utc"])
    forced = {one["culmination_utc"]: one for one in found(config, "--force", *word)}
    assert forced[lost["culmination_utc"]]["state"] == "planned"
    assert forced[lost["culmination_utc"]]["reason"] == "forced by a person"
    assert [one["state"] for one in found(config) if one["culmination_utc"] == lost["culmination_utc"]] == ["planned"]
    withdrawn = {one["culmination_utc"]: one for one in found(config, "--as-planned", *word)}
    assert withdrawn[lost["culmination_utc"]]["state"] == "refused"
    excluded = found(config, "--exclude", "scd", lost["culmination_utc"])
    assert "excluded by a person" in {one["reason"] for one in excluded}


def test_a_word_about_an_unknown_satellite_and_a_time_that_is_none_change_nothing(config: Path, state: Path) -> None:
    unknown = schedule(config, "--force", "nobody", START)
    assert unknown.code == 2
    assert "there are behind, scd" in unknown.err
    no_time = schedule(config, "--force", "scd", "soon")
    assert no_time.code == 2
    assert "soon" in no_time.err
    assert all(one["reason"] != "forced by a person" for one in found(config))


def test_a_pause_is_shown_ends_by_itself_and_can_be_ended(config: Path) -> None:
    assert acu_daemon("pause", "--config", config).code == 2
    assert acu_daemon("pause", "--config", config, "--until", START).code == 2
    assert acu_daemon("pause", "--config", config, "--until", "2200-01-01T00:00:00Z").code == 0
    paused = found(config)
    assert {one["state"] for one in paused} == {"cancelled", "refused"}
    assert "PAUSED until 2200" in schedule(config).out
    assert acu_daemon("pause", "--config", config, "--end").code == 0
    assert "planned" in {one["state"] for one in found(config)}


def test_a_maintenance_window_and_a_satellite_that_cannot_be_used_are_told(config: Path) -> None:
    first = next(one for one in found(config) if one["state"] == "planned")
    to_utc = utc_text(tai_from_utc(str(first["rise_utc"])) + 60.0)
    window = f"[[schedule.maintenance]]\nfrom_utc = {START}\nto_utc = {to_utc}\nreason = 'greasing'\n"
    station = config / "station.toml"
    station.write_text(station.read_text() + window)
    (config / "satellites" / "broken.toml").write_text(BROUWER.replace("7180.0", "100.0"))
    done = schedule(config, "--json")
    assert "broken is left out" in done.err
    [same] = [one for one in json.loads(done.out) if one["culmination_utc"] == first["culmination_utc"]]
    assert str(same["reason"]).startswith("greasing 00:00:00 to ")
