"""An ephemeris as the elements of a satellite: loading, and the commands on it."""

import csv
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import Done, acu_daemon
from config_files import STATION, from_file, write
from flights import events_named, flight_of, state_at, worst_error_deg
from made_oems import START, iss, kvn, states, xml
from real_passes import sky_angles_deg

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.config.station_tables import StationFile
from acu_daemon.edge.elements_file import LoadedElements, load_elements
from acu_daemon.errors import ElementsError, UsageError
from acu_daemon.model import EarthOrientation, Pass
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.units import DAY_S

HOUR_S = 3600.0
SITE = StationFile.model_validate(tomllib.loads(STATION)).site
SATELLITE = from_file("ISS", "oem", "iss.oem")


def make(directory: Path, text: str, satellite: str = SATELLITE, station: str = STATION) -> Path:
    write(directory, station, iss=satellite)
    (directory / "satellites" / "iss.oem").write_text(text)
    return directory


def load(directory: Path, text: str, now_tai_s: float = START + 60.0, satellite: str = SATELLITE) -> LoadedElements:
    make(directory, text, satellite)
    section, _ = load_satellite(directory, "iss", load_station(directory))
    return load_elements(section, directory / "satellites" / "iss.toml", now_tai_s)


def refusal(directory: Path, text: str, satellite: str = SATELLITE) -> str:
    with pytest.raises(ElementsError) as error:
        load(directory, text, satellite=satellite)
    return str(error.value).replace(str(directory), "DIR")


def first_high_pass() -> Pass:
    return next(one for one in find_passes(iss(), SITE, START + 600.0, START + DAY_S, 5.0) if one.duration_s > 400.0)


@pytest.mark.parametrize("form", [kvn, xml])
def test_an_ephemeris_is_the_source(tmp_path: Path, form) -> None:
    loaded = load(tmp_path, form(states()))
    assert (loaded.label, loaded.propagator.kind, loaded.epoch_tai_s) == ("ISS (1998-067-A)", "oem", START)
    assert (loaded.errors, loaded.warnings) == ([], [])


@pytest.mark.parametrize("away_s", [-100.0, 7300.0])
def test_a_present_outside_the_span_is_an_error_that_names_it(tmp_path: Path, away_s: float) -> None:
    [error] = load(tmp_path, kvn(states()), START + away_s).errors
    assert error.startswith(f"{tmp_path}/satellites/iss.oem: ISS (1998-067-A): the ephemeris covers ")
    assert "2022-02-11T20:00:00Z to 2022-02-11T22:00:00Z, which 2022-02-11T" in error


@pytest.mark.parametrize("chosen", ["OTHER", "ISS"])
def test_of_several_objects_the_one_that_the_file_of_the_satellite_names_is_taken(tmp_path: Path, chosen: str) -> None:
    both = kvn(states(600.0), OBJECT_NAME="OTHER", OBJECT_ID="2020-001-A") + kvn(states())
    text = SATELLITE.replace("[elements]\n", f'[elements]\nobject = "{chosen}"\n')
    assert text != SATELLITE
    loaded = load(tmp_path, both, satellite=text)
    assert loaded.label.startswith(f"{chosen} (")


def test_limits_hold_for_ephemerides_too(tmp_path: Path) -> None:
    narrow = SATELLITE + "[elements.limits]\nmax_inclination_deg = 40.0\n"
    [error] = load(tmp_path, kvn(states()), satellite=narrow).errors
    assert "inclination 51.6" in error


def test_a_bad_file_is_refused_with_the_line_and_a_bad_segment_warned_of(tmp_path: Path) -> None:
    assert refusal(tmp_path, kvn(states(), REF_FRAME="MOD")).startswith(
        "DIR/satellites/iss.oem, line 6: REF_FRAME is 'MOD'; TEME, TOD"
    )
    assert refusal(tmp_path, "").endswith("iss.oem: the file is empty")
    assert refusal(tmp_path, kvn(states()), from_file("ISS", "oem", "x.oem")).endswith("No such file or directory")
    half = kvn(states(600.0), states(600.0, start_tai_s=START + 900.0)).replace("T20:16:00.000000", "T20:16:00.0x")
    loaded = load(tmp_path, half)
    assert loaded.errors == []
    assert "is not a time" in loaded.warnings[0]


