"""A pass that is on is given up only for one of a higher priority whose file says so; the antenna goes over at once."""

from pathlib import Path

import pytest
from config_files import BROUWER, write
from test_station import BEHIND, HIGH, START, Night
from test_station_stow import RISE

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.options import Target
from acu_daemon.cli.station_day import StationDay
from acu_daemon.cli.virtual_station import StationAccess, run_days
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.errors import UsageError
from acu_daemon.model import Pass
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.rules import PassRequest, Wish

ENDS = START + 312.0
RULES = "[schedule]\npriority = {priority}\nmin_useful_s = 30\nmay_interrupt = {may}\n"


def forced(directory: Path, *, may: bool) -> Night:
    """While the first satellite is tracked, a person has the one behind it tracked."""
    first, second = RULES.format(priority=8, may="false"), RULES.format(priority=9, may=str(may).lower())
    config, state = write(directory / "config", HIGH, scd=BROUWER + first, behind=BEHIND + second), directory / "state"
    state.mkdir()
    with ScheduleFile(state) as file:
        file.say(PassRequest("scd", RISE + 60.0, Wish.FORCE), START, "a person")

    def force(access: StationAccess) -> None:
        [entry] = [one for one in access.runs.day.keeper.book if one.satellite == "behind" and one.rise_tai_s < ENDS]
        with ScheduleFile(state) as file:
            file.say(PassRequest("scd", RISE + 60.0, Wish.NONE), RISE + 12.0, "a person")
            file.say(PassRequest("behind", entry.culmination_tai_s, Wish.FORCE), RISE + 12.0, "a person")

    days = run_days(config, state, START + 150.0, ENDS, script=[(RISE + 12.0, force)])
    with ScheduleFile(state, is_read_only=True) as file:
        return Night(days, file.book(START))


@pytest.mark.long
def test_one_that_may_interrupt_takes_the_antenna_over_without_a_stop_between(tmp_path: Path) -> None:
    found = forced(tmp_path, may=True)
    scd, behind = found.of("scd"), found.of("behind")
    assert scd.state in (PassState.DONE, PassState.DEGRADED)
    assert f"given up for {behind.name}" in scd.reason
    assert behind.state in (PassState.PASS, PassState.POSTPASS, PassState.DONE, PassState.DEGRADED)
    after = {row.mode for row in found.days.rows if RISE + 20.0 < row.tai_s < ENDS - 2.0}
    assert after <= {AcuMode.AUTOTRACK, AcuMode.REMOTE, AcuMode.ACQUIRE, AcuMode.REMOTE_BACKUP}
    assert found.days.rows[-1].beam_error_deg is not None
    assert found.days.named("stop.done")[-1:] != []


def test_where_the_one_that_interrupts_cannot_begin_the_antenna_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is told the ACU when a pass is given up for another: it would go on, and nobody look after it."""
    begin = StationDay.begin

    def refused(day: StationDay, entry: Entry) -> tuple[Target, Pass]:
        if entry.satellite == "behind":
            raise UsageError("a file is spoilt")
        return begin(day, entry)

    monkeypatch.setattr(StationDay, "begin", refused)
    found = forced(tmp_path, may=True)
    given_up = next(one for one in found.days.events if one["event"] == "pass.done")
    assert "given up for behind" in given_up["reason"]
    assert found.days.named("stop.done") != []
    assert found.days.rows[-1].mode is AcuMode.STANDBY
    assert found.days.named("foreign.stop") == []
    assert found.of("behind").state is PassState.PLANNED


@pytest.mark.long
def test_one_whose_file_says_nothing_of_it_waits_though_a_person_forces_it(tmp_path: Path) -> None:
    found = forced(tmp_path, may=False)
    assert found.of("scd").state is PassState.DONE  # cut short by the end of the test
    assert found.of("behind").state is PassState.PLANNED
