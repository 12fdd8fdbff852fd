"""Orbit mean-elements messages in their four forms, against the same elements as a TLE."""

import json
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle

TLE = """1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996
2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325546
"""
FIELDS = {
    "OBJECT_NAME": "ISS (ZARYA)",
    "OBJECT_ID": "1998-067A",
    "EPOCH": "2022-02-10T13:19:06.231072",
    "MEAN_MOTION": "15.49692082",
    "ECCENTRICITY": ".000567",
    "INCLINATION": "51.6412",
    "RA_OF_ASC_NODE": "243.7057",
    "ARG_OF_PERICENTER": "116.5714",
    "MEAN_ANOMALY": "333.9560",
    "EPHEMERIS_TYPE": "0",
    "CLASSIFICATION_TYPE": "U",
    "NORAD_CAT_ID": "25544",
    "ELEMENT_SET_NO": "999",
    "REV_AT_EPOCH": "32554",
    "BSTAR": ".12771E-3",
    "MEAN_MOTION_DOT": ".6763E-4",
    "MEAN_MOTION_DDOT": "0",
}
HEADER = {"CENTER_NAME": "EARTH", "REF_FRAME": "TEME", "TIME_SYSTEM": "UTC", "MEAN_ELEMENT_THEORY": "SGP4"}


def kvn(*records: Mapping[str, str]) -> str:
    def one(record: Mapping[str, str]) -> str:
        lines = [f"{key:<20}= {value}" for key, value in {**HEADER, **record}.items()]
        return "\n".join(["CCSDS_OMM_VERS = 2.0", "COMMENT one = two", "ORIGINATOR = 18 SPCS", "", *lines])

    return "\n".join(one(record) for record in records) + "\n"


def xml(*records: Mapping[str, str]) -> str:
    def one(record: Mapping[str, str]) -> str:
        tags = {key: f"<{key}>{value}</{key}>" for key, value in {**HEADER, **record}.items()}
        metadata = "".join(tags.pop(key) for key in ("OBJECT_NAME", "OBJECT_ID", *HEADER) if key in tags)
        return (
            f"<omm id='CCSDS_OMM_VERS' version='2.0'><header><ORIGINATOR/></header><body><segment>"
            f"<metadata>{metadata}</metadata><data><meanElements>{''.join(tags.values())}</meanElements></data>"
            "</segment></body></omm>"
        )

    body = "".join(one(record) for record in records)
    return f"<?xml version='1.0' encoding='UTF-8'?>\n<ndm xmlns='urn:ccsds:schema:ndmxml'>{body}</ndm>\n"


def json_list(*records: Mapping[str, str]) -> str:
    def value(text: str) -> str | float:
        try:
            return int(text) if text.isdigit() else float(text)
        except ValueError:
            return text

    return json.dumps([{key: value(text) for key, text in record.items()} for record in records])


def csv_list(*records: Mapping[str, str]) -> str:
    header = list(dict.fromkeys(key for record in records for key in record))
    rows = [",".join(record.get(key, "") for key in header) for record in records]
    return "\r\n".join([",".join(header), *rows]) + "\r\n"


FORMS = pytest.mark.parametrize("write", [kvn, xml, json_list, csv_list])
Writer = Callable[..., str]


def positions_m(elements: ElementSet) -> np.ndarray:
    return Sgp4Propagator(elements).states_teme(elements.epoch_tai_s + np.arange(0.0, 86400.0, 600.0))[0]


@FORMS
def test_every_form_gives_the_satellite_of_the_same_tle(write: Writer) -> None:
    [one], [] = parse_omm(write(FIELDS), "iss.omm")
    [same], [] = parse_tle(TLE, "iss.tle")
    assert (one.kind, one.name, one.norad_id) == ("omm", "ISS (ZARYA)", 25544)
    assert one.epoch_tai_s == pytest.approx(same.epoch_tai_s, abs=1e-3)
    assert np.max(np.abs(positions_m(one) - positions_m(same))) < 1.0


@FORMS
def test_a_list_is_read_and_a_bad_record_loses_none_of_the_good_ones(write: Writer) -> None:
    bad = {**FIELDS, "MEAN_MOTION": "fast"}
    sets, problems = parse_omm(write(FIELDS, bad, {**FIELDS, "NORAD_CAT_ID": "799500001"}), "list.omm")
    assert [one.norad_id for one in sets] == [25544, 799500001]
    assert len(problems) == 1
    assert "MEAN_MOTION is 'fast', not a number" in str(problems[0])
    assert str(problems[0]).startswith(("list.omm, line ", "list.omm, record 2: "))


