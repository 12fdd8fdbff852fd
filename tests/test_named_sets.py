"""Of a long list only the sets of the satellite that is asked for are read: the same as the whole reading gives."""

import csv
import io
import json
from dataclasses import replace

import pytest
from made_oems import ISS

from acu_daemon.edge.elements_store import record_of
from acu_daemon.orbit.contents import kind_of
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.named_sets import LONG, named_sets
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.tle import parse_tle

[PLAIN], _ = parse_tle(ISS, "iss.tle")
COUNT = 600


def sealed(line: str) -> str:
    return line[:68] + str(sum(int(c) if c.isdigit() else c == "-" for c in line[:68]) % 10)


def tle(number: str, name: str = "") -> str:
    one, two = ISS.splitlines()
    return "\n".join([*([name] if name else []), sealed(f"1 {number}{one[7:]}"), sealed(f"2 {number}{two[7:]}"), ""])


TLE_SETS = [tle(f"{i + 100:05}", f"NUMBER {i}") for i in range(COUNT)]
TLES = "".join(TLE_SETS)
SETS = [replace(PLAIN, norad_id=i + 100, name=f"NUMBER {i}") for i in range(COUNT)]


def as_json(sets: list[ElementSet]) -> str:
    return json.dumps([record_of(one, "x") for one in sets])


def as_csv(sets: list[ElementSet]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(record_of(sets[0], "x"))[1:], extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(record_of(one, "x") for one in sets)
    return text.getvalue()


@pytest.mark.parametrize("name", ["", "THE ONE", "1 25544 IS ITS NAME", "2 PATHFINDER", "0 THE ONE"])
@pytest.mark.parametrize("number", ["25544", "    5", "A0001", "Z9999", "a0001"])
def test_a_set_of_a_long_list_of_lines_is_read_as_the_whole_list_has_it(number: str, name: str) -> None:
    text = "".join([*TLE_SETS[:300], tle(number, name), *TLE_SETS[300:], tle(number, name)])
    whole, _ = parse_tle(text, "f")
    wanted = [one for one in whole if one.norad_id not in range(100, 100 + COUNT)]
    found, problems = named_sets("tle", text, "f", wanted[0].norad_id)
    assert found in ([], wanted)  # nothing: then the whole list is read
    assert problems == []
    if "25544" not in name:
        assert found == wanted


@pytest.mark.parametrize("number", [25544, 100001, 339999, 799500124])
@pytest.mark.parametrize("write", [as_json, as_csv])
def test_a_set_of_a_long_list_of_messages_is_read_as_the_whole_list_has_it(write: object, number: int) -> None:
    mine = replace(PLAIN, norad_id=number, name="MINE")
    text = write([*SETS[:300], mine, *SETS[300:]])  # type: ignore[operator]
    assert kind_of(text) == "omm"
    whole, _ = parse_omm(text, "f")
    found, problems = named_sets("omm", text, "f", number)
    assert found == [one for one in whole if one.norad_id == number]
    assert len(found) == 1
    assert problems == []


def test_what_cannot_be_read_so_is_left_to_the_whole_reading() -> None:
    damaged = TLES + tle("25544").replace("51.6412", "51.6413")
    assert len(damaged) > LONG
    assert named_sets("tle", damaged, "f", 25544) == ([], [])
    assert named_sets("tle", TLES + tle("25544"), "f", 799500124) == ([], [])
    nested = as_json(SETS).replace('"NORAD_CAT_ID": 107', '"tle": {"NORAD_CAT_ID": 107}')
    assert named_sets("omm", nested, "f", 107) == ([], [])
    assert named_sets("omm", as_json(SETS)[:-5000] + '{"NORAD_CAT_ID": 25544, ', "f", 25544) == ([], [])
    assert named_sets("tle", tle("25544"), "f", 25544) == ([], [])  # short: read whole, with what is wrong in it
