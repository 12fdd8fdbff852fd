"""Orbit mean-elements messages in their four forms, against the same elements as a TLE."""

import json
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sgp4 import exporter
from sgp4.api import Satrec

from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_ccsds, tai_from_utc
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


EPOCH = "2022-02-10T13:19:06.231072"


@FORMS
@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("EPOCH", "2022-041T13:19:06.231072"), ("EPOCH", f"{EPOCH}Z"), ("EPOCH", f"{EPOCH}000000000")),
        *(("EPOCH", "2022-02-10 13:19:06.231072"), ("EPOCH", f"{EPOCH}+00:00"), ("EPOCH", "2022-041t13:19:06.231072z")),
        *(("NORAD_CAT_ID", "0025544"), ("NORAD_CAT_ID", " 25544 "), ("NORAD_CAT_ID", "25544.0")),
        *(("BSTAR", "0.12771D-03"), ("BSTAR", "+1.2771e-4"), ("MEAN_MOTION", "1.549692082E+01")),
        *(("ECCENTRICITY", "5.67E-04"), ("RA_OF_ASC_NODE", "-116.2943"), ("INCLINATION", "051.6412")),
        *(("MEAN_ELEMENT_THEORY", "sgp/sgp4"), ("MEAN_ELEMENT_THEORY", "SGP"), ("MEAN_ELEMENT_THEORY", "SDP4")),
        *(("REF_FRAME", "TEME OF DATE"), ("REF_FRAME", "TEMEOFDATE"), ("REF_FRAME", "teme")),
        *(("REF_FRAME", "True Equator Mean Equinox of Date"), ("CENTER_NAME", "Earth"), ("EPHEMERIS_TYPE", "")),
        *(("EPHEMERIS_TYPE", "00"), ("EPHEMERIS_TYPE", "SGP4"), ("MEAN_MOTION_DDOT", "none"), ("OBJECT_ID", "")),
    ],
)
def test_a_field_is_read_as_people_write_it(write: Writer, key: str, value: str) -> None:
    [one], problems = parse_omm(write({**FIELDS, key: value}), "x")
    [same], [] = parse_omm(write(FIELDS), "x")
    assert problems == []
    assert np.max(np.abs(positions_m(one) - positions_m(same))) < 0.01
    assert one.norad_id == 25544


@pytest.mark.parametrize(
    ("text", "utc"),
    [
        *(("2024-069T12:00:00", "2024-03-09T12:00:00Z"), ("2024-069T12:00", "2024-03-09T12:00:00Z")),
        *(("2024-366T12:00:00.5", "2024-12-31T12:00:00.5Z"), ("2016-366T23:59:60", "2016-12-31T23:59:60Z")),
        *(("1957-001T00:00:00.", "1957-01-01T00:00:00Z"), ("2056-12-31 23:59:59 UTC", "2056-12-31T23:59:59Z")),
    ],
)
def test_times_of_messages_are_read_in_their_forms(text: str, utc: str) -> None:
    assert tai_from_ccsds(text) == tai_from_utc(utc)


@pytest.mark.parametrize("text", ["2023-366T00:00:00", "2024-000T00:00:00", "2024-13-01T00:00:00", "24-069T12:00:00"])
def test_what_is_no_time_or_of_two_meanings_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected|no day|no such date"):
        tai_from_ccsds(text)
    with pytest.raises(ValueError, match="expected"):
        tai_from_ccsds("2024-03-09T12:00:00+02:00")


def test_a_time_system_that_is_not_utc_is_turned_into_it() -> None:
    [gps], [] = parse_omm(kvn({**FIELDS, "TIME_SYSTEM": "GPS"}), "x")
    [utc], [] = parse_omm(kvn(FIELDS), "x")
    assert utc.epoch_tai_s - gps.epoch_tai_s == pytest.approx(18.0, abs=1e-6)
    assert "only UTC or TAI or TT or GPS" in str(parse_omm(kvn({**FIELDS, "TIME_SYSTEM": "UT1"}), "x")[1][0])


