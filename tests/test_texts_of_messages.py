"""The text of ephemeris and of mean-elements messages: which line belongs to what, and what a cut or bad line costs."""

from collections.abc import Callable
from typing import Any

import pytest

from acu_daemon.orbit.oem_text import OEM, STATE_KEYS, BadSegmentError, RawSegment, read_segments
from acu_daemon.orbit.omm_text import BadRecordError, Record, read_records

NUMBERS = ["1.10", "2.20", "3.30", "4.40", "5.50", "6.60"]
STATE = " ".join(NUMBERS)
META = "META_START\nOBJECT_NAME = ISS\nMETA_STOP\n"

# Ephemerides, KVN


def one(text: str) -> RawSegment:
    [segment] = read_segments(text)
    return segment


def test_fields_and_states_have_their_lines() -> None:
    found = one(f"CCSDS_OEM_VERS = 2.0\nCREATION_DATE = now\n{META}2026-01-01 {STATE}\n\n2026-01-02 {STATE} 7 8 9\n")
    assert (found.line, found.version, found.created) == (3, "2.0", "now")
    assert found.fields == {"OBJECT_NAME": "ISS"}
    assert found.states == [(6, "2026-01-01", NUMBERS), (8, "2026-01-02", NUMBERS)]
    assert (found.problem, found.notes) == (None, [])


@pytest.mark.parametrize("count", [5, 7, 8, 10])
def test_a_line_has_six_or_nine_numbers(count: int) -> None:
    line = "2026-01-01 " + " ".join(["1.0"] * count)
    found = one(f"{META}{line}\n2026-01-02 {STATE}\n")
    assert found.problem is not None
    assert (found.problem.line, found.states) == (4, [(5, "2026-01-02", NUMBERS)])
    expected = f"{line[:40]!r} is not a time with position and velocity (or accelerations too)"
    assert str(found.problem) == expected


def test_of_several_bad_lines_the_first_is_told() -> None:
    found = one("META_START\nOBJECT_NAME\n = 7\nMETA_STOP\n2026-01-01 1\n2026-01-01 2\n")
    assert found.problem is not None
    assert (found.problem.line, str(found.problem)) == (2, "'OBJECT_NAME' is not KEY = VALUE")
    assert one("META_START\n = 7\nA=\nMETA_STOP\n").fields == {"A": ""}
    other = one(f"{META}bad 1\nbad 2\n2026-01-02 {STATE}\n").problem
    assert other is not None
    assert other.line == 4


def test_covariances_comments_and_marks_of_data_are_passed_over() -> None:
    found = one(
        f"{META}COMMENT 1 2\nDATA_START\n2026-01-01 {STATE}\nCOVARIANCE_START\nEPOCH = 3\n1 2 3\nCOVARIANCE_STOP\n"
        f"2026-01-02 {STATE}\nDATA_STOP\n2026-01-03 {STATE}\n"
    )
    assert [epoch for _, epoch, _ in found.states] == ["2026-01-01", "2026-01-02", "2026-01-03"]
    assert found.problem is None


def test_the_next_message_of_a_file_has_its_own_header() -> None:
    first = f"CCSDS_OEM_VERS = 1.0\nCREATION_DATE = then\n{META}CREATION_DATE 1 2 3 4 5 6\n"
    second = f"CCSDS_OEM_VERS = 2.0\n{META}2026-01-01 {STATE}\n"
    found = read_segments(first + second)
    assert [(raw.version, raw.created) for raw in found] == [("1.0", "then"), ("2.0", "")]
    assert found[0].states == [(6, "CREATION_DATE", ["1", "2", "3", "4", "5", "6"])]


def test_without_metadata_there_is_no_segment() -> None:
    assert read_segments(f"META_STOP\n2026-01-01 {STATE}\n") == []
    assert read_segments(f"2026-01-01 {STATE}\n") == []


NOTE = "the file ends within this line: the state is left out"


@pytest.mark.parametrize(
    ("last", "is_cut"),
    [
        (f"2026-01-02 {STATE}", False),
        (f"2026-01-02 {STATE[:-1]}", True),
        (f"2026-01-02 {STATE}\n", False),
        (f"2026-01-02 {STATE[:-1]}\n", False),
        (f"2026-01-02 {STATE}0", False),
        ("2026-01-02 1.10 2.20", True),
        ("2026-01-02 1.10 2.20\n", True),
        ("2026", True),
    ],
)
def test_a_last_line_that_lost_digits_or_numbers_costs_its_state(last: str, is_cut: bool) -> None:
    found = one(f"{META}2026-01-01 {STATE}\n{last}")
    assert len(found.states) == (1 if is_cut else 2)
    assert (found.problem, found.notes) == (None, [(5, NOTE)] if is_cut else [])


def test_one_state_alone_that_was_cut_cannot_be_known_to_be() -> None:
    assert len(one(f"{META}2026-01-01 {STATE[:-1]}").states) == 1
    bad = one(f"{META}2026-01-01 1.10")
    assert bad.problem is not None
    assert bad.notes == []


