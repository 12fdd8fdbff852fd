"""Predictions of the International Laser Ranging Service: what is read, what is refused, and where the satellite is."""

import numpy as np
import pytest
from conftest import needs_data
from made_oems import states
from made_tables import TURNED, cpf, cpf_rows, made_states, worst_m
from real_pass import PASSES
from script_modules import load

from acu_daemon.model import EarthOrientation, Site, Station
from acu_daemon.orbit.cpf import parse_cpf
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.sim.sky import read_truth

MADE = made_states()


def problem_of(text: str) -> str:
    segments, problems = parse_cpf(text, "f.cpf")
    assert segments == []
    return str(problems[0])


def changed(old: str, new: str) -> str:
    text = cpf(MADE)
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize("version", [1, 2])
def test_a_prediction_says_whose_it_is_when_it_was_made_and_where_the_satellite_is(version: int) -> None:
    [segment], [] = parse_cpf(cpf(MADE, version), "f.cpf")
    assert (segment.kind, segment.name, segment.object_id, segment.frame) == ("cpf", "iss", "25544", "ITRF")
    assert segment.created_tai_s == tai_from_utc("2022-02-11T12:00:00Z")
    assert segment.notes == ()
    assert np.abs(segment.tai_s - MADE[0]).max() < 1e-6
    assert worst_m(segment.r_m - MADE[1]) < 0.001


def test_between_its_positions_an_ephemeris_is_within_a_metre_of_the_orbit() -> None:
    """The truth is SGP4's, whose velocities are no exact derivatives: positions alone are compared."""
    [segment], [] = parse_cpf(cpf(MADE), "f.cpf")
    tai_s, truth_m, _ = states(7200.0, 13.0)
    made_m, made_m_s = Ephemeris([segment], TURNED).states(tai_s[2:-2])
    assert worst_m(made_m - truth_m[2:-2]) < 0.1
    slopes_m_s = (truth_m[3:-1] - truth_m[1:-3]) / 26.0
    assert worst_m(made_m_s - slopes_m_s) < 0.3  # of a difference over 26 s


def test_behind_a_leap_second_the_flag_takes_it_out_again() -> None:
    """2016-12-31 had one.  The day after, a flagged row's time is a second ahead of UTC (ILRS errata of CPF, 2015)."""
    begin = tai_from_utc("2016-12-31T23:00:00Z")
    tai_s, r_m, v_m_s = made_states(7200.0, 120.0)
    moved = tai_s - tai_s[0] + begin, r_m, v_m_s
    rows = []
    for i, row in enumerate(cpf_rows(moved)):
        if i < 30:
            rows.append(row)
        else:
            second = (i - 30) * 120.0
            rows.append(f"10 0 57754 {second:13.6f}  1 " + " ".join(f"{x:17.3f}" for x in r_m[i]))
    [segment], [] = parse_cpf(cpf(moved, rows=rows), "f.cpf")
    assert np.abs(np.diff(segment.tai_s) - 120.0).max() < 1e-6
    plain = [row.replace("  1 ", "  0 ", 1) if i >= 30 else row for i, row in enumerate(rows)]
    [other], [] = parse_cpf(cpf(moved, rows=plain), "f.cpf")
    assert other.tai_s[30] - other.tai_s[29] == pytest.approx(121.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("H1 CPF", "H1 CRD", "f.cpf, line 1: H1 is not: H1 CPF"),
        ("H1 CPF  2", "H1 CPF  3", "f.cpf, line 1: CPF version '3'; 1 and 2 can be read"),
        (" 1 1 0 0 0 1\n", " 1 1 7 0 0 1\n", "f.cpf, line 2: reference frame '7' of H2"),
        ("  120 1 1 0 0 0 1", "", "f.cpf, line 2: H2 has 16 fields, at least 20 are needed"),
        ("10 0 59621", "10 2 59621", "f.cpf, line 5: direction flag '2': only positions of one instant"),
        ("10 0 59621", "10 0 5962x", "f.cpf, line 5: '5962x' is not a number"),
        ("10 0 59621", "10 0 59", "f.cpf, line 5: '59' is no modified Julian date"),
        ("72000.000000", "92000.000000", "f.cpf, line 5: second 92000.000000 with leap-second flag 0"),
        ("72120.000000", "71120.000000", "f.cpf, line 6: the times must rise"),
        ("H9", "55 what", "f.cpf, line 3: '55' is no record of a CPF"),
        ("H2 ", "00 ", "f.cpf, line 5: positions before the header H2"),
    ],
)
def test_a_bad_line_is_told_with_its_number(old: str, new: str, said: str) -> None:
    assert problem_of(changed(old, new)).startswith(said)