@FORMS
def test_elements_said_to_be_of_the_true_equinox_are_read_with_a_note(write: Writer) -> None:
    [one], [note] = parse_omm(write({**FIELDS, "REF_FRAME": "TOD"}), "x")
    assert one.norad_id == 25544
    assert (note.kind, note.norad_ids) == ("note", (25544,))
    assert "REF_FRAME is 'TOD', read as TEME" in str(note)


@FORMS
def test_keys_in_small_letters_are_read(write: Writer) -> None:
    [one], [] = parse_omm(write({key.lower(): value for key, value in FIELDS.items()}), "x")
    assert one.norad_id == 25544


OTHER = {**FIELDS, "OBJECT_NAME": "OTHER", "NORAD_CAT_ID": "100001"}


@pytest.mark.parametrize(
    "text",
    [
        kvn(FIELDS) + "\n\n" + kvn(OTHER),
        kvn(FIELDS).replace("CCSDS_OMM_VERS = 2.0", "CCSDS_OMM_VERS = 3.0\nCOMMENT\nMETA_START") + kvn(OTHER),
        xml(FIELDS) + xml(OTHER),
        json_list(FIELDS) + json_list(OTHER),
        json_list(FIELDS)[1:-1] + "\n" + json_list(OTHER)[1:-1] + "\n",
        json.dumps({"data": json.loads(json_list(FIELDS, OTHER)), "count": 2}),
        json_list(FIELDS, OTHER),
        csv_list(FIELDS, OTHER).replace(",", ";"),
        csv_list(FIELDS, OTHER).replace(",", "\t"),
        csv_list(FIELDS, OTHER).replace("\r\n", ",\r\n"),
        csv_list(FIELDS, OTHER).replace("ISS (ZARYA)", '"ISS (ZARYA)"') + ",,\r\n\r\n",
    ],
)
def test_several_messages_in_one_file_are_all_read(text: str) -> None:
    sets, problems = parse_omm(text, "x")
    assert problems == []
    assert [(one.name, one.norad_id) for one in sets] == [("ISS (ZARYA)", 25544), ("OTHER", 100001)]


def test_a_json_that_nests_the_fields_as_xml_does_is_read() -> None:
    metadata = {key: FIELDS[key] for key in ("OBJECT_NAME", "OBJECT_ID")} | HEADER
    tle_parameters = {key: FIELDS[key] for key in ("NORAD_CAT_ID", "BSTAR", "EPHEMERIS_TYPE")}
    mean = {key: value for key, value in FIELDS.items() if key not in {**metadata, **tle_parameters}}
    nested = {"omm": {"header": {}, "body": {"segment": {"metadata": metadata, "data": {"meanElements": mean}}}}}
    nested["omm"]["body"]["segment"]["data"]["tleParameters"] = tle_parameters
    [one], [] = parse_omm(json.dumps(nested), "x")
    [same], [] = parse_omm(json_list(FIELDS), "x")
    assert np.max(np.abs(positions_m(one) - positions_m(same))) < 0.01


def test_of_a_list_that_was_cut_what_is_whole_is_read() -> None:
    sets, [problem] = parse_omm(json_list(FIELDS, OTHER, FIELDS)[:-60], "x.json")
    assert [one.norad_id for one in sets] == [25544, 100001]
    assert str(problem).startswith("x.json, line 1: not JSON: ")


def test_an_xml_message_without_segments_is_read() -> None:
    [one], [] = parse_omm(xml(FIELDS).replace("<segment>", "").replace("</segment>", ""), "x")
    assert one.norad_id == 25544


def test_a_record_that_cannot_be_read_says_whose_it_is() -> None:
    _, [problem] = parse_omm(json_list({**OTHER, "MEAN_MOTION": "fast"}), "x")
    assert (problem.name, problem.norad_ids, problem.kind) == ("OTHER", (100001,), "lost")


def test_a_message_as_a_library_writes_it_is_read() -> None:
    satrec = Satrec.twoline2rv(*TLE.splitlines())
    written = exporter.export_omm(satrec, "ISS (ZARYA)")
    for text in (json.dumps(written), kvn({key: str(value) for key, value in written.items()})):
        [one], [] = parse_omm(text, "x")
        [same], [] = parse_tle(TLE, "x")
        assert np.max(np.abs(positions_m(one) - positions_m(same))) < 1.0


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
