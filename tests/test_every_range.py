"""Both ends of every range, by values: what lies on them is taken, the next number beyond is not."""

import tomllib
from dataclasses import replace
from math import inf, nextafter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from config_files import BROUWER, STATION, write
from test_omm import FIELDS, csv_list, json_list, kvn, xml
from test_tle import ONE, TWO, edited, parse

from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.errors import ConfigError
from acu_daemon.orbit.brouwer import BrouwerElements
from acu_daemon.orbit.elements import ElementLimits, check_brouwer
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, DEG

IN, OUT = True, False
STATION_RANGES: list[tuple[str, float, bool, float, bool]] = [  # key, low end, whether it is in, high end, likewise
    ("station.latitude_deg", -90, IN, 90, IN),
    ("station.longitude_deg", -180, IN, 360, IN),
    ("station.height_m", -500, IN, 9000, IN),
    ("station.min_elevation_deg", 0, IN, 90, OUT),
    ("station.uncertainty_m", 0, IN, inf, OUT),
    ("acu.azimuth.min_deg", -720, IN, 270, OUT),
    ("acu.azimuth.max_deg", -270, OUT, 720, IN),
    ("acu.azimuth.max_rate_deg_s", 0, OUT, 90, IN),
    ("acu.azimuth.max_acceleration_deg_s2", 0, OUT, 360, IN),
    ("acu.elevation.min_deg", -90, IN, 90, OUT),
    ("acu.elevation.max_deg", 0, OUT, 179.99, IN),
    ("acu.elevation.max_rate_deg_s", 0, OUT, 90, IN),
    ("acu.elevation.max_acceleration_deg_s2", 0, OUT, 360, IN),
    ("acu.period_s", 0.1, IN, 0.15, IN),
    ("acu.device_delay_s", 0, IN, 0.1, IN),
    ("receiver.beamwidth_deg", 0, OUT, 30, IN),
    ("receiver.lock_dwell_s", 0, IN, 60, IN),
    ("time.ut1_utc_s", -1, IN, 1, IN),
    ("time.polar_motion_x_arcsec", -2, IN, 2, IN),
    ("time.polar_motion_y_arcsec", -2, IN, 2, IN),
    ("readings.sigma_azimuth_deg", 0, OUT, inf, OUT),
    ("readings.sigma_elevation_deg", 0, OUT, inf, OUT),
    ("readings.bias_sigma_azimuth_deg", 0, IN, inf, OUT),
    ("readings.bias_sigma_elevation_deg", 0, IN, inf, OUT),
    ("readings.bias_sigma_azimuth_sec_deg", 0, IN, inf, OUT),
    ("readings.bias_sigma_elevation_cot_deg", 0, IN, inf, OUT),
    ("tracking.horizon_s", 30, OUT, 600, IN),
    ("tracking.low_water_s", 4, IN, 90, OUT),
    ("tracking.max_fit_elevation_deg", 0, OUT, 90, IN),
    ("tracking.preposition_s", 10, IN, 3600, IN),
    ("tracking.search_along_s", 0, OUT, inf, OUT),
    ("tracking.search_across_deg", 0, OUT, inf, OUT),
    ("safety.register_watchdog_s", 2, IN, 600, IN),
    ("safety.following_error_deg", 0.2, IN, 30, IN),
    ("safety.following_error_s", 0.5, IN, 60, IN),
    ("safety.clock_alarm_beam_fraction", 0, OUT, 10, IN),
]
SATELLITE_RANGES: list[tuple[str, float, bool, float, bool]] = [
    ("elements.semi_major_axis_km", 1000, IN, 1000000, IN),
    ("elements.eccentricity", 0, IN, 1, OUT),
    ("elements.inclination_deg", 0, IN, 180, IN),
    ("elements.raan_deg", -360, IN, 360, IN),
    ("elements.arg_perigee_deg", -360, IN, 360, IN),
    ("elements.mean_anomaly_deg", -360, IN, 360, IN),
    ("elements.limits.min_semi_major_axis_km", 0, OUT, 8500, OUT),
    ("elements.limits.max_semi_major_axis_km", 6500, OUT, inf, OUT),
    ("elements.limits.min_eccentricity", 0, IN, 0.1, OUT),
    ("elements.limits.max_eccentricity", 0, OUT, 1, OUT),
    ("elements.limits.min_inclination_deg", 0, IN, 180, OUT),
    ("elements.limits.max_inclination_deg", 0, OUT, 180, IN),
    ("uncertainty.position_km", 0, OUT, 300, IN),
    ("uncertainty.velocity_m_s", 0, OUT, 300, IN),
    ("fallback.acquire_s", 0, IN, inf, OUT),
    ("fallback.hold_s", 0, IN, inf, OUT),
    ("fallback.search_s", 0, IN, inf, OUT),
]