def test_a_prediction_with_few_positions_or_none_is_refused() -> None:
    assert "7 positions without velocities in a row, at least 8" in problem_of(cpf(MADE, rows=cpf_rows(MADE)[:7]))
    assert "a prediction without positions" in problem_of(cpf(MADE, rows=[]))
    assert problem_of("") == "f.cpf: no prediction in it (CPF)"


def test_a_file_that_was_cut_is_read_up_to_the_cut_with_a_note() -> None:
    text = cpf(MADE)
    [segment], [] = parse_cpf(text[: text.rindex("99") - 4], "f.cpf")
    assert segment.tai_s.size == MADE[0].size - 1
    assert segment.notes == ("f.cpf, line 65: the file ends within this line, which is left out",)
    [whole], [] = parse_cpf(text[: text.rindex("99")], "f.cpf")
    assert whole.tai_s.size == MADE[0].size
    assert "without its record 99" in whole.notes[0]


def test_one_position_that_is_missing_is_bridged_and_two_are_a_gap() -> None:
    rows = cpf_rows(MADE)
    [bridged], [] = parse_cpf(cpf(MADE, rows=[*rows[:30], *rows[31:]]), "f.cpf")
    assert bridged.tai_s.size == MADE[0].size - 1
    parted, [] = parse_cpf(cpf(MADE, rows=[*rows[:30], *rows[32:]]), "f.cpf")
    assert [one.tai_s.size for one in parted] == [30, MADE[0].size - 32]


def test_velocities_of_the_file_are_used_where_positions_say_no_better() -> None:
    with_velocities = []
    for row, v_m_s in zip(cpf_rows(MADE), MADE[2].tolist(), strict=True):
        with_velocities += [row, "20 0 " + " ".join(f"{x:15.6f}" for x in v_m_s)]
    [segment], [] = parse_cpf(cpf(MADE, rows=with_velocities), "f.cpf")
    assert worst_m(segment.v_m_s - MADE[2]) < 0.05
    [short], [] = parse_cpf(cpf(MADE, rows=with_velocities[:10]), "f.cpf")
    assert worst_m(short.v_m_s - MADE[2][:5]) < 1e-5


@needs_data
@pytest.mark.parametrize("name", ["jason-3-Wallops-20180615T1827", "jason-3-AliceSprings-20180614T0050"])
def test_jason_3_is_where_others_have_seen_it_by_the_same_prediction(name: str) -> None:
    """Directions that others have computed from this file, to the fifth decimal."""
    path = PASSES.parent / "orbits" / "jason3_cpf_180613_16401.cne"
    segments, [] = parse_cpf(path.read_text(), path.name)
    place = {"Wallops": (37.94, -75.46, 10.0), "AliceSprings": (-23.76, 133.88, 550.0)}[name.split("-")[2]]
    site = Site(Station("s", *place), EarthOrientation(0.07, 0.13, 0.44))
    truth = read_truth(PASSES / f"{name}.truth.csv")
    lines = (PASSES / f"{name}.truth.csv").read_text().splitlines()[1::10]
    tai_s = np.array([tai_from_utc(line.split(",")[0]) for line in lines])
    seen = look_at(EphemerisPropagator(Ephemeris(segments, site.orientation)), tai_s, site)
    assert truth is not None
    for i, line in enumerate(lines):
        az_deg, el_deg, range_km = (float(text) for text in line.split(",")[1:])
        assert seen.el_deg[i] == pytest.approx(el_deg, abs=1.5e-5)
        assert (seen.az_deg[i] - az_deg) * np.cos(np.radians(el_deg)) == pytest.approx(0.0, abs=1.5e-5)
        assert seen.range_m[i] / 1e3 == pytest.approx(range_km, abs=2e-4)


@pytest.mark.long
@needs_data
@pytest.mark.parametrize(
    ("name", "within_m"), [("jason3_cpf_180613_16401.cne", 1.0), ("lageos1_cpf_180613_16401.hts", 0.05)]
)
def test_points_of_real_predictions_that_are_held_back_are_met_within_a_metre(name: str, within_m: float) -> None:
    script = load("held_back_points")
    path = PASSES.parent / "orbits" / name
    segments, [] = parse_cpf(path.read_text(), path.name)
    assert script.held_back_m(path.read_text(), "cpf", segments[0]).max() < within_m
