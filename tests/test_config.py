"""TOML files: what loads, every default, and every kind of mistake in an operator's words."""

import re
import tempfile
from pathlib import Path

import pytest
from config_files import BROUWER, STATION, replaced, write
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.config.load import load_satellite, load_station, satellite_names
from acu_daemon.config.problems import KINDS, in_words
from acu_daemon.config.to_settings import control_config, driver_of, estimator_settings
from acu_daemon.errors import ConfigError
from acu_daemon.orbit.timescales import tai_from_utc

ROOT = Path(__file__).resolve().parents[1]
SHIPPED = [
    (directory, name)
    for directory in (ROOT / "config", ROOT / "acu_daemon" / "cli" / "demo_config")
    for name in satellite_names(directory)
]
BYTE_9600_S = 10 / 9600


def complaint(directory: Path, satellite: str = "scd") -> str:
    """What loading says, with the directory's name as DIR."""
    with pytest.raises(ConfigError) as error:
        load_satellite(directory, satellite, load_station(directory))
    return str(error.value).replace(str(directory), "DIR")


@pytest.mark.parametrize(("directory", "name"), SHIPPED)
def test_every_file_that_is_shipped_loads(directory: Path, name: str) -> None:
    load_satellite(directory, name, load_station(directory))


def test_the_example_and_the_demo_are_shipped() -> None:
    assert {name for _, name in SHIPPED} >= {"scd-1", "demo-1"}


def test_every_default_is_the_one_of_the_design(tmp_path: Path) -> None:
    write(tmp_path)
    base = load_station(tmp_path)
    satellite, station = load_satellite(tmp_path, "scd", base)
    assert station == base
    assert station.station.min_elevation_deg == 5.0
    acu = station.acu
    assert (acu.dialect, acu.address, acu.period_s, acu.device_delay_s) == ("sa3842", "1", 0.1, 0.010)
    assert (station.receiver.beamwidth_deg, station.receiver.lock_dwell_s) == (1.0, 1.0)
    assert station.time.ut1_utc_s == 0.0
    readings = station.readings
    assert (readings.sigma_azimuth_deg, readings.sigma_elevation_deg) == (0.05, 0.05)
    assert (readings.bias_sigma_azimuth_deg, readings.bias_sigma_elevation_deg) == (0.1, 0.1)
    tracking = station.tracking
    assert (tracking.horizon_s, tracking.low_water_s, tracking.max_fit_elevation_deg) == (90.0, 30.0, 80.0)
    assert tracking.estimator == "full"
    assert station.safety.arm == "auto"
    assert satellite.satellite.norad_id is None
    assert (satellite.fallback.hold_s, satellite.fallback.search_s) == (1200.0, 120.0)
    assert (satellite.uncertainty.position_km, satellite.uncertainty.velocity_m_s) == (None, None)


@pytest.mark.parametrize(
    "key",
    [
        *("station.latitude_deg", "station.longitude_deg", "station.height_m", "acu.url"),
        *(f"acu.azimuth.{key}" for key in ("min_deg", "max_deg", "max_rate_deg_s", "max_acceleration_deg_s2")),
        *(f"acu.elevation.{key}" for key in ("min_deg", "max_deg", "max_rate_deg_s", "max_acceleration_deg_s2")),
    ],
)
def test_a_station_needs_its_position_the_acu_and_the_limits_of_its_axes(tmp_path: Path, key: str) -> None:
    table, _, last = key.rpartition(".")
    before, header, after = STATION.partition(f"[{table}]\n")
    removed = next(line for line in after.splitlines(keepends=True) if line.startswith(f"{last} ="))
    write(tmp_path, before + header + after.replace(removed, "", 1))
    assert complaint(tmp_path) == f"DIR/station.toml: {key} is missing; it has no default"


@pytest.mark.parametrize(
    "key",
    [
        *("name", "kind", "epoch_utc", "semi_major_axis_km", "eccentricity", "inclination_deg", "raan_deg"),
        *("arg_perigee_deg", "mean_anomaly_deg"),
    ],
)
def test_a_satellite_needs_its_name_and_elements(tmp_path: Path, key: str) -> None:
    lines = BROUWER.splitlines(keepends=True)
    write(tmp_path, scd="".join(line for line in lines if not line.startswith(f"{key} =")))
    table = "satellite" if key == "name" else "elements"
    assert complaint(tmp_path).startswith(f"DIR/satellites/scd.toml: {table}.{key} is missing")


