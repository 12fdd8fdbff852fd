"""Two-line element sets: what is read, and what is refused with file, line and reason."""

import gzip
from dataclasses import replace
from math import degrees

import pytest
from conftest import DATA, needs_data
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.orbit.element_set import ElementSet, Problem
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.orbit.tle import catalogue_number, parse_tle

NAME = "ISS (ZARYA)"
ONE = "1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996"
TWO = "2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325546"
OTHER_ONE = "1 41335U 16011A   18357.18506581  .00000016  00000-0  24644-4 0  9994"
OTHER_TWO = "2 41335  98.6325  61.6775 0000955  88.1804 271.9486 14.26733655148351"


def parse(*lines: str, end: str = "\n") -> tuple[list[ElementSet], list[Problem]]:
    return parse_tle(end.join(lines) + end, "sats.tle")


def edited(line: str, first: int, text: str) -> str:
    """The line with other text from a column on, its checksum made right."""
    body = (line[: first - 1] + text + line[first - 1 + len(text) :])[:68]
    return body + str(sum(int(c) if c.isdigit() else c == "-" for c in body) % 10)


def only_problem(*lines: str) -> str:
    sets, problems = parse(*lines)
    assert not sets
    assert len(problems) == 1
    return str(problems[0])


def test_every_field_of_a_set_is_read() -> None:
    [one], [] = parse(NAME, ONE, TWO)
    assert (one.kind, one.name, one.norad_id, one.file, one.line) == ("tle", NAME, 25544, "sats.tle", 2)
    assert utc_text(one.epoch_tai_s, 5) == "2022-02-10T13:19:06.23107Z"
    angles = (one.inclination_rad, one.raan_rad, one.argp_rad, one.mean_anomaly_rad)
    assert [degrees(angle) for angle in angles] == pytest.approx([51.6412, 243.7057, 116.5714, 333.9560])
    assert one.eccentricity == pytest.approx(0.0005670)
    assert one.bstar_per_radius == pytest.approx(0.12771e-3)
    assert one.mean_motion_rad_s == pytest.approx(15.49692082 * 2 * 3.141592653589793 / 86400)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", [(), (NAME,), (f"0 {NAME}",), (f"{NAME}             ",), ("", "# comment", NAME)])
def test_any_line_ends_and_any_form_of_the_name_are_read(end: str, name: tuple[str, ...]) -> None:
    [first, second], [] = parse(*name, ONE, TWO, "", *name, OTHER_ONE, OTHER_TWO, end=end)
    assert (first.norad_id, second.norad_id) == (25544, 41335)
    assert first.name == second.name == (NAME if name else "")
    assert first.line == len(name) + 1


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((ONE[:-1] + "5", TWO), "line 1: checksum 5, computed 6: the line was changed"),
        ((ONE, TWO.replace("243.7057", "243.7058")), "line 2: checksum 6, computed 7: the line was changed"),
        ((TWO, ONE), "line 1: the two lines are swapped: line 2 stands before line 1"),
        ((ONE, OTHER_TWO), "line 2: catalogue number 41335 does not match 25544 of line 1"),
        ((ONE[:60], TWO), "line 1: 60 characters, an element line has 69"),
        ((ONE, TWO + "0"), "line 2: 70 characters, an element line has 69"),
        ((ONE, TWO[:-1]), "line 2: 68 characters, an element line has 69"),
        ((ONE[:-1], TWO), "line 1: 68 characters, an element line has 69"),
        ((ONE[:-1], TWO[:60]), "line 2: 60 characters, an element line has 69"),
        ((ONE,), "line 1: line 1 of an element set without the other line"),
        ((TWO,), "line 1: line 2 of an element set without the other line"),
        (("No GP data found",), "line 1: 'No GP data found' is neither an element line nor the name of a set below it"),
        ((ONE, edited(TWO, 9, " 5x.6412")), "line 2: inclination (columns 9-16) is '5x.6412', not a number"),
        ((ONE, edited(TWO, 9, "190.6412")), "line 2: inclination 190.6412 deg; it must lie in 0..180"),
        ((ONE, edited(TWO, 27, "       ")), "line 2: eccentricity (columns 27-33) is '       ', not 7 digits"),
        ((edited(ONE, 19, "  "), TWO), "line 1: epoch year (columns 19-20) is '  ', not 2 digits"),
        ((ONE, edited(TWO, 27, "0.00567")), "line 2: eccentricity (columns 27-33) is '0.00567', not 7 digits"),
        ((ONE, edited(TWO, 53, "        nan")), "line 2: mean motion (columns 53-63) is 'nan', not a number"),
        ((ONE, edited(TWO, 53, " 0.00000000")), "line 2: mean motion 0.0 revolutions a day; it must be positive"),
        ((ONE, edited(TWO, 17, "2")), "line 2: column 17 must be blank: the numbers are not in their columns"),
        ((edited(ONE, 54, " 1277x-3"), TWO), "line 1: B* (columns 54-61) is '1277x-3', not like 12345-3"),
        ((edited(ONE, 19, "22366.50000000"), TWO), "line 1: epoch day 366.5 is no day of 2022"),
        ((edited(ONE, 63, "4"), TWO), "line 1: ephemeris type 4 (SGP4-XP) needs a propagator of its own"),
        ((edited(ONE, 3, "I5544"), edited(TWO, 3, "I5544")), "line 1: catalogue number 'I5544': five digits, or"),
        ((ONE.replace(" ", "\x00", 1), TWO), "line 1: '1\\x0025544U"),
    ],
)
def test_a_bad_set_is_refused_with_file_line_and_reason(lines: tuple[str, ...], message: str) -> None:
    sets, problems = parse(*lines)
    assert not sets
    assert str(problems[0]).startswith(f"sats.tle, {message}")