def text_of(table: dict[str, Any], head: str = "") -> str:
    """TOML of tables of numbers, texts and times."""
    plain = {key: value for key, value in table.items() if not isinstance(value, dict)}
    lines = [f"[{head}]"] if head else []
    for key, value in plain.items():
        shown = (
            f'"{value}"'
            if isinstance(value, str)
            else value.isoformat()
            if hasattr(value, "isoformat")
            else repr(value)
        )
        lines.append(f"{key} = {shown}")
    for key, value in table.items():
        if isinstance(value, dict):
            lines.append(text_of(value, f"{head}.{key}".strip(".")))
    return "\n".join(lines) + "\n"


def with_value(text: str, key: str, value: float) -> str:
    whole = tomllib.loads(text)
    *path, last = key.split(".")
    table = whole
    for name in path:
        table = table.setdefault(name, {})
    table[last] = value
    return text_of(whole)


def is_taken(directory: Path, key: str, value: float) -> bool:
    """Whether the files load with a key set; a refusal names it."""
    is_station = any(key == one[0] for one in STATION_RANGES)
    station = with_value(STATION, key, value) if is_station else STATION
    write(directory, station, scd=BROUWER if is_station else with_value(BROUWER, key, value))
    try:
        load_satellite(directory, "scd", load_station(directory))
    except ConfigError as error:
        assert key.rpartition(".")[2] in str(error)
        return False
    return True


@pytest.mark.parametrize(
    ("key", "low", "is_low_in", "high", "is_high_in"), STATION_RANGES + SATELLITE_RANGES, ids=lambda value: str(value)
)
def test_a_number_of_the_configuration_is_taken_up_to_the_ends_of_its_range(
    tmp_path: Path, key: str, low: float, is_low_in: bool, high: float, is_high_in: bool
) -> None:
    low, high = float(low), float(high)
    assert is_taken(tmp_path, key, low) is is_low_in
    assert is_taken(tmp_path, key, nextafter(low, inf))
    assert not is_taken(tmp_path, key, nextafter(low, -inf))
    assert is_taken(tmp_path, key, high) is is_high_in
    if high < inf:
        assert is_taken(tmp_path, key, nextafter(high, -inf))
        assert not is_taken(tmp_path, key, nextafter(high, inf))
    else:
        assert is_taken(tmp_path, key, 1e12)


ROTATOR = STATION.replace('url = "tcp://127.0.0.1:3842"', 'url = "tcp://127.0.0.1:4533"\ndialect = "rotctl"')


@pytest.mark.parametrize(("dialect", "high"), [("sa3842", 179.99), ("rotctl", 180.0)])
def test_the_elevation_of_a_rotator_reaches_to_180_deg_and_that_of_registers_to_their_end(tmp_path, dialect, high):
    text = ROTATOR + '[receiver]\nsignal = "none"\n' if dialect == "rotctl" else STATION
    key = "acu.elevation.max_deg"
    assert load_station(write(tmp_path, with_value(text, key, high))).bounds.elevation.max_deg == high
    with pytest.raises(ConfigError, match=r"elevation\.max_deg"):
        load_station(write(tmp_path, with_value(text, key, nextafter(high, inf))))


@pytest.mark.parametrize("key", ["safety.register_watchdog_s", "safety.following_error_s"])
def test_nothing_is_off_and_between_nothing_and_enough_is_refused(tmp_path: Path, key: str) -> None:
    assert is_taken(tmp_path, key, 0.0)
    assert not is_taken(tmp_path, key, 1e-9)
    assert not is_taken(tmp_path, key, -1e-9)


OMM_RANGES = [  # key, on the low end, beyond it, on the high end, beyond it
    ("MEAN_MOTION", "0.000001", "0.0000009", "20", "20.0001"),
    ("ECCENTRICITY", "0", "-0.0000001", "0.9999999", "1"),
    ("ECCENTRICITY", "0.0", "-.0000001", ".9999999", "1.0"),
    ("ECCENTRICITY", ".0000000", "-1E-7", "9.999999E-1", "0.99999999"),
    ("INCLINATION", "0", "-0.0001", "180", "180.0001"),
    ("RA_OF_ASC_NODE", "-360", "-360.0001", "360", "360.0001"),
    ("ARG_OF_PERICENTER", "-360", "-360.0001", "360", "360.0001"),
    ("MEAN_ANOMALY", "-360", "-360.0001", "360", "360.0001"),
    ("BSTAR", "-100", "-100.001", "100", "100.001"),
]
FIELD_OF = {
    "MEAN_MOTION": ("mean_motion_rad_s", 2.0 * np.pi / DAY_S),
    "ECCENTRICITY": ("eccentricity", 1.0),
    "INCLINATION": ("inclination_rad", DEG),
    "RA_OF_ASC_NODE": ("raan_rad", DEG),
    "ARG_OF_PERICENTER": ("argp_rad", DEG),
    "MEAN_ANOMALY": ("mean_anomaly_rad", DEG),
    "BSTAR": ("bstar_per_radius", 1.0),
}