AZIMUTH_MIN = "min_deg = -270.0"
LATITUDE = "latitude_deg = -15.53"
STATION_MISTAKES = [
    (
        LATITUDE,
        f"{LATITUDE}\nmin_elevation = 5",
        "station.min_elevation = 5: unknown key; did you mean min_elevation_deg?",
    ),
    (
        LATITUDE,
        f"{LATITUDE}\nbeamwidth_deg = 1",
        "station.beamwidth_deg = 1: unknown key; it belongs to [receiver] of sta",
    ),
    ("[station]", "[uncertainty]\n[station]", "uncertainty: unknown key; it belongs to the satellite's file"),
    ("[station]", "[reading]\n[station]", "reading: unknown key; did you mean readings?"),
    (LATITUDE, "lattitude_deg = -15.53", "station.latitude_deg is missing; it has no default"),
    (LATITUDE, f"{LATITUDE}\nlat = 1.5", "station.lat = 1.5: unknown key; is it misspelt, or in the wrong table?"),
    (LATITUDE, 'latitude_deg = "15 S"', 'station.latitude_deg = "15 S": expected a number'),
    (LATITUDE, "latitude_deg = true", "station.latitude_deg = true: expected a number"),
    (LATITUDE, "latitude_deg = [1]", "station.latitude_deg = [1]: expected a number"),
    (LATITUDE, "latitude_deg = 90.5", "station.latitude_deg = 90.5: expected at most 90"),
    (LATITUDE, "latitude_deg = nan", "station.latitude_deg = nan: expected a finite number"),
    (LATITUDE, "latitude_deg = -inf", "station.latitude_deg = -inf: expected a finite number"),
    (LATITUDE, "latitude_deg = 1e999", "station.latitude_deg = inf: expected a finite number"),
    (LATITUDE, f"latitude_deg = {'9' * 400}", f"station.latitude_deg = {'9' * 60}...: expected a number"),
    (LATITUDE, f'{LATITUDE}\nname = ""', 'station.name = "": expected a text that is not empty'),
    (LATITUDE, f"{LATITUDE}\nname = 5", "station.name = 5: expected text in quotes"),
    (AZIMUTH_MIN, "min_deg = 300.0", "acu.azimuth.min_deg = 300: expected less than max_deg = 270"),
    (AZIMUTH_MIN, "min_deg = -9999.0", "acu.azimuth.min_deg = -9999.0: expected at least -720"),
    ("max_deg = 90.0", "max_deg = 180.0", 'acu.elevation.max_deg = 180: dialect = "sa3842": its angles end before 180'),
    ("max_deg = 90.0", "max_deg = 270.0", "acu.elevation.max_deg = 270.0: expected at most 180"),
    ("max_rate_deg_s = 5.0", "max_rate_deg_s = 0", "acu.elevation.max_rate_deg_s = 0: expected more than 0"),
    ("[acu]", "[acu]\nperiod_s = 0.01", "acu.period_s = 0.01: expected at least 0.1"),
    ("[acu]", "[acu]\nperiod_s = 0.2", "acu.period_s = 0.2: expected at most 0.15"),
    ("[acu]", "[acu]\ndead_band_deg = 1.0", 'acu.dead_band_deg: dialect = "sa3842" has none'),
    (
        "[acu]",
        '[acu]\ndialect = "rotctl"\ndead_band_deg = 0.6',
        "acu.dead_band_deg = 0.6: expected at most half of safety.following_error_deg",
    ),
    ("[acu]", '[receiver]\nsignal = "acu"\n[acu]\ndialect = "rotctl"', 'receiver.signal = "acu": an ACU with dialect'),
    ("[acu]", '[acu]\ndialect = "x"', "acu.dialect = \"x\": expected 'sa3842'"),
    ("[acu]", "[acu]\naddress = 12", "acu.address = 12: '12' is not an ACU address, expected one character"),
    ("tcp://127.0.0.1:3842", "tcp://127.0.0.1", 'acu.url = "tcp://127.0.0.1": link'),
    ("tcp://127.0.0.1:3842", "com1", "acu.url = \"com1\": link 'com1' is not understood; expected tcp://HOST:PORT"),
    ("tcp://127.0.0.1:3842", "serial:///dev/x?baud=9", 'acu.url = "serial:///dev/x?baud=9": link'),
    ("[acu.azimuth]", "[acu.az]", "acu.azimuth is missing; it has no default"),
    ("[station]", "[statoin]", "station is missing; it has no default"),
    ("[station]", "[[station]]", "station = [{'latitude_deg': -15.53"),
    ("[station]", "[tracking]\nestimator = 'best'\n[station]", "tracking.estimator = \"best\": expected 'circular',"),
    ("[station]", "[tracking]\nlow_water_s = 95.0\n[station]", "tracking.low_water_s = 95: expected less than horizon"),
    (
        "[station]",
        "[tracking]\nlow_water_s = 3.9\n[station]",
        "tracking.low_water_s = 3.9: expected at least 4, of",
    ),
    ("[station]", "[safety]\narm = true\n[station]", "safety.arm = true: expected 'auto' or 'manual'"),
    (
        "[station]",
        "[safety]\nregister_watchdog_s = 1\n[station]",
        "safety.register_watchdog_s = 1: expected 0 (off) or at least 2",
    ),
    (
        "[station]",
        "[safety]\nfollowing_error_s = 0.1\n[station]",
        "safety.following_error_s = 0.1: expected 0 (off) or at least",
    ),
    ("[station]", "[time]\nut1_utc_s = -1.5\n[station]", "time.ut1_utc_s = -1.5: expected at least -1"),
    (
        "[station]",
        '[time]\nearth_orientation = "eop"\nut1_utc_s = 0.1\n[station]',
        "time.earth_orientation = 'eop' and ut1_utc_s: expected the file or the numbers, not both",
    ),
    (
        "[station]",
        "[atmosphere]\npressure_hpa = 700.0\n[station]",
        "atmosphere.pressure_hpa = 700: at 277 m about 982 hPa are usual; expected the pressure at the antenna",
    ),
    (
        "[station]",
        "[atmosphere]\ntemperature_c = 42.0\nhumidity_percent = 95.0\n[station]",
        "atmosphere: air of 42 deg C, 95 % humidity and 982 hPa has a refractivity of 536, expected at most 450",
    ),
    ("[station]", "[atmosphere]\nrefraction = 1\n[station]", "atmosphere.refraction = 1: expected true or false"),
    (
        "[station]",
        "[mount]\nca_deg = 0.2\nan_deg = -0.2\n[station]",
        "mount.ca_deg, npae_deg, an_deg and aw_deg are 0.4 in sum: expected at most 0.3",
    ),
    ("[station]", "[mount]\nia_sigma_deg = -1\n[station]", "mount.ia_sigma_deg = -1: expected at least 0"),
    ("[station]", "[mount]\nia_degs = 0.1\n[station]", "mount.ia_degs = 0.1: unknown key; did you mean ia_deg?"),
    ("[station]", "[receiver]\nbeamwidth_deg = 0\n[station]", "receiver.beamwidth_deg = 0: expected more than 0"),
    ("[station]", "[station", "not TOML: Expected ']' at the end of a table declaration (at line 2, column 9)"),
    (LATITUDE, f"latitude_deg = {'9' * 5000}", "not TOML: Exceeds the limit"),
]


