"""For which pass one in progress is given up: each condition, a step on either side."""

from dataclasses import replace
from pathlib import Path

import pytest
from config_files import BROUWER, write

from acu_daemon.cli.schedule_keeper import ScheduleKeeper
from acu_daemon.config.load import load_station
from acu_daemon.daemon.tally import Tally
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.schedule.book import Entry, PassState

STEP_S = 0.01
RUNNING = Entry(
    "A", 1000.0, 1300.0, 1600.0, 40.0, 5, PassState.PASS, "", start_tai_s=1000.0, end_tai_s=1600.0, number=1
)
COMING = Entry(
    "B", 1200.0, 1500.0, 1800.0, 40.0, 6, PassState.PLANNED, "", start_tai_s=1210.0, end_tai_s=1800.0, number=2
)
LEAD_S = 30.0


class Standing:
    """A clock in mid-pass."""

    def tai_s(self) -> float:
        return 1100.0


async def beside(*_: object) -> object:
    raise AssertionError("nothing is planned here")


@pytest.fixture
def keeper(tmp_path: Path) -> ScheduleKeeper:
    config, state = write(tmp_path / "config", scd=BROUWER), tmp_path / "state"
    state.mkdir()
    made = ScheduleKeeper(config, Standing(), ScheduleFile(state), load_station(config), beside, Tally())
    made.book, made._interrupters = (RUNNING, COMING), frozenset({"B"})
    return made


@pytest.mark.parametrize(("priority", "interrupts"), [(4, False), (5, False), (6, True)])
def test_one_of_a_higher_priority_alone_interrupts(keeper: ScheduleKeeper, priority: int, interrupts: bool) -> None:
    keeper.book = (RUNNING, coming := replace(COMING, priority=priority))
    assert keeper.interrupter(RUNNING, 1200.0, LEAD_S) == (coming if interrupts else None)


def test_one_whose_file_says_nothing_of_it_does_not(keeper: ScheduleKeeper) -> None:
    keeper._interrupters = frozenset({"A"})
    assert keeper.interrupter(RUNNING, 1200.0, LEAD_S) is None


@pytest.mark.parametrize(("now_tai_s", "is_due"), [(1180.0 - STEP_S, False), (1180.0, True), (1300.0, True)])
def test_it_does_so_from_its_lead_before_its_reservation(
    keeper: ScheduleKeeper, now_tai_s: float, is_due: bool
) -> None:
    assert keeper.interrupter(RUNNING, now_tai_s, LEAD_S) == (COMING if is_due else None)


@pytest.mark.parametrize(("set_tai_s", "is_due"), [(1210.0, False), (1210.0 + STEP_S, True)])
def test_one_that_begins_after_the_set_waits_for_it(keeper: ScheduleKeeper, set_tai_s: float, is_due: bool) -> None:
    assert keeper.interrupter(replace(RUNNING, set_tai_s=set_tai_s), 1205.0, LEAD_S) == (COMING if is_due else None)


def test_one_that_was_not_granted_does_not(keeper: ScheduleKeeper) -> None:
    keeper.book = (RUNNING, replace(COMING, state=PassState.REFUSED, start_tai_s=None))
    assert keeper.interrupter(RUNNING, 1200.0, LEAD_S) is None
