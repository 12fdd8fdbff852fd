"""Orbit ephemeris messages: KVN and XML give the same, and whatever is wrong is told with file and line."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_oems import START, States, kvn, source, states, xml

from acu_daemon.orbit.oem import parse_oem
from acu_daemon.orbit.timescales import tai_from_utc

Writer = Callable[..., str]
FORMS = pytest.mark.parametrize("write", [kvn, xml])
SHORT = states(300.0)


def reason(text: str) -> str:
    segments, [problem] = parse_oem(text, "x.oem")
    assert segments == []
    return str(problem)


@FORMS
def test_a_message_gives_its_states_in_metres_and_its_satellite(write: Writer) -> None:
    [segment], problems = parse_oem(write(SHORT), "x.oem")
    tai_s, r_m, v_m_s = SHORT
    assert problems == []
    assert (segment.label, segment.frame) == ("ISS (1998-067-A)", "TEME")
    assert (segment.start_tai_s, segment.end_tai_s) == (START, START + 300.0)
    assert np.array_equal(segment.tai_s, tai_s)
    assert np.abs(segment.r_m - r_m).max() < 1e-5
    assert np.abs(segment.v_m_s - v_m_s).max() < 1e-5


@given(count=st.integers(2, 6), segments=st.integers(1, 3), ends=st.sampled_from(["\n", "\r\n", "\r"]))
def test_kvn_and_xml_give_the_same(count: int, segments: int, ends: str) -> None:
    parts = [states(60.0 * (count - 1), start_tai_s=START + 1000.0 * k) for k in range(segments)]
    plain, no_problem = parse_oem("\ufeff" + kvn(*parts).replace("\n", ends), "x")
    tagged, none_either = parse_oem(xml(*parts).replace("\n", ends), "x")
    assert no_problem == none_either == []
    assert len(plain) == len(tagged) == segments
    for one, other in zip(plain, tagged, strict=True):
        assert (one.name, one.object_id, one.frame) == (other.name, other.object_id, other.frame)
        for key in ("start_tai_s", "end_tai_s", "tai_s", "r_m", "v_m_s"):
            assert np.array_equal(getattr(one, key), getattr(other, key))


@FORMS
def test_the_useable_span_is_the_span_and_the_states_beyond_it_stay(write: Writer) -> None:
    text = write(SHORT, USEABLE_START_TIME="2022-02-11T20:01:30", USEABLE_STOP_TIME="2022-02-11T20:04:00.5")
    [segment], [] = parse_oem(text, "x.oem")
    assert (segment.start_tai_s, segment.end_tai_s) == (START + 90.0, START + 240.5)
    assert segment.tai_s.size == 6


@pytest.mark.parametrize(("system", "ahead_of_tai_s"), [("UTC", -37.0), ("TAI", 0.0), ("gps", -19.0), ("TT", 32.184)])
@FORMS
def test_every_time_system_becomes_tai(write: Writer, system: str, ahead_of_tai_s: float) -> None:
    tai_s, r_m, v_m_s = SHORT
    [segment], [] = parse_oem(write((tai_s, r_m, v_m_s), TIME_SYSTEM=system), "x.oem")
    assert segment.tai_s == pytest.approx(tai_s - 37.0 - ahead_of_tai_s, abs=1e-6)  # the texts are those of UTC


@pytest.mark.parametrize("text", ["2022-042T20:00:00.000", "2022-042T20:00:00Z", "2022-02-11T20:00:00.000Z"])
def test_a_day_of_the_year_and_a_z_are_read(text: str) -> None:
    written = kvn(SHORT).replace("2022-02-11T20:00:00.000000  ", f"{text}  ")
    [segment], [] = parse_oem(written, "x.oem")
    assert segment.tai_s[0] == START


def test_a_leap_second_lies_between_its_neighbours() -> None:
    rows = "\n".join(
        f"{t} 7000 0 0 0 7.5 0" for t in ("2016-12-31T23:59:59", "2016-12-31T23:59:60", "2017-001T00:00:00")
    )
    head = "META_START\nCENTER_NAME=EARTH\nREF_FRAME=TEME\nTIME_SYSTEM=UTC\nMETA_STOP\n"
    [segment], [] = parse_oem(head + rows, "x")
    assert segment.tai_s == pytest.approx(tai_from_utc("2016-12-31T23:59:59Z") + np.arange(3.0), abs=1e-6)
    assert segment.name == "(no OBJECT_NAME)"


def test_accelerations_and_the_next_message_of_a_list_are_taken() -> None:
    text = "\n".join(f"{line} 0.1 0.2 0.3" if line.startswith("2022") else line for line in kvn(SHORT).split("\n"))
    segments, problems = parse_oem(text + kvn(states(120.0, start_tai_s=START + 600.0)), "x.oem")
    assert problems == []
    assert [one.tai_s.size for one in segments] == [6, 3]


@FORMS
@pytest.mark.parametrize(
    ("name", "frame"),
    [
        ("TEME", "TEME"),
        ("TOD", "TOD"),
        ("eme2000", "EME2000"),
        ("J2000", "EME2000"),
        ("GCRF", "GCRF"),
        ("ICRF", "GCRF"),
        ("ITRF", "ITRF"),
        ("ITRF-97", "ITRF"),
        ("ITRF2020", "ITRF"),
    ],
)
def test_frames_are_known_by_their_names(write: Writer, name: str, frame: str) -> None:
    [segment], [] = parse_oem(write(SHORT, REF_FRAME=name), "x.oem")
    assert segment.frame == frame


@FORMS
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"CENTER_NAME": "MARS"}, "CENTER_NAME is 'MARS'; only EARTH can be used"),
        ({"CENTER_NAME": ""}, "CENTER_NAME is missing"),
        ({"REF_FRAME": "TDR"}, "REF_FRAME is 'TDR'; TEME, TOD, EME2000, GCRF, ICRF, ITRF and ITRFyyyy can be used"),
        ({"REF_FRAME": ""}, "REF_FRAME is missing"),
        ({"REF_FRAME_EPOCH": "2022-01-01T00:00:00"}, "REF_FRAME_EPOCH: TEME can be used of date only"),
        ({"TIME_SYSTEM": "UT1"}, "TIME_SYSTEM is 'UT1'; UTC, TAI, TT, GPS can be used"),
        ({"TIME_SYSTEM": ""}, "TIME_SYSTEM is missing"),
        ({"USEABLE_STOP_TIME": "2022-02-11T20:00:00"}, "leaves nothing of the states"),
        ({"USEABLE_START_TIME": "soon"}, "'soon' is not a time"),
    ],
)
def test_metadata_that_cannot_be_used_is_refused_with_the_reason(
    write: Writer, changes: dict[str, str], said: str
) -> None:
    text = reason(write(SHORT, **changes))
    assert text.startswith("x.oem, line ")
    assert said in text


@FORMS
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("T20:02:00.000000", "T20:00:30.000000", "the times must rise, 2022-02-11T20:00:30.000000 does not"),
        ("2022-02-11T20:02:00.000000", "2022-02-31T20:02:00.000000", "no such date"),
        ("2022-02-11T20:02:00.000000", "2022-366T20:02:00.000000", "2022 has no day 366"),
        ("2022-02-11T20:02:00.000000", "now", "'now' is not a time"),
    ],
)
def test_a_bad_state_is_refused_with_its_line(write: Writer, old: str, new: str, said: str) -> None:
    good = write(SHORT)
    text = reason(good.replace(old, new))
    number = next(n for n, line in enumerate(good.split("\n"), start=1) if old in line)
    assert text.startswith(f"x.oem, line {number}: ")
    assert said in text


@FORMS
@pytest.mark.parametrize("word", ["nan", "inf", "1e999", "1_0", "x", "0x10"])
def test_what_is_no_number_is_refused(write: Writer, word: str) -> None:
    number = f"{SHORT[1][2, 1] / 1e3:.9f}"
    assert f"{word!r} is not a number" in reason(write(SHORT).replace(number, word))


def test_a_line_with_too_few_numbers_and_a_state_without_one_are_told() -> None:
    number = f"{SHORT[1][2, 1] / 1e3:.9f}"
    assert "is not a time with position and velocity" in reason(kvn(SHORT).replace(number, ""))
    _, r_m, _ = SHORT
    alone = re.sub(rf"(  {r_m[2, 2] / 1e3:.9f}).*", r"\1", kvn(SHORT))
    assert "is not a time with position and velocity" in reason(alone)
    assert "a stateVector without Y" in reason(xml(SHORT).replace(f'<Y units="km">{number}</Y>', ""))
    assert "'CENTER_NAME Earth' is not KEY = VALUE" in reason(
        kvn(SHORT).replace("CENTER_NAME          = Earth", "CENTER_NAME Earth")
    )


@FORMS
def test_a_bad_segment_loses_none_of_the_good_ones(write: Writer) -> None:
    later: States = states(300.0, start_tai_s=START + 600.0)
    segments, [problem] = parse_oem(write(SHORT, later).replace("T20:02:00.000000", "T20:02:00.0x", 1), "x.oem")
    assert [one.start_tai_s for one in segments] == [START + 600.0]
    assert "is not a time" in str(problem)


@FORMS
def test_one_state_is_not_enough(write: Writer) -> None:
    assert "1 states in the segment, at least 2 are needed" in reason(write(states(0.0)))


def rows_of(text: str) -> list[str]:
    return [line for line in text.split("\n") if line.startswith("2022-02-11T20:0")]


def test_a_state_that_stands_twice_is_left_out_with_a_note() -> None:
    text = kvn(SHORT)
    for row in (rows_of(text)[0], rows_of(text)[2], rows_of(text)[-1]):
        [segment], [] = parse_oem(text.replace(row, f"{row}\n{row}"), "x.oem")
        assert np.array_equal(segment.tai_s, SHORT[0])
        [note] = segment.notes
        assert note.endswith("this state stands twice: the second is left out")
    every = "\n".join(f"{line}\n{line}" if line in rows_of(text) else line for line in text.split("\n"))
    [segment], [] = parse_oem(every, "x.oem")
    assert np.array_equal(segment.tai_s, SHORT[0])
    assert "6 states, this the first, stand twice" in segment.notes[0]


def test_two_states_at_one_time_that_differ_are_refused() -> None:
    text = kvn(SHORT)
    first, second = rows_of(text)[1:3]
    other = f"{first.split()[0]}  {'  '.join(second.split()[1:])}"
    assert "does not: two states at one time, and they differ" in reason(text.replace(first, f"{first}\n{other}"))


def test_a_block_that_goes_back_in_time_is_refused() -> None:
    text = kvn(SHORT)
    rows = rows_of(text)
    assert "the times must rise, 2022-02-11T20:00:00.000000 does not" in reason(
        text.replace("\n".join(rows), "\n".join([*rows, *rows]))
    )
    assert "the times must rise" in reason(text.replace("\n".join(rows), "\n".join(rows[3:] + rows[:3])))
    assert "the times must rise" in reason(text.replace("\n".join(rows), "\n".join(reversed(rows))))


def test_segments_out_of_order_that_do_not_overlap_are_read_in_their_own_right() -> None:
    later = states(300.0, start_tai_s=START + 600.0)
    both, [] = parse_oem(kvn(later, SHORT), "x.oem")
    assert [one.start_tai_s for one in both] == [START + 600.0, START]
    spans = source(kvn(later, SHORT)).spans_tai_s
    assert spans == ((START, START + 300.0), (START + 600.0, START + 900.0))


@pytest.mark.parametrize("count", range(1, 60, 3))
def test_a_last_line_that_was_cut_costs_one_state_only(count: int) -> None:
    whole = kvn(SHORT).split("\nCOVARIANCE_START")[0].rstrip("\n")
    [segment], [] = parse_oem(whole[:-count], "x.oem")
    assert segment.tai_s.size == SHORT[0].size - 1
    assert segment.notes == (
        f"x.oem, line {whole.count(chr(10)) + 1}: the file ends within this line: the state is left out",
    )
    [segment], [] = parse_oem(whole, "x.oem")
    assert (segment.tai_s.size, segment.notes) == (SHORT[0].size, ())


def test_a_last_line_that_was_cut_and_got_a_line_end_is_left_out_too() -> None:
    whole = kvn(SHORT).split("\nCOVARIANCE_START")[0].rstrip("\n")
    [segment], [] = parse_oem(whole[:-30] + "\n\n", "x.oem")
    assert segment.tai_s.size == SHORT[0].size - 1


def test_a_bad_line_before_the_last_one_is_refused() -> None:
    text = kvn(SHORT)
    assert "is not a time with position and velocity" in reason(text.replace(rows_of(text)[-2], "2022-02-11T20"))


def test_an_xml_message_that_was_cut_has_the_states_before_the_cut() -> None:
    text = xml(SHORT)
    cut = text[: text.rindex("<stateVector>") + 60]
    [segment], [] = parse_oem(cut, "x.oem")
    assert segment.tai_s.size == SHORT[0].size - 1
    assert "the file ends here: the states before it are used" in segment.notes[0]


def test_unequal_steps_small_letters_and_exponents_of_fortran_are_read() -> None:
    tai_s, r_m, v_m_s = states(600.0, 20.0)
    kept = np.array([0, 1, 3, 5, 6, 9, 12, 14, 17, 20, 23, 26, 28, 30])
    text = kvn((tai_s[kept], r_m[kept], v_m_s[kept]))
    made = source(text).states_teme(tai_s)[0]
    assert np.abs(made - r_m).max() < 5.0
    number = f"{r_m[0, 0] / 1e3:.9f}"
    fortran = f"{r_m[0, 0] / 1e6:.12f}D+03"
    [segment], [] = parse_oem(text.replace(number, fortran).replace("META_START", "meta_start"), "x.oem")
    assert np.abs(segment.r_m - r_m[kept]).max() < 1e-3


@pytest.mark.parametrize("name", ["TEMEOFDATE", "TEME of date", "TEME_OF_DATE", "True of Date", "TOD"])
def test_frames_of_date_are_known_by_their_long_names(name: str) -> None:
    [segment], [] = parse_oem(kvn(SHORT, REF_FRAME=name), "x.oem")
    assert segment.frame == ("TEME" if name.startswith("TEME") else "TOD")


@pytest.mark.parametrize("trick", ["<!DOCTYPE oem [<!ENTITY a 'b'>]>", "<!DOCTYPE oem SYSTEM 'x'>"])
def test_xml_with_a_doctype_or_entities_is_not_read(trick: str) -> None:
    assert "x.oem, line 2: a DOCTYPE or ENTITY declaration" in reason(xml(SHORT).replace("<oem", f"{trick}<oem", 1))


@pytest.mark.parametrize(
    "text", ["", "nothing", "<xml", "<a/>", "&lt;", "<a>&b;</a>", "\x00", "<\ud800/>", "META_STOP\n1 2"]
)
def test_what_is_no_message_is_a_problem(text: str) -> None:
    assert reason(text).startswith("x.oem")


def test_xml_within_a_combined_message_with_prefixes_is_read() -> None:
    body = xml(SHORT).split("\n", 1)[1]
    for tag in ("segment", "metadata", "stateVector"):
        body = body.replace(f"<{tag}>", f"<n:{tag}>").replace(f"</{tag}>", f"</n:{tag}>")
    segments, problems = parse_oem(f"<ndm xmlns:n='urn:ccsds:schema:ndmxml'>{body}</ndm>", "x")
    assert problems == []
    assert [one.tai_s.size for one in segments] == [6]


@given(
    st.text() | st.builds(lambda start, rest: start + rest, st.sampled_from(["<", "META_START\n", "<a>"]), st.text())
)
def test_no_text_makes_the_parser_fail(text: str) -> None:
    segments, _ = parse_oem(text, "x")
    assert not segments


@given(data=st.data(), write=st.sampled_from([kvn, xml]))
def test_no_damage_to_a_message_makes_the_parser_fail(data: st.DataObject, write: Writer) -> None:
    text = list(write(SHORT, states(120.0, start_tai_s=START + 600.0)))
    for _ in range(data.draw(st.integers(1, 5))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(
            st.characters() | st.sampled_from('\n\r"<>&,=[]{}9e')
        )
    segments, problems = parse_oem("".join(text), "x")
    assert segments or problems