@FORMS
@pytest.mark.parametrize("key", ["NORAD_CAT_ID", "EPOCH", "MEAN_MOTION", "ECCENTRICITY", "MEAN_ANOMALY", "BSTAR"])
def test_a_missing_field_is_named(write: Writer, key: str) -> None:
    sets, [problem] = parse_omm(write({k: v for k, v in FIELDS.items() if k != key}), "x")
    assert not sets
    assert str(problem).endswith(f"{key} is missing")


@FORMS
@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("MEAN_MOTION", "nan", "MEAN_MOTION is 'nan', not a number"),
        ("MEAN_MOTION", "0", "outside 1e-06..20"),
        ("ECCENTRICITY", "1.5", "ECCENTRICITY is 1.5, outside 0..1"),
        ("INCLINATION", "-3.0", "INCLINATION is -3.0, outside 0..180"),
        ("NORAD_CAT_ID", "twelve", "NORAD_CAT_ID is 'twelve', not a catalogue number"),
        ("EPOCH", "yesterday", "EPOCH is 'yesterday', not a UTC time"),
        ("EPHEMERIS_TYPE", "4", "EPHEMERIS_TYPE is '4'; only 0 or 2 or 3 can be used with SGP4"),
        ("MEAN_ELEMENT_THEORY", "DSST", "MEAN_ELEMENT_THEORY is 'DSST'; only SGP4 or SGP/SGP4 can be used with SGP4"),
        ("REF_FRAME", "EME2000", "REF_FRAME is 'EME2000'; only TEME can be used with SGP4"),
    ],
)
def test_a_value_that_cannot_be_used_is_refused_with_the_reason(
    write: Writer, key: str, value: str, reason: str
) -> None:
    sets, [problem] = parse_omm(write({**FIELDS, key: value}), "x")
    assert not sets
    assert reason in str(problem)


@FORMS
@pytest.mark.parametrize("number", ["100000", "T0001", "799500001"])
def test_long_and_alpha_5_catalogue_numbers_are_read(write: Writer, number: str) -> None:
    [one], [] = parse_omm(write({**FIELDS, "NORAD_CAT_ID": number}), "x")
    assert one.norad_id == {"T0001": 270001}.get(number) or one.norad_id == int(number)


def test_a_kvn_message_may_carry_units_and_windows_line_ends() -> None:
    text = kvn({**FIELDS, "INCLINATION": "51.6412 [deg]"}).replace("\n", "\r\n")
    [one], [] = parse_omm("\ufeff" + text, "x")
    assert one.inclination_rad == pytest.approx(np.radians(51.6412))
    assert one.line == 1


def test_a_csv_record_says_its_line() -> None:
    problems = parse_omm(csv_list(FIELDS, {**FIELDS, "BSTAR": "x"}) + "1,2\r\n", "x.csv")[1]
    assert [str(one) for one in problems] == [
        "x.csv, line 3: BSTAR is 'x', not a number",
        "x.csv, line 4: 2 values, the header names 17",
    ]


@pytest.mark.parametrize("trick", ["<!DOCTYPE omm [<!ENTITY a 'b'>]>", "<! doctype omm>", "<!entity a 'b'>"])
def test_xml_with_a_doctype_or_entities_is_not_read(trick: str) -> None:
    sets, [problem] = parse_omm(xml(FIELDS).replace("<ndm", f"{trick}<ndm"), "x.xml")
    assert not sets
    assert "a DOCTYPE or ENTITY declaration" in str(problem)


@pytest.mark.parametrize(
    "text", ["", "No GP data found", "<xml", "[1, 2]", "{", "[" * 100000, "[]", "a,b\n1,2\n", "<a/>"]
)
def test_what_is_no_message_is_a_problem(text: str) -> None:
    sets, problems = parse_omm(text, "x")
    assert not sets
    assert problems
    assert all(str(problem).startswith("x") for problem in problems)


@given(st.text() | st.builds(lambda start, rest: start + rest, st.sampled_from(["<", "{", "[", "A,", "A="]), st.text()))
def test_no_text_makes_the_parser_fail(text: str) -> None:
    sets, _ = parse_omm(text, "x")
    assert not sets


@given(data=st.data(), write=st.sampled_from([kvn, xml, json_list, csv_list]))
def test_no_damage_to_a_message_makes_the_parser_fail(data: st.DataObject, write: Writer) -> None:
    text = list(write(FIELDS, FIELDS))
    for _ in range(data.draw(st.integers(1, 5))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.characters() | st.sampled_from('\n\r"<>,=[]{}9e'))
    sets, problems = parse_omm("".join(text), "x")
    assert sets or problems
