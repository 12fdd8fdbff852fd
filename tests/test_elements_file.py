"""From a satellite's TOML to a propagator: which file, which set of it, and what is said of bad ones."""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from config_files import BROUWER, from_file, replaced, write
from conftest import DATA, needs_data

from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.edge import elements_file
from acu_daemon.edge.elements_file import LoadedElements, load_elements
from acu_daemon.errors import ElementsError, UsageError
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S

ISS = """ISS (ZARYA)
1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996
2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325546
"""
JASON = """JASON-1
1 26997U 01055A   03004.93435045 -.00000061 +00000-0 +00000-0 0  9992
2 26997 066.0441 282.4493 0007263 268.3158 091.7024 12.80929111050371
"""
NOW = tai_from_utc("2022-02-11T00:00:00Z")


def bad(text: str) -> str:
    """The same set with a digit of its second line changed, so that the checksum is wrong."""
    lines = text.splitlines()
    return "\n".join([*lines[:-1], lines[-1][:12] + str(9 - int(lines[-1][12])) + lines[-1][13:]]) + "\n"


def load(directory: Path, satellite: str, elements: str | bytes = ISS, now: float = NOW) -> LoadedElements:
    """Load DIR/satellites/sat.toml, whose elements lie in DIR/lists/active.txt."""
    write(directory, sat=satellite)
    lists = directory / "lists"
    lists.mkdir(exist_ok=True)
    (lists / "active.txt").write_bytes(elements if isinstance(elements, bytes) else elements.encode())
    os.utime(lists / "active.txt", (0.0, 0.0))  # nobody is writing it
    section, _ = load_satellite(directory, "sat", load_station(directory))
    return load_elements(section, directory / "satellites" / "sat.toml", now)


def refusal(directory: Path, satellite: str, elements: str | bytes = ISS) -> str:
    with pytest.raises(ElementsError) as error:
        load(directory, satellite, elements)
    return str(error.value).replace(str(directory), "DIR")


def tle(name: str, norad_id: int | None = None) -> str:
    return from_file(name, "tle", "../lists/active.txt", norad_id)


def test_a_file_in_which_everybody_may_write_is_refused_with_what_to_do(tmp_path: Path) -> None:
    assert load(tmp_path, tle("ISS (ZARYA)")).label
    (tmp_path / "lists" / "active.txt").chmod(0o666)
    with pytest.raises(UsageError, match=r"active\.txt: everybody may write there; close it: chmod o-w"):
        load(tmp_path, tle("ISS (ZARYA)"))


def test_the_file_is_relative_to_the_satellites_toml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")
    loaded = load(tmp_path, tle("ISS"))
    assert (loaded.label, loaded.errors, loaded.warnings) == ("ISS (ZARYA) (25544)", [], [])
    assert loaded.propagator.kind == "tle"


def test_an_absolute_file_is_taken_as_it_is(tmp_path: Path) -> None:
    loaded = load(tmp_path, from_file("ISS", "tle", str(tmp_path / "lists" / "active.txt")))
    assert loaded.label == "ISS (ZARYA) (25544)"


def test_a_list_is_searched_by_number_else_by_name(tmp_path: Path) -> None:
    both = JASON + ISS
    assert load(tmp_path, tle("whatever", 25544), both).label == "ISS (ZARYA) (25544)"
    assert load(tmp_path, tle("Iss (Zarya)"), both).label == "ISS (ZARYA) (25544)"
    assert load(tmp_path, tle("jason 1"), both).label == "JASON-1 (26997)"
    assert refusal(tmp_path, tle("ISS", 7), both) == (
        "DIR/satellites/../lists/active.txt: no element set with norad_id 7 (did you mean ISS (ZARYA) (25544)?); "
        "the file holds JASON-1 (26997), ISS (ZARYA) (25544)"
    )
    assert "no element set with name 'ZARYA'" in refusal(tmp_path, tle("ZARYA"), both)


@pytest.mark.parametrize("ends", ["\r\n", "\r"])
def test_line_ends_of_other_systems_do_not_matter(tmp_path: Path, ends: str) -> None:
    elsewhere, here = load(tmp_path, tle("ISS"), ISS.replace("\n", ends)), load(tmp_path, tle("ISS"))
    times = np.array([NOW])
    assert (elsewhere.propagator.states_teme(times)[0] == here.propagator.states_teme(times)[0]).all()