def test_of_several_satellites_the_name_chooses(tmp_path: Path) -> None:
    both = kvn(states(600.0), OBJECT_NAME="OTHER", OBJECT_ID="25544") + kvn(states())
    assert load(tmp_path, both).label == "ISS (1998-067-A)"
    assert load(tmp_path, both, satellite=from_file("x", "oem", "iss.oem", 25544)).label == "OTHER (25544)"
    assert refusal(tmp_path, both, from_file("MIR", "oem", "iss.oem")) == (
        "DIR/satellites/iss.oem: no segment with name 'MIR'; the file holds OTHER (25544), ISS (1998-067-A): "
        "write one's name or designator as the satellite's name"
    )
    twice = kvn(states(600.0), OBJECT_ID="1") + kvn(states())
    assert "fits ISS (1), ISS (1998-067-A); write one's designator as" in refusal(tmp_path, twice)
    assert load(tmp_path, twice, satellite=from_file("1998-067A", "oem", "iss.oem")).label == "ISS (1998-067-A)"
    damaged = kvn(states(600.0), OBJECT_NAME="OTHER") + kvn(states()).replace("T20:16:00.000000", "x")
    assert "no segment with name 'ISS'" in refusal(tmp_path, damaged)


def test_a_catalogue_number_chooses_only_where_the_file_has_them(tmp_path: Path) -> None:
    designated, numbered = kvn(states()), kvn(states(), OBJECT_ID="25544")
    own = from_file("Station", "oem", "iss.oem", 25544)
    assert load(tmp_path, designated, satellite=own).label == "ISS (1998-067-A)"
    assert load(tmp_path, numbered, satellite=own).label == "ISS (25544)"
    other = refusal(tmp_path, numbered, from_file("ISS", "oem", "iss.oem", 48274))
    assert "no segment with name 'ISS' or with norad_id 48274; the file holds ISS (25544)" in other
    both = designated + kvn(states(), OBJECT_NAME="OTHER", OBJECT_ID="2020-001A")
    assert "no segment with name 'Station' or with norad_id 25544; the file holds ISS (1998-067-A), OTHER" in refusal(
        tmp_path, both, own
    )


@pytest.mark.parametrize(
    ("name", "norad_id", "is_doubted"),
    [
        *(("ISS", 25544, False), ("iss-", None, False), ("ISS (ZARYA)", 25544, False), ("1998-067A", None, False)),
        *(("JASON 2", 33105, True), ("JASON 2", None, True)),
    ],
)
def test_a_file_of_one_satellite_with_another_name_is_doubted(
    tmp_path: Path, name: str, norad_id: int | None, is_doubted: bool
) -> None:
    loaded = load(tmp_path, kvn(states()), satellite=from_file(name, "oem", "iss.oem", norad_id))
    assert loaded.errors == []
    said = [f"{tmp_path}/satellites/iss.oem: the file is of ISS (1998-067-A), the satellite is named {name!r}: "]
    assert [text.removesuffix("is it the right file?") for text in loaded.warnings] == (said if is_doubted else [])


@pytest.mark.parametrize(
    ("form", "old", "new", "said"),
    [
        (kvn, "VERS = 2.0", "VERS = 9.0", "CCSDS_OEM_VERS is '9.0'; versions 1.0, 2.0, 3.0 are known"),
        (kvn, "CCSDS_OEM_VERS = 2.0\n", "", "CCSDS_OEM_VERS is missing; versions 1.0, 2.0, 3.0 are known"),
        (xml, " version='2.0'>", " version='9.0'>", "CCSDS_OEM_VERS is '9.0'"),
        (xml, " version='2.0'>", ">", "CCSDS_OEM_VERS is missing"),
    ],
)
def test_a_version_that_is_not_known_is_warned_of(tmp_path: Path, form, old: str, new: str, said: str) -> None:
    [warning] = load(tmp_path, form(states()).replace(old, new)).warnings
    assert warning.startswith(f"{tmp_path}/satellites/iss.oem: {said}")


def test_the_stations_earth_orientation_reaches_an_earth_fixed_ephemeris(tmp_path: Path) -> None:
    tai_s, r_m, v_m_s = states()
    turned = EarthOrientation(0.4)
    text = kvn((tai_s, *itrs_from_teme(r_m, v_m_s, tai_s, turned)), REF_FRAME="ITRF2020")
    make(tmp_path, text, station=STATION + "[time]\nut1_utc_s = 0.4\n")
    propagator = load_target(tmp_path, "iss", START).elements.propagator
    assert np.abs(propagator.states_teme(tai_s)[0] - r_m).max() < 1e-3


