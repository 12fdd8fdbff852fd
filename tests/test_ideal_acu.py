"""control.ideal_acu: an ACU that does at once what it is told, in REMOTE alone, and turns the nearest way."""

from dataclasses import replace
from typing import Any

import pytest
from test_tick import CONFIG

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import (
    AcuMode,
    Backup,
    FreeTurnChoice,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadCommanded,
    ReadFaults,
    ReadTurnChoice,
    ReadWatchdog,
    SelectBackup,
    SelectMode,
    SetWatchdog,
    Stop,
    Stow,
)
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Commanded, Done, FaultReport, Refused, Reply, TurnChoice
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.ideal_acu import IdealAcu
from acu_daemon.pointing.axis import AxisState, step

DT_S = 0.1


def acu(
    az_deg: float = 100.0, el_deg: float = 40.0, mode: AcuMode = AcuMode.REMOTE, config: ControlConfig = CONFIG
) -> IdealAcu:
    made = IdealAcu(az_deg, el_deg, config)
    if mode is not AcuMode.STANDBY:
        made.answer(SelectMode(mode))
    return made


@pytest.mark.parametrize("az_deg", [100.0, -100.0, 260.0, 0.0, -270.0])
@pytest.mark.parametrize("is_continuous", [False, True])
@pytest.mark.parametrize("has_bit", [False, True])
@pytest.mark.parametrize("tilt_deg", [None, 7.0])
def test_it_stands_at_first_and_shows_a_bearing_its_half_its_turns_and_its_tilt_as_its_kind_can(
    az_deg: float, is_continuous: bool, has_bit: bool, tilt_deg: float | None
) -> None:
    can = Capabilities(has_sector_bit=has_bit, is_azimuth_continuous=is_continuous)
    made = IdealAcu(az_deg, 40.0, replace(CONFIG, acu=can, tilt_deg=tilt_deg))
    shown = AcuStatus(
        az_deg % 360.0,
        40.0,
        AcuMode.STANDBY,
        is_sector_high=has_bit and az_deg >= 0.0,
        tilt_deg=tilt_deg,
        turns_deg=az_deg if is_continuous else None,
    )
    assert made.status == made.answer(Poll()) == shown
    assert made.answer(ReadCommanded()) == Commanded(az_deg, 40.0)


@pytest.mark.parametrize("middle_deg", [90.0, -45.0])
def test_the_half_is_divided_at_the_middle_of_the_range(middle_deg: float) -> None:
    axis = replace(CONFIG.azimuth, min_deg=middle_deg - 225.0, max_deg=middle_deg + 225.0)
    config = replace(CONFIG, envelope=replace(CONFIG.envelope, azimuth=axis))
    for off_deg, is_high in ((-0.1, False), (0.0, True), (0.1, True)):
        assert acu(middle_deg + off_deg, config=config).status.is_sector_high is is_high


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        (Identify(), AcuIdentity("ideal", is_known=True, is_simulated=True)),
        (ReadTurnChoice(), TurnChoice(is_nearest=True)),
        (ReadFaults(), FaultReport()),
        (FreeTurnChoice(), Done()),
        (PointAt(101.0, 41.0), Done()),
        (SelectMode(AcuMode.REMOTE), Done()),
        (SelectBackup(Backup.REMOTE), Done()),
        *((one, Refused()) for one in (Stop(), Stow(), ReadWatchdog(), SetWatchdog(1.0))),
    ],
)
def test_it_answers_what_a_start_asks_and_refuses_the_rest(command: Any, reply: Reply) -> None:
    assert acu().answer(command) == reply


def test_it_shows_the_mode_and_the_backup_that_were_selected() -> None:
    made = acu(mode=AcuMode.STANDBY)
    made.answer(SelectBackup(Backup.POSITION))
    made.answer(SelectMode(AcuMode.AUTOTRACK))
    assert (made.status.mode, made.status.backup_selected) == (AcuMode.AUTOTRACK, Backup.POSITION)


@pytest.mark.parametrize("is_polled", [False, True])
def test_registers_are_followed_in_remote_alone_with_the_rate_of_their_writes_as_the_drives_can(
    is_polled: bool,
) -> None:
    for mode in AcuMode:
        made, az, el = acu(mode=mode), AxisState(100.0), AxisState(40.0)
        before = (100.0, 40.0)
        for goal in ((100.05, 39.98), (100.1, 39.96), (101.0, 39.5), (103.0, 38.0), (103.25, 38.0), (140.0, 10.0)):
            answer = made.answer(PointAndPoll(*goal) if is_polled else PointAt(*goal))
            assert answer == (made.status if is_polled else Done())
            held = made.answer(ReadCommanded())
            assert isinstance(held, Commanded)
            assert (held.az_deg, held.el_deg) == pytest.approx(goal)
            made.move(DT_S)
            if mode is AcuMode.REMOTE:
                az = step(az, goal[0], (goal[0] - before[0]) / DT_S, DT_S, CONFIG.azimuth)
                el = step(el, goal[1], (goal[1] - before[1]) / DT_S, DT_S, CONFIG.elevation)
            before = goal
            for found, expected in ((made.az, az), (made.el, el)):
                assert found.position_deg == pytest.approx(expected.position_deg)
                assert found.rate_deg_s == pytest.approx(expected.rate_deg_s, abs=1e-9)
            assert (made.status.az_deg, made.status.el_deg) == (made.az.position_deg, made.el.position_deg)


def test_a_register_that_stays_asks_for_no_rate_also_where_it_was_written_in_another_mode() -> None:
    made = acu(mode=AcuMode.STANDBY)
    made.answer(PointAt(100.5, 40.0))
    made.move(DT_S)
    made.answer(SelectMode(AcuMode.REMOTE))
    made.move(DT_S)
    assert made.az == step(AxisState(100.0), 100.5, 0.0, DT_S, CONFIG.azimuth)


@pytest.mark.parametrize(
    ("from_deg", "bearing_deg", "to_deg"),
    [(100.0, 200.0, 200.0), (-100.0, 200.0, -160.0), (200.0, 350.0, -10.0), (10.0, 350.0, -10.0), (-10.0, 10.0, 10.0)],
)
def test_of_a_bearing_on_several_turns_it_takes_the_nearest_that_it_reaches(
    from_deg: float, bearing_deg: float, to_deg: float
) -> None:
    made = acu(from_deg)
    made.answer(PointAt(bearing_deg, 40.0))
    assert made.answer(ReadCommanded()) == Commanded(to_deg, 40.0)


def test_a_bearing_that_no_turn_reaches_is_taken_as_it_was_said() -> None:
    axis = replace(CONFIG.azimuth, min_deg=0.0, max_deg=90.0)
    narrow = replace(CONFIG, envelope=replace(CONFIG.envelope, azimuth=axis))
    made = acu(10.0, config=narrow)
    made.answer(PointAt(200.0, 40.0))
    assert made.answer(ReadCommanded()) == Commanded(200.0, 40.0)