@pytest.mark.parametrize(
    "bad",
    [
        *((NAME, TWO, ONE), (NAME, ONE), (NAME, TWO), (ONE[:-1] + "5", TWO), (ONE, TWO[:30]), (NAME,), (TWO, TWO)),
        *((ONE, OTHER_TWO), ("<html>", "", "<body>")),
    ],
)
def test_a_bad_set_in_a_list_loses_none_of_the_good_ones(bad: tuple[str, ...]) -> None:
    sets, problems = parse("SENTINEL-3A", OTHER_ONE, OTHER_TWO, *bad, "SENTINEL-3A", OTHER_ONE, OTHER_TWO)
    assert [(one.name, one.norad_id) for one in sets] == [("SENTINEL-3A", 41335)] * 2
    assert problems
    assert all(problem.line is not None and 4 <= problem.line < 4 + len(bad) for problem in problems)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        *(("5", 5), ("00005", 5), ("A0000", 100000), ("H9999", 179999), ("J0001", 180001), ("Z9999", 339999)),
        *(("799500001", 799500001), ("I0000", None), ("O0000", None), ("a0000", None), ("A00001", None), ("", None)),
        *(("-5", None), ("²²²²²", None), ("1234567890", None)),
    ],
)
def test_catalogue_numbers_may_be_alpha_5_or_long(text: str, number: int | None) -> None:
    assert catalogue_number(text) == number


def test_an_alpha_5_set_is_read() -> None:
    [one], [] = parse(edited(ONE, 3, "T0001"), edited(TWO, 3, "T0001"))
    assert one.norad_id == 270001


def test_an_epoch_of_57_is_1957_and_of_56_is_2056() -> None:
    [old, new], [] = parse(edited(ONE, 19, "57"), TWO, edited(ONE, 19, "56"), TWO)
    assert utc_text(old.epoch_tai_s)[:4] == "1957"
    assert utc_text(new.epoch_tai_s)[:4] == "2056"


@pytest.mark.parametrize(
    ("line", "name"),
    [
        *(("2 PATHFINDER", "2 PATHFINDER"), ("1 KUNS-SAT", "1 KUNS-SAT"), ("1 12345", "1 12345"), ("0 2 X", "2 X")),
        *(("2 25544 DEB", "2 25544 DEB"), ("1 A1234 SAT", "1 A1234 SAT"), ("0 1 HOPEFUL", "1 HOPEFUL")),
        *(("0", ""), ("0 ", ""), ("\tISS\t", "ISS"), ("ISS\t(ZARYA)", "ISS (ZARYA)"), ("\xa0ISS\xa0", "ISS")),
        *(("iss (zarya)", "iss (zarya)"), ("1", "1"), ("2", "2"), ("1998-067A", "1998-067A")),
        (
            "1 " + "LONG NAME OF AN OBJECT THAT A PERSON WROTE DOWN BY HAND",
            "1 LONG NAME OF AN OBJECT THAT A PERSON WROTE DOWN BY HAND",
        ),
    ],
)
def test_a_name_may_look_like_an_element_line_or_be_none(line: str, name: str) -> None:
    sets, problems = parse("SENTINEL-3A", OTHER_ONE, OTHER_TWO, line, ONE, TWO, "SENTINEL-3A", OTHER_ONE, OTHER_TWO)
    assert problems == []
    assert [one.name for one in sets] == ["SENTINEL-3A", name, "SENTINEL-3A"]


def small(line: str) -> str:
    return line.lower()