def test_elements_60_days_old_are_refused_and_10_days_old_warned_of(tmp_path: Path) -> None:
    [error] = load(tmp_path, tle("ISS"), now=NOW + 60 * DAY_S).errors
    assert error.startswith(f"{tmp_path}/satellites/../lists/active.txt, line 2: ISS (ZARYA) (25544): the epoch")
    assert "60.4 days old, the limit is 30 days; fetch newer elements: expected error about " in error
    assert "(max_age_days = 30, the default; set it in [elements.limits] of the satellite's file)" in error
    older = load(tmp_path, tle("ISS"), now=NOW + 12 * DAY_S)
    assert older.errors == []
    assert "12.4 days old" in older.warnings[0]


def test_the_age_limit_is_the_satellites_own(tmp_path: Path) -> None:
    patient = tle("ISS") + "[elements.limits]\nmax_age_days = 90\n"
    assert load(tmp_path, patient, now=NOW + 60 * DAY_S).errors == []


def test_a_wrong_checksum_is_refused_with_file_and_line(tmp_path: Path) -> None:
    assert refusal(tmp_path, tle("ISS"), bad(ISS)).startswith(
        "DIR/satellites/../lists/active.txt, line 3: checksum 6, computed"
    )


def test_a_bad_set_of_another_satellite_is_only_warned_of(tmp_path: Path) -> None:
    loaded = load(tmp_path, tle("ISS (ZARYA)"), bad(JASON) + ISS)
    assert loaded.errors == []
    [warning] = loaded.warnings
    assert "active.txt, line 3: checksum 1, computed" in warning


@pytest.mark.parametrize("satellite", [tle("ISS (ZARYA)"), tle("ISS", 25544)])
def test_when_the_own_set_is_the_bad_one_the_only_other_satellite_is_not_taken_for_it(
    tmp_path: Path, satellite: str
) -> None:
    why, said = refusal(tmp_path, satellite, JASON + bad(ISS)).splitlines()
    assert "no element set with n" in said
    assert "the file holds JASON-1 (26997)" in said
    assert "active.txt, line 6: checksum 6, computed" in why


def test_of_many_bad_sets_the_first_are_told_and_the_rest_counted(tmp_path: Path) -> None:
    loaded = load(tmp_path, tle("ISS", 25544), 20 * bad(JASON) + ISS)
    assert len(loaded.warnings) == 6
    assert loaded.warnings[-1].endswith("active.txt: 15 more element sets cannot be read")


def test_an_older_good_set_is_used_when_the_newest_is_bad(tmp_path: Path) -> None:
    newer = replaced(ISS, "22041.55493323", "22042.55493323")
    loaded = load(tmp_path, tle("ISS (ZARYA)", 25544), ISS + newer, now=NOW + DAY_S)
    assert loaded.epoch_tai_s == pytest.approx(tai_from_utc("2022-02-10T13:19:06.231Z"), abs=0.01)
    assert "line 5: checksum" in loaded.warnings[0]


@pytest.mark.parametrize("text", ["", "\n\n", b"\xff\xfe\x00"])
def test_a_file_without_elements_is_told(tmp_path: Path, text: str | bytes) -> None:
    assert "active.txt" in refusal(tmp_path, tle("ISS"), text)


def test_a_file_that_is_not_there_or_a_directory_is_told_with_the_key(tmp_path: Path) -> None:
    assert refusal(tmp_path, from_file("ISS", "tle", "iss.tle")) == (
        "DIR/satellites/sat.toml: elements.file = 'iss.tle': DIR/satellites/iss.tle: No such file or directory"
    )
    assert refusal(tmp_path, from_file("ISS", "tle", "..")).endswith("DIR/satellites/..: Is a directory")


def test_an_orbit_mean_elements_message_is_read(tmp_path: Path) -> None:
    fields = {
        "OBJECT_NAME": "ISS (ZARYA)",
        "OBJECT_ID": "1998-067A",
        "EPOCH": "2022-02-10T13:19:06.231072",
        "MEAN_MOTION": 15.49692082,
        "ECCENTRICITY": 0.000567,
        "INCLINATION": 51.6412,
        "RA_OF_ASC_NODE": 243.7057,
        "ARG_OF_PERICENTER": 116.5714,
        "MEAN_ANOMALY": 333.956,
        "NORAD_CAT_ID": 25544,
        "BSTAR": 0.00012771,
    }
    omm = load(tmp_path, from_file("ISS", "omm", "../lists/active.txt"), json.dumps([fields]))
    two_lines = load(tmp_path, tle("ISS"))
    times = NOW + np.arange(0.0, 6000.0, 60.0)
    away_m = omm.propagator.states_teme(times)[0] - two_lines.propagator.states_teme(times)[0]
    assert omm.propagator.kind == "omm"
    assert np.linalg.norm(away_m, axis=1).max() < 1.0


