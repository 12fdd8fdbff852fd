"""SGP4 through our parser and propagator against Vallado's verification set and against precise orbits."""

import csv
import json
import pickle
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA, needs_data
from real_passes import sky_angles_deg

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction, EarthOrientation, Site, Station
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.orbit.tle import parse_tle

VALLADO_KM = 1e-5
VALLADO_KM_S = 1e-8
MADE_TO_FAIL = 33334  # its printed row is a copy of the one before
TRUTH_DEG = 0.003
PASSES = sorted((DATA / "passes").glob("*.json")) if DATA.is_dir() else []


def with_checksum(line: str) -> str:
    """The first 68 columns with the checksum they should have (Vallado edited some lines without it)."""
    return line[:68] + str(sum(int(c) if c.isdigit() else c == "-" for c in line[:68]) % 10)


def vallado_sets() -> list[ElementSet]:
    text = files("sgp4").joinpath("SGP4-VER.TLE").read_text()
    lines = [with_checksum(line) for line in text.splitlines() if line.startswith(("1 ", "2 "))]
    sets, problems = parse_tle("\n".join(lines), "SGP4-VER.TLE")
    assert not problems
    return sets


def vallado_answers() -> list[tuple[int, np.ndarray]]:
    """Per satellite its number and rows of minutes, position km, velocity km/s."""
    blocks: list[tuple[int, list[list[float]]]] = []
    for line in files("sgp4").joinpath("tcppver.out").read_text().splitlines():
        if line.endswith("xx"):
            blocks.append((int(line.split()[0]), []))
        elif line.strip():
            blocks[-1][1].append([float(word) for word in line.split()[:7]])
    return [(norad_id, np.array(rows)) for norad_id, rows in blocks]


def test_vallados_verification_set_comes_out_through_our_parser_and_propagator() -> None:
    sets, answers = vallado_sets(), vallado_answers()
    assert [one.norad_id for one in sets] == [norad_id for norad_id, _ in answers]
    compared = 0
    for elements, (_, rows) in zip(sets, answers, strict=True):
        propagator, times = Sgp4Propagator(elements), elements.epoch_tai_s + 60.0 * rows[:, 0]
        if elements.norad_id == MADE_TO_FAIL:
            with pytest.raises(OrbitError, match="SGP4 error 3"):
                propagator.states_teme(times)
            continue
        r_m, v_m_s = propagator.states_teme(times)
        assert np.max(np.abs(r_m / 1e3 - rows[:, 1:4])) < VALLADO_KM, elements.label
        assert np.max(np.abs(v_m_s / 1e3 - rows[:, 4:7])) < VALLADO_KM_S, elements.label
        compared += len(rows)
    assert compared > 600


