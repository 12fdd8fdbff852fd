"""Orbits in the Standard Product 3 format: what is read, what is refused, and where the satellites are."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from conftest import needs_data
from made_oems import states
from made_tables import TURNED, earth_fixed, made_states, sp3, worst_m
from real_pass import PASSES
from script_modules import load

from acu_daemon.edge.orbit_file import read_orbit_file
from acu_daemon.errors import ElementsError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.ephemeris import Ephemeris
from acu_daemon.orbit.sp3 import parse_sp3
from acu_daemon.orbit.timescales import tai_from_utc

MADE = made_states()


def problem_of(text: str) -> str:
    segments, problems = parse_sp3(text, "f.sp3")
    assert segments == []
    return str(problems[0])


@pytest.mark.parametrize("system", ["UTC", "GPS", "TAI", "BDT"])
def test_times_are_of_the_system_that_the_header_names(system: str) -> None:
    """2022: UTC is 18 s behind GPS time and 37 s behind TAI; BeiDou time is 33 s behind TAI."""
    [segment], [] = parse_sp3(sp3({"L56": MADE}, system), "f.sp3")
    assert np.abs(segment.tai_s - MADE[0]).max() < 1e-6
    assert worst_m(segment.r_m - MADE[1]) < 0.001
    assert (segment.kind, segment.name, segment.frame, segment.created_tai_s) == ("sp3", "L56", "ITRF", None)


def test_a_header_without_a_system_means_gps_time() -> None:
    [gps], [] = parse_sp3(sp3({"G01": MADE}, "GPS").replace("cc GPS ccc", "cc ccc ccc"), "f.sp3")
    assert np.abs(gps.tai_s - MADE[0]).max() < 1e-6


@pytest.mark.parametrize("has_velocities", [True, False])
def test_between_its_positions_it_is_within_a_metre_of_the_orbit(has_velocities: bool) -> None:
    [segment], [] = parse_sp3(sp3({"L56": MADE}, has_velocities=has_velocities), "f.sp3")
    tai_s, truth_m, _ = states(7200.0, 13.0)
    made_m, _ = Ephemeris([segment], TURNED).states(tai_s)
    assert worst_m(made_m - truth_m) < 0.5


def test_of_several_satellites_each_is_its_own_and_zeros_are_no_place() -> None:
    later = earth_fixed(states(7200.0, 120.0))
    moved = later[0], later[1] * 1.1, later[2]
    text = sp3({"L56": MADE, "L57": moved}, has_velocities=False)
    first, second = parse_sp3(text, "f.sp3")[0]
    assert (first.name, second.name) == ("L56", "L57")
    assert worst_m(second.r_m - moved[1]) < 0.001
    zeros = text.replace("PL57" + "".join(f"{x:14.6f}" for x in moved[1][30] / 1e3), "PL57" + 3 * f"{0.0:14.6f}")
    assert [one.tai_s.size for one in parse_sp3(zeros, "f.sp3")[0]] == [61, 60]


def test_predicted_positions_and_manoeuvres_are_known_by_their_flags() -> None:
    lines = sp3({"L56": MADE}, has_velocities=False).split("\n")
    rows = [i for i, line in enumerate(lines) if line.startswith("PL56")]
    for i in rows[40:]:
        lines[i] = f"{lines[i]:<79}P"
    lines[rows[10]] = f"{lines[rows[10]]:<78}M"
    [segment], [] = parse_sp3("\n".join(lines), "f.sp3")
    assert segment.created_tai_s == pytest.approx(MADE[0][39])
    assert segment.notes == (
        f"f.sp3, line {rows[10] + 1}: L56: a manoeuvre before this position is flagged: "
        "across it the orbit is less exact",
    )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("#cV", "#eV", "f.sp3, line 1: '#eV2022"),
        ("cc UTC ccc", "cc XYZ ccc", "f.sp3, line 4: time system 'XYZ' of %c; GPS, GAL"),
        ("ITR14", "ECI00", "f.sp3, line 1: coordinate system 'ECI00': an inertial one of which nobody knows"),
        ("*  2022", "*  20x2", "f.sp3, line 7: '*  20x2"),
        ("*  2022  2 11 20  2", "*  2022  2 11 19  2", "f.sp3, line 11: the times must rise"),
        ("PL56", "P   ", "f.sp3, line 8: 'P   "),
        ("/* made", "what", "f.sp3, line 6: 'what for a test' is no line of an SP3 file"),
    ],
)
def test_a_bad_line_is_told_with_its_number(old: str, new: str, said: str) -> None:
    text = sp3({"L56": MADE})
    assert old in text
    assert problem_of(text.replace(old, new, 1)).startswith(said)


def test_a_number_out_of_its_columns_is_told() -> None:
    lines = sp3({"L56": MADE}).split("\n")
    lines[7] = lines[7][:20] + "x" + lines[7][21:]
    assert problem_of("\n".join(lines)).startswith("f.sp3, line 8: columns 19 to 32 are ")


def test_a_file_that_was_cut_is_read_up_to_the_cut_with_a_note() -> None:
    text = sp3({"L56": MADE}, has_velocities=False)
    [segment], [] = parse_sp3(text[: text.rindex("PL56") + 30], "f.sp3")
    assert segment.tai_s.size == MADE[0].size - 1
    assert any("the file ends within this line" in note for note in segment.notes)


def test_a_packed_file_is_read_and_a_damaged_or_endless_one_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed, path = gzip.compress(sp3({"L56": MADE}).encode()), tmp_path / "f.sp3.gz"
    path.write_bytes(packed)
    kind, text = read_orbit_file(path)
    assert (kind, text) == ("sp3", sp3({"L56": MADE}))
    path.write_bytes(packed[:-20])
    with pytest.raises(ElementsError, match="a gzip archive that was cut"):
        read_orbit_file(path)
    path.write_bytes(packed[:40] + b"rubbish" + packed[47:])
    with pytest.raises(ElementsError, match="a gzip archive that is damaged"):
        read_orbit_file(path)
    monkeypatch.setattr("acu_daemon.edge.orbit_file.MOST_BYTES", 2**20)
    path.write_bytes(gzip.compress(b"0" * (2**21)))
    with pytest.raises(ElementsError, match="more than 1 MB when it is unpacked"):
        read_orbit_file(path)


@needs_data
def test_points_of_a_real_orbit_that_are_held_back_are_met_within_a_metre() -> None:
    script = load("held_back_points")
    path = PASSES.parent / "orbits" / "stella_v00.sp3"
    [segment], [] = parse_sp3(path.read_text(), path.name)
    assert script.held_back_m(path.read_text(), "sp3", segment).max() < 1.0


@needs_data
def test_stella_is_on_the_orbit_of_stella() -> None:
    """Height as the ILRS lists it; the inclination that of an element set of 2026, which drifts by 0.1 deg."""
    path = PASSES.parent / "orbits" / "stella_v00.sp3"
    [segment], [] = parse_sp3(path.read_text(), path.name)
    assert segment.start_tai_s == tai_from_utc("2023-12-08T00:00:00Z")
    r_m, v_m_s = Ephemeris([segment], EarthOrientation()).states(segment.tai_s)
    normal = np.cross(r_m, v_m_s)
    inclination_deg = np.degrees(np.arccos(normal[:, 2] / np.linalg.norm(normal, axis=1)))
    assert inclination_deg.mean() == pytest.approx(98.77, abs=0.2)
    assert np.ptp(inclination_deg) < 0.02
    assert np.linalg.norm(r_m, axis=1).mean() == pytest.approx(6378e3 + 805e3, abs=10e3)