def test_brouwer_elements_come_from_the_toml_itself(tmp_path: Path) -> None:
    at_epoch = tai_from_utc("1989-01-31T09:58:00Z")
    loaded = load(tmp_path, BROUWER, now=at_epoch)
    assert (loaded.label, loaded.propagator.kind, loaded.epoch_tai_s) == ("SCD-1", "brouwer", at_epoch)
    assert loaded.errors == []
    perigee_km = 7180.0 * (1 - 0.0436)
    r_m, _ = loaded.propagator.states_teme(at_epoch + np.arange(0.0, 6100.0, 10.0))
    assert np.linalg.norm(r_m, axis=1).min() / 1e3 == pytest.approx(perigee_km, abs=15.0)


def test_brouwer_elements_outside_the_limits_are_refused_with_the_file(tmp_path: Path) -> None:
    at_epoch = tai_from_utc("1989-01-31T09:58:00Z")
    [error] = load(tmp_path, replaced(BROUWER, "7180.0", "9180.0"), now=at_epoch).errors
    assert error.startswith(f"{tmp_path}/satellites/sat.toml: SCD-1: semi-major axis 9180 km is outside 6500..8500 km")


@needs_data
def test_a_real_list_is_searched_by_number(tmp_path: Path) -> None:
    text = (DATA / "tle_sets" / "celestrak_weather_2018-11-07.txt").read_bytes()
    loaded = load(tmp_path, tle("NOAA 19", 33591), text, now=tai_from_utc("2018-11-08T00:00:00Z"))
    assert loaded.label.startswith("NOAA 19")
    assert (loaded.errors, loaded.warnings) == ([], [])


# A file that is being written


class Writer:
    """Stands where the module `time` stands: a wait takes no time, and half a second later the file is changed."""

    def __init__(self, act: Callable[[], object]) -> None:
        self._act, self._begun_s, self.waited_s = act, time.time(), 0.0

    def monotonic(self) -> float:
        return self.waited_s

    def time(self) -> float:
        return self._begun_s + self.waited_s

    def sleep(self, seconds: float) -> None:
        is_due = self.waited_s < 0.5 <= self.waited_s + seconds
        self.waited_s += seconds
        if is_due:
            self._act()


@pytest.fixture
def load_while(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[str, Callable[[], object]], LoadedElements]:
    """Loads a file that was written just now, while something happens to it half a second later."""

    def load_and_act(text: str, act: Callable[[], object]) -> LoadedElements:
        load(tmp_path, tle("ISS (ZARYA)"))
        (tmp_path / "lists" / "active.txt").write_text(text)
        section, _ = load_satellite(tmp_path, "sat", load_station(tmp_path))
        monkeypatch.setattr(elements_file, "time", Writer(act))
        return load_elements(section, tmp_path / "satellites" / "sat.toml", NOW)

    return load_and_act


@pytest.mark.parametrize("size", [0, 15, 90, len(ISS) - 3], ids=["empty", "name", "first line", "second line"])
def test_a_half_written_file_is_read_again_until_it_is_whole(tmp_path: Path, load_while, size: int) -> None:
    path = tmp_path / "lists" / "active.txt"
    loaded = load_while(ISS[:size], lambda: path.write_text(ISS))
    assert (loaded.label, loaded.errors, loaded.warnings) == ("ISS (ZARYA) (25544)", [], [])


def test_a_list_that_is_cut_between_two_satellites_is_read_again(tmp_path: Path, load_while) -> None:
    path = tmp_path / "lists" / "active.txt"
    assert load_while(JASON, lambda: path.write_text(JASON + ISS)).label == "ISS (ZARYA) (25544)"


def test_a_file_that_stays_half_is_refused_all_the_same(load_while) -> None:
    with pytest.raises(ElementsError):
        load_while(ISS[:90], lambda: None)


def test_a_half_file_that_nobody_writes_is_refused_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = Writer(lambda: None)
    monkeypatch.setattr(elements_file, "time", writer)
    refusal(tmp_path, tle("ISS"), ISS[:90])
    assert writer.waited_s == 0.0


@pytest.mark.parametrize(
    ("name", "is_warned"),
    [("ISS", False), ("iss-zarya", True), ("ISS (ZARYA)", False), ("NOAA-20", True), ("zarya", False)],
)
def test_the_only_satellite_of_a_file_is_warned_of_when_it_bears_another_name(
    tmp_path: Path, name: str, is_warned: bool
) -> None:
    warnings = load(tmp_path, tle(name)).warnings
    assert bool(warnings) is is_warned
    assert all("is it the right file" in warning for warning in warnings)
    assert load(tmp_path, tle(name, 25544)).warnings == []
    assert load(tmp_path, tle(name), ISS.split("\n", 1)[1]).warnings == []  # no name line, no doubt