@pytest.mark.parametrize(("old", "new", "said"), STATION_MISTAKES)
def test_a_mistake_in_the_stations_file_is_told_with_file_key_value_and_what_was_expected(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    write(tmp_path, replaced(STATION, old, new))
    assert complaint(tmp_path).startswith(f"DIR/station.toml: {said}")


EPOCH = "epoch_utc = 1989-01-31T09:58:00Z"
SATELLITE_MISTAKES = [
    (EPOCH, EPOCH[:-1], "elements.epoch_utc = 1989-01-31T09:58:00: expected a time that ends in Z (UTC)"),
    (EPOCH, "epoch_utc = 1989-01-31", "elements.epoch_utc = 1989-01-31: expected a time like 1989-01-31T09:58:00Z"),
    (EPOCH, "epoch_utc = 09:58:00", "elements.epoch_utc = 09:58:00: expected a time like 1989-01-31T09:58:00Z"),
    (EPOCH, "epoch_utc = 1989.1", "elements.epoch_utc = 1989.1: expected a time like 1989-01-31T09:58:00Z"),
    (EPOCH, 'epoch_utc = "1989"', 'elements.epoch_utc = "1989": expected UTC as YYYY-MM-DDThh:mm:ss[.fff]Z'),
    (EPOCH, "epoch_utc = 1989-02-30T00:00:00Z", "not TOML: Invalid date or datetime (at line 6, column 13)"),
    ("eccentricity = 0.0436", "eccentricity = 1.0", "elements.eccentricity = 1.0: expected less than 1"),
    ("7180.0", "nan", "elements.semi_major_axis_km = nan: expected a finite number"),
    ("7180.0", "7e120", "elements.semi_major_axis_km = 7e+120: expected at most 1e+06"),
    (
        'kind = "brouwer"',
        'kind = "sgp4"',
        'elements.kind = "sgp4": expected one of tle, omm, oem, cpf, sp3, station, brouwer',
    ),
    ('kind = "brouwer"', "kind = 4", f'elements.kind = "4": expected one of {", ".join(KINDS)}'),
    ('kind = "brouwer"', 'kind = "tle"', "elements.file is missing; it has no default"),
    ('kind = "brouwer"', 'kind = "brouwer"\ntle = 1', "elements.tle = 1: unknown key"),
    ("[elements]", "[element]", "elements is missing; it has no default"),
    ('name = "SCD-1"', 'name = ""', 'satellite.name = "": expected a text that is not empty'),
    ('name = "SCD-1"', 'name = "S"\nnorad_id = "22490"', 'satellite.norad_id = "22490": expected a whole number'),
    ('name = "SCD-1"', 'name = "S"\nnorad_id = 0', "satellite.norad_id = 0: expected at least 1"),
]


@pytest.mark.parametrize(("old", "new", "said"), SATELLITE_MISTAKES)
def test_a_mistake_in_a_satellites_file_is_told_alike(tmp_path: Path, old: str, new: str, said: str) -> None:
    write(tmp_path, scd=replaced(BROUWER, old, new))
    assert complaint(tmp_path).startswith(f"DIR/satellites/scd.toml: {said}")


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("[uncertainty]\nposition_km = 0", "uncertainty.position_km = 0: expected more than 0"),
        ("[uncertainty]\nposition_km = 1000", "uncertainty.position_km = 1000: expected at most 300"),
        ("[uncertainty]\nvelocity_m_s = 1000", "uncertainty.velocity_m_s = 1000: expected at most 300"),
        ("[fallback]\nhold = 3", "fallback.hold = 3: unknown key"),
        (
            "[elements.limits]\nmin_semi_major_axis_km = 42000",
            "elements.limits.min_semi_major_axis_km = 42000: expected less than max_semi_major_axis_km = 8500",
        ),
        ("[elements.limits]\nmax_eccentricity = 1", "elements.limits.max_eccentricity = 1: expected less than 1"),
        ("[station]\nheight_m = 1", "station: unknown key; it belongs to station.toml"),
        (
            "[readings]\nuncertainty_m = 1",
            "readings.uncertainty_m = 1: unknown key; it belongs to [station] of station.toml",
        ),
        ('[tracking]\nestimater = "full"', 'tracking.estimater = "full": unknown key; did you mean estimator?'),
        ("[tracking]\nlow_water_s = 90", "tracking.low_water_s = 90: expected less than horizon_s = 90"),
        ("[readings]\nsigma_azimuth_deg = inf", "readings.sigma_azimuth_deg = inf: expected a finite number"),
        ('[receiver]\nbeamwidth_deg = "1"', 'receiver.beamwidth_deg = "1": expected a number'),
    ],
)
def test_a_mistake_in_a_table_of_a_satellite_or_in_an_override_is_told_alike(
    tmp_path: Path, table: str, said: str
) -> None:
    write(tmp_path, scd=f"{BROUWER}{table}\n")
    assert complaint(tmp_path).startswith(f"DIR/satellites/scd.toml: {said}")