def passes(config: Path, *more: object) -> Done:
    return acu_daemon("passes", "--config", config, "--satellite", "iss", "--json", *more)


def test_passes_are_those_of_the_orbit_and_the_end_of_the_ephemeris_is_told(tmp_path: Path) -> None:
    config = make(tmp_path, kvn(states(0.8 * DAY_S)))
    done = passes(config, "--from", utc_text(START, 0))
    wanted = find_passes(iss(), SITE, START, START + 0.8 * DAY_S, 5.0)
    assert done.code == 0
    assert [one["rise_utc"][:22] for one in json.loads(done.out)] == [utc_text(one.rise_tai_s)[:22] for one in wanted]
    assert "warning: iss: the ephemeris ends at 2022-02-12T15:12:00Z, no pass is looked for after that" in done.err


def test_passes_before_or_after_the_ephemeris_are_none_and_the_reason_is_told(tmp_path: Path) -> None:
    config = make(tmp_path, kvn(states()))
    done = passes(config, "--from", utc_text(START + DAY_S, 0))
    assert (done.code, json.loads(done.out)) == (0, [])
    assert "the ephemeris covers 2022-02-11T20:00:00Z to 2022-02-11T22:00:00Z" in done.err


def test_a_pass_that_the_ephemeris_cuts_is_told_and_so_is_a_gap(tmp_path: Path) -> None:
    one = first_high_pass()
    early, late = one.rise_tai_s + 100.0, one.rise_tai_s + 250.0
    before = states(60.0 * np.floor((early - START) / 60.0))
    after = states(7200.0, start_tai_s=START + 60.0 * np.ceil((late - START) / 60.0))
    done = passes(make(tmp_path, kvn(before, after)), "--from", utc_text(START, 0))
    end, begin = utc_text(before[0][-1], 0), utc_text(after[0][0], 0)
    rise, setting = utc_text(one.rise_tai_s, 0), utc_text(one.set_tai_s, 0)
    assert f"warning: iss: the ephemeris has a gap from {end} to {begin}, no pass is looked for in it" in done.err
    assert f"warning: iss: the pass from {rise} to {end} is cut: the ephemeris ends within it" in done.err
    assert f"warning: iss: the pass from {begin} to {setting} is cut: the ephemeris begins within it" in done.err
    assert done.err.count(" is cut: ") == 2


def coming_of(directory: Path, start_tai_s: float, end_tai_s: float, now_tai_s: float) -> Pass:
    """The coming pass over the station with an ephemeris of a state a minute."""
    make(directory, kvn(states(end_tai_s - start_tai_s, start_tai_s=start_tai_s)))
    return coming_pass(load_target(directory, "iss", now_tai_s), now_tai_s)


def test_the_coming_pass_must_be_covered_from_its_preparation_to_its_last_buffer(tmp_path: Path) -> None:
    one = first_high_pass()
    rise, end, now = one.rise_tai_s, one.set_tai_s, one.rise_tai_s - 300.0
    assert coming_of(tmp_path, rise - 330.0, end + 300.0, now).rise_tai_s == pytest.approx(rise, abs=0.01)
    assert coming_of(tmp_path, rise + 9.0, end + 300.0, rise + 100.0).set_tai_s == pytest.approx(end, abs=0.01)
    for start_tai_s, end_tai_s, now_tai_s in (
        (rise - 330.0, end + 30.0, now),
        (rise - 100.0, end + 300.0, rise - 99.0),
        (rise + 9.0, end + 300.0, rise + 40.0),
    ):
        with pytest.raises(UsageError, match=r"needs an ephemeris from .* fetch a longer one"):
            coming_of(tmp_path, start_tai_s, end_tai_s, now_tai_s)
    with pytest.raises(UsageError, match=r"within 3 days of .*; the ephemeris ends at"):
        coming_of(tmp_path, rise - 900.0, rise - 300.0, rise - 600.0)


def test_check_says_no_go_where_the_next_pass_is_not_covered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = first_high_pass()
    now = one.rise_tai_s - 300.0
    monkeypatch.setattr("acu_daemon.edge.clock.SystemClock.tai_s", lambda _: now)
    for spare_s, verdict in ((300.0, "GO    "), (10.0, "NO-GO ")):
        minutes = np.ceil((one.set_tai_s + spare_s - now + 60.0) / 60.0)
        make(tmp_path, kvn(states(60.0 * minutes - (0.0 if spare_s > 60.0 else 60.0), start_tai_s=now - 60.0)))
        lines = acu_daemon("check", "--config", tmp_path, "--satellite", "iss").out.splitlines()
        [line] = [line for line in lines if "iss: next pass" in line]
        assert line.startswith(verdict), lines