def test_a_bad_line_before_the_last_one_stays_a_problem() -> None:
    found = one(f"{META}2026-01-01 {STATE}\nbad\n2026-01-02 {STATE[:-1]}")
    assert found.problem is not None
    assert (found.problem.line, found.notes, len(found.states)) == (5, [], 2)


@pytest.mark.parametrize("after", ["COVARIANCE_START\n1 2 3", "META_START\nOBJECT_NAME = X"])
def test_a_file_that_ends_elsewhere_loses_no_state(after: str) -> None:
    found = read_segments(f"{META}2026-01-01 {STATE}\n2026-01-02 {STATE[:-1]}\n{after}")
    assert len(found[0].states) == 2
    assert found[0].notes == []


# Ephemerides, XML


def vector(epoch: str, leave_out: str = "") -> str:
    leaves = zip(STATE_KEYS, NUMBERS, strict=True)
    inner = "".join(f"<{key}>{number}</{key}>" for key, number in leaves if key != leave_out)
    return f"<stateVector>{'' if leave_out == 'EPOCH' else f'<EPOCH> {epoch} </EPOCH>'}{inner}</stateVector>\n"


def message(*vectors: str, meta: str = "<OBJECT_NAME> ISS </OBJECT_NAME>", root: str = 'oem version=" 2.0 "') -> str:
    body = f"<segment><metadata>{meta}</metadata><data>\n{''.join(vectors)}</data></segment>"
    return f"<{root}><header><CREATION_DATE> now </CREATION_DATE></header>\n<body>{body}</body></{root.split()[0]}>"


def test_xml_gives_the_same_with_the_lines_of_its_elements() -> None:
    found = one(message(vector("2026-01-01"), vector("2026-01-02")))
    assert (found.line, found.version, found.created) == (2, "2.0", "now")
    assert found.fields == {"OBJECT_NAME": "ISS"}
    assert found.states == [(3, "2026-01-01", NUMBERS), (4, "2026-01-02", NUMBERS)]


@pytest.mark.parametrize("key", ["EPOCH", *STATE_KEYS])
def test_a_state_without_a_number_is_told_by_its_name(key: str) -> None:
    found = one(message(vector("2026-01-01", key), vector("2026-01-02", "EPOCH"), vector("2026-01-03")))
    assert found.problem is not None
    assert (found.problem.line, str(found.problem)) == (3, f"a stateVector without {key}")
    assert [line for line, *_ in found.states] == [5]


def test_the_header_of_each_message_is_its_own_and_of_two_leaves_the_first_counts() -> None:
    both = message(vector("2026-01-01")) + message(vector("2026-01-02"), meta="<A>1</A><A>2</A>", root="oem").replace(
        "<CREATION_DATE> now </CREATION_DATE>", ""
    )
    found = read_segments(f"<ndm>{both}</ndm>")
    assert [(raw.version, raw.created) for raw in found] == [("2.0", "now"), ("", "")]
    assert found[1].fields == {"A": "1"}


def test_a_row_outside_a_segment_is_nobodys() -> None:
    assert read_segments(f"<oem>{vector('2026-01-01')}<metadata><A>1</A></metadata></oem>") == []


def test_xml_that_was_cut_has_the_states_before_the_cut_and_a_note() -> None:
    text = message(vector("2026-01-01"), vector("2026-01-02"))
    found = one(text[: text.rindex("<stateVector>") + 20])
    assert (len(found.states), found.notes) == (1, [(4, "the file ends here: the states before it are used")])
    with pytest.raises(BadSegmentError, match="not XML: ") as told:
        read_segments(text[: text.index("<stateVector>") + 20])
    assert told.value.line == 3


def test_xml_that_is_wrong_in_its_midst_is_not_read() -> None:
    text = message(vector("2026-01-01"), vector("2026-01-02")).replace("</data>", "</date>")
    with pytest.raises(BadSegmentError, match="not XML: mismatched tag") as told:
        read_segments(text)
    assert told.value.line == 5
    with pytest.raises(BadSegmentError, match="characters that are none") as none:
        read_segments("<\ud800/>")
    assert none.value.line is None


def test_the_form_is_told_by_the_first_character() -> None:
    assert OEM.is_read_cut
    assert one(" \n" + message(vector("2026-01-01"))).line == 3


# Mean elements


def records(text: str) -> list[Any]:
    return [
        (one.fields, one.line, one.record) if isinstance(one, Record) else (str(one), one.line, one.record)
        for one in read_records(text)
    ]


def test_kvn_parts_messages_at_a_version_or_at_a_key_that_comes_again() -> None:
    text = "\nCCSDS_OMM_VERS = 2.0\nCOMMENT x\nname = A [km]\nMETA_START\n\n"
    text += "CCSDS_OMM_VERS = 2.0\nNAME = B\nname = C [x] y\n"
    assert records(text) == [
        ({"CCSDS_OMM_VERS": "2.0", "NAME": "A"}, 2, None),
        ({"CCSDS_OMM_VERS": "2.0", "NAME": "B"}, 7, None),
        ({"NAME": "C [x] y"}, 9, None),
    ]