def test_a_number_in_place_of_an_overriding_table_is_told(tmp_path: Path) -> None:
    write(tmp_path, scd=f"receiver = 3\n{BROUWER}")
    assert complaint(tmp_path) == "DIR/satellites/scd.toml: receiver = 3: expected a table"


def test_every_mistake_has_a_line_of_its_own(tmp_path: Path) -> None:
    text = replaced(replaced(STATION, "[acu]", "[acu]\nport = 1"), LATITUDE, "latitude_deg = 100")
    lines = complaint(write(tmp_path, text)).splitlines()
    assert len(lines) == 2
    assert all(line.startswith("DIR/station.toml: ") for line in lines)


def test_a_satellite_overrides_any_key_of_tracking_readings_and_receiver(tmp_path: Path) -> None:
    override = "[tracking]\nhorizon_s = 60\n[readings]\nsigma_elevation_deg = 0.01\n[receiver]\nlock_dwell_s = 3"
    write(tmp_path, f"{STATION}[tracking]\nlow_water_s = 20.0\n", scd=f"{BROUWER}{override}\n")
    base = load_station(tmp_path)
    _, station = load_satellite(tmp_path, "scd", base)
    assert (station.tracking.horizon_s, station.tracking.low_water_s) == (60.0, 20.0)
    assert (station.readings.sigma_azimuth_deg, station.readings.sigma_elevation_deg) == (0.05, 0.01)
    assert station.receiver.lock_dwell_s == 3.0
    assert base.receiver.lock_dwell_s == 1.0


