"""Which segments of an ephemeris are a satellite's, which lost set is, which set is nearest; what a file is at all."""

from dataclasses import replace

import numpy as np
import pytest
from test_elements import ISS, NOW, aged

from acu_daemon.errors import ElementsError
from acu_daemon.orbit.contents import binary_kind, decoded, kind_of, what_else
from acu_daemon.orbit.element_set import Problem
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
from acu_daemon.orbit.selection import _is_slip, is_of, nearest_epoch_tai_s, select_elements, select_segments
from acu_daemon.units import DAY_S


def segment(
    name: str = "GRACE-FO 1", object_id: str = "2018-047A", version: str = "2.0", kind: str = "oem"
) -> EphemerisSegment:
    none = np.zeros((2, 3))
    return EphemerisSegment(
        kind, version, name, object_id, "TEME", NOW, NOW + 1.0, None, NOW + np.arange(2.0), none, none, "f.oem", 3
    )  # type: ignore[arg-type]


ONE, OTHER = segment(), segment("GRACE-FO 2", "2018-047B")


def refusal(*segments: EphemerisSegment, norad_id: int | None, name: str, is_whole: bool = True) -> str:
    with pytest.raises(ElementsError) as told:
        select_segments(segments, norad_id, name, is_whole=is_whole)
    return str(told.value)


@pytest.mark.parametrize(
    "name", ["GRACE-FO 1", "grace fo1", "Grace_FO-1", "2018-047A", "2018 047a", "grace", "GRACE-FO 1 (C)"]
)
def test_a_file_of_one_satellite_is_taken_without_a_word_where_its_name_or_designator_is_alike(name: str) -> None:
    assert select_segments([ONE], 43476, name) == ([ONE], [])
    assert select_segments([ONE, ONE], None, name) == ([ONE, ONE], [])


def test_of_another_name_it_is_taken_with_a_warning_unless_the_number_is_its() -> None:
    told = ["f.oem: the file is of GRACE-FO 1 (2018-047A), the satellite is named 'swarm': is it the right file?"]
    assert select_segments([ONE], 43476, "swarm") == ([ONE], told)
    numbered = segment(object_id="43476")
    assert select_segments([numbered], 43476, "swarm") == ([numbered], [])
    assert select_segments([segment(object_id="043476")], 43476, "swarm")[1] == []


def test_a_catalogue_number_that_is_anothers_is_never_taken() -> None:
    numbered = segment(object_id="43477")
    assert refusal(numbered, norad_id=43476, name="GRACE-FO 1") == (
        "f.oem: no segment with name 'GRACE-FO 1' or with norad_id 43476; the file holds GRACE-FO 1 (43477): "
        "write one's name or designator as the satellite's name"
    )
    assert select_segments([numbered], None, "GRACE-FO 1") == ([numbered], [])


@pytest.mark.parametrize("name", ["GRACE-FO 2", "grace fo2", "2018-047B", "2018047b"])
def test_of_several_satellites_the_name_or_the_designator_must_be_the_very_one(name: str) -> None:
    assert select_segments([ONE, OTHER, ONE, OTHER], None, name) == ([OTHER, OTHER], [])
    assert "no segment with name 'GRACE'; the file holds GRACE-FO 1 (2018-047A), GRACE-FO 2 (2018-047B)" in refusal(
        ONE, OTHER, norad_id=None, name="GRACE"
    )


def test_of_several_the_number_finds_its_own_whatever_the_name() -> None:
    numbered = [segment(object_id="43476"), segment("GRACE-FO 2", "43477")]
    assert select_segments(numbered, 43477, "mine") == ([numbered[1]], [])


def test_of_a_file_that_is_not_whole_one_that_is_left_must_be_named_too() -> None:
    assert select_segments([ONE], None, "grace-fo 1", is_whole=False) == ([ONE], [])
    assert "no segment with name 'grace'" in refusal(ONE, norad_id=None, name="grace", is_whole=False)


def test_a_name_that_two_bear_needs_the_designator() -> None:
    twin = segment(object_id="2018-047C")
    assert refusal(ONE, twin, norad_id=None, name="GRACE-FO 1") == (
        "f.oem: the name 'GRACE-FO 1' fits GRACE-FO 1 (2018-047A), GRACE-FO 1 (2018-047C); write one's designator as "
        "the satellite's name"
    )
    assert select_segments([ONE, twin], None, "2018-047C") == ([twin], [])


