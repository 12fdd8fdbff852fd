"""The log: JSON lines for a service, readable lines for a person; the daemon's own clock on each."""

import json
from collections.abc import Iterator
from typing import Any

import pytest
import structlog
from flights import RISING_TAI_S, climb

from acu_daemon.edge.logs import configure_logs
from acu_daemon.orbit.timescales import tai_from_utc

NOW = tai_from_utc("2016-12-31T23:59:60.250Z")


@pytest.fixture(autouse=True)
def _own_configuration() -> Iterator[None]:
    before = structlog.get_config()
    yield
    structlog.configure(**before)


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


def configure(*, is_terminal: bool, **changes: Any) -> Any:
    configure_logs(lambda: NOW, is_terminal=is_terminal, **{"tags": {}, **changes})
    return structlog.get_logger("test")


def test_for_a_service_every_line_is_one_json_object_with_the_daemons_utc(capsys: pytest.CaptureFixture[str]) -> None:
    log = configure(is_terminal=False)
    log.warning("link.lost", reason='no "reply"\nfor 0.5 s', silence_s=0.5)
    [line] = lines(capsys)
    assert json.loads(line) == {
        "utc": "2016-12-31T23:59:60.250Z",
        "event": "link.lost",
        "level": "warning",
        "reason": 'no "reply"\nfor 0.5 s',
        "silence_s": 0.5,
    }


def test_simulation_and_rehearsal_stand_on_every_line(capsys: pytest.CaptureFixture[str]) -> None:
    log = configure(is_terminal=False, tags={"SIMULATION": True, "REHEARSAL": True})
    log.info("one")
    log.info("two")
    assert all(json.loads(line)["SIMULATION"] and json.loads(line)["REHEARSAL"] for line in lines(capsys))


def test_on_a_terminal_a_line_is_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    log = configure(is_terminal=True, tags={"REHEARSAL": True})
    log.warning("fit.failed", reason="died", age_s=1.23456)
    [line] = lines(capsys)
    assert line.startswith("23:59:60.2 !  fit.failed")
    assert "reason=died  age_s=1.235" in line
    assert line.endswith("REHEARSAL")


def test_a_name_gives_a_terminal_no_orders_and_makes_no_second_line(capsys: pytest.CaptureFixture[str]) -> None:
    configure(is_terminal=True).info("run.start", satellite="NOAA\x1b[2J\n00:00:00.0 !! stop.done")
    (line,) = lines(capsys)
    assert "satellite=NOAA\\x1b[2J\\n00:00:00.0 !! stop.done" in line


def test_the_live_line_is_cleared_before_each_line(capsys: pytest.CaptureFixture[str]) -> None:
    cleared: list[int] = []
    log = configure(is_terminal=True, before_line=lambda: cleared.append(1))
    log.info("one")
    log.info("two")
    assert len(cleared) == 2
    assert len(lines(capsys)) == 2


def test_what_json_does_not_know_is_written_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    configure(is_terminal=False).info("acu.faults", faults=("azimuth jam",), where={1})
    assert json.loads(lines(capsys)[0])["where"] == "{1}"


@pytest.mark.long
def test_a_calm_pass_logs_changes_not_ticks() -> None:
    flight = climb(30.0, losses=[(12.0, 20.0)])
    assert len(flight.events) < 25
    late = [seen for seen in flight.snapshots if seen.tai_s > RISING_TAI_S + 22.0]
    assert len(late) > 70