def test_a_satellite_that_is_not_there_is_told_with_those_that_are(tmp_path: Path) -> None:
    write(tmp_path, one=BROUWER, two=BROUWER)
    (tmp_path / "satellites" / ".#two.toml").write_text("an editor's lock")
    assert complaint(tmp_path, "three") == "DIR/satellites/three.toml: no such file; satellites in DIR: one, two"


def test_a_directory_without_files_is_told(tmp_path: Path) -> None:
    assert complaint(tmp_path).startswith("DIR/station.toml: no such file; it must hold")


def test_a_directory_in_place_of_a_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "station.toml").mkdir()
    assert complaint(tmp_path) == "DIR/station.toml: cannot be read: Is a directory"
    write(tmp_path / "other")
    (tmp_path / "other" / "satellites" / "dir.toml").mkdir()
    assert complaint(tmp_path / "other", "dir") == "DIR/satellites/dir.toml: cannot be read: Is a directory"


def test_a_file_in_place_of_the_directory_is_told(tmp_path: Path) -> None:
    file = tmp_path / "config"
    file.write_text(STATION)
    assert complaint(file) == "DIR/station.toml: cannot be read: Not a directory"


def test_a_file_that_is_not_utf_8_is_told(tmp_path: Path) -> None:
    text = f"{STATION}# São José dos Campos"
    assert complaint(write(tmp_path, text.encode("latin-1"))) == (
        f"DIR/station.toml: byte {len(STATION) + 3}: expected UTF-8 text; save the file in that encoding"
    )
    assert "expected UTF-8 text" in complaint(write(tmp_path, STATION.encode("utf-16")))


@pytest.mark.parametrize("text", [STATION.replace("\n", "\r\n").encode(), STATION.encode("utf-8-sig")])
def test_windows_line_ends_and_a_byte_order_mark_do_not_matter(tmp_path: Path, text: bytes) -> None:
    write(tmp_path / "plain")
    assert load_station(write(tmp_path, text)) == load_station(tmp_path / "plain")


def test_an_epoch_may_be_a_text_and_lie_in_a_leap_second(tmp_path: Path) -> None:
    text = replaced(BROUWER, EPOCH, 'epoch_utc = "2016-12-31T23:59:60.5Z"')
    satellite, _ = load_satellite(write(tmp_path, scd=text), "scd", load_station(tmp_path))
    assert satellite.elements.epoch_utc == tai_from_utc("2016-12-31T23:59:60.5Z")  # type: ignore[union-attr]


def test_an_epoch_with_another_offset_is_turned_into_utc(tmp_path: Path) -> None:
    text = replaced(BROUWER, EPOCH, "epoch_utc = 1989-01-31T07:58:00.25-02:00")
    satellite, _ = load_satellite(write(tmp_path, scd=text), "scd", load_station(tmp_path))
    assert satellite.elements.epoch_utc == tai_from_utc("1989-01-31T09:58:00.25Z")  # type: ignore[union-attr]