@pytest.mark.parametrize(
    ("kind", "version", "said"),
    [
        ("oem", "1.0", None), ("oem", "2.0", None), ("oem", "3.0", None), ("cpf", "2", None), ("sp3", "", None),
        ("oem", "4.0", "f.oem: CCSDS_OEM_VERS is '4.0'; versions 1.0, 2.0, 3.0 are known"),
        ("oem", "", "f.oem: CCSDS_OEM_VERS is missing; versions"),
    ],
)  # fmt: skip
def test_a_version_that_is_not_known_is_told(kind: str, version: str, said: str | None) -> None:
    _, warnings = select_segments([segment(kind=kind, version=version)], None, "GRACE-FO 1")
    assert [one.startswith(said or "") for one in warnings] == ([] if said is None else [True])


# Sets


@pytest.mark.parametrize(
    ("numbers", "bears", "norad_id", "name", "is_its"),
    [
        ((25544,), "OTHER", 25544, "ISS", True),
        ((7, 25544), "", 25544, "ISS", True),
        ((7,), "ISS", 25544, "ISS", False),  # another number counts before the name
        ((), "iss", 25544, "ISS", True),
        ((7,), "I-S S [+]", None, "ISS", True),
        ((7,), "ISS 2", None, "ISS", False),
        ((), "", None, "", False),
        ((), "", 25544, "", False),
    ],
)
def test_a_lost_set_is_a_satellites_by_its_number_else_by_its_name(
    numbers: tuple[int, ...], bears: str, norad_id: int | None, name: str, is_its: bool
) -> None:
    assert is_of(Problem("f", 1, "cut", norad_ids=numbers, name=bears), norad_id, name) == is_its


@pytest.mark.parametrize(
    ("one", "other", "is_slip"),
    [
        ("25544", "25545", True), ("25544", "15544", True), ("25544", "52544", True), ("25544", "25454", True),
        ("25544", "25544", False), ("25544", "25565", False), ("25544", "35545", False), ("12345", "14325", False),
        ("25544", "255440", False), ("25544", "2554", False), ("12345", "21435", False), ("12345", "23345", False),
    ],
)  # fmt: skip
def test_a_slip_is_one_wrong_digit_or_two_neighbours_changed(one: str, other: str, is_slip: bool) -> None:
    assert _is_slip(one, other) == is_slip == _is_slip(other, one)


def test_of_two_epochs_as_near_the_older_one_is_taken() -> None:
    assert nearest_epoch_tai_s([3.0, 1.0, 7.0], 2.0) == 1.0
    assert nearest_epoch_tai_s([3.0, 1.0, 7.0], 2.01) == 3.0
    assert nearest_epoch_tai_s([3.0, 1.0, 7.0], 1e9) == 7.0


@pytest.mark.parametrize(
    ("days", "used", "following"),
    [
        ((-1.0, 5.0), "24.0 h before", "5.0 days after"),
        ((1.0, -2.0, 9.0), "24.0 h after", "48.0 h before"),
        ((-2.01, 3.0), "2.0 days before", "3.0 days after"),
        ((2.01, 2.5), "2.0 days after", "2.5 days after"),
        ((0.0, 1.0), "0.0 h before", "24.0 h after"),
    ],
)
def test_how_far_the_set_and_the_next_one_are_is_told_in_hours_up_to_two_days(
    days: tuple[float, ...], used: str, following: str
) -> None:
    selected = select_elements([replace(ISS, epoch_tai_s=aged(one)) for one in days], 25544, None, NOW)
    assert f"of {len(days)} sets the one of" in selected.why
    assert f" is used, {used} 20" in selected.why
    assert f"; the next is {following} 20" in selected.why
    assert selected.epochs_tai_s == tuple(sorted(aged(one) for one in days))


def test_two_sets_of_one_epoch_count_once_and_the_first_is_used() -> None:
    twice = [replace(ISS, line=1), replace(ISS, line=4), replace(ISS, epoch_tai_s=NOW - DAY_S, line=7)]
    selected = select_elements(twice, None, "ISS", NOW)
    assert selected.elements.line == 1
    assert "of 2 sets" in selected.why
    assert len(selected.epochs_tai_s) == 2