def test_a_line_of_kvn_that_is_none_is_told_and_loses_nothing() -> None:
    assert records("A = 1\nnonsense\n= 3\nB = 2\n") == [
        ("'nonsense' is not KEY = VALUE", 2, None),
        ("'= 3' is not KEY = VALUE", 3, None),
        ({"A": "1", "B": "2"}, 1, None),
    ]
    assert records("\n\n") == []


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_csv_is_known_by_what_parts_its_columns(mark: str) -> None:
    text = f"\n\nname{mark} Epoch\nA{mark} 1 \n#B{mark}2{mark}3\nC\n{mark}\nD{mark}4{mark}\nE{mark}5{mark}6\n"
    assert records(text) == [
        ({"NAME": "A", "EPOCH": "1"}, 4, None),
        ("1 values, the header names 2", 6, None),
        ({"NAME": "", "EPOCH": ""}, 7, None),
        ({"NAME": "D", "EPOCH": "4"}, 8, None),
        ("3 values, the header names 2", 9, None),
    ]


def test_a_first_line_with_an_equals_sign_is_kvn_whatever_else_it_has() -> None:
    assert records("A = 1, 2\n") == [({"A": "1, 2"}, 1, None)]


def test_csv_that_is_none_says_its_line() -> None:
    [(said, line, record)] = records("\nA,B\n" + '"' + "x" * 200_000 + '",2\n')
    assert said.startswith("not CSV: field larger")
    assert (line, record) == (3, None)


def test_json_is_a_list_an_object_or_objects_in_a_row_and_deeper_ones_are_found() -> None:
    assert records('[{"epoch": 1}, {"Epoch": " 2 "}]') == [({"EPOCH": "1"}, None, 1), ({"EPOCH": "2"}, None, 2)]
    assert records('{"EPOCH": 1}\n{"EPOCH": 2}') == [({"EPOCH": "1"}, None, 1), ({"EPOCH": "2"}, None, 2)]
    deep = '{"all": [{"meta": {"NORAD_CAT_ID": 7}, "list": [1], "none": null}], "x": [[{"ECCENTRICITY": 0.1}]]}'
    assert records(deep) == [({"NORAD_CAT_ID": "7"}, None, 1), ({"ECCENTRICITY": "0.1"}, None, 2)]


@pytest.mark.parametrize("key", ["EPOCH", "MEAN_MOTION", "NORAD_CAT_ID", "ECCENTRICITY"])
def test_an_object_with_any_field_of_a_record_is_one(key: str) -> None:
    assert records(f'[{{"{key}": 1, "OTHER": true}}]') == [({key: "1", "OTHER": "True"}, None, 1)]


def test_what_is_no_record_is_told_with_its_number() -> None:
    none = "not an object with the fields of an OMM"
    assert records('[{"EPOCH": 1}, 7, {"a": 1}, {"EPOCH": 2}]') == [
        ({"EPOCH": "1"}, None, 1),
        (none, None, 2),
        (none, None, 3),
        ({"EPOCH": "2"}, None, 4),
    ]


def test_json_that_was_cut_gives_what_is_whole() -> None:
    first, (said, line, record) = records('[{"EPOCH": 1},\n{"EPO')
    assert first == ({"EPOCH": "1"}, None, 1)
    assert said.startswith("not JSON: Unterminated string")
    assert (line, record) == (2, None)
    [(deep, *_)] = records('{"a":' * 100_000)
    assert deep == "not JSON: nested too deep, or a number too long"


@pytest.mark.parametrize("start", ["", "  \n"])
def test_xml_records_are_segments_else_messages_and_are_numbered_through_all_parts(start: str) -> None:
    segments = (
        '<?xml version="1.0"?><ndm xmlns="urn:x"><omm><segment><a> 1 </a></segment><segment><b/></segment></omm></ndm>'
    )
    messages = '<?xml version="1.0"?><ndm><omm><c>3</c></omm></ndm>'
    assert records(start + segments + messages) == [
        ({"A": "1"}, None, 1),
        ({"B": ""}, None, 2),
        ({"C": "3"}, None, 3),
    ]


def test_xml_that_is_none_loses_none_of_the_other_parts() -> None:
    part = '<?xml version="1.0"?><omm><c>3</c></omm>'
    (said, line, record), good = records(f"<a>{part}")
    assert said.startswith("not XML: ")
    assert (line, record, good) == (None, None, ({"C": "3"}, None, 1))


@pytest.mark.parametrize("trick", ["<!DOCTYPE a>", "<!  entity a 'b'>"])
def test_declarations_end_it(trick: str) -> None:
    [(said, *_)] = records(f"{trick}<omm><c>3</c></omm>")
    assert said.startswith("a DOCTYPE or ENTITY declaration")


def test_errors_say_where_they_are() -> None:
    made: list[Callable[..., Any]] = [BadRecordError, BadSegmentError]
    assert (made[0]("x", 3, 4).line, made[0]("x", 3, 4).record, made[1]("x", 5).line) == (3, 4, 5)