@given(st.binary(max_size=200))
def test_whatever_a_file_holds_the_answer_is_a_configuration_error(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as directory, pytest.raises(ConfigError, match=r"station\.toml: "):
        load_station(write(Path(directory), data))


def test_an_error_without_words_of_ours_keeps_the_checkers_own() -> None:
    item = {"type": "new_kind", "loc": ("a", "b"), "input": 1, "msg": "Input should be green"}
    assert in_words(item) == "a.b = 1: Input should be green"


def test_the_delays_of_a_tick_follow_the_arithmetic_of_the_icd(tmp_path: Path) -> None:
    write(tmp_path)
    satellite, station = load_satellite(tmp_path, "scd", load_station(tmp_path))
    over_tcp = control_config(station, satellite, driver_of(station), 0.0)
    assert (over_tcp.sample_delay_s, over_tcp.poll_sample_delay_s) == (0.010, 0.010)
    assert over_tcp.effect_delay_s == pytest.approx(0.020)
    serial = control_config(station, satellite, driver_of(station), BYTE_9600_S)
    assert serial.sample_delay_s == pytest.approx(17 * BYTE_9600_S + 0.010)
    assert serial.poll_sample_delay_s == pytest.approx(5 * BYTE_9600_S + 0.010)
    assert serial.effect_delay_s - serial.sample_delay_s == pytest.approx(0.010)


def test_the_rooms_get_what_the_files_say(tmp_path: Path) -> None:
    more = '[safety]\narm = "manual"\n[tracking]\nmax_fit_elevation_deg = 70\n[readings]\nsigma_azimuth_deg = 0.02\n'
    write(tmp_path, STATION + more, scd=f"{BROUWER}[fallback]\nhold_s = 7\nsearch_s = 8\nacquire_s = 9\n")
    satellite, station = load_satellite(tmp_path, "scd", load_station(tmp_path))
    control = control_config(station, satellite, driver_of(station), 0.0)
    assert not control.is_armed
    assert (control.hold_s, control.search_s, control.acquire_s) == (7, 8, 9)
    assert (control.azimuth.min_deg, control.elevation.max_rate_deg_s) == (-270.0, 5.0)
    settings = estimator_settings(station, satellite)
    assert (settings.max_fit_elevation_deg, settings.sigma_azimuth_deg) == (70, 0.02)
    assert settings.azimuth == control.azimuth
    assert (station.site.station.latitude_deg, station.site.station.height_m) == (-15.53, 277.0)


def test_the_envelope_gets_what_the_files_say(tmp_path: Path) -> None:
    (tmp_path / "hills.csv").write_text("az_deg,el_deg\n# from a panorama\n0, 5\n90, 12.5\n\n180, 3\n")
    more = (
        '[envelope]\nmask = "hills.csv"\nsun_policy = "avoid"\nsun_keep_out_deg = 3\n'
        '[[envelope.keep_out]]\nname = "the mast"\naz_from_deg = 350\naz_to_deg = 10\nel_to_deg = 20\n'
        "[mount]\nia_deg = 1.5\n"
    )
    write(tmp_path, STATION + more, scd=BROUWER)
    satellite, station = load_satellite(tmp_path, "scd", load_station(tmp_path))
    envelope = control_config(station, satellite, driver_of(station), 0.0).envelope
    assert envelope.skyline == station.site.skyline
    assert envelope.skyline is not None
    assert envelope.skyline.height_deg(45.0) == pytest.approx(8.75)
    assert envelope.why_not(1.5, 10.0, 8e8) == "within the keep-out of the mast"
    assert envelope.why_not(-9.0 + 1.5, 10.0, 8e8) == "within the keep-out of the mast"
    assert envelope.why_not(12.0, 10.0, 8e8) == ""
    assert envelope.sun is not None
    assert (envelope.sun.radius_deg, envelope.sun.policy) == (3.0, "avoid")
    assert envelope.mount is not None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mask = 5", "envelope.mask = 5: expected a CSV file beside station.toml"),
        ("mask = [[0, 5], [0, 6]]", "azimuth 0 has two elevations"),
        ('mask = "none.csv"', "none.csv: cannot be read: No such file or directory; it is [envelope] mask"),
        ('mask = "bad.csv"', "bad.csv, line 2: '90 12': expected az_deg,el_deg"),
        ("stow_az_deg = 5", "expected stow_az_deg and stow_el_deg both, or neither"),
        ('sun_policy = "ignore"', "envelope.sun_policy = \"ignore\": expected 'avoid', 'warn' or 'off'"),
    ],
)
def test_what_is_wrong_with_the_envelope_is_said_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "bad.csv").write_text("0,5\n90 12\n")
    write(tmp_path, f"{STATION}[envelope]\n{text}\n")
    with pytest.raises(ConfigError, match=re.escape(said)):
        load_station(tmp_path)
