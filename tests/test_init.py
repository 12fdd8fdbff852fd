"""`acu-daemon init`: what it asks and takes, what it writes, that nothing is ever overwritten."""

import io
import tomllib
from pathlib import Path

import pytest
from command_line import Done, acu_daemon

from acu_daemon.cli import init
from acu_daemon.cli.station_files import file_word, shipped_station, station_text
from acu_daemon.config.load import load_satellite, load_station, satellite_names
from acu_daemon.errors import UsageError

ROOT = Path(__file__).resolve().parents[1]
DEMO = (ROOT / "acu_daemon" / "cli" / "demo_config" / "satellites" / "demo-1.tle").read_text()
PLACE = ("--name", "São José", "--latitude", "-23.2", "--longitude", "-45.86", "--height", "600")
AXES = ("--azimuth", "-270,270,20,10", "--elevation", "0,90,5,5")
STATION = (*PLACE, *AXES)


def a_set(name: str, norad_id: int) -> str:
    """The demo's set for another satellite."""
    lines = [line.replace("99901", str(norad_id))[:68] for line in DEMO.splitlines()[1:]]
    sums = [sum(int(c) if c.isdigit() else c == "-" for c in line) % 10 for line in lines]
    return name + "".join(f"\n{line}{digit}" for line, digit in zip(lines, sums, strict=True)) + "\n"


