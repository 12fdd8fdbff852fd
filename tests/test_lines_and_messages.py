"""Lines of rotctld and messages of MQTT by value: each command, each form, each key, topic and flag."""

import json
from dataclasses import asdict, replace
from typing import Any

import pytest
from test_live_line import SEEN

from acu_daemon import __version__
from acu_daemon.outlets.mqtt_messages import BINARY_SENSORS, OFFLINE, ONLINE, SENSORS, Topics, discovery
from acu_daemon.outlets.rotctld_lines import (
    INVALID,
    IO_ERROR,
    NOT_IMPLEMENTED,
    OK,
    REJECTED,
    Command,
    RotctlVerb,
    dumped_state,
    reply_of,
    understood_line,
)

V = RotctlVerb
TOPICS = Topics("site/a dish/1", "The dish")


@pytest.mark.parametrize(
    ("letter", "verb", "name"),
    [
        *(
            ("p", V.GET_POSITION, "get_pos"),
            ("S", V.STOP, "stop"),
            ("K", V.PARK, "park"),
            ("_", V.GET_INFO, "get_info"),
        ),
        *(("1", V.DUMP_CAPS, "dump_caps"), ("s", V.STATUS, "get_status"), ("q", V.QUIT, "quit"), ("Q", V.QUIT, "quit")),
        *(("R", V.NOT_THERE, "reset"), ("M", V.NOT_THERE, "move"), ("C", V.NOT_THERE, "set_conf")),
        *(("U", V.NOT_THERE, "set_func"), ("u", V.NOT_THERE, "get_func"), ("V", V.NOT_THERE, "set_level")),
        *(("v", V.NOT_THERE, "get_level"), ("X", V.NOT_THERE, "set_parm"), ("x", V.NOT_THERE, "get_parm")),
        ("w", V.NOT_THERE, "send_cmd"),
    ],
)
@pytest.mark.parametrize(("first", "mark"), [("", ""), ("+", "\n"), (";", ";"), ("|", "|"), (",", ","), ("+ ", "\n")])
def test_a_command_is_a_letter_or_a_long_name_in_the_plain_or_the_extended_form(
    letter: str, verb: RotctlVerb, name: str, first: str, mark: str
) -> None:
    for said in (letter, f"\\{name}", f"{letter} 1 2 3"):
        assert understood_line(f"{first}{said}\r".encode()) == Command(verb, (), name, mark)


def test_a_state_is_dumped_by_its_long_name_alone() -> None:
    assert understood_line(b"\\dump_state") == Command(V.DUMP_STATE, (), "dump_state")
    assert understood_line(b"dump_state").verb is V.WRONG


@pytest.mark.parametrize(
    ("line", "command"),
    [
        (b"P 1 2", Command(V.SET_POSITION, (1.0, 2.0), "set_pos")),
        (b"+P1 2", Command(V.SET_POSITION, (1.0, 2.0), "set_pos", "\n")),
        (b"P-1.5 2", Command(V.SET_POSITION, (-1.5, 2.0), "set_pos")),
        (b"P 0 0", Command(V.SET_POSITION, (0.0, 0.0), "set_pos")),
        (b"+P 1", Command(V.WRONG, (), "set_pos", "\n")),
        (b"P 1 2 3", Command(V.WRONG, (), "set_pos")),
        (b";hello", Command(V.WRONG, mark=";")),
        (b"+ ", Command(V.WRONG)),
        (b"+", Command(V.WRONG)),
        (b"R1", Command(V.NOT_THERE, (), "reset")),
        (b"p1", Command(V.WRONG)),
        (b"K1", Command(V.WRONG)),
        (b"\\", Command(V.WRONG)),
        (b"\t\x00 \r", Command(V.NOTHING)),
        (b"AZ10 EL20", Command(V.EASYCOMM_SET, (10.0, 20.0))),
        (b"EL20 AZ10", Command(V.EASYCOMM_SET, (10.0, 20.0))),
        (b"az10.5 el-1 UP1 DN2", Command(V.EASYCOMM_SET, (10.5, -1.0))),
        (b"AZ EL", Command(V.EASYCOMM_GET)),
        (b"AZ", Command(V.EASYCOMM_GET)),
        (b"EL UP1", Command(V.EASYCOMM_GET)),
        (b"AZ10 EL", Command(V.WRONG, name="easycomm")),
        (b"EL10", Command(V.WRONG, name="easycomm")),
        (b"sa", Command(V.EASYCOMM_STOP)),
        (b"SE", Command(V.EASYCOMM_STOP)),
        (b"SA SE", Command(V.EASYCOMM_STOP)),
        (b"SAB", Command(V.WRONG)),
    ],
)
def test_a_line_is_what_it_says(line: bytes, command: Command) -> None:
    assert understood_line(line) == command