@needs_data
@pytest.mark.parametrize("with_polar_motion", [False, True])
@pytest.mark.parametrize("path", PASSES, ids=lambda path: path.stem)
def test_real_elements_are_wrong_by_what_the_precise_orbit_says(path: Path, with_polar_motion: bool) -> None:
    facts = json.loads(path.read_text())
    [elements], [] = parse_tle(path.with_suffix(".tle").read_text(), path.name)
    with path.with_suffix(".truth.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    polar = facts["polar_motion_arcsec"] if with_polar_motion else (0.0, 0.0)
    station = Station(facts["station"], facts["latitude_deg"], facts["longitude_deg"], facts["height_m"])
    site = Site(station, EarthOrientation(facts["ut1_utc_s"], *polar))
    seen = look_at(Sgp4Propagator(elements), np.array([tai_from_utc(row["utc"]) for row in rows]), site)
    az_deg, el_deg = (np.array([float(row[key]) for row in rows]) for key in ("az_deg", "el_deg"))
    largest_deg = np.max(sky_angles_deg(az_deg, el_deg, seen.az_deg, seen.el_deg))
    assert largest_deg == pytest.approx(facts["largest_error_of_the_elements_deg"], abs=TRUTH_DEG)


def test_a_correction_turns_the_node_and_moves_the_satellite_along_its_orbit() -> None:
    elements = next(one for one in vallado_sets() if one.norad_id == 28057)
    propagator = Sgp4Propagator(elements)
    at = np.array([elements.epoch_tai_s + 600.0])
    before = osculating_from_state(*propagator.states_teme(at))
    moved = propagator.corrected(Correction(delta_raan_rad=1e-3, delta_mean_anomaly_rad=-2e-3))
    after = osculating_from_state(*moved.states_teme(at))
    assert after.raan_rad - before.raan_rad == pytest.approx(1e-3, abs=1e-5)
    argument = after.argp_rad + after.mean_anomaly_rad - before.argp_rad - before.mean_anomaly_rad
    assert np.remainder(argument + np.pi, 2 * np.pi) - np.pi == pytest.approx(-2e-3, abs=2e-5)


def test_a_correction_replaces_the_one_before_and_an_empty_one_gives_the_source() -> None:
    propagator = Sgp4Propagator(vallado_sets()[0])
    at = propagator.epoch_tai_s + np.arange(5) * 100.0
    twice = propagator.corrected(Correction(0.1, 0.2)).corrected(Correction(0.01, 0.02))
    once = propagator.corrected(Correction(0.01, 0.02))
    assert np.array_equal(twice.states_teme(at)[0], once.states_teme(at)[0])
    assert np.array_equal(once.corrected(Correction()).states_teme(at)[0], propagator.states_teme(at)[0])


def test_a_corrected_propagator_survives_pickling() -> None:
    propagator = Sgp4Propagator(vallado_sets()[2]).corrected(Correction(0.01, -0.02))
    at = propagator.epoch_tai_s + np.arange(100) * 10.0
    copy = pickle.loads(pickle.dumps(propagator))
    assert copy == propagator != propagator.corrected(Correction(delta_raan_rad=1e-9))
    assert hash(copy) == hash(propagator)
    assert propagator != propagator.elements
    assert np.array_equal(copy.states_teme(at), propagator.states_teme(at))
    assert (copy.kind, copy.epoch_tai_s) == ("tle", propagator.epoch_tai_s)


def test_a_decayed_satellite_is_an_error_that_names_it_the_time_and_the_reason() -> None:
    elements = next(one for one in vallado_sets() if one.norad_id == 28872)
    with pytest.raises(OrbitError, match=r"NORAD 28872: no position at 2005-11-29T.*: the satellite has decayed"):
        Sgp4Propagator(elements).states_teme(elements.epoch_tai_s + np.array([0.0, 1800.0, 3600.0]))


def test_a_leap_second_between_epoch_and_now_moves_nothing() -> None:
    line1 = with_checksum("1 25544U 98067A   16366.50000000  .00006763  00000-0  12771-3 0  9990")
    line2 = with_checksum("2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325540")
    [elements], [] = parse_tle(f"{line1}\n{line2}", "x")
    propagator = Sgp4Propagator(elements)
    midnight_tai_s = tai_from_utc("2017-01-01T00:00:00Z")
    r_m, v_m_s = propagator.states_teme(midnight_tai_s + np.array([-1.5, -0.5, 0.5]))
    assert np.linalg.norm(np.diff(r_m, axis=0), axis=1) == pytest.approx(np.linalg.norm(v_m_s[1]), rel=1e-4)


def test_a_correction_to_no_orbit_blames_the_readings_and_not_the_elements() -> None:
    source = Sgp4Propagator(next(one for one in vallado_sets() if one.norad_id == 28057))
    gone = source.corrected(Correction(delta_e_cos_argp=2.0))
    with pytest.raises(OrbitError, match=r"SGP4 error 1\); so far do the readings correct the elements"):
        gone.states_teme(np.array([source.epoch_tai_s]))