def test_the_one_satellite_left_of_a_file_that_is_not_whole_must_be_the_one() -> None:
    with pytest.raises(ElementsError, match="no element set with name 'mine'"):
        select_elements([ISS], None, "mine", NOW, is_whole=False)
    assert select_elements([ISS], None, "iss (zarya)", NOW, is_whole=False).warnings == []
    assert select_elements([ISS], None, "ISS", NOW).warnings == []
    [warning] = select_elements([ISS], None, "swarm", NOW).warnings
    assert (
        warning == "iss.tle: the file is of ISS (ZARYA) (25544), the satellite is named 'swarm': is it the right file?"
    )
    assert select_elements([ISS], 25544, "swarm", NOW).warnings == []


# What a file is

TLE = "1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996\n"


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        (TLE, "tle"),
        ("ISS\n  " + TLE, "tle"),
        ("2 A0001  51.6\n", "tle"),
        ("3 25544U\n", None),
        ("H1 CPF  2 ESA\n", "cpf"),
        ("00 a comment\n00 another\nh1 cpf 1\n", "cpf"),
        ("x\nH1 CPF 2\n", None),
        ("#dP2024  1  1\n", "sp3"),
        ("#cV2024  1  1\n", "sp3"),
        ("#eP2024  1  1\n", None),
        ('[{"OBJECT_NAME": "1 25544 A", "NORAD_CAT_ID": 5}]', "omm"),
        ('{"MEAN_MOTION": 15}', "omm"),
        ("OBJECT_NAME,NORAD_CAT_ID,EPOCH\nA,1,2\n" + TLE, "omm"),
        ("CCSDS_OMM_VERS = 2.0\n", "omm"),
        ("<omm id='1'>", "omm"),
        ("CCSDS_OEM_VERS = 2.0\nMEAN_MOTION = 1\n", "oem"),
        ("META_START\n", "oem"),
        ("<ndm><oem>", "oem"),
        ("<html><title>CCSDS_OEM_VERS and NORAD_CAT_ID</title>", None),
        ("<html>" + "\n" + TLE, "tle"),
        ("nothing", None),
        ("", None),
    ],
)
def test_the_format_is_known_by_words_that_only_it_has(text: str, kind: str | None) -> None:
    assert kind_of(text) == kind


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"PK\x03\x04", "a zip archive: unpack it"), (b"BZh9", "a bzip2 archive: unpack it with bunzip2"),
        (b"%PDF-1.4", "a PDF document"), (b"a\0b", "no text: a binary file"), (b"text\0\0\x1a", ""), (b"", ""),
        (b"\xff\xfea\0b\0", ""), (b"\xfe\xff\0a\0b", ""), (b"x" * 1000 + b"\0y", ""), (b" PK\x03\x04", ""),
    ],
)  # fmt: skip
def test_what_is_no_text_is_known_by_its_first_bytes(data: bytes, what: str) -> None:
    assert binary_kind(data) == what


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"a\r\nb\rc\n", "a\nb\nc\n"), (b"\xef\xbb\xbfa", "a"), ("ä\n".encode("utf-16"), "ä\n"),
        (b"\xfe\xff" + "ä".encode("utf-16-be"), "ä"), (b"\xff", "\ufffd"), ("ä".encode(), "ä"),
    ],
)  # fmt: skip
def test_text_is_read_in_its_code_with_plain_line_ends(data: bytes, text: str) -> None:
    assert decoded(data) == text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (" \0\x1a\n", "the file is empty"),
        ("<html><script>x()</script><h1>Log in</h1>", "a web page, not elements: 'Log in'"),
        ("<error code='3'>none</error>", "XML, but no elements: 'none'"),
        ("[]", "an empty JSON answer: no satellite fits what was asked"),
        ('{"error": ["over", 7]}', "a JSON answer, not elements: 'error: over 7'"),
        ('{"error"', "JSON that cannot be read, not elements: '{\"error\"'"),
        ("  Sorry,\n no\tdata ", "a notice, not elements: 'Sorry, no data'"),
        ("x" * 160, f"a notice, not elements: '{'x' * 160}'"),
        ("x" * 161, f"a notice, not elements: '{'x' * 160}...'"),
    ],
)
def test_what_stands_in_place_of_elements_is_quoted(text: str, said: str) -> None:
    assert what_else(text) == said