@pytest.mark.parametrize(
    ("command", "code", "values", "said"),
    [
        (Command(V.GET_POSITION, (), "get_pos"), 0, (("Azimuth", "1.0"), ("Elevation", "2.0")), b"1.0\n2.0\n"),
        (Command(V.GET_POSITION, (), "get_pos"), -6, (("Azimuth", "1.0"),), b"RPRT -6\n"),
        (Command(V.STOP, (), "stop"), 0, (), b"RPRT 0\n"),
        (Command(V.STOP, (), "stop", "|"), -9, (), b"stop:|RPRT -9\n"),
        (Command(V.GET_POSITION, (), "get_pos", "\n"), 0, (("Azimuth", "1.0"),), b"get_pos:\nAzimuth: 1.0\nRPRT 0\n"),
    ],
)
def test_an_answer_is_values_or_a_number_and_both_in_the_extended_form(
    command: Command, code: int, values: tuple[tuple[str, str], ...], said: bytes
) -> None:
    assert reply_of(command, code, values) == said


def test_errors_have_hamlibs_numbers() -> None:
    assert (OK, INVALID, NOT_IMPLEMENTED, IO_ERROR, REJECTED) == (0, -1, -4, -6, -9)


def test_a_dumped_state_has_each_limit_in_its_place() -> None:
    assert dumped_state((-270.5, 271.0), (-1.0, 92.0)) == (
        b"1\n2\nmin_az=-270.500000\nmax_az=271.000000\nmin_el=-1.000000\nmax_el=92.000000\n"
        b"south_zero=0\nrot_type=AzEl\ndone\n"
    )


# MQTT


def test_each_kind_of_message_has_its_topic_and_only_lasting_news_is_kept_by_the_broker() -> None:
    state, event = TOPICS.state(SEEN), TOPICS.event({"event": "e", "text": "ü"})
    passes = TOPICS.schedule(({"a": 1}, {"b": None}))
    assert [(one.topic, one.is_retained) for one in (state, event, passes)] == [
        ("site/a dish/1/state", True),
        ("site/a dish/1/event", False),
        ("site/a dish/1/schedule", True),
    ]
    assert TOPICS.availability == "site/a dish/1/availability"
    assert (ONLINE, OFFLINE) == (b"online", b"offline")
    assert json.loads(state.payload) == json.loads(json.dumps(asdict(SEEN))) | {"alarms": []}
    assert json.loads(event.payload) == {"event": "e", "text": "ü"}
    assert passes.payload == b'[{"a":1},{"b":null}]'


def test_the_state_has_each_alarm_of_the_snapshot() -> None:
    told = json.loads(TOPICS.state(replace(SEEN, line_alarm="bad line", clock_alarm="bad clock")).payload)
    assert sorted(told["alarms"]) == ["bad clock", "bad line"]


def test_a_sensor_is_told_with_its_name_its_value_and_its_device() -> None:
    made = {message.topic: message for message in discovery(TOPICS, "ha")}
    assert all(message.is_retained for message in made.values())
    device = {
        "identifiers": ["site_a_dish_1"],
        "name": "The dish",
        "manufacturer": "acu-daemon",
        "sw_version": __version__,
    }
    common = {
        "state_topic": "site/a dish/1/state",
        "availability_topic": "site/a dish/1/availability",
        "expire_after": 30,
        "device": device,
    }
    told: Any = json.loads(made["ha/sensor/site_a_dish_1/inside_s/config"].payload)
    assert told == common | {
        "name": "Prediction good for",
        "value_template": "{{ value_json.inside_s if value_json.inside_s not in (none, '') else none }}",
        "unit_of_measurement": "s",
        "device_class": "duration",
        "unique_id": "site_a_dish_1_inside_s",
        "object_id": "site_a_dish_1_inside_s",
    }
    told = json.loads(made["ha/binary_sensor/site_a_dish_1/latch/config"].payload)
    assert told == common | {
        "name": "Axis latched",
        "value_template": "{{ 'ON' if value_json.latch != '' else 'OFF' }}",
        "device_class": "problem",
        "unique_id": "site_a_dish_1_latch",
        "object_id": "site_a_dish_1_latch",
    }


def test_every_sensor_has_the_unit_of_its_key() -> None:
    units = {"_deg": "°", "_db": "dB", "_s": "s"}
    for key, _, more in SENSORS:
        unit = next((unit for end, unit in units.items() if key.endswith(end)), None)
        assert more.get("unit_of_measurement") == unit, key
        assert (more.get("device_class") == "timestamp") == key.endswith("_utc"), key
    digits = {key: more["suggested_display_precision"] for key, _, more in SENSORS if key.endswith("_deg")}
    assert digits == {"az_deg": 2, "el_deg": 2, "off_path_deg": 3}
    names = {key: name for key, name, _ in SENSORS} | {key: name for key, name, *_ in BINARY_SENSORS}
    assert names == {
        "verdict": "Verdict",
        "state": "State",
        "satellite": "Satellite",
        "az_deg": "Azimuth",
        "el_deg": "Elevation",
        "off_path_deg": "Off the path",
        "agc_db": "AGC",
        "signal_db": "Signal",
        "inside_s": "Prediction good for",
        "rise_utc": "Rise",
        "set_utc": "Set",
        "is_link_up": "Link",
        "is_acquired": "Signal acquired",
        "latch": "Axis latched",
        "alarms": "Alarm",
    }
