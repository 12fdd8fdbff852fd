"""What people have in place of a file of elements, or around the elements in it, and what is said of it."""

import gzip
import json
import os
import time
from pathlib import Path

import pytest
from command_line import Done, acu_daemon
from config_files import STATION, from_file, write
from conftest import DATA, SHARED, needs_data
from hypothesis import given
from hypothesis import strategies as st
from made_oems import kvn, states, xml

from acu_daemon.cli.options import coming_pass, load_target, nearest_to_pass
from acu_daemon.orbit.contents import binary_kind, decoded, kind_of, what_else
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.orbit.tle import parse_tle

CASES = SHARED / "cases" / "orbit"
ISS = """ISS (ZARYA)
1 25544U 98067A   24069.50000000  .00016717  00000-0  10270-3 0  9991
2 25544  51.6400 200.0000 0005670 116.5714 333.9560 15.49692082325547
"""
PATHFINDER = """2 PATHFINDER
1 45727U 20037E   24069.50000000  .00012000  00000-0  60000-3 0  9995
2 45727  97.5000 100.0000 0011660  53.1934 307.0368 15.18441019250006
"""
BULLETIN = """SB KEPS @ AMSAT  $ORB24069.N
2Line Orbital Elements 24069.AMSAT

HR AMSAT ORBITAL ELEMENTS FOR AMATEUR SATELLITES IN NASA FORMAT
FROM N0CALL SOMEWHERE
BID: $ORB-069.N

DECODE 2-LINE ELSETS WITH THE FOLLOWING KEY:
1 AAAAAU 00  0  0 BBBBB.BBBBBBBB  .CCCCCCCC  00000-0  00000-0 0  DDDZ
2 AAAAA EEE.EEEE FFF.FFFF GGGGGGG HHH.HHHH III.IIII JJ.JJJJJJJJKKKKKZ
KEY: A-CATALOGNUM B-EPOCHTIME C-DECAY D-ELSETNUM E-INCLINATION F-RAAN

TO ALL RADIO AMATEURS BT

AO-07
1 07530U 74089B   24069.30000000 -.00000039  00000-0  60000-4 0  9990
2 07530 111.9900  60.0000 0012300 100.0000 260.0000 12.53690000260002
IO-26
1 22825U 93061C   24069.40000000  .00000200  00000-0  90000-4 0  9998
2 22825  98.9000  30.0000 0008000  90.0000 270.0000 14.30000000580007
/EX
"""
PAGE = "<!DOCTYPE html>\n<html><head><title>503 Service Unavailable</title></head>\n<body>try later</body></html>\n"
NOTICE = "Nothing new since you last asked for this group.\nCome back in two hours.\n"
NOW = ("--from", "2024-03-09T12:00:00Z")


def config(directory: Path, content: str | bytes, satellite: str = "", kind: str = "tle") -> Path:
    write(directory, STATION, sat=satellite or from_file("ISS", kind, "s.txt", 25544))
    path = directory / "satellites" / "s.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    os.utime(path, (0.0, 0.0))  # nobody is writing it
    return directory


def passes(directory: Path, *more: object) -> Done:
    return acu_daemon("passes", "--config", directory, *NOW, *more)


@pytest.mark.parametrize("kind", ["tle", "omm", "oem"])
@pytest.mark.parametrize(
    ("content", "said"),
    [
        (NOTICE, "a notice, not elements: 'Nothing new since you last asked for this group. Come back in two hours.'"),
        (PAGE, "a web page, not elements: '503 Service Unavailable try later'"),
        (
            PAGE.replace("<!DOCTYPE html>\n", "\ufeff\n  "),
            "a web page, not elements: '503 Service Unavailable try later'",
        ),
        ('{"error": "Unauthorized", "status": 401}', "a JSON answer, not elements: 'error: Unauthorized status: 401'"),
        ("[]", "an empty JSON answer: no satellite fits what was asked"),
        ('{"error": "cut', 'JSON that cannot be read, not elements: \'{"error": "cut\''),
        ("<?xml version='1.0'?><error>No GP data</error>", "XML, but no elements: 'No GP data'"),
        ("<html><body>MEAN_MOTION is a field of CCSDS_OMM</body></html>", "a web page, not elements: 'MEAN_MOTION is"),
        ("No GP data found\r\n", "a notice, not elements: 'No GP data found'"),
        (gzip.compress(ISS.encode(), mtime=0)[:-9], "a gzip archive that was cut: fetch it anew"),
        (b"\x1f\x9d\x90rest", "a compress archive: unpack it with uncompress; a file of elements is text"),
        (b"PK\x03\x04rest", "a zip archive: unpack it"),
        (b"%PDF-1.7\n%\xe2\xe3", "a PDF document"),
        (b"\x89PNG\r\n", "a picture"),
        (b"\x01\x00\x02\x00" * 50, "no text: a binary file"),
        *((blank, "the file is empty") for blank in ("", "\n \r\n", "\ufeff", b"\x00" * 100)),
    ],
)
def test_what_stands_in_place_of_elements_is_named_and_quoted(
    tmp_path: Path, kind: str, content: str | bytes, said: str
) -> None:
    done = passes(config(tmp_path, content, kind=kind))
    assert (done.code, done.out) == (2, "")
    [line] = done.err.splitlines()
    assert line.startswith(f"acu-daemon: sat is left out: {tmp_path}/satellites/s.txt: {said}")
    asked = passes(tmp_path, "--satellite", "sat")
    assert asked.code == 2
    assert asked.err.startswith(f"acu-daemon: {tmp_path}/satellites/s.txt: {said}")