@pytest.mark.parametrize("form", [kvn, xml, json_list, csv_list])
@pytest.mark.parametrize(("key", "low", "below", "high", "above"), OMM_RANGES)
def test_a_number_of_an_omm_is_taken_up_to_the_ends_of_its_range(form, key, low, below, high, above) -> None:
    for value in (low, high):
        (elements,), problems = parse_omm(form({**FIELDS, key: value}), "a.omm")
        assert problems == []
        name, unit = FIELD_OF[key]
        assert getattr(elements, name) == pytest.approx(float(value) * unit, rel=1e-12)
    for value in (below, above):
        sets, (problem,) = parse_omm(form({**FIELDS, key: value}), "a.omm")
        assert sets == []
        assert f"{key} is " in str(problem)
        assert ", outside " in str(problem)


@pytest.mark.parametrize("form", [kvn, xml, json_list, csv_list])
@pytest.mark.parametrize("eccentricity", ["0", "0.0", "0E0", ".0"])
def test_a_circle_is_an_orbit(form, eccentricity: str) -> None:
    (elements,), _ = parse_omm(form({**FIELDS, "ECCENTRICITY": eccentricity}), "a.omm")
    r_m, _ = Sgp4Propagator(elements).states_teme(elements.epoch_tai_s + np.arange(0.0, 6000.0, 600.0))
    assert np.isfinite(r_m).all()
    assert np.ptp(np.linalg.norm(r_m, axis=1)) < 30e3  # what the flattening of the Earth makes of it


@pytest.mark.parametrize(
    ("column", "taken", "refused"),
    [
        (9, ("  0.0000", "180.0000"), (" -0.0001", "180.0001")),
        (27, ("0000000", "9999999"), ("-000001", "1.00000")),
        (53, (" 0.00000001", "17.00000000"), (" 0.00000000", "-1.00000000")),
    ],
    ids=["inclination", "eccentricity", "mean motion"],
)
def test_a_number_of_an_element_line_is_taken_up_to_the_ends_of_its_range(column, taken, refused) -> None:
    for value in taken:
        sets, problems = parse(ONE, edited(TWO, column, value))
        assert (len(sets), problems) == (1, [])
    for value in refused:
        sets, problems = parse(ONE, edited(TWO, column, value))
        assert (len(sets), len(problems)) == (0, 1)


EPOCH_TAI_S = tai_from_utc("2020-01-01T00:00:00Z")
MIDDLE = BrouwerElements("MADE", EPOCH_TAI_S, 7.2e6, 0.01, 1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "beyond"),
    [
        ({"a_m": 6.5e6, "e": 0.0}, {"a_m": 6.4999e6, "e": 0.0}),
        ({"a_m": 8.5e6}, {"a_m": 8.5001e6}),
        ({"e": 0.0}, {"e": -1e-6}),
        ({"e": 0.1, "a_m": 8.0e6}, {"e": 0.100001, "a_m": 8.0e6}),
        ({"i_rad": 0.0}, {"i_rad": -1e-6}),
        ({"i_rad": np.pi}, {"i_rad": np.pi + 1e-6}),
    ],
)
def test_elements_are_fit_for_use_up_to_the_ends_of_their_limits(changes, beyond) -> None:
    assert check_brouwer(replace(MIDDLE, **changes), ElementLimits(), EPOCH_TAI_S, "f") == ([], [])
    (error,), _ = check_brouwer(replace(MIDDLE, **beyond), ElementLimits(), EPOCH_TAI_S, "f")
    assert "is outside" in error


@pytest.mark.parametrize(
    ("sign", "warned_days"), [(1.0, 10.0), (-1.0, 2.0)], ids=["old", "ahead of the clock, which may be wrong"]
)
def test_elements_are_warned_of_by_their_age_and_too_old_at_thirty_days(sign: float, warned_days: float) -> None:
    def found(days: float) -> tuple[int, int]:
        errors, warnings = check_brouwer(MIDDLE, ElementLimits(), EPOCH_TAI_S + sign * days * DAY_S, "f")
        return len(errors), len(warnings)

    shown = [found(days) for days in (0.0, warned_days, warned_days + 0.001, 30.0)]
    assert shown == [(0, 0), (0, 0), (0, 1), (0, 1)]
    assert found(30.001)[0] == 1
