"""The files of Earth orientation and leap seconds as commands use them: found, old, damaged, gone."""

import pickle
import struct
import subprocess
import sys
from datetime import date
from pathlib import Path

import pytest
from command_line import acu_daemon
from config_files import BROUWER, STATION, write
from test_earth_orientation import C04_20, FINALS
from test_leap_seconds import a_list

from acu_daemon.cli.options import load_target
from acu_daemon.config.load import load_station
from acu_daemon.edge.earth_orientation_file import at_date
from acu_daemon.edge.leap_seconds_file import adopt_system_leap_seconds, find_leap_seconds, leap_seconds_told
from acu_daemon.errors import UsageError
from acu_daemon.orbit.earth_orientation import parse_earth_orientation
from acu_daemon.orbit.timescales import LEAP_DATES, adopt_leap_dates, leap_dates, tai_from_utc
from acu_daemon.units import DAY_S

NAMED = STATION + '\n[time]\nearth_orientation = "eop"\n'
INSIDE_TAI_S = tai_from_utc("2016-12-31T06:00:00Z")
NEWER = (*LEAP_DATES, date(2029, 7, 1))


@pytest.mark.parametrize("text", [FINALS, C04_20])
def test_the_station_has_the_orientation_of_the_date_out_of_its_file(text: str, tmp_path: Path) -> None:
    (tmp_path / "eop").write_text(text)
    table = parse_earth_orientation(text, "eop")
    tai_s = float(table.tai_s[0]) + 0.25 * DAY_S
    station, used = at_date(load_station(write(tmp_path, NAMED)), tmp_path, tai_s)
    assert station.site.orientation == table.at(tai_s)
    assert station.site.orientation.ut1_utc_s != 0.0
    assert station.time.earth_orientation is None
    assert "Earth orientation measured to" in used.about
    assert used.warning == ""


def test_typed_numbers_stay_what_they_are(tmp_path: Path) -> None:
    given = load_station(write(tmp_path, STATION + "\n[time]\nut1_utc_s = 0.25\n"))
    station, used = at_date(given, tmp_path, 0.0)
    assert station == given
    assert used.orientation.ut1_utc_s == 0.25
    assert used.about == used.warning == ""


def test_what_a_command_loads_has_it_and_says_when_the_file_has_ended(tmp_path: Path) -> None:
    (tmp_path / "eop").write_text(FINALS)
    write(tmp_path, NAMED, scd=BROUWER)
    inside = load_target(tmp_path, "scd", INSIDE_TAI_S, is_strict=False)
    assert inside.station.site.orientation.ut1_utc_s == pytest.approx(-0.4079, abs=2e-3)
    assert not [text for text in inside.elements.warnings if "Earth" in text]
    later = load_target(tmp_path, "scd", INSIDE_TAI_S + 100 * DAY_S, is_strict=False)
    assert [text for text in later.elements.warnings if "Earth orientation ends on" in text]
    assert later.earth.about


@pytest.mark.parametrize("text", [None, "", "<html>not found</html>\n", FINALS[:63]])
def test_a_file_that_is_gone_or_damaged_costs_a_warning_and_no_pass(text: str | None, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / "eop").write_text(text)
    write(tmp_path, NAMED, scd=BROUWER)
    target = load_target(tmp_path, "scd", INSIDE_TAI_S, is_strict=False)
    assert target.station.site.orientation.ut1_utc_s == 0.0
    assert any("are taken as 0" in warning and "eop" in warning for warning in target.elements.warnings)
    told = [line for line in acu_daemon("check", "--config", tmp_path).out.splitlines() if "Earth orientation" in line]
    assert told[0].startswith("WARN   Earth orientation")


def test_a_file_that_everybody_may_write_is_refused(tmp_path: Path) -> None:
    (tmp_path / "eop").write_text(FINALS)
    (tmp_path / "eop").chmod(0o666)
    with pytest.raises(UsageError, match="everybody may write"):
        at_date(load_station(write(tmp_path, NAMED)), tmp_path, INSIDE_TAI_S)


@pytest.fixture
def built_in_after():  # type: ignore[no-untyped-def]
    yield
    adopt_leap_dates(LEAP_DATES)


@pytest.mark.usefixtures("built_in_after")
def test_of_the_systems_lists_the_newest_is_adopted_and_damaged_ones_are_told(tmp_path: Path) -> None:
    old, new, damaged = tmp_path / "old", tmp_path / "new", tmp_path / "damaged"
    old.write_text(a_list())
    new.write_text(a_list(NEWER))
    damaged.write_text("not found\n")
    paths = [tmp_path / "gone", damaged, old, new]
    found, wrong = find_leap_seconds(paths)
    assert found is not None
    assert found.path == new
    assert len(wrong) == 1
    assert "damaged" in wrong[0]
    adopt_system_leap_seconds([old])
    assert leap_dates() == LEAP_DATES
    adopt_system_leap_seconds(paths)
    assert leap_dates() == NEWER


def test_what_is_known_of_leap_seconds_is_told_with_the_expiry(tmp_path: Path) -> None:
    path = tmp_path / "list"
    path.write_text(a_list())
    found, _ = find_leap_seconds([path])
    assert found is not None
    expires_tai_s = found.list.expires_tai_s
    assert expires_tai_s is not None
    told, is_to_be_seen_to = leap_seconds_told(expires_tai_s - DAY_S, [path])
    assert "holds until" in told
    assert (is_to_be_seen_to, "expired" in told) == (False, False)
    for days, late in ((30.0, False), (400.0, True)):
        told, is_to_be_seen_to = leap_seconds_told(expires_tai_s + days * DAY_S, [path])
        assert f"{days:.0f} days ago" in told
        assert is_to_be_seen_to == late
    assert leap_seconds_told(0.0, [tmp_path / "gone"]) == (
        "built-in table, to 2017-01-01; this system has no leap-seconds.list",
        False,
    )


def test_the_fit_process_takes_the_leap_seconds_of_the_daemon() -> None:
    code = (
        "import io, pickle, struct, sys\n"
        "from datetime import date\n"
        "import acu_daemon.edge.fit_child as child, acu_daemon.assist.session.refit as refit\n"
        "from acu_daemon.orbit.timescales import leap_dates\n"
        "refit.Refitter = lambda setup: print(setup, len(leap_dates()), leap_dates()[-1], file=sys.stderr)\n"
        "child.serve()"
    )
    data = pickle.dumps((NEWER, "the setup"))
    done = subprocess.run(
        [sys.executable, "-c", code], input=struct.pack("<Q", len(data)) + data, capture_output=True, check=False
    )
    assert f"the setup {len(NEWER)} 2029-07-01" in done.stderr.decode()