@given(st.binary() | st.text().map(str.encode) | st.text().map(lambda text: ("<html>" + text).encode()))
def test_whatever_a_file_holds_it_is_named_in_one_line(data: bytes) -> None:
    said = binary_kind(data) or what_else(decoded(data))
    assert said
    assert "\n" not in said
    assert len(said) < 400


def test_a_packed_list_is_read(tmp_path: Path) -> None:
    done = passes(config(tmp_path, gzip.compress(ISS.encode())))
    assert (done.code, done.err) == (0, "")


def test_text_in_utf_16_is_read(tmp_path: Path) -> None:
    done = passes(config(tmp_path, "\ufeff".encode("utf-16-le") + ISS.replace("\n", "\r\n").encode("utf-16-le")))
    assert (done.code, done.err) == (0, "")


def test_the_defect_of_the_wanted_set_comes_first_and_header_text_is_no_defect(tmp_path: Path) -> None:
    wanted = from_file("AO-07", "tle", "s.txt", 7530)
    first, second = passes(config(tmp_path, BULLETIN, wanted)).err.splitlines()
    assert first == (
        f"acu-daemon: sat is left out: {tmp_path}/satellites/s.txt, line 17: checksum 2, computed 3: the line was "
        "changed; fetch it anew"
    )
    assert "no element set with norad_id 7530; the file holds IO-26 (22825)" in second
    by_name = passes(config(tmp_path, BULLETIN, from_file("AO-07", "tle", "s.txt")))
    assert by_name.code == 2
    assert "line 17: checksum 2" in by_name.err.splitlines()[0]
    other = passes(config(tmp_path, BULLETIN, from_file("IO-26", "tle", "s.txt", 22825)))
    assert other.code == 0
    assert other.err.splitlines() == [
        f"warning: {tmp_path}/satellites/s.txt, line 17: checksum 2, computed 3: the line was changed; fetch it anew"
    ]


def test_a_name_whose_lines_are_missing_is_the_first_thing_said(tmp_path: Path) -> None:
    text = PATHFINDER + "ISS (ZARYA)\n"
    done = passes(config(tmp_path, text, from_file("ISS (ZARYA)", "tle", "s.txt")))
    assert done.code == 2
    assert "line 4: 'ISS (ZARYA)' is neither an element line nor the name of a set below it" in done.err.splitlines()[0]


@pytest.mark.long
@pytest.mark.parametrize("name", ["2 PATHFINDER", "1 KUNS-SAT", "2 45727"])
def test_an_object_whose_name_looks_like_a_line_number_is_found_by_it(tmp_path: Path, name: str) -> None:
    text = ISS + PATHFINDER.replace("2 PATHFINDER", name)
    for satellite in (from_file(name, "tle", "s.txt"), from_file(name, "tle", "s.txt", 45727)):
        done = passes(config(tmp_path, text, satellite), "--days", "3")
        assert (done.code, done.err) == (0, "")
        assert len(done.out.splitlines()) > 2


def test_sets_without_checksums_are_used_with_a_warning(tmp_path: Path) -> None:
    bare = "".join(f"{line[:68]}\n" for line in ISS.splitlines())
    done = passes(config(tmp_path, bare))
    assert done.code == 0
    assert done.err.splitlines() == [
        f"warning: {tmp_path}/satellites/s.txt, line 2: no checksum at the ends of the lines: damage would not be "
        "noticed"
    ]


def test_the_kind_is_that_of_the_file_whatever_the_toml_says(tmp_path: Path) -> None:
    done = passes(config(tmp_path, ISS, kind="omm"))
    assert done.code == 0
    assert 'elements.kind = "omm", but' in done.err
    assert 'is of kind "tle" and read as that' in done.err
    assert kind_of(kvn(states(300.0))) == kind_of(xml(states(300.0))) == "oem"
    assert kind_of(json.dumps([{"OBJECT_NAME": "X", "MEAN_MOTION": 15.0, "TLE_LINE1": "1 25544U 98067A"}])) == "omm"