@pytest.mark.long
@pytest.mark.parametrize("estimator", ["kalman", "full"])
def test_replay_finds_the_satellite_of_an_ephemeris_that_runs_late(tmp_path: Path, estimator: str) -> None:
    one = first_high_pass()
    tai_s, r_m, v_m_s = states(one.set_tai_s + 300.0 - START)
    make(tmp_path, kvn((tai_s + 3.0, r_m, v_m_s)))
    times = np.arange(np.ceil(one.rise_tai_s), one.set_tai_s, 2.0)
    sky = encoder_look(iss(), times, SITE, None)
    half = times.size // 2
    rng = np.random.default_rng(4)
    rows = ["utc,az_deg,el_deg,locked"]
    for count, (time, az, el) in enumerate(zip(times.tolist(), sky.az_deg, sky.el_deg, strict=True)):
        noisy = f"{(az + 0.03 / np.cos(np.radians(el)) * rng.normal()) % 360.0:.4f},{el + 0.03 * rng.normal():.4f}"
        rows.append(f"{utc_text(time)},{noisy if count < half else ','},{int(count < half)}")
    (tmp_path / "in.csv").write_text("\n".join(rows) + "\n")
    files = ("--readings", tmp_path / "in.csv", "--out", tmp_path / "out.csv", "--estimator", estimator)
    done = acu_daemon("replay", "--config", tmp_path, "--satellite", "iss", *files)
    assert done.code == 0, done.err
    with (tmp_path / "out.csv").open() as file:
        found = np.array([(float(row["az_deg"]), float(row["el_deg"])) for row in csv.DictReader(file)])
    off_deg = sky_angles_deg(found[:, 0], found[:, 1], sky.az_deg, sky.el_deg)
    assert off_deg[0] > 0.2
    assert off_deg[half:].max() < 0.04


def test_replay_of_a_recording_outside_the_ephemeris_is_refused(tmp_path: Path) -> None:
    make(tmp_path, kvn(states()))
    (tmp_path / "in.csv").write_text(f"utc,az_deg,el_deg,locked\n{utc_text(START - 60.0)},10.0,20.0,1\n")
    done = acu_daemon(
        *("replay", "--config", tmp_path, "--satellite", "iss"),
        *("--readings", tmp_path / "in.csv", "--out", tmp_path / "out.csv"),
    )
    assert done.code == 2
    assert "the ephemeris covers 2022-02-11T20:00:00Z to" in done.err


def test_replay_of_a_recording_that_outlasts_the_ephemeris_is_refused_before_it_begins(tmp_path: Path) -> None:
    make(tmp_path, kvn(states()))
    rows = [f"{utc_text(START + after_s)},10.0,20.0,1\n" for after_s in (600.0, 7190.0)]
    (tmp_path / "in.csv").write_text("".join(["utc,az_deg,el_deg,locked\n", *rows]))
    done = acu_daemon(
        *("replay", "--config", tmp_path, "--satellite", "iss"),
        *("--readings", tmp_path / "in.csv", "--out", tmp_path / "out.csv"),
    )
    assert done.code == 2
    assert "in.csv needs an ephemeris from 2022-02-11T20:" in done.err
    assert "to 2022-02-11T22:00:22Z; this one covers 2022-02-11T20:00:00Z to" in done.err


@pytest.mark.long
def test_the_daemon_stays_on_a_satellite_that_runs_off_its_ephemeris_through_a_loss(tmp_path: Path) -> None:
    one = first_high_pass()
    begin = one.rise_tai_s + 60.0
    make(tmp_path, kvn(states(one.set_tai_s + 300.0 - START)))
    target = load_target(tmp_path, "iss", begin)
    look = look_at(iss(), np.array([begin]), SITE)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    flight = flight_of(target, begin, 60.0, antenna=antenna, losses=[(30.0, 55.0)])
    assert state_at(flight, begin + 50.0) == "HOLD/FITTED"
    assert events_named(flight, "fit.failed") == []
    assert worst_error_deg(flight, begin + 31.0, begin + 55.0) < 0.1