@pytest.fixture(autouse=True)
def quick_check(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """In place of `check`, which asks the ACU; tried by itself elsewhere."""
    checked: list[Path] = []
    monkeypatch.setattr(init, "check", checked.append)
    return checked


@pytest.fixture
def weather(tmp_path: Path) -> Path:
    """A list of three satellites, two of them alike by name."""
    path = tmp_path / "weather.txt"
    path.write_text(a_set("NOAA 20", 43013) + a_set("NOAA 21", 54234) + a_set("METOP-B [+]", 38771))
    return path


def answered(monkeypatch: pytest.MonkeyPatch, *answers: str) -> None:
    """A person at a terminal who types these lines."""
    terminal = io.StringIO("".join(f"{one}\n" for one in answers))
    monkeypatch.setattr(terminal, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stdin", terminal)


def made(directory: Path, *options: object) -> Done:
    return acu_daemon("init", directory, *options)


def test_with_all_options_no_terminal_is_needed_and_the_files_load(
    tmp_path: Path, weather: Path, quick_check: list[Path]
) -> None:
    config = tmp_path / "station"
    done = made(
        config, *STATION, "--beamwidth", "1.4", "--elements", weather, "--satellite", "43013", "--satellite", "metop b"
    )
    assert done.code == 0, done.err
    assert quick_check == [config]
    station = load_station(config)
    assert (station.station.name, station.station.latitude_deg, station.station.longitude_deg) == (
        "São José", -23.2, -45.86,
    )  # fmt: skip
    assert (station.acu.azimuth.min_deg, station.acu.elevation.max_rate_deg_s) == (-270.0, 5.0)
    assert (station.receiver.beamwidth_deg, station.station.min_elevation_deg) == (1.4, 5.0)
    assert satellite_names(config) == ["metop-b", "noaa-20"]
    satellite, _ = load_satellite(config, "noaa-20", station)
    assert satellite.satellite.norad_id == 43013
    listed = acu_daemon("passes", "--config", config, "--from", "2026-08-18T12:00:00Z", "--days", "1")
    assert listed.code == 0, listed.err
    assert "noaa-20" in listed.out
    assert "acu-daemon rehearse --config" in done.out


def test_the_comments_are_those_of_the_shipped_file_in_their_columns(tmp_path: Path) -> None:
    made(tmp_path / "station", *STATION)
    written = (tmp_path / "station" / "station.toml").read_text().splitlines()
    shipped = (ROOT / "config" / "station.toml").read_text().splitlines()
    assert written[2:][0] == ""
    assert len(written) == len(shipped)
    for new, old in zip(written[2:], shipped[2:], strict=True):
        assert new.partition("#")[1:] == old.partition("#")[1:]
        assert new.find("#") == old.find("#")


def test_every_value_that_is_asked_for_stands_in_the_shipped_file() -> None:
    keys = [key for question in init.QUESTIONS.values() for key in question.keys]
    text = station_text(shipped_station(), dict.fromkeys(keys, 1.25))
    read = tomllib.loads(text)
    for table, key in keys:
        part = read
        for word in table.split("."):
            part = part[word]
        assert part[key] == 1.25
    with pytest.raises(KeyError, match=r"no station\.colour"):
        station_text(shipped_station(), {("station", "colour"): 1.0})


def test_a_person_is_asked_for_what_is_missing_and_again_where_an_answer_cannot_be_used(
    tmp_path: Path, weather: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answered(
        monkeypatch,
        *("Kourou", "95", "5.16", "-52.6", "20", "", "serial:///dev/ttyS9?baud=9600", "-180,180,3", "-180 180 3 1"),
        *("0,90,3,1", "", str(tmp_path / "nothing.txt"), str(weather), "NOAA", "noaa 21"),
    )
    done = made(tmp_path / "station")
    assert done.code == 0, done.err
    assert "expected a number from -90 to 90" in done.out
    assert "expected four numbers" in done.out
    assert "No such file" in done.out
    assert "'NOAA' fits NOAA 20 (43013), NOAA 21 (54234)" in done.out
    station = load_station(tmp_path / "station")
    assert (station.station.latitude_deg, station.acu.url) == (5.16, "serial:///dev/ttyS9?baud=9600")
    assert satellite_names(tmp_path / "station") == ["noaa-21"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (PLACE, "give also --azimuth, --elevation"),
        (
            (*PLACE, "--azimuth", "270,-270,20,10", "--elevation", "0,90,5,5"),
            "--azimuth '270,-270,20,10': expected MIN",
        ),
        ((*STATION, "--acu", "http://acu"), "--acu 'http://acu'"),
        ((*STATION, "--beamwidth", "nan"), "--beamwidth 'nan': expected a number from 0.01 to 30"),
        ((*STATION, "--satellite", "43013"), "--satellite needs --elements FILE"),
        ((*STATION, "--elements", "{weather}"), "say which satellites"),
        ((*STATION, "--elements", "{weather}", "--satellite", "NOAA 22"), "no satellite 'NOAA 22'; near it: NOAA 2"),
        ((*STATION, "--elements", "{weather}", "--satellite", "1"), "no satellite '1'"),
        ((*STATION, "--elements", "{weather}.no", "--satellite", "1"), "No such file"),
    ],
)
def test_what_cannot_be_used_is_said_and_nothing_is_written(
    tmp_path: Path, weather: Path, options: tuple[str, ...], said: str
) -> None:
    done = made(tmp_path / "station", *(option.format(weather=weather) for option in options))
    assert done.code == 2
    assert said in done.err
    assert not (tmp_path / "station").exists()


def test_nothing_is_overwritten_and_satellites_are_added_to_a_station_that_is_there(
    tmp_path: Path, weather: Path
) -> None:
    config, add = tmp_path / "station", ("--elements", weather, "--satellite")
    assert made(config, *STATION, *add, "43013").code == 0
    before = (config / "station.toml").read_bytes()
    assert made(config, *add, "54234").code == 0
    assert satellite_names(config) == ["noaa-20", "noaa-21"]
    refused = made(config, *add, "54234")
    assert (refused.code, "is there already" in refused.err) == (2, True)
    weather.write_text(a_set("METOP-B [+]", 38771))
    assert "with other content" in made(config, *add, "38771").err
    assert "change it by hand, not by --name" in made(config, "--name", "other").err
    assert satellite_names(config) == ["noaa-20", "noaa-21"]
    assert (config / "station.toml").read_bytes() == before


def test_a_satellite_without_a_name_is_called_by_its_number(tmp_path: Path) -> None:
    lines = "".join(f"{line}\n" for line in DEMO.splitlines() if line[:2] in ("1 ", "2 "))
    (tmp_path / "one.tle").write_text(lines)
    assert made(tmp_path / "station", *STATION, "--elements", tmp_path / "one.tle", "--satellite", "99901").code == 0
    assert satellite_names(tmp_path / "station") == ["99901"]
    assert file_word("Amazônia 1 [+]") == "amazonia-1"
    assert file_word("NOAA 20 (JPSS-1)") == "noaa-20"


@pytest.mark.parametrize(
    ("word", "number"), [("noaa 1", 90001), ("NOAA-1", 90001), ("noaa18", 90018), ("aa 18", 90018), ("90001", 90001)]
)
def test_a_whole_name_goes_before_a_part_of_others_however_it_is_written(
    tmp_path: Path, word: str, number: int
) -> None:
    path = tmp_path / "list.tle"
    path.write_text(a_set("NOAA 1", 90001) + a_set("NOAA 18", 90018))
    assert init._find(init._list(path), word).norad_id == number


def test_a_part_that_several_names_have_is_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "list.tle"
    path.write_text(a_set("NOAA 1", 90001) + a_set("NOAA 18", 90018))
    with pytest.raises(UsageError, match="fits"):
        init._find(init._list(path), "noaa")