def test_of_several_sets_the_nearest_in_time_is_used_and_said(tmp_path: Path) -> None:
    old = """ISS
1 25544U 98067A   24061.50000000  .00016717  00000-0  10270-3 0  9993
2 25544  51.6400 240.0000 0005670 116.5714 333.9560 15.49000000325544
ISS
1 25544U 98067A   24069.80000000  .00016717  00000-0  10270-3 0  9994
2 25544  51.6400 198.5000 0005670 116.5714 200.0000 15.49692082325541
"""
    directory = config(tmp_path, old)
    (tmp_path / "station.toml").write_text(STATION.replace("-15.53", "32.5").replace("-56.07", "-85.5"))
    asked = ("passes", "--config", directory, "--from", "2024-03-09T18:00:00Z")
    done = acu_daemon(*asked)
    assert "2024-03-09 18:23:19" in done.out
    assert "of 2 sets the one of 2024-03-09T19:12:00Z is used, 1.2 h after 2024-03-09T18:00:00Z: nearest in" in done.err
    checked = acu_daemon("check", "--config", directory, "--at", "2024-03-09T18:00:00Z")
    assert "GO     sat: elements          epoch 2024-03-09T19:12:00Z" in checked.out
    assert "of 2 sets the one of 2024-03-09T19:12:00Z is used" in checked.out


def test_the_set_nearest_to_the_pass_is_used_and_not_the_one_nearest_to_now(tmp_path: Path) -> None:
    later = ISS.replace("24069.50", "24069.85").replace("9991", "9999")
    directory = config(tmp_path, ISS + later)
    station = STATION.replace("-15.53", "32.5").replace("-56.07", "-85.5")
    (tmp_path / "station.toml").write_text(station)
    checked = acu_daemon("check", "--config", directory, "--at", "2024-03-09T15:30:00Z")
    assert "next pass         2024-03-09T" in checked.out
    first = load_target(directory, "sat", tai_from_utc("2024-03-09T15:30:00Z"))
    assert utc_text(first.elements.epoch_tai_s, 0) == "2024-03-09T12:00:00Z"
    used = nearest_to_pass(directory, "sat", first, tai_from_utc("2024-03-09T15:30:00Z"))
    rise_tai_s = coming_pass(first, tai_from_utc("2024-03-09T15:30:00Z")).rise_tai_s
    assert rise_tai_s > tai_from_utc("2024-03-09T16:12:00Z")
    assert utc_text(used.elements.epoch_tai_s, 0) == "2024-03-09T20:24:00Z"
    assert "the one of 2024-03-09T20:24:00Z is used" in checked.out