@pytest.mark.parametrize(
    ("one", "two"),
    [
        (small(ONE), TWO),
        (small(edited(ONE, 3, "T0001")), small(edited(TWO, 3, "T0001"))),
        ("  " + ONE + "  \t", "\t" + TWO),
        (ONE + " ", TWO + " 0.0 1440.0 1.0"),
        (edited(ONE, 54, " 12771 -3".replace(" -", "-")), edited(TWO, 27, "   5670")),
        (edited(ONE, 45, "        "), TWO),
        (edited(ONE, 54, "+12771-3"), TWO),
        (ONE.replace("98067A   22041", "98067A\t  22041"), TWO.replace("25544  51", "25544\t 51")),
        (ONE.replace("22041.55493323  .", "22041.55493323\t ."), TWO),
        (ONE.replace(" ", "\t", 2), TWO.replace(" ", "\t", 1)),
        (ONE + "\x1a", TWO + "\x1a"),
        ("\ufeff" + ONE.replace("-", "\u2212"), "\ufeff" + TWO),
        (ONE.replace("-", "\u2013"), TWO),
    ],
)
def test_sets_are_read_as_people_have_them(one: str, two: str) -> None:
    [found], [] = parse(one, two)
    [same], [] = parse(ONE, TWO)
    assert found.mean_motion_rad_s == same.mean_motion_rad_s
    assert found.epoch_tai_s == same.epoch_tai_s
    assert found.bstar_per_radius == same.bstar_per_radius
    assert found.eccentricity == same.eccentricity
    assert found.norad_id in (25544, 270001)


@pytest.mark.parametrize(
    ("one_length", "two_length"), [(68, 68), (64, 63), (61, 68), (67, 63), (69, 63), (69, 67), (62, 69)]
)
def test_sets_without_checksums_are_read_with_a_note(one_length: int, two_length: int) -> None:
    [found], [note] = parse(NAME, ONE[:one_length], TWO[:two_length])
    [same], [] = parse(NAME, ONE, TWO)
    assert replace(found, name=NAME) == same
    assert (note.kind, note.norad_ids) == ("note", (25544,))
    assert str(note) == "sats.tle, line 2: no checksum at the ends of the lines: damage would not be noticed"


def test_the_verification_lines_with_start_stop_and_step_after_the_set_are_read() -> None:
    one = "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753"
    two = "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667     0.00      4320.0        360.00 "
    [found], [] = parse(one, two)
    assert found.norad_id == 5


def test_text_around_the_sets_is_text_and_a_damaged_set_says_whose_it_is() -> None:
    template = "1 AAAAAU 00  0  0 BBBBB.BBBBBBBB  .CCCCCCCC  00000-0  00000-0 0  DDDZ"
    _, problems = parse("SB KEPS @ AMSAT", template, "TO ALL", "AO-07", ONE[:-1] + "5", TWO, "/EX")
    assert [(one.kind, one.name, one.norad_ids) for one in problems] == [
        ("text", "SB KEPS @ AMSAT", ()),
        ("text", template, ()),
        ("text", "TO ALL", ()),
        ("lost", "AO-07", (25544, 25544)),
        ("text", "/EX", ()),
    ]


@needs_data
def test_every_real_list_is_read_without_a_problem() -> None:
    texts = {path.name: path.read_bytes().decode() for path in (DATA / "tle_sets").glob("*.txt")}
    packed = next((DATA / "tle_sets").glob("*.gz"))
    texts[packed.name] = gzip.decompress(packed.read_bytes()).decode()
    for file, text in texts.items():
        sets, problems = parse_tle(text, file)
        assert not problems
        assert len(sets) == text.count("\n1 ")
        assert all(one.name for one in sets)


@given(st.text())
def test_no_text_makes_the_parser_fail(text: str) -> None:
    sets, _ = parse_tle(text, "x")
    assert not sets


@given(st.data())
def test_no_damage_to_a_set_makes_the_parser_fail_or_lose_the_set_before_it(data: st.DataObject) -> None:
    text = list(f"{NAME}\n{ONE}\n{TWO}\n")
    for _ in range(data.draw(st.integers(1, 4))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.characters() | st.sampled_from(" \r\n-+.012é²"))
    lines = "".join(text).split("\n")
    with_right_checksums = [edited(line, 1, "") if len(line) == 69 and line.isascii() else line for line in lines]
    for candidate in (lines, with_right_checksums):
        sets, _ = parse(OTHER_ONE, OTHER_TWO, *candidate)
        assert sets[0].norad_id == 41335


@pytest.mark.parametrize(
    ("day", "utc"),
    [
        ("22001.00000000", "2022-01-01T00:00:00Z"),
        ("22365.00000000", "2022-12-31T00:00:00Z"),
        ("24366.00000000", "2024-12-31T00:00:00Z"),
    ],
)
def test_an_epoch_may_be_the_first_instant_of_the_first_and_of_the_last_day_of_a_year(day: str, utc: str) -> None:
    (one,), problems = parse_tle("\n".join((edited(ONE, 19, day), TWO)), "f")
    assert problems == []
    assert one.epoch_tai_s == tai_from_utc(utc)