MISTAKES = {
    "misspelt": '[satellite]\nname = "N"\nnorad = 33591\n[elements]\nkind = "tle"\nfile = "s.txt"\n',
    "missing": from_file("N", "tle", "nowhere.txt"),
    "page": from_file("N", "tle", "page.txt"),
    "no-toml": "name =",
    "not-utf-8": b"\xff\xfe\x00",
    "override": from_file("N", "tle", "s.txt", 25544) + "[receiver]\nbeamwidth_deg = -1\n",
    "not-there": from_file("N", "tle", "s.txt", 33591),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_one_broken_satellite_hides_no_other_one(tmp_path: Path, mistake: str) -> None:
    directory = config(tmp_path, ISS)
    write(directory, broken=MISTAKES[mistake])
    (tmp_path / "satellites" / "page.txt").write_text(PAGE)
    os.utime(tmp_path / "satellites" / "page.txt", (0.0, 0.0))
    os.utime(tmp_path / "satellites", (0.0, 0.0))
    done = passes(directory)
    assert done.code == 0
    assert {line.split()[0] for line in done.out.splitlines()[1:]} == {"sat"}
    assert "warning: broken is left out: " in done.err
    found = json.loads(passes(directory, "--json").out)
    assert {one["satellite"] for one in found["passes"]} == {"sat"}
    assert [one["satellite"] for one in found["omitted"]] == ["broken"]
    assert found["omitted"][0]["reason"]
    checked = acu_daemon("check", "--config", directory, "--at", "2024-03-09T12:00:00Z")
    assert "GO     sat: next pass" in checked.out
    assert "NO-GO  broken: files" in checked.out
    (tmp_path / "satellites" / "sat.toml").unlink()
    alone = passes(directory, "--json")
    assert alone.code == 2
    assert json.loads(alone.out)["passes"] == []


def test_where_no_satellite_of_several_is_left_the_status_is_2(tmp_path: Path) -> None:
    directory = config(tmp_path, PAGE)
    write(directory, other=MISTAKES["misspelt"])
    done = passes(directory)
    assert (done.code, done.out) == (2, "")
    assert "warning: other is left out: " in done.err
    assert "warning: sat is left out: " in done.err
    assert done.err.splitlines()[-1] == f"acu-daemon: no satellite of {directory}/satellites can be used"


def test_a_satellite_directory_of_another_name_or_with_other_files_is_no_mistake(tmp_path: Path) -> None:
    directory = config(tmp_path, ISS)
    (tmp_path / "satellites" / "notes.md").write_text("mine")
    (tmp_path / "satellites" / ".hidden.toml").write_text("x")
    assert passes(directory).err == ""


GEO = """GOES 16
1 41866U 16071A   24069.50000000 -.00000260  00000-0  00000-0 0  9995
2 41866   0.0300  80.0000 0001000  90.0000 102.5000  1.00270000 26004
"""


def geo(directory: Path, longitude_deg: float, latitude_deg: float = 32.5) -> Path:
    limits = "[elements.limits]\nmax_semi_major_axis_km = 43000\n"
    config(directory, GEO, from_file("GOES 16", "tle", "s.txt", 41866) + limits)
    station = STATION.replace("-15.53", f"{latitude_deg}").replace("-56.07", f"{longitude_deg}")
    (directory / "station.toml").write_text(station)
    return directory


def test_a_satellite_that_never_sets_is_said_to_in_words(tmp_path: Path) -> None:
    directory = geo(tmp_path, -85.5)
    [_, line] = passes(directory).out.splitlines()
    assert "  always up: does not set" in line
    [one] = json.loads(passes(directory, "--json").out)
    assert (one["does_not_rise"], one["does_not_set"]) == (True, True)
    checked = acu_daemon("check", "--config", directory, "--at", "2024-03-09T12:00:00Z")
    assert "always up: does not set" in checked.out


def test_a_satellite_that_never_rises_is_said_to_in_words(tmp_path: Path) -> None:
    done = passes(geo(tmp_path, 110.0))
    assert done.code == 0
    assert "sat: it does not rise above 5 deg within 1 days: it stays at " in done.out
    low = config(tmp_path, ISS)
    (tmp_path / "station.toml").write_text(STATION.replace("-15.53", "-78.0"))
    done = passes(low)
    assert (
        "sat: it never rises above 5 deg here: with an inclination of 51.6 deg it does so up to latitude " in done.out
    )
    checked = acu_daemon("check", "--config", low, "--at", "2024-03-09T12:00:00Z")
    assert "it never rises above 5 deg here" in checked.out


@pytest.mark.skipif(not CASES.is_dir(), reason="the folder of cases ../shared/cases is not there")
@pytest.mark.parametrize(
    ("case", "start", "code", "said"),
    [
        ("garb", "2025-03-20T21:39:00Z", 2, "decayed"),
        ("garb", "2025-03-03T03:00:00Z", 2, "decayed"),
        ("dec", "2018-11-03T05:00:00Z", 0, "sat  "),
        ("many", "2024-03-01T12:00:00Z", 0, "noaa19 is left out"),
        ("near", "2024-03-09T18:00:00Z", 0, "2024-03-09 18:23:19"),
        ("pathf", "2025-01-03T12:00:00Z", 0, "sat  "),
        ("amsat2", "2024-03-09T12:00:00Z", 2, "checksum"),
        ("web", "2024-03-09T12:00:00Z", 2, "a notice"),
        ("web-html", "2024-03-09T12:00:00Z", 2, "a web page"),
        ("yd", "2024-03-09T12:00:00Z", 0, "sat  "),
        ("oem-duplicate", "2024-03-09T12:10:00Z", 0, "warning"),
        ("oem-cut", "2024-03-09T12:10:00Z", 0, "warning"),
        ("geo", "2024-03-09T12:00:00Z", 0, "does not set"),
    ],
)
def test_the_cases_that_people_sent_have_their_right_answers(case: str, start: str, code: int, said: str) -> None:
    done = acu_daemon("passes", "--config", CASES / case, "--from", start, "--days", "0.2" if "oem" in case else "1")
    assert done.code == code
    assert said in done.out + done.err


@pytest.mark.long
@needs_data
def test_a_list_of_16000_sets_is_searched(tmp_path: Path) -> None:
    packed = next((DATA / "tle_sets").glob("*.gz"))
    text = gzip.decompress(packed.read_bytes()).decode()
    began_s = time.process_time()
    sets, problems = parse_tle(text, "x")
    assert (len(sets), problems) == (16079, [])
    print(f"{len(sets)} sets in {time.process_time() - began_s:.2f} s of the processor")
    config(tmp_path, text, from_file("NOAA 20 (JPSS-1)", "tle", "s.txt"))
    done = acu_daemon("passes", "--config", tmp_path, "--from", "2026-08-18T12:00:00Z")
    assert (done.code, done.err) == (0, "")
